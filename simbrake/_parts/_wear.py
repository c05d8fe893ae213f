"""Wear of the linings: how much of them a newton over a metre takes away, and what the wear of a scene is told."""

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault
from .._base._quantity import Scalar, as_number, leaves, quantity
from .._hybrid._arrays import Array
from ._material import ROOM

#: molar gas constant (J/(mol·K)), CODATA 2018
GAS_CONSTANT = 8.31446261815324


class AbstractWearRate(eqx.Module):
    """Wear rate `I(T)` in m³/(N·m) = 1/Pa: volume worn off per newton of load and metre of slip (Archard).

    Called as `rate(p, v, T)` like the functions that `simbrake.wear` takes: pressure (Pa), slip speed (m/s), and the
    temperature (K) of the rubbing face, `None` where the scene has none: then the law is at its reference temperature.
    """

    def __call__(self, p: Any, v: Any, T: Any) -> Float[Array, "..."]:
        return self.at(T)

    @abc.abstractmethod
    def at(self, T: Any) -> Float[Array, "..."]:
        """The rate at the temperature `T` (K), or at the reference temperature for `None`."""


def _rate_at(words: str) -> Any:
    return quantity("m^3/(N*m)", f"wear rate {words}".rstrip(), low=0.0, many=True)


class ConstantWear(AbstractWearRate):
    """`I = k`, whatever the temperature.

    - `coefficient` `k` (m³/(N·m)): one number, or one per lining

    Reference: J. F. Archard, *J. Appl. Phys.* 24 (1953) 981.
    """

    coefficient: Scalar = _rate_at("")

    def at(self, T):
        return jnp.asarray(self.coefficient)


class LinearWear(AbstractWearRate):
    """`I = k max(0, 1 + s (T − T_r))`: the first term of any dependence on the temperature.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `slope` `s` (1/K)
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    slope: Scalar = quantity("1/K", "relative rise of the wear rate per kelvin", many=True)
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T):
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.maximum(1 + self.slope * (T - self.reference), 0.0)


class ExponentialWear(AbstractWearRate):
    """`I = k exp((T − T_r)/ΔT)`: the rate grows by the factor e over every `ΔT`.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `rise` `ΔT` (K)

    Reference: S. K. Rhee, *Wear* 29 (1974) 391: above some 230 °C the wear of organic linings grows exponentially.
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    rise: Scalar = quantity(
        "K",
        "difference of temperature over which the wear rate grows e-fold",
        positive=True,
        difference=True,
        many=True,
    )
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T):
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.exp((T - self.reference) / self.rise)


class ArrheniusWear(AbstractWearRate):
    """`I = k exp[(E/R)(1/T_r − 1/T)]`: what binds the lining is decomposed by heat.

    - `coefficient` `k` (m³/(N·m)) at the `reference` `T_r` (K);  `energy` `E` (J/mol): activation energy

    Reference: S. K. Rhee, *Wear* 29 (1974) 391, for resin-bonded linings.
    """

    coefficient: Scalar = _rate_at("at the reference temperature")
    energy: Scalar = quantity("J/mol", "activation energy", low=0.0, many=True)
    reference: Scalar = quantity("K", "temperature at which the coefficient holds", positive=True, default=ROOM)

    def at(self, T):
        k = jnp.asarray(self.coefficient)
        return k if T is None else k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.reference - 1 / T))


class ThresholdWear(AbstractWearRate):
    """Resin-bonded linings: constant up to a threshold, above it the decay of the resin after Arrhenius.

        I = k for T ≤ T_t,   I = k exp[(E/R)(1/T_t − 1/T)] above

    - `coefficient` `k` (m³/(N·m)) below the `threshold` `T_t` (K);  `energy` `E` (J/mol): activation energy

    Reference: T. Liu, S. K. Rhee, *Wear* 37 (1976) 291; threshold about 230 °C.
    """

    coefficient: Scalar = _rate_at("below the threshold")
    threshold: Scalar = quantity("K", "temperature above which wear grows", positive=True, default=503.15)
    energy: Scalar = quantity("J/mol", "activation energy", low=0.0, many=True, default=40e3)

    def at(self, T):
        k = jnp.asarray(self.coefficient)
        hot = self.threshold if T is None else jnp.maximum(T, self.threshold)
        return k * jnp.exp(self.energy / GAS_CONSTANT * (1 / self.threshold - 1 / hot))


def _as_rate(rate: Any) -> Any:
    """A bare number is a constant rate."""
    return rate if rate is None or isinstance(rate, AbstractWearRate) else ConstantWear(as_number(rate))


class Wear(eqx.Module):
    """Wear of the linings as a part of a scene; without it a scene has no wear states, equations or cost.

        ḣ_i = I(T_i) p_i |v_i|,   p_i = N_i/A_i                                                      (model §7; Archard)

    - `rate` `I`: law of the linings, or a number; `T_i` is the temperature that their friction law sees (the scene's
      heat part), else the law's reference temperature. On a staged brake the faces that rub on the band
    - `internal`: the same for the faces of a staged brake's linings that rub on the rim; `None`: they do not wear
    - `worn` (m), a number or (n,): thickness that had been worn off before the run;  `permissible` (m): greatest wear
    - `thickness` (m): of a new lining
    - `geometry`, `heat`: whether the thickness worn before the run lowers the band circle, and the lining in the heat
      part; `take_up_speed` (m/s): speed at which the lever draws in the slack that wear has left (`simbrake.worn_scene`
      has the formulas)
    - `turned_at` (s), one time or a list: the band is turned end for end, so that the lining of the tight end comes to
      the slack end; for linings that are alike, on a brake at rest

    What a run itself wears off does not act back on it: a braking takes micrometres of some ten millimetres.
    """

    rate: AbstractWearRate = eqx.field(converter=_as_rate)
    internal: AbstractWearRate | None = eqx.field(converter=_as_rate, default=None)
    worn: Scalar = quantity("m", "thickness worn off before the run", low=0.0, many=True, default=0.0)
    permissible: Scalar | None = quantity("m", "permissible wear", positive=True, many=True, default=None)
    thickness: Scalar | None = quantity("m", "thickness of a new lining", positive=True, default=None)
    geometry: bool = eqx.field(static=True, default=False)
    heat: bool = eqx.field(static=True, default=False)
    take_up_speed: Scalar | None = quantity(
        "m/s", "speed at which the lever draws in slack of the band", positive=True, default=None
    )
    turned_at: Scalar | None = quantity("s", "times at which the band is turned end for end", many=True, default=None)

    def faults(self, path: str, n: int) -> list[Fault]:
        """What does not fit `n` linings, beyond the ranges of single numbers (concrete values only)."""
        found = []
        laws = [*leaves(self.rate, f"{path}.rate")]
        laws += [] if self.internal is None else leaves(self.internal, f"{path}.internal")
        each = [(leaf.path, leaf.value) for leaf in laws]
        each += [(f"{path}.worn", self.worn), (f"{path}.permissible", self.permissible)]
        for where, value in each:
            if value is not None and np.shape(value) not in ((), (n,)):
                found.append(Fault(where, f"does not fit {n} linings", f"give one number, or a list of {n}"))
        if not found and self.thickness is not None:
            i = int(np.argmax(np.broadcast_to(np.asarray(self.worn), (n,)) - np.asarray(self.thickness)))
            worn = float(np.broadcast_to(np.asarray(self.worn), (n,))[i])
            if worn >= float(self.thickness):
                what = f"{worn:g} m worn off lining {i + 1} leave nothing of its {float(self.thickness):g} m"
                found.append(Fault(f"{path}.worn", what))
        return found
