"""Equations of a scene by themselves: limits at ties, states and rows, thermal flows, what asks for which solver."""

import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes
import wear_scenes as ws
from heat_scenes import FLASH
from helpers import assert_one_sided
from jax.flatten_util import ravel_pytree
from scipy.optimize import brentq
from stop_scenes import stop_scene
from test_every_mechanism import scene as scene_of
from user_parts import (
    AT_REST,
    BETA,
    LAWS,
    T_0,
    Bump,
    Cooling,
    Cubic,
    Derived,
    Doubled,
    N,
    Pressed,
    Quartic,
    R,
    RunningIn,
    Slanted,
    Surging,
    Timed,
    Travelled,
    falling,
    of,
    torque_of,
)

import simbrake as sb
from simbrake._base._corners import clipped, greater, lesser
from simbrake._phases import held_within
from simbrake._physics._assemble import assemble
from simbrake._physics._brake import course_of_profile
from simbrake._physics._shaft import borne_at_rest
from simbrake._physics._sliding import Grip
from simbrake._run._choice import fastest_node, stiff_heat, stiffness
from simbrake.friction import SurfaceState
from simbrake.hybrid import QUADRATURE
from simbrake.profiles import hides_nothing
from simbrake.results import BandMode
from simbrake.studies._sides import Kind, Side, judged
from simbrake.thermal import _network as links

# --- limits at ties ---------------------------------------------------------------------------------------------------


def dry(x):
    return borne_at_rest(*x)


def held(x):
    return held_within(*x)


@pytest.mark.parametrize(
    ("f", "numbers", "ways"),
    [
        (dry, [0.0, 0.0], " +"),
        (dry, [0.0, 2.0], ""),
        (dry, [-3.0, 0.0], " +"),
        (dry, [3.0, 3.0], ""),
        (dry, [-3.0, 3.0], ""),
        (held, [0.0, 2.0, 3.0], ""),
        (held, [6.0, 2.0, 3.0], ""),
        (lambda x: jnp.stack([lesser(*x), greater(*x)]), [1.0, 1.0], ""),
        (lambda x: clipped(*x), [1.0, 1.0, 2.0], ""),
    ],
)
def test_derivative_of_limit_is_one_sided(f, numbers, ways):
    assert_one_sided(f, numbers, ways)


def given(value, error=1e-9):
    return Side(Kind.GIVEN, value, error)


@pytest.mark.parametrize(
    ("slope", "below", "above", "value", "note"),
    [
        (2.0, given(2.0), given(2.0), None, None),
        (2.0, given(2.0), given(3.0), 2.0, "one-sided: 2 below, 3 above"),
        (3.0, given(2.0), given(3.0), 3.0, "one-sided: 2 below, 3 above"),
        (2.5, given(2.0), given(3.0), 3.0, "one-sided, by differences: 2 below, 3 above"),
        (9.0, given(2.0), given(2.0), 2.0, "by differences: 2 below, 2 above (the run itself gives 9)"),
        (2.0, Side(Kind.REFUSED), given(2.0), None, None),
        (9.0, Side(Kind.REFUSED), given(2.0), 2.0, "one-sided, by differences: 2 above"),
        (2.0, Side(Kind.LOST), given(2.0), 2.0, "one-sided: 2 above, no value below"),
        (9.0, Side(Kind.LOST), Side(Kind.LOST), np.nan, "none: no value on either side"),
        (9.0, given(2.0), Side(Kind.DIVERGES), np.nan, "none: differences diverge above"),
        (9.0, Side(Kind.REFUSED), Side(Kind.REFUSED), None, None),
    ],
)
def test_what_is_reported_for_both_sides(slope, below, above, value, note):
    found = judged(slope, below, above)
    if value is None:
        assert found is None
    else:
        assert found.value == pytest.approx(value, nan_ok=True)
        assert found.note.startswith(note)


