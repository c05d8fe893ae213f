"""Options for compiling on the CPU."""

import jax


def cpu_compiler_options() -> dict[str, bool] | None:
    """Options for programs of our own: on a CPU, XLA's older emitters of fused kernels.

    The newer ones take 1.6 times as long to compile these loops and run them no faster. Other devices take none.
    """
    return {"xla_cpu_use_fusion_emitters": False} if jax.default_backend() == "cpu" else None
