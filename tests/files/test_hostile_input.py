"""Hostile input: a few hundred mutants of `fuzz.py`, those that once failed, files that are none, absurd numbers."""

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
    found = [one for kind, content in fuzz.mutants(500, 1) if (one := fuzz.tried(kind, content))]
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
    ("recording", ",".join(["t", *(f"x{i}" for i in range(20_000))]) + "\n" + "1," * 20_000 + "1\n"),
    *(("manifest", text) for text in ("[]", "3", "null", '"a"', "[" * 100_000)),
)


@pytest.mark.parametrize(("kind", "content"), CORPUS, ids=[f"{kind}-{i}" for i, (kind, _) in enumerate(CORPUS)])
def test_mutants_that_once_failed(kind, content, tmp_path):
    assert fuzz.tried(kind, content) is None
    with pytest.raises(sb.InputError):
        fuzz.kinds_read()[kind](content, tmp_path)


# --- data are data ----------------------------------------------------------------------------------------------------


def test_files_of_a_scene_lie_beside_it(tmp_path, monkeypatch):
    (tmp_path / "scene" / "data").mkdir(parents=True)
    for file in ("scene/data/lever.csv", "outside.csv"):
        (tmp_path / file).write_text("t,tension [kN]\n0,2\n1,24\n", "utf-8")
    os.symlink(tmp_path / "outside.csv", tmp_path / "scene" / "link.csv")
    folder = tmp_path / "scene"
    assert scene_from_text(fuzz.lever_from("data/lever.csv"), folder).duty.slack_tension.values.tolist() == [2e3, 24e3]
    for name in ("../outside.csv", str(tmp_path / "outside.csv"), "link.csv", "/dev/zero", "data/../../outside.csv"):
        with pytest.raises(sb.InputError, match=r"slack_tension\.file: .* is not in the folder of the scene"):
            scene_from_text(fuzz.lever_from(name), folder)
    monkeypatch.setenv("SIMBRAKE_DATA_ANYWHERE", "1")
    assert scene_from_text(fuzz.lever_from("../outside.csv"), folder).duty.slack_tension.times.tolist() == [0, 1]


