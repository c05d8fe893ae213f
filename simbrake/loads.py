"""Loads on the shaft, and levers of the driller."""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np

from ._base._arguments import explained
from ._base._faults import DRUM_RADIUS, Fault, Faults, Issues
from ._base._part import (
    Part,
    part,
    parts_below,
    positive_quantity,
    quantity,
    short_for,
    whole,
)
from ._base._quantity import IndexedBy, Quantity, Scalar, Values, in_si
from .friction import interpolated
from .hoists import (
    GRAVITY,
    AbstractLoad,
    CounterweightLoad,
    LoadWords,
    RopesNow,
    WindlassLoad,
    free_fall,
    linear_drag,
    moving_share,
)
from .hybrid.arrays import Array, Floats, Mark, ScalarArray, TwoArrays
from .hybrid.struct import AbstractClassVar, AbstractVar, with_fields
from .phases import (
    AfterTime,
    AfterTravel,
    AtHeight,
    AtRest,
    AtStop,
    AtTemperature,
    Phase,
    Phases,
    held_within,
    levers_of,
)
from .profiles import (
    AbstractHistory,
    AbstractPoints,
    AbstractProfile,
    Constant,
    Piece,
    PiecewiseLinear,
    Real,
    Repeated,
    faults_of_sign,
    point,
)
from .rope import RopeElasticity, RopeLayers, RopeWeight
from .shaft import (
    AbstractAuxiliaryBrake,
    AbstractDryTorque,
    AbstractShaftTorque,
    BearingFriction,
    EddyCurrentBrake,
    HydrodynamicBrake,
    TabulatedDrag,
    TackleLoss,
    ViscousDrag,
    faults_of_table,
)

__all__ = [
    "GRAVITY",
    "AbstractAuxiliaryBrake",
    "AbstractDryTorque",
    "AbstractLoad",
    "AbstractShaftTorque",
    "Actuator",
    "AfterTime",
    "AfterTravel",
    "AtHeight",
    "AtRest",
    "AtStop",
    "AtTemperature",
    "BearingFriction",
    "CounterweightLoad",
    "Cylinder",
    "Driller",
    "EddyCurrentBrake",
    "HookLoad",
    "HydrodynamicBrake",
    "Lever",
    "Motor",
    "Phase",
    "Phases",
    "RecordedLoad",
    "RecordedMotion",
    "RopeElasticity",
    "RopeLayers",
    "RopeWeight",
    "SpeedHold",
    "StringLoad",
    "TabulatedDrag",
    "TabulatedLoad",
    "TackleLoss",
    "TorqueLoad",
    "TrippingLoad",
    "ViscousDrag",
    "WindlassLoad",
    "differential_lever_tension",
]


@short_for(AbstractLoad)
class TorqueLoad(AbstractLoad):
    """A given torque with linear drag, `M_load = M(t) − c ω`.

    - `profile`: `M(t)` in N·m; `drag` `c` in N·m·s

    Example:
        >>> sb.TorqueLoad("12 kN*m")
        TorqueLoad(profile=Constant(level=12 kN·m), drag=0 N·m·s)
    """

    profile: AbstractProfile = part(AbstractProfile, "N*m", default=0.0)
    drag: Scalar = linear_drag()

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        return self.profile.value(t, piece) - self.drag * omega


class TabulatedLoad(AbstractLoad):
    """A torque over speed as a table, such as that of a rotor in the wind or of a motor
    that drives: `M_load = κ(t) M(ω)`, a monotone cubic (Fritsch–Carlson) through the
    points.

    - `speed` (k,) in rad/s, increasing; `torque_at` (k,) in N·m, positive in the braking
      direction of rotation
    - `share` `κ(t)`, a number or a profile

    Beyond its ends the torque is that of the ends.

    Raises `InputError` for a table that is no function of the speed.

    Example:
        >>> rotor = sb.loads.TabulatedLoad([0.0, 10.0, 20.0], ["8 kN*m", "12 kN*m", "3 kN*m"])
        >>> float(rotor.torque(0.0, 10.0, None))
        12000.0
    """

    speed: Scalar = quantity("rad/s", "speeds of the table", many=IndexedBy.ROWS)
    torque_at: Scalar = quantity("N*m", "torques of the table", many=IndexedBy.ROWS)
    share: AbstractProfile = part(AbstractProfile, "1", default=1.0)

    @property
    def profile(self) -> AbstractProfile:
        return self.share

    @property
    def words(self) -> LoadWords:
        return LoadWords(drum="shaft")

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        share = self.share.value(t, piece)
        return share * interpolated(omega, self.speed, self.torque_at)

    def faults(self, path: str) -> Faults:
        faults = faults_of_table(path, self.speed, self.torque_at)
        return faults + self.share.faults(f"{path}.share")


