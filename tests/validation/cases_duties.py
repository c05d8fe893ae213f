"""Validation of duties: phases that end cool, a driller, strings that an elastic rope
takes."""

import cmath
import math

import numpy as np
from case_tools import (
    FORM,
    Slope,
    cases_of_run,
    cases_with_slopes,
    differentiated,
)
from scenes import GAIN, closed_form, lining_ratio, stop_scene
from scipy.integrate import quad
from scipy.linalg import expm

from simbrake import (
    Driller,
    Duty,
    Heat,
    PiecewiseLinear,
    Scene,
    TrippingLoad,
)
from simbrake.loads import (
    GRAVITY,
    Phase,
    Phases,
    RopeElasticity,
    StringLoad,
)
from simbrake.thermal import (
    ROOM,
    Conductance,
    FrictionHeat,
    Lump,
    Reservoir,
)

#: tension ratio of four linings of 50°
_PI_4 = closed_form(n=4, beta=50.0)["Pi"]


def cooling_cases():
    """A stop whose rim loses heat meanwhile, and a phase that ends as it has cooled
    down to a level."""
    C = 3e3
    G = 60.0
    level = ROOM + 25.0
    J = 800.0
    w0 = 20.0
    M = 0.725 * 8e3 * (_PI_4 - 1)
    stop = J * w0 / M
    b = G / C
    alpha = M / J
    # C ΔT' = M (ω_0 − α t) − G ΔT
    rise = M / G * ((w0 + alpha / b) * -math.expm1(-b * stop) - alpha * stop)
    cooled = stop + math.log(rise / (level - ROOM)) / b
    lost = J * w0**2 / 2 - C * (level - ROOM)
    heat = Heat(
        (Lump("rim", C), Reservoir("air", ROOM)),
        (Conductance("rim", "air", G),),
        FrictionHeat("rim", None, 1.0),
        rim="rim",
    )
    ends = f"temperature of the rim below {level} K"
    lever = Phases((Phase(8e3, "rest"), Phase(8e3, ends)))
    scene = stop_scene(n=4, beta=50.0, C=None)
    scene = Scene(scene.brake, Duty(lever, scene.duty.load), scene.initial, 400.0, heat)
    rows = [
        (
            "rise at rest",
            f"{FORM}C ΔT' = M (ω_0 − M t/J) − G ΔT",
            rise,
            lambda r: r.series([stop]).temperature[0, 0] - ROOM,
        ),
        ("end", f"{FORM}t_s + (C/G) ln(ΔT_s/ΔT)", cooled, "record.t_end"),
        ("heat lost", f"{FORM}J ω_0²/2 − C ΔT", lost, "energy.heat_lost"),
    ]
    return cases_of_run("phase that ends cool", scene, rows, 1e-10)


def driller_cases():
    """A driller who slows the pulley down to a given course of the speed, from 2 rad/s
    above it."""
    M = 5e3
    J = 800.0
    R = 0.725
    w0 = 8.0
    g = 1.5
    n = 4
    f = 0.35
    end = 3.0
    times = [0.0, 2.0, 9.0]
    course = [6.0, 3.0, 3.0]

    def wanted(t):
        return float(np.interp(t, times, course))

    def speed(t, g=g):
        return wanted(t) + (w0 - 6.0) * cmath.exp(-g * t)

    def heat(g):
        # the load's work less the change of kinetic energy
        angle = 9.0 + 3.0 * (end - 2.0) + (w0 - 6.0) * (1 - cmath.exp(-g * end)) / g
        return M * angle - J / 2 * (speed(end, g) ** 2 - w0**2)

    gain = R * (lining_ratio(f, math.radians(50.0)) ** n - 1)
    pull = (M - J * (-1.5 - g * (speed(1.0).real - wanted(1.0)))) / gain
    follows = "ω = ω_r + (ω_0 − ω_r(0)) e^(−g t)"
    rows = [
        (
            "speed",
            f"{FORM}{follows}",
            speed(1.0).real,
            lambda r: r.series([1.0]).omega[0],
        ),
        ("speed at the end", f"{FORM}{follows}", speed(end).real, "record.y_end.omega"),
        (
            "slack tension",
            f"{FORM}(M − J ω̇)/(R_b (Π − 1))",
            pull,
            lambda r: r.series([1.0]).slack_tension[0],
        ),
        (
            "friction heat",
            f"{FORM}M φ − J (ω² − ω_0²)/2",
            heat(g).real,
            "energy.friction_heat",
        ),
        (
            "∂(friction heat)/∂g",
            f"{FORM}M φ − J (ω² − ω_0²)/2, differentiated",
            differentiated(heat, g),
            Slope("duty.slack_tension.gain"),
            1e-9,
        ),
    ]
    lever = Driller(PiecewiseLinear(times, course), 1e5, g)
    scene = stop_scene(
        n=n, f=f, beta=50.0, lever=lever, load=M, J=J, w0=w0, C=None, end=end
    )
    return cases_with_slopes(
        "driller", scene, rows, lambda result: result.energy["friction_heat"]
    )


