"""Band brakes with reference solutions: stops, tensions and holds in closed form, energy balances, printed tables."""

import functools
import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import FORM, Case, Reader, Row, cases_of, cases_of_run
from printed_tables import FRICTION, LAMBDA, allowed, cells, published_rows, stopped_band
from stop_scenes import (
    ELASTIC,
    FallingFriction,
    closed_form,
    elastic_stop,
    points,
    scene_of,
    staged_pair,
    stop_scene,
    time_of,
)

from simbrake import (
    Result,
    simulate,
    with_values,
)
from simbrake.brakes import grip, tension_ratio
from simbrake.loads import differential_lever_tension
from simbrake.results import BandMode, Series

_BOOK = "Khurmi & Gupta, Theory of Machines, band and block brake"
_TRUTH = closed_form(T0=8e3, **ELASTIC)
_PI = _TRUTH["Pi"]
_HOLD = 0.725 * 8e3 * (_PI - 1)  # what the brake holds (N·m)


def soft_cases() -> list[Case]:
    """A band so soft that the stop comes before full slip: nothing slides, nothing is heated [Z-16]."""
    stop = 8e3 / (5e3 * 0.725 * 2.0) + math.pi / 2 / math.sqrt(5e3 * 0.725**2 / 800.0)
    rows = [
        ("stopping time", f"{FORM}t0 + π/(2χ) [Z-16]", stop, "stopping_time"),
        ("friction heat", "nothing slides", 0.0, "energy.friction_heat", 1e-9),
    ]
    return cases_of_run("stop without slip", elastic_stop(f=0.5, C=5e3, w0=2.0, end=10.0), rows)


def textbook_cases() -> list[Case]:
    """14 blocks of 15°, effective diameter 1 m, 2000 kg with k_g 0.5 m, ends at 30/120 mm, 200 N at 750 mm, 360 rpm."""
    n, beta, f, J, R, w0 = 14, 15.0, 0.25, 2000 * 0.5**2, 0.5, 12 * math.pi
    fz = f * math.tan(math.radians(beta) / 2)
    Pi = ((1 + fz) / (1 - fz)) ** n
    T_0 = 200 * 0.75 / (0.12 - 0.03 * Pi)
    M = R * T_0 * (Pi - 1)

    def run() -> tuple[float, Series, Result]:
        mu, _ = tension_ratio(grip(jnp.asarray(f), jnp.full(n, math.radians(beta))))
        slack = float(differential_lever_tension(200.0, 0.75, 0.12, 0.03, jnp.prod(mu)))
        result = simulate(scene_of(slack, n=n, beta=beta, f=f, R=R, J=J, C=None, w0=w0, end=9.0))
        return slack, result.series([1.0, 3.0, 6.0]), result

    ratio = "T_n/T_0 = ((1 + μ tan β/2)/(1 − μ tan β/2))^n"
    rows = [
        ("tension ratio", f"{_BOOK}: {ratio}", Pi, lambda r: r[1].tight_tension[1] / r[0]),
        ("slack tension", f"{_BOOK}: F l/(a − b T_n/T_0)", T_0, "0"),
        ("tight tension", f"{_BOOK}: T_0 T_n/T_0", Pi * T_0, "1.tight_tension.1"),
        ("torque", f"{_BOOK}: R (T_n − T_0)", M, "1.brake_torque.1"),
        ("retardation", f"{_BOOK}: M/(m k²)", M / J, lambda r: (r[1].omega[0] - r[1].omega[2]) / 5.0),
        ("time to stop", f"{_BOOK}: ω_0/α", w0 * J / M, "2.stopping_time"),
        ("torque, as printed", f"{_BOOK}: 2540 N·m, rounded", 2540.0, "1.brake_torque.1", 5e-3),
    ]
    return cases_of("band and block", run, 1e-11, rows)


def capstan_cases() -> list[Case]:
    """Many short linings become a belt: the ratio tends to e^{μφ} with order 2."""
    mu, phi = 0.4, math.radians(270)

    def error(n: int) -> jax.Array:
        steps, _ = tension_ratio(grip(jnp.asarray(mu), jnp.full(n, phi / n)))
        return jnp.prod(steps) * math.exp(-mu * phi) - 1

    first = mu * (1 + mu**2) * phi**3 / (12 * 128**2)
    rows = [
        ("order", "Euler: T_n/T_0 → e^{μφ} as n⁻²", 2.0, lambda errors: math.log2(errors[0] / errors[1]), 0.025),
        ("error, 128 linings", f"{FORM}μ(1 + μ²)φ³/(12 n²), first term", first, "1"),
    ]
    return cases_of("capstan limit", jax.jit(lambda: (error(64), error(128))), 1e-3, rows)


