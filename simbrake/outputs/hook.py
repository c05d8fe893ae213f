"""The hook of a hoist at one instant: motion, weight and tensions of its lines."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..hybrid.arrays import Array, numpy_of
from ..physics._brake import BrakeNow, BrakeSystem, State, load_piece
from ..physics._rope import ElasticRope
from ..physics.mechanism import OPEN, Mode, slips
from ..physics.shaft import Shaft, rests, way_of


class HookNow(NamedTuple):
    """The hook: travel downwards since the start (m), speed (m/s), `weight` on it,
    force `m (g − a)`, tension of the tightest line (N).

    - `fast`, `dead`: tensions of these lines (N), where the shaft has a loss of the
      tackle
    - `stretch` of an elastic rope (m; below 0 it is slack)
    """

    travel: Array
    speed: Array
    weight: Any
    force: Array
    rope: Array
    fast: Any = None
    dead: Any = None
    stretch: Any = None
    deceleration: Any = None


def hook_of(system: BrakeSystem, y: State, mode: Mode, z: BrakeNow) -> HookNow | None:
    """The hook, where the load hangs on one."""
    load = system.load.on_layer(mode.layer)
    travelled = system.load.travelled(y.phi)
    piece = load_piece(mode)
    hanging = load.hanging(piece)
    travel = load.travel()
    if hanging is None or travel is None or travelled is None:
        return None
    elastic = system.feature(ElasticRope)
    rope = z.rope
    if elastic is not None:
        speed = y.hook.speed
        now = HookNow(
            travelled + elastic.stretched(system, y, mode),
            speed,
            rope.weight,
            rope.force,
            *_lines_of(system, mode, rope.force),
            stretch=rope.stretch,
        )
        acceleration = (rope.weight - rope.force) / rope.mass
    else:
        speed = y.omega * travel
        acceleration = travel * z.contact.alpha
        mass, weight = hanging
        force = weight - mass * acceleration
        pull = load.pull(force, travelled, z.contact.alpha, piece)
        lines = _lines_of(system, mode, pull)
        now = HookNow(jnp.asarray(travelled), speed, weight, force, *lines)
    return now._replace(deceleration=slowing(mode, speed, acceleration))


def slowing(mode: Mode, speed: Array, acceleration: Array) -> Array:
    """Deceleration `−d|v|/dt` of a motion at a speed `v`, 0 at rest.

    Where the mode has a sense, of sliding or of a shaft that turns with dry friction,
    that is the sense of the motion: at its very end the speed is 0, or beyond it by
    rounding.
    """
    xp = numpy_of(speed)
    sense = mode.sense
    known = slips(mode.band)
    if mode.turn is not None:
        is_open = mode.band == OPEN
        sense = xp.where(is_open, mode.turn, sense)
        known = known | is_open
    if mode.inner is not None:  # the pulley in its bandage
        sense = xp.where(mode.inner == 0, sense, mode.inner)
        known = known | (mode.inner != 0)
    moves = xp.where(known, xp.asarray(sense, np.float64), xp.sign(speed))
    return 0.0 - xp.where(rests(mode), 0.0, moves) * acceleration


def _lines_of(
    system: BrakeSystem, mode: Mode, pull: Array
) -> tuple[Array, Array | None, Array | None]:
    """Tensions (N) under a pull on the hook: of the tightest line, of the fast line and of
    the dead line.

    Without a loss of the tackle all lines have the same tension. At rest each is the
    largest that it can be, and that of the fast line the largest of all.
    """
    if system.load.lines is None:
        return pull, None, None
    lines = jnp.asarray(system.load.lines)
    shaft = system.feature(Shaft)
    tackle = None if shaft is None else shaft.tackle
    if tackle is None:
        return pull / lines, None, None
    way = way_of(mode)
    fast, dead = tackle.tensions(pull, lines, way)
    return jnp.where(way > 0, dead, fast), fast, dead