@pytest.mark.slow
def test_implicit_friction_by_scalar_roots():
    area, v = 0.02, 10.0
    base = sb.friction.ProductFriction(
        sb.ConstantFriction(0.4), (sb.LinearFade(2e-3, 300.0), sb.friction.PressureFactor(reference=1e6, exponent=0.3))
    )
    grip = Grip.of(sb.Lining(base, np.full(5, 0.5), area), FLASH)
    T = np.full(5, 320.0)
    found = grip.coefficients(
        jnp.asarray(2e4), jnp.full(5, v), SurfaceState(jnp.asarray(T)), jnp.asarray(False), static=False
    )
    before = 2e4
    for i in range(5):

        def law(f, before=before):
            mu = (1 + f * math.tan(0.25)) / (1 - f * math.tan(0.25))
            p = before * (1 + mu) * math.sin(0.25) / area
            rise = 2 * f * p * v / 50.0 * math.sqrt(1.44e-5 * 1e-3 / (math.pi * v))
            return 0.4 * (1 - 2e-3 * (320.0 + rise - 300.0)) * (1 + p / 1e6) ** -0.3 - f

        f = brentq(law, 0.0, 1.0, xtol=1e-15)
        assert float(found.f[i]) == pytest.approx(f, rel=1e-12)
        before *= (1 + f * math.tan(0.25)) / (1 - f * math.tan(0.25))

    @jax.jit
    def least(T):
        return grip.coefficients(jnp.asarray(2e4), jnp.full(5, v), SurfaceState(T), jnp.asarray(False), static=False).f[
            -1
        ]

    slope = np.asarray(jax.jit(jax.grad(least))(T))
    h = 1e-3
    for j in (0, 4):
        e = np.eye(5)[j] * h
        central = (float(least(T + e)) - float(least(T - e))) / (2 * h)
        assert float(slope[j]) == pytest.approx(central, rel=1e-7)


def test_flash_temperature_sees_heat_alone():
    """Twice the friction power with half of it as heat is the same flash temperature."""
    flash = sb.thermal.FlashTemperature(50e-6, 48.0, 1.2e-5, 1.0, 300e6)
    linings = sb.uniform_linings(4, math.radians(120), sb.ConstantFriction(0.3))
    law = sb.friction.ProductFriction(sb.ConstantFriction(0.35), (sb.LinearFade(3e-4, 293.15),))
    linings = dataclasses.replace(linings, friction=law)
    args = (jnp.asarray(1e4), jnp.full(4, 5.0), SurfaceState(jnp.full(4, 293.15)), jnp.asarray(False))
    half = Grip.of(linings, flash, sb.PowerShares(mechanical=0.5)).coefficients(*args, static=False).f
    halved = dataclasses.replace(flash, share=0.5)
    np.testing.assert_allclose(half, Grip.of(linings, halved).coefficients(*args, static=False).f, rtol=1e-12)
    assert np.all(np.asarray(half) > np.asarray(Grip.of(linings, flash).coefficients(*args, static=False).f))


# --- which solver a scene asks for ------------------------------------------------------------------------------------


def wall(name, layers, material):
    return sb.thermal.Wall(name, material, 0.08, 1.0, layers)


def shafted(*laws, load=0.0, end=30.0):
    """A rigid brake, its band open, with torques on its shaft."""
    return dataclasses.replace(stop_scene(C=None, T0=0.0, load=load, end=end), shaft=laws)


@pytest.mark.parametrize(("face", "h"), [("front", 500.0), ("back", 500.0), ("front", 1e-3)])
def test_fastest_node_of_a_wall(face, h):
    """`2 Σ g/C` with half of each layer between two nodes, and the half layer behind the face of a link."""
    k, rho, c, A, thickness = 10.0, 100.0, 8.0, 2.0, 0.9
    growth = 2.0 if face == "front" else 0.5
    steps = thickness * growth ** np.arange(3.0) / np.sum(growth ** np.arange(3.0))
    body = sb.thermal.Wall("w", sb.Material(k, rho, c), thickness, A, 3, growth)
    heat = sb.Heat((body, sb.thermal.Reservoir("air")), (sb.thermal.Convection(f"w.{face}", A, h, "air"),))
    half = steps / (2 * k * A)
    inner = 1 / (half[:-1] + half[1:])
    total = np.asarray([inner[0], inner.sum(), inner[1]])
    at = 0 if face == "front" else 2
    total[at] += 1 / (1 / (h * A) + half[at])
    rates = 2 * total / (rho * c * A * steps)
    rate, node = fastest_node(heat)
    assert (rate, node) == (pytest.approx(rates.max(), rel=1e-12), f"w[{1 + np.argmax(rates)}]")
    assert at == np.argmax(rates) or h < 1.0


