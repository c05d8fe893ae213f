"""The command line as a user meets it."""

import csv
import json
import math
import os
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from commands import call, no_cache  # noqa: F401


@pytest.fixture
def scenario(scenarios):
    return str(scenarios / "u2_5_5_stop.py")


@pytest.mark.smoke
def test_run_prints_a_summary(capsys, scenario):
    code, out, err = call(capsys, "run", scenario)
    assert code == 0
    assert err == ""
    assert 8 <= len(out.splitlines()) <= 12
    assert out.startswith("stopped:")


@pytest.mark.smoke
def test_json_alone_on_stdout(capsys, scenario):
    code, out, _ = call(capsys, "run", scenario, "--json")
    summary = json.loads(out)
    assert code == 0
    assert summary["status"] == "stopped"
    assert summary["energy"]["closure"] <= 1e-9
    metrics = summary["metrics"]
    assert (
        0
        < metrics["slip_onset_time"]
        < metrics["full_slip_time"]
        < metrics["stopping_time"]
    )
    # what the linings do at the full tension of the lever, and what the drum pays out
    # over 8 lines
    mu = (1 + 0.35 * math.tan(math.radians(6.75))) / (
        1 - 0.35 * math.tan(math.radians(6.75))
    )
    assert metrics["max_tension"] == pytest.approx(24e3 * mu**20, rel=1e-9)
    load = metrics["max_tension"] * (1 + 1 / mu) * math.sin(math.radians(6.75))
    assert metrics["max_normal_load"] == pytest.approx(load, rel=1e-9)
    assert metrics["hook_travel"] == pytest.approx(
        0.05 * metrics["stopping_angle"], rel=1e-12
    )
    # from 24 rad/s to rest: drum and string, which sinks as the drum turns
    energy = summary["energy"]
    inertia = 1200.0 + 60e3 * 0.05**2
    weight = 60e3 * 9.80665 * 0.05
    assert energy["kinetic_change"] == pytest.approx(
        -0.5 * inertia * 24.0**2, rel=1e-12
    )
    assert energy["load_work"] == pytest.approx(
        weight * metrics["stopping_angle"], rel=1e-9
    )
    assert {"steps", "rejected", "segments"} <= set(summary["solver"])
    times = [e["time"] for e in summary["events"]]
    assert times == sorted(times)
    assert [
        e["lining"] for e in summary["events"] if e["name"] == "lining_limit"
    ] == list(range(1, 21))


def test_set_changes_numbers_and_structure(capsys, scenario):
    _, out, _ = call(
        capsys,
        "run",
        scenario,
        "--json",
        "--set",
        "duty.load.mass=1e3",
        "--set",
        "brake.band.stiffness=none",
    )
    summary = json.loads(out)
    assert summary["metrics"]["slip_onset_time"] == 0.0
    code, out, _ = call(
        capsys, "run", scenario, "--json", "--set", "duty.load.mass=3e5"
    )
    assert code == 0
    assert json.loads(out)["status"] == "runaway"
    assert json.loads(out)["metrics"]["stopping_time"] is None


