"""Measured data from CSV: units, empty cells, encodings; and `simbrake calibrate` as a
user meets it. Faults of files are in `bad_input.csv`."""

import gzip
import json
import lzma
import math

import numpy as np
import pytest
from commands import call, no_cache  # noqa: F401
from goldens import assert_refused
from heat_scenes import fading, lump, rigid_stop
from helpers import all_equal, all_near, faults_of, near
from scenes import GAIN, stop_run, stop_scene
from staged_scenes import stop as staged_stop

import simbrake as sb


@pytest.fixture
def write(tmp_path):
    """Writes a text into a file of the folder of the test."""

    def written(name, text):
        (tmp_path / name).write_text(text, "utf-8")
        return tmp_path / name

    return written


def test_units_and_empty_cells(write):
    series = write(
        "series.csv",
        "# a logger's remark\n"
        "t [ms],omega (rpm),omega_sigma,lining_temperature[3] [degC],"
        "lining_temperature[3]_sigma,tight_tension[kN]\n"
        "0,300,6,20,1.5,\n\n500,,,25,2,1.25\n1000,60,3,,,-2\n",
    )
    events = write(
        "events.csv",
        "event,value,unit,sigma\nstopping_time,1500,ms,20\nmax_tension,3,kN,\n"
        "hook_travel,,,\n",
    )
    sigma = {"tight_tension": 100.0, "max_tension": 50.0}
    data = sb.read_measured(series, events, sigma=sigma)
    omega, lining, tension = data.points
    all_near(omega.t, [0.0, 1.0])
    all_near(omega.value, [10 * math.pi, 2 * math.pi])
    all_near(omega.sigma, [0.2 * math.pi, 0.1 * math.pi])
    assert (lining.column, lining.entry) == ("lining_temperature", "3")
    all_near(lining.value, [293.15, 298.15])
    all_near(lining.sigma, [1.5, 2.0])
    all_near(tension.value, [1250.0, -2000.0])
    all_near(tension.sigma, 100.0)
    stop, greatest = data.singles
    assert (stop.metric, stop.value, stop.sigma) == ("stopping_time", 1.5, 0.02)
    assert (greatest.value, greatest.sigma) == (3000.0, 50.0)
    assert (data.sigma_known, data.count) == (True, 8)


@pytest.mark.parametrize("null", ["", "-999.25", "-9.9925E+02", "-9999", "n/a", "NULL"])
def test_null_values_of_loggers(write, null):
    """In columns, standard deviations, single values, tables of recordings and
    histories of a scene alike; some are told."""
    a = write("a.csv", f"t,omega [rpm],omega_sigma\n0,{null},{null}\n1,300,3\n")
    b = write("b.csv", f"event,value\nstopping_time,{null}\nmax_tension,5\n")
    data = sb.read_measured(a, b, sigma={"max_tension": 2.0})
    (omega,) = data.points
    assert (omega.t.tolist(), omega.sigma.tolist()) == ([1.0], [math.pi / 10])
    assert [one.metric for one in data.singles] == ["max_tension"]
    assert bool(data.notes) == null.startswith("-9")
    table = write("c.csv", f"name,duty.load.mass [t],stopping_time\na,{null},1\n")
    (stop,) = sb.studies.read_recordings(table).values()
    assert (stop.known, stop.count) == ({}, 1)
    lever = write("d.csv", f"t,lever [kN]\n0,1\n1,{null}\n2,3\n")
    profile = sb.files.history(lever, "lever", "N")
    all_equal(profile.values, [1000.0, 3000.0])


def test_null_values_that_are_given(write):
    file = write("a.csv", "t,tight_tension\n-1000,-999\n-999,-1\n")
    for given, left in (
        ({}, [-1.0]),
        ({"null": ()}, [-999, -1]),
        ({"null": [-1]}, [-999]),
    ):
        values = sb.read_measured(file, **given).points[0].value
        all_equal(values, left)


