"""Hostile input: a few hundred mutants of `fuzz.py`, those that once failed, files that
are none, absurd numbers."""

import csv
import dataclasses
import inspect
import os
import signal
import time

import equinox as eqx
import fuzz
import jax
import numpy as np
import pytest
from heat_scenes import fading, lump, rigid_stop
from helpers import main
from stop_scenes import stop_scene

import simbrake as sb
from simbrake.files import scene_from_text, scene_text

BASE = fuzz.standard()


def test_mutants_are_read_or_input_errors():
    started = time.perf_counter()
    found = [
        one
        for kind, content in fuzz.mutants(500, 1)
        if (one := fuzz.tried(kind, content))
    ]
    assert found == []
    assert time.perf_counter() - started < 60


#: mutants that once failed, and are input errors now
CORPUS = (
    ("set", "brake.linings.co\nunt=18"),
    ("set", f"brake.linings.angle=[{'9' * 400}, 0.3]"),
    ("set", f"brake.linings.angle[{'9' * 5000}]=0.2"),
    ("set", "initial.omega=" + "[" * 100_000),
    ("set", ".=1"),
    ("set", "format[0]=x"),
    ("set", "duty.slack_tension.start[0]=2 kN"),
    ("set", "[[=1"),
    ("scene", BASE.replace('"590 mm"', '"590 m^9^9^9^9^9^9"')),
    ("scene", ".".join(["a"] * 40_000) + " = 1"),
    ("scene", ".".join(["'a'"] * 40_000) + " = 1"),
    ("recording", "t,omega [rpm]\n0,1e308\n1,1\n2,1e309\n"),
    (
        "recording",
        ",".join(["t", *(f"x{i}" for i in range(20_000))])
        + "\n"
        + "1," * 20_000
        + "1\n",
    ),
    *(("manifest", text) for text in ("[]", "3", "null", '"a"', "[" * 100_000)),
)


@pytest.mark.parametrize(
    ("kind", "content"),
    CORPUS,
    ids=[f"{kind}-{i}" for i, (kind, _) in enumerate(CORPUS)],
)
def test_mutants_that_once_failed(kind, content, tmp_path):
    assert fuzz.tried(kind, content) is None
    with pytest.raises(sb.InputError):
        fuzz.kinds_read()[kind](content, tmp_path)


# --- data are data ------------------------------------------------------------------


def test_files_of_a_scene_lie_beside_it(tmp_path, monkeypatch):
    (tmp_path / "scene" / "data").mkdir(parents=True)
    for file in ("scene/data/lever.csv", "outside.csv"):
        (tmp_path / file).write_text("t,tension [kN]\n0,2\n1,24\n", "utf-8")
    os.symlink(tmp_path / "outside.csv", tmp_path / "scene" / "link.csv")
    folder = tmp_path / "scene"
    assert scene_from_text(
        fuzz.lever_from("data/lever.csv"), folder
    ).duty.slack_tension.values.tolist() == [2e3, 24e3]
    for name in (
        "../outside.csv",
        str(tmp_path / "outside.csv"),
        "link.csv",
        "/dev/zero",
        "data/../../outside.csv",
    ):
        with pytest.raises(
            sb.InputError,
            match=r"slack_tension\.file: .* is not in the folder of the scene",
        ):
            scene_from_text(fuzz.lever_from(name), folder)
    monkeypatch.setenv("SIMBRAKE_DATA_ANYWHERE", "1")
    assert scene_from_text(
        fuzz.lever_from("../outside.csv"), folder
    ).duty.slack_tension.times.tolist() == [0, 1]


def test_pipes_devices_and_large_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(sb.InputError, match="is not a regular file"):
        sb.read_scene(tmp_path / "pipe.toml")
    for name in (tmp_path / "pipe.csv", "/dev/zero"):
        with pytest.raises(sb.InputError, match="is not a regular file"):
            sb.read_measured(name)
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate((1 << 25) + 1)
    (tmp_path / "latin.toml").write_bytes("# é\n".encode("latin-1") + BASE.encode())
    for name in ("large", "latin", "a" * 5000):
        with pytest.raises(sb.InputError):
            sb.read_scene(tmp_path / f"{name}.toml")


def test_reading_data_runs_no_code(tmp_path, monkeypatch):
    """No reader of data imports, evaluates or unpickles what it reads."""
    monkeypatch.chdir(tmp_path)
    call = "__import__('os').system('touch hit')"
    with pytest.raises(sb.InputError):
        scene_from_text(BASE.replace('"590 mm"', f'"590 {call}"'))
    with pytest.raises(sb.InputError):
        scene_from_text(BASE, values={"initial.omega": call})
    (tmp_path / "hit.csv").write_text(f"t,omega\n0,{call}\n", "utf-8")
    with pytest.raises(sb.InputError):
        sb.read_measured(tmp_path / "hit.csv")

    class Hit:
        def __reduce__(self):
            return os.system, ("touch hit",)

    folder = tmp_path / "runs"
    first = fuzz.ensemble(folder)
    chunks = [*folder.glob("chunk-*")]
    assert chunks
    for chunk in chunks:
        np.savez(chunk, run=np.asarray([Hit()], object), final=np.ones(1, bool))
    assert fuzz.ensemble(folder).stopping_time.equals(first.stopping_time)
    assert not (tmp_path / "hit").exists()


