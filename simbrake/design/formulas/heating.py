"""Heating by a stop: depth, Fourier numbers, temperatures, balance, layers, rational
thickness."""

import math
from collections.abc import Callable
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._base._faults import require_not_negative, require_positive, require_share
from ...hybrid.arrays import Array
from ...thermal.heat import TransmissionPartition
from ...thermal.materials import Material
from .contact import Amount, Depths, Profiles, SeriesOfTimes


def penetration_depth(diffusivity: Amount, time: Amount) -> Amount:
    """Thermal penetration depth (m) in the `time` `τ` (s): `b = 1.73 √(a τ)` (S, step 1
    of the synthesis).

    `1.73` is √3, so that `Fo = a τ/b² = 1/3` at that depth. `diffusivity` `a` in m²/s.
    Raises `ValueError` for a diffusivity that is not positive or a negative time.

    Example:
        >>> round(float(sb.formulas.penetration_depth(1.2e-5, 1.0)), 6)
        0.005993
    """
    require_positive(diffusivity=diffusivity)
    require_not_negative(time=time)
    return 1.73 * np.sqrt(diffusivity * np.asarray(time, float))


def fourier_number(diffusivity: Amount, time: Amount, depth: Amount) -> Amount:
    """`Fo = a τ/δ²` (S-15); below 0.01 the back face counts as adiabatic, S expects no
    more than 15.

    `diffusivity` `a` (m²/s), `time` `τ` (s), `depth` `δ` (m). Raises `ValueError` as
    `penetration_depth`.

    Example:
        >>> round(float(sb.formulas.fourier_number(1.2e-5, 1.0, 0.01)), 6)
        0.12
    """
    require_positive(diffusivity=diffusivity, depth=depth)
    require_not_negative(time=time)
    return diffusivity * np.asarray(time, float) / np.asarray(depth, float) ** 2


def fourier_parameter(diffusivity: Amount, depth: Amount) -> Amount:
    """`B = a/δ²` in 1/s, so that `Fo = B τ` (S, table 1, which prints 1000 times that
    for the rim).

    Example:
        >>> round(float(sb.formulas.fourier_parameter(1.2e-5, 0.01)), 6)
        0.12
    """
    return fourier_number(diffusivity, 1.0, depth)


def effective_fourier_number(
    diffusivity: Amount, time: Amount, thickness: Amount
) -> Amount:
    """Fourier number of a part, `a τ/δ²` while heat reaches through it, else 1/3 (S,
    step 2 of the synthesis).

    `1/3` where `1.73 √(a τ) ≤ δ`: the depth is then the penetration depth itself.
    Raises `ValueError` as above.

    Example:
        >>> x = sb.formulas.effective_fourier_number(1.2e-5, [1.0, 20.0], 0.01)
        >>> [round(float(Fo), 4) for Fo in x]
        [0.3333, 2.4]
    """
    through = penetration_depth(diffusivity, time) > np.asarray(thickness, float)
    return np.where(through, fourier_number(diffusivity, time, thickness), 1 / 3)[()]


def effective_volume(area: Amount, thickness: Amount, depth: Amount) -> Amount:
    """Volume (m³) that takes up heat: `ψV = A min(b, δ)` (S, step 3), `area` `A` (m²),
    thicknesses in m.

    Raises `ValueError` where an argument is not positive (the depth: negative).

    Example:
        >>> round(float(sb.formulas.effective_volume(1.6, 0.025, 0.01)), 6)
        0.016
    """
    require_positive(area=area, thickness=thickness)
    require_not_negative(depth=depth)
    return area * np.minimum(depth, thickness)


def mean_bulk_rise(
    share: Amount, work: Amount, specific_heat: Amount, mass: Amount
) -> Amount:
    """Mean rise of the bulk temperature (K) in a brake application:
    `ΔT_v = (2/3) a W/(c G)` (S-25).

    - `share` `a` of the friction `work` `W` (J) that goes into the part;
      `specific_heat` `c` (J/(kg·K)); `mass` `G` (kg) of its effective volume

    `2/3` is the mean over the brake application of heat input with a linearly falling
    power, `∫(2s − s²)ds` from 0 to 1; the rise at its end is `a W/(c G)`. Raises
    `ValueError` for numbers outside their ranges.

    Example:
        >>> round(float(sb.formulas.mean_bulk_rise(0.9, 880e3, 500.0, 400.0)), 4)
        2.64
    """
    require_positive(specific_heat=specific_heat, mass=mass)
    require_not_negative(work=work)
    require_share(share=share)
    return 2 / 3 * share * work / (specific_heat * mass)


