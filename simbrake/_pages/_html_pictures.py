"""Pictures of a report as images inside its page."""

import base64
from typing import NamedTuple

from .._base._progress import Waiting
from .._run._result import Result
from ._gallery import Picture, pictures_of

#: a picture whose SVG is longer is a PNG instead (bytes)
_LONGEST = 400_000
_DPI = 170.0  # of PNGs: sharp in print over the width of a page


class Drawing(NamedTuple):
    """A picture as an image inside the page."""

    name: str
    title: str
    caption: str
    address: str  # data URI


def draw(result: Result, picture: Picture) -> Drawing:
    """One picture of a result, as an image inside the page."""
    return drawing(picture.key, picture.title, picture.caption, picture.figure(result))


def drawing(name: str, title: str, caption: str, figure: object) -> Drawing:
    """A figure as an image inside the page: SVG, or PNG where that is shorter to load."""
    from .._pictures._plot_file import png, svg

    kind, data = "svg+xml", svg(figure)  # pyright: ignore
    if len(data) > _LONGEST:
        kind, data = "png", png(figure, _DPI)  # pyright: ignore
    return Drawing(name, title, caption, f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}")


def drawings_of(result: Result, told: Waiting) -> list[Drawing]:
    """All pictures that a result has something for."""
    drawn, pictures = [], list(pictures_of(result))
    for i, picture in enumerate(pictures):
        told.now("pictures", i, len(pictures))
        drawn.append(draw(result, picture))
    return drawn
