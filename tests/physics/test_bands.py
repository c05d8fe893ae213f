"""Several bands of unequal linings under one lever: shares, stops, holds in closed
form, heat against SciPy, input."""

import dataclasses
import math

import numpy as np
import pytest
from oracles.stops import at_rest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import simbrake as sb
from simbrake import plot

R = 0.59
R_B = 0.623
J = 1200.0
W0 = 20.0
T0 = 6e3
LOAD = 3e3
ANGLES = (np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6]))
FRICTION = (np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28))
STIFFNESS = (2e5, 3.5e5)
RATIO = (1.2, 1.05)
AREA = (0.03, np.array([0.02, 0.02, 0.015, 0.025, 0.03, 0.02]))


def lined(j, *, law=None, angle=None, stiffness=None, share=None, area=None):
    law = sb.ConstantFriction(FRICTION[j], RATIO[j]) if law is None else law
    linings = sb.Lining(
        law, ANGLES[j] if angle is None else angle, AREA[j] if area is None else area
    )
    stiffness = STIFFNESS[j] if stiffness is None and share is None else stiffness
    return sb.brakes.LinedBand(linings, stiffness, share)


def scene(bands=None, *, load=LOAD, omega=W0, pull=T0, end=6.0, **parts):
    bands = (lined(0), lined(1)) if bands is None else bands
    brake = sb.brakes.MultiBandBrake(sb.Pulley(R, J), R_B, bands)
    pull = (
        pull
        if isinstance(pull, sb.PiecewiseLinear)
        else sb.PiecewiseLinear([0.0, 9.0], [pull, pull])
    )
    load = (
        load
        if isinstance(load, sb.PiecewiseLinear)
        else sb.PiecewiseLinear([0.0, 9.0], [load, load])
    )
    return sb.Scene(
        brake, sb.Duty(pull, sb.TorqueLoad(load)), sb.Initial(omega), end, **parts
    )


def ratios(f, angle):
    fz = f * np.tan(angle / 2)
    return (1 + fz) / (1 - fz)


def tensions(slack, f, angle, back=False):
    mu = ratios(f, angle)
    return slack * np.append(1.0, np.cumprod(1 / mu if back else mu))


def shares(stiffness=STIFFNESS, friction=FRICTION, xp=np):
    """K-8 with `c = Π/C`: all bands have one elongation `x = T_n/C`."""
    growth = [
        xp.prod((1 + f * xp.tan(a / 2)) / (1 - f * xp.tan(a / 2)))
        for f, a in zip(friction, ANGLES, strict=True)
    ]
    yielding = xp.stack([C / Pi for C, Pi in zip(stiffness, growth, strict=True)])
    return yielding / yielding.sum()


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(scene())


@pytest.mark.smoke
def test_a_stop_has_the_torque_of_both_bands(stopped):
    share = shares()
    along = [
        tensions(s * T0, f, a) for s, f, a in zip(share, FRICTION, ANGLES, strict=True)
    ]
    torque = R_B * sum(T[-1] - T[0] for T in along)
    time = J * W0 / (torque - LOAD)
    assert float(stopped.stopping_time) == pytest.approx(time, rel=1e-12)
    np.testing.assert_allclose(
        sb.brakes.tension_shares(stopped.scene.brake), share, rtol=1e-14
    )
    assert float(
        stopped.scene.brake.torque(T0, np.concatenate(FRICTION))
    ) == pytest.approx(torque, rel=1e-13)
    s = stopped.series([0.5 * time])
    np.testing.assert_allclose(
        s.tension[0], np.concatenate([T[1:] for T in along]), rtol=1e-13
    )
    assert float(s.slack_tension[0]) == pytest.approx(T0, rel=1e-15)
    assert float(s.tight_tension[0]) == pytest.approx(
        sum(T[-1] for T in along), rel=1e-13
    )
    loads = [
        (T[1:] + T[:-1]) * np.sin(a / 2) for T, a in zip(along, ANGLES, strict=True)
    ]
    np.testing.assert_allclose(s.normal_load[0], np.concatenate(loads), rtol=1e-13)
    np.testing.assert_allclose(
        s.friction_force[0],
        np.concatenate(FRICTION) * np.concatenate(loads),
        rtol=1e-13,
    )
    work = np.asarray(sb.results.friction_work(stopped))
    np.testing.assert_allclose(
        work,
        np.concatenate([np.diff(T) for T in along]) * R_B * W0 * time / 2,
        rtol=1e-11,
    )
    first, second = stopped.scene.brake.of_bands(work)
    assert first.sum() / second.sum() == pytest.approx(
        np.ptp(along[0]) / np.ptp(along[1]), rel=1e-11
    )
    assert first.sum() + second.sum() == pytest.approx(
        float(stopped.energy["friction_heat"]), rel=1e-12
    )
    assert float(stopped.energy["closure"]) <= 1e-12
    greatest = stopped.max_tension
    T_max = np.array([T[-1] for T in along])
    assert float(greatest.value) == pytest.approx(T_max.max(), rel=1e-13)
    assert int(greatest.lining) == (4, 10)[int(T_max.argmax())]
    # the second band begins at its own slack tension, not behind the first one
    edges = sb.results.lining_mean(stopped, "edge_pressure_ratio")
    np.testing.assert_allclose(
        edges,
        np.concatenate([ratios(f, a) for f, a in zip(FRICTION, ANGLES, strict=True)]),
    )


