"""Materials by energy level: rims and linings of a scene exchanged, estimated and
simulated, side by side."""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ..._base._faults import Issues, input_error
from ..._base._numbers import ZERO
from ..._base._part import leaves
from ..._base._progress import counting
from ..._base._quantity import unit_suffix
from ..._base._table import Column, Table, Tabular, frozen, plain
from ...hybrid.struct import with_value_at
from ...parts.scene import Scene, band_brake
from ...parts.scene_checks import check_scene
from ...runs.choice import stiffness
from ...runs.edit import with_values
from ...runs.linings import lining_wear
from ...runs.simulate import simulate, solver_for
from ...thermal.materials import Material
from ._braking import Braking
from ._estimates import no_stop
from ._exchanged import named_materials, with_materials
from ._heated import RunValues, run_values
from ._materials import (
    LININGS,
    LiningMaterial,
    RimMaterial,
    lining_material,
    rim_material,
)
from .heating import maximum_temperatures, transmission_table
from .inputs import EstimateData, settle
from .statics import classical_stop

#: times at which a run is evaluated
_TIMES = 512
#: default materials: V's four alloys and cast iron; the linings in the library
DEFAULT_RIMS = ("steel_20L", "magnesium_alloy", "brass", "aluminium_alloy", "cast_iron")
DEFAULT_LININGS = tuple(LININGS)

Energy = (
    Sequence[float] | np.ndarray | Mapping[str, Sequence[float] | np.ndarray] | None
)


# --- one brake application with one pair of materials -------------------------------


#: quantity → unit, meaning, formula of the estimate
QUANTITIES = {
    "friction_work": (
        "J",
        "friction work of the brake application",
        "classical stop, or the hardest brake application of the run",
    ),
    "duration": ("s", "time over which friction works", "as the work"),
    "share": (
        "1",
        "share of the heat into the rim, used for the temperatures",
        "the scene's law, else e_1/(e_1 + e_2)",
    ),
    "effusivity_share": (
        "1",
        "heat partition coefficient of the rim by effusivities",
        "e_1/(e_1 + e_2) (Charron)",
    ),
    "transmission_share": (
        "1",
        "heat partition coefficient of the rim by heat transmission",
        "K_1/(K_1 + K_2) (S-41; V, table 2)",
    ),
    "bulk": ("K", "mean temperature of the heated depth", "T + (2/3) a W/(c G) (S-25)"),
    "bulk_end": ("K", "mean temperature of the rim at the end", "T + a W/(c G_rim)"),
    "surface": (
        "K",
        "maximum temperature of the rim's surface",
        "half-space under falling flux, at least bulk_end",
    ),
    "lining_surface": (
        "K",
        "maximum temperature of the linings' surface",
        "as the rim: surfaces in contact",
    ),
    "maximum": (
        "K",
        "maximum temperature with a third of the flash",
        "T + t_s + t_f/3 (S-26)",
    ),
    "stress": (
        "Pa",
        "thermal stress of the rim's surface",
        "−E α (T_s − T_m)/(1 − ν), slab under constant flux",
    ),
    "stress_ratio": ("1", "thermal stress over the allowable one", "|σ|/σ_p"),
    "wear": (
        "m",
        "mean depth worn off the linings",
        "I(T_s) W cos(β/2)/(f A_l) (Archard)",
    ),
    "mass": ("kg", "mass of the rim", "ρ δ A"),
    "inertia": ("kg*m^2", "inertia of the rim about the shaft", "m (R² + (R − δ)²)/2"),
}


class Compared(NamedTuple):
    """An estimate, and the simulated number beside it where there is one; its unit,
    meaning and formula."""

    value: float
    simulated: float | None
    unit: str
    meaning: str
    formula: str

    @property
    def best(self) -> float:
        """The simulated number, else the estimate."""
        return self.value if self.simulated is None else self.simulated