_BALANCE = "first law"

# --- the elastic rope ----------------------------------------------------------------


def moving_string_cases():
    """A drum that turns under an empty hook takes a string, and brakes: two masses on a
    damped spring, by exp(A t).

    The string comes with the speed of the hook, and the rope takes its weight on
    slowly.
    """
    J = 1200.0
    per_rad = 0.05
    k = 4e6
    c = 3e5
    empty = 5e3
    string = 40e3
    T_0 = 7.5e3
    at = 1.3
    end = 2.0
    M = T_0 * GAIN

    def matrix(mass, torque):
        """Rates of ω, v, stretch beyond that under the weight, φ, s, 1."""
        A = np.zeros((6, 6))
        A[0, [0, 1, 2, 5]] = np.array(
            [-c * per_rad, c, k, mass * GRAVITY]
        ) * per_rad / J - [0, 0, 0, torque / J]
        A[1, :3] = c * per_rad / mass, -c / mass, -k / mass
        A[2, :2] = (-per_rad, 1.0)
        A[3, 0] = 1.0
        A[4, 1] = 1.0
        return A

    def moved(at):
        """States as the string is taken, and at the end; the stretch grows with the
        weight."""
        taken = expm(matrix(empty, 0.0) * at) @ np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        return taken, expm(matrix(empty + string, M) * (end - at)) @ taken

    def heat(mass, torque, y, time):
        def power(t):
            now = expm(matrix(mass, torque) * t) @ y
            return c * (now[1] - per_rad * now[0]) ** 2

        return quad(power, 0.0, time, epsabs=0.0, epsrel=1e-12, limit=200)[0]

    taken, last = moved(at)
    light = empty * GRAVITY / k
    heavy = (empty + string) * GRAVITY / k
    brought = (
        string * taken[1] ** 2 / 2
        + k * ((heavy + taken[2]) ** 2 - (light + taken[2]) ** 2) / 2
    )
    damped = heat(empty, 0.0, np.eye(6)[5], at) + heat(
        empty + string, M, taken, end - at
    )
    source = f"{FORM}exp(A t) of ω, v, e; the string brings Δm v²/2 + k (e_2² − e_1²)/2"
    rows = [
        ("speed", source, last[0], "record.y_end.omega"),
        ("stretch", source, heavy + last[2], lambda r: r.series([end]).rope_stretch[0]),
        (
            "hook load",
            f"{source}; k e + c ė",
            k * (heavy + last[2]) + c * (last[1] - per_rad * last[0]),
            _hook_load,
        ),
        (
            "kinetic energy",
            f"{source}; J ω²/2 + m v²/2",
            (J * last[0] ** 2 + (empty + string) * last[1] ** 2) / 2,
            "energy.kinetic_change",
        ),
        (
            "load work",
            f"{source}, + m_1 g s_1 + m_2 g s_2",
            brought
            + GRAVITY * (empty * taken[4] + (empty + string) * (last[4] - taken[4])),
            "energy.load_work",
        ),
        ("heat of the damper", f"{source}: ∫ c ė² dt", damped, "energy.damper_heat"),
        (
            "friction heat",
            f"{source}: M φ",
            M * (last[3] - taken[3]),
            "energy.friction_heat",
        ),
        ("energy-balance residual", _BALANCE, 0.0, "energy.closure", 1e-11),
        (
            "∂(speed)/∂(time at which it is taken)",
            f"{source}, differentiated",
            differentiated(lambda x: moved(x)[1][0], at),
            Slope("duty.slack_tension.phases.0.until.duration"),
        ),
    ]
    phases = Phases(
        (
            Phase(0.0, f"{at} s", string_on_hook=False),
            Phase(T_0, "9 s"),
        )
    )
    load = StringLoad(empty, string, 0.4, 8.0, elasticity=RopeElasticity(k, c))
    scene = stop_scene(C=None, J=J, w0=0.0, load=load, end=end)
    scene = Scene(scene.brake, Duty(phases, load), scene.initial, end)
    return cases_with_slopes(
        "string taken in motion", scene, rows, _speed_at_end, 1e-10
    )


