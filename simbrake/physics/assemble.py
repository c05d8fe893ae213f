"""System of equations, initial state and first mode of a scene."""

from typing import Any

import jax
import jax.numpy as jnp

from ..brakes._bands import MultiBandBrake
from ..brakes._pressed import AbstractPressedBrake
from ..brakes.design import AbstractLinings, Bandage, Brake, stiffness_of, unloaded
from ..friction import Contact, rates_read
from ..hybrid.arrays import Array
from ..parts.scene import Scene
from ..parts.worn import walls_left, worn_scene
from ..phases import Phases
from ..profiles import AbstractProfile, starting_piece
from ..thermal.heat import FrictionHeat
from ..wear import AbstractWearRate, Wear
from ._brake import BrakeSystem, Feature, State
from ._chain import Chain
from ._elastic import ElasticBand
from ._onset import Onsets
from ._phased import DutyInPhases
from ._rigid import PressedContact, RigidBand, RigidBands
from ._rope import ElasticRope, HangingRopes, Layers
from ._sprung import SprungBandage
from ._thermal import Thermal, assemble_thermal
from ._worn import FrictionTables, Memory, Wearing
from .heated import Heating
from .mechanism import AbstractMechanism, Mode, Pair, Sizes
from .shaft import Drive, Shaft
from .sliding import BandFriction, LiningFriction, PadFriction
from .staged import InternalPair, StagedBrake


