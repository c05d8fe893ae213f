"""How programs are compiled: for which device, with which options of XLA, a whole run
as one function; and where they are looked up first (`_store`).

Options and the mark of XLA make programs faster and are no conditions: what the
installed XLA refuses is left out. Nothing is set for the process, neither `XLA_FLAGS` nor JAX's
configuration."""

import contextlib
import contextvars
import functools
import math
import os
import re
import time
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.custom_batching import custom_vmap
from jax.errors import JaxRuntimeError
from jaxtyping import PyTree

from ..hybrid.arrays import Array
from ._faults import input_error
from ._packing import is_traced, pack, pack_small, unpack_small
from ._progress import compiling
from ._store import MEMORY, file_of, kept, kept_on_disk

#: of the compiler, by name
Options: TypeAlias = dict[str, bool | int | str]

#: options for programs on a CPU. XLA's older emitters of fused kernels: with the newer
#: ones the first run of a command takes 1.3 to 1.6 times as long (JAX 0.12 has only
#: those). LLVM's first level of optimisation: a quarter less time to compile, the code
#: as fast. Each part that is compiled by itself takes three memory mappings, of which
#: Linux allows a process 65,530: two parts, not 32.
_CPU_OPTIONS: Options = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_backend_optimization_level": 1,
    "xla_cpu_parallel_codegen_split_count": 2,
}
#: only for a run as one function: matrix products and long reductions that XLA would
#: hand to a library cannot be part of it
_ONE_FUNCTION_OPTIONS: Options = {"xla_cpu_experimental_ynn_fusion_type": ""}
#: for a program that may be run once only: LLVM without its optimiser. The first run of
#: a command takes 1.4 to 1.7 times as long with it
_QUICK: Options = {"xla_backend_optimization_level": 0}
#: puts all of a call into one function: without it a warm stop of 20 linings takes 4
#: times as long
_MARK = "xla_cpu_small_call"
#: lines of StableHLO up to which a program is compiled as one function
LONGEST = 51_000
#: MB that a line of StableHLO takes in a compiled program; 4.1 to 7.9 kB in those of
#: seven scenes (JAX 0.10.2)
_PER_LINE = 0.005
#: numbers from which XLA hands a sum, maximum or minimum to a library
_LONG_REDUCTION = 4096
#: whether what is traced now becomes one function as a whole: XLA makes none within
#: another
_IN_ONE_FUNCTION = contextvars.ContextVar("_IN_ONE_FUNCTION", default=False)


# --- devices ------------------------------------------------------------------------


def run_device() -> Any:
    """The device of single runs and of studies of few runs: a CPU, also where JAX finds
    an accelerator.

    Steps of one brake are much too small for an accelerator, which would take thousands
    of times as long. Another device is chosen by `jax.default_device`; where
    `JAX_PLATFORMS` leaves no CPU, JAX's first device is taken.
    """
    require_own_process()
    _OWNER[:] = [os.getpid()]
    chosen = jax.config.jax_default_device  # pyright: ignore
    if chosen is not None:
        return (
            jax.local_devices(backend=chosen)[0] if isinstance(chosen, str) else chosen
        )
    try:
        return jax.local_devices(backend="cpu")[0]
    except (RuntimeError, AssertionError):
        pass
    try:
        return jax.local_devices()[0]
    except (RuntimeError, AssertionError) as error:
        what = f"is {jax.config.jax_platforms}, and there is no such device"  # pyright: ignore
        raise input_error("JAX_PLATFORMS", what, "unset it, or add cpu") from error


#: the process that compiled first
_OWNER: list[int] = []


def require_own_process() -> None:
    """Raises `InputError` in a process forked from one that has compiled: its first
    program would wait for ever."""
    if (_OWNER or [os.getpid()])[0] != os.getpid():
        hint = 'start processes by multiprocessing.get_context("spawn")'
        raise input_error(
            "process",
            "was forked from one that had run simbrake, without its threads",
            hint,
        )


