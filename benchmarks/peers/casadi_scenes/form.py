"""What a scene is to CasADi's integrators, and how one is made of it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Form(NamedTuple):
    """Expressions of a scene in natural units; states include the mode and the times of
    events, which stay constant.

    An event is where an entry of `zero` falls below 0; `after` is the state then.
    `controls` (one column per interval of `grid`) are the values of `u`: integration
    starts anew where they change. `read` takes the states at `grid[1:]`, one column
    each, and gives times of the events and the final state.
    """

    t: Any
    X: Any
    u: Any
    rhs: Any
    zero: Any
    index: Any
    after: Any
    start: np.ndarray
    sizes: np.ndarray
    grid: tuple[float, ...]
    controls: np.ndarray
    read: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def choose(mode: Any, cases: list[Any]) -> Any:
    """The entry of `cases` that the mode (a state) says."""
    import casadi as ca

    found = cases[-1]
    for i in range(len(cases) - 2, -1, -1):
        found = ca.if_else(mode < i + 0.5, cases[i], found)
    return found


def sequence(
    X: Any,
    mode: Any,
    rhs: Any,
    guards: list[Any],
    start: np.ndarray,
    sizes: np.ndarray,
    end: float,
    read: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]],
    first: int = 0,
    t: Any = None,
) -> Form:
    """A scene whose modes follow each other: the i-th guard ends the i-th mode. `read`
    takes times and final states.

    One indicator per event, negative for good once it has fired, as CVODES wants it.
    """
    import casadi as ca

    n = len(guards)
    # pyright: ignore
    times = ca.SX.sym("times", n)
    index = ca.SX.sym("index")
    t = ca.SX.sym("t") if t is None else t  # pyright: ignore
    zero = [
        ca.if_else(mode < i - 0.5, 1.0, ca.if_else(mode < i + 0.5, g, -1.0))
        for i, g in enumerate(guards)
    ]
    noted = [ca.if_else(ca.fabs(mode - i) < 0.5, t, times[i]) for i in range(n)]
    k = len(start)

    def answer(found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if round(found[k, -1]) != n:
            raise RuntimeError(
                f"ended in its mode {found[k, -1]:.0f}: an event was missed"
            )
        return read(found[k + 1 :, -1], found[:k, -1])

    return Form(
        t,
        ca.vertcat(X, mode, times),
        ca.SX.sym("u", 0),  # pyright: ignore
        ca.vertcat(rhs, ca.SX.zeros(1 + n)),  # pyright: ignore
        ca.vertcat(*zero),
        index,
        ca.vertcat(X, mode + 1, *noted),
        np.concatenate([start, [first], np.zeros(n)]),
        np.concatenate([sizes, np.ones(1 + n)]),
        (0.0, end),
        np.zeros((0, 1)),
        answer,
    )


Call = Callable[[], tuple[np.ndarray, np.ndarray]]


def integrator(
    form: Form, plugin: str, tolerance: float, options: dict[str, Any]
) -> tuple[Call, Any]:
    """The scene's call, which gives times and final state, and the integrator.

    States are in units of their typical sizes, as CasADi has one absolute tolerance for
    all.
    """
    import casadi as ca

    Y = ca.SX.sym("Y", form.X.numel())  # pyright: ignore
    rhs, zero, after = (
        ca.substitute(e, form.X, Y * form.sizes)
        for e in (form.rhs, form.zero, form.after)
    )
    none = [ca.SX.sym(name, 0) for name in "zp"]  # pyright: ignore
    transition = ca.Function(
        "transition",
        [form.index, form.t, Y, *none, form.u],
        [after / form.sizes, none[0]],
        ca.event_in(),
        ca.event_out(),
    )
    dae = {"t": form.t, "x": Y, "u": form.u, "ode": rhs / form.sizes, "zero": zero}
    options = options | {
        "transition": transition,
        "reltol": tolerance,
        "abstol": tolerance,
    }
    found = ca.integrator(
        "integrator", plugin, dae, form.grid[0], list(form.grid[1:]), options
    )
    start = form.start / form.sizes
    more = {"u": form.controls} if form.controls.size else {}

    def call() -> tuple[np.ndarray, np.ndarray]:
        return form.read(
            np.asarray(found(x0=start, **more)["xf"]) * form.sizes[:, None]
        )

    return call, found
