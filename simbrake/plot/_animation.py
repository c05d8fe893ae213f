"""An animation of one brake application: `pulley`, moment by moment."""

import os
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from .._base._faults import Issues, whole_file
from .._base._progress import counting
from ..parts.scene import banded_brake
from ..runs.result import Result, look
from .drawing import STYLE, ink, one_run, part_to_play
from .wheels import draw_moment, spot, tops_of

_FRAMES = 500  # at most: all of them are in the memory at once


def animate(
    result: Result,
    path: str | os.PathLike[str],
    *,
    duration: float | int = 6.0,
    fps: float | int = 20.0,
    start: float | int | None = None,
    end: float | int | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
) -> Path:
    """Write `pulley` over time as an animation (`.gif`), with a mark that turns with
    the pulley; returns its path.

    A page with a film, which is slower at a short onset of slip:
    `simbrake animate SCENE film.html`.

    - `duration` (s) of the animation and `fps`, its frames a second
    - `start`, `end` (s) in the run: default from its start until shortly after the
      first stop
    - `progress`: a function of the frames done and all of them; `False`: no line on a
      terminal

    Raises `InputError` for another suffix, times outside the run, and a duration or
    rate out of range.

    Example:
        >>> sb.plot.animate(result, folder / "stop.gif", duration=0.2, progress=False).name
        'stop.gif'
    """
    bands = len(banded_brake(one_run(result).scene).bands_of_linings)
    file = Path(path)
    issues = Issues()
    low, high = part_to_play(result, start, end, issues)
    frames = duration * fps
    if file.suffix.lower() != ".gif":
        issues.add("path", f"{file.name!r} is no animation", "let it end in .gif")
    if not 0.0 < fps <= 50.0:
        what = f"{fps:g} frames a second cannot be shown"
        issues.add("fps", what, "more than 0, up to 50")
    if not 0.0 < frames <= _FRAMES:
        issues.add("duration", f"makes {frames:.0f} frames", f"1 to {_FRAMES}")
    issues.report()
    times = np.linspace(low, high, max(2, round(frames)))
    tops = tops_of(look(result, times))

    def draw(t: float) -> None:
        figure.clear()
        figure.subplots_adjust(0.0, 0.13, 1.0, 0.9)  # as in all frames
        p = look(result, t)
        with matplotlib.rc_context(STYLE):
            draw_moment(figure, result, t, p, tops)
        for axes in figure.axes:
            axes.plot(
                *spot(0.97, p.y.phi + np.pi / 2).T,
                marker="o",
                ms=6,
                color=ink(),
                gid="mark",
            )

    figure = Figure(figsize=(8.0 * bands, 9.0), dpi=80)
    film = FuncAnimation(
        figure, draw, times, init_func=lambda: None, cache_frame_data=False
    )
    with (
        counting(times.size, progress, "frames", after=2.0) as report,
        whole_file(file) as scratch,
    ):
        film.save(
            scratch,
            PillowWriter(fps),  # pyright: ignore
            progress_callback=lambda i, _: report(i + 1),  # pyright: ignore
        )
    return file