def test_out_writes_chart_series_and_summary(capsys, scenario, tmp_path, drawn):
    folder = tmp_path / "out"
    code, out, _ = call(
        capsys, "run", scenario, "--out", str(folder), "--limit", "max_tension=120 kN"
    )
    assert code == 0
    (line,) = [line for line in out.splitlines() if line.startswith("limit")]
    assert line in (folder / "summary.txt").read_text("utf-8").splitlines()
    (limit,) = json.loads((folder / "summary.json").read_text("utf-8"))["limits"]
    assert limit["verdict"] == "exceeded"
    files = [
        "lining_map-normal_load.png",
        "pulley.png",
        "result.nc",
        "series.csv",
        "stop.png",
    ]
    files += ["summary.json", "summary.txt"]
    assert sorted(p.name for p in folder.iterdir()) == files
    assert "stop.png" in out
    with open(folder / "series.csv", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "t [s]"
    assert len(rows) > 1000
    assert all(len(row) == len(rows[0]) for row in rows)
    t = [float(row[0]) for row in rows[1:]]
    assert t == sorted(t)
    # along the sliding band the tension of each lining is μ times the one before, at
    # last of T_n in the chart
    columns = dict(zip(rows[0], np.asarray(rows[1:], float).T, strict=True))
    z = 0.35 * math.tan(math.radians(6.75))
    i = int(np.searchsorted(t, 1.0))
    growth = ((1 + z) / (1 - z)) ** np.arange(1, 21)
    for k in range(20):
        assert columns[f"tension_{k + 1} [N]"][i] == pytest.approx(
            24e3 * growth[k], rel=1e-9
        )
    tight, slack = (drawn["stop.png"].axes[4].lines[j].get_xydata() for j in (0, 1))
    assert np.interp(1.0, *tight.T) == pytest.approx(24 * growth[-1], rel=1e-9)
    assert np.interp([0.3, 1.0], *slack.T) == pytest.approx(
        [2.0 + 22 * 0.3 / 0.35, 24.0], rel=1e-9
    )
    assert [p for p in tmp_path.iterdir() if p != folder] == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["--set", "brake.band.stifness=1"],
            ["brake.band.stifness", "brake.band.stiffness"],
        ),
        (
            ["--set", "brake.band.stiffness=-1", "--set", "duty.load.mass=nan"],
            ["brake.band.stiffness", "duty.load.mass"],
        ),
        (["--set", "brake.linings.angle[20]=0.1"], ["no entry 20"]),
        (["--set", "brake.pulley.inertia=heavy"], ["'heavy'", "1.5 kg*m^2"]),
        (["--set", "brake.pulley.inertia=none"], ["cannot be absent"]),
        (["--set", "brake.pulley.inertia=1 kg*m"], ["'kg*m'"]),
        (["--set", "=3"], ["=3"]),
        (["--set", "initial.omega="], ["initial.omega"]),
        (["--set", "nonsense"], ["path=value"]),
        (["--rtol", "-1"], ["--rtol"]),
    ],
)
def test_bad_input_exits_2(capsys, scenario, arguments, words, tmp_path):
    code, out, err = call(
        capsys, "run", scenario, *arguments, "--json", "--out", str(tmp_path / "x")
    )
    assert code == 2
    assert out == ""
    assert all(word in err for word in words)
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_failure_exits_1(capsys, scenario):
    code, out, _ = call(capsys, "run", scenario, "--json", "--max-steps", "8")
    assert code == 1
    assert json.loads(out)["status"] == "step_limit"


def test_limits_in_words_and_exit_code(capsys, scenario):
    """The verdict with value, limit and margin, as text and as JSON; code 3 only where
    asked."""
    code, out, _ = call(
        capsys, "run", scenario, "--limit", "max_tension=120 kN", "--json"
    )
    assert code == 0
    (limit,) = json.loads(out)["limits"]
    assert (limit["name"], limit["verdict"], limit["limit"], limit["unit"]) == (
        "max_tension",
        "exceeded",
        120e3,
        "N",
    )
    assert limit["value"] == pytest.approx(125.966e3, rel=1e-5)
    assert limit["margin"] == 120e3 - limit["value"]
    code, out, _ = call(
        capsys, "run", scenario, "--limit", "max_tension=120 kN", "--fail-on-limit"
    )
    assert code == 3
    both = (
        "--limit",
        "max_tension=126000",
        "--limit",
        "stopping_time=2 s",
        "--fail-on-limit",
    )
    code, out, _ = call(capsys, "run", scenario, *both)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--limit", "max_tensoin=120 kN"], ["max_tensoin", "nearest: max_tension"]),
        (
            ["--limit", "max_tension=120 kg"],
            ["--limit max_tension", "'kg' is not a unit"],
        ),
        (["--limit", "max_tension"], ["METRIC=VALUE"]),
        (["--limit", "=3"], ["METRIC=VALUE"]),
        (["--limit", "stopping_time=1", "--limit", "stopping_time=2"], ["twice"]),
        (["--limit", "max_pressure=1 MPa"], ["areas"]),
        (["--limit", "peak_rim_temperature=300"], ["peak_rim_temperature"]),
        (["--limit", "max_tension=nan"], ["max_tension"]),
    ],
)
def test_bad_limits_write_nothing(capsys, scenario, arguments, words, tmp_path):
    code, out, err = call(
        capsys, "run", scenario, *arguments, "--json", "--out", str(tmp_path / "x")
    )
    assert (code, out) == (2, "")
    assert all(word in err for word in words)
    assert list(tmp_path.iterdir()) == []


def test_failed_run_is_1_whatever_its_limits(capsys, scenario):
    limited = ("--max-steps", "8", "--limit", "max_tension=1", "--fail-on-limit")
    assert call(capsys, "run", scenario, *limited)[0] == 1


def test_reproduce(capsys):
    code, out, _ = call(capsys, "reproduce", "--json")
    rows = json.loads(out)
    assert code == 0
    assert {row["table"] for row in rows} == {
        "Z1",
        "Z2",
        "Z3",
        "Z4",
        "Z5",
        "Z6",
        "V1",
        "V2",
        "S1",
    }
    assert {row["verdict"] for row in rows} == {"agrees", "known misprint"}
    code, out, _ = call(capsys, "reproduce")