# --- options of XLA -----------------------------------------------------------------

#: options that the installed XLA does not know
_REFUSED: set[str] = set()


def _compile(lowered: jax.stages.Lowered, options: Options) -> jax.stages.Compiled:
    """A lowered program compiled with those of the options that XLA knows."""
    known = {name: options[name] for name in options if name not in _REFUSED}
    try:
        return lowered.compile(known)  # pyright: ignore
    except JaxRuntimeError as error:
        refused = {name for name in known if name in str(error)}
        if not refused:
            raise
    _REFUSED.update(refused)
    return _compile(lowered, known)


# --- one function -------------------------------------------------------------------


def makes_one_function(platform: str) -> bool:
    """Whether a call can be marked so that everything in it, loops included, becomes
    one function for this platform; tried on a tiny program."""

    def tiny(x: jax.Array) -> jax.Array:
        return jax.lax.fori_loop(0, 3, lambda _, x: 0.5 * x + 1.0, x)

    def find() -> bool:
        program = jax.jit(lambda x: one_function(jax.jit(tiny), x))
        numbers = np.ones(2)
        try:
            with jax.default_device(jax.local_devices(backend=platform)[0]):
                # (nothing but the compiled program may be called: JAX may be tracing
                # something of the user's just now)
                found = program.lower(numbers).compile()(numbers)
        except Exception:  # whatever an XLA or a JAX raises that does not know the mark
            return False
        return np.array_equal(found, np.full(2, 1.875))

    return platform == "cpu" and kept(("mark", _MARK), find)