def falling_cases() -> list[Case]:
    """A custom friction law, μ_0/(1 + κω)."""
    J, M, k, w = 10.0, 50.0, 0.3, 8.0
    law = FallingFriction(*(jnp.asarray(x) for x in (M, k, 20.0)))
    time, angle = J / M * (w + k * w**2 / 2), J / M * (w**2 / 2 + k * w**3 / 3)
    rows = [
        ("stopping time", f"{FORM}(J/M_0)(ω_0 + κω_0²/2)", time, "stopping_time"),
        ("angle", f"{FORM}(J/M_0)(ω_0²/2 + κω_0³/3)", angle, "stopping_angle"),
    ]
    scene = stop_scene(n=1, beta=math.degrees(0.5), R=1.0, J=J, C=None, T0=20.0, w0=w, law=law, end=10.0)
    return cases_of_run("falling friction", scene, rows)


def _lever(*torques: tuple[float, float]) -> tuple[jax.Array, jax.Array]:
    """Times and torques of the band at four points: all staged scenes here share one program."""
    profile = points([torque for _, torque in torques], [time for time, _ in torques], 4)
    return profile.times, profile.values


def lock_up_cases() -> list[Case]:
    """Two inertias at 100 and 10 rad/s come to one speed through a pair of 50 N·m, free of everything else.

    They are brought to these speeds by braking for 0.1 s from 110 rad/s, which heats the internal pair by 225 J.
    """
    I1, I2, w1, w2, T, begin = 0.5, 2.0, 100.0, 10.0, 50.0, 0.1
    first = w1 + T / I1 * begin
    torque = T + I2 * (first - w2) / begin
    lever = _lever((0.0, torque), (begin, torque), (begin, 0.0))
    reduced = I1 * I2 / (I1 + I2)
    before = T * (w1 - w2) * begin / 2
    time, heat = reduced * (w1 - w2) / T, reduced * (w1 - w2) ** 2 / 2
    rows = [
        ("time", f"{FORM}I1 I2(ω1 − ω2)/(T(I1 + I2))", time, lambda r: time_of("internal_restick")(r) - begin),
        ("heat", f"{FORM}I1 I2(ω1 − ω2)²/2(I1 + I2)", heat, lambda r: float(r.energy["heat_internal"]) - before),
        ("common speed", f"{FORM}(I1 ω1 + I2 ω2)/(I1 + I2)", (I1 * w1 + I2 * w2) / (I1 + I2), "record.y_end.omega"),
    ]
    return cases_of_run("lock-up", staged_pair(M_i=T, J_1=I1, J_2=I2, w0=first, lever=lever), rows)


def duty_cases() -> list[Case]:
    """Stop, hold, a load that breaks it loose, release, second stop, reversal: all events of one brake.

    Compared are energies, signs of power and slip, limits of sticking linings.
    """
    lever = points([8e3, 8e3, 0.0, 0.0, 9e3, 5e3], [0.0, 2.0, 3.0, 3.3, 3.5, 5.0])
    load = points([0.4 * _HOLD, 0.6 * _HOLD, 0.3 * _HOLD, -_HOLD], [0.0, 2.5, 4.0, 6.0])
    scene = scene_of(lever, load, drag=50.0, **{**ELASTIC, "end": 7.0})

    def run() -> tuple[Result, Series]:
        result = simulate(scene, rtol=1e-12)
        return result, jax.tree.map(np.asarray, result.series(np.linspace(0.0, 7.0, 701)))

    def of_series(
        negative: Callable[[Series], jax.Array], size: Callable[[Series], jax.Array]
    ) -> Callable[[tuple[Result, Series]], float]:
        """Negative part of a quantity that must not be negative, relative to a size."""
        return lambda found: float(max(0.0, -np.min(negative(found[1]))) / size(found[1]))

    def power(s: Series) -> jax.Array:
        return (s.tight_tension - s.slack_tension) * s.slip_speed

    def right_slip(s: Series) -> jax.Array:
        sign = np.select([s.band_mode == BandMode.SLIP, s.band_mode == BandMode.SLIP_BACK], [1.0, -1.0], 0.0)
        return sign * s.slip_speed

    def margin(s: Series) -> jax.Array:
        """Margin of the tension ratio of a sticking band to its limits."""
        elastic = s.band_mode == BandMode.ELASTIC
        tight, slack = s.tight_tension[elastic], s.slack_tension[elastic]
        return np.minimum(_PI * slack - tight, tight - slack / _PI)

    def moved_while_held(found: tuple[Result, Series]) -> float:
        return float(np.max(np.abs(found[1].omega[found[1].band_mode == BandMode.HELD])))

    def kinds(found: tuple[Result, Series]) -> int:
        return len({e.name for e in found[0].events} & {"stop", "restart", "release", "slip_onset", "full_slip"})

    of_heat = of_series(lambda s: np.diff(s.friction_heat), lambda s: s.friction_heat[-1])
    of_slip = of_series(right_slip, lambda s: np.max(np.abs(s.slip_speed)))
    of_limit = of_series(margin, lambda s: np.max(s.tight_tension))
    rows = [
        ("energy-balance residual", "first law", 0.0, "0.energy.closure", 1e-9),
        ("negative friction power", "second law: none", 0.0, of_series(power, lambda s: np.max(power(s))), 1e-12),
        ("friction heat that falls", "second law: none", 0.0, of_heat, 1e-12),
        ("slip of the wrong sign", "Coulomb: none", 0.0, of_slip, 1e-10),
        ("sticking beyond the limit", "Coulomb: |F| ≤ f N while stuck", 0.0, of_limit, 1e-9),
        ("speed while held", "Coulomb: exactly none", 0.0, moved_while_held),
        ("kinds of events", "stop, restart, release, onset, full slip", 5.0, kinds),
    ]
    return cases_of("duty", run, 0.0, rows)


