"""Events and ends of a run that heat brings about, and coefficients of friction that
are implicit."""

import dataclasses
import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import BETA, FLASH, T0, W0, C, N, R, fading, warmed
from helpers import all_near, input_error, jacobians, near
from scenes import lining_ratio
from scipy.integrate import quad

import simbrake as sb

# --- events that heat brings about ---------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [C, None])
def test_held_brake_lets_go_when_heated(stiffness):
    z = math.tan(BETA / 2)
    load = 2.0e4
    result = sb.simulate(
        warmed(fading(slope=1e-3), 2e4, load, stiffness, end=150.0), throw=False
    )
    mu = (load / (R * T0) + 1) ** (1 / N)
    f = (mu - 1) / (mu + 1) / z
    t = (1 - f / 0.35) / 1e-3 / 2.0
    events = {event.name: event.time for event in result.events}
    near(events["restart"], t, 1e-10)
    near(events["permissible_temperature"], 25.0, 1e-10)
    held = result.series(np.linspace(0.0, 0.999 * t, 50))
    assert np.all(np.asarray(held.omega) == 0.0)
    assert np.all(np.asarray(held.phi) == 0.0)


@pytest.mark.slow
def test_self_locking_by_heat_is_reported():
    """By an event (elastic band) or a named code (rigid band)."""
    rising = sb.friction.ProductFriction(
        0.9,
        (
            sb.friction.TabulatedFade(
                np.asarray([250.0, 350.0, 900.0]), np.asarray([0.9, 1.0, 2.5])
            ),
        ),
    )
    elastic = sb.simulate(warmed(rising, 4e4, n=4, beta=math.radians(60.0), end=140.0))
    (locked,) = elastic.events["self_locking"].times
    T = sb.thermal.ROOM + 4.0 * locked
    factor = float(
        rising.factors[0].factor(sb.friction.Contact(v=None, T=jnp.asarray([T])))[0]
    )
    near(0.9 * factor * math.tan(math.radians(30.0)), 1.0, 1e-9)
    rigid = sb.simulate(
        warmed(rising, 4e4, n=4, beta=math.radians(60.0), end=140.0, stiffness=None),
        throw=False,
    )
    assert rigid.status == "singular_geometry"
    near(rigid.record.t_end, locked, 1e-9)


@pytest.mark.slow
def test_a_table_that_is_left():
    def law(*T):
        return sb.friction.ProductFriction(
            0.3,
            (sb.friction.TabulatedFade(np.asarray(T), np.asarray([1.0, 0.8])),),
        )

    result = sb.simulate(warmed(law(280.0, 400.0), 2e4), throw=False)
    assert result.status == "outside_table"
    near(result.record.t_end, (400.0 - 293.15) / 2.0, 1e-10)
    with input_error(match="does not cover the start"):
        sb.simulate(warmed(law(300.0, 400.0), 2e4))


def test_flash_temperature_of_moving_source():
    near(FLASH.rise(jnp.asarray(1e8), jnp.asarray(20.0)), 60.5551805284838, 1e-12)


def test_flash_temperature_of_a_slow_source():
    """Tian and Kennedy: `ΔT = 2 q b/(λ √(π (1.273 + Pe)))`, `Pe = v b/(2 a)`, of a
    round spot of radius `b`; at rest `q b/λ` (Carslaw and Jaeger)."""
    slow = dataclasses.replace(FLASH, slow=True)
    q = 1e8
    b = 0.5e-3
    a = 1.44e-5
    near(slow.rise(jnp.asarray(q), jnp.asarray(0.0)), q * b / 50.0, 1e-12)
    for v in (1e-3, 0.1, 20.0):
        truth = (
            2 * q * b / (50.0 * math.sqrt(math.pi * (4 / math.pi + v * b / (2 * a))))
        )
        near(slow.rise(jnp.asarray(q), jnp.asarray(v)), truth, 1e-12)


