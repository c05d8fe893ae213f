"""Which pictures a run has, under what conditions, and what to see in them."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from .._parts._heat import place_count
from .._parts._pressed import DiscBrake, ShoeBrake
from .._run._result import Result


class Picture(NamedTuple):
    """A function of `simbrake.plot` that draws a result, when it has something to draw, and what to see in it.

    `options`: what else the function is given, so that one function can draw several pictures.
    """

    name: str
    title: str
    caption: str
    wanted: Callable[[Result], bool] = lambda result: True
    options: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """A name for a file."""
        return "-".join([self.name, *self.options])

    def figure(self, result: Result) -> Any:
        """The picture as a matplotlib figure."""
        from .. import plot  # matplotlib is loaded by those who want a picture

        return getattr(plot, self.name)(result, *self.options)


def _heated(result: Result) -> bool:
    return result.scene.heated


def _banded(result: Result) -> bool:
    return result.scene.brake.banded


def _pressed(result: Result) -> bool:
    return isinstance(result.scene.brake, DiscBrake | ShoeBrake)


def _staged(result: Result) -> bool:
    return result.scene.brake.in_series


def _resolved(result: Result) -> bool:
    return bool(result.record.modes.contacts)  # pyright: ignore


def _walled(result: Result) -> bool:
    return bool(result.scene.network.walls)


def _lining_by_lining(result: Result) -> bool:
    """Whether every lining has a temperature of its own."""
    heat = result.scene.network
    return heat.linings is not None and place_count(heat, heat.linings) > 1


#: the duty has a section of its own
DUTY = Picture(
    "duty",
    "What acts on the brake",
    "What the lever gives, and torque with which the load drives the shaft, over the whole run.",
)
#: the pictures of a run in the order of the page; a new one is one line
PICTURES = (
    Picture(
        "stop",
        "The run over time",
        "From above: speed of the pulley, torques of brake and load, tensions at the two ends of the band "
        "or forces on the linings, number of "
        "linings at their friction limit. Dashed lines are events; where there are two columns, the right one "
        "enlarges the onset of slip.",
    ),
    Picture(
        "pulley",
        "Tensions and loads on the pulley's circle",
        "At the time of the greatest tension: outwards the tension of the band at the ends of the linings, inwards the "
        "normal load of each; linings at their true angles, coloured by what they do.",
        _banded,
    ),
    Picture(
        "pressed",
        "What presses the linings",
        "At the time of the greatest load: pads on their disc, or shoes in their drum, at their true angles, with the "
        "pressure on a lining, and its forces.",
        _pressed,
    ),
    Picture(
        "lining_map",
        "Normal load of every lining",
        "Linings in their order, those of a band from the slack to the tight end, over time, coloured by their normal "
        "load; lines are events.",
        options=("normal_load",),
    ),
    Picture(
        "stages",
        "Stages of the staged brake",
        "Speeds of pulley and bandage, torques and friction heat of both pairs, and their overlap coefficients (filled "
        "while a pair slides, hatched while it sticks); the shading says which stage it is.",
        _staged,
    ),
    Picture(
        "contacts",
        "Which linings slide",
        "One line for each lining, from the slack end, over time: light blue while it sticks, orange while it slides "
        "ahead, purple while it slides back.",
        _resolved,
    ),
    Picture(
        "temperatures",
        "Temperatures",
        "Surfaces over time with the permissible temperature of the linings, the coefficient of friction that is left, "
        "and the temperature through the depth of the walls at the hottest moment.",
        _heated,
    ),
    Picture(
        "depth",
        "Through the depth of the rim",
        "Temperature over time and depth below the friction surface, and beside it profiles while the face heats, at "
        "its hottest, and as it cools.",
        _walled,
    ),
    Picture(
        "lining_map",
        "Temperature of every lining",
        "Linings from the slack to the tight end over time, coloured by the temperature of their surface.",
        _lining_by_lining,
        ("temperature",),
    ),
)


def lasted(result: Result) -> bool:
    """Whether a run lasted any time; one that fails at its start has nothing to draw."""
    times = np.asarray(result.record.rows.t)
    return bool(times[int(result.record.count)] > times[0])


def pictures_of(result: Result) -> Iterator[Picture]:
    """All pictures that a result has something for."""
    if lasted(result):
        yield from (picture for picture in PICTURES if picture.wanted(result))
