"""Interface of a load, and hoists whose load depends on the angle: counterweights and
windlasses."""

import math
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from ._base._faults import Faults, Issues
from ._base._part import Part, positive_quantity, quantity
from ._base._quantity import Scalar
from .hybrid.arrays import Array
from .hybrid.struct import AbstractVar
from .profiles import AbstractProfile, Constant, Piece, Real
from .rope import RopeElasticity, RopeLayers

__all__ = [
    "GRAVITY",
    "AbstractLoad",
    "CounterweightLoad",
    "LoadWords",
    "RopesNow",
    "WindlassLoad",
    "moving_share",
]

GRAVITY = 9.80665  # m/s², standard acceleration of free fall (3rd CGPM, 1901)


def free_fall() -> Any:
    """The field of the acceleration of free fall, of a load with a weight."""
    return positive_quantity("m/s^2", "acceleration of free fall", default=GRAVITY)


def linear_drag() -> Any:
    """The field of a drag that grows with the speed, of a load."""
    return quantity("N*m*s", "drag torque per unit of speed", low=0.0, default=0.0)


class RopesNow(NamedTuple):
    """Ropes or chain with a weight of their own, at one travel of the hook.

        M = M_r − ½ J_r' ω² − b ω |ω|,   lost power b |ω|³

    - `torque` `M_r` (N·m): of their weight
    - `inertia` `J_r` (kg·m²), and `slope` `J_r'` (kg·m²/rad) over the angle
    - `loss` `b` (kg·m²): of what is picked up from rest, or laid down
    """

    torque: Any
    inertia: Any
    slope: Any = 0.0
    loss: Any = 0.0

    def torque_in_motion(self, omega: Real) -> Any:
        """`M` (N·m) at the speed `omega` (rad/s)."""
        return self.torque - (0.5 * self.slope * omega + self.loss * abs(omega)) * omega


class LoadWords(NamedTuple):
    """Names of what hangs, of what carries its rope or chain, and of these ropes."""

    hook: str = "hook"
    drum: str = "drum"
    rope: str = "rope"
    ropes: str = "ropes"


