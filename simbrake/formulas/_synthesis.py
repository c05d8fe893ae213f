"""The parametric synthesis: S's twelve steps over a scene or a run, rows of data in one chain."""

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar, Generic, NamedTuple, SupportsFloat, TypeVar

import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Table, plain
from .._parts._scene import Scene, band_brake, faults
from .._run._measure import LimitVerdict
from .._run._result import Result
from ..thermal._heat import AbstractPartition
from ._braking import Braking, HeatedPart, RunValues
from ._chain import BULK, CASES, CHAIN, HEATED, PROPERTIES, Chain, Pass, refine
from ._estimates import PARTS, ROWS, SYMBOLS, Value, braking_of
from ._inputs import EstimateData, Permissible, faults_of_data
from ._rows import Absent, Of, Row, RowTable, Symbols, SynthesisRow, read, rows, table_of, there
from .heating import penetration_depth
from .stop import classical_stop

_C = TypeVar("_C")


# --- rows of parts and of the braking ---------------------------------------------------------------------------------

#: step 2 says which of the two formulas holds
_FOURIER = {
    row.name: dataclasses.replace(
        row,
        of=dataclasses.replace(
            row.of, formula=lambda p: "a τ/δ², for b > δ" if p.depth > p.thickness else "1/3, for b ≤ δ"
        ),
    )
    for row in PARTS.values()
    if row.name.startswith("Fourier")
}


def _at_peak(run: RunValues) -> tuple[float, float, float]:
    """Relative time, power and work at the maximum of the simulated face temperature."""
    i, power = int(np.argmax(run.surface)), np.gradient(run.work, run.t)
    time, last = float(run.t[i] - run.t[0]) / run.duration, float(run.work[-1])
    return time, float(power[i]) * run.duration / last, float(run.work[i] / run.work[-1])


def _kept(b: Braking) -> float:
    """Heat (J) that the rim of the run keeps of the braking."""
    rim = there(there(b.run).rim)
    return float(rim.content[-1] * float(rim.wall.area) * rim.wall.copies)


def _four_turns(b: Braking) -> tuple[float, float]:
    """Time (s) of the first four revolutions of the run and heat (J) into its rim, absent where it makes fewer."""
    run = there(b.run)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t))])
    if angle[-1] < 8 * math.pi:
        raise Absent
    time = float(np.interp(8 * math.pi, angle, run.t))
    return time - float(run.t[0]), b.share * float(b.power.heat) * float(np.interp(time, run.t, run.work))


def _gradient(b: Braking) -> SupportsFloat:
    """Maximum gradient (K/m) at the face in the run."""
    run = there(b.run)
    return np.max((run.surface - run.course.layers[:, 0]) / run.course.depth[0])


def _slid(b: Braking) -> float:
    """Way of the linings on the track in the run (m)."""
    s = there(b.run).series
    return float(np.trapezoid(np.abs(np.asarray(s.slip_speed)), np.asarray(s.t)))


def _run_pressure(b: Braking) -> float:
    """Mean pressure (Pa) over the way that the linings of the run slide."""
    s = there(b.run).series
    power = np.asarray(s.normal_load).sum(axis=1) * np.abs(np.asarray(s.slip_speed))
    return float(np.trapezoid(power, np.asarray(s.t)) / _slid(b)) / b.lining_area


def _rest(b: Braking) -> float:
    """Time (s) from the beginning of the hardest of several brakings to its rest, not the rest after another one."""
    run = there(b.run)
    end = float(run.t[-1])
    rests = [e.time for e in there(b.result).events if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)]
    return there(rests[0] - float(run.t[0]) if rests and rests[0] - end < run.duration else None)


def _angle(b: Braking) -> float:
    """Angle (rad) of the hardest of several brakings."""
    begin = float(there(b.run).t[0])
    phi = np.asarray(there(b.result).series(np.array([begin, begin + _rest(b)])).phi)
    return float(phi[1] - phi[0])


