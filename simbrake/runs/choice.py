"""Which method integrates a scene, and why."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float

from .._base._compiling import Compiled
from .._base._numbers import digits
from .._base._store import cached_by_values
from ..brakes.design import AbstractLinings, Bandage, unloaded
from ..hybrid.arrays import Array
from ..parts.at_start import remembering_at_start
from ..parts.scene import Scene
from ..profiles import AbstractProfile
from ..shaft import AbstractDryTorque, AbstractShaftTorque
from ..thermal._coolant import WaterJacket
from ..thermal.heat import Heat
from ..thermal.materials import ROOM
from ..thermal.network import (
    AbstractCoefficient,
    Lump,
    Radiation,
    Surroundings,
    ThermalContact,
    Wall,
    place_of,
)

#: length of the real stability interval of Dopri8, roughly
_REACH = 6.0
#: explicit steps that stability may demand before a linearly implicit method is faster
_PATIENCE = 150.0
#: the same without heat, where an explicit step is cheap
_PATIENCE_COLD = 1500.0


@functools.partial(Compiled, quick=True)
def _sizes(heat: Heat) -> tuple[dict[str, Array], dict[str, Array], list[Array | None]]:
    """Capacities of the nodes of each body (J/K), of one copy of a wall and half of its
    layers' resistances (K/W), and the resistance of each link at rest and at the
    temperatures of the start; `None` of one that changes with them."""
    capacity = {}
    halves = {}
    links = []
    at_start = {body.name: getattr(body, "temperature", ROOM) for body in heat.bodies}
    for body in heat.bodies:
        if isinstance(body, Lump):
            capacity[body.name] = jnp.broadcast_to(
                jnp.asarray(body.capacity), (body.count,)
            )
        elif isinstance(body, Wall):
            area = jnp.min(jnp.asarray(body.area))  # every copy of a wall is alike
            capacity[body.name] = (
                body.material.volumetric_heat_capacity * area * body.steps
            )
            halves[body.name] = body.steps / (2 * area * body.material.conductivity)
    for link in heat.links:
        if isinstance(link, Radiation) or isinstance(
            getattr(link, "coefficient", None), AbstractCoefficient
        ):
            links.append(None)
            continue
        # as of a perfect contact
        if isinstance(link, ThermalContact) and link.law is not None:
            links.append(jnp.zeros(()))
            continue
        T = [at_start[place_of(place)[0]] for place in (link.a, link.b)]
        T = [
            jnp.asarray(ROOM)
            if isinstance(x, AbstractProfile)
            else jnp.mean(jnp.asarray(x))
            for x in T
        ]
        around = (
            Surroundings(flow=link.largest_flow)
            if isinstance(link, WaterJacket)
            else Surroundings()
        )
        g = link.conductance(T[0], T[1], around)
        links.append(jnp.zeros(()) if g is None else 1 / jnp.maximum(g, 1e-300))
    return capacity, halves, links


def fastest_node(heat: Heat) -> tuple[float, str]:
    """Largest rate `2 Σg/C` (1/s) of any node at the reference properties, after
    Gershgorin, and the node's name."""
    capacity, halves, resistances = jax.tree.map(np.asarray, _sizes(heat))
    total = {name: np.zeros_like(C) for name, C in capacity.items()}
    for name, half in halves.items():
        g = 1 / (half[:-1] + half[1:])
        total[name][:-1] += g
        total[name][1:] += g
    for link, own in zip(heat.links, resistances, strict=True):
        if own is None:
            continue
        ends = [place_of(link.a), place_of(link.b)]
        behind = sum(
            halves[n][0 if f == "front" else -1] for n, f in ends if f is not None
        )
        g = 1 / np.maximum(own + behind, 1e-300)
        # a junction hands on what the other side of it lets through: no faster than
        # this link
        for name, face in ends:
            if name in total:
                where = 0 if face == "front" else -1 if face else slice(None)
                total[name][where] += np.sum(g) if face or total[name].size == 1 else g
    rates = {name: 2 * total[name] / capacity[name] for name in capacity}
    name = max(rates, key=lambda n: rates[n].max())
    i = int(np.argmax(rates[name]))
    node = name if rates[name].size == 1 else f"{name}[{i + 1}]"
    return float(rates[name][i]), node


def _demands(what: str, rate: float, span: float, patience: float) -> str:
    """Why an explicit method is too slow for what follows at a rate (1/s) over a time
    (s); "" if it is not."""
    steps = rate * span / _REACH
    how = f"an explicit method would need at least {steps:.2g} steps to stay stable"
    return f"{what} within {1 / rate:.2g} s: {how}" if steps > patience else ""


