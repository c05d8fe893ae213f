"""The scenarios that ship: each is a valid scene and runs as a script."""

import runpy
import sys

import jax
import pytest
from shipped import FOLDER, NAMES, load

import simbrake as sb


@pytest.mark.parametrize("name", NAMES)
def test_scene_is_valid(name):
    assert {
        "everything_coupled",
        "slip_onset_chain",
        "staged_vs_standard",
        "two_bands",
    } <= set(NAMES)
    sb.check_scene(load(name).scene())


@pytest.fixture
def printed(monkeypatch, capsys):
    """What a scenario prints as a script: within this process, which has most of the
    programs; test_cli starts one."""

    def run(name, *arguments):
        file = str(FOLDER / f"{name}.py")
        monkeypatch.setattr(sys, "argv", [file, *arguments])
        # scripts are written for JAX as it comes: mixed types are no error there
        with jax.numpy_dtype_promotion("standard"):
            runpy.run_path(file, run_name="__main__")
        return capsys.readouterr().out

    return run


@pytest.mark.slow
def test_uncertainty_runs_as_a_script(printed, tmp_path):
    pytest.importorskip("SALib")
    out = printed(
        "stopping_time_uncertainty",
        "--runs",
        "64",
        "--points",
        "8",
        "--out",
        str(tmp_path),
    )
    for words in (
        "64 scrambled Sobol points",
        "does not stop",
        "peak_lining_temperature > 673.15 K",
        "time_to_stop",
    ):
        assert words in out
    assert {"stopping_time.png", "hook_travel.png", "runs.csv", "uncertainty.json"} <= {
        file.name for file in tmp_path.iterdir()
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("staged_vs_standard", "hottest rim surface"),
        ("slip_onset_chain", "k-th to slip"),
        ("two_bands", "equal elongation (K-8)"),
        ("unequal_bands", "equal tensions (balance beam)"),
        ("resolved_bandage", "comes to rest on the band"),
        ("equal_wear_layout", "equal wear differs from Z's angles"),
        ("lining_life", "uniform pitch, turned end for end"),
        ("calibrate_friction", "(relative changes) together"),
    ],
)
def test_comparison_runs_as_a_script(printed, name, words):
    assert words in printed(name)


def test_heat_to_the_flange_when_stabilised():
    """In the steady cycle the flange takes much more than in the first; linings are
    hotter than the rim."""
    module = load("thermal_stabilisation")
    _, cold = module.course_of(sb.simulate(module.scene()))
    mean, flows = module.course_of(sb.cyclic_steady_state(module.scene()).result)
    assert flows["rim", "flange"] > 5 * cold["rim", "flange"]
    assert mean["linings"] > mean["rim"]