@pytest.mark.parametrize("text", ["import sys; sys.exit(0)", "def scene(): exit('x')"])
def test_script_that_ends_the_process(text, tmp_path):
    (tmp_path / "mine.py").write_text(text, "utf-8")
    with pytest.raises(sb.InputError):
        sb.read_scene(tmp_path / "mine.py")


def test_no_cell_of_a_table_is_a_formula(tmp_path, capsys):
    """Names that people give reach tables: what a spreadsheet would compute does not
    begin a cell."""
    scene = rigid_stop(fading(), lump(), 1.0)
    renamed = scene_text(scene)
    for body in scene.heat.bodies:
        renamed = renamed.replace(f'"{body.name}', f'"x,=cmd|x{body.name}')
    file = tmp_path / "mine.toml"
    out = tmp_path / "out"
    file.write_text(renamed, "utf-8")
    with pytest.raises(SystemExit) as stop:
        main(["run", str(file), "--out", str(out)])
    assert stop.value.code == 0
    seen = 0
    for row in csv.reader((out / "series.csv").read_text("utf-8").split("\n")):
        for cell in row:
            seen += "cmd" in cell
            assert not cell.startswith(("=", "@", "+")), cell
            assert not cell.startswith("-") or cell[1:2].isdigit() or cell == "-inf", (
                cell
            )
    assert seen


# --- numbers and parts that cannot be meant -----------------------------------------

ABSURD = {
    "duty.load.line_count": 278.2,
    "duty.load.drum_radius": 1e12,
    "end_time": 9e18,
    "brake.band.stiffness": 5e-324,
    "brake.pulley.inertia": 1e-308,
    "duty.load.mass": 1e200,
}


@pytest.mark.parametrize("path", ABSURD)
def test_absurd_numbers_are_input_errors(path):
    scene = sb.with_values(scene_from_text(BASE), {path: ABSURD[path]})
    for look in (sb.check_scene, sb.simulate):
        with pytest.raises(sb.InputError) as caught:
            look(scene)
        assert [fault.path for fault in caught.value.faults] == [path]


def test_long_input_takes_linear_time():
    fades = tuple(sb.LinearFade(1e-3, 300.0) for _ in range(101))
    with pytest.raises(sb.InputError, match="at most 100"):
        sb.friction.ProductFriction(0.35, fades)
    start = time.perf_counter()
    text = scene_text(scene_from_text(BASE))
    angles = next(line for line in text.split("\n") if line.startswith("angle = "))
    many = scene_from_text(
        text.replace(angles, f"angle = [{', '.join(['1e-5'] * 100_000)}]")
    )
    assert many.brake.linings.count == 100_000
    lever = sb.PiecewiseLinear(np.linspace(0.0, 1.0, 600_000), np.ones(600_000))
    with pytest.raises(
        sb.InputError, match=r"scene: has 12000\d\d numbers — at most 1000000"
    ):
        sb.check_scene(stop_scene(lever=lever))
    assert time.perf_counter() - start < 5


def test_parts_and_options_of_a_wrong_kind():
    scene = stop_scene()
    speed = {"initial.omega": [1.0]}
    calls = {
        "rtol": lambda: sb.simulate(scene, rtol="1e-6"),
        "max_steps": lambda: sb.simulate(scene, max_steps=100.0),
        "max_step": lambda: sb.simulate(scene, max_step="a"),
        "max_events": lambda: sb.simulate(scene, max_events="3"),
        "max_steps ": lambda: sb.simulate(scene, max_steps=10**12),
        "rtol ": lambda: sb.ensemble(scene, speed, rtol="a"),
        "workers": lambda: sb.ensemble(scene, speed, workers="a"),
        "max_steps  ": lambda: sb.ensemble(scene, speed, max_steps=1e3),
        "values": lambda: sb.ensemble(scene, [1, 2]),
        "data": lambda: sb.calibrate(scene, {"initial.omega": (1, 2)}, None),
        "sigma of omega": lambda: sb.read_measured("x.csv", sigma={"omega": None}),
        "Scene.end_time": lambda: sb.Scene(
            scene.brake, scene.duty, scene.initial, None
        ),
        "Scene.brake": lambda: sb.Scene(scene.duty, scene.brake, scene.initial, 5.0),
        "brake.linings.friction": lambda: sb.simulate(
            sb.with_values(scene, {"brake.linings.friction.static_ratio": np.ones(2)})
        ),
        "x.nc": lambda: sb.save(None, "x.nc"),
    }
    for path, call in calls.items():
        with pytest.raises(sb.InputError) as caught:
            call()
        assert caught.value.faults[0].path == path.strip(), path


