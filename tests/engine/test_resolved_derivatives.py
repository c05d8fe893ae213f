"""A differentiated run resolves its derivatives: by numbers without effect, in stiff
runs, through many events.

The steps of a plain run are chosen by the values. Where a number changes no value at
the base point, values alone would let a few long steps cross the whole run, and its
derivative would be integrated blindly.
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, near
from scenes import lining_ratio
from scipy.integrate import quad

import simbrake as sb

N = 12
BETA = math.radians(22.5)
R_B = 0.6
J = 300.0
T_0 = 2500.0
OMEGA = 20.0
F = 0.35
AREA = 0.02
V_S = 0.05
P_R = 1e6
TAU = 0.02
CRITICAL = 0.3


def stop(law, load=0.0, **more):
    """A stop of a rigid band under a constant lever."""
    brake = sb.Brake(
        sb.Pulley(0.57, J), sb.Band(R_B), sb.Lining(law, np.full(N, BETA), AREA)
    )
    load = sb.TorqueLoad(load) if isinstance(load, float) else load
    return sb.Scene(brake, sb.Duty(T_0, load), sb.Initial(OMEGA), 4.0, **more)


def without_effect():
    """Five laws and torques whose numbers are 0 or equal, so that the stop is that of a
    constant torque."""
    law = sb.friction.ProductFriction(
        sb.friction.StribeckFriction(F, F, V_S), (sb.friction.PressureFactor(P_R, 0.0),)
    )
    loads = sb.loads
    shaft = (
        loads.EddyCurrentBrake(0.0, CRITICAL),
        loads.HydrodynamicBrake(0.0),
        loads.ViscousDrag(0.0),
    )
    return stop(
        law, sb.TorqueLoad(sb.profiles.ExponentialRise(0.0, TAU), 0.0), shaft=shaft
    )


def integral(of, points):
    """From rest to the speed at the start; `points`: where it bends most."""
    exact = {"epsabs": 1e-13, "epsrel": 1e-12, "limit": 500}
    return quad(of, 0.0, OMEGA, points=points, **exact)[0]


def truths():
    """Derivatives of the stopping time `∫ J dω/M` in closed form or by quadrature, each
    with the number's size."""
    growth = 2 * math.tan(BETA / 2) / (1 - (F * math.tan(BETA / 2)) ** 2)
    mu = lining_ratio(F, BETA)
    tension = T_0 * mu ** np.arange(N + 1)
    M = R_B * (tension[-1] - T_0)
    by_friction = R_B * tension[-1] * growth  # ∂M/∂f of one lining
    time = J * OMEGA / M

    def by_torque(shape):
        return -J / M**2 * integral(shape, [0.1, 0.3, 1.0])

    pressure = (tension[1:] + tension[:-1]) * math.sin(BETA / 2) / AREA
    drop = -F * np.sum(np.log1p(pressure / P_R)) * by_friction
    stribeck = by_torque(lambda w: N * by_friction * math.exp(-((R_B * w / V_S) ** 2)))
    return time, {
        "brake.linings.friction.base.static_coefficient": (stribeck, F),
        "brake.linings.friction.factors[0].exponent": (-J * OMEGA / M**2 * drop, 1.0),
        "shaft[0].max_torque": (
            by_torque(lambda w: 2 * w * CRITICAL / (w**2 + CRITICAL**2)),
            M,
        ),
        "shaft[1].coefficient": (by_torque(lambda w: w**2), M / OMEGA**2),
        "shaft[2].coefficient": (by_torque(lambda w: w), M / OMEGA),
        "duty.load.drag": (by_torque(lambda w: w), M / OMEGA),
        "duty.load.profile.level": ((time + TAU * math.expm1(-time / TAU)) / M, M),
    }


def wrong(found, time):
    """Error of each derivative over what counts: it, or the metric over the size of the
    number."""
    return {
        path: abs(found[path] - d) / max(abs(d), time / size)
        for path, (d, size) in truths()[1].items()
    }