def _of_hardest(name: str, hardest: Value) -> Value:
    """What the run shows beside a row of the stop; of several brakings that of the hardest alone."""
    all_of_them = ROWS[name].of.simulated
    return lambda b: hardest(b) if there(b.run).brakings > 1 else all_of_them(b)


#: rows of the estimates beside another simulated number
_BESIDE: dict[str, Value] = {
    "stopping time": _of_hardest("stopping time", _rest),
    "stopping angle": _of_hardest("stopping angle", _angle),
    "friction work": _of_hardest("friction work", lambda b: there(b.run).work[-1]),
    "time of four revolutions": lambda b: _four_turns(b)[0],
    "heat gained in it": lambda b: _four_turns(b)[1],
    "mean flux kept": lambda b: _kept(b) / (b.track_area * b.time),
    "pressure, mean": _run_pressure,
}
_ROWS = ROWS | {
    name: dataclasses.replace(ROWS[name], of=dataclasses.replace(ROWS[name].of, simulated=f))
    for name, f in _BESIDE.items()
}


def _load(b: Braking) -> tuple[float, float]:
    """Work (J) and time (s) of the classical stop, else of the braking."""
    return (b.work, b.time) if b.stop is None else (b.stop.work, b.stop.time)


def _drum(b: Braking) -> tuple[float, float]:
    """Effective drum radius (m) and lines strung, absent without a hook."""
    load = b.scene.duty.load
    radius, lines = getattr(load, "drum_radius", None), getattr(load, "line_count", None)
    return float(there(radius)), float(there(lines))


def _hook(b: Braking, angle: SupportsFloat) -> float:
    """Travel of the hook (m) for an angle of the drum."""
    radius, lines = _drum(b)
    return radius / lines * float(angle)


_OPERATION_SYMBOLS: Symbols[Braking] = {
    **SYMBOLS,
    "r_d": ("m", lambda b: _drum(b)[0]),
    "n|lines": ("1", lambda b: _drum(b)[1]),
    "W|load": ("J", lambda b: _load(b)[0]),
    "τ|load": ("s", lambda b: _load(b)[1]),
}
#: a lever that holds the speed, a load that outweighs the brake: no stop by statics
_NO_STOP = rows(
    SYMBOLS,
    {
        "mean brake torque": Of(lambda b: b.work * b.R_b / there(b.travel or None)),
        "friction work": Of(lambda b: b.work),
    },
    "no stop",
)
_OWN = rows(
    _OPERATION_SYMBOLS,
    {
        "relative time of the maximum": Of(lambda b: 0.5, lambda b: _at_peak(there(b.run))[0]),
        "relative power then": Of(lambda b: 1.0, lambda b: _at_peak(there(b.run))[1]),
        "relative work then": Of(lambda b: 0.75, lambda b: _at_peak(there(b.run))[2]),
        "heat into the rim": Of(lambda b: b.metal_heat, _kept),
        "greatest gradient at the face": Of(lambda b: 2 * b.flux / float(b.rim.conductivity), _gradient),
        "slack tension, greatest": Of(lambda b: b.T_0, lambda b: np.max(np.asarray(there(b.run).series.slack_tension))),
        "tight tension, greatest": Of(
            lambda b: there(b.stop).ratio * b.T_0, lambda b: np.max(np.asarray(there(b.run).series.tight_tension))
        ),
        "friction travel": Of(lambda b: b.R_b * there(b.stop).angle, _slid),
        "hook travel": Of(lambda b: _hook(b, there(b.stop).angle), lambda b: _hook(b, _BESIDE["stopping angle"](b))),
        "energy load of the linings": Of(
            lambda b: _load(b)[0] / b.lining_area, lambda b: there(b.run) and b.work / b.lining_area
        ),
        "power load of the linings, mean": Of(
            lambda b: _load(b)[0] / (b.lining_area * _load(b)[1]),
            lambda b: there(b.run) and b.work / (b.lining_area * b.time),
        ),
    },
    *("relative", "heat", "operation"),
)


