"""Band brakes with reference solutions: stops, tensions and holds in closed form, energy balances, printed tables."""

import functools
import math
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import lambertw

from .._base._compiling import DeviceJit
from .._base._faults import Fault
from .._parts._scene import Duty, Initial, Scene
from .._physics._mechanism import BandMode
from .._run._edit import with_values
from .._run._result import Result
from .._run._series import Series
from .._run._simulate import simulate
from ..brakes._band import AbstractStiffness, grip, tension_ratio
from ..brakes._design import Band, Bandage, Brake, Lining, Pulley
from ..friction import AbstractFriction, ConstantFriction, Contact
from ..hybrid._arrays import Array
from ..loads import AbstractLoad, HookLoad, TorqueLoad, differential_lever_tension
from ..profiles import AbstractProfile, Constant, ExponentialRise, PiecewiseLinear
from ..published import FRICTION, LAMBDA, allowed, cells, published_rows, stopped_band
from ._validation import FORM, Case, Reader, Row, cases_of, cases_of_run

_BOOK = "Khurmi & Gupta, Theory of Machines, band and block brake"
_SLIDER = "Modelica Standard Library, brake on a slider"
_COULOMB = "Coulomb friction below its capacity"

#: a number of a scene or of a closed form: also traced, or complex
Number: TypeAlias = complex | float | int | Array
Values: TypeAlias = Number | Sequence[Number]

# --- scenes with closed-form solutions --------------------------------------------------------------------------------


def stop_scene(
    n: int = 20,
    f: Number = 0.35,
    beta: float = 13.5,
    R: Number = 0.725,
    J: Number = 800.0,
    C: Number | AbstractStiffness | None = 2e5,
    T0: Number = 8e3,
    w0: Number = 20.0,
    load: Number | AbstractLoad = 0.0,
    end: Number = 5.0,
    law: AbstractFriction | None = None,
    lever: AbstractProfile | None = None,
    **initial: Number,
) -> Scene:
    """A stop with constant slack tension on `n` linings of `beta` degrees: closed forms in `closed_form`.

    `C`: stiffness, `None` for a rigid band; `law`: friction in place of `f`; `lever`: profile in place of `T0`; `load`:
    a torque, or a load.
    """
    lining = Lining(law if law is not None else ConstantFriction(f), np.full(n, math.radians(beta)))
    force = lever if lever is not None else Constant(T0)
    duty = Duty(force, load if isinstance(load, AbstractLoad) else TorqueLoad(Constant(load)))
    return Scene(Brake(Pulley(R, J), Band(R, C), lining), duty, Initial(omega=w0, **initial), end)


