"""The parametric synthesis: S's twelve steps over a scene or a run, rows of data in one chain."""

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar, Generic, NamedTuple, SupportsFloat, TypeVar

import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Table, plain
from .._parts._heat import AbstractPartition
from .._parts._scene import Scene, band_brake, faults
from .._run._limits import LimitVerdict
from .._run._result import Result
from ._braking import Braking, HeatedPart, Layered
from ._chain import BULK, CHAIN, HEATED, INSULATION, PROPERTIES, STORAGE, Chain, Pass, refine
from ._estimates import (
    BALANCE,
    CONTACT,
    PARTITION,
    PARTS,
    STOP,
    STRESS,
    SYMBOLS,
    TEMPERATURES,
    braking_of,
    of_rim,
    of_run,
)
from ._inputs import EstimateData, Permissible, faults_of_data
from ._rows import Of, Row, RowTable, Symbols, SynthesisRow, read, rows, table_of
from .heating import penetration_depth
from .stop import classical_stop

_C = TypeVar("_C")


# --- rows of parts and of the braking ---------------------------------------------------------------------------------

#: step 2 says which of the two formulas holds
_FOURIER = {
    row.name: row._replace(
        of=row.of._replace(formula=lambda p: "a τ/δ², for b > δ" if p.depth > p.thickness else "1/3, for b ≤ δ")
    )
    for row in PARTS.values()
    if row.name.startswith("Fourier")
}


def _at_peak(run: Layered) -> tuple[float, float, float]:
    """Relative time, power and work at the maximum of the simulated face temperature."""
    i, power = int(np.argmax(run.surface)), np.gradient(run.work, run.t)
    time, last = float(run.t[i] - run.t[0]) / run.duration, float(run.work[-1])
    return time, float(power[i]) * run.duration / last, float(run.work[i] / run.work[-1])


_RELATIVE = rows(
    "relative",
    SYMBOLS,
    {
        "relative time of the maximum": Of(lambda b: 0.5, of_rim(lambda run: _at_peak(run)[0])),
        "relative power then": Of(lambda b: 1.0, of_rim(lambda run: _at_peak(run)[1])),
        "relative work then": Of(lambda b: 0.75, of_rim(lambda run: _at_peak(run)[2])),
    },
)


def _kept(b: Braking) -> float | None:
    """Heat (J) that the rim of the run keeps of the braking."""
    rim = None if b.run is None else b.run.rim
    return None if rim is None else float(rim.content[-1] * float(rim.wall.area) * rim.wall.copies)


def _kept_flux(b: Braking) -> float | None:
    kept = _kept(b)
    return None if kept is None else kept / (b.track_area * b.time)


def _four_turns(b: Braking) -> tuple[float, float] | None:
    """Time (s) of the first four revolutions of the run and heat (J) into its rim, `None` where it makes fewer."""
    run = b.run
    if run is None:
        return None
    angle = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t))])
    if angle[-1] < 8 * math.pi:
        return None
    time = float(np.interp(8 * math.pi, angle, run.t))
    return time - float(run.t[0]), b.share * float(b.power.heat) * float(np.interp(time, run.t, run.work))


def _of_four(i: int) -> Callable[[Braking], float | None]:
    def value(b: Braking) -> float | None:
        found = _four_turns(b)
        return None if found is None else found[i]

    return value


_HEAT = rows(
    "heat",
    SYMBOLS,
    {
        "heat into the rim": Of(lambda b: b.metal_heat, _kept),
        "greatest gradient at the face": Of(
            lambda b: 2 * b.flux / float(b.rim.conductivity),
            of_rim(lambda run: np.max((run.surface - run.course.layers[:, 0]) / run.course.depth[0])),
        ),
    },
)


def _slid(b: Braking) -> SupportsFloat | None:
    """Way of the linings on the track in the run (m)."""
    s = None if b.run is None else b.run.series
    return None if s is None else np.trapezoid(np.abs(np.asarray(s.slip_speed)), np.asarray(s.t))


def _run_pressure(b: Braking) -> float | None:
    """Mean pressure (Pa) over the way that the linings of the run slide."""
    if b.run is None:
        return None
    s = b.run.series
    loads, way = np.asarray(s.normal_load).sum(axis=1), np.abs(np.asarray(s.slip_speed))
    return float(np.trapezoid(loads * way, np.asarray(s.t)) / np.trapezoid(way, np.asarray(s.t))) / b.lining_area


def _rest(b: Braking) -> float | None:
    """Time (s) from the beginning of the hardest of several brakings to its rest, not the rest after another one."""
    if b.result is None or b.run is None:
        return None
    end = float(b.run.t[-1])
    rests = [e.time for e in b.result.events if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)]
    return rests[0] - float(b.run.t[0]) if rests and rests[0] - end < b.run.duration else None