@pytest.mark.slow
def test_stop_with_flash_and_derivatives():
    """`t = ∫ J dω/M(f)` with `f = f_0 (1 − s (ΔT_rim + κ f v/√(v + v_0)))`, solved for
    `f`; by quadrature."""
    a = 1.44e-5
    hardness = 3e7
    capacity = 1e5
    J = 900.0
    n = 4
    beta = math.radians(50.0)
    at = {"f_0": 0.35, "s": 1e-3, "l": 1e-3}

    def time(f_0, s, l):
        kappa = 2 * hardness / 50.0 * math.sqrt(a * l / math.pi)
        v_0 = 16 * a / (math.pi * l)

        def needs(w):
            v = R * w
            rim = J * (W0**2 - w**2) / (2 * capacity)
            f = f_0 * (1 - s * rim) / (1 + f_0 * s * kappa * v / math.sqrt(v + v_0))
            return J / (R * T0 * (lining_ratio(f, beta) ** n - 1))

        return quad(
            needs, 0.0, W0, epsabs=0, epsrel=1e-12, points=[0.05, 0.5], limit=200
        )[0]

    def run(x):
        law = sb.friction.ProductFriction(x[0], (sb.LinearFade(x[1], 293.15, 0.0),))
        flash = sb.thermal.FlashTemperature(x[2], 50.0, a, 1.0, hardness, slow=True)
        partition = sb.thermal.ConstantPartition(1.0)
        heat = dataclasses.replace(
            sb.lumped_heat(rim=capacity, partition=partition, rim_cooling=0.0),
            flash=flash,
        )
        brake = sb.Brake(sb.Pulley(R, J), sb.Band(R), sb.Lining(law, np.full(n, beta)))
        scene = sb.Scene(brake, sb.Duty(T0, 0.0), sb.Initial(W0), 3.0, heat)
        return sb.simulate(scene, rtol=1e-12, max_steps=512).stopping_time[None]

    value, forwards, backwards = jacobians(run)(jnp.asarray([*at.values()]))
    near(value[0], time(**at), 1e-10)
    moved = [
        (time(**{**at, name: 1.0001 * x}), time(**{**at, name: 0.9999 * x}))
        for name, x in at.items()
    ]
    slopes = [
        (up - down) / (2e-4 * x)
        for (up, down), x in zip(moved, at.values(), strict=True)
    ]
    all_near(forwards[0], slopes, 1e-6)
    all_near(backwards[0], slopes, 1e-6)


@pytest.mark.slow
def test_flash_fold_is_named():
    """Friction that rises with temperature feeds its own flash: warmed far enough, the
    branch without flash ends."""
    table = np.asarray([250.0, 400.0, 450.0, 2000.0]), np.asarray([0.9, 1.0, 2.2, 2.3])
    rising = sb.friction.ProductFriction(0.3, (sb.friction.TabulatedFade(*table),))
    flash = sb.thermal.FlashTemperature(
        length=1e-3, conductivity=50.0, diffusivity=1.44e-5, hardness=3.0e7
    )
    scene = warmed(
        rising, 1e5, stiffness=None, end=80.0, flash=flash, capacity=1e5, w0=20.0
    )
    scene = eqx.tree_at(lambda s: s.brake.pulley.inertia, scene, np.asarray(1e6))
    result = sb.simulate(scene, throw=False)
    assert result.status == "flash_fold", result.message
    T = float(result.end_temperatures[0])
    v = R * float(result.record.y_end.omega)
    per_f = 2 * 3.0e7 * v / 50.0 * math.sqrt(1.44e-5 * 1e-3 / (math.pi * v))
    f = np.linspace(0.28, 0.5, 2001)
    excess = f - 0.3 * np.asarray(
        rising.factors[0].factor(
            sb.friction.Contact(v=None, T=jnp.asarray(T + per_f * f))
        )
    )
    # here the hill of the residual, behind the first root, has just sunk to 0
    hill = excess[np.argmax(np.diff(excess) < 0)]
    assert abs(hill) < 1e-4