class AbstractLoad(Part):
    """Load on the pulley: a torque on its shaft, positive in the braking direction of
    rotation, and an inertia.

    A class of yours overrides `torque`, or `torque_by_angle` where the torque depends
    on the angle. The work of either is `load_work`.
    """

    #: the profile whose time breakpoints the load has
    profile: AbstractVar[AbstractProfile]
    #: whether its pieces are those of the phases of the duty (`Phases`)
    by_phases: ClassVar[bool] = False

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        """`M_load(t, ω)` in N·m, without its ropes."""
        if type(self).torque_by_angle is AbstractLoad.torque_by_angle:
            name = type(self).__name__
            raise NotImplementedError(
                f"{name} has neither `torque` nor `torque_by_angle`"
            )
        return self.torque_by_angle(t, omega, piece, jnp.zeros(()))

    def torque_by_angle(self, t: Real, omega: Real, piece: Piece, phi: Real) -> Real:
        """`M_load(t, ω, φ)` in N·m, without its ropes; `phi` (rad) since the start."""
        return self.torque(t, omega, piece)

    def ropes(self, lowered: Any, piece: Piece) -> RopesNow | None:
        """Its ropes when the hook has travelled so far (m) since the start; `None`:
        they have no weight."""
        return None

    @property
    def by_angle(self) -> bool:
        """Whether it depends on the angle."""
        own = type(self).torque_by_angle is not AbstractLoad.torque_by_angle
        return own or self.ropes(np.zeros(()), 0) is not None

    def whole_torque(
        self, t: Real, omega: Real, piece: Piece, phi: Real, lowered: Any
    ) -> Array:
        """Torque (N·m) with that of the ropes."""
        torque = jnp.asarray(self.torque_by_angle(t, omega, piece, phi))
        ropes = self.ropes(lowered, piece)
        return torque if ropes is None else torque + ropes.torque_in_motion(omega)

    def rope_span(self) -> tuple[Real, Real] | None:
        """Least and greatest travel of the hook (m) since the start that the rope
        allows; `None`: any."""
        return None

    def slack_margin(self, lowered: Any, alpha: Real) -> Array | None:
        """Margin to a slack rope, or one that slips on its sheave, at an acceleration
        `alpha` (rad/s²) of the pulley; positive while all ropes pull and drive, `None`:
        not watched."""
        return None

    def above_ground(self, lowered: Any) -> Array | None:
        """Height of what hangs above the ground that takes it (m); `None`: there is no
        such ground. Standing on it is the piece 1 of the load."""
        return None

    def inertia(self) -> Scalar | float:
        """Inertia it adds to the shaft at the start without its ropes, in kg·m²."""
        return 0.0

    def piece_in_phase(self, place: Array, stands: Array, hanging: Array) -> Array:
        """Piece of the load in a phase of the duty (see `Phases.string_at`), of one
        `by_phases`."""
        return 0 * place

    def faults_in_phases(
        self, path: str, count: int, stands: tuple[int, int]
    ) -> Faults:
        """Errors in a duty of `count` different phases that adds so many stands at
        least and at most."""
        return []

    def added_inertia(self, piece: Piece) -> Array | None:
        """Inertia beyond that of the start, where the load changes in a run; `None`: it
        never does."""
        return None

    def travel(self) -> Scalar | None:
        """Travel of the hook per radian of the pulley, in m, or `None`."""
        return None

    def hanging(self, piece: Piece) -> tuple[Real, Real] | None:
        """Mass on the hook (kg), and its weight (N), or `None`."""
        return None

    def travelled(self, phi: Array | float) -> Array | float | None:
        """Travel of the hook (m) since the start at the angle `phi` (rad) of the
        pulley, or `None`."""
        per_radian = self.travel()
        return None if per_radian is None else phi * per_radian

    def pull(self, force: Array, lowered: Any, alpha: Array, piece: Piece) -> Array:
        """Pull (N) of all lines where it is greatest, of a `force` on the hook at an
        acceleration `alpha` (rad/s²) of the pulley."""
        return force

    @property
    def words(self) -> LoadWords:
        """What the trade calls its parts."""
        return LoadWords()

    @property
    def lines(self) -> Scalar | None:
        """Lines strung, `None`: the load hangs on no tackle."""
        return None

    @property
    def layers(self) -> RopeLayers | None:
        """Layers of the rope on the drum; `None`: its effective radius stays the
        same."""
        return None

    @property
    def elastic(self) -> RopeElasticity | None:
        """Stretch of the rope between drum and hook; `None`: it is rigid."""
        return None

    def faults(self, path: str) -> Faults:
        return self.profile.faults(f"{path}.profile")  # (which need not be a field)

    def on_layer(self, layer: Array | None) -> "AbstractLoad":
        """The load with its rope in a layer (from 1) on the drum; `None`: as it is."""
        return self


