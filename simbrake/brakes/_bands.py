"""Several bands side by side under one lever, each with its own linings."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from .._base._faults import Fault, Faults, Issues
from .._base._part import Part, faults_of_sizes, positive_quantity, structural
from .._base._quantity import Scalar, Values
from ..friction import AbstractFriction, Bounds, Contact
from ..hybrid.arrays import Array, Floats, Vector
from .band import AbstractStiffness, GivenStiffness, lever_split, product, tension_ratio
from .design import (
    AbstractBandBrake,
    AbstractLinings,
    BrakeWords,
    Lining,
    PairPlace,
    Pulley,
    fault_of_circle,
    faults_of_pair,
    faults_of_wrap,
)

T = TypeVar("T")

#: temperatures (K) that no lining reaches: bounds of a law without any beside one that
#: has them
_ANY_TEMPERATURE = (0.0, 1e6)


class LinedBand(Part):
    """One of several bands under a lever, with its own linings.

    - `linings`, counted from the slack end of the band to its tight end
    - `stiffness` (N/m), as of `Band`: the lever stretches all bands by the same length,
      which sets their shares of its tension;  or `share` of it, in proportion to those
      of the other bands: on a balance beam they are equal, or inverse to its arms

    Example:
        >>> sb.brakes.LinedBand(sb.uniform_linings(8, "270 deg", 0.35), stiffness="2 MN/m")
        LinedBand(
          linings=Lining(friction=ConstantFriction(coefficient=0.35, static_ratio=1),
          angle=8 × 33.75°), stiffness=2 MN/m,
        )
    """

    linings: Lining
    stiffness: Scalar | AbstractStiffness | None = positive_quantity(
        "N/m", "stiffness at the tight end", default=None
    )
    share: Scalar | None = positive_quantity(
        "1",
        "share of the lever's tension, in proportion to those of the other bands",
        default=None,
    )


class JoinedFriction(AbstractFriction):
    """The friction laws of several bands as the law of all their linings, one band
    after the other.

    - `laws` of the bands
    - `spans`: numbers of their first linings, and of those after the last ones

    Its states are a tuple: the first state of every law, the second, …; of laws with
    fewer they are 0 throughout. Its changes over time are those of the laws, each on
    the linings of its own band.
    """

    laws: tuple[AbstractFriction, ...]
    spans: tuple[tuple[int, int], ...] = structural()

    def cut(self, x: T, i: int) -> T:
        """The part of arrays over all linings that belongs to band `i`."""
        first, last = self.spans[i]

        def cut_leaf(x: Array) -> Array:
            return (
                x if jnp.ndim(x) == 0 or jnp.shape(x)[-1] == 1 else x[..., first:last]
            )

        return jax.tree.map(cut_leaf, x)

    def joined(self, parts: Iterable[Values]) -> Vector:
        """One array over all linings of what each band has, (n_i,) or one for all its
        linings."""
        each = [*zip(parts, self.spans, strict=True)]
        concrete = all(isinstance(x, np.ndarray | np.generic | float) for x, _ in each)
        xp: Any = np if concrete else jnp
        return xp.concatenate(
            [xp.broadcast_to(xp.asarray(x, np.float64), (b - a,)) for x, (a, b) in each]
        )

    def own(self, contact: Any, i: int) -> Any:
        """The linings of band `i` in a contact, or a state of the surfaces (`None`:
        without), of all linings."""
        if contact is None or contact.memory is None:
            return self.cut(contact, i)
        like = jax.tree.structure(self.laws[i].start(1))
        memory = self.cut(contact.memory[: like.num_leaves], i)
        rest = self.cut(contact._replace(memory=None), i)
        return rest._replace(memory=like.unflatten(memory) if like.num_leaves else None)

    def _each(
        self, of: Callable[[AbstractFriction, Contact], Any], contact: Contact
    ) -> list[Any]:
        return [of(law, self.own(contact, i)) for i, law in enumerate(self.laws)]

    def _coefficient(
        self, of: Callable[[AbstractFriction, Contact], Any], contact: Contact
    ) -> Floats:
        return self.joined(self._each(of, contact))

    def kinetic(self, contact: Contact) -> Floats:
        return self._coefficient(lambda law, own: law.kinetic(own), contact)

    def static(self, contact: Contact) -> Floats:
        return self._coefficient(lambda law, own: law.static(own), contact)

    def governing(self, contact: Contact, static: Bool[Array, "..."] | bool) -> Floats:
        return self._coefficient(lambda law, own: law.governing(own, static), contact)

    def _states(self, trees: list[PyTree], absent: float) -> tuple[Array, ...] | None:
        """States of all laws by their number; `absent`: of a law that has fewer."""
        leaves = [jax.tree.leaves(tree) for tree in trees]
        most = max(len(own) for own in leaves)
        each = (
            [own[k] if k < len(own) else absent for own in leaves] for k in range(most)
        )
        return tuple(self.joined(states) for states in each) if most else None

    def start(self, n: int) -> PyTree:
        starts = [
            law.start(last - first)
            for law, (first, last) in zip(self.laws, self.spans, strict=True)
        ]
        return self._states(starts, 0.0)

    def rates(self, contact: Contact) -> PyTree:
        own = self._each(
            lambda law, own: None if own.memory is None else law.rates(own), contact
        )
        return self._states(own, 0.0)

    def sizes(self) -> PyTree:
        sizes = []
        for law in self.laws:
            like = jax.tree.structure(law.start(1))
            size = law.sizes()
            one_for_all = jax.tree.structure(size) == jax.tree.structure(0)
            sizes.append([size] * like.num_leaves if one_for_all else size)
        return self._states(sizes, 1.0) or 1.0

    def factor_of(self, n: int, values: Sequence[Array]) -> Vector | None:
        if not self.over_time:
            return None
        factors = []
        first = 0
        for law, (begin, end) in zip(self.laws, self.spans, strict=True):
            last = first + len(law.over_time)
            own = law.factor_of(end - begin, values[first:last])
            factors.append(1.0 if own is None else own)
            first = last
        return self.joined(factors)

    def temperature_range(self) -> Bounds | None:
        bounds = [law.temperature_range() for law in self.laws]
        if all(pair is None for pair in bounds):
            return None
        low, high = zip(
            *(_ANY_TEMPERATURE if pair is None else pair for pair in bounds),
            strict=True,
        )
        return self.joined(low), self.joined(high)


class JoinedLinings(AbstractLinings):
    """The linings of several `bands`, one band after the other."""

    bands: tuple[Lining, ...]

    @property
    def friction(self) -> JoinedFriction:
        last = np.cumsum([own.count for own in self.bands]).tolist()
        return JoinedFriction(
            tuple(own.friction for own in self.bands),
            tuple(zip([0, *last], last, strict=False)),
        )

    @property
    def count(self) -> int:
        return sum(own.count for own in self.bands)

    @property
    def angle(self) -> Vector:
        """Central angles `β_i` (rad)."""
        return jnp.concatenate([jnp.asarray(own.angle) for own in self.bands])

    def grip(self, f: Values) -> Vector:
        """As of the `Lining` of each band."""
        law = self.friction
        return law.joined(
            own.grip(law.cut(jnp.asarray(f), i)) for i, own in enumerate(self.bands)
        )

    def self_locking(self, f: Values) -> Vector:
        """As of the `Lining` of each band."""
        law = self.friction
        return law.joined(
            own.self_locking(law.cut(jnp.asarray(f), i))
            for i, own in enumerate(self.bands)
        )

    @property
    def cosine(self) -> Vector:
        """As of the `Lining` of each band."""
        return jnp.concatenate([own.cosine for own in self.bands])

    @property
    def area(self) -> Vector | None:
        areas = [own.area for own in self.bands]
        return (
            None if any(area is None for area in areas) else self.friction.joined(areas)
        )

    @property
    def permissible_pressure(self) -> Vector | None:
        limits = [own.permissible_pressure for own in self.bands]
        return (
            None
            if any(limit is None for limit in limits)
            else self.friction.joined(limits)
        )

    @property
    def weights(self) -> Vector:
        return self.angle


class MultiBandBrake(AbstractBandBrake):
    """A band-shoe brake with several bands side by side under one lever, each with its
    own linings.

        T_0,j = s_j T_0,   s_j = 1/(c_j Σ_k 1/c_k),   c_j = Π_j/C_j   (K-8)
        M = R_b Σ_j T_0,j (Π_j − 1),   backwards  R_b Σ_j T_0,j (1 − 1/Π_j)

    - `pulley` on which all of them act, or several on one shaft; its `width` is that of
      all tracks together
    - `band_radius` `R_b` (m) of their circle
    - `bands`: each with its linings, and its stiffness (or its share `s_j`, in
      proportion to those of the others)

    `T_0` is the sum of the slack tensions (alike rims of a `Brake` have that of each).
    The lever stretches all bands alike: as for one elastic band the stiffness `C_j` is
    that at the tight end, `x = T_n,j/C_j`, and in full slip `T_n,j = Π_j T_0,j` with
    the `Π_j` of the band's linings (not `e^{Σfα}`, their limit of many). The shares
    `s_j` are those of a slide ahead with the friction at the start of the run, at zero
    speed and without pressure, and constant in the run: a later change of the friction
    moves the torque of each band, not its share of the lever. The stiffness sets the
    shares alone: the bands themselves are rigid, slide together and stick together.
    Where they stick, each has that part of the torque that it has of the maximum
    torque.

    Arrays over linings have those of the first band first (`of_bands` divides them).
    Source: K-4…K-8, model §2.3.

    Example:
        >>> linings = sb.uniform_linings(8, "270 deg", 0.35)
        >>> bands = tuple(sb.brakes.LinedBand(linings, stiffness=c) for c in ("3 MN/m", "1 MN/m"))
        >>> brake = sb.brakes.MultiBandBrake(sb.Pulley(0.59, 1200.0), 0.623, bands)
        >>> [round(share, 4) for share in brake.lever_shares(0.35).tolist()]
        [0.75, 0.25]
    """

    pulley: Pulley
    band_radius: Scalar = positive_quantity("m", "radius of the band circle")
    bands: tuple[LinedBand, ...]
    words: ClassVar[BrakeWords] = BrakeWords(
        "multi-band brake",
        "lining",
        "pulley",
        "f·tan(β/2) ≥ 1 on a rigid band, the band is self-locking",
        "shorten the lining, or lower its friction",
    )

    @property
    def radius(self) -> Scalar:
        return self.band_radius

    @property
    def linings(self) -> JoinedLinings:
        """The linings of all bands, one band after the other."""
        return JoinedLinings(tuple(band.linings for band in self.bands))

    @property
    def pairs(self) -> dict[str, PairPlace]:
        return {"external": PairPlace("bands[*].linings", "linings on the rim")}

    def rubbing_part(self, pair: str) -> JoinedLinings:
        return self.linings

    @property
    def bands_of_linings(self) -> tuple[Lining, ...]:
        return self.linings.bands

    @property
    def stiffnesses(self) -> tuple[Scalar | AbstractStiffness | None, ...]:
        return tuple(band.stiffness for band in self.bands)

    @property
    def force_words(self) -> str:
        return f"T₀ and Tₙ over time are sums of {len(self.bands)} bands"

    @property
    def linings_of_rims(self) -> tuple[int, ...]:
        return tuple(own.count for own in self.linings.bands)

    @property
    def features(self) -> tuple[str, ...]:
        counts = " and ".join(str(band.linings.count) for band in self.bands)
        return (f"{len(self.bands)} bands of {counts} linings",)

    def of_bands(self, values: Any) -> list[Any]:
        """Values over all linings, (…, n), divided by bands: (…, n_j) of each."""
        return [values[..., first:last] for first, last in self.linings.friction.spans]

    def lever_shares(self, f: Values) -> Float[Array, " k"]:
        if any(band.share is not None for band in self.bands):
            shares = jnp.stack([jnp.asarray(band.share) for band in self.bands])
            return shares / jnp.sum(shares)
        own = self.of_bands(jnp.broadcast_to(jnp.asarray(f), (self.linings.count,)))
        weights = []
        for band, f in zip(self.bands, own, strict=True):
            law_or_number = band.stiffness
            angle = jnp.asarray(band.linings.angle)
            stiffness = (
                law_or_number
                if isinstance(law_or_number, AbstractStiffness)
                else GivenStiffness(law_or_number)
            )
            C = stiffness.stiffness(f, angle, jnp.asarray(self.band_radius))
            weights.append(product(tension_ratio(band.linings.grip(f))[0]) / C)
        return lever_split(jnp.stack(weights), 1.0)

    def torque(self, force: Values, f: Floats) -> Float[Array, ""]:
        mu = tension_ratio(self.linings.grip(f))[0]
        growth = jnp.stack([product(own) - 1 for own in self.of_bands(mu)])
        return (
            jnp.asarray(self.band_radius)
            * force
            * jnp.sum(self.lever_shares(f) * growth)
        )

    def place_of(self, i: int) -> tuple[int, int]:
        """Band and lining in it, each from 0, of the lining `i` (from 0) of all."""
        j = next(
            j for j, (_, last) in enumerate(self.linings.friction.spans) if i < last
        )
        return j, i - self.linings.friction.spans[j][0]

    def angle_path(self, i: int) -> str:
        j, own = self.place_of(i)
        return f"bands[{j}].linings.angle[{own}]"

    def locking_words(self, i: int, share: float) -> str:
        j, own = self.place_of(i - 1)
        return (
            f"lining {own + 1} of band {j + 1}: f·tan(β/2) = {share:.4g} ≥ 1, the "
            "band is self-locking"
        )

    def faults_of_presence(self, path: str) -> Faults:
        hint = "give the linings of each, and its stiffness or share"
        return [] if self.bands else [Fault(f"{path}.bands", "there is no band", hint)]

    def faults(self, path: str) -> Faults:
        faults = fault_of_circle(self.band_radius, self.pulley, path, "band_radius")
        for j, band in enumerate(self.bands):
            faults += self._faults_of_band(band, f"{path}.bands[{j}]")
        return faults

    def _faults_of_band(self, band: LinedBand, path: str) -> Faults:
        linings = band.linings
        where = f"{path}.linings"
        angle = np.asarray(linings.angle)
        faults = Issues()
        if angle.ndim != 1:
            return [
                Fault(
                    f"{where}.angle",
                    "a list of angles is needed, one per lining",
                    "one lining: [0.5]",
                )
            ]
        faults += faults_of_pair(linings, where, angle.size)
        law = f"{where}.friction"  # it reports its sizes itself
        faults += [
            fault
            for fault in faults_of_sizes(linings, where, angle.size)
            if not fault.path.startswith(law)
        ]
        faults += faults_of_wrap(
            band.stiffness, angle, f"{where}.angle", f"{path}.stiffness"
        )
        if linings.mass is not None:
            faults.add(
                f"{where}.mass", "has no effect", "the linings follow their band"
            )
        if linings.area is None and any(
            other.linings.area is not None for other in self.bands
        ):
            faults.add(
                f"{where}.area",
                "is missing",
                "another band has areas: give those of all bands",
            )
        by_share = any(other.share is not None for other in self.bands)
        wanted, idle = ("share", "stiffness") if by_share else ("stiffness", "share")
        hint = (
            "the bands share the lever's tension by their stiffness, or by given "
            "shares: one of the two for all"
        )
        if getattr(band, wanted) is None:
            faults.add(f"{path}.{wanted}", "is missing", hint)
        if getattr(band, idle) is not None:
            faults.add(f"{path}.{idle}", f"stands beside the {wanted} of a band", hint)
        return faults
