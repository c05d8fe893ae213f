"""How programs are compiled on the CPU."""

import math
import os
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.errors import JaxRuntimeError
from jax.experimental.xla_metadata import set_xla_metadata

_SMALL_LOOPS = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=100000000"


def cpu_compiler_options() -> dict[str, Any] | None:
    """Options for programs of our own on a CPU; other devices take none.

    XLA's older emitters of fused kernels: the newer ones take 1.6 times as long to compile these loops and run them no
    faster. And LLVM's first level of optimisation: a quarter less compile time, the code as fast.
    """
    if jax.default_backend() != "cpu":
        return None
    return {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}


class Packing(NamedTuple):
    """How a PyTree of numbers lies in one vector; hashable, as it shapes a program."""

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[str, ...]  # of numbers: whole ones (indices in a law of one's own) come back as such

    @property
    def size(self) -> int:
        return sum(math.prod(shape) for shape in self.shapes)

    def unpack(self, numbers: Any) -> Any:
        ends = np.cumsum([0, *(math.prod(shape) for shape in self.shapes)])
        parts = zip(ends[:-1], ends[1:], self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(self.structure, [numbers[a:b].reshape(s).astype(kind) for a, b, s, kind in parts])


def pack(tree: Any) -> tuple[np.ndarray, Packing]:
    """All numbers of a tree in one vector, and how they lie in it."""
    leaves, structure = jax.tree.flatten(tree)
    arrays = [np.asarray(leaf) for leaf in leaves]
    kinds = tuple("float64" if np.issubdtype(x.dtype, np.floating) else str(x.dtype) for x in arrays)
    shapes = tuple(x.shape for x in arrays)
    return np.concatenate([np.ravel(x).astype(np.float64) for x in arrays]), Packing(structure, shapes, kinds)


class Program(NamedTuple):
    """A compiled function of one vector."""

    call: Callable[[Any], Any]
    trace_seconds: float
    compile_seconds: float
    one_function: bool  # loops and all; otherwise a hundred small kernels in every turn of a loop


def compiled(
    function: Callable[[Any], Any],
    numbers: np.ndarray,
    *,
    longest: int = 40_000,
    otherwise: Callable[[Any], Any] | None = None,
) -> Program:
    """`function` of a vector like `numbers`, compiled ahead; on a CPU as one function where XLA can do that.

    XLA then neither starts kernels one by one nor hands them to a pool of threads. It wants every argument to be used,
    hence one vector, and knows not all operations there; what it refuses is compiled the ordinary way (`otherwise`, if
    another way to compute the same is better then). So is a program `longest` lines and more: one function takes the
    same time to compile up to some 7,000 lines, twice the time for 15,000 and three times for 30,000.
    """
    start, options = time.perf_counter(), cpu_compiler_options()
    inner = jax.jit(function)

    def whole(numbers: Any) -> Any:
        # a mark on the call that this result comes from
        return set_xla_metadata(inner(numbers), xla_cpu_small_call="true", inlineable="false")

    if options is not None:
        # (nor can matrix products that XLA hands to a library of its own)
        marked = jax.jit(whole, compiler_options=options | {"xla_cpu_experimental_ynn_fusion_type": ""}).lower(numbers)
        text = marked.as_text()
        if "custom_call" not in text and text.count("\n") < longest:  # calls of libraries cannot be part of it
            try:
                return _timed(marked, start, True)
            except JaxRuntimeError:
                pass  # another operation of that kind; what is wrong with the function itself shows again below
    return _timed(jax.jit(otherwise or inner, compiler_options=options).lower(numbers), start, False)


def _timed(lowered: Any, start: float, one_function: bool) -> Program:
    traced = time.perf_counter()
    call = lowered.compile()
    return Program(call, traced - start, time.perf_counter() - traced, one_function)


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
