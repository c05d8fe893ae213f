"""Friction laws, links, profiles and loads as users write them, which several tests
share."""

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from scenes import lining_ratio

import simbrake as sb

N = 20
BETA = math.radians(13.5)
R = 0.725
J = 800.0
T_0 = 8e3
SPEED = 30.0
AT_REST = F = 0.4


class Timed(sb.friction.AbstractFriction):
    """Friction `f ξ` that comes to another one by itself, `ξ̇ = (ξ_e − ξ)/τ`."""

    coefficient: Any = sb.quantity("1", "coefficient at the start", low=0.0, default=F)
    end: Any = sb.quantity("1", "factor to which it tends", low=0.0, default=0.5)
    time: Any = sb.quantity("s", "time constant", positive=True, default=2.0)

    def start(self, n):
        return 1.0

    def rates(self, contact):
        return (self.end - contact.memory) / self.time

    def kinetic(self, contact):
        return self.coefficient * contact.memory

    def static(self, contact):
        return self.coefficient * contact.memory


class Travelled(Timed):
    """The same by the way that it slides, `ξ̇ = (ξ_e − ξ) (v/v_0)^k/τ`."""

    power: int = eqx.field(static=True, default=1)

    def rates(self, contact):
        return (self.end - contact.memory) * contact.v**self.power / self.time


class RunningIn(Timed):
    """The same by the friction work per area, `ξ̇ = (ξ_e − ξ) q/w_0` (`time`: `w_0` in
    J/m²)."""

    def rates(self, contact):
        return (self.end - contact.memory) * contact.q / self.time


def torque_of(f):
    """Torque of the linings that all slide (N·m), `R T_0 (Π − 1)`."""
    return R * T_0 * (lining_ratio(f, BETA) ** N - 1)


def falling(v):
    return AT_REST / (1 + v / SPEED)


class Derived(sb.ConstantFriction):
    """A shipped law whose coefficient is made to fall."""

    def kinetic(self, contact):
        return self.coefficient / (1 + contact.v / SPEED)


class Bump(sb.Constant):
    """A shipped profile with a short bump of its own, of the area `4 w √π` times its
    level."""

    def value(self, t, piece):
        return self.level * (1 + 4.0 * jnp.exp(-(((t - 0.3) / 0.005) ** 2)))


def of(function):
    return sb.profiles.FunctionProfile(lambda t, p: function(t))


class Quartic(sb.thermal.AbstractLink):
    """A link of one's own, `g = s (T_a − T_b)²`."""

    a: str = eqx.field(static=True)
    b: str = eqx.field(static=True)
    growth: Any = sb.quantity("W/K^3", "growth of the conductance", low=0.0)

    def conductance(self, T_a, T_b, around):
        return self.growth * (T_a - T_b) ** 2
