"""Validation of statics and wear: tensions along a band, its elongation, pressures, layouts, linings that wear.

Truths are systems of linear equations, quadratures and sums; every value comes from the package.
"""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import FORM, Case, Row, cases_of, differentiated
from scipy.integrate import quad

from simbrake import ConstantFriction, Pads, ShoeBrake, Shoes
from simbrake.brakes import (
    AbstractPadPressure,
    AbstractStiffness,
    BondedLinings,
    ContinuousLining,
    LiningsOnPlates,
    ParallelBands,
    UniformPressure,
    UniformWear,
    chord_tensions,
    pressure_within,
    sliding_tensions,
)

_T0 = 8e3
_F = np.array([0.30, 0.42, 0.35])

# --- tensions along a band --------------------------------------------------------------------------------------------


def _solved(equations: Sequence[tuple[dict[str, Any], Any]]) -> dict[str, Any]:
    """Unknowns of linear equations, each `{name: coefficient}` and its right side."""
    names = sorted({name for left, _ in equations for name in left})
    matrix = np.array([[left.get(name, 0.0) for name in names] for left, _ in equations])
    return dict(zip(names, np.linalg.solve(matrix, np.array([right for _, right in equations])), strict=True))


def chord_cases() -> list[Case]:
    """Three point linings between chords of unequal angles: forces along and across the rim at each."""
    beta = np.radians([12.0, 31.0, 18.0, 25.0])

    def along(angles: Any, k: int = 3) -> dict[str, Any]:
        c, s, T = np.cos(angles / 2), np.sin(angles / 2), {"T0": 1.0}
        equations: list[Any] = [(T, _T0)]
        for i in range(1, k + 1):
            before, after, N = f"T{i - 1}", f"T{i}", f"N{i}"
            equations.append(({after: c[i], before: -c[i - 1], N: -_F[i - 1]}, 0.0))
            equations.append(({after: s[i], before: s[i - 1], N: -1.0}, 0.0))
        return _solved(equations)

    def of_third(angle: complex) -> complex:
        return along(np.array([*beta[:2], angle, beta[3]]))["T3"]

    def run() -> tuple[Any, Any]:
        T_0 = jnp.asarray(_T0)
        forces = chord_tensions(T_0, _F, beta)
        return forces, jax.grad(lambda b: chord_tensions(T_0, _F, b).tension[2])(jnp.asarray(beta))

    truth, source = along(beta), "linear equations: T_i c_i − T_(i−1) c_(i−1) = f N_i, N_i = T_i s_i + T_(i−1) s_(i−1)"
    rows: list[Row] = [(f"tension {i}", f"{source} [Z-1…4]", truth[f"T{i}"], f"0.tension.{i - 1}") for i in (1, 2, 3)]
    rows += [(f"load {i}", f"{source} [Z-1…4]", truth[f"N{i}"], f"0.normal.{i - 1}") for i in (1, 2, 3)]
    rows.append(("∂(tension 3)/∂β_2", f"{source}, differentiated", differentiated(of_third, beta[2]), "1.2"))
    return cases_of("chords", jax.jit(run), 1e-13, rows)


