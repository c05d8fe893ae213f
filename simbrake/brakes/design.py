"""Mechanical parts of a brake: pulley, band, linings, bandage."""

import abc
import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, Faults, Issues, input_error
from .._base._part import (
    Part,
    Whole,
    faults_of_sizes,
    part,
    positive_quantity,
    quantity,
    structural,
    takes_values,
    whole,
)
from .._base._quantity import IndexedBy, Scalar, Values, meant_within, positive
from ..friction import (
    AbstractFriction,
    Contact,
    SurfaceState,
    faults_of_law,
    memory_at_start,
    needs,
    reads,
)
from ..hybrid.arrays import Floats, ScalarArray, Vector, VectorK, numpy_of
from ..hybrid.struct import AbstractClassVar, AbstractVar
from .band import (
    AbstractStiffness,
    ParallelBands,
    band_torque,
    grip,
    product,
    tension_ratio,
)


class Pulley(Part):
    """The brake pulley and all that turns with its shaft.

    - `radius` `R` of the friction track (m); `inertia` `J` about the shaft (kg·m²),
      drum included, hook load not
    - `width` `b` of the track (m), for overlap coefficients

    Example:
        >>> sb.Pulley("590 mm", inertia=1200)
        Pulley(radius=0.59 m, inertia=1200 kg·m²)
    """

    radius: Scalar = positive_quantity("m", "radius of the friction track")
    inertia: Scalar = positive_quantity("kg*m^2", "inertia about the shaft")
    width: Scalar | None = positive_quantity(
        "m", "width of the friction track", default=None
    )


class Segments(Part):
    """The band between linings that move individually (model §3.1, the resolved chain).

    - `stiffness` `K_i` (N/m) between lining `i` and `i + 1`, one number or (n − 1,);
      the segment to the anchor is the band's own `stiffness`
    - `damping_ratio` `ζ`: `D_i = 2 ζ √(K_i m̄_i)` with `m̄_i` the mean mass of the two
      linings it joins
    - `anchor_damping` `D_n` (N·s/m) of the segment to the anchor

    Example:
        >>> sb.Segments("2 MN/m")
        Segments(stiffness=2 MN/m, damping_ratio=0.05, anchor_damping=0 N·s/m)
    """

    stiffness: Scalar = positive_quantity(
        "N/m", "stiffness of the band between two linings", many=IndexedBy.GAPS
    )
    damping_ratio: Scalar = quantity(
        "1",
        "share of critical damping between two linings",
        low=0.0,
        many=IndexedBy.GAPS,
        default=0.05,
    )
    anchor_damping: Scalar = quantity(
        "N*s/m", "damping of the segment to the anchor", low=0.0, default=0.0
    )


class Strength(Part):
    """Sections that carry the tension of a band, and their allowable stresses.

    - `band_area` (m²) of the band at its weakest section
    - `band_stress` (Pa), allowable
    - `anchor_area` (m²) of the pin or bolt of the tight end
    - `anchor_stress` (Pa), allowable

    Stresses are tension over area: `T_max/A` of the band, `T_n,max/A` of the anchor.

    Example:
        >>> sb.brakes.Strength("900 mm^2", "150 MPa")
        Strength(band_area=9 cm², band_stress=150 MPa)
    """

    band_area: Scalar = positive_quantity("m^2", "cross-section of the band")
    band_stress: Scalar | None = positive_quantity(
        "Pa", "allowable stress of the band", default=None
    )
    anchor_area: Scalar | None = positive_quantity(
        "m^2", "cross-section of the anchor", default=None
    )
    anchor_stress: Scalar | None = positive_quantity(
        "Pa", "allowable stress of the anchor", default=None
    )


