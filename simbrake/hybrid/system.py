"""Interface of a hybrid system, and the flat vectors of the integrator."""

import abc
import enum
import itertools
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import DTypeLike
from jaxtyping import Float, Int, PyTree, Shaped

from .arrays import Array, Count, Mark, Scalar, State, TwoArrays
from .struct import Struct, structural, traced_once, with_fields


class Code(enum.IntEnum):
    """Status codes of an integration; codes of systems begin at `SYSTEM_CODES`.

    Example:
        >>> sb.hybrid.Code(int(result.record.code)).name
        'COMPLETED'
    """

    COMPLETED = 0
    STEP_LIMIT = 1
    EVENT_LIMIT = 2
    CHATTER = 3
    ZENO = 4
    NOT_FINITE = 5
    STEP_TOO_SMALL = 6


SYSTEM_CODES = 100
#: code of a transition that ends the run as completed, before its end time
ENDED = -1


class AbstractHybridSystem(Struct):
    """Ordinary differential equations `dy/dt = rhs(t, y, mode)` with modes, guards and
    jumps.

    - **State** `y`: any PyTree of floating arrays.
    - **Mode**: any PyTree of integer arrays, frozen between two events.
    - **Guards**: dimensionless numbers of order one, positive while the mode holds
      (`+1` where a guard does not matter), as any PyTree of floating arrays: in a
      dictionary or named tuple each has a name. A guard that goes negative is an event;
      it is located to the accuracy of the integrator. At a restart a guard that is 0
      within tolerance is unarmed: it fires only if it goes negative from there.
    - **Time breakpoints** (corners of given profiles) are no guards: `next_stop` names
      the next one and a step ends on it.

    Every number is an array leaf, so solutions can be differentiated with respect to
    all of them.

    Example:
        >>> isinstance(result.record.system, sb.hybrid.AbstractHybridSystem)
        True
    """

    @property
    def self_timed(self) -> bool:
        """Whether it sets its own times: `next_stop(mode, y)` depends on the state, and
        a run that reaches its end time ends with `code_at_end`. (`transition` may end
        it before, with the code `ENDED`.)"""
        return False

    @abc.abstractmethod
    def rhs(self, t: Scalar, y: PyTree, mode: PyTree) -> PyTree:
        """`dy/dt`, of the structure of `y`. Must extend smoothly a little past the end
        of its mode."""

    @abc.abstractmethod
    def guards(self, t: Scalar, y: PyTree, mode: PyTree) -> PyTree:
        """Guards, positive while `mode` holds."""

    @abc.abstractmethod
    def transition(
        self, t: Scalar, y: PyTree, mode: PyTree, fired: PyTree, at_stop: Mark
    ) -> tuple[PyTree, Count | int]:
        """The mode after an event and 0, or a code that ends the run: one ≥
        `SYSTEM_CODES`, or `ENDED`.

        `fired`, of the structure of the guards, marks every one that reached 0 at this
        instant, `at_stop` that a time breakpoint was reached. The mode need not be
        final: one whose guards are negative at once gives another event at the same
        instant.
        """

    def limits(self, mode: PyTree, guards: PyTree) -> PyTree | None:
        """Which guards, of their structure, are limits up to and including which the
        mode holds.

        A limit that is reached but not exceeded is no event. Where it is reached at a
        time breakpoint, that comes first: the limit fires after it, at the same
        instant, if it is exceeded from there. `None`: no guard is one.
        """
        return None

    @abc.abstractmethod
    def reset(self, t: Scalar, y: PyTree, before: PyTree, after: PyTree) -> PyTree:
        """The state just after a change of mode from `before` to `after`;
        differentiable in `t` and `y`."""

    @abc.abstractmethod
    def next_stop(self, mode: PyTree, y: Any = None) -> Scalar | float:
        """The next time breakpoint in this mode, `inf` where there is none; `y`: the
        state, of a `self_timed` system.

        Of several at one instant it is one, which `transition` passes alone: the others
        follow with steps of length 0. A minimum of all would share the derivative among
        them.
        """

    def near(self, mode: PyTree, after: PyTree) -> "AbstractHybridSystem":
        """The same system for one row of a run: of long lists it may keep those entries
        alone that its equations read in a mode, and in the one `after` it. All other
        numbers must stay the arrays that they are.

        So a derivative with respect to a list costs a row what these entries cost.
        """
        return self

    @abc.abstractmethod
    def scales(self) -> PyTree:
        """Typical size of every state, for the error norm; `inf` keeps a state (a
        ledger) out of the norm."""

    def typical_numbers(self) -> PyTree | None:
        """Typical size of every number of the system, one leaf like each (0: not
        known), or `None`.

        The steps of a differentiated run resolve derivatives along a change of every
        number by its size. That of a number that is 0, as of an effect that is absent,
        cannot be seen from its value.
        """
        return None

    def code_at_end(self, mode: PyTree) -> Count | int:
        """Code of a run that reaches its end time in this mode, of a `self_timed`
        system."""
        return 0

    def couplings(self) -> PyTree | None:
        """Coupling of the states, for methods that solve with the Jacobian: integer
        NumPy arrays, one like each state.

        `CORE` couples with everything; a number ≥ 0 is a place in the chain, which
        couples with its two neighbours and with the core; on a `QUADRATURE` no rate
        depends, unless its own is 0. A place in the chain whose rate is linear in the
        states, the same function of them at every time and in every mode of a run, is
        given as `place + LINEAR`: its row of the Jacobian is formed once, before the
        first step. `None`: everything with everything.
        """
        return None


