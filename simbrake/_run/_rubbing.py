"""What rubs at every lining, and what of it adds up over a run: friction work, wear, means and greatest values."""

import functools
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.tree_util import Partial
from jaxtyping import Float

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._base._quantity import as_number
from .._hybrid import Record
from .._hybrid._arrays import Array
from ._integral import POINTS, as_tree, integral, is_traced
from ._metrics import peak
from ._probe import Probe

#: wear rate `I` (m³/(N·m)): a number, one per lining, or a function `I(p, v, T)` of pressure, slip speed, temperature
WearRate = float | Array | Callable[..., Any]

#: quantities of a lining that have means and greatest values, with their units
QUANTITIES = {
    "tension_increment": "N",
    "normal_load": "N",
    "pressure": "Pa",
    "slip_speed": "m/s",
    "friction_power": "W",
}

WEIGHTS = ("time", "slip", "work")


class Rubbing(NamedTuple):
    """One friction pair of every lining at one or many instants, (m, n) or (n,).

    `increment` is the friction at the radius of the slip: its power is `increment · v_i`. Under a band it is the
    difference of tensions, `|T_i − T_{i−1}| = f_i N_i/cos(β_i/2)`: the friction `f_i N_i` acts where the band's ends
    meet, at `R_b/cos(β_i/2)` (model §1).
    """

    increment: Array
    normal: Array
    speed: Array  # |v| ≥ 0, 0 while the lining sticks
    pressure: Any  # N/A, `None` without areas
    temperature: Any  # that the pair's friction law sees, `None` where the scene has none


def fault_of_pair(pair: str, known: Iterable[str]) -> Fault | None:
    """What is wrong with the name of a friction pair in a brake with the pairs `known`."""
    names = list(known)
    return None if pair in names else Fault("pair", f"the brake has no {pair!r} pair", f"it has: {', '.join(names)}")


def rubbing(record: Record, p: Probe, *, pair: str = "external") -> Rubbing:
    """Forces, slip speeds, pressures and temperatures of the linings in a probe.

    - `pair`: its name; `external` is the one on which the lever acts, of a staged brake band on linings, beside
      `internal`, linings on rim

    Raises `InputError` for a pair that the brake does not have.
    """
    system: Any = record.system
    if fault := fault_of_pair(pair, system.pair_names):
        raise InputError([fault])
    number = system.pair_names.index(pair)
    now, area = p.shown.pairs[number], system.mechanism.pairs[number].area
    T = None if system.thermal is None else jax.vmap(lambda u: system.sensed(u)[number])(p.y.heat)
    T = None if T is None else jnp.broadcast_to(T, now.normal.shape)
    pressure = None if area is None else now.normal / jnp.asarray(area)
    return Rubbing(jnp.abs(now.force), now.normal, jnp.abs(now.slip), pressure, T)


# --- what is picked out of a probe: functions of the module, so that each compiles once ------------------------------


def _power(record: Record, pair: str, p: Probe) -> Array:
    r = rubbing(record, p, pair=pair)
    return r.increment * r.speed


def wearing(rate: Any, r: Rubbing) -> Array:
    """Rate of wear `ḣ = I p v` (m/s) of linings that rub; `rate` as in `wear`."""
    value = rate(r.pressure, r.speed, r.temperature) if callable(rate) else jnp.asarray(rate)
    return value * r.pressure * r.speed


def _wear(record: Record, pair: str, rate: Any, p: Probe) -> Array:
    return wearing(rate, rubbing(record, p, pair=pair))


def quantity_of(quantity: str, r: Rubbing) -> Array:
    """One of `QUANTITIES` of linings that rub."""
    if quantity == "friction_power":
        return r.increment * r.speed
    names = {"tension_increment": "increment", "normal_load": "normal", "slip_speed": "speed"}
    return getattr(r, names.get(quantity, quantity))


def _weighted(record: Record, pair: str, quantity: str, over: str, p: Probe) -> tuple[Array, Array]:
    r = rubbing(record, p, pair=pair)
    weight = {"time": jnp.ones_like(r.speed), "slip": r.speed, "work": r.increment * r.speed}[over]
    return weight * quantity_of(quantity, r), weight


def _pick(function: Callable[..., Any], record: Record, *static: str, rate: Any = None) -> Any:
    """`function` of the record and its words as a PyTree that compiles once for each structure."""
    words = _words(function, static)
    return Partial(words, record) if rate is None else Partial(words, record, rate)


@functools.cache
def _words(function: Callable[..., Any], static: tuple[str, ...]) -> Callable[..., Any]:
    def picked(record: Record, *rest: Any) -> Any:
        return function(record, *static, *rest)

    return picked


def _compact(run: Any) -> Record:
    record: Record = getattr(run, "record", run)
    return record if is_traced(record) else record.compact()


# --- over a run -------------------------------------------------------------------------------------------------------


