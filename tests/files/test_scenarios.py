"""The scenarios that ship: each is a valid scene and runs as a script."""

import runpy
import sys

import jax
import numpy as np
import pytest
from shipped import FOLDER, NAMES, load

import simbrake as sb


@pytest.mark.parametrize("name", NAMES)
def test_scene_is_valid(name):
    assert {"everything_coupled", "slip_onset_chain", "staged_vs_standard", "two_bands"} <= set(NAMES)
    sb.check(load(name).scene())


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
        ("unequal_bands", "equal tensions (balance beam)"),
        ("resolved_bandage", "comes to rest on the band"),
        ("equal_wear_layout", "equal wear differs from Z's angles"),
        ("lining_life", "uniform pitch, turned end for end"),
        ("calibrate_friction", "together change the measured values by less than their errors"),
    ],
)
def test_comparison_runs_as_a_script(printed, name, words):
    assert words in printed(name)


def pulley_network():
    """Capacities (J/K) and conductances (W/K) of rim, linings, band, flange, rim lips and disc, as in V and Charron."""
    track, pulleys = 2 * 2 * np.pi * 0.590 * 0.220, 2
    steel, lining, band = (sb.material(name) for name in ("steel_20L", "FK-24A", "band_steel"))
    rho_c = [float(m.density * m.specific_heat) for m in (steel, lining, band)]
    C = [rho_c[0] * track * 0.025, rho_c[1] * 0.75 * track * 0.03, rho_c[2] * 0.75 * track * 0.006]
    air, K = [25.0 * 2 * track, 0.0, 10.0 * 0.75 * track], np.zeros((7, 7))
    K[1, 2] = float(lining.conductivity) * 0.75 * track / 0.03
    for i, (r, R, L) in enumerate(
        ((0.420, 0.565, 0.035), (0.565, 0.615, 0.025), (0.575, 0.615, 0.025), (0.575, 0.590, 0.025))
    ):
        face = pulleys * np.pi * (R**2 - r**2)
        C.append(rho_c[0] * face * L)
        air.append(15.0 * 2 * face)
        K[0, 3 + i] = pulleys * 2 * np.pi * float(steel.conductivity) * L / np.log(R / r)
    e = [float(m.effusivity) for m in (steel, lining)]
    return np.array(C), np.diag((K + K.T).sum(1) + air) - K - K.T, np.array([e[0], e[1], 0, 0, 0, 0, 0]) / sum(e)


def test_heat_to_the_flange_when_stabilised():
    """The first cycle against SciPy; means of the steady cycle are linear algebra of a linear network."""
    from scipy.integrate import solve_ivp

    module = load("thermal_stabilisation")
    C, K, into = pulley_network()
    z, J, M = np.tan(np.radians(13.5 / 2)), 1200 + 60e3 * 0.05**2, 60e3 * 9.80665 * 0.05
    grip = 0.623 * (((1 + 0.35 * z) / (1 - 0.35 * z)) ** 20 - 1)

    def rates(t, y, turns):  # speed, rises over the air, their integrals, friction work
        torque = turns * grip * (2e3 + 22e3 * min(t / 0.35, 1.0))
        return np.r_[turns * (M - torque) / J, (into * torque * y[0] - K @ y[1:8]) / C, y[1:8], torque * y[0]]

    def stop(t, y, turns):
        return y[0]

    stop.terminal = True
    y, t = np.r_[24.0, np.zeros(15)], 0.0
    for end, turns in ((0.35, 1), (90.0, 1), (90.0, 0)):
        ran = solve_ivp(
            rates, (t, end), y, "DOP853", rtol=1e-12, atol=1e-8, args=(turns,), events=stop if turns else None
        )
        y, t = ran.y[:, -1], ran.t[-1]
    _, cold = module.course_of(sb.simulate(module.scene()))
    assert cold["rim", "flange"] == pytest.approx(-K[0, 3] * (y[8] - y[11]), rel=1e-9)

    mean, flows = module.course_of(sb.cyclic_steady_state(module.scene()).result)
    rise = np.linalg.solve(K, into * y[15] / 90.0)
    assert flows["rim", "flange"] == pytest.approx(-K[0, 3] * (rise[0] - rise[3]) * 90.0, rel=1e-7)
    assert mean["linings"] - mean["rim"] == pytest.approx(rise[1] - rise[0], abs=1e-6)
    assert flows["rim", "flange"] > 5 * cold["rim", "flange"]
    assert mean["linings"] > mean["rim"]