class Instant(NamedTuple):
    """Quantities of a semi-explicit system at the instant of an event.

    Example:
        >>> record = result.record
        >>> now = record.system.instant(np.float64(0.1), record.y_end, record.mode_end)
        >>> float(now.y_rate.omega)
        0.0
    """

    t: Scalar
    y: PyTree
    mode: PyTree
    z: PyTree  # variables
    y_rate: PyTree  # dy/dt
    z_rate: PyTree  # dz/dt along the motion


class AbstractSemiExplicitSystem(AbstractHybridSystem):
    """A hybrid system whose equations share algebra: `z = variables(t, y, mode)`,
    `dy/dt = rates(t, y, mode, z)`.

    Forces and other shared terms are written once, in `variables`; rates, guards and
    changes of mode use them. `z` is a pure function of `(t, y, mode)` and of the
    system's numbers; it is not recorded, and derivatives through a run compute it
    again. Quantities that only the guards need are left out of the stages of a step.

    Example:
        >>> record = result.record
        >>> float(record.system.variables(0.1, record.y_end, record.mode_end).lever_tension)
        12000.0
    """

    @abc.abstractmethod
    def variables(self, t: Scalar, y: PyTree, mode: PyTree) -> PyTree:
        """`z`, everything algebraic at one instant: a PyTree of floating arrays."""

    @abc.abstractmethod
    def rates(self, t: Scalar, y: PyTree, mode: PyTree, z: PyTree) -> PyTree:
        """`dy/dt`, of the structure of `y`. Must extend smoothly a little past the end
        of its mode."""

    @abc.abstractmethod
    def margins(self, t: Scalar, y: PyTree, mode: PyTree, z: PyTree) -> PyTree:
        """The guards (see `guards`), positive while `mode` holds."""

    @abc.abstractmethod
    def change(
        self, now: Instant, fired: PyTree, at_stop: Mark
    ) -> tuple[PyTree, Count | int]:
        """The mode after an event, and a code (see `transition`). It may evaluate
        `variables` in other modes."""

    def rhs(self, t: Scalar, y: PyTree, mode: PyTree) -> PyTree:
        return self.rates(t, y, mode, variables_of(self, t, y, mode))

    def guards(self, t: Scalar, y: PyTree, mode: PyTree) -> PyTree:
        return self.margins(t, y, mode, variables_of(self, t, y, mode))

    def instant(self, t: Scalar, y: PyTree, mode: PyTree) -> Instant:
        """Variables and rates at one instant: `variables` is linearised once for all of
        them."""
        z, push = jax.linearize(lambda t, y: variables_of(self, t, y, mode), t, y)
        y_rate = jax.tree.map(jnp.asarray, self.rates(t, y, mode, z))
        return Instant(t, y, mode, z, y_rate, push(jnp.ones_like(t), y_rate))

    def transition(
        self, t: Scalar, y: PyTree, mode: PyTree, fired: PyTree, at_stop: Mark
    ) -> tuple[PyTree, Count | int]:
        return self.change(self.instant(t, y, mode), fired, at_stop)


@traced_once
def variables_of(
    system: AbstractSemiExplicitSystem, t: Scalar, y: PyTree, mode: PyTree
) -> PyTree:
    """`system.variables`, traced once for all systems of one structure, however often a
    program calls it."""
    return system.variables(t, y, mode)


class Settings(Struct):
    """Numbers that steer an integration (traced, except for those that shape the
    program).

    - `rtol`: relative tolerance, absolute ones being `rtol` times the typical size of a
      state
    - `max_step`: longest step; `guard_samples` points inside each step are checked for
      excursions of a guard
    - `max_events`, `max_chain` (events at one instant), `max_steps` (attempts): limits,
      each with its code

    Example:
        >>> sb.hybrid.Settings(rtol=1e-8, max_events=100).max_steps
        1024
    """

    rtol: Any
    max_events: Any
    max_step: Any = np.inf
    max_chain: int = structural(default=128)
    max_steps: int = structural(default=1024)
    guard_samples: int = structural(default=15)