# --- limits -----------------------------------------------------------------------------------------------------------


class Loaded(NamedTuple):
    """A permissible value and what is compared with it, by the estimate and in the run; `None`: there is none."""

    permissible: float | None
    value: float | None
    simulated: float | None


def _of_row(c: Chain, limit: str, row: Row[_C], context: _C) -> Loaded:
    """A row beside its permissible value."""
    return Loaded(c.limits.get(limit), *row.found(context))


def _stressed(c: Chain) -> Loaded:
    value, simulated = ROWS["thermal stress, surface"].found(c.after)
    return Loaded(c.after.elastic.permissible, abs(there(value)), None if simulated is None else abs(simulated))


def _margin(unit: str, loaded: Callable[[Chain], Loaded]) -> Of[Chain]:
    """What is left up to a permissible value, by the estimate and by the run; no row without a limit."""
    return Of(
        lambda c: there(loaded(c).permissible) - there(loaded(c).value),
        lambda c: there(loaded(c).permissible) - there(loaded(c).simulated),
        numbers=lambda c: [
            ("permissible", there(loaded(c).permissible), unit),
            ("found", there(loaded(c).value), unit),
        ],
    )


_MARGINS = rows(
    {},
    {
        "margin, face of the linings": _margin(
            "K",
            lambda c: Loaded(
                c.limits["lining_permissible"], c.face_peak, None if c.before.run is None else c.before.run.face
            ),
        ),
        "margin, back of the linings": _margin(
            "K", lambda c: _of_row(c, "back_permissible", CHAIN["lining's back after the braking"], c)
        ),
        "margin, stress of the rim": _margin("Pa", _stressed),
        "margin, pressure": _margin(
            "Pa", lambda c: _of_row(c, "pressure_permissible", _ROWS["pressure, mean"], c.before)
        ),
        "margin, power load": _margin(
            "W/m^2",
            lambda c: _of_row(c, "power_permissible", _OWN["power load of the linings, mean"], c.before),
        ),
    },
    "margin",
)


def _verdict(row: SynthesisRow) -> str:
    """Within limit or exceeded by the estimate, and what the run says where that is something else."""
    by_estimate, by_run = (
        None if margin is None else LimitVerdict.WITHIN if margin >= 0 else LimitVerdict.EXCEEDED
        for margin in (row.value, row.simulated)
    )
    return f"{by_estimate}" if by_run in (None, by_estimate) else f"{by_estimate}, in the run {by_run}"


# --- the steps --------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Place(Generic[_C]):
    """Rows by name, and the contexts of a chain, each with the name of its part, in which they are filled."""

    rows: Mapping[str, Row[_C]]
    contexts: Callable[[Chain], Iterable[tuple[_C, str]]]
    ending: str = ""  # of the names


def _heated(found: Pass, names: Iterable[str] = HEATED) -> list[tuple[HeatedPart, str]]:
    """Parts of a pass, by default those that take up heat."""
    return [(found.parts[name], name) for name in names]


