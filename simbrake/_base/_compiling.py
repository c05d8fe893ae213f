"""How and where programs are compiled: the device, XLA options that help, and a whole
run as one function.

Options and marks of XLA are accelerators, never conditions: each is tried once per
process on a tiny program and left out where the installed XLA refuses it. Nothing is
set for the process, neither `XLA_FLAGS` nor JAX's configuration."""

import contextlib
import contextvars
import functools
import itertools
import math
import os
import threading
import time
import warnings
import weakref
from collections.abc import Callable, Hashable, Iterable, Sequence
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.custom_batching import custom_vmap
from jax.errors import JaxRuntimeError
from jaxtyping import PyTree

from ..hybrid.arrays import Array
from . import _cache
from ._faults import input_error
from ._programs import STORE

_Answer = TypeVar("_Answer")
#: of the compiler, by name
Options: TypeAlias = dict[str, bool | int | str]

#: options for programs on a CPU. XLA's older emitters of fused kernels: the newer ones
#: take 1.6 times as long to compile these loops and run them no faster. LLVM's first
#: level of optimisation: a quarter less compile time, the code as fast. Each part that
#: is compiled by itself takes three memory mappings (see `_programs`): two parts, not
#: 32.
_CPU_OPTIONS: Options = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_backend_optimization_level": 1,
    "xla_cpu_parallel_codegen_split_count": 2,
}
#: only for a run as one function: matrix products that XLA would hand to a library
#: cannot be part of it
_ONE_FUNCTION_OPTIONS: Options = {"xla_cpu_experimental_ynn_fusion_type": ""}
#: for a program that may be run once only: LLVM without its optimiser
_QUICK: Options = {"xla_backend_optimization_level": 0}
#: lines of StableHLO up to which a program is compiled as one function
LONGEST = 51_000
_MARK = "xla_cpu_small_call"
#: numbers from which a result is given in two halves: XLA would have two threads make a
#: long one, each a part of it
_LONG_RESULT = 8192
#: whether what is traced now becomes one function as a whole: XLA makes none within
#: another
_IN_ONE_FUNCTION = contextvars.ContextVar("_IN_ONE_FUNCTION", default=False)
#: what each accelerator gains, measured once on 2 cores with JAX 0.10.2, or what it is
#: for
WORTH = {
    "xla_cpu_use_fusion_emitters": "without it compiling takes up to 1.6 times as long",
    "xla_backend_optimization_level": "without it compiling takes 1.3 times as long",
    "xla_cpu_parallel_codegen_split_count": "without it a run and its print take 2.6 times as many "
    "memory "
    "mappings",
    "xla_cpu_experimental_ynn_fusion_type": "without it programs with matrix products are not "
    "compiled as "
    "one "
    "function",
    _MARK: "without it a warm stop of 20 linings takes 4 times as long",
}


class Accelerators(NamedTuple):
    """What the installed XLA accepts for programs on one platform."""

    options: Options
    one_function_options: (
        Options  # these and those that a run as one function takes besides
    )
    # a call can be marked so that everything in it, loops included, becomes one
    # function
    one_function: bool
    refused: tuple[str, ...]


@functools.cache
def accelerators(platform: str) -> Accelerators:
    """Tries options and marks on a tiny program; there are none for other platforms
    than the CPU."""
    if platform != "cpu":
        return Accelerators({}, {}, False, ())
    return _cache.cached(
        "accelerators", (_CPU_OPTIONS, _ONE_FUNCTION_OPTIONS), _accelerators_of_cpu
    )


