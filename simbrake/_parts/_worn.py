"""What wear changes in a brake before a run: geometry, lever, heat; and a band turned end for end."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault, InputError
from .._base._quantity import Scalar, holding, leaves, quantity
from .._hybrid._arrays import Array
from ._driller import AbstractSpeedLever
from ._duty import AbstractProfile
from ._fade import TabulatedFade
from ._friction import TabulatedFriction
from ._heat import Heat, TransmissionPartition
from ._links import Conductance
from ._network import Lump, Wall, place_of


class Delayed(AbstractProfile):
    """A profile that comes later, `p(t − delay)`; until then it is as before its beginning.

    - `profile`: any profile;  `delay` (s)
    """

    profile: AbstractProfile = holding("SI")
    delay: Scalar = quantity("s", "time by which the profile comes later", low=0.0)

    @property
    def knot_count(self) -> int:
        return getattr(self.profile, "knot_count", 0)

    def value(self, t, piece):
        return self.profile.value(t - self.delay, piece)

    def next_knot(self, piece):
        return self.profile.next_knot(piece) + self.delay

    def first_piece(self, t):
        return self.profile.first_piece(t - self.delay)

    def no_more_turns(self, t):
        return self.profile.no_more_turns(t - self.delay)

    def scale(self):
        return self.profile.scale()

    def faults(self, path, low):
        if isinstance(self.profile, AbstractSpeedLever):
            return [Fault(f"{path}.profile", "a lever that answers the speed cannot come later")]
        return self.profile.faults(f"{path}.profile", low)


def feeds_back(scene: Any) -> bool:
    """Whether what was worn off before a run changes it."""
    wear = scene.wear
    return wear is not None and (wear.geometry or wear.heat or wear.take_up_speed is not None)


def _worn(scene: Any) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Thickness worn off before the run, and the sizes of the linings: under a band their angles."""
    weights = scene.brake.linings.weights
    return jnp.broadcast_to(jnp.asarray(scene.wear.worn), weights.shape), weights


def worn_scene(scene: Any) -> Any:
    """The scene as it is with the thickness `h_i` that was worn off before it (`Wear.worn`); itself without feedback.

        geometry        R_b' = R_b − h̄,  h̄ = Σ β_i h_i/Σ β_i        the band follows the linings inwards
        take_up_speed   T_0'(t) = T_0(t − Δ/u),  Δ = Σ β_i h_i = h̄ Σ β_i    the lever first draws in the slack Δ of the
                        band's length, with its end at the speed u
        heat            lumps of linings: C' = C s_i, conductances from them G' = G/s_i, s_i = 1 − h_i/δ;
                        `TransmissionPartition`: δ_l' = δ_l − h̄.  Walls of linings: all layers by s_i (`walls_left`)

    The band circle is one, so that its radius falls by the mean; nobody readjusts the linkage in between. Faces do not
    grow or shrink: the inner one stays on the rim.
    """
    if not feeds_back(scene):
        return scene
    (h, angle), wear = _worn(scene), scene.wear
    slack = jnp.sum(angle * h)
    if wear.geometry:
        radius = jnp.asarray(scene.brake.band.radius) - slack / jnp.sum(angle)
        scene = eqx.tree_at(lambda s: s.brake.band.radius, scene, radius)
    if wear.take_up_speed is not None:
        lever = Delayed(scene.duty.slack_tension, slack / wear.take_up_speed)
        scene = eqx.tree_at(lambda s: s.duty.slack_tension, scene, lever)
    if wear.heat and scene.heated:
        scene = eqx.tree_at(lambda s: s.heat, scene, _thinner(scene.heat, h, angle, wear.thickness))
    return scene


def _linings(heat: Heat) -> set[str]:
    """Names of the bodies that are linings."""
    inner, outer = heat.friction, heat.external
    places = (heat.linings, None if inner is None else inner.lining, None if outer is None else outer.lining)
    return {place_of(place)[0] for place in places if place is not None}


def _left(h: Array, angle: Array, thickness: Any, count: int) -> Array:
    """Share of the thickness that is left, of each of `count` bodies (all linings in one: their mean)."""
    share = 1 - h / jnp.asarray(thickness)
    return share if count > 1 else jnp.sum(share * angle, keepdims=True) / jnp.sum(angle)


def walls_left(scene: Any) -> dict[str, Array]:
    """Share `s_i = 1 − h_i/δ` of the thickness that is left of every wall of linings, for each of its copies.

    Layers are thinner by it: `C' = C s_i`, resistance `s_i δ/λ`.
    """
    if scene.wear is None or not scene.wear.heat or not scene.heated:
        return {}
    h, angle = _worn(scene)
    walls = [wall for wall in scene.heat.walls if wall.name in _linings(scene.heat)]
    return {wall.name: _left(h, angle, wall.thickness, wall.copies) for wall in walls}


def _thinner(heat: Heat, h: Array, angle: Array, thickness: Any) -> Heat:
    bodies, links = list(heat.bodies), list(heat.links)
    for i, body in enumerate(bodies):
        if not isinstance(body, Lump) or body.name not in _linings(heat):
            continue
        share = _left(h, angle, thickness, body.count)
        share = share if body.count > 1 else share[0]
        bodies[i] = eqx.tree_at(lambda b: b.capacity, body, jnp.asarray(body.capacity) * share)
        for k, link in enumerate(links):
            if isinstance(link, Conductance) and body.name in (link.a, link.b):
                links[k] = eqx.tree_at(lambda one: one.value, link, jnp.asarray(link.value) / share)
    heat = eqx.tree_at(lambda x: (x.bodies, x.links), heat, (tuple(bodies), tuple(links)))

    def thin(part: Any) -> Any:
        if not isinstance(part, TransmissionPartition):
            return part
        mean = jnp.sum(h * angle) / jnp.sum(angle)
        return eqx.tree_at(lambda p: p.lining_thickness, part, jnp.asarray(part.lining_thickness) - mean)

    return jax.tree.map(thin, heat, is_leaf=lambda x: isinstance(x, TransmissionPartition))


