"""Validation of the other ways to run a scene: prepared, side by side in an ensemble, and in steps from outside."""

import functools
import math
from typing import Any

import numpy as np
from diffrax import Tsit5

from .._run._simulate import prepare
from .._run._stepper import Stepper
from ._cases_band import closed_form, stop_scene
from ._validation import FORM, Case, cases_of

_OMEGA, _J = "initial.omega", "brake.pulley.inertia"
#: five linings of the wrap of twenty
_WIDE: dict[str, Any] = {"n": 5, "beta": 54.0}


def prepared_cases() -> list[Case]:
    """A prepared stop at another speed than the one it was prepared with: time, angle, and a derivative of each."""
    asked, w0, J = ("stopping_time", "stopping_angle"), 26.0, 800.0
    run = functools.cache(lambda: prepare(stop_scene(C=None), asked, rtol=1e-12, max_steps=128, solver=Tsit5()))
    time = J * w0 / (0.725 * 8e3 * (closed_form()["Pi"] - 1))
    angle = 0.5 * w0 * time

    def slope(row: int, path: str) -> Any:
        return lambda run: run.gradient({_OMEGA: w0})[row, run.places[path]].item()

    at = "at another initial speed"
    of_time, of_angle = f"{FORM}J ω_0/(R T_0 (Π − 1)), {at}", f"{FORM}J ω_0²/(2 R T_0 (Π − 1)), {at}"
    rows = [
        ("stopping_time", of_time, time, lambda run: run({_OMEGA: w0}).metrics["stopping_time"]),
        ("stopping_angle", of_angle, angle, lambda run: run({_OMEGA: w0}).metrics["stopping_angle"]),
        ("∂(stopping time)/∂ω_0", f"{of_time}, differentiated", time / w0, slope(0, _OMEGA)),
        ("∂(stopping angle)/∂J", f"{of_angle}, differentiated", angle / J, slope(1, _J)),
    ]
    return cases_of("prepared run", run, 1e-10, rows)


def ensemble_cases() -> list[Case]:
    """Stops side by side, of which the slow ones end before all linings slide, and the last does not stop in time."""
    from ..studies._ensemble import ensemble  # loaded on demand: it imports xarray

    speeds = np.array([20.0, 0.5, 26.0, 60.0, 22.0])
    chi, C = 0.725 * math.sqrt(2e5 / 800.0), 2e5

    def run() -> Any:
        asked = ["slip_onset_time", "full_slip_time", "stopping_time"]
        scene = stop_scene(**_WIDE, end=1.5)
        return ensemble(scene, {_OMEGA: speeds}, asked, rtol=1e-12, solver=Tsit5(), workers=1, progress=False)

    def of(name: str, i: int) -> Any:
        return lambda data: float(data[name].values[i])

    slow = 8e3 / (C * 0.725 * 0.5) + math.pi / (2 * chi)
    source = f"{FORM}model §3, one by one"
    rows = [
        ("stopping time, run 1", source, closed_form(**_WIDE, w0=20.0)["stop"], of("stopping_time", 0)),
        ("stopping time, run 2", f"{FORM}t_0 + π/2χ", slow, of("stopping_time", 1)),
        ("full slip, run 2", "does not come", 0.0, lambda data: float(np.isfinite(data.full_slip_time.values[1]))),
        ("full slip, run 3", source, closed_form(**_WIDE, w0=26.0)["t1"], of("full_slip_time", 2)),
        ("slip onset, run 4", source, closed_form(**_WIDE, w0=60.0)["t0"], of("slip_onset_time", 3)),
        ("stop, run 4", "later than the end", 0.0, lambda data: float(np.isfinite(data.stopping_time.values[3]))),
        ("stopping time, run 5", source, closed_form(**_WIDE, w0=22.0)["stop"], of("stopping_time", 4)),
        ("energy-balance residual", "first law", 0.0, lambda data: float(np.max(data["energy.closure"].values))),
    ]
    return cases_of("ensemble", run, 1e-10, rows)


def stepper_cases() -> list[Case]:
    """A stop in steps under a lever that is pulled harder on the way, put back once, and pulled again.

    In full slip `ω` falls by `R T_0 (Π − 1)/J` a second, so that its value after every step is known.
    """
    R, J, w0, low, high = 0.725, 800.0, 20.0, 4e3, 9e3
    Pi = closed_form()["Pi"]
    fall = {T_0: R * T_0 * (Pi - 1) / J for T_0 in (low, high)}
    middle = w0 - 0.3 * fall[low]
    time = 0.3 + middle / fall[high]

    @functools.cache
    def run() -> dict[str, Any]:
        stepper = Stepper(stop_scene(C=None, T0=low, w0=w0), inputs=["lever"], rtol=1e-12)
        stepper.advance(0.1)
        stepper.advance(0.2)
        state, at = stepper.state(), float(stepper["omega"])
        stepper.advance(0.05, lever=high)
        pulled = float(stepper["omega"])
        stepper.restore(state)
        back = float(stepper["omega"])
        found = stepper.advance(1.0, lever=high)
        (stop,) = (event.time for event in found.events if event.name == "stop")
        return {"middle": at, "pulled": pulled, "back": back, "stop": stop}

    source = f"{FORM}ω_0 − Σ R T_0 (Π − 1) Δt/J"
    rows = [
        ("speed after two steps", source, middle, "middle"),
        ("speed under a harder pull", source, middle - 0.05 * fall[high], "pulled"),
        ("speed put back", source, middle, "back"),
        ("stop", f"{FORM}t_1 + ω_1 J/(R T_0 (Π − 1))", time, "stop"),
    ]
    return cases_of("steps from outside", run, 1e-10, rows)


CASES = (
    prepared_cases,
    ensemble_cases,
    stepper_cases,
)