def test_unknown_options_and_help(capsys, scenario):
    assert call(capsys, "run", scenario, "--bogus")[0] == 2
    assert call(capsys, "run", "nowhere.py")[0] == 2
    code, out, _ = call(capsys, "run", "--help")
    assert code == 0
    assert "--set" in out


def test_scenario_runs_as_a_script(scenario):
    done = subprocess.run(
        [sys.executable, scenario],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("stopped:")


def test_sensitivity_as_table_json_and_chart(capsys, scenario, tmp_path):
    arguments = (
        "sensitivity",
        scenario,
        "--metric",
        "stopping_time",
        "--wrt",
        "brake.band",
        "--span",
        "0.05",
    )
    code, out, _ = call(capsys, *arguments, "--out", str(tmp_path / "s"))
    assert code == 0
    assert "brake.band.stiffness" in out
    names = {file.name for file in (tmp_path / "s").iterdir()}
    assert names == {
        "sensitivity.json",
        "sensitivity_stopping_time.csv",
        "tornado_stopping_time.png",
    }
    code, out, _ = call(capsys, *arguments, "--json")
    (table,) = json.loads(out)
    rows = {row["path"]: row for row in table["rows"]}
    code, out, _ = call(
        capsys, "run", scenario, "--json", "--set", "brake.band.stiffness=1.05e5"
    )
    assert rows["brake.band.stiffness"]["high"] == pytest.approx(
        json.loads(out)["metrics"]["stopping_time"], rel=1e-9
    )
    code, out, err = call(
        capsys, "sensitivity", scenario, "--metric", "stoping_time", "--span", "2"
    )
    assert (code, out) == (2, "")
    assert "--span" in err
    code, _, err = call(capsys, "sensitivity", scenario, "--metric", "stoping_time")
    assert code == 2
    assert "nearest: stopping_time" in err


def test_scene_file_runs_as_python_scene(capsys, scenario, scenarios):
    code, out, err = call(capsys, "run", str(scenarios / "u2_5_5_stop.toml"), "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    wanted = json.loads(call(capsys, "run", scenario, "--json")[1])
    assert found["metrics"] == pytest.approx(wanted["metrics"], rel=1e-13)
    assert [e["name"] for e in found["events"]] == [e["name"] for e in wanted["events"]]


def test_scene_show_check_schema(capsys, scenario, tmp_path):
    import jsonschema

    code, out, _ = call(
        capsys, "scene", "show", scenario, "--set", "duty.load.mass=30 t"
    )
    assert code == 0
    assert any(
        line.split()[:3] == ["duty.load.mass", "30000", "kg"]
        for line in out.splitlines()
    )
    code, text, _ = call(capsys, "scene", "show", scenario, "--toml")
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    code, out, _ = call(capsys, "scene", "check", str(tmp_path / "mine.toml"))
    code, out, _ = call(capsys, "scene", "schema", "--json")
    schema = json.loads(out)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(tomllib.loads(text), schema)
    for wrong in (
        text.replace("mass", "masss"),
        text.replace('"0.35"', "true").replace("0.35", "true"),
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tomllib.loads(wrong), schema)
    assert any(
        line.split()[:3] == ["brake", "needed", "Brake"]
        for line in call(capsys, "scene", "schema")[1].splitlines()
    )
    code, out, err = call(capsys, "scene", "schema", "pully")
    assert (code, out) == (2, "")
    assert "nearest: pulley" in err


def test_reader_that_goes_away_ends_no_work(tmp_path):
    """As in `simbrake run … --out x --json | head -1`: what is still to be written is
    written, without a traceback."""

    def unread(program):
        ours, theirs = os.pipe()
        os.close(ours)
        done = subprocess.run(
            [sys.executable, "-c", program],
            stdout=theirs,
            stderr=subprocess.PIPE,
            timeout=300,
        )
        os.close(theirs)
        return done.returncode, done.stderr

    file = tmp_path / "written"
    start = "from simbrake.__main__ import main\n"
    asked = ["run", "standard", "--json", "--out", str(file)]
    assert unread(f"{start}main({asked})") == (0, b"")
    assert (file / "summary.json").exists()


def test_a_folder_and_an_empty_file(capsys, tmp_path):
    (tmp_path / "mine.toml").touch()
    code, _, err = call(capsys, "run", str(tmp_path))
    assert code == 2
    assert f"{tmp_path}: is a folder — there are: {tmp_path / 'mine.toml'}" in err
    code, _, err = call(capsys, "run", str(tmp_path / "mine.toml"))
    assert code == 2
    assert "  type: is missing" in err