class Band(Part):
    """The brake band.

    - `radius` `R_b` (m) of the circle on which its tension acts: track radius, lining
      and half the band
    - `stiffness` `C` (N/m): tension of the tight end per unit elongation, band, anchor
      and linkage in series; `None` for a rigid band, which slips from the moment the
      lever pulls; or the band's geometry, or several bands in parallel, from which
      `stiffness_of` finds the number
    - `segments`: resolves the band into a chain of linings that move individually;
      `stiffness` is then that of the segment to the anchor. `None`: linings follow the
      band as a whole
    - `strength`: sections, for stresses among the results

    Example:
        >>> sb.Band("623 mm", stiffness="100 kN/m")
        Band(radius=0.623 m, stiffness=100 kN/m)
    """

    radius: Scalar = positive_quantity("m", "radius of the band circle")
    stiffness: Scalar | AbstractStiffness | None = positive_quantity(
        "N/m", "stiffness at the tight end", default=None
    )
    segments: Segments | None = None
    strength: Strength | None = None


class AbstractLinings(Part):
    """The `n` linings of one brake: linings of a band, pads or shoes. Arrays over them
    have `n` entries.

    - `friction`: the law of all of them, with numbers for all or per lining
    - `area` `A_i` (m²), `None`: not given
    """

    # (fields of an abstract class would come first among those of its kinds)
    if TYPE_CHECKING:

        @property
        def friction(self) -> AbstractFriction: ...

        @property
        def area(self) -> Scalar | None: ...
    else:
        friction: AbstractVar[AbstractFriction]
        area: AbstractVar[Any]

    @property
    def permissible_pressure(self) -> Any:
        """Permissible mean pressure of a lining (Pa), a number or (n,); `None`: none is
        given."""
        return None

    @property
    @abc.abstractmethod
    def count(self) -> int:
        """Number of linings."""

    @property
    def weights(self) -> Vector:
        """Sizes by which linings count in a mean over all of them."""
        return jnp.ones(self.count)


class Lining(AbstractLinings):
    """`n` linings as one object with a leading axis, counted from the slack to the
    tight end.

    - `angle` `β_i` (n,) in rad: central angle of each
    - `friction`: its law, with numbers for all or per lining
    - `area` `A_i` (m²), a number or (n,): needed where pressure matters
    - `mass` `m_i` (kg), a number or (n,): needed where the band is resolved into
      `segments`, else without effect
    - `permissible_pressure` (Pa), a number or (n,): limit of the mean pressure
      `N_i/A_i` for the verdict on a run
    - `continuous`: one lining along the band, of which these are pieces (an arc of 270°
      takes two at least): each is exact, `T_i = T_{i−1} e^{f_i β_i}` (Euler–Eytelwein),
      whatever their number. They are needed where temperature, wear or pressure is to
      differ along the band; the pressure `T/(R b)` is that at the edges of the pieces

    Example:
        >>> sb.Lining(0.35, ["14 deg", "13 deg"])
        Lining(friction=ConstantFriction(coefficient=0.35, static_ratio=1), angle=[14,
        13]°)
    """

    friction: AbstractFriction = part(AbstractFriction)
    angle: Scalar = positive_quantity(
        "rad", "central angle of a lining", high=math.pi * (1 - 1e-9), many=True
    )
    area: Scalar | None = positive_quantity(
        "m^2", "area of a lining", many=True, default=None
    )
    mass: Scalar | None = positive_quantity(
        "kg", "mass of a lining and its band", many=True, default=None
    )
    permissible_pressure: Scalar | None = positive_quantity(
        "Pa", "permissible mean pressure", many=True, default=None
    )
    continuous: bool = structural(default=False)

    def grip(self, f: Values) -> Vector:
        """`(μ_i − 1)/(μ_i + 1)` of the tension ratios `μ_i` of linings that slide with
        the coefficients `f`."""
        return grip(jnp.asarray(f), jnp.asarray(self.angle), continuous=self.continuous)

    def self_locking(self, f: Values) -> Vector:
        """Self-locking ratio of each lining: self-locking from 1."""
        return jnp.zeros(self.count) if self.continuous else self.grip(f)

    @property
    def cosine(self) -> Vector:
        """Friction of each lining over the rise of tension that it makes: `cos(β_i/2)`,
        1 of a continuous one."""
        return (
            jnp.ones(self.count)
            if self.continuous
            else jnp.cos(jnp.asarray(self.angle) / 2)
        )

    @property
    def count(self) -> int:
        return int((*jnp.shape(self.angle), 1)[0])

    @property
    def weights(self) -> Vector:
        return numpy_of(self.angle).asarray(self.angle)

    @property
    def wrap(self) -> ScalarArray:
        """Wrap angle `Σβ_i` in rad."""
        return jnp.sum(jnp.asarray(self.angle))


