"""An animation of one brake application: the pulley turns, linings stick, slide and heat."""

import io
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Wedge
from matplotlib.ticker import MaxNLocator
from PIL import Image
from scipy.integrate import cumulative_trapezoid

from .._base._arguments import explained
from .._base._faults import Fault, InputError, whole_file
from .._base._progress import counting
from .._base._quantity import as_number
from .._outputs._quantities import Series, fault_of_times
from .._parts._scene import band_brake
from .._run._linings import lining_contacts
from .._run._result import Result, look
from ._pulley import (
    CONTACT_COLOURS,
    LINING,
    colour_linings,
    contact_legend,
    draw_band,
    draw_linings,
    draw_wheel,
    lining_edges,
    on_circle,
    spot,
)
from ._shared import BLUE, SKY, STYLE, ZERO, Times, dense_grid, one_run, span, windows

SHARE = 0.45  # share of the animation for a short onset of slip
_Time = TypeVar("_Time", float, np.ndarray)  # s, one or many


class Film(NamedTuple):
    """Times of run and animation at the beginning, at the end of the slow part, if any, and at the end."""

    run: tuple[float, ...]  # s
    film: tuple[float, ...]  # s

    @property
    def slow(self) -> bool:
        """Whether the beginning is slower."""
        return len(self.run) == 3

    def run_time(self, film: _Time) -> _Time:
        """Time of the run at a time of the animation."""
        return np.interp(film, self.film, self.run)  # pyright: ignore

    def film_time(self, run: _Time) -> _Time:
        """Time of the animation at a time of the run."""
        return np.interp(run, self.run, self.film)  # pyright: ignore

    def rate(self, film: float) -> float:
        """Seconds of animation for one second of the run."""
        i = min(int(np.searchsorted(self.film, film, side="right")), len(self.film) - 1)
        return (self.film[i] - self.film[i - 1]) / (self.run[i] - self.run[i - 1])


def film_of(result: Result, duration: float, start: float | int | None, end: float | int | None) -> Film:
    """The first brake application, from the start until shortly after the first stop, or the requested part."""
    first, last = span(result)
    finish = windows(result)[0].end
    stop = next((e.time for e in result.events if e.name == "stop" and e.time > first), None)
    if stop is not None:
        finish = min(finish, first + 1.15 * (stop - first))
    low = first if start is None else float(as_number(start))
    high = (finish if finish > low else last) if end is None else float(as_number(end))
    checks = [fault_of_times(np.asarray([t]), first, last, name) for name, t in (("start", low), ("end", high))]
    faults = [fault for fault in checks if fault]
    low, high = max(low, first), min(high, last)
    if not faults and not low < high:
        faults.append(Fault("end", f"{high:g} s is not after the start at {low:g} s", "it must be later"))
    if faults:
        raise InputError(faults)
    slip = next((e.time for e in result.events if e.name == "full_slip" and low < e.time < high), high)
    slow = low + 1.3 * (slip - low)
    if slow - low > 0.25 * (high - low):
        return Film((low, high), (0.0, duration))
    return Film((low, slow, high), (0.0, SHARE * duration, duration))


def words_of_rate(rate: float) -> str:
    """Speed of an animation, in words."""
    if rate >= 1.05:
        return f"slow motion: {_round(rate)} times slower than the brake"
    if rate > 0.95:
        return "as fast as the brake"
    return f"{_round(1 / rate)} times faster than the brake"


def _round(x: float) -> str:
    digits = max(0, 1 - math.floor(math.log10(x)))
    return f"{x:.{digits}f}"


def ticks(film: Film) -> list[tuple[float, str]]:
    """Times of the run for the ticks of a time axis that runs as the animation does, with labels."""
    places: list[tuple[float, str]] = []
    for i, (low, high) in enumerate(zip(film.run, film.run[1:], strict=False)):
        milliseconds = film.slow and i == 0 and high - low < 0.5
        factor, unit = (1e3, "ms") if milliseconds else (1.0, "s")
        for value in MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(factor * low, factor * high):
            t = float(f"{value:g}") / factor  # as its label says: not beyond the end by rounding
            room = (film.film_time(high) - film.film_time(t)) / film.film[-1]
            near = i > 0 and (film.film_time(t) - film.film[i]) / film.film[-1] < 0.04
            if low <= t <= high and not near and (room > 0.02 or i == len(film.run) - 2):
                places.append((t, f"{value:g} {unit}"))
    return places


