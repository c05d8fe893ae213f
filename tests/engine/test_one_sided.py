"""Derivatives at ties: of both sides where these agree, of one of them where they
differ, none where they diverge.

Every interpolant, law, limiter and profile is looked at where two of its arguments are
equal, or a number is 0.
"""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_one_sided, near
from scenes import lining_ratio, stop_scene

import simbrake as sb
from simbrake.friction import Contact
from simbrake.hybrid import LANDED

V = jnp.linspace(0.0, 13.0, 27)
PLATE = [0.0, 0.1, 1.0, 3.0, 12.0]


def friction_by_values(values, at=PLATE):
    return lambda: (
        lambda x: sb.friction.TabulatedFriction(jnp.asarray(at), x).kinetic(Contact(V)),
        values,
    )


def fade(T, *numbers):
    """Factor at a temperature, by it and the numbers of a `LinearFade`."""
    return lambda: (
        lambda x: sb.LinearFade(*x[1:]).factor(Contact(None, x[0])),
        [T, *numbers],
    )


def table_of_temperature(T):
    law = sb.friction.TabulatedFade
    at = jnp.asarray([293.0, 400.0, 500.0])
    values = jnp.asarray([1.0, 1.0, 0.8])
    return lambda: (
        lambda x: law(at, x[1:] * values).factor(Contact(None, x[0])),
        [T, 1.0, 1.0, 1.0],
    )


def spread(T_n, f):
    """Tensions by the mobilisation rule, by both ends and the friction of three linings
    (`T_n` 0: all slide)."""

    def tensions(x):
        mu = (1 + x[2:] * 0.2) / (1 - x[2:] * 0.2)
        return sb.brakes.mobilised(
            x[0], x[1] if T_n else x[0] * jnp.prod(mu), mu, jnp.full(3, 0.4)
        ).tension

    return lambda: (tensions, [1.0, T_n, *f])


def split(turn):
    sizes = {
        "slack_area": 1e-3,
        "slack_lining_area": 2e-3,
        "tight_area": 2e-3,
        "tight_lining_area": 1e-3,
    }
    band = sb.brakes.ContinuousLining

    def stretch(x):
        law = band(
            modulus=2.1, split=x[0], lining_modulus=0.1, lining_radius=0.6, **sizes
        )
        return law.stretch(jnp.full(4, 0.3), x[1:], 0.6) / 1e3

    return lambda: (stretch, [turn, 1.0, 1.0, 1.0, 1.0])


def lagged(times, count=None):
    """Force of an actuator under a command with a jump, by times, values and lag."""
    k = len(times)

    def force(x):
        command = sb.PiecewiseLinear(x[:k], x[k : 2 * k])
        if count:
            command = sb.Repeated(x[:k], x[k : 2 * k], period=x[-2], count=count)
        law = sb.loads.Actuator(command, lag=x[-1])
        t = jnp.asarray(2.9)
        return law.value(t, law.first_piece(t))

    return lambda: (
        force,
        [*times, *np.linspace(1.0, 2.0, k), *([1.0] if count else []), 0.3],
    )


