"""States and forces of a run at any time, and integrals over it."""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from .._base._arguments import explained
from .._base._corners import greater
from ..hybrid import SKIPPED, Record
from ..hybrid.arrays import Array, TwoArrays, VectorM, numpy_of
from ..hybrid.system import ravel, unravel
from ..loads import Lever, cylinder_of, cylinders
from ..phases import of_running
from ..physics._brake import BrakeNow, BrakeSystem, State, piece_of
from ..physics.heated import surface_temperatures
from ..physics.mechanism import MechanismOutputs, Mode
from ..profiles import AbstractProfile
from .hook import HookNow, hook_of
from .programs import (
    LANES,
    Instants,
    RunJit,
    T,
    at_samples,
    in_lanes,
    is_traced_run,
    record_of,
)
from .torques import holding

#: steps of a long run, and instants in one call for it
LONG = 1024
_LANES_OF_LONG = 1024
#: instants to each of which a step is taken, in one call: for systems with many states,
#: for others, and for many instants of a long run
_LANES_OF_STEPS = (16, 128, 256)
_MANY_STATES = 24
#: instants inside the steps of a long run from which an optimised program pays
_MANY_INSTANTS = 2048


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


def tension_before(shown: MechanismOutputs, slack: VectorM) -> Float[Array, "m n"]:
    """Tension (N) of the band ahead of every lining; `slack`: at the slack end."""
    if shown.before is not None:
        return shown.before
    return numpy_of(slack).concatenate([slack[:, None], shown.tension[:, :-1]], axis=1)


class LazyProbe:
    """A `Probe` of one instant, without the axis of times. A field is computed when it is
    first read, so that a program contains only the fields that it reads."""

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
        if not isinstance(lever, Lever):
            return None
        return self._variables.lever_tension / lever.gain

    @property
    def slack_end_travel(self) -> Array:
        """How far elongation of the band and wear in the run let its slack end move (m);
        of linings that act as one."""
        travel = getattr(self.y.own, "x", None)
        travel = jnp.zeros(()) if travel is None else travel
        if self.y.worn is None:
            return travel
        linings: Any = self._system.grip.linings
        lost = sum(h for h in self.y.worn if h is not None)
        return travel + jnp.sum(linings.angle * lost)

    @functools.cached_property
    def actuator_pressure(self) -> Array | None:
        return _gauge_pressure(self._system, self.t, self.y, self.mode)


class WithTimeAxis:
    """The fields of a `LazyProbe` with an axis of one time, as functions of a `Probe`
    expect them."""

    def __init__(self, probe: LazyProbe) -> None:
        self._probe = probe

    def __getattr__(self, name: str) -> Any:
        return jax.tree.map(lambda x: jnp.asarray(x)[None], getattr(self._probe, name))


def probe_of(system: BrakeSystem, t: VectorM, y: State, mode: Mode) -> Probe:
    """The probe of given times, states and modes."""

    def of_instant(t: Array, y: State, mode: Mode) -> PyTree:
        probe = LazyProbe(system, t, y, mode)
        return [getattr(probe, name) for name in Probe._fields[3:]]

    return Probe(t, y, mode, *jax.vmap(of_instant)(t, y, mode))


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
    """The probe at the times `h` (s) after the start of rows, by partial steps of the
    method itself."""
    t, y = record.inside(index, h)
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[index])
    return probe_of(record.system, t, y, mode)  # pyright: ignore


def _probed(system: BrakeSystem, t: Array, y: State, mode: Mode) -> tuple[Probe, Array]:
    p = probe_of(system, t, y, mode)
    slopes = jax.vmap(system.rates)(t, y, mode, p.flows)
    return p._replace(t=None, y=None, mode=None), jax.vmap(
        lambda tree: ravel(tree, jnp.float64)
    )(slopes)


def _inside(record: Record, index: Array, h: Array) -> TwoArrays:
    t, y = record.inside(index, h, still=True)
    return t, jax.vmap(lambda y: ravel(y, jnp.float64))(y)


#: the first of each is compiled quickly, the second runs quickly
_PROBED = [RunJit(_probed, quick=quick) for quick in (True, False)]
_INSIDE = [RunJit(_inside, quick=quick) for quick in (True, False)]


def evaluate_at(
    record: Record,
    index: np.ndarray,
    instants: Instants,
    evaluate: Callable[[Probe, Array], T],
) -> T:
    """`evaluate(probe, rates)` in NumPy at the samples numbered `index` of a compact
    record outside of jit; `rates` of the flat states (m, …).

    All that evaluates runs of one structure shares one program, which computes the
    whole probe.
    """
    long = int(record.count) > LONG

    def find(system: BrakeSystem, t: Array, y: State, mode: Mode) -> T:
        p, rates = _PROBED[long](system, t, y, mode)
        return evaluate(p._replace(t=t, y=y, mode=mode), rates)

    return at_samples(record, find, index, instants, _LANES_OF_LONG if long else LANES)


def states_inside(record: Record, index: Int[Array, " m"], h: VectorM) -> TwoArrays:
    """Times and flat states at `h` (s) after the start of rows, of a compact record
    outside of jit.

    A call gets the rows that it needs, always the same number, and not the whole
    record: its cost does not grow with the length of the run, and runs of any length
    share one compiled program.
    """
    many = int(record.count) > LONG and len(index) >= _MANY_INSTANTS
    few, some, most = _LANES_OF_STEPS
    count = few if record.rows.y.shape[1] > _MANY_STATES else some
    count = most if many else count
    lanes = np.arange(count, dtype=np.int32)

    def call(index: np.ndarray, h: np.ndarray) -> TwoArrays:
        rows = jax.tree.map(lambda column: column[index], record.rows)
        return _INSIDE[many](dataclasses.replace(record, rows=rows), lanes, h)

    return in_lanes(call, np.asarray(index), np.asarray(h), lanes=count)


def states_at(record: Record, index: Int[Array, " m"], h: VectorM) -> State:
    """States by name at `h` (s) after the start of rows, of any run."""
    if is_traced_run(record):
        return record.inside(index, h)[1]
    return unravel(states_inside(record, index, h)[1], record.y_like)


def probe_many(record: Record, index: Int[Array, " m"], h: VectorM) -> Probe:
    """`probe_at` of a compact record outside of jit."""
    (t, y) = states_inside(record, index, h)
    mode = np.asarray(record.rows.mode)[np.asarray(index)]
    return evaluate_at(
        record, np.arange(len(t)), lambda i: (t[i], y[i], mode[i]), lambda p, _: p
    )


#: Gauss–Legendre points in every step: exact to the order 2 · 6 − 1, above that of the
#: methods that integrate
POINTS = 6


def as_tree(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A function as a PyTree, so that it can be an argument of a compiled program;
    PyTrees stay as they are."""
    if jax.tree.structure(function) == jax.tree.structure(0):
        return jax.tree_util.Partial(function)
    return function


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