def half_space_rise(flux: Amount, time: Amount, effusivity: Amount) -> Amount:
    """Surface rise (K) of a half-space under a constant `flux` `q` (W/m²):
    `ΔT = 2 q √(τ/π)/e`.

    `effusivity` `e = √(λ ρ c)` (W·√s/(m²·K)). Raises `ValueError` where it is not
    positive or the time is negative.

    Reference: H. S. Carslaw, J. C. Jaeger, *Conduction of Heat in Solids* (1959), §2.9,
    eq. (7).

    Example:
        >>> round(float(sb.formulas.half_space_rise(1e6, 1.0, 14e3)), 3)
        80.599
    """
    require_positive(effusivity=effusivity)
    require_not_negative(time=time)
    return 2 * flux * np.sqrt(np.asarray(time, float) / math.pi) / effusivity


def stopping_rise(
    flux: Amount, time: Amount, duration: Amount, effusivity: Amount
) -> Amount:
    """Surface rise (K) of a half-space while the flux falls linearly,
    `q(t) = q_0 (1 − t/τ)`, as in a stop:

        ΔT(t) = (2 q_0/e) √(t/π) (1 − 2 t/(3 τ)),   maximum at t = τ/2: (2/3)(2 q_0/e)
        √(τ/(2π))

    - initial `flux` `q_0` (W/m²), `time` `t ≤ τ`, `duration` `τ` of the brake
      application (s), `effusivity` `e`

    Superposition of `half_space_rise` (Carslaw & Jaeger, §2.9). Raises `ValueError`
    outside `0 ≤ t ≤ τ`.

    Example:
        >>> round(float(sb.formulas.stopping_rise(2e6, 0.5, 1.0, 14e3)), 3)
        75.989
    """
    require_positive(duration=duration)
    _require_within(time, duration)
    t = np.asarray(time, float)
    return half_space_rise(flux, t, effusivity) * (1 - 2 * t / (3 * duration))


def _require_within(time: Amount, duration: Amount) -> None:
    if np.any(np.asarray(time, float) > duration):
        raise ValueError(
            f"time = {time} is after the end of the brake application at {duration}"
        )


def slab_rise(
    flux: Amount,
    time: Amount,
    thickness: Amount,
    material: Material,
    depth: Amount = 0.0,
) -> Amount:
    """Rise (K) at a `depth` `x` below the heated face of a slab with an adiabatic back,
    under a constant flux:

        ΔT = (q δ/λ) {Fo + (3 ξ² − 1)/6 − (2/π²) Σ (−1)ⁿ/n² exp(−n² π² Fo) cos(n π ξ)},
        ξ = 1 − x/δ,  n = 1, 2, …

    - `flux` `q` (W/m²), `time` (s), `thickness` `δ` (m), `material` with its properties
      at the reference temperature

    Arguments broadcast. Below `Fo = 0.02`, where the series converges slowly, the
    method of images is used, `ΔT = (2 q √(a τ)/λ) [ierfc(x/ℓ) + ierfc((2 δ − x)/ℓ)]`,
    `ℓ = 2 √(a τ)`; the next image would add 1e-22 of it. Raises `ValueError` where the
    thickness is not positive or the time is negative.

    Reference: Carslaw & Jaeger (1959), §3.8, eqs. (3), (4).

    Example:
        >>> rise = sb.formulas.slab_rise(1e6, 2.0, 0.03, sb.material("steel_20L"))
        >>> round(float(rise), 2)
        112.72
    """
    Fo = fourier_number(material.diffusivity, time, thickness)
    Fo, xi = np.broadcast_arrays(Fo, 1 - np.asarray(depth, float) / thickness)
    rise = np.where(Fo < 0.02, _by_images(Fo, xi), _by_series(np.maximum(Fo, 0.02), xi))
    return (flux * thickness / material.conductivity * rise)[()]