class CounterweightLoad(AbstractLoad):
    """A car and a counterweight, or two conveyances of a winder, on ropes over a drum
    or a sheave, with or without a tail rope.

        M = g (r/i) [m_A − m_B + (i q − q_t) D] − c ω
        D = 2 l_A − L,   l_A = l_0 + r φ/i
        J = (r/i)² (m_A + m_B + q_t L) + r² q L k/i²,   k = i² + i (i − 1)(i − 2)/3

    - `car` `m_A` and `counterweight` `m_B` (kg), of either weight: the one that goes
      down as the pulley turns in the braking direction, with all that is in it, and the
      other. A counterweight heavier than the car pulls up
    - `drum_radius` `r` (m) at which the rope runs; `roping` `i`: falls of the rope on
      each side (1: 1:1, 2: 2:1)
    - `rope_mass` `q` (kg/m) of all ropes together; `tail_mass` `q_t` (kg/m) of the tail
      rope
    - `length` `L` (m): both hanging lengths together; `hanging_length` `l_0` (m) of it
      on the side of the car at the start. Needed where a rope has a mass; the run ends
      with the code `rope_end` where one side is used up
    - `traction` `e^(f α)`: tension of one side over the other up to which the rope does
      not slip on its sheave, `None`: it cannot slip (a drum)
    - `drag` (N·m·s), `gravity` (m/s²)

    The run ends with the code `slack_rope` where one side decelerates upwards with more
    than `g`, so that its rope is slack, or where the rope would slip. Ropes and sheaves
    are rigid and without loss; the inertia of sheaves belongs to that of the drum.
    Source: energy of both sides (Lagrange); Euler and Eytelwein for the traction.

    Example:
        >>> lift = sb.loads.CounterweightLoad("1200 kg", "1650 kg", "320 mm", roping=2)
        >>> round(float(lift.torque(0.0, 0.0, 0)), 2)
        -706.08
    """

    car: Scalar = quantity("kg", "mass of the car with its load", low=0.0)
    counterweight: Scalar = quantity(
        "kg", "mass of the counterweight, or of the other conveyance", low=0.0
    )
    drum_radius: Scalar = positive_quantity("m", "effective radius of drum or sheave")
    roping: Scalar = quantity("1", "falls of the rope on each side", 1.0, default=1.0)
    rope_mass: Scalar = quantity(
        "kg/m", "mass per length of all ropes", low=0.0, default=0.0
    )
    tail_mass: Scalar = quantity(
        "kg/m", "mass per length of the tail rope", low=0.0, default=0.0
    )
    length: Scalar | None = positive_quantity(
        "m", "hanging lengths of both sides together", default=None
    )
    hanging_length: Scalar | None = quantity(
        "m", "hanging length on the side of the car at the start", low=0.0, default=None
    )
    traction: Scalar | None = quantity(
        "1", "greatest tension of a side over the other", 1.0, default=None
    )
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()

    @property
    def profile(self) -> Constant:
        # its value bears the scale of the torque
        return Constant((self.car + self.counterweight) * self.gravity * self.travel())

    @property
    def words(self) -> LoadWords:
        on_sheave = self.traction is not None
        return LoadWords("car", "sheave") if on_sheave else LoadWords("conveyance")

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        over = self.car - self.counterweight
        return over * self.gravity * self.travel() - self.drag * omega

    def inertia(self) -> Scalar:
        return (self.car + self.counterweight) * self.travel() ** 2

    def travel(self) -> Scalar:
        return self.drum_radius / self.roping

    def hanging(self, piece: Piece) -> tuple[Real, Real]:
        return self.car, self.car * self.gravity

    def ropes(self, lowered: Any, piece: Piece) -> RopesNow | None:
        if self.length is None or self.hanging_length is None:
            return None
        i = self.roping
        more = 2 * (self.hanging_length + lowered) - self.length
        net = i * self.rope_mass - self.tail_mass
        moving = i**2 * self.rope_mass * moving_share(i) + self.tail_mass
        return RopesNow(
            self.gravity * self.travel() * net * more,
            moving * self.length * self.travel() ** 2,
        )

    def rope_span(self) -> tuple[Real, Real] | None:
        if self.length is None or self.hanging_length is None:
            return None
        return -self.hanging_length, self.length - self.hanging_length

    def tensions(self, lowered: Any, alpha: Any) -> tuple[Array, Array]:
        """Tension (N) of all ropes on the side of the car, and on the other one, at an
        acceleration `alpha` (rad/s²) of the pulley."""
        down = self.gravity - self.travel() * alpha
        up = self.gravity + self.travel() * alpha
        car: Any = self.car
        other: Any = self.counterweight
        if self.length is not None and self.hanging_length is not None:
            here = self.hanging_length + lowered
            there = self.length - here
            rope = self.roping * self.rope_mass
            car = car + rope * here + self.tail_mass * there
            other = other + rope * there + self.tail_mass * here
        return car * down / self.roping, other * up / self.roping

    def slack_margin(self, lowered: Any, alpha: Real) -> Array:
        free = 1.0 - jnp.abs(jnp.asarray(alpha) * self.travel()) / self.gravity
        if self.traction is None:
            return free
        sides = jnp.stack(self.tensions(lowered, alpha))
        least, most = jnp.min(sides), jnp.max(sides)
        return jnp.minimum(free, (least * self.traction - most) / most)

    def pull(self, force: Array, lowered: Any, alpha: Array, piece: Piece) -> Array:
        return jnp.maximum(*self.tensions(lowered, alpha))

    def faults(self, path: str) -> Faults:
        faults = Issues()
        if float(self.car) == 0.0 and float(self.counterweight) == 0.0:
            what = "is 0, and so is the counterweight"
            faults.add(f"{path}.car", what, "give the mass of a side")
        given = (self.length is not None, self.hanging_length is not None)
        if any(given) and not all(given):
            name = "hanging_length" if given[0] else "length"
            hint = "give `length` and `hanging_length`"
            faults.add(f"{path}.{name}", "is missing", hint)
        for name in ("rope_mass", "tail_mass"):
            if float(getattr(self, name)) > 0.0 and not any(given):
                what = "acts over the hanging lengths, which are missing"
                hint = "give `length` and `hanging_length`"
                faults.add(f"{path}.{name}", what, hint)
        start, whole = (
            math.nan if length is None else float(length)
            for length in (self.hanging_length, self.length)
        )
        if start > whole:
            what = f"{start:g} m is more than the whole length"
            hint = f"give at most {whole:g} m"
            faults.add(f"{path}.hanging_length", what, hint)
        return faults