def _speed_at_end(result):
    return result.record.y_end.omega


def _hook_load(result):
    force = result.series([float(result.record.t_end)]).hook_load
    return force[0]


def tripping_cases():
    """A string that the moving hook takes and sets down twice, a stand more the second
    time: speed, and work."""
    J = 1200.0
    per_rad = 0.05
    empty = 5e3
    string = 40e3
    pull = 4e3
    w0 = 12.0
    gain = GAIN
    # of two cycles of 2 s
    marks = (0.5, 1.5, 2.5, 3.5)
    end = 3.8

    def course(stand=4e3):
        """Speed and angle at the end, and the work of the load with what the masses
        bring."""
        omega = w0
        phi = 0.0
        work = 0.0
        m = empty
        t = 0.0
        hung = (string, 0.0, string + stand, 0.0)
        for mark, more in zip((*marks, end), (*hung, 0.0), strict=True):
            dt = mark - t
            M = m * GRAVITY * per_rad
            alpha = (M - gain * pull) / (J + m * per_rad**2)
            angle = omega * dt + alpha * dt**2 / 2
            omega = omega + alpha * dt
            phi = phi + angle
            work = work + M * angle
            t = mark
            if mark != end:
                work += (empty + more - m) * (per_rad * omega) ** 2 / 2
                m = empty + more
        return omega, phi, work

    omega, phi, work = (complex(x).real for x in course())
    load = TrippingLoad(empty, string, 4e3, marks[0], marks[1], 2.0, 0.4, 8.0, 2)
    rows = [
        ("speed", f"{FORM}ω̇ = (m_k g r/n − M_b)/J_k", omega, "record.y_end.omega"),
        (
            "travel",
            f"{FORM}Σ (ω t + α t²/2) r/n",
            per_rad * phi,
            lambda r: r.series([end]).hook_position[0],
        ),
        ("load work", f"{FORM}Σ m_k g s_k + Σ Δm v²/2", work, "energy.load_work"),
        ("friction heat", f"{FORM}M_b φ", gain * pull * phi, "energy.friction_heat"),
        ("energy-balance residual", "first law", 0.0, "energy.closure", 1e-12),
        (
            "∂(speed)/∂Δm",
            f"{FORM}the speed, differentiated",
            differentiated(lambda x: course(x)[0], 4e3),
            Slope("duty.load.stand"),
            1e-9,
        ),
    ]
    scene = stop_scene(C=None, J=J, T0=pull, w0=w0, load=load, end=end)
    return cases_with_slopes(
        "masses in motion", scene, rows, lambda result: result.record.y_end.omega
    )


CASES = (
    tripping_cases,
    cooling_cases,
    driller_cases,
    moving_string_cases,
)
