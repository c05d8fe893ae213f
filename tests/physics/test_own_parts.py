"""User-defined friction laws, thermal links, profiles and brakes: what they read is
found without a word of theirs."""

import dataclasses
import functools
import math
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_near, input_error, names_of, near
from scenes import stop_run, stop_scene
from scipy.integrate import quad, solve_ivp
from user_parts import AT_REST, T_0, Bump, Derived, J, R, falling, of, torque_of

import simbrake as sb
from simbrake import plot
from simbrake.friction import FrictionWithMemory, MemoryProcess

# --- friction laws: the same coefficient written in many ways ------------------------


def test_a_shipped_law_made_to_fall():
    """Frozen at rest it would stop the second pulley as well."""
    result = stop_run(C=None, law=Derived(AT_REST))
    stop = quad(
        lambda w: J / torque_of(falling(R * w)), 0.0, 20.0, epsabs=1e-12, epsrel=1e-12
    )[0]
    near(result.stopping_time, stop, 1e-10)
    load = 0.5 * (torque_of(AT_REST) + torque_of(falling(R * 20.0)))
    result = stop_run(C=None, law=Derived(AT_REST), load=load)
    run = solve_ivp(
        lambda t, w: (load - torque_of(falling(R * w))) / J,
        (0.0, 5.0),
        [20.0],
        rtol=1e-12,
        atol=1e-10,
    )
    assert result.status == "runaway"
    near(result.record.y_end.omega, run.y[0, -1], 1e-9)
    assert run.y[0, -1] > 20.0


# --- temperature and pressure, where the scene has them -----------------------------


class Fading(sb.ConstantFriction):
    """Falls with the temperature where there is one."""

    def kinetic(self, contact):
        f = jnp.asarray(self.coefficient)
        return (
            f if contact.T is None else f * (1 - 1e-3 * (contact.T - sb.thermal.ROOM))
        )

    def static(self, contact):
        return self.kinetic(contact)


def heated(law, capacity):
    """A stop whose friction heat stays in a rim of one node, which the law senses."""
    heat = sb.Heat(
        (sb.thermal.Lump("rim", capacity, sb.thermal.ROOM),),
        friction=sb.thermal.FrictionHeat("rim", None, 1.0),
    )
    return eqx.tree_at(
        lambda s: s.heat, stop_scene(C=None, law=law), heat, is_leaf=lambda x: x is None
    )


def test_optional_temperature_fades_if_given():
    result = sb.simulate(heated(Fading(0.35), capacity=500.0), rtol=1e-12)

    def slowness(w):
        T = 0.5 * J * (20.0**2 - w**2) / 500.0
        return J / torque_of(0.35 * (1 - 1e-3 * T))

    stop = quad(slowness, 0.0, 20.0, epsabs=1e-12, epsrel=1e-12)[0]
    near(result.stopping_time, stop, 1e-9)
    assert stop > 1.2 * 20.0 * J / torque_of(0.35)


class ConstantShear(sb.friction.AbstractFriction):
    """Friction whose stress does not depend on the pressure, `f = τ/p` up to 2."""

    stress: object = sb.quantity("Pa", "shear stress", low=0.0)

    def kinetic(self, contact):
        return self.stress / jnp.maximum(contact.p, self.stress / 2)

    def static(self, contact):
        return self.kinetic(contact)


def test_constant_shear_stress_brakes_as_in_closed_form():
    """`T_i − T_{i−1} = τ A/cos(β/2)` whatever the tension; derivatives likewise."""
    n = 24
    beta = math.radians(200.0) / n
    area = 0.02

    def stop_of(stress, omega, slack):
        linings = sb.Lining(ConstantShear(stress), np.full(n, beta), area=area)
        brake = sb.Brake(sb.Pulley(R, J), sb.Band(R), linings)
        duty = sb.Duty(slack, 0.0)
        scene = sb.Scene(brake, duty, sb.Initial(omega), 9.0)
        return sb.simulate(scene, rtol=1e-11).stopping_time

    stress = 1.6e6 / n
    stop = 20.0 * J * math.cos(beta / 2) / (R * n * stress * area)
    program = jax.jit(jax.value_and_grad(stop_of, (0, 1, 2)))
    found, slopes = program(stress, 20.0, T_0)
    near(found, stop, 1e-12)
    all_near(slopes[:2], [-stop / stress, stop / 20.0], 1e-10)
    assert abs(float(slopes[2])) * T_0 < 1e-10 * stop


# --- profiles -----------------------------------------------------------------------


def test_bump_on_a_profile_is_not_missed():
    result = sb.simulate(stop_scene(C=None, lever=Bump(T_0), end=2.0), rtol=1e-12)
    stop = 20.0 * J / torque_of(0.35) - 4.0 * 0.005 * math.sqrt(math.pi)
    near(result.stopping_time, stop, 1e-9)


# --- another kind of brake ----------------------------------------------------------


