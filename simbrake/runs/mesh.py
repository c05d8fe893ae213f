"""Walls whose layers are too thick for the heating of a run: warnings, and the same
scene with finer layers."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from ..outputs.metrics import HOT, Peak
from ..outputs.scan import Scan
from ..parts.scene import Scene
from ..physics.heated import thermal_of
from ..thermal.mesh import Coarse, coarse, cuts_for, finer, heated_faces
from ..thermal.network import Wall, nodes_at, place_of

#: heat that is none, as a share of that of the run;  errors of a temperature (K) that
#: nobody minds
_NONE = 1e-9
_LITTLE = 0.1
#: intervals of a heating that are looked at, at most
_INTERVALS = 400


class Heating(NamedTuple):
    """What heats a face of a wall up to its highest temperature: times (s) and the
    friction work until them (J)."""

    wall: Wall
    face: str | None
    peak: Peak
    times: Float[np.ndarray, " k"]
    work: Float[np.ndarray, " k"]


def heatings(scene: Scene, scan: Scan, peaks: Mapping[str, Peak]) -> Iterator[Heating]:
    """Of each face of a wall that friction heats, and whose temperature a run
    reports."""
    walls = {wall.name: wall for wall in scene.network.walls}
    faces = heated_faces(scene.network) if walls else set()
    places = {
        kind: place
        for kind, place in scene.network.hot_places.items()
        if place in faces
    }
    for name, kind in HOT.items():
        if kind in places and name in peaks:
            body, face = place_of(places[kind])
            work = np.asarray(scan.columns.friction_work)[:, _pairs(scene, kind)].sum(
                axis=1
            )
            stretch = _stretch(
                np.asarray(scan.columns.t), work, float(peaks[name].time)
            )
            if stretch is not None:
                yield Heating(walls[body], face, peaks[name], *stretch)


class ThickLayers(NamedTuple):
    """A heated wall whose layers are too thick: its place, the layers that it has and
    those that would do, and the rise of its temperature (K)."""

    place: str
    found: Coarse
    rise: float


def thick_layers(
    scene: Scene, scan: Scan, peaks: Mapping[str, Peak]
) -> Iterator[ThickLayers]:
    """Heated walls with layers that are too thick for the heating up to their highest
    temperature."""
    for wall, face, peak, times, work in heatings(scene, scan, peaks):
        found = coarse(wall, face, times, work)
        if found is None:
            continue
        before = _outermost(scan, wall, face, times[0])
        rise = float(peak.value - before[min(int(peak.lining), len(before)) - 1])
        if abs(found.share) * rise > _LITTLE:
            yield ThickLayers(f"{wall.name}.{face}", found, rise)


def cuts_of(result: Any) -> dict[str, int]:
    """By the name of a wall, how often its layers are to be cut in two, so that their
    error falls to half at least.

    Once, but where the first layer of a heated wall is too thick for the time of
    heating.
    """
    scene = result.scene
    report = result.report()
    cuts = dict[str, int]()
    if result.ok:
        for wall, face, _, times, _ in heatings(scene, report.scan, report.peaks):
            cuts[wall.name] = max(
                cuts.get(wall.name, 1),
                cuts_for(wall, face, float(times[-1] - times[0])),
            )
    return cuts


def with_finer_layers(scene: Scene, cuts: Mapping[str, int]) -> Scene:
    """The scene with the layers of its walls cut in two, as often as `cuts_of` says."""
    return dataclasses.replace(scene, heat=finer(scene.network, cuts))


def _pairs(scene: Scene, kind: str) -> slice:
    """Friction pairs that heat a place: of a staged brake the first is on the band, the
    last on the rim."""
    if not scene.brake.in_series:
        return slice(None)
    return slice(0, 1) if kind in ("band", "outer") else slice(-1, None)


def _outermost(scan: Scan, wall: Wall, face: str | None, t: float) -> np.ndarray:
    """Temperatures (K) of the outermost layer of each copy of a wall in the row of a
    run that begins at `t`."""
    thermal = thermal_of(scan.record.system)  # pyright: ignore
    assert thermal is not None
    row = int(np.searchsorted(scan.steps.t0, t, side="right")) - 1
    T = np.asarray(
        thermal.temperatures(
            jax.tree.map(lambda column: column[row], scan.record.states).heat
        )
    )
    return T[thermal.spans.stores[wall.name]][nodes_at(wall, face)]


def _stretch(
    t: Float[np.ndarray, " m"], work: Float[np.ndarray, " m"], peak: float
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]] | None:
    """Times and work from where friction began to work without a pause, before a peak,
    to where it ended."""
    lasts = np.diff(t) > 0
    begins = t[:-1][lasts]
    ends = t[1:][lasts]
    gained = np.diff(work)[lasts]
    works = gained > _NONE * (work[-1] - work[0])
    before = np.flatnonzero(works & (begins <= peak))
    if not before.size:
        return None
    rests = np.flatnonzero(~works)
    first = int(np.max(rests[rests < before[-1]], initial=-1)) + 1
    last = int(np.min(rests[rests > before[-1]], initial=len(works)))
    times = np.append(begins[first], ends[first:last])
    heat = np.append(0.0, np.cumsum(gained[first:last]))
    some = np.unique(
        np.linspace(0, len(times) - 1, min(len(times), _INTERVALS + 1))
        .round()
        .astype(int)
    )
    return times[some], heat[some]