class AbstractHookLoad(AbstractLoad):
    """A load on a hook: lines strung, and the rope on the drum."""

    drum_radius: AbstractVar[Scalar]
    line_count: AbstractVar[Scalar]
    gravity: AbstractVar[Scalar]
    drag: AbstractVar[Scalar]
    rope: AbstractVar[RopeLayers | None]
    elasticity: AbstractVar[RopeElasticity | None]
    weight: AbstractVar[RopeWeight | None]

    @property
    def words(self) -> LoadWords:
        # (on a single line there need not be a hook)
        return LoadWords("load") if float(self.line_count) == 1.0 else LoadWords()

    def mass_on(self, piece: Piece) -> Any:
        """Mass (kg) on the hook on a piece."""
        raise NotImplementedError

    def torque(self, t: Real, omega: Real, piece: Piece) -> Real:
        return self.mass_on(piece) * self.gravity * self.travel() - self.drag * omega

    def hanging(self, piece: Piece) -> tuple[Real, Real]:
        return self.mass_on(piece), self.mass_on(piece) * self.gravity

    @classmethod
    def meant_by(cls, name: str, given: Mapping[str, Any]) -> str:
        words = super().meant_by(name, given)
        rope = given.get("rope")
        if DRUM_RADIUS not in words:
            return words
        length = Quantity("m", "diameter")
        other = rope.get("diameter") if isinstance(rope, Mapping) else None
        diameters = (
            in_si(given.get(name), length),
            in_si(getattr(rope, "diameter", other), length),
        )
        known = all(isinstance(x, np.ndarray) and x.ndim == 0 for x in diameters)
        return f"{words} = {float(sum(diameters)) / 2:g} m" if known else words

    @property
    def lines(self) -> Scalar:
        return self.line_count

    @property
    def layers(self) -> RopeLayers | None:
        return self.rope

    @property
    def elastic(self) -> RopeElasticity | None:
        return self.elasticity

    def travel(self) -> Scalar:
        return self.drum_radius / self.line_count

    def travelled(self, phi: Array | float) -> Array | float:
        if self.rope is None:
            return phi * self.travel()
        return self.rope.paid_out(self.drum_radius, phi) / self.line_count

    def on_layer(self, layer: Array | None) -> AbstractLoad:
        if self.rope is None or layer is None:
            return self
        radius = self.rope.radius(jnp.asarray(self.drum_radius), layer)
        weight = self.weight
        if weight is not None:
            weight = with_fields(weight, length=self._rope_length())
        return with_fields(self, drum_radius=radius, weight=weight)

    def _rope_length(self) -> Array:
        """`L` (m) of a rope with a weight; the radius is that of the first layer."""
        assert self.weight is not None
        radius = jnp.asarray(self.drum_radius)
        return self.weight.whole(radius, self.line_count, self.rope)

    def ropes(self, lowered: Any, piece: Piece) -> RopesNow | None:
        rope = self.weight
        if rope is None:
            return None
        n = self.line_count
        r = self.drum_radius
        line = rope.hanging_length + lowered
        torque = self.gravity * rope.linear_mass * r * (line - rope.drum_below)
        of_line = moving_share(n) - n
        inertia = rope.linear_mass * r**2
        moving = inertia * (self._rope_length() + line * of_line)
        return RopesNow(torque, moving, inertia * of_line * self.travel())

    def rope_span(self) -> tuple[Real, Real] | None:
        rope = self.weight
        if rope is None:
            return None
        longest = (self._rope_length() - rope.drum_below) / self.line_count
        return -rope.hanging_length, longest - rope.hanging_length

    def pull(self, force: Array, lowered: Any, alpha: Array, piece: Piece) -> Array:
        rope = self.weight
        if rope is None:
            return force
        lines = self.line_count * rope.linear_mass * (rope.hanging_length + lowered)
        return force + lines * (self.gravity - self.travel() * alpha)

    def faults(self, path: str) -> Faults:
        return super().faults(path) + self.faults_of_weight(path)

    def faults_of_weight(self, path: str) -> Faults:
        """Errors of the weight of the rope."""
        rope = self.weight
        if rope is None:
            return []
        path = f"{path}.weight"
        errors = Issues()
        if self.elasticity is not None:
            what = "is given beside an elastic rope, which has none"
            errors.add(path, what, "leave out one of the two")
        lines = float(self.line_count) * float(rope.hanging_length)
        least = lines + float(rope.drum_below)
        if rope.length is None:
            if self.rope is None:
                hint = "give the length of the rope that moves, or its layers"
                errors.add(f"{path}.length", "is missing", hint)
            return errors
        length = float(rope.length)
        if length < least:
            what = f"{length:g} m is shorter than the {least:g} m off the drum"
            errors.add(f"{path}.length", what, "a longer rope, or shorter lines")
        if self.rope is not None:
            held = with_fields(rope, length=None)
            held = with_fields(self, weight=held)._rope_length() - least
            if length - least > float(held) * (1 + 1e-9):
                what = f"leaves {length - least:g} m on a drum that holds {held:g} m"
                hint = "more turns, a shorter rope, or leave the length out"
                errors.add(f"{path}.length", what, hint)
        return errors


class HookLoad(AbstractHookLoad):
    """A load on the hook, lowered through the tackle: `M_load = m g r_d/n`,
    `J_load = m (r_d/n)²`, travel `r_d φ/n`.

    - `mass` `m` of all that hangs on the hook (kg); `drum_radius` `r_d` (m), effective;
      `line_count` `n`: lines strung
    - `gravity` `g` (m/s²); `drag` (N·m·s) as of bearings and an auxiliary brake, whose
      work the work of the load is less; a `ViscousDrag` on the shaft has its own
    - `rope`: its layers on the drum, of which `drum_radius` is the radius of the first;
      `None`: `r_d` stays the same
    - `elasticity` of the rope between drum and hook, `None`: it is rigid
    - `weight` of the rope, `None`: it has none

    The loss of the tackle is a part of the shaft (`TackleLoss`).

    Example:
        >>> sb.HookLoad("60 t", drum_radius="400 mm", line_count=8).mass
        array(60000.)
    """

    mass: Scalar = quantity(
        "kg",
        "mass on the hook",
        low=0.0,
        instead="a counterweight pulls the other way: give a `CounterweightLoad`",
    )
    drum_radius: Scalar = positive_quantity("m", "effective drum radius")
    line_count: Scalar = quantity("1", "lines strung", 1.0, 100.0)
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()
    rope: RopeLayers | None = None
    elasticity: RopeElasticity | None = None
    weight: RopeWeight | None = None

    def mass_on(self, piece: Piece) -> Scalar:
        return self.mass

    def inertia(self) -> Scalar:
        return self.mass * self.travel() ** 2

    def faults(self, path: str) -> Faults:
        bare = self.elasticity is not None and float(self.mass) == 0.0
        why = Fault(
            f"{path}.mass",
            "is 0, and moves by itself on an elastic rope",
            "give the mass of hook and block",
        )
        return ([why] if bare else []) + self.faults_of_weight(path)

    @property
    def profile(self) -> Constant:
        return Constant(0.0)