_OF_BRAKING = {**_ROWS, **_OWN}
_OF_PART = {**PARTS, **_FOURIER, **BULK}
#: places of `steps.csv`
_PLACES: dict[str, Place[Any]] = {
    "chain": Place({**CHAIN, **_MARGINS}, lambda c: [(c, "")]),
    "all parts": Place(_OF_PART, lambda c: _heated(c.found.first, c.found.first.parts)),
    "heated parts": Place(_OF_PART, lambda c: _heated(c.found.first)),
    "refined parts": Place(_OF_PART, lambda c: _heated(c.found.last), ", refined"),
    "rim properties": Place(PROPERTIES, lambda c: [(c.property_of("rim"), "rim")]),
    "lining properties": Place(PROPERTIES, lambda c: [(c.property_of("lining"), "lining")]),
    "rim cases": Place(CASES, lambda c: [(case, case.name) for case in c.rim_cases]),
    "lining cases": Place(CASES, lambda c: [(case, case.name) for case in c.lining_cases]),
    "before": Place(_OF_BRAKING, lambda c: [(c.before, "rim")]),
    "after": Place(_OF_BRAKING, lambda c: [(c.after, "rim")]),
    "stop": Place(_OF_BRAKING, lambda c: [] if c.before.stop is None else [(c.before, "rim")]),
    "no stop": Place(_NO_STOP, lambda c: [(c.before, "rim")] if c.before.stop is None else []),
}
#: S's steps in its own order
STEPS = (
    "effective depth of heat",
    "Fourier numbers",
    "effective volumes",
    "partition of the heat",
    "mean bulk temperatures",
    "properties at these temperatures, where above 150 °C",
    "depth, Fourier numbers, volumes, partition once more",
    "temperatures of the layers, rational thickness",
    "maximum temperature of the friction surface",
    "heat balance",
    "thermal stress of the rim",
    "operating characteristics",
)


def _rows_of(c: Chain) -> Iterator[SynthesisRow]:
    """All rows in the order of `steps.csv`; a line is one row in one place of a step, and its reason if another one."""
    for line in read("steps.csv"):
        place, name = _PLACES[line["place"]], line["row"]
        row = place.rows[name]
        row = dataclasses.replace(row, why=line["why"] or row.why)
        for context, part in place.contexts(c):
            found = row.of_step(int(line["step"]), context, part, ending=place.ending)
            if found is not None:
                yield dataclasses.replace(found, verdict=_verdict(found)) if name in _MARGINS else found


