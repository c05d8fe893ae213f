"""States and forces of a run at any time, integrals, and the capacity of its brake."""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from .._base._arguments import explained
from .._base._compiling import Compiled
from .._base._corners import greater
from .._base._part import is_traced
from .._base._progress import piece
from ..hybrid import SKIPPED, Record, smallest
from ..hybrid.arrays import Array, Mark, ScalarArray, TwoArrays, VectorM, numpy_of
from ..hybrid.system import ravel, unravel
from ..loads import Lever, cylinder_of, cylinders
from ..phases import of_running
from ..physics._brake import (
    BrakeNow,
    BrakeSystem,
    Capacity,
    State,
    load_piece,
    piece_of,
)
from ..physics._rope import ElasticRope
from ..physics.heated import surface_temperatures
from ..physics.mechanism import OPEN, MechanismOutputs, Mode, slips
from ..physics.shaft import Drive, Shaft, rests, way_of
from ..profiles import AbstractProfile

#: times looked at in one call of a compiled program, and in a long run
_LANES = 256
_LANES_OF_LONG = 1024
#: fewer where a step is taken to each: of systems with many states, of others, and in a
#: long run
_LANES_OF_STEPS = (16, 128, 256)
_MANY_STATES = 24
LONG = 1024  # steps of a long run
# times inside the steps of a long run from which on an optimised program for them pays
_MANY_LOOKS = 2048

T = TypeVar("T")
#: one number, or an array of them
Number = float | int | Array
#: what JSON has as a mapping
Entry = dict[str, Any]


class HookNow(NamedTuple):
    """The hook: travel downwards since the start (m), speed (m/s), `weight` on it,
    force `m (g − a)`, tension of the tightest line (N).

    Where the shaft has a loss of the tackle also the tensions of its `fast` and its
    `dead` line (N). On an elastic rope its stretch (m; below 0 it is slack).
    """

    travel: Array
    speed: Array
    weight: Any
    force: Array
    rope: Array
    fast: Any = None
    dead: Any = None
    stretch: Any = None
    deceleration: Any = None


class Probe(NamedTuple):
    """States, forces and margins at the times `t` (m,)."""

    t: VectorM
    y: State
    mode: Mode
    flows: BrakeNow
    shown: MechanismOutputs
    margins: Float[Array, "m marks"]
    # of the two sides of each lining; None without a band
    greater_tension: Float[Array, "m n"] | None
    # surface temperatures of rim, linings, band (m, nodes), where the scene has them
    surfaces: dict[str, Array]
    # load at rest, and static capacity of the brake in its direction (N·m), (m,) each
    holding: TwoArrays
    hook: HookNow | None
    lever_force: VectorM | None  # on the lever of the driller, where the scene has one
    # gauge pressure (Pa) of a cylinder, where the scene has one
    actuator_pressure: VectorM | None


def is_traced_run(record: Record) -> bool:
    """Whether a run is being traced: its times and states, or numbers of its system
    alone where nothing depends on them."""
    return is_traced(record)


def record_of(run: Any) -> Record:
    """The record of a `Result`, or a record as it is; a concrete one without skipped
    and unused rows."""
    record: Record = getattr(run, "record", run)
    return record if is_traced_run(record) else record.compact()