def test_fastest_node_by_kinds_of_links():
    C, walls = 5.0, [wall(name, 4, sb.Material(10.0, 100.0, 8.0)) for name in "ab"]
    loose = (sb.thermal.Radiation("lump", 1.0, 0.8), sb.thermal.Conductance("lump", "air", 3.0))
    heat = sb.Heat((sb.thermal.Lump("lump", C, 400.0), sb.thermal.Reservoir("air")), loose)
    assert fastest_node(heat) == (pytest.approx(2 * 3.0 / C), "lump")
    assert fastest_node(sb.Heat(heat.bodies, loose[:1]))[0] == 0.0
    assert stiff_heat(sb.Heat(heat.bodies, loose[:1]), 10.0) == (False, "no thermal node gives heat to another")
    step = 0.08 / 4
    half, C = step / (2 * 10.0), 100.0 * 8.0 * step
    for contact in (
        sb.thermal.ThermalContact("a.front", "b.back", 1.0),
        sb.thermal.ThermalContact("a.front", "b.back", 1.0, law=sb.thermal.MetalContact(50.0, 0.15, 2e-6, 3e9)),
    ):
        rate, node = fastest_node(sb.Heat((walls[0], walls[1]), (contact,)))
        assert (rate, node) == (pytest.approx(2 * (2 / (2 * half)) / C, rel=1e-12), node)


@pytest.mark.parametrize(("steps", "stiff"), [(149.0, False), (151.0, True)])
def test_150_steps_of_the_fastest_node(steps, stiff):
    """A step is stable up to six of its times `C/2g`."""
    heat = sb.Heat((sb.thermal.Lump("a", 2.0), sb.thermal.Reservoir("air")), (sb.thermal.Conductance("a", "air", 4.0),))
    assert stiff_heat(heat, 6.0 * steps / 4.0) == (
        stiff,
        "the thermal node a follows within 0.25 s: an explicit method would need at least 1.5e+02 steps to stay stable"
        if stiff
        else "the thermal node a follows within 0.25 s, which an explicit method can follow",
    )


@pytest.mark.parametrize("single", [True, False])
def test_fastest_node_of_a_rim(single):
    """`2 Σ g/C`: of one rim the links of all four linings, of four rims that of each."""
    g, C = np.array([1.0, 2.0, 3.0, 4.0]), 5.0
    rim = sb.thermal.Lump("rim", C) if single else sb.thermal.Lump("rim", C, count=4)
    heat = sb.Heat((rim, sb.thermal.Lump("linings", 100.0, count=4)), (sb.thermal.Conductance("rim", "linings", g),))
    rate, node = fastest_node(heat)
    assert (rate, node) == (pytest.approx(2 * (10.0 if single else 4.0) / C), "rim" if single else "rim[4]")
    if single:  # all of them at one face of a wall, each behind half a layer
        rim, half, C = (
            wall("rim", 1, sb.Material(50.0, 7800.0, 50.0 / (7800.0 * 1.4e-5))),
            0.08 / (2 * 50.0),
            50.0 / 1.4e-5 * 0.08,
        )
        links = (sb.thermal.Conductance("rim.front", "linings", 1e5 * g),)
        heat = sb.Heat((rim, sb.thermal.Lump("linings", 1e9, count=4)), links)
        assert fastest_node(heat) == (pytest.approx(2 * np.sum(1 / (1e-5 / g + half)) / C, rel=1e-12), "rim")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rigid band", "elastic band", "chain", "disc brake"])
