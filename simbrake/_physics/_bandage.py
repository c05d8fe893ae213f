"""The resolved bandage as a hybrid system: equations, guards, changes of mode and an energy ledger."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from .._hybrid import CORE, QUADRATURE, largest
from .._hybrid._arrays import Array
from ._acting import AbstractBrakeSystem
from ._at_rest import holding_range, resting_tensions, yields_on_band
from ._bandage_forces import BandageForces
from ._bandage_state import BandageFlows, BandageMode, BandageState, band_label
from ._modes import BandMode
from ._sparsity import couplings
from ._state import BrakeCode, HeatLedger, Ledger
from ._wearing import Pressed, Wearing

#: guards before those of the linings: lever, pulley (two)
_FIRST = 3


class BandageSystem(AbstractBrakeSystem):
    """A staged brake whose linings are bodies of their own, with springs between neighbours (model §4, last part; K).

        J ω̇ = M_load(t, ω) − Σ λ_i,   J_i ω̇_i = λ_i + Q_i − R_b (T_i − T_{i−1})

    Each lining is held or slides on the band, and sticks or slides on the rim, by its own balance; `BandageForces` has
    the equations. Guards: lever, pulley (two), then two for each lining, `inner` and `outer`:

        sticks on the rim:      M_s,i − |λ_i|                             slides there: σ_i (ω − ω_i)
        held on the band:       f_s,i z_i (T_i + T_{i−1}) − |T_i − T_{i−1}|     slides there: sgn(ω_i) ω_i
        neither moves:          what both pairs could hold against its springs
        pulley:                 its speed in motion; at rest how far the load is from both ends of what holds it

    The second line is `T_{i−1}/μ_s ≤ T_i ≤ T_{i−1} μ_s`. Speeds that vanish together with the pulley's have no guard of
    their own: its guard decides for all linings that come to rest with it.
    """

    forces: BandageForces
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]
    wearing: Wearing | None = None

    @property
    def staged(self):
        return True

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """Ends of the run that heat can bring about; each has a guard after those of the linings."""
        found = [BrakeCode.SINGULAR_GEOMETRY] if self.forces.fades else []
        return (*found, BrakeCode.OUTSIDE_TABLE) if self.has_tables else tuple(found)

    def rhs(self, t, y, mode):
        f, q = self.forces, self.forces.flows(t, y, mode)
        moving = jnp.where(mode.rests, 0.0, y.omega)
        outer, inner = f.powers(y, mode, q)
        drift = -f.band_radius * jnp.diff(y.speeds)
        _, damped, _ = f.springs(y)
        ledger = Ledger(
            load_work=q.load_torque * moving,
            lever_work=jnp.zeros_like(moving),
            friction_heat=jnp.sum(outer),
            internal_heat=jnp.sum(inner),
            damper_heat=jnp.sum(damped * drift),
        )
        rates = BandageState(moving, q.alpha, drift, q.accelerations, ledger)
        rates = self.with_wear(rates, t, y, mode, q)
        if f.thermal is None:
            return rates
        net, on_band, on_rim = q.thermal.flows, q.thermal.outer, q.thermal.inner
        zero = jnp.zeros_like(moving)
        booked = HeatLedger(
            to_metal=on_rim.to_metal + (zero if on_band.beyond is None else on_band.beyond),
            to_linings=on_rim.to_linings + on_band.to_linings,
            lost=net.lost + on_rim.lost + on_band.lost,
            supplied=net.supplied,
            to_band=on_band.to_metal,
        )
        into = net.into + on_band.into + on_rim.into
        return rates._replace(ledger=ledger._replace(heat=booked), heat=f.thermal.rise(into))

    def pressed(self, y, mode, q):
        outer_T, inner_T = self.forces.surfaces(y.heat)
        outer = Pressed(q.normal, mode.outer.astype(jnp.float64) * q.outer_slip, outer_T)
        return outer, Pressed(q.load, mode.inner.astype(jnp.float64) * q.inner_slip, inner_T)

    # --- guards ---------------------------------------------------------------------------------------------------

    def guards(self, t, y, mode):
        q, is_open, rests = self.forces.flows(t, y, mode), mode.band == BandMode.OPEN, mode.rests
        lever = jnp.where(is_open, -q.lever_tension, q.lever_tension) / self.tension_scale
        turning = jnp.where(is_open, 1.0, mode.sense.astype(jnp.float64) * y.omega / self.speed_scale)
        high = jnp.where(rests, (q.most_hold - q.load_torque) / self.torque_scale, turning)
        low = jnp.where(rests, (q.load_torque - q.least_hold) / self.torque_scale, 1.0)
        parts = [jnp.stack([lever, high, low]), *self._lining_guards(y, mode, q)]
        parts += [self._margin(code, y, mode)[None] for code in self.codes]
        return jnp.concatenate(parts)

    def _lining_guards(self, y: BandageState, mode: BandageMode, q: BandageFlows) -> tuple[Array, Array]:
        stuck, held = mode.inner == 0, mode.outer == 0
        torque_scale = self.torque_scale / self.forces.count
        slip = mode.inner.astype(jnp.float64) * (y.omega - y.speeds) / self.speed_scale
        inner = jnp.where(stuck, (q.capacity - jnp.abs(q.inner_torque)) / torque_scale, slip)
        inner = jnp.where(held & ~stuck, 1.0, inner)  # its slip is the pulley's speed
        inner = jnp.where(mode.fixed, self._spring_margin(y, mode, q) / torque_scale, inner)
        travel = mode.outer.astype(jnp.float64) * y.speeds / self.speed_scale
        outer = jnp.where(held, (q.outer_limit - jnp.abs(q.outer_force)) / self.tension_scale, travel)
        # fixed linings are bounded by their limits on the band; stuck ones move with the pulley
        return inner, jnp.where(stuck | (mode.band == BandMode.OPEN), 1.0, outer)

    def _spring_margin(self, y: BandageState, mode: BandageMode, q: BandageFlows) -> Array:
        """What both pairs of a fixed lining could hold, less what its springs pull (N·m)."""
        c, Q = self.forces.coefficients(y, mode), q.spring_torque
        r = self.forces.resting(y, mode, c, Q)
        before = jnp.concatenate([q.slack_tension[None], q.tension[:-1]])
        most = jnp.where(Q > 0, before * c.mu_static, before / c.mu_static)
        return r.grip * (most + before) + r.floor + self.forces.band_radius * jnp.abs(most - before) - jnp.abs(Q)

    def _margin(self, code: BrakeCode, y: BandageState, mode: BandageMode) -> Array:
        f = self.forces
        if code == BrakeCode.SINGULAR_GEOMETRY:
            c = f.coefficients(y, mode)
            on_rim = f.track_radius * c.inner_static * f.grip.sine / f.band_radius
            return 1 - jnp.maximum(largest(c.grip_static), largest(on_rim))
        return self.table_margin(y.heat)

    # --- changes of mode ------------------------------------------------------------------------------------------

    def transition(self, t, y, mode, fired, at_stop):
        n = self.forces.count
        new = self.next_pieces(mode, at_stop)
        T_0, rate = self.forces.lever_tension(t, new)
        rounding = 1e-12 * self.tension_scale
        pulls = (rounding < T_0) | ((jnp.abs(T_0) <= rounding) & (rate > 0))
        was_open, rests = mode.band == BandMode.OPEN, mode.rests
        broke, gone = fired[_FIRST : _FIRST + n], fired[_FIRST + n : _FIRST + 2 * n]
        new = self._each_lining(t, y, new, broke, gone)

        # the lever begins to pull: what moves slides, what rests is held unless that proves too much
        grips = was_open & pulls
        starts = grips & (y.omega == 0)
        sense = jnp.where(grips & (y.omega != 0), jnp.sign(y.omega).astype(jnp.int32), mode.sense)
        outer = jnp.where(grips, jnp.sign(y.speeds).astype(jnp.int32), new.outer)
        new = new._replace(outer=outer, sense=sense, band=jnp.where(pulls, BandMode.HELD, BandMode.OPEN))

        # pulley and linings come to rest together, start together, or pass through
        stops = ~was_open & ~rests & fired[1]
        breaks = rests & (fired[1] | fired[2])
        with_pulley = (mode.inner == 0) | (mode.outer == 0) | broke | gone
        together = jnp.where(breaks, mode.fixed & ~broke, jnp.where(starts, y.speeds == 0, with_pulley))
        forced = jnp.where(breaks, jnp.where(fired[1], 1, -1), 0)
        settled = self._settled(t, y, new, together, forced)
        decides = pulls & (stops | breaks | starts)
        new = jax.tree.map(lambda a, b: jnp.where(decides, a, b).astype(jnp.int32), settled, new)

        # while open, `outer` says nothing and no lining is held
        new = new._replace(outer=jnp.where(pulls, new.outer, new.sense).astype(jnp.int32))
        new = new._replace(band=band_label(new.outer, new.sense, pulls))
        code = jnp.asarray(0, jnp.int32)
        for i, failure in enumerate(self.codes, _FIRST + 2 * n):
            code = jnp.where(fired[i], int(failure), code)
        return new, code

    def _each_lining(self, t: Array, y: BandageState, mode: BandageMode, broke: Array, gone: Array) -> BandageMode:
        """Every lining by itself: what it does after guards of its own fired.

        What lets go slides the way of the force that was too great; what has come to rest is held for now: if that
        takes too great a force, its guard is negative and fires at the same instant. A lining without speed on a
        pulley without speed, which starts, goes with the stronger pair.
        """
        q = self.forces.flows(t, y, mode)
        stuck, held, fixed, rests = mode.inner == 0, mode.outer == 0, mode.fixed, mode.rests

        def way(x: Array) -> Array:
            return jnp.where(x < 0, -1, 1).astype(jnp.int32)

        slides = ~stuck & ~held
        still = slides & (gone | broke) & (y.speeds == 0) & (y.omega == 0)
        r = self.forces.resting(y, mode, self.forces.coefficients(y, mode), q.spring_torque)
        band_yields = yields_on_band(r, q.slack_tension, q.tension, mode.sense)
        on_band = slides & jnp.where(still, ~band_yields, gone)
        on_rim = slides & jnp.where(still, band_yields, broke & ~gone)
        lost = stuck & ~fixed & broke
        inner = jnp.where(lost, way(q.inner_torque), mode.inner)
        inner = jnp.where(on_band, jnp.where(rests, 0, mode.sense), jnp.where(on_rim, 0, inner))
        outer = jnp.where(held & ~stuck & gone, way(q.outer_force), mode.outer)
        outer = jnp.where(on_band, 0, jnp.where(on_rim, jnp.where(rests, 0, mode.sense), outer))
        # springs tear a lining off both: it moves against a pulley at rest
        torn = fixed & broke
        outer = jnp.where(torn, way(q.spring_torque), outer)
        inner = jnp.where(torn, -way(q.spring_torque), inner)
        return mode._replace(outer=outer.astype(jnp.int32), inner=inner.astype(jnp.int32))

    def _settled(
        self, t: Array, y: BandageState, new: BandageMode, together: Bool[Array, " n"], forced: Array
    ) -> BandageMode:
        """The mode where the pulley has no speed, and the linings named have none either.

        They rest if the load is within what all of them hold (each at the limit of its weaker pair). Otherwise the
        pulley starts the way of the load, or of the guard that fired (`forced`), and each lets go at its weaker pair.
        """
        f = self.forces
        trial = new._replace(outer=jnp.where(together, 0, new.outer), inner=jnp.where(together, 0, new.inner))
        T_0 = f.lever_tension(t, trial)[0]
        load = f.load.torque(t, jnp.zeros_like(y.omega), trial.load_piece)
        r = f.resting(y, trial, f.coefficients(y, trial), f.springs(y)[2])._replace(fixed=together)
        least, most = holding_range(r, T_0)
        slack = 1e-12 * self.torque_scale
        way = jnp.where(load > most + slack, 1, jnp.where(load < least - slack, -1, 0))
        way = jnp.where(forced == 0, way, forced)
        # nothing comes to rest: the pulley passes through zero
        none = ~jnp.any(together)
        way = jnp.where(none, -new.sense, way)
        yields = yields_on_band(r, T_0, resting_tensions(r, T_0, way.astype(jnp.float64)), way)
        outer = jnp.where(together, jnp.where(yields, way, 0), new.outer)
        inner = jnp.where(together, jnp.where(yields, 0, way), new.inner)
        return new._replace(outer=outer, inner=inner, sense=jnp.where(way == 0, new.sense, way))

    def reset(self, t, y, before, after):
        turned = (before.band != BandMode.OPEN) & (after.sense != before.sense)
        omega = jnp.where(after.rests | turned, 0.0, y.omega)
        speeds = jnp.where(after.outer == 0, 0.0, jnp.where(after.inner == 0, omega, y.speeds))
        return self.booked_change_of_load(y, before, after)._replace(omega=omega, speeds=speeds)

    # --- sizes ----------------------------------------------------------------------------------------------------

    def scales(self):
        f, infinity = self.forces, jnp.inf
        ledger = Ledger(infinity, infinity, infinity, None, infinity, infinity)
        stretch = self.tension_scale / f.stiffness
        plain = self.with_worn(BandageState(1.0, self.speed_scale, stretch, self.speed_scale, ledger))
        if f.thermal is None:
            return plain
        booked = HeatLedger(infinity, infinity, infinity, infinity, infinity)
        return plain._replace(ledger=ledger._replace(heat=booked), heat=jnp.full_like(f.thermal.capacity, 100.0))

    def couplings(self):
        f = self.forces
        if f.thermal is None:
            return None
        q, c = np.asarray(QUADRATURE), np.asarray(CORE)
        booked = Ledger(q, q, q, HeatLedger(q, q, q, q, q), q, q)
        stretch, speeds = np.full(f.count - 1, CORE), np.full(f.count, CORE)
        kinds = BandageState(q, c, stretch, speeds, booked, couplings(f.thermal.heat))
        return self.with_worn(kinds, np.full(f.count, QUADRATURE))
