"""A field recording of time, hook position, speed and load, and lever force: read, laid
over a run, fitted."""

import math

import numpy as np
import pytest
from helpers import main

import simbrake as sb
from simbrake import plot

R = 0.6
J = 900.0
N = 10
BETA = math.radians(25.0)
F = 0.3
W0 = 18.0
FORCE = 2000.0
GAIN = 10.0
MASS = 40e3
RADIUS = 0.4
LINES = 8
POUND = 0.45359237
G = 9.80665
PER_RADIAN = RADIUS / LINES


def scene(friction=F):
    lever = sb.Lever(sb.Constant(FORCE), GAIN, 1.0)
    brake = sb.Brake(
        sb.Pulley(R, J),
        sb.Band(R),
        sb.Lining(sb.ConstantFriction(friction), np.full(N, BETA)),
    )
    return sb.Scene(
        brake, sb.Duty(lever, sb.HookLoad(MASS, RADIUS, LINES)), sb.Initial(W0), 3.0
    )


def alpha(f=F):
    """Constant while the brake slides (rad/s²)."""
    z = math.tan(BETA / 2)
    torque = R * FORCE * GAIN * (((1 + f * z) / (1 - f * z)) ** N - 1)
    return (MASS * G * PER_RADIAN - torque) / (J + MASS * PER_RADIAN**2)


STOP = -W0 / alpha()
TIMES = np.linspace(0.0, 0.9 * STOP, 7)
POSITION = PER_RADIAN * (W0 * TIMES + 0.5 * alpha() * TIMES**2)
SPEED = PER_RADIAN * (W0 + alpha() * TIMES)
LOAD = MASS * (G - PER_RADIAN * alpha())


@pytest.fixture
def recording(tmp_path):
    head = (
        "t [ms],hook_position [ft],hook_speed [ft/min],hook_load [klbf],lever_force "
        "[lbf],hook_load_sigma"
    )
    rows = [
        f"{1e3 * t!r},{x / 0.3048!r},{v / 0.00508!r},{LOAD / POUND / G / 1e3!r},{FORCE / POUND / G!r},0.5"
        for t, x, v in zip(
            TIMES.tolist(), POSITION.tolist(), SPEED.tolist(), strict=True
        )
    ]
    (tmp_path / "rig.csv").write_text("\n".join([head, *rows]))
    return tmp_path / "rig.csv"


def test_hook_of_a_run():
    assert 0.5 < STOP < 3.0
    result = sb.simulate(scene())
    s = result.series(TIMES)
    np.testing.assert_allclose(s.hook_position, POSITION, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(s.hook_speed, SPEED, rtol=1e-9)
    np.testing.assert_allclose(s.hook_load, LOAD, rtol=1e-9)
    np.testing.assert_allclose(s.lever_force, FORCE, rtol=1e-12)
    still = result.series([3.0])
    assert float(still.hook_load[0]) == pytest.approx(MASS * G, rel=1e-12)


def test_recording_in_units_of_a_rig_is_read(recording):
    data = {part.name: part for part in sb.read_measured(recording).points}
    np.testing.assert_allclose(data["hook_position"].t, TIMES, rtol=1e-14)
    np.testing.assert_allclose(data["hook_position"].value, POSITION, rtol=1e-13)
    np.testing.assert_allclose(data["hook_speed"].value, SPEED, rtol=1e-13)
    np.testing.assert_allclose(data["hook_load"].value, LOAD, rtol=1e-13)
    np.testing.assert_allclose(data["hook_load"].sigma, 500 * POUND * G, rtol=1e-13)
    np.testing.assert_allclose(data["lever_force"].value, FORCE, rtol=1e-13)


def test_recording_over_a_run(recording):
    result = sb.simulate(scene())
    data = sb.read_measured(recording)
    with sb.results.display_units("rig"):
        figure = plot.overlay(result, data)
    dots = figure.axes[1].lines[0]
    line = figure.axes[1].lines[-1]
    np.testing.assert_allclose(dots.get_ydata(), SPEED / 0.00508, rtol=1e-12)
    t = np.asarray(line.get_xdata())
    np.testing.assert_allclose(
        line.get_ydata(), PER_RADIAN * (W0 + alpha() * t) / 0.00508, rtol=1e-9
    )
    with pytest.raises(
        sb.InputError, match="rim_temperature: is not in a run of this scene"
    ):
        plot.overlay(
            result, sb.studies.Measured.of(TIMES, {"rim_temperature": TIMES + 300.0})
        )


def test_friction_is_fitted_to_the_hook(recording):
    data = sb.read_measured(
        recording,
        columns=["hook_position", "hook_speed"],
        sigma={"hook_position": 0.01, "hook_speed": 0.01},
    )
    fit = sb.calibrate(
        scene(0.27), {"brake.linings.friction.coefficient": (0.2, 0.4)}, data
    )
    assert fit.parameters[0].value == pytest.approx(F, rel=1e-7)


def test_run_writes_the_overlay(recording, tmp_path, capsys, drawn):
    sb.write_scene(scene(), tmp_path / "stop.toml")
    options = [
        "run",
        str(tmp_path / "stop.toml"),
        "--measured",
        str(recording),
        "--units",
        "rig",
    ]
    with pytest.raises(SystemExit) as end:
        main([*options, "--out", str(tmp_path / "out")])
    assert end.value.code == 0
    assert "overlay.png" in capsys.readouterr().out
    assert (tmp_path / "out" / "overlay.png").exists()
    np.testing.assert_allclose(
        drawn["overlay.png"].axes[1].lines[0].get_ydata(), SPEED / 0.00508, rtol=1e-12
    )
    with pytest.raises(SystemExit) as end:
        main(options)
    assert end.value.code == 2
    assert "--out" in capsys.readouterr().err
