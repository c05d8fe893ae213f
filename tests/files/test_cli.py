"""The command line as a user meets it: runs, files and exit codes. Wrong commands are in
`bad_input.csv`."""

import csv
import json
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from commands import call, no_cache, output  # noqa: F401
from helpers import all_near, near
from scenes import lining_ratio

import simbrake as sb
from simbrake.files.shipped_scenes import TEMPLATES

SCENE = "u2_5_5_stop"


def run(capsys, *arguments):
    """The JSON of a command that ends with 0."""
    code, out, _ = call(capsys, *arguments, "--json")
    assert code == 0
    return json.loads(out)


@pytest.mark.smoke
def test_run_prints_a_summary(capsys):
    code, out, err = call(capsys, "run", SCENE)
    assert (code, err) == (0, "")
    assert out.startswith("stopped:")


@pytest.mark.smoke
def test_numbers_of_a_run(capsys):
    """Tensions and loads of the linings at the full pull of the lever, what the drum
    pays out over 8 lines, and the energy from 24 rad/s to rest."""
    summary = run(capsys, "run", SCENE)
    assert summary["status"] == "stopped"
    metrics = summary["metrics"]
    times = ("slip_onset_time", "full_slip_time", "stopping_time")
    assert 0 < metrics[times[0]] < metrics[times[1]] < metrics[times[2]]
    mu = lining_ratio(0.35, math.radians(13.5))
    load = 24e3 * mu**20 * (1 + 1 / mu) * math.sin(math.radians(6.75))
    near(metrics["max_tension"], 24e3 * mu**20, 1e-9)
    near(metrics["max_normal_load"], load, 1e-9)
    angle = metrics["stopping_angle"]
    near(metrics["hook_travel"], 0.05 * angle, 1e-12)
    energy = summary["energy"]
    change = -0.5 * (1200.0 + 60e3 * 0.05**2) * 24.0**2
    near(energy["kinetic_change"], change, 1e-12)
    work = 60e3 * 9.80665 * 0.05 * angle
    near(energy["load_work"], work, 1e-9)
    assert energy["closure"] <= 1e-9
    limits = [e for e in summary["events"] if e["name"] == "lining_limit"]
    assert [event["lining"] for event in limits] == list(range(1, 21))


def test_numbers_have_the_names_of_their_bodies(capsys):
    _, text, _ = call(capsys, "scene", "show", "tripping")
    assert re.search(r"heat\.bodies\[2\]\.capacity .*heat capacity \(linings\)\n", text)
    assert re.search(r"heat\.links\[0\]\.value .* \(rim to air\)\n", text)
    assert re.search(r"phases\[2\]\.until\.duration .* \(hold\)\n", text)


def test_keys_that_are_set(capsys):
    """Of the file, also those that its numbers are made of; with their units."""
    changes = {
        "brake.linings.count": "18",
        "brake.linings.wrap": "280 deg",
        "duty.slack_tension.end": "30 kN",
        "duty.load.mass": "80 t",
        "brake.band.stiffness": "none",
    }
    given = [x for path, value in changes.items() for x in ("--set", f"{path}={value}")]
    code, text, _ = call(capsys, "scene", "show", "standard", "--toml", *given)
    assert code == 0
    scene = sb.files.scene_from_text(text)
    assert scene.brake.linings.angle.shape == (18,)
    near(scene.brake.linings.wrap, math.radians(280))
    assert scene.duty.slack_tension.values.tolist() == [2e3, 30e3]
    assert float(scene.duty.load.mass) == 80e3
    assert scene.brake.band.stiffness is None
    heavy = run(capsys, "run", SCENE, "--set", "duty.load.mass=3e5")
    assert heavy["status"] == "runaway"
    assert heavy["metrics"]["stopping_time"] is None


