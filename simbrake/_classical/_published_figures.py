"""Figures of the papers that a formula gives: their curves as numbers.

The pictures themselves are not in the sources that simbrake was made from, so no point could be read off them. What the
curves stand on is checked against the printed tables instead, which hold the same formulas at single points.
"""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._parts._layout import InfeasibleLayout, chord_equal_load_angles, equal_increment_angles
from .._parts._scene import Duty, Initial, Scene
from ..brakes._band import sliding_tensions
from ..brakes._design import Band, Bandage, Brake, Pulley, uniform_linings
from ..friction import ConstantFriction
from ..loads import TorqueLoad
from ..profiles import Constant, PiecewiseLinear
from ..thermal._heat import FlashTemperature
from ..thermal._material import effusivity_share, material
from ._thermal_estimates import maximum_temperatures, mean_bulk_rise, penetration_depth, slab_rise, stopping_rise


class ChordCurves(NamedTuple):
    """Z, Fig. 4: chord angles (m, k) of equal loads over the last angle (m,), both in rad, and where they end."""

    f: float
    last: Float[np.ndarray, " m"]
    angle: Float[np.ndarray, "m k"]
    why_it_ends: str


def chord_curves(f: float, k: int = 7, step: float = math.radians(0.1)) -> ChordCurves:
    """Z-11 with `β_{k−1} = β_k`, from one `step` (rad) up to 90° or to where no such layout exists."""
    found, last, why = [], np.arange(step, 0.5 * math.pi, step), ""
    for beta in last:
        try:
            found.append(chord_equal_load_angles(f, k, float(beta), float(beta)))
        except InfeasibleLayout as error:
            why = str(error)
            break
    return ChordCurves(f, last[: len(found)], np.asarray(found), why)


class BandDiagram(NamedTuple):
    """Z, Fig. 5: central angles (n,) in rad, tension (n + 1,) and normal load (n,) of one layout over `T_0`."""

    name: str
    angle: Float[np.ndarray, " n"]
    tension: Float[np.ndarray, " n_1"]
    normal: Float[np.ndarray, " n"]
    w_0: float  # λ/(Π − 1): at this and smaller ones all linings come to slide


#: numbers of Z, Fig. 5
Z5_LININGS, Z5_WRAP, Z5_FRICTION, Z5_LAMBDA, Z5_W_0 = 10, math.radians(270.0), 0.3, 5.08, 1.5


def band_diagrams() -> tuple[BandDiagram, BandDiagram]:
    """Tension and load along the band in full slip, equal tension increments beside uniform pitch.

    With the figure's `λ` and `w_0` the tension would grow to `1 + λ/w_0 = 4.39 T_0` before the pulley rests; both
    layouts hold less, so that all ten linings slide and the greatest tension is `Π T_0` (Z-14).
    """
    layouts = {
        "equal tension increments": equal_increment_angles(Z5_FRICTION, Z5_LININGS, Z5_LININGS, Z5_WRAP).angle,
        "uniform pitch": np.full(Z5_LININGS, Z5_WRAP / Z5_LININGS),
    }
    found = []
    for name, beta in layouts.items():
        forces = sliding_tensions(jnp.asarray(1.0), jnp.full(Z5_LININGS, Z5_FRICTION), jnp.asarray(beta))
        tension = np.append(1.0, np.asarray(forces.tension))
        found.append(BandDiagram(name, beta, tension, np.asarray(forces.normal), Z5_LAMBDA / float(tension[-1] - 1)))
    return found[0], found[1]


class EnergyLevels(NamedTuple):
    """S, Fig. 1: levels over the time (m,), relative (a stop) or in s (a drag); temperatures are rises (K)."""

    time: Float[np.ndarray, " m"]
    power: Float[np.ndarray, " m"]  # over the mean power
    work: Float[np.ndarray, " m"]  # over the whole work
    bulk: Float[np.ndarray, " m"]
    surface: Float[np.ndarray, " m"]
    maximum: Float[np.ndarray, " m"]  # by S-26


#: what the two panels of S, Fig. 1 are drawn for; the rim is V's, the rest assumed: f_0, V_0 (m/s), p_c (Pa), A_c (m²)
S1_PAIR = {"f_0": 0.35, "V_0": 14.2, "p_c": 0.25e6, "A_c": 1.22}
S1_STOP, S1_DRAG, S1_RIM, S1_TRACK = 1.0, 60.0, 0.025, 1.63  # s, s, m, m²
_DRAG_POWER = 0.1  # of the power of the stop at first
_SPOT, _HARDNESS = 50e-6, 300e6  # m, Pa


def energy_levels(points: int = 201) -> tuple[EnergyLevels, EnergyLevels]:
    """A stop over the relative time, and a drag over time (S, Fig. 1, in our reading).

        P_0 = f_0 p_c A_c V_0;   stop: N/N_m = 2 (1 − s), W/W_T = 2 s − s², s = τ/τ_T;   drag: both even

    Bulk by energy over the depth of step 1, surface by the falling flux (stop) or the slab (drag), the maximum by S-26.
    """
    steel, s = material("steel_20L"), np.linspace(0.0, 1.0, points)
    share = float(effusivity_share(steel, material("FK-24A")))
    first = S1_PAIR["f_0"] * S1_PAIR["p_c"] * S1_PAIR["A_c"] * S1_PAIR["V_0"]
    q, a, heat = share * first / S1_TRACK, float(steel.diffusivity), float(steel.density * steel.specific_heat)
    law = FlashTemperature(_SPOT, float(steel.conductivity), a, share, _HARDNESS)

    def flash(speed: np.ndarray) -> np.ndarray:
        spots = S1_PAIR["f_0"] * _HARDNESS * speed
        return np.asarray(law.rise(jnp.asarray(spots), jnp.asarray(speed)))

    relative = 2 * s - s**2
    depth = min(float(penetration_depth(a, S1_STOP)), S1_RIM)
    mass, work = S1_TRACK * depth * float(steel.density), first * S1_STOP / 2
    # S-25 is the mean over the braking, 2/3 of the rise at its end
    rise = 1.5 * float(mean_bulk_rise(share, work, float(steel.specific_heat), mass))
    surface = np.asarray(stopping_rise(q, s * S1_STOP, S1_STOP, float(steel.effusivity)))
    top = maximum_temperatures(0.0, surface, flash(S1_PAIR["V_0"] * (1 - s))).surface_and_third_flash
    stop = EnergyLevels(s, 2 * (1 - s), relative, rise * relative, surface, np.asarray(top))
    t, drag_q = s * S1_DRAG, _DRAG_POWER * q
    surface = np.asarray(slab_rise(drag_q, t, S1_RIM, steel))
    top = maximum_temperatures(0.0, surface, flash(np.full(points, _DRAG_POWER * S1_PAIR["V_0"])))
    bulk = drag_q * t / (S1_RIM * heat)
    return stop, EnergyLevels(t, np.ones(points), s, bulk, surface, np.asarray(top.surface_and_third_flash))


def overlap_stop(external: float, internal: float) -> Scene:
    """A stop of a staged brake with these coefficients of friction, for K, Fig. 5; the numbers are assumed."""
    brake = Brake(
        Pulley(0.590, 1200.0, width=0.220),
        Band(0.638),
        uniform_linings(20, math.radians(270.0), ConstantFriction(external)),
        Bandage(22.0, ConstantFriction(internal), 4e3),
    )
    duty = Duty(PiecewiseLinear([0.0, 2.0], [0.5e3, 20e3]), TorqueLoad(Constant(8e3)))
    return Scene(brake, duty, Initial(24.0), 8.0)
