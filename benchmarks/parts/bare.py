"""The bare loop: fixed steps of a method on the equations of a scene, in one mode, and nothing else.

No error estimate, step-size control, events, record or results. The equations are simbrake's own, mode and numbers are
data, and the program is compiled like its runs: what it takes is what the integrator has to pay for its work.
"""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from simbrake import simulate
from simbrake._base._compiling import compiled, pack
from simbrake._physics._assemble import assemble
from simbrake.hybrid import AbstractMethod, ExplicitRungeKutta
from simbrake.hybrid._bordered import Couplings
from simbrake.hybrid._system import flatten

Step = Callable[..., tuple[Any, Any]]


class Stretch(NamedTuple):
    """The longest stay of a run in one mode: start, state, mode there, its length."""

    t: float
    y: np.ndarray
    mode: np.ndarray
    span: float


def longest(scene: Any, solver: Any, rtol: float) -> Stretch:
    """The longest stay in time, of those with at least half as many step attempts as any has."""
    record = simulate(scene, solver=solver, rtol=rtol).record
    rows, count = record.rows, int(record.count)
    t, modes = np.asarray(rows.t)[: count + 1], np.asarray(rows.mode)[: count + 1]
    changes = [0, *(np.flatnonzero(np.any(modes[1:] != modes[:-1], axis=1)) + 1), count]
    stays = list(itertools.pairwise(changes))
    most = max(b - a for a, b in stays)
    a, b = max(((a, b) for a, b in stays if 2 * (b - a) >= most), key=lambda stay: t[stay[1]] - t[stay[0]])
    return Stretch(float(t[a]), np.asarray(rows.y)[a], modes[a], float(t[b] - t[a]))


def written_out(solver: diffrax.AbstractERK) -> Step:
    """A step with its stages one after the other, from the method's tableau."""
    tableau: Any = solver.tableau

    def step(rhs: Callable[..., Any], t: Any, y: Any, f: Any, h: Any) -> tuple[Any, Any]:
        k, x = [f], y
        for row, c in zip(tableau.a_lower, tableau.c, strict=True):
            x = y + h * sum(float(a) * q for a, q in zip(row, k, strict=True) if a)
            k.append(rhs(t + float(c) * h, x))
        if tableau.fsal:
            return x, k[-1]
        y = y + h * sum(float(b) * q for b, q in zip(tableau.b_sol, k, strict=True) if b)
        return y, rhs(t + h, y)

    return step


def _of_method(method: AbstractMethod) -> Step:
    def step(rhs: Callable[..., Any], t: Any, y: Any, f: Any, h: Any) -> tuple[Any, Any]:
        y, _, f = method.step(rhs, t, y, f, h)
        return y, f

    return step


def steps_of(solver: Any) -> dict[str, Step]:
    """Ways of writing a method's step; the fastest loop is the unit."""
    if not isinstance(solver, diffrax.AbstractERK):
        return {"as simbrake": _of_method(solver)}
    return {"written out": written_out(solver), "in a loop": _of_method(ExplicitRungeKutta(solver, unrolled=False))}


def _fitted(method: Any, system: Any) -> Any:
    kinds = system.couplings()
    if kinds is None or not isinstance(method, AbstractMethod):
        return method
    return method.fitted(Couplings.of(np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(kinds)])))


def loop(way: str, solver: Any) -> Callable[..., Any]:
    """`(scene, t, h, n, y, mode) → y` after `n` steps `h` with one way of writing the step."""

    def run(scene: Any, t: Any, h: Any, n: Any, y: Any, mode: Any) -> Any:
        system, y_like, mode_like = assemble(scene)
        flat = flatten(system, y_like, mode_like)
        step = steps_of(_fitted(solver, system))[way]

        def body(carry: Any) -> Any:
            t, y, f = carry
            return (t + h, *step(lambda t, y: flat.rhs(t, y, mode), t, y, f, h))

        carry = (t, y, flat.rhs(t, y, mode))
        return jax.lax.fori_loop(0, n, lambda i, carry: body(carry), carry)[1]

    return run


def programs(scene: Any, solver: Any, steps: int, stretch: Stretch) -> dict[str, Callable[[], Any]]:
    """Calls of the compiled loop over a stretch in `steps` steps, for every way of writing the step."""
    given = (scene, stretch.t, stretch.span / steps, float(steps), stretch.y, np.asarray(stretch.mode, np.float64))
    numbers, like = pack(given)
    found = {}
    for way in steps_of(solver):
        run = loop(way, solver)

        def whole(numbers: Any, run: Any = run) -> Any:
            scene, t, h, n, y, mode = like.unpack(numbers)
            return run(scene, t, h, n.astype(jnp.int32), y, mode.astype(jnp.int32))

        call = compiled(whole, numbers).call
        if not np.all(np.isfinite(np.asarray(call(numbers)))):
            raise RuntimeError("the bare loop leaves the numbers: its steps are too long to be stable")
        found[way] = lambda call=call: np.asarray(call(numbers))
    return found
