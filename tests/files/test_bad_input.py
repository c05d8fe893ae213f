"""Bad and hostile input: each is an error at its place, with the hint that leads to the
right one. `bad_input.csv` is the table of what people write."""

import csv
import dataclasses
import inspect
import os
import pathlib
import shlex
import signal
import time

import equinox as eqx
import fuzz
import jax
import numpy as np
import pytest
from commands import call
from goldens import assert_refused
from heat_scenes import fading, lump, rigid_stop
from helpers import faults_of, input_error, paths_of
from oracles import hard_input
from oracles.hard_cases import cases_to_test, check
from scenes import stop_scene
from text_scenes import TEXT

import simbrake as sb

with (pathlib.Path(__file__).parent / "bad_input.csv").open(encoding="utf-8") as _file:
    ROWS = list(csv.DictReader(_file))


def rows_of(kind):
    rows = (row for row in ROWS if row["kind"] == kind)
    return [(row["input"], row["path"], row["hint"]) for row in rows]


@pytest.fixture(autouse=True)
def _not_for_ever(tmp_path, monkeypatch):
    """In a folder of its own; what waits for ever on a pipe fails."""
    monkeypatch.chdir(tmp_path)
    signal.alarm(300)
    yield
    signal.alarm(0)


@pytest.mark.parametrize(("change", "path", "hint"), rows_of("scene"))
def test_scene_file(change, path, hint, tmp_path):
    old, new = change.split(" => ")
    assert old in TEXT
    faults = faults_of(sb.files.scene_from_text, TEXT.replace(old, new, 1), tmp_path)
    assert hint in "".join(str(one) for one in faults if path in ("", one.path))


def test_all_faults_of_a_file_at_once():
    text = TEXT
    for old, new in (('"590 mm"', "-1"), ("= 0.35", "= true"), ("omega =", "omga =")):
        text = text.replace(old, new)
    paths = {fault.path for fault in faults_of(sb.files.scene_from_text, text)}
    assert paths == {"brake.pulley.radius", "brake.linings.friction", "initial.omga"}
    faults = faults_of(sb.files.scene_from_text, 'programme = ["take"]\npull = "1 W"')
    assert {fault.path for fault in faults} >= {"pull", "programme[0]"}


@pytest.mark.parametrize(("text", "path", "hint"), rows_of("recording"))
def test_recording(text, path, hint, tmp_path):
    (tmp_path / "a.csv").write_text(text.replace("\\n", "\n"), "utf-8")
    told = [str(fault) for fault in faults_of(sb.read_measured, "a.csv")]
    assert any(path in text and hint in text for text in told), told


@pytest.mark.parametrize(("line", "_", "hint"), rows_of("command"))
def test_command(line, _, hint, capsys, tmp_path, monkeypatch):
    """Exit code 2, nothing on stdout, no traceback, and no file."""
    monkeypatch.setenv("COLUMNS", "200")
    code, out, err = call(capsys, *shlex.split(line))
    assert (code, out, hint in err) == (2, "", True), err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


# --- in Python ----------------------------------------------------------------------

SCENE = stop_scene()
HEAT = sb.Heat((sb.thermal.Lump("body", 1.0),))
#: values that options of a run cannot have
OPTIONS = {
    "rtol": (np.nan, np.inf, -1e-6, 0.0, 0.1, 1.0, "1e-6"),
    "max_step": (np.nan, -1e-6, 0.0),
    "max_steps": (-1, 10**12),
    "max_events": (-1, "3"),
}
SPEED = {"initial.omega": [1.0]}
ROPE = sb.loads.RopeLayers("35 mm", turns_per_layer=30, turns=50)