def _by_series(Fo: Array, xi: Array) -> Array:
    n = np.arange(1, 16, dtype=float)
    terms = (
        (-1.0) ** n
        / n**2
        * np.exp(-(n**2) * math.pi**2 * Fo[..., None])
        * np.cos(n * math.pi * xi[..., None])
    )
    return Fo + (3 * xi**2 - 1) / 6 - 2 / math.pi**2 * terms.sum(axis=-1)


def _by_images(Fo: Array, xi: Array) -> Array:
    from scipy.special import erfc

    length = 2 * np.sqrt(np.where(Fo > 0, Fo, 1.0))
    near = (1 - xi) / length
    far = (1 + xi) / length
    ierfc = sum(np.exp(-(u**2)) / math.sqrt(math.pi) - u * erfc(u) for u in (near, far))
    return np.where(Fo > 0, length * ierfc, 0.0)


def stopping_slab_rise(
    flux: Amount, time: Amount, duration: Amount, thickness: Amount, material: Material
) -> Amount:
    """Surface rise (K) of a slab with an adiabatic back while the flux falls linearly,
    `q(t) = q_0 (1 − t/t_T)`:

        ΔT = (q_0 δ/2λ) {τ_N/3 + Fo τ_W + 2/(45 Fo) − Σ [4/(π² n²) + 4/(π⁴ n⁴ Fo)]
        exp(−n² π² Fo τ)},   n = 1, 2, … τ = t/t_T,   τ_N = 2 (1 − τ),   τ_W = 2 τ − τ²,
        Fo = a t_T/δ²

    - initial `flux` `q_0` (W/m²), `time` `t ≤ t_T`, `duration` `t_T` of the brake
      application (s), `thickness` `δ` (m)

    `τ_N`, `τ_W` are power and work over their means (S). Superposition of `slab_rise`;
    below `Fo τ = 0.02` that of the half-space, `stopping_rise`, to which the back adds
    1e-22. Raises `ValueError` outside `0 ≤ t ≤ t_T`.

    Example:
        >>> rise = sb.formulas.stopping_slab_rise(2e6, 0.5, 1.0, 0.03, sb.material("steel_20L"))
        >>> round(float(rise), 2)
        75.15
    """
    # checks the times
    half_space = stopping_rise(flux, time, duration, material.effusivity)
    Fo = fourier_number(material.diffusivity, duration, thickness)
    tau = np.asarray(time, float) / duration
    n2 = (math.pi * np.arange(1, 16)) ** 2
    terms = (4 / n2 + 4 / (n2**2 * np.asarray(Fo)[..., None])) * np.exp(
        -n2 * np.asarray(Fo * tau)[..., None]
    )
    rise = (
        2 * (1 - tau) / 3 + Fo * (2 * tau - tau**2) + 2 / (45 * Fo) - terms.sum(axis=-1)
    )
    return np.where(
        Fo * tau < 0.02,
        half_space,
        flux * thickness / (2 * material.conductivity) * rise,
    )[()]


def reconstructed_surface_rise(
    flux: Amount, time: Amount, duration: Amount, thickness: Amount, material: Material
) -> Amount:
    """Mean surface rise (K) in a brake application by S-24, whose third term is lost
    and reconstructed here:

        ΔT = (q_0 δ/2λ) [τ_N/3 + Fo τ_W − (2/π²) τ_N Σ exp(−n² π² Fo τ)/n²],   q_0/2 = α
        W_T/(A_a t_T)

    Arguments and symbols as of `stopping_slab_rise`, the exact solution of the same
    slab. The source shows the first two terms; alone they are largest at `τ = 0`, where
    no heat has entered. With the third the rise is 0 there: that of a slab under the
    present power from the start, and `Fo τ²` for the power that was above it. At the
    end of a long brake application it lacks `2/(45 Fo)`. Raises `ValueError` outside
    `0 ≤ t ≤ t_T`.

    Example:
        >>> rise = sb.formulas.reconstructed_surface_rise(2e6, 0.5, 1.0, 0.03, sb.material("steel_20L"))
        >>> round(float(rise), 2)
        58.35
    """
    tau = np.asarray(time, float) / duration
    _require_within(time, duration)
    present = slab_rise(flux * (1 - tau), time, thickness, material)
    above = fourier_number(material.diffusivity, duration, thickness) * tau**2
    return present + flux * thickness / (2 * material.conductivity) * above


