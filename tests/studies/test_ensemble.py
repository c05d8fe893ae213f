"""Ensembles: the numbers of single runs, every run's own fate, faults, restarts, a cluster, the command line."""

import csv
import json
import os
import signal
import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from heat_scenes import fading, lump, rigid_stop
from helpers import main
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._base._fingerprint import fingerprint
from simbrake._base._programs import STORE
from simbrake._run._measure import measure
from simbrake.studies import _ensemble, _evaluator

SPEED, FRICTION, LEVER = "initial.omega", "brake.linings.friction.coefficient", "duty.slack_tension.level"
TIMES = ("slip_onset_time", "full_slip_time", "stopping_time")


def drawn(count, seed=1):
    rng = np.random.default_rng(seed)
    return {
        SPEED: rng.uniform(5, 30, count),
        FRICTION: rng.uniform(0.2, 0.4, count),
        LEVER: rng.uniform(5e3, 1e4, count),
    }


def travel_share(result):
    return result.stopping_angle / result.record.y_end.phi


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


@pytest.mark.smoke
def test_same_numbers_as_single_runs_with_other_events_in_every_run():
    n = 12
    rng = np.random.default_rng(1)
    values = {
        SPEED: np.append(rng.uniform(-5, 30, n - 1), 0.0),
        FRICTION: rng.uniform(0.2, 0.4, n),
        "duty.load.profile.level": np.append(rng.uniform(0, 4e4, n - 1), 0.0),
        "brake.linings.angle[3]": rng.uniform(0.1, 0.3, n),
        "end_time": rng.uniform(0.5, 3.0, n),
    }
    metrics = [*TIMES, "max_tension", "energy.friction_heat", "energy.elastic_change", "stopping_angle"]
    data = assert_like_single_runs(stop_scene(), values, metrics, range(n), chunk=8)
    assert {"stopped", "not_stopped", "held"} <= set(data.status.values)
    assert np.all(np.isinf(data.stopping_time.values[data.status.values == "not_stopped"]))
    assert data["max_tension"].attrs["units"] == "N"
    assert data[SPEED].attrs == {"units": "rad/s", "meaning": "initial speed"}
    assert data["brake.linings.angle[3]"].attrs["units"] == "rad"


@pytest.mark.slow
def test_lanes_take_the_steps_of_single_runs_whatever_their_neighbours_do(monkeypatch):
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


def test_scenes_of_single_runs_are_those_of_with_values():
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


@pytest.mark.slow
def test_failing_runs_keep_their_codes_and_only_short_ones_are_repeated(monkeypatch):
    # before the onset of slip a few attempts, to the stop 20 to 30, as it comes with rounding
    values = {"end_time": np.asarray([1e-3, 5.0, 1e-3, 5.0]), SPEED: np.asarray([20.0, 28.0, 15.0, 60.0])}
    data = assert_like_single_runs(stop_scene(), values, ["stopping_time"], range(4), max_steps=12)
    assert list(data.status.values) == ["not_stopped", "step_limit"] * 2
    seen = []
    run = _evaluator.run_chunk

    def counting(job, rows, device=None):
        seen.append((job.max_steps, len(rows)))
        return run(job, rows, device)

    monkeypatch.setattr("simbrake.studies._evaluator.run_chunk", counting)
    monkeypatch.setattr("simbrake.studies._evaluator._SHORT", 12)
    whole = sb.ensemble(stop_scene(), values, ["stopping_time"], progress=False)
    assert (seen[0], sorted({limit for limit, _ in seen}), sum(n for _, n in seen)) == ((12, 4), [12, 1024], 6)
    assert list(whole.status.values) == ["not_stopped", "stopped"] * 2


@pytest.mark.slow
def test_every_run_gets_the_solver_of_a_single_run():
    scene = rigid_stop(fading(), lump(cooling=10.0), end=1.0)
    values = {"heat.links[0].value": np.asarray([10.0, 2e7, 50.0]), SPEED: np.asarray([20.0, 15.0, 10.0])}
    data = assert_like_single_runs(
        scene, values, ["stopping_time", "energy.friction_heat", "energy.heat_lost"], range(3)
    )
    assert list(data.method.values) == ["Dopri8", "Rodas5P", "Dopri8"]


