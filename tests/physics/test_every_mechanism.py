"""What every kind of brake can do: derivatives both ways, runs side by side and
prepared, heat, wear, files.

Every mechanism is in two of the three tests, so that each assertion sees bands,
bandages, single linings and pads.
"""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_equal, all_near, jacobians, near

import simbrake as sb

N = 3
BETA = math.radians(70.0)
R = 0.59
R_B = 0.64
AREA = 0.03
CAPACITY = (2e4, 1e3, 5e3)
BANDAGE = sb.Bandage(45.0, sb.ConstantFriction(0.22), 900.0, AREA)
SPRUNG = sb.Bandage(
    np.full(N, 15.0), sb.ConstantFriction(0.22), 900.0, AREA, spring=2e5
)
#: stiffness of the band, its segments, the bandage
KINDS = {
    "rigid band": (None, None, None),
    "elastic band": (2e5, None, None),
    "staged, rigid band": (None, None, BANDAGE),
    "staged, elastic band": (2e5, None, BANDAGE),
    "chain": (2e5, sb.Segments(4e5, 0.3, 2e3), None),
    "bandage on springs": (None, None, SPRUNG),
    "several bands": (None, None, None),
}
#: brakes without a band, by the law of their linings
PRESSED = {
    "disc brake": lambda law: sb.DiscBrake(900.0, sb.Pads(law, 0.5, 0.6, 1.0, N)),
    "double-shoe brake": lambda law: sb.ShoeBrake(
        900.0, sb.Shoes(law, R, 0.1, 0.2, 2.0), 0.5, 0.8
    ),
}


def scene(kind, hot=False):
    """A stop under a ramp of the lever, with a load; `hot`: lumps, fade and wear."""
    stiffness, segments, bandage = KINDS.get(kind, (None, None, None))
    law = sb.ConstantFriction(0.4)
    heat = wear = None
    if hot:
        law = sb.friction.ProductFriction(law, (sb.LinearFade(2e-4, 293.15),))
        rim, linings, band = (
            sb.thermal.Lump(name, C)
            for name, C in zip(("rim", "linings", "band"), CAPACITY, strict=True)
        )
        outer = sb.thermal.FrictionHeat("band", "linings", 0.6)
        heat = sb.Heat(
            bodies=(rim, linings, band, sb.thermal.Reservoir("air")),
            links=(
                sb.thermal.Convection("rim", 2.0, 30.0),
                sb.thermal.Convection("band", 1.0, 10.0),
            ),
            friction=sb.thermal.FrictionHeat("rim", "linings", 0.8),
            external=None if bandage is None else outer,
            linings="linings",
        )
        inner = None if bandage is None else sb.wear.ConstantWear(2e-14)
        wear = sb.Wear(1e-14, internal=inner)
    lever = sb.PiecewiseLinear([0.0, 4.0], [500.0, 9e3])
    load = sb.TorqueLoad(300.0, 2.0)
    if kind in PRESSED:
        return sb.Scene(
            PRESSED[kind](law),
            sb.ForceDuty(lever, load),
            sb.Initial(20.0),
            9.0,
            heat,
            wear=wear,
        )
    pulley = sb.Pulley(R, 900.0)
    mass = None if segments is None else 40.0
    brake = sb.Brake(
        pulley,
        sb.Band(R_B, stiffness, segments),
        sb.Lining(law, np.full(N, BETA), AREA, mass),
        bandage,
    )
    if kind == "several bands":
        bands = [
            sb.brakes.LinedBand(sb.Lining(law, np.full(n, BETA), AREA), share=n)
            for n in (1, N - 1)
        ]
        brake = sb.brakes.MultiBandBrake(pulley, R_B, tuple(bands))
    return sb.Scene(
        brake,
        sb.Duty(lever, load),
        sb.Initial(20.0, 500.0 / 2e5 if stiffness else 0.0),
        9.0,
        heat,
        wear=wear,
    )


def linings_of(kind):
    return (
        [f"brake.bands[{i}].linings" for i in range(2)]
        if kind == "several bands"
        else ["brake.linings"]
    )


def answers(kind, values):
    inertia = "brake.inertia" if kind in PRESSED else "brake.pulley.inertia"
    paths = ("initial.omega", inertia, f"{linings_of(kind)[-1]}.friction.coefficient")
    run = sb.simulate(
        sb.with_values(scene(kind), dict(zip(paths, values, strict=True))),
        rtol=1e-9,
        max_steps=2048,
    )
    work = run.energy
    return (
        jnp.stack([run.stopping_time, run.stopping_angle, work["friction_heat"] / 1e5]),
        work["closure"],
        run.code,
    )


def on(*kinds):
    assert set(kinds) <= {*KINDS, *PRESSED}
    return pytest.mark.parametrize("kind", kinds)


@pytest.mark.slow
@on(
    "rigid band",
    "staged, elastic band",
    "chain",
    "bandage on springs",
    "several bands",
    "double-shoe brake",
)
def test_derivatives_both_ways_and_batches(kind):
    start = np.asarray([20.0, 900.0, 0.4])
    value, forwards, backwards = jacobians(lambda x: answers(kind, x)[0])(
        jnp.asarray(start)
    )
    assert np.all(np.isfinite(value))
    all_near(forwards, backwards, 1e-10, 1e-12 * np.max(np.abs(forwards)))
    assert np.all(forwards[0, :2] > 0)  # a faster, heavier pulley stops later
    # (the run under a derivative takes shorter steps where its tangents ask for them:
    # alone is one without)
    alone = jax.jit(lambda x: answers(kind, x)[0])(jnp.asarray(start))
    all_near(value, alone, 1e-8)
    two = jnp.asarray([start, start * [1.05, 1.0, 1.0]])
    side, closure, code = jax.jit(jax.vmap(lambda x: answers(kind, x)))(two)
    assert not np.any(code)
    assert np.max(closure) < 1e-9
    all_near(side[0], alone, 1e-12)
    # a chord over 5 % of the speed has the mean of the slopes at its ends: the first of
    # them within the bend
    chord = (side[1, 0] - side[0, 0]) / (0.05 * start[0])
    near(chord, forwards[0, 0], 0.05)