def transmission_table() -> TransmissionPartition:
    """V's coefficients and surface layers (table 2) over the temperature of the
    polished rim surface, as a law.

    Example:
        >>> type(sb.formulas.transmission_table()).__name__
        'TransmissionPartition'
    """
    text = (
        resources.files("simbrake.design.formulas") / "heat_transmission.csv"
    ).read_text("utf-8")
    table = np.genfromtxt(text.splitlines(), delimiter=",", names=True)
    polished, matte, band = (table[f"alpha{i}"] for i in (1, 2, 3))
    return TransmissionPartition(
        table["T_polished_C"] + 273.15,
        polished,
        matte,
        band,
        1e-6 * table["delta_s_um"],
    )


def heat_content(material: Material, start: Amount, end: Amount) -> Amount:
    """Heat per volume (J/m³) from `start` to `end` (K), `ρ ∫ c dT`: exact for a
    specific heat linear in temperature.

    Example:
        >>> round(float(sb.formulas.heat_content(sb.material("steel_20L"), 300.0, 400.0)) / 1e6, 1)
        419.3
    """
    slope = float(material.specific_heat_slope or 0.0)
    middle = 0.5 * (start + end) - float(material.reference)
    return material.volumetric_heat_capacity * (1 + slope * middle) * (end - start)


class MaximumTemperatures(NamedTuple):
    """Alternative formulas of the maximum temperature of a friction surface (K, or
    rises in K)."""

    surface_and_third_flash: Amount  # S-26: t_s + t_flash/3
    printed: Amount  # S-27 as the scan shows it: t_v + t_s/3 + t_flash/3
    plain_sum: Amount  # t_v + t_s + t_flash


def maximum_temperatures(
    bulk: Amount, surface: Amount, flash: Amount
) -> MaximumTemperatures:
    """The maximum temperature in the combinations of S (S-26, S-27) and as a plain sum,
    of rises in K:

        S-26: t_s + t_flash/3;   S-27: t_v + t_s/3 + t_flash/3 (doubtful scan);   sum:
        t_v + t_s + t_flash

    - `bulk` `t_v`, `surface` `t_s`, `flash` `t_flash`: rises (K)

    Where `t_s` is the whole rise of the surface, as most formulas give it, the two that
    add `t_v` count the bulk twice; where it is the rise above the bulk, S-26 leaves the
    bulk out. S states no condition for either beyond the kind of brake application
    (single, or repeated at short intervals). Raises `ValueError` for negative rises.

    Example:
        >>> sb.formulas.maximum_temperatures(20.0, 150.0, 90.0)
        MaximumTemperatures(surface_and_third_flash=180.0, printed=100.0,
        plain_sum=260.0)
    """
    require_not_negative(bulk=bulk, surface=surface, flash=flash)
    return MaximumTemperatures(
        surface + flash / 3, bulk + surface / 3 + flash / 3, bulk + surface + flash
    )


class SchmidtCourse(NamedTuple):
    """Temperatures of a wall by Schmidt's scheme: times (m,) in s, depths (N + 2,) in
    m, temperatures (m, N + 2) in K.

    First and last depth are the faces, between them the centres of the layers.

    Example:
        >>> course = sb.formulas.schmidt(sb.material("steel_20L"), 0.03, 10, 5.0, 1e6)
        >>> course.temperature.shape[1], round(float(course.temperature[-1, 0]), 1)
        (12, 184.1)
    """

    t: SeriesOfTimes
    depth: Depths
    temperature: Profiles

    @property
    def mean(self) -> SeriesOfTimes:
        """Mean temperature of the layers (K): the scheme conserves it exactly."""
        return self.temperature[:, 1:-1].mean(axis=1)


