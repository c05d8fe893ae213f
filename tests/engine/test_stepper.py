"""Steps that the caller sets: equal to one run of the same commands, closed forms,
states kept and taken up again."""

from itertools import pairwise

import numpy as np
import pytest
from helpers import all_equal, all_near, input_error, nothing_compiled
from scenes import drawworks_brake, lining_ratio
from scipy.integrate import solve_ivp

import simbrake as sb

ELASTIC = drawworks_brake(20, C=4e5)
COMMANDS = [
    (5e3, 5e3),
    (12e3, 5e3),
    (24e3, 4e3),
    (24e3, 6e3),
    (1e3, 6e3),
    (0.0, 6e3),
    (20e3, 6e3),
    (20e3, 3e3),
]


def rigid(lever=24e3, load=5e3, **options):
    duty = sb.Duty(lever, sb.TorqueLoad(load))
    return sb.Scene(drawworks_brake(12), duty, sb.Initial(24.0), "5 s", **options)


def elastic(lever=24e3):
    return sb.Scene(ELASTIC, sb.Duty(lever, 5e3), sb.Initial(24.0), "5 s")


@pytest.mark.slow
def test_commands_are_jumps_of_a_profile():
    stepper = sb.Stepper(elastic(), inputs=["lever", "load"])
    events = [
        event
        for F, M in COMMANDS
        for event in stepper.advance(0.31, lever=F, load=M).events
    ]
    whole = sb.simulate(stepper.history())
    names = [event for event in whole.events if event.name != "lining_limit"]
    assert [event.name for event in events] == [event.name for event in names]
    assert {"slip_onset", "restick", "stop", "restart", "release"} <= {
        event.name for event in events
    }
    all_near([event.time for event in events], [event.time for event in names], 1e-9)
    end = whole.record.y_end
    kept = stepper.series()
    all_near(kept.phi[0], end.phi, 1e-9)
    all_near(kept.elongation[0], end.own.x, 1e-9)
    for name in ("load_work", "lever_work", "friction_heat"):
        all_near(
            getattr(kept, name)[0],
            getattr(whole.series([whole.record.t_end]), name)[0],
            1e-9,
        )


def test_held_inputs_match_closed_form():
    """J dω/dt = M − T_0 (Π − 1) R: uniformly decelerated between two commands, at rest
    until the load outweighs it."""
    stepper = sb.Stepper(rigid(), inputs=["lever", "load"])
    ratio = lining_ratio(0.35, 1.5 * np.pi / 12) ** 12
    arm = 0.623 * (ratio - 1)
    inertia = 1200.0
    omega = 24.0
    for F, M in ((3e3, 2e3), (6e3, 8e3), (0.0, 3e3)):
        stepper.advance("0.4 s", lever=F, load=M)
        omega += (M - F * arm) / inertia * 0.4
        all_near(stepper.omega, omega, 1e-12)
    stop = stepper.advance(2.0, lever="9 kN", load=0.0).events[-1]
    assert np.isnan(stepper["holding_reserve"])  # (it holds no load)
    all_near(stop.time, 1.2 + omega * inertia / (9e3 * arm), 1e-12)
    assert (stop.name, stepper.omega) == ("stop", 0.0)
    assert repr(stepper).endswith("0 rad/s, held; inputs: lever 9 kN, load 0 N·m)")
    assert stepper.advance(10.0, load=0.999 * 9e3 * arm).events == []
    assert stepper.omega == 0.0
    begun = stepper.advance(0.5, load=1.2 * 9e3 * arm)
    assert [(event.name, event.time) for event in begun.events] == [
        ("restart", 13.2),
        ("full_slip", 13.2),
    ]
    all_near(stepper.omega, 0.2 * 9e3 * arm / inertia * 0.5, 1e-9)


@pytest.mark.slow
def test_an_actuator_follows_its_commands():
    """More commands than fit wait in the dead time, and a lag still feels those that
    are long over (against SciPy)."""
    late = 0.13
    slow = 0.06
    stepper = sb.Stepper(
        rigid(sb.loads.Actuator(24e3, lag=slow, dead_time=late)), inputs=["lever"]
    )
    rng = np.random.default_rng(5)
    given = [(0.05 * k, force) for k, force in enumerate(rng.uniform(1e3, 9e3, 24))]
    found = []
    for _, force in given:
        stepper.advance(0.05, lever=force)
        found.append(stepper["slack_tension"])

    def command(t):
        return [24e3, *(force for begun, force in given if begun <= t + 1e-12)][-1]

    wanted = []
    tension = 24e3
    for k in range(24):
        knots = sorted(
            {0.05 * k, *(0.05 * j + late for j in range(24)), 0.05 * (k + 1)}
        )
        for a, b in pairwise(knots):
            if a < 0.05 * k - 1e-12 or b > 0.05 * (k + 1) + 1e-12 or b - a < 1e-12:
                continue
            u = command(0.5 * (a + b) - late)
            run = solve_ivp(
                lambda t, F, u=u: (u - F) / slow,
                (a, b),
                [tension],
                rtol=1e-12,
                atol=1e-6,
            )
            tension = run.y[0, -1]
        wanted.append(tension)
    all_near(found, wanted, 1e-9)
    whole = sb.simulate(stepper.history())
    all_near(stepper["phi"], whole.record.y_end.phi, 1e-9)