class RunJit(Compiled):
    """A function of concrete runs, compiled by itself; of traced ones it is part of
    their program."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if is_traced((arguments, named)):
            return self._function(*arguments, **named)
        return jax.tree.map(np.asarray, super().__call__(*arguments, **named))


def in_lanes(look: Callable[..., T], *columns: np.ndarray, lanes: int = _LANES) -> T:
    """`look(*columns)` of columns (m,) of any length, in calls of one length, so that
    it compiles once."""
    parts = []
    count = len(columns[0])
    for start in range(0, count, lanes):
        if count > lanes:  # shown as progress
            piece(start // lanes, -(-count // lanes))
        rows = np.minimum(np.arange(start, start + lanes), count - 1)
        values = look(*(column[rows] for column in columns))
        used = min(lanes, count - start)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], values))
    return (
        parts[0]
        if len(parts) == 1
        else jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)
    )


def tension_before(shown: MechanismOutputs, slack: VectorM) -> Float[Array, "m n"]:
    """Tension (N) of the band ahead of every lining; `slack`: at the slack end."""
    if shown.before is not None:
        return shown.before
    return numpy_of(slack).concatenate([slack[:, None], shown.tension[:, :-1]], axis=1)


class Sight:
    """Everything algebraic at one instant, each found when it is first read: a program
    holds what it reads alone.

    Fields are those of `Probe`, without the axis of times.
    """

    def __init__(self, system: BrakeSystem, t: Array, y: State, mode: Mode) -> None:
        self._system = system
        self.t = t
        self.y = y
        self.mode = mode

    @functools.cached_property
    def _variables(self) -> BrakeNow:
        return self._system.variables(self.t, self.y, self.mode)

    @functools.cached_property
    def _shown(self) -> tuple[BrakeNow, MechanismOutputs]:
        return self._system.shown(self.t, self.y, self.mode, self._variables)

    @property
    def flows(self) -> BrakeNow:
        return self._shown[0]

    @property
    def shown(self) -> MechanismOutputs:
        return self._shown[1]

    @property
    def margins(self) -> Array:
        return self._system.mechanism.lining_margins(self.mode, self._variables.contact)

    @functools.cached_property
    def greater_tension(self) -> Array | None:
        if self.shown.tension is None:
            return None
        shown, slack = jax.tree.map(
            lambda x: x[None], (self.shown, self.flows.contact.slack_tension)
        )
        return greater(shown.tension, tension_before(shown, slack))[0]

    @functools.cached_property
    def surfaces(self) -> dict[str, Array]:
        return surface_temperatures(self._system, self._variables)

    @functools.cached_property
    def holding(self) -> TwoArrays:
        return holding(self._system, self.t, self.y, self.mode)

    @functools.cached_property
    def hook(self) -> HookNow | None:
        return hook_of(self._system, self.y, self.mode, self._variables)

    @property
    def lever_force(self) -> Array | None:
        lever = self._system.lever
        return (
            self._variables.lever_tension / lever.gain
            if isinstance(lever, Lever)
            else None
        )

    @functools.cached_property
    def actuator_pressure(self) -> Array | None:
        return _gauge_pressure(self._system, self.t, self.y, self.mode)


class SightOfOne:
    """A `Sight` with an axis of one time, as functions of a `Probe` take it."""

    def __init__(self, sight: Sight) -> None:
        self._sight = sight

    def __getattr__(self, name: str) -> Any:
        return jax.tree.map(lambda x: jnp.asarray(x)[None], getattr(self._sight, name))


def seen_at(system: BrakeSystem, t: VectorM, y: State, mode: Mode) -> Probe:
    """Everything algebraic at many times, states and modes."""

    def look(t: Array, y: State, mode: Mode) -> PyTree:
        sight = Sight(system, t, y, mode)
        return [getattr(sight, name) for name in Probe._fields[3:]]

    return Probe(t, y, mode, *jax.vmap(look)(t, y, mode))


def _gauge_pressure(
    system: BrakeSystem, t: Array, y: State, mode: Mode
) -> Array | None:
    """Gauge pressure (Pa) of the cylinder behind the lever, 0 in phases without one;
    `None`: there is none."""
    if not any(cylinders(system.lever)):
        return None
    piece = piece_of(mode, "lever")

    def pressure(lever: AbstractProfile, t: Array) -> Any:
        cylinder = cylinder_of(lever)
        return jnp.zeros(()) if cylinder is None else cylinder.followed(t, piece)

    return of_running(system.lever_at(y, mode), t, pressure)


def probe_at(record: Record, index: Int[Array, " m"], h: VectorM) -> Probe:
    """Everything at the times `h` (s) after the start of the rows named, by a partial
    step of the method itself."""
    t, y = record.inside(index, h)
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[index])
    return seen_at(record.system, t, y, mode)  # pyright: ignore


def _seen(system: BrakeSystem, t: Array, y: State, mode: Mode) -> tuple[Probe, Array]:
    p = seen_at(system, t, y, mode)
    slopes = jax.vmap(system.rates)(t, y, mode, p.flows)
    return p._replace(t=None, y=None, mode=None), jax.vmap(
        lambda tree: ravel(tree, jnp.float64)
    )(slopes)


def _inside(record: Record, index: Array, h: Array) -> TwoArrays:
    t, y = record.inside(index, h, still=True)
    return t, jax.vmap(lambda y: ravel(y, jnp.float64))(y)


# the first of each is compiled quickly, the second runs quickly
_SEEN = [RunJit(_seen, quick=quick) for quick in (True, False)]
_INSIDE = [RunJit(_inside, quick=quick) for quick in (True, False)]

#: of samples numbered (m,): times (m,), flat states and flat modes (m, …)
Instants = Callable[[np.ndarray], tuple[Array, ...]]


def look_at(
    record: Record,
    index: np.ndarray,
    instants: Instants,
    see: Callable[[Probe, Array], T],
) -> T:
    """What `see(probe, rates)` makes in NumPy of the samples numbered `index` of a
    compact record outside of jit.

    One program for all that looks at runs of a structure, whatever of it is wanted;
    `rates` of the flat states (m, …).
    """
    long = int(record.count) > LONG

    def find(system: BrakeSystem, t: Array, y: State, mode: Mode) -> T:
        p, rates = _SEEN[long](system, t, y, mode)
        return see(p._replace(t=t, y=y, mode=mode), rates)

    return _in_lanes_of(
        record, find, index, instants, _LANES_OF_LONG if long else _LANES
    )


def states_inside(record: Record, index: Int[Array, " m"], h: VectorM) -> TwoArrays:
    """Times and flat states at `h` (s) after the start of the rows named, of a compact
    record outside of jit.

    A call gets the rows that it looks at, always as many, instead of the whole record:
    the work grows with the number of times, not with that times the length of the run,
    and runs of any length share one compiled program.
    """
    many = int(record.count) > LONG and len(index) >= _MANY_LOOKS
    few, some, most = _LANES_OF_STEPS
    count = most if many else few if record.rows.y.shape[1] > _MANY_STATES else some
    lanes = np.arange(count, dtype=np.int32)

    def call(index: np.ndarray, h: np.ndarray) -> TwoArrays:
        rows = jax.tree.map(lambda column: column[index], record.rows)
        return _INSIDE[many](dataclasses.replace(record, rows=rows), lanes, h)

    return in_lanes(call, np.asarray(index), np.asarray(h), lanes=count)


def states_at(record: Record, index: Int[Array, " m"], h: VectorM) -> State:
    """States by name at `h` (s) after the start of the rows named, of any run."""
    if is_traced_run(record):
        return record.inside(index, h)[1]
    return unravel(states_inside(record, index, h)[1], record.y_like)


def probe_many(record: Record, index: Int[Array, " m"], h: VectorM) -> Probe:
    """`probe_at` of a compact record outside of jit."""
    (t, y) = states_inside(record, index, h)
    mode = np.asarray(record.rows.mode)[np.asarray(index)]
    return look_at(
        record, np.arange(len(t)), lambda i: (t[i], y[i], mode[i]), lambda p, _: p
    )


# --- integrals over a run, by quadrature inside every step --------------------------

#: Gauss–Legendre points in every step: exact to the order 2 · 6 − 1, above that of the
#: methods that integrate
POINTS = 6


def as_tree(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A function as a PyTree, so that it can be an argument of a compiled program;
    PyTrees stay as they are."""
    leaf = jax.tree.structure(0)
    return (
        jax.tree_util.Partial(function)
        if jax.tree.structure(function) == leaf
        else function
    )


