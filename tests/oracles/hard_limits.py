"""Hard cases: limits of friction and geometry (tested by `test_hard_brake.py`)."""

import math

import numpy as np
from helpers import changes_of, input_error
from oracles.hard_cases import (
    BETA,
    T0,
    W0,
    C,
    Case,
    J,
    N,
    Named,
    R,
    Value,
    gradients,
    ratio_of,
    run,
    scene,
    stop_times,
)

#: distances of f·tan(β/2) from 1
NEAR = 10.0 ** -np.arange(1, 13)


def near_locking_rigid():
    """One lining of 90° with `f = 1 − ε`, the others without friction:
    `Π = (2 − ε)/ε`."""
    beta = [math.pi / 2, 0.2, 0.2, 0.2]
    found = []
    truth = []
    for e in NEAR:
        truth.append(stop_times((2 - e) / e, stiffness=None).stop)
        result = run(scene([1 - e, 0.0, 0.0, 0.0], beta, end=2 * truth[-1]))
        found.append(float(result.stopping_time))
    e = 1e-3
    at = scene(
        [1 - e, 0.0, 0.0, 0.0],
        beta,
        end=2 * stop_times((2 - e) / e, stiffness=None).stop,
    )
    slope = gradients(at).stop.brake.linings.friction.coefficient[0]
    return [
        Value("stopping times, ε = 1e-1…1e-4", found[:4], truth[:4], 2e-12),
        # ε itself is known to a rounding of 1
        Value("ε = 1e-5…1e-12", found[4:], truth[4:], 5e-16 / NEAR[4:]),
        # t = (J ω_0/(R T_0)) (1 − f z)/(2 f z)
        Value(
            "∂t/∂f at ε = 1e-3", slope, -J * W0 / (R * T0) / (2 * (1 - e) ** 2), 1e-9
        ),
    ]


def near_locking_elastic():
    """The same on an elastic band: it slips fully while `T_0 Π` can be reached, and is
    stopped as if bonded beyond."""
    found = []
    full = []
    truth = []
    for e in NEAR:
        truth.append(stop_times((2 - e) / e))
        result = run(
            scene([1 - e, 0.0, 0.0, 0.0], [math.pi / 2, 0.2, 0.2, 0.2], C, end=1.0)
        )
        found.append(float(result.stopping_time))
        full.append(float(result.full_slip_time))
    slipped = np.isfinite([t.full_slip for t in truth])
    return [
        Value("stopping times, ε = 1e-1…1e-12", found, [t.stop for t in truth], 1e-10),
        Named(
            "full slip at",
            list(NEAR[np.isfinite(full)].astype(str)),
            list(NEAR[slipped].astype(str)),
        ),
    ]


def no_friction():
    tiny = [0.0, 1e-300, 1e-16, 1e-8]
    results = [run(scene(f, end=2.0)) for f in tiny]
    z = math.tan(BETA / 2)
    lost = [R * T0 * math.expm1(2 * N * math.atanh(f * z)) * 2.0 / J for f in tiny]
    slope = gradients(scene(0.0, end=2.0)).omega.brake.linings.friction.coefficient
    elastic = run(scene(0.0, stiffness=C, end=2.0))
    return [
        Value(
            "speed after 2 s, f = 0, 1e-300, 1e-16, 1e-8",
            [r.record.y_end.omega for r in results],
            W0 - np.array(lost),
            1e-14,
        ),
        Value("∂ω/∂f at f = 0", slope, np.full(N, -R * T0 * 2 * z * 2.0 / J), 1e-12),
        Named("", results[0].status, "not_stopped"),
        Value(
            "full slip at the onset, elastic band",
            elastic.full_slip_time,
            T0 / (C * R * W0),
            1e-11,
        ),
        Value("speed after it", elastic.record.y_end.omega, W0, 1e-15),
    ]