@pytest.mark.slow
@on(
    "elastic band",
    "staged, rigid band",
    "staged, elastic band",
    "bandage on springs",
    "several bands",
    "disc brake",
)
def test_heat_wear_prepared_runs_and_files(kind, tmp_path):
    hot = scene(kind, hot=True)
    result = sb.simulate(hot, rtol=1e-9)
    assert result.status == "stopped"
    energy = {name: float(value) for name, value in result.energy.items()}
    assert energy["closure"] < 1e-9
    assert energy["heat_closure"] < 1e-12
    stored = np.asarray(CAPACITY) * (
        np.asarray(result.end_temperatures) - sb.thermal.ROOM
    )
    near(energy["heat_stored"], stored.sum(), 1e-12)
    # V = k W/f of each pair: Archard's law does not ask how the load is spread
    worn = result.record.y_end.worn
    f = 0.4 * np.asarray(
        [1.0, 1 - 2e-4 * (float(np.max(result.end_temperatures)) - 293.15)]
    )
    cosine = 1.0 if kind in PRESSED else math.cos(BETA / 2)
    volume = float(np.mean(hot.brake.linings.area)) * float(np.sum(worn[0])) / cosine
    outer = energy.get("heat_external", energy["friction_heat"])
    assert (
        1e-14 * outer / f[0] * (1 - 1e-6) <= volume <= 1e-14 * outer / f[1] * (1 + 1e-6)
    )
    if "heat_internal" in energy:
        near(
            AREA * float(np.sum(worn[1])), 2e-14 * energy["heat_internal"] / 0.22, 1e-6
        )
    # every pair passes on what its linings give at its radius, and only takes energy
    s = result.series(np.linspace(0.0, 9.0, 40))
    radii = (hot.brake.radius, hot.brake.track_radius)
    for pair, radius, tilt in zip(s.pairs.values(), radii, (cosine, 1.0), strict=False):
        given = radius * np.sum(pair.friction_force, axis=1) / tilt
        all_near(given, pair.torque, 1e-9, 1e-9 * np.max(np.abs(pair.torque)))
        assert np.min(pair.sense * pair.slip_speed) >= 0.0
        assert np.min(np.diff(pair.heat)) >= -1e-12 * energy["friction_heat"]
        assert np.all(
            np.abs(pair.friction_force)
            <= (1 + 1e-9) * pair.friction_coefficient * pair.normal_load + 1e-9
        )
    all_equal(sum(pair.heat for pair in s.pairs.values()), s.friction_heat)
    all_equal(sum(pair.worn_thickness for pair in s.pairs.values()), s.worn_thickness)

    answer = sb.prepare(
        hot,
        ["stopping_time", "energy.friction_heat"],
        rtol=1e-9,
        solver=sb.hybrid.Rodas5P(),
    )()
    near(answer.metrics["stopping_time"], result.stopping_time, 1e-6)
    near(answer.metrics["energy.friction_heat"], energy["friction_heat"], 1e-6)


@pytest.mark.slow
@on(
    "rigid band",
    "elastic band",
    "staged, rigid band",
    "chain",
    "disc brake",
    "double-shoe brake",
)
def test_breakpoints_on_line_change_nothing(kind):
    """All modes are chosen anew at a breakpoint: of a brake that slides, sticks, is
    held, is turned by its load."""
    calm = scene(kind)
    lines = ([0.0, 3.0, 5.0, 6.5, 7.5, 9.0], [500.0, 7e3, 7e3, 100.0, 100.0, 8e3])
    pairs = linings_of(kind) + ["brake.bandage"] * bool(KINDS.get(kind, (None,))[-1])
    calm = sb.with_values(
        calm, {f"{pair}.friction.static_ratio": 1.15 for pair in pairs}
    )
    runs = []
    for more in ([], np.linspace(0.05, 8.95, 61)):
        t = np.union1d(lines[0], more)
        lever = sb.PiecewiseLinear(t, np.interp(t, *lines))
        load = sb.TorqueLoad(900.0, 2.0)
        duty = dataclasses.replace(
            calm.duty, **{calm.duty.lever_field: lever, "load": load}
        )
        runs.append(sb.simulate(dataclasses.replace(calm, duty=duty), rtol=1e-11))
    few, many = ([e for e in run.events if "lever" not in e.name] for run in runs)
    assert [e.name for e in few] == [e.name for e in many]
    # a chain swings: what differs by rounding grows
    atol = 1e-9 if kind == "chain" else 1e-13
    all_near([e.time for e in few], [e.time for e in many], 0, atol)
    one, other = (run.series(np.linspace(0.0, 9.0, 91)) for run in runs)
    for name in ("omega", "phi", "brake_torque", "friction_heat"):
        value = getattr(one, name)
        all_near(value, getattr(other, name), 1e-8, 1e-9 * np.max(np.abs(value)))
    if kind != "disc brake":  # which the load turns throughout
        assert [e.name for e in few if e.name in ("stop", "restart")][:3] == [
            "stop",
            "restart",
            "stop",
        ]
