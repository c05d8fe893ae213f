"""Cases of the integrator by itself: event times, states, derivatives of small systems with exact solutions."""

import math
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from case_tools import FORM, Case, cases_of
from jaxtyping import Float, PyTree
from small_systems import (
    SLIP,
    BeltOscillator,
    BouncingBall,
    CoulombOscillator,
    Filippov,
    Number,
    Oscillator,
    Smooth,
    arrays,
    first_event_times,
)

from simbrake.hybrid import (
    Code,
    ExplicitRungeKutta,
    Record,
    Rodas5P,
    Settings,
    hybridsolve,
)

_LEINE = "Leine, van Campen, de Kraker, van den Steen 1998, Nonlinear Dynamics 16:41–54"


# --- cases ------------------------------------------------------------------------------------------------------------


def _solve(system: Smooth, y0: PyTree, mode: int, t1: float, *, stiff: bool = False, rtol: float = 1e-13) -> Record:
    settings = Settings(rtol=jnp.asarray(rtol), max_events=jnp.asarray(1000), max_steps=8192 if stiff else 256)
    method = Rodas5P() if stiff else ExplicitRungeKutta(diffrax.Dopri8())
    return hybridsolve(system, y0, jnp.asarray(mode), 0.0, t1, method, settings)


def _finished(program: Callable[[Any], tuple[Record, PyTree]], system: Smooth) -> Callable[[], PyTree]:
    """Compile a run to the numbers that `program(system)` returns after their record.

    It raises `RuntimeError` if the integration failed.
    """

    def run() -> PyTree:
        record, numbers = jax.jit(program)(arrays(system))
        if int(record.code) != Code.COMPLETED:
            raise RuntimeError(f"the integration ended with {Code(int(record.code)).name.lower()}")
        return numbers

    return run


def _solved(
    read: Callable[[Record], PyTree], system: Smooth, y0: PyTree, mode: int, t1: float, **options: Any
) -> Callable[[], PyTree]:
    """Compile a run to the numbers read from the record."""

    def program(system: Smooth) -> tuple[Record, PyTree]:
        record = _solve(system, y0, mode, t1, **options)
        return record, read(record)

    return _finished(program, system)


def _events_and(count: int, last: Callable[[PyTree], Number]) -> Callable[[Record], Float[jax.Array, " numbers"]]:
    """The times of the first events, and a number of the state at the end."""
    return lambda record: jnp.append(first_event_times(record, count), last(record.y_end))


def leine_cases() -> list[Case]:
    """Slip law F_s/(1 + 3|v|): a benchmark of stick–slip without smoothing."""

    def read(record: Record) -> Float[jax.Array, "3"]:
        t = first_event_times(record, 2)
        return jnp.append(t, record.at(t[:1], left=True)[0].x)

    # digits beyond the publication: DOP853 at rtol 2e-14 on the slip phase alone
    source = f"{_LEINE}; digits: slip phase alone, DOP853"
    rows = [
        ("slip lasts", source, 4.29599952548, "0"),
        ("x where slip ends", source, -0.54100635387, "2"),
        ("period", source, 12.00103129483, "1"),
    ]
    belt = BeltOscillator(decay=3.0)
    return cases_of("Leine oscillator", _solved(read, belt, belt.start, SLIP, 13.0), 1e-9, rows)


def coulomb_cases() -> list[Case]:
    """Free oscillator with dry friction: amplitude falls by 2F/k in every half period until it rests."""
    rows = [
        ("time of rest", f"{FORM}3π", 3 * math.pi, "2"),
        ("x at rest, 1000 s", f"{FORM}−(x_0 − 6F/k)", -(1 - 6 * 0.15), "3"),
    ]
    run = _solved(_events_and(3, lambda y: y.x), CoulombOscillator(F=0.15), Oscillator(1.0, 0.0), -1, 1000.0)
    return cases_of("Coulomb oscillator", run, 1e-12, rows)


def filippov_cases() -> list[Case]:
    """Sliding along the line where two fields meet (Filippov's convex combination)."""
    rows = [
        ("reaches the line", f"{FORM}0.5/(2 + 1.5)", 1 / 7, "0"),
        ("x(1)", f"{FORM}slides at −6/17", 31 / 34, "1"),
    ]
    run = _solved(_events_and(1, lambda y: y[0]), Filippov(), np.asarray([1.5, 1.0]), 1, 1.0)
    return cases_of("Filippov sliding", run, 1e-12, rows)


def ball_cases() -> list[Case]:
    """Bouncing ball of the FMI reference models: impacts, and rest where it leaves slower than 0.1 m/s."""
    g, e, h = 9.81, 0.7, 1.0
    first = math.sqrt(2 * h / g)

    def impact(k: int) -> float:
        return first + 2 * first * sum(e**i for i in range(1, k))

    source = "FMI reference model"
    rows = [(f"impact {k}", f"{source}; {FORM}√(2h/g)(1 + 2 Σ eⁱ)", impact(k), f"{k - 1}") for k in (1, 2, 6, 11)]
    rest = ("speed at rest", source, 0.0, "11", 0.0)
    run = _solved(_events_and(11, lambda y: y.v), BouncingBall(g, e, 0.1), Oscillator(h, 0.0), 0, 3.0)
    return cases_of("bouncing ball", run, 1e-12, [*rows, rest])


CASES = (
    leine_cases,
    coulomb_cases,
    filippov_cases,
    ball_cases,
)
