"""How and where programs are compiled: the device, XLA options that help, and a whole run as one function.

Options and marks of XLA are accelerators, never conditions: each is tried once per process on a tiny program and left
out where the installed XLA refuses it. Nothing is set for the process, neither `XLA_FLAGS` nor JAX's configuration."""

import functools
import math
import time
import warnings
from collections.abc import Callable, Hashable
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.errors import JaxRuntimeError
from jaxtyping import PyTree

from ..hybrid._arrays import Array

_Answer = TypeVar("_Answer")
#: of the compiler, by name
Options: TypeAlias = dict[str, bool | int | str]

#: options for programs on a CPU. XLA's older emitters of fused kernels: the newer ones take 1.6 times as long to
#: compile these loops and run them no faster. LLVM's first level of optimisation: a quarter less compile time, the
#: code as fast.
_CPU_OPTIONS: Options = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}
#: only for a run as one function: matrix products that XLA would hand to a library cannot be part of it
_ONE_FUNCTION_OPTIONS: Options = {"xla_cpu_experimental_ynn_fusion_type": ""}
_MARK = "xla_cpu_small_call"
#: what each accelerator is worth, measured once on 2 cores with JAX 0.10.2, or what it is for
WORTH = {
    "xla_cpu_use_fusion_emitters": "without it compiling takes up to 1.6 times as long",
    "xla_backend_optimization_level": "without it compiling takes 1.3 times as long",
    "xla_cpu_experimental_ynn_fusion_type": "without it programs with matrix products are not compiled as one function",
    _MARK: "without it a warm stop of 20 linings takes 4 times as long",
}


class Accelerators(NamedTuple):
    """What the installed XLA accepts for programs on one platform."""

    options: Options
    one_function_options: Options  # these and those that a run as one function takes besides
    one_function: bool  # a call can be marked so that everything in it, loops included, becomes one function
    refused: tuple[str, ...]


@functools.cache
def accelerators(platform: str) -> Accelerators:
    """Tries options and marks on a tiny program; there are none for other platforms than the CPU."""
    if platform != "cpu":
        return Accelerators({}, {}, False, ())
    numbers = np.ones(2)

    def accepted(options: Options) -> Options:
        try:
            jax.jit(_tiny, compiler_options=options).lower(numbers).compile()
            return options
        except (JaxRuntimeError, ValueError, TypeError):
            parts = [accepted({name: value}) for name, value in options.items()] if len(options) > 1 else []
            return {name: value for part in parts for name, value in part.items()}

    with jax.default_device(jax.local_devices(backend="cpu")[0]):
        options, more = accepted(_CPU_OPTIONS), accepted(_ONE_FUNCTION_OPTIONS)
        try:
            program = jax.jit(lambda x: one_function(jax.jit(_tiny), x), compiler_options=options | more)
            # (nothing but the compiled program may be called: JAX may be tracing something of the user's just now)
            marked = np.array_equal(program.lower(numbers).compile()(numbers), np.full(2, 1.875))
        except (ImportError, AttributeError, JaxRuntimeError, NotImplementedError, ValueError, TypeError):
            marked = False
    refused = [name for name in _CPU_OPTIONS | _ONE_FUNCTION_OPTIONS if name not in options | more]
    return Accelerators(options, options | more, marked, (*refused, *([] if marked else [_MARK])))


def _tiny(x: jax.Array) -> jax.Array:
    return jax.lax.fori_loop(0, 3, lambda _, x: 0.5 * x + 1.0, x)


def one_function(function: Callable[[Array], PyTree], numbers: Array) -> PyTree:
    """`function(numbers)` for a jitted function, marked so that XLA makes one function of it for the CPU.

    XLA wants every argument of the call to be used, hence one vector.
    """
    from jax.experimental.xla_metadata import set_xla_metadata

    # the mark is put on the call that the result comes from
    return set_xla_metadata(function(numbers), **{_MARK: "true"}, inlineable="false")


def run_device() -> Any:
    """The device of single runs and of studies of few runs: a CPU, also where JAX finds an accelerator.

    Steps of one brake are much too small for an accelerator, which would take thousands of times as long. Another
    device is chosen by `jax.default_device`; where `JAX_PLATFORMS` leaves no CPU, JAX's first device is taken.
    """
    chosen = jax.config.jax_default_device  # pyright: ignore
    if chosen is not None:
        return jax.local_devices(backend=chosen)[0] if isinstance(chosen, str) else chosen
    try:
        return jax.local_devices(backend="cpu")[0]
    except RuntimeError:
        return jax.local_devices()[0]


class DeviceJit:
    """`jax.jit` of a program that runs by itself: on `run_device()`, with the options for it."""

    def __init__(self, function: Callable, *, static_argnames: str | tuple[str, ...] = ()) -> None:
        functools.update_wrapper(self, function)
        self._function, self._static = function, static_argnames
        self._programs: dict[str, Callable[..., Any]] = {}

    def on(self, platform: str) -> Callable:
        """The jitted function for a platform."""
        if platform not in self._programs:
            options = accelerators(platform).options or None
            program = jax.jit(self._function, static_argnames=self._static, compiler_options=options)
            self._programs.setdefault(platform, program)  # whichever thread was first
        return self._programs[platform]

    def __call__(self, *arguments: PyTree, **named: PyTree) -> PyTree:
        device = run_device()
        with jax.default_device(device):
            return self.on(device.platform)(*arguments, **named)


