"""Materials by energy level: rims and linings of a scene exchanged, estimated and simulated, side by side."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer

from .._base._faults import Fault, InputError
from .._base._progress import Progress
from .._base._quantity import leaves
from .._parts._scene import Scene, band_brake, check
from .._run._choice import stiffness
from .._run._edit import named_materials, with_materials, with_values
from .._run._result import Result
from .._run._simulate import simulate, solver_for
from ..thermal._material import Material
from ._classical_stop import classical_stop
from ._estimate_basis import Basis
from ._estimate_data import EstimateData, settle
from ._estimate_run import RunValues, run_values
from ._material_data import LININGS, LiningMaterial, RimMaterial, lining_material, rim_material
from ._material_estimate import (
    Case,
    Compared,
    criteria,
    estimated,
    greatest_work,
    knows_wear,
    rim_mass,
    ring_inertia,
    simulated,
)
from ._material_table import EnergyLevel, MaterialComparison, MaterialRow

#: times at which a run is looked at
_LOOKS = 512
#: what is compared by default: V's four alloys and cast iron; the linings of which the library has numbers
DEFAULT_RIMS = ("steel_20L", "magnesium_alloy", "brass", "aluminium_alloy", "cast_iron")
DEFAULT_LININGS = tuple(LININGS)

Energy = Sequence[float] | np.ndarray | Mapping[str, Sequence[float] | np.ndarray] | None


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
    """Compares materials of rim and linings for the duty of a scene, at one or several energy levels.

    - `rims`, `linings`: names of the library (`rim_material`, `lining_material`) or materials of one's own
    - `data`: numbers for the estimates beyond materials, as in `estimates`; its rim is what the scene has if that does
      not say so
    - `energy`: `None`, the scene as it is; friction works (J), for each of which the initial speed is sought whose
      classical stop does that work; or a number of the scene with its values, as `{"initial.omega": [12.0, 24.0]}`
    - `run`: simulate each combination too, if the scene's heat has a rim in layers; else the scene once for each level,
      for time and work. `False`: those of a classical stop
    - `inertia`: the pulley's inertia follows the rim's mass; by default the scene's stays
    - `rtol`: relative tolerance of runs; `show`: as of `Progress`

    For each: shares of the heat, bulk, surface and maximum temperature, thermal stress over the permissible one, wear
    of the linings (Archard, at the temperature of their surface), mass and inertia of the rim; whether it is admissible
    (temperatures, stress, melting of spots), else why; and the greatest friction work that it can take by the
    estimates. Friction stays that of the scene. Runs of all materials are one compiled program.

    Raises `InputError` for faults of the scene, a staged brake, a scene without a classical stop where one is needed,
    runs in which nothing slides, materials twice or none, and levels that are not positive; `KeyError` for unknown
    materials; `SimulationError` where a run fails.
    """
    check(scene)
    _require(scene)
    found_rims = _alike([rim_material(r) if isinstance(r, str) else r for r in rims])
    found_linings = _alike([lining_material(x) if isinstance(x, str) else x for x in linings])
    _require_names(rims=found_rims, linings=found_linings)
    levels = _levels(scene, energy)
    study = _Study(scene, data or EstimateData(), run, inertia, rtol)
    pairs = [(rim, lining) for rim in found_rims for lining in found_linings]
    combined = [(i, level, *pair) for i, (_, level) in enumerate(levels) for pair in pairs]
    scenes = [study.scene_of(level, rim, lining) for _, level, rim, lining in combined]
    solver = solver_for(any(stiffness(s)[0] for s in scenes)) if run else None  # one program for all of them
    progress = Progress(len(combined), show, what="combinations", after=2.0)
    rows = []
    for s, (i, _, rim, lining) in zip(scenes, combined, strict=True):
        rows.append(study.row(i, s, rim, lining, solver))
        progress.add(1)
    progress.close()
    works = [[row["friction_work"].value for row in rows if row.level == i] for i in range(len(levels))]
    told = tuple(EnergyLevel(words, min(w), max(w)) for (words, _), w in zip(levels, works, strict=True))
    return MaterialComparison(
        study.about(), told, tuple(found_rims), tuple(found_linings), tuple(rows), study.notes(found_linings)
    )


def _require(scene: Scene) -> None:
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(scene)):
        raise InputError([Fault("scene", "is traced", "give a scene with values")])
    if band_brake(scene).in_series:
        raise InputError([Fault("brake.bandage", "is not for this comparison", "it is of a brake with one pair")])


def _require_names(**groups: Iterable[Any]) -> None:
    faults = []
    for name, found in groups.items():
        names = [one.name for one in found]
        twice = sorted({one for one in names if names.count(one) > 1})
        if not names:
            faults.append(Fault(name, "are none", "at least one material is needed"))
        if twice:
            faults.append(Fault(name, f"have {', '.join(twice)} more than once", "a name stands for one material"))
    if faults:
        raise InputError(faults)


def _alike(found: list[Any]) -> list[Any]:
    """Materials of one structure, so that their runs are one program: a slope that one has is 0 in the others."""
    slopes = ("conductivity_slope", "specific_heat_slope")
    used = [name for name in slopes if any(getattr(one.thermal, name) is not None for one in found)]

    def filled(thermal: Material) -> Material:
        return dataclasses.replace(thermal, **{n: 0.0 for n in used if getattr(thermal, n) is None})  # pyright: ignore

    return [dataclasses.replace(one, thermal=filled(one.thermal)) for one in found]


def _levels(scene: Scene, energy: Energy) -> list[tuple[str, Scene]]:
    """Scenes of the energy levels with what sets them apart."""
    if energy is None:
        return [("the scene's own duty", scene)]
    if isinstance(energy, Mapping):
        if len(energy) != 1:
            hint = 'as in {"initial.omega": [12.0, 24.0]}'
            raise InputError([Fault("energy", f"names {len(energy)} numbers of the scene", hint)])
        ((path, values),) = energy.items()
        scenes = [with_values(scene, {path: float(value)}) for value in values]
        unit = next((f" {leaf.about.unit}" for one in scenes for leaf in leaves(one) if leaf.path == path), "")
        unit = "" if unit in (" 1", " SI") else unit
        found = [(f"{path} = {float(v):.6g}{unit}", one) for v, one in zip(values, scenes, strict=True)]
        for _, one in found:
            check(one)
    else:
        works = [float(work) for work in energy]
        wrong = [work for work in works if not (work > 0 and np.isfinite(work))]
        if wrong:
            raise InputError([Fault("energy", f"{wrong[0]:g} J is not admissible", "friction works are > 0 J")])
        found = [(f"classical stop of {work / 1e3:g} kJ", _of_work(scene, work)) for work in works]
    if not found:
        raise InputError([Fault("energy", "is empty", "leave it out for the scene's own duty")])
    return found


def _of_work(scene: Scene, work: float) -> Scene:
    """The scene from the initial speed whose classical stop has the friction `work`, which grows with the speed."""
    from scipy.optimize import brentq

    def at(omega: float) -> Scene:
        return with_values(scene, {"initial.omega": omega})

    def over(omega: float) -> float:
        stop = classical_stop(at(omega))
        if stop is None:
            hint = "it must begin in motion and the brake outweigh its load; or give energy as a number of the scene"
            raise InputError([Fault("scene", "has no classical stop for a friction work", hint)])
        return stop.work / work - 1

    low = high = max(float(scene.initial.omega), 1e-3)
    while over(low) > 0:
        low /= 2
    while over(high) < 0:
        high *= 2
    omega = low if low == high else brentq(over, low, high, xtol=1e-13 * high)
    assert isinstance(omega, float)
    return at(omega)


@dataclasses.dataclass
class _Study:
    """The scene of a comparison and what its rows have in common."""

    scene: Scene
    data: EstimateData
    run: bool
    inertia: bool
    rtol: float

    def __post_init__(self) -> None:
        self.named = named_materials(self.scene.network)
        own = self._own = settle(self.scene, self.data)
        self._own_mass = float(own["rim"].value.density) * own["rim_thickness"].value * own["track_area"].value
        self._area = own["lining_area"].value
        self._runs: dict[bytes, tuple[Result, RunValues]] = {}

    def scene_of(self, scene: Scene, rim: RimMaterial, lining: LiningMaterial) -> Scene:
        """The scene of a level with the materials, where it names any."""
        scene = with_materials(scene, rim.thermal if self.named[0] else None, lining.thermal if self.named[1] else None)
        if self.run and knows_wear(scene) and scene.brake.linings.area is None:  # wear alone looks at the pressure
            area = np.asarray(self._area / scene.brake.linings.count)
            scene = eqx.tree_at(lambda s: s.brake.linings.area, scene, area, is_leaf=lambda x: x is None)
        if self.inertia:
            b = self._basis(scene, rim, lining, None, None)
            more = ring_inertia(rim_mass(b) - self._own_mass, float(band_brake(scene).pulley.radius), b.rim_thickness)
            scene = with_values(scene, {"brake.pulley.inertia": float(band_brake(scene).pulley.inertia) + more})
            check(scene)
        return scene

    def _basis(
        self, scene: Scene, rim: RimMaterial, lining: LiningMaterial, result: Result | None, values: RunValues | None
    ) -> Basis:
        hardness = self.data.hardness or min(rim.hardness, lining.hardness)  # of the softer surface
        data = dataclasses.replace(
            self.data, rim=rim.thermal, lining=lining.thermal, elastic=rim.elastic, hardness=hardness
        )
        inputs, stop = settle(scene, data), classical_stop(scene)
        if values is not None:
            work, first = float(values.work[-1]), float(abs(values.omega[0]))
            return Basis(scene, inputs, stop, result, values, values.duration, work, first)
        time, work = (0.0, 0.0) if stop is None else (stop.time, stop.work)
        return Basis(scene, inputs, stop, None, None, time, work, float(scene.initial.omega))

    def row(self, level: int, scene: Scene, rim: RimMaterial, lining: LiningMaterial, solver: Any) -> MaterialRow:
        """One row of the table."""
        result, values = self._ran(scene, solver) if self.run else (None, None)
        basis = self._basis(scene, rim, lining, result, values)
        if basis.stop is None and values is None:
            hint = "it must begin in motion and the brake outweigh its load; or let it run"
            raise InputError([Fault("scene", "has no classical stop", hint)])
        case = Case(basis, rim, lining)
        by_formula = estimated(case)
        by_run = simulated(case, result) if result is not None and self.named[0] else {}
        quantities = {name: Compared(value, by_run.get(name)) for name, value in by_formula.items()}
        looked = {name: one.best for name, one in quantities.items()}
        fails = tuple(one.words for one in criteria(looked, rim, lining) if one.ratio > 1)
        return MaterialRow(level, rim.name, lining.name, quantities, fails, *greatest_work(case))

    def _ran(self, scene: Scene, solver: Any) -> tuple[Result, RunValues]:
        """The run of a scene; scenes whose equations do not know the materials run once."""
        key = b"".join(np.asarray(leaf, float).tobytes() for leaf in jax.tree.leaves(scene))
        if key not in self._runs:
            result = simulate(scene, solver=solver, rtol=self.rtol)
            values = run_values(result, looks=_LOOKS)
            if values is None:
                raise InputError([Fault("scene", "has no friction work", "nothing ever slides in its run")])
            self._runs[key] = result, values
        return self._runs[key]

    def about(self) -> str:
        """What stands on what."""
        how = "time and friction work are those of " + ("the runs" if self.run else "classical stops")
        return f"materials of rim and linings compared; {how}, temperatures in °C"

    def notes(self, linings: list[LiningMaterial]) -> tuple[str, ...]:
        """What is assumed, and what is not simulated."""
        found = [
            "friction is the scene's with every lining; numbers of the materials and their sources: as_dict(), JSON"
        ]
        if self.run and not self.named[0]:
            found.append("the scene's heat has no rim in layers: temperatures, stress and wear are estimates")
        elif self.scene.network.permissible is not None:
            found.append("permissible temperatures are those of the materials; the scene's own is an event of its runs")
        if not self.run:
            found.append("no runs: estimates only")
        for name in ("track_area", "lining_area", "rim_thickness"):
            size = self._own[name]
            if size.source not in ("given", "scene"):
                found.append(f"{name} = {size.value:.4g} {size.unit} is not the scene's: {size.source}")
        if not self.inertia:
            found.append("the pulley's inertia is the scene's whatever the rim weighs (inertia=True lets it follow)")
        if any("assum" in words for one in linings for name, words in one.sources.items() if "wear" in name):
            found.append("wear coefficients are assumed orders of magnitude: compare them, do not trust them")
        return tuple(found)
