"""Validation of the integrator: stick and slip, impacts, sliding and stiff problems that have an exact answer."""

import functools
import math
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp

from .._base._compiling import DeviceJit
from ..hybrid import Code, ExplicitRungeKutta, Record, Rodas5P, Settings, hybridsolve
from ._reference_problems import (
    SLIP,
    BeltOscillator,
    BouncingBall,
    CoulombOscillator,
    Filippov,
    Oscillator,
    Robertson,
    VanDerPol,
    arrays,
    first_event_times,
)
from ._validation import Case

_LEINE = "Leine, van Campen, de Kraker, van den Steen 1998, Nonlinear Dynamics 16:41–54"
_IVP = "Test Set for IVP Solvers (Mazzia, Magherini)"


def _solve(system: Any, y0: Any, mode: int, t1: float, *, stiff: bool = False, rtol: float = 1e-13) -> Record:
    settings = Settings(rtol=jnp.asarray(rtol), max_events=jnp.asarray(1000), max_steps=8192 if stiff else 256)
    method = Rodas5P() if stiff else ExplicitRungeKutta(diffrax.Dopri8())
    return hybridsolve(system, y0, jnp.asarray(mode), 0.0, t1, method, settings)


def _once(function: Callable[[Any], Any], system: Any) -> Callable[[], Any]:
    """The numbers that `function(system)` finds, compiled and run when first asked for; it returns their record too.

    Raises `RuntimeError` if the integration failed.
    """

    def run() -> Any:
        record, numbers = DeviceJit(function)(arrays(system))
        if int(record.code) != Code.COMPLETED:
            raise RuntimeError(f"the integration ended with {Code(int(record.code)).name.lower()}")
        return numbers

    return functools.cache(run)


def _pick(run: Callable[[], Any], *index: Any) -> Callable[[], Any]:
    def value() -> Any:
        found = run()
        for i in index:
            found = getattr(found, i) if isinstance(i, str) else found[i]
        return found

    return value


def _belt_start(belt: Any) -> Oscillator:
    return Oscillator(belt.F_s / belt.k, belt.v_b)


def _slopes_of_period(belt: Any) -> Any:
    def period(belt: Any) -> Any:
        record = _solve(belt, _belt_start(belt), SLIP, 12.0)
        return first_event_times(record, 2)[1], record

    slopes, record = jax.grad(period, has_aux=True)(belt)
    return record, slopes


def belt_cases() -> list[Case]:
    """Belt oscillator with F_s > F_k: times, extremes, derivatives of the period by every number."""
    m, k, F_s, F_k, v_b = 1.0, 1.0, 1.0, 0.6, 0.2
    D, w = (F_s - F_k) / k, math.sqrt(k / m)
    slip, stick = 2 / w * (math.pi - math.atan(D * w / v_b)), 2 * D / v_b
    swing = math.hypot(D, v_b / w)
    top = math.atan2(v_b / w, D) / w  # after the start of slip

    def numbers(belt: Any) -> Any:
        record = _solve(belt, _belt_start(belt), SLIP, 12.0)
        t = first_event_times(record, 2)
        x = record.at(jnp.asarray([top, top + math.pi / w]))[0].x
        return record, jnp.concatenate([jnp.stack([t[0], t[1] - t[0]]), x])

    run = _once(numbers, BeltOscillator(m, k, F_s, F_k, v_b))
    form = "closed form: "
    cases = [
        Case("belt oscillator/slip lasts", f"{form}(2/ω)(π − atan(Δω/v_b))", slip, 1e-11, _pick(run, 0)),
        Case("belt oscillator/stick lasts", f"{form}2Δ/v_b", stick, 1e-11, _pick(run, 1)),
        Case("belt oscillator/greatest x", f"{form}F_k/k + √(Δ² + v_b²/ω²)", F_k / k + swing, 1e-11, _pick(run, 2)),
        Case("belt oscillator/least x", f"{form}F_k/k − √(Δ² + v_b²/ω²)", F_k / k - swing, 1e-11, _pick(run, 3)),
    ]
    # of T = (2/ω)(π − atan u) + 2Δ/v_b with u = Δω/v_b, ω = √(k/m), Δ = (F_s − F_k)/k
    u = D * w / v_b
    bend = 2 / (w * (1 + u * u))  # −∂T/∂u
    by_D, by_w = 2 / v_b - bend * w / v_b, -slip / w - bend * D / v_b
    slopes = {
        "F_s": by_D / k,
        "F_k": -by_D / k,
        "v_b": -2 * D / v_b**2 + bend * u / v_b,
        "k": -by_D * D / k + by_w * w / (2 * k),
        "m": -by_w * w / (2 * m),
    }
    slope = _once(_slopes_of_period, BeltOscillator(m, k, F_s, F_k, v_b))
    source = "closed form of the period, differentiated"
    for name, truth in slopes.items():
        cases.append(Case(f"belt oscillator/∂(period)/∂{name}", source, truth, 1e-9, _pick(slope, name)))
    return cases


