"""Starting: templates and shipped scenes by name, what may be set, and what every
command has in common."""

import json
import os
import pty
import re
import subprocess
import sys

import pytest
from commands import call, output

import simbrake as sb

TEMPLATES = ("standard", "staged", "heated", "tripping", "rig", "disc", "shoe")
#: names in the list of `simbrake --help`
COMMANDS = re.findall(r"^│ ([a-z]\w+)  ", output("--help"), re.MULTILINE)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    return tmp_path


# --- simbrake new -------------------------------------------------------------------


@pytest.mark.parametrize("name", TEMPLATES)
def test_template_gives_no_warnings(capsys, folder, name):
    code, out, err = call(capsys, "new", name, "mine.toml")
    assert (code, err) == (0, "")
    text = (folder / "mine.toml").read_text("utf-8")
    assert f"{name}.toml" not in text
    assert text.count("#") > 12
    code, out, err = call(capsys, "scene", "check", "mine.toml")
    assert (code, err) == (0, "")
    assert "warning" not in out


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[pytest.mark.slow] * (name in ("heated", "tripping", "rig"))
        )
        for name in TEMPLATES
    ],
)
def test_a_template_runs_at_once(capsys, name):
    call(capsys, "new", name)
    code, out, err = call(capsys, "run", f"{name}.toml", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["status"] == "stopped"
    assert found["energy"]["closure"] <= 1e-9
    assert {limit["verdict"] for limit in found["limits"]} == {"within limit"}


def test_shipped_scenes_are_written(capsys, folder, scenarios):
    code, out, _ = call(capsys, "new")
    names = {file.stem for file in [*scenarios.glob("*.py"), *scenarios.glob("*.toml")]}
    listed = [line.split()[0] for line in out.splitlines() if line.startswith("  ")]
    assert code == 0
    assert listed == [*TEMPLATES, *sorted(names)]
    rows = json.loads(call(capsys, "new", "--json")[1])
    assert [row["name"] for row in rows] == listed
    assert [row["name"] for row in rows if row["template"]] == [*TEMPLATES]
    for name in (
        "u2_5_5_stop",
        "drag_lowering",
        "lining_life",
    ):  # two of them use another one
        code, out, err = call(capsys, "new", name, "--json")
        assert (code, err) == (0, "")
        written = json.loads(out)["written"]
        sb.check_scene(sb.read_scene(folder / written))
    assert written == "lining_life.py"


def test_new_replaces_no_file(capsys, folder):
    (folder / "standard.toml").write_text("mine", "utf-8")
    for arguments, words in (
        (["standard"], "standard.toml: exists and is not replaced"),
        (["standart"], "nearest: standard"),
        (["standard", "mine.py"], "give a name with .toml"),
    ):
        code, out, err = call(capsys, "new", *arguments)
        assert (code, out) == (2, "")
        assert words in err
    assert [(file.name, file.read_text("utf-8")) for file in folder.iterdir()] == [
        ("standard.toml", "mine")
    ]


def test_scene_by_name_and_study_without_one(capsys, tmp_path):
    assert (
        call(capsys, "scene", "check", "standard")[0]
        == call(capsys, "scene", "check", "u2_5_5_stop")[0]
        == 0
    )
    study = tmp_path / "study.py"
    study.write_text("def main():\n    pass\n", "utf-8")
    code, _, err = call(capsys, "run", str(study))
    assert code == 2
    assert f"is a study without a scene — run it: python {study}" in err
    code, _, err = call(capsys, "run", "standart")
    assert code == 2
    assert "standart: there is no such file — nearest: standard, " in err


# --- what may be set ----------------------------------------------------------------


def test_keys_of_a_scene_file_can_be_set(capsys, folder, scenarios):
    call(capsys, "new", "standard")
    changes = [
        "brake.linings.count=18",
        "brake.linings.wrap=280 deg",
        "duty.slack_tension.end=30 kN",
    ]
    changes += ["duty.load.mass=80 t", "brake.band.stiffness=none"]
    given = [part for change in changes for part in ("--set", change)]
    code, text, _ = call(capsys, "scene", "show", "standard.toml", "--toml", *given)
    assert code == 0
    scene = sb.files.scene_from_text(text)
    assert scene.brake.linings.angle.shape == (18,)
    assert float(scene.brake.linings.wrap) == pytest.approx(
        280 * 3.141592653589793 / 180, rel=1e-15
    )
    assert scene.duty.slack_tension.values.tolist() == [2e3, 30e3]
    assert float(scene.duty.load.mass) == 80e3
    assert scene.brake.band.stiffness is None
    for wrong, words in (
        ("brake.linings.count=18.5", "18.5 is not a whole number"),
        ("brake.linings.count=none", "brake.linings.count: is missing"),
        ("brake.linings.cuont=18", "there is no such number in the scene"),
        ("duty.slack_tension.ned=30 kN", "there is no such number in the scene"),
    ):
        code, out, err = call(capsys, "scene", "check", "standard.toml", "--set", wrong)
        assert (code, out) == (2, "")
        assert words in err


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ("duty.load.mass=40:80 t:5", "40 has no unit, others have one"),
        ("duty.load.mass=40 t, 80", "80 has no unit"),
        ("duty.load.mass=80 t:40 t:5", "80 t is not below 40 t"),
        ("duty.load.mass=40 m:80 m:5", "'m' is not a unit of mass"),
        ("duty.load.mas=40 t:80 t:5", "nearest: duty.load.mass"),
        ("duty.load.mass=40 t:80 t", "is not of the form PATH=LOW:HIGH:COUNT"),
    ],
)
def test_units_of_varied_parameters(capsys, vary, words):
    code, out, err = call(capsys, "sweep", "standard", "--vary", vary)
    assert (code, out) == (2, "")
    assert words in err


