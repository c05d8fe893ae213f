"""A point of the track over a revolution: it heats under every lining and cools outside
(V)."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..._base._faults import Issues, require_positive
from ...brakes.design import Brake
from ...parts.scene import band_brake
from ...runs.linings import geometric_overlap, rubbing
from ...runs.result import Result, look
from ...thermal.materials import Material
from .contact import Depths, Layers, Profiles, SeriesOfTimes
from .inputs import wall_at

# of an interval of constant flux, at which its extremes are sought
_FRACTIONS = np.linspace(0.0, 1.0, 9)
# of the rim's thickness: the back returns exp(−2 √π/0.5) = 8e-4 of a ripple
_DEEP = 0.5


def revolution_ripple(
    place: Layers, edges: Layers, flux: Layers, period: float, effusivity: float
) -> Float[np.ndarray, "..."]:
    """Periodic part (K) of the surface temperature of a half-space under a flux that
    repeats itself:

        θ(x) = (2/e) √(P/π) Σ_j (q_j − q_{j−1}) ζ(−½, x − x_j),   x − x_j modulo 1

    - `place` `x` (m,): times as parts of the period `P` (s)
    - `effusivity` `e` (W·√s/(m²·K))
    - `edges` `x_j` (k,), rising in [0, 1): where the `flux` `q_j` (…, k) (W/m²) begins;
      the last continues to the first

    Returns (…, m).

    Superposition of all earlier steps of the flux, `(2/e) √(t/π)` each
    (`half_space_rise`), of which Hurwitz's zeta function is the finite part: the ripple
    has the mean 0 over a period, whatever the mean flux, and the network of a scene has
    the mean. Raises `ValueError` for edges that do not rise in [0, 1), or where period
    or effusivity is not positive.

    Reference: H. S. Carslaw, J. C. Jaeger, *Conduction of Heat in Solids* (1959), §2.9,
    §3.10 (periodic flux).

    Example:
        >>> ripple = sb.formulas.revolution_ripple([0.0, 0.5], [0.0, 0.5], [1e6, 0.0], 0.3, 14e3)
        >>> [round(float(x), 2) for x in ripple]
        [-11.87, 11.87]
    """
    require_positive(effusivity=effusivity, period=period)
    x, at, q = (np.asarray(values, float) for values in (place, edges, flux))
    if (
        at.ndim != 1
        or at.shape != q.shape[-1:]
        or np.any(np.diff(at) <= 0)
        or at[0] < 0
        or at[-1] >= 1
    ):
        raise ValueError("edges must rise in [0, 1), with one flux for each")
    jumps = q - np.roll(q, 1, axis=-1)
    unit = 2 / effusivity * math.sqrt(period / math.pi)
    return unit * (jumps @ _zeta((x - at[:, None]) % 1.0))


def _zeta(x: np.ndarray) -> np.ndarray:
    """`ζ(−½, x)` for `0 ≤ x < 1`, by Euler and Maclaurin."""
    n = 12
    y = x + n
    first = np.sqrt(x[..., None] + np.arange(n)).sum(axis=-1)
    tail = (
        -2 / 3 * y**1.5
        + 0.5 * y**0.5
        - y**-0.5 / 24
        + y**-2.5 / 1920
        - y**-4.5 / 9216
        + y**-6.5 * 11 / 163840
    )
    return first + tail


class TrackRipple(NamedTuple):
    """A point of the track over a revolution, at the times `t` (m,) of a run (SI
    units).

    A point passes the `heated` (k,) and open parts of the track one after the other,
    from the tight end on: `edges` (k,) where each begins, as a part of the revolution,
    and `flux` (m, k) into the rim there (W/m²).
    """

    t: SeriesOfTimes
    period: SeriesOfTimes  # s, of a revolution past the linings; `inf` where they stick
    # Hz, of heating and cooling: parts of the track that are heated, per second
    frequency: SeriesOfTimes
    # K, from the lowest to the highest temperature of a point over a revolution
    amplitude: SeriesOfTimes
    # K, highest over the mean, which is the surface temperature of the network
    above: SeriesOfTimes
    # √(2π a/ω)/δ_rim: depth that a ripple reaches, over the rim's thickness
    reach: SeriesOfTimes
    overlap: float  # share of the track under linings
    edges: Depths
    heated: Bool[np.ndarray, " k"]
    flux: Profiles

    @property
    def valid(self) -> Bool[np.ndarray, " m"]:
        """Where a rim is a half-space for the ripple: it slides, and `reach ≤ 0.5` (at
        which its back returns 8e-4)."""
        return self.reach <= _DEEP


def track_ripple(
    result: Result,
    ts: Layers,
    *,
    material: Material | None = None,
    share: float | None = None,
    cooling: float = 0.0,
) -> TrackRipple:
    """The ripple of a point of the track at the times `ts` (m,) of a concrete run,
    above and below the network's mean.

    Each lining heats it by `q_i = a P_i/A_i` over the arc `A_i/(R b)` of its face;
    between them it cools. The ripple is the periodic one at the speed and power of that
    time: it has the mean 0 and adds nothing to the energies of the run.

    - `material` of the rim, `None`: that of its wall
    - `share` `a` of the friction heat into it, `None`: its mean over
      the run;  `cooling` (W/m²): flux from the open track to the air

    Raises `InputError` for times outside the run, a brake without a band, linings
    without an area or a pulley without a width, and where material or share are neither
    given nor in the scene.

    Reference: Volchenko et al. (V): the larger the overlap, the lower the frequency of
    heating and cooling.

    Example:
        >>> stop = sb.simulate(sb.with_values(scene, {"brake.pulley.width": 0.23, "brake.linings.area": 0.05}))
        >>> ripple = sb.formulas.track_ripple(stop, [0.5], material=sb.thermal.material("cast_iron"), share=0.9)
        >>> round(float(ripple.overlap), 4), round(float(ripple.frequency[0]), 4), round(float(ripple.amplitude[0]), 3)
        (0.4691, 18.4097, 24.476)
    """
    scene = result.scene
    brake = band_brake(scene)
    wall = wall_at(scene.network, scene.network.rim)
    material = material or (None if wall is None else wall.material)
    work = float(result.energy["friction_heat"])
    if share is None and scene.heated and work > 0:
        share = float(result.energy["heat_to_metal"]) / work
    rim = brake.bandage or brake.linings  # the part whose faces rub on the rim
    missing = Issues()
    if brake.pulley.width is None:
        hint = "the arc of a lining's face is A/(R b)"
        missing.add("brake.pulley.width", "is missing", hint)
    if rim.area is None:
        missing.add("linings.area", "is missing", "of the faces that rub on the rim")
    if material is None:
        missing.add("material", "is missing", "give it, or the scene a rim in layers")
    if share is None:
        missing.add("share", "is missing", "give it, or the scene heat")
    missing.report()
    assert material is not None
    assert share is not None
    p = look(result, ts)
    pair = result.record.system.pair_names[-1]  # pyright: ignore
    hot = 1.0 if scene.power_shares is None else float(scene.power_shares.heat)
    power = hot * share * rubbing(result.record, p, pair=pair).power
    edges, lining = _around(brake, np.asarray(rim.area, float))
    flux = np.where(lining < 0, -cooling, (power / np.asarray(rim.area))[:, lining])
    s = result.series(ts)
    omega = np.abs(s.omega - (0.0 if s.bandage_speed is None else s.bandage_speed))
    with np.errstate(divide="ignore"):
        period = 2 * math.pi / omega
    # an interval may have its extreme inside, where neighbours still heat or cool it
    places = (edges[:, None] + np.diff(edges, append=1.0)[:, None] * _FRACTIONS).ravel()
    unit = revolution_ripple(places, edges, flux, 1.0, material.effusivity)
    ripple = np.sqrt(np.where(omega > 0, period, 0.0))[:, None] * unit
    heated = lining >= 0
    patches = np.sum(heated & ~np.roll(heated, 1))
    thickness = math.nan if wall is None else wall.thickness
    reach = np.sqrt(material.diffusivity * period) / thickness
    return TrackRipple(
        np.asarray(s.t),
        period,
        patches / period,
        np.ptp(ripple, axis=1),
        np.max(ripple, axis=1),
        reach,
        geometric_overlap(brake)[1],
        edges,
        heated,
        flux,
    )


def _around(brake: Brake, area: Float[np.ndarray, "..."]) -> tuple[Depths, np.ndarray]:
    """Where the parts of the track begin (k,), from the tight end on, and the lining
    over each (k,), −1 where open."""
    n = brake.linings.count
    section = np.broadcast_to(brake.linings.angle, (n,))[::-1] / (2 * math.pi)
    face = np.broadcast_to(area, (n,))[::-1] / (
        2 * math.pi * float(brake.pulley.radius) * float(brake.pulley.width)  # pyright: ignore
    )
    face = np.minimum(face, section)
    start = np.append(0.0, np.cumsum(section)[:-1]) + 0.5 * (section - face)
    edges = np.stack([start, start + face], axis=1).ravel()
    lining = np.stack([np.arange(n)[::-1], np.full(n, -1)], axis=1).ravel()
    gap = np.diff(edges, append=edges[0] + 1.0) > 1e-12
    return edges[gap], lining[gap]
