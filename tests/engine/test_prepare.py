"""The prepared handle: the numbers of single runs and their derivatives, room for
longer runs, faults."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import fading, lump, rigid_stop
from helpers import all_near, input_error, near
from scenes import closed_form, stop_scene

import simbrake as sb

TIMES = {"slip_onset_time": "t0", "full_slip_time": "t1", "stopping_time": "stop"}


@pytest.fixture(scope="module")
def run():
    return sb.prepare(
        stop_scene(end=20.0), [*TIMES, "energy.friction_heat"], rtol=1e-12
    )


def test_run_and_gradient_match_closed_form(run):
    assert run.program.one_function == (jax.default_backend() == "cpu")
    derived = jax.jit(
        jax.jacobian(
            lambda p: {
                name: closed_form(**p, xp=jnp)[key] for name, key in TIMES.items()
            }
        )
    )
    for change in (
        {},
        {"initial.omega": 11.0},
        {"duty.slack_tension.level": 6e3, "initial.omega": 25.0},
    ):
        p = {
            "w0": change.get("initial.omega", 20.0),
            "T0": change.get("duty.slack_tension.level", 8e3),
            "J": 800.0,
        }
        truth = closed_form(**p)
        slopes = derived(p)
        answer = run(change)
        slope = run.gradient(change)
        assert answer.code == 0
        assert answer.accepted > 5
        assert slope.shape == (4, run.numbers.size)
        for row, (name, key) in zip(slope, TIMES.items(), strict=False):
            near(answer.metrics[name], truth[key], 1e-10)
            for path, of in (
                ("initial.omega", "w0"),
                ("duty.slack_tension.level", "T0"),
                ("brake.pulley.inertia", "J"),
            ):
                expected = float(slopes[name][of])
                near(row[run.places[path]], expected, 1e-10, 1e-12)


def test_entries_and_vectors_match_simulate(run):
    change = {
        "brake.linings.angle[3]": 0.21,
        "brake.linings.angle[-1]": 0.25,
        "brake.pulley.inertia": 700.0,
    }
    numbers = run.vector(change)
    assert run(numbers) == run(change)
    result = run.result(change)
    found = run(change).metrics
    near(found["stopping_time"], result.stopping_time, 1e-12)
    near(found["energy.friction_heat"], result.energy["friction_heat"], 1e-12)
    entry = range(run.numbers.size)[run.places["brake.linings.angle"]][3]
    assert numbers[entry] == 0.21
    assert run.numbers[entry] != 0.21


@pytest.mark.slow
def test_a_run_that_needs_more_room_gets_it():
    run = sb.prepare(stop_scene(end=20.0), ["stopping_time"], max_steps=8)
    near(run().metrics["stopping_time"], closed_form()["stop"], 1e-10)
    assert run.max_steps > 8


def test_never_is_infinite_without_a_derivative(run):
    answer = run({"initial.omega": 0.0})
    assert answer.metrics["stopping_time"] == np.inf
    slope = run.gradient({"initial.omega": 0.0})
    assert np.all(np.isnan(slope[2]))
    assert np.all(np.isfinite(slope[3]))


@pytest.mark.slow
def test_heat_and_the_implicit_method():
    scene = rigid_stop(fading(), lump())
    expected = sb.simulate(scene, rtol=1e-11).stopping_time
    for solver in (None, sb.hybrid.Rodas5P()):
        run = sb.prepare(scene, ["stopping_time"], solver=solver, rtol=1e-8)
        assert run.program.one_function == (jax.default_backend() == "cpu")
        near(run().metrics["stopping_time"], expected, 1e-6)


def test_places_of_numbers_and_their_entries(run):
    """As paths are written everywhere: entries of lists too, and the nearest names of
    what is not there."""
    whole = run.places["brake.linings.angle"]
    assert run.places["brake.linings.angle[3]"] == slice(
        whole.start + 3, whole.start + 4
    )
    assert run.places["brake.linings.angle[-1]"] == slice(whole.stop - 1, whole.stop)
    for path, words in (
        ("former.name", "no such number"),
        ("initial.omeg", "nearest: initial.omega"),
        ("brake.linings.angle[99]", "has 20 entries"),
        (3, "no such number"),
    ):
        with pytest.raises(KeyError, match=words):
            run.places[path]
        with input_error(match=words):
            run({path: 1.0})


@pytest.mark.slow
def test_array_metrics_and_another_tolerance():
    def both(result):
        return jnp.stack([result.slip_onset_time, result.stopping_time])

    run = sb.prepare(stop_scene(end=20.0), [both, "full_slip_time"], rtol=1e-10)
    truth = closed_form()
    fine = run()
    coarse = run(rtol=1e-4)
    all_near(fine.metrics["both"], [truth["t0"], truth["stop"]], 1e-9)
    near(fine.metrics["full_slip_time"], truth["t1"], 1e-9)
    assert coarse.accepted < fine.accepted
    assert run.gradient().shape == (3, run.numbers.size)


class Kinds(sb.friction.AbstractFriction):
    """A law of one's own that picks the coefficient of every lining by its index."""

    values: jax.Array
    which: np.ndarray

    def kinetic(self, contact):
        return jnp.asarray(self.values)[jnp.asarray(self.which)]

    def static(self, contact):
        return self.kinetic(contact)

    def faults(self, path):
        return []


@pytest.mark.slow
def test_integers_of_a_custom_law_stay_whole():
    law = Kinds(jnp.asarray([0.2, 0.35]), np.ones(20, np.int32))
    scene = eqx.tree_at(lambda s: s.brake.linings.friction, stop_scene(), law)
    expected = pytest.approx(closed_form()["stop"], rel=1e-10)
    assert float(sb.simulate(scene).stopping_time) == expected
    assert sb.prepare(scene, ["stopping_time"])().metrics["stopping_time"] == expected