# --- every command ------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [*sorted({*COMMANDS} - {"scene"}), "scene show", "scene check", "scene schema"],
)
def test_help_has_exit_codes_and_json(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "200")
    code, out, _ = call(capsys, *command.split(), "--help")
    assert code == 0
    assert "--json" in out
    assert "scenario" not in out.lower()


def test_mistakes_are_answered_without_jax(folder):
    """In a command, an option, the name of a file or of a template: no module that
    takes time to load."""
    program = (
        "import sys; from simbrake.__main__ import main\ntry:\n    main()\nfinally:\n"
    )
    program += "    print(sorted({'jax', 'numpy', 'scipy'} & set(sys.modules)))"
    lines = (
        "runn",
        "run standard --rtoll 1",
        "run step.toml --set a.b=1",
        "new standart",
        "compare a.nc b.nc",
    )
    without_file = (
        f"{name} step.toml"
        for name in ("calibrate", "synthesize", "rig", "validate --cross-check")
    )
    for line in (*lines, *without_file, "new"):
        done = subprocess.run(
            [sys.executable, "-c", program, *line.split()],
            capture_output=True,
            text=True,
        )
        assert done.returncode == (0 if line == "new" else 2), line
        assert done.stdout.splitlines()[-1] == "[]", line


def test_new_scene_in_a_folder_and_in_python(capsys, folder):
    (folder / "mine").mkdir()
    code, out, _ = call(capsys, "new", "u2_5_5_stop", "mine", "--json")
    assert (code, json.loads(out)["written"], json.loads(out)["template"]) == (
        0,
        "mine/u2_5_5_stop.toml",
        False,
    )
    assert call(capsys, "new", "drag_lowering", "mine/x.py")[0] == 0
    assert len(call(capsys, "new", "standard")[1].splitlines()) == 2
    code, out, _ = call(capsys, "scene", "show", "standard.toml", "--json")
    rows = {row["path"]: row for row in json.loads(out)}
    assert (code, rows["initial.omega"]["value"], rows["initial.omega"]["unit"]) == (
        0,
        24.0,
        "rad/s",
    )
    code, out, _ = call(capsys, "scene", "check", "standard.toml", "--json")
    assert (code, json.loads(out)) == (0, {"faults": [], "warnings": []})


def test_colour_is_for_terminals(tmp_path, capsys):
    """A pseudo-terminal gets colours, a pipe, `NO_COLOR` and `TERM=dumb` do not."""
    program = [sys.executable, "-m", "simbrake", "new", "standart"]
    for environment, coloured in (
        ({}, True),
        ({"NO_COLOR": "1"}, False),
        ({"TERM": "dumb"}, False),
    ):
        ours, theirs = pty.openpty()
        asked = (
            {"TERM": "xterm"}
            | {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "TERM")}
            | environment
        )
        assert (
            subprocess.run(program, stderr=theirs, env=asked, timeout=120).returncode
            == 2
        )
        os.close(theirs)
        said = os.read(ours, 1 << 16)
        os.close(ours)
        assert (b"\x1b[31msimbrake:" in said) == coloured
    assert "\x1b" not in call(capsys, "new", "standart")[2]


def test_out_is_a_folder_or_one_file(capsys, folder):
    scene = (
        "materials",
        "standard",
        "--no-run",
        "--rim",
        "brass",
        "--lining",
        "retinax",
    )
    (folder / "kept.d").mkdir()
    (folder / "taken").touch()
    for out, written in (
        ("a", "a/materials.png"),
        ("b/x.svg", "b/x.svg"),
        ("kept.d", "kept.d/materials.png"),
    ):
        code, said, _ = call(capsys, *scene, "--out", out)
        assert (code, said.splitlines()[-1]) == (0, f"written  {written}")
        assert (folder / written).is_file()
    for out, word in (
        ("x.gif", ".gif"),
        ("taken/x.png", "taken is a file"),
        ("taken", "is a file"),
    ):
        code, _, err = call(capsys, *scene, "--out", out)
        assert (code, word in err, "1 input error" in err) == (2, True, True)


def test_all_errors_of_a_command_at_once(capsys, folder):
    given = ("--rtol", "0.105", "--max-steps", "0", "--set", "initial.omega=x")
    code, _, err = call(capsys, "run", "standard", *given)
    assert (code, err.startswith("simbrake: 3 input errors")) == (2, True)
    assert [
        word
        for word in ("--rtol: 0.105", "--max-steps: 0", "initial.omega")
        if word not in err
    ] == []