@frozen
class Case:
    """One brake application with one pair of materials; `flash`: rise of the spots
    (K)."""

    braking: Braking
    rim: RimMaterial
    lining: LiningMaterial
    flash: float

    def scaled(self, s: float) -> "Case":
        """The same from `s` times the speed, under the same torques: time by `s`, work
        by `s²`, flash by `√s`."""
        b = self.braking
        braking = dataclasses.replace(
            b, omega=b.omega * s, time=b.time * s, work=b.work * s**2
        )
        return dataclasses.replace(
            self, braking=braking, flash=self.flash * math.sqrt(s)
        )

    @functools.cached_property
    def surface_rise(self) -> float:
        """Rise (K) of the rim's surface: a half-space has no back, and long brake
        applications warm the rim through."""
        return max(self.braking.falling_rise, self.braking.whole_rise)

    @property
    def limited(self) -> dict[str, float]:
        """Estimates that `criteria` limit; the maximum has a third of the flash."""
        b = self.braking
        surface = b.start_now + self.surface_rise
        rises = maximum_temperatures(b.heated.rise, self.surface_rise, self.flash)
        return {
            "surface": surface,
            "lining_surface": surface,
            "stress_ratio": b.stress_ratio,
            "maximum": b.start_now + float(rises.surface_and_third_flash),
        }

    def transmission(self) -> float:
        """Heat partition coefficient of the rim by heat transmission."""
        b = self.braking
        T = jnp.asarray(b.start_now)
        law = dataclasses.replace(
            transmission_table(),
            rim_conductivity=b.rim.conductivity,
            lining_conductivity=b.lining.conductivity,
        )
        return float(law.share(T, T))

    def wear(self) -> float:
        """Mean depth (m) worn off the linings over all brake applications, each at the
        temperature of the hardest."""
        b = self.braking
        work = b.work if b.run is None else b.run.total_work
        cosine = np.mean(np.asarray(band_brake(b.scene).linings.cosine))
        # ∫ p v dt, as the friction f N acts at R_b/cos(β/2)
        load_way = work * cosine / (b.friction * b.lining_area)
        speed = jnp.asarray(b.travel / b.time)
        rate = self.lining.wear(
            jnp.asarray(load_way) / b.travel,
            speed,
            jnp.asarray(self.limited["surface"]),
        )
        return np.mean(np.asarray(rate)).item() * load_way

    def quantities(self, simulated: bool) -> dict[str, Compared]:
        """All quantities by name, beside those of the run if they are `simulated`."""
        b = self.braking
        mass = rim_mass(b)
        in_run = {}
        values = self.limited | {
            "friction_work": b.work,
            "duration": b.time,
            "share": b.share,
            "effusivity_share": b.effusivity_share,
            "transmission_share": self.transmission(),
            "bulk": b.heated.bulk,
            "bulk_end": b.end,
            "stress": b.stress,
            "wear": self.wear(),
            "mass": mass,
            "inertia": ring_inertia(mass, b),
        }
        if simulated and b.run is not None:
            result = b.run.result
            in_run = {
                "share": b.simulated_share,
                "bulk": b.simulated_bulk,
                "bulk_end": b.simulated_end,
                "surface": b.peak,
            }
            if b.run_stress is not None:
                _, in_run["stress"], in_run["stress_ratio"] = b.run_stress
            if b.scene.network.linings is not None:
                in_run["lining_surface"] = float(result.peak_lining_temperature.value)
            if knows_wear(result.scene):
                in_run["wear"] = float(
                    np.mean(np.asarray(lining_wear(result, self.lining.wear)))
                )
        return {
            name: Compared(values[name], in_run.get(name), *about)
            for name, about in QUANTITIES.items()
        }


def rim_mass(b: Braking) -> float:
    """`ρ δ A` (kg)."""
    return b.rim.density * b.rim_thickness * b.track_area


def ring_inertia(mass: float, b: Braking) -> float:
    """Inertia (kg·m²) of a ring as thick as the rim: `m (R² + (R − δ)²)/2`."""
    return mass * (b.R**2 + (b.R - b.rim_thickness) ** 2) / 2


def knows_wear(scene: Scene) -> bool:
    """Whether runs of a scene have a temperature of the linings, on which their wear
    depends."""
    pair = scene.network.friction
    return pair is not None and pair.lining is not None


class Criterion(NamedTuple):
    """One limit of a pair of materials: value over permissible value, and both in
    words."""

    name: str
    ratio: float  # of temperatures in K
    words: str