def test_anything_in_the_place_of_a_number():
    scene = stop_scene()
    accepted = []
    places = {id(leaf.value): leaf.path for leaf in sb.files.leaves(scene)}
    for i, number in enumerate(jax.tree.leaves(scene)):
        for wrong in (
            None,
            "x",
            {},
            object(),
            True,
            np.asarray(["a"]),
            1j,
            np.zeros((2, 2)),
            10**400,
        ):
            spoiled = eqx.tree_at(lambda s, i=i: jax.tree.leaves(s)[i], scene, wrong)
            try:
                sb.simulate(spoiled, throw=False)
            except sb.InputError:
                continue
            accepted.append((places[id(number)], wrong))
    assert accepted == [("brake.band.stiffness", None)]  # a rigid band


def parts_with_paths(node, path=()):
    """Every part of a scene, one of each class, with the names and places on the way to
    it."""
    if isinstance(node, tuple):
        return [
            found
            for i, one in enumerate(node)
            for found in parts_with_paths(one, (*path, i))
        ]
    if not dataclasses.is_dataclass(node):
        return []
    below = [
        parts_with_paths(getattr(node, field.name), (*path, field.name))
        for field in dataclasses.fields(node)
    ]
    return [(path, node), *(found for each in below for found in each)]


def put(node, path, value):
    if not path:
        return value
    first, *rest = path
    if isinstance(first, int):
        return (*node[:first], put(node[first], rest, value), *node[first + 1 :])
    return dataclasses.replace(node, **{first: put(getattr(node, first), rest, value)})


def test_anything_in_the_place_of_a_part():
    """Also of a text, of yes or no, and in a list of parts; an error is at the place
    itself."""
    source = sb.thermal.Source("rim", 1.0)
    tried = set()
    for name in (
        "everything_coupled",
        "heated",
        "rig",
        "disc",
        "shoe",
        "two_bands",
        "unequal_bands",
    ):
        scene = sb.read_scene(name)
        for path, part in parts_with_paths(scene):
            for field in dataclasses.fields(part):
                if (type(part), field.name) in tried or not field.init:
                    continue
                tried.add((type(part), field.name))
                for wrong in (object(), source, (source,), (3, "x")):
                    with pytest.raises(sb.InputError):  # noqa: PT012
                        sb.check_scene(put(scene, (*path, field.name), wrong))
                        pytest.fail(
                            f"accepted: {type(part).__name__}.{field.name} = {wrong}"
                        )
    assert len(tried) > 150


@pytest.fixture(autouse=True)
def _not_for_ever():
    """A test that waits for ever on a pipe fails."""
    signal.alarm(300)
    yield
    signal.alarm(0)


# --- arguments of the wrong kind in Python ------------------------------------------


def public_functions():
    """Every function that a user can name, by its name."""
    names = (
        "brakes",
        "checks",
        "files",
        "formulas",
        "layouts",
        "loads",
        "plot",
        "profiles",
        "results",
        "rig",
    )
    homes = [sb, *(getattr(sb, name) for name in (*names, "studies", "thermal"))]
    found = {name: getattr(home, name) for home in homes for name in home.__all__}
    return {
        name: function
        for name, function in found.items()
        if inspect.isfunction(function)
    }


class Odd:
    """What fits nowhere."""


@pytest.mark.parametrize(
    "value", [Odd(), {1: Odd()}, [[1, 2], [3]]], ids=["object", "dict", "list"]
)
def test_every_public_function_tells_what_does_not_fit(value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    functions = public_functions()
    raw = {}
    assert len(functions) > 150
    for name, function in functions.items():
        parameters = inspect.signature(function).parameters.values()
        needed = [
            one
            for one in parameters
            if one.default is one.empty and "VAR_" not in one.kind.name
        ]
        if not needed:
            continue
        positional = [value for one in needed if one.kind is not one.KEYWORD_ONLY]
        named = {one.name: value for one in needed if one.kind is one.KEYWORD_ONLY}
        try:
            function(*positional, **named)
        except sb.InputError:
            pass
        except Exception as error:
            raw[name] = f"{type(error).__name__}: {error}"
    assert raw == {}


def test_a_metric_of_the_user_that_fails_is_named():
    def metric(result):
        return result.nothing_of_that_name

    with pytest.raises(sb.InputError, match="nothing_of_that_name"):
        sb.sweep(stop_scene(), {"initial.omega": [10.0]}, [metric])
