"""Warnings of a scene that is valid but unusual, or has values in another unit than was
meant."""

import math
from collections.abc import Iterator

import numpy as np

from .._base._numbers import ZERO, number, pretty
from .._base._part import is_traced, leaves, parts_below
from .._base._quantity import meant_within
from ..brakes.band import ParallelBands
from ..brakes.design import USUAL_CIRCLE, AbstractBrake, Brake, tension_shares
from ..friction import remembers
from ..loads import GRAVITY, AbstractLoad, Cylinder
from ..thermal.heat import Heat
from ..thermal.network import Wall, place_of
from .at_start import locked, read_by_linings, sensed_at_start, static_friction
from .scene import Scene


def warnings(scene: Scene) -> list[str]:
    """Warnings of a scene that is valid but unusual."""
    if is_traced(scene):
        return []
    then = (
        "it never slips as long as that lasts"
        if scene.brake.banded
        else "a run ends as soon as its force acts"
    )
    messages = [f"self_locking: {why}; {then}" for why in locked(scene).values()]
    for i, jacket in scene.network.jackets.items():
        messages += [
            f"outside_range: heat.links[{i}]: Dittus–Boelter: {words}"
            for words in jacket.outside_range()
        ]
    brake = scene.brake
    messages += did_you_mean(
        brake, scene.duty.load, float(scene.start_speed), scene.network
    )
    messages += [*_of_other_sizes(scene)] or _of_other_ratios(brake, scene.duty.load)
    messages += _in_bar(scene)
    if not (
        isinstance(brake, Brake) and isinstance(brake.band.stiffness, ParallelBands)
    ):
        return messages
    linings_read = read_by_linings(scene)
    if not (linings_read.T or linings_read.p or remembers(brake.linings.friction)):
        return messages
    shares = np.asarray(
        tension_shares(brake, sensed_at_start(scene), scene.initial.time)
    )
    if np.ptp(shares) > 1e-9:
        text = ", ".join(f"{share:.4g}" for share in shares)
        messages.append(
            f"unequal_bands: the bands carry {text} of the tension; their heat and "
            "pressure are taken as the mean (a `MultiBandBrake` has those of each)"
        )
    return messages


_DRUMEANU = "Drumeanu & Antonescu 2003, band brakes of drawworks"


#: coefficient of friction, wrap angle (deg), rim temperature (°C): low, high
FRICTION = (0.35, 0.65)


WRAP = (270.0, 325.0)


RIM = (300.0, 800.0)


#: linings of a band; conductivities (W/(m·K)) of rims and linings
LININGS = (8.0, 26.0)


RIM_CONDUCTIVITY = (38.0, 163.0)


LINING_CONDUCTIVITY = (0.4, 1.5)


def _unusual(
    what: str, low: float, high: float, usual: tuple[float, float], words: str
) -> list[str]:
    """Warning of values from `low` to `high` outside the usual range; `words` describe
    that range."""
    # the angles of equal linings add up to a wrap with rounding
    slack = 1e-9 * usual[1]
    within = usual[0] - slack <= low and high <= usual[1] + slack
    span = f"{usual[0]:g}…{usual[1]:g}"
    return [] if within else [f"unusual: {what}, {words.format(span)}"]


def plausibility(scene: Scene, peak_rim: float | None = None) -> list[str]:
    """Warnings of parameters that are unusual for drawworks brakes: usual range,
    source, reason.

    - static coefficient of friction 0.35…0.65, wrap 270…325°, rim at most 800 °C:
      Drumeanu & Antonescu (2003); Z has cases down to 0.1, and a single stop stays far
      below 300 °C, so that there is no warning for a cool rim
    - 8…26 linings: Z;  conductivity of rim 38…163 and linings 0.4…1.5 W/(m·K): V,
      tables 1 and 2, and textbooks
    - `peak_rim`: highest rim temperature (K) of a run of it, if there was one
    """
    if is_traced(scene):
        return []
    messages = list[str]()
    brake = scene.brake
    heat = scene.network
    if brake.banded:  # the sources are about band brakes
        f = static_friction(scene)
        values = (
            f"{f.min():.4g}" if np.ptp(f) < 1e-12 else f"{f.min():.4g}…{f.max():.4g}"
        )
        why = "tensions depend on it exponentially (Z computes cases down to 0.1)"
        what = f"static coefficient of friction {values}"
        messages += _unusual(
            what, f.min(), f.max(), FRICTION, f"usual are {{}} ({_DRUMEANU}); {why}"
        )
        for linings in brake.bands_of_linings:
            wrap = math.degrees(float(np.sum(np.asarray(linings.weights))))
            n = linings.count
            why = "the grip of the band depends on it exponentially"
            messages += _unusual(
                f"wrap {wrap:.5g}°",
                wrap,
                wrap,
                WRAP,
                f"usual are {{}}° ({_DRUMEANU}); {why}",
            )
            if not getattr(linings, "continuous", False):
                messages += _unusual(f"{n} linings", n, n, LININGS, "usual are {} (Z)")
    if peak_rim is not None:
        T = peak_rim - ZERO
        why = "properties of steel and linings are not known that hot"
        words = f"usual in heavy service are {{}} °C ({_DRUMEANU}); {why}"
        # a single stop leaves it cooler
        messages += _unusual(f"rim at {T:.0f} °C", max(T, RIM[0]), T, RIM, words)
    walls = {wall.name: wall for wall in heat.walls}
    for name, place, usual in (
        ("rim", heat.rim, RIM_CONDUCTIVITY),
        ("linings", heat.linings, LINING_CONDUCTIVITY),
    ):
        wall = walls.get(place_of(place)[0]) if place else None
        if wall is not None:
            value = float(wall.material.conductivity)
            words = "usual are {} (V, tables 1 and 2); is the unit right?"
            messages += _unusual(
                f"{name} with {value:.4g} W/(m·K)", value, value, usual, words
            )
    return messages