def criteria(
    values: Mapping[str, float], rim: RimMaterial, lining: LiningMaterial
) -> list[Criterion]:
    """Limits of the materials for estimated or simulated values (SI)."""

    def hot(name: str, key: str, limit: float, of: str) -> Criterion:
        words = f"{of} {values[key] - ZERO:.0f} °C over {limit - ZERO:.0f} °C"
        return Criterion(name, values[key] / limit, words)

    stress = f"stress {values['stress_ratio']:.2f} × allowable stress"
    return [
        hot("rim temperature", "surface", rim.permissible, "rim"),
        hot("lining temperature", "lining_surface", lining.permissible, "lining"),
        Criterion("thermal stress", values["stress_ratio"], stress),
        hot("melting", "maximum", rim.solidus, "spots"),
    ]


def greatest_work(case: Case) -> tuple[float, str]:
    """Maximum friction work (J) of one brake application that the pair withstands by
    the estimates, and its limiting criterion.

    The same brake application from another speed under the same torques (time by the
    speed, work by its square). Every criterion grows with the speed, so that there is
    one end; 0 where the rim is too hot at the start.
    """
    from scipy.optimize import brentq

    def worst(log_s: float) -> Criterion:
        return max(
            criteria(case.scaled(math.exp(log_s)).limited, case.rim, case.lining),
            key=lambda limit: limit.ratio,
        )

    low = math.log(1e-4)
    high = math.log(1e4)
    if worst(low).ratio >= 1:
        return 0.0, worst(low).name
    end = brentq(lambda x: worst(x).ratio - 1, low, high, xtol=1e-13)
    assert isinstance(end, float)
    return case.braking.work * math.exp(2 * end), worst(end).name


# --- the table ----------------------------------------------------------------------


@frozen
class EnergyLevel:
    """One duty of a comparison: its label, a title in words, and the friction work (J)
    of its hardest application.

    Minimum and maximum among the pairs: with fade, or with an inertia that follows the
    rim's mass, runs differ.
    """

    label: str
    least: float
    most: float
    title: str

    @property
    def words(self) -> str:
        """The work in kJ."""
        low = f"{self.least / 1e3:.4g}"
        high = f"{self.most / 1e3:.4g}"
        return f"{low} kJ" if low == high else f"{low}…{high} kJ"


