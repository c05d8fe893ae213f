"""Friction laws of one lining: `f(v, T, p)` while it slides, and the coefficient up to which it sticks."""

import abc
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._dependence import Skeleton, read_by, skeleton
from .._base._faults import Fault
from .._base._quantity import Scalar, quantity
from .._hybrid._arrays import Array


class Contact(NamedTuple):
    """What a friction law sees: slip speed `v` (m/s), surface temperature `T` (K) and pressure `p` (Pa).

    Each broadcasts over the linings; `None` where the scene does not model it.
    """

    v: Any
    T: Any = None
    p: Any = None


def continued(coefficient: Callable[[Array], Array], v: Array) -> Array:
    """A coefficient of friction at speeds `v` (m/s) signed by the sense of the slide, for `coefficient(v ≥ 0)`.

        f(−v) = 2 f(0) − f(v)

    The step on which a slide ends looks a little past `v = 0`. Equations with another slope there would spoil its
    derivative, so that the coefficient goes on through `(0, f(0))` with the slope that it has. A law never sees a
    negative speed: one that takes `|v|`, or a power of `v`, is continued as well.
    """
    past = v < 0
    f = coefficient(jnp.where(past, -v, v))
    return jnp.where(past, 2 * coefficient(jnp.zeros_like(v)) - f, f)


class AbstractFriction(eqx.Module):
    """A friction law. Its numbers are scalars or have one entry per lining.

    A law is smooth enough to differentiate, never negative, and `kinetic ≤ static`. It is asked for `v ≥ 0` only; what
    lies just past the end of a slide follows from that (`continued`). It reads from the `Contact` what it needs; what
    its coefficients do not depend on costs nothing in the integration (`reads`).
    """

    @abc.abstractmethod
    def kinetic(self, contact: Contact) -> Float[Array, "..."]:
        """Coefficient while sliding."""

    @abc.abstractmethod
    def static(self, contact: Contact) -> Float[Array, "..."]:
        """Coefficient up to which the lining sticks."""

    def governing(self, contact: Contact, static: Any) -> Float[Array, "..."]:
        """Coefficient of linings that stick (`static`, a traced bool) or slide.

        A law whose two coefficients have a factor in common may say so here, where it is then found once.
        """
        still = contact._replace(v=jnp.zeros_like(contact.v))
        return jnp.where(static, self.static(still), self.kinetic(contact))

    def faults(self, path: str) -> list[Fault]:
        """What cannot be right in this law, beyond the ranges of single numbers; a law of one's own may say nothing."""
        return []

    def temperature_range(self) -> tuple[Any, Any] | None:
        """Temperatures (K) between which the law holds, `None` without bounds; a run ends where it leaves them."""
        return None


class Reads(NamedTuple):
    """Fields of `Contact`: speed, temperature, pressure."""

    v: bool
    T: bool
    p: bool


def _coefficients(law: AbstractFriction, contact: Contact) -> tuple[Array, Array]:
    """Both coefficients as a brake uses them: what sticks has no speed."""
    return law.kinetic(contact), law.static(contact._replace(v=jnp.zeros_like(contact.v)))


def _whole_contact(n: int) -> Contact:
    one = jax.ShapeDtypeStruct((n,), np.float64)
    return Contact(one, one, one)


def reads(law: AbstractFriction, n: int, *, T: bool, p: bool) -> Reads:
    """On which fields of the contact of `n` linings the coefficients of a law depend.

    - `T`, `p`: whether there are temperatures and pressures; without them the fields are `None`, and are not read

    Found from the lowered program, once for each structure of a law; in doubt a field counts as read (`read_by`).
    """
    return _reads(skeleton(law), n, T, p)


@functools.lru_cache(maxsize=1024)
def _reads(law: Skeleton, n: int, T: bool, p: bool) -> Reads:
    whole = _whole_contact(n)
    contact = Contact(whole.v, whole.T if T else None, whole.p if p else None)
    _, found = read_by(_coefficients, law.stand_in(), contact)
    return Reads(found.v, bool(found.T), bool(found.p))


def needs(law: AbstractFriction, n: int) -> Reads:
    """Which fields of the contact of `n` linings a law cannot do without: given as `None` they make it fail."""
    return _needs(skeleton(law), n)


@functools.lru_cache(maxsize=1024)
def _needs(law: Skeleton, n: int) -> Reads:
    whole = _whole_contact(n)

    def fails(contact: Contact) -> bool:
        try:
            jax.eval_shape(_coefficients, law.stand_in(), contact)
        except Exception:  # whatever None raises in a law
            return True
        return False

    if fails(whole):  # another mistake, which the run itself will name
        return Reads(v=True, T=False, p=False)
    return Reads(v=True, T=fails(whole._replace(T=None)), p=fails(whole._replace(p=None)))


