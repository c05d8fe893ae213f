"""Friction that is changed while a brake runs: oil, lost linings; closed forms, SciPy,
files, input."""

import dataclasses
import math
import pathlib
import re

import bandage_scenes
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from disc_scenes import FRICTION, R_I, R_O, W0, F, J, N, disc_heat, disc_scene
from helpers import TSIT5, jacobians
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from shoe_scenes import normals, shoe_scene

import simbrake as sb
from simbrake.friction import ChangingFriction, FrictionChange

R_B = 0.623
INERTIA = 1200.0
T0 = 6e3
OMEGA = 24.0
COUNT = 8
MU = 0.35
Z = math.tan(math.radians(270 / COUNT / 2))


def jump(time, to, begin=1.0):
    return sb.PiecewiseLinear([time, time], [begin, to])


def changed(base, factor, linings=None):
    return ChangingFriction(base, (FrictionChange(factor, linings),))


def scene(law, stiffness=None, load=0.0, omega=OMEGA, end=8.0, T_0=T0):
    brake = sb.Brake(
        sb.Pulley(0.59, INERTIA),
        sb.Band(R_B, stiffness),
        sb.uniform_linings(COUNT, "270 deg", law),
    )
    # (at rest the band has the elongation with which it bears the load)
    elongation = 0.0 if stiffness is None or omega else (T0 + load / R_B) / stiffness
    return sb.Scene(brake, sb.Duty(T_0, load), sb.Initial(omega, elongation), end)


def torque(factor, f=MU, chosen=slice(None), T_0=T0):
    """`R_b T_0 (Π − 1)`, `Π` the product of the ratios `T_i/T_{i−1}`."""
    each = jnp.full(COUNT, f).at[chosen].multiply(factor)
    return R_B * T_0 * (jnp.prod((1 + each * Z) / (1 - each * Z)) - 1)


@pytest.mark.slow
def test_a_lost_lining_compiles_nothing():
    """Which lining is a number: all of them lower the torque alike on a rigid band."""
    law = ChangingFriction(
        MU,
        (FrictionChange(jump(0.2, 0.0), 1.0), FrictionChange(jump(1.0, 0.5), [2, 5])),
    )
    run = sb.prepare(scene(law), ["stopping_time"])
    lost = torque(0.0, MU, slice(0, 1))
    each = np.full(COUNT, MU)
    each[[0, 1, 4]] *= [0.0, 0.5, 0.5]
    both = R_B * T0 * (np.prod((1 + each * Z) / (1 - each * Z)) - 1)
    left = OMEGA - (0.2 * torque(1.0) + 0.8 * lost) / INERTIA
    for number in (1.0, 7.0):
        found = run({"brake.linings.friction.changes[0].linings": number}).metrics[
            "stopping_time"
        ]
        assert found == pytest.approx(float(1.0 + left * INERTIA / both), rel=1e-12)


@pytest.mark.slow
def test_held_load_goes_when_friction_jumps():
    """It holds until the instant of the jump, then `J ω̇ = M − M_k`; exactly, in either
    direction."""
    end = 2.0
    ratio = 1.2

    def held(x):
        law = changed(sb.ConstantFriction(MU, ratio), jump(x[0], x[1]))
        return scene(law, 3e5, x[2], 0.0, end)

    def grip(f, load):
        Pi = ((1 + f * Z) / (1 - f * Z)) ** COUNT
        return R_B * T0 * jnp.where(load > 0, Pi - 1, 1 / Pi - 1)

    def by_hand(x):
        return ((x[2] - grip(MU * x[1], x[2])) / INERTIA * (end - x[0]))[None]

    run = jacobians(
        lambda x: sb.simulate(held(x), max_steps=128).record.y_end.omega[None]
    )
    for x in (np.array([1.7, 0.45, 14e3]), np.array([1.2, 0.45, -2.5e3])):
        assert (
            abs(grip(MU * ratio, x[2])) > abs(x[2]) > abs(grip(MU * ratio * x[1], x[2]))
        )
        value, forward, backward = run(x)
        np.testing.assert_allclose(value, by_hand(x), rtol=1e-11)
        np.testing.assert_allclose(forward, jax.jacobian(by_hand)(x), rtol=1e-8)
        np.testing.assert_allclose(backward, forward, rtol=1e-9)
        result = sb.simulate(held(x))
        assert (
            next(event.time for event in result.events if event.name == "restart")
            == x[0]
        )
        assert np.all(
            np.asarray(result.series([0.3, 1.0, x[0]], left=True).omega) == 0.0
        )
        assert float(result.energy["closure"]) <= 1e-12


