"""The classical estimates of a scene, and of a run beside them."""

import math

import pytest
from heat_scenes import falling_flux
from helpers import near
from material_scenes import heated
from scenes import closed_form, stop_scene

import simbrake as sb


@pytest.fixture(scope="module")
def run():
    result = sb.simulate(heated())
    return result, sb.estimates(result)


def test_classical_stop_is_that_of_full_slip():
    stop = sb.formulas.classical_stop(stop_scene(C=None))
    truth = closed_form(C=1e15)  # as good as rigid: slips from the first moment
    assert stop is not None
    near(stop.time, truth["stop"], 1e-8)
    near(stop.work, 0.5 * 800.0 * 20.0**2, 1e-12)
    near(stop.angle, 20.0 * stop.time / 2)
    # a load that falls with the speed counts at half the speed, at which the
    # deceleration is the mean one
    scene = stop_scene(C=None, load=sb.TorqueLoad(5e3, drag=100.0))
    M = 0.725 * 8e3 * (truth["Pi"] - 1)
    near(
        sb.formulas.classical_stop(scene).time,
        800.0 * 20.0 / (M - 5e3 + 100.0 * 10.0),
        1e-12,
    )


def test_estimates_of_a_scene_alone():
    table = sb.estimates(
        stop_scene(C=None), sb.formulas.EstimateData(track_area=1.0, lining_area=0.7)
    )
    near(table["friction work"].value, 0.5 * 800.0 * 20.0**2)
    assert {row.simulated for row in table} == {None}
    near(table["overlap coefficient"].value, 0.7)


@pytest.mark.slow
def test_estimates_match_a_stop_they_assume(run):
    """Sliding throughout under constant torque: statics agree, temperatures up to what
    the formulas leave out."""
    result, table = run
    for name in ("brake torque", "stopping time", "stopping angle", "friction work"):
        near(table[name].value, table[name].simulated, 1e-9)
    for name, share in (
        # of the rise: layers, and cooling of the open track
        ("surface temperature, falling flux", 0.004),
        ("surface temperature, falling flux, slab", 0.004),
        ("surface temperature, Schmidt", 0.004),
        ("bulk temperature, end", 0.004),
    ):
        row = table[name]
        assert row.value - 293.15 == pytest.approx(row.simulated - 293.15, rel=share), (
            name
        )
    face, mean, difference = falling_flux(
        48.0,
        7800.0,
        500.0,
        0.95 * 0.5 * 800.0 * 20.0**2,
        result.metrics["stopping_time"],
    )
    near(table["surface temperature, falling flux"].simulated - 293.15, face, 5e-3)
    near(table["bulk temperature, end"].simulated - 293.15, mean, 2e-3)
    # the run's stress is that of the greatest difference, the estimate's that of two
    # temperatures of different times
    stress = table["thermal stress, surface"]
    factor = -205e9 * 12e-6 / (1 - 0.3)
    near(stress.simulated, factor * difference, 5e-3)
    near(stress.value, factor * (3 / math.sqrt(8) * face - mean), 1e-4)
    near(table["stress over allowable"].simulated, abs(stress.simulated) / 150e6)
    near(table["heat partition coefficient, rim, effusivities"].simulated, 0.95)