class AbstractString(AbstractHookLoad):
    """A string that becomes longer by a stand in each cycle, on the hook or in the
    slips: `M_load = m g r_d/n − c ω`.

    At a change of mass in motion the speed stays: added mass brings its energy (counted
    as load work). An elastic rope takes the weight on slowly: its stretch follows at
    once, without a swing, and its energy counts as load work too.
    """

    empty: AbstractVar[Scalar]
    string: AbstractVar[Scalar]
    stand: AbstractVar[Scalar]

    @classmethod
    def meant_by(cls, name: str, given: Mapping[str, Any]) -> str:
        if name == "mass":
            return "it is `duty.load.string` + `duty.load.empty`: change the string"
        return super().meant_by(name, given)

    @abc.abstractmethod
    def hangs(self, piece: Piece) -> TwoArrays:
        """Whether it hangs on the hook on a piece, and how many stands it has more than
        at first."""

    def string_on(self, piece: Piece) -> Scalar:
        """Mass of the string on a piece without the stands that came to it."""
        return self.string

    def mass_on(self, piece: Piece) -> Array:
        hangs, stands = self.hangs(piece)
        return self.empty + jnp.where(
            hangs, self.string_on(piece) + stands.astype(jnp.float64) * self.stand, 0.0
        )

    def inertia(self) -> Scalar:
        return self.empty * self.travel() ** 2

    def added_inertia(self, piece: Piece) -> Array:
        return (self.mass_on(piece) - self.empty) * self.travel() ** 2


class StringLoad(AbstractString):
    """A string on the hook or in the slips as the phases of the duty say, longer or
    shorter in each cycle.

        m = m_e + (m_s + k Δm) while it hangs with k stands more than at first, else
        m_e;   M_load = m g r_d/n − c ω

    - `empty` `m_e`: hook and travelling block (kg); `stand` `Δm` (kg), of which
      `Phases.stands` come in each cycle
    - `string` `m_s`: string of the first cycle (kg), or a list with that of each phase
      (`Phases.each`)
    - `drum_radius`, `line_count`, `gravity`, `drag`, `rope`, `elasticity`, `weight`: as
      in `HookLoad`

    Example:
        >>> sb.loads.StringLoad("8 t", "80 t", "400 mm", 8, stand=800.0).stand
        array(800.)
    """

    empty: Scalar = positive_quantity("kg", "mass of hook and block")
    string: Scalar = quantity(
        "kg", "mass of the string in the first cycle", low=0.0, many=IndexedBy.ROWS
    )
    drum_radius: Scalar = positive_quantity("m", "effective drum radius")
    line_count: Scalar = quantity("1", "lines strung", 1.0, 100.0)
    stand: Scalar = quantity("kg", "mass of one stand", low=0.0, default=0.0)
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()
    rope: RopeLayers | None = None
    elasticity: RopeElasticity | None = None
    weight: RopeWeight | None = None
    by_phases: ClassVar[bool] = True

    @property
    def profile(self) -> Constant:
        # its value bears the scale of the torque
        most = jnp.max(self.string) if np.ndim(self.string) else self.string
        return Constant((self.empty + most) * self.gravity * self.travel())

    def piece_in_phase(self, place: Array, stands: Array, hanging: Array) -> Array:
        piece = 2 * stands + hanging
        return piece * np.size(self.string) + place if np.ndim(self.string) else piece

    def hangs(self, piece: Piece) -> TwoArrays:
        piece = jnp.asarray(piece, jnp.int32)
        piece = piece // np.size(self.string) if np.ndim(self.string) else piece
        return piece % 2 == 1, piece // 2

    def faults_in_phases(
        self, path: str, count: int, stands: tuple[int, int]
    ) -> Faults:
        strings = np.asarray(self.string)
        errors = Issues()
        if strings.ndim and strings.size != count:
            what = f"has {strings.size} masses for {count} phases"
            errors.add(
                f"{path}.string",
                what,
                "one number, or one for each phase, those of `then` included",
            )
        least = float(np.min(strings)) + min(stands) * float(self.stand)
        if least < 0 and not errors:
            what = (
                f"{float(np.min(strings)):g} kg is less than the {-min(stands)} "
                "stands that are laid down"
            )
            errors.add(
                f"{path}.string",
                what,
                "a heavier string, lighter stands, or fewer cycles",
            )
        return errors

    def string_on(self, piece: Piece) -> Scalar:
        if np.ndim(self.string) == 0:
            return self.string
        n = np.size(self.string)
        here = jnp.arange(n, dtype=jnp.int32) == jnp.asarray(piece, jnp.int32) % n
        return jnp.sum(jnp.where(here, jnp.asarray(self.string), 0.0))


class TrippingLoad(AbstractString):
    """Tripping a string in stand by stand: in each cycle it hangs on the hook for some
    time, then in the slips.

        m(t) = m_e + (m_s + k Δm) while it hangs in cycle k = 0…count − 1, else m_e;
        M_load = m g r_d/n − c ω

    - `empty` `m_e`: hook and travelling block (kg); `string` `m_s`: string of the first
      cycle (kg); `stand` `Δm` (kg)
    - `taken`, `set`: times in a cycle of `period` (s) at which the hook takes the
      string, and is set in the slips
    - `drum_radius`, `line_count`, `gravity`, `drag`, `rope`, `elasticity`, `weight`: as
      in `HookLoad`

    In a run whose cycles take as long as they take, a `StringLoad` follows the phases
    instead.

    Example:
        >>> load = sb.TrippingLoad("8 t", "80 t", 800.0, 5.0, 55.0, 60.0, 0.4, 8, count=30)
        >>> load.count
        30
    """

    empty: Scalar = positive_quantity("kg", "mass of hook and block")
    string: Scalar = quantity("kg", "mass of the string in the first cycle", low=0.0)
    stand: Scalar = quantity("kg", "mass of one stand", low=0.0)
    taken: Scalar = quantity(
        "s", "time in the cycle at which the hook takes the string", low=0.0
    )
    set: Scalar = positive_quantity(
        "s", "time in the cycle at which the string is set in the slips"
    )
    period: Scalar = positive_quantity("s", "length of a cycle")
    drum_radius: Scalar = positive_quantity("m", "effective drum radius")
    line_count: Scalar = quantity("1", "lines strung", 1.0, 100.0)
    count: int = whole("number of cycles", high=1_000_000)
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()
    rope: RopeLayers | None = None
    elasticity: RopeElasticity | None = None
    weight: RopeWeight | None = None

    @property
    def profile(self) -> Repeated:
        # its values bear the scale of the maximum torque
        most = (
            (self.empty + self.string + (self.count - 1) * self.stand)
            * self.gravity
            * self.travel()
        )
        times = jnp.stack(
            [jnp.asarray(self.taken, jnp.float64), jnp.asarray(self.set, jnp.float64)]
        )
        return Repeated(times, jnp.stack([most, most]), self.period, self.count)

    def hangs(self, piece: Piece) -> TwoArrays:
        passed = jnp.asarray(piece, jnp.int32) - 1
        return (passed >= 0) & (passed % 2 == 0), passed // 2


