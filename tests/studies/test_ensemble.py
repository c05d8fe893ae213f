"""Ensembles: the numbers of single runs, every run's own fate, faults, restarts, a
cluster, the command line."""

import csv
import json
import shutil

import diffrax
import numpy as np
import pytest
import xarray as xr
from commands import call, no_cache  # noqa: F401
from goldens import assert_refused
from heat_scenes import fading, lump, rigid_stop
from helpers import all_equal, all_near, input_error, near, nothing_compiled
from scenes import (
    FRICTION,
    GAIN,
    LEVER,
    SPEED,
    TIMES,
    closed_form,
    drawn,
    stop_scene,
)

import simbrake as sb


def travel_share(result):
    return result.stopping_angle / result.record.y_end.phi


def assert_like_single_runs(scene, values, metrics, runs, **settings):
    data = sb.ensemble(scene, values, metrics, progress=False, **settings)
    settings.pop("chunk", None)
    events = {}
    for i in runs:
        one = sb.with_values(scene, {path: array[i] for path, array in values.items()})
        single = sb.simulate(one, throw=False, **settings)
        assert (int(data.code[i]), str(data.status[i].values)) == (
            int(single.code),
            single.status,
        )
        for name in data.data_vars:
            if name in metrics:
                found = single[name]
                wanted = np.inf if found is None else float(found)
                all_near(data[name][i], wanted, 1e-12, err_msg=str(name))
        assert float(data["energy.closure"][i]) < 1e-9
        # runs of one sequence have the same events in the same order
        seen = [(event.name, event.lining) for event in single.events]
        assert events.setdefault(int(data.sequence[i]), seen) == seen
    return data


def test_same_numbers_as_single_runs():
    n = 12
    rng = np.random.default_rng(1)
    values = {
        SPEED: np.append(rng.uniform(-5, 30, n - 1), 0.0),
        FRICTION: rng.uniform(0.2, 0.4, n),
        "duty.load.profile.level": np.append(rng.uniform(0, 4e4, n - 1), 0.0),
        "brake.linings.angle[3]": rng.uniform(0.1, 0.3, n),
        "end_time": rng.uniform(0.5, 3.0, n),
    }
    metrics = [
        *TIMES,
        "max_tension",
        "energy.friction_heat",
        "energy.elastic_change",
        "stopping_angle",
    ]
    data = assert_like_single_runs(stop_scene(), values, metrics, range(n), chunk=8)
    assert {"stopped", "not_stopped", "held"} <= set(data.status.values)
    assert np.all(
        np.isinf(data.stopping_time.values[data.status.values == "not_stopped"])
    )
    assert data["max_tension"].attrs["units"] == "N"
    assert data[SPEED].attrs == {"units": "rad/s", "meaning": "initial speed"}
    assert data["brake.linings.angle[3]"].attrs["units"] == "rad"


@pytest.mark.slow
def test_failing_runs_keep_their_codes():
    # before the onset of slip a few attempts, to the stop 20 to 30, as it comes with
    # rounding
    values = {
        "end_time": np.asarray([1e-3, 5.0, 1e-3, 5.0]),
        SPEED: np.asarray([20.0, 28.0, 15.0, 60.0]),
    }
    data = assert_like_single_runs(
        stop_scene(), values, ["stopping_time"], range(4), max_steps=12
    )
    assert list(data.status.values) == ["not_stopped", "step_limit"] * 2


@pytest.mark.slow
def test_run_gets_the_solver_of_a_single_run():
    """A quick node asks for an implicit method, and one that is less quick where it is
    followed for long."""
    scene = rigid_stop(fading(), lump(cooling=2e4), end=1.0)
    metrics = ["stopping_time", "energy.heat_lost"]
    for values in (
        {"heat.links[0].value": [10.0, 2e7], SPEED: [20.0, 15.0]},
        {"end_time": [1.0, 2000.0]},
    ):
        given = {path: np.asarray(two) for path, two in values.items()}
        data = assert_like_single_runs(scene, given, metrics, range(2))
        assert list(data.method.values) == ["Dopri8", "Rodas5P"], values