# --- other brakes -------------------------------------------------------------------


@pytest.mark.slow
def test_staged_brake_with_changes_of_pairs():
    """Oil on the rim lets the bandage go at once; on the band it lowers the torque of
    stage 1."""
    R = staged.R
    J_ = staged.J
    J_b = staged.J_B
    s = math.sin(staged.BETA / 2)
    z = math.tan(staged.BETA / 2)
    T_0 = 400.0
    load = 300.0
    outer = np.full(staged.N, staged.F_EXT)
    inner = np.full(staged.N, staged.F_INT)

    def ext(f):
        Pi = np.cumprod(np.append(1.0, (1 + f * z) / (1 - f * z)))
        return staged.R_B * T_0 * (Pi[-1] - 1), T_0 * (Pi[1:] + Pi[:-1]) * s

    def parts(t):
        f = outer.copy()
        g = inner.copy()
        f[2:4] *= 0.5 if t >= 0.4 else 1.0
        g *= 0.2 if t >= 0.9 else 1.0
        M_ext, N_i = ext(f)
        return M_ext, R * float(np.sum(g * (N_i + staged.PRELOAD)))

    laws = {
        "law": changed(staged.F_EXT, jump(0.4, 0.5), [3, 4]),
        "inner": changed(staged.F_INT, jump(0.9, 0.2)),
    }
    result = sb.simulate(
        staged.stop(lever=sb.Constant(T_0), load=load, w0=20.0, end=1.5, **laws)
    )
    omega = 20.0 + 0.4 * (load - parts(0.0)[0]) / (J_ + J_b)
    omega += 0.5 * (load - parts(0.5)[0]) / (J_ + J_b)
    M_ext, M_int = parts(1.0)
    # it grips, and does not then
    assert parts(0.5)[1] > abs(load - J_ * (load - M_ext) / (J_ + J_b)) > M_int
    assert float(result.internal_slip_time) == 0.9
    end = result.series([1.5])
    assert float(end.omega[0]) == pytest.approx(
        omega + 0.6 * (load - M_int) / J_, rel=1e-12
    )
    assert float(end.bandage_speed[0]) == pytest.approx(
        omega + 0.6 * (M_int - M_ext) / J_b, rel=1e-12
    )
    assert float(result.energy["closure"]) <= 1e-12


@pytest.mark.slow
def test_disc_with_fade_and_oil_by_scipy():
    """Two of four pads from 0.6 s on; pads fade by their own heat; disc and pads as
    lumps."""
    base = sb.friction.ProductFriction(
        sb.ConstantFriction(FRICTION), (sb.LinearFade(2e-3, 273.15),)
    )
    result = sb.simulate(
        disc_scene(friction=changed(base, jump(0.6, 0.3), [1, 4]), heat=disc_heat()),
        rtol=1e-12,
    )
    r = 0.5 * (R_I + R_O)
    load = 1500.0

    def rates(t, y, factor):
        f = FRICTION * (1 - 2e-3 * (y[2:] - 273.15)) * factor
        P = f * F * r * y[0]
        disc = (0.3 * 0.0 + 0.7 * P.sum() - 20.0 * (y[1] - 293.15)) / 2e5
        return [
            (load - r * F * f.sum()) / J,
            disc,
            *((0.3 * P - 5.0 * (y[2:] - 293.15)) / 500.0),
        ]

    def stops(t, y, factor):
        return y[0]

    stops.terminal = True
    y = np.array([W0, 293.15, *[293.15] * N])
    t = 0.0
    for end, factor in ((0.6, np.ones(N)), (9.0, np.array([0.3, 1.0, 1.0, 0.3]))):
        found = solve_ivp(
            rates,
            (t, end),
            y,
            "DOP853",
            args=(factor,),
            events=stops,
            rtol=1e-13,
            atol=1e-10,
        )
        t = found.t[-1]
        y = found.y[:, -1]
    assert float(result.stopping_time) == pytest.approx(t, rel=1e-9)
    hot = np.asarray(result.series([t], left=True).temperature)[0]
    np.testing.assert_allclose(hot, y[1:], rtol=1e-9)
    assert float(result.energy["heat_closure"]) <= 1e-12