def sliding_cases() -> list[Case]:
    """Three unequal linings that all slide: at rest on the band, and with masses, of which one lifts off."""
    beta = np.radians([28.0, 51.0, 36.0])
    pushed, thrown, far = np.array([150.0, 80.0, 210.0]), np.array([900.0, 300.0, 1500.0]), np.array([0.0, 3e4, 0.0])
    c, s = np.cos(beta / 2), np.sin(beta / 2)

    def along(ma: Any, mrw: Any, f: Any = _F, lifted: int | None = None) -> dict[str, Any]:
        equations: list[Any] = [({"T0": 1.0}, _T0)]
        for i in range(3):
            before, after, N = f"T{i}", f"T{i + 1}", f"N{i + 1}"
            slides = 0.0 if i == lifted else f[i]
            equations.append(({after: c[i], before: -c[i], N: -slides}, -ma[i]))
            off = {N: 1.0} if i == lifted else {after: s[i], before: s[i], N: -1.0}
            equations.append((off, 0.0 if i == lifted else mrw[i]))
        return _solved(equations)

    def tight(f: complex) -> complex:
        return along(pushed, thrown, np.array([_F[0], f, _F[2]]))["T3"]

    def last(f: Any) -> Any:
        return sliding_tensions(jnp.asarray(_T0), f, beta, inertia_force=pushed, centrifugal_force=thrown).tension[2]

    def unbalanced(found: Any) -> float:
        """All forces on the band by components, over the tight tension; each lining is on the angle of its middle."""
        T, N, F = (np.asarray(x) for x in (found.tension, found.normal, found.friction))
        ends = np.concatenate([[0.0], np.cumsum(beta)])
        middle = 0.5 * (ends[1:] + ends[:-1])
        pull = T[-1] * np.exp(1j * (ends[-1] + math.pi / 2)) - _T0 * np.exp(1j * math.pi / 2)
        return float(abs(pull + np.sum((N - 1j * F) * np.exp(1j * middle))) / T[-1])

    def run() -> tuple[Any, ...]:
        massive = {"inertia_force": pushed, "centrifugal_force": thrown}
        return (
            sliding_tensions(jnp.asarray(_T0), _F, beta),
            sliding_tensions(jnp.asarray(_T0), _F, beta, **massive),
            sliding_tensions(jnp.asarray(_T0), _F, beta, centrifugal_force=far, inertia_force=pushed),
            jax.grad(last)(jnp.asarray(_F)),
        )

    source = "linear equations: (T_i − T_(i−1)) c_i + m a_i = f_i N_i, N_i = (T_i + T_(i−1)) s_i − m R ω²"
    still, moved = along(np.zeros(3), np.zeros(3)), along(pushed, thrown)
    off = along(pushed, far, lifted=1)
    rows: list[Row] = [
        ("tension 3", f"{source} [Z-12…14]", still["T3"], "0.tension.2"),
        ("forces on the band", "their sum is 0 in both directions", 0.0, lambda x: unbalanced(x[0])),
        ("tension 3 with masses", source, moved["T3"], "1.tension.2"),
        ("load 2 with masses", source, moved["N2"], "1.normal.1"),
        ("friction 1 with masses", source, _F[0] * moved["N1"], "1.friction.0"),
        ("tension 3, lining 2 off", f"{source}, N_2 = 0", off["T3"], "2.tension.2"),
        ("load 2, lining 2 off", f"{source}, N_2 = 0", 0.0, "2.normal.1"),
        ("∂(tension 3)/∂f_2", f"{source}, differentiated", differentiated(tight, _F[1]), "3.1"),
    ]
    return cases_of("sliding linings", jax.jit(run), 1e-13, rows)


# --- elongation of a band ---------------------------------------------------------------------------------------------

# of the bands here: friction and angles (rad) of the linings, radius of the band circle (m)
_FRICTION, _ANGLE, _R0 = np.array([0.34, 0.01, 0.40, 0.27]), np.radians([52.0, 47.0, 61.0, 40.0]), 0.623
_GAP, _STEEL, _SECTION, _ENDS = np.radians([4.0, 6.0, 3.0]), 2.1e11, 13e-4, (0.3, 0.5)


def _stretched(k: Callable[[float], complex], gap: Callable[[int], complex], ends: tuple[complex, complex]) -> complex:
    """`Δl/S_C` by quadrature: `k(θ)` by the angle under the linings, yield `gap(i)` of what follows lining `i`."""
    S, at, found = 1.0, 0.0, ends[0]
    for i, (f, angle) in enumerate(zip(_FRICTION, _ANGLE, strict=True)):
        arc = functools.partial(lambda a, f, S, at: S * math.exp(f * a) / k(at + a), f=f, S=S, at=at)
        kinks = [x - at for x in _KINKS if 0 < x - at < angle]
        parts = [0.0, *kinks, angle]
        for low, high in itertools.pairwise(parts):
            for unit, part in ((1.0, "real"), (1j, "imag")):
                of_part = functools.partial(lambda a, part, arc: getattr(complex(arc(a)), part), part=part, arc=arc)
                scale = 1.0 if part == "real" else 1e200  # (of a complex step the imaginary part is tiny)
                found += unit / scale * quad(lambda a, y=of_part, c=scale: c * y(a), low, high, epsrel=1e-13)[0]
        S, at = S * math.exp(f * angle), at + angle
        found += S * gap(i)
    return found + S * ends[1]