@takes_values
def uniform_linings(
    count: Annotated[int, Whole("number of linings", 1, 10_000)],
    wrap: Annotated[float, positive("rad", "wrap angle", 4 * math.pi)],
    friction: AbstractFriction | float,
    area: Annotated[float | None, positive("m^2", "area of a lining")] = None,
    mass: Annotated[
        float | None, positive("kg", "mass of a lining and its band")
    ] = None,
    permissible_pressure: Annotated[
        float | None, positive("Pa", "permissible mean pressure")
    ] = None,
    continuous: bool = False,
) -> Lining:
    """`count` equal linings over the angle `wrap` (rad); each of the `area` (m²) if
    pressure matters, of the `mass` (kg) in a chain; `permissible_pressure` (Pa): a
    limit for the verdict; `continuous`: pieces of one lining.

    Example:
        >>> sb.uniform_linings(20, "270 deg", 0.35)
        Lining(friction=ConstantFriction(coefficient=0.35, static_ratio=1), angle=20 ×
        13.5°)
    """
    options: Any = {
        "area": area,
        "mass": mass,
        "permissible_pressure": permissible_pressure,
        "continuous": continuous,
    }
    return Lining(angle=np.full(count, wrap / count), friction=friction, **options)


class Bandage(Part):
    """The linings of a staged brake as a bandage that rides on the pulley (model §4;
    K).

    The band rubs on the bandage (external pair, with `Lining.friction`), the bandage on
    the rim (internal pair):

        M_int = R Σ f_i N_int,i,   N_int,i = N_i + N_pre,i − m_i r_m ω_b² ≥ 0,   N_i =
        (T_i + T_{i−1}) sin(β_i/2)

    A lining lifts off the rim where its load comes to 0: rods and springs then carry
    the surplus, and the load of the band on it is unchanged.

    - `inertia` `J_b` about the shaft (kg·m²), all linings together; with springs also
      (n,), of each
    - `friction`: law `f` of the internal pair, with numbers for all linings or per
      lining
    - `preload` `N_pre,i` (N), a number for each or (n,): the interference with which a
      lining sits on the rim
    - `area` (m²) of a lining's inner face, a number or (n,): needed where pressure
      matters, and for overlaps
    - `mass` `m_i` (kg) of a lining, a number for each or (n,), and `mass_radius` `r_m`
      (m) of its centre of mass, for the centrifugal force; `None`: without
    - `spring` `K_j` (N/m) between neighbouring linings at the band circle, a number or
      (n − 1,): every lining is then a separate body (resolved bandage), which needs a
      rigid band; `None`: the bandage is one rigid body
    - `spring_damping` `ζ_j`: share of the critical damping of two neighbours on their
      spring, `D_j = 2 ζ_j √(K_j m_j)`, `1/m_j = R_b² (1/J_j + 1/J_{j+1})`

    Example:
        >>> sb.Bandage(45.0, 0.22, preload="900 N")
        Bandage(
          inertia=45 kg·m²,
          friction=ConstantFriction(coefficient=0.22, static_ratio=1),
          preload=900 N,
          spring_damping=0.05,
        )
    """

    inertia: Scalar = positive_quantity(
        "kg*m^2", "inertia of the bandage about the shaft", many=True
    )
    friction: AbstractFriction = part(AbstractFriction)
    preload: Scalar = quantity(
        "N", "interference load of a lining on the rim", low=0.0, many=True, default=0.0
    )
    area: Scalar | None = positive_quantity(
        "m^2", "area of a lining's inner face", many=True, default=None
    )
    spring: Scalar | None = positive_quantity(
        "N/m",
        "stiffness between neighbouring linings",
        many=IndexedBy.GAPS,
        default=None,
    )
    spring_damping: Scalar = quantity(
        "1",
        "share of critical damping of the springs",
        low=0.0,
        many=IndexedBy.GAPS,
        default=0.05,
    )
    mass: Scalar | None = quantity(
        "kg", "mass of a lining", low=0.0, many=True, default=None
    )
    mass_radius: Scalar | None = positive_quantity(
        "m", "radius of the centre of mass of a lining", many=True, default=None
    )

    def centrifugal_force(self, omega: Values) -> Floats | None:
        """`m_i r_m ω²` (N) of linings that turn with `omega` (rad/s); `None` without
        masses."""
        if self.mass is None or self.mass_radius is None:
            return None
        return jnp.asarray(self.mass) * self.mass_radius * omega**2