def _integrate(
    record: Record, pick: Callable[[Probe], PyTree], *, points: int
) -> PyTree:
    rows = record.rows
    n = rows.t.shape[0]
    row_numbers = jnp.arange(n, dtype=jnp.int32)
    used = (row_numbers < record.count) & (rows.kind != SKIPPED)
    span = jnp.where(
        used, rows.t[jnp.minimum(row_numbers + 1, record.count)] - rows.t, 0.0
    )
    nodes, weights = np.polynomial.legendre.leggauss(points)
    # rows that were never written hold nothing that could be looked at: there the first
    # row is, with weight 0
    index = jnp.repeat(jnp.where(used, row_numbers, 0), points)
    # (the time up to the next row, not the step, so that ends of steps move with their
    # events in derivatives)
    h = jnp.tile(jnp.asarray(0.5 * (nodes + 1)), n) * (
        rows.t[jnp.minimum(index + 1, record.count)] - rows.t[index]
    )
    values = pick(probe_at(record, index, h))
    weight = jnp.repeat(span, points) * jnp.tile(jnp.asarray(0.5 * weights), n)
    return jax.tree.map(lambda leaf: jnp.tensordot(weight, leaf, axes=1), values)


_integral = RunJit(_integrate, static_argnames=("points",))


@explained
def integral(
    run: Any, pick: Callable[[Probe], PyTree], *, points: int = POINTS
) -> PyTree:
    """`∫ pick(probe) dt` over a run, from its start to its end.

        ∫ q dt = Σ_steps h Σ_k w_k q(t + s_k h)        (Gauss–Legendre, `points` nodes s_k in each recorded step)

    - `run`: a `Result` or its record, concrete or traced; under `vmap` map the call,
      not a batch of results
    - `pick`: function of a probe of `m` times to an array (m, …), or a PyTree of such,
      from `p.t`, `p.y`, `p.mode`, `p.flows`, `p.shown` (friction pairs, tensions),
      `p.surfaces`. Use one function again, or a `jax.tree_util.Partial` of one: a new
      function compiles anew

    Between two events a run is smooth and its states inside a step are those of the
    method itself, so that the error is that of the integration. What is not smooth
    inside a step (linings that come to their limit one by one while a band is elastic)
    converges more slowly; `points` tells. Differentiable forward and reverse, ends of
    steps move with their events. Heat that is booked at an instant (a restart, a
    break-away, a release of an elastic band) is no integral and not in it.

    Example:
        >>> turned = sb.results.integral(result, lambda p: p.y.omega)
        >>> round(float(turned) / float(result["stopping_angle"]), 6)
        1.0
    """
    return _integral(record_of(run), as_tree(pick), points=points)


