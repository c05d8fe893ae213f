"""Derivatives of every shipped scene against central differences: all its numbers at once, through all its events."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_scenarios import NAMES, load

import simbrake as sb
from simbrake._hybrid import LANDED
from simbrake._run._simulate import solver_of

RTOL = 1e-12
EVENTS = 24  # looked at in a scene with more of them
#: long duties are cut where the same kinds of events only come again (s)
END = {"tripping_30_stands": 10.0, "slip_onset_chain": 0.3, "thermal_stabilisation": 10.0, "drag_lowering": 2.0}
#: share by which all numbers move; less where many linings pass their marks in close order, which must stay the same
STEP = {"resolved_bandage": 5e-5, "slip_onset_chain": 1e-5}
#: tighter where an event is passed slowly: friction of a heated pair that recovers at rest lets go at last
TIGHT = {"everything_coupled": 1e-13}


def events_of(record, count, wanted, xp):
    """Times of the events wanted, by their place among the `count` of the run, and of its end, and the states there."""
    kinds = xp.asarray(record.rows.kind) == LANDED
    landed = np.flatnonzero(kinds)[:count] if xp is np else jnp.flatnonzero(kinds, size=count)
    rows = xp.append(landed + 1, xp.asarray(record.count, landed.dtype))
    at = rows[np.append(wanted, count)]
    return xp.asarray(record.rows.t)[at], xp.asarray(record.rows.y)[at]


def perturbed(scene, direction, share):
    moved = jax.tree.map(lambda p, d: p + share * d, scene, direction)
    return jax.tree.map(np.asarray, moved) if isinstance(share, float) else moved


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_events_and_states_of_a_scene(name):
    scene = load(name).scene()
    scene = dataclasses.replace(scene, end_time=min(float(scene.end_time), END.get(name, np.inf)))
    method, rtol = solver_of(scene), TIGHT.get(name, RTOL)
    rng = np.random.default_rng(5)

    def run(share):
        moved = perturbed(scene, direction, share)
        return sb.simulate(moved, rtol=rtol, solver=method)

    # every number moves by a random part of itself, but for those at the edge of their range
    direction = jax.tree.map(lambda p: np.asarray(p) * rng.uniform(-1, 1, np.shape(p)), scene)
    for leaf in sb.leaves(scene):
        if not all(np.all(leaf.about.admits(np.atleast_1d(np.multiply(leaf.value, f)))) for f in (0.99, 1.01)):
            direction = sb.with_values(direction, {leaf.path: np.zeros(np.shape(leaf.value))})
    base = run(0.0)
    count = int(np.sum(np.asarray(base.record.rows.kind)[: int(base.record.count)] == LANDED))
    wanted = np.unique(np.linspace(0, count - 1, min(count, EVENTS)).astype(int))
    steps = max(64, 1 << int(np.ceil(np.log2(1.25 * int(base.record.count)))))

    # as the runs that it is compared with: without LLVM's first level the last digits of slowly passed events differ
    @functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 1})
    def slope(direction):
        def answer(share):
            result = sb.simulate(perturbed(scene, direction, share), rtol=rtol, solver=method, max_steps=steps)
            return events_of(result.record, count, wanted, jnp)

        return jax.jvp(answer, (jnp.zeros(()),), (jnp.ones(()),))[1]

    t_slope, y_slope = (np.asarray(x) for x in slope(direction))

    def at(share):
        record = run(share).record
        assert int(np.sum(np.asarray(record.rows.kind)[: int(record.count)] == LANDED)) == count
        return events_of(record, count, wanted, np)

    def difference(h):
        ends = [at(h), at(-h)]
        return [(a - b) / (2 * h) for a, b in zip(*ends, strict=True)]

    h = STEP.get(name, 3e-4)
    coarse, fine = difference(2 * h), difference(h)
    t_difference, y_difference = ((4 * f - c) / 3 for f, c in zip(fine, coarse, strict=True))
    span = np.max(np.abs(t_slope))
    np.testing.assert_allclose(t_slope, t_difference, rtol=1e-7, atol=1e-7 * span)
    size = np.maximum(np.max(np.abs(y_slope), axis=0), 1e-300)
    np.testing.assert_allclose(y_slope / size, y_difference / size, rtol=0, atol=1e-7)


@pytest.mark.slow
def test_all_hundred_numbers_of_a_scene_in_one_reverse_pass():
    scene = load("staged_vs_standard").scene()
    table = sb.sensitivity("stopping_time", scene, span=None, rtol=RTOL)
    entries = [row for row in table.rows if not row.path.endswith("[:]")]
    assert len(entries) >= 100
    rng = np.random.default_rng(3)
    slope, direction = 0.0, {}
    for leaf in sb.leaves(scene):
        value = np.asarray(leaf.value, np.float64)
        if not all(np.all(leaf.about.admits(np.atleast_1d(value * f))) for f in (0.99, 1.01)):
            continue
        direction[leaf.path] = step = np.asarray(value * rng.uniform(-1, 1, value.shape))
        names = [leaf.path] if value.ndim == 0 else [f"{leaf.path}[{i}]" for i in range(value.size)]
        slope += sum(table.at(name).derivative * d for name, d in zip(names, step.ravel(), strict=True))

    def time(share):
        values = {leaf.path: np.asarray(leaf.value) for leaf in sb.leaves(scene)}
        moved = {path: values[path] + share * step for path, step in direction.items()}
        return float(sb.simulate(sb.with_values(scene, moved), rtol=RTOL).stopping_time)

    coarse, fine = ((time(h) - time(-h)) / (2 * h) for h in (6e-4, 3e-4))
    assert slope == pytest.approx((4 * fine - coarse) / 3, rel=1e-7)