def test_an_oiled_shoe():
    """The leading shoe loses friction: its load falls as well; one of them rising until
    it locks ends the run."""
    f = np.array([0.32, 0.32])
    law = changed(sb.ConstantFriction(f, 1.1), jump(0.3, 0.25), 1.0)
    result = sb.simulate(shoe_scene(friction=law))
    before = 0.150 * np.sum(f * normals(f))
    after = 0.150 * np.sum(f * [0.25, 1.0] * normals(f * [0.25, 1.0]))
    assert float(result.stopping_time) == pytest.approx(
        0.3 + (25.0 - before * 0.3 / 12.0) * 12.0 / after, rel=1e-11
    )
    wet = changed(sb.ConstantFriction(f, 1.1), jump(0.3, 4.0), 1.0)
    locked = sb.simulate(shoe_scene(friction=wet), throw=False)
    assert locked.status == "singular_geometry"
    assert float(locked.record.t_end) == 0.3


@pytest.mark.slow
def test_a_lining_on_springs_locks():
    """Where `R f sin(β/2)/R_b` of a lining on the rim comes to 1, whether its friction
    rises to that or jumps past."""
    base = bandage_scenes.scene(n=2, lever=((0.0, 9.0), (2e3, 2e3)), end=0.9)
    f = 0.2
    s = math.sin(float(base.brake.linings.angle[0]) / 2)
    limit = bandage_scenes.R_B / (bandage_scenes.R * f * s)
    for times, end, locks in (
        ([0.3, 0.8], 2 * limit - 1, 0.55),
        ([0.6, 0.6], 1.01 * limit, 0.6),
        ([0.6, 0.6], 0.99 * limit, None),
    ):
        law = changed(
            sb.ConstantFriction(f), sb.PiecewiseLinear(times, [1.0, end]), [2]
        )
        bandage = dataclasses.replace(base.brake.bandage, friction=law)
        given = dataclasses.replace(
            base, brake=dataclasses.replace(base.brake, bandage=bandage)
        )
        result = sb.simulate(given, solver=TSIT5, throw=False)
        assert (result.status == "singular_geometry") == (locks is not None)
        assert float(result.record.t_end) == pytest.approx(locks or 0.9, rel=1e-9)


@pytest.mark.slow
def test_runaway_waits_for_changes_to_come():
    """A load beyond the oiled brake runs away, unless the brake dries later."""
    load = 8e3
    oily = sb.simulate(scene(changed(MU, jump(0.5, 0.3)), None, load, 10.0, 4.0))
    assert oily.status == "runaway"
    drying = sb.PiecewiseLinear([0.5, 0.5, 6.0, 7.0], [1.0, 0.3, 0.3, 1.0])
    assert (
        sb.simulate(scene(changed(MU, drying), None, load, 10.0, 4.0)).status
        == "not_stopped"
    )


# --- changes that begin when something happens --------------------------------------


def waiting(base, factor, when, linings=None):
    return ChangingFriction(base, (FrictionChange(factor, linings, when),))


def times_of(result, name):
    return [event.time for event in result.events if event.name == name]