class ConstantFriction(AbstractFriction):
    """Coulomb friction, `f = f_k` sliding and `f_s = r f_k` sticking.

    - `coefficient`: `f_k`, scalar or per lining
    - `static_ratio`: `r = f_s/f_k ≥ 1`
    """

    coefficient: Scalar = quantity("1", "coefficient of friction", low=0.0, high=10.0, many=True)
    static_ratio: Scalar = quantity(
        "1", "ratio of static to kinetic friction", low=1.0, high=10.0, many=True, default=1.0
    )

    def kinetic(self, contact):
        return jnp.asarray(self.coefficient)

    def static(self, contact):
        return jnp.asarray(self.coefficient * self.static_ratio)

    def faults(self, path):
        return []


class StribeckFriction(AbstractFriction):
    """Friction that falls with the slip speed: `f(v) = f_k + (f_s − f_k) exp(−(v/v_s)^δ)`.

    - `static_coefficient` `f_s`, `kinetic_coefficient` `f_k`: scalars or per lining
    - `stribeck_speed` `v_s` in m/s, `exponent` `δ` in [1, 4] (1: Bo & Pavelescu; 2: Gaussian)

    Reference: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, *Automatica* 30 (1994) 1083–1138, eq. (3).
    """

    static_coefficient: Scalar = quantity("1", "static coefficient of friction", low=0.0, high=10.0, many=True)
    kinetic_coefficient: Scalar = quantity("1", "kinetic coefficient of friction", low=0.0, high=10.0, many=True)
    stribeck_speed: Scalar = quantity("m/s", "Stribeck speed", positive=True, many=True)
    exponent: Scalar = quantity("1", "exponent of the Stribeck curve", low=1.0, high=4.0, many=True, default=2.0)

    def kinetic(self, contact):
        # slip begins at v = 0: the slope there must be that of sliding, also of an exponent of 1
        r = jnp.where(contact.v >= 0, contact.v, 0.0) / self.stribeck_speed
        positive, n = r > 0, jnp.asarray(self.exponent)
        power = r * jnp.where(positive | (n == 1), jnp.where(positive, r, 1.0) ** (n - 1), 0.0)
        return self.kinetic_coefficient + (self.static_coefficient - self.kinetic_coefficient) * jnp.exp(-power)

    def static(self, contact):
        return jnp.asarray(self.static_coefficient)

    def faults(self, path):
        if np.any(np.asarray(self.static_coefficient) < np.asarray(self.kinetic_coefficient)):
            return [Fault(path, "the static coefficient is below the kinetic one", "static must be ≥ kinetic")]
        return []


class TabulatedFriction(AbstractFriction):
    """Measured friction over slip speed, `f(v)`, interpolated by a monotone cubic (Fritsch–Carlson).

    - `speed` (k,) in m/s, increasing from 0; `coefficient` (k,)
    - `static_ratio`: `f_s / f(0) ≥ 1`

    Beyond the last speed the last coefficient holds (stated, not extrapolated). The interpolant has a continuous
    slope, so that the table's knots need no stops of the integrator. One table serves all linings.
    """

    speed: Scalar = quantity("m/s", "slip speeds of the table", low=0.0, many=True)
    coefficient: Scalar = quantity("1", "coefficients of friction of the table", low=0.0, high=10.0, many=True)
    static_ratio: Scalar = quantity("1", "ratio of static friction to that at zero speed", low=1.0, default=1.0)

    def kinetic(self, contact):
        import interpax  # half a second that only tables pay

        speed, coefficient = jnp.asarray(self.speed), jnp.asarray(self.coefficient)
        # (no clip: at v = 0, where slip begins, it would halve the slope)
        v = jnp.where(contact.v >= 0, jnp.minimum(contact.v, speed[-1]), 0.0)
        with jax.numpy_dtype_promotion("standard"):  # the library mixes integers and floats
            return interpax.interp1d(v, speed, coefficient, method="monotonic")

    def static(self, contact):
        return jnp.asarray(self.coefficient[..., 0] * self.static_ratio)

    def faults(self, path):
        speed, coefficient = np.asarray(self.speed), np.asarray(self.coefficient)
        if speed.ndim != 1 or speed.shape != coefficient.shape or speed.size < 2:
            return [Fault(path, "the table needs speeds and coefficients of one length, at least 2")]
        if np.any(np.diff(speed) <= 0) or speed[0] != 0.0:
            return [Fault(f"{path}.speed", "the speeds must increase, from 0 upwards")]
        if np.any(coefficient > coefficient[0] * np.asarray(self.static_ratio)):
            return [Fault(path, "a coefficient of the table exceeds the static one", "raise static_ratio")]
        return []