#: angle from the slack end at which the section of the slotted band changes (rad)
_KINKS = (math.radians(120.0),)
_RISE = math.exp(float(_FRICTION @ _ANGLE))


def _on_plates(E: complex = _STEEL, bond: complex = 0.0, ends: float = 1.0) -> complex:
    """`Δl/S_C` of linings on plates, or bonded where they bear `bond` (N) per radius."""
    EA = E * _SECTION
    slack, tight = (ends * length / EA for length in _ENDS)
    return _stretched(lambda _: EA / _R0 + bond, lambda i: _R0 * _GAP[i] / EA if i < 3 else 0.0, (slack, tight))


def _continuous(E: complex = _STEEL) -> complex:
    E_2, R_2 = 1.2e9, 0.61

    def k(angle: float) -> complex:
        steel, lining = (6e-4, 3e-3) if angle < _KINKS[0] else (10e-4, 5e-3)
        return E * steel / _R0 + E_2 * lining / R_2

    return _stretched(k, lambda _: 0.0, (_ENDS[0] / (E * 6e-4), _ENDS[1] / (E * 10e-4)))


def compliance_cases() -> list[Case]:
    """Elongation of bands with linings on plates, bonded ones, and a continuous one on a slotted band [K-1…3, K-8]."""
    link = 3e7
    plates: dict[str, Any] = {"modulus": _STEEL, "area": _SECTION, "gap": _GAP}
    plates |= {"slack_end": _ENDS[0], "tight_end": _ENDS[1]}
    on_plates, halved = LiningsOnPlates(**plates, linkage=link), LiningsOnPlates(**plates, halved_ends=True)
    bonded = BondedLinings(**plates, lining_modulus=1e9, lining_area=60e-4, lining_radius=0.61)
    slotted = ContinuousLining(
        _STEEL,
        *(6e-4, 10e-4, _KINKS[0], 1.2e9, 3e-3, 5e-3, 0.61),
        slack_end=_ENDS[0],
        tight_end=_ENDS[1],
    )
    pair = ParallelBands((halved, slotted), linkage=link)
    bands = {"on plates": on_plates, "half the ends": halved, "bonded": bonded, "slotted": slotted, "pair": pair}

    def run() -> dict[str, Any]:
        given = (_FRICTION, _ANGLE, _R0)
        found: dict[str, Any] = {f"{name}, C": band.stiffness(*given) for name, band in bands.items()}
        found |= {"longer": on_plates.elongation(_T0, *given), "shares": pair.shares(*given)}

        def by_modulus(band: AbstractStiffness) -> Any:
            return jax.grad(lambda band: band.stiffness(*given))(band).modulus

        return found | {f"{name}, ∂": by_modulus(bands[name]) for name in ("on plates", "slotted")}

    def linked(stretch: complex) -> complex:
        return 1 / (stretch / _RISE + 1 / link)

    def read(key: str) -> Callable[[dict[str, Any]], Any]:
        return lambda found: found[key]

    c_1, c_2 = _on_plates(ends=0.5).real, _continuous().real
    by_quad = "quadrature: Δl/S_C = ∫ S dθ/k + gaps + ends, 1/C = Δl/S_H + 1/C_l"
    own = by_quad.partition(", 1/C")[0] + ", C = S_H/Δl"
    of_bond = 1e9 * 60e-4 / 0.61
    rows: list[Row] = [
        ("stiffness on plates", f"{by_quad} [K-2]", linked(_on_plates()).real, read("on plates, C")),
        ("elongation on plates", f"{by_quad} [K-2]", _T0 * (_on_plates().real + _RISE / link), read("longer")),
        ("stiffness, half the ends", f"{own}, as K prints", _RISE / c_1, read("half the ends, C")),
        ("stiffness, bonded", f"{own} [K-1]", _RISE / _on_plates(bond=of_bond).real, read("bonded, C")),
        ("stiffness, slotted", f"{own} [K-3]", _RISE / c_2, read("slotted, C")),
        (
            "stiffness of two",
            f"{by_quad}, C = C_1 + C_2",
            1 / (1 / (_RISE / c_1 + _RISE / c_2) + 1 / link),
            read("pair, C"),
        ),
        ("share of the first", "quadrature: c_2/(c_1 + c_2) [K-8]", c_2 / (c_1 + c_2), lambda x: x["shares"][0]),
        ("bare angle", f"{FORM}Σ β_i of the gaps", math.radians(13.0), lambda _: pair.bare_angle(4)),
        ("longest wrap, slotted", f"{FORM}twice around", 4 * math.pi, lambda _: slotted.longest_wrap),
        ("longest wrap of two", f"{FORM}once around", 2 * math.pi, lambda _: pair.longest_wrap),
    ]
    slopes = {"on plates": lambda E: linked(_on_plates(E)), "slotted": lambda E: _RISE / _continuous(E)}
    for name, of in slopes.items():
        truth = differentiated(of, _STEEL)
        rows.append((f"∂(stiffness {name})/∂E_1", f"{own}, differentiated", truth, read(f"{name}, ∂")))
    return cases_of("elongation by geometry", jax.jit(run), 1e-12, rows)