@pytest.mark.slow
def test_second_stop_begins_a_change():
    """Two stops by hand; at the second the held load breaks away, or later where the
    friction falls slowly."""
    load = 9e3
    let_go = 2.0
    pulled = 2.6
    end = 7.0
    ratio = 1.2
    lever = sb.PiecewiseLinear([let_go, let_go, pulled, pulled], [T0, 0.0, 0.0, T0])
    base = sb.ConstantFriction(MU, ratio)

    def stops(x):
        """The second stop, for the load `x[1]`, from the speed `x[0]`."""
        return pulled + x[1] * (pulled - let_go) / (torque(1.0) - x[1])

    def by_hand(x):
        return ((x[1] - torque(x[2])) / INERTIA * (end - stops(x)))[None]

    def found(x):
        law = waiting(base, x[2], "stop 2")
        return sb.simulate(
            scene(law, None, x[1], x[0], end, lever), max_steps=256
        ).record.y_end.omega[None]

    x = jnp.asarray([OMEGA / 3, load, 0.3])
    value, forward, backward = jacobians(found)(x)
    np.testing.assert_allclose(value, by_hand(x), rtol=1e-11)
    for jacobian in (forward, backward):
        np.testing.assert_allclose(
            jacobian, jax.jacobian(by_hand)(x), rtol=1e-9, atol=1e-12
        )
    result = sb.simulate(
        scene(waiting(base, 0.3, "stop 2"), None, load, OMEGA / 3, end, lever)
    )
    names = [
        event.name
        for event in result.events
        if event.time == times_of(result, "friction_change")[0]
    ]
    assert names[:3] == ["stop", "friction_change", "restart"]
    assert len(times_of(result, "stop")) == 2
    assert float(result.energy["closure"]) <= 1e-12
    # a lasting ramp of the factor, in the time since the stop
    slow = waiting(base, sb.PiecewiseLinear([0.5, 2.5], [1.0, 0.3]), "stop 2")
    result = sb.simulate(scene(slow, None, load, OMEGA / 3, end, lever))
    limit = brentq(
        lambda factor: float(torque(factor * ratio)) - load, 0.3, 1.0, xtol=1e-15
    )
    breaks = float(stops(x)) + 0.5 + 2.0 * (1 - limit) / 0.7
    assert times_of(result, "friction_change") == pytest.approx(
        [float(stops(x))], rel=1e-12
    )
    assert times_of(result, "restart")[-1] == pytest.approx(breaks, rel=1e-10)


def heated_from_outside(
    level,
    power,
    capacity,
    factor,
    *,
    when=None,
    load=9e3,
    stiffness=None,
    end=4.0,
    rises=True,
):
    """A load held at rest while a source warms the rim, `T = T_0 + P t/C`."""
    heat = sb.Heat(
        (sb.thermal.Lump("rim", capacity),),
        sources=(sb.thermal.Source("rim", power),),
        friction=sb.thermal.FrictionHeat(
            "rim", None, sb.thermal.ConstantPartition(1.0)
        ),
        rim="rim",
    )
    when = sb.loads.AtTemperature(level, falling=not rises) if when is None else when
    law = waiting(sb.ConstantFriction(MU, 1.2), factor, when)
    return dataclasses.replace(scene(law, stiffness, load, 0.0, end), heat=heat)


@pytest.mark.slow
def test_hot_rim_begins_a_change():
    """The held load goes as the rim is as hot: `t = (T − T_0) C/P`, exactly, and with
    all derivatives."""
    end = 4.0
    load = 9e3

    def begins(x):
        return (x[0] - 293.15) * x[2] / x[1]

    def by_hand(x):
        return ((load - torque(x[3])) / INERTIA * (end - begins(x)))[None]

    def found(x):
        return sb.simulate(heated_from_outside(*x), max_steps=128).record.y_end.omega[
            None
        ]

    x = jnp.asarray([393.15, 5e4, 1e3, 0.3])
    value, forward, backward = jacobians(found)(x)
    np.testing.assert_allclose(value, by_hand(x), rtol=1e-10)
    for jacobian in (forward, backward):
        np.testing.assert_allclose(jacobian, jax.jacobian(by_hand)(x), rtol=1e-8)
    result = sb.simulate(
        heated_from_outside(*x, when="temperature of the rim above 120 degC")
    )
    assert times_of(result, "friction_change") == pytest.approx(
        [float(begins(x))], rel=1e-12
    )
    assert times_of(result, "restart") == times_of(result, "friction_change")
    never = sb.simulate(heated_from_outside(393.15 + 300.0, *x[1:]))
    assert not times_of(never, "friction_change")
    assert never.status == "held"
    at_once = sb.simulate(heated_from_outside(393.15, *x[1:], rises=False))
    assert times_of(at_once, "friction_change") == [0.0]


