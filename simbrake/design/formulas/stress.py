"""Thermal stress of a rim, taken as a plate."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._base._faults import require_positive
from .contact import Amount, Layers, SeriesOfTimes


class ElasticMaterial(NamedTuple):
    """Elastic properties of a material for thermal stress.

    `young` `E` (Pa), `expansion` `α_T` (1/K), `poisson` `ν`, `permissible` stress (Pa).
    Defaults: cast carbon steel, textbook values; the permissible stress is an
    assumption.

    Example:
        >>> sb.formulas.ElasticMaterial(young=1.1e11).poisson
        0.3
    """

    young: float = 2.05e11
    expansion: float = 12.0e-6
    poisson: float = 0.30
    permissible: float = 150e6


def surface_stress(surface: Amount, mean: Amount, elastic: ElasticMaterial) -> Amount:
    """Stress of the rim's surface (Pa): `σ = −E α_T (T_s − T_mean)/(1 − ν)` (model
    §6.3), compression negative.

    - `surface` `T_s`, `mean` `T_mean` over the rim's thickness (K)

    Biaxial and equal in both directions of the surface: the rim is a plate that may
    expand as a whole but not bend. Raises `ValueError` as `plate_stress`.

    Reference: S. P. Timoshenko, J. N. Goodier, *Theory of Elasticity* (1951), §132.

    Example:
        >>> elastic = sb.formulas.ElasticMaterial()
        >>> round(sb.formulas.surface_stress(500.0, 400.0, elastic) / 1e6, 1)
        -351.4
    """
    return _modulus(elastic) * (mean - surface)


def plate_stress(
    temperature: Layers,
    depth: Layers,
    elastic: ElasticMaterial,
    *,
    restraint: str = "bending",
) -> Float[np.ndarray, "..."]:
    """Stress (Pa) over a plate with the profile `temperature` (…, k) at the places
    `depth` (k,) from face to face:

        none:    σ = E' (T_m − T + 12 M (z − δ/2)/δ³),   M = ∫ (T − T_m)(z − δ/2) dz     free to expand and to bend
        bending: σ = E' (T_m − T)                                                        free to expand only
        all:     σ = −E' T                                                               held; T is then the rise

    `E' = E α_T/(1 − ν)`, `T_m = ∫ T dz/δ`. A closed rim of a pulley cannot bend along
    its circumference, hence the default. The profile is linear between the depths, the
    integrals are exact for that.

    Raises `ValueError` for another word, depths that do not rise, or constants of the
    material out of range.

    Reference: Timoshenko & Goodier (1951), §132, eqs. (a)…(e).

    Example:
        >>> elastic = sb.formulas.ElasticMaterial()
        >>> stress = sb.formulas.plate_stress([400.0, 300.0], [0.0, 0.03], elastic)
        >>> [round(float(s) / 1e6, 1) for s in stress]
        [-175.7, 175.7]
    """
    z = np.asarray(depth, float)
    T = np.asarray(temperature, float)
    if z.ndim != 1 or z.size < 2 or np.any(np.diff(z) <= 0):
        raise ValueError("depths must rise from face to face")
    if restraint not in ("none", "bending", "all"):
        raise ValueError(
            f"restraint = {restraint!r} must be 'none', 'bending' or 'all'"
        )
    modulus = _modulus(elastic)
    if restraint == "all":
        return -modulus * T
    mean = np.asarray(profile_mean(T, z))[..., None]
    stress = modulus * (mean - T)
    if restraint == "none":
        thickness = z[-1] - z[0]
        middle = 0.5 * (z[0] + z[-1])
        h = np.diff(z)
        arm = z - middle
        away = T - mean
        a_0 = arm[:-1]
        a_1 = arm[1:]
        away_0 = away[..., :-1]
        away_1 = away[..., 1:]
        # both are linear in each layer
        product = away_0 * (2 * a_0 + a_1) + away_1 * (a_0 + 2 * a_1)
        moment = np.sum(h / 6 * product, axis=-1)[..., None]
        stress = stress + modulus * 12 * moment * arm / thickness**3
    return stress


def profile_mean(temperature: Layers, depth: Layers) -> Amount:
    """Mean over the depth, `∫ T dz/δ`, of a profile (…, k) that is linear between the
    depths (k,)."""
    z = np.asarray(depth, float)
    T = np.asarray(temperature, float)
    return np.trapezoid(T, z) / (z[-1] - z[0])


def _modulus(elastic: ElasticMaterial) -> float:
    require_positive(young=elastic.young, permissible=elastic.permissible)
    if not -1 < elastic.poisson < 0.5:
        raise ValueError(f"poisson = {elastic.poisson} must be between −1 and 0.5")
    return elastic.young * elastic.expansion / (1 - elastic.poisson)


class StressHistory(NamedTuple):
    """Thermal stress of a rim over a run (Pa), compression negative."""

    t: SeriesOfTimes  # s
    surface: SeriesOfTimes  # at the track
    back: SeriesOfTimes  # at the bore
    extreme: SeriesOfTimes  # of maximum magnitude over the depth
    ratio: SeriesOfTimes  # |extreme| over the permissible stress

    @property
    def worst(self) -> tuple[float, float, float]:
        """Time (s), stress (Pa) and ratio to the permissible stress where that is
        largest."""
        i = int(np.argmax(self.ratio))
        return float(self.t[i]), float(self.extreme[i]), float(self.ratio[i])


def stress_over_time(
    t: Layers,
    temperature: Layers,
    depth: Layers,
    elastic: ElasticMaterial,
    *,
    restraint: str = "bending",
) -> StressHistory:
    """Stress of a plate with the profiles `temperature` (m, k) at the times `t` (m,);
    else as `plate_stress`.

    Example:
        >>> t, z, T = [0.0, 1.0], [0.0, 0.03], [[300.0, 300.0], [400.0, 300.0]]
        >>> history = sb.formulas.stress_over_time(t, T, z, sb.formulas.ElasticMaterial())
        >>> history.worst[0], round(history.worst[1] / 1e6, 1)
        (1.0, -175.7)
    """
    stress = np.atleast_2d(
        plate_stress(temperature, depth, elastic, restraint=restraint)
    )
    extreme = np.take_along_axis(
        stress, np.argmax(np.abs(stress), axis=1)[:, None], axis=1
    )[:, 0]
    ratio = np.abs(extreme) / elastic.permissible
    return StressHistory(
        np.asarray(t, float), stress[:, 0], stress[:, -1], extreme, ratio
    )
