"""The pulley with its linings and band, seen as in `docs/signs.md`: the geometry of two pictures."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, FancyArrowPatch, Patch, Wedge

from .._parts._compliance import AbstractStiffness, ParallelBands
from .._parts._design import Brake
from .._run._lining_view import WORDS, Contact
from ._plot_shared import ORANGE, PURPLE, VERMILLION

#: colour of what a lining does; light for what sticks, so that numbers stay readable on all of them
CONTACT_COLOURS = {
    Contact.SLIDES: VERMILLION,
    Contact.AT_LIMIT: ORANGE,
    Contact.STICKS: "#9ecae1",
    Contact.SLIDES_BACK: PURPLE,
    Contact.FREE: "0.88",
}
#: radii in units of the drawn rim
RIM, LINING, BAND = 1.0, (1.02, 1.18), 1.21


def lining_edges(brake: Brake) -> np.ndarray:
    """Angles (n, 2) in rad at which each lining begins and ends, from the slack end on, gaps between them included.

    Of bands in parallel the first one; its gaps stand for all.
    """
    angle = np.asarray(brake.linings.angle, np.float64)
    stiffness: Any = brake.band.stiffness
    if isinstance(stiffness, ParallelBands):
        stiffness = stiffness.bands[0]
    gap = getattr(stiffness, "gap", 0.0) if isinstance(stiffness, AbstractStiffness) else 0.0
    gaps = np.broadcast_to(np.asarray(gap, np.float64), (angle.size - 1,))
    begin = np.append(0.0, np.cumsum(angle[:-1] + gaps))
    return np.stack([begin, begin + angle], axis=1)


def on_circle(edges: np.ndarray) -> np.ndarray:
    """Angles in the picture (rad, counter-clockwise from the right) of angles from the slack end on.

    The wrap is centred on the top. The pulley turns counter-clockwise: it runs onto the band at the right, the tight
    end, and off at the left.
    """
    wrap = float(np.max(edges))
    return math.pi / 2 + wrap / 2 - edges


def spot(radius: Any, angle: Any) -> Any:
    """Points (…, 2) at a radius and an angle."""
    return np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle)), axis=-1)


def draw_linings(axes: Axes, angles: np.ndarray, radii: tuple[float, float], gid: str) -> list[Wedge]:
    """A wedge for each lining between two radii, `angles` (n, 2) in the picture; coloured later."""
    wedges = []
    for begin, end in np.degrees(angles):
        wedge = Wedge((0, 0), radii[1], end, begin, width=radii[1] - radii[0], ec="white", lw=0.8, gid=gid, zorder=2)
        wedges.append(axes.add_patch(wedge))
    return wedges


def draw_band(axes: Axes, angles: np.ndarray, ends: tuple[str, str]) -> None:
    """The band with its two straight ends and what is written at them, slack end first."""
    first, last = angles[0, 0], angles[-1, 1]
    turn = np.linspace(first, last, 400)
    axes.plot(*spot(BAND, turn).T, color="0.25", lw=2.5, zorder=3)
    for angle, direction, words in ((first, 1.0, ends[0]), (last, -1.0, ends[1])):
        start = spot(BAND, angle)
        tangent: Any = direction * np.array([-math.sin(angle), math.cos(angle)])
        arrow = FancyArrowPatch(start, start + 0.5 * tangent, arrowstyle="-|>", mutation_scale=14, color="0.25", lw=2.5)
        axes.add_patch(arrow)
        axes.annotate(
            words,
            start + 0.52 * tangent,
            xytext=(0, -3),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=9,
        )


def draw_rotation(axes: Axes, omega: float, radius: float) -> None:
    """An arrow round the centre in the sense of the rotation, with the speed."""
    if omega != 0.0:
        low, high = (-50.0, 230.0)
        axes.add_patch(Arc((0, 0), 2 * radius, 2 * radius, theta1=low, theta2=high, color="k", lw=1.4))
        tip, back = (high, high - 14) if omega > 0 else (low, low + 14)
        ends = [spot(radius, math.radians(a)) for a in (back, tip)]
        axes.add_patch(FancyArrowPatch(*ends, arrowstyle="-|>", mutation_scale=12, color="k", lw=1.4, gid="rotation"))
    words = f"ω\n{omega:.3g}\nrad/s" if omega != 0.0 else "at rest"
    axes.text(0, 0, words, ha="center", va="center", fontsize=8)


def contact_legend(found: list[np.ndarray], lining: str = "lining") -> list[Patch]:
    """Patches for the contacts that occur."""
    present = set(np.unique(np.concatenate([states.ravel() for states in found])).tolist())
    return [Patch(color=CONTACT_COLOURS[c], label=f"{lining} {words}") for c, words in WORDS.items() if c in present]