def unloaded(
    pair: AbstractLinings | Bandage,
    v: Vector,
    T: Floats | float | None,
    t: ScalarArray | None = None,
) -> Contact:
    """The contact of surfaces without load, at slip speeds `v` (n,) and temperatures
    `T` (K; `None`: unknown).

    As in a run it has a pressure only where the pair has areas; or where the law needs
    one. States of the law are those of the start. `t` (s): time of changes of the law,
    `None`: those of sound linings.
    """
    law = pair.friction
    n = np.size(v)
    pressed = pair.area is not None or needs(law, n).p
    factor = None if t is None else law.factor_at(n, t)
    return SurfaceState(T, memory_at_start(law, n), factor).contact(
        v, jnp.zeros_like(v) if pressed else None
    )


class BrakeWords(NamedTuple):
    """Names of a kind of brake, its linings and the body on which they rub.

    - `locking`: condition of self-locking, and `unlocking`, the remedy
    """

    brake: str
    lining: str
    body: str
    locking: str = ""
    unlocking: str = ""


class PairPlace(NamedTuple):
    """Description of a friction pair: the `field` of the brake with its linings, and
    the pair in words."""

    field: str
    words: str


class AbstractBrake(Part):
    """Interface of all kinds of brakes.

    - `linings`;  `inertia` `J` (kg·m²) of all that turns with the shaft, hook load not
    """

    words: AbstractClassVar[BrakeWords]
    if TYPE_CHECKING:

        @property
        def linings(self) -> AbstractLinings: ...

        @property
        def inertia(self) -> Scalar: ...
    else:
        linings: AbstractVar[AbstractLinings]
        inertia: AbstractVar[Any]

    @property
    @abc.abstractmethod
    def track_radius(self) -> Scalar:
        """Radius (m) of the friction track: its speed determines the cooling."""

    @property
    @abc.abstractmethod
    def radius(self) -> Scalar:
        """Radius (m) at which the friction of the linings acts."""

    @property
    def resolved(self) -> bool:
        """Whether linings move individually."""
        return False

    @property
    def pairs(self) -> dict[str, PairPlace]:
        """Friction pairs by name, first the one on which the lever acts."""
        return {
            "external": PairPlace(
                "linings", f"{self.words.lining}s on the {self.words.body}"
            )
        }

    def rubbing_part(self, pair: str) -> "AbstractLinings | Bandage":
        """The part that describes the linings of a friction pair: their law, their
        areas."""
        return getattr(self, self.pairs[pair].field)

    @property
    def bands_of_linings(self) -> tuple[AbstractLinings, ...]:
        """The linings, those of each band by themselves."""
        return (self.linings,)

    @property
    def rims(self) -> int:
        """Number of alike rims: forces, areas and numbers of linings are those of one
        of them."""
        return 1

    @property
    def force_words(self) -> str:
        """Of which bands the forces of a run are, in words: "" where there is one."""
        return "" if self.rims == 1 else f"forces of one of {self.rims} alike rims"

    @property
    def linings_of_rims(self) -> tuple[int, ...]:
        """Numbers of linings on each of the rims that bands may have by themselves;
        none: all linings have one."""
        return ()

    @property
    def in_series(self) -> bool:
        """Whether there are two friction pairs in series: runs then have stages."""
        return len(self.pairs) > 1

    @property
    def kind(self) -> str:
        """Name of a brake of this build."""
        return self.words.brake

    @property
    def features(self) -> tuple[str, ...]:
        """Features of this build that other brakes of its class lack, in words."""
        return ()

    @property
    def banded(self) -> bool:
        """Whether a band presses the linings, which then has tensions."""
        return False

    @abc.abstractmethod
    def torque(self, force: Values, f: Floats) -> ScalarArray:
        """Torque (N·m) of linings that slide ahead with the coefficients `f` under the
        `force` (N) of the lever."""

    @abc.abstractmethod
    def self_locking(self, f: Floats) -> Vector:
        """Self-locking ratio of each lining with the coefficients `f`: self-locking
        from 1."""

    @abc.abstractmethod
    def locking_words(self, i: int, share: float) -> str:
        """Reason why lining `i` (from 1) with the ratio `share` is self-locking."""

    def angle_path(self, i: int) -> str:
        """Path of the angle of lining `i` (from 0)."""
        return f"linings.angle[{i}]"

    def lever_shares(self, f: Values) -> VectorK:
        """Share of the tension of the lever that each band has, of linings with the
        coefficients `f`."""
        return jnp.ones(1)

    def faults(self, path: str) -> Faults:
        faults = Issues()
        for name, place in self.pairs.items():
            of = " of the internal pair" if name == "internal" else ""
            faults += faults_of_pair(
                self.rubbing_part(name), f"{path}.{place.field}", self.linings.count, of
            )
        return faults + self.faults_of_shape(path)

    def faults_of_shape(self, path: str) -> Faults:
        """Errors of the geometry."""
        return []


