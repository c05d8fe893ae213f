"""Measured data from CSV: units, empty cells, faults in one report; and `simbrake calibrate` as a user meets it."""

import json
import math
import re

import numpy as np
import pytest
from helpers import closed_form
from test_cli import call

import simbrake as sb
from simbrake._base._table import unit
from simbrake.studies._measured import COLUMNS, column_of


def write(folder, name, text):
    file = folder / name
    file.write_text(text, "utf-8")
    return file


def test_units_and_empty_cells(tmp_path):
    series = write(
        tmp_path,
        "series.csv",
        "# a logger's remark\n"
        "t [ms],omega [rpm],omega_sigma,lining_temperature[3] [degC],lining_temperature[3]_sigma,tight_tension[kN]\n"
        "0,300,6,20,1.5,\n"
        "\n"
        "500,,,25,2,1.25\n"
        "1000,60,3,,,-2\n",
    )
    events = write(
        tmp_path, "events.csv", "event,value,unit,sigma\nstopping_time,1500,ms,20\nmax_tension,3,kN,\nhook_travel,,,\n"
    )
    data = sb.read_measured(series, events, sigma={"tight_tension": 100.0, "max_tension": 50.0})
    omega, lining, tension = data.points
    np.testing.assert_allclose(omega.t, [0.0, 1.0])
    np.testing.assert_allclose(omega.value, [10 * math.pi, 2 * math.pi])
    np.testing.assert_allclose(omega.sigma, [0.2 * math.pi, 0.1 * math.pi])
    assert (lining.column, lining.entry, lining.name) == ("lining_temperature", "3", "lining_temperature[3]")
    np.testing.assert_allclose(lining.value, [293.15, 298.15])
    np.testing.assert_allclose(lining.sigma, [1.5, 2.0])
    np.testing.assert_allclose(tension.value, [1250.0, -2000.0])
    np.testing.assert_allclose(tension.sigma, 100.0)
    stop, greatest = data.singles
    assert (stop.metric, stop.value, stop.sigma) == ("stopping_time", 1.5, 0.02)
    assert (greatest.value, greatest.sigma) == (3000.0, 50.0)
    assert data.sigma_known
    assert data.count == 8
    assert "stopping_time = 1.5 s" in str(data)


def test_semicolons_with_decimal_commas_and_chosen_columns(tmp_path):
    file = write(tmp_path, "a.csv", "\ufefft;omega;comment\n0,5;1,25e1;begin\n1,5;7;end\n")
    (omega,) = sb.read_measured(file, columns=["omega"], sigma={"omega": 0.1}).points
    np.testing.assert_allclose(omega.t, [0.5, 1.5])
    np.testing.assert_allclose(omega.value, [12.5, 7.0])
    with pytest.raises(sb.InputError, match="comment"):
        sb.read_measured(file)


def test_all_faults_of_all_files_in_one_report(tmp_path):
    series = write(
        tmp_path,
        "series.csv",
        "t,omega [degC],omga,rim_temperature [degC],rim_temperature_sigma,at_limit,phi_sigma\n"
        "0,1,2,20,1,3,1\n"
        "x,1,2,-300,1,3,1\n"
        ",1,2,20,,3,1\n"
        "3,1,2,20,-1,3,1\n"
        "4,1,2\n"
        "5,inf,2,20,1,3,1\n",
    )
    events = write(
        tmp_path,
        "events.csv",
        "event,time,sigma\nstoping_time,1.5,0.1\nmax_tension,5,1\nstopping_time,soon,0.1\nfull_slip_time,0.1,0\n",
    )
    with pytest.raises(sb.InputError) as caught:
        sb.read_measured(series, events, tmp_path / "none.csv")
    text = str(caught.value)
    for words in (
        "column omega [degC]: 'degC' is not a unit of a quantity in rad/s — known here: rad/s, rpm",
        "column omga: unknown column 'omga' — nearest: omega",
        "column at_limit: at_limit cannot be fitted",
        "column phi_sigma: there is no column phi",
        "series.csv line 3, column t: 'x' is not a number",
        "line 3, column rim_temperature [degC]: -300 is below absolute zero",
        "line 4, column t: is empty",
        "line 4, column rim_temperature_sigma: is empty beside a measured value",
        "line 5, column rim_temperature_sigma: -1 is not a standard deviation",
        "line 6: has 3 cells under 7 columns",
        "line 7, column omega [degC]: 'inf' is not finite",
        "events.csv line 2, event stoping_time: unknown metric",
        "line 3, event max_tension: is not a time",
        "line 4, column time: 'soon' is not a number",
        "line 5, column sigma: 0 is not a standard deviation",
        "none.csv: there is no such file",
    ):
        assert words in text, words
    assert len(caught.value.faults) == 16


def test_a_broken_logger_does_not_fill_the_screen(tmp_path):
    file = write(tmp_path, "a.csv", "t,omega\n" + "".join(f"{i},err\n" for i in range(500)))
    with pytest.raises(sb.InputError, match="450 more errors") as caught:
        sb.read_measured(file, sigma={"omega": 0.1})
    assert len(caught.value.faults) == 51


