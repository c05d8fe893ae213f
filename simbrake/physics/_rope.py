"""The rope: its layers on the drum, and a hook on an elastic rope."""

from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._corners import lesser
from ..hoists import AbstractLoad
from ..hybrid import CORE
from ..hybrid.arrays import Array, ScalarArray, TwoArrays
from ..profiles import Piece
from ..rope import RopeElasticity
from ._brake import (
    BrakeAtInstant,
    BrakeGuards,
    BrakeNow,
    BrakeSystem,
    Feature,
    State,
    load_piece,
)
from .mechanism import BrakeCode, Ledger, Mode


class Layers(Feature):
    """The layers of the rope on the drum (`RopeLayers`), of which one pays out:
    `Mode.layer`."""

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        paid_out, full = now.brake.load.layers.margins(now.y.phi, now.mode.layer)  # pyright: ignore
        return guards._replace(layer_paid_out=paid_out, layer_full=full)

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        return limits._replace(layer_paid_out=np.True_, layer_full=np.True_)

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        code = jnp.where(
            fired.layer_paid_out & (now.mode.layer == 1), int(BrakeCode.ROPE_END), code
        )
        step = fired.layer_full.astype(jnp.int32) - fired.layer_paid_out.astype(
            jnp.int32
        )
        return new._replace(
            layer=jnp.maximum(now.mode.layer + step, 1).astype(jnp.int32)
        ), code

    def speed_after(self, now: BrakeAtInstant, after: Mode, omega: Array) -> Array:
        """Speed of the pulley on another layer, with the kinetic energy that was there
        before.

        Bodies that stick to the pulley follow it.
        """
        _, _, y, before, _ = now
        whole, others, there = _kinetic(now, after)
        whole = whole - others
        speed = y.omega * jnp.sqrt(
            jnp.where(
                whole > 0, (there - others) / jnp.where(whole > 0, whole, 1.0), 1.0
            )
        )
        return jnp.where(after.layer == before.layer, omega, speed)


def _kinetic(now: BrakeAtInstant, after: Mode) -> tuple[Array, Array, Array]:
    """Kinetic energy (J) after a change of mode at the speed before it, the same with a
    pulley at rest, and what was there before.

    Bodies that stick to the pulley follow it.
    """
    brake, _, y, before, _ = now
    # (the band and the linings answer the event by themselves)
    loaded = before._replace(layer=after.layer, grounded=after.grounded)
    new = brake.inertia_at(loaded, y)

    def kinetic(omega: Array) -> Array:
        speed, own = brake.mechanism.with_stuck_speeds(omega, y.own, before, after)
        return brake.stored_at(new, speed, own, after)[0]

    there = brake.stored_at(brake.inertia_at(before, y), y.omega, y.own, before)[0]
    return kinetic(y.omega), kinetic(0.0 * y.omega), there


# --- ropes with a weight ------------------------------------------------------------


