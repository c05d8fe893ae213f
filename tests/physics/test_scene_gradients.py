"""Derivatives of shipped scenes: along all numbers at once against central differences,
and reverse = forward."""

import dataclasses

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near
from shipped import NAMES, load

import simbrake as sb
from simbrake.hybrid import LANDED, Code

#: all their parts are in another scene
REPEATED = {
    "calibrate_friction",
    "equal_wear_layout",
    "stopping_time_uncertainty",
    "thermal_stabilisation",
    "u2_5_5_stop",
}
RTOL = 1e-12
EVENTS = 24  # looked at in a scene with more of them
#: room for step attempts of scenes that take more than 1024
STEPS = {"slip_onset_chain": 4096}
#: long duties are cut where the same kinds of events only come again (s)
END = {"tripping_30_stands": 10.0, "slip_onset_chain": 0.3, "drag_lowering": 2.0}
#: share by which all numbers move; less where many linings pass their marks in close
#: order, which must stay the same
STEP = {"resolved_bandage": 5e-5, "slip_onset_chain": 1e-5}
#: scenes that `simulate` runs by the implicit method
STIFF = {"disc_stop", "drag_lowering", "staged_vs_standard", "tripping_30_stands"}
#: tighter where an event is passed slowly: friction of a heated pair that recovers at
#: rest lets go at last
TIGHT = {"everything_coupled": 1e-13}


def scene_and_direction(name, ends):
    """A scene, with its end if it is cut, and the direction in which its numbers
    move."""
    scene = load(name).scene()
    scene = dataclasses.replace(
        scene, end_time=min(float(scene.end_time), ends.get(name, np.inf))
    )
    rng = np.random.default_rng(5)
    # every number moves by a random part of itself, but for those at the edge of their
    # range
    direction = jax.tree.map(
        lambda p: np.asarray(p) * rng.uniform(-1, 1, np.shape(p)), scene
    )
    for leaf in sb.files.leaves(scene):
        chosen = leaf.path.endswith("].linings")  # (their numbers are whole)
        if chosen or not all(
            np.all(leaf.about.admits(np.atleast_1d(np.multiply(leaf.value, f))))
            for f in (0.99, 1.01)
        ):
            direction = sb.with_values(
                direction, {leaf.path: np.zeros(np.shape(leaf.value))}
            )
    return scene, direction


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(NAMES) - REPEATED))
def test_events_and_states_of_a_scene(name):
    scene, direction = scene_and_direction(name, END)
    solver = sb.hybrid.Rodas5P() if name in STIFF else diffrax.Dopri8()
    rtol = TIGHT.get(name, RTOL)

    # one program for runs and slope: compiling is most of the work, and another program
    # would round differently (the numbers of the scene are arguments, so that scenes of
    # one structure share it)
    @jax.jit
    def run(scene, direction, share):
        def starts(share):
            moved = jax.tree.map(lambda p, d: p + share * d, scene, direction)
            record = sb.simulate(
                moved, rtol=rtol, solver=solver, max_steps=STEPS.get(name)
            ).record
            return (record.rows.t, record.rows.y), (
                record.rows.kind,
                record.count,
                record.code,
            )

        return jax.jvp(starts, (share,), (jnp.ones(()),), has_aux=True)

    def at(share):
        """Times of the events looked at and of the end, the states there, and the
        slopes of both."""
        (t, y), (dt, dy), (kind, count, code) = jax.tree.map(
            np.asarray, run(scene, direction, np.float64(share))
        )
        # (a duty in phases that is cut does not end)
        assert code == Code.COMPLETED or name in END
        landed = np.flatnonzero(kind[:count] == LANDED)
        wanted = np.unique(
            np.linspace(0, len(landed) - 1, min(len(landed), EVENTS)).astype(int)
        )
        rows = np.append(landed[wanted] + 1, count)
        return len(landed), (t[rows], y[rows]), (dt[rows], dy[rows])

    landed, _, (t_slope, y_slope) = at(0.0)

    def difference(h):
        (after, more, _) = at(h)
        (before, less, _) = at(-h)
        assert after == before == landed
        return [(a - b) / (2 * h) for a, b in zip(more, less, strict=True)]

    h = STEP.get(name, 3e-4)
    coarse = difference(2 * h)
    fine = difference(h)
    t_difference, y_difference = (
        (4 * f - c) / 3 for f, c in zip(fine, coarse, strict=True)
    )
    span = np.max(np.abs(t_slope))
    all_near(t_slope, t_difference, 1e-7, 1e-7 * span)
    size = np.maximum(np.max(np.abs(y_slope), axis=0), 1e-300)
    all_near(y_slope / size, y_difference / size, 0, 1e-7)
