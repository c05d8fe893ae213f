"""What a smoothed scene is to diffrax, and the solve that is compiled of it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Smooth(NamedTuple):
    """Right-hand side on a vector, and what is read from the dense output.

    - `readings(t, y)` (events,): each rises through 0 at its event, once within its
      `window` (low, high)
    - `final(times, evaluate, y_end)`: the state that is compared; `corners`: times at
      which the equations have a corner
    """

    rhs: Callable[[Any, Any], Any]
    start: np.ndarray
    sizes: np.ndarray
    end: float
    readings: Callable[[Any, Any], Any]
    windows: tuple[np.ndarray, np.ndarray]
    final: Callable[[Any, Any, Any], Any]
    corners: np.ndarray | None = None


def compiled(smooth: Smooth, kind: str, room: int) -> Callable[[Any], Any]:
    """One program for all tolerances: times, final state, accepted steps, step
    attempts, whether it failed."""
    import diffrax
    import jax
    import jax.numpy as jnp

    low, high = (jnp.asarray(w) for w in smooth.windows)
    start = jnp.asarray(smooth.start)
    sizes = jnp.asarray(smooth.sizes)
    corners = None if smooth.corners is None else jnp.asarray(smooth.corners)

    @jax.jit
    def run(tolerance: Any) -> Any:
        controller: Any = diffrax.PIDController(rtol=tolerance, atol=tolerance * sizes)
        if corners is not None:
            controller = diffrax.ClipStepSizeController(controller, jump_ts=corners)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, _: smooth.rhs(t, y)),  # pyright: ignore
            getattr(diffrax, kind)(),
            0.0,
            smooth.end,
            None,
            start,
            saveat=diffrax.SaveAt(t1=True, dense=True),
            stepsize_controller=controller,
            max_steps=room,
            throw=False,
        )

        def crossing(i: Any, low: Any, high: Any) -> Any:
            def halve(_: int, ends: Any) -> Any:
                low, high = ends
                mid = 0.5 * (low + high)
                past = smooth.readings(mid, found.evaluate(mid))[i] > 0
                return jnp.where(past, low, mid), jnp.where(past, mid, high)

            return jax.lax.fori_loop(0, 52, halve, (low, high))[1]

        times = jax.vmap(crossing)(jnp.arange(len(low)), low, high)
        failed = jnp.where(found.result == diffrax.RESULTS.successful, 0, 1)
        counts = jnp.stack(
            [found.stats["num_accepted_steps"], found.stats["num_steps"], failed]
        )
        state = smooth.final(times, found.evaluate, found.ys[-1])
        return jnp.concatenate([times, state, counts.astype(jnp.float64)])

    return run