# --- flat states and modes, recorded rows -------------------------------------------

#: outcome of one step attempt
SKIPPED, ADVANCED, FINISHED, LANDED, INSTANT, STOPPED = range(6)


Leaf = TypeVar("Leaf", bound=Array | jax.ShapeDtypeStruct)


def _parts(leaves: list[Leaf]) -> list[list[Leaf]]:
    """Leaves in order, scalars that follow each other together: in programs one
    equation takes or gives all of them."""
    runs = (
        (scalars, list(run))
        for scalars, run in itertools.groupby(leaves, key=lambda leaf: leaf.shape == ())
    )
    return [
        part
        for scalars, run in runs
        for part in ([run] if scalars else [[leaf] for leaf in run])
    ]


def unravel(flat: Shaped[Array, "*rows n"], like: PyTree) -> PyTree:
    """Entries along the last axis of an array as leaves shaped like those of `like`."""
    leaves, structure = jax.tree.flatten(like)
    parts = _parts(leaves)
    is_concrete = isinstance(flat, np.ndarray)
    sizes = [sum(int(np.size(leaf)) for leaf in part) for part in parts]
    if len(parts) < 2:
        pieces = [flat] * len(parts)
    elif is_concrete:
        pieces = np.split(flat, np.cumsum(sizes)[:-1], axis=-1)
    else:
        pieces = jax.lax.split(flat, sizes, axis=flat.ndim - 1)
    unravelled = []
    for piece, part in zip(pieces, parts, strict=True):
        if np.ndim(part[0]):
            unravelled.append(piece.reshape((*flat.shape[:-1], *np.shape(part[0]))))
        else:
            unravelled += (
                [piece[..., i] for i in range(len(part))]
                if is_concrete
                else jnp.unstack(piece, axis=-1)
            )
    return jax.tree.unflatten(structure, unravelled)


def ravel(tree: PyTree, dtype: DTypeLike) -> Array:
    """Join all leaves in one vector."""
    parts = _parts([jnp.asarray(leaf, dtype) for leaf in jax.tree.leaves(tree)])
    pieces = [
        jnp.ravel(part[0]) if np.ndim(part[0]) else jnp.stack(part) for part in parts
    ]
    if len(pieces) < 2:
        return pieces[0] if pieces else jnp.zeros(0, dtype)
    return jnp.concatenate(pieces)


def pack_mode(mode: PyTree) -> Int[Array, " mode"]:
    return ravel(mode, jnp.int32)


