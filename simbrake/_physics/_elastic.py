"""The elastic band: it follows the pulley until its linings slide, stores energy, and slides with what it stretches."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from ..friction import SurfaceState
from ..hybrid._arrays import Array
from ._ageing import rates_of_memory
from ._mechanism import (
    ELASTIC,
    HELD,
    OPEN,
    SLIP,
    SLIP_BACK,
    TAKE_UP,
    AbstractMechanism,
    Acting,
    BandMode,
    BrakeCode,
    Fired,
    Locking,
    Mode,
    Moment,
    Onset,
    Pair,
    Rub,
    Shown,
    Sizes,
    Sliding,
    arrested,
    failed,
    moving_as_one,
    onset,
    pick,
    sense_of,
    settled_mode,
    slips,
)
from ._wrap import MOBILISATION, Limit, Wrap, band_torque

#: Newton iterations of a slip speed under states of the law, and those after them that carry derivatives
_SEARCH, _CARRY = 8, 2
#: how far they may look, and what is no solution, over typical speeds
_FAR, _OFF = 1e3, 1e-9


class Stretched(NamedTuple):
    """Elongation `x` (m) of the band."""

    x: Any


class ElasticNow(NamedTuple):
    """Variables of an elastic band."""

    slack_tension: Float[Array, ""]  # T_0 (N), as the band has it at its slack end
    tight_tension: Float[Array, ""]  # T_n (N)
    drag: Float[Array, ""]  # T_n − T_0 (N) against the motion, 0 on a pulley at rest: what rates need of the tensions
    brake_torque: Float[Array, ""]  # R_b (T_n − T_0) (N·m)
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    slip_speed: Float[Array, ""]  # v_s (m/s)
    band_speed: Float[Array, ""]  # ẋ (m/s)
    lever_power: Float[Array, ""]  # T_0 ẋ (W)
    upper: Float[Array, ""]  # limits of T_n by friction (N)
    lower: Float[Array, ""]
    ratio: Float[Array, ""]  # Π of the linings at rest
    fz: Float[Array, " n"]  # f_i z_i of the linings at the limit that counts
    slope: Array  # of implicit coefficients
    margin: Any  # 1 − max f_s z
    snap: Any  # 1 + γ: by how much the band still follows the fade
    lead: Float[Array, ""]  # R_b ω − ẋ_0 (m/s): the slip speed but for the factor 1 + γ > 0


class ElasticBand(AbstractMechanism):
    """An elastic band on a pulley (model §3).

        J ω̇ = M_load − R_b (T_n − T_0),   T_n = C x while it sticks, T_0 Π^{±1} while it slides

    While it slides the tension moves with the lever, the speed and the temperatures, and these with the heat of the
    slip itself: `ẋ = Ṫ_n/C = ẋ_0 + γ v_s`, `v_s = (R_b ω − ẋ_0)/(1 + γ)`. States of the friction law whose rates depend
    on the slip make `ẋ(v_s)` a curve; `1 + γ` is then `1 + dẋ/dv_s`.

    Guards: motion, upper limit, lower limit, lever; then what can change with heat: locking, snap, fold.
    """

    wrap: Wrap
    stiffness: Float[Array, ""]
    pairs: tuple[Pair, ...]
    sizes: Sizes

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """Ends of the run that heat can bring about; each has a guard, the last ones."""
        grip = self.wrap.grip
        found = [BrakeCode.BAND_SNAP] if grip.follows_slip else []
        return (*found, BrakeCode.FLASH_FOLD) if grip.implicit else tuple(found)

    def start(self, omega, elongation):
        locks = self.wrap.locked.astype(jnp.int32) if self.wrap.grip.varies else None
        return Stretched(elongation), OPEN, Locking(locks)

    def rests(self, mode):
        return mode.band == BandMode.HELD

    def locked_in(self, mode: Mode) -> Bool[Array, ""]:
        return self.wrap.locked if mode.own.locks is None else mode.own.locks > 0

    def variables(self, acting, omega, own, mode):
        band, R_b, C = mode.band, self.wrap.radius, self.stiffness
        sliding, back, held = slips(band), band == BandMode.SLIP_BACK, band == BandMode.HELD
        take_up = band == BandMode.TAKE_UP
        T_0, speed, stretched = acting.tension, R_b * omega, C * own.x
        upper, push, at_limit = limit_of(self, acting, omega, mode)
        lower = T_0 / at_limit.other
        elastic = band == BandMode.ELASTIC
        carried = elastic | take_up
        drag = pick(sliding, upper - T_0, pick(elastic, stretched - T_0, 0.0))
        alpha = pick(held, 0.0, (acting.load - R_b * drag) / acting.inertia)
        slack = pick(take_up, stretched, T_0)
        # what is held bears the load
        tight = pick(held, T_0 + acting.load / R_b, pick(carried, stretched, pick(sliding, upper, 0.0)))
        shown = pick(band == BandMode.OPEN, 0.0, slack)

        drift = None if self.wrap.fixed is not None else acting.warming(None)[0]
        friction = (friction_of(self, T_0, at_limit.fz, back, upper),)
        ageing = ageing_of(self, acting, T_0, at_limit.fz, back, friction[0])
        slide = slide_of(self, push, acting, speed, alpha, drift, friction, ageing)
        band_speed = pick(carried, speed, pick(sliding, slide.growth, 0.0))
        return ElasticNow(
            slack_tension=shown,
            tight_tension=tight,
            drag=drag,
            brake_torque=R_b * (tight - shown),
            alpha=alpha,
            slip_speed=pick(sliding, slide.slip, 0.0),
            band_speed=band_speed,
            lever_power=slack * band_speed,
            upper=upper,
            lower=lower,
            ratio=at_limit.other,
            fz=at_limit.fz,
            slope=at_limit.slope,
            margin=at_limit.margin,
            snap=slide.snap,
            lead=pick(sliding, slide.lead, 0.0),
        )

    def own_rates(self, z):
        return Stretched(z.band_speed)

    def rubs(self, acting, mode, z):
        back = mode.band == BandMode.SLIP_BACK
        each, normal = self.wrap.sliding(z.slack_tension, z.fz, back)
        return (Rub(each if self.pairs[0].apart else z.drag, z.slip_speed, sense_of(mode), normal),)

    def guards(self, acting, omega, own, mode, z):
        return jnp.stack(band_guards(self, acting, omega, mode, z))

    # --- changes of mode ------------------------------------------------------------------------------------------

    def change(self, now, new, fired, ask):
        fired, old, size = jnp.unstack(fired), now.mode, self.sizes
        if new.own.locks is not None:
            new = new._replace(own=Locking(jnp.where(fired[4], 1 - old.own.locks, old.own.locks).astype(jnp.int32)))
        # at rest: does the band hold the load?
        acting, rest = ask(new._replace(band=HELD), now.omega, now.own)
        spare = size.slight_torque / self.wrap.radius
        beyond = jnp.where(rest.tight_tension < rest.lower - spare, -1, 0)
        beyond = jnp.where(rest.tight_tension > rest.upper + spare, 1, beyond)
        found = onset(now, fired, acting, jnp.where(self.locked_in(new), 0, beyond), size)
        new = new._replace(sense=settled_mode(now, new, found, old.band).sense)

        def there(mode: Mode) -> ElasticNow:
            return ask(mode, found.omega, now.own)[1]

        new = settled_mode(now, new, found, taut_mode(self, now, new, fired, there, acting, rest, found))
        return new, failed(self.codes, fired, 4 + (new.own.locks is not None), jnp.asarray(0, jnp.int32))

    def arrested(self, omega, own, before, after):
        return arrested(omega, before, after), own

    @property
    def grip(self):
        return self.wrap.grip

    @property
    def distribution(self):
        return MOBILISATION

    def lining_margins(self, mode, z):
        margins = self.wrap.margins(z.slack_tension, z.tight_tension, z.fz) / self.sizes.tension
        return jnp.where((mode.band == BandMode.ELASTIC) & ~self.locked_in(mode), margins, -1.0)

    def shown(self, tension, omega, own, mode, surfaces, z):
        forces = self.wrap.linings(z.slack_tension, z.tight_tension, z.fz)
        f = self.wrap.kinetic(tension, omega, surfaces[0], mode) if self.shows_friction else None
        return Shown((moving_as_one(forces, self.grip.cosine, mode, z, f),), forces.tension, elongation=own.x)

    @property
    def varies(self):
        return self.wrap.grip.varies

    @property
    def couples_slip(self):
        return True

    @property
    def strains(self):
        return True

    def strained(self, omega, own, before, after):
        jump = strained(self, omega, own.x, before, after)

        def of(surfaces: tuple[Any, ...]) -> tuple[Stretched, Array, tuple[Array, ...]]:
            x, work, heat = jump(surfaces[0])
            return Stretched(x), work, (heat,)

        return of

    # --- what it stores, what it could hold -------------------------------------------------------------------------

    def stored(self, inertia, omega, own, mode):
        return 0.5 * inertia * omega**2, 0.5 * self.stiffness * own.x**2

    def own_sizes(self):
        return Stretched(self.sizes.tension / self.stiffness)

    def capacity(self, tension, omega, own, surfaces):
        return band_torque(self.grip, self.wrap.radius, tension, omega, surfaces[0])[None]


# --- what every elastic band has, whatever it lies on -----------------------------------------------------------------
#
# `m` is a mechanism with `wrap`, `stiffness`, `pairs`, `sizes`, `codes` and `locked_in`; `omega` the speed of what
# carries the band.


class Slide(NamedTuple):
    """A band that slides: `ẋ = ẋ_0 + γ v_s` (`growth`), `v_s` (`slip`), `R_b ω − ẋ_0` (`lead`), `1 + γ` (`snap`)."""

    growth: Array
    slip: Array
    lead: Array
    snap: Any


def limit_of(m: Any, acting: Acting, omega: Array, mode: Mode) -> tuple[Array, Callable[..., Array], Limit]:
    """The tension at the limit forwards, or of the way it slides; how that moves with the rates of slack tension, speed
    and surfaces; and the linings there."""
    sliding, back = slips(mode.band), mode.band == BandMode.SLIP_BACK

    def tension(T_0: Array, omega: Array, surface: Any) -> tuple[Array, Limit]:
        v = jnp.where(mode.sense > 0, omega, -omega) * m.wrap.radius
        found = m.wrap.limit(T_0, v, surface, back, ~sliding)
        return T_0 * found.ratio, found

    surface = None if m.wrap.fixed is not None else acting.surfaces[0]
    return jax.linearize(tension, acting.tension, omega, surface, has_aux=True)


def friction_of(m: Any, T_0: Array, fz: Array, back: Any, tight: Array) -> Float[Array, "*n"]:
    """Friction `T_i − T_{i−1}` of the linings while every one slides, or its sum."""
    if not m.pairs[0].apart:
        return tight - T_0
    return m.wrap.sliding(T_0, fz, back)[0]


def ageing_of(
    m: Any, acting: Acting, T_0: Array, fz: Array, back: Any, friction: Array
) -> Callable[[Array], Any] | None:
    """Rates of the states of the law of linings that all slide, as a function of their slip speed; `None`: no states.

    - `friction`: that of `friction_of`
    """
    pair = m.pairs[0]
    if pair.memory is None:
        return None
    normal = m.wrap.sliding(T_0, fz, back)[1]

    def rates(slip: Array) -> Any:
        return rates_of_memory(pair, acting.surfaces[0], pick(back, -slip, slip), normal, friction * slip)

    return rates


def slide_of(
    m: Any,
    push: Callable[..., Array],
    acting: Acting,
    speed: Array,
    alpha: Array,
    drift: Any,
    friction: tuple[Array | None, ...],
    ageing: Callable[[Array], Any] | None,
) -> Slide:
    """The band in full slip: `x = T_n/C` moves with the lever, the speed, the temperatures and states of the law.

    `speed` (m/s) and `alpha` (rad/s²) of its carrier;  `drift`: rates of the temperatures but for the heat of this slip
    """
    still, grip, fixed = jnp.zeros_like(speed), m.wrap.grip, m.wrap.fixed is not None

    def stretch(pull: Array, alpha: Any, T_rate: Any, memory_rate: Any) -> Array:
        none = fixed or acting.surfaces[0] is None
        return push(pull, alpha, None if none else SurfaceState(T_rate, memory_rate)) / m.stiffness

    at_rest = None if ageing is None else ageing(still)
    growth = stretch(acting.pull, still if fixed else alpha, drift, at_rest)
    lead = speed - growth
    if not grip.follows_slip:
        return Slide(growth, lead, lead, None)
    heating, rates = acting.warming(friction)[0], m.pairs[0].memory

    def change(slip: Array) -> Any:
        return None if ageing is None else jax.tree.map(jnp.subtract, ageing(slip), at_rest)

    if rates is not None and rates.bends:

        def more(slip: Array) -> Array:
            return stretch(still, still, None if heating is None else slip * heating, change(slip))

        slip, snap = _slip_of(more, lead, m.wrap.radius * m.sizes.speed)
        return Slide(speed - slip, slip, lead, snap)
    gamma = stretch(still, still, heating, change(jnp.ones_like(still)))
    slip = lead / jnp.where(1 + gamma > 0, 1 + gamma, 1.0)
    return Slide(growth + gamma * slip, slip, lead, 1 + gamma)


def _slip_of(more: Callable[[Array], Array], lead: Array, size: Array) -> tuple[Array, Array]:
    """The slip speed `v` with `v + more(v) = lead`, `more(0) = 0`, and `1 + d more/dv`.

    Where there is none it is `lead`, and the slope negative.  `size`: a typical speed
    """

    def residual(v: Array) -> tuple[Array, Array]:
        return jax.jvp(lambda v: v + more(v) - lead, (v,), (jnp.ones_like(v),))

    def newton(v: Array, _: None) -> tuple[Array, None]:
        r, slope = residual(v)
        return v - r / jnp.where(slope > 0, slope, 1.0), None

    def search(v: Array, _: None) -> tuple[Array, None]:
        return jnp.clip(newton(v, None)[0], -far, far), None

    far = jax.lax.stop_gradient(_FAR * (jnp.abs(lead) + size))
    v = jax.lax.stop_gradient(jax.lax.scan(search, jax.lax.stop_gradient(lead), None, length=_SEARCH)[0])
    for _ in range(_CARRY):  # each carries derivatives one order further
        v = newton(v, None)[0]
    r, slope = residual(v)
    off = jnp.abs(r) / size
    return jnp.where(off > _OFF, lead, v), jnp.where(off > _OFF, -jnp.minimum(off, 1.0), slope)


def band_guards(m: Any, acting: Acting, omega: Array, mode: Mode, z: Any) -> list[Array]:
    """Guards of a band: motion, upper limit, lower limit, lever, and codes."""
    band, size = mode.band, m.sizes
    forward, back, held = band == BandMode.SLIP, band == BandMode.SLIP_BACK, band == BandMode.HELD
    is_open, take_up = band == BandMode.OPEN, band == BandMode.TAKE_UP
    motion = jnp.where(mode.sense > 0, omega, -omega) / size.speed
    motion = jnp.where(is_open | held, 1.0, motion)
    # at rest a difference of tensions is one of torques
    per_newton = jnp.where(held, m.wrap.radius / size.torque, 1 / size.tension)
    bounded = (held | (band == BandMode.ELASTIC)) & ~m.locked_in(mode)
    lead = z.lead / (m.wrap.radius * size.speed)
    most = jnp.where(take_up, acting.tension, z.upper)
    high = jnp.where(bounded | take_up, (most - z.tight_tension) * per_newton, jnp.where(forward, lead, 1.0))
    low = jnp.where(bounded, (z.tight_tension - z.lower) * per_newton, jnp.where(back, -lead, 1.0))
    lever = jnp.where(is_open, -acting.tension, acting.tension) / size.tension
    more = [] if z.margin is None else [jnp.where(mode.own.locks > 0, -z.margin, z.margin)]
    for code in m.codes:
        more.append(jnp.where(slips(band), z.snap if code == BrakeCode.BAND_SNAP else z.slope, 1.0))
    return [motion, high, low, lever, *more]


def tension_of(m: Any, x: Array, mode: Mode, z: Any) -> Array:
    """`C x`, with the exact value where it follows from the slack tension."""
    return jnp.where(slips(mode.band), z.upper, m.stiffness * x)


def taut_mode(
    m: Any,
    now: Moment,
    new: Mode,
    fired: Fired,
    there: Callable[[Mode], Any],
    acting: Acting,
    rest: Any,
    found: Onset,
) -> Array:
    """Mode of an elastic band that the lever pulls, on a carrier that moves or starts to.

    - `there(mode)`: the variables in another mode;  `rest`: those at rest
    """
    old, C, locked, T_0 = now.mode.band, m.stiffness, m.locked_in(new), acting.tension
    rounding, speed = m.sizes.slight_tension, m.wrap.radius * found.omega
    was_slack = (old == BandMode.OPEN) | (old == BandMode.TAKE_UP)
    tension = tension_of(m, now.own.x, now.mode, now.z)
    # where the lever only begins to pull both limits are 0, and Ṫ_0/C lies between the speeds of the band on them
    lags = C * speed < acting.pull
    takes_up = jnp.where(found.rising, lags, tension < T_0 - rounding)
    takes_up = was_slack & (found.omega > 0) & takes_up & ~((old == BandMode.TAKE_UP) & fired[1])
    low, high = jnp.where(locked, 0.0, rest.lower), jnp.where(locked, jnp.inf, rest.upper)
    # the lever itself draws a slack band tight on a pulley that does not run into it
    tension = jnp.where(was_slack & (found.omega <= 0), jnp.maximum(tension, low), tension)
    if new.lever_piece is not None:  # late in a run the known times themselves are rounded
        steepest = jnp.maximum(jnp.abs(acting.pull), jnp.abs(now.acting.pull))
        rounding = rounding + 1e-15 * jnp.abs(now.t) * steepest * jnp.where(locked, 1.0, rest.ratio)
    # at a limit of the tension it slides if the slip speed that it would have there has the right sign; with no slip
    # speed yet, the direction in which the pulley starts decides
    at_high, at_low = tension >= high - rounding, tension <= low + rounding
    lags = lags | ((C * speed == acting.pull) & (found.direction < 0))
    back = jnp.where(at_high, at_low & lags, at_low | (old == BandMode.SLIP_BACK))
    trial, way = jnp.where(back, SLIP_BACK, SLIP), jnp.where(back, -1.0, 1.0)
    slid = there(new._replace(band=Sliding(back)))
    # a band that slides stays at its kinetic limit; at rest and elastic the static one counts
    past = way * (tension - slid.upper)
    limited = jnp.where(back, at_low, at_high) | ((old == trial) & (past >= -rounding))
    runs = (way * slid.lead > 0) | ((slid.lead == 0) & jnp.where(back, found.direction < 0, found.direction > 0))
    mode = jnp.where(limited & runs, trial, ELASTIC)
    mode = jnp.where((old == BandMode.ELASTIC) & fired[1], SLIP, mode)
    mode = jnp.where((old == BandMode.ELASTIC) & fired[2], SLIP_BACK, mode)
    sticks = ((old == BandMode.SLIP) & fired[1]) | ((old == BandMode.SLIP_BACK) & fired[2])
    mode = jnp.where(sticks, ELASTIC, mode)
    return jnp.where(takes_up, TAKE_UP, mode)


def strained(
    m: Any, omega: Array, x: Array, before: tuple[Mode, Any], after: tuple[Mode, Array]
) -> Callable[[Any], tuple[Array, Array, Array]]:
    """Elongation after a change of mode, the work of the lever in it and the heat that it sets free (J), as a function
    of the surfaces of the linings."""
    (old, z), (new, T_0), C = before, after, m.stiffness
    was_open, locked, sliding = old.band == BandMode.OPEN, m.locked_in(new), slips(new.band)
    is_open, held, elastic = new.band == BandMode.OPEN, new.band == BandMode.HELD, new.band == BandMode.ELASTIC
    T_0 = jnp.where(is_open, 0.0, T_0)
    v = jnp.where(new.sense > 0, omega, -omega) * m.wrap.radius
    back, tension = new.band == BandMode.SLIP_BACK, tension_of(m, x, old, z)
    drawn_tight = was_open | (old.band == BandMode.TAKE_UP)
    # what neither slides nor is held by friction keeps its elongation; a band that is let go springs back
    kept = jnp.where(is_open & ~was_open, 0.0, C * x)

    def of(surface: Any) -> tuple[Array, Array, Array]:
        limit = m.wrap.limit(T_0, v, surface, back, ~sliding)
        upper = T_0 * limit.ratio
        low, high = jnp.where(locked, 0.0, T_0 / limit.other), jnp.where(locked, jnp.inf, upper)
        drawn = jnp.maximum(tension, low)
        resting = jnp.where(held, jnp.where(drawn_tight, drawn, tension), jnp.where(sliding, upper, kept))
        T_n = jnp.where(elastic, jnp.minimum(drawn, high), resting)
        after = T_n / C
        drift = after - x
        return after, T_0 * drift, drift * (T_0 - 0.5 * (C * x + T_n))

    return of
