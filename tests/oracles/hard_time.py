"""Hard cases: short times, huge and tiny units, loose and tight tolerances (tested by
`test_hard_brake.py`)."""

import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from chain_scenes import changes
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
    run,
    scene,
    stop_times,
)
from oracles.hard_events import BELT, HOLD, PI, belt, belt_period, let_go

import simbrake as sb

# --- a chain that is light and stiff -------------------------------------------------


def light_and_stiff():
    """Stick and slip of one lining with a period of 10 ns in closed form; two linings
    against 1 kg on 1 N/m, scaled."""
    m = 1e-6
    stiff = 1e12
    v = BELT["v"] / math.sqrt(m * stiff)  # m/s for every newton
    given = {"f_k": BELT["f_k"], "f_s": BELT["f_s"], "m": m, "v": v}
    law = sb.ConstantFriction(BELT["f_k"], BELT["f_s"] / BELT["f_k"])
    found = let_go(sb.simulate(belt(law, m, stiff, v, 4e-8), rtol=1e-12))
    first, period = belt_period(**given, C=stiff)
    scaled = [two_linings(m, k, math.sqrt(m / k)) for m, k in ((1.0, 1.0), (m, stiff))]
    return [
        Value("first slip of one lining", found[0], first, 1e-11),
        Value("its periods", np.diff(found), np.full(found.size - 1, period), 1e-9),
        Named("events of two linings", len(scaled[1]), len(scaled[0])),
        Value(
            "their times over √(m/K), against 1 kg on 1 N/m", scaled[1], scaled[0], 1e-9
        ),
    ]


def two_linings(m, K, unit):
    """Times of all events in `unit` of a stop of two linings within 12 units."""
    linings = sb.Lining(0.3, np.full(2, BETA), mass=m)
    given = sb.Scene(
        sb.Brake(sb.Pulley(1.0, 8 * m), sb.Band(1.0, K, sb.Segments(K)), linings),
        sb.Duty(1.0, 0.0),
        sb.Initial(1.0 / math.sqrt(m * K), 1.0 / K),
        12 * unit,
    )
    return np.array([t for t, _, _ in changes(sb.simulate(given).record)]) / unit


# --- a lever thrown in within a microsecond -----------------------------------------

RAMP = [(1.0, 0.0), (1.0 + 1e-6, T0), (2.0, T0)]


def fast_lever():
    rigid = run(scene(lever=RAMP))
    elastic = run(scene(lever=RAMP, stiffness=C))
    truth = stop_times(PI)
    pulse = run(scene(lever=[(1.0, 0.0), (1.0 + 5e-7, T0), (1.0 + 1e-6, 0.0)]))
    slope = np.asarray(gradients(scene(lever=RAMP)).stop.duty.slack_tension.times)
    return [
        Value("stopping time, rigid", rigid.stopping_time, 1.0 + 5e-7 + stop_times(PI, stiffness=None).stop, 1e-12),
        Value("onset, full slip, stop, elastic",
              [elastic.slip_onset_time, elastic.full_slip_time, elastic.stopping_time],
              1.0 + np.array([truth.onset, truth.full_slip, truth.stop]), 1e-11),
        Value("∂t/∂(corners)", slope[:2], np.full(2, 0.5), 1e-8),
        Value("speed lost in a pulse of "
        "1 µs", W0 - pulse.record.y_end.omega, R * T0 * (PI - 1) / J * 5e-7, 1e-8),
    ]  # fmt: skip


# --- units and tolerances -----------------------------------------------------------


def other_units():
    """The same stop in units of mass 1e-6…1e9, length 1e-3…1e3 and time 1e-6…1e6."""
    truth = stop_times(PI)
    found = []
    heats = []
    heat = float(run(scene(stiffness=C)).energy["friction_heat"])
    for mass, length, time in itertools.product(
        (1e-6, 1.0, 1e9), (1e-3, 1.0, 1e3), (1e-6, 1.0, 1e6)
    ):
        result = run(
            scene(
                radius=R * length,
                inertia=J * mass * length**2,
                stiffness=C * mass / time**2,
                lever=T0 * mass * length / time**2,
                omega=W0 / time,
                end=5.0 * time,
            )
        )
        found.append(
            np.array(
                [result.slip_onset_time, result.full_slip_time, result.stopping_time]
            )
            / time
        )
        heats.append(
            float(result.energy["friction_heat"]) / (mass * length**2 / time**2)
        )
    rows = np.array(found)
    return [
        Value(
            "event times in 27 systems of units",
            rows,
            np.tile([truth.onset, truth.full_slip, truth.stop], (27, 1)),
            1e-9,
        ),
        Value("friction heats", heats, np.full(27, heat), 1e-9),
    ]


