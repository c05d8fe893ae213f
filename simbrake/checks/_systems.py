"""Small hybrid systems with known solutions, of which the integrator's event times, states and derivatives are read."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from .._base._compiling import DeviceJit
from ..hybrid import LANDED, AbstractHybridSystem, Code, ExplicitRungeKutta, Record, Rodas5P, Settings, hybridsolve
from ..hybrid._arrays import Array
from ._validation import Case, cases_of

Number: TypeAlias = Float[Array, ""]
Mode: TypeAlias = Int[Array, ""]
Guards: TypeAlias = Float[Array, " guard"]
Fired: TypeAlias = Bool[Array, " guard"]

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
    stick `2Δ/v_b`.
    """

    m: Any = 1.0
    k: Any = 1.0
    F_s: Any = 1.0
    F_k: Any = 0.6
    v_b: Any = 0.2

    @property
    def start(self) -> Oscillator:
        """State at the onset of slip."""
        return Oscillator(self.F_s / self.k, self.v_b)

    def rhs(self, t: Number, y: Oscillator, mode: Mode) -> Oscillator:
        slip = (self.F_k - self.k * y.x) / self.m
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


def first_event_times(record: Record, count: int) -> Float[Array, " count"]:
    """Times of the first `count` events that guards made after the start, traced."""
    i = jnp.flatnonzero(record.rows.kind == LANDED, size=count, fill_value=0)
    return record.rows.t[i + 1]


# --- cases ------------------------------------------------------------------------------------------------------------


def _solve(system: Smooth, y0: PyTree, mode: int, t1: float, *, stiff: bool = False, rtol: float = 1e-13) -> Record:
    settings = Settings(rtol=jnp.asarray(rtol), max_events=jnp.asarray(1000), max_steps=8192 if stiff else 256)
    method = Rodas5P() if stiff else ExplicitRungeKutta(diffrax.Dopri8())
    return hybridsolve(system, y0, jnp.asarray(mode), 0.0, t1, method, settings)


def _run(name: str, program: Callable[[Any], tuple[Record, PyTree]], system: Smooth) -> Callable[[], PyTree]:
    """A run to the numbers that `program(system)` returns after their record, compiled as `name`.

    Every number of the system is an array, so that nothing but its structure may change the program. It raises
    `RuntimeError` if the integration failed.
    """

    def run() -> PyTree:
        traced = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64) if isinstance(x, float) else x, system)
        record, numbers = DeviceJit(program, subject=("validation", name), quick=True)(traced)
        if int(record.code) != Code.COMPLETED:
            raise RuntimeError(f"the integration ended with {Code(int(record.code)).name.lower()}")
        return numbers

    return run


def belt_cases() -> list[Case]:
    """Belt oscillator with F_s > F_k: times, extremes, derivatives of the period by every number."""
    belt, subject = BeltOscillator(), "belt oscillator"
    D, w = (belt.F_s - belt.F_k) / belt.k, math.sqrt(belt.k / belt.m)
    top = math.atan2(belt.v_b / w, D) / w  # after the start of slip

    def course(system: BeltOscillator) -> tuple[Record, Float[Array, "4"]]:
        record = _solve(system, belt.start, SLIP, 12.0)
        t = first_event_times(record, 2)
        x = record.at(jnp.asarray([top, top + math.pi / w]))[0].x
        return record, jnp.concatenate([jnp.stack([t[0], t[1] - t[0]]), x])

    def period(system: BeltOscillator) -> tuple[Number, Record]:
        record = _solve(system, system.start, SLIP, 12.0)
        return first_event_times(record, 2)[1], record

    def slopes(system: BeltOscillator) -> tuple[Record, BeltOscillator]:
        gradient, record = jax.grad(period, has_aux=True)(system)
        return record, gradient

    reads = {what: f"{i}" for i, what in enumerate(("slip lasts", "stick lasts", "maximum x", "minimum x"))}
    by = {f"∂(period)/∂{name}": name for name in ("F_s", "F_k", "v_b", "k", "m")}
    return cases_of(subject, _run(subject, course, belt), reads) + cases_of(
        subject, _run(f"{subject}, slopes", slopes, belt), by
    )


def stiff_cases() -> list[Case]:
    """Stiff problems of the Test Set at its end times."""

    def solved(subject: str, system: Smooth, y0: list[float], end: str, rtol: float) -> list[Case]:
        def program(system: Smooth) -> tuple[Record, PyTree]:
            record = _solve(system, np.asarray(y0), 0, float(end), stiff=True, rtol=rtol)
            return record, record.y_end

        return cases_of(subject, _run(subject, program, system), {f"y{i + 1}({end})": f"{i}" for i in range(len(y0))})

    return solved("Robertson", Robertson(), [1.0, 0.0, 0.0], "1e11", 1e-8) + solved(
        "van der Pol", VanDerPol(), [2.0, 0.0], "2", 1e-9
    )