#: what is looked at, its numbers, and which of them can only rise (+) or fall (-)
CASES = {
    "table, plateau": (friction_by_values([0.35] * 5), ""),
    "table, extremum beside a plateau": (
        friction_by_values([0.30, 0.36, 0.36, 0.30, 0.36]),
        "",
    ),
    "table, two points": (friction_by_values([0.3, 0.3], [0.0, 3.0]), ""),
    "table, by speeds": (
        lambda: (
            lambda x: sb.friction.TabulatedFriction(
                x, jnp.asarray([0.4, 0.38, 0.36, 0.36, 0.36])
            ).kinetic(Contact(V)),
            PLATE,
        ),
        "",
    ),
    "table, at rest and at its last speed": (
        lambda: (
            lambda x: sb.friction.TabulatedFriction(
                PLATE, [0.4, 0.3, 0.3, 0.2, 0.1]
            ).kinetic(Contact(x)),
            [0.0, 12.0],
        ),
        "",
    ),
    "fade table, at its first temperature": (table_of_temperature(293.0), ""),
    "fade table, at a knot": (table_of_temperature(400.0), ""),
    "fade table, at its last temperature": (table_of_temperature(500.0), ""),
    "fade at its corner": (fade(400.0, 2e-3, 400.0, 0.0), ""),
    "fade at the end of its blend": (fade(420.0, 2e-3, 400.0, 0.0, 20.0), ""),
    "fade, blend 0": (fade(430.0, 2e-3, 400.0, 0.0, 0.0), "    +"),
    "fade, slope 0": (fade(430.0, 0.0, 400.0, 0.0), " +"),
    "fade at its floor": (fade(650.0, 2e-3, 400.0, 0.5), ""),
    "Stribeck, equal coefficients": (
        lambda: (
            lambda x: sb.StribeckFriction(*x).kinetic(Contact(V)),
            [0.3, 0.3, 1.0, 2.0],
        ),
        "",
    ),
    "Stribeck, exponent 1": (
        lambda: (
            lambda x: sb.StribeckFriction(*x).kinetic(Contact(V)),
            [0.4, 0.3, 1.0, 1.0],
        ),
        "   +",
    ),
    "pressure, exponent 0": (
        lambda: (
            lambda x: sb.friction.PressureFactor(*x[:2]).factor(
                Contact(None, None, x[2:])
            ),
            [1.0, 0.0, 0.0, 1.0],
        ),
        "  +",
    ),
    "memory, no rate": (
        lambda: (
            lambda x: sb.friction.MemoryProcess(x[0], rate=x[1]).change(
                x[2], Contact(None)
            ),
            [1.0, 0.0, 1.0],
        ),
        " +",
    ),
    "wear, rate 0": (
        lambda: (
            lambda x: sb.wear.LinearWear(*x[:3]).at(x[3]),
            [1.0, -0.01, 300.0, 400.0],
        ),
        "",
    ),
    "wear, at the threshold": (
        lambda: (
            lambda x: sb.wear.ThresholdWear(*x[:3]).at(x[3]),
            [1.0, 503.15, 4e3, 503.15],
        ),
        "",
    ),
    "eddy current, not excited": (
        lambda: (
            lambda x: sb.loads.EddyCurrentBrake(x[0], x[1], sb.Constant(x[2])).torque(
                0.0, x[3], 0, 0.0
            ),
            [4.0, 1.0, 0.0, 2.0],
        ),
        "",
    ),
    "hydrodynamic, at rest": (
        lambda: (
            lambda x: sb.loads.HydrodynamicBrake(x[0]).torque(0.0, x[1], 0, 0.0),
            [4.0, 0.0],
        ),
        "",
    ),
    "tackle without load": (
        lambda: (
            lambda x: (
                sb.loads.TackleLoss(lowering_efficiency=x[0])
                .strung(8.0)
                .torque(0.0, 1.0, 0, x[1])
            ),
            [0.8, 0.0],
        ),
        "",
    ),
    "linings, equal ends": (spread(1.0, [0.3, 0.3, 0.3]), ""),
    "linings without friction": (spread(0.0, [0.0, 0.0, 0.0]), "  +++"),
    "linings, one at its limit": (spread(1.06 / 0.94, [0.3, 0.3, 0.3]), ""),
    "lining split between two elements": (split(2.0), ""),
    "surface layer at a knot": (
        lambda: (
            lambda x: sb.thermal.SurfaceLayer(x[1:4], x[4:], 1.0).resistance(x[0]),
            [400.0, 300.0, 400.0, 500.0, 1.0, 1.0, 2.0],
        ),
        "",
    ),
    "convection at rest": (
        lambda: (
            lambda x: sb.thermal.SpeedCoefficient(*x[:3]).value(x[3], 1.0, 1.0),
            [8.0, 2.0, 0.0, 0.0],
        ),
        "  +",
    ),
    "convection without a difference": (
        lambda: (
            lambda x: sb.thermal.TemperatureCoefficient(*x[:2]).value(0.0, x[2], x[3]),
            [1.5, 0.0, 300.0, 300.0],
        ),
        "",
    ),
    "contact without pressure": (
        lambda: (
            lambda x: (
                sb.thermal.MetalContact(50.0, 0.15, 2e-6, 1.0).conductance(1e-6 * x)
                / 1e3
            ),
            [0.0],
        ),
        "+",
    ),
    "rise at its start": (
        lambda: (
            lambda x: sb.profiles.ExponentialRise(*x[:3]).value(x[3], 1),
            [1.0, 0.5, 2.0, 2.0],
        ),
        "",
    ),
    "actuator, jump": (lagged([0.5, 1.5, 1.5, 2.5]), " -+"),
    "actuator, jump between cycles": (lagged([0.5, 1.0, 1.5], 3), "+ -"),
    "magnitude": (lambda: (lambda x: jnp.abs(x), [0.0]), ""),
}