@pytest.mark.parametrize("law", [Timed(), Travelled(), RunningIn()], ids=lambda law: type(law).__name__)
def test_jacobian_of_states_of_friction(kind, law):
    system, y, mode = assemble(eqx.tree_at(lambda s: s.brake.linings.friction, scene_of(kind), law))
    sliding = jax.tree.map(jnp.asarray, mode._replace(band=int(BandMode.SLIP)))
    if kind == "chain":
        sliding = sliding._replace(own=sliding.own._replace(linings=jnp.ones(3, jnp.int32)))
        y = y._replace(own=y.own._replace(v=jnp.asarray([1.0, 2.0, 3.0])))
    y = y._replace(omega=jnp.asarray(18.0), memory=(jnp.asarray([0.9, 0.8, 0.7]),))
    flat, back = ravel_pytree(y)
    slope = jax.jit(jax.jacfwd(lambda x: ravel_pytree(system.rhs(jnp.asarray(1.0), back(x), sliding))[0]))(flat)
    kinds = np.concatenate([np.ravel(kind) for kind in jax.tree.leaves(system.couplings())])
    chained = np.flatnonzero(kinds >= 0)
    # not where loads depend on the friction of others, nor where the slip does; nor beside a core that is larger
    loads, slips = isinstance(law, RunningIn) and "band" in kind, isinstance(law, Travelled) and kind == "elastic band"
    coupled = loads or slips
    assert len(chained) == (0 if coupled or kind == "chain" else 3)
    block = np.asarray(slope)[np.ix_(chained, chained)]
    assert np.all(np.diag(block) != 0)
    assert np.count_nonzero(block) == len(chained)
    assert not np.any(np.asarray(slope)[:, kinds == QUADRATURE])


def test_quick_states_ask_for_rosenbrock():
    """600 and 6000 steps to stay stable: with heat, whose steps cost more, 150 are too many, without it 1500."""
    heat = sb.lumped_heat(rim=1e6, partition=sb.thermal.ConstantPartition(1.0), rim_cooling=0.0)
    for steps, needs in ((600, [False, True]), (6000, [True, True]), (60, [False, False])):
        cold = stop_scene(C=None, law=Timed(time=10.0 / (6 * steps)), end=10.0)
        warm = sb.Scene(cold.brake, cold.duty, cold.initial, cold.end_time, heat)
        assert [stiffness(one)[0] for one in (cold, warm)] == needs


def torque_at(law, omega):
    """Brake torque of an assembled rigid brake in full slip."""
    system, state, mode = assemble(stop_scene(C=None, law=law, w0=omega))
    mode = jax.tree.map(jnp.asarray, mode._replace(band=int(BandMode.SLIP)))
    return system.variables(jnp.zeros(()), state._replace(omega=jnp.asarray(omega)), mode).contact.brake_torque


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_law_of_the_speed_is_not_frozen(law):
    several = jax.jit(jax.vmap(lambda omega: torque_at(law, omega)))
    omega = np.asarray([0.0, 5.0, 20.0])
    np.testing.assert_allclose(several(omega), torque_of(falling(R * omega)), rtol=1e-12)


def test_law_of_traced_numbers_is_not_frozen():
    def torque(coefficient):
        return torque_at(Derived(coefficient), 20.0)

    value, slope = jax.jit(jax.value_and_grad(torque))(AT_REST)
    assert float(value) == pytest.approx(torque_of(falling(R * 20.0)), rel=1e-12)
    fz = falling(R * 20.0) * math.tan(BETA / 2)
    Pi = ((1 + fz) / (1 - fz)) ** N
    assert float(slope) == pytest.approx(R * T_0 * Pi * N * 2 / (1 - fz**2) * fz / AT_REST, rel=1e-12)


def test_pressure_where_linings_have_areas():
    area, law = 0.05, Pressed(0.35)
    plain = stop_scene(C=None, law=law)
    pressed = eqx.tree_at(lambda s: s.brake.linings.area, plain, area, is_leaf=lambda x: x is None)
    implicit = [assemble(scene)[0].grip.implicit for scene in (plain, pressed)]
    assert implicit == [False, True]
    system, state, mode = assemble(pressed)
    mode = mode._replace(band=jnp.asarray(int(BandMode.SLIP), jnp.int32))
    tight = T_0
    for _ in range(N):
        f = 0.35
        for _ in range(200):
            fz = f * math.tan(BETA / 2)
            after = tight * (1 + fz) / (1 - fz)
            f = 0.35 * (1 + (tight + after) * math.sin(BETA / 2) / area / 1e6) ** -0.2
        tight = after
    flows = jax.jit(lambda t, y, mode: system.variables(t, y, mode))(jnp.zeros(()), state, mode)
    assert float(flows.contact.tight_tension) == pytest.approx(tight, rel=1e-12)