@pytest.mark.slow
def test_a_state_goes_on_to_the_last_bit(tmp_path):
    scene = rigid(sb.loads.Actuator(24e3, lag="60 ms", dead_time="130 ms"))
    stepper = sb.Stepper(scene, inputs=["lever"])
    for force in (3e3, 8e3, 5e3, 7e3):
        stepper.advance(0.04, lever=force)
    np.savez(tmp_path / "state.npz", **stepper.state())

    def further(one):
        return [
            (one.advance(0.03, lever=force).events, one.omega)
            for force in (2e3, 9e3, 20e3, 20e3, 24e3)
        ]

    first = further(stepper)
    with np.load(tmp_path / "state.npz") as kept:
        again = sb.Stepper(scene, inputs=["lever"], state=kept)
    assert (again.time, again.inputs) == (0.16, {"lever": 7e3})
    assert further(again) == first
    all_equal(again.state()["y"], stepper.state()["y"])
    other = sb.Stepper(
        rigid(sb.loads.Actuator(25e3, lag="60 ms", dead_time="130 ms")),
        inputs=["lever"],
    )
    with input_error(match="state: is of another scene"):
        other.restore(stepper.state())
    with input_error(match="state: has other entries"):
        sb.Stepper(scene).restore(stepper.state())


def test_new_values_compile_nothing(caplog):
    stepper = sb.Stepper(rigid(), inputs=["lever"])
    stepper.advance(0.1, lever=4e3)
    with nothing_compiled(caplog):
        for k in range(20):
            stepper.advance(0.01 * (k + 1), lever=4e3 + 100.0 * k)


@pytest.mark.slow
def test_lever_and_driller_are_commanded():
    lever = sb.Lever("400 N", arm="1.5 m", slack_arm="0.1 m")
    stepper = sb.Stepper(rigid(lever), inputs=["lever"])
    stepper.advance(0.1, lever="200 N")
    all_near(stepper["slack_tension"], 3000.0, 1e-14)
    driller = sb.Stepper(
        rigid(sb.Driller(sb.PiecewiseLinear([0.0], [24.0]), "60 kN")), inputs=["lever"]
    )
    driller.advance(4.0, lever="120 rpm")
    # ω − ω_r falls by e^{−g t} with g = 2/s
    all_near(driller.omega - 4 * np.pi, (24 - 4 * np.pi) * np.exp(-8.0), 1e-7)


def test_wrong_input_changes_nothing():
    with input_error() as caught:
        sb.Stepper(
            sb.Scene(
                ELASTIC,
                sb.Duty("0 N", sb.HookLoad("60 t", "400 mm", 8)),
                sb.Initial(24.0),
                5.0,
            ),
            ["lever", "load", "wind"],
        )
    text = str(caught.value)
    assert "duty.slack_tension: is 0 at all times" in text
    assert "duty.load: a HookLoad gives its torque by itself" in text
    assert "wind: is no input — inputs are lever and load" in text
    stepper = sb.Stepper(rigid(), inputs=["lever"])
    before = stepper.state()
    with input_error() as caught:
        stepper.advance("-1 s", lever="3 kg", load=3.0)
    text = str(caught.value)
    assert all(
        part in text
        for part in ("dt: ", "lever: ", "load: is no input of this stepper")
    )
    assert all(
        np.array_equal(before[name], value) for name, value in stepper.state().items()
    )


def warmed():
    """A brake at rest whose linings are warmed from outside by 2 K/s, and whose
    friction is known up to 400 K."""
    fade = sb.friction.TabulatedFade(np.asarray([280.0, 400.0]), np.asarray([1.0, 0.8]))
    law = sb.friction.ProductFriction(0.3, (fade,))
    brake = drawworks_brake(12, law, C=4e5)
    heat = sb.Heat(
        (sb.thermal.Lump("linings", 1e4),),
        sources=(sb.thermal.Source("linings", 2e4),),
        friction=sb.thermal.FrictionHeat(None, "linings", 1.0),
        linings="linings",
    )
    return sb.Scene(brake, sb.Duty(8e3, 0.0), sb.Initial(0.0), 100.0, heat)


@pytest.mark.slow
def test_a_step_that_fails_changes_nothing():
    stepper = sb.Stepper(warmed(), inputs=["lever"])
    for k in range(5):
        stepper.advance(10.0, lever=8e3 + k)
        all_near(stepper["lining_temperature"], 293.15 + 20.0 * (k + 1), 1e-10)
    before = stepper.state()
    with pytest.raises(sb.SimulationError, match="outside_table"):
        stepper.advance(10.0, lever=7e3)
    assert all(
        np.array_equal(before[name], value) for name, value in stepper.state().items()
    )
    stepper.advance(3.0, lever=6e3)
    all_near(stepper["lining_temperature"], 293.15 + 106.0, 1e-10)
    said = np.asarray(stepper.history().duty.slack_tension.values)
    # not what failed
    all_equal(said[::2], [8e3, 8001.0, 8002.0, 8003.0, 8004.0, 6e3])