# --- capacity -----------------------------------------------------------------------

#: up to this share of the tension the lever may still move, at its present rate over
#: the time of the run so far
_AT_REST = 1e-3
#: speeds at which a balance of torques is looked for: so many on either side, up to
#: that many times the present one
_SPEEDS = 256
_FAR = 1e4
#: halvings of an interval around it, and Newton steps after them, which carry
#: derivatives
_HALVINGS = 50
_CARRY = 2


def capacity(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start: Array
) -> Capacity:
    """Load and capacity of a turning brake at the time `t` of a run that began at
    `start`."""
    lever = system.lever_at(y, mode)
    T_0, rate = jax.jvp(
        lambda t: lever.value(t, piece_of(mode, "lever")), (t,), (jnp.ones_like(t),)
    )
    if lever.controls_speed:
        follows = lever.follows(piece_of(mode, "lever"))
        T_0 = jnp.where(follows, lever.greatest(), T_0)
        rate = jnp.where(follows, 0.0, rate)
    settled = lever.is_settled(t) & (jnp.abs(rate) * (t - start) <= _AT_REST * T_0)
    for course in system.changes(y, mode).values():
        settled = settled & course.is_settled(t)
    load = driving(system, t, y.omega, y, mode)
    hanging = jnp.sign(y.omega) * system.hanging_torque(t, 0.0 * y.omega, mode, y)
    return Capacity(
        load,
        system.capacity(T_0, y.omega, y.own, system.surfaces(t, y, mode)),
        settled,
        hanging,
    )