class AbstractBandBrake(AbstractBrake):
    """Interface of brakes whose linings one or several bands press on the rim of a
    `pulley`."""

    pulley: AbstractVar[Pulley]
    banded: ClassVar[bool] = True

    @property
    @abc.abstractmethod
    def stiffnesses(self) -> tuple[Scalar | AbstractStiffness | None, ...]:
        """Stiffness or geometry of each of the `bands_of_linings`, as it was given."""

    @property
    def inertia(self) -> Scalar:
        return self.pulley.inertia

    @property
    def track_radius(self) -> Scalar:
        return self.pulley.radius

    def self_locking(self, f: Floats) -> Vector:
        return self.linings.self_locking(f)  # pyright: ignore


class Brake(AbstractBandBrake):
    """A band-shoe brake: pulley, band and linings; staged where the linings ride on the
    pulley as a `bandage`.

    - `rims`: number of alike rims on the shaft, 2 on most drawworks, each with its own
      band, linings and bandage under one lever, which an equalizer shares equally

    With several rims everything of a band, its linings and its bandage is that of one
    rim, here and in the results: slack tension (of the duty and its limits), tensions,
    loads, areas, pressures, wear, strength, inertia of the bandage. Torques, works and
    energies are those of the whole brake, `M = n R_b T_0 (Π − 1)` on `n` rims;
    `Pulley.inertia`, load and torques on the shaft are those of the shaft. The heat
    part has all rims together as if they were one: the capacity of its rim is that of
    all rims, that of its lining `i` that of lining `i` of every band, and so are areas
    and conductances. Rims or bands that differ are a `MultiBandBrake`.

    Example:
        >>> sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35))
        Brake(
          pulley=Pulley(radius=0.59 m, inertia=1200 kg·m²), band=Band(radius=0.623 m),
          linings=Lining(friction=ConstantFriction(coefficient=0.35, static_ratio=1),
          angle=8 × 33.75°),
        )
    """

    pulley: Pulley
    band: Band
    linings: Lining
    bandage: Bandage | None = None
    rims: int = whole(
        "number of alike rims, each with its band",
        high=100,
        guesses=("bands", "drums", "pulleys"),
        default=1,
    )
    words: ClassVar[BrakeWords] = BrakeWords(
        "band brake",
        "lining",
        "pulley",
        "f·tan(β/2) ≥ 1 on a rigid band, the band is self-locking",
        "shorten the lining, lower its friction, or give the band a stiffness",
    )

    @property
    def radius(self) -> Scalar:
        return self.band.radius

    @property
    def pairs(self) -> dict[str, PairPlace]:
        on_rim = "linings on the rim"
        if self.bandage is None:
            return {"external": PairPlace("linings", on_rim)}
        return {
            "external": PairPlace("linings", "band on linings"),
            "internal": PairPlace("bandage", on_rim),
        }

    @property
    def stiffnesses(self) -> tuple[Scalar | AbstractStiffness | None, ...]:
        return (self.band.stiffness,)

    @property
    def force_words(self) -> str:
        words = super().force_words
        if not isinstance(self.band.stiffness, ParallelBands):
            return words
        of_all = f"forces are sums of {len(self.band.stiffness.bands)} parallel bands"
        return f"{words}; {of_all}" if words else of_all

    @property
    def kind(self) -> str:
        return (
            "staged brake"
            if self.in_series
            else "resolved brake"
            if self.resolved
            else "standard brake"
        )

    @property
    def features(self) -> tuple[str, ...]:
        features = (
            ()
            if self.band.segments is None
            else ("each on its own segment of the band",)
        )
        features = (*features, "staged") if self.in_series else features
        features = (
            (*features, "continuous lining") if self.linings.continuous else features
        )
        return features if self.rims == 1 else (*features, f"{self.rims} alike rims")

    def lever_shares(self, f: Values) -> VectorK:
        stiffness = self.band.stiffness
        if not isinstance(stiffness, ParallelBands):
            return super().lever_shares(f)
        return stiffness.shares(
            f, jnp.asarray(self.linings.angle), jnp.asarray(self.band.radius)
        )

    def torque(self, force: Values, f: Floats) -> ScalarArray:
        mu = tension_ratio(self.linings.grip(f))[0]
        torque = band_torque(
            jnp.asarray(self.band.radius), jnp.asarray(force), force * product(mu)
        )
        return torque if self.rims == 1 else self.rims * torque

    def locking_words(self, i: int, share: float) -> str:
        return f"lining {i}: f·tan(β/2) = {share:.4g} ≥ 1, the band is self-locking"

    @property
    def resolved(self) -> bool:
        """Whether linings move individually: a chain, or a bandage on springs."""
        sprung = self.bandage is not None and self.bandage.spring is not None
        return self.band.segments is not None or sprung

    def faults_of_shape(self, path: str) -> Faults:
        angle = np.asarray(self.linings.angle)
        where = f"{path}.linings.angle"
        if angle.ndim != 1:
            return [
                Fault(
                    where,
                    "a list of angles is needed, one per lining",
                    "one lining: [0.5]",
                )
            ]
        # they report it themselves
        laws = tuple(f"{path}.{place.field}.friction" for place in self.pairs.values())
        faults = [
            fault
            for fault in faults_of_sizes(self, path, angle.size)
            if not fault.path.startswith(laws)
        ]
        faults += faults_of_wrap(
            self.band.stiffness, angle, where, f"{path}.band.stiffness"
        )
        faults += fault_of_circle(self.band.radius, self.pulley, path, "band.radius")
        if self.rims > 1:
            faults += self._faults_of_rims(path, angle)
        if self.linings.continuous and (
            self.bandage is not None or self.band.segments is not None
        ):
            what = f"a {self.kind} has separate linings"
            faults.append(
                Fault(
                    f"{path}.linings.continuous",
                    what,
                    "leave it out, or the bandage or the segments",
                )
            )
        return faults or [
            *self._faults_of_springs(path, angle.size),
            *self._faults_of_segments(path),
        ]

    def _faults_of_rims(self, path: str, angle: np.ndarray) -> Faults:
        """Errors of several bands on one rim that are given as several rims."""
        if isinstance(self.band.stiffness, ParallelBands):
            what = (
                f"there are {len(self.band.stiffness.bands)} bands side by side on "
                f"each of {self.rims} rims"
            )
            hint = (
                "give the stiffness of one band; bands that share one rim are those "
                "of one rim: leave out `rims`"
            )
            return [Fault(f"{path}.band.stiffness", what, hint)]
        # the part whose faces rub on the rim
        area = (self.bandage or self.linings).area
        width = self.pulley.width
        if area is None or width is None:
            return []
        widest = float(
            np.max(np.asarray(area) / (angle * np.asarray(self.pulley.radius)))
        )
        if widest * self.rims > float(width) * (1 + 1e-9):
            return []
        what = (
            f"{self.rims} bands of linings {widest:.3g} m wide fit side by side on "
            f"one rim of {float(width):g} m"
        )
        hint = (
            "the width is that of one rim; bands that share one are a `MultiBandBrake`"
        )
        return [Fault(f"{path}.rims", what, hint)]

    def _faults_of_segments(self, path: str) -> Faults:
        band = self.band
        mass = self.linings.mass
        faults = Issues()
        if band.segments is None:
            if mass is not None:
                hint = "linings move individually only where the band has `segments`"
                faults.add(f"{path}.linings.mass", "has no effect", hint)
            return faults
        if self.bandage is not None:
            hint = (
                "the linings of a staged brake ride on the pulley; `Bandage.spring` "
                "resolves them"
            )
            faults.add(
                f"{path}.band.segments", "is not available for a staged brake", hint
            )
        if band.stiffness is None:
            hint = "with segments it is the stiffness of the one to the anchor"
            faults.add(f"{path}.band.stiffness", "is missing", hint)
        if mass is None:
            faults.add(
                f"{path}.linings.mass",
                "is missing",
                "each lining of a chain moves individually",
            )
        return faults

    def _faults_of_springs(self, path: str, n: int) -> Faults:
        """Errors of options that a resolved, or a rigid, bandage does not support."""
        bandage = self.bandage
        bandage_path = f"{path}.bandage"
        faults = Issues()
        if bandage is None:
            return faults
        if (bandage.mass is None) != (bandage.mass_radius is None):
            missing = "mass" if bandage.mass is None else "mass_radius"
            faults.add(
                f"{bandage_path}.{missing}",
                "is missing",
                "the centrifugal force needs both, or leave out both",
            )
        if bandage.spring is None:
            lists = [
                name
                for name in ("inertia", "spring_damping")
                if np.ndim(getattr(bandage, name))
            ]
            what = f"does not fit {n} linings"
            return faults + [
                Fault(f"{bandage_path}.{name}", what, "give one number, or springs")
                for name in lists
            ]
        if self.band.stiffness is not None:
            hint = "leave it out: with separate linings the band has no single motion"
            faults.add(
                f"{path}.band.stiffness",
                "a bandage with springs needs a rigid band",
                hint,
            )
        for pair, where in (
            (self.linings, f"{path}.linings.friction"),
            (bandage, f"{bandage_path}.friction"),
        ):
            law = pair.friction
            if needs(law, n).p or reads(law, n, T=True, p=pair.area is not None).p:
                faults.add(
                    where,
                    "cannot depend on the pressure in a bandage with springs",
                    "leave it out",
                )
            elif pair is bandage and not reads(law, n, T=True, p=False).T:
                still = unloaded(pair, np.zeros(n), None)
                turns = (
                    self.pulley.radius
                    * np.asarray(law.static(still))
                    * np.sin(np.asarray(self.linings.angle) / 2)
                )
                if np.any(turns >= self.band.radius):
                    faults.add(
                        where, "a lining held by the band could not slide on the rim"
                    )
        return faults