def full_turn():
    found = []
    truth = []
    for share in (1.0, 1 - 1e-15, 1 - 1e-9):
        beta = np.full(N, math.pi / 2 * share)
        found.append(float(run(scene(0.2, beta, C)).stopping_time))
        truth.append(stop_times(ratio_of(0.2, beta)).stop)
    half = [math.pi * (1 - 1e-9), 1.0, 1.0, 1.0]  # tan(β/2) = 6e8
    friction = [1e-10, 0.2, 0.2, 0.2]
    with input_error(match=r"brake\.linings\.angle: the linings span 360\.0°") as more:
        run(scene(0.2, math.pi / 2 * (1 + 1e-9)))
    slope = gradients(scene(0.2, math.pi / 2)).stop.brake.linings.angle
    Pi = ratio_of(0.2, math.pi / 2)
    z = 1.0
    # dμ/μ = 2 f dz/(1 − f² z²), dz = (1 + z²)/2 dβ
    exact = (
        -stop_times(Pi, stiffness=None).stop
        * Pi
        / (Pi - 1)
        * 2
        * 0.2
        / (1 - (0.2 * z) ** 2)
        * (1 + z**2)
        / 2
    )
    return [
        Value("stopping times at 2π (1 − 0, 1e-15, 1e-9)", found, truth, 1e-11),
        Value("a lining of 180° (1 − 1e-9)", run(scene(friction, half)).stopping_time,
              stop_times(ratio_of(friction, half), stiffness=None).stop, 1e-7),
        Value("∂t/∂β at 2π", slope, np.full(N, exact), 1e-9),
        Named("at 2π (1 + 1e-9)", type(more.value).__name__, "InputError"),
    ]  # fmt: skip


#: speeds around the one at which the band reaches full slip just as the pulley stops
GRAZING = np.array([0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6])


def grazing():
    """`x_max = T_0 Π/C` exactly at the stop: `ω_0 = χ T_0 (Π − 1)/(C R)`; faster it
    slides."""
    Pi = ratio_of(0.3, BETA)
    exact = R * math.sqrt(C / J) * T0 * (Pi - 1) / (C * R)
    results = [run(scene(stiffness=C, omega=exact * (1 + e))) for e in GRAZING]
    truth = [stop_times(Pi, omega=exact * (1 + e)) for e in GRAZING]
    slope = gradients(scene(stiffness=C, omega=exact)).stop.initial.omega
    slides = [
        f"{e:g}"
        for e, r in zip(GRAZING, results, strict=True)
        if abs(e) > 1e-10 and "full_slip" in changes_of(r)
    ]
    return [
        Value(
            "stopping times, ω_0 off by 0…±1e-6",
            [r.stopping_time for r in results],
            [t.stop for t in truth],
            1e-9,
        ),
        # slower it does not slide: ∂t/∂ω_0 = −t_0/ω_0; beside the touch derivatives
        # differ by the root of the distance
        Value("∂t/∂ω_0 at the touch", slope, -T0 / (C * R * exact**2), 1e-4),
        Named("status", sorted({r.status for r in results}), ["stopped"]),
        Named("of ±1e-9, ±1e-6 it slides at", slides, ["1e-09", "1e-06"]),
        Value(
            "energy-balance residual",
            [r.energy["closure"] for r in results],
            np.zeros(9),
            1e-10,
            True,
        ),
    ]


def all_at_once():
    """The lever falls to a tenth in no time while no lining is at its limit: all pass
    theirs at that instant."""
    lever = [(-1.0, T0), (0.02, T0), (0.02, 0.1 * T0)]
    # as the band is still elastic then, and stretched to far more than the new limits
    result = run(
        scene(
            0.3,
            stiffness=3e4,
            lever=lever,
            omega=2.0,
            elongation=T0 / 3e4,
            inertia=1000.0,
        )
    )
    events = result.events
    limits = [e for e in events if e.name == "lining_limit"]
    Pi = ratio_of(0.3, BETA)
    x = float(result.series([0.02], left=True).elongation[0])
    spent = (x - 0.1 * T0 * Pi / 3e4) * (0.5 * (3e4 * x + 0.1 * T0 * Pi) - 0.1 * T0)
    after, before = (
        float(result.series([0.02], left=left).friction_heat[0])
        for left in (False, True)
    )
    return [
        Value(
            "limits of linings 1…4",
            [e.time for e in limits[-N:]],
            np.full(N, 0.02),
            0.0,
        ),
        Value("full slip", result.full_slip_time, 0.02, 0.0),
        Value("heat of the jump in tension", after - before, spent, 1e-10),
        Value("energy-balance residual", result.energy["closure"], 0.0, 1e-12, True),
    ]


CASES = [
    Case(
        "f·tan(β/2) → 1 on a rigid band",
        "the tension ratio goes to infinity, its digits to none",
        near_locking_rigid,
        slow=True,
    ),
    Case(
        "f·tan(β/2) → 1 on an elastic band",
        "the limit leaves the tensions that the spring can reach",
        near_locking_elastic,
    ),
    Case("f → 0", "full slip without any torque; Π − 1 cancels", no_friction),
    Case("wrap → 2π", "the whole pulley is covered; more is rejected", full_turn),
    Case(
        "full slip exactly at the stop",
        "two guards touch zero together, one of them grazing",
        grazing,
        slow=True,
    ),
    Case(
        "all linings at their limit at once", "the lever falls in no time", all_at_once
    ),
]
