"""Steps of many stops of a brake that wears."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import input_error
from .._base._progress import Progress
from ..parts.scene import Scene
from ..parts.worn import feeds_back
from ..runs.edit import with_values
from ..runs.simulate import simulate
from ._turned import turned_scene

# factors of a step of stops from one to the next
_LEAST = 0.2
_MOST = 5.0
_SAFETY = 0.9


class _Point(NamedTuple):
    """The brake after `done` stops: wear depth, wear of the next stop, stopping
    time."""

    done: float
    worn: np.ndarray
    wear: np.ndarray
    stop: float
    turned: bool


class StepOfStops(NamedTuple):
    """`h(Δ) = h + Δ w + ½ Δ (Δ − 1) s` over `Δ` stops from `start`; `s` (n,): change of
    `w` per stop."""

    start: _Point
    slope: np.ndarray | float = 0.0

    def worn(self, brakings: float) -> np.ndarray:
        return (
            self.start.worn
            + brakings * self.start.wear
            + 0.5 * brakings * max(brakings - 1, 0.0) * self.slope
        )

    def until(self, limit: np.ndarray) -> np.ndarray:
        """Stops after which each lining reaches its limit, `inf` if it does not."""
        room = np.maximum(limit - self.start.worn, 0.0)
        w = self.start.wear
        s = self.slope
        b = w - 0.5 * s
        inside = b * b + 2 * s * room
        with np.errstate(divide="ignore", invalid="ignore"):
            many = np.where(
                inside >= 0, 2 * room / (b + np.sqrt(np.maximum(inside, 0.0))), np.inf
            )
            linear = room / w
        stops = np.where(linear <= 1, linear, many)
        return np.where((w > 0) & (stops >= 0), stops, np.inf)


class _Path(NamedTuple):
    steps: list[StepOfStops]
    end: _Point


class WornBrake:
    """The stop of a scene with given wear, as built or with the band turned; and steps
    of stops.

    `tolerance`, `step`: of the stops taken at once, as in `lining_life`
    """

    def __init__(
        self,
        scene: Scene,
        limit: np.ndarray,
        tolerance: float,
        step: float | None,
        options: dict[str, Any],
    ) -> None:
        self.scenes = {False: scene}
        self.limit = limit
        self.tolerance = tolerance
        self.step = step
        self.options = options
        self.feeds_back = feeds_back(scene)
        self.runs = 0
        self._known: dict[bool, tuple[np.ndarray, float]] = {}
        self.progress = Progress("stops", "compiling…")

    def after(self, done: float, worn: np.ndarray, turned: bool) -> _Point:
        if turned not in self._known or self.feeds_back:
            if turned not in self.scenes:
                self.scenes[turned] = turned_scene(self.scenes[False])
            along = slice(None, None, -1 if turned else 1)
            result = simulate(
                with_values(self.scenes[turned], {"wear.worn": worn[along]}),
                **self.options,
            )
            self.runs += 1
            self._known[turned] = (
                np.asarray(result.worn_thickness)[along],
                float(result.stopping_time),
            )
        return _Point(done, worn, *self._known[turned], turned)

    def follow(self, start: _Point, until: float = np.inf) -> _Path:
        """Stops from `start` on until a lining is at its limit, or `until` stops are
        done."""
        limit = self.limit
        step = self.step
        steps = list[StepOfStops]()
        now = start
        if not np.any(now.wear > 0):
            hint = "the linings must slide with a wear rate above 0"
            raise input_error("scene", "no lining wears in it", hint)
        usual = (1.0 if self.feeds_back else np.inf) if step is None else step
        length = usual
        while now.done < until:
            ahead = StepOfStops(now)
            length = min(length, until - now.done, float(np.min(ahead.until(limit))))
            error = 0.0
            if self.feeds_back and length > 1.0:
                following = self.after(
                    now.done + length, ahead.worn(length), now.turned
                )
                ahead = StepOfStops(now, (following.wear - now.wear) / length)
                error = float(
                    np.max(np.abs(ahead.worn(length) - following.worn) / limit)
                )
            # factor by which the next step may be longer
            more = _MOST
            if error > 0:
                more = min(_MOST, _SAFETY * float(np.sqrt(self.tolerance / error)))
            if step is None and error > self.tolerance:
                length *= max(_LEAST, more)
                continue
            reached = float(np.min(ahead.until(limit)))
            done = min(length, reached)
            worn = ahead.worn(done)
            steps.append(ahead)
            now = self.after(now.done + done, worn, now.turned)
            self.progress.now(
                f"{now.done:.0f} done, {1e3 * float(np.max(worn)):.3g} mm worn"
            )
            if reached <= length or np.min(limit - worn) <= 1e-12 * np.max(limit):
                break
            length = done * more if step is None and self.feeds_back else usual
        return _Path(steps, now)

    def life(self, first: _Point, turns: Sequence[float]) -> list[_Path]:
        """Paths from turn to turn; the last one ends with a worn lining."""
        paths = list[_Path]()
        now = first
        for until in [*turns, np.inf]:
            if now.done < until:
                paths.append(self.follow(now, until))
                now = paths[-1].end
            if now.done < until:
                break
            now = self.after(now.done, now.worn, not now.turned)
        return paths


def best_turn(brake: WornBrake, unturned: _Path) -> float:
    """Number of stops after which a turn gives the longest life; the history up to the
    turn is known."""
    from scipy.optimize import minimize_scalar

    starts = np.asarray([step.start.done for step in unturned.steps])

    def life(turn: float) -> float:
        step = unturned.steps[int(np.searchsorted(starts, turn, side="right")) - 1]
        worn = step.worn(turn - step.start.done)
        return brake.follow(brake.after(turn, worn, True)).end.done

    end = unturned.end.done
    sharp = {"xatol": (1e-4 if brake.feeds_back else 1e-8) * end, "maxiter": 200}
    best: Any = minimize_scalar(
        lambda x: -life(x), bounds=(0.0, end), method="bounded", options=sharp
    )
    return float(best.x)