@pytest.mark.slow
def test_elastic_band_feels_it_as_a_jump_at_that_time():
    """With its jump of tension: the same as a change at the known time, which other
    tests have proved."""
    x = (393.15, 5e4, 1e3, 0.3)
    time = 2.0
    C = 2e6
    of_heat = sb.simulate(heated_from_outside(*x, stiffness=C))
    law = changed(sb.ConstantFriction(MU, 1.2), jump(time, 0.3))
    known = sb.simulate(
        dataclasses.replace(
            heated_from_outside(*x, stiffness=C), brake=scene(law, C).brake
        )
    )
    (omega, band), (known_omega, known_band) = (
        (r.record.y_end.omega, r.record.y_end.own.x) for r in (of_heat, known)
    )
    assert float(omega) == pytest.approx(float(known_omega), rel=1e-10)
    assert float(band) == pytest.approx(float(known_band), rel=1e-10)
    assert float(of_heat.energy["closure"]) <= 1e-12


@pytest.mark.slow
def test_one_of_two_bands_begins_to_change_at_a_stop():
    """A change that waits, beside one in time, in laws of two bands: each on its own
    linings."""
    laws = waiting(MU, 0.0, "stop 1"), changed(MU, jump(0.2, 0.5))
    bands = tuple(
        sb.brakes.LinedBand(sb.uniform_linings(COUNT, "270 deg", law), share=1.0)
        for law in laws
    )
    brake = sb.brakes.MultiBandBrake(sb.Pulley(0.59, INERTIA), R_B, bands)
    result = sb.simulate(sb.Scene(brake, sb.Duty(2 * T0, 0.0), sb.Initial(OMEGA), 4.0))
    first = float(torque(1.0))
    second = float(torque(0.5))
    stop = 0.2 + (OMEGA * INERTIA - 0.4 * first) / (first + second)
    assert float(result.stopping_time) == pytest.approx(stop, rel=1e-12)
    assert times_of(result, "friction_change") == pytest.approx([stop], rel=1e-12)
    f = result.series([0.1, 0.3, 3.9]).friction_coefficient
    np.testing.assert_allclose(
        f[:, [0, COUNT]], [[MU, MU], [MU, 0.5 * MU], [0.0, 0.5 * MU]], rtol=1e-12
    )


@pytest.mark.slow
def test_stop_on_a_shaft_with_dry_friction():
    """Beside other torques on the shaft, one of them with time breakpoints: the change
    half a second after the stop."""
    load = 9e3
    dry = 400.0
    end = 6.0
    idle = sb.loads.EddyCurrentBrake(
        2e3, 12.0, sb.PiecewiseLinear([0.3, 1.0], [0.0, 0.0])
    )
    law = waiting(sb.ConstantFriction(MU, 1.2), jump(0.5, 0.3), "stop 1")
    given = scene(law, None, load, 10.0, end)
    result = sb.simulate(
        dataclasses.replace(given, shaft=(idle, sb.loads.BearingFriction(dry)))
    )
    stop = 10.0 * INERTIA / (float(torque(1.0)) + dry - load)
    assert times_of(result, "friction_change") == pytest.approx([stop], rel=1e-12)
    assert times_of(result, "restart") == pytest.approx([stop + 0.5], rel=1e-12)
    speed = (load - dry - float(torque(0.3))) / INERTIA * (end - stop - 0.5)
    assert float(result.record.y_end.omega) == pytest.approx(speed, rel=1e-11)


def test_what_begins_a_change_is_read_and_checked():
    changes = '[{ factor = 0.4, when = "stop 3" }, { factor = 0, linings = 2, when = "stop 5" }]'
    text = sb.files.scene_text(scene(changed(MU, 1.0)))
    head, _, rest = text.partition("[brake.linings.friction]\n")
    rest = rest[rest.index("\n[duty") :]
    law = f'type = "ChangingFriction"\nbase = 0.35\nchanges = {changes}\n'
    read = sb.files.scene_from_text(
        f"{head}[brake.linings.friction]\n{law}{rest}"
    ).brake.linings.friction
    assert [change.when.words for change in read.changes] == ["stop 3", "stop 5"]
    cooled = FrictionChange(0.5, when="temperature of the band below 50 degC").when
    assert (cooled.words, float(cooled.level)) == (
        "temperature of the band below 50 °C",
        323.15,
    )
    again = sb.files.scene_from_text(
        sb.files.scene_text(scene(read))
    ).brake.linings.friction
    assert jax.tree.structure(again) == jax.tree.structure(read)
    assert read.changes[1].turned(8).when is read.changes[1].when
    for when, words in (
        ("12 s", "changes.*when: '12 s' begins no change of friction"),
        ("rest", "begins no change of friction.*as in .stop 3."),
        (sb.loads.AtStop(1.5), "1.5 is no whole number"),
        (
            "temperature of the rim above 300 degC",
            "changes.0..when: never comes: no temperature of the rim",
        ),
    ):
        with pytest.raises(sb.InputError, match=words):
            sb.check_scene(scene(waiting(MU, 0.5, when)))
    with pytest.raises(sb.InputError, match="'stop x' is not understood"):
        FrictionChange(0.5, when="stop x")
    phases = sb.loads.Phases((sb.loads.Phase(T0, "stop 2"),))
    with pytest.raises(sb.InputError, match="a number of stops ends no phase"):
        sb.check_scene(scene(MU, T_0=phases))