def moving_share(lines: Any) -> Any:
    """Sum of the squared speeds of the lines of a tackle over the speed of the rope
    squared, `k/N²`.

    The lines have `N, N − 2, N − 2, N − 4, …` times the speed of the hook, whose
    squares have the sum `k = N² + N (N − 1)(N − 2)/3`.
    """
    return 1 + (lines - 1) * (lines - 2) / (3 * lines)


class WindlassLoad(AbstractLoad):
    """An anchor on a chain that a gypsy pays out of its locker, until the anchor stands
    on the ground.

        hanging:        M = g r [b (m + q l) + (1 − b) q f − q h] − c ω,  l = l_0 + r φ
        on the ground:  M = g r [b q D + (1 − b) q f − q h] − c ω
        J = r² [m + q (l + h + w)], without m and with l = D on the ground

    - `anchor` `m` (kg);  `chain_mass` `q` (kg/m);  `gypsy_radius` `r` (m)
    - `hanging_length` `l_0` (m) below the gypsy at the start;  `depth` `D` (m) from the
      gypsy to the ground;  `length` (m) of the whole chain below the gypsy when all of
      it is paid out. There, and where the anchor comes to the water, the run ends with
      the code `rope_end`
    - `lift` `h` (m) from the chain in the locker up to the gypsy;  `wrapped` `w` (m):
      chain on the gypsy
    - `submerged` `b`: weight under water over weight, 1 − ρ_w/ρ (steel in sea water
      0.869);  `freeboard` `f` (m): gypsy above the water
    - `drag` (N·m·s), `gravity` (m/s²)

    Chain that begins to move takes the momentum `q v` per length, and chain that is
    laid down gives none back: paying out a hanging anchor needs `q r³ ω²`, with the
    anchor on the ground the torque is against either sense. The energy that is lost,
    `½ q |v|³` on each side where chain starts or ends its motion, and `½ m v²` of an
    anchor that comes to the ground, is `pick_up_heat`. Hoisting lifts the anchor with
    the momentum of all that moves (event `anchor_lifted`). Resistance of the water, the
    pull of the ship and the friction of the hawse pipe are not in it. Source: momentum
    of a chain with one end at rest (Cayley 1857).

    Example:
        >>> chain = ("120 kg/m", "0.4 m", "6 m", "45 m", "300 m")
        >>> windlass = sb.loads.WindlassLoad("5 t", *chain)
        >>> round(float(windlass.torque(0.0, 0.0, 0)))
        17052
    """

    anchor: Scalar = positive_quantity("kg", "mass of the anchor")
    chain_mass: Scalar = positive_quantity("kg/m", "mass per length of the chain")
    gypsy_radius: Scalar = positive_quantity("m", "radius at which the chain runs")
    hanging_length: Scalar = quantity(
        "m", "chain below the gypsy at the start", low=0.0
    )
    depth: Scalar = positive_quantity("m", "depth of the ground below the gypsy")
    length: Scalar = positive_quantity("m", "chain that can be paid out")
    lift: Scalar = quantity("m", "lift from locker to gypsy", low=0.0, default=0.0)
    wrapped: Scalar = quantity("m", "chain on the gypsy", low=0.0, default=0.0)
    submerged: Scalar = quantity(
        "1", "weight under water over weight", 0.0, 1.0, default=1 - 1025 / 7850
    )
    freeboard: Scalar = quantity("m", "gypsy above the water", low=0.0, default=0.0)
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()

    @property
    def profile(self) -> Constant:
        # its value bears the scale of the torque
        most = self.anchor + self.chain_mass * self.depth
        return Constant(most * self.gravity * self.gypsy_radius)

    @property
    def words(self) -> LoadWords:
        return LoadWords("anchor", "gypsy", "chain", "chain")

    def mass_on(self, piece: Piece) -> Array:
        """Mass (kg) on the end of the chain, 0 of an anchor on the ground."""
        return jnp.where(jnp.asarray(piece) > 0, 0.0, jnp.asarray(self.anchor))

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        return self.hanging(piece)[1] * self.gypsy_radius - self.drag * omega

    def travel(self) -> Scalar:
        return self.gypsy_radius

    def hanging(self, piece: Piece) -> tuple[Real, Real]:
        mass = self.mass_on(piece)
        return mass, self.submerged * mass * self.gravity

    def _below(self, lowered: Any, piece: Piece) -> Array:
        """Chain that hangs below the gypsy (m)."""
        standing = jnp.asarray(piece) > 0
        return jnp.where(standing, self.depth, self.hanging_length + lowered)

    def ropes(self, lowered: Any, piece: Piece) -> RopesNow:
        below = self._below(lowered, piece)
        hangs = jnp.where(jnp.asarray(piece) > 0, 0.0, 1.0)
        q = self.chain_mass
        r = self.gypsy_radius
        weight = self.submerged * below + (1 - self.submerged) * self.freeboard
        moving = self.mass_on(piece) + q * (below + self.lift + self.wrapped)
        return RopesNow(
            self.gravity * r * q * (weight - self.lift),
            moving * r**2,
            q * r**3 * hangs,
            q * r**3 * (1 - 0.5 * hangs),
        )

    def rope_span(self) -> tuple[Real, Real]:
        start = self.hanging_length
        return self.freeboard - start, self.length - start

    def above_ground(self, lowered: Any) -> Array:
        return jnp.asarray(self.depth - (self.hanging_length + lowered))

    def pull(self, force: Array, lowered: Any, alpha: Array, piece: Piece) -> Array:
        below = self._below(lowered, piece)
        weight = self.submerged * below + (1 - self.submerged) * self.freeboard
        inertia = below * self.gypsy_radius * alpha
        return force + self.chain_mass * (weight * self.gravity - inertia)

    def faults(self, path: str) -> Faults:
        faults = Issues()
        least = max(float(self.depth), float(self.hanging_length))
        if float(self.length) < least:
            length = f"{float(self.length):g} m"
            hangs = float(self.hanging_length) > float(self.depth)
            of = "that hang at the start" if hangs else "to the ground"
            what = f"{length} is shorter than the {least:g} m {of}"
            less = "hanging_length" if hangs else "depth"
            hint = f"give a longer chain, or a smaller {less}"
            faults.add(f"{path}.length", what, hint)
        if float(self.freeboard) > min(float(self.hanging_length), float(self.depth)):
            what = f"{float(self.freeboard):g} m is more than hangs at the start"
            hint = "let the anchor begin under water"
            faults.add(f"{path}.freeboard", what, hint)
        return faults