class Packing(NamedTuple):
    """A PyTree without its numbers: structure, shapes and types.

    Hashable: it shapes programs, and answers that hold for all numbers are kept by it.
    """

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[str, ...]  # of numbers: whole ones (indices in a custom law) come back as such

    @property
    def size(self) -> int:
        return sum(math.prod(shape) for shape in self.shapes)

    def unpack(self, numbers: Array) -> PyTree:
        """The tree whose numbers lie in one vector (`pack`)."""
        ends = np.cumsum([0, *(math.prod(shape) for shape in self.shapes)])
        parts = zip(ends[:-1], ends[1:], self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(self.structure, [numbers[a:b].reshape(s).astype(kind) for a, b, s, kind in parts])

    def stand_in(self) -> PyTree:
        """The tree with the shape and type of each number in place of it."""
        parts = zip(self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(self.structure, [jax.ShapeDtypeStruct(s, np.dtype(kind)) for s, kind in parts])


def pack(tree: PyTree, xp: ModuleType = np) -> tuple[Array, Packing]:
    """All numbers of a tree in one vector, and how they lie in it; `xp`: `jax.numpy` for traced ones."""
    leaves, structure = jax.tree.flatten(tree)
    arrays = [xp.asarray(leaf) for leaf in leaves]
    kinds = tuple("float64" if np.issubdtype(x.dtype, np.floating) else str(x.dtype) for x in arrays)
    shapes = tuple(x.shape for x in arrays)
    return xp.concatenate([xp.ravel(x).astype(np.float64) for x in arrays]), Packing(structure, shapes, kinds)


def per_structure(find: Callable[..., _Answer]) -> Callable[..., _Answer]:
    """A function of a part (a PyTree of numbers, traced ones included) whose answer holds for all of its numbers.

    It is found once for each structure: `find` gets shapes and types in place of numbers, and further arguments that
    can be hashed.
    """

    @functools.lru_cache(maxsize=1024)
    def found(like: Packing, *arguments: Hashable, **named: Hashable) -> _Answer:
        return find(like.stand_in(), *arguments, **named)

    @functools.wraps(find)
    def answer(part: PyTree, *arguments: Hashable, **named: Hashable) -> _Answer:
        numbers, structure = jax.tree.flatten(part)
        shapes, kinds = tuple(np.shape(x) for x in numbers), tuple(str(jnp.result_type(x)) for x in numbers)
        return found(Packing(structure, shapes, kinds), *arguments, **named)

    return answer


class Program(NamedTuple):
    """A compiled function of one vector."""

    call: Callable[[Any], Any]
    trace_seconds: float
    compile_seconds: float
    one_function: bool  # loops and all; otherwise a hundred small kernels in every turn of a loop


def compiled(
    function: Callable[[Any], Any],
    numbers: Array,
    *,
    longest: int = 51_000,
    otherwise: Callable[[Any], Any] | None = None,
    device: Any = None,
) -> Program:
    """`function` of a vector like `numbers`, compiled ahead for a device (`run_device()`); on a CPU as one function
    where XLA can do that.

    XLA then neither starts kernels one by one nor hands them to a pool of threads. It knows not all operations there;
    what it refuses is compiled the ordinary way (`otherwise`, if another way to compute the same is better then). So is
    a program `longest` lines and more: one function takes the same time to compile up to some 9,000 lines, twice the
    time for 19,000 and three times for 38,000.
    """
    device = run_device() if device is None else device
    start, use, inner = time.perf_counter(), accelerators(device.platform), jax.jit(function)
    with jax.default_device(device):
        if use.one_function:
            marked = jax.jit(lambda x: one_function(inner, x), compiler_options=use.one_function_options or None)
            lowered = marked.lower(numbers)
            if fits_one_function(lowered.as_text(), longest):
                try:
                    return _timed(lowered, start, True)
                except JaxRuntimeError:
                    pass  # an operation that it does not know; what is wrong with the function itself shows below
        ordinary = jax.jit(otherwise or inner, compiler_options=use.options or None)
        return _timed(ordinary.lower(numbers), start, False)


def fits_one_function(text: str, longest: int) -> bool:
    """Whether a lowered program is short enough and calls no library, which cannot be part of one function."""
    return "custom_call" not in text and text.count("\n") < longest


def _timed(lowered: jax.stages.Lowered, start: float, one_function: bool) -> Program:
    traced = time.perf_counter()
    call = lowered.compile()
    return Program(call, traced - start, time.perf_counter() - traced, one_function)


def read_by(function: Callable, *arguments: PyTree) -> tuple[PyTree, ...]:
    """For every leaf of the `arguments` (PyTrees of shapes) whether the result of `function` depends on it.

    The function is lowered once, which drops the arguments that its result does not need. What cannot be lowered by
    itself (a call back to the host, a tracer in a closure, a mistake) counts as depending on all of them: the answer
    only decides what may be left out, and a mistake shows in the run.
    """
    from jax import export  # a module that only this needs

    leaves, structure = jax.tree.flatten(arguments)
    try:
        kept = export.export(jax.jit(function), platforms=("cpu",))(*arguments).module_kept_var_idx
    except Exception:
        kept = tuple(range(len(leaves)))
    return jax.tree.unflatten(structure, [i in kept for i in range(len(leaves))])


#: the bounds of JAX in pyproject.toml: its minor releases change what simbrake calls
OLDEST_JAX = (0, 9)
FIRST_UNTESTED_JAX = (0, 13)


def warn_of_untested_jax(version: tuple[int, ...]) -> None:
    """Warn in one line if this version of JAX is newer than tested: pip may be told to ignore the bounds."""
    if version >= FIRST_UNTESTED_JAX:
        installed, bound = (".".join(map(str, numbers)) for numbers in (version, FIRST_UNTESTED_JAX))
        text = f"JAX {installed} is newer than simbrake was tested with (below {bound}); pip install 'jax<{bound}'"
        # a file name that is none: Python would print the source line as a second line
        warnings.warn_explicit(text, UserWarning, "<simbrake>", 0)