class ConeLining(sb.brakes.AbstractLinings):
    """The lining of a cone."""

    friction: sb.friction.AbstractFriction
    inner_radius: Any = sb.quantity("m", "inner radius", positive=True)
    outer_radius: Any = sb.quantity("m", "outer radius", positive=True)
    half_angle: Any = sb.quantity(
        "rad", "half of the angle of the cone", positive=True, high=math.pi / 2
    )

    @property
    def count(self):
        return 1

    @property
    def area(self):
        return (
            jnp.pi
            * (jnp.asarray(self.outer_radius) ** 2 - self.inner_radius**2)
            / jnp.sin(self.half_angle)
        )

    @property
    def weights(self):
        return jnp.ones(1)


class ConeBrake(sb.brakes.AbstractPressedBrake):
    """`M = f F (r_i + r_o)/(2 sin α)`."""

    inertia: Any = sb.quantity("kg*m^2", "inertia about the shaft", positive=True)
    linings: ConeLining
    words: ClassVar[sb.brakes.BrakeWords] = sb.brakes.BrakeWords(
        "cone brake", "lining", "cone"
    )

    @property
    def radius(self):
        return 0.5 * (
            jnp.asarray(self.linings.inner_radius) + self.linings.outer_radius
        )

    def normal(self, force, f, back):
        return jnp.broadcast_to(force / jnp.sin(self.linings.half_angle), (1,))


@pytest.mark.slow
def test_custom_cone_brake_is_a_full_brake():
    f = 0.3
    F = 2e3
    r_i = 0.20
    r_o = 0.26
    alpha = math.radians(12.5)
    inertia = 50.0
    omega = 60.0
    load = 50.0
    rim = sb.thermal.Lump("rim", 5e3)
    linings = sb.thermal.Lump("linings", 500.0)
    heat = sb.Heat(
        (rim, linings),
        (),
        sb.thermal.FrictionHeat("rim", "linings", 0.8),
        linings="linings",
    )
    brake = ConeBrake(inertia, ConeLining(sb.ConstantFriction(f, 1.2), r_i, r_o, alpha))
    duty = sb.ForceDuty(F, load)
    scene = sb.Scene(
        brake,
        duty,
        sb.Initial(omega),
        12.0,
        heat,
        wear=sb.Wear(1e-14),
    )
    run = sb.simulate(scene)
    N = F / math.sin(alpha)
    r = 0.5 * (r_i + r_o)
    stop = inertia * omega / (f * N * r - load)
    near(run.stopping_time, stop, 1e-11)
    assert names_of(run) == ["slip_onset", "full_slip", "stop"]
    assert run.status == "stopped"
    friction = f * N * r * omega * stop / 2
    near(run.energy["friction_heat"], friction, 1e-11)
    near(run.end_temperatures[1] - sb.thermal.ROOM, 0.2 * friction / 500.0, 1e-9)
    worn = 1e-14 * N * r * omega * stop / 2 / float(brake.linings.area)
    all_near(run.worn_thickness, worn, 1e-9)

    (table,) = sb.sensitivity(
        scene, ["stopping_time"], ["brake.linings.half_angle"], span=None
    )
    slope = stop**2 * f * r * N / math.tan(alpha) / (inertia * omega)
    near(table.rows[0].derivative, slope, 1e-9)
    with input_error(match="is a cone brake: this draws discs and drums"):
        plot.pressed(run)


class ServoBrake(sb.brakes.AbstractPressedBrake):
    """Pads of which each presses the next one on: `N_1 = F`,
    `N_{i+1} = N_i (1 + k f_i)`."""

    inertia: Any = sb.quantity("kg*m^2", "inertia about the shaft", positive=True)
    linings: sb.Pads
    share: Any = sb.quantity(
        "1", "share of its friction with which a pad presses", default=1.5
    )
    words: ClassVar[sb.brakes.BrakeWords] = sb.brakes.BrakeWords(
        "servo brake", "pad", "disc"
    )
    can_lock: ClassVar[bool] = True

    @property
    def radius(self):
        return self.linings.radius

    def normal(self, force, f, back):
        factors = 1 + self.share * jnp.broadcast_to(f, (self.linings.count,))
        return force * jnp.concatenate([jnp.ones(1), jnp.cumprod(factors[:-1])])


