"""Validation of mechanisms: pressed and locking stages, chains that stick and part,
wear laws."""

import math

import numpy as np
from case_tools import (
    FORM,
    Slope,
    cases_with_slopes,
    differentiated,
    rows_of,
)
from oracles import mechanisms
from scenes import lining_ratio, staged_pair, time_of
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from simbrake import (
    Band,
    Bandage,
    Brake,
    ConstantFriction,
    Duty,
    Heat,
    Initial,
    Lining,
    PiecewiseLinear,
    Pulley,
    Scene,
    Segments,
    TorqueLoad,
    with_values,
)
from simbrake.friction import PressureFactor, ProductFriction
from simbrake.thermal import (
    Convection,
    FrictionHeat,
    Lump,
    Reservoir,
    SpeedCoefficient,
)


def pressed_stage_cases():
    """All stages of a staged brake of one lining whose inner friction falls with the
    pressure, and the pull that holds.

    Stage 2 is uniformly decelerated on both sides of the inner face; in stage 3 the
    band only just holds the bandage: `R_b (T_1 − T_0) = R f(p) N`,
    `N = (T_1 + T_0) sin β/2 + N_pre`, `p = N/A`.
    """
    T_0 = 6e3
    J = 900.0
    J_b = 45.0
    R = 0.59
    R_b = 0.64
    half = math.radians(55.0)
    w0 = 20.0
    pre = 2e3
    area = 0.02
    f = 0.12
    reference = 6e5
    exponent = 0.35
    ratio = lining_ratio(0.4, 2 * half)

    def load(T_1):
        return (T_1 + T_0) * math.sin(half) + pre

    def friction(T_1, exponent=exponent):
        return f * (1 + load(T_1) / area / reference) ** -exponent

    def torque(T_1, exponent=exponent):
        return R * friction(T_1, exponent) * load(T_1)

    def stages(exponent=exponent):
        """Times of the lock and of the stop, and the tension that holds the bandage."""
        inner = torque(ratio * T_0, exponent)
        lock = J_b * w0 / (R_b * T_0 * (ratio - 1) - inner)
        holds = brentq(
            lambda T: R_b * (T - T_0) - torque(T, exponent),
            T_0,
            ratio * T_0,
            xtol=1e-10,
        )
        return lock, lock + (J * w0 - inner * lock) / torque(holds, exponent), holds

    (lock, stop, holds) = stages()
    h = 1e-3
    slope = sum(
        c * (stages(exponent + k * h)[1] - stages(exponent - k * h)[1])
        for k, c in ((1, 45), (2, -9), (3, 1))
    )
    source = f"{FORM}R_b (T_1 − T_0) = R f(p) N in stage 3"

    def at_one_second(name):
        return lambda result: getattr(result.series([1.0]).pairs["internal"], name)[
            0, 0
        ]

    rows = [
        (
            "external lock",
            f"{FORM}J_b ω_0/(R_b T_0 (μ − 1) − R f(p) N)",
            lock,
            "external_lock_time",
        ),
        ("stopping time", source, stop, "stopping_time"),
        (
            "tension in stage 3",
            source,
            holds,
            lambda result: result.series([1.0]).tension[0, 0],
        ),
        ("load in stage 3", f"{source}; N", load(holds), at_one_second("normal_load")),
        (
            "friction in stage 3",
            f"{source}; f(p)",
            friction(holds),
            at_one_second("friction_coefficient"),
        ),
        (
            "∂(stopping time)/∂m",
            f"{source}, differences",
            slope / (60 * h),
            Slope("brake.bandage.friction.factors.0.exponent"),
            1e-9,
        ),
    ]
    law = ProductFriction(f, (PressureFactor(reference, exponent),))
    linings = Lining(0.4, np.array([2 * half]), 0.03)
    bandage = Bandage(J_b, law, pre, area)
    brake = Brake(Pulley(R, J), Band(R_b), linings, bandage)
    scene = Scene(brake, Duty(T_0, 0.0), Initial(w0), 40.0)
    return cases_with_slopes(
        "staged, friction under pressure", scene, rows, tolerance=1e-10
    )


# --- chains -------------------------------------------------------------------------


def parting_cases():
    """A lining that a growing torque takes along on its spring, until it breaks away;
    either way."""
    return [*_parting(1), *_parting(-1)]