def test_many_stops_against_the_closed_form_in_the_callers_order():
    values = drawn(1000)
    done = []
    data = sb.ensemble(stop_scene(end=20.0), values, TIMES, progress=lambda n, total: done.append((n, total)))
    truth = closed_form(w0=values[SPEED], f=values[FRICTION], T0=values[LEVER], xp=np)
    for name, wanted in zip(TIMES, ("t0", "t1", "stop"), strict=True):
        np.testing.assert_allclose(data[name], truth[wanted], rtol=1e-10)
    assert np.all(data.code == 0)
    assert done[-1] == (1000, 1000)
    made = STORE.made
    other = sb.ensemble(stop_scene(end=21.0, J=700.0), drawn(1000, 2), TIMES, progress=False, workers=1, rtol=1e-9)
    assert STORE.made == made
    assert not np.any(other.stopping_time == data.stopping_time)


@pytest.mark.slow
def test_fields_with_entries_and_functions():
    angles = np.full((3, 20), np.radians(13.0)) + np.linspace(0, 0.01, 3)[:, None]
    data = sb.ensemble(stop_scene(), {"brake.linings.angle": angles}, [travel_share, "stopping_time"], progress=False)
    assert data["brake.linings.angle"].shape == (3, 20)
    np.testing.assert_allclose(data.travel_share, 1.0, rtol=1e-12)
    same = sb.ensemble(stop_scene(), {"brake.linings.angle": angles[:, 0]}, ["stopping_time"], progress=False)
    np.testing.assert_allclose(same.stopping_time, data.stopping_time, rtol=1e-13)


@pytest.mark.slow
def test_sweep_is_a_full_grid():
    data = sb.sweep(stop_scene(), {SPEED: [10.0, 20.0], LEVER: [6e3, 8e3, 1e4]}, ["stopping_time"], progress=False)
    assert data.stopping_time.dims == (SPEED, LEVER)
    got = float(data.stopping_time.sel({SPEED: 20.0, LEVER: 1e4}))
    assert got == pytest.approx(closed_form(w0=20.0, T0=1e4)["stop"], rel=1e-10)


@pytest.mark.parametrize(
    ("values", "settings", "words"),
    [
        (
            {SPEED: [1.0, np.nan, 3.0], "brake.pulley.inertia": [-1, -2, 1]},
            {"metrics": ["stoping_time"]},
            ["3 input errors", "run 1", "runs 0, 1", "nearest: stopping_time"],
        ),
        ({"initial.omeg": [1.0]}, {}, ["initial.omeg", "nearest: initial.omega"]),
        ({SPEED: [1.0], LEVER: [1.0, 2.0]}, {}, ["the numbers of runs differ"]),
        ({"initial.time": [1.0, 7.0], SPEED: [1.0, 2.0]}, {}, ["end_time", "run 1", "must be later"]),
        ({SPEED: ["fast"]}, {"rtol": 2.0, "chunk": 0}, ["3 input errors", "not numbers", "rtol", "chunk"]),
        ({}, {}, ["nothing varies"]),
        ({SPEED: [1.0]}, {"metrics": ["stopping_time", "stopping_time"]}, ["asked for twice"]),
    ],
)
def test_all_faults_at_once(values, settings, words):
    with pytest.raises(sb.InputError) as error:
        sb.ensemble(stop_scene(), values, **settings)
    assert all(word in str(error.value) for word in words), str(error.value)


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


def test_expected_cost_is_a_fit_and_sorts():
    x = np.random.default_rng(0).uniform(-1, 1, (500, 3)) * [1.0, 1e3, 0.0]
    steps = np.exp(2.0 + 0.5 * x[:, 0] - 0.3e-6 * x[:, 1] ** 2)
    known = _ensemble.spread(500, 64)
    np.testing.assert_allclose(_ensemble.expected_cost(x, known, steps[known]), np.log(steps), atol=1e-4)
    assert len(np.unique(known)) == 64
    few = _ensemble.expected_cost(x, known[:3], steps[known[:3]])
    assert np.all(np.isfinite(few))


def test_fingerprints_see_numbers_structure_and_code():
    def law(k):
        return lambda t, p: k * jnp.sin(t)

    scenes = [
        stop_scene(lever=sb.profiles.FunctionProfile(law(k)), n=n) for k, n in ((1.0, 4), (1.0, 4), (2.0, 4), (1.0, 5))
    ]
    marks = [fingerprint(scene) for scene in scenes]
    assert marks[0] == marks[1]
    assert len(set(marks)) == 3
    assert fingerprint(stop_scene(C=None)) != fingerprint(stop_scene())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_of_two_with_one_killed(tmp_path, caplog):
    from distributed import Client, LocalCluster

    values, folder, killed = drawn(400), tmp_path / "runs", []
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            pids = client.run(os.getpid)

            def kill(done, total):
                if done >= 50 and not killed:
                    killed.append(next(iter(pids.values())))
                    os.kill(killed[0], signal.SIGKILL)

            metrics = ["stopping_time", lambda result: result.full_slip_time]
            data = sb.ensemble(stop_scene(), values, metrics, client=client, directory=folder, progress=kill, chunk=16)
            assert killed
        by_address = sb.ensemble(
            stop_scene(), values, metrics, client=cluster.scheduler_address, directory=folder, progress=False
        )
    local = sb.ensemble(stop_scene(), values, ["stopping_time"], progress=False)
    assert np.all(data.code == 0)
    np.testing.assert_allclose(data.stopping_time, local.stopping_time, rtol=1e-12)
    xr.testing.assert_equal(data, by_address)
    assert "<lambda>" in data


