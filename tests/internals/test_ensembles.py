"""Plans and chunks of ensembles: sizes, groups, faults, the data set, the folder of chunks, lanes."""

import dataclasses
import json
import os
import pickle
import re
import time
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from heat_scenes import fading, lump, rigid_stop
from stop_scenes import FRICTION, LEVER, SPEED, TIMES, drawn, stop_scene

import simbrake as sb
from simbrake._run._measure import measure
from simbrake.hybrid import Code
from simbrake.results import BandMode, metric_names
from simbrake.studies import _ensemble, _evaluator
from simbrake.studies._chunks import Store, Task
from simbrake.studies._evaluator import LANES, Job


def plan(values, scene=None, metrics=None, solver=None, max_steps=None, chunk=None):
    return _ensemble.plan_of(scene or stop_scene(), values, metrics, 1e-10, solver, max_steps, chunk)


def faults(call, *arguments, **settings):
    with pytest.raises(sb.InputError) as caught:
        call(*arguments, **settings)
    return [str(fault) for fault in caught.value.faults]


# --- the plan ---------------------------------------------------------------------------------------------------------


def test_wrong_values_are_named_with_runs():
    many = np.full(9, -1.0)
    several = "(runs 0, 1, 2, 3, 4 and 4 more)"
    assert several in faults(plan, {"brake.pulley.inertia": many})[0]
    five = faults(plan, {"brake.pulley.inertia": many[:5]})[0]
    assert "-1 kg*m^2 is out of range (runs 0, 1, 2, 3, 4)" in five
    angles = np.full((3, 20), 0.2)
    angles[2, 7:] = -0.3, *np.full(12, -0.4)
    assert "-0.3 rad is out of range (run 2)" in faults(plan, {"brake.linings.angle": angles})[0]
    for shape in ((), (0,), (2, 0), (1, 1, 1)):
        assert faults(plan, {SPEED: np.zeros(shape)})[0].startswith(f"{SPEED}: has the shape {shape}")
    assert faults(plan, [1.0]) == ["values: nothing varies — give {path: array of values}"]
    late = {"initial.time": [1.0, 1.5, 7.0, 9.0], "end_time": [2.0, 1.5, 6.0, 10.0]}
    assert faults(plan, late) == ["end_time: 1.5 s is not after the start (runs 1, 2) — it must be later"]
    wide = faults(plan, {"brake.linings.angle": [0.2, 0.4, 0.25, 0.5, 0.41]})
    spans = ["458.4° (runs 1, 4)", "573.0° (run 3)"]  # one hint, one error: also of several runs
    assert [text.split(" span ")[1].split(" — ")[0] for text in wide] == spans
    (chunk,) = faults(plan, {SPEED: [1.0]}, chunk=2.0)
    assert chunk == "chunk: 2.0 is out of range — chunk > 0"
    (twice,) = faults(plan, {SPEED: [1.0]}, metrics=["stopping_time", "stopping_angle", "stopping_time"])
    assert twice.startswith("stopping_time: is asked for twice")


def test_grid_needs_distinct_numbers():
    wrong = {SPEED: [1.0, 2.0, 1.0], LEVER: [[1.0, 2.0]], "end_time": "soon"}
    assert [text.partition(":")[0] for text in faults(sb.sweep, stop_scene(), wrong)] == [SPEED, LEVER, "end_time"]
    assert faults(sb.sweep, stop_scene(), {}) == ["values: nothing varies — give {path: array of values}"]
    assert faults(sb.ensemble, stop_scene(), {SPEED: [1.0]}, workers=0) == ["workers: 0 is out of range — at least 1"]


def test_maxima_are_measured_only_on_request():
    scene = stop_scene()
    maxima = {name for name in metric_names(scene) if name.startswith(("max_", "peak_"))}
    assert {"max_tension", "max_normal_load"} <= maxima
    usual = _ensemble.default_metrics(scene)
    assert set(usual) == set(metric_names(scene)) - maxima
    assert {"stopping_time", "energy.friction_heat"} <= set(usual)
    assert plan({SPEED: [1.0]}).metrics == usual


