"""What governs a run: torques of a stop, torques at rest, or powers of a lowering."""

from collections.abc import Sequence
from typing import Any

from .._base._numbers import digits, number
from ..outputs.duty import DutyKind, first_greatest, rows_of
from ..outputs.energies import energies_between
from ..outputs.log import labels_of
from ..parts.scene import Scene
from ..runs.findings import (
    Finding,
    capacity_words,
    held,
    mean_powers,
    powers,
    sentences,
)
from ..runs.result import Result
from ..shaft import AbstractAuxiliaryBrake

#: torques that differ by less than this share of the load balance each other
BALANCED = 1e-9
#: percent of a balance that shows in none of its printed digits
_SHOWN = 5e-4


def as_topic(topic: str, found: Sequence[Finding]) -> list[Finding]:
    """Findings as the sentences of one topic, with the numbers of all."""
    numbers = dict[str, Any]()
    for finding in found:
        numbers |= finding.numbers
    text = sentences(finding.text for finding in found)
    return [Finding(topic, text, numbers)] if found else []


def what_governs(result: Result) -> list[Finding]:
    """What governs the run: torques of a stop, torques at rest, or powers of a
    lowering."""
    report = result.report()
    kind = report.summary["duty"]
    if found := [*held(report), *powers(report)]:
        return as_topic("balance", found)
    if kind in (DutyKind.STOP, DutyKind.STOPS):
        if float(result.energy["friction_heat"]) > 0:
            return [_torque_budget(result, kind)]
        return as_topic("balance", [mean_powers(report)])
    capacity = report.summary["capacity"]
    if capacity is None or not capacity["brake_torque"]:
        return []
    load = capacity["load_torque"]
    torque = capacity["brake_torque"]
    left = torque - load
    if abs(left) <= BALANCED * load:
        rest = "they balance, and the speed stays as it is"
    elif left > 0:
        rest = f"{number(left, 'N*m')} are left to slow it down"
    else:
        rest = f"{number(-left, 'N*m')} too little"
    words = capacity_words(result.end_capacity, result.scene)
    numbers = {"brake_torque": torque, "load_torque": load}
    return [Finding("balance", f"At the end {words}: {rest}.", numbers)]


#: works that are not those of brake, load and inertia, as they add to what the brake
#: takes
_OTHERS = (
    ("lever_work", 1),
    ("motor_work", 1),
    ("elastic_change", -1),
    ("shaft_work", -1),
    ("pick_up_heat", -1),
)


def _torque_budget(result: Result, kind: str) -> Finding:
    """Mean torques over the angle of a single stop, or of the longest of several from
    the onset of slip on."""
    record = result.record.compact()
    words = result.scene.brake.words
    t = record.rows.t
    phi = record.states.phi
    stops = rows_of(labels_of(record), result.report().turned)
    number_of = first_greatest([t[stop.stop] - t[stop.onset] for stop in stops])
    stop = stops[number_of]
    first = stop.start if kind == DutyKind.STOP else stop.onset
    last = stop.stop
    e = {
        name: float(value)
        for name, value in energies_between(record, first, last).items()
    }
    angle = abs(float(phi[last] - phi[first]))
    brake = sum(
        e.get(name, 0.0)
        for name in (
            "friction_heat",
            "electrical_work",
            "mechanical_work",
            "damper_heat",
        )
    )
    others = sum(sign * e.get(name, 0.0) for name, sign in _OTHERS)
    works = {
        "brake": brake,
        "load": e["load_work"] + e.get("rope_work", 0.0),
        "inertia": -e["kinetic_change"],
        "others": others,
    }
    torque = {name: work / angle for name, work in works.items()} if angle else works
    share = {name: 100 * work / brake if brake else 0.0 for name, work in works.items()}

    def term(name: str) -> str:
        return (
            f"{number(torque[name], 'N*m', count=5)} "
            f"({digits(round(share[name], 9) + 0.0, 3)} %)"
        )

    which = (
        "the stop"
        if kind == DutyKind.STOP
        else f"stop {number_of + 1}, the longest, from the onset of slip on"
    )
    over = f"the {number(angle, 'rad', count=5)} of {which},"
    whole = number(torque["brake"], "N*m", count=5)
    text = f"Averaged over {over} the brake gives {whole}: "
    text += f"{term('load')} against the load, {term('inertia')} against the inertia"
    minor = abs(share["others"]) < _SHOWN
    others = _others_words(result.scene)
    text += ". " if minor else f", {term('others')} from {others}. "
    governs = "load" if works["load"] > works["inertia"] else "inertia"
    why = "The inertia governs: the brake mainly takes kinetic energy."
    if governs == "load":
        why = (
            "The load governs: the brake works mainly to hold it while the "
            f"{words.body} turns."
        )
    numbers = {f"{name}_torque": value for name, value in torque.items()} | {
        f"{name}_work": w for name, w in works.items()
    }
    return Finding(
        "balance",
        text + why,
        {**numbers, "stop": number_of + 1, "angle": angle, "governs": governs},
    )


def _others_words(scene: Scene) -> str:
    """What of a scene takes or gives work beside brake, load and inertia, in words."""
    auxiliary = [law for law in scene.shaft if isinstance(law, AbstractAuxiliaryBrake)]
    parts = ["lever"]
    parts += ["band"] if scene.brake.banded else []
    parts += ["auxiliary brake"] if auxiliary else []
    parts += ["friction of the shaft"] if len(scene.shaft) > len(auxiliary) else []
    parts += ["motor"] if scene.motor is not None else []
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
