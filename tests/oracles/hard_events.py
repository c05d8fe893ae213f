"""Hard cases: events, their order, rest and restart (tested by
`test_hard_brake.py`)."""

import math

import numpy as np
from chain_scenes import changes
from helpers import changes_of
from oracles.hard_cases import (
    BETA,
    T0,
    W0,
    C,
    Case,
    J,
    Named,
    R,
    Value,
    gradients,
    ratio_of,
    run,
    scene,
    stop_times,
)
from scenes import lining_ratio
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import simbrake as sb

PI = ratio_of(0.3, BETA)
HOLD = R * T0 * (PI - 1)  # greatest load that the scene holds (N·m)


def load_beside_the_stop():
    """A load beyond the brake comes 1e-12 s before the stop, at it, and 1e-12 s after
    it."""
    stop = stop_times(PI, stiffness=None).stop
    found = []
    truth = []
    after = None
    for shift in (-1e-12, 0.0, 1e-12):
        at = stop + shift
        result = run(scene(load=[(-1.0, 0.0), (at, 0.0), (at, 2 * HOLD)]))
        found.append(float(result.record.y_end.omega))
        truth.append(HOLD * (5.0 - at) / J)
        after = result
    assert after is not None
    return [
        Value(
            "speeds at the end, load at the stop −1e-12, 0, 1e-12 s",
            found,
            truth,
            1e-10,
        ),
        Named(
            "1e-12 s after it",
            changes_of(after),
            ["slip_onset", "full_slip", "stop", "restart", "full_slip"],
        ),
    ]


def corner_at_an_event():
    """The lever begins to give way at 1000 N/s at the onset, at full slip, at the stop,
    or a rounding beside it."""
    times = stop_times(PI)
    rate = 1e3

    def with_corner(at):
        return run(
            scene(stiffness=C, lever=[(-1.0, T0), (at, T0), (at + 1.0, T0 - rate)])
        )

    shifts = (0.0, 1e-15, -1e-15, 1e-12, -1e-12)
    left = (times.stop - times.full_slip) * T0  # ∫T_0 dt from full slip to the stop
    late = times.full_slip + (T0 - math.sqrt(T0**2 - 2 * rate * left)) / rate
    stops = [
        float(with_corner(times.full_slip + shift).stopping_time) for shift in shifts
    ]

    # elastic under a falling lever: C x = T_0 − r s + C A sin χ s, A χ = R ω_0 + r/C
    chi = R * math.sqrt(C / J)
    swing = (R * W0 + rate / C) / chi
    s = brentq(
        lambda s: T0 - rate * s + C * swing * math.sin(chi * s) - (T0 - rate * s) * PI,
        0.0,
        0.1,
        xtol=1e-16,
    )
    slips = [float(with_corner(times.onset + shift).full_slip_time) for shift in shifts]
    ends = [with_corner(times.stop + shift) for shift in shifts]
    slope = gradients(
        scene(
            stiffness=C,
            lever=[
                (-1.0, T0),
                (times.full_slip, T0),
                (times.full_slip + 1.0, T0 - rate),
            ],
        )
    )
    # a corner that moves on adds r (t − t_c) to the lever's impulse: ∂t/∂t_c = −r (t −
    # t_c)/T_0(t); both points move
    moved = np.sum(np.asarray(slope.stop.duty.slack_tension.times)[1:])
    exact = -rate * (late - times.full_slip) / (T0 - rate * (late - times.full_slip))
    return [
        Value(
            "stopping times, corner at full slip ± 0, 1e-15, 1e-12 s",
            stops,
            np.full(5, late),
            1e-11,
        ),
        Value(
            "full slip, corner at the onset", slips, np.full(5, times.onset + s), 1e-10
        ),
        Value(
            "stopping times, corner at the stop",
            [e.stopping_time for e in ends],
            np.full(5, times.stop),
            1e-11,
        ),
        Value("∂t/∂(time of the corner)", moved, exact, 1e-8),
        Named("", sorted({e.status for e in ends}), ["stopped"]),
    ]


# --- one lining of a chain on its spring, dragged by a pulley too heavy to be slowed: stick and slip for ever ---------