def schmidt(
    material: Material,
    thickness: float,
    layers: int,
    end: float,
    flux: float | Callable[[float, float], float],
    *,
    start: float | Float[np.ndarray, " N"] = 0.0,
    front_coefficient: float = 0.0,
    back_coefficient: float = 0.0,
    ambient: float = 0.0,
) -> SchmidtCourse:
    """Temperatures of a wall that is heated at its front, layer by layer (S-28, S-29;
    E. Schmidt, 1924):

        t_j⁺ = ½ (t_{j−1} + t_{j+1}),   Δτ = Δx²/(2 a),   j = 1…N face: t_s = (t_j + Δx
        (q + h t_a)/(2 λ))/(1 + h Δx/(2 λ)),   layer beyond it: 2 t_s − t_j

    The layers' temperatures are those of their centres. Outside each face is a layer
    whose temperature gives the correct flow through the face, so that the wall gains
    exactly the inflow.

    - `material` at its reference temperature; `thickness` `δ` (m) in `layers` `N` of
      `Δx = δ/N`; `end` (s): steps of `Δτ` are made until it is reached
    - `flux` `q` (W/m²) into the front: a number, or a function of the beginning and end
      of a step (s), its mean there
    - `start`: temperature of the wall, a number or (N,); `front_coefficient` `h_f`,
      `back_coefficient` `h_b` (W/(m²·K)) to `ambient` `t_a`; temperatures in K or as
      rises

    Of second order in `Δx` at fixed time, and stable with any coefficient. (Nodes on
    the faces, as the scheme is often drawn, form two interleaved grids; a cooled face
    then drives these apart without bound.) Raises `ValueError` for numbers outside
    their ranges and for fewer than 2 layers.

    Reference: M. Jakob, *Heat Transfer*, vol. 1 (1949), ch. 19.

    Example:
        >>> course = sb.formulas.schmidt(sb.material("steel_20L"), 0.03, 10, 5.0, 1e6, start=293.15)
        >>> round(float(course.temperature[-1, 0]), 1)
        477.2
    """
    require_positive(thickness=thickness, end=end)
    require_not_negative(
        front_coefficient=front_coefficient, back_coefficient=back_coefficient
    )
    if layers < 2:
        raise ValueError(f"layers = {layers} must be at least 2")
    dx = thickness / layers
    step = dx**2 / (2 * material.diffusivity)
    half = dx / (2 * material.conductivity)

    def face(t: Amount, q: Amount, h: float) -> Amount:
        return (t + half * (q + h * ambient)) / (1 + half * h)

    count = max(1, math.ceil(end / step * (1 - 1e-12)))
    t = step * np.arange(count + 1)
    entering = [flux(t[m], t[m + 1]) if callable(flux) else flux for m in range(count)]
    padded = np.empty(layers + 2)
    T = np.empty((count + 1, layers + 2))
    T[0] = np.pad(np.broadcast_to(np.asarray(start, float), (layers,)), 1, mode="edge")
    for m, q in enumerate(entering):
        padded[1:-1] = now = T[m, 1:-1]
        padded[0] = 2 * face(now[0], q, front_coefficient) - now[0]
        padded[-1] = 2 * face(now[-1], 0.0, back_coefficient) - now[-1]
        T[m + 1, 1:-1] = 0.5 * (padded[:-2] + padded[2:])
    after = np.asarray([*entering[1:], entering[-1]])
    T[1:, 0] = face(T[1:, 1], 0.5 * (np.asarray(entering) + after), front_coefficient)
    T[1:, -1] = face(T[1:, -2], 0.0, back_coefficient)
    depth = np.concatenate([[0.0], dx * (np.arange(layers) + 0.5), [thickness]])
    return SchmidtCourse(t, depth, T)


class HeatBalance(NamedTuple):
    """Balance of a rim over whole revolutions at constant speed and surface temperature
    (SI units)."""

    time: Amount  # s, of the revolutions
    gained: Amount  # J, Q_1
    lost: Amount  # J, Q_2
    net: Amount  # J, Q_1 − Q_2
    mean_flux: Amount  # W/m² of the whole track, net over A_a τ
    # K, surface temperature at which net is 0, `inf` where no heat is rejected
    stationary: Amount