def test_runs_are_grouped_by_their_solver():
    def groups(scene, values, solver=None):
        return [(type(one).__name__, runs.tolist()) for one, runs in plan(values, scene, solver=solver).groups()]

    cool, stiff = rigid_stop(fading(), lump(cooling=10.0)), rigid_stop(fading(), lump(cooling=2e7))
    cooling, speed = {"heat.links[0].value": [10.0, 2e7, 50.0]}, {SPEED: [20.0, 15.0, 10.0]}
    explicit, implicit = (type(sb.hybrid.Rodas5P()).__name__ if kind else None for kind in (False, True))
    explicit = groups(stop_scene(), speed)[0][0]
    assert explicit != implicit
    assert groups(stop_scene(), speed) == [(explicit, [0, 1, 2])]
    assert groups(cool, speed) == [(explicit, [0, 1, 2])]
    assert groups(stiff, speed) == [(implicit, [0, 1, 2])]
    assert groups(cool, cooling) == groups(stiff, cooling) == [(explicit, [0, 2]), (implicit, [1])]
    assert groups(cool, {"heat.links[0].value": [1e7, 2e7]}) == [(implicit, [0, 1])]
    quick = rigid_stop(fading(), lump(cooling=2e4))
    assert groups(quick, {"end_time": [1.0, 2000.0, 2.0]}) == [(explicit, [0, 2]), (implicit, [1])]
    given = sb.hybrid.Rodas5P()
    assert groups(cool, cooling, given) == groups(stop_scene(), speed, given) == [(implicit, [0, 1, 2])]


# --- chunks -----------------------------------------------------------------------------------------------------------


def runs_of(count, metrics=("stopping_time",), chunk=None, on_cpu=True, workers=2):
    pool = SimpleNamespace(on_cpu=on_cpu, workers=workers)
    made = plan({SPEED: np.linspace(1.0, 20.0, count)}, metrics=list(metrics), chunk=chunk)
    return _ensemble.Runs(made, pool, None, False)


def job(runs, size, max_steps=128, **changes):
    one = runs.plan
    solver = one.groups()[0][0]
    return Job(one.scene, one.paths, one.metrics, solver, one.rtol, max_steps, size, 16)._replace(**changes)


def test_lanes_are_for_short_explicit_runs():
    runs = runs_of(5)
    one = job(runs, 1024)
    assert one.lanes == LANES
    assert job(runs, 8).lanes == 8
    assert one._replace(max_steps=129).lanes == 1
    assert one._replace(solver=sb.hybrid.Rodas5P()).lanes == 1
    assert one._replace(metrics=("stopping_time", "max_tension")).lanes == 1
    assert one._replace(metrics=(lambda result: result.stopping_time,)).lanes == 1
    brake = dataclasses.replace(one.scene.brake, bandage=sb.Bandage(20.0, 0.1))
    assert one._replace(scene=dataclasses.replace(one.scene, brake=brake)).lanes == 1
    # rows of all records: of events alone, or of whole runs
    assert one._replace(size=2**20).fitting().size == 2**22 // 16
    assert one._replace(size=2**20, metrics=("max_tension",)).fitting().size == 2**19 // 128
    assert one._replace(room=2**30).fitting().size == 1
    assert one.fitting() == one


class Counting:
    """A pool that takes each run's steps to be those given, and keeps what it was asked for."""

    on_cpu = True

    def __init__(self, steps, workers=1):
        self.steps, self.workers, self.asked = steps, workers, []

    def submit(self, job, tasks):
        self.asked += [(job.max_steps, job.room, task.runs.tolist(), task.last) for task in tasks]
        self.tasks = [task for task in tasks if len(task.runs)]

    def results(self):
        for task in self.tasks:
            steps = self.steps[task.runs]
            code = np.where(steps > task.limit, int(Code.STEP_LIMIT), 0)
            yield task, {"code": code, "steps": steps, "stopping_time": task.rows[:, 0]}


