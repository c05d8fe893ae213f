"""Friction laws of a lining, `f(v, T, p)`, with fade, pressure and internal states."""

import abc
import dataclasses
import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, PyTree

from ._base._arguments import faults_of_tracing
from ._base._compiling import read_by
from ._base._corners import clipped, greater, lesser, rounded
from ._base._faults import Fault, Faults, Issues, input_error
from ._base._part import Part, part, positive_quantity, quantity, short_for
from ._base._quantity import IndexedBy, Scalar, shown
from ._base._store import cached_by_structure
from .hybrid.arrays import Array, Floats, ScalarArray, TwoArrays, Vector
from .hybrid.struct import AbstractVar, struct_field
from .phases import AbstractEnd, AtStop, AtTemperature, as_end
from .profiles import AbstractProfile, faults_of_sign

__all__ = [
    "AbstractFactor",
    "AbstractFriction",
    "ChangingFriction",
    "ConstantFriction",
    "Contact",
    "FrictionChange",
    "FrictionWithMemory",
    "LinearFade",
    "MemoryProcess",
    "PressureFactor",
    "ProductFriction",
    "StribeckFriction",
    "TabulatedFade",
    "TabulatedFriction",
]

# --- factors of a coefficient, and the contact that they see -------------------------


#: molar gas constant (J/(mol·K)), CODATA 2018
GAS_CONSTANT = 8.31446261815324


class Contact(NamedTuple):
    """Inputs of a friction law: slip speed `v` (m/s), surface temperature `T` (K) and
    pressure `p` (Pa).

    - `v` under a band as a whole is that at the band's circle, `R_band ω` less the
      speed of an elastic band. It is `R_band/R_rim` times that at the rim, as the
      friction acts at `R_band` in the torque (model §2)
    - `memory`: states of the law, as `start` gives them, (n,) each
    - `q = f p v` (W/m²): friction power per area of the face, for rates of states only.
      Under a band the friction heat over the area is `1/cos(β/2)` times that: friction
      acts on the band circle
    - `factor` of friction by given changes over time, (n,)

    Each broadcasts over the linings; `None` where the scene does not model it.

    Example:
        >>> sb.ConstantFriction(0.35).kinetic(sb.friction.Contact(np.float64(2.0))).item()
        0.35
    """

    v: Any
    T: Any = None
    p: Any = None
    memory: Any = None
    q: Any = None
    factor: Any = None


#: temperatures (K) between which a law or factor holds
Bounds: TypeAlias = tuple[ScalarArray, ScalarArray]


def _alike(a: Array, b: Array) -> Array:
    """Whether two chords have one sense.

    One of 0 counts as rising at both of its ends: these are then on the same side of
    the corner. Two of 0 differ, as the value between them moves them apart, whichever
    way.
    """
    return ((a >= 0) == (b >= 0)) & ((a != 0) | (b != 0))


def _end_slope(h: TwoArrays, chord: TwoArrays) -> Array:
    """Slope at an end by the parabola through three points, the nearer interval and
    chord first.

    It is 0 where the parabola would leave the sense of the first chord. A second chord
    of the other sense is left out: the slope then depends on the values like a straight
    line wherever both chords are 0, as on a plateau.
    """
    alike = _alike(*chord)
    slope = ((2 * h[0] + h[1]) * chord[0] - h[0] * jnp.where(alike, chord[1], 0.0)) / (
        h[0] + h[1]
    )
    return jnp.where(alike & (slope * chord[0] <= 0), 0.0, slope)


def _node_slopes(h: Array, chord: Array) -> Array:
    """Slopes (k,) of a monotone cubic at its points, for the intervals `h` (k − 1,) and
    the slopes of their chords.

    Inside the weighted harmonic mean of both chords, 0 where they differ in sense or
    one of them is 0.
    """
    if h.shape[0] == 1:
        return jnp.concatenate([chord, chord])
    before = 2 * h[1:] + h[:-1]
    after = h[1:] + 2 * h[:-1]
    alike = _alike(chord[:-1], chord[1:])
    whole = jnp.where(alike, before * chord[1:] + after * chord[:-1], 1.0)
    inside = jnp.where(alike, (before + after) * (chord[:-1] * chord[1:]) / whole, 0.0)
    first, last = (
        _end_slope((h[a], h[b]), (chord[a], chord[b])) for a, b in ((0, 1), (-1, -2))
    )
    return jnp.concatenate([first[None], inside, last[None]])


def interpolated(x: Any, places: Scalar, table: Scalar) -> Array:
    """A monotone cubic through the values (k,) of a `table` at its `places` (k,), at
    `x` of any shape; beyond the first and the last the value there.

    Its derivatives by values and places are those of one side at ties, as on a plateau
    of equal values.

    Reference: F. N. Fritsch, J. Butland, *SIAM J. Sci. Stat. Comput.* 5 (1984) 300;
    ends: C. Moler, *Numerical Computing with MATLAB* (2004), section 3.6.
    """
    at = jnp.asarray(places)
    values = jnp.asarray(table)
    within = clipped(x, at[0], at[-1])
    x = within.reshape(-1)
    h = jnp.diff(at)
    chord = jnp.diff(values) / h
    d = _node_slopes(h, chord)
    square = (3 * chord - 2 * d[:-1] - d[1:]) / h
    cube = (d[:-1] + d[1:] - 2 * chord) / (h * h)
    pieces = jnp.stack([at[:-1], values[:-1], d[:-1], square, cube], axis=1)
    # a product with a mask in place of indexed loads, which are slow in a loop and
    # backwards
    passed = jnp.sum(x[:, None] >= at[None, 1:-1], axis=1, dtype=jnp.int32)
    in_piece = passed[:, None] == jnp.arange(h.shape[0], dtype=jnp.int32)
    start, value, slope, square, cube = (in_piece.astype(jnp.float64) @ pieces).T
    s = x - start
    return (value + s * (slope + s * (square + s * cube))).reshape(within.shape)


