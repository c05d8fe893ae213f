"""The cyclic steady state of a repeated duty: temperatures that one cycle gives back as it found them."""

from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from .._base._faults import Fault, InputError
from .._parts._friction import remembers
from .._parts._heat import Heat, initial_temperatures
from .._parts._network import Junction, Reservoir
from .._parts._scene import Scene, pairs_of
from ._result import Result
from ._simulate import simulate


class CyclicState(NamedTuple):
    """Scene that starts in the cyclic steady state, its run over one cycle, and what is left of the change (K)."""

    scene: Scene
    result: Result
    change: float
    cycles: int  # runs it took to find it


def with_temperatures(heat: Heat, T: Any) -> Heat:
    """The same network, starting at `T` (k,) in K: one temperature per node with capacity, in their order."""
    bodies, at = [], 0
    for body in heat.bodies:
        if isinstance(body, Reservoir | Junction):
            bodies.append(body)
            continue
        here = T[at : at + body.count]
        at += body.count
        here = np.reshape(here, ()) if body.count == 1 and isinstance(here, np.ndarray) else here
        bodies.append(eqx.tree_at(lambda b: b.temperature, body, here))
    return eqx.tree_at(lambda h: h.bodies, heat, tuple(bodies))


def cyclic_steady_state(
    scene: Scene, *, tolerance: float = 1e-7, cycles: int = 3, limit: int = 400, **options: Any
) -> CyclicState:
    """Finds the temperatures at which a cycle ends as it began, without running cycle after cycle until it does.

    - `scene`: exactly one cycle, which starts and ends in the same mechanical state (at rest and held, say)
    - `tolerance` (K): greatest change over a cycle that is left;  `cycles`: runs in a row before the search
    - `limit`: greatest number of runs;  `options`: as for `simulate`

    The root of `P(T) − T`, `P` being one cycle, by Newton's method on a Krylov space (scipy's `newton_krylov`): a cycle
    that changes the temperatures by 1 % of what is still missing takes hundreds of runs in a row, here some dozens.

    Raises `InputError` if the scene has no heat, or a friction law with states; `RuntimeError` if no state is found
    within `limit` runs.
    """
    from scipy.optimize import NoConvergence, newton_krylov  # imported where it is used: half a second of start-up

    if not scene.heated:
        raise InputError([Fault("heat", "is missing", "a cyclic steady state is one of temperatures")])
    if any(remembers(law) for law, *_ in pairs_of(scene)):
        raise InputError([Fault("brake", "has a friction law with states", "run the cycles one after the other")])
    heat, runs = scene.network, 0

    def starting(T: np.ndarray) -> Scene:
        return eqx.tree_at(lambda s: s.heat, scene, with_temperatures(heat, np.asarray(T, np.float64)))

    def change(T: np.ndarray) -> np.ndarray:
        nonlocal runs
        runs += 1
        if runs > limit:
            raise RuntimeError(f"no cyclic steady state within {limit} cycles: the friction may run away with the heat")
        return np.asarray(simulate(starting(T), **options).end_temperatures) - T

    T = initial_temperatures(heat)
    for _ in range(cycles):
        T = T + change(T)
    left = change(T)
    if np.max(np.abs(left)) > tolerance:
        try:
            T = newton_krylov(change, T, f_tol=0.5 * tolerance, method="lgmres", rdiff=1e-6, inner_maxiter=len(T) + 1)
        except NoConvergence as error:
            raise RuntimeError(
                "no cyclic steady state found: a cycle changes more than its tolerance allows"
            ) from error
        left = change(T)
    found = starting(T)
    return CyclicState(found, simulate(found, **options), float(np.max(np.abs(left))), runs)