def faults_of_pair(
    pair: AbstractLinings | Bandage, path: str, n: int, of: str = ""
) -> Faults:
    """Errors of the friction law of a pair's linings, `of` the pair in words, and of
    their areas."""
    faults = Issues(faults_of_law(pair.friction, f"{path}.friction", n))
    if pair.area is None and needs(pair.friction, n).p:
        faults.add(
            f"{path}.area",
            "is missing",
            f"the friction law{of} depends on the pressure",
        )
    elif pair.area is None and getattr(pair, "permissible_pressure", None) is not None:
        faults.add(
            f"{path}.area",
            "is missing",
            "a permissible pressure needs the area of a lining",
        )
    return faults


#: a band circle of more than so many track radii is none: between them are linings and
#: half a band; usual are up to
_MOST_CIRCLE = 2.0
USUAL_CIRCLE = 1.5


def fault_of_circle(radius: Scalar, pulley: Pulley, path: str, field: str) -> Faults:
    """Error of a band circle inside the track, or far outside of it, as by another unit
    of one of the two."""
    band = float(radius)
    track = float(pulley.radius)
    if track <= band <= _MOST_CIRCLE * track:
        return []
    where = "inside" if band < track else f"{band / track:.4g} times"
    hint = "the band circle is the track radius + lining + half the band"
    if meant := meant_within(band, track, USUAL_CIRCLE * track):
        hint += f": did you mean {meant}?"
    elif meant := meant_within(track, band / USUAL_CIRCLE, band):
        hint += f": did you mean {path}.pulley.radius = {meant}?"
    return [
        Fault(
            f"{path}.{field}", f"{band:g} m is {where} the track of {track:g} m", hint
        )
    ]