# --- the animation ----------------------------------------------------------------------------------------------------

_SPOKES = 3
_FRAMES = 2000  # more would fill the memory


@explained
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
    """Write an animation of one brake application as `.gif`; returns its path.

    The pulley turns by the true angle, with a mark; linings are coloured by stick and slip and, with
    heat, by the temperature of their surface; below, speed and tensions with a cursor. Where the onset of slip is short
    against the braking, the animation is slower there: each frame shows the factor, and the time axis
    is scaled accordingly. A page with the film, to be played, stepped and hovered: `simbrake animate SCENE film.html`.

    - `duration` (s) of the animation and `fps`, its frames a second
    - `start`, `end` (s) in the run: default from its start until shortly after the first stop
    - `progress`: `None` shows the remaining time on a terminal if it takes longer than two seconds, `False` never; a
      function is called with the number of frames done and all of them

    Raises `InputError` for another suffix, times outside the run, and a duration or rate out of range.

    Example:
        >>> sb.plot.animate(result, folder / "stop.gif", duration=0.2, progress=False).name
        'stop.gif'
    """
    file = Path(path)
    seconds, rate = _numbers(file, duration, fps)
    band_brake(result.scene)
    film = film_of(one_run(result), seconds, start, end)
    count = max(2, round(seconds * rate))
    frames: list[Image.Image] = []
    with counting(count, progress, "frames", after=2.0) as report:
        for image in _frames(result, film, np.linspace(0.0, seconds, count)):
            frames.append(image)
            report(len(frames))
    with whole_file(file) as scratch:
        scratch.write_bytes(_gif(frames, rate))
    return file


def _numbers(file: Path, duration: float | int, fps: float | int) -> tuple[float, float]:
    faults = []
    if file.suffix.lower() != ".gif":
        hint = "let it end in .gif; `simbrake animate SCENE film.html` writes a page"
        faults.append(Fault("path", f"{file.name!r} is not an animation", hint))
    seconds, rate = float(as_number(duration)), float(as_number(fps))
    if not 0.0 < seconds < math.inf:
        faults.append(Fault("duration", f"{seconds:g} s is out of range", "it must be positive"))
    if not 0.0 < rate <= 50.0:
        faults.append(Fault("fps", f"{rate:g} frames a second cannot be shown", "more than 0, up to 50"))
    if not faults and seconds * rate > _FRAMES:
        faults.append(Fault("duration", f"makes {seconds * rate:.0f} frames", f"up to {_FRAMES} are made"))
    if faults:
        raise InputError(faults)
    return seconds, rate


# --- the frames ------------------------------------------------------------------------------------------------------