@dataclasses.dataclass(frozen=True)
class Synthesis(RowTable[SynthesisRow]):
    """The parametric synthesis of a brake for one braking: figures of S's twelve steps beside the simulated ones.

    - `rows` in order of the steps; `inputs`: what they are made from; `about`: the braking
    - `rounds`: how often steps 1 to 5 were repeated with properties at temperature; `replaced`: parts that have them
    - `rim_thickness`, `lining_thickness`: rational (m), `inf` where none will do
    - `synthesis["friction work"]` is one figure, `synthesis.step(8)` those of a step; `str` gives the report,
      `as_dict` the same as numbers and words
    """

    rounds: int
    replaced: tuple[str, ...]
    kind: ClassVar[str] = "figure"

    def step(self, number: int) -> tuple[SynthesisRow, ...]:
        """The figures of one step, 1…12; the first is its main one."""
        return tuple(row for row in self.rows if row.step == number)

    @property
    def rim_thickness(self) -> float:
        """Rational thickness of the rim (m)."""
        return self["rational thickness, rim"].value

    @property
    def lining_thickness(self) -> float:
        """Rational thickness of the linings without what they may wear (m)."""
        return self["rational thickness, lining"].value

    @property
    def limits(self) -> dict[str, str]:
        """Name of every permissible limit that was evaluated → its verdict."""
        return {row.name: row.verdict for row in self.rows if row.verdict}

    @property
    def exceeded(self) -> list[str]:
        """Names of the limits that the estimate or the run exceeds: their margin is below 0."""
        margins = [row for row in self.rows if row.verdict]
        return [row.name for row in margins if row.value < 0 or (row.simulated is not None and row.simulated < 0)]

    def as_list(self) -> list[dict[str, Any]]:
        """Every figure as numbers and words; numbers that are not finite are `None`."""
        return [row.as_dict() for row in self.rows]

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words; numbers that are not finite are `None`."""
        about = {"about": self.about, "rounds": self.rounds, "replaced": list(self.replaced)}
        return {**about, "inputs": plain(self.inputs), "steps": self.as_list()}

    def parts(self) -> Iterator[str | Table]:
        yield from self.head()
        for number, title in enumerate(STEPS, 1):
            rows = self.step(number)
            yield from ("", f"{number}. {title}: {rows[0].words}")
            yield from table_of(rows, numbers=True)


# --- the function -----------------------------------------------------------------------------------------------------


def synthesize(
    run: Scene | Result,
    data: EstimateData | None = None,
    *,
    permissible: Permissible | None = None,
    partition: AbstractPartition | None = None,
    tolerance: float = 1e-9,
    rounds: int = 100,
) -> Synthesis:
    """Parametric synthesis of a brake for one braking, after S: twelve steps from the depth of heat to operation.

    1. effective depth of heat `b = 1.73 √(a τ)`;  2. Fourier numbers;  3. effective volumes;  4. partition of the heat;
    5. mean bulk temperatures;  6. properties at these, where they exceed 150 °C;  7. depth, Fourier numbers, volumes
    and partition once more, until the temperatures change no more;  8. temperatures of the rim's layers, rational
    thickness of rim and lining;  9. maximum temperature;  10. heat balance;  11. thermal stress;  12. operating
    characteristics with the permissible limits.

    - `run`: a `Scene`, of which a classical stop gives time and work, or a `Result`: its hardest braking, and every
      figure stands beside the simulated one where the run has it
    - `data`: numbers that the scene does not have, or others in their place (as for `estimates`)
    - `permissible`: limits of temperature, pressure and power
    - `partition`: law of step 4, as `TransmissionPartition` for S-41; by default `data.share`, else the scene's law,
      else effusivities at the properties of the round
    - `tolerance` (K) of the repeat of step 7 and maximum number of its `rounds`

    Raises `InputError` as `estimates` does, for a staged brake, and for wrong options, `SynthesisError` with the
    code `no_convergence` or `material_range` where step 7 finds no temperature.
    """
    limits = permissible or Permissible()
    scene = run.scene if isinstance(run, Result) else run
    wrong = faults_of_synthesis(scene, data, limits)
    if not 0 < tolerance < math.inf:
        wrong.append(Fault("tolerance", f"{tolerance} is out of range", "must be > 0 K"))
    if rounds < 1:
        wrong.append(Fault("rounds", f"{rounds} is out of range", "at least 1"))
    if wrong:
        raise InputError(wrong)
    before, about = braking_of(run, data)
    if before.run is not None and before.run.brakings > 1:
        before = dataclasses.replace(before, stop=classical_stop(before.run.then))
    start = _start_temperatures(before)
    refined = refine(before, start, partition, tolerance, rounds)
    settled = limits.settled(before.scene)
    materials = {name: part.material for name, part in refined.last.parts.items()}
    after = before.with_inputs(**materials, share=refined.last.share)
    chain = Chain(before, after, refined, start, {limit.name: float(limit.value) for limit in settled})
    inputs = (*before.inputs.values(), *settled)
    return Synthesis(f"parametric synthesis{about}", inputs, tuple(_rows_of(chain)), refined.rounds, refined.replaced)


def _start_temperatures(b: Braking) -> dict[str, float]:
    """Mean temperatures (K) of rim, lining and band as the braking begins; without a run all as the rim.

    The lining's is that of the depth which the braking heats: a lining that has braked before is hot at its face.
    """
    start = dict.fromkeys(b.parts, b.start_now)
    if b.run is not None and b.run.lining is not None:
        depth = float(penetration_depth(float(b.lining.diffusivity), b.time))
        start["lining"] = float(b.run.lining.mean(depth)[0])
    if b.run is not None and b.run.band is not None:
        start["band"] = float(b.run.band[0])
    return start


def faults_of_synthesis(scene: Scene, data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """All input errors of a synthesis, found before anything is simulated."""
    found = [*faults(scene), *faults_of_data(data, limits)]
    if band_brake(scene).in_series:
        hint = "it is of a brake with one friction pair; `estimates` takes both pairs of a staged one"
        found.append(Fault("brake.bandage", "is not for this synthesis", hint))
    return found