#: inertia (kg·m²) of a drawworks' drum, whose hook never carries less than the mass
#: (kg): the block alone is heavier
_DRUM = 100.0


_BLOCK = 1000.0


#: track speeds (m/s) of brakes stay below; temperatures (K) of brakes and air lie above
_FAST = 60.0


_COLD = 200.0


#: gauge pressure (Pa) that moves no brake
_BREATH = 1000.0


#: flow of a coolant (m³/s) above those of drawworks
_RIVER = 0.5


#: least and most lengths (m) and areas (m²) of drawworks by the last names of their
#: paths, wide
_OF_DRAWWORKS = {
    **dict.fromkeys(
        ("radius", "band_radius", "drum_radius", "inner_radius", "outer_radius", "pin"),
        (0.1, 3.0),
    ),
    **dict.fromkeys(
        ("lining_radius", "mass_radius", "slack_end", "tight_end"), (0.1, 3.0)
    ),
    **dict.fromkeys(("width", "arm"), (0.03, 6.0)),
    **dict.fromkeys(("thickness", "clearance", "permissible", "worn"), (1e-4, 0.3)),
    **dict.fromkeys(("slack_arm", "diameter"), (0.005, 1.5)),
    **dict.fromkeys(
        ("band_area", "anchor_area", "lining_area", "slack_area", "tight_area"),
        (1e-5, 0.05),
    ),
    **dict.fromkeys(("linings.area", "bandage.area"), (1e-3, 0.5)),
    "area": (1e-4, 50.0),
}


#: radius (m) above those of drawworks' rims, whose diameters are 0.9…1.6 m
_LARGEST_RIM = 0.85


#: a drum has so many track radii at most, and the same part of one at least; that of a
#: drawworks is inside its rims
_DRUM_OVER_TRACK = 5.0


def did_you_mean(
    brake: AbstractBrake, load: AbstractLoad, omega: float, heat: Heat
) -> Iterator[str]:
    """Warnings of values that are most likely in another unit (concrete values
    only)."""
    for name in ("mass", "empty", "string"):
        mass = float(np.max(getattr(load, name, 0.0)))
        if 0 < mass < _BLOCK and float(brake.inertia) >= _DRUM:
            about = f"on the hook of a drum with {float(brake.inertia):g} kg·m²"
            yield _said(f"duty.load.{name}", f"{mass:g} kg", about, f'"{mass:g} t"')
    lines = float(np.max(getattr(load, "line_count", 1.0)))
    if lines != round(lines):
        yield _said(
            "duty.load.line_count",
            f"{lines:g}",
            "not a whole number of lines",
            f"{lines:.0f}",
        )
    gravity = float(np.max(getattr(load, "gravity", GRAVITY)))
    if gravity > 2 * GRAVITY:
        path = "duty.load.gravity"
        about = "more than on the Earth"
        yield _said(path, f"{gravity:g} m/s²", about, f'"{gravity:g} ft/s^2"')
    speed = abs(omega) * float(brake.track_radius)
    if speed > _FAST and float(brake.track_radius) <= _OF_DRAWWORKS["radius"][1]:
        turned = f'"{omega:g} rpm" ({omega * math.pi / 30:.4g} rad/s)'
        yield _said(
            "initial.omega",
            f"{omega:g} rad/s",
            f"{number(speed, 'm/s', count=3)} at the track",
            turned,
        )
    if brake.rims > 1 and isinstance(brake, Brake):
        yield from _one_rim(brake, heat)
    for i, jacket in heat.jackets.items():
        flow = float(jacket.largest_flow)
        if flow > _RIVER:
            about = "more than any pump of a rig gives"
            yield _said(
                f"heat.links[{i}].flow", f"{flow:g} m³/s", about, f'"{flow:g} l/min"'
            )
    for i, body in enumerate(heat.bodies):
        T = getattr(body, "temperature", None)
        if isinstance(T, np.ndarray) and np.any(T < _COLD):
            least = float(np.min(T))
            cold = f"{least - ZERO:g} °C"
            yield _said(
                f"heat.bodies[{i}].temperature",
                f"{least:g} K",
                cold,
                f'"{least:g} degC"',
            )