def faults_of_wrap(
    stiffness: Scalar | AbstractStiffness | None,
    angle: np.ndarray,
    where: str,
    path: str,
) -> Faults:
    """Errors of linings that do not fit on the pulley, or of the stiffness of their
    band."""
    wrap = np.sum(angle)
    longest = 2 * math.pi
    gaps = ""
    if isinstance(stiffness, AbstractStiffness):
        faults = stiffness.faults_with(path, angle.size)
        if faults:
            return faults
        bare = stiffness.bare_angle(angle.size)
        wrap = wrap + bare
        longest = stiffness.longest_wrap
        gaps = " with their gaps" if bare else ""
    if wrap > longest * (1 + 1e-12):
        has = (
            "the pulley has"
            if longest <= 2 * math.pi
            else f"{math.degrees(longest):.0f}°"
        )
        # 270 rad of many short linings are within the range of each
        meant = (
            f'; did you mean "{wrap:.4g} deg"?'
            if wrap > 3 * math.pi and wrap <= 540
            else ""
        )
        return [
            Fault(
                where,
                f"the linings span {math.degrees(wrap):.1f}°{gaps}",
                f"more than {has}{meant}",
            )
        ]
    return []


def under_a_band(brake: AbstractBrake) -> Brake:
    """Return the brake if it has one band. Raises `InputError` for another kind."""
    if not isinstance(brake, Brake):
        needed = "a brake with one band" if brake.banded else "a band brake"
        problem = f"is a {brake.words.brake}: this needs {needed}"
        raise input_error("brake", problem, "take a `Brake`, with band and linings")
    return brake