def group(steps, workers=1, speeds=None, **settings):
    speeds = np.linspace(1.0, 20.0, len(steps)) if speeds is None else speeds
    made = plan({SPEED: speeds}, metrics=["stopping_time"], **settings)
    pool = Counting(np.asarray(steps), workers)
    runs = _ensemble.Runs(made, pool, None, False)
    ((solver, some),) = made.groups()
    runs.group(solver, some)
    return runs, pool.asked


def test_runs_repeat_with_more_steps_at_need():
    steps = np.where(np.arange(20) % 5 == 0, 500, 20)
    runs, asked = group(steps)
    assert asked[0] == (128, 32, list(range(20)), False)
    again = [(limit, room, last) for limit, room, *_, last in asked[1:5]]
    assert again == [(1024, 256, False)] * 4
    assert sorted(i for *_, chunk, _ in asked[1:5] for i in chunk) == [0, 5, 10, 15]
    assert np.all(runs.done)
    assert runs.columns["steps"].tolist() == steps.tolist()
    runs, asked = group(np.full(3, 10**7))
    tried = sorted({(limit, last) for limit, _, _, last in asked})
    assert [last for _, last in tried] == [False] * (len(tried) - 1) + [True]
    assert asked[-1][0] == asked[-1][1]  # the last one has room for every step
    assert runs.done.all()
    assert set(runs.columns["code"]) == {int(Code.STEP_LIMIT)}
    runs, asked = group(steps, max_steps=40)
    assert [(limit, room, last) for limit, room, _, last in asked] == [(40, 40, True)]
    assert np.flatnonzero(runs.columns["code"]).tolist() == [0, 5, 10, 15]
    # where most of the first runs are longer, the others begin with the higher limit
    _, asked = group(np.full(200, 500))
    assert (asked[0][0], len(asked[0][2])) == (128, 64)
    assert {limit for limit, *_ in asked[1:]} == {1024}
    _, asked = group(np.where(np.arange(200) % 3 == 0, 500, 20))
    assert [limit for limit, *_ in asked[:2]] == [128, 128]


def test_cluster_worker_stores_its_results(tmp_path, monkeypatch):
    made = plan({SPEED: [1.0, 2.0]}, metrics=["stopping_time"], solver=sb.hybrid.Rodas5P())
    store = _ensemble.store_of(made, tmp_path / "kept")
    manifest = json.loads((tmp_path / "kept" / "manifest.json").read_text("utf-8"))
    assert {name: manifest[name] for name in ("runs", "paths", "metrics", "rtol", "solver", "max_steps")} == {
        "runs": 2,
        "paths": [SPEED],
        "metrics": ["stopping_time"],
        "rtol": 1e-10,
        "solver": "Rodas5P",
        "max_steps": None,
    }
    called = []

    def chunk(job, rows):
        called.append((job, rows.tolist()))
        return {"code": np.zeros(2, int), "stopping_time": 2 * rows[:, 0]}

    monkeypatch.setattr(_ensemble, "run_chunk", chunk)
    payload, task = pickle.dumps("job"), Task(128, np.arange(2), made.columns)
    for folder, key, times in (
        ("", "", 1),
        (str(tmp_path / "kept"), store.key, 2),
        (str(tmp_path / "kept"), store.key, 2),
    ):
        found = _ensemble.run_packed(payload, task, folder, key)
        assert found["stopping_time"].tolist() == [2.0, 4.0]
        assert called == [("job", [[1.0], [2.0]])] * times, folder
    # a folder that is another ensemble's, or not there, keeps nothing
    for folder, key in ((str(tmp_path / "kept"), "other"), (str(tmp_path / "nowhere"), store.key)):
        _ensemble.run_packed(payload, task, folder, key)
    assert len(called) == 4
    assert not (tmp_path / "nowhere").exists()


# --- the data set -----------------------------------------------------------------------------------------------------