def test_names_of_columns_are_those_that_a_run_writes():
    assert column_of("omega") == ("omega", None)
    assert column_of("tension[20]") == column_of("tension_20") == ("tension", "20")
    assert column_of("temperature_rim[1]") == column_of("temperature[rim[1]]") == ("temperature", "rim[1]")
    assert column_of("lining_outer_temperature_2") == ("lining_outer_temperature", "2")
    assert all(column_of(name) == (name, None) for name in COLUMNS)
    assert column_of("tension_sigma") is None
    # of friction pairs
    assert column_of("internal_torque") == ("internal_torque", None)
    assert column_of("external_slip_speed[3]") == column_of("external_slip_speed_3") == ("external_slip_speed", "3")
    assert column_of("internal_sense") is column_of("internal_load") is None
    assert unit("kN·m", "N*m").factor == 1e3
    with pytest.raises(ValueError, match="known here"):
        unit("rpm", "N")


def test_arrays_are_checked_as_files_are():
    with pytest.raises(sb.InputError) as caught:
        sb.studies.Measured.of(
            [0.0, 1.0],
            {"omega": [1.0], "speed": [1.0, 2.0], "phi": [np.nan, np.nan], "tight_tension": [1.0, 2.0]},
            sigma={"tight_tension": -1.0, "slack_tension": 1.0},
            events={"stopping_time": np.inf},
        )
    assert len(caught.value.faults) == 6
    t, values = [0.0, 1.0, 2.0], {"omega": [3.0, np.nan, 1.0]}
    assert list(sb.studies.Measured.of(t, values, sigma={"omega": [0.1, 0.2, 0.3]}).points[0].sigma) == [0.1, 0.3]


SCENE = """
import math
import simbrake as sb

def scene():
    linings = sb.uniform_linings(20, math.radians(270), sb.ConstantFriction(0.35))
    brake = sb.Brake(sb.Pulley(0.725, 800.0), sb.Band(0.725), linings)
    return sb.Scene(brake, sb.Duty(sb.Constant(6e3), sb.TorqueLoad()), sb.Initial(15.0), 5.0)
"""


@pytest.fixture
def files(tmp_path):
    ts = np.linspace(0.02, 0.6, 30)
    slope = 8e3 * 0.725 * (closed_form()["Pi"] - 1) / 800.0
    lines = "".join(f"{t!r},{(20.0 - slope * t) * 30 / math.pi!r}\n" for t in ts.tolist())
    series = write(tmp_path, "speed.csv", "t,omega [rpm]\n" + lines)
    events = write(tmp_path, "events.csv", f"event,time [ms],sigma\nstopping_time,{1e3 * 20.0 / slope!r},1\n")
    return write(tmp_path, "stop.py", SCENE), series, events


@pytest.mark.slow
def test_calibrate_from_files(capsys, monkeypatch, tmp_path, files):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    scene, series, events = map(str, files)
    fit = ["--fit", "initial.omega=5:60", "--fit", "duty.slack_tension.level=2e3:3e4"]
    data = [series, "--events", events, "--sigma", "omega=0.2"]
    code, out, err = call(capsys, "calibrate", scene, *data, *fit, "--json", "--out", str(tmp_path / "out"))
    assert (code, err) == (0, "")
    found = json.loads(out)
    np.testing.assert_allclose([p["value"] for p in found["parameters"]], [20.0, 8e3], rtol=1e-8)
    assert found["degrees_of_freedom"] == 29
    names = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert names == ["calibration.json", "calibration.png", "calibration.txt", "residuals.csv"]
    assert json.loads((tmp_path / "out" / "calibration.json").read_text("utf-8")) == found
    assert len((tmp_path / "out" / "residuals.csv").read_text("utf-8").splitlines()) == 32
    code, out, _ = call(capsys, "calibrate", scene, *data, *fit, "--set", "initial.omega=18")
    assert code == 0
    assert "run it   simbrake run" in out
    late = write(tmp_path, "late.csv", "event,time,sigma\nstopping_time,70,0.1\n")
    limits = ["--fit", "brake.linings.friction.coefficient=0.01:0.5"]
    code, out, _ = call(capsys, "calibrate", scene, str(late), *limits)
    assert code == 1
    assert "not converged" in out


def test_calibrate_with_bad_input_exits_2_with_all_faults(capsys, tmp_path, files):
    scene, series, _ = map(str, files)
    bad = write(tmp_path, "bad.csv", "t,omega\n0,fast\n")
    fit = ["--fit", "initial.omega=5", "--sigma", "omega", "--start", "x=y", "--start", "5 kN", "--start", "x=z"]
    code, out, err = call(capsys, "calibrate", scene, str(bad), *fit, "--out", str(tmp_path / "out"))
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
    assert re.search(r"--start x\W+is given twice", err)
    assert not (tmp_path / "out").exists()
    code, _, err = call(capsys, "calibrate", scene, series, "--fit", "initial.omga=5:60", "--sigma", "omega=1")
    assert code == 2
    assert "initial.omega" in err
    assert call(capsys, "calibrate", scene, series)[0] == 2