@pytest.mark.slow
def test_long_runs_beside_short_ones():
    """Runs that need more steps than most are repeated with more of them, as long as
    they are allowed to."""
    load = sb.TorqueLoad(
        sb.Repeated([0.0, 0.25, 0.75, 1.0], [0.0, 1e5, -1e5, 0.0], 1.0, 60)
    )
    scene = stop_scene(n=6, load=load, w0=0.5)
    ends = {"end_time": np.asarray([0.1, 60.0, 0.2, 12.0])}
    data = assert_like_single_runs(
        scene,
        ends,
        ["stopping_angle", "energy.friction_heat"],
        range(4),
        max_steps=4096,
    )
    assert data.steps[1] > 1024 > 128 > data.steps[0]


@pytest.mark.slow
@pytest.mark.smoke
def test_many_stops_against_the_closed_form(caplog):
    values = drawn(1000)
    done = []
    data = sb.ensemble(
        stop_scene(end=20.0),
        values,
        TIMES,
        progress=lambda n, total: done.append((n, total)),
    )
    truth = closed_form(w0=values[SPEED], f=values[FRICTION], T0=values[LEVER], xp=np)
    for name, wanted in zip(TIMES, ("t0", "t1", "stop"), strict=True):
        all_near(data[name], truth[wanted], 1e-10)
    assert np.all(data.code == 0)
    assert done[-1] == (1000, 1000)
    with nothing_compiled(
        caplog
    ):  # for other numbers, and for other metrics, by which no number changes
        other = sb.ensemble(
            stop_scene(end=21.0, J=700.0),
            drawn(1000, 2),
            TIMES,
            progress=False,
            workers=1,
            rtol=1e-9,
        )
        wanted = ["stopping_angle", "stopping_time"]
        again = sb.ensemble(
            stop_scene(end=20.0), values, wanted, progress=False, workers=1
        )
    assert not np.any(other.stopping_time == data.stopping_time)
    assert [name for name in again.data_vars if name in (*TIMES, *wanted)] == wanted
    all_equal(again.stopping_time, data.stopping_time)
    one = sb.simulate(
        sb.with_values(
            stop_scene(end=20.0), {path: array[7] for path, array in values.items()}
        )
    )
    all_near(again.stopping_angle[7], one["stopping_angle"], 1e-12)


def own_tolerance(result):
    return result.rtol * result.stopping_time


@pytest.mark.slow
def test_metric_of_tolerance_is_recomputed(tmp_path):
    """Numbers of another tolerance are not taken for those of this one."""
    values = {SPEED: [10.0, 20.0]}

    def found(rtol):
        where = {"directory": tmp_path, "key": "", "progress": False}
        return sb.ensemble(
            stop_scene(C=None), values, [own_tolerance], rtol=rtol, **where
        )

    truth = 800 / (8e3 * GAIN) * np.asarray(values[SPEED])
    all_near(found(1e-8).own_tolerance, 1e-8 * truth, 1e-9)
    with input_error(match="rtol: 1e-08 there, 1e-06 here"):
        found(1e-6)


OWN_SCENE = {"lever": sb.profiles.FunctionProfile(lambda t, p: 8e3 + 0 * t)}