class RecordedLoad(AbstractHookLoad, AbstractHistory):
    """A load on the hook that changes at given times: `M_load = m_i g r_d/n − c ω` from
    the time `t_i` on.

    - `times` (k,) in s, not decreasing
    - `masses` (k,): `m_i` of all that hangs on the hook (kg), the first one before
      its time too
    - `drum_radius`, `line_count`, `gravity`, `drag`, `rope`, `elasticity`, `weight`: as
      in `HookLoad`

    At a change of mass in motion the speed stays: added mass brings its energy. Many
    masses cost no more than few.

    Example:
        >>> sb.loads.RecordedLoad([0, 60], ["80 t", "12 t"], "400 mm", 8).masses
        array([80000., 12000.])
    """

    times: Scalar = quantity(
        "s", "times from which the masses hang", many=IndexedBy.ROWS
    )
    masses: Scalar = quantity("kg", "masses on the hook", low=0.0, many=IndexedBy.ROWS)
    drum_radius: Scalar = positive_quantity("m", "effective drum radius")
    line_count: Scalar = quantity("1", "lines strung", 1.0, 100.0)
    gravity: Scalar = free_fall()
    drag: Scalar = linear_drag()
    rope: RopeLayers | None = None
    elasticity: RopeElasticity | None = None
    weight: RopeWeight | None = None
    by_piece: ClassVar[tuple[str, ...]] = ("times", "masses")

    @property
    def profile(self) -> "_Steps":
        return with_fields(
            _STEPS,
            times=self.times,
            values=self.masses,
            factor=self.gravity * self.travel(),
        )

    def mass_on(self, piece: Piece) -> Array:
        return point(self.masses, jnp.asarray(piece) - 1)

    def inertia(self) -> Scalar:
        return point(self.masses, 0) * self.travel() ** 2

    def added_inertia(self, piece: Piece) -> Array:
        return (self.mass_on(piece) - point(self.masses, 0)) * self.travel() ** 2

    def faults(self, path: str) -> Faults:
        points = PiecewiseLinear(self.times, self.masses).faults(path)
        return points + self.faults_of_weight(path)


def _knot(times: Scalar, piece: Piece) -> Array:
    """The time that ends a piece, `inf` after the last."""
    piece = jnp.asarray(piece)
    return jnp.where(piece < np.shape(times)[0], point(times, piece), jnp.inf)


class _Steps(PiecewiseLinear):
    """Breakpoints of many values of which each is constant up to the next, times a
    factor."""

    factor: Any = 1.0

    def value(self, t: Real, piece: Piece) -> Real:
        return self.factor * point(self.values, jnp.asarray(piece) - 1)

    def scale(self) -> ScalarArray:
        return self.factor * super().scale()

    def next_knot(self, piece: Piece) -> Array:
        return _knot(self.times, piece)


_STEPS = _Steps(times=np.zeros(1), values=np.zeros(1))


# --- levers that follow the speed ---------------------------------------------------


class AbstractSpeedLever(AbstractProfile):
    """A lever whose tension depends on the speed, up to its `limit` (N). For rigid
    bands, and laws without pressure and flash temperature: the torque is then known
    from the tension."""

    @property
    def controls_speed(self) -> bool:
        return True

    def follows(self, piece: Piece) -> Mark | bool:
        return True

    def value(self, t: Real, piece: Piece) -> Real:
        return jnp.broadcast_to(jnp.asarray(self.greatest(), jnp.float64), np.shape(t))

    @abc.abstractmethod
    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Real:
        """Brake torque (N·m) demanded by the driller for a load torque and an inertia
        of the shaft.

        - `turned` (rad): angle since the begin of the phase, or of the run
        """

    def holding(self, torque: ScalarArray, gain: ScalarArray) -> ScalarArray:
        """`T_0` (N) for a brake torque, and the torque per newton of it (m)."""
        return held_within(torque, gain, self.greatest())

    def greatest(self) -> ScalarArray:
        """Maximum slack tension (N), the `limit` of the lever."""
        return jnp.asarray(self.limit)  # pyright: ignore

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return self.greatest()

    def scale(self) -> ScalarArray:
        return self.greatest()


class SpeedHold(AbstractSpeedLever):
    """A lever that holds the speed: it pulls so that the brake torque equals the load
    torque (drag).

        T_0 = min(M_load/(R_b (Π − 1)), limit)

    - `limit` (N): maximum slack tension; where fade requires more the load runs away
      (event `grip_lost`)

    The tension follows the friction of the hot linings, so that the power `M_load ω`
    goes into heat at any fade. For rigid bands, and laws without pressure and flash
    temperature.

    Example:
        >>> sb.SpeedHold("30 kN")
        SpeedHold(limit=30 kN)
    """

    limit: Scalar = positive_quantity("N", "maximum slack tension")

    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Real:
        return load


class AbstractFollower(AbstractSpeedLever):
    """A lever that keeps the pulley on a given speed, and on the angle that belongs to
    it."""

    speed: AbstractVar[PiecewiseLinear]
    gain: AbstractVar[Scalar]
    position_gain: AbstractVar[Scalar | None]

    @property
    def corrects_position(self) -> bool:
        return self.position_gain is not None

    @property
    def has_simple_pieces(self) -> bool:
        own = (type(self).wanted_torque, type(self.speed).value)
        own = own == (AbstractFollower.wanted_torque, PiecewiseLinear.value)
        return own and self.corrects_position  # (the angle is a parabola of the time)

    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Real:
        away = omega - self.speed.value(t, piece)
        slower = self.gain * away
        if self.position_gain is not None:
            assert turned is not None
            slower = slower + self.position_gain * (turned - self.speed.area(t, piece))
        return load - inertia * (self.speed.slope(piece) - slower)

    def next_knot(self, piece: Piece) -> Floats | float:
        return self.speed.next_knot(piece)

    def first_piece(self, t: Real) -> Piece:
        return self.speed.first_piece(t)