def assemble(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and initial mode of a scene. The run settles the true first
    mode itself, as an event.

    With feedback of wear the brake is as worn as it is at the start of the run.
    """
    scene = _with_sums(worn_scene(scene))
    brake = scene.brake
    duty = scene.duty
    initial = scene.initial
    heat = scene.heat
    lever = scene.lever
    thermal = u = None
    if heat is not None:
        lifts = (
            isinstance(brake, Brake)
            and brake.bandage is not None
            and brake.bandage.mass is not None
        )
        thermal, u = assemble_thermal(
            heat, walls_left(scene), scene.power_shares, brake.linings_of_rims, lifts
        )
    pairs = _pairs(scene, thermal)
    still = _at_the_start(
        brake.linings, pairs[0], thermal, u, jnp.asarray(initial.time)
    )
    t_0 = jnp.asarray(initial.time)
    omega_0 = jnp.asarray(scene.start_speed)
    layer = None if duty.load.layers is None else duty.load.layers.first_layer()
    elastic = duty.load.elastic
    load = duty.load.on_layer(layer)
    inertia = jnp.asarray(brake.inertia) + (load.inertia() if elastic is None else 0.0)
    zero = jnp.zeros(())
    ropes = load.ropes(zero, 0)
    moving = inertia if ropes is None else inertia + ropes.inertia
    sizes = _sizes(scene, still, omega_0, moving)
    of_rim = inertia if brake.rims == 1 else inertia / brake.rims
    mechanism = _mechanism(scene, pairs, sizes, still)
    # of what the scene has; each sees the changes of those before it
    features: list[Feature] = []
    if any(
        pair.law.temperature_range() is not None and _senses(pair, thermal)
        for pair in pairs
    ):
        features.append(FrictionTables())
    if layer is not None:
        features.append(Layers())
    if scene.shaft:
        features.append(
            Shaft(
                scene.torques,
                lever if isinstance(lever, Phases) and lever.engages else None,
            )
        )
    if thermal is not None:
        features.append(Heating(thermal, brake.linings.weights))
    if scene.wear is not None:
        features.append(
            _wearing(scene.wear, pairs[0], 0.5 * of_rim * sizes.speed**2 + sizes.torque)
        )
    if any(pair.memory is not None for pair in pairs):
        features.append(Memory())
    if isinstance(lever, Phases):
        height = initial.block_height
        features.append(DutyInPhases(None if height is None else jnp.asarray(height)))
    if scene.motor is not None:
        features.append(Drive(scene.motor, scene.motor.course(duty.lever)))
    if elastic is not None:
        features.append(ElasticRope.of(elastic, load, duty.load_piece(t_0)))
    if load.rope_span() is not None or load.slack_margin(zero, zero) is not None:
        features.append(HangingRopes())
    # (the last, as it counts the stops of all others)
    if any(change.when is not None for change in mechanism.changes):
        features.append(Onsets.of(mechanism.changes))
    system = BrakeSystem(
        mechanism=mechanism,
        inertia=inertia,
        track_radius=jnp.asarray(brake.track_radius),
        lever=lever,
        load=duty.load,
        features=tuple(features),
        rims=brake.rims,
        wants=duty.wants,
    )
    own, band, own_mode = mechanism.start(
        omega_0, jnp.asarray(initial.elongation) + jnp.zeros_like(omega_0)
    )
    sense = jnp.where(omega_0 < 0, -1, 1).astype(jnp.int32)
    pieces: dict[str, Any] = {"load": duty.load_piece(t_0)}
    given = {"lever": lever, **system.profiles}
    if isinstance(lever, Phases):
        pieces["phase"] = jnp.asarray(0, jnp.int32)
        given = {
            name: x.at(pieces["phase"], t_0) if isinstance(x, Phases) else x
            for name, x in given.items()
        }
    pieces |= {name: starting_piece(profile, t_0) for name, profile in given.items()}
    mode = Mode(jnp.asarray(band), sense, own_mode, pieces, layer=layer)
    return system, *system.start(t_0, omega_0, own, u, mode)


def _with_sums(scene: Scene) -> Scene:
    """The scene with sums over its histories (`AbstractProfile.with_sums`)."""

    def is_profile(x: object) -> bool:
        return isinstance(x, AbstractProfile)

    return jax.tree.map(
        lambda x: x.with_sums() if is_profile(x) else x, scene, is_leaf=is_profile
    )


def _senses(pair: Pair, thermal: Thermal | None) -> bool:
    """Whether the law of a pair sees temperatures of the scene."""
    return (
        thermal is not None and pair.heat is not None and pair.heat.sensor is not None
    )


def _wearing(wear: Wear, pair: Pair, energy: Array) -> Wearing:
    assert pair.area is not None
    # volume k W/f for the friction work of a typical stop, over all linings: f n is of
    # the order of 1
    turned_at = wear.turned_at if wear.turned_after is None else wear.turned_after
    scale = _positive(jnp.max(wear.rate.at(None) / pair.area) * energy)
    return Wearing(scale, None if turned_at is None else jnp.asarray(turned_at))


def _pairs(scene: Scene, thermal: Thermal | None) -> tuple[Pair, ...]:
    """The friction pairs of a scene: friction law, places of the heat, wear."""
    brake = scene.brake
    heat = scene.network
    wear = scene.wear
    several = len(brake.pairs) > 1
    on_rim = heat.friction
    on_band = heat.external
    rate, inner_rate = (None, None) if wear is None else (wear.rate, wear.internal)
    given: dict[str, tuple[FrictionHeat | None, AbstractWearRate | None]] = {
        "external": (on_band if several else on_rim, rate),
        "internal": (on_rim, inner_rate),
    }

    def pair(name: str, field: str) -> Pair:
        part: AbstractLinings | Bandage = brake.rubbing_part(name)
        n = brake.linings.count
        (place, worn) = given[name]
        seen = place is not None and place.sensor is not None
        memory = rates_read(part.friction, n, T=seen, p=part.area is not None)
        apart = thermal is not None and thermal.needs_each_lining(place)
        by_band = (
            brake.banded and name == "external" and memory is not None and memory.q
        )
        return Pair(
            name=name,
            field=field,
            law=part.friction,
            area=None if part.area is None else jnp.asarray(part.area),
            heat=place,
            wear=worn,
            count=n,
            on_band=several and part is brake.linings,
            apart=apart or (memory is not None and memory.q),
            memory=memory,
            cosine=brake.linings.cosine if by_band else None,  # pyright: ignore
        )

    return tuple(pair(name, place.field) for name, place in brake.pairs.items())


def _at_the_start(
    linings: AbstractLinings, pair: Pair, thermal: Thermal | None, u: Any, t: Array
) -> Contact:
    """Inputs of the linings' friction law at the start, without load."""
    hot = None
    if (
        thermal is not None
        and u is not None
        and pair.heat is not None
        and pair.heat.sensor is not None
    ):
        hot = thermal.at(thermal.temperatures(u), pair.heat.sensor, pair.count)
    return unloaded(linings, jnp.zeros(linings.count), hot, t)


#: tensions and torques that differ by less than this share of a typical one are equal
_ROUNDING = 1e-12
#: smallest size of a speed (rad/s)
_SLOWEST = 1e-120


def _positive(size: Array) -> Array:
    return jax.lax.stop_gradient(jnp.where(size > 0, size, 1.0))


def _sizes(scene: Scene, still: Contact, omega_0: Array, inertia: Array) -> Sizes:
    """Typical sizes of one rim: the largest slack tension; what its band could hold, or
    its load; the speed at the start, or the one that the largest torque could give in
    the run."""
    brake = scene.brake
    duty = scene.duty
    t_0 = jnp.asarray(scene.initial.time)
    tension = _positive(scene.lever.scale())
    capacity = brake.torque(tension, brake.linings.friction.static(still))
    piece = jnp.asarray(
        0 if (first := duty.load_piece(t_0)) is None else first, jnp.int32
    )
    zero = jnp.zeros(())
    load_0 = jnp.abs(duty.load.whole_torque(t_0, omega_0, piece, zero, zero))
    torque = jnp.maximum(capacity, jnp.maximum(load_0, duty.load.profile.scale()))
    if scene.shaft:
        pieces = tuple(
            jnp.asarray(law.profile.first_piece(t_0), jnp.int32) for law in scene.shaft
        )
        beside = Shaft(scene.torques).turning(
            t_0, jnp.abs(omega_0), load_0, jnp.asarray(1.0), pieces
        )
        torque = jnp.maximum(torque, beside)
    if scene.motor is not None:
        torque = jnp.maximum(torque, jnp.asarray(scene.motor.max_torque))
    torque = _positive(torque)
    # from rest 1 rad/s at most
    reach = jnp.minimum(torque / inertia * (jnp.asarray(scene.end_time) - t_0), 1.0)
    # (of a smaller speed the energy would be 0)
    speed = jnp.maximum(
        _positive(jnp.where(omega_0 == 0, reach, jnp.abs(omega_0))), _SLOWEST
    )
    torque = torque if brake.rims == 1 else torque / brake.rims
    return Sizes(tension, torque, speed, _ROUNDING * tension, _ROUNDING * torque)


def _mechanism(
    scene: Scene, pairs: tuple[Pair, ...], sizes: Sizes, still: Contact
) -> AbstractMechanism:
    """Mechanism of a scene: its bodies, and how they stick and slide."""
    brake = scene.brake
    heated = still.T is not None
    if isinstance(brake, AbstractPressedBrake):
        f = jnp.broadcast_to(
            brake.linings.friction.static(still), (brake.linings.count,)
        )
        friction = PadFriction(brake.linings, scene.power_shares, heated)
        return PressedContact(
            brake, friction, jnp.any(brake.self_locking(f) >= 1), pairs, sizes
        )
    if isinstance(brake, MultiBandBrake):
        return _bands(scene, brake, pairs, sizes, still)
    assert isinstance(brake, Brake)
    friction = LiningFriction.of(
        brake.linings, scene.network.flash, scene.power_shares, heated=heated
    )
    linings = brake.linings
    bandage = brake.bandage
    radius = jnp.asarray(brake.band.radius)
    n = brake.linings.count
    stiffness = stiffness_of(brake, still.T, scene.initial.time)
    if brake.band.segments is not None:
        return _chain(scene, brake, pairs, sizes, friction, stiffness)
    if bandage is not None and bandage.spring is not None:
        return _sprung(brake, pairs, sizes, friction)
    static, kinetic = (
        jnp.broadcast_to(f(still), (n,))
        for f in (linings.friction.static, linings.friction.kinetic)
    )
    wrap = BandFriction.of(radius, friction, static, kinetic)
    if bandage is not None:
        rim = InternalPair(bandage, jnp.asarray(brake.pulley.radius), friction.sine)
        return StagedBrake(
            wrap=wrap, stiffness=stiffness, internal=rim, pairs=pairs, sizes=sizes
        )
    if stiffness is None:
        return RigidBand(wrap=wrap, pairs=pairs, sizes=sizes)
    return ElasticBand(wrap=wrap, stiffness=stiffness, pairs=pairs, sizes=sizes)


def _bands(
    scene: Scene,
    brake: MultiBandBrake,
    pairs: tuple[Pair, ...],
    sizes: Sizes,
    still: Contact,
) -> RigidBands:
    """Several bands: each is made as if it were alone."""
    linings = brake.linings
    n = brake.linings.count
    radius = jnp.asarray(brake.band_radius)

    def friction(of: Any) -> LiningFriction:
        return LiningFriction.of(
            of, scene.network.flash, scene.power_shares, heated=still.T is not None
        )

    static, kinetic = (
        jnp.broadcast_to(f(still), (n,))
        for f in (linings.friction.static, linings.friction.kinetic)
    )
    each = zip(
        brake.bands, brake.of_bands(static), brake.of_bands(kinetic), strict=True
    )
    wraps = (
        BandFriction.of(radius, friction(band.linings), *own) for band, *own in each
    )
    bands = tuple(RigidBand(wrap=wrap, pairs=pairs, sizes=sizes) for wrap in wraps)
    shares = brake.lever_shares(kinetic)
    return RigidBands(
        bands=bands, shares=shares, grip=friction(linings), pairs=pairs, sizes=sizes
    )


def _chain(
    scene: Scene,
    brake: Brake,
    pairs: tuple[Pair, ...],
    sizes: Sizes,
    friction: LiningFriction,
    anchor: Array | None,
) -> Chain:
    """A chain, from the onset of slip on: all linings stick, all segments have the
    tension `C x_0`."""
    n = brake.linings.count
    segments = brake.band.segments
    assert segments is not None
    assert brake.linings.mass is not None
    assert anchor is not None
    mass = jnp.broadcast_to(jnp.asarray(brake.linings.mass), (n,))
    between = jnp.broadcast_to(jnp.asarray(segments.stiffness), (n - 1,))
    damping = (
        2
        * jnp.asarray(segments.damping_ratio)
        * jnp.sqrt(between * 0.5 * (mass[1:] + mass[:-1]))
    )
    return Chain(
        radius=jnp.asarray(brake.band.radius),
        mass=mass,
        stiffness=jnp.append(between, anchor),
        damping=jnp.append(damping, jnp.asarray(segments.anchor_damping)),
        preload=anchor * jnp.asarray(scene.initial.elongation),
        cosine=jnp.cos(jnp.asarray(brake.linings.angle) / 2),
        grip=friction,
        pairs=pairs,
        sizes=sizes,
    )


def _sprung(
    brake: Brake, pairs: tuple[Pair, ...], sizes: Sizes, friction: LiningFriction
) -> SprungBandage:
    """A bandage on springs that are not stretched at the start."""
    n = brake.linings.count
    bandage = brake.bandage
    R_b = jnp.asarray(brake.band.radius)
    assert bandage is not None
    inertias = jnp.asarray(bandage.inertia)
    inertias = jnp.broadcast_to(inertias / n, (n,)) if inertias.ndim == 0 else inertias
    stiffness = jnp.broadcast_to(jnp.asarray(bandage.spring), (n - 1,))
    reduced = inertias[:-1] * inertias[1:] / ((inertias[:-1] + inertias[1:]) * R_b**2)
    return SprungBandage(
        inertias=inertias,
        band_radius=R_b,
        track_radius=jnp.asarray(brake.pulley.radius),
        grip=friction,
        bandage=bandage,
        stiffness=stiffness,
        damping=2 * jnp.asarray(bandage.spring_damping) * jnp.sqrt(stiffness * reduced),
        pairs=pairs,
        sizes=sizes,
    )