def _accelerators_of_cpu() -> Accelerators:
    numbers = np.ones(2)

    def accepted(options: Options) -> Options:
        try:
            jax.jit(_tiny, compiler_options=options).lower(numbers).compile()
            return options
        except (JaxRuntimeError, ValueError, TypeError):
            parts = (
                [accepted({name: value}) for name, value in options.items()]
                if len(options) > 1
                else []
            )
            return {name: value for part in parts for name, value in part.items()}

    def marks(options: Options) -> bool:
        try:
            program = jax.jit(
                lambda x: one_function(jax.jit(_tiny), x), compiler_options=options
            )
            # (nothing but the compiled program may be called: JAX may be tracing
            # something of the user's just now)
            return np.array_equal(
                program.lower(numbers).compile()(numbers), np.full(2, 1.875)
            )
        except (
            ImportError,
            AttributeError,
            JaxRuntimeError,
            NotImplementedError,
            ValueError,
            TypeError,
        ):
            return False

    with jax.default_device(jax.local_devices(backend="cpu")[0]):
        if marks(
            _CPU_OPTIONS | _ONE_FUNCTION_OPTIONS
        ):  # as with every JAX tested: one trial for all of them
            return Accelerators(
                _CPU_OPTIONS, _CPU_OPTIONS | _ONE_FUNCTION_OPTIONS, True, ()
            )
        options = accepted(_CPU_OPTIONS)
        more = accepted(_ONE_FUNCTION_OPTIONS)
        marked = marks(options | more)
    refused = [
        name
        for name in _CPU_OPTIONS | _ONE_FUNCTION_OPTIONS
        if name not in options | more
    ]
    return Accelerators(
        options, options | more, marked, (*refused, *([] if marked else [_MARK]))
    )


def _tiny(x: jax.Array) -> jax.Array:
    return jax.lax.fori_loop(0, 3, lambda _, x: 0.5 * x + 1.0, x)