def test_files_of_a_run(capsys, tmp_path):
    """All in one folder; along the sliding band each tension is μ times the one
    before."""
    folder = tmp_path / "out"
    limit = ("--limit", "max_tension=120 kN")
    code, out, _ = call(capsys, "run", SCENE, "--out", str(folder), *limit)
    assert code == 0
    pictures = {"lining_map-normal_load.png", "pulley.png", "stop.png"}
    data = {"result.nc", "series.csv", "summary.json", "summary.txt"}
    assert {path.name for path in folder.iterdir()} == pictures | data
    assert [path for path in tmp_path.iterdir() if path != folder] == []
    (line,) = [line for line in out.splitlines() if line.startswith("limit")]
    printed = (folder / "summary.txt").read_text("utf-8").splitlines()
    assert line in printed
    findings = json.loads((folder / "summary.json").read_text("utf-8"))["findings"]
    words = [f"{one['topic']:8} {one['text']}" for one in findings]
    assert [text for text in printed if text in words] == words
    with open(folder / "series.csv", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    columns = dict(zip(head, np.asarray(rows, float).T, strict=True))
    i = int(np.searchsorted(columns["t [s]"], 1.0))
    wanted = 24e3 * lining_ratio(0.35, math.radians(13.5)) ** np.arange(1, 21)
    drawn = [columns[f"tension_{k} [N]"][i] for k in range(1, 21)]
    all_near(drawn, wanted, 1e-9)


def test_exit_codes_and_limits(capsys):
    """1 for a failure whatever its limits, 3 for a limit only where asked."""
    limit = ("--limit", "max_tension=120 kN")
    (found,) = run(capsys, "run", SCENE, *limit)["limits"]
    assert (found["verdict"], found["limit"], found["unit"]) == ("exceeded", 120e3, "N")
    assert found["margin"] == 120e3 - found["value"]
    assert call(capsys, "run", SCENE, *limit, "--fail-on-limit")[0] == 3
    failed = ("run", SCENE, *limit, "--fail-on-limit", "--json", "--max-steps", "8")
    code, out, _ = call(capsys, *failed)
    assert (code, json.loads(out)["status"]) == (1, "step_limit")


def test_sensitivity(capsys, tmp_path):
    """The ends of a range are runs."""
    asked = ("sensitivity", SCENE, "--metric", "stopping_time", "--wrt", "brake.band")
    asked = (*asked, "--span", "0.05")
    assert call(capsys, *asked, "--out", str(tmp_path / "s"))[0] == 0
    names = {file.name for file in (tmp_path / "s").iterdir()}
    table = {"sensitivity.json", "sensitivity_stopping_time.csv"}
    assert names == table | {"tornado_stopping_time.png"}
    (table,) = run(capsys, *asked)
    rows = {row["path"]: row for row in table["rows"]}
    single = run(capsys, "run", SCENE, "--set", "brake.band.stiffness=1.05e5")
    time = single["metrics"]["stopping_time"]
    near(rows["brake.band.stiffness"]["high"], time, 1e-9)


def test_scene_in_toml_and_in_python(capsys, scenarios):
    found, wanted = (
        run(capsys, "run", str(scenarios / f"{SCENE}{suffix}"))
        for suffix in (".toml", ".py")
    )
    near(found["metrics"], wanted["metrics"], 1e-13)
    assert [e["name"] for e in found["events"]] == [e["name"] for e in wanted["events"]]


# --- new scenes ---------------------------------------------------------------------


@pytest.mark.parametrize("name", TEMPLATES)
def test_template_gives_no_warnings(capsys, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert run(capsys, "new", name, "mine.toml")["written"] == "mine.toml"
    faults = run(capsys, "scene", "check", "mine.toml")
    assert faults == {"faults": [], "warnings": []}
    if name in ("standard", "staged", "disc", "shoe", "lift"):
        found = run(capsys, "run", "mine.toml")
        assert found["status"] == "stopped"
        assert {limit["verdict"] for limit in found["limits"]} == {"within limit"}


def test_new_lists_and_writes_shipped_scenes(capsys, tmp_path, monkeypatch, scenarios):
    monkeypatch.chdir(tmp_path)
    names = {
        file.stem for file in scenarios.iterdir() if file.suffix in (".py", ".toml")
    }
    listed = [row["name"] for row in run(capsys, "new")]
    assert listed == [*TEMPLATES, *sorted(names)]
    # (the last one uses another)
    for name, file in (("drag_lowering", "mine/"), ("lining_life", "lining_life.py")):
        (tmp_path / "mine").mkdir(exist_ok=True)
        written = run(capsys, "new", name, file)["written"]
        sb.check_scene(sb.read_scene(tmp_path / written))
    before = (tmp_path / "lining_life.py").read_text("utf-8")
    assert call(capsys, "new", "lining_life")[0] == 2
    assert (tmp_path / "lining_life.py").read_text("utf-8") == before


# --- processes and streams ----------------------------------------------------------


def process(*arguments, **options):
    usual = {"capture_output": True, "timeout": 300}
    command = [sys.executable, "-m", "simbrake", *arguments]
    return subprocess.run(command, **usual | options)


def test_mistakes_are_answered_without_jax():
    """No module that takes time to load."""
    program = "import sys; from simbrake.__main__ import main\ntry:\n    main()\n"
    program += "finally:\n    print({'jax', 'numpy', 'scipy'} & {*sys.modules})"
    for line in ("runn", "run standard --rtoll 1", "run a.toml --set a=1", "rig a.csv"):
        command = [sys.executable, "-c", program, *line.split()]
        done = subprocess.run(command, capture_output=True, text=True)
        assert (done.returncode, done.stdout.split("\n")[-2]) == (2, "set()"), line


def test_output_in_ascii(tmp_path):
    """Symbols are spelled where the encoding lacks them."""
    asked = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = process("run", SCENE, env=asked)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"lining limits 1...20 0.00152167...0.00896396 s" in done.stdout
    done = process("run", "ω.toml", env=asked, cwd=tmp_path)
    assert done.returncode == 2
    assert b"omega.toml: there is no such file" in done.stderr


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("ω̇ ≤ T₀·Πₙ", "omega' <= T_0*Pi_n"),
        ("10⁻⁶ m², 20 °C, ½ λ", "10^-6 m^2, 20 degC, 1/2 lambda"),
        ("╭─┤ẋ│", "+-+x'|"),
        ("Ж 𝛀 ᴬ", "\\u0416 \\U0001d6c0 ^A"),
    ],
)
def test_symbols_are_spelled(capsys, text, plain):
    out = call(capsys, "--version")[1]
    assert out.startswith(f"simbrake {sb.__version__}, jax ")
    assert text.encode("ascii", "simbrake-readable") == plain.encode()