@frozen
class MaterialRow:
    """One rim and lining material at one energy level.

    - `level`: index of the level; `rim`, `lining`: names; `row["surface"]` is one
      quantity, its estimate (`value`) and the `simulated` number; names as in
      `quantities`
    - `fails`: limits that the pair exceeds, by the simulated number where there is one;
      empty if it is within all
    - `greatest_work` (J): of one brake application that the pair withstands by the
      estimates; `ends`: its limiting criterion
    """

    level: int
    rim: str
    lining: str
    quantities: dict[str, Compared]
    fails: tuple[str, ...]
    greatest_work: float
    ends: str

    @property
    def admissible(self) -> bool:
        return not self.fails

    def __getitem__(self, name: str) -> Compared:
        """A quantity by its name. Raises `KeyError` with the known names."""
        if name not in self.quantities:
            raise KeyError(
                f"no quantity {name!r}; there are: {', '.join(self.quantities)}"
            )
        return self.quantities[name]

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words; of each quantity `{estimate, simulated, unit}`."""
        names = [
            "level",
            "rim",
            "lining",
            "admissible",
            "fails",
            "greatest_work",
            "ends",
        ]
        numbers = {
            name: {"estimate": x.value, "simulated": x.simulated, "unit": x.unit}
            for name, x in self.quantities.items()
        }
        return plain({name: getattr(self, name) for name in names} | numbers)


def _celsius(T: float) -> str:
    return f"{T - ZERO:.0f}"


def _scaled(factor: float, digits: str) -> Callable[[float], str]:
    return lambda value: format(factor * value, digits)


#: columns of the table: quantity, heading, unit, how it is shown, and which of its
#: numbers
_COLUMNS: tuple[tuple[str, str, str, Callable[[float], str], tuple[str, ...]], ...] = (
    ("share", "share", "%", _scaled(100.0, ".1f"), ("value",)),
    ("bulk", "bulk", "°C", _celsius, ("value", "simulated")),
    ("surface", "surface", "°C", _celsius, ("value", "simulated")),
    ("lining_surface", "lining", "°C", _celsius, ("simulated",)),
    ("maximum", "maximum", "°C", _celsius, ("value",)),
    ("stress", "stress", "MPa", _scaled(1e-6, ".0f"), ("value", "simulated")),
    ("stress_ratio", "stress over allowable", "", _scaled(1.0, ".2f"), ("best",)),
    ("wear", "wear", "µm", _scaled(1e6, ".3g"), ("value", "simulated")),
    ("mass", "mass", "kg", _scaled(1.0, ".0f"), ("value",)),
)


@dataclasses.dataclass(frozen=True, eq=False)
class MaterialComparison(Tabular):
    """Rim materials and linings for one duty at one or several energy levels, side by
    side.

    - `levels`, `rims`, `linings`: what is compared; `rows`: one for each combination,
      level by level; `notes`: assumptions and values that could not be simulated
    - `comparison.row("brass", "FK-24A")` is one row; `str` gives the table; `as_dict`
      the same as numbers and words; `dataset` as labelled data; `ranking` the pairs by
      the work that they withstand

    Example:
        >>> table = sb.compare_materials(scene, ["steel_20L", "brass"], ["FK-24A"], run=False)
        >>> [row.rim for row in table.ranking()]
        ['steel_20L', 'brass']
    """

    about: str
    levels: tuple[EnergyLevel, ...]
    rims: tuple[RimMaterial, ...]
    linings: tuple[LiningMaterial, ...]
    rows: tuple[MaterialRow, ...]
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[MaterialRow]:
        return iter(self.rows)

    def row(self, rim: str, lining: str | None = None, level: int = 0) -> MaterialRow:
        """The row of a rim and a lining (the first, if none is named) at a level.
        Raises `KeyError` for other names."""
        lining = self.linings[0].name if lining is None else lining
        for row in self._rows_at(level):
            if (row.rim, row.lining) == (rim, lining):
                return row
        names = (
            f"rims {', '.join(r.name for r in self.rims)}; linings "
            f"{', '.join(x.name for x in self.linings)}"
        )
        raise KeyError(f"no row {rim!r} with {lining!r}; there are: {names}")

    def ranking(self, level: int = -1) -> list[MaterialRow]:
        """Rows of a level, those with the largest friction work first, pairs within all
        limits before all others."""
        rows = self._rows_at(level)
        return sorted(rows, key=lambda row: (not row.admissible, -row.greatest_work))

    def _rows_at(self, level: int) -> list[MaterialRow]:
        level = range(len(self.levels))[level]
        return [row for row in self.rows if row.level == level]

    @property
    def simulated(self) -> bool:
        """Whether any row has simulated temperatures."""
        return any(row["surface"].simulated is not None for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text (SI); numbers that are not finite
        are `None`."""
        return {
            "about": self.about,
            "levels": plain(self.levels),
            "materials": {
                kind: [
                    {"name": x.name, "numbers": x.numbers, "sources": x.sources}
                    for x in materials
                ]
                for kind, materials in (("rims", self.rims), ("linings", self.linings))
            },
            "rows": [row.as_dict() for row in self.rows],
            "ranking": [
                {"rim": row.rim, "lining": row.lining} for row in self.ranking()
            ],
            "notes": list(self.notes),
        }

    def dataset(self) -> Any:
        """The same as an `xarray.Dataset` over `level`, `rim`, `lining`; simulated
        numbers in `<name>_simulated`."""
        import xarray as xr

        places = {
            "level": [level.label for level in self.levels],
            "rim": [rim.name for rim in self.rims],
            "lining": [lining.name for lining in self.linings],
        }
        data = xr.Dataset(coords=places, attrs={"about": self.about})

        def add(name: str, values: Any, **about: str) -> None:
            shape = [len(names) for names in places.values()]
            data[name] = (tuple(places), np.reshape(values, shape), about)

        for name, (unit, meaning, formula) in QUANTITIES.items():
            about = {"units": unit, "meaning": meaning}
            each = [row[name] for row in self.rows]
            add(name, [x.value for x in each], **about, formula=formula)
            simulated = np.array([x.simulated for x in each], float)
            if not np.all(np.isnan(simulated)):
                about["meaning"] += ", simulated"
                add(f"{name}_simulated", simulated, **about)
        works = [row.greatest_work for row in self.rows]
        meaning = "maximum friction work of one brake application, by the estimates"
        add("greatest_work", works, units="J", meaning=meaning)
        add("admissible", [row.admissible for row in self.rows])
        return data

    def parts(self) -> Iterator[str | Table]:
        yield self.about
        for i, level in enumerate(self.levels):
            heading = f"{level.label}: friction work {level.words}"
            yield from ("", heading, self._table(i))
        columns = [
            Column("place", heading=""),
            "rim",
            "lining",
            Column("work", display_units="kJ", show=_scaled(1e-3, ".0f")),
            ("ends", ""),
        ]
        ranked = [
            (n, row.rim, row.lining, row.greatest_work, row.ends)
            for n, row in enumerate(self.ranking(), 1)
        ]
        title = (
            "maximum friction work of one brake application by the estimates, and "
            "its limiting criterion"
        )
        yield from ("", Table(columns, ranked, title), "")
        yield from (f"note: {note}" for note in self.notes)

    def _table(self, level: int) -> Table:
        rows = self._rows_at(level)
        columns = []
        values = []
        for name, heading, unit, show, numbers in _COLUMNS:
            for number in numbers:
                column = [getattr(row[name], number) for row in rows]
                if any(x is not None for x in column):
                    words = heading + " sim." * (number == "simulated")
                    columns.append(
                        Column(
                            f"{name}_{number}",
                            heading=words,
                            display_units=unit,
                            show=show,
                        )
                    )
                    values.append(column)
        verdicts = [
            f"exceeded: {'; '.join(row.fails)}" if row.fails else "within limits"
            for row in rows
        ]
        rims = [row.rim for row in rows]
        linings = [row.lining for row in rows]
        lines = zip(rims, linings, *values, verdicts, strict=True)
        return Table(["rim", "lining", *columns, "verdict"], lines)