def test_value_or_option(request):
    calls = [
        lambda: sb.Pulley(None, 1200, {}),
        lambda: sb.Pulley(0.5, 10**400),
        lambda: sb.Brake(sb.Pulley(1, 1), 3.0, 0.35),
        lambda: sb.Bandage(65.0, 0.3, [1.0, "x"]),
        lambda: sb.Bandage(65.0, 0.3, [1.0, -2.0]),
        lambda: sb.Initial(jax.numpy.float32(3)),
        lambda: sb.simulate_heat(HEAT, [0.0, 1.0], rtol=np.nan),
        lambda: sb.ensemble(SCENE, SPEED, workers="a"),
        lambda: sb.ensemble(SCENE, [1, 2]),
        lambda: sb.read_measured("x.csv", sigma={"omega": None}),
        lambda: sb.save(None, "x.nc"),
    ]
    calls += [
        lambda option=option, bad=bad: sb.simulate(SCENE, **{option: bad})
        for option, every in OPTIONS.items()
        for bad in every
    ]
    assert_refused(request, "values", calls)


def test_argument_near_an_unknown_one(request):
    drum = {"drum_diameter": "0.8 m", "line_count": 8, "rope": ROPE}
    calls = (
        lambda: sb.Pulley(radius=1, inertia_=1200),
        lambda: sb.Pulley(diameter=1.18, inertia=1),
        lambda: sb.HookLoad(1, **drum),
        lambda: sb.Pulley(radius=0.59),
        lambda: sb.simulate(stop_scene(), rtoll=1e-9),
    )
    assert_refused(request, "arguments", calls)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("duty.load.line_count", 278.2),
        ("duty.load.drum_radius", 1e12),
        ("end_time", 9e18),
        ("brake.band.stiffness", 5e-324),
        ("brake.pulley.inertia", 1e-308),
        ("duty.load.mass", 1e200),
    ],
)
def test_absurd_number(path, value):
    scene = sb.with_values(sb.files.scene_from_text(TEXT), {path: value})
    for look in (sb.check_scene, sb.simulate):
        assert [fault.path for fault in faults_of(look, scene)] == [path]


def test_one_report_of_scene_and_options(tmp_path):
    scene = sb.with_values(SCENE, {"end_time": -1.0})
    for run in (sb.simulate, sb.prepare, sb.Stepper):
        there = paths_of(run, scene, rtol=1.0, solver="Tsit5")
        assert there == ["rtol", "solver", "end_time"]
    file = str(tmp_path / "x.txt")
    wrong = {"inputs": ["wind"], "waiting": 0}
    there = paths_of(sb.export_c, SCENE, file, outputs=["max_tenson"], **wrong)
    assert there == [file, "waiting", "max_tenson", "wind"]
    there = paths_of(sb.export.export_fmu, SCENE, file, fmi=1, **wrong)
    assert there == [file, "waiting", "fmi", "wind"]


@pytest.mark.parametrize("case", cases_to_test(hard_input.CASES))
def test_number_that_is_none(case):
    check(case)


def test_anything_in_the_place_of_a_number():
    scene = stop_scene()
    accepted = []
    places = {id(leaf.value): leaf.path for leaf in sb.files.leaves(scene)}
    for i, number in enumerate(jax.tree.leaves(scene)):
        for wrong in (None, "x", {}, object(), True, 1j, np.zeros((2, 2)), 10**400):
            spoiled = eqx.tree_at(lambda s, i=i: jax.tree.leaves(s)[i], scene, wrong)
            try:
                sb.simulate(spoiled, throw=False)
            except sb.InputError:
                continue
            accepted.append((places[id(number)], wrong))
    assert accepted == [("brake.band.stiffness", None)]


def with_wrong_field(node, source):
    """Copies of a part in which a field of it, or of a part in it, is something else."""
    for field in dataclasses.fields(node):
        inner = getattr(node, field.name)
        for wrong in (object(), source, (source,), (3, "x")) if field.init else ():
            yield node, field.name, lambda w=wrong, f=field: {f.name: w}
        entries = inner if isinstance(inner, tuple) else (inner,)
        for i, part in enumerate(entries):
            for owner, name, change in (
                with_wrong_field(part, source) if dataclasses.is_dataclass(part) else ()
            ):

                def whole(change=change, part=part, i=i, f=field, inner=inner):
                    new = dataclasses.replace(part, **change())
                    many = isinstance(inner, tuple)
                    return {f.name: (*inner[:i], new, *inner[i + 1 :]) if many else new}

                yield owner, name, whole


