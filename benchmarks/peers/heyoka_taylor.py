"""heyoka's Taylor series with terminal events: an adaptive integrator for each program
of the modes.

Events are roots of the Taylor polynomial of their guards. Tolerance and order are
compiled in; the numbers of a scene are parameters of the integrator, so that another
run needs no other program. It has no implicit method. The stop without heat is also run
by the loop that a user of heyoka writes for it, without the layer that all scenes
share.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.peers.written import written
from benchmarks.peers.written.form import Program, Words
from benchmarks.scenes import Answer, Case, Stop

NAME = "heyoka"
PACKAGES = ("heyoka",)
PIP = "'heyoka>=7.13'"
AGREES = 1e-9


def methods(case: Case) -> dict[str, str | None]:
    if case.stiff:
        return {
            "heyoka Taylor": "explicit on a stiff scene: stability asks for millions of steps"
        }
    return {
        "heyoka Taylor": None,
        **({"heyoka, plain loop": None} if case.name == "a" else {}),
    }


def _plain_loop(p: Stop, tolerance: float) -> Callable[[], Answer]:
    """Take-up, elastic, full slip: three integrators, one after the other."""
    import heyoka as hy

    w, phi, x = hy.make_vars("w", "phi", "x")
    full = p.T_0 * p.Pi

    def phase(rate: Any, guard: Any) -> Any:
        event = hy.t_event(guard, direction=hy.event_direction.negative)
        system = [(w, rate), (phi, w), (x, p.R * w)]
        return hy.taylor_adaptive(
            system, [p.w_0, 0.0, 0.0], t_events=[event], tol=tolerance, fast_math=True
        )

    take_up = phase(0.0 * w, p.T_0 - p.C * x)
    elastic = phase(p.R / p.J * (p.T_0 - p.C * x), full - p.C * x)
    slip = phase(-p.R / p.J * (full - p.T_0) + 0.0 * w, w)
    start = np.array([p.w_0, 0.0, 0.0])

    def run() -> Answer:
        state = start
        t = 0.0
        times = []
        steps = 0
        for integrator in (take_up, elastic, slip):
            integrator.time = t
            integrator.state[:] = state
            integrator.reset_cooldowns()
            steps += integrator.propagate_until(p.end)[3]
            state = integrator.state
            t = integrator.time
            times.append(t)
        # in full slip the band stays as long as it is
        return Answer(np.array(times), np.array([state[1], full / p.C]), -1, steps)

    return run


def _integrator(program: Program, numbers: int, tolerance: float) -> Any:
    import heyoka as hy

    y = [hy.make_vars(f"y_{i}") for i in range(program.states)]
    q = [hy.par[i] for i in range(numbers)]
    rates, guards = program.equations(Words(hy.exp, lambda x: x), hy.time, y, q)
    falling = hy.event_direction.negative
    return hy.taylor_adaptive(
        list(zip(y, rates, strict=True)),
        np.ones(program.states),
        pars=np.ones(numbers),
        t_events=[hy.t_event(guard, direction=falling) for guard in guards],
        tol=tolerance,
        fast_math=True,
    )


def prepare(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    import heyoka as hy

    if method == "heyoka, plain loop":
        return _plain_loop(case.plain, tolerance)
    automaton = automaton_of(case)
    modes = written(case)
    made = {}
    for mode in modes.values():
        if mode.program not in made:
            made[mode.program] = _integrator(
                mode.program, len(mode.numbers(0.0)), tolerance
            )
    # the arrays of an integrator are views of its memory: they are asked for once
    known = {}
    for name, mode in modes.items():
        ta = made[mode.program]
        known[name] = (
            ta,
            ta.state,
            ta.pars,
            ta.propagate_until,
            mode.numbers,
            mode.program.guards,
        )
    to_the_end = int(hy.taylor_outcome.time_limit)

    def run() -> Answer:
        steps = 0

        def segment(
            name: str, t: float, y: Any, stop: float
        ) -> tuple[float, Any, int | None]:
            nonlocal steps
            ta, state, pars, propagate_until, numbers, guards = known[name]
            state[:] = y
            pars[:] = numbers(t)
            ta.time = t
            if guards:
                ta.reset_cooldowns()
            found = propagate_until(stop)
            outcome = int(found[0])
            steps += found[3]
            if outcome == to_the_end:
                return stop, state, None
            # a terminal event that ends the integration is told as −1 − its index
            if not -guards <= outcome <= -1:
                raise RuntimeError(f"heyoka ends with {found[0]}")
            return ta.time, state, -1 - outcome

        times, end = drive(automaton, case, segment)
        return Answer(times, np.array(end), -1, steps)

    return run