def test_data_set_has_words_units_sequences():
    n, codes = 5, np.array([0, 0, int(Code.STEP_LIMIT), -1, 0])
    made = plan({SPEED: np.arange(1.0, 6.0), "brake.linings.angle": np.full((n, 20), 0.2)}, metrics=["stopping_time"])
    runs = _ensemble.Runs(made, SimpleNamespace(on_cpu=True, workers=1), None, False)
    assert runs.columns["code"].tolist() == [-1] * n
    columns = runs.columns | {"code": codes, "sequence": np.array([7, 3, 7, 0, 3]), "moved": np.array([1, 0, 1, 0, 1])}
    columns |= {"stopping_time": np.arange(n) + 0.5, "band": np.full(n, BandMode.HELD)}
    data = _ensemble._as_dataset(made, columns)
    words = data.status.values
    assert words.tolist() == ["stopped", "held", "step_limit", "not_run", "stopped"]
    ways = {"band": [0, 0, 3, 3, 5], "turn": [0, 1, 1, 1, 1], "exceeded": [0, 0, 1, 0, 1], "steady": [0, 0, 0, 1, 0]}
    ways |= {"inner": [0, 0, 0, 0, 1], "code": [0] * 5, "moved": [1] * 5}
    ended = _ensemble._statuses({name: np.array(way) for name, way in ways.items()})
    assert ended.tolist() == ["stopped", "released", "runaway", "lowering", "runaway"]
    assert data.sequence.values.tolist() == [0, 1, 0, 2, 1]
    assert data.sequence.attrs["meaning"].startswith("runs with the same number")
    assert data.run.values.tolist() == list(range(n))
    assert data[SPEED].dims == ("run",)
    assert data["brake.linings.angle"].dims == ("run", "brake.linings.angle entry")
    assert data.stopping_time.attrs == {"units": "s"}
    assert data.code.attrs["units"] == "1"
    assert (
        "units"
        not in _ensemble._as_dataset(dataclasses.replace(made, metrics=(len,)), columns | {"len": np.zeros(n)})[
            "len"
        ].attrs
    )
    assert data.attrs["rtol"] == 1e-10
    axes = {SPEED: np.array([1.0, 2.0]), LEVER: np.array([5e3, 6e3, 7e3])}
    flat = _ensemble._as_dataset(
        plan({SPEED: np.repeat(axes[SPEED], 3), LEVER: np.tile(axes[LEVER], 2)}, metrics=["stopping_time"]),
        {name: np.resize(column, 6) for name, column in columns.items()},
    )
    grid = _ensemble._as_grid(flat, axes)
    assert grid.run.values.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert grid.stopping_time.dims == (SPEED, LEVER)
    assert grid[LEVER].attrs["units"] == "N"


# --- the folder of chunks ---------------------------------------------------------------------------------------------


def test_a_folder_gives_back_what_is_final(tmp_path):
    store = Store(tmp_path / "kept", "key", {"runs": 4})
    short = Task(16, np.array([2, 3]), np.zeros((2, 1)), last=False)
    last = Task(64, np.array([2, 3]), np.zeros((2, 1)))
    columns = {"code": np.array([0, int(Code.STEP_LIMIT)]), "stopping_time": np.array([1.5, np.inf])}
    assert short.final(columns).tolist() == [True, False]
    assert last.final(columns).tolist() == [True, True]
    assert store.read(short) is None
    store.write(short, columns)
    store.write(short, {"code": np.array([5, 5])})  # what is there stays
    again = Store(tmp_path / "kept", "key", {"runs": 4})
    assert again.read(short)["stopping_time"].tolist() == [1.5, np.inf]
    assert again.read(last) is None
    ((runs, found),) = again.finished()
    assert runs.tolist() == [2]
    assert {name: column.tolist() for name, column in found.items()} == {"code": [0], "stopping_time": [1.5]}
    (file,) = (tmp_path / "kept").glob("chunk-*.npz")
    assert re.fullmatch(r"chunk-00000002-[0-9a-f]{16}\.npz", file.name)
    file.write_bytes(file.read_bytes()[:40])
    assert again.read(short) is None
    assert [*again.finished()] == []
    assert Store(tmp_path / "kept", "key").key == "key"  # of another process