def _parting(sense):
    J = 40.0
    R_b = 0.9
    m = 5.0
    C = 2e4
    D = 60.0
    T_0 = 1e3
    f = 0.3
    growth = sense * 2e3
    end = 0.5
    z = math.tan(math.radians(30.0))
    # of t, elongation beyond T_0/C, its rate, speed of the pulley, 1: sticking; sliding
    stuck, along = np.zeros((2, 5, 5))
    stuck[0, 4] = stuck[1, 2] = along[0, 4] = along[1, 2] = 1.0
    spring = np.array([0.0, C, D, 0.0, 0.0])  # T − T_0
    stuck[2] = (np.array([growth / R_b, 0.0, 0.0, 0.0, 0.0]) - spring) / (
        J / R_b**2 + m
    )
    stuck[3] = stuck[2] / R_b

    def force(f):
        """Of friction on a lining that slides: `± f (T + T_0) tan(β/2)`."""
        return sense * f * z * (spring + np.array([0.0, 0.0, 0.0, 0.0, 2 * T_0]))

    def moved(t, taken, f):
        slid = along + 0j * f
        slid[2] = (force(f) - spring) / m
        slid[3] = (np.array([growth, 0.0, 0.0, 0.0, 0.0]) - R_b * force(f)) / J
        return expm(slid * (t - taken)) @ stuck_at(taken)

    def stuck_at(t):
        return expm(stuck * t) @ np.array([0.0, 0.0, 0.0, 0.0, 1.0])

    def excess(t, f):
        """Of the force that holds the lining over what friction can."""
        return sense * (m * stuck[2] + spring - force(f)) @ stuck_at(t)

    taken = brentq(lambda t: excess(t, f), 0.0, end, xtol=1e-16)
    slope = sense * (m * stuck[2] + spring - force(f)) @ stuck @ stuck_at(taken)

    def last(f):
        return moved(end, taken - excess(taken, f) / slope, f)

    def power(t):
        y = moved(t, taken, f).real
        return force(f) @ y * (R_b * y[3] - y[2])

    e, v, w = last(f).real[1:4]
    at_rest = T_0 / C
    source = (
        f"{FORM}matrix exponential of the linear rates, root of |G| = f_s N/cos(β/2)"
    )
    heat = quad(power, taken, end, epsabs=0.0, epsrel=1e-13)[0]
    rows = [
        ("breaks away", source, taken, time_of("restart")),
        ("speed", source, w, "record.y_end.omega"),
        ("speed of the lining", source, v, "record.y_end.own.v.0", 1e-9),
        ("elongation beyond x_0", source, e, lambda r: r.series([end]).elongation[0]),
        (
            "friction heat",
            f"{source}; quadrature of G (R_b ω − v)",
            heat,
            "energy.friction_heat",
        ),
        (
            "elastic energy",
            f"{source}: C (x² − x_0²)/2",
            C * e * (e + 2 * at_rest) / 2,
            "energy.elastic_change",
        ),
        ("energy-balance residual", "first law", 0.0, "energy.closure", 1e-11),
        (
            "∂(speed)/∂f",
            f"{source}, differentiated",
            differentiated(lambda f: last(f)[3], f),
            Slope("brake.linings.friction.coefficient"),
            1e-9,
        ),
    ]
    lining = Lining(f, np.full(1, math.radians(60.0)), mass=m)
    brake = Brake(Pulley(R_b, J), Band(R_b, C, Segments(1e3, D, D)), lining)
    load = TorqueLoad(PiecewiseLinear([0.0, 1.0], [0.0, growth]))
    scene = Scene(brake, Duty(T_0, load), Initial(0.0, at_rest), end)
    subject = f"a lining that breaks away {'ahead' if sense > 0 else 'back'}"
    return cases_with_slopes(
        subject, scene, rows, lambda r: r.record.y_end.omega, program="parting lining"
    )