class HangingRopes(Feature):
    """Ropes or a chain with a weight (`AbstractLoad.ropes`): their work in the ledger,
    the end of the rope, a slack side, and a load that comes to stand on the ground."""

    def book(self, brake: BrakeSystem, ledger: Ledger, of_each: Any) -> Ledger:
        ropes = brake.load.ropes(jnp.zeros(()), 0)
        return ledger._replace(
            ropes=None if ropes is None else of_each,
            pick_up=of_each if self.jumps(brake) else None,
        )

    def jumps(self, brake: BrakeSystem) -> bool:
        return brake.load.above_ground(jnp.zeros(())) is not None

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        above = now.brake.load.above_ground(jnp.zeros(()))
        if above is None:
            return now.y, now.mode
        return now.y, now.mode._replace(grounded=(above <= 0).astype(jnp.int32))

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        ropes = now.brake.ropes_at(now.mode, now.y)
        if ropes is None:
            return rates
        omega = now.y.omega
        ledger = rates.ledger
        ledger = ledger._replace(
            load_work=ledger.load_work - ropes.torque_in_motion(omega) * omega,
            ropes=ropes.torque * omega,
        )
        if ledger.pick_up is not None or self.jumps(now.brake):
            ledger = ledger._replace(pick_up=ropes.loss * jnp.abs(omega) ** 3)
        return rates._replace(ledger=ledger)

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        load = now.brake.load
        travelled: Any = load.travelled(now.y.phi)
        span: Any = load.rope_span()
        if span is not None:
            low, high = span
            left = lesser(jnp.asarray(travelled - low), jnp.asarray(high - travelled))
            guards = guards._replace(rope_end=left / (high - low))
        above = load.above_ground(travelled)
        if above is not None:
            height = above / jnp.asarray(load.travel())
            grounded = now.mode.grounded == 1
            guards = guards._replace(ground=jnp.where(grounded, -height, height))
        slack = load.slack_margin(travelled, now.z.contact.alpha)
        return guards._replace(slack_rope=slack)

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        held = {
            name: np.True_
            for name in ("rope_end", "slack_rope", "ground")
            if getattr(limits, name) is not None
        }
        return limits._replace(**held)

    # --- changes of mode -------------------------------------------------------------

    def at_once(self, mode: Mode, fired: BrakeGuards) -> Mode:
        # (what the brake does answers the load after the event)
        if mode.grounded is None:
            return mode
        return mode._replace(grounded=mode.grounded ^ fired.ground.astype(jnp.int32))

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        if fired.rope_end is not None:
            code = jnp.where(fired.rope_end, int(BrakeCode.ROPE_END), code)
        if fired.slack_rope is not None:
            code = jnp.where(fired.slack_rope, int(BrakeCode.SLACK_ROPE), code)
        return new, code

    def speed_after(self, now: BrakeAtInstant, after: Mode, omega: Array) -> Array:
        """Speed of the pulley that has lifted an anchor from the ground, with the
        momentum that was there before."""
        if after.grounded is None:
            return omega
        whole, others, there = _kinetic(now, after)
        heavier = (after.grounded < now.mode.grounded) & (whole > others)
        share = (there - others) / jnp.where(heavier, whole - others, 1.0)
        return jnp.where(heavier, omega * share, omega)

    def reset(self, now: BrakeAtInstant, after: Mode, new: State) -> State:
        if after.grounded is None:
            return new
        brake, _, y, before, _ = now
        there = brake.stored_at(brake.inertia_at(before, y), y.omega, y.own, before)[0]
        left = brake.inertia_at(after, y)
        left = brake.stored_at(left, new.omega, new.own, after)[0]
        ledger = new.ledger
        lost = jnp.where(after.grounded == before.grounded, 0.0, there - left)
        ledger = ledger._replace(pick_up=ledger.pick_up + lost)
        return new._replace(ledger=ledger)


# --- an elastic rope ----------------------------------------------------------------


