"""heyoka's Taylor series with terminal events: an adaptive integrator for each program of the modes.

Events are roots of the Taylor polynomial of their guards. Tolerance and order are compiled in; the numbers of a scene
are parameters of the integrator, so that another run needs no other program. It has no implicit method.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.peers.written import written
from benchmarks.peers.written.form import Program, Words
from benchmarks.scenes import Answer, Case

NAME, PACKAGES, PIP, AGREES = "heyoka", ("heyoka",), "'heyoka>=7.13'", 1e-9


def methods(case: Case) -> dict[str, str | None]:
    return {"heyoka Taylor": "explicit on a stiff scene: stability asks for millions of steps" if case.stiff else None}


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

    automaton, modes, made = automaton_of(case), written(case), {}
    for mode in modes.values():
        if mode.program not in made:
            made[mode.program] = _integrator(mode.program, len(mode.numbers(0.0)), tolerance)
    # the arrays of an integrator are views of its memory: they are asked for once
    known = {}
    for name, mode in modes.items():
        ta = made[mode.program]
        known[name] = ta, ta.state, ta.pars, ta.propagate_until, mode.numbers, mode.program.guards
    to_the_end = int(hy.taylor_outcome.time_limit)

    def run() -> Answer:
        steps = 0

        def segment(name: str, t: float, y: Any, stop: float) -> tuple[float, Any, int | None]:
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