class Driller(AbstractFollower):
    """A lever that keeps the pulley on a given speed `ω_r(t)`, with a correction of the
    deviation:

        M_b = M_load − J [ω̇_r − g (ω − ω_r) − h (φ − ∫ω_r dt)],   T_0 = min(M_b/(R_b (Π
        − 1)), limit)

    - `speed`: `ω_r(t)` (rad/s), straight lines
    - `limit` (N): maximum slack tension; where fade requires more the load runs away
      (event `grip_lost`)
    - `gain` `g` (1/s) of the correction
    - `position_gain` `h` (1/s²) of that of the angle `φ` turned since the begin of the
      run (at the time 0) or the phase, `None`: without; `h = g²/4` brings it back
      without overshoot

    In a phase of `Phases` its time is that of the phase; `simbrake.programme_scene`
    makes such phases from words. A brake can only slow down: a speed that the load does
    not reach is not followed.

    Example:
        >>> sb.Driller(sb.ramp(0.0, 6.0, 0.0, 2.0), "30 kN").gain
        array(2.)
    """

    speed: PiecewiseLinear = part(PiecewiseLinear, "rad/s")
    limit: Scalar = positive_quantity("N", "maximum slack tension")
    gain: Scalar = quantity("1/s", "correction of the speed", low=0.0, default=2.0)
    position_gain: Scalar | None = quantity(
        "1/s^2", "correction of the angle", low=0.0, default=None
    )


class RecordedMotion(AbstractFollower, AbstractHistory):
    """A lever, and the motor beside it, that keep the pulley on a recorded motion: it
    is lowered, hoisted, and at rest.

        M_b = (1 − s) M_w   where it is lowered,   M_w = M_load − Σ M_shaft − J [ω̇_r − g (ω − ω_r) − h (φ − φ_r)]

    - `speed`: `ω_r(t)` (rad/s), straight lines between points, 0 at rest; on a line it
      does not change its sign; only the last of a lowering may end below 0, with a jump
      to 0 there: the pulley is at rest before
    - `angles` (n,): `φ_r` (rad) at the points, the integral of the speed
    - `limit` (N): maximum slack tension in lowering;  `pull` (N): slack tension at rest
    - `motor_share` (n,): `s` from each point on, the share that the motor takes of a
      load that is lowered
    - `gain` `g` (1/s), `position_gain` `h` (1/s²): as of a `Driller`

    Where the drum is hoisted the band is open, and the scene's `Motor` follows the
    speed. It drives a load down that is too light to reach the speed by itself
    (`M_w < 0`). Many points cost no more than few.

    Example:
        >>> speed = sb.PiecewiseLinear([0, 4, 24, 28, 60, 64, 84, 88], [0, 20, 20, 0, 0, -20, -20, 0])
        >>> motion = sb.loads.RecordedMotion(speed, [0, 40, 440, 480, 480, 440, 40, 0], "40 kN", "20 kN", np.zeros(8))
        >>> [bool(motion.follows(piece)) for piece in range(9)]
        [False, True, True, True, False, False, False, False, False]
    """

    speed: PiecewiseLinear = part(PiecewiseLinear, "rad/s")
    angles: Scalar = quantity(
        "rad", "angle turned at the points of the speed", many=IndexedBy.ROWS
    )
    limit: Scalar = positive_quantity("N", "maximum slack tension")
    pull: Scalar = positive_quantity("N", "slack tension at rest")
    motor_share: Scalar = quantity(
        "1", "share of the motor in lowering", 0.0, 1.0, many=IndexedBy.ROWS
    )
    gain: Scalar = quantity("1/s", "correction of the speed", low=0.0, default=2.0)
    position_gain: Scalar = quantity(
        "1/s^2", "correction of the angle", low=0.0, default=1.0
    )
    by_piece: ClassVar[tuple[str, ...]] = ("angles", "motor_share")

    def near(self, before: Piece, after: Piece) -> Self:
        return with_fields(
            super().near(before, after), speed=self.speed.near(before, after)
        )

    @property
    def knot_count(self) -> int:
        return int(np.shape(self.angles)[0])

    @property
    def has_simple_pieces(self) -> bool:
        return True  # (the angle is a parabola of the time)

    def way(self, piece: Piece) -> Array:
        """Sense of the motion on a piece: 1 lowered, −1 hoisted, 0 at rest."""
        piece = jnp.asarray(piece)
        (times, speeds) = (self.speed.times, self.speed.values)
        inside = (piece > 0) & (point(times, piece) > point(times, piece - 1))
        return jnp.where(
            inside, jnp.sign(point(speeds, piece - 1) + point(speeds, piece)), 0.0
        )

    def follows(self, piece: Piece) -> Mark:
        return self.way(piece) > 0

    def value(self, t: Real, piece: Piece) -> Real:
        return jnp.broadcast_to(
            jnp.where(self.way(piece) == 0, jnp.asarray(self.pull, jnp.float64), 0.0),
            np.shape(t),
        )

    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Real:
        piece = jnp.asarray(piece)
        (times, speeds) = (self.speed.times, self.speed.values)
        begin, speed, angle = (
            point(x, piece - 1) for x in (times, speeds, self.angles)
        )
        span = point(times, piece) - begin
        since = t - begin
        slope = jnp.where(
            span > 0,
            (point(speeds, piece) - speed) / jnp.where(span > 0, span, 1.0),
            0.0,
        )
        assert turned is not None
        away = turned - (angle + (speed + 0.5 * slope * since) * since)
        slower = (
            self.gain * (omega - (speed + slope * since)) + self.position_gain * away
        )
        return load - inertia * (slope - slower)

    def next_knot(self, piece: Piece) -> Array | float:
        return _knot(self.speed.times, piece)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return self.scale()

    def scale(self) -> ScalarArray:
        return jnp.maximum(jnp.asarray(self.limit), self.pull)

    def faults(self, path: str) -> Faults:
        speeds = np.asarray(self.speed.values)
        n = np.size(self.speed.times)
        faults = [
            Fault(
                f"{path}.{name}",
                f"has {np.size(x)} values for {n} points of the speed",
                "one for each point",
            )
            for name, x in (("angles", self.angles), ("motor_share", self.motor_share))
            if np.shape(x) != (n,)
        ]
        # (a lowering that aims below 0 is at rest from that instant on)
        at_once = np.append(np.diff(self.speed.times)[1:] == 0, False)
        aims = (speeds[:-1] > 0) & at_once & (np.append(speeds[2:], np.inf) == 0)
        turns = np.flatnonzero((speeds[1:] * speeds[:-1] < 0) & ~aims)
        if turns.size:
            what = (
                f"changes its sign between {float(speeds[turns[0]]):g} and "
                f"{float(speeds[turns[0] + 1]):g} rad/s"
            )
            faults.append(
                Fault(f"{path}.speed.values", what, "give the point at 0 between them")
            )
        return faults