def is_table(at: Scalar, values: Scalar) -> bool:
    return np.ndim(at) == 1 and np.shape(at) == np.shape(values) and np.size(at) >= 2


class AbstractFactor(Part):
    """A factor of a coefficient of friction, 1 where the base law was measured. Never
    negative."""

    @abc.abstractmethod
    def factor(self, contact: Contact) -> Floats:
        """The factor at surface temperature `T` (K) and pressure `p` (Pa)."""

    def temperature_range(self) -> Bounds | None:
        """Temperatures (K) between which it holds, `None` if there are no bounds."""
        return None


class LinearFade(AbstractFactor):
    """Fade above a permissible temperature: `max(φ_min, 1 − s (T − T_p)₊)`.

    - `slope` `s` (1/K), `above` `T_p` (K), `floor` `φ_min`
    - `blend` `w` (K): half-width over which both corners are rounded; `None` or 0:
      corners, which cost steps at tight tolerances where many linings pass them one
      after the other, and derivatives half of their digits

    Within `±w` of a corner `x₊` is `w u⁵ (14 − 28 u + 20 u² − 5 u³)`,
    `u = (x + w)/(2 w)`, with four continuous derivatives; at the floor the same with
    `s w` for `w`.

    Example:
        >>> fade = sb.LinearFade(slope=1.5e-3, above="120 degC", floor=0.6)
        >>> sb.friction.ProductFriction(0.35, (fade,)).base
        ConstantFriction(coefficient=0.35, static_ratio=1)
    """

    slope: Scalar = quantity(
        "1/K", "loss of friction per kelvin", low=0.0, many=True, typical=1e-3
    )
    above: Scalar = quantity(
        "K", "temperature at which fade begins", low=0.0, many=True
    )
    floor: Scalar = quantity("1", "minimum factor", 0.0, 1.0, many=True, default=0.0)
    blend: Scalar | None = quantity(
        "K",
        "half-width of the rounded corner",
        low=0.0,
        difference=True,
        many=True,
        default=None,
    )

    def factor(self, contact: Contact) -> Floats:
        w = None if self.blend is None else jnp.asarray(self.blend)
        s = self.slope
        lost = s * rounded(contact.T - self.above, w)
        return self.floor + rounded(1 - lost - self.floor, None if w is None else s * w)


class TabulatedFade(AbstractFactor):
    """A measured factor over the temperature, interpolated by a monotone cubic
    (Fritsch–Carlson).

    - `temperature` (k,) in K, increasing; `values` (k,)

    The table is not extrapolated: a run that leaves it ends with the code
    `outside_table`.

    Example:
        >>> sb.friction.TabulatedFade([293.15, 573.15], [1.0, 0.8])
        TabulatedFade(temperature=[20, 300] °C, values=[1, 0.8])
    """

    temperature: Scalar = quantity(
        "K", "temperatures of the table", low=0.0, many=IndexedBy.ROWS
    )
    values: Scalar = quantity(
        "1", "factors of the table", 0.0, 10.0, many=IndexedBy.ROWS
    )

    def factor(self, contact: Contact) -> Floats:
        return interpolated(contact.T, self.temperature, self.values)

    def faults(self, path: str) -> Faults:
        if not is_table(self.temperature, self.values):
            return [
                Fault(
                    path,
                    "the table needs temperatures and factors of one length, at least 2",
                )
            ]
        rises = np.all(np.diff(np.asarray(self.temperature, float)) > 0)
        return (
            []
            if rises
            else [Fault(f"{path}.temperature", "the temperatures must increase")]
        )

    def temperature_range(self) -> Bounds | None:
        T = jnp.asarray(self.temperature)
        return T[0], T[-1]


class PressureFactor(AbstractFactor):
    """Friction that falls (or rises) with pressure: `(1 + p/p_r)^{−m}`.

    - `reference` `p_r` (Pa), `exponent` `m`

    Example:
        >>> sb.friction.PressureFactor("1 MPa", 0.1)
        PressureFactor(reference=1 MPa, exponent=0.1)
    """

    reference: Scalar = positive_quantity("Pa", "reference pressure", many=True)
    exponent: Scalar = quantity("1", "exponent of the pressure", -1.0, 1.0, many=True)

    def factor(self, contact: Contact) -> Floats:
        return (1 + contact.p / self.reference) ** (-self.exponent)


