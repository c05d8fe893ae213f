"""Small hybrid systems with exact solutions, and the integrator's validation by them: event times, states, derivatives.

Closed forms are in the docstrings, re-derived from `T` and energy balances; they test the integrator without
any brake.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias, TypeVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from .._base._compiling import DeviceJit
from ..hybrid import LANDED, AbstractHybridSystem, Code, ExplicitRungeKutta, Record, Rodas5P, Settings, hybridsolve
from ..hybrid._arrays import Array
from ._validation import FORM, Case, cases_of

_IVP = "Test Set for IVP Solvers (Mazzia, Magherini)"

Number: TypeAlias = Float[Array, ""]
Mode: TypeAlias = Int[Array, ""]
Guards: TypeAlias = Float[Array, " guard"]
Fired: TypeAlias = Bool[Array, " guard"]
S = TypeVar("S")

# --- systems ----------------------------------------------------------------------------------------------------------


class Oscillator(NamedTuple):
    x: Any
    v: Any


STICK, SLIP = 0, 1


class Smooth(AbstractHybridSystem):
    """An initial value problem without events, base of the others."""

    def guards(self, t: Number, y: PyTree, mode: Mode) -> Guards:
        return jnp.ones(1)

    def transition(self, t: Number, y: PyTree, mode: Mode, fired: Fired, at_stop: Array) -> tuple[Mode, int]:
        return mode, 0

    def reset(self, t: Number, y: PyTree, before: Mode, after: Mode) -> PyTree:
        return y

    def next_stop(self, mode: Mode, y: Any = None) -> float:
        return math.inf

    def scales(self) -> PyTree:
        return Oscillator(1.0, 1.0)


class BeltOscillator(Smooth):
    """Mass on a spring dragged by a belt: `m ẍ + k x = F`, sticks while `|k x| ≤ F_s`, slips with `F_k`.

    From `x = F_s/k`, `v = v_b` with `Δ = (F_s − F_k)/k`, `ω = √(k/m)`: slip lasts `(2/ω)(π − atan(Δω/v_b))`,
    stick `2Δ/v_b`. With `decay` > 0 the slip law is `F_s/(1 + decay |v_rel|)` (Leine et al. 1998).
    """

    m: Any = 1.0
    k: Any = 1.0
    F_s: Any = 1.0
    F_k: Any = 0.6
    v_b: Any = 0.2
    decay: Any = None

    @property
    def start(self) -> Oscillator:
        """State at the onset of slip."""
        return Oscillator(self.F_s / self.k, self.v_b)

    def force(self, v: Number) -> Number:
        if self.decay is None:
            return self.F_k
        return self.F_s / (1 + self.decay * (self.v_b - v))

    def rhs(self, t: Number, y: Oscillator, mode: Mode) -> Oscillator:
        slip = (self.force(y.v) - self.k * y.x) / self.m
        return Oscillator(y.v, jnp.where(mode == STICK, 0.0, slip))

    def guards(self, t: Number, y: Oscillator, mode: Mode) -> Guards:
        stick = 1 - self.k * y.x / self.F_s
        slip = (self.v_b - y.v) / self.v_b
        return jnp.where(mode == STICK, stick, slip)[None]

    def transition(self, t: Number, y: Oscillator, mode: Mode, fired: Fired, at_stop: Array) -> tuple[Mode, int]:
        return 1 - mode, 0

    def reset(self, t: Number, y: Oscillator, before: Mode, after: Mode) -> Oscillator:
        x = jnp.where(after == SLIP, self.F_s / self.k, y.x)
        return Oscillator(x, jnp.where(after == STICK, self.v_b, y.v))


class Robertson(Smooth):
    """Chemical kinetics, stiff over eleven decades of time: `ẏ_1 = −k_1 y_1 + k_3 y_2 y_3`, `ẏ_3 = k_2 y_2²`.

    Reference: Mazzia & Magherini, *Test Set for Initial Value Problem Solvers*, ROBER.
    """

    k_1: Any = 0.04
    k_2: Any = 3e7
    k_3: Any = 1e4

    def rhs(self, t: Number, y: Float[Array, "3"], mode: Mode) -> Float[Array, "3"]:
        slow, fast = self.k_1 * y[0] - self.k_3 * y[1] * y[2], self.k_2 * y[1] ** 2
        return jnp.stack([-slow, slow - fast, fast])

    def scales(self) -> Float[Array, "3"]:
        return jnp.asarray([1e-6, 1e-12, 1.0])


class VanDerPol(Smooth):
    """Relaxation oscillator in its scaled form, `ẏ_2 = ((1 − y_1²) y_2 − y_1)/ε`.

    Reference: Mazzia & Magherini, *Test Set for Initial Value Problem Solvers*, VDPOL.
    """

    eps: Any = 1e-6

    def rhs(self, t: Number, y: Float[Array, "2"], mode: Mode) -> Float[Array, "2"]:
        return jnp.stack([y[1], ((1 - y[0] ** 2) * y[1] - y[0]) / self.eps])

    def scales(self) -> float:
        return 1.0


def arrays(system: S) -> S:
    """The same system with every number as an array, so that a new value never re-traces."""
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float64) if isinstance(x, float) else x, system)


def first_event_times(record: Record, count: int) -> Float[Array, " count"]:
    """Times of the first `count` events that guards made after the start, traced."""
    i = jnp.flatnonzero(record.rows.kind == LANDED, size=count, fill_value=0)
    return record.rows.t[i + 1]


# --- cases ------------------------------------------------------------------------------------------------------------


def _solve(system: Smooth, y0: PyTree, mode: int, t1: float, *, stiff: bool = False, rtol: float = 1e-13) -> Record:
    settings = Settings(rtol=jnp.asarray(rtol), max_events=jnp.asarray(1000), max_steps=8192 if stiff else 256)
    method = Rodas5P() if stiff else ExplicitRungeKutta(diffrax.Dopri8())
    return hybridsolve(system, y0, jnp.asarray(mode), 0.0, t1, method, settings)


def _finished(name: str, program: Callable[[Any], tuple[Record, PyTree]], system: Smooth) -> Callable[[], PyTree]:
    """Compile a run to the numbers that `program(system)` returns after their record.

    - `name`: of the program on disk; nothing but the system's structure may change what it does

    It raises `RuntimeError` if the integration failed.
    """

    def run() -> PyTree:
        record, numbers = DeviceJit(program, subject=("validation", name), quick=True)(arrays(system))
        if int(record.code) != Code.COMPLETED:
            raise RuntimeError(f"the integration ended with {Code(int(record.code)).name.lower()}")
        return numbers

    return run


def _solved(
    name: str, read: Callable[[Record], PyTree], system: Smooth, y0: PyTree, mode: int, t1: float, **options: Any
) -> Callable[[], PyTree]:
    """Compile a run to the numbers read from the record."""

    def program(system: Smooth) -> tuple[Record, PyTree]:
        record = _solve(system, y0, mode, t1, **options)
        return record, read(record)

    return _finished(name, program, system)


def belt_cases() -> list[Case]:
    """Belt oscillator with F_s > F_k: times, extremes, derivatives of the period by every number."""
    belt, subject = BeltOscillator(), "belt oscillator"
    m, k, F_s, F_k, v_b = belt.m, belt.k, belt.F_s, belt.F_k, belt.v_b
    D, w = (F_s - F_k) / k, math.sqrt(k / m)
    slip, stick = 2 / w * (math.pi - math.atan(D * w / v_b)), 2 * D / v_b
    swing = math.hypot(D, v_b / w)
    top = math.atan2(v_b / w, D) / w  # after the start of slip

    def read(record: Record) -> Float[Array, "4"]:
        t = first_event_times(record, 2)
        x = record.at(jnp.asarray([top, top + math.pi / w]))[0].x
        return jnp.concatenate([jnp.stack([t[0], t[1] - t[0]]), x])

    def period(belt: BeltOscillator) -> tuple[Number, Record]:
        record = _solve(belt, belt.start, SLIP, 12.0)
        return first_event_times(record, 2)[1], record

    def slopes(belt: BeltOscillator) -> tuple[Record, BeltOscillator]:
        found, record = jax.grad(period, has_aux=True)(belt)
        return record, found

    # of T = (2/ω)(π − atan u) + 2Δ/v_b with u = Δω/v_b, ω = √(k/m), Δ = (F_s − F_k)/k
    u = D * w / v_b
    bend = 2 / (w * (1 + u * u))  # −∂T/∂u
    by_D, by_w = 2 / v_b - bend * w / v_b, -slip / w - bend * D / v_b
    truths = {
        "F_s": by_D / k,
        "F_k": -by_D / k,
        "v_b": -2 * D / v_b**2 + bend * u / v_b,
        "k": -by_D * D / k + by_w * w / (2 * k),
        "m": -by_w * w / (2 * m),
    }
    rows = [
        ("slip lasts", f"{FORM}(2/ω)(π − atan(Δω/v_b))", slip, "0"),
        ("stick lasts", f"{FORM}2Δ/v_b", stick, "1"),
        ("maximum x", f"{FORM}F_k/k + √(Δ² + v_b²/ω²)", F_k / k + swing, "2"),
        ("minimum x", f"{FORM}F_k/k − √(Δ² + v_b²/ω²)", F_k / k - swing, "3"),
    ]
    source = "closed form of the period, differentiated"
    by = [(f"∂(period)/∂{name}", source, truth, name) for name, truth in truths.items()]
    run = _solved(subject, read, belt, belt.start, SLIP, 12.0)
    slope = _finished(f"{subject}, slopes", slopes, belt)
    return cases_of(subject, run, 1e-11, rows) + cases_of(subject, slope, 1e-9, by)


def stiff_cases() -> list[Case]:
    """Stiff problems of the Test Set at its end times."""

    kinetics = [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050]
    relaxation = [0.1706167732170483e1, -0.8928097010247975]
    found = []
    for subject, end, system, y0, rtol, truths in (
        ("Robertson", "1e11", Robertson(), [1.0, 0.0, 0.0], 1e-8, kinetics),
        ("van der Pol", "2", VanDerPol(), [2.0, 0.0], 1e-9, relaxation),
    ):
        run = _solved(
            subject, lambda record: record.y_end, system, np.asarray(y0), 0, float(end), stiff=True, rtol=rtol
        )
        rows = [(f"y{i + 1}({end})", _IVP, truth, f"{i}") for i, truth in enumerate(truths)]
        found += cases_of(subject, run, 1e-6, rows)
    return found


CASES = (
    belt_cases,
    stiff_cases,
)
