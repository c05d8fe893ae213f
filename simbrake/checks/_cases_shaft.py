"""Validation of torques on the shaft and layers of rope: stops, rest on dry friction, terminal speed, travel."""

import dataclasses
import math

from scipy.integrate import quad

from .._parts._scene import Scene
from ..loads import HookLoad, TorqueLoad
from ..profiles import Constant, PiecewiseLinear
from ..rope import RopeLayers
from ..shaft import AbstractShaftTorque, BearingFriction, EddyCurrentBrake
from ._cases_band import closed_form, stop_scene, time_of
from ._validation import FORM, Case, cases_of_run

_J, _W0 = 800.0, 20.0


def _turning(*shaft: AbstractShaftTorque, load: TorqueLoad, end: float, w0: float = _W0) -> Scene:
    """A pulley with an open band under torques on its shaft."""
    return dataclasses.replace(stop_scene(C=None, T0=0.0, w0=w0, load=load, end=end), shaft=shaft)


def eddy_current_cases() -> list[Case]:
    """Slowing down between two speeds, and lowering of a load at a steady speed."""
    M_m, w_m, low, load = 9e3, 11.0, 3.0, 4e3
    time = quad(lambda w: _J * (w**2 + w_m**2) / (2 * M_m * w * w_m), low, _W0, epsabs=0.0, epsrel=1e-13)[0]
    brake = EddyCurrentBrake(M_m, w_m)  # pyright: ignore
    slowed = _turning(brake, load=TorqueLoad(Constant(0.0)), end=time)
    lowered = _turning(brake, load=TorqueLoad(Constant(load)), end=20.0, w0=0.0)
    kloss = "quadrature: ω at t = ∫ J (ω² + ω_m²)/(2 M_m ω ω_m) dω (Kloss)"
    steady = w_m * (M_m / load - math.sqrt((M_m / load) ** 2 - 1))
    return [
        *cases_of_run("eddy-current brake", slowed, [("speed", kloss, low, lambda r: r.record.y_end.omega)]),
        *cases_of_run(
            "eddy-current brake",
            lowered,
            [("terminal speed", f"{FORM}ω_m [M_m/M − √((M_m/M)² − 1)]", steady, "terminal_speed")],
        ),
    ]


def bearing_cases() -> list[Case]:
    """A pulley that dry friction of the bearings brings to rest, until a growing load exceeds it."""
    M_c, M, s = 5e3, 1e3, 800.0
    load = TorqueLoad(PiecewiseLinear([0.0, 5.0, 25.0], [M, M, M + 20.0 * s]))
    rows = [
        ("stopping time", f"{FORM}J ω_0/(M_c − M)", _J * _W0 / (M_c - M), "stopping_time"),
        ("restart", f"{FORM}where M(t) = M_c", 5.0 + (M_c - M) / s, time_of("restart")),
    ]
    return cases_of_run("bearing friction", _turning(BearingFriction(M_c), load=load, end=11.0), rows)  # pyright: ignore


def rope_cases() -> list[Case]:
    """A stop over two layers of rope, by energy."""
    m, r, d, n, turns, g, T_0 = 40e3, 0.4, 0.04, 8.0, 5.0, 9.80665, 12e3
    scene = stop_scene(C=None, T0=T_0, w0=_W0, load=HookLoad(m, r, n, rope=RopeLayers(d, 4.0, turns)), end=6.0)  # pyright: ignore
    upper, phi = r + math.sqrt(3) / 2 * d, 2 * math.pi * (turns - 4.0)
    M_b = 0.725 * T_0 * (closed_form()["Pi"] - 1)
    energy = 0.5 * (_J + m * (upper / n) ** 2) * _W0**2 - (M_b - m * g * upper / n) * phi
    travel = (upper * phi + r * energy / (M_b - m * g * r / n)) / n
    source = f"{FORM}Σ r_k φ_k/n, J ω_0²/2 = Σ (M_b − m g r_k/n) φ_k"
    return cases_of_run("rope in layers", scene, [("hook travel", source, travel, "hook_travel")])


CASES = (eddy_current_cases, bearing_cases, rope_cases)
