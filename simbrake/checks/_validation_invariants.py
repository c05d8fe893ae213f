"""Validation by what must hold in every run: books that close, friction that only takes, holds, derivatives."""

import functools
import math
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from .._base._compiling import DeviceJit
from .._parts._scene import Scene
from .._physics._mechanism import BandMode
from .._run._result import Result
from .._run._simulate import simulate
from ._reference_scenes import closed_form
from ._validation import Case
from ._validation_brakes import ELASTIC, elastic_stop, points, ran, scene_of

_PARTS = {name: value for name, value in ELASTIC.items() if name != "w0"}
_PI = closed_form(T0=8e3, **ELASTIC)["Pi"]
_HOLD = 0.725 * 8e3 * (_PI - 1)


def _duty() -> Scene:
    """Stop, hold, a load that breaks it loose, release, stop again, reversal: all that can happen to one brake."""
    lever = points([8e3, 8e3, 0.0, 0.0, 9e3, 5e3], [0.0, 2.0, 3.0, 3.3, 3.5, 5.0])
    load = points([0.4 * _HOLD, 0.6 * _HOLD, 0.3 * _HOLD, -_HOLD], [0.0, 2.5, 4.0, 6.0])
    return scene_of(lever, load, drag=50.0, **{**ELASTIC, "end": 7.0})


def _flows(run: Callable[[], Result]) -> Callable[[], Any]:
    return functools.cache(lambda: run().series(np.linspace(0.0, 7.0, 701)))


def duty_cases() -> list[Case]:
    """One duty through all modes: energies, signs of power and slip, limits of what sticks."""
    run = ran(_duty())
    course = _flows(run)

    def lost_power() -> float:
        s = course()
        power = (s.tight_tension - s.slack_tension) * s.slip_speed
        return float(max(0.0, -np.min(power)) / np.max(power))

    def falling_heat() -> float:
        heat = np.asarray(course().friction_heat)
        return float(max(0.0, -np.min(np.diff(heat))) / heat[-1])

    def wrong_slip() -> float:
        s = course()
        sign = np.select([s.band_mode == BandMode.SLIP, s.band_mode == BandMode.SLIP_BACK], [1.0, -1.0], 0.0)
        return float(max(0.0, -np.min(sign * s.slip_speed)) / np.max(np.abs(s.slip_speed)))

    def over_limit() -> float:
        """Tension ratio of a band that sticks, beyond its limits."""
        s = course()
        elastic = np.asarray(s.band_mode) == BandMode.ELASTIC
        high = s.tight_tension[elastic] - _PI * s.slack_tension[elastic]
        low = s.slack_tension[elastic] / _PI - s.tight_tension[elastic]
        return float(max(0.0, np.max(high), np.max(low)) / np.max(s.tight_tension))

    def moved_while_held() -> float:
        s = course()
        return float(np.max(np.abs(np.asarray(s.omega)[np.asarray(s.band_mode) == BandMode.HELD])))

    def kinds() -> float:
        return float(len({e.name for e in run().events} & {"stop", "restart", "release", "slip_onset", "full_slip"}))

    return [
        Case("duty/closure of the energies", "first law", 0.0, 1e-9, lambda: run().energy["closure"]),
        Case("duty/negative friction power", "second law: none", 0.0, 1e-12, lost_power),
        Case("duty/friction heat that falls", "second law: none", 0.0, 1e-12, falling_heat),
        Case("duty/slip of the wrong sign", "Coulomb: none", 0.0, 1e-10, wrong_slip),
        Case("duty/sticking beyond the limit", "Coulomb: |F| ≤ f N while stuck", 0.0, 1e-9, over_limit),
        Case("duty/speed while held", "Coulomb: exactly none", 0.0, 0.0, moved_while_held),
        Case("duty/kinds of events", "stop, restart, release, onset, full slip", 5.0, 0.0, kinds),
    ]


def hold_cases() -> list[Case]:
    """An hour of holding: half of the capacity, just below it, and none."""
    found = []
    for share in (0.5, 1 - 1e-12):
        run = ran(scene_of(8e3, share * _HOLD, **{**_PARTS, "w0": 0.0, "end": 3600.0}))

        def moved(run: Any = run) -> float:
            s = run().series(np.linspace(0.0, 3600.0, 25))
            return float(np.max(np.abs(s.phi)) + np.max(np.abs(s.omega)))

        word = "half of the capacity" if share == 0.5 else "capacity less 1e-12"
        found.append(
            Case(f"held 3600 s/{word}", "Coulomb friction below its capacity: moves exactly 0", 0.0, 0.0, moved)
        )
    return found


def symmetry_cases() -> list[Case]:
    """Scaling of inertia and forces together, and a shift of the clock, against the unscaled closed form."""
    truth = closed_form(T0=8e3, **ELASTIC)["stop"]
    k = 1e6
    scaled = ran(elastic_stop(8e3 * k, J=800.0 * k, C=2e5 * k))
    shifted = ran(elastic_stop(time=5.0, end=8.0))
    form = "closed form of the stop"
    return [
        Case(
            "inertia and forces × 1e6/stopping time", f"{form}, unscaled", truth, 1e-11, lambda: scaled().stopping_time
        ),
        Case("clock + 5 s/stopping time", f"{form} + 5 s", truth + 5.0, 1e-11, lambda: shifted().stopping_time),
    ]


def gradient_cases() -> list[Case]:
    """Derivatives of the stopping time by reverse mode; forward mode along all numbers at once."""

    def stopping_time(scene: Scene) -> Any:
        return simulate(scene, rtol=1e-12, max_steps=64).stopping_time

    def both(scene: Scene) -> Any:
        reverse = jax.grad(stopping_time)(scene)
        return reverse, jax.jvp(stopping_time, (scene,), (scene,))[1]

    @functools.cache
    def slopes() -> Any:
        scene = jax.tree.map(np.asarray, elastic_stop())
        return DeviceJit(both)(scene)

    def truth(name: str) -> float:
        # complex step: no difference of near numbers
        values: dict[str, Any] = {"T0": 8e3, **ELASTIC}
        values[name] = values[name] + 1e-200j
        return closed_form(xp=np, **values)["stop"].imag / 1e-200

    places: dict[str, Callable[[Any], Any]] = {
        "f": lambda s: s.brake.linings.friction.coefficient,
        "beta": lambda s: np.sum(s.brake.linings.angle) * math.pi / 180,
        "R": lambda s: s.brake.band.radius,
        "J": lambda s: s.brake.pulley.inertia,
        "C": lambda s: s.brake.band.stiffness,
        "T0": lambda s: np.sum(s.duty.slack_tension.values),
        "w0": lambda s: s.initial.omega,
    }
    source = "closed form of the stop, differentiated"
    found = [
        Case(
            f"elastic stop/∂(stopping time)/∂{name}", source, truth(name), 1e-9, lambda place=place: place(slopes()[0])
        )
        for name, place in places.items()
    ]

    def gap() -> float:
        scene, (reverse, forward) = elastic_stop(), slopes()
        leaves = zip(jax.tree.leaves(reverse), jax.tree.leaves(scene), strict=True)
        return float(forward) / sum(float(np.sum(a * b)) for a, b in leaves)

    return [*found, Case("elastic stop/forward over reverse mode", "chain rule: Σ x ∂t/∂x both ways", 1.0, 1e-9, gap)]


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return duty_cases() + hold_cases() + symmetry_cases() + gradient_cases()