# --- pressures --------------------------------------------------------------------------------------------------------


def _gauss(of: Callable[[Any], Any], low: float, high: float) -> float:
    """Integral of a smooth function by 40 points of Gauss and Legendre."""
    x, w = np.polynomial.legendre.leggauss(40)
    return float(np.sum(w * np.asarray(of(low + 0.5 * (high - low) * (x + 1)))) * (high - low) / 2)


def lining_pressure_cases() -> list[Case]:
    """Pressure along one lining, `p ∝ T e^{κθ}`: its integral is the load, its edges have the ratio of the tensions."""
    mean, rise = 0.8e6, 1.31

    def there(place: float, rise: complex = rise) -> complex:
        kappa = np.log(rise)
        return mean * kappa * np.exp(kappa * place) / (rise - 1)

    def run() -> Callable[..., Any]:
        return lambda place, ratio=rise: pressure_within(mean, ratio, place)

    form = f"{FORM}(N/(R b)) κ e^(κ θ)/(e^(κ α) − 1), κ = ln(T_i/T_(i−1))/α"
    rows: list[Row] = [
        ("mean", f"{FORM}N_i/A_i", mean, lambda p: _gauss(p, 0.0, 1.0)),
        ("mean, tight side first", f"{FORM}N_i/A_i", mean, lambda p: _gauss(lambda x: p(x, 1 / rise), 0.0, 1.0)),
        ("edges", f"{FORM}T_i/T_(i−1)", rise, lambda p: p(1.0) / p(0.0)),
        ("slack edge", form, there(0.0).real, lambda p: p(0.0)),
        ("three tenths along", form, there(0.3).real, lambda p: p(0.3)),
        ("tight edge, nearly even", form, there(1.0, 1.004).real, lambda p: p(1.0, 1.004)),
        ("even", f"{FORM}N_i/A_i", mean, lambda p: p(0.4, 1.0)),
        (
            "∂(tight edge)/∂(ratio)",
            f"{form}, differentiated",
            differentiated(lambda x: there(1.0, x), rise),
            lambda p: jax.grad(lambda x: p(1.0, x))(rise),
        ),
    ]
    return cases_of("pressure along a lining", run, 1e-12, rows)