def kept_study(folder, scene=None, speed=10.0, metrics=("stopping_time",), **settings):
    settings = {"directory": folder, "progress": False} | settings
    return sb.ensemble(
        scene or stop_scene(), {SPEED: [speed, 20.0]}, metrics, **settings
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder of a finished study."""
    place = tmp_path_factory.mktemp("kept") / "study"
    kept_study(place)
    return place


@pytest.mark.parametrize(
    "change",
    [
        {"speed": 11.0},
        {"scene": stop_scene(R=0.7)},
        {"scene": stop_scene(**OWN_SCENE), "key": "1"},
        {"rtol": 1e-9},
        {"max_steps": 500},
        {"solver": sb.hybrid.ExplicitRungeKutta(diffrax.Tsit5())},
        {"metrics": ["full_slip_time"]},
        {"key": "1"},
    ],
)
def test_a_study_of_other_settings_is_not_resumed(tmp_path, kept, change):
    shutil.copytree(kept, tmp_path / "study")
    with input_error(match="holds another ensemble"):
        kept_study(tmp_path / "study", **change)


def test_a_finished_study_is_read_and_versions_count(kept):
    written = {file: file.stat().st_mtime_ns for file in kept.iterdir()}
    kept_study(kept)
    assert {file: file.stat().st_mtime_ns for file in kept.iterdir()} == written
    file = kept / "manifest.json"
    text = file.read_text("utf-8")
    manifest = json.loads(text)
    for name in manifest["versions"]:
        other = manifest | {"versions": manifest["versions"] | {name: "0.0.7"}}
        file.write_text(json.dumps(other), "utf-8")
        with input_error(match=f"{name}: 0.0.7 there"):
            kept_study(kept)
    file.write_text(text, "utf-8")


def own_metric(result):
    return result.stopping_time


OWN = {
    "function": {"metrics": [own_metric]},
    "profile": {"scene": stop_scene(**OWN_SCENE)},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", OWN)
def test_functions_of_ones_own_are_resumed_by_a_key(tmp_path, capsys, kind):
    """Without one a study starts anew and keeps nothing, as these may have changed; and
    says so in one line."""
    place = tmp_path / "kept"
    kept_study(place, **OWN[kind])
    assert capsys.readouterr().err.count("\n") == 1
    assert not place.exists()
    kept_study(place, key="mine 1", **OWN[kind])
    written = {file: file.stat().st_mtime_ns for file in place.iterdir()}
    kept_study(place, key="mine 1", **OWN[kind])
    assert {file: file.stat().st_mtime_ns for file in place.iterdir()} == written
    for folder, key in ((place, "mine 2"), (None, "mine 1")):
        with input_error(match="key: "):
            kept_study(folder, key=key, **OWN[kind])
    assert capsys.readouterr().err == ""


LIMIT = 2.0


def limited(result):
    return LIMIT**3 * result.stopping_time


@pytest.mark.slow
@pytest.mark.parametrize("chunk", [None, 2])
def test_a_changed_global_is_seen_in_the_same_process(monkeypatch, chunk):
    """Of a metric and of a profile in the scene: JAX would take each for the function
    that it has compiled."""
    scene = stop_scene(
        C=None,
        lever=sb.profiles.FunctionProfile(lambda t, p: 4e3 * LIMIT * (1 + 0 * t)),
    )
    exact = 800.0 * np.array([10.0, 20.0]) / (4e3 * GAIN)  # the stop of a rigid band
    for limit in (2.0, 4.0):
        monkeypatch.setitem(globals(), "LIMIT", limit)
        for metric, truth in (
            ("stopping_time", exact / limit),
            (limited, exact * limit**2),
        ):
            data = sb.ensemble(
                scene, {SPEED: [10.0, 20.0]}, [metric], chunk=chunk, progress=False
            )
            all_near(
                data[metric if metric == "stopping_time" else "limited"], truth, 1e-9
            )


@pytest.mark.slow
def test_fields_with_entries_and_functions():
    angles = np.full((3, 20), np.radians(13.0)) + np.linspace(0, 0.01, 3)[:, None]
    data = sb.ensemble(
        stop_scene(),
        {"brake.linings.angle": angles},
        [travel_share, "stopping_time"],
        progress=False,
    )
    assert data["brake.linings.angle"].shape == (3, 20)
    all_near(data.travel_share, 1.0, 1e-12)
    same = sb.ensemble(
        stop_scene(),
        {"brake.linings.angle": angles[:, 0]},
        ["stopping_time"],
        progress=False,
    )
    all_near(same.stopping_time, data.stopping_time, 1e-13)


def test_sweep_is_a_full_grid_of_single_runs(caplog):
    """Few runs are those of `simulate` to the last bit, and need no program but those
    of a run that was printed."""
    scene = stop_scene()
    metrics = ["stopping_time", "energy.friction_heat", "max_tension"]
    str(sb.simulate(scene))
    with nothing_compiled(caplog):
        data = sb.sweep(
            scene,
            {SPEED: [10.0, 20.0], LEVER: ["6 kN", "8 kN", "1e4 N"]},
            metrics,
            progress=False,
        )
    assert data.stopping_time.dims == (SPEED, LEVER)
    got = data.sel({SPEED: 20.0, LEVER: 1e4})
    single = sb.simulate(sb.with_values(scene, {SPEED: 20.0, LEVER: 1e4}))
    assert [float(got[name]) for name in metrics] == [single[name] for name in metrics]
    assert (str(got.status.values), int(got.steps)) == (
        single.status,
        int(single.record.stats.accepted),
    )
    near(got.stopping_time, closed_form(w0=20.0, T0=1e4)["stop"], 1e-10)


def test_one_metric_needs_no_list():
    scene = stop_scene()
    data = sb.sweep(scene, {SPEED: [10.0, 20.0]}, "stopping_time", progress=False)
    found = sb.studies.overview(scene, data, "stopping_time")
    assert found.metrics == ("stopping_time",)
    assert repr(found) == str(found)
    assert "<td>stopping_time" in found._repr_html_()
    assert len(sb.plot.sweep(data, "stopping_time").axes) == 1
    run = sb.prepare(scene, "stopping_time")
    near(run({SPEED: 10.0}).metrics["stopping_time"], data.stopping_time[0], 1e-12)


ANGLE = "brake.linings.angle"
INERTIA = "brake.pulley.inertia"
#: values and options of ensembles that cannot be
WRONG = (
    ({SPEED: [1.0, np.nan, 3.0], INERTIA: [-1, -2, 1]}, {"metrics": ["stoping_time"]}),
    ({"initial.omeg": [1.0], SPEED: ["fast"]}, {"metrics": ["stoping_time"]}),
    ({SPEED: [1.0], LEVER: [1.0, 2.0]}, {}),
    ({"initial.time": [1.0, 7.0]}, {}),
    ({SPEED: ["fast"]}, {"rtol": 2.0, "chunk": 0}),
    ({SPEED: ["10 rpm", "2 m"]}, {}),
    ({SPEED: ["10 rpm", 2.0]}, {}),
    ({}, {}),
    ({SPEED: [1.0]}, {"metrics": ["stopping_time"] * 2}),
    ({SPEED: [1.0]}, {"workers": 0}),
    ({SPEED: np.zeros((1, 1, 1))}, {}),
    ({ANGLE: [[0.2] * 20, [0.2] * 19 + [-0.3]]}, {}),
    ({ANGLE: [0.2, 0.4, 0.25, 0.5, 0.41]}, {}),
    ({ANGLE + "[-1]": [0.1], ANGLE: [0.2]}, {}),
)


def test_all_faults_at_once(request):
    grid = {SPEED: [1.0, 2.0, 1.0], LEVER: [[1.0, 2.0]], "end_time": "soon"}
    studies = [
        lambda values=values, options=options: sb.ensemble(
            stop_scene(), values, **options
        )
        for values, options in WRONG
    ]
    studies.append(lambda: sb.sweep(stop_scene(), grid, ["stoping_time"]))
    assert_refused(request, "ensembles", studies)


@pytest.mark.slow
def test_interrupted_and_resumed(tmp_path):
    values = drawn(300)
    folder = tmp_path / "runs"
    calls = []

    def interrupt(done, total):
        if done >= 100 and not calls:
            calls.append(done)
            raise KeyboardInterrupt

    def again(**more):
        settings = {
            "values": values,
            "metrics": ["stopping_time"],
            "directory": folder,
            "progress": False,
        } | more
        return sb.ensemble(settings.pop("scene", stop_scene()), **settings)

    part = again(workers=1, chunk=32, progress=interrupt)
    missing = part.code.values == -1
    assert 0 < missing.sum() <= 200
    assert set(part.status.values[missing]) == {"not_run"}
    assert np.all(np.isnan(part.stopping_time.values[missing]))
    whole = again(chunk=32, progress=lambda done, total: calls.append(done))
    assert calls[1] >= 300 - missing.sum()  # those that are there are not made again
    fresh = sb.ensemble(stop_scene(), values, ["stopping_time"], progress=False)
    all_near(whole.stopping_time, fresh.stopping_time, 1e-13)
    sorted(folder.glob("chunk*"))[0].write_bytes(b"spoilt")
    assert np.all(again(chunk=32).code == 0)
    for place in (tmp_path, folder / "manifest.json"):
        with input_error():
            again(directory=place)


@pytest.mark.slow
def test_the_command(capsys, tmp_path):
    """Its tables, and the same runs again from what was kept."""
    vary = ("--vary", "duty.load.mass=30 t:300 t:3", "--vary", "initial.omega=10,20")
    kept = ("--resume", str(tmp_path / "kept"))
    grid = ("sweep", "u2_5_5_stop", *vary, *kept)
    code, _, err = call(capsys, *grid, "--out", str(tmp_path / "out"))
    assert (code, err) == (0, "")
    with open(tmp_path / "out" / "runs.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    masses = [float(row["duty.load.mass [kg]"]) for row in rows]
    assert masses == [3e4, 3e4, 1.65e5, 1.65e5, 3e5, 3e5]
    away = {row["stopping_time [s]"] for row in rows if row["status"] == "runaway"}
    assert away == {"inf"}
    with xr.open_dataset(tmp_path / "out" / "runs.nc", engine="scipy") as stored:
        assert stored["stopping_time"].dims == ("duty.load.mass", "initial.omega")
    found = json.loads(call(capsys, *grid, "--json")[1])["runs"]
    changes = ("--set", "duty.load.mass=3e4", "--set", "initial.omega=20")
    single = json.loads(call(capsys, "run", "u2_5_5_stop", "--json", *changes)[1])
    assert found[1]["status"] == single["status"] == "stopped"
    metrics = {name: single["metrics"][name] for name in found[1]["metrics"]}
    near(found[1]["metrics"], metrics, 1e-12)
    assert found[-1]["metrics"]["stopping_time"] is None


def test_the_command_counts_runs_beyond_limits(capsys, tmp_path):
    """Of a lever of 6 kN and one of 0 one run stops; the limits lie beside its closed
    form."""
    stop = closed_form(T0=6e3)["stop"]
    file = str(tmp_path / "s.toml")
    metrics = ("--metrics", "stopping_time", "--metrics", "stopping_angle, max_tension")
    vary = ("--vary", f"{LEVER}=0,6000", *metrics, "--json")
    for share, count in ((0.99, 2), (1.01, 1)):
        limits = sb.Limits(stopping_time=share * stop)
        sb.write_scene(stop_scene(limits=limits), file)
        code, out, _ = call(capsys, "sweep", file, *vary)
        found = json.loads(out)
        (row,) = found["limits"]["checked"]
        assert [*found["runs"][0]["metrics"]] == [
            "stopping_time",
            "stopping_angle",
            "max_tension",
        ]
        assert (code, row["exceeded"], row["of"]) == (0, count, 2)


def test_limits_of_runs_have_units(kept):
    data = kept_study(kept)
    between = f"{1e3 * data.stopping_time.values.mean()} ms"
    asked = (stop_scene(), data, ["stopping_time"])
    found = sb.studies.overview(*asked, {"stopping_time": between})
    (row,) = found.limits["checked"]
    assert (row["exceeded"], row["of"]) == (1, 2)
    with input_error(match="is not a unit of limit"):
        sb.studies.overview(*asked, {"stopping_time": "3 kg"})


def test_the_command_counts_reserves_below_a_limit(capsys, tmp_path):
    """Loads of 0.7 and 0.9 times the torque of the brake have reserves of 1.43 and 1.11;
    that of 1.1 times is not held, and has none; without load any reserve is kept."""
    torque = 8e3 * GAIN
    file = str(tmp_path / "held.toml")
    sb.write_scene(stop_scene(C=None, w0=0.0, end=0.1, load=0.7 * torque), file)
    loads = f"duty.load.profile.level=0,{0.7 * torque},{0.9 * torque},{1.1 * torque}"
    reserve = (
        "--metrics",
        "min_holding_reserve",
        "--limit",
        "min_holding_reserve=1.25",
    )
    _, out, _ = call(capsys, "sweep", file, "--vary", loads, *reserve)
    assert "limits   min_holding_reserve below 1.25 in 2 of 4 runs\n" in out
    _, out, _ = call(capsys, "sweep", file, "--vary", loads, *reserve, "--json")
    colours = [run["colour"] for run in json.loads(out)["runs"]]
    assert colours == ["green", "green", "red", "red"]


def test_ranges_of_runs_are_in_units_of_their_size():
    """Heat of stops of a rigid band without load: `J ω²/2`."""
    heat = "energy.friction_heat"
    scene = stop_scene(C=None)
    data = sb.ensemble(scene, {SPEED: [10.0, 20.0]}, [heat], progress=False)
    found = str(sb.studies.overview(scene, data, [heat]))
    (row,) = [line.split() for line in found.splitlines() if line.startswith(heat)]
    assert row == [heat, "40", "100", "160", "kJ", "2"]