def test_backwards_the_lever_end_is_tight():
    result = sb.simulate(scene(omega=-W0, load=-500.0, end=20.0))
    along = [
        tensions(s * T0, f, a, back=True)
        for s, f, a in zip(shares(), FRICTION, ANGLES, strict=True)
    ]
    torque = R_B * sum(T[0] - T[-1] for T in along)
    assert float(result.stopping_time) == pytest.approx(
        J * W0 / (torque - 500.0), rel=1e-12
    )
    np.testing.assert_allclose(
        result.series([0.1]).tension[0],
        np.concatenate([T[1:] for T in along]),
        rtol=1e-13,
    )


def test_given_shares_are_relative():
    for given in ((1.0, 2.0), (0.25, 0.5)):
        result = sb.simulate(
            scene((lined(0, share=given[0]), lined(1, share=given[1])))
        )
        torque = sum(
            w * R_B * T0 * (ratios(f, a).prod() - 1)
            for w, f, a in zip((1 / 3, 2 / 3), FRICTION, ANGLES, strict=True)
        )
        assert float(result.stopping_time) == pytest.approx(
            J * W0 / (torque - LOAD), rel=1e-12
        )


def test_geometries_stretch_alike():
    """Each band by quadrature of `∫ S R dθ/(E A)` and its ends, `S` by Euler's law up
    to the tight end.

    There it is the `T_n = Π T_0` of the band's linings, whose share of the lever's
    tension `T_0` is.
    """
    modulus = 2.06e11
    area = (1.3e-3, 1.1e-3)
    ends = ((0.35, 0.6), (0.3, 1.4))
    bands = tuple(
        lined(
            j,
            stiffness=sb.brakes.LiningsOnPlates(
                modulus, area[j], *ends[j], gap=0.02 * j
            ),
        )
        for j in (0, 1)
    )
    found = np.asarray(sb.brakes.tension_shares(scene(bands).brake))
    stretch = []
    for j, share in enumerate(found):
        S = (
            share
            * T0
            * ratios(FRICTION[j], ANGLES[j]).prod()
            / math.exp(np.sum(FRICTION[j] * ANGLES[j]))
        )
        total = S * ends[j][0] / (modulus * area[j])
        EA = modulus * area[j]
        for i, (f, a) in enumerate(zip(FRICTION[j], ANGLES[j], strict=True)):
            total += (
                quad(
                    lambda x, S=S, f=f: S * math.exp(f * x),
                    0,
                    a,
                    epsabs=0,
                    epsrel=1e-13,
                )[0]
                * R_B
                / EA
            )
            S *= math.exp(f * a)
            total += (
                S * R_B * 0.02 * j / EA
                if i < len(ANGLES[j]) - 1
                else S * ends[j][1] / EA
            )
        stretch.append(total)
    assert found.sum() == pytest.approx(1.0, rel=1e-15)
    assert stretch[0] == pytest.approx(stretch[1], rel=1e-12)


