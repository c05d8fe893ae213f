"""Validation of the energies that brakes store: rope, chain, bandage, linings on springs; memory on a soft band."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import (
    FORM,
    Case,
    Row,
    Slope,
    cases_of_run,
    cases_with_slopes,
    differentiated,
    frozen_cases,
    truths,
)
from cases_mechanisms import _staged
from jaxtyping import Float
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq
from stop_scenes import closed_form, stop_scene, time_of

from simbrake import (
    Band,
    Bandage,
    Brake,
    Constant,
    ConstantFriction,
    Duty,
    HookLoad,
    Initial,
    Lining,
    PiecewiseLinear,
    Pulley,
    Result,
    Scene,
    Segments,
    TorqueLoad,
)
from simbrake.friction import AbstractFriction, AnyContact
from simbrake.loads import GRAVITY, Phase, Phases, RopeElasticity, StringLoad

_BALANCE = "first law"

# --- the elastic rope -------------------------------------------------------------------------------------------------


def rope_cases() -> list[Case]:
    """A stop of a hook on an elastic rope and the swing after it: what is stored, and what was done, at the end."""
    J, per_rad, m, w0, k, T_0, end = 1200.0, 0.05, 40e3, 8.0, 4e6, 25e3, 2.0
    M, still, nu = T_0 * 0.725 * (closed_form()["Pi"] - 1), m * GRAVITY / k, math.sqrt(k / m)
    rate = math.sqrt(k * (1 / m + per_rad**2 / J))
    middle = (GRAVITY + per_rad * M / J) / rate**2
    swing, steady, pull = still - middle, (k * per_rad * middle - M) / J, k * per_rad / J

    def speed(t: float) -> float:
        return w0 + steady * t + pull * swing * math.sin(rate * t) / rate

    stop: Any = brentq(speed, 1e-3, 1.0, xtol=1e-15)
    angle = w0 * stop + steady * stop**2 / 2 + pull * swing * (1 - math.cos(rate * stop)) / rate**2
    e, v = middle + swing * math.cos(rate * stop), -swing * rate * math.sin(rate * stop)
    # the drum rests, and the hook swings about its weight
    turn = nu * (end - stop)
    e, v = (
        still + (e - still) * math.cos(turn) + v / nu * math.sin(turn),
        v * math.cos(turn) - (e - still) * nu * math.sin(turn),
    )
    drop = per_rad * angle + e - still
    source = f"{FORM}two masses on a spring; the hook alone after the stop"
    rows: list[Row] = [
        ("stretch", source, e, lambda r: r.series([end]).rope_stretch[0]),
        ("elastic energy", f"{source}: k (e² − e_0²)/2", k * (e**2 - still**2) / 2, "energy.elastic_change"),
        (
            "kinetic energy",
            f"{source}: m v²/2 − (J + m (r/n)²) ω_0²/2",
            (m * v**2 - (J + m * per_rad**2) * w0**2) / 2,
            "energy.kinetic_change",
        ),
        ("load work", f"{source}: m g s", m * GRAVITY * drop, "energy.load_work"),
        ("friction heat", f"{source}: M φ", M * angle, "energy.friction_heat"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
    ]
    load = HookLoad(m, 0.4, 8.0, elasticity=RopeElasticity(k, 0.0))
    scene = stop_scene(C=None, J=J, T0=T_0, w0=w0, load=load, end=end)
    return cases_with_slopes("energies on a rope", scene, rows, tolerance=1e-9, program="elastic rope")


def string_cases() -> list[Case]:
    """An elastic rope that takes a string at rest, sets it down and takes a longer one: its energy is load work."""
    k, empty, string, stand = 4e6, 5e3, 40e3, 3e3
    light, heavy, last = (m * GRAVITY / k for m in (empty, empty + string, empty + string + stand))
    lever = Phases((Phase(Constant(25e3), "1 s", hangs=False), Phase(Constant(25e3), "1 s")), 2)
    load = StringLoad(empty, string, 0.4, 8.0, stand, elasticity=RopeElasticity(k, 2e4))
    scene = stop_scene(C=None, J=1200.0, w0=0.0, load=load, end=10.0)
    scene = Scene(scene.brake, Duty(lever, load), scene.initial, 10.0)
    gained = k * (last**2 - light**2) / 2
    rows: list[Row] = [
        ("elastic energy", f"{FORM}k (e_1² − e_0²)/2, e = m g/k", gained, "energy.elastic_change"),
        ("load work", f"{FORM}k (e_1² − e_0²)/2: it is let down slowly", gained, "energy.load_work"),
        ("hook", f"{FORM}Δm g/k", last - light, lambda r: r.series([4.0]).hook_position[0]),
        ("hook, first string", f"{FORM}Δm g/k", heavy - light, lambda r: r.series([1.5]).hook_position[0]),
        ("hook load", f"{FORM}m g", (empty + string) * GRAVITY, lambda r: r.series([1.5]).hook_load[0]),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-12),
    ]
    return cases_of_run("string on a rope", scene, rows)


def moving_string_cases() -> list[Case]:
    """A drum that turns under an empty hook takes a string, and brakes: two masses on a damped spring, by exp(A t).

    The string comes with the speed of the hook, and the rope takes its weight on slowly.
    """
    J, per_rad, k, c, empty, string, T_0, at, end = 1200.0, 0.05, 4e6, 3e5, 5e3, 40e3, 7.5e3, 1.3, 2.0
    M = T_0 * 0.725 * (closed_form()["Pi"] - 1)

    def matrix(mass: float, torque: float) -> Any:
        """Rates of ω, v, stretch beyond that under the weight, φ, s, 1."""
        A = np.zeros((6, 6))
        A[0, [0, 1, 2, 5]] = np.array([-c * per_rad, c, k, mass * GRAVITY]) * per_rad / J - [0, 0, 0, torque / J]
        A[1, :3] = c * per_rad / mass, -c / mass, -k / mass
        A[2, :2], A[3, 0], A[4, 1] = (-per_rad, 1.0), 1.0, 1.0
        return A

    def moved(at: complex) -> tuple[Any, Any]:
        """States as the string is taken, and at the end; the stretch grows with the weight."""
        taken = expm(matrix(empty, 0.0) * at) @ np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        return taken, expm(matrix(empty + string, M) * (end - at)) @ taken

    def heat(mass: float, torque: float, y: Any, time: float) -> float:
        def power(t: float) -> float:
            now = expm(matrix(mass, torque) * t) @ y
            return c * (now[1] - per_rad * now[0]) ** 2

        return quad(power, 0.0, time, epsabs=0.0, epsrel=1e-12, limit=200)[0]

    taken, last = moved(at)
    light, heavy = empty * GRAVITY / k, (empty + string) * GRAVITY / k
    brought = string * taken[1] ** 2 / 2 + k * ((heavy + taken[2]) ** 2 - (light + taken[2]) ** 2) / 2
    damped = heat(empty, 0.0, np.eye(6)[5], at) + heat(empty + string, M, taken, end - at)
    source = f"{FORM}exp(A t) of ω, v, e; the string brings Δm v²/2 + k (e_2² − e_1²)/2"
    rows: list[Row] = [
        ("speed", source, last[0], "record.y_end.omega"),
        ("stretch", source, heavy + last[2], lambda r: r.series([end]).rope_stretch[0]),
        ("hook load", f"{source}; k e + c ė", k * (heavy + last[2]) + c * (last[1] - per_rad * last[0]), _hook_load),
        (
            "kinetic energy",
            f"{source}; J ω²/2 + m v²/2",
            (J * last[0] ** 2 + (empty + string) * last[1] ** 2) / 2,
            "energy.kinetic_change",
        ),
        (
            "load work",
            f"{source}, + m_1 g s_1 + m_2 g s_2",
            brought + GRAVITY * (empty * taken[4] + (empty + string) * (last[4] - taken[4])),
            "energy.load_work",
        ),
        ("heat of the damper", f"{source}: ∫ c ė² dt", damped, "energy.damper_heat"),
        ("friction heat", f"{source}: M φ", M * (last[3] - taken[3]), "energy.friction_heat"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
        (
            "∂(speed)/∂(time at which it is taken)",
            f"{source}, differentiated",
            differentiated(lambda x: moved(x)[1][0], at),
            Slope("duty.slack_tension.phases.0.until.duration"),
        ),
    ]
    phases = Phases((Phase(Constant(0.0), f"{at} s", hangs=False), Phase(Constant(T_0), "9 s")))
    load = StringLoad(empty, string, 0.4, 8.0, elasticity=RopeElasticity(k, c))
    scene = stop_scene(C=None, J=J, w0=0.0, load=load, end=end)
    scene = Scene(scene.brake, Duty(phases, load), scene.initial, end)
    return cases_with_slopes("string taken in motion", scene, rows, _speed_at_end, 1e-10)


def falling_string_cases() -> list[Case]:
    """A hook that falls on a slack rope takes a string, falls on, and swings as the rope pulls; the drum holds."""
    k, empty, string, slack, at, end = 4e6, 5e3, 40e3, 0.2, 0.12, 0.5
    m, tight = empty + string, math.sqrt(2 * slack / GRAVITY)
    still, nu = m * GRAVITY / k, math.sqrt(k / m)
    turn = nu * (end - tight)
    e = still * (1 - math.cos(turn)) + GRAVITY * tight / nu * math.sin(turn)
    v = still * nu * math.sin(turn) + GRAVITY * tight * math.cos(turn)
    fallen, early = GRAVITY * at**2 / 2, 0.18
    work = GRAVITY * (empty * fallen + m * (slack + e - fallen)) + string * (GRAVITY * at) ** 2 / 2
    source = f"{FORM}e = g t²/2 − e_0, then m e'' = m g − k e"
    rows: list[Row] = [
        (
            "stretch as it falls",
            f"{FORM}g t²/2 − e_0",
            GRAVITY * early**2 / 2 - slack,
            lambda r: r.series([early]).rope_stretch[0],
        ),
        ("stretch", source, e, lambda r: r.series([end]).rope_stretch[0]),
        ("kinetic energy", f"{source}: m v²/2", m * v**2 / 2, "energy.kinetic_change"),
        ("load work", f"{source}: m_1 g s_1 + m_2 g s_2 + Δm v²/2", work, "energy.load_work"),
        ("elastic energy", f"{source}: k e²/2", k * e**2 / 2, "energy.elastic_change"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
    ]
    phases = Phases((Phase(Constant(25e3), f"{at} s", hangs=False), Phase(Constant(25e3), "9 s")))
    load = StringLoad(empty, string, 0.4, 8.0, elasticity=RopeElasticity(k, 0.0, stretch=-slack))
    scene = stop_scene(C=None, J=1200.0, w0=0.0, load=load, end=end)
    scene = Scene(scene.brake, Duty(phases, load), scene.initial, end)
    return cases_with_slopes("string taken on a slack rope", scene, rows, tolerance=1e-10)


def _speed_at_end(result: Result) -> Any:
    return result.record.y_end.omega


def _hook_load(result: Result) -> Any:
    force: Any = result.series([float(result.record.t_end)]).hook_load
    return force[0]


# --- chain, linings on springs, bandage -------------------------------------------------------------------------------


def chain_cases() -> list[Case]:
    """Three linings of unequal mass that stick: with the pulley they are one mass on the anchor's spring and damper."""
    J, R_b, m, C, D, T_0, w0, end = 40.0, 0.9, np.array([2.0, 5.0, 9.0]), 2e4, 60.0, 1e3, 1.0, 0.06
    # as seen at the band circle: q'' + 2 δ q' + ν² q = 0 of the elongation beyond T_0/C
    mass = J / R_b**2 + m.sum()
    delta = D / (2 * mass)
    nu = math.sqrt(C / mass - delta**2)

    def moved(t: float) -> tuple[float, float]:
        """Elongation beyond `T_0/C`, and its rate."""
        decay, q = math.exp(-delta * t), R_b * w0 / nu
        return decay * q * math.sin(nu * t), decay * q * (nu * math.cos(nu * t) - delta * math.sin(nu * t))

    q, rate = moved(end)
    still = T_0 / C
    source = f"{FORM}(J/R_b² + Σ m) q'' + D q' + C q = 0"
    damped = quad(lambda t: D * moved(t)[1] ** 2, 0.0, end, epsrel=1e-13, epsabs=0.0)[0]
    rows: list[Row] = [
        ("speed", source, rate / R_b, "record.y_end.omega"),
        (
            "kinetic energy",
            f"{source}: Σ of pulley and linings",
            mass * (rate**2 - (R_b * w0) ** 2) / 2,
            "energy.kinetic_change",
        ),
        (
            "elastic energy",
            f"{source}: C (x² − x_0²)/2",
            C * ((still + q) ** 2 - still**2) / 2,
            "energy.elastic_change",
        ),
        ("lever work", f"{source}: T_0 (x − x_0)", T_0 * q, "energy.lever_work"),
        ("heat of the damper", f"{source}: ∫ D q̇² dt", damped, "energy.damper_heat"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
    ]
    linings = Lining(ConstantFriction(0.6), np.full(3, math.radians(80.0)), mass=m)
    brake = Brake(Pulley(R_b, J), Band(R_b, C, Segments(np.array([3e6, 5e6]), 0.05, D)), linings)
    scene = Scene(brake, Duty(Constant(T_0), TorqueLoad()), Initial(w0, still), end)
    return cases_of_run("energies of a chain", scene, rows, 1e-10)


def parting_cases() -> list[Case]:
    """A lining that a growing torque takes along on its spring, until it breaks away; either way."""
    return [*_parting(1), *_parting(-1)]


def _parting(sense: int) -> list[Case]:
    J, R_b, m, C, D, T_0, f, growth, end = 40.0, 0.9, 5.0, 2e4, 60.0, 1e3, 0.3, sense * 2e3, 0.5
    z = math.tan(math.radians(30.0))
    # of t, elongation beyond T_0/C, its rate, speed of the pulley, 1: sticking; sliding
    stuck, along = np.zeros((2, 5, 5))
    stuck[0, 4] = stuck[1, 2] = along[0, 4] = along[1, 2] = 1.0
    spring = np.array([0.0, C, D, 0.0, 0.0])  # T − T_0
    stuck[2] = (np.array([growth / R_b, 0.0, 0.0, 0.0, 0.0]) - spring) / (J / R_b**2 + m)
    stuck[3] = stuck[2] / R_b

    def force(f: Any) -> Any:
        """Of friction on a lining that slides: `± f (T + T_0) tan(β/2)`."""
        return sense * f * z * (spring + np.array([0.0, 0.0, 0.0, 0.0, 2 * T_0]))

    def moved(t: Any, taken: Any, f: Any) -> Any:
        slid = along + 0j * f
        slid[2], slid[3] = (force(f) - spring) / m, (np.array([growth, 0.0, 0.0, 0.0, 0.0]) - R_b * force(f)) / J
        return expm(slid * (t - taken)) @ stuck_at(taken)

    def stuck_at(t: Any) -> Any:
        return expm(stuck * t) @ np.array([0.0, 0.0, 0.0, 0.0, 1.0])

    def excess(t: Any, f: Any) -> Any:
        """Of the force that holds the lining over what friction can."""
        return sense * (m * stuck[2] + spring - force(f)) @ stuck_at(t)

    taken: Any = brentq(lambda t: excess(t, f), 0.0, end, xtol=1e-16)
    slope = sense * (m * stuck[2] + spring - force(f)) @ stuck @ stuck_at(taken)

    def last(f: Any) -> Any:
        return moved(end, taken - excess(taken, f) / slope, f)

    def power(t: float) -> float:
        y = moved(t, taken, f).real
        return force(f) @ y * (R_b * y[3] - y[2])

    e, v, w = last(f).real[1:4]
    at_rest, source = T_0 / C, f"{FORM}matrix exponential of the linear rates, root of |G| = f_s N/cos(β/2)"
    heat = quad(power, taken, end, epsabs=0.0, epsrel=1e-13)[0]
    rows: list[Row] = [
        ("breaks away", source, taken, time_of("restart")),
        ("speed", source, w, "record.y_end.omega"),
        ("speed of the lining", source, v, "record.y_end.own.v.0", 1e-9),
        ("elongation beyond x_0", source, e, lambda r: r.series([end]).elongation[0]),
        ("friction heat", f"{source}; quadrature of G (R_b ω − v)", heat, "energy.friction_heat"),
        ("elastic energy", f"{source}: C (x² − x_0²)/2", C * e * (e + 2 * at_rest) / 2, "energy.elastic_change"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
        (
            "∂(speed)/∂f",
            f"{source}, differentiated",
            differentiated(lambda f: last(f)[3], f),
            Slope("brake.linings.friction.coefficient"),
            1e-9,
        ),
    ]
    lining = Lining(ConstantFriction(f), np.full(1, math.radians(60.0)), mass=m)
    brake = Brake(Pulley(R_b, J), Band(R_b, C, Segments(1e3, D, D)), lining)
    load = TorqueLoad(PiecewiseLinear([0.0, 1.0], [0.0, growth]))
    scene = Scene(brake, Duty(Constant(T_0), load), Initial(0.0, at_rest), end)
    subject = f"a lining that breaks away {'ahead' if sense > 0 else 'back'}"
    return cases_with_slopes(subject, scene, rows, lambda r: r.record.y_end.omega, program="parting lining")


#: inertia of the linings of `sprung_stop` (kg·m²)
SPRUNG = 1.2, 1.5


def sprung_stop(end: float) -> Scene:
    """The stop of "linings on springs": two linings of a staged brake, with a spring between them."""
    bandage = Bandage(
        list(SPRUNG),
        ConstantFriction(0.2),
        [1500.0, 900.0],
        spring=np.array([2e3]),
        spring_damping=0.05,
    )
    linings = Lining(ConstantFriction(0.4), np.full(2, math.radians(50.0)))
    lever = PiecewiseLinear([0.0, 0.3], [100.0, 6e3])
    brake = Brake(Pulley(0.59, 200.0), Band(0.64), linings, bandage)
    return Scene(brake, Duty(lever, TorqueLoad()), Initial(20.0), end)


def sprung_slopes() -> list[Case]:
    """Its derivatives."""
    slopes = {"∂(stopping time)/∂K": "brake.bandage.spring.0", "∂(stopping time)/∂N_pre": "brake.bandage.preload.1"}
    return frozen_cases("linings on springs", sprung_stop(8.0), {}, slopes)


def spring_cases() -> list[Case]:
    """The stop of "linings on springs": all kinetic energy is gone, the spring keeps some; and its first instants."""
    J, own, K, w0, R_b, early = 200.0, SPRUNG, 2e3, 20.0, 0.64, 0.015
    frozen = {row["what"]: float(row["truth"]) for row in truths()["linings on springs"]}
    whole = J + sum(own)
    half = math.tan(math.radians(25.0))
    mu = (1 + 0.4 * half) / (1 - 0.4 * half)
    drag = R_b * (mu**2 - 1)
    # while all linings ride on the rim, under T_0 = 100 + 5900 t/0.3
    speed = w0 - drag * (100.0 * early + 5900.0 / 0.3 * early**2 / 2) / whole

    def rim_speed(result: Result) -> jax.Array:
        speeds: Any = result._system.mechanism.lining_speed(result.record.y_end.own)
        return speeds[1]

    stopped: list[Row] = [
        ("kinetic energy", f"{FORM}−(J + Σ J_i) ω_0²/2", -whole * w0**2 / 2, "energy.kinetic_change"),
        (
            "elastic energy",
            "K e²/2, e by SciPy DOP853",
            K * frozen["elongation at rest"] ** 2 / 2,
            "energy.elastic_change",
            1e-8,
        ),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
    ]
    source = f"{FORM}(J + Σ J_i) ω̇ = −R_b T_0(t) (μ² − 1)"
    riding: list[Row] = [
        ("kinetic energy of the ride", source, whole * (speed**2 - w0**2) / 2, "energy.kinetic_change"),
        ("speed of lining 2 on the band", f"{source}: R_b ω", R_b * speed, rim_speed),
        (
            "friction of lining 2 on the band",
            f"{FORM}(T_2 − T_1) cos β/2, T_i = μ^i T_0(t)",
            (100.0 + 5900.0 / 0.3 * early) * mu * (mu - 1) * math.cos(math.radians(25.0)),
            lambda result: result.series([early]).friction_force[0, 1],
        ),
    ]
    program = "linings on springs"
    return [
        *cases_with_slopes("energies of linings on springs", sprung_stop(8.0), stopped, program=program),
        *cases_with_slopes("energies of linings on springs", sprung_stop(early), riding, program=program),
    ]


def staged_cases() -> list[Case]:
    """The stop of "staged stop", with a bandage on an elastic band."""
    scene = _staged(PiecewiseLinear([0.0, 7.5], [200.0, 30200.0]), 300.0, 3e5, 900.0, 4.0)
    rows: list[Row] = [
        ("kinetic energy", f"{FORM}−(J + J_b) ω_0²/2", -(900.0 + 45.0) * 20.0**2 / 2, "energy.kinetic_change"),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
    ]
    return cases_with_slopes("energies of a staged stop", scene, rows, program="staged stop")


# --- friction with memory on an elastic band --------------------------------------------------------------------------


class Softening(AbstractFriction):
    """Friction `f c` of linings that soften the faster they slide: `ċ = κ (c_e − c) (v/v_0)²`."""

    coefficient: jax.Array
    pace: Float[jax.Array, " n"]  # κ (1/s) of each lining
    end: jax.Array
    size: jax.Array  # v_0 (m/s)

    def start(self, n: int) -> jax.Array:
        return jnp.ones(n)

    def rates(self, contact: AnyContact) -> jax.Array:
        return self.pace * (self.end - contact.memory) * (contact.v / self.size) ** 2

    def kinetic(self, contact: AnyContact) -> jax.Array:
        return self.coefficient * contact.memory

    def static(self, contact: AnyContact) -> jax.Array:
        return self.coefficient * contact.memory


def softening_cases() -> list[Case]:
    """A soft band that yields as its linings soften by the slip: the slip speed is implicit."""
    law = Softening(*(np.asarray(x) for x in (0.35, [0.5, 1.5], 0.4, 10.0)))
    scene = stop_scene(n=2, beta=80.0, C=2e4, law=law, load=500.0, T0=9e3, end=6.0)

    def factor(k: int) -> Any:
        return lambda result: result.series([float(result.stopping_time)]).friction_memory[0, k]

    def at_one_second(name: str) -> Any:
        return lambda result: getattr(result.series([1.0]), name)[0]

    return frozen_cases(
        "softening on a soft band",
        scene,
        {
            "full slip": "full_slip_time",
            "stopping time": "stopping_time",
            "factor of lining 1 at rest": factor(0),
            "factor of lining 2 at rest": factor(1),
            "elongation at 1 s": at_one_second("elongation"),
            "lever work at 1 s": at_one_second("lever_work"),
        },
        {"∂(stopping time)/∂v_0": "brake.linings.friction.size"},
    )


CASES = (
    rope_cases,
    string_cases,
    moving_string_cases,
    falling_string_cases,
    chain_cases,
    parting_cases,
    spring_cases,
    sprung_slopes,
    staged_cases,
    softening_cases,
)