class MemoryProcess(Part):
    """One way in which a lining's friction changes with its history:
    `ċ = (c_e φ(T) − c) (k e^{−E/(R_g T)} + q/w_0)`.

    - `end` `c_e`: factor of friction to which it tends; `fade` `φ(T)`: how that depends
      on temperature, 1 without
    - `rate` `k` (1/s) and `activation` energy `E` (J/mol): how fast with time; `k` at
      all temperatures without `E`
    - `work` `w_0` (J/m²): friction work per area of the face, `∫ f p v dt`, in which
      the distance to `c_e φ` falls to 1/e

    Recovery with the time constant `τ(T) = e^{E/(R_g T)}/k`:
    `MemoryProcess(1.0, LinearFade(…), rate=1/τ)`. Burn-off of binders:
    `MemoryProcess(0.0, rate=A, activation=E)`. Running-in:
    `MemoryProcess(c_1, work=w_0)`.

    Example:
        >>> sb.friction.MemoryProcess(0.9, work="2 MJ/m^2")
        MemoryProcess(end=0.9, work=2000000 J/m²)
    """

    end: Scalar = quantity(
        "1", "factor of friction to which it tends", 0.0, 10.0, many=True
    )
    fade: AbstractFactor | None = None
    rate: Scalar | None = quantity("1/s", "rate", low=0.0, many=True, default=None)
    activation: Scalar | None = quantity(
        "J/mol", "activation energy", low=0.0, many=True, typical=2e4, default=None
    )
    work: Scalar | None = positive_quantity(
        "J/m^2", "friction work per area of running-in", many=True, default=None
    )

    def change(self, c: Array, contact: Contact) -> Array:
        """Rate (1/s) of the factor `c`."""
        end = jnp.asarray(self.end) * (
            1.0 if self.fade is None else self.fade.factor(contact)
        )
        paces = [] if self.work is None else [contact.q / self.work]
        if self.rate is not None:
            thermal = (
                1.0
                if self.activation is None
                else jnp.exp(-self.activation / (GAS_CONSTANT * contact.T))
            )
            paces.append(self.rate * thermal)
        return (end - c) * functools.reduce(operator.add, paces)

    def faults(self, path: str) -> Faults:
        """Error of a process without a pace, or with an activation energy and no
        rate."""
        if self.rate is None and (self.work is None or self.activation is not None):
            return [
                Fault(
                    path,
                    "has no pace",
                    "give rate (1/s), work (J/m²), or both; activation belongs to rate",
                )
            ]
        return []


class FrictionChange(Part):
    """A factor of the friction of some linings over time: oil or water on them, a
    lining lost (0).

    - `factor`: a number ≥ 0 or a profile, 1 of sound linings, in the time of the run
      (also of a duty in phases)
    - `linings`: their numbers from the slack end (from 1), one or a list; `None`: all
    - `when` it begins: `"temperature of the rim above 300 degC"` (or `band`, `linings`:
      of the hottest; or `below`), `"stop 3"`, or an object of these kinds
      (`loads.AtTemperature`, `loads.AtStop`); until then the linings are sound, and the
      time of the `factor` counts from then on. `None`: from the start of the run. It
      begins once

    Example:
        >>> oil = sb.friction.FrictionChange(0.4, [3, 4])
        >>> oil
        FrictionChange(factor=Constant(level=0.4), linings=[3, 4])
        >>> np.asarray(oil.of_each(oil.factor.level, 6))
        array([1. , 1. , 0.4, 0.4, 1. , 1. ])
    """

    factor: AbstractProfile = part(AbstractProfile, "1")
    linings: Scalar | None = quantity(
        "1",
        "numbers of the linings, from 1 at the slack end",
        low=1.0,
        many=IndexedBy.ROWS,
        default=None,
    )
    when: AbstractEnd | None = struct_field(
        converter=as_end, metadata={"part": AbstractEnd}, default=None
    )

    def of_each(self, value: Array, n: int) -> Vector:
        """The factor of each of `n` linings, where that of the chosen ones is
        `value`."""
        if self.linings is None:
            return jnp.broadcast_to(value, (n,))
        chosen = (
            jnp.arange(1.0, n + 1.0)
            == jnp.atleast_1d(jnp.asarray(self.linings))[:, None]
        )
        return jnp.where(jnp.any(chosen, axis=0), value, 1.0)

    def faults(self, path: str) -> Faults:
        faults = faults_of_sign(
            self.factor, f"{path}.factor", "1", "friction is never negative"
        )
        if self.when is not None and not isinstance(self.when, AtTemperature | AtStop):
            what = f"{self.when.words!r} begins no change of friction"
            hint = (
                'a temperature or a stop, as in "stop 3"; a time belongs to the '
                "points of the `factor`"
            )
            faults.append(Fault(f"{path}.when", what, hint))
        return faults

    def turned(self, n: int) -> "FrictionChange":
        """The same of a band of `n` linings that is turned end for end."""
        return (
            self
            if self.linings is None
            else dataclasses.replace(self, linings=n + 1 - jnp.asarray(self.linings))
        )


# --- laws ---------------------------------------------------------------------------


class SurfaceState(NamedTuple):
    """Surface inputs of the law of a pair beside its motion: temperatures `T` (K), its
    own `memory`, and the `factor` of its changes over time, (n,) each; `None` where
    there is none."""

    T: Any = None
    memory: Any = None
    factor: Any = None

    def contact(self, v: Any, p: Any = None, q: Any = None) -> Contact:
        """The contact at slip speeds `v`, pressures `p` and friction powers per area
        `q`."""
        return Contact(v, self.T, p, self.memory, q, self.factor)