class Scenery:
    """The figure of the animation and its moving parts; `show` sets one moment."""

    def __init__(self, result: Result, film: Film, times: Times):
        self.film, self.times = film, times
        self.p = look(result, film.run_time(times))
        self.contacts = lining_contacts(result, self.p)
        #: surface temperatures (°C), where the scene names them
        self.heat = {name: np.asarray(T) - ZERO for name, T in self.p.surfaces.items() if name in ("linings", "rim")}
        self.load = result.scene.duty.load
        # too few frames would show the pulley turning backwards: then spokes, and finally the mark, are omitted
        self.turn = np.abs(np.gradient(np.asarray(self.p.y.phi)))
        self.figure = Figure(figsize=(8.4, 9.4), dpi=80, layout="constrained")
        FigureCanvasAgg(self.figure)
        wheel, speed, tension = self.figure.subplots(3, 1, height_ratios=[5.2, 1, 1])
        #: everything that `show` changes, in the order in which it is drawn
        self.moving: list[Artist] = []
        self._wheel(wheel, result)
        series = dense_grid(result, film.run[0], film.run[-1])
        self._bandage(wheel, series)
        speed.plot(series.t, series.omega, color="k", label=r"pulley $\omega$")
        if series.bandage_speed is not None:
            speed.plot(series.t, series.bandage_speed, color=BLUE, ls="--", label=r"bandage $\omega_b$")
            speed.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)
        tension.plot(series.t, series.tight_tension / 1e3, color=BLUE, label="tight end $T_n$")
        tension.plot(series.t, series.slack_tension / 1e3, color=SKY, label="slack end $T_0$")
        tension.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)
        speed.set_ylabel("speed,\nrad/s")
        tension.set_ylabel("tension,\nkN")
        self.cursors = [self._strip(panel) for panel in (speed, tension)]
        speed.tick_params(labelbottom=False)
        if film.slow:
            place = {"transform": speed.transAxes, "ha": "center", "va": "center"}
            speed.text(0.5 * SHARE, 0.4, "slow motion", color="0.4", **place)
        self.title = self.figure.suptitle(" \n \n ", ha="left", x=0.03, family="monospace")
        self.moving += [*self.cursors, self.title]

    def _bandage(self, wheel: Axes, series: Series) -> None:
        """Marks of bandage and pulley, and the legend."""
        handles, title = contact_legend(self.contacts), None
        self.ride: Line2D | None = None  # mark of the bandage
        self.ridden = np.zeros(0)  # its angle since the beginning of the animation
        if series.bandage_speed is not None:
            turned = cumulative_trapezoid(series.bandage_speed, series.t, initial=0.0)
            self.ridden = np.interp(self.film.run_time(self.times), series.t, turned)
            title = "outer half of a lining: band on lining; inner half: lining on rim"
            mark = {"marker": "D", "color": "w", "mec": "k", "ls": "none", "ms": 6}
            handles.append(Line2D([], [], label="mark on the bandage", **mark))
            (self.ride,) = wheel.plot([], [], zorder=5, **mark)
            self.moving.append(self.ride)
        handles.append(Line2D([], [], marker="o", ls="none", color="k", label="mark on the pulley"))
        place = {"loc": "outside lower center", "ncols": 3, "frameon": False}
        self.figure.legend(handles=handles, title=title, **place)

    def _strip(self, axes: Axes) -> Line2D:
        film = self.film
        axes.set_xscale("function", functions=(film.film_time, film.run_time))
        axes.set_xlim(film.run[0], film.run[-1])
        places = ticks(film)
        axes.set_xticks([t for t, _ in places], [words for _, words in places])
        axes.set_xticks([], minor=True)
        axes.tick_params(axis="y")
        axes.grid(alpha=0.3)
        if film.slow:
            axes.axvspan(film.run[0], film.run[1], color="0.9", lw=0, zorder=0)
        return axes.axvline(film.run[0], color="k", lw=1.2)

    def _wheel(self, axes: Axes, result: Result) -> None:
        angles = on_circle(lining_edges(band_brake(result.scene)))
        self.wedges = draw_wheel(axes, angles, self.contacts)
        self.rim = axes.add_patch(Wedge((0, 0), 0.93, 0, 360, width=0.09, color="0.8"))
        axes.add_patch(Circle((0, 0), 0.12, color="0.6"))
        self.spokes = [axes.plot([], [], color="0.6", lw=5, solid_capstyle="butt")[0] for _ in range(_SPOKES)]
        (self.mark,) = axes.plot([], [], marker="o", ms=11, color="k", ls="none")
        draw_band(axes, angles, ("slack end\n(lever)", "tight end\n(anchor)"))
        self.hot: list[Wedge] = []
        if self.heat:
            low, high = (f([f(T) for T in self.heat.values()]) for f in (np.min, np.max))
            self.norm = Normalize(low, high if high > low else low + 1.0)
            self.colours = ScalarMappable(self.norm, "inferno")
            if "linings" in self.heat:
                self.hot = draw_linings(axes, angles, (1.25, 1.38), "temperature")
            rings = ["outer ring: linings"] * bool(self.hot) + ["inner ring: rim"] * ("rim" in self.heat)
            bar = self.figure.colorbar(self.colours, ax=axes, shrink=0.7, pad=0.0)
            bar.set_label(f"surface temperature, °C\n({', '.join(rings)})")
        axes.set(aspect="equal", xlim=(-1.5, 1.5), ylim=(-1.6, 1.45))
        axes.axis("off")
        linings = [wedge for wedges in self.wedges.values() for wedge in wedges]
        self.moving += [self.rim, *self.spokes, self.mark, *linings, *self.hot]

    def show(self, i: int) -> None:
        film, t = self.times[i], float(self.film.run_time(self.times[i]))
        phi, omega = float(self.p.y.phi[i]), float(self.p.y.omega[i])
        colour_linings(self.wedges, self.contacts, i)
        if self.hot:
            for wedge, T in zip(self.hot, np.broadcast_to(self.heat["linings"][i], (len(self.hot),)), strict=True):
                wedge.set_facecolor(self.colours.to_rgba(T))  # pyright: ignore
        if "rim" in self.heat:
            self.rim.set_color(self.colours.to_rgba(self.heat["rim"][i].max()))  # pyright: ignore
        for k, spoke in enumerate(self.spokes):
            angle = phi + math.pi / 2 + 2 * math.pi * k / _SPOKES
            spoke.set_data(*spot(np.array([0.1, 0.85]), angle).T)
            spoke.set_alpha(1.0 if self.turn[i] < 0.9 * math.pi / _SPOKES else 0.0)
        self.mark.set_data(*spot(np.array([0.7]), phi + math.pi / 2).T)
        visible = self.turn[i] < 0.9 * math.pi
        self.mark.set_alpha(1.0 if visible else 0.0)
        if self.ride is not None:
            self.ride.set_data(*spot(np.array([np.mean(LINING)]), self.ridden[i] + math.pi / 2).T)
        for cursor in self.cursors:
            cursor.set_xdata([t, t])
        slow = self.film.slow and film < self.film.film[1] and self.film.run[1] - self.film.run[0] < 0.5
        clock = f"{1e3 * t:9.3f} ms" if slow else f"{t:9.4f} s "
        words = words_of_rate(self.film.rate(film)) + ("" if visible else "; too fast to show")
        hook = self.load.travelled(phi)
        travel = "" if hook is None else f"   hook travel {float(hook):7.4f} m"
        now = self.p.flows.contact
        slack, tight = (float(x[i]) / 1e3 for x in (now.slack_tension, now.tight_tension))
        self.title.set_text(
            f"t = {clock}   {words}\nω = {omega:7.3f} rad/s   φ = {phi / (2 * math.pi):7.4f} turns{travel}\n"
            f"T₀ = {slack:7.2f} kN   Tₙ = {tight:7.2f} kN   brake torque {now.brake_torque[i] / 1e3:7.2f} kN·m"
        )


