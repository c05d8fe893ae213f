"""PathSim: an `ODE` block per mode with zero-crossing events, mode by mode."""

import numpy as np

from benchmarks.equations import automaton_of, drive
from benchmarks.scenes import Answer, Case, Chain

NAME = "PathSim"
PACKAGES = ("pathsim",)
PIP = "pathsim"
AGREES = 1e-9


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    return {
        "PathSim RKDP54": stability if case.stiff else None,
        "PathSim RKDP87": stability if case.stiff else None,
        "PathSim ESDIRK54": None,
    }


class _Simulated:
    """One mode as a simulation that stops at its first event."""

    def __init__(self, mode, solver, tolerance: float, first: float, rounding: float):
        import pathsim
        from pathsim.blocks import ODE
        from pathsim.events import ZeroCrossingDown

        rhs = mode.rhs
        jacobian = mode.jacobian
        self.calls = 0
        self.fired = None
        self.first = first
        self.rounding = rounding

        def function(x, u, t):
            self.calls += 1
            return np.asarray(rhs(t, x))

        self.block = ODE(
            function, np.zeros(len(mode.scales)), lambda x, u, t: jacobian(t, x)
        )
        self.events = []
        for i, guard in enumerate(mode.guards):

            def value(t, value=guard.value):
                return float(value(t, self.block.engine.state))

            def act(t, i=i):
                self.fired = i
                self.simulation.stop()

            self.events.append(ZeroCrossingDown(func_evt=value, func_act=act))
        self.tolerance = tolerance
        self.simulation = pathsim.Simulation(
            [self.block],
            [],
            self.events,
            dt=first,
            Solver=solver,
            tolerance_fpi=max(0.01 * tolerance, 1e-13),
            tolerance_lte_rel=tolerance,
            tolerance_lte_abs=tolerance * mode.scales,
            log=False,
        )

    def run(self, t, y, stop):
        self.fired = None
        self.simulation.reset(time=t)
        self.block.engine.set(np.asarray(y, dtype=float))
        for event in self.events:
            event.buffer(t)
            # located to a share of the guard's value at the start of the mode
            event.tolerance = max(0.1 * self.tolerance, self.rounding) * abs(
                event.func_evt(t)
            )
        self.simulation.dt = self.first
        stats = self.simulation.run(stop - t)
        return self.simulation.time, self.block.engine.state.copy(), self.fired, stats


def prepare(case: Case, method: str, tolerance: float):
    from pathsim import solvers

    automaton = automaton_of(case)
    solver = getattr(solvers, method.removeprefix("PathSim "))
    first = min(automaton.fastest, 1e-3)
    # guards of the chain are differences of tensions: closer to 0 than this they are
    # rounding, and it searches on
    rounding = 1e-12 if isinstance(case.plain, Chain) else 1e-14
    moving = {
        name: mode for name, mode in automaton.modes.items() if mode.rhs is not None
    }
    simulated = {
        name: _Simulated(mode, solver, tolerance, first, rounding)
        for name, mode in moving.items()
    }

    def run() -> Answer:
        for one in simulated.values():
            one.calls = 0
        steps = 0

        def segment(name, t, y, stop):
            nonlocal steps
            t, y, fired, stats = simulated[name].run(t, y, stop)
            steps += stats["successful_steps"]
            return t, y, fired

        times, state = drive(automaton, case, segment)
        return Answer(
            times,
            np.asarray(state),
            sum(one.calls for one in simulated.values()),
            steps,
        )

    return run