def _still_friction(
    linings: AbstractLinings, temperature: Values | None, time: Values | None
) -> Vector:
    law = linings.friction
    n = linings.count
    if temperature is None and needs(law, n).T:
        raise ValueError("the friction law depends on the temperature: give it")
    T = (
        None
        if temperature is None
        else jnp.broadcast_to(jnp.asarray(temperature), (n,))
    )
    at = None if time is None else jnp.asarray(time)
    return jnp.broadcast_to(law.kinetic(unloaded(linings, jnp.zeros(n), T, at)), (n,))


def stiffness_of(
    brake: AbstractBrake, temperature: Values | None = None, time: Values | None = None
) -> ScalarArray | None:
    """Stiffness `C` of a brake's band in N/m, given or from its geometry; `None` for a
    rigid band.

    The friction along a geometry is the linings' kinetic coefficient at zero speed,
    without pressure, and at the `temperature` (K, a number or (n,)) if the law depends
    on it; of a law that changes over time at the `time` (s), `None`: that of sound
    linings. A run takes those of its start, and the stiffness is constant in it.

    Raises `ValueError` if that temperature is needed and missing, `InputError` for a
    brake without a band, or with several.

    Example:
        >>> brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, 1e5), sb.uniform_linings(8, 4.0, 0.3))
        >>> float(sb.brakes.stiffness_of(brake))
        100000.0
    """
    stiffness = under_a_band(brake).band.stiffness
    if not isinstance(stiffness, AbstractStiffness):
        return None if stiffness is None else jnp.asarray(stiffness)
    f = _still_friction(brake.linings, temperature, time)
    return stiffness.stiffness(
        f, jnp.asarray(brake.linings.weights), jnp.asarray(brake.radius)
    )


def tension_shares(
    brake: AbstractBrake, temperature: Values | None = None, time: Values | None = None
) -> VectorK:
    """Share of the lever's tension that each of a brake's parallel bands has (K-8);
    `[1]` where there is one band.

    `temperature`, `time` as in `stiffness_of`. Raises `InputError` for a brake without
    a band.
    """
    brake = brake if brake.banded else under_a_band(brake)
    if isinstance(brake, Brake) and not isinstance(brake.band.stiffness, ParallelBands):
        return jnp.ones(1)
    return brake.lever_shares(_still_friction(brake.linings, temperature, time))