def holding(system: BrakeSystem, t: Array, y: State, mode: Mode) -> TwoArrays:
    """Load on a pulley at rest, and the static capacity of the brake in its direction
    (N·m, both ≥ 0).

    The load is that of the instant, of an elastic rope its pull. A lever that follows
    the speed can pull to its limit.
    """
    z, surfaces = system.shaft_and_lever(t, y, mode)
    tension = z.lever_tension
    lever = system.lever_at(y, mode)
    piece = piece_of(mode, "lever")
    if lever.controls_speed:
        tension = jnp.where(lever.follows(piece), lever.greatest(), tension)
    load = system.load_torque(t, jnp.zeros_like(y.omega), mode, y)
    way = jnp.where(load < 0, -1.0, 1.0)
    pairs = system.capacity(tension, way, y.own, surfaces, static=True)
    return jnp.abs(load), smallest(pairs)


def driving(system: BrakeSystem, t: Array, omega: Array, y: State, mode: Mode) -> Array:
    """Torque (N·m) of the load in the direction of a rotation, less that of a motor and
    the other ones on the shaft.

    Of a load on an elastic rope that of its weight, about which the pull of the rope
    swings.
    """
    sense = jnp.sign(omega)
    load = system.hanging_torque(t, omega, mode, y)
    shaft = system.feature(Shaft)
    motor = system.feature(Drive)
    if shaft is not None:
        rest = system.hanging_torque(t, 0.0 * omega, mode, y)
        load = load - shaft.engaged(mode).turning(
            t, omega, rest, sense, shaft.pieces(mode)
        )
    if motor is not None:
        load = load - motor.torque(system, t, omega, y, mode)
    return sense * load


def stable_speed(net: Callable[[Array], Array], speed: Array) -> ScalarArray:
    """The steady speed (rad/s) that a shaft at `speed` > 0 tends to: the next stable
    zero of `net`, `inf` without one.

    - `net(ω)`: accelerating torque (N·m) at the speed `ω`

    From the present speed the shaft moves the way of `net`; the first zero that it
    meets is stable.
    """
    start = jax.lax.stop_gradient(speed)
    ratios = np.geomspace(1.0, _FAR, _SPEEDS + 1)
    up, down = jax.lax.stop_gradient(
        jax.vmap(jax.vmap(net))(start * jnp.asarray([ratios, 1 / ratios]))
    )
    still = up[0]
    speeds = start * jnp.where(still > 0, ratios, 1 / ratios)
    # (signed so that it is positive until the zero is met)
    values = jnp.where(still > 0, up, -down)
    met = values[1:] <= 0
    i = jnp.argmax(met)
    bracket = jnp.stack(
        [jnp.minimum(speeds[i], speeds[i + 1]), jnp.maximum(speeds[i], speeds[i + 1])]
    )

    def halve(ends: Array, _: None) -> tuple[Array, None]:
        middle = 0.5 * (ends[0] + ends[1])
        above = net(middle) > 0
        return jnp.stack(
            [jnp.where(above, middle, ends[0]), jnp.where(above, ends[1], middle)]
        ), None

    def newton(carry: TwoArrays, _: None) -> tuple[TwoArrays, None]:
        steady = carry[0]
        value, slope = jax.jvp(net, (steady,), (jnp.ones_like(steady),))
        return (steady - value / jnp.where(slope < 0, slope, -jnp.inf), slope < 0), None

    middle = jax.lax.stop_gradient(
        jnp.mean(jax.lax.scan(halve, bracket, None, length=_HALVINGS)[0])
    )
    (steady, stable), _ = jax.lax.scan(
        newton, (middle, still == 0), None, length=_CARRY
    )
    return jnp.where(jnp.any(met) & stable & (start > 0), steady, jnp.inf)


def net_torque(
    system: BrakeSystem, t: Array, y: State, mode: Mode
) -> Callable[[Array], Array]:
    """Accelerating torque (N·m) over the speed (rad/s, ≥ 0) in the sense of rotation:
    that of load and shaft, less what the sliding brake gives under the tension,
    temperatures and given functions of the instant `t`."""
    z, surfaces = system.shaft_and_lever(t, y, mode)
    tension = z.lever_tension
    sense = jnp.where(y.omega < 0, -1.0, 1.0)

    def net(speed: Array) -> Array:
        omega = sense * speed
        held = smallest(system.capacity(tension, omega, y.own, surfaces))
        return driving(system, t, omega, y, mode) - jnp.where(
            mode.band == OPEN, 0.0, held
        )

    return net