def test_sharing_of_a_load_at_rest(stopped):
    static = [r * f for r, f in zip(RATIO, FRICTION, strict=True)]
    slack = shares() * T0
    most = np.array(
        [
            T * (ratios(f, a).prod() - 1)
            for T, f, a in zip(slack, static, ANGLES, strict=True)
        ]
    )
    s = stopped.series([5.5])
    assert float(s.omega[0]) == 0.0
    assert float(s.brake_torque[0]) == LOAD
    held = stopped.scene.brake.of_bands(np.asarray(s.tension)[0])
    np.testing.assert_allclose(
        [T[-1] for T in held] - slack, LOAD / R_B * most / most.sum(), rtol=1e-12
    )
    for j, T in enumerate(held):  # no lining beyond its limit
        assert np.all(np.diff(np.append(slack[j], T)) >= -1e-9)
        assert np.all(
            T / np.append(slack[j], T[:-1])
            <= ratios(static[j], ANGLES[j]) * (1 + 1e-12)
        )
    assert stopped.metrics["min_holding_reserve"] == pytest.approx(
        R_B * most.sum() / LOAD, rel=1e-12
    )
    rising = sb.PiecewiseLinear([0.0, 9.0], [0.0, 3 * R_B * most.sum()])
    result = sb.simulate(scene(omega=0.0, load=rising, end=5.0))
    restart = next(event.time for event in result.events if event.name == "restart")
    assert restart == pytest.approx(3.0, rel=1e-12)
    kinetic = sum(
        T * (ratios(f, a).prod() - 1)
        for T, f, a in zip(slack, FRICTION, ANGLES, strict=True)
    )
    assert float(result.end_capacity.torque) == pytest.approx(R_B * kinetic, rel=1e-12)


# --- heat, fade, memory, wear -------------------------------------------------------

SLOPE = 1e-3
STRIBECK = (0.34, 0.29, 3.0)
RUN_IN = (0.8, 4e6)
WEAR = 2e-13
C_RIM = 4e4
C_LINING = 4e3
G_RIM = 60.0
G_LINING = 3.0
TO_RIM = 0.7
ROOM = 293.15
N = ANGLES[0].size, ANGLES[1].size


FADING = sb.friction.ProductFriction(
    sb.ConstantFriction(0.3), (sb.LinearFade(SLOPE, 273.15),)
)


def hot_scene(**changes):
    """A band whose friction fades beside one whose friction falls with the speed and
    runs in; a rim for each."""
    fading = sb.friction.ProductFriction(
        sb.ConstantFriction(FRICTION[0], 1.1), (sb.LinearFade(SLOPE, 273.15),)
    )
    running_in = sb.friction.FrictionWithMemory(
        sb.StribeckFriction(*STRIBECK),
        (sb.friction.MemoryProcess(RUN_IN[0], work=RUN_IN[1]),),
    )
    heat = sb.Heat(
        (
            sb.thermal.Lump("rims", C_RIM, ROOM, count=2),
            sb.thermal.Lump("linings", C_LINING, ROOM, count=sum(N)),
            sb.thermal.Reservoir("air", ROOM),
        ),
        (
            sb.thermal.Conductance("rims", "air", G_RIM),
            sb.thermal.Conductance("linings", "air", G_LINING),
        ),
        sb.thermal.FrictionHeat(
            "rims", "linings", sb.thermal.ConstantPartition(TO_RIM)
        ),
        rim="rims",
        linings="linings",
    )
    bands = lined(0, law=fading), lined(1, law=running_in)
    return scene(
        bands,
        heat=heat,
        wear=sb.Wear(sb.wear.ExponentialWear(WEAR, rise=100.0)),
        **changes,
    )