def test_a_client_that_is_none():
    with pytest.raises(sb.InputError, match="client"):
        sb.ensemble(stop_scene(), {SPEED: [1.0]}, client=3)


def call(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out, err = capsys.readouterr()
    return stop.value.code, out, err


@pytest.fixture
def no_cache(monkeypatch):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")


@pytest.mark.slow
def test_the_command(capsys, tmp_path, scenarios, no_cache):
    scenario = str(scenarios / "u2_5_5_stop.py")
    grid = ["sweep", scenario, "--vary", "duty.load.mass=30 t:300 t:3", "--vary", "initial.omega=10,20"]
    code, out, err = call(capsys, *grid, "--out", str(tmp_path / "out"), "--resume", str(tmp_path / "kept"))
    assert (code, err) == (0, "")
    assert out.startswith("6 runs: ")
    with open(tmp_path / "out" / "runs.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["duty.load.mass [kg]"]) for row in rows] == [3e4, 3e4, 1.65e5, 1.65e5, 3e5, 3e5]
    assert {row["stopping_time [s]"] for row in rows if row["status"] == "runaway"} == {"inf"}
    with xr.open_dataset(tmp_path / "out" / "runs.nc", engine="scipy") as stored:
        assert stored["stopping_time"].dims == ("duty.load.mass", "initial.omega")
        assert stored["duty.load.mass"].attrs["units"] == "kg"
    code, out, _ = call(capsys, *grid, "--json", "--resume", str(tmp_path / "kept"))
    found = json.loads(out)
    assert len(found["runs"]) == 6
    _, out, _ = call(capsys, "run", scenario, "--json", "--set", "duty.load.mass=3e4", "--set", "initial.omega=20")
    single, run = json.loads(out), found["runs"][1]
    assert run["status"] == single["status"] == "stopped"
    assert set(run["metrics"]) <= set(single["metrics"])
    assert set(run["energy"]) <= set(single["energy"])
    for name, value in run["metrics"].items():
        assert value == pytest.approx(single["metrics"][name], rel=1e-12)
    assert found["runs"][-1]["metrics"]["stopping_time"] is None


@pytest.mark.slow
def test_the_command_samples_and_tells_failures(capsys, scenarios, no_cache):
    scenario = str(scenarios / "u2_5_5_stop.py")
    vary = ["--vary", "duty.load.mass=3e4:6e4", "--metrics", "stopping_time"]
    code, out, _ = call(capsys, "sweep", scenario, *vary, "--sample", "4", "--json")
    masses = [run["values"]["duty.load.mass"] for run in json.loads(out)["runs"]]
    assert code == 0
    assert len(set(masses)) == 4
    assert all(3e4 < mass < 6e4 for mass in masses)
    code, out, _ = call(capsys, "sweep", scenario, *vary, "--sample", "4", "--max-steps", "8")
    assert code == 1
    assert "4 step limit" in out
    code, out, err = call(capsys, "sweep", scenario, "--vary", "a=1:2", "--vary", "nonsense", "--out", "x")
    assert (code, out) == (2, "")
    assert "2 input errors" in err


@pytest.mark.slow
def test_order_gives_back_the_callers_order(monkeypatch):
    values = drawn(97)  # the last run is alone in its chunk
    stop = closed_form(w0=values[SPEED], f=values[FRICTION], T0=values[LEVER], xp=np)["stop"]
    truth = np.where(stop < 5.0, stop, np.nan)
    data = sb.ensemble(stop_scene(), values, ["stopping_time"], chunk=8, workers=1, progress=False)
    monkeypatch.setattr(_ensemble, "expected_cost", lambda columns, known, steps: np.zeros(len(columns)))
    plain = sb.ensemble(stop_scene(), values, ["stopping_time"], chunk=8, workers=1, progress=False)
    for found in (data, plain):
        np.testing.assert_allclose(found.stopping_time, truth, rtol=1e-10)
