"""What people read in Python: parts, results, series with units; numbers by name;
notebooks."""

import jax
import numpy as np
import pytest
from stop_scenes import stop_scene

import simbrake as sb


@pytest.fixture(scope="module")
def result():
    return sb.simulate(stop_scene(C=None, load=1e4))


def test_parts_show_values_with_units():
    assert (
        repr(sb.Pulley("590 mm", 1200)) == "Pulley(radius=0.59 m, inertia=1200 kg·m²)"
    )
    assert (
        repr(sb.ramp(2e3, 24e3, 0.0, 0.35))
        == "PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])"
    )
    load = "TorqueLoad(profile=Constant(level=0 N·m), drag=0 N·m·s)"
    assert (
        repr(sb.Duty("6 kN", 0))
        == f"Duty(\n  slack_tension=Constant(level=6 kN),\n  load={load},\n)"
    )
    linings = sb.uniform_linings(20, "270 deg", 0.35)
    assert "friction=ConstantFriction(coefficient=0.35, static_ratio=1)" in repr(
        linings
    )
    assert "angle=20 × 13.5°" in repr(linings)
    fade = sb.LinearFade(slope=1.5e-3, above="120 degC", floor=0.6, blend=10.0)
    assert (
        repr(fade)
        == "LinearFade(slope=0.0015 1/K, above=120 °C, floor=0.6, blend=10 K)"
    )
    scene = stop_scene()
    text = repr(scene)
    assert text.startswith(
        "Scene(\n  brake=Brake(\n    pulley=Pulley(radius=0.725 m, inertia=800 kg·m²),\n"
    )
    assert "heat" not in text
    assert max(map(len, text.splitlines())) <= 110


def test_traced_and_odd_values_do_not_hinder():
    seen = []
    jax.jit(lambda scene: seen.append(repr(scene.brake)) or scene.end_time)(
        stop_scene()
    )
    assert "angle=f64[20]" in seen[0]
    assert "radius=None" not in repr(jax.tree.map(lambda _: None, stop_scene()))
    assert "Scene" in repr(jax.tree.map(lambda _: "leaf", stop_scene()))
    assert "nan" in repr(jax.tree.map(lambda x: x * np.nan, stop_scene()))


def test_results_are_read_by_name(result):
    assert result["stopping_time"] == float(result.stopping_time)
    assert result["max_tension"] == float(result.max_tension.value)
    assert result["energy.friction_heat"] == float(result.energy["friction_heat"])
    with pytest.raises(KeyError, match="nearest: stopping_time"):
        result["stoping_time"]
    with pytest.raises(KeyError, match="not a metric"):
        result[0]
    with pytest.raises(TypeError):
        iter(result)
    assert result.events["stop"].times == [result["stopping_time"]]
    assert result.events[0].name == "slip_onset"
    assert result.events["restart"] == []
    with pytest.raises(KeyError, match="nearest: stop"):
        result.events["stopp"]


def test_results_in_notebooks(result):
    page = result._repr_html_()
    assert "#fdf3e0" in page  # amber: no limits are given
    assert "stopping_time" in page
    series = result.series([0.0, 0.5])
    assert "omega" in repr(series)
    assert "rad/s" in series._repr_html_()
    part = " ".join(result.scene._repr_html_().split())
    assert all(
        words in part
        for words in ("brake.pulley.inertia", "kg·m²", "inertia about the shaft")
    )
    assert float(result.to_xarray().stopping_time) == result["stopping_time"]
    assert result.plot().axes
    assert repr(result) == str(result)


def test_prepared_runs_tell_what_they_give():
    prepared = sb.prepare(stop_scene(C=None, load=1e4), ["stopping_time"])
    assert repr(prepared).startswith("Prepared(standard brake: ")
    assert "stopping_time [s]" in repr(prepared)
