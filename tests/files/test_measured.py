"""Measured data from CSV: units, empty cells, faults in one report; and
`simbrake calibrate` as a user meets it."""

import gzip
import json
import lzma
import math

import numpy as np
import pytest
from commands import call
from heat_scenes import fading, lump, rigid_stop
from staged_scenes import stop as staged_stop
from stop_scenes import closed_form, stop_scene

import simbrake as sb


def faults(call, *arguments, **settings):
    with pytest.raises(sb.InputError) as caught:
        call(*arguments, **settings)
    return [str(fault) for fault in caught.value.faults]


def write(folder, name, text):
    file = folder / name
    file.write_text(text, "utf-8")
    return file


def test_units_and_empty_cells(tmp_path):
    series = write(
        tmp_path,
        "series.csv",
        "# a logger's remark\n"
        "t [ms],omega (rpm),omega_sigma,lining_temperature[3] "
        "[degC],lining_temperature[3]_sigma,tight_tension[kN]\n"
        "0,300,6,20,1.5,\n"
        "\n"
        "500,,,25,2,1.25\n"
        "1000,60,3,,,-2\n",
    )
    events = write(
        tmp_path,
        "events.csv",
        "event,value,unit,sigma\nstopping_time,1500,ms,20\nmax_tension,3,kN,\nhook_travel,,,\n",
    )
    data = sb.read_measured(
        series, events, sigma={"tight_tension": 100.0, "max_tension": 50.0}
    )
    omega, lining, tension = data.points
    np.testing.assert_allclose(omega.t, [0.0, 1.0])
    np.testing.assert_allclose(omega.value, [10 * math.pi, 2 * math.pi])
    np.testing.assert_allclose(omega.sigma, [0.2 * math.pi, 0.1 * math.pi])
    assert (lining.column, lining.entry, lining.name) == (
        "lining_temperature",
        "3",
        "lining_temperature[3]",
    )
    np.testing.assert_allclose(lining.value, [293.15, 298.15])
    np.testing.assert_allclose(lining.sigma, [1.5, 2.0])
    np.testing.assert_allclose(tension.value, [1250.0, -2000.0])
    np.testing.assert_allclose(tension.sigma, 100.0)
    stop, greatest = data.singles
    assert (stop.metric, stop.value, stop.sigma) == ("stopping_time", 1.5, 0.02)
    assert (greatest.value, greatest.sigma) == (3000.0, 50.0)
    assert data.sigma_known
    assert data.count == 8


@pytest.mark.parametrize(
    "null",
    [
        "",
        "-999.25",
        "-999.2500",
        "-9999",
        "-999",
        "-9.9925E+02",
        "NaN",
        "n/a",
        "-",
        "NULL",
    ],
)
def test_null_values_of_loggers_were_not_measured(tmp_path, null):
    """In columns, standard deviations, single values, tables of recordings and
    histories of a scene alike."""
    a = write(
        tmp_path,
        "a.csv",
        f"t,omega [rpm],omega_sigma,phi\n0,{null},{null},1\n1,300,3,{null}\n2,150,3,2\n",
    )
    b = write(
        tmp_path,
        "b.csv",
        f"event,value,sigma\nstopping_time,{null},1\nmax_tension,5,{null}\n",
    )
    data = sb.read_measured(a, b, sigma={"max_tension": 2.0})
    omega, phi = data.points
    np.testing.assert_allclose(omega.value, np.array([10.0, 5.0]) * math.pi)
    np.testing.assert_array_equal(
        (omega.t, omega.sigma), ([1.0, 2.0], [math.pi / 10] * 2)
    )
    np.testing.assert_array_equal((phi.t, phi.value), ([0.0, 2.0], [1.0, 2.0]))
    assert [(one.metric, one.value, one.sigma) for one in data.singles] == [
        ("max_tension", 5.0, 2.0)
    ]
    told = [note for note in data.notes if "is taken as a null value in" in note]
    assert told == list(data.notes)
    assert bool(told) == null.startswith("-9")
    assert all(note in str(data) for note in told)
    table = write(
        tmp_path,
        "c.csv",
        f"name,duty.load.mass [t],stopping_time\na,{null},1\nb,40,{null}\n",
    )
    one, other = sb.studies.read_recordings(table).values()
    assert (one.known, one.count, other.known, other.count) == (
        {},
        1,
        {"duty.load.mass": "40.0 t"},
        0,
    )
    profile = sb.files.history(
        write(tmp_path, "d.csv", f"t,lever [kN]\n0,1\n1,{null}\n2,3\n"), "lever", "N"
    )
    np.testing.assert_array_equal(
        (profile.times, profile.values), ([0.0, 2.0], [1e3, 3e3])
    )
    if null != "":
        (told,) = faults(
            sb.read_measured, write(tmp_path, "e.csv", f"t,omega\n0,1\n{null},2\n")
        )
        assert (
            f"line 3, column t: {null} is a null value — every line needs its time"
            in told
        )


