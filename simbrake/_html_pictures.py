"""Which pictures a report has, under what conditions, and what to see in them."""

import base64
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ._heat import place_count
from ._network import Wall
from ._result import Result

#: a picture whose SVG is longer is a PNG instead (bytes)
_LONGEST = 400_000
_DPI = 170.0  # of PNGs: sharp in print over the width of a page


class Picture(NamedTuple):
    """A function of `simbrake.plot` that draws a result, when it has something to draw, and what to see in it.

    `options`: what else the function is given, so that one function can draw several pictures.
    """

    name: str
    title: str
    caption: str
    wanted: Callable[[Result], bool] = lambda result: True
    options: tuple[str, ...] = ()


class Drawing(NamedTuple):
    """A picture as an image inside the page."""

    name: str
    title: str
    caption: str
    address: str  # data URI


def _heated(result: Result) -> bool:
    return result.scene.heat is not None


def _staged(result: Result) -> bool:
    return result.scene.brake.bandage is not None


def _resolved(result: Result) -> bool:
    return bool(result.record.modes.contacts)  # pyright: ignore


def _walled(result: Result) -> bool:
    heat = result.scene.heat
    return heat is not None and any(isinstance(body, Wall) for body in heat.bodies)


def _lining_by_lining(result: Result) -> bool:
    """Whether every lining has a temperature of its own."""
    heat = result.scene.heat
    return heat is not None and heat.linings is not None and place_count(heat, heat.linings) > 1


#: the duty has a section of its own
DUTY = Picture(
    "duty",
    "What acts on the brake",
    "Slack tension that the lever gives, and torque with which the load drives the shaft, over the whole run.",
)
#: the pictures of a run in the order of the page; a new one is one line
PICTURES = (
    Picture(
        "stop",
        "The run over time",
        "From above: speed of the pulley, torques of brake and load, tensions at the two ends of the band, number of "
        "linings at their friction limit. Dashed lines are events; where there are two columns, the right one "
        "enlarges the onset of slip.",
    ),
    Picture(
        "pulley",
        "Tensions and loads on the pulley's circle",
        "At the time of the greatest tension: outwards the tension of the band at the ends of the linings, inwards the "
        "normal load of each; linings at their true angles, coloured by what they do.",
    ),
    Picture(
        "lining_map",
        "Normal load of every lining",
        "Linings from the slack to the tight end over time, coloured by their normal load; lines are events.",
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
        "One line for each lining, from the slack end, over time: grey while it sticks, coloured while it slides.",
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


def draw(result: Result, picture: Picture) -> Drawing:
    """One picture of a result, as an image inside the page."""
    from . import plot  # matplotlib is loaded by those who want a picture

    figure = getattr(plot, picture.name)(result, *picture.options)
    return drawing("-".join([picture.name, *picture.options]), picture.title, picture.caption, figure)


def drawing(name: str, title: str, caption: str, figure: object) -> Drawing:
    """A figure as an image inside the page: SVG, or PNG where that is shorter to load."""
    from ._plot_file import png, svg

    kind, data = "svg+xml", svg(figure)  # pyright: ignore
    if len(data) > _LONGEST:
        kind, data = "png", png(figure, _DPI)  # pyright: ignore
    return Drawing(name, title, caption, f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}")


def lasted(result: Result) -> bool:
    """Whether a run lasted any time; one that fails at its start has nothing to draw."""
    times = np.asarray(result.record.rows.t)
    return bool(times[int(result.record.count)] > times[0])


def pictures_of(result: Result) -> list[Drawing]:
    """All pictures that a result has something for."""
    if not lasted(result):
        return []
    return [draw(result, picture) for picture in PICTURES if picture.wanted(result)]
