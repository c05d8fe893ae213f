"""Starting: templates and shipped scenes by name, what may be set, and what every command has in common."""

import gc
import io
import json
import os
import pathlib
import re
import signal
import sys
import threading
from types import SimpleNamespace

import jax
import pytest
from helpers import main, open_scene

import simbrake as sb
from simbrake._commands import _checks, _cli, _options, _runs, _scenes, _studies
from simbrake.files import _shipped
from simbrake.files._shipped import IN_CHECKOUT, TEMPLATES, Shipped, hint_of, shipped_files, title_of

COMMANDS = [f.__name__ for module in (_scenes, _runs, _studies, _checks) for f in module.COMMANDS]


def call(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    return tmp_path


# --- simbrake new -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_is_a_scene_without_warnings_that_says_how_to_run_it(capsys, folder, name):
    code, out, err = call(capsys, "new", name, "mine.toml")
    assert (code, err) == (0, "")
    assert "simbrake run mine.toml" in out
    text = (folder / "mine.toml").read_text("utf-8")
    assert "#   simbrake run mine.toml" in text
    assert f"{name}.toml" not in text
    assert text.count("#") > 12
    code, out, err = call(capsys, "scene", "check", "mine.toml")
    assert (code, err) == (0, "")
    assert "warning" not in out


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in ("heated", "tripping"))) for name in TEMPLATES]
)
def test_a_template_runs_at_once(capsys, name):
    call(capsys, "new", name)
    code, out, err = call(capsys, "run", f"{name}.toml", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["status"] == "stopped"
    assert found["energy"]["closure"] <= 1e-9
    assert {limit["verdict"] for limit in found["limits"]} == {"within limit"}


def test_all_shipped_scenes_are_listed_and_written_by_name(capsys, folder, scenarios):
    code, out, _ = call(capsys, "new")
    names = {file.stem for file in [*scenarios.glob("*.py"), *scenarios.glob("*.toml")]}
    listed = [line.split()[0] for line in out.splitlines() if line.startswith("  ")]
    assert code == 0
    assert listed == [*TEMPLATES, *sorted(names)]
    rows = json.loads(call(capsys, "new", "--json")[1])
    assert [row["name"] for row in rows] == listed
    assert [row["name"] for row in rows if row["template"]] == [*TEMPLATES]
    for name in ("u2_5_5_stop", "drag_lowering", "lining_life"):  # two of them use another one
        code, out, err = call(capsys, "new", name, "--json")
        assert (code, err) == (0, "")
        written = json.loads(out)["written"]
        sb.check(open_scene(folder / written))
    assert written == "lining_life.py"


def test_new_replaces_no_file_and_names_what_is_near(capsys, folder):
    (folder / "standard.toml").write_text("mine", "utf-8")
    for arguments, words in (
        (["standard"], "standard.toml: exists and is not replaced"),
        (["standart"], "nearest: standard"),
        (["standard", "mine.py"], "give a name with .toml"),
    ):
        code, out, err = call(capsys, "new", *arguments)
        assert (code, out) == (2, "")
        assert words in err
    assert [(file.name, file.read_text("utf-8")) for file in folder.iterdir()] == [("standard.toml", "mine")]


def test_a_scene_is_opened_by_name_and_a_study_says_that_it_is_one(capsys, tmp_path):
    assert call(capsys, "scene", "check", "standard")[0] == call(capsys, "scene", "check", "u2_5_5_stop")[0] == 0
    study = tmp_path / "study.py"
    study.write_text("def main():\n    pass\n", "utf-8")
    code, _, err = call(capsys, "run", study)
    assert code == 2
    assert f"is a study without a scene — run it: python {study}" in err
    code, _, err = call(capsys, "run", "standart")
    assert code == 2
    assert "standart: there is no such file — nearest: standard, " in err


def test_titles_and_names_of_shipped_scenes(tmp_path):
    for name, text, title in (
        ("a_b.toml", "# ## A stop.\n# more\nx = 1\n", "A stop"),
        ("a_b.toml", "x = 1\n# A stop\n", "a b"),
        ("a_b.toml", "", "a b"),
        ("a_b.py", '"""A stop.\n\nMore."""\n', "A stop"),
        ("a_b.py", "# A stop\nx = 1\n", "a b"),
        ("a_b.py", "def (", "a b"),
    ):
        assert title_of(tmp_path / name, text) == title
    assert shipped_files()["standard"].template
    assert not shipped_files()["u2_5_5_stop"].template
    assert sb.files.shipped("standard").read_text("utf-8").startswith("#")
    assert hint_of("standart").startswith("nearest: standard")
    assert 1 <= len(hint_of("stop").split(",")) <= 3
    for name, words in (("standart", "nearest: standard"), ("qqqq", "there are: standard, staged, heated, ")):
        with pytest.raises(sb.InputError, match=f"{name}: is not the name of a template or shipped scene — {words}"):
            sb.files.shipped(name)


def test_the_wheel_takes_the_shipped_scenes_along(scenarios):
    """What `.ci/check_installed.py` sees in an installed one."""
    names = {name for name, one in shipped_files().items() if not one.template}
    assert {one.file.parent for one in shipped_files().values() if not one.template} == {scenarios}
    assert len(names - set(IN_CHECKOUT)) == 12
    assert names > set(IN_CHECKOUT)


def test_a_scene_of_the_checkout_alone_says_where_it_is(capsys, monkeypatch):
    installed = {name: one for name, one in shipped_files().items() if name not in IN_CHECKOUT}
    monkeypatch.setattr(_shipped, "shipped_files", lambda: installed)
    where = "it is scenarios/unequal_bands.py in a checkout of the repository"
    for arguments in (("run", "unequal_bands"), ("new", "unequal_bands")):
        code, _, err = call(capsys, *arguments)
        assert code == 2
        assert where in err


def test_no_script_or_page_sets_64_bits_itself(scenarios):
    """Importing simbrake does."""
    root, patterns = scenarios.parent, ("README.md", "docs/**/*.md", "scenarios/**/*.py", "notebooks/*.ipynb")
    files = [file for pattern in patterns for file in root.glob(pattern)]
    assert len(files) > 60
    line = re.compile(r"jax\.config\.update\(.{1,2}jax_enable_x64")
    assert [file.name for file in files if line.search(file.read_text("utf-8"))] == []


# --- what may be set --------------------------------------------------------------------------------------------------


def test_keys_of_a_scene_file_can_be_set_beside_its_numbers(capsys, folder, scenarios):
    call(capsys, "new", "standard")
    changes = ["brake.linings.count=18", "brake.linings.wrap=280 deg", "duty.slack_tension.end=30 kN"]
    changes += ["duty.load.mass=80 t", "brake.band.stiffness=none"]
    given = [part for change in changes for part in ("--set", change)]
    code, text, _ = call(capsys, "scene", "show", "standard.toml", "--toml", *given)
    assert code == 0
    scene = sb.files.scene_from_text(text)
    assert scene.brake.linings.angle.shape == (18,)
    assert float(scene.brake.linings.wrap) == pytest.approx(280 * 3.141592653589793 / 180, rel=1e-15)
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


def test_the_number_of_equal_linings_can_be_set_in_a_python_scene_too(capsys, scenarios):
    code, out, _ = call(capsys, "scene", "check", scenarios / "u2_5_5_stop.py", "--set", "brake.linings.count=18")
    assert (code, "18 linings" in out) == (0, True)
    for wrong, words in (("18.5", "is not a number of linings"), ("none", "is not a number of linings")):
        code, _, err = call(
            capsys, "scene", "check", scenarios / "u2_5_5_stop.py", "--set", f"brake.linings.count={wrong}"
        )
        assert (code, words in err) == (2, True)
    made = open_scene(scenarios / "u2_5_5_stop.py")
    fewer = sb.with_values(made, {"brake.linings.count": 16, "duty.load.mass": "30 t"})
    assert fewer.brake.linings.angle.tolist() == [float(made.brake.linings.wrap) / 16] * 16
    assert float(fewer.duty.load.mass) == 30e3
    with pytest.raises(sb.InputError, match=r"brake\.linings\.count: linings differ"):
        sb.with_values(sb.with_values(made, {"brake.linings.angle[3]": 0.2}), {"brake.linings.count": 16})
    each = open_scene(scenarios / "equal_wear_layout.py")  # a wall for each lining
    with pytest.raises(sb.InputError, match=r"brake\.linings\.count: linings differ, or other parts"):
        sb.with_values(each, {"brake.linings.count": 16})


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
    assert "input error" in err


def test_values_of_varied_parameters_in_si():
    scene, axes = open_scene(sb.files.shipped("standard")), {}
    given = {"duty.load.mass": _studies._grid("40 t:80 t:5"), "initial.omega": _studies._grid("120 rpm, 10 rad/s")}
    assert _studies._axes(scene, given, axes) == []
    assert axes["duty.load.mass"].tolist() == [40e3, 50e3, 60e3, 70e3, 80e3]
    assert axes["initial.omega"] == pytest.approx([4 * 3.141592653589793, 10.0], rel=1e-15)


# --- every command ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [*COMMANDS, "scene show", "scene check", "scene schema"])
def test_help_has_one_word_for_a_scene_exit_codes_and_json(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "200")
    code, out, _ = call(capsys, *command.split(), "--help")
    assert code == 0
    assert "Exit codes: 0 " in out
    assert "--json" in out
    assert "scenario" not in out.lower()
    if "--out -o" in out:
        assert "Folder for the files that the command writes" in out
    assert not [line for line in out.splitlines() if line.endswith("STR...  │")]


def test_colour_is_for_terminals_and_not_where_it_is_not_wanted(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    text = "stopped: the brake holds\nlimit    exceeded: 5 kN"
    assert _options.highlighted(text, True) == text  # captured: no terminal
    monkeypatch.setattr(sys, "stdout", Terminal())
    seen = _options.highlighted(text, True)
    assert seen.startswith("\x1b[32mstopped\x1b[0m: the brake")
    assert "\x1b[31mexceeded\x1b[0m: 5 kN" in seen
    monkeypatch.setattr(sys, "stderr", Terminal())
    with pytest.raises(SystemExit):
        _cli.main(["new", "standart"])
    assert sys.stderr.getvalue().startswith("\x1b[31msimbrake:\x1b[0m 1 input error")
    for name, value in (("NO_COLOR", "1"), ("TERM", "dumb")):
        with monkeypatch.context() as here:
            here.setenv(name, value)
            assert _options.highlighted(text, True) == text


def test_mistakes_are_answered_without_jax(folder):
    """In a command, an option, the name of a file or of a template: no module that takes time to load."""
    import subprocess

    program = "import sys; from simbrake._commands._cli import main\ntry:\n    main()\nfinally:\n"
    program += "    print(sorted({'jax', 'numpy', 'scipy'} & set(sys.modules)))"
    lines = ("runn", "run standard --rtoll 1", "run step.toml --set a.b=1", "calibrate step.toml", "new standart")
    for line in (*lines, "synthesize step.toml", "compare a.nc b.nc", "validate --cross-check step.toml", "new"):
        done = subprocess.run([sys.executable, "-c", program, *line.split()], capture_output=True, text=True)
        assert done.returncode == (0 if line == "new" else 2), line
        assert done.stdout.splitlines()[-1] == "[]", line


def test_out_is_a_folder_or_the_one_file_of_a_command(folder):
    (folder / "kept.d").mkdir()
    for out, file in (("a", "a/x.png"), ("a.png", "a.png"), ("b/a.svg", "b/a.svg"), ("kept.d", "kept.d/x.png")):
        assert _options.file_in(folder / out, "x.png") == folder / file
    (folder / "taken").touch()
    (fault,) = _options.faults_of_file(folder / "taken" / "x.png")
    assert fault.path == "--out"
    assert os.listdir(folder / "kept.d") == []


def test_a_name_is_a_file_or_else_a_shipped_scene(folder):
    def named(text):
        return _options.named_file(None, [SimpleNamespace(value=text)])

    assert named("standard") == shipped_files()["standard"].file
    for text in ("standard.toml", "a/standard", "nothing"):
        assert named(text) == pathlib.Path(text)
    (folder / "standard").touch()
    assert named("standard") == pathlib.Path("standard")


def test_names_of_files_that_cannot_be_written(folder):
    (folder / "taken").touch()
    endings = (".png", ".svg", ".pdf")
    for file, allowed, said in (
        (None, endings, []),
        (folder / "x.svg", endings, []),
        (folder / "new" / "x.anything", (), []),
        (folder, endings, [f"--out: {folder} is a folder — give a file"]),
        (
            folder / "x.gif",
            endings,
            [f"{folder / 'x.gif'}: .gif is not a format of this file — give .png, .svg or .pdf"],
        ),
        (
            folder / "x",
            endings,
            [f"{folder / 'x'}: a name without ending is not a format of this file — give .png, .svg or .pdf"],
        ),
        (
            folder / "taken" / "x.png",
            endings,
            [f"--out: {folder / 'taken'} is a file — give a folder, or a name with an ending"],
        ),
    ):
        assert [str(fault) for fault in _options.faults_of_file(file, *allowed)] == said
    for out, name, where in (("a.png", "x.png", "a.png"), ("a", "x.png", "a/x.png")):
        assert _options.file_in(folder / out, name) == folder / where


def test_texts_of_options():
    faults = []
    found = _options.assignments("--sigma", "NAME=VALUE", ["a = 1", "b=x", "=3", "a=2", "c", "d=1=2"], float, faults)
    assert found == {"a": 1.0}
    hint = "is not of the form NAME=VALUE — numbers are in SI, or have their unit"
    assert [str(fault) for fault in faults] == [
        f"--sigma b=x: {hint}",
        f"--sigma =3: {hint}",
        "--sigma a: is given twice — give each parameter once",
        f"--sigma c: {hint}",
        f"--sigma d=1=2: {hint}",
    ]
    assert _options.assignments("--sigma", "NAME=VALUE", None, float, faults) == {}
    assert _options.bounds("1 t:2 t") == ["1 t", "2 t"]
    scene, wrong = open_scene(sb.files.shipped("standard")), []
    assert _options.in_si(scene, "--fit", {"duty.load.mass": ["1 t", "2 t"]}, wrong) == {"duty.load.mass": [1e3, 2e3]}
    assert _options.in_si(scene, "--fit", {"duty.load.mas": ["1", "2"]}, wrong) == {}
    assert [fault.path for fault in wrong] == ["--fit duty.load.mas=1:2"]


def test_exit_codes_and_what_ended_well():
    codes = {(ok, exceeded): _options.exit_code(ok, exceeded) for ok in (True, False) for exceeded in (True, False)}
    assert codes == {(True, False): 0, (True, True): 3, (False, False): 1, (False, True): 1}
    assert _options.exit_code(True) == 0
    for status, ok, good in (
        ("stopped", True, True),
        ("held", True, True),
        ("runaway", True, False),
        ("end_of_time", True, None),
        ("stopped", False, False),
    ):
        assert _options.verdict_of(SimpleNamespace(status=status, ok=ok)) is good
    from simbrake._run._measure import LimitVerdict

    kept, passed = SimpleNamespace(verdict="within limit"), SimpleNamespace(verdict=LimitVerdict.EXCEEDED)
    assert [_options.any_exceeded(checks) for checks in ([], [kept], [kept, passed])] == [False, False, True]


def test_verdicts_in_colour(monkeypatch):
    monkeypatch.setattr(_options, "coloured", lambda text, colour, stream: f"<{colour} {text}>")
    for text, ok, seen in (
        ("stopped: x", True, "<32 stopped>: x"),
        ("step_limit: x", False, "<31 step_limit>: x"),
        ("runaway: x", None, "runaway: x"),
        ("a\nb: x", True, "a\nb: x"),
        ("nothing", True, "nothing"),
        ("a\nwarning  b, warning", None, "a\n<33 warning>  b, warning"),
        ("x within limit, y exceeded", None, "x <32 within limit>, y <31 exceeded>"),
    ):
        assert _options.highlighted(text, ok) == seen


def test_results_are_printed_as_text_or_as_json_and_written_all_at_once(folder, capsys):
    _options.tell("a text", lambda: {"a": [1]}, False)
    _options.tell("a text", lambda: {"a": [1]}, True)
    assert capsys.readouterr().out == 'a text\n{\n "a": [\n  1\n ]\n}\n'
    with pytest.raises(ValueError, match="not JSON compliant"):
        _options.as_json(float("nan"))
    files = {"b.txt": "text", "a.txt": lambda place: place.write_text("made", "utf-8")}
    _options.write(folder / "out", files, False)
    assert capsys.readouterr().out == f"written  {folder / 'out' / 'a.txt'}, {folder / 'out' / 'b.txt'}\n"
    _options.write(folder / "out", files, True)
    assert capsys.readouterr().out == ""
    texts = [(folder / "out" / name).read_text("utf-8") for name in ("a.txt", "b.txt")]
    assert texts == ["made", "text\n"]


def test_a_scene_is_opened_with_all_errors_in_one_report(folder):
    file = sb.files.shipped("standard")
    also, given = [], {"faults": [sb.Fault("--span", "is odd")], "max_steps": 0, "workers": None, "starts": 1}
    with pytest.raises(sb.InputError) as caught:
        _options.opened(file, ["initial.omega=x"], 0.105, also=lambda scene: also.append(scene) or [], **given)
    assert [fault.path for fault in caught.value.faults] == ["--span", "--rtol", "--max-steps", "initial.omega"]
    assert str(caught.value.faults[1]) == "--rtol: 0.105 is out of range — 0 < rtol < 0.1"
    assert str(caught.value.faults[2]) == "--max-steps: 0 is out of range — at least 1"
    for rtol in (1e-15, 1.05e-15, 0.099):
        if rtol > 1e-15:
            assert float(_options.opened(file, ["initial.omega=3"], rtol, max_steps=1).initial.omega) == 3.0
        else:
            with pytest.raises(sb.InputError, match="--rtol"):
                _options.opened(file, None, rtol)
    with pytest.raises(sb.InputError, match="1 input error:\n  --vary: is odd"):
        _options.opened(file, None, also=lambda scene: [sb.Fault("--vary", "is odd")])
    with pytest.raises(sb.InputError) as caught:
        _options.opened(folder / "x.toml", ["a"], 1.0)
    assert [fault.path for fault in caught.value.faults] == ["--rtol", str(folder / "x.toml")]
    assert (
        caught.value.faults[1].hint == "give the path of a scene file; simbrake new lists templates and shipped scenes"
    )
    with pytest.raises(sb.InputError, match=r"nearest: standard.*; simbrake new lists"):
        _options.existing(folder / "standart")


def test_before_jax_works(monkeypatch):
    """64 bits, fewer rounds of the garbage collector, and Ctrl-C where nobody has switched it off."""
    before, heard = gc.get_threshold(), signal.getsignal(signal.SIGINT)
    monkeypatch.delenv("TF_CPP_MIN_LOG_LEVEL", raising=False)
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        _options.prepare_jax()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert gc.isenabled()
        assert gc.get_threshold()[:2] == (100_000, 50)
        assert os.environ["TF_CPP_MIN_LOG_LEVEL"] == "3"
        assert jax.config.jax_enable_x64
        signal.signal(signal.SIGINT, lambda *_: None)
        failed = []
        aside = threading.Thread(target=lambda: failed.append(_options.prepare_jax()))
        aside.start()
        aside.join()
        assert failed == [None]
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
        _options.prepare_jax()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, heard)
        gc.set_threshold(*before)


def test_titles_fit_into_the_terminal(monkeypatch, folder):
    """Words of one letter fill a line up to its last place or the one before."""
    file = folder / "x.toml"
    file.touch()
    found = [Shipped("standard", file, "x " * 300), Shipped("own", file, "a stop")]
    for columns, length in (("90", 90), ("91", 90), ("30", 2 + 8 + 2 + 40), (None, 200)):
        monkeypatch.delenv("COLUMNS", raising=False)
        if columns:
            monkeypatch.setenv("COLUMNS", columns)
        lines = _scenes._listed(found).splitlines()
        assert (lines[0], lines[3], lines[4]) == ("templates, with comments", "shipped scenes", "  own       a stop")
        assert len(lines[1]) == length
        assert lines[1].startswith("  standard  x x")
        assert lines[1].endswith("x…")


def test_a_new_scene_goes_into_a_folder_and_a_python_scene_says_how_it_runs_alone(capsys, folder):
    (folder / "mine").mkdir()
    code, out, _ = call(capsys, "new", "u2_5_5_stop", "mine", "--json")
    assert (code, json.loads(out)["written"], json.loads(out)["template"]) == (0, "mine/u2_5_5_stop.toml", False)
    code, out, _ = call(capsys, "new", "drag_lowering", "mine/x.py")
    assert code == 0
    assert out.splitlines()[1:] == [
        "run it   simbrake run mine/x.py",
        "         python mine/x.py: what the script prints beside",
    ]
    assert len(call(capsys, "new", "standard")[1].splitlines()) == 2
    code, out, _ = call(capsys, "scene", "show", "standard.toml", "--json")
    rows = {row["path"]: row for row in json.loads(out)}
    assert (code, rows["initial.omega"]["value"], rows["initial.omega"]["unit"]) == (0, 24.0, "rad/s")
    code, out, _ = call(capsys, "scene", "check", "standard.toml", "--json")
    assert (code, json.loads(out)) == (0, {"faults": [], "warnings": []})