def test_folder_of_other_things_is_refused(tmp_path):
    file, kept = tmp_path / "file", tmp_path / "kept"
    file.touch()
    assert faults(Store, file, "key", {}) == [f"directory: {file} is a file — give a folder"]
    manifest = kept / "manifest.json"
    assert faults(Store, kept, "key") == [f"directory: {manifest} is not there"]
    assert not kept.exists()
    Store(kept, "key", {"runs": 4, "rtol": 1e-9})
    assert json.loads(manifest.read_text("utf-8")) == {"format": 2, "fingerprint": "key", "runs": 4, "rtol": 1e-9}
    (other,) = faults(Store, kept, "another", {"runs": 5, "rtol": 1e-9})
    assert "holds another ensemble: runs differ" in other
    (same,) = faults(Store, kept, "another", {"runs": 4, "rtol": 1e-9})
    assert "numbers or structure of the scene, the values, or a function differ" in same
    manifest.write_text(json.dumps({"format": 1, "fingerprint": "key"}), "utf-8")
    assert "holds another ensemble" in faults(Store, kept, "key", {})[0]
    for text, words in (("[1]", "it is not a table"), ("{", "cannot be read: ")):
        manifest.write_text(text, "utf-8")
        (told,) = faults(Store, kept, "key", {})
        assert f"{manifest} cannot be read: " in told
        assert words in told
    manifest.write_bytes(b"\xff\xfe{")
    assert "give another folder" in faults(Store, kept, "key", {})[0]


@pytest.mark.slow
def test_lanes_take_the_steps_of_single_runs(monkeypatch):
    """Lanes wait for each other at events: runs of different events, lengths and ends beside each other; of chunks
    whose last group is not full; and of more events than there is space for at first."""
    n = 21
    rng = np.random.default_rng(5)
    values = {
        SPEED: np.append(rng.uniform(-5, 30, n - 2), [0.0, 12.0]),
        FRICTION: rng.uniform(0.2, 0.4, n),
        "duty.load.profile.level": np.append(rng.uniform(0, 4e4, n - 2), [0.0, 1e4]),
        "end_time": np.append(rng.uniform(0.5, 3.0, n - 2), [1.0, 1e-3]),
    }
    scene, metrics = stop_scene(), [*TIMES, "stopping_angle", "energy.friction_heat", "energy.elastic_change"]
    monkeypatch.setattr(_evaluator, "LANES", 8)
    monkeypatch.setattr(_ensemble, "_ROOM", 3)
    monkeypatch.setattr(_evaluator, "_SHORT", 16)
    limits, run = [], _evaluator.run_chunk
    seen = lambda job, rows, device=None: limits.append(job.max_steps) or run(job, rows, device)  # noqa: E731
    monkeypatch.setattr(_evaluator, "run_chunk", seen)
    data = assert_like_single_runs(scene, values, metrics, range(n), chunk=12)
    assert set(limits) == {16, 1024}
    assert {"stopped", "not_stopped", "held"} <= set(data.status.values)
    for i in range(n):
        one = sb.with_values(scene, {path: array[i] for path, array in values.items()})
        stats = sb.simulate(one, throw=False).record.stats
        got = [int(data[name][i]) for name in ("steps", "rejected", "retaken", "segments")]
        # (programs round differently, and now and then a step is taken again for that)
        np.testing.assert_allclose(got, [stats.accepted, stats.rejected, stats.retaken, stats.segments], atol=1)