def one_function(function: Callable[[Array], PyTree], numbers: Array) -> PyTree:
    """`function(numbers)` for a jitted function, marked so that XLA makes one function
    of it for the CPU.

    XLA wants every argument of the call to be used, hence one vector. A result comes
    in two halves: what ends the function is then no computation, which XLA might share
    between two threads.
    """
    from jax.experimental.xla_metadata import set_xla_metadata

    def marked(function: Callable[[Array], PyTree]) -> PyTree:
        # the mark is put on the call that the result comes from
        about = {_MARK: "true", "inlineable": "false"}
        return set_xla_metadata(function(numbers), **about)

    def in_halves(numbers: Array) -> list[Array]:
        [numbers] = jax.tree.leaves(function(numbers))
        return jnp.split(numbers, [len(numbers) // 2])  # pyright: ignore

    shapes, structure = jax.tree.flatten(jax.eval_shape(function, numbers))
    if len(shapes) == 1 and shapes[0].size > 1:
        halves = marked(jax.jit(in_halves))
        return jax.tree.unflatten(structure, [jnp.concatenate(halves)])
    return marked(function)


def fits_one_function(text: str, longest: int = LONGEST) -> bool:
    """Whether a lowered program is short enough and calls no library, which cannot be
    part of one function."""
    return "custom_call" not in text and text.count("\n") < longest


def _reduces_much(text: str) -> bool:
    """Whether a lowered program has a sum, maximum or minimum of many numbers."""
    for shape in re.findall(r"\) applies .*: \(tensor<([0-9x]*)x[a-z]", text):
        if math.prod(map(int, shape.split("x"))) >= _LONG_REDUCTION:
            return True
    return False


def as_one_function(
    function: Callable[[PyTree], PyTree], arrays: PyTree, *, in_turn: bool = False
) -> PyTree:
    """`function(arrays)` of a tree of arrays within a larger program: as one function
    where XLA can do that.

    Where it is mapped, many are computed side by side in the ordinary way, as XLA's
    treatment of those is not known, or one after the other (`in_turn`). Arrays that are
    not traced are compiled in.
    """
    if jax.default_backend() != "cpu" or not makes_one_function("cpu"):
        return function(arrays)
    leaves, structure = jax.tree.flatten(arrays)
    traced = [isinstance(leaf, Tracer) for leaf in leaves]
    both = [*zip(leaves, traced, strict=True)]
    numbers, like = pack([leaf for leaf, moves in both if moves], jnp)

    @jax.jit
    def inner(numbers: Array) -> PyTree:
        new = iter(like.unpack(numbers))
        every = [next(new) if moves else leaf for leaf, moves in both]
        return function(jax.tree.unflatten(structure, every))

    def fits() -> bool:
        text = inner.lower(jax.ShapeDtypeStruct(numbers.shape, np.float64)).as_text()
        # (these too are calls of a library, unless the options of the whole program
        # say otherwise)
        calls = "dot_general" in text or _reduces_much(text)
        return not calls and fits_one_function(text)

    @custom_vmap
    def marked(numbers: Array) -> PyTree:
        if _IN_ONE_FUNCTION.get() or not fits():
            return inner(numbers)
        return one_function(inner, numbers)

    @marked.def_vmap
    def _(size: int, batched: PyTree, numbers: Array) -> tuple[PyTree, PyTree]:
        answers = jax.lax.map(marked, numbers) if in_turn else jax.vmap(inner)(numbers)
        return answers, jax.tree.map(lambda _: True, answers)

    return marked(numbers)


# --- programs -----------------------------------------------------------------------


class Program(NamedTuple):
    """A compiled function of arrays.

    - `one_function`: loops and all; otherwise it is a hundred small kernels in every
      turn of a loop
    - `quick`: without LLVM's optimiser;  `lines`: of StableHLO

    On disk it has its machine code, by `jax.experimental.serialize_executable`. By
    public interfaces alone (`jax.export` for the trace, JAX's own cache for the code)
    commands take 1.15 to 1.35 times as long when they run again and 1.3 to 1.45 times
    when they run first; processes that have no cache of JAX compile all anew.
    """

    call: Callable[..., PyTree]
    trace_seconds: float
    compile_seconds: float
    one_function: bool
    quick: bool
    lines: int

    def __reduce__(self) -> tuple:
        from jax.experimental.serialize_executable import serialize

        call: Any = self.call
        counts = len(jax.tree.leaves(call.args_info)), call.out_tree.num_leaves
        return _restored, (serialize(call)[0], *counts, *self[1:])


def _restored(code: bytes, arguments: int, results: int, *about: Any) -> Program:
    from jax.experimental.serialize_executable import deserialize_and_load

    device = run_device()
    if b"lapack_" in code:
        with jax.default_device(device):
            _find_lapack()
    trees = ((0,) * arguments, {}), [0] * results
    call = deserialize_and_load(
        code,
        *map(jax.tree.structure, trees),
        backend=device.client,
        execution_devices=[device],
    )
    return Program(call, *about)


@functools.cache
def _find_lapack() -> None:
    """Have JAX look up LAPACK, as it does when it lowers a call of it: before that a
    restored call goes nowhere."""
    jax.jit(jnp.linalg.inv).lower(np.eye(1))


def program_of(
    function: Callable[..., PyTree],
    *arguments: Array,
    subject: tuple,
    quick: bool = False,
    longest: int = 0,
    packed: bool = False,
    anew: bool = False,
) -> Program:
    """`function` of arrays like these, compiled for `run_device()`: from disk where an
    earlier process has left it there, else traced.

    - `subject`: a name, and all that the function depends on. What depends on a user's
      own class or function is traced each time, and kept by the text of its program
    - `quick`: without LLVM's optimiser, for what is called a few times only
    - `longest`: lines of StableHLO up to which a function of one vector becomes one
      function where XLA can do that, which then neither starts kernels one by one nor
      hands them to a pool of threads: it runs two to five times as fast. XLA knows not
      all operations there; what it refuses is compiled the ordinary way
    - `packed`: small arrays of the result come in one vector, and all as NumPy's. With
      an array for each a warm run of a stop takes 0.46 ms instead of 0.25
    - `anew`: also where there is a program on disk, which is replaced
    """
    device = run_device()
    outputs: list[Any] = []  # their shapes, once the function is traced

    def flat(*arguments: Array) -> list[Array]:
        results = jax.tree.map(jnp.asarray, function(*arguments))
        outputs[:] = [
            jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), results)
        ]
        leaves = jax.tree.leaves(results)
        return pack_small(leaves) if packed else leaves

    def whole(numbers: Array) -> list[Array]:
        return one_function(jax.jit(flat), numbers)

    # (where JAX's own cache is on: a program that JAX has read from there could be
    # written and read, and would fail when it is called)
    name, *rest = subject
    shapes = tuple((argument.shape, argument.dtype) for argument in arguments)
    file = file_of(name, (rest, shapes), device)
    keep = functools.partial(kept_on_disk, anew=anew, written=not of_jax())

    def compiled(as_one: bool) -> Program | None:
        start = time.perf_counter()
        options = {}
        if device.platform == "cpu":
            options = _CPU_OPTIONS | (_QUICK if quick else {})
            options |= _ONE_FUNCTION_OPTIONS if as_one else {}
        # (a new function: in the other one the parts of a run are joined, or not)
        traced = whole if as_one else lambda *arguments: flat(*arguments)
        traced.__name__ = name  # in logs of JAX
        inside = _IN_ONE_FUNCTION.set(as_one)
        try:
            with jax.default_device(device):
                lowered = jax.jit(traced).lower(*arguments)
        finally:
            _IN_ONE_FUNCTION.reset(inside)
        text = lowered.as_text()
        if as_one and not fits_one_function(text, longest):
            return None
        tracing = time.perf_counter() - start

        def compile_it() -> Program:
            start = time.perf_counter()
            call = _compile(lowered, options)
            seconds = tracing, time.perf_counter() - start
            return Program(call, *seconds, as_one, quick, text.count("\n"))

        if file is not None:
            return compile_it()
        return keep(file_of("text", (text, shapes), device), compile_it)

    def make() -> tuple[Program, PyTree]:
        program = None
        if longest and makes_one_function(device.platform):
            with contextlib.suppress(JaxRuntimeError):  # an operation that it refuses
                program = compiled(True)
        program = program or compiled(False)
        return program, outputs[0]  # pyright: ignore

    def make_and_say() -> tuple[Program, PyTree]:
        with compiling():
            return make()

    program, like = keep(file, make_and_say)
    unpack = unpack_small(like)
    if not packed:
        unpack = functools.partial(jax.tree.unflatten, jax.tree.structure(like))
    call = program.call
    return program._replace(call=lambda *arguments: unpack(call(*arguments)))


