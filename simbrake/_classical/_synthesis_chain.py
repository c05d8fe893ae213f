"""What the twelve steps of the synthesis share: the braking, its properties before and after, and the run beside it."""

import dataclasses
import functools
import math
from typing import Any, NamedTuple

import numpy as np

from .._parts._scene import Scene
from .._run._networks import with_temperatures
from .._run._series import Series
from ..thermal._heat import initial_temperatures
from ._classical_stop import ClassicalStop, classical_stop
from ._estimate_basis import Basis
from ._estimate_data import Input, rim_wall
from ._estimate_run import schmidt_of_run
from ._property_iteration import PARTS, Pass, Refinement
from ._schmidt import SchmidtCourse, schmidt
from ._thermal_estimates import penetration_depth
from ._wall_course import WallCourse, wall_course


class Permissible(NamedTuple):
    """Permissible values that the synthesis compares with; `None`: no such limit.

    - `lining` (K): of the friction surface; `None`: the scene's `heat.permissible`, else 400 °C (assumption)
    - `back` (K): at the lining's back, where rivets or a bond hold it; 120 °C by default (assumption)
    - `pressure` (Pa), nominal; `power` (W/m²) of friction per area of the linings

    The permissible stress of the rim stands in `EstimateData.elastic`.
    """

    lining: float | None = None
    back: float = 273.15 + 120.0
    pressure: float | None = None
    power: float | None = None

    def settled(self, scene: Scene) -> tuple[Input, ...]:
        """Every limit there is, and where it is from."""
        known = scene.network.permissible
        lining = Input("lining_permissible", 673.15, "K", "assumption: friction composite, 400 °C")
        if self.lining is not None:
            lining = lining._replace(value=self.lining, source="given")
        elif known is not None:
            lining = lining._replace(value=float(known), source="scene")
        back = "given" if self.back != Permissible().back else "assumption: rivets or bond, 120 °C"
        more = [("pressure_permissible", self.pressure, "Pa"), ("power_permissible", self.power, "W/m^2")]
        rest = [Input(name, value, unit, "given") for name, value, unit in more if value is not None]
        return (lining, Input("back_permissible", self.back, "K", back), *rest)


@dataclasses.dataclass(frozen=True)
class Chain:
    """The braking of a synthesis: `before` with properties at room temperature, `after` with those of step 7.

    `found`: the iteration between the two; `start`: temperatures (K) of the parts as the braking begins; `limits` (SI).
    """

    before: Basis
    after: Basis
    found: Refinement
    start: dict[str, float]
    limits: dict[str, float]
    seen: "Seen | None"

    @property
    def first(self) -> Pass:
        return self.found.first

    @property
    def last(self) -> Pass:
        return self.found.last

    @functools.cached_property
    def schmidt(self) -> SchmidtCourse:
        """Schmidt's scheme over the braking: with the run's own heat, else with the falling power of a stop."""
        b = self.after
        share = b.share * float(b.power.heat)
        wall = rim_wall(b.scene)
        if b.layered is not None and wall is not None:
            return schmidt_of_run(b.layered, dataclasses.replace(wall, material=b.rim), share, b.track_area)
        layers = int(np.clip(math.sqrt(1e4 / (float(b.rim.diffusivity) * b.time / b.rim_thickness**2)), 8, 100))

        def work(t: float) -> float:
            if b.run is not None:
                return float(np.interp(b.run.t[0] + t, b.run.t, b.run.work))
            s = min(t / b.time, 1.0)
            return b.work * (2 * s - s**2)

        def flux(t0: float, t1: float) -> float:
            return share * (work(t1) - work(t0)) / (b.track_area * (t1 - t0))

        return schmidt(b.rim, b.rim_thickness, layers, b.time, flux, start=self.start["rim"])

    @property
    def lining_body(self) -> float:
        """Mean temperature of the whole lining as the braking begins (K)."""
        known = None if self.seen is None else self.seen.lining
        return self.start["lining"] if known is None else float(known.mean(math.inf)[0])

    @functools.cached_property
    def stop(self) -> ClassicalStop | None:
        """The classical stop of the scene; of a run with several brakings, that from its hardest one's beginning."""
        b = self.before
        if b.run is None or self.seen is None or b.run.brakings == 1:
            return b.stop
        return classical_stop(self.seen.scene)


@dataclasses.dataclass(frozen=True)
class Seen:
    """The run over its hardest braking: columns, layers of rim and lining, and the scene as that braking finds it."""

    series: Series
    rim: WallCourse | None
    lining: WallCourse | None
    scene: Scene

    @property
    def face(self) -> float | None:
        """Greatest temperature of the linings' face (K), of the rim's where only that is known."""
        s = self.series
        known = [c for c in (s.lining_temperature, s.rim_temperature) if c is not None]
        return float(np.max(np.asarray(known[0]))) if known else None


def seen(b: Basis) -> Seen | None:
    """What a run shows over its hardest braking; `None` without a run."""
    if b.run is None or b.result is None:
        return None
    s, scene, heat = b.result.series(b.run.t), b.scene, b.scene.network
    initial = dataclasses.replace(
        scene.initial, omega=np.asarray(b.run.omega[0]), time=np.asarray(b.run.t[0]), elongation=np.asarray(0.0)
    )
    if s.temperature is None:
        return Seen(s, None, None, dataclasses.replace(scene, initial=initial))
    stores = np.asarray(s.temperature)[0, : initial_temperatures(heat).size]
    then = dataclasses.replace(scene, initial=initial, heat=with_temperatures(heat, stores))
    return Seen(s, wall_course(heat, s, heat.rim), wall_course(heat, s, heat.linings), then)


def start_temperatures(b: Basis, found: Seen | None) -> dict[str, float]:
    """Mean temperatures (K) of rim, lining and band as the braking begins; without a run all as the rim.

    The lining's is that of the depth which the braking heats: a lining that has braked before is hot at its face.
    """
    start = dict.fromkeys(PARTS, b.start_now)
    if found is not None and found.lining is not None:
        depth = float(penetration_depth(float(b.lining.diffusivity), b.time))
        start["lining"] = float(found.lining.mean(depth)[0])
    if found is not None and found.series.band_temperature is not None:
        start["band"] = float(np.mean(np.asarray(found.series.band_temperature)[0]))
    return start


def with_properties(b: Basis, found: Pass) -> Basis:
    """The same braking with the properties and the share of a pass."""
    changed: dict[str, Any] = {**{part: found.materials[part] for part in PARTS}, "share": found.share}
    inputs = {name: i._replace(value=changed.get(name, i.value)) for name, i in b.inputs.items()}
    return dataclasses.replace(b, inputs=inputs)