@pytest.mark.slow
def test_laws_see_the_rim_of_their_own_band():
    """Rims that start at different temperatures; heat into the linings is not
    modelled."""
    start = np.array([293.15, 393.15])
    fade = sb.LinearFade(2e-3, 273.15)
    laws = [
        sb.friction.ProductFriction(sb.ConstantFriction(f, 1.0), (fade,))
        for f in FRICTION
    ]
    heat = sb.Heat(
        (
            sb.thermal.Lump("rims", C_RIM, start, count=2),
            sb.thermal.Reservoir("air", ROOM),
        ),
        (sb.thermal.Conductance("rims", "air", G_RIM),),
        sb.thermal.FrictionHeat("rims", None, sb.thermal.ConstantPartition(TO_RIM)),
        rim="rims",
    )
    result = sb.simulate(
        scene((lined(0, law=laws[0]), lined(1, law=laws[1])), load=0.0, heat=heat),
        rtol=1e-11,
    )

    def friction(T):
        return [
            f * (1 - 2e-3 * (rim - 273.15)) for f, rim in zip(FRICTION, T, strict=True)
        ]

    slack = shares(friction=friction(start)) * T0
    assert slack[0] == pytest.approx(
        T0 * float(sb.brakes.tension_shares(result.scene.brake, np.repeat(start, N))[0])
    )

    def rates(t, y):
        f = friction(y[1:])
        pull = np.array(
            [
                S * (ratios(one, a).prod() - 1)
                for S, one, a in zip(slack, f, ANGLES, strict=True)
            ]
        )
        return [
            -R_B * pull.sum() / J,
            *((TO_RIM * pull * R_B * y[0] - G_RIM * (y[1:] - ROOM)) / C_RIM),
        ]

    truth = solve_ivp(
        rates, (0, 9), [W0, *start], "DOP853", events=at_rest, rtol=1e-13, atol=1e-12
    )
    assert float(result.stopping_time) == pytest.approx(truth.t[-1], rel=1e-10)
    np.testing.assert_allclose(
        result.series([truth.t[-1]]).rim_temperature[0], truth.y[1:, -1], rtol=1e-10
    )


@pytest.mark.slow
def test_shaft_heat_enters_all_rims_alike():
    heat = sb.Heat(
        (sb.thermal.Lump("rims", C_RIM, ROOM, count=2),),
        (),
        sb.thermal.FrictionHeat("rims", None, sb.thermal.ConstantPartition(TO_RIM)),
        rim="rims",
    )
    drag = sb.shaft.ViscousDrag(200.0, place="rims")
    result = sb.simulate(
        scene(load=0.0, pull=0.0, end=2.0, heat=heat, shaft=(drag,)), rtol=1e-11
    )
    lost = J * W0**2 / 2 * (1 - np.exp(-2 * 200.0 * 2.0 / J))
    np.testing.assert_allclose(
        result.end_temperatures - ROOM, np.full(2, lost / (2 * C_RIM)), rtol=1e-9
    )


@pytest.mark.slow
def test_pressure_on_one_band():
    factor = FRICTION[0]
    p_r = 5e5
    m = 0.3
    law = sb.friction.ProductFriction(
        sb.ConstantFriction(factor), (sb.friction.PressureFactor(p_r, m),)
    )
    result = sb.simulate(scene((lined(0, law=law, share=1.0), lined(1, share=1.0))))
    slack = T = T0 / 2
    for f_0, a in zip(factor, ANGLES[0], strict=True):

        def excess(f, T=T, a=a, f_0=f_0):
            mu = ratios(f, a)
            return f - f_0 * (1 + T * (1 + mu) * math.sin(a / 2) / AREA[0] / p_r) ** -m

        T *= ratios(brentq(excess, 0.0, f_0, xtol=1e-15), a)
    torque = R_B * (T - slack + slack * (ratios(FRICTION[1], ANGLES[1]).prod() - 1))
    assert float(result.stopping_time) == pytest.approx(
        J * W0 / (torque - LOAD), rel=1e-12
    )


@pytest.mark.slow
def test_one_band_leaves_its_table():
    table = sb.friction.TabulatedFade([250.0, 320.0], [1.0, 0.9])
    scene = hot_scene(end=20.0)
    law = sb.friction.ProductFriction(sb.ConstantFriction(0.3), (table,))
    other = dataclasses.replace(scene.brake.bands[1], linings=lined(1, law=law).linings)
    brake = dataclasses.replace(scene.brake, bands=(scene.brake.bands[0], other))
    result = sb.simulate(
        dataclasses.replace(scene, brake=brake, initial=sb.Initial(60.0)), throw=False
    )
    assert result.status == "outside_table"
    T = np.asarray(result.series([float(result.record.t_end)]).lining_temperature)[0]
    assert T[N[0] :].max() == pytest.approx(320.0, abs=1e-6)
    assert T[: N[0]].max() > 325.0  # those of the other band have no table