def of_jax() -> bool:
    """Whether JAX's own cache of compiled programs is on
    (`JAX_COMPILATION_CACHE_DIR`)."""
    return bool(jax.config.jax_compilation_cache_dir)  # pyright: ignore


def megabytes(program: "Program | TieredProgram") -> float:
    """Memory that a program takes, estimated."""
    return _PER_LINE * program.lines


class Compiled:
    """A function compiled by itself for `run_device()`, once for each structure of its
    arguments: from memory, from disk, or traced.

    - `subject`: where the function is not one of a module: a name, and all that the
      function depends on
    - `static_argnames`: of arguments that are given by name and compiled in
    - `quick`: without LLVM's optimiser, for what is called a few times only
    """

    def __init__(
        self,
        function: Callable,
        *,
        static_argnames: tuple[str, ...] = (),
        subject: tuple | None = None,
        quick: bool = False,
    ) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        self._static = static_argnames
        self._subject = subject or (function.__name__, function)
        self._quick = quick
        self._part = jax.jit(function, static_argnames=static_argnames)

    def __call__(self, *arguments: PyTree, **named: PyTree) -> PyTree:
        """The function of arrays; of what is traced it is a part of that program."""
        device = run_device()
        static = {name: named.pop(name) for name in self._static if name in named}
        leaves, structure = jax.tree.flatten((arguments, named))
        leaves = [np.float64(leaf) if type(leaf) is float else leaf for leaf in leaves]
        if is_traced(leaves) or not all(
            isinstance(leaf, np.ndarray | np.generic | jax.Array) for leaf in leaves
        ):
            with jax.default_device(device):
                return self._part(*arguments, **named, **static)
        leaves = [np.asarray(leaf) for leaf in leaves]

        def function(*leaves: Array) -> PyTree:
            arguments, named = jax.tree.unflatten(structure, leaves)
            return self._function(*arguments, **named, **static)

        subject = (*self._subject, self._quick, structure, tuple(static.items()))
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        program = MEMORY.get(
            (subject, shapes, device),
            lambda: program_of(function, *leaves, subject=subject, quick=self._quick),
            megabytes,
        )
        return program.call(*leaves)