def staged_heat_cases():
    """Heat of both pairs of a staged brake into rim, linings and band; linings on a
    ring that turns are cooled.

    The stop is that of the subject "staged pair": torque `c t` of the band, capacity
    `M_i` of the internal pair.
    """
    J_1 = 40.0
    J_2 = 4.0
    w0 = 20.0
    M = 600.0
    c = 500.0
    end = 3.0
    cold = 300.0
    C = (50.0, 20.0, 10.0)
    start = 400.0
    area = 0.2
    h_0 = 2.0
    v_0 = 3.0
    share = 0.8
    band = 0.6
    beyond = 0.4
    t_0 = M * (J_1 + J_2) / (c * J_1)
    first = np.polynomial.Polynomial([w0, 0.0, -c / (2 * (J_1 + J_2))])
    both = np.polynomial.Polynomial([first(t_0), (M - c * t_0) / J_2, -c / (2 * J_2)])
    lock = t_0 + float(np.max(both.roots()))
    # ω of the rim less ω of the ring after t_0, until the lock; then that of the rim
    # alone
    apart = np.polynomial.Polynomial([first(t_0), -M / J_1]) - both
    after = first(t_0) - M * (lock - t_0) / J_1
    internal = M * apart.integ()(lock - t_0) + J_1 * after**2 / 2
    external = (J_1 + J_2) * w0**2 / 2 - internal
    turned = (first**2).integ()(t_0) + (both**2).integ()(lock - t_0)

    def cooled(area):
        return cold + (start - cold) * np.exp(
            -h_0 * area * (end + turned / v_0**2) / C[1]
        )

    places = ("rim", "linings", "band")
    lumps = tuple(
        Lump(name, C[i], start if name == "linings" else cold)
        for i, name in enumerate(places)
    )
    air = Convection("linings", area, SpeedCoefficient(h_0, v_0, 2.0))
    rubs = FrictionHeat("rim", None, share, "rim")
    outer = FrictionHeat("band", None, band, "linings", "rim", beyond)
    heat = Heat(
        (*lumps, Reservoir("air", cold)),
        (air,),
        rubs,
        (),
        None,
        *places,
        external=outer,
    )
    scene = staged_pair(M, J_1, J_2, w0, ([0.0, 10.0], [0.0, 10.0 * c]), end)
    scene = Scene(scene.brake, scene.duty, scene.initial, end, heat)
    work = f"{FORM}work of the pairs, over C"
    lost = f"{FORM}e^(−∫ h_0 A (1 + (R_b ω_b/v_0)²) dt/C)"
    rows = [
        (
            "rim",
            work,
            cold + (share * internal + beyond * external) / C[0],
            "end_temperatures.0",
        ),
        ("linings", lost, cooled(area).real, "end_temperatures.1"),
        ("band", work, cold + band * external / C[2], "end_temperatures.2"),
        (
            "∂(linings)/∂A",
            f"{lost}, differentiated",
            differentiated(cooled, area),
            Slope("heat.links.0.area"),
            1e-9,
        ),
        (
            "heat to the rim",
            work,
            share * internal + beyond * external,
            "energy.heat_to_metal",
        ),
        ("heat to the band", work, band * external, "energy.heat_to_band"),
        (
            "heat lost",
            f"{work}, + C ΔT of the linings",
            (1 - share) * internal + C[1] * (start - cooled(area).real),
            "energy.heat_lost",
        ),
    ]
    return cases_with_slopes(
        "heat of a staged brake", scene, rows, lambda result: result.end_temperatures[1]
    )


def spring_cases():
    """Two linings with a spring between: events of their stop, derivatives, energies of
    its first instants."""
    J = 200.0
    own = (1.2, 1.5)
    w0 = 20.0
    R_b = 0.64
    early = 0.015
    friction = ConstantFriction(0.2)
    wrap = np.full(2, math.radians(50.0))
    bandage = Bandage(
        list(own),
        friction,
        [1500.0, 900.0],
        spring=np.array([2e3]),
        spring_damping=0.05,
    )
    brake = Brake(Pulley(0.59, J), Band(R_b), Lining(0.4, wrap), bandage)
    stop = Scene(
        brake,
        Duty(PiecewiseLinear([0.0, 0.3], [100.0, 6e3]), 0.0),
        Initial(w0),
        8.0,
    )
    whole = J + sum(own)
    mu = lining_ratio(0.4, math.radians(50.0))
    # while all linings ride on the rim, under T_0 = 100 + 5900 t/0.3
    speed = (
        w0 - R_b * (mu**2 - 1) * (100.0 * early + 5900.0 / 0.3 * early**2 / 2) / whole
    )
    source = f"{FORM}(J + Σ J_i) ω̇ = −R_b T_0(t) (μ² − 1)"
    rows = [
        (
            "kinetic energy",
            f"{FORM}−(J + Σ J_i) ω_0²/2",
            -whole * w0**2 / 2,
            "energy.kinetic_change",
        ),
        ("energy-balance residual", "first law", 0.0, "energy.closure", 1e-11),
    ]
    riding = [
        (
            "kinetic energy of the ride",
            source,
            whole * (speed**2 - w0**2) / 2,
            "energy.kinetic_change",
        ),
        (
            "friction of lining 2 on the band",
            f"{FORM}(T_2 − T_1) cos β/2, T_i = μ^i T_0(t)",
            (100.0 + 5900.0 / 0.3 * early)
            * mu
            * (mu - 1)
            * math.cos(math.radians(25.0)),
            lambda result: result.series([early]).friction_force[0, 1],
        ),
    ]
    events = {
        "lining 1 slips": time_of("lining_internal_slip", 1),
        "lining 2 slips": time_of("lining_internal_slip", 2),
        "lining 1 rests on the band": time_of("lining_external_stick", 1),
        "lining 2 rests on the band": time_of("lining_external_stick", 2),
        "stopping time": "stopping_time",
        "elongation at rest": "record.y_end.own.stretch.0",
    }
    slopes = {
        "∂(stopping time)/∂K": Slope("brake.bandage.spring.0"),
        "∂(stopping time)/∂N_pre": Slope("brake.bandage.preload.1"),
    }
    rows += rows_of(mechanisms.linings_on_springs, events) + rows_of(
        mechanisms.slopes_of_springs, slopes
    )
    begin = with_values(stop, {"end_time": early})
    return [
        *cases_with_slopes("a stop on springs", stop, rows, program="springs"),
        *cases_with_slopes("a stop on springs", begin, riding, program="springs"),
    ]


CASES = (
    staged_heat_cases,
    spring_cases,
    parting_cases,
    pressed_stage_cases,
)