def is_led(system: BrakeSystem, y: State, mode: Mode) -> Array:
    """Whether the lever follows a speed."""
    return jnp.asarray(system.lever_at(y, mode).follows(piece_of(mode, "lever")))


def steady_speed(system: BrakeSystem, t: Array, y: State, mode: Mode) -> ScalarArray:
    """Speed (rad/s, ≥ 0) at which the torques of the instant `t` balance, `inf` where
    they do not.

    With the tension, the temperatures and the given functions of that instant; `inf`
    under a lever that holds the speed.
    """
    terminal = stable_speed(net_torque(system, t, y, mode), jnp.abs(y.omega))
    return jnp.where(is_led(system, y, mode), jnp.inf, terminal)


#: a balance this near (share of the speed) counts as steady
_STEADY = 1e-2


class Balance(NamedTuple):
    """Torques on a turning shaft at one instant.

    - `rises` (N·m): the accelerating torque
    - `steady`: whether the torques balance within 1 % of the speed, and would do so
      again after a change of it;  `tends`: whether they balance at some higher speed

    Under a lever that follows a speed the torques say nothing of this: `steady` and
    `tends` are false.
    """

    rises: ScalarArray
    steady: Mark
    tends: Mark


def balance_of(system: BrakeSystem, t: Array, y: State, mode: Mode) -> Balance:
    net = net_torque(system, t, y, mode)
    speed = jnp.abs(y.omega)
    speeds = jnp.stack([speed, _FAR * jnp.maximum(speed, system.sizes.speed)])
    torques, slopes = jax.vmap(
        lambda speed: jax.jvp(net, (speed,), (jnp.ones_like(speed),))
    )(speeds)
    balances = (slopes[0] < 0) & (jnp.abs(torques[0]) <= _STEADY * speed * -slopes[0])
    tends = (
        torques[1] <= 0
        if system.feature(Shaft) is None
        else stable_speed(net, speed) < jnp.inf
    )
    free = ~is_led(system, y, mode)
    return Balance(torques[0], free & balances & (speed > 0), free & tends)


def hook_of(system: BrakeSystem, y: State, mode: Mode, z: BrakeNow) -> HookNow | None:
    """The hook, where the load hangs on one."""
    load = system.load.on_layer(mode.layer)
    travelled = system.load.travelled(y.phi)
    piece = load_piece(mode)
    hanging = load.hanging(piece)
    travel = load.travel()
    if hanging is None or travel is None or travelled is None:
        return None
    elastic = system.feature(ElasticRope)
    rope = z.rope
    if elastic is not None:
        speed = y.hook.speed
        now = HookNow(
            travelled + elastic.stretched(system, y, mode),
            speed,
            rope.weight,
            rope.force,
            *_lines_of(system, mode, rope.force),
            stretch=rope.stretch,
        )
        acceleration = (rope.weight - rope.force) / rope.mass
    else:
        speed = y.omega * travel
        acceleration = travel * z.contact.alpha
        mass, weight = hanging
        force = weight - mass * acceleration
        pull = load.pull(force, travelled, z.contact.alpha, piece)
        lines = _lines_of(system, mode, pull)
        now = HookNow(jnp.asarray(travelled), speed, weight, force, *lines)
    return now._replace(deceleration=slowing(mode, speed, acceleration))


def slowing(mode: Mode, speed: Array, acceleration: Array) -> Array:
    """Deceleration `−d|v|/dt` of what moves at a speed, 0 at rest.

    Where the mode has a sense, of sliding or of a turning shaft with dry friction, it is
    that: at the very end of a motion the speed is 0, or beyond it by rounding.
    """
    xp = numpy_of(speed)
    sense = mode.sense
    known = slips(mode.band)
    if mode.turn is not None:
        is_open = mode.band == OPEN
        sense = xp.where(is_open, mode.turn, sense)
        known = known | is_open
    if mode.inner is not None:  # the pulley in its bandage
        sense = xp.where(mode.inner == 0, sense, mode.inner)
        known = known | (mode.inner != 0)
    moves = xp.where(known, xp.asarray(sense, np.float64), xp.sign(speed))
    return 0.0 - xp.where(rests(mode), 0.0, moves) * acceleration