def continued(coefficient: Callable[[Array], Array], v: Array) -> Array:
    """A coefficient of friction at speeds `v` (m/s) signed by the sense of the slide,
    for `coefficient(v ≥ 0)`.

        f(−v) = 2 f(0) − f(v)

    The step on which a slide ends evaluates slightly past `v = 0`. Equations with
    another slope there would corrupt its derivative, so that the coefficient continues
    through `(0, f(0))` with its slope. A law is never called with a negative speed: one
    that takes `|v|`, or a power of `v`, is continued as well.
    """
    past = v < 0
    f = coefficient(jnp.where(past, -v, v))
    return jnp.where(past, 2 * coefficient(jnp.zeros_like(v)) - f, f)


class AbstractFriction(Part):
    """A friction law. Its numbers are scalars or have one entry per lining.

    A law is smooth enough to differentiate, never negative, and `kinetic ≤ static`. It
    is evaluated for `v ≥ 0` only; values just past the end of a slide follow from that
    (`continued`). It reads what it needs from the `Contact`; fields on which its
    coefficients do not depend cost nothing in the integration (`reads`).

    A law may have internal states, one value per lining each: friction that fades and
    recovers, or that runs in.

        ċ_i = rates(v_i, T_i, p_i, q_i, c_i),   c_i = start at the start of the run

    It then gives `start` and `rates`, and finds the states in `contact.memory`. The
    rates see the slip speed of the surfaces, 0 while they stick or do not touch (the
    coefficients of a band as a whole see `R_b ω`). In a jump of the tension no time
    passes, and the states are unchanged.

    A law made of others (fields that hold a law, or a tuple of laws) passes the contact
    on to them. What it does not define itself it has from them: states, changes over
    time, range of temperatures, errors.
    """

    @abc.abstractmethod
    def kinetic(self, contact: Contact) -> Floats:
        """Coefficient while sliding."""

    @abc.abstractmethod
    def static(self, contact: Contact) -> Floats:
        """Coefficient up to which the lining sticks."""

    def governing(self, contact: Contact, static: Bool[Array, "..."] | bool) -> Floats:
        """Coefficient of linings that stick (`static`, a traced bool) or slide.

        A law whose two coefficients share a factor may override this to compute it
        once.
        """
        still = contact._replace(v=jnp.zeros_like(contact.v))
        return jnp.where(static, self.static(still), self.kinetic(contact))

    @property
    def bases(self) -> dict[str, "AbstractFriction"]:
        """The laws that this one is made of, at any depth, by their paths in it."""
        return self._below(AbstractFriction)

    def _below(self, kinds: Any) -> dict[str, Any]:
        """The nearest parts of some kinds in this law, by their paths in it."""

        def wanted(x: object) -> bool:
            return x is not self and isinstance(x, kinds)

        leaves = jax.tree_util.tree_flatten_with_path(self, is_leaf=wanted)[0]
        return {
            jax.tree_util.keystr(path).removeprefix("."): part
            for path, part in leaves
            if wanted(part)
        }

    def _remembering(self) -> "AbstractFriction | None":
        """The one of its bases that has states."""
        laws = [law for law in self.bases.values() if remembers(law)]
        if len(laws) > 1:
            raise NotImplementedError(
                f"several laws in a {type(self).__name__} have states: give `start` and `rates`"
            )
        return laws[0] if laws else None

    def start(self, n: int) -> PyTree:
        """States of the law at the start of a run: a PyTree of numbers for all or for
        each of `n` linings.

        `None`: it has no states. By default those of its base.
        """
        base = self._remembering()
        return None if base is None else base.start(n)

    def rates(self, contact: Contact) -> PyTree:
        """Rates (1/s times the unit of each state) of the states `contact.memory`, a
        PyTree like that.

        They must be smooth in `v ≥ 0`. `contact.q` is the friction power per area at
        the face, `f p v` (W/m²).
        """
        base = self._remembering()
        if base is None:
            raise NotImplementedError(
                f"{type(self).__name__} has states but no `rates`"
            )
        return base.rates(contact)

    def sizes(self) -> PyTree:
        """Typical size of each state, a number or a PyTree like that of `start`:
        tolerances are in proportion to it."""
        base = self._remembering()
        return 1.0 if base is None else base.sizes()

    def temperature_range(self) -> Bounds | None:
        """Temperatures (K) between which the law holds, `None` without bounds; a run
        ends where it leaves them."""
        return _common_range(*self._below((AbstractFriction, AbstractFactor)).values())

    @property
    def over_time(self) -> tuple[FrictionChange, ...]:
        """Given changes over time, whose factor the law finds in `contact.factor`."""
        return tuple(change for law in self.bases.values() for change in law.over_time)

    def factor_of(self, n: int, values: Sequence[Array]) -> Vector | None:
        """Factor of the friction of `n` linings where its changes over time have these
        `values`; `None`: it has none."""
        factor = None
        for change, value in zip(self.over_time, values, strict=True):
            changed = change.of_each(value, n)
            factor = changed if factor is None else factor * changed
        return factor

    def factor_at(self, n: int, t: Array) -> Vector | None:
        """The same at the time `t`, where nothing has happened yet that begins a
        change."""
        sound = jnp.ones(())
        profiles = [
            None if change.when is not None else change.factor
            for change in self.over_time
        ]
        return self.factor_of(
            n,
            [
                sound if x is None else jnp.asarray(x.value(t, x.first_piece(t)))
                for x in profiles
            ],
        )


