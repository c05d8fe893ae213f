"""What every row of a table of estimates is made from: scene, inputs, classical stop, and the run if there is one."""

import dataclasses
from typing import Any

import numpy as np

from .._parts._scene import Scene, band_brake
from .._run._result import Result
from ..thermal._heat import PowerShares
from ..thermal._material import Material
from ._classical_staged import internal_friction_at_start
from ._classical_stop import ClassicalStop, friction_at_start
from ._estimate_data import Input
from ._estimate_run import RunValues


@dataclasses.dataclass(frozen=True)
class Basis:
    """What every row is made from: scene, inputs by name, the classical stop and the run where there are any.

    `time` (s), `work` (J), `omega` (rad/s, at first) of the braking: the run's, else the classical stop's. On a staged
    brake each `pair`, `"external"` or `"internal"`, has a basis of its own: `run`, `time`, `work` are that pair's,
    `omega` its greatest sliding speed, `slid` (rad) how far it slides, and `more` (J) the heat that its metal gets from
    the other pair.
    """

    scene: Scene
    inputs: dict[str, Input]
    stop: ClassicalStop | None
    result: Result | None
    run: RunValues | None
    time: float
    work: float
    omega: float
    pair: str = ""
    slid: float | None = None
    more: float = 0.0

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["inputs"][name].value
        except KeyError:
            raise AttributeError(name) from None

    @property
    def part(self) -> str:
        """The metal that rubs: the rim, or the band of an external pair."""
        return "band" if self.pair == "external" else "rim"

    @property
    def metal(self) -> Material:
        """Material of that part."""
        return self.band if self.part == "band" else self.rim

    @property
    def metal_thickness(self) -> float:
        """Its thickness (m)."""
        return self.band_thickness if self.part == "band" else self.rim_thickness

    @property
    def metal_area(self) -> float:
        """Area (m²) of the metal's face over which the heat of the pair spreads."""
        return self.outer_area if self.part == "band" else self.track_area

    @property
    def face_area(self) -> float:
        """Area (m²) of the linings' faces that rub."""
        return self.outer_area if self.part == "band" else self.lining_area

    @property
    def metal_share(self) -> float:
        """Share of the pair's heat that goes into its metal."""
        return self.external_share if self.part == "band" else self.share

    @property
    def metal_heat(self) -> float:
        """Heat into the metal (J)."""
        return self.metal_share * self.heat + self.more

    @property
    def speed(self) -> float:
        """Sliding speed at first (m/s)."""
        brake = band_brake(self.scene)
        return self.omega * float(brake.band.radius if self.part == "band" else brake.pulley.radius)

    @property
    def start_now(self) -> float:
        """Mean temperature of the metal as the braking begins (K)."""
        if self.bodied is not None:
            return float(self.bodied.mean()[0])
        return self.band_start if self.part == "band" else self.start

    @property
    def arm(self) -> float:
        """Radius (m) at which the way is counted."""
        brake = band_brake(self.scene)
        return float(brake.pulley.radius if self.pair == "internal" else brake.band.radius)

    @property
    def travel(self) -> float:
        """Way that the linings rub (m), on the band circle; of an internal pair on the rim."""
        if self.slid is not None:
            return self.arm * abs(self.slid)
        if self.run is None:
            angle = self.omega * self.time / 2
        else:
            angle = np.sum(0.5 * (self.run.omega[1:] + self.run.omega[:-1]) * np.diff(self.run.t))
        return self.arm * abs(float(angle))

    @property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
        if self.pair == "internal":
            return float(np.mean(internal_friction_at_start(self.scene)))
        return float(np.mean(friction_at_start(self.scene)))

    @property
    def heat(self) -> float:
        """Friction work that becomes heat (J)."""
        return float(self.power.split(self.work).heat)

    @property
    def booked(self) -> PowerShares:
        """Shares of the friction power that a run of the scene books."""
        return self.scene.power_shares or PowerShares()

    @property
    def flux(self) -> float:
        """Mean heat flux into the whole track, or into the band (W/m²)."""
        return self.metal_heat / (self.metal_area * self.time)

    @property
    def layered(self) -> RunValues | None:
        """The run where it has a rim in layers."""
        return None if self.run is None or self.run.layers is None else self.run

    @property
    def bodied(self) -> RunValues | None:
        """The run where it has a temperature of the metal, in layers or as a whole."""
        return self.run if self.run is not None and self.run.body is not None else self.layered
