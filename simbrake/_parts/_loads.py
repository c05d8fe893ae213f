"""What drives the pulley: hook, given torque, drag, and a string run in stand by stand."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float, Int

from .._base._quantity import Scalar, holding, quantity, whole
from .._hybrid._arrays import Array
from ._duty import AbstractProfile, Constant, Repeated

GRAVITY = 9.80665  # m/s², standard acceleration of free fall (3rd CGPM, 1901)


class AbstractLoad(eqx.Module):
    """What drives the pulley: a torque on its shaft, positive in the braking direction of rotation, and an inertia."""

    #: the profile whose known times the load has
    profile: eqx.AbstractVar[AbstractProfile]

    @abc.abstractmethod
    def torque(self, t: Float[Array, ""], omega: Float[Array, ""], piece: Int[Array, ""]) -> Float[Array, ""]:
        """`M_load(t, ω)` in N·m."""

    @abc.abstractmethod
    def inertia(self) -> Scalar | float:
        """Inertia it adds to the shaft at the start, in kg·m²."""

    def added_inertia(self, piece: Int[Array, ""]) -> Array | None:
        """Inertia beyond that of the start, where the load changes in a run; `None`: it never does."""
        return None

    @abc.abstractmethod
    def travel(self) -> Scalar | None:
        """Travel of the hook per radian of the pulley, in m, or `None`."""


class TorqueLoad(AbstractLoad):
    """A given torque with linear drag, `M_load = M(t) − c ω`.

    - `profile`: `M(t)` in N·m; `drag` `c` in N·m·s
    """

    profile: AbstractProfile = holding("N*m", default_factory=lambda: Constant(0.0))
    drag: Scalar = quantity("N*m*s", "drag torque per unit of speed", low=0.0, default=0.0)

    def torque(self, t, omega, piece):
        return self.profile.value(t, piece) - self.drag * omega

    def inertia(self):
        return 0.0

    def travel(self):
        return None


class HookLoad(AbstractLoad):
    """A load on the hook, lowered through the tackle: `M_load = m g r_d/n`, `J_load = m (r_d/n)²`, travel `r_d φ/n`.

    - `mass` `m` of all that hangs on the hook (kg); `drum_radius` `r_d` (m) to the rope; `line_count` `n` of the tackle
    - `gravity` `g` (m/s²); `drag` (N·m·s) as of bearings and an auxiliary brake

    Ropes are rigid and without weight, the tackle without loss.
    """

    mass: Scalar = quantity("kg", "mass on the hook", low=0.0)
    drum_radius: Scalar = quantity("m", "radius of the drum to the rope", positive=True)
    line_count: Scalar = quantity("1", "number of lines of the tackle", low=1.0)
    gravity: Scalar = quantity("m/s^2", "acceleration of free fall", positive=True, default=GRAVITY)
    drag: Scalar = quantity("N*m*s", "drag torque per unit of speed", low=0.0, default=0.0)

    def torque(self, t, omega, piece):
        return self.mass * self.gravity * self.travel() - self.drag * omega

    def inertia(self):
        return self.mass * self.travel() ** 2

    def travel(self):
        return self.drum_radius / self.line_count

    @property
    def profile(self):
        return Constant(0.0)


class TrippingLoad(AbstractLoad):
    """A string run into the hole stand by stand: in each cycle it hangs on the hook for a while, then on the slips.

        m(t) = m_e + (m_s + k Δm) while it hangs in cycle k = 0…count − 1, else m_e;   M_load = m g r_d/n − c ω

    - `empty` `m_e`: hook and travelling block (kg); `string` `m_s`: string of the first cycle (kg); `stand` `Δm` (kg)
    - `taken`, `set`: times in a cycle of `period` (s) at which the hook takes the string, and it is set into the slips
    - `drum_radius`, `line_count`, `gravity`, `drag`: as in `HookLoad`

    At a change of mass in motion the speed stays: what comes onto the hook brings its energy (booked as load work).
    """

    empty: Scalar = quantity("kg", "mass of hook and block", positive=True)
    string: Scalar = quantity("kg", "mass of the string in the first cycle", low=0.0)
    stand: Scalar = quantity("kg", "mass of one stand", low=0.0)
    taken: Scalar = quantity("s", "time in the cycle at which the hook takes the string", low=0.0)
    set: Scalar = quantity("s", "time in the cycle at which the string is set into the slips", positive=True)
    period: Scalar = quantity("s", "length of a cycle", positive=True)
    drum_radius: Scalar = quantity("m", "radius of the drum to the rope", positive=True)
    line_count: Scalar = quantity("1", "number of lines of the tackle", low=1.0)
    count: int = whole("number of cycles", high=1_000_000)
    gravity: Scalar = quantity("m/s^2", "acceleration of free fall", positive=True, default=GRAVITY)
    drag: Scalar = quantity("N*m*s", "drag torque per unit of speed", low=0.0, default=0.0)

    @property
    def profile(self):
        # its values bear the scale of the greatest torque
        most = (self.empty + self.string + (self.count - 1) * self.stand) * self.gravity * self.travel()
        times = jnp.stack([jnp.asarray(self.taken, jnp.float64), jnp.asarray(self.set, jnp.float64)])
        return Repeated(times, jnp.stack([most, most]), self.period, self.count)

    def _mass(self, piece: Int[Array, ""]) -> Array:
        passed = jnp.asarray(piece, jnp.int32) - 1
        hangs = (passed >= 0) & (passed % 2 == 0)
        return self.empty + jnp.where(hangs, self.string + (passed // 2).astype(jnp.float64) * self.stand, 0.0)

    def torque(self, t, omega, piece):
        return self._mass(piece) * self.gravity * self.travel() - self.drag * omega

    def inertia(self):
        return self.empty * self.travel() ** 2

    def added_inertia(self, piece):
        return (self._mass(piece) - self.empty) * self.travel() ** 2

    def travel(self):
        return self.drum_radius / self.line_count