def memory_at_start(law: AbstractFriction, n: int) -> PyTree:
    """States of a law at the start, (n,) each; `None` of a law without."""
    states = law.start(n)
    if not jax.tree.leaves(states):
        return None
    return jax.tree.map(
        lambda x: jnp.broadcast_to(jnp.asarray(x, jnp.float64), (n,)), states
    )


def memory_sizes(law: AbstractFriction, memory: PyTree) -> PyTree:
    """Typical sizes of the states `memory` (n,) of a law."""
    sizes = law.sizes()
    if jax.tree.structure(sizes) == jax.tree.structure(0):  # one for all
        sizes = jax.tree.map(lambda _: sizes, memory)
    return jax.tree.map(
        lambda x, old: jnp.broadcast_to(jnp.asarray(x, jnp.float64), old.shape),
        sizes,
        memory,
    )


@cached_by_structure
def remembers(law: AbstractFriction) -> bool:
    """Whether a law has states."""
    try:
        return bool(jax.tree.leaves(jax.eval_shape(lambda law: law.start(1), law)))
    except Exception:  # an error reported by `faults_of_law`, and by the run itself
        return False


@cached_by_structure
def _memory_like(law: AbstractFriction, n: int) -> PyTree:
    """Shapes of the states of a law of `n` linings."""
    try:
        return jax.eval_shape(lambda law: memory_at_start(law, n), law)
    except Exception:  # an error reported by `faults_of_law`, and by the run itself
        return None


def faults_of_law(law: AbstractFriction, path: str, n: int) -> Faults:
    """Errors of the states of a law, and of numbers that are neither one for all nor
    one for each lining."""
    faults = _faults_of_memory(law, path, n)
    for change in law.over_time:
        chosen = (
            np.zeros(1) if change.linings is None else np.atleast_1d(change.linings)
        )
        if np.any(chosen > n) or np.any(chosen % 1):
            what = f"changes of the linings {', '.join(f'{i:g}' for i in chosen)}"
            faults.append(
                Fault(
                    path,
                    what,
                    f"give whole numbers of linings, 1…{n} from the slack end",
                )
            )
    faults += _faults_of_bases(law, path)
    if not faults and (misfit := _misfit(law, n)) is not None:
        faults = [Fault(path, *misfit)]
    if not faults and not _sees_changes(law, n):
        faults = [
            Fault(
                path, "does not follow the changes over time of a law in it", _PASS_ON
            )
        ]
    return faults


_PASS_ON = "pass the contact on to that law as it is, or with `contact._replace`"


def _faults_of_bases(law: AbstractFriction, path: str) -> Faults:
    """Errors of a law that hides states or changes of the laws that it is made of, or
    mixes up their changes."""
    faults = Issues()
    bases = law.bases
    for name, base in bases.items():
        lost = {id(change) for change in base.over_time} - {
            id(change) for change in law.over_time
        }
        if lost:
            hint = (
                "put all changes into one law around it; a custom law leaves "
                "`over_time` as it is"
            )
            faults.add(
                f"{path}.{name}",
                "changes over time, and the law around it does not",
                hint,
            )
        if remembers(base) and not remembers(law):
            hint = "a custom law leaves `start`, `rates` and `sizes` as they are"
            faults.add(
                f"{path}.{name}", "has states, and the law around it has none", hint
            )
        faults += _faults_of_bases(base, f"{path}.{name}")
    if sum(bool(base.over_time) for base in bases.values()) > 1:
        faults.add(
            path,
            "several laws in it change over time",
            "put all changes into one law around it",
        )
    return faults


@cached_by_structure
def _sees_changes(law: AbstractFriction, n: int) -> bool:
    """Whether the coefficients of a law with changes over time depend on their
    factor."""
    if not law.over_time:
        return True
    contact, _ = contact_like(law, n)
    changing = contact._replace(factor=jax.ShapeDtypeStruct((n,), np.float64))
    return bool(read_by(_coefficients, law, changing)[1].factor)


@cached_by_structure
def _misfit(law: AbstractFriction, n: int) -> tuple[str, str] | None:
    """What is wrong, and a hint, where a law with numbers of these shapes does not give
    one coefficient for each of `n` linings."""
    misfit = f"its numbers do not fit {n} linings", f"give one number, or a list of {n}"
    odd: list[tuple[str, str]] = []

    def coefficients(law: AbstractFriction, contact: Contact) -> list[Any]:
        given = []
        for name in ("kinetic", "static"):
            value = getattr(law, name)(contact)
            if not _is_number(value):
                hint = f"return one number, or an array of {n}"
                odd.append((f"`{name}` returns {shown(value)}", hint))
            given.append(value)
        return given

    try:
        found = jax.eval_shape(coefficients, law, contact_like(law, n)[0])
        shapes = [getattr(coefficient, "shape", ()) for coefficient in found]
        fits = all(np.broadcast_shapes(shape, (n,)) == (n,) for shape in shapes)
    except (TypeError, ValueError, IndexError) as error:
        if odd:
            return odd[0]
        for fault in faults_of_tracing(error):
            return f"{fault.path} {fault.problem}", fault.hint
        # which the run itself reports
        return None if isinstance(error, jax.errors.JAXTypeError) else misfit
    return odd[0] if odd else None if fits else misfit