def closed_form(
    n: int = 20,
    f: Number = 0.35,
    beta: Number = 13.5,
    R: Number = 0.725,
    J: Number = 800.0,
    C: Number = 2e5,
    T0: Number = 8e3,
    w0: Number = 20.0,
    xp: ModuleType = math,
) -> dict[str, Any]:
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping time.

        t0 = T_0/(C R ω_0),   lining i: t0 + asin(χ T_0 (Π_i − 1)/(C R ω_0))/χ,   χ² = C R²/J,   t1 = that of lining n
        stop: t1 + J ω_0 cos χ(t1 − t0)/(R T_0 (Π − 1))

    `xp`: `math`, or a module with the same functions for derivatives (`jax.numpy`) or complex numbers (`numpy`).
    """
    z = xp.tan(beta * math.pi / 180 / 2)
    mu = (1 + f * z) / (1 - f * z)
    Pi = mu**n
    t0 = T0 / (C * R * w0)
    chi = xp.sqrt(C * R**2 / J)

    def limit(ratio: Number) -> Number:
        return t0 + xp.asin(chi * T0 * (ratio - 1) / (C * R * w0)) / chi

    t1 = limit(Pi)
    w1 = w0 * xp.cos(chi * (t1 - t0))
    limits = [limit(mu ** (i + 1)) for i in range(n)]
    return {"t0": t0, "limits": limits, "t1": t1, "stop": t1 + w1 * J / (R * T0 * (Pi - 1)), "Pi": Pi}


class FallingFriction(AbstractFriction):
    """Friction with which the torque of one lining of 0.5 rad falls as `M_0/(1 + κ ω)`, for `R_b` = 1 m.

    A stop then takes `(J/M_0)(ω_0 + κ ω_0²/2)` and the angle `(J/M_0)(ω_0²/2 + κ ω_0³/3)`.
    """

    M0: jax.Array
    kappa: jax.Array
    T_0: jax.Array

    def kinetic(self, contact: Contact) -> Array:
        torque = self.M0 / (1 + self.kappa * contact.v)
        r = 1 + torque / self.T_0  # Π for R_b = 1
        return (r - 1) / (r + 1) / jnp.tan(0.25)

    def static(self, contact: Contact) -> Array:
        return self.kinetic(Contact(v=0.0 * contact.v))

    def faults(self, path: str) -> list[Fault]:
        return []


def tension_for(torque: Number, n: int, f: Number, beta: float, R: Number = 1.0) -> Number:
    """Slack tension (N) at which the torque of `n` sliding linings is `torque`: `T_0 = M/(R (Π − 1))`."""
    return torque / (R * (closed_form(n=n, f=f, beta=beta)["Pi"] - 1))


def staged_pair(
    M_i: Number = 600.0,
    J_1: Number = 40.0,
    J_2: Number = 4.0,
    w0: Number = 20.0,
    lever: tuple[Values, Sequence[Number] | Array] | None = None,
    end: Number = 3.0,
    c: Number = 500.0,
) -> Scene:
    """Pulley `J_1` and bandage `J_2` joined by an internal pair of capacity `M_i`; the band's torque is `c t`.

    The capacity comes from preload alone: a coefficient so small that the tensions add nothing to it. `lever` `(times,
    torques)`: points of the band's torque in place of `c t`. Radii are 1 m.
    """
    n, f, beta, small = 4, 0.5, 60.0, 1e-14
    brake = Brake(
        Pulley(1.0, J_1),
        Band(1.0),
        Lining(ConstantFriction(f), np.full(n, math.radians(beta))),
        Bandage(J_2, ConstantFriction(small), M_i / (n * small)),
    )
    times, torques = ([0.0, 10.0], [jnp.zeros(()), jnp.asarray(10.0 * c)]) if lever is None else lever
    tensions = jnp.stack([jnp.asarray(tension_for(torque, n, f, beta), jnp.float64) for torque in torques])
    return Scene(brake, Duty(PiecewiseLinear(times, tensions), TorqueLoad()), Initial(w0), end)


def points(values: Values, times: Values = 0.0, count: int = 6) -> PiecewiseLinear:
    """A profile of `count` points, a constant by itself: scenes of one structure share their compiled program."""
    values, times = np.atleast_1d(np.asarray(values, float)), np.atleast_1d(np.asarray(times, float))
    more = count - len(values)
    later = np.linspace(1e6, 2e6, more)  # after the end of every run
    return PiecewiseLinear(np.append(times, later), np.append(values, np.full(more, values[-1])))


def scene_of(
    lever: Values | PiecewiseLinear, load: Values | PiecewiseLinear = 0.0, drag: float = 0.0, **parts: Any
) -> Scene:
    """`stop_scene` under a lever and a load of six points each."""
    lever, load = (x if isinstance(x, PiecewiseLinear) else points(x) for x in (lever, load))
    return stop_scene(lever=lever, load=TorqueLoad(load, drag=drag), **parts)


def time_of(name: str, lining: int | None = None) -> Callable[[Result], float]:
    """The time of the first such event in a run."""
    return lambda r: next(e.time for e in r.events if e.name == name and e.lining == lining)


# --- the standard brake -----------------------------------------------------------------------------------------------

#: the elastic stop of several cases, and its closed forms
ELASTIC: dict[str, Any] = {"n": 10, "beta": 27.0, "f": 0.35, "R": 0.725, "J": 800.0, "C": 2e5, "w0": 20.0}
_TRUTH = closed_form(T0=8e3, **ELASTIC)
_PI = _TRUTH["Pi"]
_HOLD = 0.725 * 8e3 * (_PI - 1)  # what the brake holds (N·m)


def elastic_stop(T0: Number = 8e3, **changes: Any) -> Scene:
    return scene_of(T0, **{**ELASTIC, "end": 5.0, **changes})


def elastic_cases(scene: Scene | None = None) -> list[Case]:
    """Every event of a stop with an elastic band; `scene`: another scene than that of the truth."""
    by_asin = f"{FORM}t0 + asin(χ T_0 (Π_5 − 1)/(C R ω_0))/χ, χ² = C R²/J"
    rows = [
        ("slip onset", f"{FORM}T_0/(C R ω_0) [Z-15]", _TRUTH["t0"], "slip_onset_time"),
        ("limit of lining 5", by_asin, _TRUTH["limits"][4], time_of("lining_limit", 5)),
        ("full slip", f"{FORM}the same with Π [Z-16]", _TRUTH["t1"], "full_slip_time"),
        ("stopping time", f"{FORM}t1 + J ω_1/(R T_0 (Π − 1)) [Z-17, 18]", _TRUTH["stop"], "stopping_time"),
        ("maximum tension", f"{FORM}T_0 Π", 8e3 * _PI, "metrics.max_tension"),
    ]
    return cases_of_run("elastic stop", scene or elastic_stop(), rows)


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

    def error(n: int) -> Array:
        steps, _ = tension_ratio(grip(jnp.asarray(mu), jnp.full(n, phi / n)))
        return jnp.prod(steps) * math.exp(-mu * phi) - 1

    first = mu * (1 + mu**2) * phi**3 / (12 * 128**2)
    rows = [
        ("order", "Euler: T_n/T_0 → e^{μφ} as n⁻²", 2.0, lambda errors: math.log2(errors[0] / errors[1]), 0.025),
        ("error, 128 linings", f"{FORM}μ(1 + μ²)φ³/(12 n²), first term", first, "1"),
    ]
    return cases_of("capstan limit", jax.jit(lambda: (error(64), error(128))), 1e-3, rows)


def hook_cases() -> list[Case]:
    """A hook of 60 t on eight lines, braked by 60 kN·m through one lining."""
    J, m, r, n, w0, M, g = 1200.0, 60e3, 0.4, 8, 24.0, 60e3, 9.81
    f, beta, R = 0.3, 30.0, 0.6
    load = HookLoad(mass=m, drum_radius=r, line_count=n, gravity=g)  # pyright: ignore
    T_0 = tension_for(M, 1, f, beta, R)
    scene = stop_scene(n=1, f=f, beta=beta, R=R, J=J, C=None, T0=T_0, w0=w0, load=load, end=3.0)
    run = functools.cache(lambda: simulate(scene, rtol=1e-12))
    inertia, torque = J + m * (r / n) ** 2, m * g * r / n
    time = inertia * w0 / (M - torque)
    fz = f * math.tan(math.radians(beta) / 2)

    def ratio(result: Result) -> Array:
        s = result.series([0.5])
        return s.tight_tension[0] / s.slack_tension[0]

    rows = [
        ("stopping time", f"{FORM}J_eq ω_0/(M_b − m g r/n), J_eq = J + m(r/n)²", time, "stopping_time"),
        ("travel", f"{FORM}v_0 t/2", w0 * r / n * time / 2, "hook_travel"),
        ("friction heat", f"{FORM}M_b ω_0 t/2", M * w0 * time / 2, "energy.friction_heat"),
    ]
    shoe = f"{FORM}single shoe: (1 + f tan β/2)/(1 − f tan β/2)"
    one = ("tension ratio", shoe, (1 + fz) / (1 - fz), ratio)
    return cases_of("hook load", run, 1e-11, rows) + cases_of("one lining", run, 1e-11, [one])


def rigid_cases() -> list[Case]:
    """Rigid bands: a brake applied at a given time, rotation the other way, a load that grows past the capacity."""
    n, beta, f = 14, 15.0, 0.25
    parts: dict[str, Any] = {"n": n, "beta": beta, "f": f, "C": None}
    late = points([0.0, 0.0, tension_for(1.0, n, f, beta)], [0.0, 0.1, 0.1])
    Pi = closed_form(n=n, f=f, beta=beta)["Pi"]
    x = (4.0 + 0.5) / 0.5
    rise = ExponentialRise(800 * 20 / 4.0 / (0.725 * (Pi - 1)), 0.5)
    slider = [
        ("stop", f"{_SLIDER}: 0.1 + m v/F", 1.1, "stopping_time"),
        ("way", f"{_SLIDER}: v t_0 + m v²/2F", 0.6, "stopping_angle"),
    ]
    back = (f"{FORM}J|ω_0|/(R T_0 (1 − 1/Π))", 16e3 / (0.725 * 8e3 * (1 - 1 / Pi)))
    grows = (f"{FORM}where M_load = R T_0 (Π − 1)", 0.725 * 8e3 * (Pi - 1) / 1e3)
    pressed = (f"{FORM}a + τ + τ W_0(−e^(−(a+τ)/τ)), a = Jω_0/M_0", 0.5 * (x + lambertw(-math.exp(-x)).real))
    load = points([0.0, 12e3], [0.0, 12.0])
    return [
        *cases_of_run("brake on a slider", scene_of(late, R=1.0, J=1.0, w0=1.0, end=2.0, **parts), slider),
        *cases_of_run(
            "turning back", scene_of(8e3, w0=-20.0, end=15.0, **parts), [("stopping time", *back, "stopping_time")]
        ),
        *cases_of_run(
            "growing load", scene_of(8e3, load, w0=0.0, end=12.0, **parts), [("restart", *grows, time_of("restart"))]
        ),
        *cases_of_run(
            "exponential rise", stop_scene(lever=rise, end=8.0, **parts), [("stopping time", *pressed, "stopping_time")]
        ),
    ]


def falling_cases() -> list[Case]:
    """A custom friction law, μ_0/(1 + κω)."""
    J, M, k, w = 10.0, 50.0, 0.3, 8.0
    law = FallingFriction(*(jnp.asarray(x) for x in (M, k, 20.0)))  # pyright: ignore
    time, angle = J / M * (w + k * w**2 / 2), J / M * (w**2 / 2 + k * w**3 / 3)
    rows = [
        ("stopping time", f"{FORM}(J/M_0)(ω_0 + κω_0²/2)", time, "stopping_time"),
        ("angle", f"{FORM}(J/M_0)(ω_0²/2 + κω_0³/3)", angle, "stopping_angle"),
    ]
    scene = stop_scene(n=1, beta=math.degrees(0.5), R=1.0, J=J, C=None, T0=20.0, w0=w, law=law, end=10.0)
    return cases_of_run("falling friction", scene, rows)


# --- the staged brake -------------------------------------------------------------------------------------------------


def pair_cases(**changes: Any) -> list[Case]:
    """Internal slip, external lock and stop under a torque `c t`; `changes`: of the scene, not of the truth."""
    J1, J2, w0, M, c = 40.0, 4.0, 20.0, 600.0, 500.0
    t0 = M * (J1 + J2) / (c * J1)
    w_t0 = w0 - c * t0**2 / (2 * (J1 + J2))
    # J2 ω̇2 = M − c t from t0 on, down to 0
    slope = M - c * t0
    d = (slope + math.sqrt(slope**2 + 2 * c * J2 * w_t0)) / c
    lock, w1 = t0 + d, w_t0 - M * d / J1
    # internal slip: ω1 − ω2 = −M τ/J1 − (slope τ − c τ²/2)/J2 until the lock, then ω1 alone
    inner = M * (-(M / J1 + slope / J2) * d**2 / 2 + c * d**3 / (6 * J2)) + J1 * w1**2 / 2
    total = (J1 + J2) * w0**2 / 2

    def speed(result: Result) -> Array:
        return result.series([float(result.external_lock_time)]).omega[0]

    rows = [
        ("internal slip", f"{FORM}M_i(J1 + J2)/(c J1)", t0, "internal_slip_time"),
        ("external lock", f"{FORM}J2 ω̇2 = M_i − c t to 0", lock, "external_lock_time"),
        ("speed at the lock", f"{FORM}ω1 = ω(t0) − M_i(t − t0)/J1", w1, speed),
        ("stopping time", f"{FORM}t0/2 + ω_0 J1/M_i", t0 / 2 + w0 * J1 / M, "stopping_time"),
        ("internal heat", f"{FORM}∫ M_i(ω1 − ω2) dt", inner, "energy.heat_internal"),
        ("external heat", f"{FORM}(J1 + J2)ω_0²/2 − internal heat", total - inner, "energy.heat_external"),
    ]
    parts = {"M_i": M, "J_1": J1, "J_2": J2, "w0": w0, "lever": _lever((0.0, 0.0), (10.0, 10.0 * c))}
    return cases_of_run("staged pair", staged_pair(**parts | changes), rows)


def _lever(*torques: tuple[float, float]) -> tuple[Array, Array]:
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


# --- conditions of every run --- --------------------------------------------------------------------------------------


def hold_cases() -> list[Case]:
    """An hour of holding: half of the capacity, just below it, and by a staged brake; nothing moves at all."""

    def moved(result: Result) -> float:
        s = result.series(np.linspace(0.0, 3600.0, 25))
        other = s.omega if s.bandage_speed is None else np.asarray(s.bandage_speed)
        return float(np.max(np.abs(s.phi)) + np.max(np.abs(other)))

    def held(share: float) -> Scene:
        return elastic_stop(load=share * _HOLD, w0=0.0, end=3600.0)

    staged = staged_pair(w0=0.0, lever=_lever((0.0, 500.0)), end=3600.0)
    exactly = f"{_COULOMB}: moves exactly 0"
    return [
        *cases_of_run("held 3600 s", held(0.5), [("half of the capacity", exactly, 0.0, moved, 0.0)]),
        *cases_of_run("held 3600 s", held(1 - 1e-12), [("capacity less 1e-12", exactly, 0.0, moved, 0.0)]),
        *cases_of_run("staged brake held 3600 s", staged, [("movement", f"{_COULOMB}: none", 0.0, moved, 0.0)]),
    ]


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
        negative: Callable[[Series], Array], size: Callable[[Series], Array]
    ) -> Callable[[tuple[Result, Series]], float]:
        """Negative part of a quantity that must not be negative, relative to a size."""
        return lambda found: float(max(0.0, -np.min(negative(found[1]))) / size(found[1]))

    def power(s: Series) -> Array:
        return (s.tight_tension - s.slack_tension) * s.slip_speed

    def right_slip(s: Series) -> Array:
        sign = np.select([s.band_mode == BandMode.SLIP, s.band_mode == BandMode.SLIP_BACK], [1.0, -1.0], 0.0)
        return sign * s.slip_speed

    def margin(s: Series) -> Array:
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


def gradient_cases() -> list[Case]:
    """Derivatives of the stopping time by reverse mode; forward mode along all numbers at once."""

    def stopping_time(scene: Scene) -> Array:
        return simulate(scene, rtol=1e-12, max_steps=256).stopping_time

    def both(scene: Scene) -> tuple[Scene, Array]:
        return jax.grad(stopping_time)(scene), jax.jvp(stopping_time, (scene,), (scene,))[1]

    def run() -> tuple[Scene, Array]:
        return DeviceJit(both)(jax.tree.map(np.asarray, elastic_stop()))

    def truth(name: str) -> float:
        # complex step: no difference of near numbers
        values: dict[str, Any] = {"T0": 8e3, **ELASTIC}
        values[name] = values[name] + 1e-200j
        return closed_form(xp=np, **values)["stop"].imag / 1e-200

    def ratio(found: tuple[Scene, Array]) -> float:
        leaves = zip(jax.tree.leaves(found[0]), jax.tree.leaves(elastic_stop()), strict=True)
        return float(found[1]) / sum(float(np.sum(a * b)) for a, b in leaves)

    places = {
        "f": "0.brake.linings.friction.coefficient",
        "beta": lambda found: np.sum(found[0].brake.linings.angle) * math.pi / 180,
        "R": "0.brake.band.radius",
        "J": "0.brake.pulley.inertia",
        "C": "0.brake.band.stiffness",
        "T0": lambda found: np.sum(found[0].duty.slack_tension.values),
        "w0": "0.initial.omega",
    }
    source = "closed form of the stop, differentiated"
    rows: list[Row] = [(f"∂(stopping time)/∂{name}", source, truth(name), place) for name, place in places.items()]
    rows.append(("forward over reverse mode", "chain rule: Σ x ∂t/∂x both ways", 1.0, ratio))
    return cases_of("elastic stop", run, 1e-9, rows)


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
    *(elastic_cases, soft_cases, textbook_cases, capstan_cases, hook_cases, rigid_cases, falling_cases),
    *(pair_cases, lock_up_cases, hold_cases, duty_cases, symmetry_cases, gradient_cases, table_cases, cell_cases),
)