def test_null_values_that_are_given(tmp_path):
    file = write(tmp_path, "a.csv", "t,tight_tension\n-1000,-999\n-999,-1\n")
    np.testing.assert_array_equal(sb.read_measured(file).points[0].value, [-1.0])
    np.testing.assert_array_equal(
        sb.read_measured(file, null=()).points[0].value, [-999.0, -1.0]
    )
    np.testing.assert_array_equal(
        sb.read_measured(file, null=[-1]).points[0].value, [-999.0]
    )


def test_semicolons_and_decimal_commas(tmp_path):
    file = write(
        tmp_path, "a.csv", "\ufefft;omega;comment\n0,5;1,25e1;begin\n1,5;7;end\n"
    )
    (omega,) = sb.read_measured(file, columns=["omega"], sigma={"omega": 0.1}).points
    np.testing.assert_allclose(omega.t, [0.5, 1.5])
    np.testing.assert_allclose(omega.value, [12.5, 7.0])
    with pytest.raises(sb.InputError, match="comment"):
        sb.read_measured(file)


@pytest.mark.parametrize("coded", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
@pytest.mark.parametrize("packed", [bytes, gzip.compress, lzma.compress])
def test_encodings_and_packed_files(tmp_path, coded, packed):
    file = tmp_path / "a.csv"
    file.write_bytes(
        packed(
            "# Größe des Prüfstands\r\nt;omega\r\n0,5;1,25e1\r\n1,5;7\r\n".encode(coded)
        )
    )
    data = sb.read_measured(file)
    np.testing.assert_array_equal(
        (data.points[0].t, data.points[0].value), ([0.5, 1.5], [12.5, 7.0])
    )
    if packed is not bytes:
        file.write_bytes(file.read_bytes()[:-9])
        assert "cannot be unpacked" in faults(sb.read_measured, file)[0]


@pytest.mark.parametrize("name", ["time", "Time [ms]", "T [ms]"])
def test_other_names_of_the_time(tmp_path, name):
    ratio = 1e-3 if "ms" in name else 1.0
    (omega,) = sb.read_measured(
        write(tmp_path, "a.csv", f"{name},omega\n500,3\n1500,2\n")
    ).points
    np.testing.assert_allclose(omega.t, [500 * ratio, 1500 * ratio], rtol=1e-15)
    with pytest.raises(sb.InputError, match="unknown column 'time'"):
        sb.read_measured(write(tmp_path, "b.csv", "t,time,omega\n0,0,3\n1,1,2\n"))


@pytest.mark.parametrize(
    ("text", "place", "word"),
    [
        ("t,omega [degC]\n0,1\n", "column omega [degC]", "rad/s, rpm"),
        ("t,omga\n0,1\n", "column omga", "nearest: omega"),
        ("t,omega,at_limit\n0,1,3\n", "column at_limit", "cannot be fitted"),
        ("t,omega,phi_sigma\n0,1,1\n", "column phi_sigma", "no column phi"),
        ("t,omega\nx,1\n1,1\n", "line 2, column t", "'x'"),
        ("t,omega\n0,1\n,1\n", "line 3, column t", "is empty"),
        ("t;omega\ninf;1\n0,25;2\n", "line 2, column t", "'inf'"),
        ("t,omega\n0,inf\n1,1\n", "line 2, column omega", "'inf'"),
        ('t,omega\n0,"1,5"\n1,2\n', "line 2, column omega", "'1,5'"),
        ("t,omega\n0,1\n4\n", "line 3", "1 cells"),
        ('t,omega\n0,1\n1,"2\n2,3\n', "line 3", "is a quote left open?"),
        (
            "t,rim_temperature [degC]\n0,-300\n1,20\n",
            "line 2, column rim_temperature",
            "-300",
        ),
        (
            "t;rim_temperature [degC]\n0,5;-300,5\n",
            "line 2, column rim_temperature",
            "-300.5",
        ),
        ("t,omega,omega_sigma\n0,1,\n", "line 2, column omega_sigma", "is empty"),
        (
            "t,omega,omega_sigma\n0,1,0\n",
            "line 2, column omega_sigma",
            "0 is not a standard",
        ),
        (
            "t,omega,omega_sigma\n0,1,-1\n",
            "line 2, column omega_sigma",
            "-1 is not a standard",
        ),
        ("event,time\nstoping_time,1.5\n", "event stoping_time", "unknown metric"),
        (
            "event,time\nmax_tension,5\nstopping_time,1\n",
            "event max_tension",
            "not a time",
        ),
        (
            "event,time\nstopping_time,soon\nfull_slip_time,1\n",
            "line 2, column time",
            "'soon'",
        ),
        (
            "event,time,sigma\nstopping_time,1,0\n",
            "line 2, column sigma",
            "0 is not a standard",
        ),
        ("event,value\nstopping_time,\n", "a.csv", "no event with a value"),
        ("event,value,time\nstopping_time,1,1\n", "a.csv", "one column of values"),
    ],
)
def test_errors_of_cells_have_their_places(tmp_path, text, place, word):
    told = faults(sb.read_measured, write(tmp_path, "a.csv", text))
    assert any(place in one and word in one for one in told), told


def test_all_errors_of_files_at_once(tmp_path):
    series = write(tmp_path, "series.csv", "t,omga,omega\nx,1,2\n1,2,inf\n")
    events = write(tmp_path, "events.csv", "event,value\n,3\nstoping_time,2\n")
    assert len(faults(sb.read_measured, series, events, tmp_path / "none.csv")) == 6
    good = write(tmp_path, "good.csv", "t,omega\n0,1\n1,2\n")
    assert faults(sb.read_measured, good, columns=["phi"])[0].startswith(
        f"{good}: has no column to fit"
    )
    assert faults(sb.read_measured)[0].startswith("data: no file")


def test_a_broken_logger_is_told_shortly(tmp_path):
    file = write(
        tmp_path, "a.csv", "t,omega\n" + "".join(f"{i},err\n" for i in range(500))
    )
    with pytest.raises(sb.InputError, match="450 more errors") as caught:
        sb.read_measured(file, sigma={"omega": 0.1})
    assert len(caught.value.faults) == 51


def test_arrays_are_checked_as_files_are():
    with pytest.raises(sb.InputError) as caught:
        sb.studies.Measured.of(
            [0.0, 1.0],
            {
                "omega": [1.0],
                "speed": [1.0, 2.0],
                "phi": [np.nan, np.nan],
                "tight_tension": [1.0, 2.0],
            },
            sigma={"tight_tension": -1.0, "slack_tension": 1.0},
            events={"stopping_time": np.inf},
        )
    assert len(caught.value.faults) == 6
    t = [0.0, 1.0, 2.0]
    values = {"omega": [3.0, np.nan, 1.0]}
    assert list(
        sb.studies.Measured.of(t, values, sigma={"omega": [0.1, 0.2, 0.3]})
        .points[0]
        .sigma
    ) == [0.1, 0.3]


def test_calibrate_with_bad_input_exits_2(capsys, tmp_path):
    scene = "standard"
    series = str(write(tmp_path, "speed.csv", "t,omega\n0,20\n1,10\n"))
    bad = write(tmp_path, "bad.csv", "t,omega\n0,fast\n")
    fit = [
        "--fit",
        "initial.omega=5",
        "--sigma",
        "omega",
        "--start",
        "x=y",
        "--start",
        "5 kN",
        "--start",
        "x=z",
    ]
    code, out, err = call(
        capsys, "calibrate", scene, str(bad), *fit, "--out", str(tmp_path / "out")
    )
    assert (code, out) == (2, "")
    for words in (
        "initial.omega=5",
        "PATH=LOW:HIGH",
        "--sigma omega",
        "'fast' is not a number",
        "--start x=y",
        "--start 5 kN",
    ):
        assert words in err
    assert not (tmp_path / "out").exists()
    code, _, err = call(
        capsys,
        "calibrate",
        scene,
        series,
        "--fit",
        "initial.omga=5:60",
        "--sigma",
        "omega=1",
    )
    assert code == 2
    assert "initial.omega" in err
    assert call(capsys, "calibrate", scene, series)[0] == 2


def test_table_of_recordings(tmp_path):
    write(tmp_path, "speed.csv", "t [ms],omega\n0,20\n100,19\n")
    table = write(
        tmp_path,
        "stops.csv",
        "name,file,stopping_time [ms],stopping_time_sigma [ms],duty.load.mass [t],end_time\n"
        "long,speed.csv,,,40,9\n"
        "short,,1500,20,60,\n",
    )
    stops = sb.studies.read_recordings(table, sigma={"omega": 0.1})
    assert [part.name for part in stops["long"].all] == ["omega"]
    assert stops["long"].known == {"duty.load.mass": "40.0 t", "end_time": 9.0}
    (stop,) = stops["short"].singles
    assert (stop.name, stop.value, stop.sigma) == ("stopping_time", 1.5, 0.02)
    assert stops["short"].known == {"duty.load.mass": "60.0 t"}
    rows = "a,no.csv,1,,x\na,,late,1,2\n"
    bad = write(
        tmp_path,
        "bad.csv",
        f"name,file,stopping_time,stopping_time_sigma,initial.omega\n{rows}",
    )
    told = " ".join(faults(sb.studies.read_recordings, bad))
    for words in (
        "no.csv",
        "is empty beside a measured",
        "'x' is not a number",
        "'late'",
        "another recording 'a'",
    ):
        assert words in told


def test_calibrate_with_a_table_of_recordings(capsys, tmp_path):
    """Stopping times t = J ω/(R T_0 (Π − 1)) of two stops of different inertia, by one
    slack tension."""
    scene = str(tmp_path / "stop.toml")
    sb.write_scene(stop_scene(C=None), scene)
    times = {
        inertia: 20.0 / (0.725 * (closed_form()["Pi"] - 1) / inertia * 7.5e3)
        for inertia in (800.0, 1200.0)
    }
    rows = "".join(
        f"{inertia},{1e3 * time:.9f},1,-999.25\n" for inertia, time in times.items()
    )
    head = (
        "brake.pulley.inertia,stopping_time [ms],stopping_time_sigma [ms],max_tension"
    )
    table = write(tmp_path, "stops.csv", f"{head}\n{rows}")
    fit = ("--fit", "duty.slack_tension.level=5 kN:12 kN", "--set", "initial.omega=20")
    fit = (scene, "--recordings", str(table), *fit)
    code, out, _ = call(capsys, "calibrate", *fit, "--out", str(tmp_path / "out"))
    assert code == 0
    assert "stopping_time@2" in out
    saved = json.loads((tmp_path / "out" / "calibration.json").read_text("utf-8"))
    assert saved["parameters"][0]["value"] == pytest.approx(7.5e3, rel=1e-6)
    assert [row["name"] for row in saved["residuals"]] == [
        "stopping_time@1",
        "stopping_time@2",
    ]
    assert call(capsys, "calibrate", *fit, "--each", "initial.omega=5:60")[0] == 4
    code, _, err = call(capsys, "calibrate", *fit, str(table))
    assert (code, "--recordings: beside" in err) == (2, True)


def test_unusual_cells_are_read(tmp_path):
    spread = write(
        tmp_path,
        "spread.csv",
        "t,rim_temperature [degC],rim_temperature_sigma [degF]\n0,0,9\n1,,\n",
    )
    (rim,) = sb.read_measured(spread).points
    assert (rim.value.tolist(), rim.sigma.tolist()) == ([273.15], [5.0])
    comma = write(
        tmp_path,
        "comma.csv",
        "event;value;sigma\nstopping_time;1,5;0,25\nmax_tension;0;\n",
    )
    stop, tension = sb.read_measured(comma).singles
    assert (stop.value, stop.sigma, tension.value, tension.sigma) == (
        1.5,
        0.25,
        0.0,
        None,
    )
    chosen = write(tmp_path, "w.csv", "t,tension_3,omega\n0,1,2\n")
    wanted = sb.read_measured(chosen, columns=["tension[3]"], sigma={"tension_3": 2.0})
    assert [(one.name, one.sigma.tolist()) for one in wanted.points] == [
        ("tension[3]", [2.0])
    ]


def test_data_say_what_they_hold():
    t = [0.0, 1.0, 2.5]
    data = sb.studies.Measured.of(
        t,
        {
            "omega": [3.0, 2.0, 1.0],
            "phi": [0.0, 1.0, np.nan],
            "tension[3]": [1.0, 2.0, 4.0],
        },
        sigma={"omega": [0.1, 0.2, 0.3], "phi": 0.5},
        events={"stopping_time": (3.0, 0.25), "max_tension": 2e4},
    )
    values, sigma = data.arrays
    assert values.tolist() == [3, 2, 1, 0, 1, 1, 2, 4, 3, 2e4]
    assert sigma.tolist() == [0.1, 0.2, 0.3, 0.5, 0.5, 1, 1, 1, 0.25, 1]
    assert not data.sigma_known
    assert (data.points[2].column, data.points[2].entry) == ("tension", "3")
    told = data.as_dict()
    assert told["points"]["phi"] == {
        "unit": "rad",
        "t": [0.0, 1.0],
        "value": [0.0, 1.0],
        "sigma": [0.5, 0.5],
    }
    assert told["singles"]["stopping_time"] == {
        "unit": "s",
        "value": 3.0,
        "sigma": 0.25,
    }
    for sigma in (0.0, -1.0, np.inf, np.nan):
        (text,) = faults(sb.studies.Measured.of, events={"stopping_time": (3.0, sigma)})
        assert (
            text
            == f"stopping_time: {sigma} is not a standard deviation — it must be > 0"
        )


@pytest.mark.parametrize(
    ("column", "words"),
    [
        ("omega[1]", "omega has no entries"),
        ("rim_temperature", "is not in a run of this scene"),
        ("internal_torque", "nearest: external_torque"),
        ("tension[21]", "there is no entry 21"),
        ("tension", "has 20 entries"),
        ("brake_torqe", "nearest: brake_torque"),
        ("at_limit", "cannot be fitted"),
    ],
)
def test_columns_that_a_run_does_not_have(column, words):
    with pytest.raises(sb.InputError) as caught:
        sb.plot.overlay(
            sb.simulate(stop_scene(C=None)),
            sb.studies.Measured.of([0.1, 0.2], {column: [1.0, 2.0]}),
        )
    (fault,) = caught.value.faults
    assert column in fault.path + fault.problem
    assert words in str(fault)


def drawn(result, column):
    """The curve of a run that is laid over a measured column."""
    data = sb.studies.Measured.of([0.1, 0.2], {column: [2e3, 3e3]})
    (line,) = (
        line
        for line in sb.plot.overlay(result, data).axes[0].lines
        if line.get_label() == "run"
    )
    return line.get_data()


def test_entries_of_columns():
    """Of a lining, a pair and a node; one entry alone needs no name."""
    staged = sb.simulate(staged_stop())
    hot = sb.simulate(rigid_stop(fading(), lump()))
    for result, names, read in (
        (staged, ("tension[3]", "tension_3"), lambda s: s.tension[:, 2] / 1e3),
        (
            staged,
            ("internal_slip_speed[3]", "internal_slip_speed_3"),
            lambda s: s.pairs["internal"].slip_speed[:, 2],
        ),
        (
            hot,
            (f"temperature[{hot.nodes[0]}]", "rim_temperature"),
            lambda s: s.rim_temperature[:, 0] - 273.15,
        ),
    ):
        for name in names:
            t, y = drawn(result, name)
            apart = (
                np.min(
                    np.abs(np.subtract.outer(t, [e.time for e in result.events])),
                    axis=1,
                )
                > 1e-9
            )
            np.testing.assert_allclose(
                y[apart], read(result.series(t))[apart], rtol=1e-9, err_msg=name
            )


def test_measured_times_lie_in_the_run():
    data = sb.studies.Measured.of(
        [1.0, 6.5, 8.0], {"omega": [1.0, 2.0, 3.0]}, sigma={"omega": 0.1}
    )
    for wrong, words in (
        (data, "6.5 s"),
        (sb.studies.Measured(), "nothing was measured"),
    ):
        with pytest.raises(sb.InputError, match=words):
            sb.calibrate(stop_scene(C=None), {"initial.omega": (5.0, 30.0)}, wrong)