@pytest.mark.parametrize(
    ("link", "nonlinear", "constant"),
    [
        (sb.thermal.Conductance("a", "b", 1.0), False, True),
        (sb.thermal.ThermalContact("a", "b", 1.0), False, True),
        (sb.thermal.Convection("a", 1.0, 10.0), False, True),
        (sb.thermal.Convection("a", 1.0, 10.0, covered=0.5), False, False),
        (sb.thermal.Convection("a", 1.0, sb.thermal.SpeedCoefficient(10.0, 5.0)), False, False),
        (sb.thermal.Convection("a", 1.0, Cooling()), False, False),
        (sb.thermal.Convection("a", 1.0, sb.thermal.TemperatureCoefficient(2.0)), True, False),
        (sb.thermal.Radiation("a", 1.0, 0.8), True, False),
        (Cubic("a", "b", 1.0), True, False),
    ],
)
def test_what_a_conductance_depends_on(link, nonlinear, constant):
    assert links.reads(link, 3, 1).temperatures is nonlinear
    assert links.reads(link, 1, 1).temperatures is nonlinear
    bodies = (sb.thermal.Lump("a", 1.0, count=3), sb.thermal.Lump("b", 1.0), sb.thermal.Reservoir("air", 300.0))
    assert links.depends_on_temperatures(link, bodies) is nonlinear
    assert links.is_constant(link, bodies) is constant


PLAIN = [
    sb.Constant(1.0),
    sb.ramp(0.0, 1.0, 0.0, 2.0),
    sb.Repeated([0.0, 1.0], [0.0, 5.0], 2.0, 9),
    sb.profiles.ExponentialRise(1.0, 0.3),
    sb.Lever(sb.profiles.ExponentialRise(1.0, 0.3), 0.8, 0.1),
    sb.SpeedHold(1.0),
    Slanted(1.0),
]


SHORT = [
    Bump(1.0),
    Doubled(1.0, 1e-3),
    sb.Lever(Bump(1.0), 0.8, 0.1),
    of(lambda t: t * t),
    of(lambda t: 5.0 * (t < 1.0)),
    of(lambda t: t + 0.0 * jnp.floor(t)),
    of(lambda t: t + jnp.asarray(t, jnp.int32)),
    of(lambda t: 1.0 if t else 0.0),
    of(lambda t: t + (t == 1.0)),
]


@pytest.mark.parametrize(("profile", "plain"), [(x, True) for x in PLAIN] + [(x, False) for x in SHORT])
def test_which_profiles_hide_nothing(profile, plain):
    assert hides_nothing(profile, course_of_profile) is plain
    traced = []
    jax.eval_shape(lambda profile: traced.append(hides_nothing(profile, course_of_profile)), profile)
    assert traced == [plain]


def test_points_inside_steps():
    def samples(**parts):
        return assemble(stop_scene(**parts))[0].guard_samples

    assert samples() == 0
    assert samples(lever=Bump(T_0)) > 0
    assert samples(load=Surging()) > 0


def test_a_steep_drag_asks_for_rosenbrock():
    """A drag `c` is followed within `J/c`: in steps of six of these an explicit method stays stable."""
    drag, dry = sb.loads.ViscousDrag(4e5), sb.loads.BearingFriction(5e3)
    assert stiffness(shafted(drag, dry))[0]
    assert "drag balances the speed within 0.002 s" in stiffness(shafted(drag))[1]
    assert not stiffness(shafted(dry))[0]
    assert not stiffness(shafted(sb.loads.ViscousDrag(4e3), dry))[0]


