"""What every lining does and carries at any time of a run: its contacts in words of one kind, and its quantities."""

import enum
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._parts._design import Brake
from .._physics._modes import BandMode
from ._probe import Probe, probe_many
from ._result import Result
from ._rubbing import PAIRS, quantity_of, rubbing
from ._rubbing import QUANTITIES as RUBBING
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
    """Contact of every lining of each of its pairs, (m, n) `Contact`s by the names `external` and `internal`.

    A standard brake has the pair `external` alone, linings on the rim. Where the linings act as one, those at their
    limit while the band is elastic follow from the mobilisation rule (model §3).
    """
    shape = np.shape(p.linings.normal)
    own = p.mode.contacts
    found = {}
    if own:
        inner = "lining_internal" in own
        outer = np.asarray(own["lining_external" if inner else "lining"])
        found["external"] = _of_signs(outer)
        if inner:
            found["internal"] = _of_signs(np.asarray(own["lining_internal"]))
    else:
        band = np.asarray(p.mode.band)[:, None]
        stays = np.where(np.asarray(p.linings.at_limit), Contact.AT_LIMIT, Contact.STICKS)
        slides = np.where(band == BandMode.SLIP, Contact.SLIDES, Contact.SLIDES_BACK)
        found["external"] = np.where((band == BandMode.SLIP) | (band == BandMode.SLIP_BACK), slides, stays)
        if "internal_mode" in p.columns:
            found["internal"] = np.broadcast_to(_of_signs(np.asarray(p.columns["internal_mode"]))[:, None], shape)
    loads = {"external": p.linings.normal, "internal": p.columns.get("internal_load")}
    return {pair: np.where(np.asarray(loads[pair]) > 0, states, Contact.FREE) for pair, states in found.items()}


def _of_signs(signs: np.ndarray) -> np.ndarray:
    return np.choose(signs + 1, [Contact.SLIDES_BACK, Contact.STICKS, Contact.SLIDES])


def lining_values(result: Result, quantity: str, edges: Any, *, pair: str = "external") -> np.ndarray:
    """One of `VIEWS` of every lining in SI units in the cells between `edges` (s), (cells, n) or (cells, 1).

    The value in the middle of each cell; `friction_heat` is that at its end, by the midpoint rule. One column alone:
    the scene has one surface for all linings.

    Raises `InputError` for what the run does not have.
    """
    edges = np.asarray(edges, np.float64)
    _check(result, quantity, pair)
    p = look(result, 0.5 * (edges[1:] + edges[:-1]))
    inner = pair == "internal"
    if quantity == "temperature":
        return np.asarray(p.surfaces["outer" if _outer(p, pair) else "linings"])
    if quantity == "friction_heat":
        power = _rubs(result, p, "friction_power", pair)
        shares = result.scene.power_shares
        hot = 1.0 if shares is None else float(shares.heat)
        return hot * np.cumsum(power * np.diff(edges)[:, None], axis=0)
    if quantity in RUBBING:
        return _rubs(result, p, quantity, pair)
    if quantity == "tension":
        return np.asarray(p.linings.tension)
    if quantity == "worn_thickness":
        return np.asarray(p.y.worn[1 if inner else 0])
    if quantity == "friction_force":
        return np.asarray(p.linings.friction)
    return np.asarray(p.columns[f"internal_{quantity}" if inner and quantity == "friction_coefficient" else quantity])


def _rubs(result: Result, p: Probe, quantity: str, pair: str) -> np.ndarray:
    return np.asarray(quantity_of(quantity, jax.tree.map(jnp.asarray, rubbing(result.record, p, pair=pair))))


def _outer(p: Any, pair: str) -> bool:
    return pair == "external" and "outer" in p.surfaces


def _check(result: Result, quantity: str, pair: str) -> None:
    system: Any = result.record.system
    found = []
    if quantity not in VIEWS:
        found.append(Fault("quantity", f"{quantity!r} is none", f"there are: {', '.join(VIEWS)}"))
    if pair not in PAIRS:
        found.append(Fault("pair", f"{pair!r} is no pair", "there are: external, internal"))
    elif pair == "internal" and not system.staged:
        found.append(Fault("pair", "only a staged brake has an internal pair", "leave it out"))
    elif pair == "internal" and quantity in ("tension", "friction_force", "displacement"):
        found.append(Fault("pair", f"{quantity} is of the band, not of the internal pair", "leave it out"))
    if found:
        raise InputError(found)
    heat = result.scene.heat
    if quantity == "temperature" and (heat is None or heat.linings is None):
        why = "the scene has no heat" if heat is None else "the heat of the scene names no linings"
        found.append(Fault("quantity", why, "there are no temperatures of linings to draw"))
    if quantity == "friction_coefficient" and heat is None:
        found.append(Fault("quantity", "the scene has no heat", "the coefficient of friction is drawn where it fades"))
    brake = result.scene.brake
    if quantity == "displacement" and not (isinstance(brake, Brake) and brake.band.segments is not None):
        found.append(Fault("quantity", "only linings of a chain have a displacement", "give brake.band.segments"))
    if quantity == "tension" and not result.scene.brake.banded:
        found.append(Fault("quantity", f"a {result.scene.brake.words.brake} has no band", "look at its normal_load"))
    wear = result.scene.wear
    if quantity == "worn_thickness" and (wear is None or (pair == "internal" and wear.internal is None)):
        found.append(Fault("quantity", "the scene has no wear of that pair", "give it a `Wear`"))
    if quantity == "pressure":
        area = system.areas[PAIRS.index(pair)]
        if area is None:
            path = "brake.bandage.area" if pair == "internal" else "brake.linings.area"
            found.append(Fault(path, "is missing", "a pressure is looked at"))
    if found:
        raise InputError(found)
