"""A small system of guards given as functions of time."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp

from simbrake.hybrid import AbstractHybridSystem


class Timed(AbstractHybridSystem):
    """`ẏ = 1` from 0 and guards given as functions of `t`; every firing moves that guard's count in the mode by one.

    `corner`, if finite, is a known time at which the slope changes to 2.
    """

    functions: tuple = eqx.field(static=True)
    corner: Any = jnp.inf
    repeat: bool = eqx.field(static=True, default=False)

    def rhs(self, t, y, mode):
        return jnp.where(mode[1] > 0, 2.0, 1.0) * jnp.ones_like(y)

    def guards(self, t, y, mode):
        values = jnp.stack([fn(t) for fn in self.functions])
        return jnp.where((mode[0] > 0) & (not self.repeat), 1.0, values)

    def transition(self, t, y, mode, fired, at_stop):
        return (mode[0] + fired.astype(jnp.int32), mode[1] + at_stop.astype(jnp.int32)), 0

    def reset(self, t, y, before, after):
        return y

    def next_stop(self, mode):
        return jnp.where(mode[1] > 0, jnp.inf, self.corner)

    def scales(self):
        return 1.0