def leine_cases() -> list[Case]:
    """Slip law F_s/(1 + 3|v|): a benchmark of stick–slip without smoothing."""

    def numbers(belt: Any) -> Any:
        record = _solve(belt, _belt_start(belt), SLIP, 13.0)
        t = first_event_times(record, 2)
        return record, jnp.append(t, record.at(t[:1], left=True)[0].x)

    run = _once(numbers, BeltOscillator(decay=3.0))
    # digits beyond the publication: DOP853 at rtol 2e-14 on the slip phase by itself
    source = f"{_LEINE}; digits: slip phase by itself, DOP853"
    return [
        Case("Leine oscillator/slip lasts", source, 4.29599952548, 1e-9, _pick(run, 0)),
        Case("Leine oscillator/x where slip ends", source, -0.54100635387, 1e-9, _pick(run, 2)),
        Case("Leine oscillator/period", source, 12.00103129483, 1e-9, _pick(run, 1)),
    ]


def coulomb_cases() -> list[Case]:
    """Free oscillator with dry friction: amplitude falls by 2F/k in every half period until it rests."""

    def numbers(system: Any) -> Any:
        record = _solve(system, Oscillator(1.0, 0.0), -1, 1000.0)
        return record, jnp.append(first_event_times(record, 3), record.y_end.x)

    run = _once(numbers, CoulombOscillator(F=0.15))
    return [
        Case("Coulomb oscillator/time of rest", "closed form: 3π", 3 * math.pi, 1e-12, _pick(run, 2)),
        Case(
            "Coulomb oscillator/x at rest, 1000 s", "closed form: −(x_0 − 6F/k)", -(1 - 6 * 0.15), 1e-12, _pick(run, 3)
        ),
    ]


def filippov_cases() -> list[Case]:
    """Sliding along the line where two fields meet (Filippov's convex combination)."""

    def numbers(system: Any) -> Any:
        record = _solve(system, jnp.asarray([1.5, 1.0]), 1, 1.0)
        return record, jnp.append(first_event_times(record, 1), record.y_end[0])

    run = _once(numbers, Filippov())
    return [
        Case("Filippov sliding/reaches the line", "closed form: 0.5/(2 + 1.5)", 1 / 7, 1e-12, _pick(run, 0)),
        Case("Filippov sliding/x(1)", "closed form: slides at −6/17", 31 / 34, 1e-12, _pick(run, 1)),
    ]


def ball_cases() -> list[Case]:
    """Bouncing ball of the FMI reference models: impacts, and rest where it leaves slower than 0.1 m/s."""
    g, e, h = 9.81, 0.7, 1.0
    first = math.sqrt(2 * h / g)
    impacts = [first + 2 * first * sum(e**i for i in range(1, k + 1)) for k in range(11)]

    def numbers(system: Any) -> Any:
        record = _solve(system, Oscillator(h, 0.0), 0, 3.0)
        return record, jnp.append(first_event_times(record, 11), record.y_end.v)

    run = _once(numbers, BouncingBall(g, e, 0.1))
    source = "FMI reference model; closed form: √(2h/g)(1 + 2 Σ eⁱ)"
    cases = [Case(f"bouncing ball/impact {k}", source, impacts[k - 1], 1e-12, _pick(run, k - 1)) for k in (1, 2, 6, 11)]
    return [*cases, Case("bouncing ball/speed at rest", "FMI reference model", 0.0, 0.0, _pick(run, 11))]


def stiff_cases() -> list[Case]:
    """Stiff problems of the Test Set at its end times."""

    def end(system: Any, y0: Any, t1: float, rtol: float) -> Any:
        record = _solve(system, jnp.asarray(y0), 0, t1, stiff=True, rtol=rtol)
        return record, record.y_end

    robertson = _once(functools.partial(end, y0=[1.0, 0.0, 0.0], t1=1e11, rtol=1e-8), Robertson())
    oscillator = _once(functools.partial(end, y0=[2.0, 0.0], t1=2.0, rtol=1e-9), VanDerPol())
    published = (0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050)
    cases = [
        Case(f"Robertson/y{i + 1}(1e11)", _IVP, truth, 1e-6, _pick(robertson, i)) for i, truth in enumerate(published)
    ]
    for i, truth in enumerate((0.1706167732170483e1, -0.8928097010247975)):
        cases.append(Case(f"van der Pol/y{i + 1}(2)", _IVP, truth, 1e-6, _pick(oscillator, i)))
    return cases


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return belt_cases() + leine_cases() + coulomb_cases() + filippov_cases() + ball_cases() + stiff_cases()