def test_reader_that_goes_away_ends_no_work(tmp_path):
    """As in `simbrake run … --out x --json | head -1`."""
    ours, theirs = os.pipe()
    os.close(ours)
    asked = ("run", "standard", "--json", "--out", str(tmp_path / "x"))
    done = process(*asked, capture_output=False, stdout=theirs, stderr=subprocess.PIPE)
    os.close(theirs)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "x" / "summary.json").exists()


def test_every_command_has_help_and_json(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    names = re.findall(r"^│ ([a-z]\w+)  ", output("--help"), re.MULTILINE)
    assert len(names) > 15
    for name in {*names, "scene show", "scene check", "scene schema"} - {"scene"}:
        code, out, _ = call(capsys, *name.split(), "--help")
        assert (code, "--json" in out) == (0, True), name


@pytest.mark.parametrize(
    "command",
    [
        ("sweep", "--vary", "load.mass=80 t:90 t:3"),
        ("sensitivity", "--wrt", "load.mass"),
    ],
)
def test_a_key_of_the_file_in_place_of_a_path(capsys, command):
    """`--set load.mass` changes the file; in the scene the string is a number of its
    own."""
    name, *options = command
    code, _, said = call(capsys, name, "tripping", *options)
    assert code == 2
    assert "duty.load.string" in said


def test_one_file_instead_of_a_folder(capsys, tmp_path):
    file = tmp_path / "run.nc"
    assert call(capsys, "run", SCENE, "--out", str(file))[0] == 0
    assert sb.read_result(file).status.item() == "stopped"
    assert list(tmp_path.iterdir()) == [file]


def test_tables_of_the_papers(capsys):
    verdicts = {row["verdict"] for row in run(capsys, "reproduce")}
    assert verdicts == {"agrees", "known misprint"}