def _of_other_sizes(scene: Scene) -> Iterator[str]:
    """Warnings of lengths and areas beyond those of any drawworks, most likely in
    another unit."""
    for leaf in leaves(scene):
        if leaf.about.unit not in ("m", "m^2") or not np.size(leaf.value):
            continue
        *_, part, name = ["", *leaf.path.split(".")]
        least, most = _OF_DRAWWORKS.get(f"{part}.{name}") or _OF_DRAWWORKS.get(
            name, (0.0, math.inf)
        )
        value = float(np.max(np.asarray(leaf.value)))
        if value > most:
            meant = meant_within(value, least, most, leaf.about.unit)
            yield _said(
                leaf.path,
                f"{value:g} {pretty(leaf.about.unit)}",
                "beyond any drawworks",
                meant,
            )


def _of_other_ratios(brake: AbstractBrake, load: AbstractLoad) -> Iterator[str]:
    """Warnings of a track under a tackle that no drawworks has, and of a band circle
    and a drum that do not fit the track."""
    track = float(brake.track_radius)
    if brake.banded and track > _LARGEST_RIM and (load.lines or 1) > 1:
        yield _said(
            "brake.pulley.radius",
            f"{track:g} m",
            "beyond the rims of any drawworks",
            f"{track / 2:g} m, half of a diameter",
        )
    about = f"beside a track of {track:g} m"
    circle = float(brake.radius)
    drum = float(getattr(load, "drum_radius", track))
    if brake.banded and circle > USUAL_CIRCLE * track:
        name = "band.radius" if isinstance(brake, Brake) else "band_radius"
        yield _said(f"brake.{name}", f"{circle:g} m", about, "")
    most = 1.0 if brake.banded else _DRUM_OVER_TRACK
    if not 1 / _DRUM_OVER_TRACK <= drum / track <= most:
        halved = 1 < drum / track <= 2
        meant = (
            f"{drum / 2:g} m, half of a diameter"
            if halved
            else meant_within(drum, track / _DRUM_OVER_TRACK, track)
        )
        yield _said("duty.load.drum_radius", f"{drum:g} m", about, meant)


def _in_bar(scene: Scene) -> Iterator[str]:
    """Warnings of gauge pressures of cylinders that were most likely meant in bar or
    psi."""
    lever = f"duty.{scene.duty.lever_field}"
    for path, cylinder, _ in parts_below(scene.duty.lever, lever):
        if isinstance(cylinder, Cylinder):
            given = cylinder.pressure.scale()
            permissible = cylinder.permissible_pressure
            pressures = {
                "pressure": given,
                "permissible_pressure": 0.0 if permissible is None else permissible,
            }
            for name, most in ((name, float(most)) for name, most in pressures.items()):
                if 0 < most < _BREATH:
                    about = "less than a breath gives"
                    yield _said(
                        f"{path}.{name}",
                        f"{most:g} Pa",
                        about,
                        f'"{most:g} bar" or "{most:g} psi"',
                    )


def _one_rim(brake: Brake, heat: Heat) -> Iterator[str]:
    """Warnings of walls of the heat part that have the area of one of several rims."""
    area = (brake.bandage or brake.linings).area
    width = brake.pulley.width
    of_rim = {
        heat.rim: None
        if width is None
        else 2 * math.pi * float(brake.pulley.radius) * float(width),
        heat.linings: None
        if area is None
        else float(np.sum(np.broadcast_to(area, (brake.linings.count,)))),
    }
    areas = {
        place_of(place)[0]: area
        for place, area in of_rim.items()
        if place and area is not None
    }
    for i, body in enumerate(heat.bodies):
        own = areas.get(body.name)
        if (
            isinstance(body, Wall)
            and own
            and abs(float(body.area) * body.copies - own) <= 1e-2 * own
        ):
            about = f"that of one of the {brake.rims} rims, which the heat part has together"
            meant = f'"{brake.rims * float(body.area):.5g} m^2"'
            yield (
                f"rims: heat.bodies[{i}].area = {float(body.area):.5g} m², {about}: "
                f"did you mean {meant}?"
            )


def _said(path: str, value: str, about: str, meant: str) -> str:
    question = f"did you mean {meant}" if meant else "is the unit right"
    return f"unit: {path} = {value}, {about}: {question}?"
