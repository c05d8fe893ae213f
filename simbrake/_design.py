"""The parts of a brake: what could be weighed."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._friction import AbstractFriction, Contact
from ._quantity import Fault, Scalar, quantity


class Pulley(eqx.Module):
    """The brake pulley and all that turns with its shaft.

    - `radius` `R` of the friction track (m); `inertia` `J` about the shaft (kg·m²), drum included, hook load not
    """

    radius: Scalar = quantity("m", "radius of the friction track", positive=True)
    inertia: Scalar = quantity("kg*m^2", "inertia about the shaft", positive=True)


class Segments(eqx.Module):
    """The band between the linings, where each of them moves for itself (model §3.1, the resolved chain).

    - `stiffness` `K_i` (N/m) between lining `i` and `i + 1`, one number or (n − 1,); the segment to the anchor is the
      band's own `stiffness`
    - `damping_ratio` `ζ`: `D_i = 2 ζ √(K_i m̄_i)` with `m̄_i` the mean mass of the two linings it joins
    - `anchor_damping` `D_n` (N·s/m) of the segment to the anchor
    """

    stiffness: Scalar = quantity("N/m", "stiffness of the band between two linings", positive=True)
    damping_ratio: Scalar = quantity("1", "share of critical damping between two linings", low=0.0, default=0.05)
    anchor_damping: Scalar = quantity("N*s/m", "damping of the segment to the anchor", low=0.0, default=0.0)


class Band(eqx.Module):
    """The brake band.

    - `radius` `R_b` (m) of the circle on which its tension acts: track radius, lining and half the band
    - `stiffness` `C` (N/m): tension of the tight end per unit elongation, band, anchor and linkage in series;
      `None` for a rigid band, which slips from the moment the lever pulls
    - `segments`: resolves the band into a chain of linings that move for themselves; `stiffness` is then that of the
      segment to the anchor. `None`: linings follow the band as a whole
    """

    radius: Scalar = quantity("m", "radius of the band circle", positive=True)
    stiffness: Scalar | None = quantity("N/m", "stiffness at the tight end", positive=True, default=None)
    segments: Segments | None = None


class Lining(eqx.Module):
    """`n` linings as one object with a leading axis, counted from the slack to the tight end.

    - `angle` `β_i` (n,) in rad: central angle of each;  `friction`: its law, with numbers for all or per lining
    - `area` `A_i` (m²), a number or (n,): needed where pressure matters
    - `mass` `m_i` (kg), a number or (n,): needed where the band is resolved into `segments`, else without effect
    """

    friction: AbstractFriction
    angle: Scalar = quantity("rad", "central angle of a lining", positive=True, high=math.pi * (1 - 1e-9))
    area: Scalar | None = quantity("m^2", "area of a lining", positive=True, default=None)
    mass: Scalar | None = quantity("kg", "mass of a lining and its band", positive=True, default=None)

    @property
    def count(self) -> int:
        return int(jnp.shape(self.angle)[0])

    @property
    def wrap(self) -> Float[Array, ""]:
        """Wrap angle `Σβ_i` in rad."""
        return jnp.sum(jnp.asarray(self.angle))


def uniform_linings(
    count: int, wrap: float, friction: AbstractFriction, area: float | None = None, mass: float | None = None
) -> Lining:
    """`count` equal linings over the angle `wrap` (rad); each of the `area` (m²) if pressure matters, of the `mass`
    (kg) in a chain."""
    return Lining(angle=np.full(count, wrap / count), friction=friction, area=area, mass=mass)


class Brake(eqx.Module):
    """A band-shoe brake: pulley, band and linings."""

    pulley: Pulley
    band: Band
    linings: Lining

    def faults(self, path: str) -> list[Fault]:
        """What does not fit together, beyond the ranges of single numbers (concrete values only)."""
        found = self.linings.friction.faults(f"{path}.linings.friction")
        angle = np.asarray(self.linings.angle)
        where = f"{path}.linings.angle"
        if angle.ndim != 1 or angle.size == 0:
            return [*found, Fault(where, "a list of angles is needed, one per lining", "one lining: [0.5]")]
        if np.sum(angle) > 2 * math.pi * (1 + 1e-12):
            found.append(
                Fault(where, f"the linings span {math.degrees(np.sum(angle)):.1f}°", "more than the pulley has")
            )
        if np.all(np.isfinite([self.band.radius, self.pulley.radius])) and self.band.radius < self.pulley.radius:
            found.append(
                Fault(
                    f"{path}.band.radius",
                    f"{float(self.band.radius):g} m is inside the track of {float(self.pulley.radius):g} m",
                    "the band circle is the track radius + lining + half the band",
                )
            )
        if self.linings.friction.pressure_dependent and self.linings.area is None:
            found.append(Fault(f"{path}.linings.area", "is missing", "the friction law looks at the pressure"))
        found += _faults_of_shapes(self.linings, f"{path}.linings.friction", angle.size)
        return found + self._faults_of_segments(path, angle.size)

    def _faults_of_segments(self, path: str, n: int) -> list[Fault]:
        band, mass, found = self.band, self.linings.mass, []
        if band.segments is None:
            if mass is not None:
                hint = "linings move for themselves only where the band has `segments`"
                found.append(Fault(f"{path}.linings.mass", "has no effect", hint))
            return found
        if band.stiffness is None:
            hint = "with segments it is the stiffness of the one to the anchor"
            found.append(Fault(f"{path}.band.stiffness", "is missing", hint))
        if mass is None:
            found.append(Fault(f"{path}.linings.mass", "is missing", "each lining of a chain moves for itself"))
        elif np.shape(mass) not in ((), (n,)):
            found.append(Fault(f"{path}.linings.mass", f"does not fit {n} linings", f"give one number, or {n}"))
        for name in ("stiffness", "damping_ratio"):
            if np.shape(getattr(band.segments, name)) not in ((), (n - 1,)):
                where, what = f"{path}.band.segments.{name}", f"does not fit {n} linings"
                found.append(Fault(where, what, f"give one number, or {n - 1}, one between each two"))
        return found


def _faults_of_shapes(linings: Lining, path: str, n: int) -> list[Fault]:
    try:
        one = jax.ShapeDtypeStruct((n,), np.float64)
        still = Contact(v=one, T=one, p=one)
        shape = jax.eval_shape(linings.friction.kinetic, still).shape
        if np.broadcast_shapes(shape, (n,)) != (n,):
            raise ValueError
    except (TypeError, ValueError, IndexError):
        return [Fault(path, f"its numbers do not fit {n} linings", f"give one number, or a list of {n}")]
    return []
