"""A field recording of time, hook position, speed and load, and lever force: read, laid
over a run, fitted."""

import math

import numpy as np
import pytest
from commands import call
from helpers import all_near, near
from scenes import lining_ratio

import simbrake as sb

R = 0.6
J = 900.0
N = 10
BETA = math.radians(25.0)
F = 0.3
W0 = 18.0
FORCE = 2000.0
GAIN = 10.0
MASS = 40e3
#: m of the hook a radian
REACH = 0.4 / 8
POUND = 0.45359237
G = 9.80665


def scene(friction=F):
    lever = sb.Lever(sb.Constant(FORCE), GAIN, 1.0)
    lining = sb.Lining(sb.ConstantFriction(friction), np.full(N, BETA))
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R), lining)
    duty = sb.Duty(lever, sb.HookLoad(MASS, 0.4, 8))
    return sb.Scene(brake, duty, sb.Initial(W0), 3.0)


TORQUE = R * FORCE * GAIN * (lining_ratio(F, BETA) ** N - 1)
#: constant while the brake slides (rad/s²)
ALPHA = (MASS * G * REACH - TORQUE) / (J + MASS * REACH**2)
TIMES = np.linspace(0.0, -0.9 * W0 / ALPHA, 7)
TRUTH = {
    "hook_position": REACH * (W0 * TIMES + 0.5 * ALPHA * TIMES**2),
    "hook_speed": REACH * (W0 + ALPHA * TIMES),
    "hook_load": np.full(7, MASS * (G - REACH * ALPHA)),
    "lever_force": np.full(7, FORCE),
}


@pytest.fixture
def recording(tmp_path):
    """In the units of a rig."""
    head = "t [ms],hook_position [ft],hook_speed [ft/min],hook_load [klbf],lever_force [lbf]"
    units = (1e-3, 0.3048, 0.3048 / 60, 1e3 * POUND * G, POUND * G)
    rows = np.stack([TIMES, *TRUTH.values()], axis=1) / units
    text = "\n".join([head, *(",".join(map(repr, row.tolist())) for row in rows)])
    (tmp_path / "rig.csv").write_text(text)
    return tmp_path / "rig.csv"


def test_hook_of_a_run_and_of_the_recording(recording):
    series = sb.simulate(scene()).series(TIMES)
    data = {part.name: part for part in sb.read_measured(recording).points}
    for name, truth in TRUTH.items():
        all_near(getattr(series, name), truth, 1e-9, 1e-12)
        all_near(data[name].value, truth, 1e-13, 1e-15)
        all_near(data[name].t, TIMES, 1e-14)


def test_friction_is_fitted_to_the_hook(recording):
    sigma = {"hook_position": 0.01, "hook_speed": 0.01}
    data = sb.read_measured(recording, columns=[*sigma], sigma=sigma)
    path = "brake.linings.friction.coefficient"
    fit = sb.calibrate(scene(0.27), {path: (0.2, 0.4)}, data)
    near(fit.parameters[0].value, F, 1e-7)


def test_run_writes_the_overlay(recording, tmp_path, capsys, drawn):
    file = str(tmp_path / "stop.toml")
    sb.write_scene(scene(), file)
    asked = ("run", file, "--measured", str(recording), "--units", "rig")
    assert call(capsys, *asked, "--out", str(tmp_path / "out"))[0] == 0
    dots = drawn["overlay.png"].axes[1].lines[0].get_ydata()
    all_near(dots, TRUTH["hook_speed"] / 0.3048 * 60, 1e-12)
    assert drawn["stop.png"].axes[0].get_ylabel() == "$\\omega$, rpm"
    assert call(capsys, *asked)[0] == 2