def test_anything_in_the_place_of_a_part():
    """Also of a text, of yes or no, and in a list of parts."""
    source = sb.thermal.Source("nowhere", 1.0)
    tried = set()
    for name in ("everything_coupled", "heated", "rig", "disc", "shoe", "two_bands"):
        scene = sb.read_scene(name)
        for owner, field, change in with_wrong_field(scene, source):
            with input_error():
                sb.check_scene(dataclasses.replace(scene, **change()))
                pytest.fail(f"accepted: {type(owner).__name__}.{field}")
            tried.add((type(owner), field))
    assert len(tried) > 150


class Odd:
    """What fits nowhere."""

    def __repr__(self):
        return "odd"


@pytest.mark.parametrize("value", [Odd(), {1: Odd()}, [[1, 2], [3]]], ids=str)
def test_every_public_function(value):
    """Each tells what does not fit."""
    homes = [
        sb,
        *(
            home
            for name in sb.__all__
            if inspect.ismodule(home := getattr(sb, name)) and home is not sb.hybrid
        ),
    ]
    names = {
        name: getattr(home, name)
        for home in homes
        for name in getattr(home, "__all__", ())
        if home is not sb.hybrid
    }
    functions = {name: one for name, one in names.items() if inspect.isfunction(one)}
    assert len(functions) > 150
    raw = {}
    for name, function in functions.items():
        parameters = inspect.signature(function).parameters.values()
        needed = [
            x for x in parameters if x.default is x.empty and "VAR_" not in x.kind.name
        ]
        named = {x.name: value for x in needed if x.kind is x.KEYWORD_ONLY}
        try:
            if needed:
                function(*[value] * (len(needed) - len(named)), **named)
        except sb.InputError:
            pass
        except Exception as error:
            raw[name] = f"{type(error).__name__}: {error}"
    assert raw == {}


# --- files that mean harm -----------------------------------------------------------


def test_mutants_are_read_or_input_errors():
    found = [fuzz.tried(kind, content) for kind, content in fuzz.mutants(500, 1)]
    assert [one for one in found if one] == []


@pytest.mark.parametrize(
    ("kind", "content"),
    [
        ("set", "brake.linings.co\nunt=18"),
        ("set", f"brake.linings.angle[{'9' * 5000}]=0.2"),
        ("set", "initial.omega=" + "[" * 100_000),
        ("set", ".=1"),
        ("set", "[[=1"),
        ("scene", TEXT.replace('"590 mm"', '"590 m^9^9^9^9^9^9"')),
        ("scene", TEXT.replace("= 0.35", "= " + "{ base = " * 3000 + "1" + "}" * 3000)),
        ("scene", ".".join(["a"] * 40_000) + " = 1"),
        ("recording", "t,omega [rpm]\n0,1e308\n1,1\n2,1e309\n"),
        ("recording", ",".join(f"x{i}" for i in range(20_000)) + "\n" + "1," * 20_000),
        *(("manifest", text) for text in ("[]", "null", '"a"', "[" * 100_000)),
    ],
    ids=lambda text: text[:20],
)
def test_mutants_that_once_failed(kind, content, tmp_path):
    assert fuzz.tried(kind, content) is None
    faults_of(fuzz.read, kind, content, tmp_path)