def _angle(b: Braking) -> float | None:
    """Angle (rad) of the hardest of several brakings."""
    time = _rest(b)
    if time is None or b.result is None or b.run is None:
        return None
    begin = float(b.run.t[0])
    phi = np.asarray(b.result.series(np.array([begin, begin + time])).phi)
    return float(phi[1] - phi[0])


def _beside(row: Row[Braking], simulated: Callable[[Braking], SupportsFloat | None], why: str = "") -> Row[Braking]:
    """A row of the estimates beside another simulated number, with the reason that `rows.csv` has for it."""
    return row._replace(of=row.of._replace(simulated=simulated), why=why or row.why)


def _of_hardest(row: Row[Braking], simulated: Callable[[Braking], SupportsFloat | None]) -> Row[Braking]:
    """A row of the stop; of several brakings beside what the run shows of the hardest alone."""

    def chosen(b: Braking) -> SupportsFloat | None:
        return simulated(b) if b.run is not None and b.run.brakings > 1 else row.of.simulated(b)

    return _beside(row, chosen)


_OF_HARDEST: dict[str, Callable[[Braking], SupportsFloat | None]] = {
    "stopping time": _rest,
    "stopping angle": _angle,
    "friction work": of_run(lambda run: run.work[-1]),
}
_MAIN = ("stopping time", "brake torque")  # the step's main figures come first
_STOP = {
    name: _of_hardest(STOP[name], _OF_HARDEST[name]) if name in _OF_HARDEST else STOP[name]
    for name in (*_MAIN, *(name for name in STOP if name not in _MAIN))
}
_FIRST = "the first four revolutions are faster than the mean, and their power is another"
_BALANCE = BALANCE | {
    name: _beside(BALANCE[name], simulated, why)
    for name, simulated, why in (
        ("time of four revolutions", _of_four(0), _FIRST),
        ("heat gained in it", _of_four(1), _FIRST),
        ("mean flux kept", _kept_flux, _HEAT["heat into the rim"].why),
    )
}
_PRESSURE = _beside(
    CONTACT["pressure, mean"],
    _run_pressure,
    "the formula leaves out the angle at which the band leaves a lining, and takes friction as at first",
)


def _load(b: Braking) -> tuple[float, float]:
    """Work (J) and time (s) of the classical stop, else of the braking."""
    return (b.work, b.time) if b.stop is None else (b.stop.work, b.stop.time)


def _drum(b: Braking) -> tuple[float, float] | None:
    """Effective drum radius (m) and lines strung of a load on a hook."""
    load = b.scene.duty.load
    radius, lines = getattr(load, "drum_radius", None), getattr(load, "line_count", None)
    return None if radius is None or lines is None else (float(radius), float(lines))


def _hook(angle: Callable[[Braking], SupportsFloat | None]) -> Callable[[Braking], float | None]:
    """Travel of the hook for an angle of the drum."""

    def travel(b: Braking) -> float | None:
        drum, phi = _drum(b), angle(b)
        return None if drum is None or phi is None else drum[0] / drum[1] * float(phi)

    return travel


_OPERATION_SYMBOLS: Symbols[Braking] = {
    **SYMBOLS,
    "r_d": ("m", lambda b: (_drum(b) or (0.0, 0.0))[0]),
    "n|lines": ("1", lambda b: (_drum(b) or (0.0, 0.0))[1]),
    "W|load": ("J", lambda b: _load(b)[0]),
    "τ|load": ("s", lambda b: _load(b)[1]),
}
#: a lever that holds the speed, a load that outweighs the brake: no stop by statics
_NO_STOP = rows(
    "no stop",
    SYMBOLS,
    {
        "mean brake torque": Of(lambda b: b.work * b.R_b / b.travel if b.travel > 0 else None),
        "friction work": Of(lambda b: b.work),
    },
)
_ENDS = rows(
    "operation",
    _OPERATION_SYMBOLS,
    {
        "slack tension, greatest": Of(
            lambda b: b.T_0, of_run(lambda run: np.max(np.asarray(run.series.slack_tension)))
        ),
        "tight tension, greatest": Of(
            lambda b: b.by_statics.ratio * b.T_0, of_run(lambda run: np.max(np.asarray(run.series.tight_tension)))
        ),
        "friction travel": Of(lambda b: b.R_b * b.by_statics.angle, _slid),
        "hook travel": Of(_hook(lambda b: b.by_statics.angle), _hook(_STOP["stopping angle"].of.simulated)),
    },
)
_LOAD = rows(
    "operation",
    _OPERATION_SYMBOLS,
    {
        "energy load of the linings": Of(
            lambda b: _load(b)[0] / b.lining_area, lambda b: None if b.run is None else b.work / b.lining_area
        ),
        "power load of the linings, mean": Of(
            lambda b: _load(b)[0] / (b.lining_area * _load(b)[1]),
            lambda b: None if b.run is None else b.work / (b.lining_area * b.time),
        ),
    },
)


