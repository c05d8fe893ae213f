"""What makes a scene ask for an implicit method: quick thermal nodes, drag, ropes,
states; and what a run may assume.

Steps of an explicit method stay stable up to six times the fastest time constant: with
heat, whose steps cost more, 150 of them are too many, without it 1500.
"""

import numpy as np
import pytest
from scenes import stop_scene

import simbrake as sb
from simbrake.runs.choice import fastest_node, stiffness


def shafted(*laws, load=0.0, end=30.0):
    """A rigid brake, its band open, with torques on its shaft."""
    return stop_scene(C=None, T0=0.0, load=load, end=end, shaft=laws)


@pytest.mark.parametrize("face", ["front", "back"])
def test_fastest_node_of_a_wall(face):
    """`2 Σ g/C` with half of each layer between two nodes, and the half layer behind
    the face of a link."""
    k = 10.0
    rho = 100.0
    c = 8.0
    A = 2.0
    thickness = 0.9
    h = 500.0
    growth = 2.0 if face == "front" else 0.5
    steps = thickness * growth ** np.arange(3.0) / np.sum(growth ** np.arange(3.0))
    body = sb.thermal.Wall("w", sb.Material(k, rho, c), thickness, A, 3, growth)
    heat = sb.Heat(
        (body, sb.thermal.Reservoir("air")),
        (sb.thermal.Convection(f"w.{face}", A, h, "air"),),
    )
    half = steps / (2 * k * A)
    inner = 1 / (half[:-1] + half[1:])
    total = np.asarray([inner[0], inner.sum(), inner[1]])
    at = 0 if face == "front" else 2
    total[at] += 1 / (1 / (h * A) + half[at])
    rate, node = fastest_node(heat)
    assert (rate, node) == (
        pytest.approx(2 * total[at] / (rho * c * A * steps[at]), rel=1e-12),
        f"w[{at + 1}]",
    )


@pytest.mark.parametrize(("steps", "stiff"), [(1490.0, False), (1510.0, True)])
def test_1500_steps_of_drag_and_rope(steps, stiff):
    """Rates `(c_load + c_shaft)/J`, and `c (1/m + (r/n)²/J)` of the empty hook, over
    the time of the run."""
    c = 6.0 * steps / 8.0 * 800.0
    load = sb.TorqueLoad(0.0, drag=0.75 * c)
    drag = sb.with_values(
        shafted(sb.loads.ViscousDrag(0.25 * c), load=load, end=10.0),
        {"initial.time": 2.0},
    )
    assert stiffness(drag)[0] == stiff
    m = 2e3
    r = 0.4
    n = 2
    rope = sb.loads.RopeElasticity(
        1e6, damping=6.0 * steps / 10.0 / (1 / m + (r / n) ** 2 / 800.0)
    )
    load = sb.loads.TrippingLoad(
        m, 6e4, 900.0, 1.0, 5.0, 6.0, r, n, count=2, elasticity=rope
    )
    assert stiffness(shafted(load=load, end=10.0))[0] == stiff