def _is_number(value: object) -> bool:
    """Whether a function of a user has returned real numbers, or nothing."""
    kind = getattr(getattr(value, "dtype", None), "kind", "O")
    return kind in "biuf" or isinstance(value, int | float | None)


def _faults_of_memory(law: AbstractFriction, path: str, n: int) -> Faults:
    try:
        start = law.start(n)
        sizes = law.sizes()
    except Exception as error:  # any exception of a user-defined law
        return [Fault(path, f"its states at the start cannot be found: {error}")]
    like = jax.tree.structure(start)
    faults = Issues()
    if like.num_leaves == 0:
        return faults
    each = f"give one number, or a list of {n}"
    for name, tree in (("state", start), ("size", sizes)):
        for x in map(np.asarray, jax.tree.leaves(tree)):
            if x.shape not in ((), (n,)):
                faults.add(
                    path,
                    f"a {name} of the shape {x.shape} does not fit {n} linings",
                    each,
                )
            elif not np.all(np.isfinite(x)) or (name == "size" and np.any(x <= 0)):
                faults.add(
                    path,
                    f"a {name} of {x} is out of range",
                    "finite numbers; sizes > 0",
                )
    if jax.tree.structure(sizes) not in (like, jax.tree.structure(0)):
        faults.add(
            path,
            "`sizes` has another structure than `start`",
            "give one size for each state",
        )
    return faults or _faults_of_rates(law, path, n)


def _faults_of_rates(law: AbstractFriction, path: str, n: int) -> Faults:
    contact = contact_like(law, n)[1]
    assert contact is not None
    try:
        rates = jax.eval_shape(_rates, law, contact)
    except Exception as error:
        return [
            Fault(
                path,
                f"its `rates` cannot be found: {error}",
                "they see v, T, p, q and the memory of a contact",
            )
        ]
    if jax.tree.structure(rates) != jax.tree.structure(contact.memory):
        return [
            Fault(
                path,
                "`rates` has another structure than `start`",
                "give one rate for each state",
            )
        ]
    shapes = {x.shape for x in jax.tree.leaves(rates)} - {(), (n,)}
    return [
        Fault(path, f"a rate of the shape {shape} does not fit {n} linings")
        for shape in shapes
    ]


class Reads(NamedTuple):
    """Fields of `Contact`: speed, temperature, pressure."""

    v: bool
    T: bool
    p: bool


def _coefficients(law: AbstractFriction, contact: Contact) -> TwoArrays:
    """Both coefficients as a brake uses them: sticking linings have no speed."""
    return law.kinetic(contact), law.static(
        contact._replace(v=jnp.zeros_like(contact.v))
    )


def _rates(law: AbstractFriction, contact: Contact) -> PyTree:
    return law.rates(contact)


def contact_like(
    law: AbstractFriction, n: int, *, T: bool = True, p: bool = True
) -> tuple[Contact, Contact | None]:
    """Shapes of the contact of `n` linings for the coefficients of a law, and for the
    rates of its states (`None`: it has none); with or without temperatures and
    pressures."""
    per_lining = jax.ShapeDtypeStruct((n,), np.float64)
    surface = SurfaceState(per_lining if T else None, _memory_like(law, n))
    pressure = per_lining if p else None
    rates = (
        None
        if surface.memory is None
        else surface.contact(per_lining, pressure, pressure)
    )
    return surface.contact(per_lining, pressure), rates


@cached_by_structure
def reads(law: AbstractFriction, n: int, *, T: bool, p: bool) -> Reads:
    """Fields of the contact of `n` linings on which the coefficients of a law depend.

    - `T`, `p`: whether there are temperatures and pressures; without them the fields
      are `None`, and are not read

    Found from the lowered program, once for each structure of a law; in doubt a field
    counts as read (`read_by`).
    """
    _, dependence = read_by(_coefficients, law, contact_like(law, n, T=T, p=p)[0])
    return Reads(dependence.v, bool(dependence.T), bool(dependence.p))


class RatesRead(NamedTuple):
    """Dependence of the rates of a law's states on slip speed, temperature, pressure,
    friction power per area.

    - `bends`: whether they are nonlinear in slip speed and power
    """

    v: bool
    T: bool
    p: bool
    q: bool
    bends: bool = False

    @property
    def slip(self) -> bool:
        """Whether they depend on the slip speed."""
        return self.v or self.q


@cached_by_structure
def rates_read(law: AbstractFriction, n: int, *, T: bool, p: bool) -> RatesRead | None:
    """`reads` of the rates of its states; `None` of a law without."""
    contact = contact_like(law, n, T=T, p=p)[1]
    if contact is None:
        return None
    _, rate = read_by(_rates, law, contact)
    _, slope = read_by(_slopes, law, contact)
    return RatesRead(
        rate.v, bool(rate.T), bool(rate.p), bool(rate.q), slope.v or bool(slope.q)
    )


def _slopes(law: AbstractFriction, contact: Contact) -> PyTree:
    """Change of the rates of a law's states with slip speed and power together."""
    slip = (contact.v, contact.q)
    along = jax.tree.map(jnp.ones_like, slip)
    return jax.jvp(
        lambda slip: law.rates(contact._replace(v=slip[0], q=slip[1])),
        (slip,),
        (along,),
    )[1]


