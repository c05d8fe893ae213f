"""Validation of the heat of a jump: a rim that fades the friction as it heats."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np
from case_tools import (
    AIR,
    EXPLICIT,
    FORM,
    Slope,
    cases_with_slopes,
    differentiated,
)
from cases_thermal import _F, _J, _N, _R, _W0, _mu
from scenes import stop_scene
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from simbrake import ConstantFriction, Heat, LinearFade, Material
from simbrake.friction import ProductFriction, TabulatedFade
from simbrake.thermal import EffusivityPartition, FrictionHeat, Lump

# rim (J/K), stiffness of the band, lever and static ratio; share of the heat that the
# rim takes, √(λρc) on either side
_RIM = 3e3
_C = 2e4
_TENSION = 4e3
_RATIO = 1.2
_METAL = (48.0, 7800.0, 480.0)
_LINING = (0.8, 2000.0, 1100.0)
_SLOPE = 4e-3
_ABOVE = 310.0
_FLOOR = 0.9
_BLEND = 8.0
_TABLE = [280.0, 320.0, 400.0], [1.0, 0.97, 0.8]
#: temperatures at which a derivative of the friction jumps, of whatever order
_CORNERS = 302.0, 318.0, 320.0, 327.0, 343.0
_LAW = "brake.linings.friction"


def _rounded(x, w):
    """`max(x, 0)`, its corner rounded over `±w` by the polynomial of the manual."""
    u = (x + w) / (2 * w)
    return np.where(
        x <= -w,
        0.0,
        np.where(x >= w, x, w * u**5 * (14 - 28 * u + 20 * u**2 - 5 * u**3)),
    )


def _fading(T):
    """Coefficient of friction at a temperature: fade above a limit down to a floor,
    times a table."""
    lost = _SLOPE * _rounded(T - _ABOVE, _BLEND)
    linear = _FLOOR + _rounded(1 - lost - _FLOOR, _SLOPE * _BLEND)
    return _F * linear * PchipInterpolator(*_TABLE)(T)


def _outcome(result):
    return jnp.stack([result.stopping_time, result.end_temperatures[0]])


def jump_cases():
    """An elastic band that breaks away from static friction and then fades as it heats
    the rim.

    All mechanical energy becomes heat, that of the jump of the tension too:
    `C_r ΔT/a = J (ω_0² − ω²)/2 − (T_n(T) − T_0)²/2C` from the moment on at which the
    band slides.
    """
    share = 1 / (1 + math.sqrt(math.prod(_LINING) / math.prod(_METAL)))

    def excess(T):
        return _TENSION * (_mu(_fading(T)) ** _N - 1)

    def at(w):
        """Temperature of the rim at a speed."""

        def left(T):
            return (
                _RIM * (T - AIR) / share
                + excess(T) ** 2 / (2 * _C)
                - _J * (_W0**2 - w**2) / 2
            )

        found = brentq(left, AIR, 399.0, xtol=1e-13)
        return found

    chi = math.sqrt(_C * _R**2 / _J)
    v = _C * _R * _W0
    cold = float(_fading(AIR))

    def onset(ratio):
        """Time at which the band slides, and the speed then: the rim is cold until
        then."""
        sine = chi * _TENSION * (_mu(ratio * cold) ** _N - 1) / v
        return _TENSION / v + np.arcsin(sine) / chi, _W0 * np.sqrt(1 - sine**2)

    (t_1, w_1) = onset(_RATIO)
    end = at(0.0)

    def speed(T):
        lost = 2 / _J * (_RIM * (T - AIR) / share + excess(T) ** 2 / (2 * _C))
        return math.sqrt(max(_W0**2 - lost, 0.0))

    corners = [w for w in map(speed, _CORNERS) if 0 < w < w_1]
    time = (
        t_1
        + quad(
            lambda w: _J / (_R * excess(at(w))),
            0.0,
            w_1,
            points=corners,
            epsabs=1e-13,
            epsrel=1e-12,
        )[0]
    )
    by_ratio = differentiated(lambda x: onset(x)[0], _RATIO)
    by_ratio += (
        differentiated(lambda x: onset(x)[1], _RATIO) * _J / (_R * excess(at(w_1)))
    )
    metal = Material(*_METAL)
    lining = Material(*_LINING)
    pair = FrictionHeat("rim", None, EffusivityPartition(metal, lining))
    factors = LinearFade(_SLOPE, _ABOVE, _FLOOR, _BLEND), TabulatedFade(*_TABLE)
    law = ProductFriction(ConstantFriction(_F, _RATIO), factors)
    scene = stop_scene(n=_N, beta=50.0, C=_C, T0=_TENSION, law=law, end=5.0)
    scene = dataclasses.replace(
        scene, heat=Heat((Lump("rim", _RIM, AIR),), (), pair, rim="rim")
    )
    balance = (
        "root: C_r ΔT/a = J ω_0²/2 − (T_n(T) − T_0)²/2C, a = e_1/(e_1 + e_2) (Charron)"
    )
    course = (
        "quadrature ∫ J dω/R(T_n(T(ω)) − T_0), T(ω) by energy, f(T) by SciPy's "
        "monotone cubic and by hand"
    )
    rows = [
        ("temperature at rest", balance, end, "end_temperatures.0"),
        (
            "full slip",
            f"{FORM}t_0 + asin(χ T_0 (Π_s − 1)/(C R ω_0))/χ",
            t_1,
            "full_slip_time",
        ),
        ("stopping time", course, time, "stopping_time"),
        (
            "elastic energy at rest",
            f"{balance}; T_n²/2C",
            (excess(end) + _TENSION) ** 2 / (2 * _C),
            "energy.elastic_change",
        ),
        # the second derivative of the table jumps at 320 K, which derivatives of a run
        # feel
        (
            "∂(stopping time)/∂(f_s/f)",
            f"{course}, differentiated",
            by_ratio,
            Slope(f"{_LAW}.base.static_ratio", 0),
            5e-7,
        ),
    ]
    return cases_with_slopes(
        "heat of a jump", scene, rows, _outcome, 1e-11, solver=EXPLICIT
    )


CASES = (jump_cases,)