def test_pipes_devices_and_large_files(tmp_path):
    os.mkfifo("pipe.toml")
    os.mkfifo("pipe.csv")
    faults_of(sb.read_scene, "pipe.toml")
    for name in ("pipe.csv", "/dev/zero"):
        faults_of(sb.read_measured, name)
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate((1 << 25) + 1)
    (tmp_path / "latin.toml").write_bytes("# é\n".encode("latin-1") + TEXT.encode())
    for name in ("large", "latin", "a" * 5000):
        faults_of(sb.read_scene, f"{name}.toml")


def test_files_of_a_scene_lie_in_its_folder(tmp_path, monkeypatch):
    folder = tmp_path / "scene"
    folder.mkdir()
    for file in (folder / "lever.csv", tmp_path / "outside.csv"):
        file.write_text("t,tension [kN]\n0,2\n1,24\n", "utf-8")
    os.symlink(tmp_path / "outside.csv", folder / "link.csv")
    scene = sb.files.scene_from_text(fuzz.lever_from("lever.csv"), folder)
    assert scene.duty.slack_tension.values.tolist() == [2e3, 24e3]
    for name in ("../outside.csv", str(tmp_path / "outside.csv"), "link.csv"):
        faults_of(sb.files.scene_from_text, fuzz.lever_from(name), folder)
    monkeypatch.setenv("SIMBRAKE_DATA_ANYWHERE", "1")
    sb.files.scene_from_text(fuzz.lever_from("../outside.csv"), folder)


def test_reading_data_runs_no_code(tmp_path):
    call_ = "__import__('os').system('touch hit')"
    faults_of(sb.files.scene_from_text, TEXT.replace('"590 mm"', f'"590 {call_}"'))
    faults_of(sb.files.scene_from_text, TEXT, values={"initial.omega": call_})
    (tmp_path / "a.csv").write_text(f"t,omega\n0,{call_}\n", "utf-8")
    faults_of(sb.read_measured, "a.csv")

    class Hit:
        def __reduce__(self):
            return os.system, ("touch hit",)

    first = fuzz.ensemble(tmp_path / "runs")
    for chunk in (tmp_path / "runs").glob("chunk-*"):
        np.savez(chunk, run=np.asarray([Hit()], object), final=np.ones(1, bool))
    again = fuzz.ensemble(tmp_path / "runs")
    assert again.stopping_time.equals(first.stopping_time)
    assert not (tmp_path / "hit").exists()


@pytest.mark.parametrize("text", ["import sys; sys.exit(0)", "def scene(): exit('x')"])
def test_script_that_ends_the_process(text, tmp_path):
    (tmp_path / "mine.py").write_text(text, "utf-8")
    faults_of(sb.read_scene, "mine.py")


def test_no_cell_of_a_table_is_a_formula(tmp_path, capsys):
    """Names that people give reach tables, not a spreadsheet's interpreter."""
    scene = rigid_stop(fading(), lump(), 1.0)
    text = sb.files.scene_text(scene)
    for body in scene.heat.bodies:
        text = text.replace(f'"{body.name}', f'"x,=cmd|x{body.name}')
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    assert call(capsys, "run", "mine.toml", "--out", "out")[0] == 0
    with open("out/series.csv", encoding="utf-8", newline="") as file:
        head, *_ = csv.reader(file)
    assert any("cmd" in cell for cell in head)
    assert not [cell for cell in head if cell.startswith(("=", "@", "+", "-"))]


def test_long_input_takes_linear_time():
    start = time.perf_counter()
    text = sb.files.scene_text(sb.files.scene_from_text(TEXT))
    angles = next(line for line in text.split("\n") if line.startswith("angle = "))
    many = text.replace(angles, f"angle = [{', '.join(['1e-5'] * 100_000)}]")
    assert sb.files.scene_from_text(many).brake.linings.count == 100_000
    lever = sb.PiecewiseLinear(np.linspace(0.0, 1.0, 600_000), np.ones(600_000))
    assert faults_of(sb.check_scene, stop_scene(lever=lever))[0].path == "scene"
    assert time.perf_counter() - start < 5