@cached_by_structure
def needs(law: AbstractFriction, n: int) -> Reads:
    """Fields of the contact of `n` linings that a law needs: as `None` they make it
    fail."""

    def fails(T: bool = True, p: bool = True) -> bool:
        try:
            contact, lasting = contact_like(law, n, T=T, p=p)
            jax.eval_shape(_coefficients, law, contact)
            if lasting is not None:
                jax.eval_shape(_rates, law, lasting)
        except Exception:  # any exception that None raises in a law
            return True
        return False

    if fails():  # another error, which the run itself reports
        return Reads(v=True, T=False, p=False)
    return Reads(v=True, T=fails(T=False), p=fails(p=False))


@short_for(AbstractFriction)
class ConstantFriction(AbstractFriction):
    """Coulomb friction, `f = f_k` sliding and `f_s = r f_k` sticking.

    - `coefficient`: `f_k`, scalar or per lining
    - `static_ratio`: `r = f_s/f_k ≥ 1`

    Example:
        >>> sb.ConstantFriction(0.35, static_ratio=1.1)
        ConstantFriction(coefficient=0.35, static_ratio=1.1)
    """

    coefficient: Scalar = quantity("1", "coefficient of friction", 0.0, 10.0, many=True)
    static_ratio: Scalar = quantity(
        "1", "ratio of static to kinetic friction", 1.0, 10.0, many=True, default=1.0
    )

    def kinetic(self, contact: Contact) -> Floats:
        return jnp.asarray(self.coefficient)

    def static(self, contact: Contact) -> Floats:
        return jnp.asarray(self.coefficient * self.static_ratio)


class StribeckFriction(AbstractFriction):
    """Friction that falls with the slip speed:
    `f(v) = f_k + (f_s − f_k) exp(−(v/v_s)^δ)`.

    - `static_coefficient` `f_s`, `kinetic_coefficient` `f_k`: scalars or per lining
    - `stribeck_speed` `v_s` in m/s, `exponent` `δ` in [1, 4] (1: Bo & Pavelescu; 2:
      Gaussian)

    Reference: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, *Automatica* 30
    (1994) 1083–1138, eq. (3).

    Example:
        >>> sb.StribeckFriction(0.44, 0.40, "0.5 m/s")
        StribeckFriction(
          static_coefficient=0.44,
          kinetic_coefficient=0.4,
          stribeck_speed=0.5 m/s,
          exponent=2,
        )
    """

    static_coefficient: Scalar = quantity(
        "1", "static coefficient of friction", 0.0, 10.0, many=True
    )
    kinetic_coefficient: Scalar = quantity(
        "1", "kinetic coefficient of friction", 0.0, 10.0, many=True
    )
    stribeck_speed: Scalar = positive_quantity("m/s", "Stribeck speed", many=True)
    exponent: Scalar = quantity(
        "1", "exponent of the Stribeck curve", 1.0, 4.0, many=True, default=2.0
    )

    def kinetic(self, contact: Contact) -> Floats:
        # slip begins at v = 0: the slope there must be that of sliding, also of an
        # exponent of 1
        r = jnp.where(contact.v >= 0, contact.v, 0.0) / self.stribeck_speed
        positive = r > 0
        n = jnp.asarray(self.exponent)
        power = r * jnp.where(
            positive | (n == 1), jnp.where(positive, r, 1.0) ** (n - 1), 0.0
        )
        return self.kinetic_coefficient + (
            self.static_coefficient - self.kinetic_coefficient
        ) * jnp.exp(-power)

    def static(self, contact: Contact) -> Floats:
        return jnp.asarray(self.static_coefficient)

    def faults(self, path: str) -> Faults:
        if np.any(
            np.asarray(self.static_coefficient) < np.asarray(self.kinetic_coefficient)
        ):
            return [
                Fault(
                    path,
                    "the static coefficient is below the kinetic one",
                    "static must be ≥ kinetic",
                )
            ]
        return []


class TabulatedFriction(AbstractFriction):
    """Measured friction over slip speed, `f(v)`, interpolated by a monotone cubic
    (Fritsch–Carlson).

    - `speed` (k,) in m/s, increasing from 0; `coefficient` (k,)
    - `static_ratio`: `f_s / f(0) ≥ 1`

    Beyond the last speed the last coefficient holds (not extrapolated). The interpolant
    has a continuous slope, so that the table's knots need no step ends. One table
    serves all linings. Where two neighbours are equal the interpolant has a corner as a
    function of them: derivatives by such coefficients are those of one side.

    Example:
        >>> sb.friction.TabulatedFriction([0.0, 5.0], [0.4, 0.35])
        TabulatedFriction(speed=[0, 5] m/s, coefficient=[0.4, 0.35], static_ratio=1)
    """

    speed: Scalar = quantity(
        "m/s", "slip speeds of the table", low=0.0, many=IndexedBy.ROWS
    )
    coefficient: Scalar = quantity(
        "1", "coefficients of friction of the table", 0.0, 10.0, many=IndexedBy.ROWS
    )
    static_ratio: Scalar = quantity(
        "1", "ratio of static friction to that at zero speed", low=1.0, default=1.0
    )

    def kinetic(self, contact: Contact) -> Floats:
        return interpolated(contact.v, self.speed, self.coefficient)

    def static(self, contact: Contact) -> Floats:
        return jnp.asarray(self.coefficient[..., 0] * self.static_ratio)

    def faults(self, path: str) -> Faults:
        speed = np.asarray(self.speed)
        coefficient = np.asarray(self.coefficient)
        if not is_table(speed, coefficient):
            return [
                Fault(
                    path,
                    "the table needs speeds and coefficients of one length, at least 2",
                )
            ]
        if np.any(np.diff(speed) <= 0) or speed[0] != 0.0:
            return [Fault(f"{path}.speed", "the speeds must increase, from 0 upwards")]
        if np.any(coefficient > coefficient[0] * np.asarray(self.static_ratio)):
            return [
                Fault(
                    path,
                    "a coefficient of the table exceeds the static one",
                    "raise static_ratio",
                )
            ]
        return []