def test_pipes_devices_and_large_files(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.toml")
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(sb.InputError, match="is not a regular file"):
        sb.read_scene(tmp_path / "pipe.toml")
    for name in (tmp_path / "pipe.csv", "/dev/zero"):
        with pytest.raises(sb.InputError, match="is not a regular file"):
            sb.read_measured(name)
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate((1 << 25) + 1)
    with pytest.raises(sb.InputError, match="34 MB"):
        sb.read_scene(tmp_path / "large.toml")
    (tmp_path / "latin.toml").write_bytes("# é\n".encode("latin-1") + BASE.encode())
    with pytest.raises(sb.InputError, match="give a TOML file in UTF-8"):
        sb.read_scene(tmp_path / "latin.toml")
    with pytest.raises(sb.InputError, match="cannot be read"):
        sb.read_scene(tmp_path / ("a" * 5000 + ".toml"))


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


def test_script_that_ends_the_process(tmp_path):
    for text, words in (
        ("import sys; sys.exit(0)", r"sys\.exit\(0\)"),
        ("def scene(): exit('x')", r"sys\.exit\('x'\)"),
    ):
        (tmp_path / "mine.py").write_text(text, "utf-8")
        with pytest.raises(sb.InputError, match=words):
            sb.read_scene(tmp_path / "mine.py")


def test_no_cell_of_a_table_is_a_formula(tmp_path, capsys):
    """Names that people give reach tables: what a spreadsheet would compute does not begin a cell."""
    scene = rigid_stop(fading(), lump(), 1.0)
    renamed = scene_text(scene)
    for body in scene.heat.bodies:
        renamed = renamed.replace(f'"{body.name}', f'"x,=cmd|x{body.name}')
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(renamed, "utf-8")
    with pytest.raises(SystemExit) as stop:
        main(["run", str(file), "--out", str(out)])
    assert stop.value.code == 0
    seen = 0
    for row in csv.reader((out / "series.csv").read_text("utf-8").split("\n")):
        for cell in row:
            seen += "cmd" in cell
            assert not cell.startswith(("=", "@", "+")), cell
            assert not cell.startswith("-") or cell[1:2].isdigit() or cell == "-inf", cell
    assert seen


# --- numbers and parts that cannot be meant ---------------------------------------------------------------------------

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


def test_fraction_of_a_line_is_a_warning():
    scene = sb.with_values(scene_from_text(BASE), {"duty.load.line_count": 8.5})
    (said,) = sb.simulate(scene).summary()["warnings"]
    assert "duty.load.line_count = 8.5" in said


def test_long_input_takes_linear_time():
    fades = tuple(sb.LinearFade(1e-3, 300.0) for _ in range(101))
    with pytest.raises(sb.InputError, match="at most 100"):
        sb.friction.ProductFriction(0.35, fades)
    start = time.perf_counter()
    text = scene_text(scene_from_text(BASE))
    angles = next(line for line in text.split("\n") if line.startswith("angle = "))
    many = scene_from_text(text.replace(angles, f"angle = [{', '.join(['1e-5'] * 100_000)}]"))
    assert many.brake.linings.count == 100_000
    lever = sb.PiecewiseLinear(np.linspace(0.0, 1.0, 600_000), np.ones(600_000))
    with pytest.raises(sb.InputError, match=r"scene: has 12000\d\d numbers — at most 1000000"):
        sb.check_scene(stop_scene(lever=lever))
    assert time.perf_counter() - start < 5


@pytest.mark.slow
def test_a_million_rows_take_seconds(tmp_path):
    t = np.linspace(0, 1000, 1_000_000)
    lines = "\n".join(f"{x!r},{20 - x!r}" for x in t.tolist())
    (tmp_path / "long.csv").write_text(f"t [ms],omega [rpm]\n{lines}\n", "utf-8")
    start = time.process_time()
    (points,) = sb.read_measured(tmp_path / "long.csv").points
    assert time.process_time() - start < 5
    np.testing.assert_allclose(points.value, (20 - t) * np.pi / 30, rtol=1e-15)
    np.testing.assert_allclose(points.t, t / 1000, rtol=1e-15)


WRONG = ("x.toml", None, 3, [1], {})


@pytest.mark.parametrize("wrong", WRONG, ids=repr)
def test_what_is_no_scene_is_called_so(wrong):
    calls = (
        sb.simulate,
        sb.prepare,
        sb.check_scene,
        sb.estimates,
        sb.synthesize,
        sb.lining_life,
        scene_text,
        sb.Stepper,
    )
    calls += (lambda x: sb.ensemble(x, {"initial.omega": [1.0]}), lambda x: sb.sensitivity(x, "stopping_time"))
    calls += (lambda x: sb.uncertainty(x, {}), lambda x: sb.with_values(x, {}), lambda x: sb.cross_check(x))
    calls += (lambda x: sb.calibrate(x, {"initial.omega": (1, 2)}, sb.studies.Measured()),)
    for call in calls:
        with pytest.raises(sb.InputError, match="is not a scene"):
            call(wrong)


def test_parts_and_options_of_a_wrong_kind():
    scene, speed = stop_scene(), {"initial.omega": [1.0]}
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
        "Scene.end_time": lambda: sb.Scene(scene.brake, scene.duty, scene.initial, None),
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
    scene, accepted = stop_scene(), []
    places = {id(leaf.value): leaf.path for leaf in sb.files.leaves(scene)}
    for i, number in enumerate(jax.tree.leaves(scene)):
        for wrong in (None, "x", {}, object(), True, np.asarray(["a"]), 1j, np.zeros((2, 2)), 10**400):
            spoiled = eqx.tree_at(lambda s, i=i: jax.tree.leaves(s)[i], scene, wrong)
            try:
                sb.simulate(spoiled, throw=False)
            except sb.InputError:
                continue
            accepted.append((places[id(number)], wrong))
    assert accepted == [("brake.band.stiffness", None)]  # a rigid band


def parts_with_paths(node, path=()):
    """Every part of a scene, one of each class, with the names and places on the way to it."""
    if isinstance(node, tuple):
        return [found for i, one in enumerate(node) for found in parts_with_paths(one, (*path, i))]
    if not dataclasses.is_dataclass(node):
        return []
    below = [parts_with_paths(getattr(node, field.name), (*path, field.name)) for field in dataclasses.fields(node)]
    return [(path, node), *(found for each in below for found in each)]


def put(node, path, value):
    if not path:
        return value
    first, *rest = path
    if isinstance(first, int):
        return (*node[:first], put(node[first], rest, value), *node[first + 1 :])
    return dataclasses.replace(node, **{first: put(getattr(node, first), rest, value)})


def test_anything_in_the_place_of_a_part():
    """Also of a text, of yes or no, and in a list of parts; an error is at the place itself."""
    source, tried = sb.thermal.Source("rim", 1.0), set()
    for name in ("everything_coupled", "heated", "rig", "disc", "shoe", "two_bands", "unequal_bands"):
        scene = sb.read_scene(name)
        for path, part in parts_with_paths(scene):
            for field in dataclasses.fields(part):
                if (type(part), field.name) in tried or not field.init:
                    continue
                tried.add((type(part), field.name))
                for wrong in (object(), source, (source,), (3, "x")):
                    with pytest.raises(sb.InputError):  # noqa: PT012
                        sb.check_scene(put(scene, (*path, field.name), wrong))
                        pytest.fail(f"accepted: {type(part).__name__}.{field.name} = {wrong}")
    assert len(tried) > 150


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda s, x: sb.Heat(s.heat.bodies, links=(x,)), "Heat.links[0]: Source(a='rim', power=1 W) does not fit"),
        (lambda s, x: sb.Heat(s.heat.bodies, links=x), "Heat.links: Source(a='rim', power=1 W) does not fit"),
        (lambda s, x: sb.Heat((*s.heat.bodies, x)), "give a Lump or a Junction or a Reservoir or a Wall"),
        (lambda s, x: dataclasses.replace(s, shaft=[x]), "Scene.shaft[0]: Source("),
        (lambda s, x: sb.check_scene(eqx.tree_at(lambda s: s.heat.links, s, (x,))), "heat.links[0]: Source("),
        (lambda s, x: sb.simulate(eqx.tree_at(lambda s: s.brake, s, x)), "brake: Source("),
        (lambda s, x: sb.simulate(eqx.tree_at(lambda s: s.brake.band.radius, s, x)), "brake.band.radius: Source("),
        (lambda s, x: sb.thermal.Lump(3, 2e5), "Lump.name: 3 does not fit here — give a text"),
        (
            lambda s, x: sb.thermal.Conductance("a", "b", 3, opens=1),
            "Conductance.opens: 1 does not fit here — give True",
        ),
        (lambda s, x: sb.thermal.Reservoir("air", None), "Reservoir.temperature: is missing"),
        (lambda s, x: sb.loads.Phases(()), "Phases.phases: has no phase"),
        (lambda s, x: sb.brakes.MultiBandBrake(s.brake.pulley, 0.6, ()), "MultiBandBrake.bands: there is no band"),
    ],
)
def test_part_of_a_wrong_kind_is_told_at_its_place(spoil, said):
    with pytest.raises(sb.InputError) as raised:
        spoil(sb.read_scene("heated"), sb.thermal.Source("rim", 1.0))
    assert said in str(raised.value)


