"""Materials compared by simulation, and what the comparison shows."""

import dataclasses
import math

import numpy as np
import pytest
from heat_scenes import falling_flux
from helpers import near, nothing_compiled
from material_scenes import ROOM, W0, J, compared, heated
from scenes import replaced, stop_scene

import simbrake as sb

# --- simulated -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def simulated():
    return sb.compare_materials(heated(), ["steel_20L", "brass"], ["FK-24A"])


@pytest.mark.slow
def test_a_new_material_does_not_re_trace(simulated, caplog):
    with nothing_compiled(caplog):
        sb.compare_materials(heated(), ["magnesium_alloy", "cast_iron"], ["retinax"])


@pytest.mark.slow
def test_simulated_numbers_are_of_the_scene(simulated):
    row = simulated.row("brass")
    scene = heated()
    wall = dataclasses.replace(scene.heat.bodies[0], material=sb.material("brass"))
    heat = dataclasses.replace(scene.heat, bodies=(wall, *scene.heat.bodies[1:]))
    result = sb.simulate(dataclasses.replace(scene, heat=heat))
    series = result.series(np.linspace(0.0, float(result.stopping_time), 4001))
    near(row["surface"].simulated, np.max(series.rim_temperature), abs=2e-4)
    near(row["friction_work"].value, series.friction_heat[-1], 1e-9)
    near(row["share"].simulated, 0.95, 1e-9)
    # the scene has no lining whose temperature were known
    assert row["wear"].simulated is None
    assert row["mass"].simulated is None


@pytest.mark.slow
def test_estimates_and_runs_of_a_half_space(simulated):
    """Closed forms for a face under falling flux; the air, layers of some thickness and
    the back take little from it.

    The estimated stress takes the face under the mean flux at the end: 3/√8 of its
    greatest rise.
    """
    for row in simulated:
        m = sb.formulas.rim_material(row.rim)
        thermal = [
            float(x)
            for x in (
                m.thermal.conductivity,
                m.thermal.density,
                m.thermal.specific_heat,
            )
        ]
        face, mean, difference = falling_flux(
            *thermal, 0.95 * 0.5 * J * W0**2, row["duration"].value
        )
        K = -m.elastic.young * m.elastic.expansion / (1 - m.elastic.poisson)
        for key, rise in (("surface", face), ("bulk_end", mean)):
            assert row[key].value - ROOM == pytest.approx(rise, rel=1e-4), (
                row.rim,
                key,
            )
            assert row[key].simulated - ROOM == pytest.approx(rise, rel=5e-3), (
                row.rim,
                key,
            )
        near(row["stress"].value, K * (3 / math.sqrt(8) * face - mean), 1e-4)
        near(row["stress"].simulated, K * difference, 5e-3)


@pytest.mark.slow
def test_one_run_without_heat_and_mean_wear():
    """Mean wear by hand against the integral over the run, for a constant
    coefficient."""
    scene = stop_scene(C=None)
    cold = sb.formulas.lining_material("FK-24A", wear_activation=0.0)
    table = compared(["brass", "cast_iron"], [cold], scene=scene, run=True)
    works = [row["friction_work"].value for row in table]
    near(works, [0.5 * J * W0**2] * 2, 1e-9)
    assert table.row("brass")["surface"].simulated is None
    n = scene.brake.linings.count
    area = np.asarray(0.75 / n)
    result = sb.simulate(replaced(scene, {"brake.linings.area": area}))
    mean = float(np.mean(np.asarray(sb.results.lining_wear(result, 3e-14))))
    near(table.row("brass")["wear"].value, mean, 1e-9)


# --- shown --------------------------------------------------------------------------


def test_table_its_numbers_and_labelled_data():
    table = compared(["steel_20L", "brass"], ["FK-24A", "retinax"], energy=[2e5, 4e6])
    data = table.dataset()
    assert dict(data.sizes) == {"level": 2, "rim": 2, "lining": 2}
    one = data["surface"].sel(rim="brass", lining="retinax").isel(level=1)
    assert float(one) == table.row("brass", "retinax", 1)["surface"].value
    assert data["stress"].attrs["units"] == "Pa"
