"""Hard cases: numbers that are none, and too few bits (tested by
`test_bad_input.py`)."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from heat_scenes import fading, lump, rigid_stop
from oracles.hard_cases import C, Case, Named, run, scene
from shipped import NAMES, load

import simbrake as sb
from simbrake.files import leaves

BAD = (np.nan, np.inf, -np.inf)


def refused(given, path, value):
    """Whether `simulate` refuses the value with the path of that number, or of an entry
    of it, and nothing else."""
    try:
        sb.simulate(sb.with_values(given, {path: value}))
    except sb.InputError as error:
        return all(
            fault.path == path or fault.path.startswith(f"{path}[")
            for fault in error.faults
        )
    return False


def every_number():
    """Every number of every shipped scene set to NaN, ∞ and −∞, and a little beyond its
    bounds; in a list its last entry; each path and law once."""
    passed = []
    count = 0
    seen = set()
    for name in NAMES:
        given = load(name).scene()
        numbers = leaves(given)
        # none of them is out of sight of the check
        assert len(numbers) == len(jax.tree.leaves(given)), name
        for leaf in numbers:
            if (leaf.path, leaf.about) in seen:
                continue
            seen.add((leaf.path, leaf.about))
            bounds = ((leaf.about.low, -1e-9), (leaf.about.high, 1e-9))
            beyond = [x + d for x, d in bounds if x is not None]
            for bad in (*BAD, *beyond, 1e41, -1e41):
                spoiled = np.array(leaf.value, float)
                spoiled.reshape(-1)[-1:] = bad
                count += 1
                if not refused(given, leaf.path, spoiled):
                    passed.append(f"{name}: {leaf.path} = {bad}")
    return [Named(f"{count} inputs rejected with their path, except", passed, [])]


@jax.jit
@jax.vmap
def _code(given):
    return sb.simulate(given, max_steps=128).code


def _traced(given):
    """The codes of runs in which one number of the scene is NaN, ∞ or −∞, by one
    program under `jit(vmap)`."""
    arrays, tree = jax.tree.flatten(jax.tree.map(lambda x: np.asarray(x, float), given))
    rows = [given]
    for i, bad in itertools.product(range(len(arrays)), BAD):
        changed = [np.array(x) for x in arrays]
        changed[i].reshape(-1)[-1:] = bad
        rows.append(jax.tree.unflatten(tree, changed))
    codes = [int(code) for code in _code(jax.tree.map(lambda *x: jnp.stack(x), *rows))]
    assert codes[0] == 0
    return Named(
        f"{len(codes) - 1} runs",
        sorted({sb.results.FAILURES[code][0] for code in codes[1:]}),
        ["not_finite"],
    )


def traced_elastic():
    return [_traced(scene(stiffness=C, drag=1.0))]


def traced_others():
    rigid = _traced(scene(drag=1.0))
    heated = _traced(rigid_stop(fading(), lump(2e4, linings=1e4, cooling=50.0), 1.0))
    return [rigid, heated]


def _constant(t, level):
    return level + 0.0 * t


def own_profile():
    """Parameters of a user-defined profile may be anything; its value where a run
    begins is checked."""
    given = scene()
    found = []
    for bad in (np.nan, np.inf):
        lever = sb.profiles.FunctionProfile(_constant, jnp.asarray(bad), 1e4)
        try:
            found.append(
                run(eqx.tree_at(lambda s: s.duty.slack_tension, given, lever)).status
            )
        except sb.InputError as error:
            found += [fault.path for fault in error.faults]
    return [Named("NaN, ∞", found, ["duty.slack_tension", "duty.slack_tension"])]


def _fault(run):
    try:
        run()
    except sb.InputError as error:
        return error.faults[0].path
    return "accepted"


def single_precision():
    """A 32-bit number in a scene, concrete and traced, whatever the promotion of types
    allows."""
    given = eqx.tree_at(
        lambda s: s.brake.pulley.inertia, scene(), jnp.asarray(100.0, jnp.float32)
    )
    small = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), scene())
    with jax.numpy_dtype_promotion("standard"):
        faults = [
            _fault(lambda: sb.simulate(given)),
            _fault(lambda: sb.simulate(small)),
            _fault(
                lambda: jax.jit(lambda s: sb.simulate(s, max_steps=64).stopping_time)(
                    given
                )
            ),
        ]
    where = "brake.pulley.inertia"
    return [Named("rejected at", faults, [where, "brake.pulley.radius", where])]


CASES = [
    Case(
        "NaN, ±∞ and what is out of range in every number of every shipped scene",
        "one of them corrupts all the others",
        every_number,
    ),
    Case(
        "the same in traced numbers, elastic band",
        "values are unknown before the run",
        traced_elastic,
    ),
    Case(
        "the same, rigid band, and heat with fade", "as above", traced_others, slow=True
    ),
    Case(
        "NaN and ∞ in the parameters of a user-defined profile",
        "their meaning is undefined",
        own_profile,
    ),
    Case(
        "a float32 number in a scene",
        "it would pull others down to 7 digits, or fail deep inside",
        single_precision,
    ),
]