# --- what goes with it --------------------------------------------------------------


def test_changes_are_written_read_and_turned():
    law = changed(sb.friction.StribeckFriction(0.4, 0.3, 2.0), jump(2.0, 0.4), [3, 4])
    before = scene(law)
    after = sb.files.scene_from_text(sb.files.scene_text(before))
    assert jax.tree.structure(after) == jax.tree.structure(before)
    assert all(
        np.array_equal(a, b)
        for a, b in zip(jax.tree.leaves(after), jax.tree.leaves(before), strict=True)
    )
    text = (pathlib.Path(__file__).parents[2] / "docs" / "recipes.md").read_text(
        "utf-8"
    )
    recipe = re.search(r"type = \"ChangingFriction\".*?(?=```)", text, re.S)
    assert recipe is not None
    head, _, rest = sb.files.scene_text(scene(changed(MU, 1.0))).partition(
        "[brake.linings.friction]\n"
    )
    others = re.search(r"\n\[(?!brake\.linings|\[brake\.linings).*", rest, re.S)
    assert others is not None
    law = recipe[0].replace("linings = 20", "linings = 8")
    written = sb.files.scene_from_text(
        f"{head}[brake.linings.friction]\n{law}{others[0]}"
    ).brake.linings.friction
    np.testing.assert_array_equal(written.changes[0].linings, [3, 4])
    assert [
        float(written.changes[1].linings),
        float(written.changes[1].factor.level),
    ] == [8.0, 0.0]
    turned = sb.studies.turned_scene(before).brake.linings.friction.changes[0]
    np.testing.assert_array_equal(turned.linings, [6, 5])
    np.testing.assert_array_equal(turned.factor.times, [2.0, 2.0])


def test_input_errors():
    cases = {
        "give whole numbers of linings, 1…8": changed(MU, 0.5, [3, 9]),
        "friction is never negative": changed(MU, jump(1.0, -0.1)),
        "changes: is empty": ChangingFriction(MU, ()),
        "put all changes into one law": changed(changed(MU, 0.5), 0.5),
        "self-locking": changed(MU, 14.0),
        "a lever that depends on the speed": changed(
            MU, sb.Driller(sb.PiecewiseLinear([0.0], [1.0]), 1e3)
        ),
    }
    for words, law in cases.items():
        with pytest.raises(sb.InputError, match=words):
            sb.check_scene(scene(law))
    with pytest.raises(sb.InputError, match="linings"):
        FrictionChange(0.5, [0])


def test_change_is_linear_between_points():
    """A ramp of the factor on a rigid band: the stop by quadrature."""
    result = sb.simulate(
        scene(changed(MU, sb.PiecewiseLinear([0.2, 1.0], [1.0, 0.6]), [1, 8]))
    )
    lost = quad(
        lambda t: float(torque(1 - 0.5 * (t - 0.2), MU, jnp.asarray([0, 7]))),
        0.2,
        1.0,
        epsrel=1e-12,
    )[0]
    left = OMEGA - (0.2 * torque(1.0) + lost) / INERTIA
    truth = 1.0 + left * INERTIA / torque(0.6, MU, jnp.asarray([0, 7]))
    assert float(result.stopping_time) == pytest.approx(float(truth), rel=1e-10)