@pytest.mark.slow
def test_numbers_without_effect_forwards():
    scene = without_effect()
    (time, expected) = truths()

    def stopping_time(x):
        return sb.simulate(
            sb.with_values(scene, dict(zip(expected, x, strict=True)))
        ).stopping_time

    slope = jax.jit(jax.jacfwd(stopping_time))(
        jnp.asarray([F] + [0.0] * (len(expected) - 1))
    )
    assert (
        max(wrong(dict(zip(expected, slope.tolist(), strict=True)), time).values())
        < 1e-7
    )


@pytest.mark.slow
def test_numbers_without_effect_in_reverse():
    time, expected = truths()
    run = sb.prepare(without_effect(), ["stopping_time"])
    slopes = run.gradient()
    assert (
        max(
            wrong(
                {path: slopes[0, run.places[path]].item() for path in expected}, time
            ).values()
        )
        < 1e-7
    )


@pytest.mark.slow
def test_gradient_takes_the_steps_it_needs():
    scene = stop(sb.friction.StribeckFriction(0.45, F, V_S))
    run = sb.prepare(scene, ["stopping_time"])
    # a record that suffices for the values alone
    short = sb.prepare(
        scene,
        ["stopping_time"],
        max_steps=run().accepted + run().rejected + run().retaken + 2,
    )
    all_near(short.gradient(), run.gradient(), 1e-12)
    fine = sb.prepare(scene, ["stopping_time"], max_step=0.01)
    assert fine().accepted > 100 > run().accepted
    near(fine().metrics["stopping_time"], run().metrics["stopping_time"], 1e-10)


def test_value_with_and_without_derivative():
    scene = stop(sb.friction.StribeckFriction(0.45, F, 0.5, 1.5))
    path = "brake.linings.friction.static_coefficient"

    def stopping_time(static):
        return sb.simulate(sb.with_values(scene, {path: static})).stopping_time

    value, slope = jax.jit(jax.value_and_grad(stopping_time))(0.45)
    near(value, sb.simulate(scene).stopping_time, 1e-10)

    def torque(w, f_s=0.45):
        f = F + (f_s - F) * math.exp(-((R_B * w / 0.5) ** 1.5))
        return R_B * T_0 * (lining_ratio(f, BETA) ** N - 1)

    def by_static(w):
        return (1 / torque(w, 0.45 + 1e-5) - 1 / torque(w, 0.45 - 1e-5)) / 2e-5

    truth = J * integral(by_static, [0.5, 1.0, 3.0])
    near(slope, truth, 1e-7)


@pytest.mark.slow
def test_short_record_gives_no_derivative():
    """Not even of what did not happen yet, whose infinite time is a constant."""
    scene = jax.tree.map(jnp.asarray, stop(sb.friction.StribeckFriction(F, F, V_S)))

    def run(s):
        result = sb.simulate(s, max_steps=12)
        found = (
            result.stopping_time,
            result.full_slip_time,
            result.max_tension.value,
            result.energy["friction_heat"],
        )
        return jnp.stack(found), result.code

    def scaled(factor):
        return run(eqx.tree_at(lambda s: s.initial.omega, scene, factor * OMEGA))

    (values, code), (forward, _) = jax.jit(lambda: jax.jvp(scaled, (1.0,), (1.0,)))()
    assert int(code) == sb.hybrid.Code.STEP_LIMIT
    assert np.isinf(float(values[0]))
    assert np.isnan(np.asarray(forward)).all()
    reverse = jax.jit(jax.jacrev(lambda factor: scaled(factor)[0]))(1.0)
    assert np.isnan(np.asarray(reverse)).all()


@pytest.mark.slow
def test_estimated_error_of_derivatives():
    (time, expected) = truths()
    rtol = 1e-6
    truth, size = expected["brake.linings.friction.base.static_coefficient"]
    scene = stop(sb.friction.StribeckFriction(F, F, V_S))
    table = sb.sensitivity(
        scene, "stopping_time", "brake.linings.friction", span=None, rtol=rtol
    )
    row = table.at("brake.linings.friction.static_coefficient")
    assert abs(row.derivative - truth) <= 3 * row.error + 1e-10 * time / size
    assert row.error <= 1e3 * rtol * max(abs(truth), time / size)
    assert "± error" in str(table)