class _RecordedDrive(RecordedMotion):
    """The part of the motor in a recorded motion, on the pieces of its lever."""

    def follows(self, piece: Piece) -> Mark:
        return self.way(piece) != 0

    def wanted_torque(
        self,
        t: Real,
        omega: Real,
        piece: Piece,
        load: Real,
        inertia: Real,
        turned: Real | None = None,
    ) -> Real:
        whole = jnp.asarray(
            RecordedMotion.wanted_torque(self, t, omega, piece, load, inertia, turned)
        )
        share = point(self.motor_share, jnp.asarray(piece) - 1)
        return jnp.where((whole > 0) & (self.way(piece) > 0), share * whole, whole)

    def next_knot(self, piece: Piece) -> float:
        return jnp.inf


# --- the motor ----------------------------------------------------------------------


class _Course(AbstractFollower):
    """A course of the speed that a motor follows."""

    speed: PiecewiseLinear = part(PiecewiseLinear, "rad/s")
    gain: Scalar = quantity("1/s", "correction of the speed", low=0.0)
    position_gain: Scalar | None = quantity(
        "1/s^2", "correction of the angle", low=0.0, default=None
    )

    def greatest(self) -> ScalarArray:
        return jnp.zeros(())


class Motor(Part):
    """A motor on the shaft of the drum that follows a speed `ω_r(t)`: it hoists, and
    holds back what is lowered.

        M = clip(M_load − Σ M_shaft − J [ω̇_r − g (ω − ω_r) − h (φ − ∫ω_r dt)], ±M_a),
        M_a = min(M_m, P/|ω|)

    `M` is against the braking direction: positive while it hoists (`ω < 0`, its power
    `−M ω` is taken from the supply) and while it holds a load back (`ω > 0`, it feeds
    that power back).

    - `max_torque` `M_m` (N·m), `max_power` `P` (W) and `max_speed` (rad/s): limits of
      the motor, at the drum
    - `speed`: `ω_r(t)` (rad/s), negative to hoist; of a duty in phases `None`: each
      says it (`Phase.motor`); so does a `RecordedMotion`
    - `gain` `g` (1/s), `position_gain` `h` (1/s²): as of a `Driller`

    A lever that follows a speed sees what the motor leaves. The inertia of the rotor is
    a part of the pulley's. Field weakening as usual: constant torque up to `P/M_m`,
    then constant power.

    Example:
        >>> motor = sb.loads.Motor("40 kN*m", "1100 kW", "30 rad/s")
        >>> motor.available(np.array([0.0, 10.0, 55.0])).tolist()
        [40000.0, 40000.0, 20000.0]
    """

    max_torque: Scalar = positive_quantity(
        "N*m", "maximum torque of the motor at the drum"
    )
    max_power: Scalar = positive_quantity("W", "maximum power of the motor")
    max_speed: Scalar = positive_quantity(
        "rad/s", "maximum speed of the drum under the motor"
    )
    speed: PiecewiseLinear | None = part(PiecewiseLinear, "rad/s", default=None)
    gain: Scalar = quantity("1/s", "correction of the speed", low=0.0, default=2.0)
    position_gain: Scalar | None = quantity(
        "1/s^2", "correction of the angle", low=0.0, default=None
    )

    def available(self, omega: Real) -> Real:
        """`M_a` (N·m) at the speed `omega` (rad/s)."""
        speed = jnp.abs(jnp.asarray(omega))
        weak = speed * self.max_torque > self.max_power
        return jnp.where(
            weak, self.max_power / jnp.where(weak, speed, 1.0), self.max_torque
        )

    def course(self, duty: AbstractProfile | Phases) -> AbstractFollower | Phases:
        """The speed that it follows, as a lever would; in phases in which it is off, 0
        without correction."""

        def follows(speed: PiecewiseLinear) -> _Course:
            return _Course(speed, self.gain, self.position_gain)

        if isinstance(duty, Phases):
            return duty.with_levers(
                lambda phase: (
                    Constant(0.0) if phase.motor is None else follows(phase.motor)
                )
            )
        if isinstance(duty, RecordedMotion):
            return _RecordedDrive(**vars(duty))
        assert self.speed is not None
        return follows(self.speed)


# --- the brake lever ----------------------------------------------------------------