@pytest.mark.parametrize("coded", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
@pytest.mark.parametrize("packed", [bytes, gzip.compress, lzma.compress])
def test_encodings_and_packed_files(tmp_path, coded, packed):
    """With semicolons and decimal commas."""
    file = tmp_path / "a.csv"
    text = "# Größe des Prüfstands\r\nt;omega;comment\r\n0,5;1,25e1;x\r\n1,5;7;y\r\n"
    file.write_bytes(packed(text.encode(coded)))
    (omega,) = sb.read_measured(file, columns=["omega"]).points
    all_equal((omega.t, omega.value), ([0.5, 1.5], [12.5, 7.0]))
    if packed is not bytes:
        file.write_bytes(file.read_bytes()[:-9])
        assert faults_of(sb.read_measured, file)


@pytest.mark.parametrize(("name", "ratio"), [("time", 1.0), ("Time [ms]", 1e-3)])
def test_other_names_of_the_time(write, name, ratio):
    (omega,) = sb.read_measured(write("a.csv", f"{name},omega\n500,3\n1500,2\n")).points
    all_near(omega.t, [500 * ratio, 1500 * ratio], 1e-15)


def test_all_errors_of_files_at_once(write, tmp_path):
    series = write("series.csv", "t,omga,omega\nx,1,2\n1,2,inf\n")
    events = write("events.csv", "event,value\n,3\nstoping_time,2\n")
    assert len(faults_of(sb.read_measured, series, events, tmp_path / "none.csv")) == 6
    broken = write("a.csv", "t,omega\n" + "".join(f"{i},err\n" for i in range(500)))
    assert len(faults_of(sb.read_measured, broken)) == 51
    wrong = {"omega": [1.0], "speed": [1.0, 2.0], "phi": [np.nan, np.nan]}
    events = {"stopping_time": np.inf}
    sigma = {"slack_tension": 1.0}
    of = sb.studies.Measured.of
    assert len(faults_of(of, [0.0, 1.0], wrong, sigma=sigma, events=events)) == 5


def test_table_of_recordings(write):
    write("speed.csv", "t [ms],omega\n0,20\n100,19\n")
    head = "name,file,stopping_time [ms],stopping_time_sigma [ms],duty.load.mass [t]"
    rows = "long,speed.csv,,,40,9\nshort,,1500,20,60,\n"
    table = write("stops.csv", f"{head},end_time\n{rows}")
    stops = sb.studies.read_recordings(table, sigma={"omega": 0.1})
    assert [part.name for part in stops["long"].all] == ["omega"]
    assert stops["long"].known == {"duty.load.mass": "40.0 t", "end_time": 9.0}
    (stop,) = stops["short"].singles
    assert (stop.name, stop.value, stop.sigma) == ("stopping_time", 1.5, 0.02)
    bad = write("bad.csv", f"{head}\na,no.csv,1,,x\na,,late,1,2\n")
    assert len(faults_of(sb.studies.read_recordings, bad)) == 5


def test_calibrate_with_a_table_of_recordings(capsys, tmp_path, write):
    """Stopping times t = J ω/(R T_0 (Π − 1)) of two stops of different inertia, by one
    slack tension."""
    scene = str(tmp_path / "stop.toml")
    sb.write_scene(stop_scene(C=None), scene)
    slope = 20.0 / (GAIN * 7.5e3)
    rows = "".join(f"{J},{1e3 * J * slope:.9f},1\n" for J in (800.0, 1200.0))
    head = "brake.pulley.inertia,stopping_time [ms],stopping_time_sigma [ms]"
    table = str(write("stops.csv", f"{head}\n{rows}"))
    fit = ("--fit", "duty.slack_tension.level=5 kN:12 kN", "--set", "initial.omega=20")
    fit = ("calibrate", scene, "--recordings", table, *fit)
    assert call(capsys, *fit, "--out", str(tmp_path / "out"))[0] == 0
    saved = json.loads((tmp_path / "out" / "calibration.json").read_text("utf-8"))
    near(saved["parameters"][0]["value"], 7.5e3, 1e-6)
    names = [row["name"] for row in saved["residuals"]]
    assert names == ["stopping_time@1", "stopping_time@2"]
    assert call(capsys, *fit, "--each", "initial.omega=5:60")[0] == 4
    assert call(capsys, *fit, table)[0] == 2


def test_data_say_what_they_hold():
    values = {"omega": [3.0, 2.0, 1.0], "phi": [0.0, 1.0, np.nan]}
    data = sb.studies.Measured.of(
        [0.0, 1.0, 2.5],
        values | {"tension[3]": [1.0, 2.0, 4.0]},
        sigma={"omega": [0.1, 0.2, 0.3], "phi": 0.5},
        events={"stopping_time": (3.0, 0.25), "max_tension": 2e4},
    )
    values, sigma = data.arrays
    assert values.tolist() == [3, 2, 1, 0, 1, 1, 2, 4, 3, 2e4]
    assert sigma.tolist() == [0.1, 0.2, 0.3, 0.5, 0.5, 1, 1, 1, 0.25, 1]
    assert not data.sigma_known
    assert data.as_dict()["points"]["phi"] == {
        "unit": "rad",
        "t": [0.0, 1.0],
        "value": [0.0, 1.0],
        "sigma": [0.5, 0.5],
    }


def test_columns_that_a_run_does_not_have(request):
    run = stop_run(C=None)
    of = sb.studies.Measured.of
    overlays = (
        lambda column=column: sb.plot.overlay(run, of([0.1, 0.2], {column: [1.0, 2.0]}))
        for column in ("omega[1]", "rim_temperature", "tension[21]", "tension")
    )
    assert_refused(request, "columns", overlays)


@pytest.mark.parametrize(
    ("scene", "name", "read"),
    [
        (staged_stop, "tension_3", lambda s: s.tension[:, 2] / 1e3),
        (
            staged_stop,
            "internal_slip_speed[3]",
            lambda s: s.pairs["internal"].slip_speed[:, 2],
        ),
        (
            lambda: rigid_stop(fading(), lump()),
            "rim_temperature",
            lambda s: s.rim_temperature[:, 0] - 273.15,
        ),
    ],
)
def test_entries_of_columns(scene, name, read):
    """Of a lining and a pair; a single entry needs no name."""
    result = sb.simulate(scene())
    data = sb.studies.Measured.of([0.1, 0.2], {name: [2e3, 3e3]})
    lines = sb.plot.overlay(result, data).axes[0].lines
    (line,) = (line for line in lines if line.get_label() == "run")
    t, y = line.get_data()
    events = result.events.times
    apart = np.min(np.abs(np.subtract.outer(t, events)), axis=1) > 1e-9
    all_near(y[apart], read(result.series(t))[apart], 1e-9)
