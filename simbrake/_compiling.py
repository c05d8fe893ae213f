"""How programs are compiled on the CPU."""

import os

import jax

_SMALL_LOOPS = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=100000000"


def cpu_compiler_options() -> dict[str, bool] | None:
    """Options for programs of our own: on a CPU, XLA's older emitters of fused kernels.

    The newer ones take 1.6 times as long to compile these loops and run them no faster. Other devices take none.
    """
    return {"xla_cpu_use_fusion_emitters": False} if jax.default_backend() == "cpu" else None


def fast_loops() -> None:
    """Lets XLA compile the whole integration loop into one function: warm runs on a CPU become several times faster.

    Sets `XLA_FLAGS` for the whole process, so that it is never done unasked, and JAX's dispatch on the CPU to
    synchronous. Call it before the first computation of the process.

    Raises `RuntimeError` if JAX has already started its backend, which reads the flags only once.
    """
    from jax._src import xla_bridge  # no public way to ask

    if xla_bridge.backends_are_initialized():
        raise RuntimeError("fast_loops() must be called before the first computation with JAX in this process")
    flags = os.environ.get("XLA_FLAGS", "")
    if _SMALL_LOOPS not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {_SMALL_LOOPS}".strip()
    jax.config.update("jax_cpu_enable_async_dispatch", False)