def test_lists_of_parts_may_be_lists():
    scene = sb.read_scene("heated")
    heat = dataclasses.replace(scene.heat, links=list(scene.heat.links))
    assert heat == scene.heat
    assert heat.links == scene.heat.links


@pytest.fixture(autouse=True)
def _not_for_ever():
    """A test that waits for ever on a pipe fails."""
    signal.alarm(300)
    yield
    signal.alarm(0)


# --- arguments of the wrong kind in Python ----------------------------------------------------------------------------


def public_functions():
    """Every function that a user can name, by its name."""
    names = ("brakes", "checks", "files", "formulas", "layouts", "loads", "plot", "profiles", "results", "rig")
    homes = [sb, *(getattr(sb, name) for name in (*names, "studies", "thermal"))]
    found = {name: getattr(home, name) for home in homes for name in home.__all__}
    return {name: function for name, function in found.items() if inspect.isfunction(function)}


class Odd:
    """What fits nowhere."""


@pytest.mark.parametrize("value", [Odd(), {1: Odd()}, [[1, 2], [3]]], ids=["object", "dict", "list"])
def test_every_public_function_tells_what_does_not_fit(value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    functions, raw = public_functions(), {}
    assert len(functions) > 150
    for name, function in functions.items():
        parameters = inspect.signature(function).parameters.values()
        needed = [one for one in parameters if one.default is one.empty and "VAR_" not in one.kind.name]
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


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: sb.with_values(s, np.nan), "values: nan"),
        (lambda s: sb.read_result({}), "path: a table does not fit here — give a text or a path"),
        (lambda s: sb.write_scene(s, [1, 2]), "path: [1, 2]"),
        (lambda s: sb.dataset(0), "0 does not fit here — give a Result"),
        (lambda s: sb.plot.tornado(3), "3 does not fit here"),
        (lambda s: sb.uniform_linings(20, None, 0.3), "wrap: None does not fit here — give a number"),
        (lambda s: sb.ramp([1, 2], 3, 0, 1), "[1, 2]"),
        (lambda s: sb.prepare(s, rtol=[]), "rtol: []"),
        (lambda s: sb.simulate(s, max_step=[1, 2]), "max_step: [1, 2]"),
        (lambda s: sb.simulate(s, solver="x"), "solver"),
        (lambda s: sb.brakes.ParallelBands(3), "bands: 3 does not fit here — give a list; an entry is a Stiffness ("),
        (lambda s: sb.Heat(3), "bodies: 3 does not fit here — give a list; an entry is a Lump or"),
        (
            lambda s: sb.friction.ProductFriction(0.3, 3),
            "factors: 3 does not fit here — give a list; an entry is a Factor (",
        ),
        (lambda s: sb.sweep(s, [1]), "values: [1] does not fit here — give a dict"),
    ],
)
def test_what_once_was_a_raw_answer(call, said):
    with pytest.raises(sb.InputError) as raised:
        call(stop_scene())
    assert said in str(raised.value)


def test_an_error_of_the_user_passes():
    """A metric of the user's that fails is no argument of the wrong kind."""

    def metric(result):
        return result.nothing_of_that_name

    with pytest.raises(AttributeError, match="nothing_of_that_name"):
        sb.sweep(stop_scene(), {"initial.omega": [10.0]}, [metric])