def _lines_of(
    system: BrakeSystem, mode: Mode, pull: Array
) -> tuple[Array, Array | None, Array | None]:
    """Tensions (N) under a pull on the hook: of the tightest line, of the fast and of
    the dead one.

    Without a loss of the tackle all lines have the same. At rest each is the largest
    that it can be, and the fast line has the largest of all.
    """
    if system.load.lines is None:
        return pull, None, None
    lines = jnp.asarray(system.load.lines)
    shaft = system.feature(Shaft)
    tackle = None if shaft is None else shaft.tackle
    if tackle is None:
        return pull / lines, None, None
    way = way_of(mode)
    fast, dead = tackle.tensions(pull, lines, way)
    return jnp.where(way > 0, dead, fast), fast, dead


def can_lose_grip(system: BrakeSystem) -> bool:
    """Whether fade can leave a sliding brake of one pair, whose linings act as one,
    weaker than its load."""
    reads = (
        system.grip.reads.T or system.grip.remembers or bool(system.mechanism.profiles)
    )
    return reads and len(system.mechanism.pairs) == 1 and not system.mechanism.resolved


#: time, state and mode
EndOfRun = tuple[Array, State, Mode]


def ends_of(record: Record) -> tuple[EndOfRun, EndOfRun]:
    """Time, state and mode at the start and at the end of a run; NumPy's of a concrete
    one."""
    rows = record.rows
    first = [
        x[0] if is_traced_run(record) else np.asarray(x)[0]
        for x in (rows.t, rows.y, rows.mode)
    ]
    start = (
        first[0],
        unravel(first[1], record.y_like),
        unravel(first[2], record.mode_like),
    )
    return start, (record.t_end, record.y_end, record.mode_end)


def _capacity_at_each(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start: Array
) -> Capacity:
    return jax.vmap(capacity, in_axes=(None, 0, 0, 0, None))(system, t, y, mode, start)


_end_capacity = RunJit(capacity, quick=True)
_capacities = Compiled(_capacity_at_each, quick=True)


def end_capacity(record: Record) -> Capacity:
    """Load torque and capacity of the brake at the end of a run; meaningful where the
    pulley still turns."""
    (start, *_), end = ends_of(record)
    return _end_capacity(record.system, *end, start)


_terminal_speed = RunJit(steady_speed, quick=True)


def terminal_speed(record: Record) -> ScalarArray:
    """Steady speed (rad/s) at which the torques of the end of a run balance, `inf`
    where there is none."""
    return _terminal_speed(record.system, *ends_of(record)[1])


_balance = RunJit(balance_of, quick=True)


def runs_away(record: Record) -> Array:
    """Whether the load at the end of a run exceeds what brake and shaft give, also at
    any higher speed."""
    return (
        end_capacity(record).exceeded
        & ~_balance(record.system, *ends_of(record)[1]).tends
    )


def lowers_steadily(record: Record) -> Array:
    """Whether the torques on the shaft have brought the load to a steady speed at the
    end of a run."""
    return _balance(record.system, *ends_of(record)[1]).steady


def ends_driven(record: Record) -> Any:
    """Whether the motor runs at the end of a run."""
    motor = record.system.feature(Drive)  # pyright: ignore
    return np.False_ if motor is None else motor.follows(record.y_end, record.mode_end)


def capacities_at(record: Record, index: np.ndarray, instants: Instants) -> Capacity:
    """Load torque and capacity of the brake of a concrete record at the samples
    numbered `index`."""
    start = np.asarray(record.rows.t)[0]
    return _in_lanes_of(
        record, lambda system, *now: _capacities(system, *now, start), index, instants
    )


def _in_lanes_of(
    record: Record,
    find: Callable[..., T],
    index: np.ndarray,
    instants: Instants,
    lanes: int = _LANES,
) -> T:
    def look(index: np.ndarray) -> T:
        t, y, mode = instants(index)
        return find(
            record.system, t, unravel(y, record.y_like), unravel(mode, record.mode_like)
        )

    return in_lanes(look, index, lanes=lanes)
