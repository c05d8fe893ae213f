"""What the integrator asks of a hybrid system."""

import abc
import enum
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from ._arrays import Array


class Code(enum.IntEnum):
    """How an integration ended; systems add their own codes from `SYSTEM_CODES` upwards."""

    COMPLETED = 0
    STEP_LIMIT = 1
    EVENT_LIMIT = 2
    CHATTER = 3
    ZENO = 4
    NOT_FINITE = 5
    STEP_TOO_SMALL = 6


SYSTEM_CODES = 100


class AbstractHybridSystem(eqx.Module):
    """Ordinary differential equations `dy/dt = rhs(t, y, mode)` with modes, guards and jumps.

    - **State** `y`: any PyTree of floating arrays.
    - **Mode**: any PyTree of integer arrays, frozen between two events.
    - **Guards**: one vector of dimensionless numbers of order one, positive while the mode holds (`+1` where a guard
      does not matter). A guard that goes negative is an event; it is located to the accuracy of the integrator.
      At a restart a guard that is 0 within tolerance is unarmed: it fires only if it goes negative from there.
    - **Known times** (corners of given profiles) are no guards: `next_stop` names the next one and a step ends on it.

    Every number is an array leaf, so solutions can be differentiated with respect to all of them.
    """

    @abc.abstractmethod
    def rhs(self, t: Float[Array, ""], y: PyTree, mode: PyTree) -> PyTree:
        """`dy/dt`, of the structure of `y`. Must extend smoothly a little past the end of its mode."""

    @abc.abstractmethod
    def guards(self, t: Float[Array, ""], y: PyTree, mode: PyTree) -> Float[Array, " guard"]:
        """Guards, positive while `mode` holds."""

    @abc.abstractmethod
    def transition(
        self, t: Float[Array, ""], y: PyTree, mode: PyTree, fired: Bool[Array, " guard"], at_stop: Bool[Array, ""]
    ) -> tuple[PyTree, Int[Array, ""] | int]:
        """The mode after an event and 0, or a code ≥ `SYSTEM_CODES` that ends the run.

        `fired` marks every guard that reached 0 at this instant, `at_stop` that a known time was reached. The mode
        need not be final: one whose guards are negative at once gives another event at the same instant.
        """

    @abc.abstractmethod
    def reset(self, t: Float[Array, ""], y: PyTree, before: PyTree, after: PyTree) -> PyTree:
        """The state just after a change of mode from `before` to `after`; differentiable in `t` and `y`."""

    @abc.abstractmethod
    def next_stop(self, mode: PyTree) -> Float[Array, ""] | float:
        """The next known time in this mode, `inf` where there is none.

        Of several at one instant it is one, which `transition` passes alone: the others follow with steps of length 0.
        A minimum of all would share the derivative among them.
        """

    @abc.abstractmethod
    def scales(self) -> PyTree:
        """Typical size of every state, for the error norm; `inf` keeps a state (a ledger) out of the norm."""

    def couplings(self) -> PyTree | None:
        """How the states couple, for methods that solve with the Jacobian: integer NumPy arrays, one like each state.

        `CORE` couples with everything; a number ≥ 0 is a place in the chain, which couples with its two neighbours and
        with the core; on a `QUADRATURE` no rate depends. A place in the chain whose rate is linear in the states, with
        coefficients that are the same at every time and in every mode of a run, is given as `place + LINEAR`: its row
        of the Jacobian is formed once, before the first step. `None`: everything with everything.
        """
        return None


class Instant(NamedTuple):
    """What a semi-explicit system knows of itself at one instant, where an event happens."""

    t: Float[Array, ""]
    y: PyTree
    mode: PyTree
    z: PyTree  # variables
    y_rate: PyTree  # dy/dt
    z_rate: PyTree  # dz/dt along the motion


class AbstractSemiExplicitSystem(AbstractHybridSystem):
    """A hybrid system whose equations share algebra: `z = variables(t, y, mode)`, `dy/dt = rates(t, y, mode, z)`.

    Forces and the like are written once, in `variables`; rates, guards and changes of mode are read off them. `z` is a
    pure function of `(t, y, mode)` and of the system's numbers; it is not recorded, and derivatives through a run
    compute it again. What only the guards need is left out of the stages of a step, as nothing there depends on it.
    """

    @abc.abstractmethod
    def variables(self, t: Float[Array, ""], y: PyTree, mode: PyTree) -> PyTree:
        """`z`, everything algebraic at one instant: a PyTree of floating arrays."""

    @abc.abstractmethod
    def rates(self, t: Float[Array, ""], y: PyTree, mode: PyTree, z: PyTree) -> PyTree:
        """`dy/dt`, of the structure of `y`. Must extend smoothly a little past the end of its mode."""

    @abc.abstractmethod
    def margins(self, t: Float[Array, ""], y: PyTree, mode: PyTree, z: PyTree) -> Float[Array, " guard"]:
        """The guards (see `guards`), positive while `mode` holds."""

    @abc.abstractmethod
    def change(
        self, now: Instant, fired: Bool[Array, " guard"], at_stop: Bool[Array, ""]
    ) -> tuple[PyTree, Int[Array, ""] | int]:
        """The mode after an event, and a code (see `transition`). It may ask for `variables` in other modes."""

    def rhs(self, t, y, mode):
        return self.rates(t, y, mode, variables_of(self, t, y, mode))

    def guards(self, t, y, mode):
        return self.margins(t, y, mode, variables_of(self, t, y, mode))

    def instant(self, t: Float[Array, ""], y: PyTree, mode: PyTree) -> Instant:
        """Variables and rates at one instant: `variables` is linearised once for all of them."""
        z, push = jax.linearize(lambda t, y: variables_of(self, t, y, mode), t, y)
        y_rate = jax.tree.map(jnp.asarray, self.rates(t, y, mode, z))
        return Instant(t, y, mode, z, y_rate, push(jnp.ones_like(t), y_rate))

    def transition(self, t, y, mode, fired, at_stop):
        return self.change(self.instant(t, y, mode), fired, at_stop)


@eqx.filter_jit
def variables_of(system: AbstractSemiExplicitSystem, t: Any, y: PyTree, mode: PyTree) -> PyTree:
    """`system.variables`, traced once for all systems of one structure, however often a program asks for it."""
    return system.variables(t, y, mode)


class Settings(eqx.Module):
    """Numbers that steer an integration (traced, except for those that shape the program).

    - `rtol`: relative tolerance, absolute ones being `rtol` times the typical size of a state
    - `max_step`: longest step; `guard_samples` points inside each step are looked at for excursions of a guard
    - `max_events`, `max_chain` (events at one instant), `max_steps` (attempts): limits, each with its code
    """

    rtol: Any
    max_events: Any
    max_step: Any = np.inf
    max_chain: int = eqx.field(static=True, default=128)
    max_steps: int = eqx.field(static=True, default=1024)
    guard_samples: int = eqx.field(static=True, default=15)