class TieredProgram:
    """A program for an unknown number of runs, compiled quickly at first.

    When its runs have taken as long as compiling it with LLVM's optimiser would, that
    is done, and later processes begin with that program: no number of runs costs more
    than twice what it would if it were known. Left quick, it would run up to seven
    times as long.

    - `function`: of one vector like `numbers`; its result is `packed`
    - `quick`: whether it begins so
    """

    def __init__(
        self,
        function: Callable[[Array], PyTree],
        numbers: Array,
        subject: tuple,
        quick: bool = True,
    ) -> None:
        self._make = functools.partial(
            program_of,
            function,
            numbers,
            subject=subject,
            longest=LONGEST,
            packed=True,
        )
        self._program = self._make(quick=quick)
        program = self._program  # optimised already, if that was on disk
        self._left = program.trace_seconds + 2 * program.compile_seconds
        self.lines = program.lines
        self.calls = 0

    def call(self, numbers: Array) -> PyTree:
        if self._left < 0 and self._program.quick:
            self._program = self._make(anew=True)
        start = time.perf_counter()
        result = self._program.call(numbers)
        self._left -= time.perf_counter() - start  # (it is NumPy's: all is done)
        self.calls += 1
        return result


def read_by(function: Callable, *arguments: PyTree) -> tuple[PyTree, ...]:
    """For every leaf of the `arguments` (PyTrees of shapes) whether the result of
    `function` depends on it.

    The function is lowered once, which drops the arguments that its result does not
    need. What cannot be lowered by itself (a call back to the host, a tracer in a
    closure, a mistake) counts as depending on all of them: the answer only decides what
    may be left out, and a mistake shows in the run.
    """
    from jax import export  # a module that only this needs

    leaves, structure = jax.tree.flatten(arguments)
    try:
        kept = export.export(jax.jit(function), platforms=("cpu",))(
            *arguments
        ).module_kept_var_idx
    except Exception:
        kept = tuple(range(len(leaves)))
    return jax.tree.unflatten(structure, [i in kept for i in range(len(leaves))])


#: the bounds of JAX in pyproject.toml: its minor releases change what simbrake calls
OLDEST_JAX = (0, 9)
FIRST_UNTESTED_JAX = (0, 13)


def warn_of_untested_jax(version: tuple[int, ...]) -> None:
    """Warn in one line if this version of JAX is newer than tested: pip may be told to
    ignore the bounds."""
    if version >= FIRST_UNTESTED_JAX:
        installed, bound = (
            ".".join(map(str, numbers)) for numbers in (version, FIRST_UNTESTED_JAX)
        )
        text = (
            f"JAX {installed} is newer than simbrake was tested with (below "
            f"{bound}); pip install 'jax<{bound}'"
        )
        # a file name that is none: Python would print the source line as a second line
        warnings.warn_explicit(text, UserWarning, "<simbrake>", 0)
