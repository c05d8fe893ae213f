"""A limit that is reached exactly and not exceeded is no event, and one exceeded by
1e-9 of itself is, of every part that has limits; brakes and bearings at rest:
test_holding."""

import dataclasses
import math

import chain_scenes
import numpy as np
import pytest
import staged_scenes as staged
from scenes import lining_ratio, replaced

import simbrake as sb
from simbrake.loads import RopeElasticity, RopeLayers

MASS = 40e3
DRUM = 0.4
LINES = 8.0
GRAVITY = 9.80665
INERTIA = 1200.0


def on_hook(tension, omega, end, **rope):
    brake = sb.Brake(
        sb.Pulley(0.725, INERTIA),
        sb.Band(0.725),
        sb.uniform_linings(20, "270 deg", 0.35),
    )
    duty = sb.Duty(tension, sb.HookLoad(MASS, DRUM, LINES, **rope))
    return sb.Scene(brake, duty, sb.Initial(omega), end)


def slack_rope(over):
    """A hook that swings by its weight over a drum at rest,
    `F = m g (1 + (1 + over) cos ω t)`."""
    stiffness = 4e6
    stretch = MASS * GRAVITY / stiffness * (2 + over)
    return on_hook(
        60e3, 0.0, 0.5, elasticity=RopeElasticity(stiffness, stretch=stretch)
    )


def full_layer(over):
    """A hook thrown up that winds `J ω_0²/(2 M)` on, and falls again."""
    torque = MASS * GRAVITY * DRUM / LINES
    inertia = INERTIA + MASS * (DRUM / LINES) ** 2
    turns = inertia * 10.0**2 / (2 * torque) / (2 * math.pi)
    return on_hook(
        0.0, -10.0, 1.2, rope=RopeLayers(0.04, 4.0, 4.0 - turns * (1 - over))
    )


def lifted_lining(over):
    """Speeds up for 4 s to where the preload of one lining is `m r ω²`, and slows
    down."""
    radius = 0.61
    masses = np.ones(staged.N)
    preloads = np.full(staged.N, 9e3)
    top = 10.0 + 4 * 3e3 / (staged.J + staged.J_B)
    preloads[1] = masses[1] * radius * top**2 * (1 - over)
    scene = staged.stop(lever=sb.Constant(0.0), w0=10.0, end=6.0, preload=preloads)
    bandage = dataclasses.replace(scene.brake.bandage, mass=masses, mass_radius=radius)
    load = sb.TorqueLoad(sb.PiecewiseLinear([4.0, 4.0], [3e3, -3e3]))
    return replaced(scene, {"brake.bandage": bandage, "duty": sb.Duty(0.0, load)})


def dragged_bandage(over):
    """A load whose peak at 1 s asks all of the rim's friction to speed the bandage
    up."""
    friction = staged.R * staged.F_INT * staged.PRELOAD * staged.N
    peak = friction * (staged.J + staged.J_B) / staged.J_B * (1 + over)
    scene = staged.stop(lever=sb.Constant(0.0), w0=5.0, end=3.0)
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 1.0, 2.0], [0.0, peak, 0.0]))
    return dataclasses.replace(scene, duty=sb.Duty(0.0, load))


def chained_lining(over):
    """A lever whose peak at 2 s is `μ` times the tension of the segment behind the
    first lining, all at rest."""
    peak = lining_ratio(0.3, math.radians(27.0)) * (1 + over)
    return chain_scenes.chain(
        w0=0.0, damping=0.1, end=3.0, J=1e15, lever=((0.0, 2.0, 3.0), (1.0, peak, 1.0))
    )


def slack_segment(over):
    """A lining without friction on its spring, thrown with the speed at which
    `T_1 = T_0 + R ω_0 √(C m) sin ω t` comes to 0; the pulley speeds up, so that it
    never catches up."""
    stiffness = 5.0 / chain_scenes.ARM
    speed = (1 + over) / (chain_scenes.ARM * math.sqrt(stiffness * 1e-3))
    return chain_scenes.chain(
        n=1, f=0.0, w0=speed, m=1e-3, J=1.0, end=0.1, load=((0.0,), (50.0,))
    )


def left_table(over):
    """Linings of a held brake that a source heats from 300 K to 320 K in 2 s, and then
    cools; the end of the table."""
    fade = sb.friction.TabulatedFade(
        np.array([280.0, 300.0 + 20.0 * (1 - over)]), np.array([1.0, 0.8])
    )
    source = sb.thermal.Source("linings", sb.PiecewiseLinear([2.0, 2.0], [2e5, -1e5]))
    rub = sb.thermal.FrictionHeat(None, "linings", 1.0)
    lump = sb.thermal.Lump("linings", 2e4, 300.0)
    law = sb.friction.ProductFriction(0.35, (fade,))
    linings = sb.uniform_linings(20, "270 deg", law)
    heat = sb.Heat((lump,), friction=rub, sources=(source,), linings="linings")
    changes = {"brake.linings": linings, "heat": heat}
    return replaced(on_hook(60e3, 0.0, 4.0), changes)


#: the scene, and the tolerance of one that swings: as far as its state is exact
TOUCHES = {
    "slack rope": (slack_rope, 1e-13),
    "full layer": (full_layer, None),
    "lifted lining": (lifted_lining, None),
    "dragged bandage": (dragged_bandage, None),
    "chained lining": (chained_lining, None),
    "slack segment": (slack_segment, 1e-13),
    "left table": (left_table, None),
}


def changes(result):
    """How often the run changed its mode behind its start."""
    return sum(time > 0 for time, _, _ in chain_scenes.changes(result.record))


DAILY = ("full layer", "slack rope")


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=() if kind in DAILY else pytest.mark.slow)
        for kind in TOUCHES
    ],
)
def test_a_touch_is_no_crossing(kind):
    scene, rtol = TOUCHES[kind]
    fewer, touched, more = (
        sb.simulate(
            scene(over), **({} if rtol is None else {"rtol": rtol}), throw=False
        )
        for over in (-1e-9, 0.0, 1e-9)
    )
    assert touched.status == fewer.status
    assert changes(touched) == changes(fewer)
    assert (more.status, changes(more)) != (touched.status, changes(touched))
