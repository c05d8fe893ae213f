"""The elastic band: it follows the pulley until its linings slide, stores energy, and
stretches as it slides."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from .._base._corners import greater, lesser
from ..brakes.band import LiningForces, band_torque
from ..friction import SurfaceState
from ..hybrid.arrays import Array, ScalarArray, TwoArrays
from ..hybrid.struct import AbstractVar
from ._contact import acceleration, exceeded, limit_margins
from ._rigid import AbstractBand, ContactGuards, LumpedMode, MotionAfterEvent, sense_of
from .mechanism import (
    ELASTIC,
    HELD,
    OPEN,
    SLIP,
    SLIP_BACK,
    TAKE_UP,
    AppliedLoads,
    BrakeCode,
    ContactState,
    EvaluateInMode,
    EventState,
    MechanismNow,
    MechanismOutputs,
    Mode,
    Pair,
    Sizes,
    Surfaces,
    slips,
)
from .sliding import BandFriction, Limit, where_static

#: Newton steps to a slip speed under states of the law, and steps after them that carry
#: its first and second derivatives
_SEARCH_STEPS = 8
_DERIVATIVE_STEPS = 2
#: over typical speeds: where a slip speed is searched for, and the residual from which
#: there is none
_RANGE = 1e3
_NO_SOLUTION = 1e-9


class BandState(NamedTuple):
    """Elongation `x` of the band (m; `None` where it is rigid), and the speed `ω_b`
    (rad/s) of a bandage that carries it (`None`: the pulley does)."""

    x: Any
    omega_b: Any = None


class ElasticNow(MechanismNow):
    """Variables of an elastic band; `lever_power` is `T_0 ẋ`."""

    # T_n − T_0 (N) against the motion, 0 on a pulley at rest: the part of the tensions
    # that rates need
    net_tension: ScalarArray
    band_speed: ScalarArray  # ẋ (m/s)
    upper: ScalarArray  # limits of T_n by friction (N)
    lower: ScalarArray
    slip_gain: Array | None  # 1 + γ > 0: the stretch of the band follows the fade
    # R_b ω − ẋ_0 (m/s): slip speed without the factor 1 + γ > 0
    uncorrected_slip: ScalarArray
    limit: Limit  # of the linings, at the limit that counts


class Slide(NamedTuple):
    """A band that slides: `ẋ = ẋ_0 + γ v_s` (`growth`), `v_s` (`slip`), `R_b ω − ẋ_0`
    (`uncorrected_slip`), and `1 + γ` (`slip_gain`)."""

    growth: Array
    slip: Array
    uncorrected_slip: Array
    slip_gain: Array | None


class AtLimit(NamedTuple):
    """A band at its limit of friction: forwards, or in the sense in which it slides.

    - `upper` (N): tight tension there;  `push`: its rate, from the rates of slack
      tension, speed of the carrier and surfaces
    - `limit` of the linings
    """

    upper: ScalarArray
    push: Callable[..., Array]
    limit: Limit


class AbstractElasticBand(AbstractBand):
    """A band on a carrier, a pulley or a bandage: its tensions, and how its stretch
    follows the carrier (model §3).

        T_n = C x,  ẋ = R_b ω while it sticks;   T_n = T_0 Π^{±1} while it slides

    While it slides the tension moves with the lever, the speed and the temperatures,
    and these with the heat of the slip itself: `ẋ = Ṫ_n/C = ẋ_0 + γ v_s`,
    `v_s = (R_b ω − ẋ_0)/(1 + γ)`. Where rates of states of the friction law depend on
    the slip, `ẋ(v_s)` is a curve and `1 + γ` is `1 + dẋ/dv_s`.

    - `stiffness` `C` (N/m); `None`: the band is rigid
    """

    stiffness: AbstractVar[Any]

    @property
    def stretches(self) -> bool:
        return self.stiffness is not None

    @property
    def _follows_slip(self) -> bool:
        """Whether the slip itself changes friction, by its heat or by states of the
        law."""
        rates = self.pairs[0].memory
        return self.grip.reads.T or (rates is not None and rates.slip)

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        codes = list[BrakeCode]()
        if self._follows_slip and self.stretches:
            codes.append(BrakeCode.BAND_SNAP)
        if self.grip.implicit:
            codes.append(BrakeCode.FLASH_FOLD)
        return tuple(codes)

    # --- at one instant; `omega` is the speed of the carrier -------------------------

    def at_limit(self, acting: AppliedLoads, omega: Array, mode: Mode) -> AtLimit:
        sliding = slips(mode.band)
        back = mode.band == SLIP_BACK

        def tension(
            T_0: Array, omega: Array, surface: SurfaceState | None
        ) -> tuple[Array, Limit]:
            v = jnp.where(mode.sense > 0, omega, -omega) * self.wrap.radius
            limit = self.wrap.limit(T_0, v, surface, back, ~sliding)
            return T_0 * limit.ratio, limit

        surface = None if self.wrap.fixed is not None else acting.surfaces[0]
        return AtLimit(
            *jax.linearize(tension, acting.tension, omega, surface, has_aux=True)
        )

    def tensions(
        self,
        slack: Array,
        stretched: Array | None,
        band: Array,
        upper: Array,
        held: Array,
    ) -> TwoArrays:
        """Slack tension, as if the band were closed, and tight tension (N).

        - `stretched`: `C x`;  `held`: the tight tension at rest
        """
        tight = where_static(band == HELD, held, where_static(slips(band), upper, 0.0))
        if stretched is None:
            return slack, tight
        take_up = band == TAKE_UP
        slack = where_static(take_up, stretched, slack)
        return slack, where_static(take_up | (band == ELASTIC), stretched, tight)

    def band_kinematics(
        self,
        acting: AppliedLoads,
        mode: Mode,
        at: AtLimit,
        slack: Array,
        carrier: TwoArrays,
        inner: Array | None = None,
    ) -> dict[str, Any]:
        """Variables of every elastic band, on a `carrier` (`ω`, `ω̇`).

        - `inner` (W): friction power of the internal pair, which also heats the linings
        """
        band = mode.band
        speed = self.wrap.radius * carrier[0]
        sliding = slips(mode.band)
        zero = jnp.zeros_like(speed)
        slide = Slide(zero, speed, speed, None)
        band_speed = zero
        if self.stretches:
            slide = self._slide(acting, band == SLIP_BACK, at, speed, carrier[1], inner)
            sticks = (band == TAKE_UP) | (band == ELASTIC)
            band_speed = where_static(
                sticks, speed, where_static(sliding, slide.growth, 0.0)
            )
        return {
            "slip_speed": where_static(sliding, slide.slip, 0.0),
            "lever_power": slack * band_speed,
            "band_speed": band_speed,
            "upper": at.upper,
            "lower": acting.tension / at.limit.other,
            "slip_gain": slide.slip_gain,
            "uncorrected_slip": where_static(sliding, slide.uncorrected_slip, 0.0),
            "limit": at.limit,
        }

    def _slide(
        self,
        acting: AppliedLoads,
        back: Array,
        at: AtLimit,
        speed: Array,
        alpha: Array,
        inner: Array | None,
    ) -> Slide:
        """The band in full slip: `x = T_n/C` moves with lever, speed, temperatures and
        states of the law."""
        still = jnp.zeros_like(speed)
        fixed = self.wrap.fixed
        surface = acting.surfaces[0]
        pair = self.pairs[0]
        rates = pair.memory
        each, normal = self.wrap.sliding(acting.tension, at.limit.fz, back)
        friction = each if pair.apart else at.upper - acting.tension

        def memory_rates(slip: Array) -> PyTree:
            if rates is None or surface is None:
                return None
            return pair.memory_rates(
                surface, where_static(back, -slip, slip), normal, friction * slip
            )

        def stretch(
            pull: Array,
            alpha: Array,
            T_rate: Array | None,
            memory_rate: PyTree,
            swing: Array | None = None,
        ) -> Array:
            surface_rate = None
            if fixed is None and surface is not None:
                if surface.factor is not None and swing is None:
                    swing = jnp.zeros_like(surface.factor)
                surface_rate = SurfaceState(T_rate, memory_rate, swing)
            return at.push(pull, alpha, surface_rate) / self.stiffness

        T_rate = None if fixed is not None else acting.heating_rate(None)[0]
        if T_rate is not None and inner is not None:
            T_rate = T_rate + acting.heating_rate((None, inner))[0]
        at_rest = memory_rates(still)
        swing = None if acting.factor_rates is None else acting.factor_rates[0]
        growth = stretch(
            acting.pull, alpha if fixed is None else still, T_rate, at_rest, swing
        )
        uncorrected_slip = speed - growth
        if not self._follows_slip:
            return Slide(growth, uncorrected_slip, uncorrected_slip, None)
        forces = (friction, *(None,) * (len(self.pairs) - 1))
        heating = acting.heating_rate(forces)[0]

        def change(slip: Array) -> PyTree:
            return jax.tree.map(jnp.subtract, memory_rates(slip), at_rest)

        if rates is not None and rates.bends:

            def more(slip: Array) -> Array:
                T_rate = None if heating is None else slip * heating
                return stretch(still, still, T_rate, change(slip))

            slip, slip_gain = _slip_of(
                more, uncorrected_slip, self.wrap.radius * self.sizes.speed
            )
            return Slide(speed - slip, slip, uncorrected_slip, slip_gain)
        gamma = stretch(still, still, heating, change(jnp.ones_like(still)))
        slip = uncorrected_slip / jnp.where(1 + gamma > 0, 1 + gamma, 1.0)
        return Slide(growth + gamma * slip, slip, uncorrected_slip, 1 + gamma)

    def band_guards(
        self, acting: AppliedLoads, omega: Array, mode: Mode, z: ElasticNow
    ) -> ContactGuards:
        band = mode.band
        size = self.sizes
        R_b = self.wrap.radius
        held = band == HELD
        take_up = band == TAKE_UP
        # at rest a difference of tensions counts by its torque
        per_newton = jnp.where(held, R_b / size.torque, 1 / size.tension)
        bounded = (held | (band == ELASTIC)) & ~self.locked_in(mode)
        uncorrected_slip = z.uncorrected_slip / (R_b * size.speed)
        ahead = jnp.where(band == SLIP, uncorrected_slip, 1.0)
        most = jnp.where(take_up, acting.tension, z.upper)
        above, below = (
            left * per_newton for left in limit_margins(z.tight_tension, z.lower, most)
        )
        high = jnp.where(bounded | take_up, above, ahead)
        back = jnp.where(band == SLIP_BACK, -uncorrected_slip, 1.0)
        low = jnp.where(bounded, below, back)
        sound = {BrakeCode.BAND_SNAP: z.slip_gain, BrakeCode.FLASH_FOLD: z.limit.slope}
        return self.margins(acting, omega, mode, (high, low), z.limit.margin, sound)

    def lining_margins(self, mode: Mode, z: ElasticNow) -> Float[Array, " twice_n"]:
        margins = (
            self.wrap.margins(z.slack_tension, z.tight_tension, z.limit.fz)
            / self.sizes.tension
        )
        return jnp.where((mode.band == ELASTIC) & ~self.locked_in(mode), margins, -1.0)

    def outer_rub(self, mode: Mode, z: ElasticNow) -> ContactState:
        each, normal = self.wrap.sliding(
            z.slack_tension, z.limit.fz, mode.band == SLIP_BACK
        )
        return ContactState(
            each if self.pairs[0].apart else z.net_tension,
            z.slip_speed,
            sense_of(mode),
            normal,
        )

    def linings(self, mode: Mode, z: ElasticNow) -> LiningForces:
        return self.wrap.linings(z.slack_tension, z.tight_tension, z.limit.fz)

    # --- changes of mode -------------------------------------------------------------

    def tension_of(self, x: Array, mode: Mode, z: ElasticNow) -> Array:
        """`C x`, with the exact value where it follows from the slack tension."""
        return jnp.where(slips(mode.band), z.upper, self.stiffness * x)

    def taut_mode(
        self,
        now: EventState,
        new: Mode,
        fired: ContactGuards,
        there: Callable[[Mode], ElasticNow],
        acting: AppliedLoads,
        rest: ElasticNow,
        motion: MotionAfterEvent,
    ) -> Array:
        """Mode of an elastic band that the lever pulls, on a carrier that moves or
        starts to.

        - `there(mode)`: the variables at this instant in another mode;  `rest`: those of
          a pulley at rest
        """
        old = now.mode.band
        C = self.stiffness
        locked = self.locked_in(new)
        T_0 = acting.tension
        rounding = self.sizes.slight_tension
        speed = self.wrap.radius * motion.omega
        was_slack = (old == OPEN) | (old == TAKE_UP)
        tension = self.tension_of(now.own.x, now.mode, now.z)
        # where the lever begins to pull from 0 both limits of the tension are 0 as well:
        # rates decide, and that of T_0 lies between those of the limits
        lags = C * speed < acting.pull
        takes_up = jnp.where(motion.rising, lags, tension < T_0 - rounding)
        takes_up = (
            was_slack & (motion.omega > 0) & takes_up & ~((old == TAKE_UP) & fired.high)
        )
        low = jnp.where(locked, 0.0, rest.lower)
        high = jnp.where(locked, jnp.inf, rest.upper)
        # on a pulley that does not run into a slack band the lever draws it tight
        tension = jnp.where(
            was_slack & (motion.omega <= 0), greater(tension, low), tension
        )
        # late in a run the time breakpoints themselves are rounded
        if new.pieces["lever"] is not None:
            steepest = jnp.maximum(jnp.abs(acting.pull), jnp.abs(now.acting.pull))
            rounding = rounding + 1e-15 * jnp.abs(now.t) * steepest * jnp.where(
                locked, 1.0, rest.limit.other
            )
        # at a limit of its tension the band slides if it would slip there in the sense
        # of that limit; without slip speed the sense in which the pulley starts decides
        at_high = tension >= high - rounding
        at_low = tension <= low + rounding
        lags = lags | ((C * speed == acting.pull) & (motion.direction < 0))
        back = jnp.where(at_high, at_low & lags, at_low | (old == SLIP_BACK))
        trial = jnp.where(back, SLIP_BACK, SLIP)
        way = jnp.where(back, -1.0, 1.0)
        slid = there(new._replace(band=trial))
        # a band that slides goes on at its kinetic limit; for others the static limit
        # counts
        past = way * (tension - slid.upper)
        limited = jnp.where(back, at_low, at_high) | (
            (old == trial) & (past >= -rounding)
        )
        runs = (way * slid.uncorrected_slip > 0) | (
            (slid.uncorrected_slip == 0)
            & jnp.where(back, motion.direction < 0, motion.direction > 0)
        )
        mode = jnp.where(limited & runs, trial, ELASTIC)
        mode = jnp.where((old == ELASTIC) & fired.high, SLIP, mode)
        mode = jnp.where((old == ELASTIC) & fired.low, SLIP_BACK, mode)
        sticks = ((old == SLIP) & fired.high) | ((old == SLIP_BACK) & fired.low)
        mode = jnp.where(sticks, ELASTIC, mode)
        return jnp.where(takes_up, TAKE_UP, mode)

    def tension_jump(
        self,
        omega: Array,
        own: BandState,
        before: tuple[Mode, ElasticNow],
        after: tuple[Mode, Array],
    ) -> Callable[[Surfaces], tuple[BandState, Array, tuple[Array, ...]]]:
        (old, z) = before
        (new, T_0) = after
        C = self.stiffness
        x = own.x
        omega = omega if own.omega_b is None else own.omega_b
        was_open = old.band == OPEN
        locked = self.locked_in(new)
        sliding = slips(new.band)
        is_open = new.band == OPEN
        held = new.band == HELD
        elastic = new.band == ELASTIC
        T_0 = jnp.where(is_open, 0.0, T_0)
        v = jnp.where(new.sense > 0, omega, -omega) * self.wrap.radius
        back = new.band == SLIP_BACK
        tension = self.tension_of(x, old, z)
        drawn_tight = was_open | (old.band == TAKE_UP)
        # a band that neither slides nor is held by friction keeps its elongation; a
        # released band springs back
        kept = jnp.where(is_open & ~was_open, 0.0, C * x)

        def jump(surfaces: Surfaces) -> tuple[BandState, Array, tuple[Array, ...]]:
            limit = self.wrap.limit(T_0, v, surfaces[0], back, ~sliding)
            upper = T_0 * limit.ratio
            low = jnp.where(locked, 0.0, T_0 / limit.other)
            high = jnp.where(locked, jnp.inf, upper)
            drawn = greater(tension, low)
            resting = jnp.where(
                held,
                jnp.where(drawn_tight, drawn, tension),
                jnp.where(sliding, upper, kept),
            )
            T_n = jnp.where(elastic, lesser(drawn, high), resting)
            drift = T_n / C - x
            heat = drift * (T_0 - 0.5 * (C * x + T_n))
            return (
                own._replace(x=T_n / C),
                T_0 * drift,
                (heat, *(jnp.zeros_like(heat) for _ in self.pairs[1:])),
            )

        return jump


class ElasticBand(AbstractElasticBand):
    """An elastic band on a pulley: `J ω̇ = M_load − R_b (T_n − T_0)` (model §3)."""

    wrap: BandFriction
    stiffness: ScalarArray
    pairs: tuple[Pair, ...]
    sizes: Sizes

    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[BandState, np.int32, LumpedMode]:
        return BandState(elongation), OPEN, LumpedMode(self.starts_locked)

    def variables(
        self, acting: AppliedLoads, omega: Array, own: BandState, mode: Mode
    ) -> ElasticNow:
        band = mode.band
        R_b = self.wrap.radius
        T_0 = acting.tension
        stretched = self.stiffness * own.x
        at = self.at_limit(acting, omega, mode)
        # a held brake bears the load
        slack, tight = self.tensions(
            T_0, stretched, band, at.upper, T_0 + acting.load / R_b
        )
        shown = where_static(band == OPEN, 0.0, slack)
        elastic = where_static(band == ELASTIC, stretched - T_0, 0.0)
        net_tension = where_static(slips(band), at.upper - T_0, elastic)
        alpha = acceleration(
            acting.load, R_b * net_tension, acting.inertia, band == HELD
        )
        return ElasticNow(
            slack_tension=shown,
            tight_tension=tight,
            net_tension=net_tension,
            brake_torque=band_torque(R_b, shown, tight),
            alpha=alpha,
            **self.band_kinematics(acting, mode, at, slack, (omega, alpha)),
        )

    def own_rates(self, z: ElasticNow) -> BandState:
        return BandState(z.band_speed)

    def contact_states(self, mode: Mode, z: ElasticNow) -> tuple[ContactState, ...]:
        return (self.outer_rub(mode, z),)

    def guards(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: BandState,
        mode: Mode,
        z: ElasticNow,
    ) -> ContactGuards:
        return self.band_guards(acting, omega, mode, z)

    def change(
        self, now: EventState, new: Mode, fired: ContactGuards, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        new = self.relocked(new, fired)
        # at rest: does the band hold the load?
        acting, rest = evaluate(new._replace(band=HELD), now.omega, now.own)
        beyond = exceeded(
            rest.tight_tension,
            rest.lower,
            rest.upper,
            self.sizes.slight_torque / self.wrap.radius,
        )
        motion = self.onset(
            now, fired, acting, jnp.where(self.locked_in(new), 0, beyond)
        )
        new = new._replace(sense=motion.settled(now, new, now.mode.band).sense)

        def there(mode: Mode) -> ElasticNow:
            return evaluate(mode, motion.omega, now.own)[1]

        new = motion.settled(
            now, new, self.taut_mode(now, new, fired, there, acting, rest, motion)
        )
        return new, self.code_of(fired, jnp.asarray(0, jnp.int32))

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: BandState,
        mode: Mode,
        surfaces: Surfaces,
        z: ElasticNow,
    ) -> MechanismOutputs:
        pair, along = self.first_shown(tension, omega, mode, surfaces, z)
        return MechanismOutputs((pair,), along, elongation=own.x)

    def stored(
        self, inertia: Array, omega: Array, own: BandState, mode: Mode
    ) -> TwoArrays:
        return 0.5 * inertia * omega**2, 0.5 * self.stiffness * own.x**2

    def own_sizes(self) -> BandState:
        return BandState(self.sizes.tension / self.stiffness)


def _slip_of(
    more: Callable[[Array], Array], uncorrected_slip: Array, size: Array
) -> TwoArrays:
    """The slip speed `v` with `v + more(v) = uncorrected_slip`, `more(0) = 0`, and
    `1 + d more/dv`.

    Without a solution `v` is `uncorrected_slip`, and the slope negative.

    - `size`: a typical speed
    """

    def residual(v: Array) -> TwoArrays:
        return jax.jvp(
            lambda v: v + more(v) - uncorrected_slip, (v,), (jnp.ones_like(v),)
        )

    def newton(v: Array, _: None) -> tuple[Array, None]:
        r, slope = residual(v)
        return v - r / jnp.where(slope > 0, slope, 1.0), None

    def search(v: Array, _: None) -> tuple[Array, None]:
        return jnp.clip(newton(v, None)[0], -far, far), None

    far = jax.lax.stop_gradient(_RANGE * (jnp.abs(uncorrected_slip) + size))
    v = jax.lax.stop_gradient(
        jax.lax.scan(
            search, jax.lax.stop_gradient(uncorrected_slip), None, length=_SEARCH_STEPS
        )[0]
    )
    for _ in range(_DERIVATIVE_STEPS):  # each carries derivatives one order further
        v = newton(v, None)[0]
    r, slope = residual(v)
    off = jnp.abs(r) / size
    fails = off > _NO_SOLUTION
    slope = jnp.where(fails, -jnp.minimum(off, 1.0), slope)
    return jnp.where(fails, uncorrected_slip, v), slope