@pytest.mark.parametrize(("steps", "stiff"), [(1490.0, False), (1510.0, True)])
def test_1500_steps_of_a_drag(steps, stiff):
    """Rates `(c_load + c_shaft)/J` over the time from the start to the end, in steps of six."""
    c = 6.0 * steps / 8.0 * 800.0
    load = sb.TorqueLoad(sb.Constant(0.0), drag=0.75 * c)
    one = sb.with_values(shafted(sb.loads.ViscousDrag(0.25 * c), load=load, end=10.0), {"initial.time": 2.0})
    found = stiffness(one)
    assert found[0] == stiff
    if stiff:
        assert found[1] == (
            f"drag balances the speed within {800.0 / c:.2g} s: "
            "an explicit method would need at least 1.5e+03 steps to stay stable"
        )
    else:
        assert found[1] == "nothing in the scene is stiff"


@pytest.mark.parametrize(("steps", "stiff"), [(1490.0, False), (1510.0, True)])
def test_1500_steps_of_a_damped_rope(steps, stiff):
    """Rate `c (1/m + (r/n)²/J)` over 10 s, in steps of six; with the empty hook where a string hangs at times."""
    m, r, n = 2e3, 0.4, 2
    c = 6.0 * steps / 10.0 / (1 / m + (r / n) ** 2 / 800.0)
    rope = sb.loads.RopeElasticity(stiffness=1e6, damping=c)
    load = sb.loads.TrippingLoad(m, 6e4, 900.0, 1.0, 5.0, 6.0, r, n, count=2, elasticity=rope)
    found = stiffness(shafted(load=load, end=10.0))
    assert (found[0], "the damped rope follows within" in found[1]) == (stiff, stiff)


@pytest.mark.parametrize("scene", [stop_scene, lambda: staged_scenes.stop(), lambda: ws.stop(None, ws.lumps())])
def test_a_scene_without_wear(scene):
    """The program of the other rates is the same without wear, to the letter, and wear is the only state more."""
    scene = shafted()

    def program(scene):
        system, y, mode = assemble(scene)
        rates = jax.jit(lambda t, y, mode: system.rhs(t, y, mode)._replace(worn=None))
        return rates.lower(jnp.zeros(()), y, mode).as_text(), jax.tree.structure(y).num_leaves

    text, leaves = program(scene)
    worn_text, worn_leaves = program(ws.wearing(scene, sb.Wear(1e-14)))
    assert text == worn_text
    assert worn_leaves == leaves + 1
    assert assemble(scene)[0].wearing is None
    with pytest.raises(ValueError, match="no wear"):
        _ = sb.simulate(stop_scene()).worn_thickness


def test_unequal_bands_are_a_warning():
    from simbrake._parts._scene import warnings

    law = sb.friction.ProductFriction(sb.ConstantFriction(0.3), (sb.friction.PressureFactor(1e6, 0.1),))
    assert warnings(stop_scene(C=sb.brakes.ParallelBands((2e5, 3e5)))) == []
    assert warnings(stop_scene(C=sb.brakes.ParallelBands((2e5, 2e5)), law=law)) == []
    scene = stop_scene(C=sb.brakes.ParallelBands((2e5, 3e5)), law=law)
    linings = dataclasses.replace(scene.brake.linings, area=0.1)
    (text,) = warnings(eqx.tree_at(lambda s: s.brake.linings, scene, linings))
    assert text.startswith("unequal_bands: the bands carry 0.4, 0.6")


@pytest.mark.parametrize(("growth", "stiff"), [(1e-3, False), (10.0, True)])
def test_a_users_link_may_be_stiff(growth, stiff):
    # 100 K at the start: g = 1e4 s W/K, so that 2 g/C · 10 s/6 is 17 steps for s = 1e-3, 1.7e5 for s = 10
    heat = sb.Heat(
        (sb.thermal.Lump("a", 2.0, 400.0), sb.thermal.Reservoir("air", 300.0)), (Quartic("a", "air", growth),)
    )
    found, why = stiff_heat(heat, 10.0)
    assert found is stiff
    assert "the thermal node a follows" in why