def _frames(result: Result, film: Film, times: Times) -> Iterator[Image.Image]:
    with matplotlib.rc_context(STYLE):
        stage = Scenery(result, film, times)
    canvas: Any = stage.figure.canvas
    canvas.draw()
    stage.figure.set_layout_engine("none")  # laid out once, so that nothing moves between frames
    for artist in stage.moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(stage.figure.bbox)  # the static background is drawn once
    palette = None
    for i in range(len(times)):
        stage.show(i)
        canvas.restore_region(still)
        for artist in stage.moving:
            stage.figure.draw_artist(artist)
        image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
        if palette is None:
            palette = _palette(stage, image)
        yield image.quantize(palette=palette, dither=Image.Dither.NONE)


def _palette(stage: Scenery, image: Image.Image) -> Image.Image:
    """One palette for all frames: what the first one has, colours of contacts and temperatures."""
    used = [to_rgb(colour) for colour in CONTACT_COLOURS.values()]
    if stage.heat:
        used += [stage.colours.to_rgba(T)[:3] for T in np.linspace(stage.norm.vmin, stage.norm.vmax, 64)]  # pyright: ignore
    fixed = (255 * np.asarray(used)).astype(np.uint8).reshape(-1, 3)
    rest = image.quantize(256 - len(fixed)).getpalette() or []
    table = Image.new("P", (1, 1))
    table.putpalette([*fixed.ravel().tolist(), *rest[: 3 * (256 - len(fixed))]])
    return table


# --- files ------------------------------------------------------------------------------------------------------------


def _gif(frames: list[Image.Image], fps: float) -> bytes:
    out = io.BytesIO()
    step = max(20, 10 * round(100 / fps))  # a GIF counts in hundredths of a second
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=step, loop=0, optimize=False)
    return out.getvalue()
