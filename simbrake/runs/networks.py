"""Thermal networks by themselves, and the cyclic steady state of a repeated duty."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.core import Tracer
from jaxtyping import Bool, Float, Int, PyTree

from .._base._arguments import explained
from .._base._compiling import Compiled, TieredProgram, megabytes, run_device
from .._base._faults import InputError, Issues, input_error
from .._base._packing import pack
from .._base._part import (
    Part,
    as_arrays,
    faults_below,
    faults_of_values,
    is_traced,
    quantity,
)
from .._base._quantity import faults_of_tolerance
from .._base._store import MEMORY
from .._base._table import Table
from ..hybrid import (
    QUADRATURE,
    AbstractHybridSystem,
    AbstractMethod,
    Record,
    Settings,
    hybridsolve,
)
from ..hybrid.arrays import Array, NumberOrArray, VectorM
from ..hybrid.struct import with_fields
from ..outputs.metrics import closure_of
from ..outputs.quantities import array_of_times, ranges
from ..parts.at_start import remembering_at_start
from ..parts.scene import Scene
from ..physics._brake import course_of_profile
from ..physics._sparsity import couplings
from ..physics._thermal import Conditions, HeatFlows, Thermal, assemble_thermal
from ..profiles import (
    AbstractProfile,
    is_piecewise_simple,
    next_known_time,
    with_near_points,
)
from ..thermal.heat import Heat, initial_temperatures, node_names
from ..thermal.network import Junction, Reservoir, Source
from .choice import stiff_heat
from .result import Result
from .simulate import Solver, as_method, simulate, solver_for

#: state: heat content of the nodes over their capacity, heat lost, supplied, and taken
#: by coolants (`None` without); mode: pieces of the profiles
Course = tuple[Array, Array, Array, Any]
Pieces = tuple[Int[Array, ""], ...]
#: what acts on a network: the same at all times, or over time
Acting: TypeAlias = AbstractProfile | NumberOrArray


class Operation(Part):
    """What acts on a network by itself in place of a brake, each a number or a profile
    over time (`simulate_heat`)."""

    speed: AbstractProfile | Any = quantity("m/s", "speed of the track")
    closed: AbstractProfile | Any = quantity(
        "1", "share to which the band is closed", 0.0, 1.0, many=True
    )
    pressure: AbstractProfile | Any = quantity(
        "Pa", "pressure of the linings", low=0.0, many=True
    )
    power: AbstractProfile | Any = quantity(
        "W", "friction heat", many=True, default=None
    )

    @property
    def given(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """Those that are given over time, in the order of the fields."""
        return tuple(x for x in self.given.values() if isinstance(x, AbstractProfile))

    def at(self, t: Array, pieces: tuple[Any, ...]) -> dict[str, Any]:
        """All numbers at one instant by name."""
        left = iter(pieces)
        return {
            name: x.value(t, next(left)) if isinstance(x, AbstractProfile) else x
            for name, x in self.given.items()
        }


class NetworkSystem(AbstractHybridSystem):
    """The network as a system without guards; its mode has the pieces of all profiles,
    those of the `operation` last."""

    thermal: Thermal
    operation: Operation

    @property
    def profiles(self) -> dict[int, AbstractProfile]:
        """All profiles by their number in the mode."""
        inside = (*self.thermal.heat.profiles, *self.operation.profiles)
        return dict(enumerate(inside))

    def first_mode(self, t: Array) -> Pieces:
        """The mode at a start."""
        return tuple(
            jnp.asarray(profile.first_piece(t), jnp.int32)
            for profile in self.profiles.values()
        )

    def junctions_and_flows(
        self, T: Array, t: Array, mode: Pieces
    ) -> tuple[Array, HeatFlows]:
        """Temperatures of the junctions without friction, and all heat flows."""
        heat = self.thermal.heat
        now = self.operation.at(t, mode[len(heat.profiles) :])
        speed = jnp.asarray(now["speed"])
        # the linings of a staged brake turn with its rim, those of others stand still
        around = Conditions(
            speed,
            0.0 if heat.external is None else speed,
            jnp.asarray(now["closed"]),
            (jnp.asarray(now["pressure"]),),
        )
        T_J = self.thermal.junctions(T, t, around, mode)
        flows = self.thermal.flows(T, T_J, t, around, mode)
        if now["power"] is None:
            return T_J, flows
        P = jnp.atleast_1d(jnp.asarray(now["power"]))
        friction = self.thermal.deposit(heat.friction, P, T, T_J, t, around, mode)
        stream = flows.coolant
        return T_J, flows._replace(
            into=flows.into + friction.into,
            lost=flows.lost + friction.lost,
            supplied=flows.supplied + jnp.sum(P),
            coolant=stream and stream._replace(heat=stream.heat + friction.coolant),
        )

    def rhs(self, t: Array, y: Course, mode: Pieces) -> Course:
        T = self.thermal.temperatures(y[0])
        _, flows = self.junctions_and_flows(T, t, mode)
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
        _, turns = next_known_time(self.profiles, mode)
        return tuple(
            piece + (at_stop & turns[i]).astype(jnp.int32)
            for i, piece in enumerate(mode)
        ), 0

    def reset(self, t: Array, y: Course, before: Pieces, after: Pieces) -> Course:
        return y

    def next_stop(self, mode: Pieces, y: Any = None) -> Float[Array, ""] | float:
        return next_known_time(self.profiles, mode)[0]

    def near(self, mode: Pieces, after: Pieces) -> "NetworkSystem":
        return with_near_points(
            self, zip(self.profiles.values(), mode, after, strict=True)
        )

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

    def _table(self) -> Table:
        nodes = node_names(self.record.system.thermal.heat)  # pyright: ignore
        columns: list[Any] = [("t", self.t, "s", "time")]
        columns += [
            (f"temperature[:, {i}]", self.temperature[..., i], "K", name)
            for i, name in enumerate(nodes)
        ]
        heats = ("lost", "supplied", "coolant")
        columns += [(name, getattr(self, name), "J", "heat") for name in heats]
        return ranges(columns, f"Network at {np.shape(self.t)[-1]} times")

    def __repr__(self) -> str:
        return str(self._table())

    def _repr_html_(self) -> str:
        return self._table()._repr_html_()


def _run(
    heat: Heat,
    ts: Array,
    operation: Operation,
    rtol: Array,
    method: AbstractMethod,
    max_steps: int,
) -> HeatResult:
    thermal, u = assemble_thermal(heat)
    system = NetworkSystem(thermal, operation)
    ts = jnp.asarray(ts, jnp.float64)
    profiles = system.profiles.values()
    hidden = not all(is_piecewise_simple(p, course_of_profile) for p in profiles)
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
        system.first_mode(ts[0]),
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


def _compiled(*arguments: Any, **static: Any) -> HeatResult:
    """`_run` of numbers, as one function where XLA can do that: points of histories
    cost a tenth then."""
    numbers, packing = pack(arguments)
    subject = ("network", packing, *static.values())

    def make() -> TieredProgram:
        def run(numbers: Array) -> HeatResult:
            return _run(*packing.unpack(numbers), **static)

        long = static["max_steps"] > _LONG
        return TieredProgram(run, numbers, subject, quick=not long)

    return MEMORY.get((*subject, run_device()), make, megabytes).call(numbers)


#: step attempts of a network, and how many more for each point of a history
_STEPS = 4096
_STEPS_OF_POINT = 8
#: step attempts above which a program is compiled with LLVM's optimiser at once
_LONG = 32_768


def _points(profile: AbstractProfile) -> int:
    """NumberOrArray of points of a profile, at least roughly."""
    return max([profile.knot_count, *map(np.size, jax.tree.leaves(profile))])


def _checked(
    heat: Heat,
    faults: Issues,
    speed: Any,
    power: Any,
    air: Any,
    coolant: Any,
    *closed: Any,
) -> tuple[Heat, Operation]:
    """The network with the temperatures and sources given to `simulate_heat`, and all
    else that acts on it; raises `InputError` with all errors, those found before
    included."""

    def made(kind: type, *about: Any, name: str = "") -> Any:
        try:
            return kind(*about)
        except InputError as error:
            for fault in error.faults:
                path = name or fault.path.removeprefix(f"{kind.__name__}.")
                faults.append(replace(fault, path=path))
            return None

    here = {body.name: body for body in heat.bodies if isinstance(body, Reservoir)}
    inlets = {jacket.b for jacket in heat.jackets.values()}
    for name, places, T in (("air", {"air"}, air), ("coolant", inlets, coolant)):
        if T is not None and not (places and places <= {*here}):
            there = ", ".join(here) or "none"
            what = "the network has no such reservoir"
            faults.add(name, what, f"reservoirs: {there}; give one its temperature")
        elif T is not None and (new := made(Reservoir, name, T, name=name)):
            here |= {place: with_fields(new, name=place) for place in places}
    sources = [*heat.sources]
    if isinstance(power, Mapping):
        more = [
            made(Source, place, P, name=f"power[{place!r}]")
            for place, P in power.items()
        ]
        sources += [source for source in more if source is not None]
        power = None
    elif power is not None and heat.friction is None:
        what = "the network has no friction pair that it could enter"
        faults.add("power", what, "give its places, as in {'rim': 2000.0}")
    operation = made(Operation, speed, *closed, power)
    bodies = tuple(here.get(body.name, body) for body in heat.bodies)
    heat = with_fields(heat, bodies=bodies, sources=tuple(sources))
    if not is_traced((heat, operation)):
        faults.attempt(check_heat, heat)
        faults += faults_of_values(operation)
        faults += faults_below(operation)
    faults.report()
    return as_arrays((heat, operation))


def _in_order(ts: Any) -> Array:
    """Times of a run; raises `InputError` where they decrease or are none."""
    ts = array_of_times(ts, "ts")
    if np.all(np.isfinite(ts)) and np.all(np.diff(ts) >= 0):
        return ts
    hint = "the run goes from the first to the last of them"
    raise input_error("ts", "are not times in order", hint)


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
    speed: Acting = 0.0,
    power: Mapping[str, Acting] | Acting | None = None,
    air: Acting | None = None,
    coolant: Acting | None = None,
    closed: Acting = 0.0,
    pressure: Acting = 0.0,
    solver: Solver | None = None,
    rtol: NumberOrArray = 1e-10,
    max_steps: int | None = None,
) -> HeatResult:
    """Temperatures of a network at the times `ts` (m,), without a brake.

    The run goes from the first of `ts` to the last. All that acts on the network is a
    number or a profile over time (`PiecewiseLinear`, `profiles.held`,
    `files.histories`):

    - `speed` (m/s) of the track, for convection; the linings of a staged brake turn
      with it
    - `power` (W): heat into places, `{"disc": profile}`, besides the network's
      `sources`; or friction heat that enters as `heat.friction` says
    - `air` (K): temperature of the reservoir `air`; `coolant` (K): of the inlets of all
      jackets. Without them the network has its own
    - `closed`: 1 where linings cover their share and contacts that open are closed
    - `pressure` (Pa) of the linings, for contacts with a law of it
    - `solver`, `rtol`: as in `simulate`;  `max_steps`: step attempts, by default 4096
      and 8 for each point of a history

    Every point is a time at which a step ends; before its first point and after its
    last a history is constant. Differentiable and batchable like `simulate`. Raises
    `InputError` with all errors of network and histories, for times that decrease or a
    tolerance out of range, `RuntimeError` if the integration fails.

    Example:
        >>> disc = (sb.thermal.Lump("disc", "4 kJ/K"), sb.thermal.Reservoir("air"))
        >>> cooling = sb.thermal.Convection("disc", 0.1, sb.thermal.LinearCoefficient(10.0, 2.0))
        >>> stops = sb.PiecewiseLinear([0.0, 3.0, 3.0, 60.0], [40e3, 0.0, 0.0, 0.0])
        >>> speed = sb.PiecewiseLinear([0.0, 3.0, 60.0], [50.0, 10.0, 50.0])
        >>> run = sb.simulate_heat(sb.Heat(disc, (cooling,)), [0.0, 3.0, 60.0], speed=speed, power={"disc": stops})
        >>> run.temperature[:, 0].round(2).tolist()
        [293.15, 308.11, 306.69]
    """
    faults = Issues(faults_of_tolerance(rtol))
    acting = (speed, power, air, coolant, closed, pressure)
    traced = is_traced((heat, ts, acting, rtol))
    times: Any = ts if traced else faults.attempt(_in_order, ts)
    heat, operation = _checked(heat, faults, *acting)
    if solver is None:
        span = 0.0 if traced else float(times[-1] - times[0])
        solver = solver_for(traced or stiff_heat(heat, span)[0])
    method = as_method(solver).rolled()
    if max_steps is None:
        points = sum(map(_points, (*heat.profiles, *operation.profiles)))
        max_steps = _STEPS + _STEPS_OF_POINT * points
    run = _traced if traced else _compiled
    result = run(
        heat,
        times,
        operation,
        rtol if isinstance(rtol, Tracer) else np.asarray(rtol, np.float64),
        method=method,
        max_steps=max_steps,
    )
    if not traced and int(result.record.code) != 0:
        raise RuntimeError(
            f"the integration ended with code {int(result.record.code)}: raise "
            "max_steps, or loosen rtol"
        )
    return result


def _steady(
    heat: Heat, operation: Operation, guess: Array | None
) -> tuple[Array, Array]:
    thermal, u = assemble_thermal(heat)
    system = NetworkSystem(thermal, operation)
    zero = jnp.zeros(())
    mode = system.first_mode(zero)
    start = thermal.temperatures(u) if guess is None else jnp.asarray(guess)

    def excess(T: Array, _: None) -> Array:
        return system.junctions_and_flows(T, zero, mode)[1].into

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
    return T, system.junctions_and_flows(T, zero, mode)[0]


_steady_traced = jax.jit(_steady)
_steady_compiled = Compiled(_steady)


@explained
def steady_state(
    heat: Heat,
    *,
    power: Mapping[str, Acting] | Acting | None = None,
    speed: Acting = 0.0,
    closed: Acting = 0.0,
    pressure: Acting = 0.0,
    guess: Array | None = None,
) -> dict[str, Array]:
    """Temperatures (K) at which no node of a network warms or cools any more, by name.

    - `power`: friction heat (W), one number or one per lining, that enters as
      `heat.friction` says; or by place as in `simulate_heat`
    - `speed` (m/s), `closed`, `pressure` (Pa): as in `simulate_heat`; profiles are
      taken at the time 0

    Newton's method on the balance of all nodes; differentiable (implicit function
    theorem). Raises `InputError` with all errors of the network, or where it has no
    outlet for its heat: then no steady state is determined.
    """
    acting = (speed, power, None, None, closed, pressure)
    traced = is_traced((heat, acting))
    heat, operation = _checked(heat, Issues(), *acting)
    if not traced and not any(isinstance(body, Reservoir) for body in heat.bodies):
        raise input_error(
            "heat",
            "has no reservoir",
            "without an outlet its temperatures are not determined",
        )
    steady = _steady_traced if traced else _steady_compiled
    stores, junctions = steady(heat, operation, guess)
    if not traced and not np.all(np.isfinite(np.asarray(stores))):
        raise input_error(
            "heat",
            "no steady state was found",
            "a body may have no way to a reservoir",
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
        raise input_error(
            "heat", "is missing", "a cyclic steady state is one of temperatures"
        )
    if remembering_at_start(scene):
        raise input_error(
            "brake",
            "has a friction law with states",
            "run the cycles one after the other",
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