# --- the function -------------------------------------------------------------------


def compare_materials(
    scene: Scene,
    rims: Sequence[str | RimMaterial] = DEFAULT_RIMS,
    linings: Sequence[str | LiningMaterial] = DEFAULT_LININGS,
    data: EstimateData | None = None,
    *,
    energy: Energy = None,
    run: bool = True,
    inertia: bool = False,
    rtol: float = 1e-10,
    show: Any = None,
) -> MaterialComparison:
    """Compare materials of rim and linings for the duty of a scene, at one or several
    energy levels.

    - `rims`, `linings`: names of the library (`rim_material`, `lining_material`) or
      custom materials
    - `data`: numbers for the estimates beyond materials, as in `estimates`; its rim
      defaults to that of the scene
    - `energy`: `None`, the scene as it is; friction works (J), each reached by the
      initial speed whose classical stop does that work; or a parameter of the scene
      with its values, `{"initial.omega": [12.0, 24.0]}`
    - `run`: simulate each combination too, if the scene's heat has a rim in layers;
      else the scene once for each level, for time and work. `False`: those of a
      classical stop
    - `inertia`: the pulley's inertia follows the rim's mass; by default the scene's
      stays
    - `rtol`: relative tolerance of runs; `show`: as of `counting`

    For each: shares of the heat, bulk, surface and maximum temperature, thermal stress
    over the permissible one, wear of the linings (Archard, at the temperature of their
    surface), mass and inertia of the rim; whether it is within its limits
    (temperatures, stress, melting of spots), else why; and the maximum friction work
    that it withstands by the estimates. Friction stays that of the scene. Runs of all
    materials are one compiled program.

    Raises `InputError` for input errors of the scene, a staged brake, a scene without a
    classical stop where one is needed, runs without sliding, no or duplicate materials,
    and levels that are not positive; `KeyError` for unknown materials;
    `SimulationError` where a run fails.
    """
    check_scene(scene)
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(scene)):
        raise input_error("scene", "is traced", "give a scene with values")
    if band_brake(scene).in_series:
        raise input_error(
            "brake.bandage", "cannot be compared", "give a brake with one friction pair"
        )
    rim_materials = _alike([rim_material(r) if isinstance(r, str) else r for r in rims])
    lining_materials = _alike(
        [lining_material(x) if isinstance(x, str) else x for x in linings]
    )
    _require_names(rims=rim_materials, linings=lining_materials)
    levels = _levels(scene, energy)
    study = _Study(scene, data or EstimateData(), run, inertia, rtol)
    pairs = [(rim, lining) for rim in rim_materials for lining in lining_materials]
    combined = [
        (i, level, *pair) for i, (*_, level) in enumerate(levels) for pair in pairs
    ]
    scenes = [study.scene_of(level, rim, lining) for _, level, rim, lining in combined]
    # one program for all of them
    solver = solver_for(any(stiffness(s)[0] for s in scenes)) if run else None
    rows = []
    with counting(len(combined), show, "combinations", after=2.0) as report:
        for s, (i, _, rim, lining) in zip(scenes, combined, strict=True):
            rows.append(study.row(i, s, rim, lining, solver))
            report(len(rows))
    energy_levels = []
    for i, (label, title, _) in enumerate(levels):
        works = [row["friction_work"].value for row in rows if row.level == i]
        energy_levels.append(EnergyLevel(label, min(works), max(works), title))
    how = "the runs" if run else "classical stops"
    return MaterialComparison(
        "materials of rim and linings compared; time and friction work are those of "
        f"{how}, temperatures in °C",
        tuple(energy_levels),
        tuple(rim_materials),
        tuple(lining_materials),
        tuple(rows),
        study.notes(lining_materials),
    )