def test_linings_that_press_others_on_are_coupled_by_their_friction_states():
    """The Jacobian of a stiff step needs the coupling: without it the order falls, and
    755 steps are taken."""
    f = 0.35
    end = 0.3
    work = 3e4
    force = 4e3
    speed = 60.0
    pads = sb.Pads(
        FrictionWithMemory(f, (MemoryProcess(end, work=work),)), 0.3, 0.5, 0.7, faces=6
    )
    brake = ServoBrake(800.0, pads)
    scene = sb.Scene(brake, sb.ForceDuty(force, 0), sb.Initial(speed), 2.0)
    result = sb.simulate(scene, solver=sb.hybrid.Rodas5P(), rtol=1e-8)
    r = float(brake.radius)
    area = float(pads.area)

    def rhs(t, y):
        c = y[1:]
        friction = f * c * force * np.append(1.0, np.cumprod(1 + 1.5 * f * c[:-1]))
        return np.append(
            -r * friction.sum() / 800.0, (end - c) * friction * r * y[0] / area / work
        )

    truth = solve_ivp(
        rhs, (0, 2), [speed, *np.ones(6)], method="DOP853", rtol=1e-12, atol=1e-14
    ).y[:, -1]
    y = result.record.y_end
    all_near([y.omega, *y.memory[0]], truth, 1e-8)
    assert int(result.record.stats.accepted) < 150


class Ramped(sb.ConstantFriction):
    """Written as for single numbers."""

    def kinetic(self, contact):
        return self.coefficient if contact.v > 10 else 0.9 * self.coefficient


class Exponential(sb.ConstantFriction):
    def kinetic(self, contact):
        return self.coefficient * np.exp(-contact.v)


class Late(sb.Constant):
    def value(self, t, piece):
        return self.level if t > 1 else 0.5 * self.level


class Windy(sb.TorqueLoad):
    def torque(self, t, omega, piece):
        return 5.0 * math.sqrt(omega)


@pytest.mark.parametrize(
    ("place", "part", "words"),
    [
        (
            lambda s: s.brake.linings.friction,
            Ramped(0.4),
            "brake.linings.friction: Ramped.kinetic needs",
        ),
        (
            lambda s: s.brake.linings.friction,
            Exponential(0.4),
            "brake.linings.friction: Exponential.kinetic needs",
        ),
        (lambda s: s.duty.slack_tension, Late(8e3), "Late.value: needs"),
        (lambda s: s.duty.load, Windy(0.0), "Windy.torque: needs"),
    ],
)
def test_own_parts_written_for_plain_numbers(place, part, words):
    with input_error(
        match=r"test_own_parts.py, line \d+.*jnp.where in place of `if`"
    ) as caught:
        sb.simulate(eqx.tree_at(place, stop_scene(), part))
    assert words in str(caught.value)


# --- laws that are not finite where a run begins ------------------------------------


class AtNoPressure(sb.friction.AbstractFriction):
    def kinetic(self, contact):
        return 0.3 / contact.p

    def static(self, contact):
        return 0.3 / contact.p


class TooFast(sb.friction.AbstractFriction):
    def kinetic(self, contact):
        return 0.3 * jnp.sqrt(10.0 - contact.v)

    def static(self, contact):
        return jnp.full_like(contact.v, 1.0)


class Pushing(TooFast):
    def kinetic(self, contact):
        return 0.3 - 0.1 * contact.v


class Slippery(TooFast):
    def kinetic(self, contact):
        return 1.1 - 0.01 * contact.v


class Worded(TooFast):
    def kinetic(self, contact):
        return "0.3"

    def static(self, contact):
        return 1.2 * self.kinetic(contact)


class Spring(sb.loads.AbstractLoad):
    profile: sb.profiles.AbstractProfile = sb.Constant(1.0)

    def torque(self, t, omega, piece):
        return 1.0 / t


class Drag(sb.shaft.AbstractShaftTorque):
    profile: sb.profiles.AbstractProfile = sb.Constant(1.0)
    place: str | None = None

    def torque(self, t, omega, piece, load):
        return jnp.log(omega - 20.0)


class Nothing(Drag):
    def torque(self, t, omega, piece, load):
        return None


class Both(Drag):
    def torque(self, t, omega, piece, load):
        return jnp.ones(2)


class WearAtPressure(sb.wear.AbstractWearRate):
    def at(self, T):
        return jnp.asarray(1e-14)

    def __call__(self, p, v, T):
        return 1e-9 / p


def test_law_that_is_impossible_at_the_start_is_named_once(request):
    changes = (
        {"wear": sb.Wear(WearAtPressure())},
        {"law": AtNoPressure()},
        {"law": TooFast()},
        {"law": Pushing()},
        {"law": Slippery()},
        {"law": Worded()},
        {"law": sb.friction.ProductFriction(AtNoPressure(), ())},
        {"duty": sb.Duty(of(lambda t: 8e3 / t), 0.0)},
        {"duty": sb.Duty(8e3, sb.TorqueLoad(of(jnp.log)))},
        {"duty": sb.Duty(8e3, Spring())},
        {"shaft": (Drag(),)},
        {"shaft": (Nothing(),)},
        {"shaft": (Both(),)},
    )

    def run(law=None, **change):
        scene = stop_scene(C=None, law=law)
        scene = sb.with_values(scene, {"brake.linings.area": 0.01})
        sb.simulate(dataclasses.replace(scene, **change))

    runs = (functools.partial(run, **change) for change in changes)
    assert_refused(request, "own_parts", runs)