def heat_balance(
    flux: Amount,
    *,
    overlap: Amount,
    coefficient: Amount,
    surface: Amount,
    ambient: Amount,
    omega: Amount,
    area: Amount,
    revolutions: Amount = 4,
) -> HeatBalance:
    """Heat that a rim gains and loses over `revolutions` `n` (S: four, one of which
    corresponds to the open quarter):

        τ = 2 π n/ω                                                                                          (S-17)
        Q_1 = q_1 A_a κ τ,   Q_2 = h (T_1 − T_a) A_a (1 − κ) τ,   Q = Q_1 − Q_2                              (S-18…20)
        q̄ = κ q_1 − (1 − κ) h (T_1 − T_a)                                                                   (S-21)

    - `flux` `q_1` (W/m²) into the rim under the linings; `overlap` `κ`: share of the
      track that they cover, about 0.75
    - `coefficient` `h` (W/(m²·K)) of the open track, radiation included; `surface`
      `T_1`, `ambient` `T_a` (K)
    - `omega` `ω` (rad/s); `area` `A_a` (m²) of the track

    The scan of S-17…S-20 is damaged; S-21 is whole, and these are its terms before
    division. `stationary` is `T_a + κ q_1/((1 − κ) h)`. Raises `ValueError` for numbers
    outside their ranges.

    Example:
        >>> balance = sb.formulas.heat_balance(
        ...     2e5, overlap=0.75, coefficient=60.0, surface=473.0, ambient=293.0, omega=12.0, area=0.8
        ... )
        >>> round(balance.mean_flux), round(balance.stationary)
        (147300, 10293)
    """
    require_positive(
        omega=omega,
        area=area,
        revolutions=revolutions,
        surface=surface,
        ambient=ambient,
    )
    require_not_negative(flux=flux, coefficient=coefficient)
    require_share(overlap=overlap)
    time = 2 * math.pi * revolutions / omega
    open_share = (1 - overlap) * coefficient
    into = overlap * flux
    out = open_share * (surface - ambient)
    stationary = ambient + into / open_share if open_share > 0 else math.inf
    return HeatBalance(
        time,
        into * area * time,
        out * area * time,
        (into - out) * area * time,
        into - out,
        stationary,
    )


class RimThickness(NamedTuple):
    """Rational thickness of a rim (m), and the two thicknesses of which it is the
    maximum."""

    depth: float  # heat of one brake application just reaches the back
    storage: (
        # the heat warms all of it just to the permissible temperature; `inf` where the
        # permissible rise is 0
        float
    )
    rational: float


class LiningThickness(NamedTuple):
    """Rational thickness of a lining (m), and the two thicknesses of which it is the
    maximum."""

    depth: float  # heat of one brake application just reaches the back
    # the back just reaches its permissible temperature; `inf` where it starts there
    insulation: float
    rational: float


def rational_rim_thickness(
    material: Material, time: float, *, heat: float, rise: float
) -> RimThickness:
    """Thickness of a rim that the heat of a brake application penetrates and that can
    store it (S, step 8):

        δ_1 = 1.73 √(a τ)          Fo = a τ/δ² = 1/3: deeper material takes up no heat
        δ_2 = Q/(ρ c ΔT_p)         the heat Q, spread over the thickness, warms it by the permissible rise
        δ = max(δ_1, δ_2)

    - `material` at the temperature of its properties; `time` `τ` (s); `heat` `Q` (J/m²)
      into the track; `rise` `ΔT_p` (K), permissible, of the bulk; if ≤ 0, no thickness
      is sufficient

    S names a rational thickness without a condition: full penetration is the condition
    of its steps 1 and 2. Raises `ValueError` for a negative time or heat.

    Example:
        >>> case = sb.formulas.rational_rim_thickness(sb.material("steel_20L"), 2.0, heat=2e6, rise=40.0)
        >>> round(float(1e3 * case.rational), 2)
        11.93
    """
    require_not_negative(time=time, heat=heat)
    depth = float(penetration_depth(material.diffusivity, time))
    storage = heat / material.volumetric_heat_capacity / rise if rise > 0 else math.inf
    return RimThickness(depth, storage, max(depth, storage))


