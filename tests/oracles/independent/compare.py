"""A scene run by simbrake and by the independent model, side by side: modes, events,
states and energies."""

from typing import Any, NamedTuple

import numpy as np
from oracles.independent import base, draws
from oracles.independent.banded import Banded
from oracles.independent.chain import Chain
from oracles.independent.pressed import Bands, Pressed
from oracles.independent.sprung import Sprung
from oracles.independent.stepping import Logged, integrate

import simbrake as sb

RTOL = 1e-11
#: relative differences allowed: of times over 1 s, of states and energies; linings that
#: slip and stick one by one, some hundred times in a run, make errors of integration
#: grow
ALLOWED = {"chain": 1e-6}
USUALLY = 5e-8
#: of a time also what a margin takes to change by this, where the margin passes 0
#: slowly: springs without dampers, and friction that falls with the speed, let speeds
#: come together over seconds, and the time at which they do is ill-posed
FLAT = {"resolved bandage": 1e-9}
#: marks, which change no mode: of heat, and of a speed that passes 0
MARKS = ("grip_lost", "permissible_temperature", "self_locking", "reversal")
#: events nearer than this are at one instant
_INSTANT = 2e-7
#: a mode that lasts less (s) counts as one that lasts no time
_BRIEF = 1e-9
_BANDS = {
    sb.results.BandMode.OPEN: base.OPEN,
    sb.results.BandMode.TAKE_UP: base.TAKE_UP,
    sb.results.BandMode.ELASTIC: base.ELASTIC,
    sb.results.BandMode.SLIP: base.SLIP,
    sb.results.BandMode.SLIP_BACK: base.BACK,
    sb.results.BandMode.HELD: base.HELD,
}
Modes = list[tuple[float, tuple[Any, ...]]]


class Course(NamedTuple):
    """A run: the modes that last, with the times from which they hold; events; what
    there is at the end.

    - `passing`: instants at which a mode lasted no time
    - `slopes`: by time how fast a margin passed 0 (1/s)
    """

    modes: Modes
    events: list[Logged]
    end: dict[str, Any]
    passing: list[float]
    slopes: dict[float, float]


class Comparison(NamedTuple):
    """Both runs of a scene: what differs (empty: nothing), largest differences, numbers
    of modes and events.

    - `times`: of a time (s)
    - `margins`: of a time, as what the margin that ended the mode changes in it
    """

    name: str
    differs: str
    times: float
    margins: float
    states: float
    modes: int
    events: int


def _lasting(changes, end):
    """Modes that last, and the instants of others: those that are neither the mode
    before nor that after."""
    found = []
    brief = []
    for (t, mode), (after, _) in zip(changes, [*changes[1:], (end, ())], strict=True):
        if after <= t + _BRIEF:
            brief.append((t, mode, len(found)))
        elif not found or found[-1][1] != mode:
            found.append((t, mode))
    around = [None, *(mode for _, mode in found), None]
    return found, [t for t, mode, i in brief if mode not in around[i : i + 2]]


def ours(p):
    """simbrake's run."""
    result = sb.simulate(draws.scene(p), rtol=RTOL, max_steps=16384)
    record = result.record
    energy = {k: float(v) for k, v in result.energy.items()}
    y = result.record.y_end
    n = int(record.count)
    times = np.asarray(record.rows.t)[: n + 1]
    modes = record.modes
    parts = [
        part
        for name in ("outer", "inner", "linings")
        if (part := getattr(modes.own, name, None)) is not None
    ]
    columns = [np.asarray(x)[: n + 1].reshape(n + 1, -1) for x in (modes.band, *parts)]
    # a lining off the rim neither sticks nor slides
    if p["kind"] == "resolved bandage" and modes.lifted is not None:
        columns[2] = np.where(np.asarray(modes.lifted)[: n + 1] != 0, 2, columns[2])
    if p["kind"] == "resolved bandage":  # an open band touches no lining
        columns[1] = np.where(columns[0] == sb.results.BandMode.OPEN, 0, columns[1])
    rows = np.column_stack(columns).astype(int)
    changes = [
        (float(t), (_BANDS[sb.results.BandMode(row[0])], *map(int, row[1:])))
        for t, row in zip(times, rows, strict=True)
    ]
    # a run settles from open
    begins = (
        1 if changes[0][1][0] == base.OPEN and changes[1][0] == changes[0][0] else 0
    )
    lasting, passing = _lasting(changes[begins:-1], float(times[-1]))
    end = {
        "angle": float(y.phi),
        "speed": float(y.omega),
        "load work": energy["load_work"],
        "lever work": energy.get("lever_work", 0.0),
        "damper heat": energy.get("damper_heat", 0.0),
        "friction heat": energy.get("heat_external", energy.get("friction_heat")),
        "kinetic change": energy["kinetic_change"],
        "elastic change": energy.get("elastic_change", 0.0),
    }
    if "heat_internal" in energy:
        end["internal heat"] = energy["heat_internal"]
    if y.heat is not None:
        end["temperatures"] = np.asarray(result.end_temperatures)
    if y.worn is not None:
        end["worn"] = np.concatenate([np.ravel(np.asarray(worn)) for worn in y.worn])
    events = [
        Logged(e.time, e.name, e.lining) for e in result.events if e.name not in MARKS
    ]
    if p["bandage"] is not None or p["kind"] == "several bands":
        events = [e for e in events if e.name != "lining_limit"]
    return Course(lasting, events, end, passing, {})


