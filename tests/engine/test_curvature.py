"""Second derivatives against closed forms, and where there are none."""

import jax
import pytest
from helpers import all_equal, input_error, near
from scenes import closed_form, stop_scene

import simbrake as sb

PATHS = {
    "f": "brake.linings.friction.coefficient",
    "J": "brake.pulley.inertia",
    "C": "brake.band.stiffness",
    "T0": "duty.slack_tension.level",
    "w0": "initial.omega",
}
VALUES = {"f": 0.35, "J": 800.0, "C": 2e5, "T0": 8e3, "w0": 20.0}


@pytest.mark.slow
def test_second_derivatives_of_the_stop():
    exact = jax.hessian(lambda p: closed_form(**p, xp=jax.numpy)["stop"])(VALUES)
    slope = jax.grad(lambda p: closed_form(**p, xp=jax.numpy)["stop"])(VALUES)
    found = sb.studies.hessian(stop_scene(), "stopping_time", list(PATHS.values()))
    assert found.paths == tuple(PATHS.values())
    scale = abs(found.value)
    for i, a in enumerate(VALUES):
        near(
            found.gradient[i] * VALUES[a] / scale,
            float(slope[a]) * VALUES[a] / scale,
            abs=1e-9,
        )
        for j, b in enumerate(VALUES):
            unit = VALUES[a] * VALUES[b] / scale  # as elasticities, of order one
            near(found.matrix[i, j] * unit, float(exact[a][b]) * unit, 1e-7, 1e-7)
            assert (
                abs(found.matrix[i, j] - float(exact[a][b])) * unit
                <= 10 * found.error[i, j] * unit + 1e-7
            )
    all_equal(found.matrix, found.matrix.T)
    # a range of 1 % shows the same curvature, but for its fourth derivative
    (table,) = sb.sensitivity(stop_scene(), ["stopping_time"], [PATHS["f"]], span=0.01)
    (row,) = table.rows
    assert row.low is not None
    bent = (0.5 * (row.low + row.high) - table.value) / (0.5 * row.half**2)
    near(bent, exact["f"]["f"], 1e-3)


def test_other_events_in_a_step_are_refused():
    scene = stop_scene(C=None)
    metric = "stopping_time"
    stop = float(sb.simulate(scene).stopping_time)
    close = sb.with_values(scene, {"end_time": 1.005 * stop})
    with input_error(
        match=r"initial\.omega: .* within a step of 0\.02 — give a smaller step"
    ):
        sb.studies.hessian(close, metric, "initial.omega")
    assert sb.studies.hessian(
        close, metric, "initial.omega", step=0.001
    ).matrix.shape == (1, 1)
    with input_error(match="no such number"):
        sb.studies.hessian(scene, metric, "initial.omeg")
    with input_error(match=r"initial\.time: is 0"):
        sb.studies.hessian(scene, metric, "initial.time")
    with input_error(match="stoping_time"):
        sb.studies.hessian(scene, "stoping_time", "initial.omega")