# --- input, files, figures ----------------------------------------------------------


PROGRAMME = """
format = "simbrake scene 1"
programme = ["lower 4 m at 1 m/s", "brake to rest"]
pull = "30 kN"
load = { mass = "30 t", drum_radius = "400 mm", line_count = 8 }
[brake]
pulley = { radius = "590 mm", inertia = "1200 kg*m^2" }
band_radius = "623 mm"
[[brake.bands]]
linings = { count = 8, wrap = "270 deg", friction = 0.35 }
share = 1
[[brake.bands]]
linings = { count = 10, wrap = "250 deg", friction = 0.3 }
share = 1
"""

GOOD = """
format = "simbrake scene 1"
end_time = "6 s"
[brake]
pulley = { radius = "590 mm", inertia = "1200 kg*m^2" }
band_radius = "623 mm"
[[brake.bands]]
linings = { count = 8, wrap = "200 deg", friction = 0.35 }
share = 1
[[brake.bands]]
linings = { count = 10, wrap = "250 deg", friction = 0.25 }
share = 1
[duty]
slack_tension = "6 kN"
load = "3 kN*m"
[initial]
omega = "20 rad/s"
"""


@pytest.mark.slow
def test_file_by_hand_and_all_its_errors():
    result = sb.simulate(sb.files.scene_from_text(GOOD))
    torque = sum(
        R_B * T0 / 2 * (ratios(f, math.radians(wrap) / n) ** n - 1)
        for n, wrap, f in ((8, 200, 0.35), (10, 250, 0.25))
    )
    assert float(result.stopping_time) == pytest.approx(
        J * W0 / (torque - LOAD), rel=1e-12
    )
    bad = (
        GOOD.replace("share = 1\n", "stiffness = 2e5\n", 1)
        .replace("250 deg", "370 deg")
        .replace("623 mm", "523 mm")
    )
    with pytest.raises(sb.InputError) as caught:
        sb.check_scene(sb.files.scene_from_text(bad))
    for part in (
        "brake.band_radius: 0.523 m is inside the track of 0.59 m",
        "brake.bands[0].share: is missing",
        "brake.bands[0].stiffness: stands beside the share of a band",
        "brake.bands[1].linings.angle: the linings span 370.0°",
    ):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("bands", "message"),
    [
        ((), r"MultiBandBrake\.bands: there is no band"),
        (
            (lined(0), dataclasses.replace(lined(1), stiffness=None)),
            r"brake\.bands\[1\]\.stiffness: is missing",
        ),
        (
            (lined(0, law=sb.ConstantFriction([0.3, 0.4])), lined(1)),
            r"bands\[0\]\.linings\.friction: its numbers do not",
        ),
        (
            (
                lined(0),
                dataclasses.replace(lined(1), linings=sb.Lining(0.3, ANGLES[1])),
            ),
            r"brake\.bands\[1\]\.linings\.area: is missing",
        ),
        (
            (
                lined(0),
                dataclasses.replace(
                    lined(1), linings=sb.Lining(0.3, ANGLES[1], 0.02, 3.0)
                ),
            ),
            r"brake\.bands\[1\]\.linings\.mass: has no effect",
        ),
        (
            (lined(0), lined(1, law=sb.ConstantFriction(2.8))),
            r"brake\.bands\[1\]\.linings\.angle\[4\]: lining 5 of band 2: f·tan\(β/2\) = 1\.184 ≥ 1",
        ),
        (
            (lined(0), lined(1, law=FADING)),
            r"heat: is missing, but friction law brake\.bands\[\*\]\.linings\.friction",
        ),
    ],
)
def test_bad_input(bands, message):
    with pytest.raises(sb.InputError, match=message):
        sb.check_scene(scene(bands))