def symmetry_cases() -> list[Case]:
    """Scaling of inertia and forces together, and a shift of the clock, against the unscaled closed form."""
    k, truth, form = 1e6, _TRUTH["stop"], "closed form of the stop"
    scaled, shifted = elastic_stop(8e3 * k, J=800.0 * k, C=2e5 * k), elastic_stop(time=5.0, end=8.0)
    first = ("stopping time", f"{form}, unscaled", truth, "stopping_time")
    second = ("stopping time", f"{form} + 5 s", truth + 5.0, "stopping_time")
    return cases_of_run("inertia and forces × 1e6", scaled, [first]) + cases_of_run("clock + 5 s", shifted, [second])


# --- printed tables ---------------------------------------------------------------------------------------------------

_TITLES = {
    "Z": "Zhuravlov et al., Dynamics of friction couples of a band-shoe brake",
    "V": "Volchenko et al., Thermal transmission through metal friction elements",
}


def _row(what: str, table: str, printed: str, read: Reader) -> Row:
    """A printed number, with the tolerance of `reproduce`."""
    source = f"{_TITLES[table[0]]}, table {table[1]}"
    return what, source, float(printed), read, allowed(printed) / abs(float(printed))


def table_cases() -> list[Case]:
    """Rows of Z's tables 5 and 6 as stops: ten linings over 270°, λ = C R/T_0 = 5, at rest as k of them slide."""
    found = []
    for table, k, scheme in (("Z5", "8", "variable"), ("Z5", "4", "uniform"), ("Z6", "8", "variable")):
        printed = next(row for row in published_rows(table) if (row["k"], row["scheme"]) == (k, scheme))
        band = stopped_band(table, printed)
        scene = scene_of(1.0, n=10, f=FRICTION[table], R=1.0, J=LAMBDA / band.w_0**2, C=LAMBDA, w0=1.0, end=30.0)
        stop = 1 / LAMBDA + math.pi / (2 * band.w_0)
        rows = [
            _row("T_max", table, printed["T_max"], "metrics.max_tension"),
            _row("N_max", table, printed["N_max"], "metrics.max_normal_load"),
            ("stop", f"{FORM}1/λ + π/(2w_0) [Z-15, 16]", stop, "stopping_time"),
        ]
        scene = with_values(scene, {"brake.linings.angle": band.angle})
        found += cases_of_run(f"Z table {table[1]}, k = {k}, {scheme}", scene, rows)
    return found


def cell_cases() -> list[Case]:
    """Single cells of the tables that `simbrake reproduce` recomputes whole."""
    computed = functools.cache(lambda: {(cell.table, cell.row, cell.column): cell.computed for cell in cells()})
    wanted = {"Z1": ["beta1_deg"], "Z2": ["T7"], "Z4": ["N3"], "V1": ["resistance"], "V2": ["K1", "share_metal"]}
    found = []
    for table, columns in wanted.items():
        printed = published_rows(table)[0]
        rows = [_row(name, table, printed[name], lambda values, key=(table, 0, name): values[key]) for name in columns]
        found += cases_of(f"{table} row 0", computed, 0.0, rows)
    return found


CASES = (
    soft_cases,
    textbook_cases,
    capstan_cases,
    falling_cases,
    lock_up_cases,
    duty_cases,
    symmetry_cases,
    table_cases,
    cell_cases,
)
