"""diffrax by itself: one solve of a smoothed brake, as is done where events are to be avoided.

Corners of the tension are rounded, full slip sets in with tanh, and the brake's torque carries `tanh(ω/ε ω_0)`, so that
the pulley creeps to rest. The times of events are read from the dense output, the stop at `ω = 0.01 ε ω_0`. The answer
tends to that of the smoothed brake: its distance from the brake itself is a floor that no tolerance passes.
"""

import functools
from typing import Any

import numpy as np

from benchmarks.scenes import CASES, Answer, Case, Stop

NAME, PACKAGES, PIP, AGREES = "diffrax", ("diffrax",), "diffrax", 0.1
_METHODS = {
    "diffrax Tsit5, tanh ε=1e-2": ("Tsit5", 1e-2),
    "diffrax Kvaerno5, tanh ε=1e-2": ("Kvaerno5", 1e-2),
    "diffrax Kvaerno5, tanh ε=1e-4": ("Kvaerno5", 1e-4),
}


def methods(case: Case) -> dict[str, str | None]:
    if not isinstance(case.plain, Stop):
        not_written = "a smoothed form of this scene is not written"
        return dict.fromkeys(_METHODS, not_written)
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {name: stability if case.stiff and m == "Tsit5" else None for name, (m, _) in _METHODS.items()}


def _equations(p: Stop, share: float):
    """Right-hand side on (ω, φ, T…), and what is read off: `C x − T_0`, `C x − T_0 Π`."""
    import jax
    import jax.numpy as jnp

    k = 0 if p.rates is None else len(p.rates)
    width = share * p.T_0
    rates = None if p.rates is None else jnp.asarray(p.rates)
    into = None if p.into is None else jnp.asarray(p.into)

    def grip(T: Any) -> tuple[Any, Any]:
        if not k:
            return p.T_0 * (p.Pi - 1), 0.0
        fz = p.f * p.z * (1 - p.fade * T[0])
        T_n = p.T_0 * ((1 + fz) / (1 - fz)) ** p.n
        return T_n - p.T_0, -2 * p.n * p.f * p.z * p.fade * T_n / (1 - fz * fz)

    def winding(phi: Any) -> Any:
        return p.C * (p.x_0 + p.R * phi) - p.T_0

    def held(phi: Any, g: Any) -> Any:
        """The band's tension above T_0: rounded at both its corners."""
        taken = width * jax.nn.softplus(winding(phi) / width)
        return g - width * jax.nn.softplus((g - taken) / width)

    def rhs(t: Any, y: Any, _: Any) -> Any:
        w, phi, T = y[0], y[1], y[2:]
        g, slope = grip(T)
        F = held(phi, g) * jnp.tanh(w / (share * p.w_0))
        change = jnp.zeros(0)
        if rates is not None and into is not None:
            cooling = rates @ T
            slides = 0.5 * (1 + jnp.tanh((winding(phi) - g) / width))
            v = slides * (p.R * w - slope * cooling[0] / p.C) / (1 + slope * into[0] * g / p.C)
            change = cooling + into * (F * v)
        return jnp.concatenate([jnp.stack([-p.R * F / p.J, w]), change])

    def readings(y: Any) -> Any:
        """Rise through 0 at onset, full slip and stop."""
        return jnp.stack([winding(y[1]), winding(y[1]) - grip(y[2:])[0], 0.01 * share * p.w_0 - y[0]])

    def elongation(y: Any) -> Any:
        return (p.T_0 + held(y[1], grip(y[2:])[0])) / p.C

    return rhs, readings, elongation, k


@functools.cache
def _compiled(name: str, method: str):
    import diffrax
    import jax
    import jax.numpy as jnp

    p: Stop = CASES[name].plain
    kind, share = _METHODS[method]
    rhs, readings, elongation, k = _equations(p, share)
    sizes = jnp.concatenate([jnp.array([20.0, 10.0]), jnp.full(k, 10.0)])
    start = jnp.concatenate([jnp.array([p.w_0, 0.0]), jnp.zeros(k)])

    @jax.jit
    def run(tolerance: Any) -> Any:
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rhs),  # pyright: ignore
            getattr(diffrax, kind)(),
            0.0,
            p.end,
            None,
            start,
            saveat=diffrax.SaveAt(t1=True, dense=True),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance * sizes),
            max_steps=16384,
            throw=False,
        )

        def crossing(i: int) -> Any:
            def halve(_: int, ends: Any) -> Any:
                low, high = ends
                mid = 0.5 * (low + high)
                past = readings(found.evaluate(mid))[i] > 0
                return jnp.where(past, low, mid), jnp.where(past, mid, high)

            return jax.lax.fori_loop(0, 52, halve, (jnp.asarray(0.0), jnp.asarray(p.end)))[1]

        y = found.ys[-1]
        times = jnp.stack([crossing(i) for i in range(1 if p.x_0 else 0, 3)])
        steps = jnp.stack([found.stats["num_accepted_steps"], found.stats["num_steps"], _failed(found)])
        state = jnp.concatenate([jnp.stack([y[1], elongation(found.evaluate(times[-1]))]), y[2:]])
        return jnp.concatenate([times, state, steps.astype(jnp.float64)])

    return run


def _failed(found: Any) -> Any:
    import diffrax
    import jax.numpy as jnp

    return jnp.where(found.result == diffrax.RESULTS.successful, 0, 1)


def prepare(case: Case, method: str, tolerance: float):
    compiled, rtol, events = _compiled(case.name, method), np.float64(tolerance), len(case.events)
    stages = {"Tsit5": 6, "Kvaerno5": 6}[_METHODS[method][0]]

    def run() -> Answer:
        out = np.asarray(compiled(rtol))
        accepted, attempts, failed = (int(n) for n in out[-3:])
        if failed:
            raise RuntimeError("no solution within 16384 steps")
        # explicit stages; of the implicit one, its stages without their iterations
        return Answer(out[:events], out[events:-3], stages * attempts, accepted)

    return run