class AbstractScaledFriction(AbstractFriction):
    """A base law times a factor, sliding and sticking alike. States are those of the
    base law."""

    base: AbstractVar[AbstractFriction]

    @abc.abstractmethod
    def scale(self, contact: Contact) -> Array | float:
        """The factor."""

    def governing(self, contact: Contact, static: Bool[Array, "..."] | bool) -> Floats:
        return self.base.governing(contact, static) * self.scale(contact)

    def kinetic(self, contact: Contact) -> Floats:
        return self.base.kinetic(contact) * self.scale(contact)

    def static(self, contact: Contact) -> Floats:
        return self.base.static(contact) * self.scale(contact)


class ProductFriction(AbstractScaledFriction):
    """`f(T, v, p) = f_base(v) · ∏ factors(T, p)`, sliding and sticking alike. States
    are those of the base law.

    Example:
        >>> sb.friction.ProductFriction(0.35, (sb.friction.PressureFactor("1 MPa", 0.1),)).factors
        (PressureFactor(reference=1 MPa, exponent=0.1),)
    """

    base: AbstractFriction = part(AbstractFriction)
    factors: tuple[AbstractFactor, ...]

    def __check_init__(self) -> None:
        # each adds equations
        if isinstance(self.factors, tuple) and len(self.factors) > 100:
            raise input_error(
                "ProductFriction.factors", f"are {len(self.factors)}", "at most 100"
            )

    def scale(self, contact: Contact) -> Array:
        product = None
        for factor in self.factors:
            product = (
                factor.factor(contact)
                if product is None
                else product * factor.factor(contact)
            )
        return jnp.ones(()) if product is None else product


def _common_range(*parts: AbstractFriction | AbstractFactor) -> Bounds | None:
    """Temperatures (K) between which all parts of a law hold."""
    bounds = [
        bound
        for bound in (part.temperature_range() for part in parts)
        if bound is not None
    ]
    if not bounds:
        return None
    low, high = bounds[0]
    for bound in bounds[1:]:
        low = greater(low, bound[0])
        high = lesser(high, bound[1])
    return low, high


# --- friction with memory -----------------------------------------------------------


class FrictionWithMemory(AbstractScaledFriction):
    """Friction that depends on the history of each lining: `f = f_base c`, sliding and
    sticking alike, `ċ = Σ_j ċ_j`.

    - `base`: law of a lining with `c = 1`; `processes`: what changes `c`, a factor ≥ 0,
      one per lining
    - `initial`: `c` at the start, scalar or per lining; `Series.friction_memory` shows
      it over a run
    """

    base: AbstractFriction = part(AbstractFriction)
    processes: tuple[MemoryProcess, ...]
    initial: Scalar = quantity(
        "1", "factor of friction at the start", 0.0, 10.0, many=True, default=1.0
    )

    def scale(self, contact: Contact) -> Array:
        return contact.memory

    def start(self, n: int) -> PyTree:
        return self.initial

    def rates(self, contact: Contact) -> PyTree:
        return functools.reduce(
            operator.add,
            [process.change(contact.memory, contact) for process in self.processes],
        )

    def faults(self, path: str) -> Faults:
        faults = Issues()
        if not self.processes:
            faults.add(
                f"{path}.processes",
                "is empty",
                "give at least one process, or the base law alone",
            )
        if remembers(self.base):
            faults.add(
                f"{path}.base",
                "has states of its own",
                "put all processes into one law",
            )
        return faults


# --- friction that is changed from outside ------------------------------------------


class ChangingFriction(AbstractScaledFriction):
    """Friction that is changed from outside while the brake runs:
    `f = f_base ∏_j φ_j(t)`, static and kinetic alike.

    - `base`: the law of sound linings
    - `changes`: factors `φ_j(t)` of all linings, or of some of them

    Points of the profiles are time breakpoints: jumps are exact, also those that let a
    held load go, and derivatives by factors and times are as well. A change that begins
    at a temperature or a stop (`FrictionChange.when`) begins with the event
    `friction_change`. Estimates before a run are those of sound linings.

    Example: oil on linings 3 and 4 from 2 s on.
        >>> oil = sb.PiecewiseLinear([2.0, 2.0], [1.0, 0.4])
        >>> law = sb.friction.ChangingFriction(0.35, (sb.friction.FrictionChange(oil, [3, 4]),))
    """

    base: AbstractFriction = part(AbstractFriction)
    changes: tuple[FrictionChange, ...]

    def scale(self, contact: Contact) -> Array | float:
        return 1.0 if contact.factor is None else contact.factor

    @property
    def over_time(self) -> tuple[FrictionChange, ...]:
        return self.changes

    def faults(self, path: str) -> Faults:
        hint = "give at least one change, or the base law alone"
        return [] if self.changes else [Fault(f"{path}.changes", "is empty", hint)]
