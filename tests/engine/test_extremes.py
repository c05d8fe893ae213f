"""Maxima close to events, corners and equal swings, against closed forms; and equal in
all ways of running."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import T0, W0, N, R, lump, rigid_stop
from helpers import near
from oracles.independent.draws import draw
from oracles.independent.draws import scene as random_scene
from oracles.random_maxima import COVERED, SOLVERS, compared
from scenes import stop_scene
from scipy.optimize import brentq
from shipped import load

import simbrake as sb
from simbrake.hybrid import Rodas5P

MU = (
    (1 + 0.35 * math.tan(math.radians(13.5) / 2))
    / (1 - 0.35 * math.tan(math.radians(13.5) / 2))
) ** N
J = 800.0


def rise(t, force, capacity, cooling):
    """Of a lump in air under the heat of a rigid stop:
    `C T' = M (ω_0 − M t/J) − h T`."""
    M = R * force * (MU - 1)
    slope = M / J
    k = cooling / capacity
    return M / capacity * ((W0 + slope / k) * -jnp.expm1(-k * t) / k - slope * t / k)


def hottest(force, capacity, cooling):
    """Instant and maximum of `rise`, before the stop at the latest."""
    M = R * force * (MU - 1)
    slope = M / J
    k = cooling / capacity
    t = jnp.minimum(jnp.log1p(k * W0 / slope) / k, W0 / slope)
    return jax.lax.stop_gradient(t), rise(
        jax.lax.stop_gradient(t), force, capacity, cooling
    )


def cooled_stop(force, capacity, cooling):
    heat = lump(capacity, cooling=cooling)
    return rigid_stop(sb.ConstantFriction(0.35), heat, 3.0, sb.Constant(force))


# the maximum lies close to the stop, or in the middle of the run
COOLED = [(150e3, 20.0), (787.5, 0.9), (787.5, 0.3), (400.0, 300.0)]


@pytest.mark.parametrize(
    "solver",
    [
        pytest.param(None, id="explicit"),
        pytest.param(Rodas5P(), id="implicit", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(("capacity", "cooling"), COOLED)
def test_highest_temperature_of_a_cooled_rim(capacity, cooling, solver):
    when, truth = hottest(T0, capacity, cooling)
    at = "peak_rim_temperature"
    for rtol in (1e-6, 1e-10):
        result = sb.simulate(
            cooled_stop(T0, capacity, cooling), solver=solver, rtol=rtol
        )
        found = result.report().peaks[at]
        within = 10 * rtol * float(truth) + 1e-11
        near(found.value - 293.15, truth, 0, within)
        near(found.time, when, 0, 10 * math.sqrt(rtol))
        stated = result.accuracy()[at]
        assert abs(found.value - 293.15 - float(truth)) <= 3 * stated + 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(("capacity", "cooling"), COOLED)
def test_derivative_of_the_highest_temperature(capacity, cooling):
    def simulated(force):
        return sb.simulate(cooled_stop(force, capacity, cooling), rtol=1e-12)[
            "peak_rim_temperature"
        ]

    exact = jax.grad(lambda force: hottest(force, capacity, cooling)[1])(T0)
    for derivative in (jax.grad, jax.jacfwd):
        near(derivative(simulated)(T0), exact, 1e-8)


def test_highest_speed_just_after_a_corner():
    """The lever passes the tension that holds the load 2 ms after a corner at 2 s."""
    held = 2e3
    rate = 4e5
    corner = held - 2e-3 * rate
    lever = sb.PiecewiseLinear(
        [0.0, 2.0, 2.1, 9.0], [0.0, corner, corner + 0.1 * rate, corner + 0.1 * rate]
    )
    load = R * held * (MU - 1)
    scene = rigid_stop(sb.ConstantFriction(0.35), None, 9.0, lever, load=load, w0=5.0)
    M = R * (MU - 1)
    # ω' = (load − M T)/J: T rises to the corner over 2 s, then by `rate`
    exact = 5.0 + (load * 2.0 - M * corner * 1.0) / J + 0.5 * M * rate * 2e-3**2 / J
    result = sb.simulate(scene)
    found = result.report().peaks["max_drum_speed"]
    near(found.value, exact, 1e-12)
    near(found.time, 2.002, abs=1e-8)


G = 9.80665
MASS = 40e3
K = 4e6


def hook_load(t, damping):
    """Of a mass on a spring that is let go at 0.4 of its stretch at rest."""
    delta = damping / (2 * MASS)
    omega = jnp.sqrt(K / MASS - delta**2)
    fade = 0.6 * MASS * G * jnp.exp(-delta * t)
    phase = omega * t
    stretch = MASS * G - fade * (jnp.cos(phase) + delta / omega * jnp.sin(phase))
    return stretch + damping / K * fade * (omega + delta**2 / omega) * jnp.sin(phase)


def highest(damping):
    """A run of the mass."""
    elastic = sb.loads.RopeElasticity(K, damping, stretch=0.4 * MASS * G / K)
    load = sb.HookLoad(MASS, 0.4, 8.0, elasticity=elastic)
    scene = stop_scene(C=None, T0=30e3, w0=0.0, load=load, end=3.0)
    return sb.simulate(scene, rtol=1e-12)


def time_of_the_first(damping):
    omega = math.sqrt(K / MASS)
    slope = jax.grad(hook_load)
    return brentq(
        lambda t: slope(t, damping),
        0.9 * math.pi / omega,
        1.1 * math.pi / omega,
        xtol=1e-15,
    )


#: the second swing is lower by 2e-6, or 2e-3
DAMPINGS = pytest.mark.parametrize("damping", [0.4, 400.0])


@DAMPINGS
def test_first_of_nearly_equal_swings_is_the_highest(damping):
    when = time_of_the_first(damping)
    found = highest(damping).report().peaks["max_hook_load"]
    near(found.value, hook_load(when, damping), 1e-11)
    near(found.time, when, abs=1e-6)


@pytest.mark.slow
@DAMPINGS
def test_derivative_of_the_highest_of_nearly_equal_swings(damping):
    when = time_of_the_first(damping)
    exact = jax.grad(hook_load, argnums=1)(when, damping)
    slope = jax.jit(jax.grad(lambda c: highest(c)["max_hook_load"]))
    near(slope(damping), exact, 1e-7)


RANDOM = [
    ("rigid band", "hot", 3),
    ("elastic band", "hot", 4),
    ("elastic band", "plain", 5),
    ("disc", "hot", 2),
    ("shoe", "hot", 0),
    ("staged, elastic band", "plain", 9),
    ("chain", "plain", 5),
    ("several bands", "hot", 1),
]


@pytest.mark.slow
@pytest.mark.parametrize("solver", [None, Rodas5P()], ids=["chosen", "implicit"])
@pytest.mark.parametrize(("kind", "flavour", "seed"), RANDOM)
def test_no_instant_of_a_run_exceeds_its_maxima(kind, flavour, seed, solver):
    result = sb.simulate(
        random_scene(draw(kind, flavour, seed)), solver=solver, rtol=1e-9
    )
    rows = np.unique(np.asarray(result.record.rows.t)[: int(result.record.count) + 1])
    inside = rows[:-1, None] + np.linspace(0.0, 1.0, 60) * np.diff(rows)[:, None]
    times = np.unique(np.concatenate([rows, inside.ravel()]))
    looks = result.series(times), result.series(times, left=True)
    columns = {
        "max_normal_load": "normal_load",
        "max_drum_speed": "omega",
        "peak_rim_temperature": "rim_temperature",
    }
    columns |= {
        "peak_lining_temperature": "lining_temperature",
        "max_hook_load": "hook_load",
    }
    peaks = result.report().peaks
    for name in columns.keys() & peaks.keys():
        seen = max(
            float(np.max(np.abs(np.asarray(getattr(look, columns[name])))))
            for look in looks
        )
        assert peaks[name].value >= seen * (1 - 1e-12), name
        assert peaks[name].value <= seen * (1 + 1e-3), name


@pytest.mark.slow
@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize(("kind", "flavour", "seed"), RANDOM[::2])
def test_maxima_close_to_a_corner_are_as_exact_as_the_run(kind, flavour, seed, method):
    found = list(compared(kind, flavour, seed, method))
    assert len(found) >= 8
    assert not [one for one in found if not one.holds]
    covered = [one.covered for one in found if one.covered is not None]
    assert sum(covered) >= COVERED * len(covered)


SCENES = ["u2_5_5_stop", "disc_stop", "unequal_bands"]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_maxima_are_the_same_in_every_way_of_running(name):
    scene = load(name).scene()
    names = [
        m
        for m in sb.results.metric_names(scene)
        if m.startswith(("max_", "peak_", "min_"))
    ]
    result = sb.simulate(scene, rtol=1e-8)
    prepared = sb.prepare(scene, names, rtol=1e-8)().metrics
    speeds = np.full(4, float(scene.initial.omega))
    # (the holding reserve needs the whole record of a run: without it runs go side by
    # side)
    columns = [
        sb.studies.ensemble(
            scene, {"initial.omega": speeds}, metrics=some, rtol=1e-8, chunk=4
        )
        for some in (names, [one for one in names if one != "min_holding_reserve"])
    ]
    for one in names:
        assert prepared[one] == pytest.approx(float(result[one]), rel=1e-13), one
        for many in columns:
            if one in many:
                assert np.asarray(many[one]) == pytest.approx(
                    float(result[one]), rel=1e-13
                ), one
