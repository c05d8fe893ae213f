"""A brake whose load hangs on an elastic rope: the hook moves by itself, and the rope pulls or is slack."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from .._base._corners import lesser
from ..hybrid import CORE
from ..hybrid._arrays import Array
from ..hybrid._system import Instant
from ..loads import AbstractLoad
from ..profiles import Piece
from ..rope import RopeElasticity
from ._brake import LOAD, BrakeSystem, piece_of
from ._mechanism import Mode
from ._state import BrakeNow, State


class HookState(NamedTuple):
    """Speed of the hook downwards (m/s), and the stretch of the rope at the hook beyond that under the weight (m).

    Beyond that under the weight, so that a hook that hangs still does so exactly, whatever the rounding.
    """

    speed: Any
    excess: Any


class RopeNow(NamedTuple):
    """The rope at one instant.

    - `force` (N) on the hook;  `taut_force` (N): what it would be of a taut rope
    - `stretch` (m; below 0 it is slack by that), and its `rate` (m/s)
    - `mass` (kg) on the hook, and its `weight` (N)
    """

    force: Array
    taut_force: Array
    stretch: Array
    rate: Array
    mass: Array
    weight: Array


class BrakeUnderRope(BrakeSystem):
    """A brake under a hook on an elastic rope (`RopeElasticity`).

        F = k e + c ė,   ė = v − ω r/n,   m v̇ = m g − F,   J ω̇ = F r/n − c_d ω − Σ M_shaft − M_b

    Taut and slack are modes, in the slack one `F = 0`; `J` is without the hook, which only the rope feels. A slack rope
    has no energy: what is left of its stretch as its pull ends is heat of the damping, less what comes back where it
    pulls again before that stretch has gone.

    - `stiffness` `k` (N/m), `damping` `c` (N·s/m);  `excess` `e_0 − m g/k` (m) and `weight` `m g` (N) at the start
    """

    stiffness: Float[Array, ""] = eqx.field(kw_only=True)
    damping: Float[Array, ""] = eqx.field(kw_only=True)
    excess: Float[Array, ""] = eqx.field(kw_only=True)
    weight: Float[Array, ""] = eqx.field(kw_only=True)

    def hung(self, y: State, mode: Mode) -> tuple[State, Mode]:
        """State and mode at the start with those of hook and rope."""
        y = y._replace(hook=HookState(y.omega * self._per_radian(mode), self.excess))
        return y, mode._replace(taut=(self.rope(y, mode).stretch > 0).astype(jnp.int32))

    def _per_radian(self, mode: Mode) -> Any:
        return self.load.on_layer(mode.layer).travel()

    def rope(self, y: State, mode: Mode) -> RopeNow:
        mass, weight = map(jnp.asarray, self.load.hanging(piece_of(mode, LOAD)))  # pyright: ignore
        rate = y.hook.speed - self._per_radian(mode) * y.omega
        force = weight + (self.stiffness * y.hook.excess + self.damping * rate)
        stretch = weight / self.stiffness + y.hook.excess
        return RopeNow(jnp.where(mode.taut == 1, force, 0.0), force, stretch, rate, mass, weight)

    def stretched(self, y: State, mode: Mode) -> Array:
        """Stretch of the rope since the start (m); exactly 0 of a hook that hangs still."""
        return y.hook.excess - self.excess + (self.rope(y, mode).weight - self.weight) / self.stiffness

    # --- differences from a rigid rope ------------------------------------------------------------------------------

    def inertia_at(self, mode: Mode) -> Array:
        return self.inertia

    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State | None = None) -> Array:
        """Torque of the load (N·m): with the pull of the rope in the state `y`, without a state that of the weight."""
        torque = super().load_torque(t, omega, mode)
        if y is None:
            return torque
        rope = self.rope(y, mode)
        return torque + (rope.force - rope.weight) * self._per_radian(mode)

    def variables(self, t: Array, y: State, mode: Mode) -> BrakeNow:
        return super().variables(t, y, mode)._replace(rope=self.rope(y, mode))

    def rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> State:
        found, rope, v = super().rates(t, y, mode, z), z.rope, y.hook.speed
        ledger, heat = found.ledger, jnp.where(mode.taut == 1, self.damping * rope.rate**2, 0.0)
        ledger = ledger._replace(
            load_work=ledger.load_work + rope.weight * v - rope.force * (v - rope.rate),
            damper_heat=heat if ledger.damper_heat is None else ledger.damper_heat + heat,
        )
        return found._replace(ledger=ledger, hook=HookState((rope.weight - rope.force) / rope.mass, rope.rate))

    def _margins_beside(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> dict[str, Array]:
        rope = z.rope
        longer = lesser(self.stiffness * rope.stretch, rope.taut_force)
        margin = jnp.where(mode.taut == 1, rope.taut_force, -longer) / rope.weight
        return {**super()._margins_beside(t, y, mode, z), "rope": margin}

    def change(self, now: Instant, fired: Bool[Array, " guard"], at_stop: Bool[Array, ""]) -> tuple[Mode, Array]:
        # (the guard of the rope is the last; what the brake does answers the pull after it)
        taut = now.mode.taut ^ fired[-1].astype(jnp.int32)
        return super().change(now._replace(mode=now.mode._replace(taut=taut)), fired, at_stop)

    def reset(self, t: Array, y: State, before: Mode, after: Mode) -> State:
        found, k, v = super().reset(t, y, before, after), self.stiffness, y.hook.speed
        old, new = self.rope(y, before), self.rope(y, after)
        pulls, still, e = _pulls(before), _pulls(after), old.stretch
        # a rope that pulls takes another weight on slowly; what hangs on the hook brings its energy
        excess = y.hook.excess - (1 - pulls) * (new.weight - old.weight) / k
        follows = new.weight / k + excess
        brought = 0.5 * (new.mass - old.mass) * v**2 + 0.5 * k * pulls * (follows**2 - e**2)
        left = 0.5 * k * (pulls - still) * follows**2
        ledger = found.ledger
        ledger = ledger._replace(load_work=ledger.load_work + brought, damper_heat=ledger.damper_heat + left)
        return found._replace(ledger=ledger, hook=HookState(v, excess))

    def stored(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        kinetic, elastic = super().stored(t, y, mode)
        rope = self.rope(y, mode)
        return (
            kinetic + 0.5 * rope.mass * y.hook.speed**2,
            elastic + 0.5 * self.stiffness * _pulls(mode) * rope.stretch**2,
        )

    @property
    def jumps(self) -> bool:
        return super().jumps or self.load.added_inertia(jnp.asarray(0, jnp.int32)) is not None

    # --- sizes --------------------------------------------------------------------------------------------------------

    def _like(self, phi: PyTree, omega: PyTree, own: PyTree, quadrature: PyTree, *others: PyTree) -> State:
        found = super()._like(phi, omega, own, quadrature, *others)
        damped = found.ledger._replace(damper_heat=quadrature)
        return found._replace(ledger=damped, hook=HookState(omega, omega))

    def scales(self) -> State:
        per_radian, sizes = jnp.asarray(self.load.travel()), self.sizes
        hook = HookState(sizes.speed * per_radian, sizes.torque / (self.stiffness * per_radian))
        return super().scales()._replace(hook=hook)

    def couplings(self) -> State | None:
        found, core = super().couplings(), np.asarray(CORE)
        return None if found is None else found._replace(hook=HookState(core, core))


def _pulls(mode: Mode) -> Array:
    """1 of a taut rope, 0 of a slack one."""
    return jnp.asarray(mode.taut, jnp.float64)


def under_rope(elastic: RopeElasticity, load: AbstractLoad, piece: Piece | None) -> Callable[..., BrakeUnderRope]:
    """The system of a load on an elastic rope, which hangs still at the start; `piece` of the load at the start."""
    _, weight = load.hanging(jnp.asarray(0, jnp.int32) if piece is None else piece)  # pyright: ignore
    k = elastic.at_hook(load.line_count)  # pyright: ignore
    weight, damping = jnp.asarray(weight), jnp.asarray(elastic.damping)
    excess = jnp.zeros(()) if elastic.stretch is None else jnp.asarray(elastic.stretch) - weight / k
    return functools.partial(BrakeUnderRope, stiffness=k, damping=damping, excess=excess, weight=weight)