def hot(links, layers=0, slope=0.0):
    """A stop whose rim heats, of one lump or of layers, under friction that fades with
    its temperature."""
    thermal = sb.thermal
    steel = thermal.Material(48.0, 7800.0, 480.0)
    rim = (
        thermal.Wall("rim", steel, 0.025, 0.9, layers)
        if layers
        else thermal.Lump("rim", 2e4)
    )
    place = "rim.front" if layers else "rim"
    heat = sb.Heat(
        bodies=(rim, thermal.Lump("linings", 1e3), thermal.Reservoir("air")),
        links=links,
        friction=thermal.FrictionHeat(place, "linings", 0.8, sensed=place),
        linings="linings",
    )
    fade = sb.friction.LinearFade(slope, 293.15)
    return stop(sb.friction.ProductFriction(0.4, (fade,)), heat=heat)


def compare_with_short_steps(scene, paths, step, tolerance, **options):
    """Derivatives at the default steps beside those of very many short ones, in one
    program."""

    def metric(x, max_step):
        run = sb.simulate(
            sb.with_values(scene, dict(zip(paths, x, strict=True))),
            max_step=max_step,
            **options,
        )
        return run.stopping_time

    slope = jax.jit(jax.value_and_grad(metric))
    known = {leaf.path: float(np.mean(leaf.value)) for leaf in sb.files.leaves(scene)}
    x = jnp.asarray([known[path] for path in paths])
    time, found = slope(x, np.inf)
    truth = slope(x, step)[1]
    size = np.where(x == 0, 1.0, np.abs(x))
    assert (
        np.max(np.abs(found - truth) / np.maximum(np.abs(truth), float(time) / size))
        < tolerance
    )
    assert np.all(truth != 0.0)


@pytest.mark.slow
def test_heat_without_effect():
    thermal = sb.thermal
    links = (
        thermal.Convection("rim", 2.0, 0.0),
        thermal.Radiation("rim", 2.0, 0.0),
        thermal.Conductance("rim", "linings", 0.0),
    )
    paths = [
        "heat.links[0].coefficient",
        "heat.links[1].emissivity",
        "heat.links[2].value",
    ]
    paths += [
        "brake.linings.friction.factors[0].slope",
        "brake.linings.friction.base.coefficient",
    ]
    compare_with_short_steps(hot(links, slope=2e-4), paths, 1e-3, 1e-8, max_steps=8192)
    compare_with_short_steps(hot(links), paths[3:], 1e-3, 1e-8, max_steps=8192)


@pytest.mark.slow
def test_layers_with_rodas5p():
    scene = hot((sb.thermal.Convection("rim.back", 0.9, 30.0),), layers=8)
    paths = [
        "brake.linings.friction.factors[0].slope",
        "brake.linings.friction.base.coefficient",
        "initial.omega",
    ]
    compare_with_short_steps(
        scene, paths, 5e-4, 1e-7, solver=sb.hybrid.Rodas5P(), max_steps=16384
    )


@pytest.mark.slow
def test_a_run_of_a_hundred_events():
    """A pulley that a load turns again and again past a brake that opens and closes."""
    lever = sb.profiles.Repeated(
        [0.0, 0.02, 0.1, 0.12], [200.0, 3e3, 3e3, 200.0], 0.2, 60
    )
    brake = stop(sb.friction.StribeckFriction(F, F, V_S)).brake
    scene = sb.Scene(brake, sb.Duty(lever, 2500.0), sb.Initial(2.0), 12.0)
    assert int(sb.simulate(scene).record.stats.events) >= 100
    paths = [
        "brake.linings.friction.static_coefficient",
        "brake.linings.friction.kinetic_coefficient",
    ]

    def end(x, max_step):
        changed = sb.with_values(scene, dict(zip(paths, x, strict=True)))
        return sb.simulate(changed, max_step=max_step, max_steps=16384).record.y_end.phi

    slope = jax.jit(jax.grad(end))
    x = jnp.asarray([F, F])
    all_near(slope(x, np.inf), slope(x, 1e-3), 1e-7)