def held_face_rise(Fo: Amount) -> Amount:
    """Rise of the adiabatic back of a slab over that of its face, held at constant
    temperature from the start:

        θ(Fo) = 1 − (4/π) Σ (−1)ⁿ/(2n + 1) exp(−(2n + 1)² π² Fo/4),   n = 0, 1, …

    - `Fo`: Fourier number of the thickness

    Below `Fo = 0.2` by images, `2 Σ (−1)ⁿ erfc((2n + 1)/(2 √Fo))`. Raises `ValueError`
    for a negative one.

    Reference: Carslaw & Jaeger (1959), §3.4, eqs. (5), (6).

    Example:
        >>> round(float(sb.formulas.held_face_rise(0.5)), 4)
        0.6292
    """
    from scipy.special import erfc

    require_not_negative(Fo=Fo)
    F = np.asarray(Fo, float)
    n = np.arange(8)
    odd = 2.0 * n + 1
    sign = (-1.0) ** n
    late = 1 - 4 / math.pi * np.sum(
        sign / odd * np.exp(-(odd**2) * math.pi**2 * F[..., None] / 4), axis=-1
    )
    root = 2 * np.sqrt(np.where(F > 0, F, 1.0))
    early = np.where(
        F > 0, 2 * np.sum(sign * erfc(odd / root[..., None]), axis=-1), 0.0
    )
    return np.where(F < 0.2, early, late)[()]


def back_temperature(
    material: Material, thickness: float, time: float, *, face: float, start: float
) -> float:
    """Temperature (K) of the back of a lining whose `face` (K) is held for the `time`
    (s), from `start` (K).

    `T_0 + (T_f − T_0) θ(a τ/δ²)` by `held_face_rise`; an upper bound where the face is
    that hot only for a while. Raises `ValueError` where thickness, face or start is not
    positive or the time is negative.

    Example:
        >>> lining = sb.formulas.lining_material("FK-24A").thermal
        >>> round(float(sb.formulas.back_temperature(lining, 0.025, 600.0, face=600.0, start=293.15)), 2)
        436.64
    """
    require_positive(thickness=thickness, face=face, start=start)
    Fo = fourier_number(material.diffusivity, time, thickness)
    return start + (face - start) * float(held_face_rise(Fo))


def rational_lining_thickness(
    material: Material, time: float, *, face: float, back: float, start: float
) -> LiningThickness:
    """Thickness of a lining that heat penetrates and that keeps its back (bond, rivets)
    cool (S, step 8):

        δ_1 = 1.73 √(a τ)
        δ_2 = √(a τ/Fo_p),   θ(Fo_p) = (T_p − T_0)/(T_f − T_0)        (`held_face_rise`)
        δ = max(δ_1, δ_2)

    - `material` at the temperature of its properties; `time` `τ` (s) for which the
      `face` is at `T_f` (K); `back` `T_p` (K): its permissible temperature; `start`
      `T_0` (K)

    `δ_2` is 0 where the face itself is not hotter than `T_p`. The wear allowance is
    added to it. Raises `ValueError` where a temperature is not positive or the time is
    negative.

    Example:
        >>> lining = sb.formulas.lining_material("FK-24A").thermal
        >>> case = sb.formulas.rational_lining_thickness(lining, 60.0, face=620.0, back=390.0, start=293.0)
        >>> round(float(1e3 * case.rational), 2)
        9.61
    """
    require_positive(face=face, back=back, start=start)
    depth = float(penetration_depth(material.diffusivity, time))
    if start >= back:
        insulation = math.inf
    elif face <= back:
        insulation = 0.0
    else:
        from scipy.optimize import brentq

        # θ is 1e-110 and 1 at these
        ends = (1e-3, 20.0)
        theta = (back - start) / (face - start)
        over = lambda x: float(held_face_rise(x)) - theta
        Fo: Any = ends[0]
        if over(ends[0]) < 0:
            Fo = brentq(over, *ends, xtol=1e-15, rtol=1e-13)  # pyright: ignore
        insulation = math.sqrt(material.diffusivity * time / Fo)
    return LiningThickness(depth, insulation, max(depth, insulation))