def tolerances():
    """Tolerances 1e-2…1e-14: a swing of the band, and a stop with drag,
    `t = (J/c) ln(1 + c ω_0/M)`."""
    rtols = 10.0 ** -np.arange(2, 15)
    truth = stop_times(PI).stop
    c = 60.0
    dragged = J / c * math.log1p(c * W0 / HOLD)
    found = [float(run(scene(stiffness=C), rtol=rtol).stopping_time) for rtol in rtols]
    slowed = [float(run(scene(drag=c), rtol=rtol).stopping_time) for rtol in rtols]
    return [
        Value("at 1e-2", [found[0], slowed[0]], [truth, dragged], 1e-2),
        Value("1e-2…1e-14, swing", found, np.full(13, truth), rtols + 1e-12),
        Value("1e-2…1e-14, drag", slowed, np.full(13, dragged), rtols + 1e-12),
        Value("at 1e-14", [found[-1], slowed[-1]], [truth, dragged], 1e-12),
    ]


# --- many events --------------------------------------------------------------------


def ten_thousand_changes():
    """3400 cycles of 1 s: the load runs for 0.4 s, is stopped in 0.4 s by a brake twice
    as strong, and held."""
    cycles = 3400
    a = 0.6
    lever = sb.Repeated([0.0, a, a, 1.0, 1.0], [T0, T0, 0.0, 0.0, T0], 1.0, cycles)
    given = scene(load=0.5 * HOLD, omega=0.0, end=float(cycles))
    whole = sb.Scene(
        given.brake, sb.Duty(lever, given.duty.load), given.initial, given.end_time
    )
    result = sb.simulate(whole)
    stops = np.array(result.events["stop"].times)
    count = sum(e.name != "lining_limit" for e in result.events)
    k = np.arange(1, cycles)

    # in every cycle M_b ω t/2 with ω = 0.4 M/J and t = 0.4 M/(M_b − M), M_b = 2 M
    heat = (cycles - 1) * HOLD * 0.5 * (0.5 * HOLD / J) * 0.4**2

    def worn(values):
        moved = eqx.tree_at(lambda s: s.duty.load.profile.values, whole, values)
        return sb.simulate(moved, max_steps=65536, max_events=20_000).energy[
            "friction_heat"
        ]

    slope = jnp.sum(jax.jit(jax.grad(worn))(jnp.full(3, 0.5 * HOLD)))
    return [
        Named("more than 10,000 changes of mode", count > 10_000, True),
        Value("stops", stops, k + 0.4, 1e-10),
        Value("friction heat", result.energy["friction_heat"], heat, 1e-10),
        # heat ∝ M²/(M_b − M)
        Value("∂(friction heat)/∂M through all of them", slope, heat * 6 / HOLD, 1e-9),
        Value("energy-balance residual", result.energy["closure"], 0.0, 1e-9, True),
    ]


CASES = [
    Case(
        "chain of mass 1e-6 kg and stiffness 1e12 N/m",
        "it swings at 1e9 rad/s, by 1e-12 m",
        light_and_stiff,
    ),
    Case(
        "lever applied within 1 µs", "a ramp shorter than a step", fast_lever, slow=True
    ),
    Case(
        "huge and tiny units",
        "an absolute tolerance would be wrong by 15 orders",
        other_units,
    ),
    Case(
        "tolerance 1e-2 and 1e-14",
        "events no worse than the tolerance; steps near rounding",
        tolerances,
    ),
    Case(
        "10,000 changes of mode of a brake",
        "errors of every stop add up in the next",
        ten_thousand_changes,
        slow=True,
    ),
]
