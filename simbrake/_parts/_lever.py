"""The brake lever: from the driller's force to the tension of the slack end."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault
from .._base._quantity import Scalar, holding, quantity
from .._hybrid._arrays import Array
from ._driller import AbstractSpeedLever
from ._duty import AbstractProfile


class Lever(AbstractProfile):
    """Slack tension of a simple band brake, whose tight end is held by a fixed anchor: moments about the fulcrum.

        T_0(t) = η F(t) l/a

    - `force`: `F(t) ≥ 0` in N, any profile;  `arm` `l` (m) of the force, `slack_arm` `a` (m) of the slack end
    - `efficiency` `η` of the linkage

    Knots and pieces are those of the force. Lever and linkage have no mass and do not stretch; what they
    stretch is part of the band's stiffness. Reference: R. S. Khurmi, J. K. Gupta, *Theory of Machines*, simple band
    brake.
    """

    force: AbstractProfile = holding("N")
    arm: Scalar = quantity("m", "arm of the force", positive=True)
    slack_arm: Scalar = quantity("m", "arm of the slack end", positive=True)
    efficiency: Scalar = quantity("1", "efficiency of the linkage", positive=True, high=1.0, default=1.0)

    @property
    def knot_count(self) -> int:
        return getattr(self.force, "knot_count", 0)

    @property
    def gain(self) -> Float[Array, ""]:
        """`T_0/F = η l/a`."""
        return jnp.asarray(self.efficiency) * self.arm / self.slack_arm

    def value(self, t, piece):
        return self.gain * self.force.value(t, piece)

    def next_knot(self, piece):
        return self.force.next_knot(piece)

    def first_piece(self, t):
        return self.force.first_piece(t)

    def no_more_turns(self, t):
        return self.force.no_more_turns(t)

    def scale(self):
        return self.gain * self.force.scale()

    def faults(self, path, low):
        if isinstance(self.force, AbstractSpeedLever):
            hint = "give it as the slack tension itself"
            return [Fault(f"{path}.force", "a lever that holds the speed gives a tension, not a force", hint)]
        found = [
            Fault(f"{path}.{name}", f"has the shape {np.shape(value)}", "give one number")
            for name, value in (("arm", self.arm), ("slack_arm", self.slack_arm), ("efficiency", self.efficiency))
            if np.shape(value) != ()
        ]
        return found or self.force.faults(f"{path}.force", None if low is None else low / float(self.gain))


def differential_lever_tension(force: Any, arm: Any, slack_arm: Any, tight_arm: Any, ratio: Any) -> Float[Array, "..."]:
    """Slack tension (N) in full slip of a differential brake: both ends of the band on the lever, the tight one helps.

        T_0 a − T_n b = F l,   T_n = Π T_0   →   T_0 = F l/(a − b Π)

    - `force` `F` (N), its `arm` `l`, `slack_arm` `a`, `tight_arm` `b` (m); `ratio` `Π = T_n/T_0`

    With `a ≤ b Π` the brake locks itself: no force is needed, and the tension is `inf`. Statics only: in a scene the
    lever of `Lever` has its tight end on a fixed anchor. Reference: Khurmi & Gupta, differential band brake.
    """
    left = jnp.asarray(slack_arm) - jnp.asarray(tight_arm) * jnp.asarray(ratio)
    holds = left > 0
    return jnp.where(holds, jnp.asarray(force) * arm / jnp.where(holds, left, 1.0), jnp.inf)
