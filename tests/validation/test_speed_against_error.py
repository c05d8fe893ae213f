"""The work–precision benchmark: its equations, its reference and its interpolation."""

import importlib
import pathlib
import shutil
import sys

import pytest
from helpers import near

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import ours, peers
from benchmarks.peers import scipy_ivp
from benchmarks.reference import error, reference
from benchmarks.scenes import CASES, closed_form


@pytest.mark.parametrize(
    "name", ["a", "b", *(pytest.param(n, marks=pytest.mark.slow) for n in "def")]
)
def test_scipy_and_simbrake_agree(name):
    case = CASES[name]
    theirs = peers.solve(scipy_ivp, name, "SciPy DOP853", 1e-11)
    mine = ours.simbrake_runner(case, "simbrake Dopri8", 1e-11)()
    assert max(error(case, mine, theirs)) <= 1e-9
    if name == "a":
        assert max(error(case, mine, closed_form(case.plain))) <= 1e-11
    if name == "b":
        near(theirs.times[-1], 0.65866, abs=1e-5)


@pytest.mark.parametrize("name", [pytest.param("b", marks=pytest.mark.slow), "d"])
def test_reference_by_collocation(name):
    theirs = peers.solve(scipy_ivp, name, "SciPy DOP853", 1e-12)
    assert max(error(CASES[name], theirs, reference(name).answer)) <= 1e-11
    assert reference(name).uncertainty <= 1e-12


NO_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
#: one method of each peer, what is asked of it, and how close it must come in scenes
#: with events
PEERS = [
    ("casadi_events", "CasADi erk", 1e-10, 1e-8),
    ("casadi_events", "CasADi Rosenbrock", 1e-10, 1e-8),
    ("casadi_events", "CasADi CVODES Adams", 1e-10, 3e-6),
    ("sundae_cvode", "sundae CVODE Adams", 1e-12, 1e-8),
    ("pathsim_blocks", "PathSim RKDP87", 1e-10, 1e-7),
    ("heyoka_taylor", "heyoka Taylor", 1e-12, 1e-10),
    ("pydiffsol_text", "diffsol tsit45", 1e-11, 1e-8),
    pytest.param(
        "casadi_events", "CasADi erk, C", 1e-10, 1e-8, marks=[pytest.mark.slow, NO_GCC]
    ),
]


@pytest.mark.parametrize("name", ["a", "d", "e"])
@pytest.mark.parametrize(("module", "method", "tolerance", "allowed"), PEERS)
def test_peers_solve_every_scene(module, method, tolerance, allowed, name):
    peer = importlib.import_module(f"benchmarks.peers.{module}")
    for package in peer.PACKAGES:
        pytest.importorskip(package)
    theirs = peers.solve(peer, name, method, tolerance)
    assert (
        max(
            error(
                CASES[name], theirs, peers.solve(scipy_ivp, name, "SciPy DOP853", 1e-12)
            )
        )
        <= allowed
    )
