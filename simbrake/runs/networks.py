"""Thermal networks by themselves, and the cyclic steady state of a repeated duty."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.core import Tracer
from jaxtyping import Bool, Float, Int, PyTree

from .._base._arguments import explained
from .._base._compiling import Compiled
from .._base._faults import Fault, InputError
from .._base._part import as_arrays, faults_below, faults_of_values, is_traced
from .._base._quantity import faults_of_tolerance
from ..hybrid import (
    QUADRATURE,
    AbstractHybridSystem,
    AbstractMethod,
    Record,
    Settings,
    hybridsolve,
)
from ..hybrid.arrays import Array, VectorM
from ..hybrid.struct import with_fields
from ..outputs.metrics import closure_of
from ..outputs.probe import Number
from ..outputs.quantities import array_of_times
from ..parts.scene import Scene, remembering_at_start
from ..physics._brake import course_of_profile
from ..physics._sparsity import couplings
from ..physics._thermal import Conditions, Thermal, assemble_thermal
from ..profiles import is_piecewise_simple, near, next_known_time
from ..thermal.heat import Heat, initial_temperatures, node_names
from ..thermal.network import Junction, Reservoir
from .choice import stiff_heat
from .result import Result
from .simulate import Solver, as_method, simulate, solver_for

#: state: heat content of the nodes over their capacity, heat lost, supplied, and taken
#: by coolants (`None` without); mode: pieces of the profiles
Course = tuple[Array, Array, Array, Any]
Pieces = tuple[Int[Array, ""], ...]


class NetworkSystem(AbstractHybridSystem):
    """The network as a system without guards."""

    thermal: Thermal
    around: Conditions

    def rhs(self, t: Array, y: Course, mode: Pieces) -> Course:
        T = self.thermal.temperatures(y[0])
        T_J = self.thermal.junctions(T, t, self.around, mode)
        flows = self.thermal.flows(T, T_J, t, self.around, mode)
        stream = flows.coolant
        return (
            self.thermal.rise(flows.into),
            flows.lost,
            flows.supplied,
            stream and jnp.sum(stream.heat),
        )

    def guards(self, t: Array, y: Course, mode: Pieces) -> Float[Array, "1"]:
        return jnp.ones(1)

    def transition(
        self,
        t: Array,
        y: Course,
        mode: Pieces,
        fired: Bool[Array, " guard"],
        at_stop: Bool[Array, ""],
    ) -> tuple[Pieces, int]:
        _, turns = next_known_time(dict(enumerate(self.thermal.heat.profiles)), mode)
        return tuple(
            piece + (at_stop & turns[i]).astype(jnp.int32)
            for i, piece in enumerate(mode)
        ), 0

    def reset(self, t: Array, y: Course, before: Pieces, after: Pieces) -> Course:
        return y

    def next_stop(self, mode: Pieces, y: Any = None) -> Float[Array, ""] | float:
        return next_known_time(dict(enumerate(self.thermal.heat.profiles)), mode)[0]

    def near(self, mode: Pieces, after: Pieces) -> "NetworkSystem":
        return near(self, zip(self.thermal.heat.profiles, mode, after, strict=True))

    def scales(self) -> PyTree:
        return (
            jnp.full_like(self.thermal.capacity, 100.0),
            jnp.inf,
            jnp.inf,
            self._of_coolant(jnp.inf),
        )

    def couplings(self) -> PyTree:
        place = np.asarray(QUADRATURE)
        return couplings(self.thermal.heat), place, place, self._of_coolant(place)

    def _of_coolant(self, value: Any) -> Any:
        return value if self.thermal.heat.jackets else None


class HeatResult(NamedTuple):
    """Course of a network: times (m,) in s, temperatures (m, k) in K, heats in J,
    closure of their balance.

    `coolant`: heat that the coolants of jackets carried away, `None` without any; it is
    not among what is `lost`.

    Example:
        >>> heat = sb.lumped_heat(rim=2e5, partition=1.0, rim_cooling=20.0, temperature=400.0)
        >>> round(float(sb.simulate_heat(heat, [0.0, 60.0]).temperature[-1, 0]), 4)
        399.3608
    """

    t: VectorM
    temperature: Float[Array, "m k"]
    lost: VectorM
    supplied: VectorM
    closure: Array
    record: Record
    coolant: VectorM | None = None


def _around(heat: Heat, speed: Number, closed: Number, pressure: Number) -> Conditions:
    """Conditions of a network alone: the linings of a staged brake turn with its rim,
    those of others stand still."""
    track, closed, pressure = (jnp.asarray(x) for x in (speed, closed, pressure))
    return Conditions(
        track, 0.0 if heat.external is None else track, closed, (pressure,)
    )


def _run(
    heat: Heat,
    ts: Array,
    speed: Array,
    closed: Array,
    pressure: Array,
    rtol: Array,
    method: AbstractMethod,
    max_steps: int,
) -> HeatResult:
    thermal, u = assemble_thermal(heat)
    system = NetworkSystem(thermal, _around(heat, speed, closed, pressure))
    ts = jnp.asarray(ts, jnp.float64)
    mode = tuple(jnp.asarray(p.first_piece(ts[0]), jnp.int32) for p in heat.profiles)
    hidden = not all(is_piecewise_simple(p, course_of_profile) for p in heat.profiles)
    settings = Settings(
        rtol=jnp.asarray(rtol),
        max_events=jnp.asarray(1_000_000, jnp.int32),
        # a user-defined profile may hide a pulse
        max_step=(ts[-1] - ts[0]) / 64 if hidden else jnp.inf,
        max_steps=max_steps,
        guard_samples=0,
    )
    zero = jnp.zeros(())
    record = hybridsolve(
        system,
        (u, zero, zero, zero if heat.jackets else None),
        mode,
        ts[0],
        ts[-1],
        method,
        settings,
    )
    (course, lost, supplied, coolant), _ = record.at(ts)
    T = jax.vmap(thermal.temperatures)(course)
    stored = jnp.sum(thermal.capacity * (course[-1] - course[0]))
    closure = closure_of(
        stored, lost[-1], -supplied[-1], None if coolant is None else coolant[-1]
    )
    return HeatResult(ts, T, lost, supplied, closure, record, coolant)


_STATIC = ("method", "max_steps")
_traced = jax.jit(_run, static_argnames=_STATIC)
_compiled = Compiled(_run, static_argnames=_STATIC)


def check_heat(heat: Heat) -> None:
    """Raises `InputError` with all errors of a network."""
    if faults := faults_of_values(heat, "heat") or [
        *faults_below(heat, "heat"),
        *heat.faults_with("heat", 1),
    ]:
        raise InputError(faults)


@explained
def simulate_heat(
    heat: Heat,
    ts: Any,
    *,
    speed: Number = 0.0,
    closed: Number = 0.0,
    pressure: Number = 0.0,
    solver: Solver | None = None,
    rtol: Number = 1e-10,
    max_steps: int = 4096,
) -> HeatResult:
    """Temperatures of a network at the times `ts` (m,), without a brake: friction heat
    comes from `sources`, if at all.

    The run goes from the first of `ts` to the last.

    - `speed` (m/s) of the track, for convection; the linings of a staged brake turn
      with it
    - `closed`: 1 where linings cover their share and contacts that open are closed
    - `pressure` (Pa) of the linings,
      for contacts with a law of it
    - `solver`, `rtol`: as in `simulate`

    Differentiable and batchable like `simulate`. Raises `InputError` with all errors of
    the network, for times that decrease or a tolerance out of range, `RuntimeError` if
    the integration fails.
    """
    traced = is_traced((heat, ts, speed, closed, pressure, rtol))
    faults = faults_of_tolerance(rtol)
    if faults:
        raise InputError(faults)
    if not traced:
        check_heat(heat)
        ts = array_of_times(ts, "ts")
        if not np.all(np.isfinite(ts)) or np.any(np.diff(ts) < 0):
            raise InputError(
                [
                    Fault(
                        "ts",
                        "are not times in order",
                        "the run goes from the first to the last of them",
                    )
                ]
            )
    heat = as_arrays(heat)
    if solver is None:
        span = 0.0 if traced else float(ts[-1] - ts[0])
        solver = solver_for(traced or stiff_heat(heat, span)[0])
    method = as_method(solver).rolled()
    run = _traced if traced else _compiled
    numbers = (
        np.asarray(x, np.float64) if not isinstance(x, Tracer) else x
        for x in (speed, closed, pressure, rtol)
    )
    result = run(heat, ts, *numbers, method=method, max_steps=max_steps)
    if not traced and int(result.record.code) != 0:
        raise RuntimeError(
            f"the integration ended with code {int(result.record.code)}: raise "
            "max_steps, or loosen rtol"
        )
    return result


def _steady(
    heat: Heat,
    around: tuple[Number, Number, Number],
    power: Number | None,
    guess: Array | None,
) -> tuple[Array, Array]:
    thermal, u = assemble_thermal(heat)
    conditions = _around(heat, *around)
    pieces = tuple(jnp.asarray(p.first_piece(0.0), jnp.int32) for p in heat.profiles)
    zero = jnp.zeros(())
    start = thermal.temperatures(u) if guess is None else jnp.asarray(guess)

    def excess(T: Array, _: None) -> Array:
        T_J = thermal.junctions(T, zero, conditions, pieces)
        into = thermal.flows(T, T_J, zero, conditions, pieces).into
        if power is not None:
            P = jnp.atleast_1d(jnp.asarray(power))
            into = (
                into
                + thermal.deposit(
                    heat.friction, P, T, T_J, zero, conditions, pieces
                ).into
            )
        return into

    # each balance over its own conductance: what is left is in kelvin
    own = jax.lax.stop_gradient(jnp.abs(jnp.diagonal(jax.jacfwd(excess)(start, None))))

    def imbalance(T: Array, _: None) -> Array:
        return excess(T, None) / jnp.where(own > 0, own, 1.0)

    with jax.numpy_dtype_promotion("standard"):
        solution = optx.root_find(
            imbalance,
            optx.Newton(rtol=1e-10, atol=1e-9),
            start,
            max_steps=64,
            throw=False,
        )
    ok = solution.result == optx.RESULTS.successful
    T = jnp.where(ok, solution.value, jnp.nan)
    return T, thermal.junctions(T, zero, conditions, pieces)


_steady_traced = jax.jit(_steady)
_steady_compiled = Compiled(_steady)


@explained
def steady_state(
    heat: Heat,
    *,
    power: Number | None = None,
    speed: Number = 0.0,
    closed: Number = 0.0,
    pressure: Number = 0.0,
    guess: Array | None = None,
) -> dict[str, Array]:
    """Temperatures (K) at which no node of a network warms or cools any more, by name.

    - `power`: friction heat (W), one number or one per lining, that enters as
      `heat.friction` says
    - `speed` (m/s), `closed`, `pressure` (Pa): as in `simulate_heat`; profiles are
      taken at the time 0

    Newton's method on the balance of all nodes; differentiable (implicit function
    theorem). Raises `InputError` with all errors of the network, or where it has no
    outlet for its heat: then no steady state is determined.
    """
    traced = is_traced((heat, power, speed, closed, pressure))
    if not traced:
        check_heat(heat)
        if not any(isinstance(body, Reservoir) for body in heat.bodies):
            raise InputError(
                [
                    Fault(
                        "heat",
                        "has no reservoir",
                        "without an outlet its temperatures are not determined",
                    )
                ]
            )
    heat = as_arrays(heat)
    steady = _steady_traced if traced else _steady_compiled
    stores, junctions = steady(heat, (speed, closed, pressure), power, guess)
    if not traced and not np.all(np.isfinite(np.asarray(stores))):
        raise InputError(
            [
                Fault(
                    "heat",
                    "no steady state was found",
                    "a body may have no way to a reservoir",
                )
            ]
        )
    return dict(zip(node_names(heat), [*stores, *junctions], strict=True))


# --- the cyclic steady state --------------------------------------------------------


class CyclicState(NamedTuple):
    """Scene that starts in the cyclic steady state, its run over one cycle, and the
    remaining change (K).

    Example:
        >>> heat = sb.lumped_heat(rim=2e4, partition=1.0, rim_cooling=2e3)
        >>> found = sb.cyclic_steady_state(sb.Scene(scene.brake, scene.duty, scene.initial, 4.0, heat=heat))
        >>> round(float(found.scene.heat.bodies[0].temperature), 4)
        347.0303
    """

    scene: Scene
    result: Result
    change: float
    cycles: int  # runs it took to find it


@explained
def with_temperatures(heat: Heat, T: Float[Array, " k"]) -> Heat:
    """The same network, starting at `T` (k,) in K: one temperature per node with
    capacity, in their order.

    Example:
        >>> heat = sb.lumped_heat(rim=2e5, partition=1.0, rim_cooling=20.0)
        >>> sb.results.with_temperatures(heat, np.array([400.0])).bodies[0].temperature
        array(400.)
    """
    bodies = []
    at = 0
    for body in heat.bodies:
        if isinstance(body, Reservoir | Junction):
            bodies.append(body)
            continue
        temperature = T[at : at + body.count]
        at += body.count
        temperature = (
            np.reshape(temperature, ())
            if body.count == 1 and isinstance(temperature, np.ndarray)
            else temperature
        )
        bodies.append(with_fields(body, temperature=temperature))
    return with_fields(heat, bodies=tuple(bodies))


@explained
def cyclic_steady_state(
    scene: Scene,
    *,
    tolerance: float = 1e-7,
    cycles: int = 3,
    limit: int = 400,
    **options: Any,
) -> CyclicState:
    """Find the temperatures at which a cycle ends as it began, without running cycle
    after cycle.

    - `scene`: exactly one cycle, which starts and ends in the same mechanical state (at
      rest and held, say)
    - `tolerance` (K): largest change over a cycle that is left
    - `cycles`: runs in a row before the search
    - `limit`: maximum number of runs;  `options`: as for `simulate`

    The root of `P(T) − T`, `P` being one cycle, by Newton's method on a Krylov space
    (scipy's `newton_krylov`): a cycle that changes the temperatures by 1 % of what is
    still missing takes hundreds of runs in a row, here some dozens.

    Raises `InputError` if the scene has no heat, or a friction law with states;
    `RuntimeError` if no state is found within `limit` runs.
    """
    # imported where it is used: half a second of start-up
    from scipy.optimize import NoConvergence, newton_krylov

    if not scene.heated:
        raise InputError(
            [
                Fault(
                    "heat", "is missing", "a cyclic steady state is one of temperatures"
                )
            ]
        )
    if remembering_at_start(scene):
        raise InputError(
            [
                Fault(
                    "brake",
                    "has a friction law with states",
                    "run the cycles one after the other",
                )
            ]
        )
    heat = scene.network
    runs = 0

    def starting(T: np.ndarray) -> Scene:
        return with_fields(
            scene, heat=with_temperatures(heat, np.asarray(T, np.float64))
        )

    def change(T: np.ndarray) -> np.ndarray:
        nonlocal runs
        runs += 1
        if runs > limit:
            raise RuntimeError(
                f"no cyclic steady state within {limit} cycles: the friction may run "
                "away with the heat"
            )
        return np.asarray(simulate(starting(T), **options).end_temperatures) - T

    T = initial_temperatures(heat)
    for _ in range(cycles):
        T = T + change(T)
    left = change(T)
    if np.max(np.abs(left)) > tolerance:
        try:
            T = newton_krylov(
                change,
                T,
                f_tol=0.5 * tolerance,
                method="lgmres",
                rdiff=1e-6,
                inner_maxiter=len(T) + 1,
            )
        except NoConvergence as error:
            raise RuntimeError(
                "no cyclic steady state found: a cycle changes more than its tolerance allows"
            ) from error
        left = change(T)
    steady = starting(T)
    return CyclicState(
        steady, simulate(steady, **options), float(np.max(np.abs(left))), runs
    )
