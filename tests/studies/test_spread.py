"""The spread of inputs that the library knows: what is found in a scene, and what it does to results."""

import math
import re

import numpy as np
import pytest
from helpers import main

import simbrake as sb
from simbrake.studies import known_spread

T0, J, R, W0, N, WRAP = 8e3, 800.0, 0.6, 20.0, 12, math.radians(270.0)


def stop(f=0.35, heat=None, end=20.0):
    linings = sb.uniform_linings(N, WRAP, f)
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R), linings)
    return sb.Scene(brake, sb.Duty(T0, sb.TorqueLoad(0.0)), sb.Initial(W0), end, heat)


def stopping_time(f):
    """`J ω_0/(R T_0 (Π − 1))` of a rigid band without load."""
    z = np.tan(WRAP / N / 2)
    return J * W0 / (R * T0 * (((1 + f * z) / (1 - f * z)) ** N - 1))


def heated():
    rim = sb.thermal.Wall("rim", sb.material("steel_20L"), 0.028, 1.4, 6)
    own = sb.thermal.Wall("own", sb.Material(47.0, 7800.0, 500.0), 0.01, 1.0, 3)
    friction = sb.thermal.FrictionHeat("rim.front", None, sb.thermal.ConstantPartition(0.95))
    return stop(heat=sb.Heat(bodies=(rim, own), friction=friction, rim="rim.front"))


def test_friction_range_by_material_or_class():
    path = "brake.linings.friction.coefficient"
    assert known_spread(stop()).ranges == {path: (pytest.approx(0.30), pytest.approx(0.40))}
    assert known_spread(stop(), "moulded").ranges == {path: (0.25, 0.45)}
    assert "Juvinall" in str(known_spread(stop(), "woven"))
    with pytest.raises(sb.InputError, match=r"0.35 is outside the range of class_G linings — 0\.45…0\.55"):
        known_spread(stop(), "class_G")
    with pytest.raises(sb.InputError, match="'mould' is no friction material — there are moulded, woven"):
        known_spread(stop(), "mould")


def test_thermal_ranges_are_of_the_library():
    known = known_spread(heated()).known
    entries = sb.thermal.LIBRARY["steel_20L"]
    found = {path: (one.low, one.high, one.source) for path, one in known.items() if path.startswith("heat.")}
    assert found == {
        f"heat.bodies[0].material.{name}": (one.low, one.high, one.source) for name, one in entries.items()
    }  # and nothing of a material that is not the library's


@pytest.mark.slow
def test_ranges_of_key_figures(tmp_path):
    """A stop takes longer with less friction: its quantiles are those of the coefficient, the other way round."""
    page = sb.report(stop(), check=False, spread="moulded")
    low, high = (stopping_time(0.25 + 0.20 * share) for share in (0.95, 0.05))
    shown = re.search(r"Stopping time</dt>.*?90 % of runs: ([\d.]+) … .*?([\d.]+) s", page, re.DOTALL)
    assert float(shown[1]) == pytest.approx(low, rel=0.02)
    assert float(shown[2]) == pytest.approx(high, rel=0.02)
    heat = re.search(r"Friction heat</dt>.*?90 % of runs: ([\d.]+) … ", page, re.DOTALL)
    assert float(heat[1]) == pytest.approx(0.5 * J * W0**2 / 1e3)
    assert '<section id="spread">' in page
    assert "does not stop" not in page
    few = sb.report(stop(end=0.5 * (low + high)), check=False, spread="moulded")
    assert re.search(r"does not stop: \d+ of 256 runs", few)
    assert re.search(r"90 % of the \d+ runs of 256 that have it", few)


def test_wrong_options_write_nothing(tmp_path, capsys):
    file = tmp_path / "stop.toml"
    sb.write_scene(stop(), file)
    out = tmp_path / "page.html"
    with pytest.raises(SystemExit) as ended:
        main(["report", str(file), "--with-spread", "--lining", "corks", "--limit", "stop=3", "--out", str(out)])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert "2 input errors" in error
    assert "'corks' is no friction material" in error
    assert not out.exists()
    with pytest.raises(SystemExit) as ended:
        main(["report", str(file), "--lining", "cork"])
    assert ended.value.code == 2