def stiffness(scene: Scene) -> tuple[bool, str]:
    """Whether a scene (concrete values) needs a linearly implicit method, and the
    reason in words."""
    span = float(scene.end_time) - float(scene.initial.time)
    heat_stiffness = (
        stiff_heat(scene.network, span)
        if scene.heated
        else (False, "nothing in the scene is stiff")
    )
    # linings that swing one by one have to be followed in any case
    brake = scene.brake
    duty = scene.duty
    if heat_stiffness[0] or brake.resolved:
        return heat_stiffness
    drag = float(getattr(duty.load, "drag", 0.0)) + _steepest_drag(scene)
    drag = drag / float(brake.inertia)
    patience = _PATIENCE if scene.heated else _PATIENCE_COLD
    why = _demands("drag balances the speed", drag, span, _PATIENCE_COLD)
    why = why or _demands(
        "the damped rope follows", _damping_of_rope(scene), span, _PATIENCE_COLD
    )
    why = why or _demands(
        "a state of a friction law follows",
        _fastest_state_at_start(scene),
        span,
        patience,
    )
    return (True, why) if why else heat_stiffness


def _damping_of_rope(scene: Scene) -> float:
    """Rate (1/s) at which the damping of an elastic rope makes the speeds of hook and
    drum equal, `c (1/m + (r/n)²/J)`, with the least mass on the hook."""
    load = scene.duty.load
    if load.elastic is None:
        return 0.0

    mass = float(load.hanging(jnp.asarray(0, jnp.int32))[0])  # pyright: ignore
    per_radian = float(load.travel())  # pyright: ignore
    return float(load.elastic.damping) * (
        1 / mass + per_radian**2 / float(scene.brake.inertia)
    )


@cached_by_values(lambda scene: (scene.shaft, scene.initial))
def _steepest_drag(scene: Scene) -> float:
    """Largest slope `dM/dω` (N·m·s) of all torques on the shaft together, at rest and
    at the initial speed."""
    laws = tuple(law for law in scene.shaft if not isinstance(law, AbstractDryTorque))
    return (
        float(_slopes(laws, np.asarray(abs(float(scene.start_speed))))) if laws else 0.0
    )


@functools.partial(Compiled, quick=True)
def _slopes(laws: tuple[AbstractShaftTorque, ...], speed: Array) -> Array:
    still = jnp.zeros(())
    total = jnp.zeros(())
    for law in laws:
        piece = law.profile.first_piece(still)
        slope = jax.grad(
            lambda omega, law=law, piece=piece: jnp.asarray(
                law.torque(still, omega, piece, still)
            )
        )
        total = total + jnp.maximum(slope(still), slope(speed))
    return total


@cached_by_values(lambda scene: (scene.brake, scene.heat, scene.initial))
def _fastest_state_at_start(scene: Scene) -> float:
    """Largest rate (1/s) at which a state of a friction law follows at the start; 0
    without any."""
    v = np.full(
        scene.brake.linings.count,
        abs(float(scene.brake.radius) * float(scene.start_speed)),
    )
    return max(
        (float(_fastest_state(part, v, T)) for part, T in remembering_at_start(scene)),
        default=0.0,
    )


@functools.partial(Compiled, quick=True)
def _fastest_state(
    part: AbstractLinings | Bandage, v: Float[Array, " n"], T: Array | None
) -> Float[Array, ""]:
    """Largest rate (1/s) at which changes of the states of a pair's law decay, after
    Gershgorin."""
    law = part.friction
    contact = unloaded(part, v, T)
    memory, back = ravel_pytree(contact.memory)
    still = None if contact.p is None else jnp.zeros_like(contact.p)

    def rates(memory: jax.Array) -> jax.Array:
        slopes = law.rates(contact._replace(memory=back(memory), q=still))
        return ravel_pytree(
            jax.tree.map(lambda x, y: x + 0.0 * y, slopes, back(memory))
        )[0]

    return jnp.max(jnp.sum(jnp.abs(jax.jacfwd(rates)(memory)), axis=1))


def stiff_heat(heat: Heat, span: float) -> tuple[bool, str]:
    """The same for a network over the time `span` (s)."""
    rate, node = fastest_node(heat)
    if rate <= 0:
        return False, "no thermal node gives heat to another"
    follows = f"the thermal node {node} follows"
    why = _demands(follows, rate, span, _PATIENCE)
    return (
        bool(why),
        why
        or f"{follows} within {digits(1 / rate, 2)} s, which an explicit method can follow",
    )