def _require_names(**groups: Iterable[Any]) -> None:
    faults = Issues()
    for name, materials in groups.items():
        names = [material.name for material in materials]
        twice = sorted({known for known in names if names.count(known) > 1})
        if not names:
            faults.add(name, "are none", "at least one material is needed")
        if twice:
            what = f"have {', '.join(twice)} more than once"
            faults.add(name, what, "a name must denote one material")
    faults.report()


def _alike(materials: list[Any]) -> list[Any]:
    """Materials of one structure, so that their runs are one program: a slope that one
    has is 0 in the others."""
    slopes = ("conductivity_slope", "specific_heat_slope")
    used = [
        name
        for name in slopes
        if any(getattr(material.thermal, name) is not None for material in materials)
    ]

    def filled(thermal: Material) -> Material:
        return dataclasses.replace(
            thermal, **{n: 0.0 for n in used if getattr(thermal, n) is None}
        )

    return [
        dataclasses.replace(material, thermal=filled(material.thermal))
        for material in materials
    ]


def _levels(scene: Scene, energy: Energy) -> list[tuple[str, str, Scene]]:
    """Scenes of the energy levels with their labels, and the same in words."""
    if energy is None:
        words = "the duty of the scene"
        return [(words, words, scene)]
    if isinstance(energy, Mapping):
        if len(energy) != 1:
            hint = 'as in {"initial.omega": [12.0, 24.0]}'
            raise input_error(
                "energy", f"names {len(energy)} numbers of the scene", hint
            )
        ((path, values),) = energy.items()
        scenes = [with_values(scene, {path: float(value)}) for value in values]
        about = {leaf.path: leaf.about for leaf in leaves(scene)}.get(path)
        unit = "" if about is None else unit_suffix(about.unit)
        meaning = path if about is None else about.meaning
        levels = []
        for value, level in zip(values, scenes, strict=True):
            check_scene(level)
            shown = f"{float(value):.6g}{unit}"
            levels.append((f"{path} = {shown}", f"{meaning} {shown}", level))
    else:
        works = [float(work) for work in energy]
        wrong = [work for work in works if not 0 < work < math.inf]
        if wrong:
            raise input_error(
                "energy", f"{wrong[0]:g} J is out of range", "friction works are > 0 J"
            )
        levels = []
        for work in works:
            title = f"classical stop of {work / 1e3:g} kJ"
            levels.append((title, title, _of_work(scene, work)))
    if not levels:
        raise input_error(
            "energy", "is empty", "leave it out for the duty of the scene"
        )
    return levels


def _of_work(scene: Scene, work: float) -> Scene:
    """The scene from the initial speed whose classical stop has the friction `work`,
    which grows with the speed."""
    from scipy.optimize import brentq

    def at(omega: float) -> Scene:
        return with_values(scene, {"initial.omega": omega})

    def over(omega: float) -> float:
        stop = classical_stop(at(omega))
        if stop is None:
            raise no_stop("give energy as a parameter of the scene")
        return stop.work / work - 1

    low = high = max(float(scene.start_speed), 1e-3)
    while over(low) > 0:
        low /= 2
    while over(high) < 0:
        high *= 2
    omega = low if low == high else brentq(over, low, high, xtol=1e-13 * high)
    assert isinstance(omega, float)
    return at(omega)


