"""What people read in Python: parts, results, series with units; numbers by name."""

import jax
import numpy as np
import pytest
from scenes import stop_run, stop_scene

import simbrake as sb


def test_parts_show_values_with_units():
    assert (
        repr(sb.Pulley("590 mm", 1200)) == "Pulley(radius=0.59 m, inertia=1200 kg·m²)"
    )
    lever = repr(sb.ramp(2e3, 24e3, 0.0, 0.35))
    assert lever == "PiecewiseLinear(times=[0, 0.35] s, values=[2000, 24000])"
    assert "angle=20 × 13.5°" in repr(sb.uniform_linings(20, "270 deg", 0.35))
    text = repr(stop_scene())
    assert "heat" not in text
    assert max(map(len, text.splitlines())) <= 110


def test_traced_and_odd_values_do_not_hinder():
    seen = []
    jax.jit(lambda scene: seen.append(repr(scene.brake)) or scene.end_time)(
        stop_scene()
    )
    assert "angle=f64[20]" in seen[0]
    assert "Scene" in repr(jax.tree.map(lambda _: "leaf", stop_scene()))
    assert "nan" in repr(jax.tree.map(lambda x: x * np.nan, stop_scene()))


def test_results_are_read_by_name():
    result = stop_run(C=None, load=10e3)
    assert result["stopping_time"] == float(result.stopping_time)
    assert result["max_tension"] == float(result.max_tension.value)
    assert result["energy.friction_heat"] == float(result.energy["friction_heat"])
    assert result.events["stop"].times == [result["stopping_time"]]
    assert result.events["restart"] == []
    with pytest.raises(KeyError, match="nearest: stopping_time"):
        result["stoping_time"]
    with pytest.raises(KeyError, match="nearest: stop"):
        result.events["stopp"]
    with pytest.raises(AttributeError, match="nearest: slack_tension"):
        _ = result.series([0.0]).slack_tenson
    assert "stopping_time" in result._repr_html_()
    assert "rad/s" in result.series([0.0])._repr_html_()
    assert "brake.pulley.inertia" in result.scene._repr_html_()