def test_planned_scenes_equal_with_values():
    values = {
        "brake.linings.angle": np.linspace(0.1, 0.3, 40).reshape(2, 20),
        SPEED: np.asarray([3.0, 4.0]),
        "duty.slack_tension.level": np.asarray([5e3, 6e3]),
    }
    entry = {"brake.linings.angle[3]": np.asarray([0.11, 0.12]), "brake.linings.angle[-1]": np.asarray([0.2, 0.3])}
    for some in (values, entry):
        plan = _ensemble.plan_of(stop_scene(), some, None, 1e-10, None, None, None)
        for i in (0, 1):
            expected = sb.with_values(stop_scene(), {path: array[i] for path, array in some.items()})
            assert jax.tree.structure(plan.one(i)) == jax.tree.structure(expected)
            for a, b in zip(jax.tree.leaves(plan.one(i)), jax.tree.leaves(expected), strict=True):
                np.testing.assert_array_equal(a, b)


class Interrupting:
    """Progress that interrupts after some runs, as Ctrl-C would."""

    def __init__(self, after):
        self.after = after

    def __call__(self, done, total):
        if done >= self.after:
            self.after = np.inf
            raise KeyboardInterrupt


@pytest.mark.slow
def test_interrupted_and_resumed(tmp_path, capsys, monkeypatch):
    values, folder = drawn(300), tmp_path / "runs"
    run = _evaluator.run_chunk

    def slow(*arguments):
        time.sleep(0.1)
        return run(*arguments)

    monkeypatch.setattr("simbrake.studies._evaluator.run_chunk", slow)
    part = sb.ensemble(stop_scene(), values, ["stopping_time"], directory=folder, workers=1, progress=Interrupting(100))
    missing = part.code.values == -1
    assert 0 < missing.sum() <= 200
    assert set(part.status.values[missing]) == {"not_run"}
    assert np.all(np.isnan(part.stopping_time.values[missing]))
    assert f"{missing.sum()} of 300 runs are missing" in capsys.readouterr().err
    again = []
    monkeypatch.setattr("simbrake.studies._evaluator.run_chunk", lambda *a: again.append(len(a[1])) or run(*a))
    whole = sb.ensemble(stop_scene(), values, ["stopping_time"], directory=folder, progress=False)
    assert sum(again) == missing.sum()
    fresh = sb.ensemble(stop_scene(), values, ["stopping_time"], progress=False)
    np.testing.assert_allclose(whole.stopping_time, fresh.stopping_time, rtol=1e-13)
    (folder / sorted(os.listdir(folder))[0]).write_bytes(b"spoilt")
    assert np.all(sb.ensemble(stop_scene(), values, ["stopping_time"], directory=folder, progress=False).code == 0)
    with pytest.raises(sb.InputError, match="another ensemble: metrics differ"):
        sb.ensemble(stop_scene(), values, ["full_slip_time"], directory=folder)
    twice = tmp_path / "function"

    def metric(result):
        return 2 * result.stopping_time

    sb.ensemble(stop_scene(), values, [metric], directory=twice, progress=False)

    def metric(result):
        return 3 * result.stopping_time

    with pytest.raises(sb.InputError, match="another ensemble: the metric metric differs"):
        sb.ensemble(stop_scene(), values, [metric], directory=twice)
    with pytest.raises(sb.InputError, match="another ensemble: the scene differs"):
        sb.ensemble(stop_scene(R=0.7), values, ["stopping_time"], directory=folder)
    with pytest.raises(sb.InputError, match="holds other files"):
        sb.ensemble(stop_scene(), values, ["stopping_time"], directory=tmp_path)


def assert_like_single_runs(scene, values, metrics, runs, **settings):
    data = sb.ensemble(scene, values, metrics, progress=False, **settings)
    settings.pop("chunk", None)
    for i in runs:
        one = sb.with_values(scene, {path: array[i] for path, array in values.items()})
        single = sb.simulate(one, throw=False, **settings)
        assert (int(data.code[i]), str(data.status[i].values)) == (int(single.code), single.status)
        assert str(data.method[i].values) == single.method_name
        for name in data.data_vars:
            if name in metrics:
                np.testing.assert_allclose(data[name][i], float(measure(single, name)), rtol=1e-12, err_msg=str(name))
        assert float(data["energy.closure"][i]) < 1e-9
    return data
