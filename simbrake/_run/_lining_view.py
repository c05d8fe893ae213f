"""What every lining does and carries at any time of a run: its contacts in words of one kind, and its quantities."""

import enum
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._physics._mechanism import PairNow
from ._probe import Probe, probe_many
from ._result import Result
from ._rubbing import QUANTITIES as RUBBING
from ._rubbing import fault_of_pair, faults_of_area, quantity_of, rubbing
from ._series import times_within


class Contact(enum.IntEnum):
    """What a lining does on its partner."""

    SLIDES_BACK = 0  # the partner runs behind
    FREE = 1  # nothing presses it
    STICKS = 2
    AT_LIMIT = 3  # still moves with its partner, its friction is used up (`k` counts these)
    SLIDES = 4


WORDS = {
    Contact.SLIDES: "slides",
    Contact.AT_LIMIT: "at its friction limit",
    Contact.STICKS: "sticks",
    Contact.SLIDES_BACK: "slides back",
    Contact.FREE: "not pressed",
}


class View(NamedTuple):
    """A name, its unit for people, and what the SI value is multiplied by and added to."""

    words: str
    unit: str
    factor: float = 1.0
    offset: float = 0.0


#: what `lining_values` knows; units as a picture shows them
VIEWS = {
    "temperature": View("surface temperature", "°C", 1.0, -273.15),
    "normal_load": View("normal load N", "kN", 1e-3),
    "tension": View("tension T behind the lining", "kN", 1e-3),
    "tension_increment": View("tension increment |Tᵢ − Tᵢ₋₁|", "kN", 1e-3),
    "pressure": View("pressure N/A", "MPa", 1e-6),
    "slip_speed": View("slip speed |v|", "m/s"),
    "friction_force": View("friction force F", "kN", 1e-3),
    "friction_coefficient": View("coefficient of friction f", ""),
    "friction_power": View("friction power", "kW", 1e-3),
    "friction_heat": View("friction heat since the start", "kJ", 1e-3),
    "worn_thickness": View("thickness worn off since the start", "µm", 1e6),
    "displacement": View("displacement u along the band", "mm", 1e3),
}


def look(result: Result, times: Any, *, left: bool = False) -> Probe:
    """States and forces of one concrete run at the times (s), at an event after it, or with `left` before it.

    Raises `InputError` for times outside the run.
    """
    record = result.record.compact()
    t = record.rows.t
    times = times_within(times, float(t[0]), float(t[record.count]), "times")
    index = record.find(times, left=left)
    return probe_many(record, index, times - t[index])


def lining_contacts(result: Result, p: Probe) -> dict[str, np.ndarray]:
    """Contact of every lining in each friction pair, (m, n) `Contact`s by the names of the pairs.

    Where the linings act as one, those at their limit while the band is elastic follow from the mobilisation rule
    (model §3).
    """
    system: Any = result.record.system
    return {name: _contacts(now) for name, now in zip(system.pair_names, p.shown.pairs, strict=True)}


def _contacts(now: PairNow) -> np.ndarray:
    sense, normal, used_up = (np.asarray(x) for x in (now.sense, now.normal, now.at_limit))
    stays = np.where(used_up, Contact.AT_LIMIT, Contact.STICKS)
    moves = np.where(sense > 0, Contact.SLIDES, Contact.SLIDES_BACK)
    return np.where(normal > 0, np.where(sense == 0, stays, moves), Contact.FREE)


def lining_values(result: Result, quantity: str, edges: Any, *, pair: str = "external") -> np.ndarray:
    """One of `VIEWS` of every lining in SI units in the cells between `edges` (s), (cells, n) or (cells, 1).

    The value in the middle of each cell; `friction_heat` is that at its end, by the midpoint rule. One column alone:
    the scene has one surface for all linings.

    Raises `InputError` for what the run does not have.
    """
    edges = np.asarray(edges, np.float64)
    _check(result, quantity, pair)
    p = look(result, 0.5 * (edges[1:] + edges[:-1]))
    if quantity == "friction_heat":
        power = _rubs(result, p, "friction_power", pair)
        shares = result.scene.power_shares
        hot = 1.0 if shares is None else float(shares.heat)
        return hot * np.cumsum(power * np.diff(edges)[:, None], axis=0)
    found = _rubs(result, p, quantity, pair) if quantity in RUBBING else _seen(result, p, quantity, pair)
    if found is None:
        raise InputError([_absent(result, quantity)])
    return np.asarray(found)


def _rubs(result: Result, p: Probe, quantity: str, pair: str) -> np.ndarray:
    return np.asarray(quantity_of(quantity, jax.tree.map(jnp.asarray, rubbing(result.record, p, pair=pair))))


def _seen(result: Result, p: Any, quantity: str, pair: str) -> Any:
    """A quantity that is not of the rubbing itself, `None` where the run does not have it."""
    system: Any = result.record.system
    number = system.pair_names.index(pair)
    now = p.shown.pairs[number]
    outside = system.mechanism.pairs[number].on_band and "outer" in p.surfaces
    values = {
        "temperature": p.surfaces.get("outer" if outside else "linings"),
        "tension": p.shown.tension,
        "displacement": p.shown.displacement,
        "friction_force": now.friction,
        "friction_coefficient": now.coefficient,
        "worn_thickness": None if p.y.worn is None else p.y.worn[number],
    }
    return values[quantity]


#: quantities of the band, not of a friction pair
_OF_BAND = ("tension", "displacement")


def _check(result: Result, quantity: str, pair: str) -> None:
    system: Any = result.record.system
    missing = fault_of_pair(pair, system.pair_names)
    found = [] if missing is None else [missing]
    if quantity not in VIEWS:
        found.append(Fault("quantity", f"{quantity!r} is none", f"there are: {', '.join(VIEWS)}"))
    if missing is None and quantity in _OF_BAND and pair != system.pair_names[0]:
        found.append(Fault("pair", f"{quantity} is of the band, not of the {pair} pair", "leave it out"))
    if quantity == "pressure" and not found:
        found += faults_of_area(system, pair)
    if found:
        raise InputError(found)


def _absent(result: Result, quantity: str) -> Fault:
    """Why a run has no such quantity."""
    cold = not result.scene.heated
    why = {
        "temperature": (
            "the scene has no heat" if cold else "the heat of the scene names no linings",
            "there are no temperatures of linings to draw",
        ),
        "friction_coefficient": (
            "the scene has no heat" if cold else "no friction heats a body of the scene",
            "the coefficient of friction is drawn where it fades",
        ),
        "displacement": ("only linings of a chain have a displacement", "give brake.band.segments"),
        "tension": (f"a {result.scene.brake.words.brake} has no band", "look at its normal_load"),
        "worn_thickness": ("the scene has no wear of that pair", "give it a `Wear`"),
    }
    return Fault("quantity", *why[quantity])