def pad_cases() -> list[Case]:
    """A pad under either distribution of pressure, by integrals over its face; shoes that hold and that lock."""
    r_i, r_o, angle, force = 0.30, 0.50, 0.7, 20e3

    def pads(pressure: AbstractPadPressure, r_i: Any = r_i) -> Pads:
        return Pads(ConstantFriction(0.4), r_i, r_o, angle, 2, pressure)

    def over(weight: Callable[[Any], Any]) -> Callable[[Any], float]:
        """Of the shares of pressure that the package gives: an integral over the face."""
        return lambda law: _gauss(lambda r: np.asarray(law.share(r, r_i)) * weight(r), r_i, r_o)

    load, moment = over(lambda r: angle * r), over(lambda r: angle * r**2)

    def worn(r_i: Any = r_i) -> Any:
        # p r is constant: F = ∫ p r θ dr = p_i r_i θ (r_o − r_i)
        return force / (angle * r_i * (r_o - r_i))

    def even(r_i: Any = r_i) -> Any:
        return 2 * force / (angle * (r_o**2 - r_i**2))

    found: list[Case] = []
    for name, law, peak, source in (
        ("uniform wear", UniformWear(), worn, f"{FORM}F/(θ r_i (r_o − r_i))"),
        ("uniform pressure", UniformPressure(), even, f"{FORM}2 F/(θ (r_o² − r_i²))"),
    ):
        rows: list[Row] = [
            ("greatest pressure", source, peak(), lambda law: pads(law).greatest_pressure(force)),
            ("load", "integral of the pressure: F", force, lambda law, of=peak: of() * load(law)),
            ("arm", "integrals: ∫ p r² dA/∫ p r dA = r_e", 1.0, lambda law: moment(law) / load(law) / pads(law).radius),
            (
                "∂(greatest pressure)/∂r_i",
                f"{source}, differentiated",
                differentiated(peak, r_i),
                lambda law: jax.grad(lambda r: pads(law, r).greatest_pressure(force))(r_i),
            ),
        ]
        found += cases_of(f"pad, {name}", functools.partial(lambda law: law, law), 1e-12, rows)
    return found + _shoe_cases()


def _shoe_cases() -> list[Case]:
    """Shoes whose linings end before 90°: greatest pressure, loads that hold and that slide, friction that locks."""
    r, b, a, arm, low, high, F = 0.15, 0.04, 0.12, 0.21, math.radians(22.0), math.radians(81.0), 2e3
    brake = ShoeBrake(12.0, Shoes(ConstantFriction(0.3), r, b, low, high), a, arm)
    # of the pressure sin θ: load, moments of the normal forces and of friction 1 about the pin
    N, M_N, M_F = (
        _gauss(of, low, high)
        for of in (np.sin, lambda x: a * np.sin(x) ** 2, lambda x: np.sin(x) * (r - a * np.cos(x)))
    )
    held = np.array([700.0, 400.0])
    by_moments = "quadrature: F c = M_N ∓ M_F about the pin"
    rows: list[Row] = [
        ("greatest pressure", "quadrature: sin θ_2/(b r ∫ sin θ dθ) N", F * math.sin(high) / (b * r * N), "0"),
        ("load of the leading shoe at rest", by_moments, (F * arm + held[0] * M_F / N) * N / M_N, "1.0"),
        ("load of the trailing shoe at rest", by_moments, (F * arm - held[1] * M_F / N) * N / M_N, "1.1"),
        ("friction that locks", "quadrature: M_N/M_F", M_N / M_F, lambda x: 1 / x[2][0]),
        ("load of the leading shoe", by_moments, F * arm * N / (M_N - 0.3 * M_F), "3.0"),
        ("load of the second shoe backwards", by_moments, F * arm * N / (M_N - 0.3 * M_F), "4.1"),
    ]

    def run() -> tuple[Any, ...]:
        f = jnp.full(2, 0.3)
        sliding = (brake.normal(F, f, back) for back in (False, True))
        return (
            brake.greatest_pressure(F),
            brake.normal_under(F, jnp.asarray(held)),
            brake.self_locking(f / 0.3),
            *sliding,
        )

    return cases_of("shoes", run, 1e-12, rows)


CASES = (
    chord_cases,
    sliding_cases,
    compliance_cases,
    lining_pressure_cases,
    pad_cases,
)