class Lever(AbstractProfile):
    """Slack tension of a simple band brake, whose tight end is held by a fixed anchor:
    moments about the fulcrum.

        T_0(t) = η F(t) l/a,   on `n` alike rims (`Brake.rims`)  η F(t) l/(n a)

    - `force`: `F(t) ≥ 0` in N, any profile
    - `arm` `l` (m) of the force, `slack_arm` `a` (m) of the slack end
    - `efficiency` `η` of the linkage
    - `clearance` (m) between the linings of the released band and the rim
    - `greatest_force` (N), `greatest_travel` (m) of the lever's end: allowable values,
      to be compared with a run's

    Knots and pieces are those of the force. Lever and linkage have no mass and are
    rigid; their elasticity is part of the band's stiffness. Reference: R. S. Khurmi, J.
    K. Gupta, *Theory of Machines*, simple band brake.

    Example:
        >>> sb.Lever("400 N", arm="1.5 m", slack_arm="0.1 m").force
        Constant(level=400)
    """

    instead: ClassVar[dict[str, str]] = {
        "tight_arm": "the tight end of a `Lever` is fixed; a differential brake is statics alone: "
        "`sb.loads.differential_lever_tension` gives its slack tension"
    }
    force: AbstractProfile = part(AbstractProfile, "N")
    arm: Scalar = positive_quantity("m", "arm of the force")
    slack_arm: Scalar = positive_quantity("m", "arm of the slack end")
    efficiency: Scalar = positive_quantity(
        "1", "efficiency of the linkage", high=1.0, default=1.0
    )
    clearance: Scalar = quantity(
        "m", "clearance of the released linings", low=0.0, typical=1e-3, default=0.0
    )
    greatest_force: Scalar | None = positive_quantity(
        "N", "allowable force on the lever", default=None
    )
    greatest_travel: Scalar | None = positive_quantity(
        "m", "allowable travel of the lever", default=None
    )

    @property
    def knot_count(self) -> int:
        return self.force.knot_count

    @property
    def gain(self) -> ScalarArray:
        """`T_0/F = η l/a`."""
        return jnp.asarray(self.efficiency) * self.arm / self.slack_arm

    def value(self, t: Real, piece: Piece) -> Real:
        return self.gain * self.force.value(t, piece)

    def next_knot(self, piece: Piece) -> Floats | float:
        return self.force.next_knot(piece)

    def first_piece(self, t: Real) -> Piece:
        return self.force.first_piece(t)

    def is_settled(self, t: Real) -> Mark:
        return self.force.is_settled(t)

    def greatest_from(self, begin: Array, end: Array) -> Array:
        return self.gain * self.force.greatest_from(begin, end)

    def scale(self) -> ScalarArray:
        return self.gain * self.force.scale()

    def faults(self, path: str) -> Faults:
        what = "a lever that holds the speed gives a tension, not a force"
        hint = "give it as the slack tension itself"
        return [Fault(f"{path}.force", what, hint)] if self.force.controls_speed else []


class AbstractActuator(AbstractProfile):
    """What follows a command with a dead time and a first-order lag:
    `τ ẋ + x = u(t − t_d)`."""

    lag: AbstractVar[Scalar | None]
    dead_time: AbstractVar[Scalar]
    #: field that holds the command
    command_field: AbstractClassVar[str]

    @property
    def input(self) -> AbstractProfile:
        """The command `u(t)`."""
        return getattr(self, self.command_field)

    def followed(self, t: Real, piece: Piece) -> Real:
        """`x` at `t` on the given piece."""
        command = self.input
        t = t - self.dead_time
        x = command.value(t, piece)
        if self.lag is not None and isinstance(command, AbstractPoints):
            x = (
                x
                - self.lag * command.slope(piece)
                + command.transient(t, piece, self.lag)
            )
        return x

    def with_sums(self) -> AbstractProfile:
        if not isinstance(self.input, AbstractPoints):
            return super().with_sums()
        return with_fields(self, **{self.command_field: self.input.with_sums(self.lag)})

    @abc.abstractmethod
    def force(self, followed: Real) -> Real:
        """Force (N) at the band for what follows the command."""

    def value(self, t: Real, piece: Piece) -> Real:
        return self.force(self.followed(t, piece))

    def greatest_from(self, begin: Array, end: Array) -> Array:
        """Of a lagged course of points its greatest value at the points, or the last
        one, which it tends to."""
        command = self.input
        begin = begin - self.dead_time
        if self.lag is None or not isinstance(command, PiecewiseLinear):
            return jnp.asarray(
                self.force(command.greatest_from(begin, end - self.dead_time))
            )
        times = jnp.append(jnp.asarray(command.times), begin)
        reached = jax.vmap(
            lambda t: jnp.asarray(
                self.followed(t + self.dead_time, command.first_piece(t))
            )
        )(times)
        most = jnp.max(jnp.where(times >= begin, reached, -jnp.inf))
        return jnp.asarray(
            self.force(jnp.maximum(most, jnp.asarray(command.values)[-1]))
        )

    @property
    def knot_count(self) -> int:
        return self.input.knot_count

    @property
    def has_simple_pieces(self) -> bool:
        plain = isinstance(self.input, AbstractPoints | Constant) or (
            self.lag is None and self.input.has_simple_pieces
        )
        return type(self) in (Actuator, Cylinder) and plain

    def next_knot(self, piece: Piece) -> Floats | float:
        knot = self.input.next_knot(piece)
        return knot if isinstance(knot, float) else knot + self.dead_time

    def first_piece(self, t: Real) -> Piece:
        return self.input.first_piece(t - self.dead_time)

    def is_settled(self, t: Real) -> Mark:
        return self.input.is_settled(t - self.dead_time)

    def faults(self, path: str) -> Faults:
        if isinstance(self.input, AbstractPoints | Constant) or (
            self.lag is None and not self.input.controls_speed
        ):
            return []
        what = f"a lagged `{type(self.input).__name__}` has no closed form"
        return [
            Fault(
                f"{path}.{self.command_field}",
                what,
                "give points, cycles of points, or a constant",
            )
        ]