def theirs(p):
    """The independent model's run."""
    kinds = {
        "disc": Pressed,
        "shoe": Pressed,
        "chain": Chain,
        "resolved bandage": Sprung,
        "several bands": Bands,
    }
    model = kinds.get(p["kind"], Banded)(p)
    y = integrate(model)
    lasting, passing = _lasting(model.modes, model.end)
    return Course(
        lasting, model.log, base.answers(model, y), passing, dict(model.slopes)
    )


def _ordered(events, passing):
    """Events in order, those at one instant by name; without those of an instant at
    which a mode lasted no time.

    Which modes a log passes through at such an instant is a matter of the order in
    which conditions are looked at.
    """
    kept = [e for e in events if all(abs(e.time - t) > _INSTANT for t in passing)]
    kept = sorted(kept, key=lambda e: e.time)
    groups = []
    for event in kept:
        if groups and event.time - groups[-1][0].time < _INSTANT:
            groups[-1].append(event)
        else:
            groups.append([event])
    return [
        e
        for group in groups
        for e in sorted(group, key=lambda e: (e.name, e.lining or 0))
    ]


def compare(kind, flavour, seed):
    """Run one scene both ways."""
    name = f"{kind}, {flavour}, seed {seed}"
    p = draws.draw(kind, flavour, seed)
    a = ours(p)
    b = theirs(p)
    staged = p["bandage"] is not None
    passing = [*a.passing, *b.passing] if staged else []
    events = _ordered(a.events, passing)
    others = _ordered(b.events, passing)
    pairs = [(x[0], y[0]) for x, y in zip(a.modes, b.modes, strict=False)]
    pairs += [(x.time, y.time) for x, y in zip(events, others, strict=False)]
    apart = [(abs(x - y), b.slopes.get(y, np.inf)) for x, y in pairs if x != y]
    works = ("load work", "kinetic change", "friction heat")
    energy = max(1.0, *(abs(b.end[k]) for k in works))
    worst = 0.0
    which = ""
    for key, value in b.end.items():
        size = {"angle": 1.0, "speed": 1.0, "temperatures": 1.0}.get(key, energy)
        size = max(1e-15, float(np.max(np.abs(value)))) if key == "worn" else size
        gap = float(np.max(np.abs(np.asarray(a.end[key]) - value))) / size
        if not gap <= worst:
            worst = gap
            which = key
    allowed = ALLOWED.get(kind, USUALLY)
    flat = FLAT.get(kind, 0.0)
    differs = ""
    if [mode for _, mode in a.modes] != [mode for _, mode in b.modes]:
        differs = "modes"
    elif [(e.name, e.lining) for e in events] != [(e.name, e.lining) for e in others]:
        differs = "events"
    elif any(gap > allowed + flat / slope for gap, slope in apart):
        differs = "times"
    elif not worst <= allowed:
        differs = which
    times = max((gap for gap, _ in apart), default=0.0)
    margins = max(
        (gap * slope for gap, slope in apart if np.isfinite(slope)), default=0.0
    )
    return Comparison(name, differs, times, margins, worst, len(a.modes), len(events))