# --- limits -----------------------------------------------------------------------------------------------------------


class Loaded(NamedTuple):
    """A permissible value (`None`: there is none) and what is compared with it, by the estimate and in the run."""

    permissible: float | None
    value: float | None
    simulated: float | None


def _of_row(c: Chain, limit: str, row: Row[_C], context: _C) -> Loaded:
    """A row beside its permissible value."""
    filled = row.at(context)
    return Loaded(c.limits.get(limit), *((None, None) if filled is None else (filled.value, filled.simulated)))


def _stressed(c: Chain) -> Loaded:
    stress = STRESS["thermal stress, surface"].of.simulated(c.after)
    return Loaded(c.after.elastic.permissible, abs(c.after.stress), None if stress is None else abs(float(stress)))


def _margin(unit: str, loaded: Callable[[Chain], Loaded]) -> Of[Chain]:
    """What is left up to a permissible value, by the estimate and by the run; no row without a limit."""

    def left(permissible: float | None, value: float | None) -> float | None:
        return None if permissible is None or value is None else permissible - value

    return Of(
        lambda c: left(*loaded(c)[:2]),
        lambda c: left(loaded(c).permissible, loaded(c).simulated),
        numbers=lambda c: [("permissible", loaded(c)[0] or 0.0, unit), ("found", loaded(c)[1] or 0.0, unit)],
    )


_MARGINS = rows(
    "margin",
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
        "margin, pressure": _margin("Pa", lambda c: _of_row(c, "pressure_permissible", _PRESSURE, c.before)),
        "margin, power load": _margin(
            "W/m^2",
            lambda c: _of_row(c, "power_permissible", _LOAD["power load of the linings, mean"], c.before),
        ),
    },
)


def _verdict(row: SynthesisRow) -> str:
    """Within limit or exceeded by the estimate, and what the run says where that is something else."""
    by_estimate, by_run = (
        None if margin is None else LimitVerdict.WITHIN if margin >= 0 else LimitVerdict.EXCEEDED
        for margin in (row.value, row.simulated)
    )
    return f"{by_estimate}" if by_run in (None, by_estimate) else f"{by_estimate}, in the run {by_run}"


# --- the steps --------------------------------------------------------------------------------------------------------


class Place(NamedTuple, Generic[_C]):
    """Rows by name, and the contexts of a chain, each with the name of its part, in which they are filled."""

    rows: Mapping[str, Row[_C]]
    contexts: Callable[[Chain], Iterable[tuple[_C, str]]]
    ending: str = ""  # of the names


def _heated(found: Pass, names: Iterable[str] = HEATED) -> list[tuple[HeatedPart, str]]:
    """Parts of a pass, by default those that take up heat."""
    return [(found.parts[name], name) for name in names]


_OF_BRAKING = {**PARTITION, **TEMPERATURES, **_RELATIVE, **_BALANCE, **_HEAT, **STRESS, **_STOP, **_ENDS, **_LOAD}
_OF_PART = {**PARTS, **_FOURIER, **BULK}
#: places of `steps.csv`
_PLACES: dict[str, Place[Any]] = {
    "chain": Place({**CHAIN, **_MARGINS}, lambda c: [(c, "")]),
    "all parts": Place(_OF_PART, lambda c: _heated(c.found.first, c.found.first.parts)),
    "heated parts": Place(_OF_PART, lambda c: _heated(c.found.first)),
    "refined parts": Place(_OF_PART, lambda c: _heated(c.found.last), ", refined"),
    "rim properties": Place(PROPERTIES, lambda c: [(c.property_of("rim"), "rim")]),
    "lining properties": Place(PROPERTIES, lambda c: [(c.property_of("lining"), "lining")]),
    "rim cases": Place(STORAGE, lambda c: [(case, case.name) for case in c.rim_cases]),
    "lining cases": Place(INSULATION, lambda c: [(case, case.name) for case in c.lining_cases]),
    "before": Place(_OF_BRAKING | {"pressure, mean": _PRESSURE}, lambda c: [(c.before, "rim")]),
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
    """All rows in the order of `steps.csv`; a line is one row in one place of a step."""
    for line in read("steps.csv"):
        place, name = _PLACES[line["place"]], line["row"]
        for context, part in place.contexts(c):
            row = place.rows[name].of_step(int(line["step"]), context, part, ending=place.ending)
            if row is not None:
                yield dataclasses.replace(row, verdict=_verdict(row)) if name in _MARGINS else row


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