class Actuator(AbstractActuator):
    """The force of an actuator that follows its command with a dead time and a
    first-order lag, less a return spring.

        τ dF/dt + F = u(t − t_d),   T_0 = F − F_s

    - `command`: `u(t) ≥ 0` in N: a constant, straight lines between points, or repeated
      cycles of them; without a lag any profile
    - `lag` `τ` (s), `None`: no lag
    - `dead_time` `t_d` (s)
    - `spring` `F_s` (N): preload of the return spring

    On every piece of the command the force is known in closed form, from the
    equilibrium before the first point on:

        F = u − τ m + Σ_j (τ Δm_j − Δu_j) e^{−(t − t_d − t_j)/τ}

    with the slope `m`, its change `Δm_j` and the jump `Δu_j` at each point `t_j`
    passed: no state, and the knots are those of the command, later by `t_d`. A released
    force only tends to 0 and never reaches it: without a return spring the band stays
    closed under a tension that fades away. With one the band opens when the force falls
    to `F_s`, and closes when it rises above it.

    Stands for the slack tension of a `Duty`, the force of a `ForceDuty`, or the force
    of a `Lever`.

    Example:
        >>> sb.loads.Actuator("24 kN", lag="50 ms", dead_time="100 ms").dead_time
        array(0.1)
    """

    command: AbstractProfile = part(AbstractProfile, "N")
    lag: Scalar | None = positive_quantity(
        "s", "time constant of the lag", default=None
    )
    dead_time: Scalar = quantity("s", "dead time", low=0.0, default=0.0)
    spring: Scalar = quantity("N", "preload of the return spring", low=0.0, default=0.0)
    command_field: ClassVar[str] = "command"

    def force(self, followed: Real) -> Real:
        return followed - self.spring

    def scale(self) -> ScalarArray:
        return self.command.scale()


class Cylinder(AbstractActuator):
    """The force of a cylinder of air or oil through its linkage, from the gauge
    pressure that its valve gives.

        τ dp/dt + p = u(t − t_d),   T_0 = η i (p A − F_s)

    - `pressure`: `u(t) ≥ 0`, the commanded gauge pressure (Pa, "8 bar", "120 psi"): any
      profile without a lag, else as the command of an `Actuator`, whose closed form it
      shares
    - `area` `A` (m²) of the piston, or its `diameter` `d` (m), `A = π d²/4`
    - `ratio` `i` of the linkage: force at the end of the band over that of the piston
    - `efficiency` `η` of both
    - `spring` `F_s` (N): preload of the return spring at the piston, which opens the
      brake below `p = F_s/A`
    - `lag` `τ` (s) of valve and line, `None`: no lag;  `dead_time` `t_d` (s)
    - `permissible_pressure` (Pa) of the cylinder, for the verdict

    Stands for the slack tension of a `Duty` (of each band on alike rims), the force of
    a `ForceDuty`, or the force of a `Lever`, which all bands share. The gauge pressure
    behind the lag is the column `actuator_pressure`.

    Example:
        >>> cylinder = sb.loads.Cylinder("8 bar", diameter="200 mm", ratio=1.5, efficiency=0.9, spring="600 N")
        >>> round(float(cylinder.value(0.0, 0)))
        33119
    """

    pressure: AbstractProfile = part(AbstractProfile, "Pa")
    area: Scalar | None = positive_quantity("m^2", "area of the piston", default=None)
    diameter: Scalar | None = positive_quantity(
        "m", "diameter of the piston", default=None
    )
    ratio: Scalar = positive_quantity(
        "1", "force at the band over that of the piston", default=1.0
    )
    efficiency: Scalar = positive_quantity(
        "1", "efficiency of piston and linkage", high=1.0, default=1.0
    )
    spring: Scalar = quantity("N", "preload of the return spring", low=0.0, default=0.0)
    lag: Scalar | None = positive_quantity(
        "s", "time constant of the lag", default=None
    )
    dead_time: Scalar = quantity("s", "dead time", low=0.0, default=0.0)
    permissible_pressure: Scalar | None = positive_quantity(
        "Pa", "permissible gauge pressure", default=None
    )
    command_field: ClassVar[str] = "pressure"

    def faults_of_presence(self, path: str) -> Faults:
        if (self.area is None) != (self.diameter is None):
            return []
        what = (
            "is missing"
            if self.area is None
            else "stands beside the area of the piston"
        )
        return [
            Fault(
                f"{path}.diameter", what, "give the diameter of the piston, or its area"
            )
        ]

    @property
    def piston_area(self) -> ScalarArray:
        """`A` (m²), given or of the diameter."""
        if self.area is not None:
            return jnp.asarray(self.area)
        assert self.diameter is not None
        return 0.25 * jnp.pi * jnp.asarray(self.diameter) ** 2

    @property
    def gain(self) -> ScalarArray:
        """`η i`: force at the band per newton of the piston."""
        return jnp.asarray(self.efficiency) * self.ratio

    def force(self, followed: Real) -> Real:
        return self.gain * (self.piston_area * followed - self.spring)

    def scale(self) -> ScalarArray:
        return self.gain * self.piston_area * self.pressure.scale()

    def faults(self, path: str) -> Faults:
        below = faults_of_sign(
            self.pressure,
            f"{path}.pressure",
            "Pa",
            "a gauge pressure presses from 0 upwards",
        )
        return super().faults(path) + below


def cylinder_of(lever: AbstractProfile) -> Cylinder | None:
    """The cylinder behind a lever, `None`: there is none."""
    return next((x for _, x, _ in parts_below(lever) if isinstance(x, Cylinder)), None)


def cylinders(lever: AbstractProfile | Phases) -> list[Cylinder | None]:
    """The cylinder behind a lever, or behind that of each phase; `None`: there is
    none."""
    return [cylinder_of(own) for own in levers_of(lever)]


@explained
def differential_lever_tension(
    force: Values, arm: Values, slack_arm: Values, tight_arm: Values, ratio: Values
) -> Floats:
    """Slack tension (N) in full slip of a differential brake: both band ends on the
    lever, the tight one assists.

        T_0 a − T_n b = F l,   T_n = Π T_0   →   T_0 = F l/(a − b Π)

    - `force` `F` (N), its `arm` `l`, `slack_arm` `a`, `tight_arm` `b` (m); `ratio`
      `Π = T_n/T_0`

    With `a ≤ b Π` the brake is self-locking: no force is needed, and the tension is
    `inf`. Statics only: in a scene the lever of `Lever` has its tight end on a fixed
    anchor. Reference: Khurmi & Gupta, differential band brake.

    Example:
        >>> sb.loads.differential_lever_tension(400.0, 1.5, 0.1, 0.02, np.array([3.0, 6.0])).round().tolist()
        [15000.0, inf]
    """
    left = jnp.asarray(slack_arm) - jnp.asarray(tight_arm) * jnp.asarray(ratio)
    holds = left > 0
    return jnp.where(
        holds, jnp.asarray(force) * arm / jnp.where(holds, left, 1.0), jnp.inf
    )