def one_function(function: Callable[[Array], PyTree], numbers: Array) -> PyTree:
    """`function(numbers)` for a jitted function, marked so that XLA makes one function
    of it for the CPU.

    XLA wants every argument of the call to be used, hence one vector.
    """
    from jax.experimental.xla_metadata import set_xla_metadata

    def marked(function: Callable[[Array], PyTree]) -> PyTree:
        # the mark is put on the call that the result comes from
        return set_xla_metadata(
            function(numbers), **{_MARK: "true"}, inlineable="false"
        )

    result = jax.eval_shape(function, numbers)
    if isinstance(result, jax.ShapeDtypeStruct) and result.size > _LONG_RESULT:
        return jnp.concatenate(
            marked(jax.jit(lambda x: jnp.split(function(x), [result.shape[0] // 2])))
        )
    return marked(function)


def joined(
    function: Callable[[PyTree], PyTree], arrays: PyTree, *, in_turn: bool = False
) -> PyTree:
    """`function(arrays)` of a tree of arrays within a larger program: as one function
    where XLA can do that.

    Where it is mapped, many are computed side by side in the ordinary way, as XLA's
    treatment of those is not known, or one after the other (`in_turn`). Arrays that are
    not traced are compiled in.
    """
    leaves, structure = jax.tree.flatten(arrays)
    traced = [isinstance(leaf, Tracer) for leaf in leaves]
    numbers, like = pack(
        [leaf for leaf, moves in zip(leaves, traced, strict=True) if moves], jnp
    )

    @jax.jit
    def inner(numbers: Array) -> PyTree:
        new = iter(like.unpack(numbers))
        every = [
            next(new) if moves else leaf
            for leaf, moves in zip(leaves, traced, strict=True)
        ]
        return function(jax.tree.unflatten(structure, every))

    def joins() -> bool:
        text = inner.lower(jax.ShapeDtypeStruct(numbers.shape, np.float64)).as_text()
        # (matrix products too are calls of a library, unless the options of the whole
        # program say otherwise)
        return "dot_general" not in text and fits_one_function(text)

    @custom_vmap
    def marked(numbers: Array) -> PyTree:
        return (
            one_function(inner, numbers)
            if not _IN_ONE_FUNCTION.get() and joins()
            else inner(numbers)
        )

    @marked.def_vmap
    def _(size: int, batched: PyTree, numbers: Array) -> tuple[PyTree, PyTree]:
        answers = jax.lax.map(marked, numbers) if in_turn else jax.vmap(inner)(numbers)
        return answers, jax.tree.map(lambda _: True, answers)

    return marked(numbers)


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


class DeviceJit:
    """A function compiled by itself: for `run_device()`, with the options for it, and
    kept on disk.

    It is compiled once for each structure of its arguments; static ones are given by
    name. `_programs.STORE` keeps the programs, as long as there is room and this object
    lives.

    - `subject`: where the function is not one of a module: a name, and all that the
      function depends on
    - `quick`: for what is called a few times only, without LLVM's optimiser, which
      takes half the time to compile
    """

    def __init__(
        self,
        function: Callable,
        *,
        static_argnames: str | tuple[str, ...] = (),
        subject: tuple | None = None,
        quick: bool = False,
    ) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        self._static = (
            (static_argnames,) if isinstance(static_argnames, str) else static_argnames
        )
        self._subject = subject or (function.__name__, function)
        self._quick = quick
        self._programs: dict[str, Callable[..., Any]] = {}
        self._owner = object()
        weakref.finalize(self, STORE.bury, self._owner).atexit = False

    def clear_cache(self) -> None:
        """Drop its programs."""
        STORE.forget(self._owner)

    def on(self, platform: str) -> Callable:
        """The jitted function for a platform."""
        if platform not in self._programs:
            options = accelerators(platform).options or None
            program = jax.jit(
                self._function, static_argnames=self._static, compiler_options=options
            )
            self._programs.setdefault(platform, program)  # whichever thread was first
        return self._programs[platform]

    def __call__(self, *arguments: PyTree, **named: PyTree) -> PyTree:
        device = run_device()
        static = {name: named.pop(name) for name in self._static if name in named}
        leaves, structure = jax.tree.flatten((arguments, named))
        leaves = [np.float64(leaf) if type(leaf) is float else leaf for leaf in leaves]
        if not all(
            isinstance(leaf, np.ndarray | np.generic | jax.Array) for leaf in leaves
        ) or is_traced(leaves):
            with jax.default_device(device):
                return self.on(device.platform)(*arguments, **named, **static)
        leaves = [np.asarray(leaf) for leaf in leaves]
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        key = self._owner, structure, shapes, tuple(static.items()), device
        return STORE.get(
            key, lambda: self._compiled(leaves, structure, static, device)
        ).call(leaves)

    def _compiled(
        self, leaves: list[np.ndarray], structure: Any, static: dict, device: Any
    ) -> "Program":
        def function(leaves: list[Array]) -> PyTree:
            arguments, named = jax.tree.unflatten(structure, leaves)
            return self._function(*arguments, **named, **static)

        def make(by_text: bool) -> Program:
            start = time.perf_counter()
            options = _tier(accelerators(device.platform).options, self._quick)
            with jax.default_device(device):
                lowered = jax.jit(function, compiler_options=options).lower(leaves)
            return _finished(
                lowered, start, False, self._quick, device if by_text else None
            )

        shapes = jax.tree.unflatten(structure, leaves)
        return _cached_or((*self._subject, shapes, static), self._quick, device, make)


def is_traced(tree: PyTree) -> bool:
    """Whether any leaf is being traced by a transformation of JAX."""
    return any(
        type(leaf) is not np.ndarray and isinstance(leaf, Tracer)
        for leaf in jax.tree.leaves(tree)
    )


# --- derivatives outside of jit -----------------------------------------------------

#: entries of a matrix of derivatives up to which it is made as a whole
_MOST_SLOPES = 2**22


def _is_real(x: Any) -> bool:
    return jnp.issubdtype(jnp.result_type(x), jnp.floating)


def _reals(tree: PyTree) -> list[Any]:
    return [leaf for leaf in jax.tree.leaves(tree) if _is_real(leaf)]


def with_stored_slopes(
    function: Callable, subject: tuple, inside: Callable | None = None
) -> Callable:
    """`function(*arguments)`, whose values and first derivatives come from one stored
    program where it is differentiated outside of `jit`: JAX would compile operation by
    operation, anew in every process.

    The program gives the matrix of all derivatives. What JAX differentiates is a
    product with it, forwards, backwards and mapped. Inside of `jit`, and where the
    matrix is too large, the function is differentiated as it is.

    - `subject`: a name, and all that the function depends on
    - `inside`: the same function, for programs that do not
      differentiate it
    """

    def with_slopes(*arguments: PyTree) -> tuple[PyTree, Array]:
        leaves, structure = jax.tree.flatten(arguments)
        numbers, like = pack(_reals(leaves), jnp)

        def of_numbers(x: Array) -> tuple[Array, PyTree]:
            reals = iter(like.unpack(x))
            values = function(
                *jax.tree.unflatten(
                    structure, [next(reals) if _is_real(y) else y for y in leaves]
                )
            )
            return pack(_reals(values), jnp)[0], values

        size = jax.eval_shape(of_numbers, numbers)[0].size
        if size <= numbers.size:
            _, back, values = jax.vjp(of_numbers, numbers, has_aux=True)
            return values, jax.vmap(back)(jnp.eye(size))[0]
        _, along, values = jax.linearize(of_numbers, numbers, has_aux=True)
        return values, jax.vmap(along, out_axes=1)(jnp.eye(numbers.size))

    @functools.cache
    def fits(packing: Packing) -> bool:
        def entries() -> int:
            arguments = packing.stand_in()
            both = arguments, jax.eval_shape(function, *arguments)
            return math.prod(sum(leaf.size for leaf in _reals(tree)) for tree in both)

        return _cache.cached("slopes", (subject, packing), entries) <= _MOST_SLOPES

    program = DeviceJit(with_slopes, subject=("slopes", *subject))

    @jax.custom_jvp
    def call(*arguments: PyTree) -> PyTree:
        return (inside or function)(*arguments)

    @functools.partial(call.defjvp, symbolic_zeros=True)
    def _(primals: tuple, tangents: tuple) -> tuple[PyTree, PyTree]:
        if (
            not is_traced(primals)
            and jax.default_backend() == "cpu"
            and fits(Packing.of(primals))
        ):
            values, slopes = program(
                *jax.tree.map(np.asarray, primals)
            )  # (JAX has classes of its own for scalars)
            both = zip(*map(jax.tree.leaves, (primals, tangents)), strict=True)
            moves = [
                d if hasattr(d, "shape") else np.asarray(d)
                for x, d in both
                if _is_real(x)
            ]
            return values, _along(np.asarray(slopes), values, moves)
        return jax.jvp(function, primals, jax.tree.map(_instantiated, tangents))

    return call


def _is_zero(tangent: Any) -> bool:
    return isinstance(tangent, jax.custom_derivatives.SymbolicZero)


def _instantiated(tangent: Any) -> Array:
    return np.zeros(tangent.shape, tangent.dtype) if _is_zero(tangent) else tangent


def _along(slopes: np.ndarray, values: PyTree, moves: list[Any]) -> PyTree:
    """Tangents of the values for moves of all numbers, by the derivatives (values,
    numbers).

    What does not depend on a number passes nothing on to it. Products are bare
    operations, few of which have other shapes than those before.
    """

    def ends(arrays: Iterable[Any]) -> list[int]:
        return np.cumsum([0, *(math.prod(x.shape) for x in arrays)]).tolist()

    def tangent(value: Array, rows: np.ndarray) -> Array:
        total: Any = np.zeros(value.shape)
        for (a, b), move in zip(itertools.pairwise(ends(moves)), moves, strict=True):
            if not _is_zero(move) and np.any(block := rows[:, a:b]):
                axes = range(value.ndim, value.ndim + move.ndim), range(move.ndim)
                part = jax.lax.dot_general(
                    block.reshape(value.shape + move.shape), move, (axes, ((), ()))
                )
                total = part if type(total) is np.ndarray else jax.lax.add(total, part)
        return total

    reals = _reals(values)
    by_place = zip(reals, itertools.pairwise(ends(reals)), strict=True)
    tangents = iter([tangent(value, slopes[a:b]) for value, (a, b) in by_place])
    return jax.tree.map(
        lambda x: (
            next(tangents) if _is_real(x) else np.zeros(x.shape, jax.dtypes.float0)
        ),
        values,
    )


def _cached_or(
    subject: tuple, quick: bool, device: Any, make: Callable[[bool], "Program"]
) -> "Program":
    """The program of a subject (a name, and all that it depends on), read from the disk
    or made and kept.

    Where a `quick` one is wanted and the optimised one is there, that is read. `make`
    keeps by its text what depends on a user's own class or function: it is traced each
    time, and compiled once.
    """
    # (a program names its device: only those for the first of a platform are kept)
    name, *rest = subject
    first = device == jax.local_devices(backend=device.platform)[0]
    keys = (
        [_cache.key_of(name, (rest, tier), device) for tier in sorted({False, quick})]
        if first
        else [None]
    )
    if keys[0] is None:
        return make(first)
    for key in keys:
        program = _cache.read(
            key,
            lambda kept: _restored(
                kept[0], [*map(jax.tree.structure, kept[1])], device
            ),
        )
        if program is not None:
            return program
    program = make(False)
    _keep(keys[-1], program, lambda: _trees(program))
    return program


def _keep(
    key: str | None, program: "Program", trees: Callable[[], Any] | None = None
) -> None:
    """Write a compiled program to the cache, except where JAX's own cache is on.

    A program that JAX has read from its cache no longer has the code that it would be
    stored with: it could be written and read, and would fail when it is called.
    """
    if not _cache.of_jax():
        _cache.write(
            key,
            lambda: _stored(program) if trees is None else (_stored(program), trees()),
        )


def _tier(options: Options, quick: bool) -> Options | None:
    """The options of a program, those that XLA knows."""
    return (
        options
        | {name: value for name, value in _QUICK.items() if quick and name in options}
        or None
    )


class Packing(NamedTuple):
    """A PyTree without its numbers: structure, shapes and types.

    Hashable: it shapes programs, and answers that hold for all numbers are kept by it.
    """

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[
        str, ...
    ]  # of numbers: whole ones (indices in a custom law) come back as such

    @classmethod
    def of(cls, tree: PyTree) -> "Packing":
        leaves, structure = jax.tree.flatten(tree)
        return cls(
            structure,
            tuple(map(np.shape, leaves)),
            tuple(str(jnp.result_type(leaf)) for leaf in leaves),
        )

    @property
    def size(self) -> int:
        return sum(math.prod(shape) for shape in self.shapes)

    def unpack(self, numbers: Array) -> PyTree:
        """The tree whose numbers lie in one vector (`pack`)."""
        ends = np.cumsum([0, *(math.prod(shape) for shape in self.shapes)])
        parts = zip(ends[:-1], ends[1:], self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(
            self.structure,
            [numbers[a:b].reshape(s).astype(kind) for a, b, s, kind in parts],
        )

    def stand_in(self) -> PyTree:
        """The tree with the shape and type of each number in place of it."""
        parts = zip(self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(
            self.structure,
            [jax.ShapeDtypeStruct(s, np.dtype(kind)) for s, kind in parts],
        )


_KINDS = {np.dtype(name): name for name in ("float64", "int32", "int64")}


def pack(tree: PyTree, xp: ModuleType = np) -> tuple[Array, Packing]:
    """All numbers of a tree in one vector, and how they lie in it; `xp`: `jax.numpy`
    for traced ones."""
    leaves, structure = jax.tree.flatten(tree)
    if xp is np and all(
        type(leaf) is np.ndarray and leaf.dtype in _KINDS for leaf in leaves
    ):  # the same, faster
        shapes = tuple(leaf.shape for leaf in leaves)
        kinds = tuple(_KINDS[leaf.dtype] for leaf in leaves)
        return np.concatenate(
            [leaf.ravel() for leaf in leaves], dtype=np.float64
        ), Packing(structure, shapes, kinds)
    arrays = [xp.asarray(leaf) for leaf in leaves]
    kinds = tuple(
        "float64" if np.issubdtype(x.dtype, np.floating) else str(x.dtype)
        for x in arrays
    )
    shapes = tuple(x.shape for x in arrays)
    return xp.concatenate([xp.ravel(x).astype(np.float64) for x in arrays]), Packing(
        structure, shapes, kinds
    )


#: sets of numbers for which answers are remembered
_REMEMBERED = 64


#: entries from which on an array is a separate result: XLA splits larger operations
#: into parallel tasks, which cannot be part of one function
_LARGE = 256


class Unpacking:
    """Make a tree of NumPy arrays from the results of a program: small ones in one
    vector, large ones as they are."""

    def __init__(self, like: PyTree) -> None:
        leaves, self._structure = jax.tree.flatten(like)
        self._shapes = [jax.ShapeDtypeStruct(leaf.shape, leaf.dtype) for leaf in leaves]
        self.large = [math.prod(leaf.shape) >= _LARGE for leaf in leaves]
        sizes = [
            0 if large else math.prod(leaf.shape)
            for leaf, large in zip(leaves, self.large, strict=True)
        ]
        ends = np.cumsum([0, *sizes]).tolist()
        kinds = [None if leaf.dtype == np.float64 else leaf.dtype for leaf in leaves]
        self._parts = [
            *zip(
                self.large,
                ends,
                ends[1:],
                (leaf.shape for leaf in leaves),
                kinds,
                strict=False,
            )
        ]

    def __call__(self, numbers: np.ndarray, large: Sequence[Array]) -> PyTree:
        leaves = []
        whole = iter(large)
        for is_large, start, end, shape, kind in self._parts:
            if is_large:
                leaves.append(np.asarray(next(whole)))
                continue
            part = numbers[start:end].reshape(shape)
            leaves.append(part if kind is None else part.astype(kind))
        return jax.tree.unflatten(self._structure, leaves)

    def __reduce__(self) -> tuple:
        return Unpacking, (jax.tree.unflatten(self._structure, self._shapes),)


@jax.tree_util.register_pytree_node_class
class Packed:
    """The result of a program, its small arrays in one vector: JAX takes longer to make
    an array than to compute it."""

    def __init__(
        self, numbers: Array, large: Sequence[Array], unpacking: Unpacking
    ) -> None:
        self.numbers = numbers
        self._large = large
        self._unpacking = unpacking

    @classmethod
    def of(cls, tree: PyTree) -> "Packed":
        arrays = jax.tree.map(jnp.asarray, tree)
        unpacking = Unpacking(arrays)
        leaves = [*zip(jax.tree.leaves(arrays), unpacking.large, strict=True)]
        small, _ = pack([leaf for leaf, large in leaves if not large], jnp)
        return cls(small, [leaf for leaf, large in leaves if large], unpacking)

    def unpack(self) -> PyTree:
        return self._unpacking(np.asarray(self.numbers), self._large)

    def tree_flatten(self) -> tuple[tuple[Array, ...], Unpacking]:
        return (self.numbers, *self._large), self._unpacking

    @classmethod
    def tree_unflatten(
        cls, unpacking: Unpacking, arrays: tuple[Array, ...]
    ) -> "Packed":
        return cls(arrays[0], arrays[1:], unpacking)


#: what drops the answers that `per_value` and `per_structure` remember
_FORGET: list[Callable[[], object]] = []


def trace_anew() -> None:
    """Forget all programs, and all answers that were found by tracing.

    JAX takes a user's function for the same one as before when a global value that it
    reads has changed.
    """
    STORE.forget()
    jax.clear_caches()
    for forget in _FORGET:
        forget()


def per_value(
    of: Callable[[Any], PyTree],
) -> Callable[[Callable[[Any], _Answer]], Callable[[Any], _Answer]]:
    """A function of a scene or part, found once for each set of numbers in `of(part)`,
    on which alone it depends.

    Numbers that are traced, or no arrays, are looked at anew.
    """

    def remembering(find: Callable[[Any], _Answer]) -> Callable[[Any], _Answer]:
        answers: dict[Hashable, _Answer] = {}
        _FORGET.append(answers.clear)

        @functools.wraps(find)
        def answer(part: Any) -> _Answer:
            leaves, structure = jax.tree.flatten(of(part))
            if not all(type(leaf) is np.ndarray for leaf in leaves):
                return find(part)
            key = (
                structure,
                tuple((leaf.shape, leaf.dtype.char, leaf.tobytes()) for leaf in leaves),
            )
            stored: Any = answers.get(key, answers)  # itself: not among them
            if stored is not answers:
                return stored
            stored = answers[key] = find(part)
            for old in list(answers)[:-_REMEMBERED]:
                answers.pop(old, None)  # another thread may have done so
            return stored

        return answer

    return remembering


def per_structure(find: Callable[..., _Answer]) -> Callable[..., _Answer]:
    """A function of a part (a PyTree of numbers, traced ones included) whose answer
    holds for all of its numbers.

    It is found once for each structure: `find` gets shapes and types in place of
    numbers, and further arguments that can be hashed.
    """

    @functools.lru_cache(maxsize=1024)
    def cached_answer(
        like: Packing, *arguments: Hashable, **named: Hashable
    ) -> _Answer:
        part = like.stand_in()
        subject = find, part, arguments, sorted(named.items())
        return _cache.cached(
            find.__name__, subject, lambda: find(part, *arguments, **named)
        )

    _FORGET.append(cached_answer.cache_clear)

    @functools.wraps(find)
    def answer(part: PyTree, *arguments: Hashable, **named: Hashable) -> _Answer:
        return cached_answer(Packing.of(part), *arguments, **named)

    return answer


class Program(NamedTuple):
    """A compiled function of one vector."""

    call: jax.stages.Compiled
    trace_seconds: float
    compile_seconds: float
    one_function: (
        bool  # loops and all; otherwise a hundred small kernels in every turn of a loop
    )
    quick: bool  # without LLVM's optimiser
    lines: int  # of StableHLO


def compiled(
    function: Callable[[Any], Any],
    numbers: Array,
    *,
    longest: int = LONGEST,
    otherwise: Callable[[Any], Any] | None = None,
    device: Any = None,
    subject: tuple | None = None,
    quick: bool = False,
) -> Program:
    """`function` of a vector like `numbers`, compiled ahead for a device
    (`run_device()`); on a CPU as one function where XLA can do that.

    XLA then neither starts kernels one by one nor hands them to a pool of threads. It
    knows not all operations there; what it refuses is compiled the ordinary way
    (`otherwise`, if another way to compute the same is better then). So is a program of
    `longest` lines and more: up to 19,000 lines one function takes the same time to
    compile, or a quarter more, and runs are two to five times as fast.

    - `subject`: a name, and all that the function depends on: the program is kept on
      disk under it, or read from there
    - `quick`: without LLVM's optimiser, which takes half the time to compile
      (`TieredProgram`)
    """
    device = run_device() if device is None else device

    def make(by_text: bool) -> Program:
        start = time.perf_counter()
        use = accelerators(device.platform)
        place = device if by_text else None
        with jax.default_device(device):
            if use.one_function:
                options = _tier(use.one_function_options, quick)
                whole = jax.jit(
                    lambda x: one_function(jax.jit(function), x),
                    compiler_options=options,
                )
                inside = _IN_ONE_FUNCTION.set(True)
                try:
                    lowered = whole.lower(numbers)
                finally:
                    _IN_ONE_FUNCTION.reset(inside)
                text = lowered.as_text()
                if fits_one_function(text, longest):
                    try:
                        return _finished(lowered, start, True, quick, place, text)
                    except JaxRuntimeError:
                        # an operation that it does not know; what is wrong with the
                        # function itself shows below
                        pass
            # (not the function that was traced above, in which the parts of a run are
            # not joined)
            ordinary = jax.jit(
                lambda x: (otherwise or function)(x),
                compiler_options=_tier(use.options, quick),
            )
            return _finished(ordinary.lower(numbers), start, False, quick, place)

    return _cached_or(
        (*(subject or ("program", function)), longest), quick, device, make
    )


def fits_one_function(text: str, longest: int = LONGEST) -> bool:
    """Whether a lowered program is short enough and calls no library, which cannot be
    part of one function."""
    return "custom_call" not in text and text.count("\n") < longest


def _finished(
    lowered: jax.stages.Lowered,
    start: float,
    one_function: bool,
    quick: bool,
    device: Any = None,
    text: str | None = None,
) -> Program:
    """A lowered program, compiled; with a `device` it is looked up and kept there by
    its text."""
    text = lowered.as_text() if text is None else text
    # (the text is without arguments that the program ignores, and so is what is kept)
    shapes = tuple(
        (argument.shape, str(argument.dtype))
        for argument in jax.tree.leaves(lowered.args_info)
    )
    key = None if device is None else _cache.key_of("text", (text, shapes), device)
    trees = jax.tree.structure(lowered.args_info), lowered.out_tree
    kept = _cache.read(key, lambda stored: _restored(stored, trees, device))
    if kept is not None:
        return kept
    _forget_origins(lowered)
    traced = time.perf_counter()
    executable = lowered.compile()
    seconds = traced - start, time.perf_counter() - traced
    program = Program(executable, *seconds, one_function, quick, text.count("\n"))
    _keep(key, program)
    return program


def _forget_origins(lowered: jax.stages.Lowered) -> None:
    """Leave out where in the source each operation comes from, and under which names.

    A compiled program keeps that: a third of what is read from disk, and an eighth of
    the time to compile.
    """
    module: Any = lowered.compiler_ir()
    nowhere = type(module.operation.location).unknown(module.context)

    def forget(operation: Any) -> None:
        operation.location = nowhere
        for inner in itertools.chain.from_iterable(
            itertools.chain.from_iterable(operation.regions)
        ):
            forget(inner.operation)

    with contextlib.suppress(AttributeError):  # older versions of JAX cannot
        forget(module.operation)


def _stored(program: Program) -> tuple[Any, ...]:
    from jax.experimental.serialize_executable import serialize

    return serialize(program.call)[0], *program[1:]


def _trees(program: Program) -> list[PyTree]:
    """Arguments and results of a program with nothing in the places of numbers."""
    trees = jax.tree.structure(program.call.args_info), program.call.out_tree
    return [jax.tree.unflatten(tree, [0] * tree.num_leaves) for tree in trees]


@functools.cache
def _find_lapack() -> None:
    """Have JAX look up LAPACK, as it does when it lowers a call of it: before that a
    restored call goes nowhere."""
    jax.jit(jnp.linalg.inv).lower(np.eye(1))


def _restored(stored: tuple[Any, ...], trees: Sequence[Any], device: Any) -> Program:
    """A program out of the bytes of `_stored`, with the structures of its arguments and
    results."""
    from jax.experimental.serialize_executable import deserialize_and_load

    if b"lapack_" in stored[0]:
        with jax.default_device(device):
            _find_lapack()
    target = {"backend": device.client, "execution_devices": [device]}
    return Program(deserialize_and_load(stored[0], *trees, **target), *stored[1:])


class TieredProgram:
    """A program for an unknown number of runs, compiled quickly at first.

    When its runs have taken as long as compiling it again would, it is compiled with
    LLVM's optimiser in a thread, and that program takes over, in later processes from
    the start. So no number of runs costs more than twice what it would if it were
    known.

    - `quick`: whether it begins so
    """

    def __init__(self, make: Callable[[bool], Program], quick: bool = True) -> None:
        self._make = make
        self._spent = 0.0
        self._thread = None
        self.calls = 0
        self._program = make(quick)
        program = self._program  # optimised already, if that was cached
        self._worth = (
            program.trace_seconds + 2 * program.compile_seconds
            if program.quick
            else np.inf
        )
        self.lines = program.lines

    def call(self, numbers: Array) -> PyTree:
        start = time.perf_counter()
        result = jax.block_until_ready(self._program.call(numbers))
        self._spent += time.perf_counter() - start
        self.calls += 1
        if self._spent > self._worth and self._thread is None:
            self._thread = threading.Thread(
                target=self._improve, name="simbrake compiles"
            )
            self._thread.start()
        return result

    def _improve(self) -> None:
        self._program = self._make(False)


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
