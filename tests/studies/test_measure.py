"""Metrics by name: what a scene is said to have is what its run has, and the rest is refused with the nearest names."""

import jax
import pytest
from shipped import load

import simbrake as sb
from simbrake._run._measure import check_metrics, happened, measure, name_of, unit_of
from simbrake.results import METRICS, metric_names


@pytest.mark.parametrize(
    "name",
    ["u2_5_5_stop", pytest.param("staged_vs_standard", marks=pytest.mark.slow), "slip_onset_chain", "resolved_bandage"],
)
def test_names_of_a_scene_are_those_of_its_run(name):
    scene = load(name).scene()
    seen = {}

    def run(scene):
        result = sb.simulate(scene)
        for one in set(METRICS) & set(metric_names(scene)):
            seen[one] = measure(result, one)
        for one in set(METRICS) - set(metric_names(scene)) - {"hook_travel"}:
            with pytest.raises(ValueError, match=f"the scene has no {one}: "):
                measure(result, one)
        seen.update({f"energy.{key}": None for key in result.energy if not key.endswith("closure")})
        return measure(result, "energy.load_work"), measure(result, "stopping_time")

    shapes = jax.eval_shape(run, scene)
    assert set(metric_names(scene)) == set(seen)
    assert all(shape.shape == () and shape.dtype == "float64" for shape in shapes)
    assert all(unit_of(one) for one in metric_names(scene))


def test_what_a_scene_does_not_have_is_refused_in_one_report():
    scene = load("u2_5_5_stop").scene()
    with pytest.raises(sb.InputError) as error:
        check_metrics(scene, ["stoping_time", "peak_rim_temperature", 3.0, "stopping_time"])
    text = str(error.value)
    assert "3 input errors" in text
    assert "nearest: stopping_time" in text


def test_functions_of_a_result_are_metrics():
    def work_ratio(result):
        return result.energy["load_work"] / result.energy["friction_heat"]

    result = sb.simulate(load("u2_5_5_stop").scene())
    assert name_of(work_ratio) == "work_ratio"
    assert unit_of(work_ratio) == ""
    expected = float(result.energy["load_work"]) / float(result.energy["friction_heat"])
    assert float(measure(result, work_ratio)) == expected
    assert happened(measure(result, "stopping_time"))