@dataclasses.dataclass
class _Study:
    """The scene of a comparison and the shared data of its rows."""

    scene: Scene
    data: EstimateData
    run: bool
    inertia: bool
    rtol: float

    def __post_init__(self) -> None:
        self.named = named_materials(self.scene.network)
        self._own = settle(self.scene, self.data)
        self._own_mass = rim_mass(Braking.of(self.scene, self._own, None))
        self._runs: dict[bytes, RunValues] = {}

    def scene_of(self, scene: Scene, rim: RimMaterial, lining: LiningMaterial) -> Scene:
        """The scene of a level with the materials, where it names any."""
        scene = with_materials(
            scene,
            rim.thermal if self.named[0] else None,
            lining.thermal if self.named[1] else None,
        )
        # wear alone depends on the pressure
        if self.run and knows_wear(scene) and scene.brake.linings.area is None:
            area = np.asarray(
                self._own["lining_area"].value
                / (scene.brake.rims * scene.brake.linings.count)
            )
            scene = with_value_at(scene, "brake.linings.area", area)
        if self.inertia:
            b = self._braking(scene, rim, lining)
            more = ring_inertia(rim_mass(b) - self._own_mass, b)
            scene = with_values(
                scene, {"brake.pulley.inertia": band_brake(scene).pulley.inertia + more}
            )
            check_scene(scene)
        return scene

    def _braking(
        self,
        scene: Scene,
        rim: RimMaterial,
        lining: LiningMaterial,
        run: RunValues | None = None,
    ) -> Braking:
        # of the softer surface
        hardness = self.data.hardness or min(rim.hardness, lining.hardness)
        data = dataclasses.replace(
            self.data,
            rim=rim.thermal,
            lining=lining.thermal,
            elastic=rim.elastic,
            hardness=hardness,
        )
        inputs = settle(scene, data)
        return Braking.of(scene, inputs, classical_stop(scene), run=run)

    def row(
        self,
        level: int,
        scene: Scene,
        rim: RimMaterial,
        lining: LiningMaterial,
        solver: Any,
    ) -> MaterialRow:
        """One row of the table."""
        braking = self._braking(
            scene, rim, lining, self._ran(scene, solver) if self.run else None
        )
        if braking.stop is None and braking.run is None:
            raise no_stop("let it run")
        case = Case(braking, rim, lining, braking.flash or 0.0)
        quantities = case.quantities(
            simulated=braking.layered is not None and self.named[0]
        )
        best = {name: quantity.best for name, quantity in quantities.items()}
        fails = tuple(
            limit.words for limit in criteria(best, rim, lining) if limit.ratio > 1
        )
        return MaterialRow(
            level, rim.name, lining.name, quantities, fails, *greatest_work(case)
        )

    def _ran(self, scene: Scene, solver: Any) -> RunValues:
        """The run of a scene; scenes whose equations do not depend on the materials run
        once."""
        key = b"".join(
            np.asarray(leaf, float).tobytes() for leaf in jax.tree.leaves(scene)
        )
        if key not in self._runs:
            values = run_values(
                simulate(scene, solver=solver, rtol=self.rtol), times=_TIMES
            )
            if values is None:
                raise input_error(
                    "scene", "has no friction work", "no lining slides in its run"
                )
            self._runs[key] = values
        return self._runs[key]

    def notes(self, linings: list[LiningMaterial]) -> tuple[str, ...]:
        """Notes: assumptions, and values that are not simulated."""
        notes = [
            "friction is the scene's with every lining; numbers of the materials and "
            "their sources: as_dict(), JSON"
        ]
        if self.run and not self.named[0]:
            notes.append(
                "the scene's heat has no rim in layers: temperatures, stress and wear are estimates"
            )
        elif self.scene.network.permissible is not None:
            notes.append(
                "permissible temperatures are those of the materials; that of the "
                "scene is an event of its runs"
            )
        if not self.run:
            notes.append("no runs: estimates only")
        for name in ("track_area", "lining_area", "rim_thickness"):
            size = self._own[name]
            if size.source not in ("given", "scene"):
                notes.append(
                    f"{name} = {size.value:.4g} {size.unit} is not the scene's: {size.source}"
                )
        if not self.inertia:
            notes.append(
                "the pulley's inertia is the scene's for every rim mass (inertia=True "
                "lets it follow)"
            )
        if any(
            "assum" in words
            for lining in linings
            for name, words in lining.sources.items()
            if "wear" in name
        ):
            notes.append(
                "wear coefficients are assumed orders of magnitude: use them for comparison only"
            )
        return tuple(notes)