class HookState(NamedTuple):
    """Speed of the hook downwards (m/s), and the stretch of the rope at the hook beyond
    that under the weight (m).

    Beyond that under the weight, so that a hook that hangs still does so exactly,
    whatever the rounding.
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


class ElasticRope(Feature):
    """A hook on an elastic rope (`RopeElasticity`).

        F = k e + c ė,   ė = v − ω r/n,   m v̇ = m g − F,   J ω̇ = F r/n − c_d ω − Σ
        M_shaft − M_b

    Taut and slack are modes, in the slack one `F = 0`; `J` is without the hook, which
    only the rope feels. A slack rope has no energy: what is left of its stretch as its
    pull ends is heat of the damping, less what comes back where it pulls again before
    that stretch has gone.

    - `stiffness` `k` (N/m), `damping` `c` (N·s/m)
    - `excess` `e_0 − m g/k` (m) and `weight` `m g` (N) at the start
    """

    stiffness: ScalarArray
    damping: ScalarArray
    excess: ScalarArray
    weight: ScalarArray
    frees_hook: ClassVar[bool] = True

    @classmethod
    def of(
        cls, elastic: RopeElasticity, load: AbstractLoad, piece: Piece | None
    ) -> "ElasticRope":
        """The rope of a load that hangs still at the start; `piece` of the load at the
        start."""
        _, weight = load.hanging(jnp.asarray(0, jnp.int32) if piece is None else piece)  # pyright: ignore
        k = elastic.at_hook(load.line_count)  # pyright: ignore
        weight = jnp.asarray(weight)
        excess = (
            jnp.zeros(())
            if elastic.stretch is None
            else jnp.asarray(elastic.stretch) - weight / k
        )
        return cls(k, jnp.asarray(elastic.damping), excess, weight)

    def book(self, brake: BrakeSystem, ledger: Ledger, of_each: Any) -> Ledger:
        return ledger._replace(damper_heat=of_each)

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        brake, _, y, mode, _ = now
        y = y._replace(hook=HookState(y.omega * _per_radian(brake, mode), self.excess))
        return y, mode._replace(
            taut=(self.at(brake, y, mode).stretch > 0).astype(jnp.int32)
        )

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        per_radian = jnp.asarray(brake.load.travel())
        size = brake.sizes
        hook = HookState(
            size.speed * per_radian, size.torque / (self.stiffness * per_radian)
        )
        return sizes._replace(hook=hook)

    def places(self, brake: BrakeSystem, places: State) -> State:
        return places._replace(hook=HookState(np.asarray(CORE), np.asarray(CORE)))

    def jumps(self, brake: BrakeSystem) -> bool:
        return brake.load.added_inertia(jnp.asarray(0, jnp.int32)) is not None

    # --- at one instant --------------------------------------------------------------

    def at(self, brake: BrakeSystem, y: State, mode: Mode) -> RopeNow:
        """The rope at one instant."""
        mass, weight = map(jnp.asarray, brake.load.hanging(load_piece(mode)))  # pyright: ignore
        rate = y.hook.speed - _per_radian(brake, mode) * y.omega
        force = weight + (self.stiffness * y.hook.excess + self.damping * rate)
        stretch = weight / self.stiffness + y.hook.excess
        return RopeNow(
            jnp.where(mode.taut == 1, force, 0.0), force, stretch, rate, mass, weight
        )

    def stretched(self, brake: BrakeSystem, y: State, mode: Mode) -> Array:
        """Stretch of the rope since the start (m); exactly 0 of a hook that hangs
        still."""
        return (
            y.hook.excess
            - self.excess
            + (self.at(brake, y, mode).weight - self.weight) / self.stiffness
        )

    def load_torque(self, now: BrakeAtInstant, torque: Array) -> Array:
        rope = self.at(now.brake, now.y, now.mode)
        return torque + (rope.force - rope.weight) * _per_radian(now.brake, now.mode)

    def variables(self, now: BrakeAtInstant) -> BrakeNow:
        return now.z._replace(rope=self.at(now.brake, now.y, now.mode))

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        rope = now.z.rope
        v = now.y.hook.speed
        ledger = rates.ledger
        heat = jnp.where(now.mode.taut == 1, self.damping * rope.rate**2, 0.0)
        ledger = ledger._replace(
            load_work=ledger.load_work + rope.weight * v - rope.force * (v - rope.rate),
            damper_heat=heat
            if ledger.damper_heat is None
            else ledger.damper_heat + heat,
        )
        return rates._replace(
            ledger=ledger,
            hook=HookState((rope.weight - rope.force) / rope.mass, rope.rate),
        )

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        rope = now.z.rope
        longer = lesser(self.stiffness * rope.stretch, rope.taut_force)
        return guards._replace(
            rope=jnp.where(now.mode.taut == 1, rope.taut_force, -longer) / rope.weight
        )

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        return limits._replace(rope=mode.taut == 1)

    def stored(self, now: BrakeAtInstant, stored: TwoArrays) -> TwoArrays:
        (kinetic, elastic) = stored
        rope = self.at(now.brake, now.y, now.mode)
        elastic = elastic + 0.5 * self.stiffness * _pulls(now.mode) * rope.stretch**2
        return kinetic + 0.5 * rope.mass * now.y.hook.speed**2, elastic

    # --- changes of mode -------------------------------------------------------------

    def at_once(self, mode: Mode, fired: BrakeGuards) -> Mode:
        # (what the brake does answers the pull after the event of the rope)
        return mode._replace(taut=mode.taut ^ fired.rope.astype(jnp.int32))

    def reset(self, now: BrakeAtInstant, after: Mode, new: State) -> State:
        brake, _, y, before, _ = now
        k = self.stiffness
        v = y.hook.speed
        old = self.at(brake, y, before)
        then = self.at(brake, y, after)
        pulls = _pulls(before)
        still = _pulls(after)
        e = old.stretch
        # a rope that pulls takes another weight on slowly; what hangs on the hook
        # brings its energy
        excess = y.hook.excess - (1 - pulls) * (then.weight - old.weight) / k
        follows = then.weight / k + excess
        brought = 0.5 * (then.mass - old.mass) * v**2 + 0.5 * k * pulls * (
            follows**2 - e**2
        )
        left = 0.5 * k * (pulls - still) * follows**2
        ledger = new.ledger
        ledger = ledger._replace(
            load_work=ledger.load_work + brought, damper_heat=ledger.damper_heat + left
        )
        return new._replace(ledger=ledger, hook=HookState(v, excess))


def _per_radian(brake: BrakeSystem, mode: Mode) -> Any:
    """Travel of the hook per angle of the drum (m)."""
    return brake.load.on_layer(mode.layer).travel()


def _pulls(mode: Mode) -> Array:
    """1 of a taut rope, 0 of a slack one."""
    return jnp.asarray(mode.taut, jnp.float64)
