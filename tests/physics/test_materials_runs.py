"""Materials compared by simulation, and what the comparison shows."""

import dataclasses
import json
import math

import numpy as np
import pytest
from heat_scenes import falling_flux
from helpers import main, nothing_compiled
from material_scenes import ROOM, W0, J, compared, heated
from scenes import stop_scene

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
    assert row["surface"].simulated == pytest.approx(
        float(np.max(series.rim_temperature)), abs=2e-4
    )
    assert row["friction_work"].value == pytest.approx(
        float(series.friction_heat[-1]), rel=1e-9
    )
    assert row["share"].simulated == pytest.approx(0.95, rel=1e-9)
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
        assert row["stress"].value == pytest.approx(
            K * (3 / math.sqrt(8) * face - mean), rel=1e-4
        )
        assert row["stress"].simulated == pytest.approx(K * difference, rel=5e-3)


@pytest.mark.slow
def test_one_run_without_heat_and_mean_wear():
    """Mean wear by hand against the integral over the run, for a constant
    coefficient."""
    scene = stop_scene(C=None)
    cold = sb.formulas.lining_material("FK-24A", wear_activation=0.0)
    table = compared(["brass", "cast_iron"], [cold], scene=scene, run=True)
    works = [row["friction_work"].value for row in table]
    assert works == pytest.approx([0.5 * J * W0**2] * 2, rel=1e-9)
    assert table.row("brass")["surface"].simulated is None
    n = scene.brake.linings.count
    linings = dataclasses.replace(scene.brake.linings, area=np.asarray(0.75 / n))
    result = sb.simulate(
        dataclasses.replace(
            scene, brake=dataclasses.replace(scene.brake, linings=linings)
        )
    )
    mean = float(np.mean(np.asarray(sb.results.lining_wear(result, 3e-14))))
    assert table.row("brass")["wear"].value == pytest.approx(mean, rel=1e-9)


# --- shown --------------------------------------------------------------------------


def test_table_its_numbers_and_labelled_data():
    table = compared(["steel_20L", "brass"], ["FK-24A", "retinax"], energy=[2e5, 4e6])
    told = json.loads(json.dumps(table.as_dict(), allow_nan=False))
    assert len(told["rows"]) == 8
    assert told["rows"][0]["surface"]["estimate"] == table.rows[0]["surface"].value
    assert told["materials"]["rims"][0]["sources"]["conductivity"].startswith("V")
    data = table.dataset()
    assert dict(data.sizes) == {"level": 2, "rim": 2, "lining": 2}
    one = data["surface"].sel(rim="brass", lining="retinax").isel(level=1)
    assert float(one) == table.row("brass", "retinax", 1)["surface"].value
    assert data["stress"].attrs["units"] == "Pa"
    with pytest.raises(KeyError, match="no row 'wood'"):
        table.row("wood")
    with pytest.raises(KeyError, match="no quantity 'colour'"):
        table.rows[0]["colour"]


def call(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_the_command(capsys, scenarios, tmp_path, monkeypatch, drawn):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    command = [
        "materials",
        str(scenarios / "u2_5_5_stop.toml"),
        "--no-run",
        "--rim",
        "brass",
        "--rim",
        "cast_iron",
    ]
    picture = tmp_path / "materials.png"
    code, out, _ = call(
        capsys, *command, "--energy", "400 kJ, 0.8 MJ", "-o", str(picture)
    )
    assert code == 0
    assert picture.exists()
    told = json.loads(call(capsys, *command, "--energy", "400 kJ, 0.8 MJ", "--json")[1])
    widths = [bar.get_width() for bar in drawn["materials.png"].axes[0].patches]
    first = [row for row in told["rows"] if row["lining"] == told["rows"][0]["lining"]]
    rises = sorted(row["surface"]["estimate"] - 273.15 for row in first)
    assert sorted(widths) == pytest.approx(rises)
    code, out, _ = call(
        capsys,
        *command,
        "--lining",
        "retinax",
        "--energy",
        "initial.omega=120 rpm, 24",
        "--json",
    )
    told = json.loads(out)
    assert code == 0
    assert [level["label"] for level in told["levels"]] == [
        "initial.omega = 12.5664 rad/s",
        "initial.omega = 24 rad/s",
    ]
    assert len(told["rows"]) == 4
    # brass is over its allowable stress at 12 MJ, cast iron alone bears 100 kJ
    assert call(capsys, *command, "--energy", "12 MJ", "--fail-on-limit")[0] == 3
    assert call(capsys, *command, "--energy", "12 MJ")[0] == 0
    assert (
        call(
            capsys,
            *command[:3],
            "--rim",
            "cast_iron",
            "--energy",
            "100 kJ",
            "--fail-on-limit",
        )[0]
        == 0
    )
    assert call(capsys, *command, "-o", str(tmp_path / "charts"))[0] == 0
    assert [file.name for file in (tmp_path / "charts").iterdir()] == ["materials.png"]
    for wrong, word in (
        (["--rim", "wood"], "no rim material 'wood'"),
        (["--energy", "lots"], "friction works, as in"),
        (["--energy", "brake.linings.angle=0.2"], "not a single number"),
        (["-o", "chart.doc"], "is not a format"),
    ):
        code, _, err = call(capsys, *command, *wrong)
        assert code == 2
        assert word in err