class Flat(Struct):
    """A hybrid system on flat vectors: state `(ny,)`, mode `(nm,)` of int32.

    Functions used repeatedly, for stages, guards and their derivatives, are traced once
    for all systems of one structure.
    """

    system: AbstractHybridSystem
    y_like: PyTree
    mode_like: PyTree

    def unpack_state(self, y: Array) -> PyTree:
        return unravel(y, self.y_like)

    def unpack_mode(self, mode: Array) -> PyTree:
        return unravel(mode, self.mode_like)

    @traced_once
    def rhs(self, t: Array, y: Array, mode: Array) -> Array:
        return _packed(self.system.rhs(t, self.unpack_state(y), self.unpack_mode(mode)))

    @traced_once
    def guards(self, t: Array, y: Array, mode: Array) -> Array:
        return _packed(
            self.system.guards(t, self.unpack_state(y), self.unpack_mode(mode))
        )

    def near(self, mode: Array, after: Array) -> "Flat":
        return with_fields(
            self,
            system=self.system.near(self.unpack_mode(mode), self.unpack_mode(after)),
        )

    def guards_like(self, t: Array, y: PyTree, mode: PyTree) -> PyTree:
        """Shapes of the guards, in their structure."""
        import equinox as eqx

        return eqx.filter_eval_shape(self.system.guards, t, y, mode)

    def reset(self, t: Array, y: Array, before: Array, after: Array) -> Array:
        modes = self.unpack_mode(before), self.unpack_mode(after)
        return _packed(_reset(self.system, t, self.unpack_state(y), *modes))

    def next_stop(self, mode: Array, y: Array) -> Array:
        arguments = (
            self.unpack_mode(mode),
            *([self.unpack_state(y)] if self.system.self_timed else []),
        )
        return jnp.asarray(self.system.next_stop(*arguments), jnp.float64)

    def ended(self, code: Array, status: Array) -> Array:
        """Status of a run after a transition with a code."""
        status = jnp.where(code > 0, code, status)
        return (
            jnp.where(code == ENDED, np.int32(Code.COMPLETED), status)
            if self.system.self_timed
            else status
        )

    def code_at_end(self, mode: Array) -> Array | np.int32:
        if not self.system.self_timed:
            return np.int32(Code.COMPLETED)
        return jnp.asarray(self.system.code_at_end(self.unpack_mode(mode)), jnp.int32)

    def rates_and_guards(
        self, t: Array, y: Array, mode: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Rates of the states, guards and their rates, and which guards are limits."""
        system = self.system
        y = self.unpack_state(y)
        mode = self.unpack_mode(mode)

        def marked(guards: PyTree) -> TwoArrays:
            g = _packed(guards)
            limits = system.limits(mode, guards)
            return g, jnp.zeros(g.shape, bool) if limits is None else ravel(
                limits, jnp.bool_
            )

        if isinstance(system, AbstractSemiExplicitSystem):
            now = system.instant(t, y, mode)
            moving = (jnp.ones_like(t), now.y_rate, now.z_rate)
            measured = jax.jvp(
                lambda t, y, z: marked(system.margins(t, y, mode, z)),
                (t, y, now.z),
                moving,
                has_aux=True,
            )
            return _packed(now.y_rate), *measured
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        moving = (jnp.ones_like(t), f)
        return _packed(f), *jax.jvp(
            lambda t, y: marked(system.guards(t, y, mode)), (t, y), moving, has_aux=True
        )

    def rates(self, t: Array, y: Array, mode: Array) -> TwoArrays:
        """Rates of states and guards, without derivatives."""
        import equinox as eqx

        numbers, rest = eqx.partition((self, t, y), eqx.is_inexact_array)
        still, t, y = eqx.combine(jax.lax.stop_gradient(numbers), rest)
        f, _, rate, _ = still.rates_and_guards(t, y, mode)
        return f, rate

    def jump(
        self, t: Array, y: Array, mode: Array, fired: Array, at_stop: Array
    ) -> tuple[Array, Array, Array]:
        """State, mode and code just after an event."""
        y = self.unpack_state(y)
        before = self.unpack_mode(mode)
        marks = unravel(fired, self.guards_like(t, y, before))
        after, code = self.system.transition(t, y, before, marks, at_stop)
        after = jax.tree.map(lambda label: jnp.asarray(label, jnp.int32), after)
        return (
            _packed(_reset(self.system, t, y, before, after)),
            pack_mode(after),
            jnp.asarray(code, jnp.int32),
        )


@traced_once
def _reset(
    system: AbstractHybridSystem, t: Array, y: PyTree, before: PyTree, after: PyTree
) -> PyTree:
    return system.reset(t, y, before, after)


def _packed(y: PyTree) -> Array:
    return ravel(y, jnp.float64)


def flatten(system: AbstractHybridSystem, y0: PyTree, mode0: PyTree) -> Flat:
    """`system` on flat vectors laid out like `y0` and `mode0`."""

    def templates(tree: PyTree, dtype: DTypeLike) -> PyTree:
        return jax.tree.map(
            lambda leaf: jax.ShapeDtypeStruct(np.shape(leaf), dtype), tree
        )

    return Flat(system, templates(y0, np.float64), templates(mode0, np.int32))


class Rows(Struct):
    """Recorded step attempts; row `i` starts at `t[i], y[i]` in `mode[i]`, row `count`
    is the end of the run.

    `h` is the step taken, `kind` one of SKIPPED (rejected or truncated), ADVANCED,
    LANDED (on guard `guard`, after a last move by `delta`), INSTANT (guard `guard`, no
    time passed), STOPPED (at a time breakpoint) and FINISHED.
    """

    t: Float[Array, " row"]
    y: Float[Array, "row state"]
    h: Float[Array, " row"]
    delta: Float[Array, " row"]
    kind: Int[Array, " row"]
    guard: Int[Array, " row"]
    mode: Int[Array, "row mode"]


HEAD = 5


def pack_row(
    t: Scalar,
    h: Scalar,
    delta: Scalar,
    kind: Count,
    guard: Count,
    y: State,
    mode: Int[Array, " mode"],
) -> Float[Array, " column"]:
    head = jnp.stack([t, h, delta, kind.astype(t.dtype), guard.astype(t.dtype)])
    return jnp.concatenate([head, y, mode.astype(t.dtype)])


def unpack_rows(packed: Float[Array, "row column"], ny: int) -> Rows:
    def integer(x: Array) -> Array:
        return jnp.round(x).astype(jnp.int32)

    return Rows(
        t=packed[..., 0],
        h=packed[..., 1],
        delta=packed[..., 2],
        kind=integer(packed[..., 3]),
        guard=integer(packed[..., 4]),
        y=packed[..., HEAD : HEAD + ny],
        mode=integer(packed[..., HEAD + ny :]),
    )