def test_what_needs_one_band_says_so(stopped):
    with_wear = dataclasses.replace(
        hot_scene(), wear=sb.Wear(WEAR, geometry=True, turned_at=1.0)
    )
    with pytest.raises(
        sb.InputError, match=r"wear\.geometry: has no effect on a multi-band brake"
    ):
        sb.check_scene(with_wear)
    with pytest.raises(
        sb.InputError, match=r"initial\.elongation: a multi-band brake has rigid bands"
    ):
        sb.check_scene(
            dataclasses.replace(stopped.scene, initial=sb.Initial(W0, elongation=1e-3))
        )
    heat = hot_scene().heat
    rims = dataclasses.replace(heat.bodies[0], count=3)
    three = dataclasses.replace(
        hot_scene(), heat=dataclasses.replace(heat, bodies=(rims, *heat.bodies[1:]))
    )
    with pytest.raises(
        sb.InputError, match=r"heat\.friction\.metal: 'rims' has 3 nodes — 1 or 2 or 10"
    ):
        sb.check_scene(three)
    for feature in (
        lambda: sb.brakes.stiffness_of(stopped.scene.brake),
        lambda: sb.studies.turned_scene(stopped.scene),
    ):
        with pytest.raises(sb.InputError, match=r"is a multi-band brake: .* one band"):
            feature()


def test_circles_of_all_bands_have_one_scale(stopped):
    bands = zip(shares(), FRICTION, ANGLES, strict=True)
    figure = plot.pulley(stopped, 0.5)
    along = [tensions(s * T0, f, a) for s, f, a in bands]
    for axes, T in zip(figure.axes, along, strict=True):
        (line,) = (line for line in axes.lines if line.get_gid() == "tension")
        radius = np.hypot(*line.get_xydata().T)  # both ends of each lining
        shown = (radius - 1.30) / 0.72 * max(T.max() for T in along)
        np.testing.assert_allclose(shown, np.repeat(T, 2)[1:-1], rtol=1e-12)


def test_estimates_and_synthesis_of_several_bands(stopped):
    Pi = sum(
        s * ratios(f, a).prod()
        for s, f, a in zip(shares(), FRICTION, ANGLES, strict=True)
    )
    for table in (sb.estimates(stopped), sb.synthesize(stopped)):
        assert table["tension ratio"].value == pytest.approx(Pi, rel=1e-13)
        assert table["brake torque"].value == pytest.approx(
            R_B * T0 * (Pi - 1), rel=1e-13
        )
        for name in (
            "brake torque",
            "stopping time",
            "stopping angle",
            "friction work",
        ):
            assert table[name].value == pytest.approx(table[name].simulated, rel=1e-9)
    inputs = {entry.name: entry.value for entry in table.inputs}
    assert inputs["lining_area"] == pytest.approx(4 * 0.03 + 0.13, rel=1e-14)
    # a rim for each
    assert inputs["track_area"] == pytest.approx(2 * 2 * math.pi * R * 0.22, rel=1e-14)
    assert table["tight tension, maximum"].value == pytest.approx(Pi * T0, rel=1e-13)


@pytest.mark.slow
def test_a_programme_lowers_with_several_bands(tmp_path):
    """Two equal bands at twice the tension move as one of them does."""
    linings = sb.uniform_linings(8, "270 deg", 0.35)
    pulley = sb.Pulley(R, J)
    band = sb.brakes.LinedBand(linings, share=1.0)
    runs = []
    brakes = (
        sb.Brake(pulley, sb.Band(R_B), linings),
        sb.brakes.MultiBandBrake(pulley, R_B, (band, band)),
    )
    for brake in brakes:
        lines = ("lower 4 m at 1 m/s", "brake to rest", "hold 2 s")
        hook = sb.HookLoad("30 t", "400 mm", 8)
        runs.append(sb.simulate(sb.programme_scene(brake, lines, hook, pull=4e4)))
    one, two = (
        [*run.events["stop"].times, run.metrics["total_hook_travel"]] for run in runs
    )
    np.testing.assert_allclose(two, one, rtol=1e-10)
    file = tmp_path / "trip.toml"
    file.write_text(PROGRAMME)
    assert isinstance(sb.read_scene(file).brake, sb.brakes.MultiBandBrake)
