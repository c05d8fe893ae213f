"""The examples in docstrings give what they say; every part at the top has one, and what runs in a moment."""

import doctest
import inspect
import math
import types

import numpy as np
import pytest

import simbrake as sb

#: names at the top whose examples are pages of the docs: they need files, or many runs
ON_PAGES = {
    *("calibrate", "compare_materials", "cross_check", "cyclic_steady_state", "ensemble", "equal_layout"),
    *("layered_heat", "least_tension", "lining_life", "morris", "programme_scene", "quantity", "simulate_heat"),
    *("sobol_indices", "steady_state", "synthesize", "uncertainty", "validate"),
}


#: names whose examples are pages of the docs, as those above, with what they return
OF_PAGES = ON_PAGES | {
    *("Calibration", "GlobalSensitivity", "LifeHistory", "LiningLife", "MorrisTable", "SobolTable", "Uncertainty"),
}
#: the same in modules, and two that other examples show
LEFT = {
    *("InfeasibleLayout", "Layout", "LayoutDesign", "LayoutRow", "LeastTension", "chord_equal_load_angles"),
    *("equal_increment_angles", "equal_load_angles", "BrakeWords", "FrictionWithMemory", "ring_wear"),
    *("tension_shares", "write_fmu"),
}


def public():
    homes = [sb, *(getattr(sb, name) for name in sb.__all__ if isinstance(getattr(sb, name), types.ModuleType))]
    return {name: getattr(home, name) for home in homes for name in getattr(home, "__all__", ())}


EXAMPLES = {name: one for name, one in public().items() if ">>>" in (inspect.getdoc(one) or "") and callable(one)}


@pytest.fixture(scope="module")
def given():
    """What every example has: a small stop under a hook load, and its result."""
    brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35))
    scene = sb.Scene(brake, sb.Duty("12 kN", sb.HookLoad("20 t", 0.4, 8)), sb.Initial(24.0), 4.0)
    return {"sb": sb, "np": np, "math": math, "scene": scene, "result": sb.simulate(scene)}


@pytest.mark.parametrize("name", EXAMPLES)
def test_example(name, given):
    (test,) = doctest.DocTestFinder(recurse=False).find(EXAMPLES[name], name, globs=dict(given))
    said: list[str] = []
    failed, tried = doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert tried
    assert not failed, "".join(said)


def test_every_part_at_the_top_has_an_example():
    names = {name for name in sb.__all__ if not isinstance(getattr(sb, name), types.ModuleType)}
    assert names - EXAMPLES.keys() == ON_PAGES
    assert len(EXAMPLES) > 200


def test_every_name_has_an_example():
    """But for interfaces, which have pages of their own, and what is named above."""
    names = {name for name, one in public().items() if callable(one) and not name.startswith("Abstract")}
    assert names - EXAMPLES.keys() == OF_PAGES | LEFT
