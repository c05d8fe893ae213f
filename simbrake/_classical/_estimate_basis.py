"""What every row of a table of estimates is made from: scene, inputs, classical stop, and the run if there is one."""

import dataclasses
from typing import Any

import numpy as np

from .._parts._power_shares import PowerShares
from .._parts._scene import Scene
from .._run._result import Result
from ._classical_stop import ClassicalStop, friction_at_start
from ._estimate_data import Input
from ._estimate_run import RunValues


@dataclasses.dataclass(frozen=True)
class Basis:
    """What every row is made from: scene, inputs by name, the classical stop and the run where there are any.

    `time` (s), `work` (J), `omega` (rad/s, at first) of the braking: the run's, else the classical stop's.
    """

    scene: Scene
    inputs: dict[str, Input]
    stop: ClassicalStop | None
    result: Result | None
    run: RunValues | None
    time: float
    work: float
    omega: float

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["inputs"][name].value
        except KeyError:
            raise AttributeError(name) from None

    @property
    def speed(self) -> float:
        """Track speed at first (m/s)."""
        return self.omega * float(self.scene.brake.pulley.radius)

    @property
    def start_now(self) -> float:
        """Mean temperature of the rim as the braking begins (K)."""
        return self.start if self.run is None or self.run.layers is None else float(self.run.mean()[0])

    @property
    def travel(self) -> float:
        """Way that the linings rub (m), on the band circle."""
        if self.run is None:
            angle = self.omega * self.time / 2
        else:
            angle = np.sum(0.5 * (self.run.omega[1:] + self.run.omega[:-1]) * np.diff(self.run.t))
        return float(self.scene.brake.band.radius) * abs(float(angle))

    @property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
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
        """Mean heat flux into the whole track (W/m²)."""
        return self.share * self.heat / (self.track_area * self.time)

    @property
    def layered(self) -> RunValues | None:
        """The run where it has a rim in layers."""
        return None if self.run is None or self.run.layers is None else self.run
