"""The scenarios that ship: each is a valid scene and runs as a script."""

import importlib.util
import pathlib
import runpy
import sys

import jax
import numpy as np
import pytest

import simbrake as sb

FOLDER = pathlib.Path(__file__).parent.parent / "scenarios"
NAMES = sorted(file.stem for file in FOLDER.glob("*.py"))


def load(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", NAMES)
def test_scene_is_valid(name):
    assert {"everything_coupled", "slip_onset_chain", "staged_vs_standard", "two_bands"} <= set(NAMES)
    sb.check(load(name).scene())


@pytest.mark.slow
def test_everything_coupled_keeps_its_balances():
    result = sb.simulate(load("everything_coupled").scene())
    assert result.status == "stopped"
    assert float(result.energy["closure"]) <= 1e-9
    assert float(result.energy["heat_closure"]) <= 1e-12
    names = [event.name for event in result.events]
    for name in ("slip_onset", "internal_slip", "external_lock", "stop", "restart", "release"):
        assert name in names
    assert names.count("external_lock") == 2
    s = result.series(np.linspace(0.0, 8.0, 200))
    assert np.all(np.diff(np.asarray(s.friction_heat)) >= -1e-6)


@pytest.fixture
def printed(monkeypatch, capsys):
    """What a scenario prints as a script: within this process, which has most of the programs; test_cli starts one."""

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
    out = printed("stopping_time_uncertainty", "--runs", "64", "--points", "8", "--out", str(tmp_path))
    for words in ("64 scrambled Sobol points", "does not stop", "peak_lining_temperature > 673.15 K", "S_T"):
        assert words in out
    assert {"stopping_time.png", "sobol_time_to_stop.png", "runs.csv", "uncertainty.json"} <= {
        file.name for file in tmp_path.iterdir()
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("staged_vs_standard", "hottest rim surface"),
        ("slip_onset_chain", "k-th to slip"),
        ("two_bands", "equal elongation (K-8)"),
        ("resolved_bandage", "comes to rest on the band"),
        ("equal_wear_layout", "equal wear differs from Z's angles"),
        ("lining_life", "uniform pitch, turned end for end"),
        ("calibrate_friction", "together change the measured values by less than their errors"),
    ],
)
def test_comparison_runs_as_a_script(printed, name, words):
    assert words in printed(name)