# --- faults -----------------------------------------------------------------------------------------------------------


def faults_of_wear(scene: Any) -> list[Fault]:
    """What does not fit together between the wear of a scene and the rest of it (concrete values only)."""
    wear, brake = scene.wear, scene.brake
    if wear is None:
        return []
    found = wear.faults("wear", brake.linings.count)
    if not brake.banded:
        found += _faults_without_band(wear, brake.words.brake)
        return found + (_faults_of_thickness(scene) if wear.heat and not found else [])
    bandage = brake.bandage
    if brake.linings.area is None:
        found.append(Fault("brake.linings.area", "is missing", "wear looks at the pressure"))
    if wear.internal is not None and bandage is None:
        found.append(Fault("wear.internal", "has no effect", "only a staged brake (`brake.bandage`) has inner faces"))
    elif wear.internal is not None and bandage is not None and bandage.area is None:
        found.append(Fault("brake.bandage.area", "is missing", "wear of the inner faces looks at the pressure"))
    if wear.turned_at is not None:
        found += _faults_of_turning(brake)
    if wear.take_up_speed is not None and isinstance(scene.duty.lever, AbstractSpeedLever):
        found.append(Fault("wear.take_up_speed", "has no effect on a lever that answers the speed", "leave it out"))
    return found + (_faults_of_thickness(scene) if wear.heat and not found else [])


def _faults_without_band(wear: Any, name: str) -> list[Fault]:
    """What of the wear is of the band alone."""
    given = {"internal": wear.internal is not None, "geometry": wear.geometry}
    given |= {"take_up_speed": wear.take_up_speed is not None, "turned_at": wear.turned_at is not None}
    return [Fault(f"wear.{field}", f"has no effect on a {name}", "leave it out") for field, is_ in given.items() if is_]


def _faults_of_turning(brake: Any) -> list[Fault]:
    """Why a band cannot be turned within a run: the brake is integrated as it was built."""
    where = "wear.turned_at"
    if brake.bandage is not None:
        return [Fault(where, "the linings of a staged brake ride on the pulley", "turning its band does not move them")]
    parts = [*leaves(brake.linings, "brake.linings"), *leaves(brake.band, "brake.band")]
    unlike = [leaf.path for leaf in parts if np.ndim(leaf.value) == 1 and np.ptp(np.asarray(leaf.value)) > 0]
    hint = "linings that are alike; else `lining_life(turn_at=…)`, which turns the brake itself between brakings"
    return [Fault(where, f"the numbers of {path} are not alike", hint) for path in unlike]


def _faults_of_thickness(scene: Any) -> list[Fault]:
    wear, heat, n = scene.wear, scene.network, scene.brake.linings.count
    names = _linings(heat)
    if not names:
        return [Fault("wear.heat", "has no effect", "the scene has no heat part with linings")]
    found, worn = [], float(np.max(np.broadcast_to(np.asarray(wear.worn), (n,))))
    for i, body in enumerate(heat.bodies):
        if body.name not in names:
            continue
        if isinstance(body, Lump) and wear.thickness is None:
            found.append(Fault("wear.thickness", "is missing", f"the lump {body.name!r} does not say how thick it is"))
        elif isinstance(body, Wall) and worn >= float(body.thickness):
            what = f"{worn:g} m worn off leave nothing of the wall {body.name!r}"
            found.append(Fault(f"heat.bodies[{i}].thickness", what))
    return found


# --- a band turned end for end ----------------------------------------------------------------------------------------


def turned_scene(scene: Any) -> Any:
    """The scene with its band turned end for end: what goes with the band is counted from the other end.

    That is every number of `brake.linings`, of segments and gaps of the band, of the wear, and the heat capacity of the
    linings, where it has one entry per lining. Numbers of the places stay: temperatures at the start, free ends of the
    band. Raises `InputError` for a staged brake, whose linings ride on the pulley.
    """
    brake, n = scene.brake, scene.brake.linings.count
    if not brake.banded:
        raise InputError([Fault("brake", f"is a {brake.words.brake}: only a band is turned end for end")])
    if brake.in_series:
        raise InputError(_faults_of_turning(brake))

    def reverse(part: Any) -> Any:
        tables = TabulatedFade | TabulatedFriction  # their entries are no linings

        def one(x: Any) -> Any:
            return x[::-1] if not isinstance(x, tables) and np.ndim(x) == 1 and np.shape(x)[0] in (n, n - 1) else x

        return jax.tree.map(one, part, is_leaf=lambda x: isinstance(x, tables))

    scene = eqx.tree_at(lambda s: (s.brake.linings, s.brake.band), scene, (reverse(brake.linings), reverse(brake.band)))
    if scene.wear is not None:
        numbers = [scene.wear.rate, scene.wear.worn, scene.wear.permissible]
        scene = eqx.tree_at(
            lambda s: [s.wear.rate, s.wear.worn, s.wear.permissible],
            scene,
            [reverse(x) for x in numbers],
            is_leaf=lambda x: x is None,
        )
    if scene.heated:
        linings = _linings(scene.heat)
        bodies = tuple(
            eqx.tree_at(lambda b: b.capacity, body, reverse(body.capacity))
            if isinstance(body, Lump) and body.name in linings
            else body
            for body in scene.heat.bodies
        )
        scene = eqx.tree_at(lambda s: s.heat.bodies, scene, bodies)
    return scene