@pytest.mark.parametrize("name", CASES)
def test_derivative_is_that_of_one_side(name):
    case, ways = CASES[name]
    assert_one_sided(*case(), ways)


# --- whole runs ---------------------------------------------------------------------

LEVER = "duty.slack_tension"


def lever(times, values, **options):
    return stop_scene(C=None, lever=sb.PiecewiseLinear(times, values), **options)


@pytest.mark.slow
def test_jump_points_share_its_derivative():
    """`t = k/2 + …` where the lever doubles at `k`: each of both points moves the
    middle of the jump."""
    table = sb.sensitivity(
        lever([1.0, 1.0], [4e3, 8e3], end=9.0),
        "stopping_time",
        f"{LEVER}.times",
        span=None,
    )
    near(
        [table.at(f"{LEVER}.times[{i}]").derivative for i in (0, 1)], [0.25, 0.25], 1e-9
    )
    near(table.at(f"{LEVER}.times[:]").derivative, 0.5, 1e-9)
    assert not any(row.note for row in table.rows)


@pytest.mark.slow
def test_jump_at_the_start_is_one_sided():
    """Before the start nobody sees it; later by `ε` it costs `ε/2` of the stop."""
    scene = lever([0.0, 0.0], [4e3, 8e3], end=9.0)
    table = sb.sensitivity(scene, "stopping_time", f"{LEVER}.times", span=None)
    whole = table.at(f"{LEVER}.times[:]")
    second = table.at(f"{LEVER}.times[1]")
    assert (whole.derivative, whole.note) == (0.0, "one-sided: 0 below, 0.5 above")
    # the second point alone can only come later
    near(second.derivative, 0.25, 1e-5)
    assert second.note.startswith("one-sided, by differences: 0.25 above")
    assert "one-sided" in str(table)
    assert sb.simulate(scene).derivative_notes() == (
        f"{LEVER}.times: a jump at the start: derivatives by its time are those of an "
        "earlier one, 0",
    )


def first_event(result):
    rows = result.record.rows
    landed = rows.kind == LANDED
    return jnp.where(jnp.any(landed), rows.t[jnp.argmax(landed) + 1], jnp.inf)


@pytest.mark.slow
def test_grazed_event_has_no_derivative():
    """The load on a held brake exceeds its capacity by 1e-10 at the crest of a wave."""
    capacity = 0.7 * 5e3 * (lining_ratio(0.3, np.radians(20.0)) ** 4 - 1)
    linings = sb.Lining(0.3, np.full(4, np.radians(20.0)))
    crest = sb.profiles.FunctionProfile(
        lambda t, size: size * jnp.sin(t), capacity * (1 + 1e-10)
    )
    brake = sb.Brake(sb.Pulley(0.7, 500.0), sb.Band(0.7), linings)
    scene = sb.Scene(brake, sb.Duty(5e3, sb.TorqueLoad(crest)), sb.Initial(0.0), 2.0)
    table = sb.sensitivity(
        scene, first_event, [f"{LEVER}.level", "brake.pulley.inertia"], span=None
    )
    level = table.at(f"{LEVER}.level")
    inertia = table.at("brake.pulley.inertia")
    assert np.isnan(level.derivative)
    assert level.note.startswith("none: ")
    assert (inertia.derivative, inertia.note) == (0.0, "")
    assert any(
        "only just reached" in note for note in sb.simulate(scene).derivative_notes()
    )