BELT = {"m": 1.0, "C": 1.0, "f_k": 0.3, "f_s": 0.39, "v": 0.05}


def belt(
    law,
    m=BELT["m"],
    stiffness=BELT["C"],
    v=BELT["v"],
    end=40.0,
):
    """`m ë = f z (C e + T_0) + T_0 − C e` while it slips, `ė = v` while it sticks;
    `T_0` = 1 N, `R_b` = 1 m."""
    return sb.Scene(
        sb.Brake(
            sb.Pulley(1.0, 1e15),
            sb.Band(1.0, stiffness, sb.Segments(1.0)),
            sb.Lining(law, np.full(1, BETA), mass=m),
        ),
        sb.Duty(1.0, 0.0),
        sb.Initial(v, 1.0 / stiffness),
        end,
    )


def belt_period(m, C, f_k, f_s, v, xp=math):
    """First slip from `e = T_0/C`, and the period: `2Δ/v + (2/ω)(π − atan(Δ ω/v))`.

    `e_s,k = T_0 μ_s,k/C`, `Δ = e_s − e_k`, `ω² = C (1 − f_k z)/m`: the belt oscillator
    with a load that follows `e`.
    """
    z = math.tan(BETA / 2)
    mu = [lining_ratio(f, BETA) for f in (f_s, f_k)]
    delta = (mu[0] - mu[1]) / C
    omega = xp.sqrt(C * (1 - f_k * z) / m)
    atan = xp.atan if xp is math else xp.arctan
    return (mu[0] - 1) / C / v, 2 * delta / v + 2 / omega * (
        math.pi - atan(delta * omega / v)
    )


def scipy_belt(law, end):
    """Times at which the lining lets go, mode by mode with DOP853."""
    z = math.tan(BETA / 2)
    v = BELT["v"]

    def slips(t, y):
        return [y[1], law(v - y[1]) * z * (y[0] + 1) + 1 - y[0]]

    def sticks(t, y):
        return v - y[1]

    sticks.terminal = True
    sticks.direction = -1
    limit = lining_ratio(law(0.0), BETA)
    t = 0.0
    e = 1.0
    found = []
    while True:
        t += (limit - e) / v
        if t >= end:
            return np.array(found)
        found.append(t)
        out = solve_ivp(
            slips,
            (t, t + 100.0),
            [limit, v],
            "DOP853",
            events=sticks,
            rtol=3e-14,
            atol=1e-15,
        )
        t = out.t[-1]
        e = out.y[0, -1]


def let_go(result):
    return np.array(
        [
            t
            for t, before, after in changes(result.record)
            if before.own.linings[0] == 0 != after.own.linings[0]
        ]
    )


def limit_cycle():
    result = sb.simulate(
        belt(sb.ConstantFriction(BELT["f_k"], BELT["f_s"] / BELT["f_k"])), rtol=1e-12
    )
    found = let_go(result)
    first, period = belt_period(**BELT)
    return [
        Value("first slip", found[0], first, 1e-11),
        Value("periods", np.diff(found), np.full(found.size - 1, period), 1e-10),
    ]


STRIBECK = (0.39, 0.2, 0.1, 1.5)


def stribeck(v):
    f_s, f_k, v_s, exponent = STRIBECK
    return f_k + (f_s - f_k) * math.exp(-((max(v, 0.0) / v_s) ** exponent))


def stribeck_cycle():
    result = sb.simulate(belt(sb.StribeckFriction(*STRIBECK), end=60.0), rtol=1e-12)
    found = let_go(result)
    assert found.size >= 3
    return [Value("times of slip", found, scipy_belt(stribeck, 60.0), 1e-9)]


CASES = [
    Case(
        "a load comes 1e-12 s beside the stop",
        "a time breakpoint next to an event",
        load_beside_the_stop,
    ),
    Case(
        "corner of the lever at an event",
        "the rate of the guard is another on each side",
        corner_at_an_event,
        slow=True,
    ),
    Case(
        "limit cycle: stick and slip of a lining",
        "the slip speed passes zero in every cycle",
        limit_cycle,
    ),
    Case(
        "limit cycle with Stribeck friction",
        "friction that falls with speed feeds the swing",
        stribeck_cycle,
        slow=True,
    ),
]