def _check(run: Any, *, pair: str, over: str = "time", quantity: str = "slip_speed", area: bool = False) -> None:
    record: Record = getattr(run, "record", run)
    system: Any = record.system
    missing = fault_of_pair(pair, system.pair_names)
    found = [] if missing is None else [missing]
    if over not in WEIGHTS:
        found.append(Fault("over", f"{over!r} is no weight", f"there are: {', '.join(WEIGHTS)}"))
    if quantity not in QUANTITIES:
        found.append(Fault("quantity", f"{quantity!r} is none", f"there are: {', '.join(QUANTITIES)}"))
    if (area or quantity == "pressure") and not found:
        found += faults_of_area(system, pair)
    if found:
        raise InputError(found)


def faults_of_area(system: Any, pair: str) -> list[Fault]:
    """The fault of a pair whose pressure is asked for and whose linings have no areas."""
    one = system.mechanism.pairs[system.pair_names.index(pair)]
    return [] if one.area is not None else [Fault(f"brake.{one.field}.area", "is missing", "a pressure is looked at")]


def friction_work(run: Any, *, pair: str = "external", points: int = POINTS) -> Float[Array, " n"]:
    """Friction work of every lining over a run, in J.

        W_i = ∫ |T_i − T_{i−1}| |v_i| dt,   |T_i − T_{i−1}| = f_i N_i/cos(β_i/2)                       (model §1, §6.1)

    Its sum is the friction heat of the pair in the ledger, less the heat of jumps (restart, break-away, release of an
    elastic band), which is booked at an instant for the band as a whole and belongs to no lining.

    - `run`: a `Result` or its record, concrete or traced;  `pair`: as in `rubbing`;  `points`: as in `integral`

    Raises `InputError` for a pair that the brake does not have.
    """
    _check(run, pair=pair)
    record = _compact(run)
    return integral(record, _pick(_power, record, pair), points=points)


def wear(run: Any, rate: WearRate, *, pair: str = "external", points: int = POINTS) -> Float[Array, " n"]:
    """Depth worn off every lining over a run, in m (model §7; Archard).

        h_i = ∫ I(p_i, v_i, T_i) p_i v_i dt,   p_i = N_i/A_i

    - `rate` `I` (m³/(N·m) = m²/N): a number, one per lining, or a function of pressure (Pa), slip speed (m/s) and the
      temperature (K) that the pair's friction law sees (`None` without heat), each (m, n); use one function again, as
      each compiles anew, or a `jax.tree_util.Partial` or an `equinox.Module` with its numbers as leaves

    The wear does not act back on the run. Raises `InputError` where the areas are missing.

    Reference: J. F. Archard, *J. Appl. Phys.* 24 (1953) 981.
    """
    _check(run, pair=pair, area=True)
    record = _compact(run)
    rate = as_tree(rate) if callable(rate) else jnp.asarray(as_number(rate))
    return integral(record, _pick(_wear, record, pair, rate=rate), points=points)


def lining_mean(
    run: Any, quantity: str, *, over: str = "slip", pair: str = "external", points: int = POINTS
) -> Float[Array, " n"]:
    """Mean of a quantity of every lining over a run, `∫ q w dt/∫ w dt`.

    - `quantity`: `tension_increment` `|T_i − T_{i−1}|` (N), `normal_load` `N_i` (N), `pressure` `N_i/A_i` (Pa),
      `slip_speed` (m/s), `friction_power` (W)
    - `over`: the weight `w`: `time` 1, `slip` `|v_i|` (the mean over the distance that the lining rubs), `work` the
      lining's own friction power

    `nan` where the weight is 0 throughout. With an elastic band the mean over time looks at the time before full slip
    as well, where linings come to their limit one by one inside a step: there the quadrature converges slowly.
    """
    _check(run, pair=pair, over=over, quantity=quantity)
    record = _compact(run)
    above, below = integral(record, _pick(_weighted, record, pair, quantity, over), points=points)
    return above / below


def _peaks(record: Record, pair: str, quantity: str) -> Array:
    def of(i: Array) -> Array:
        def pick(p: Probe) -> Array:
            return jnp.take(quantity_of(quantity, rubbing(record, p, pair=pair)), i[None], axis=1)

        return peak(record, pick).value

    system: Any = record.system
    return jax.vmap(of)(jnp.arange(system.linings.count, dtype=jnp.int32))


_peaks_compiled = DeviceJit(_peaks, static_argnames=("pair", "quantity"))


def lining_peak(run: Any, quantity: str, *, pair: str = "external") -> Float[Array, " n"]:
    """Greatest value over a run of a quantity of every lining (`quantity` and `pair` as in `lining_mean`)."""
    _check(run, pair=pair, quantity=quantity)
    record = _compact(run)
    if is_traced(record):
        return _peaks(record, pair, quantity)
    return _peaks_compiled(record, pair=pair, quantity=quantity)
