"""The law of sticking, once for every kind of brake: when a contact sticks or slides,
and what comes after an event.

    sticks (s = 0):    v = 0   while   F_low ≤ F ≤ F_high
    slides (s = ±1):   F = s F_k   while   s v > 0

`s` is the sense of the contact, `F` the force or torque that it passes on, `v` its
slip.
"""

import jax.numpy as jnp
from jaxtyping import Bool, Int

from ..hybrid.arrays import Array, Floats, Vector
from .mechanism import OPEN, Mode
from .sliding import Known, where_static


def driven_way(force: Array) -> Int[Array, "..."]:
    """The sense (±1) in which a force drives."""
    return jnp.where(force < 0, -1, 1).astype(jnp.int32)


def limit_margins(force: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Margins of a contact that sticks to its limits: `F_high − F`, `F − F_low`."""
    return high - force, force - low


def contact_margin(sense: Int[Array, "..."], left: Array, slip: Array) -> Floats:
    """Guard of a contact: the friction `left` while it sticks, else its slip in its
    sense; both over typical sizes."""
    return jnp.where(sense == 0, left, sense.astype(slip.dtype) * slip)


def sense_after(
    sense: Int[Array, "..."], fired: Bool[Array, "..."], force: Array
) -> Int[Array, "..."]:
    """The sense after an event in which the guard of the contact `fired` or not.

    A contact that breaks loose slides the way of the `force` that it passed on; one
    that has lost its slip sticks. If the force to hold it exceeds its limit, its guard
    is negative and fires at the same instant.
    """
    return jnp.where(fired, jnp.where(sense == 0, driven_way(force), 0), sense).astype(
        jnp.int32
    )


def exceeded(force: Array, low: Array, high: Array, slack: Array) -> Int[Array, "..."]:
    """Limit of sticking that a force exceeds by more than `slack`: 1 the upper, −1 the
    lower, else 0."""
    return jnp.where(force > high + slack, 1, jnp.where(force < low - slack, -1, 0))


def acceleration(
    load: Array, torque: Array, inertia: Array, held: Known = False
) -> Floats:
    """`ω̇` (rad/s²) of a body and all that sticks to it, `J ω̇ = M_load − M`; exactly 0
    where it is held."""
    return where_static(held, 0.0, (load - torque) / inertia)


def speed_after(omega: Array, before: Mode, after: Mode, rests: Array) -> Array:
    """The speed just after a change of mode: exactly 0 where the pulley comes to rest
    or turns round."""
    turned = (before.band != OPEN) & (after.sense != before.sense)
    return jnp.where(rests | turned, 0.0, omega)


# --- a lining on the rim ------------------------------------------------------------


def rim_margin(lifted: Int[Array, " n"], normal: Vector) -> Vector:
    """Load (N) of each lining on the rim, of one that has lifted off what it lacks to
    touch again."""
    return jnp.where(lifted != 0, -normal, normal)


def lifted_after(
    lifted: Int[Array, " n"],
    margin: Vector,
    fired: Bool[Array, " n"],
    rests: Array,
    slack: Array,
) -> Int[Array, " n"]:
    """Linings off the rim after an event: one changes where its guard fired or its load
    has jumped past 0.

    - `margin`: `rim_margin` in the new mode, rounded by `slack`
    - `rests`: linings without speed, which touch the rim
    """
    crossed = fired | (margin < -slack)
    return jnp.where(rests, 0, lifted ^ crossed.astype(jnp.int32)).astype(jnp.int32)
