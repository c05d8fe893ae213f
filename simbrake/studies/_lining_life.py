"""Life of the linings in stops: steps of many stops, with the worn brake simulated in
each step."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .._base._faults import Issues, input_error
from .._base._progress import Progress
from .._base._table import Column, Table, Tabular, frozen, plain
from ..parts.scene import Scene, check_scene, require_scene
from ..parts.worn import feeds_back, turned_scene
from ..parts.worn import worn_scene as worn_scene
from ..runs.edit import with_values
from ..runs.result import Result
from ..runs.simulate import simulate

#: thickness in m or with its unit, for all linings or for each
Permissible: TypeAlias = float | int | str | Sequence[float | int] | np.ndarray | None
#: stops after which the band is turned, or `"best"`
TurnAt: TypeAlias = float | int | str | Sequence[float | int] | np.ndarray | None


class LifeHistory(NamedTuple):
    """The life in steps of many stops, `m` instants; at a turn of the band one before
    and one after it.

    Linings are counted from the slack end at the start of the life, and keep their
    number when the band is turned.
    """

    brakings: np.ndarray  # (m,) done so far
    worn: np.ndarray  # (m, n) thickness worn off so far, m
    per_braking: np.ndarray  # (m, n) thickness that the next stop takes, m
    stopping_time: np.ndarray  # (m,) of the next stop, s; inf where it does not stop


@frozen
class LiningLife(Tabular):
    """Stops until the linings are worn.

    - `brakings`: until the first lining has reached its permissible wear
    - `first`: its number (from 1)
    - `each` (n,): until lining `i` would have, with the others left in place:
      longer-lasting ones continue at the rate of the last stop
    - `permissible` (n,) in m
    - `turned_at`: stops after which the band was turned end for end
    - `unturned`: the life without turning, where the best number of stops was searched
    - `history`;  `runs`: stops that were simulated
    """

    brakings: float
    first: int
    each: np.ndarray
    permissible: np.ndarray
    turned_at: tuple[float, ...]
    unturned: float | None
    history: LifeHistory
    runs: int

    @property
    def gain(self) -> float | None:
        """Life over that without turning."""
        return None if self.unturned is None else self.brakings / self.unturned

    @property
    def worn(self) -> np.ndarray:
        """Thickness (n,) worn off at the end of the life (m)."""
        return self.history.worn[-1]

    @property
    def over_mean(self) -> np.ndarray:
        """Maximum over mean wear per stop (m,), over the life."""
        return self.history.per_braking.max(axis=1) / self.history.per_braking.mean(
            axis=1
        )

    @property
    def over_least(self) -> np.ndarray:
        """Maximum over minimum wear per stop (m,), over the life."""
        with np.errstate(divide="ignore"):
            return self.history.per_braking.max(axis=1) / self.history.per_braking.min(
                axis=1
            )

    @property
    def used(self) -> float:
        """Used share of the permissible wear of all linings at the end: 1 where all end
        together."""
        return float((self.worn / self.permissible).mean())

    def as_dict(self) -> dict[str, Any]:
        """Return the data as plain values of JSON."""
        history = self.history._asdict() | {
            "over_mean": self.over_mean,
            "over_least": self.over_least,
        }
        return plain(
            vars(self) | {"gain": self.gain, "used": self.used, "history": history}
        )

    def parts(self) -> Iterator[str | Table]:
        h = self.history
        n = len(self.each)
        worn = (
            f"lining {self.first} of {n} has lost "
            f"{1e3 * self.permissible[self.first - 1]:.4g} mm"
        )
        yield f"life     {self.brakings:.0f} stops, until {worn}"
        for at in self.turned_at:
            yield f"turned   end for end after {at:.0f} stops"
        if self.gain is not None:
            yield (
                f"gain     {self.gain:.4g} times the life without turning "
                f"({self.unturned:.0f} stops)"
            )
        yield (
            f"uneven   maximum wear of one stop {self.over_mean[0]:.4g} times the mean "
            f"and {self.over_least[0]:.4g} "
            f"times the minimum initially, {self.over_mean[-1]:.4g} and "
            f"{self.over_least[-1]:.4g} times at the end"
        )
        yield f"used     {100 * self.used:.1f} % of the permissible wear of all linings"
        columns = [
            Column("lining"),
            Column("worn", "m", display_units="mm", show=lambda x: f"{1e3 * x:.4f}"),
            Column(
                "per stop", "m", display_units="µm", show=lambda x: f"{1e6 * x:.4f}"
            ),
            Column("stops left", show=lambda x: f"{x:.0f}" if np.isfinite(x) else "—"),
        ]
        left = np.maximum(self.each - self.brakings, 0.0)
        yield Table(
            columns,
            zip(range(1, n + 1), self.worn, h.per_braking[-1], left, strict=True),
        )
        if np.ptp(h.stopping_time[np.isfinite(h.stopping_time)]) > 0:
            yield (
                f"stop     after {h.stopping_time[0]:.5g} s initially, "
                f"{h.stopping_time[-1]:.5g} s at the end"
            )
        yield f"solver   {self.runs} stops simulated"


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


class _Step(NamedTuple):
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
    steps: list[_Step]
    end: _Point


class _Brake:
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

    def look(self, done: float, worn: np.ndarray, turned: bool) -> _Point:
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
        steps = list[_Step]()
        now = start
        if not np.any(now.wear > 0):
            hint = "the linings must slide with a wear rate above 0"
            raise input_error("scene", "no lining wears in it", hint)
        usual = (1.0 if self.feeds_back else np.inf) if step is None else step
        length = usual
        while now.done < until:
            ahead = _Step(now)
            length = min(length, until - now.done, float(np.min(ahead.until(limit))))
            error = 0.0
            if self.feeds_back and length > 1.0:
                following = self.look(now.done + length, ahead.worn(length), now.turned)
                ahead = _Step(now, (following.wear - now.wear) / length)
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
            now = self.look(now.done + done, worn, now.turned)
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
            now = self.look(now.done, now.worn, not now.turned)
        return paths


def _best_turn(brake: _Brake, unturned: _Path) -> float:
    """Number of stops after which a turn gives the longest life; the history up to the
    turn is known."""
    from scipy.optimize import minimize_scalar

    starts = np.asarray([step.start.done for step in unturned.steps])

    def life(turn: float) -> float:
        step = unturned.steps[int(np.searchsorted(starts, turn, side="right")) - 1]
        worn = step.worn(turn - step.start.done)
        return brake.follow(brake.look(turn, worn, True)).end.done

    end = unturned.end.done
    sharp = {"xatol": (1e-4 if brake.feeds_back else 1e-8) * end, "maxiter": 200}
    best: Any = minimize_scalar(
        lambda x: -life(x), bounds=(0.0, end), method="bounded", options=sharp
    )
    return float(best.x)


def _wearing(run: Scene | Result, permissible: Permissible) -> tuple[Scene, np.ndarray]:
    """The scene with one thickness worn per lining, and the permissible one of each."""
    scene = run.scene if isinstance(run, Result) else run
    require_scene(scene)
    if scene.wear is not None and permissible is not None:
        scene = with_values(scene, {"wear.permissible": permissible})
    wear = scene.wear
    if wear is None:
        raise input_error(
            "wear",
            "is missing",
            "give the scene a `Wear`, a file [wear] with rate = 1e-14, in m³/(N·m)",
        )
    if wear.permissible is None:
        raise input_error(
            "wear.permissible",
            "is missing",
            "give the permissible wear depth, as in 8 mm",
        )
    check_scene(scene)
    if wear.turned_at is not None:
        raise input_error("wear.turned_at", "is for one run", "give `turn_at` in stops")
    n = scene.brake.linings.count
    limit = np.broadcast_to(np.asarray(wear.permissible, np.float64), (n,))
    worn = np.broadcast_to(np.asarray(wear.worn, np.float64), (n,))
    over = np.flatnonzero(worn >= limit)
    if over.size:
        raise input_error(
            "wear.worn",
            f"lining {over[0] + 1} is worn already",
            "increase the permissible wear",
        )
    # a worn brake outside its valid range
    check_scene(with_values(scene, {"wear.worn": limit}))
    return with_values(scene, {"wear.worn": np.array(worn)}), limit


def lining_life(
    run: Scene | Result,
    permissible: Permissible = None,
    *,
    turn_at: TurnAt = None,
    step: float | int | None = None,
    tolerance: float = 1e-3,
    **options: Any,
) -> LiningLife:
    """Life of the linings: number of repetitions of a scene's stop until they are worn.

        h(m + 1) = h(m) + w(h(m)),   h_i(0) = `wear.worn`,   until h_i = `permissible`
        for some lining w(h): wear of one stop of a brake with the wear depth h

    Without feedback (`Wear.geometry`, `heat`, `take_up_speed`) `w` does not change and
    one stop is enough. With it steps of `Δ` stops are taken, each with the brake
    simulated at its present wear,

        h(m + Δ) = h + ½ [(Δ + 1) w(h) + (Δ − 1) w(h + Δ w(h))],

    which is exact for `Δ = 1` and of second order in `Δ`; its difference from
    `h + Δ w`, over the permissible wear, is limited to `tolerance` in each step.

    - `run`: a scene with `wear`, or a result of one
    - `permissible` (m, or with its unit): a number, one per lining; by
      default `wear.permissible`. On a staged brake it counts for both faces together
    - `turn_at`: stops after which the band is turned end for end (Z's practice), or
      `"best"` for the number that gives the longest life. With constant wear and equal
      linings that is half of the life, `2 h/(w_1 + w_n)` in all
    - `step`: stops in a step, instead of those by `tolerance`; 1: stop by stop
    - `options`: as for `simulate`

    Each stop begins with the initial state of the scene, temperatures included: use
    those of the cyclic steady state (`cyclic_steady_state`) for a duty that is repeated
    hot. Numbers of stops are not rounded; within the last one the wear is linear.
    Raises `InputError` where the scene cannot be worn so far, and `SimulationError`.
    """
    scene, limit = _wearing(run, permissible)
    turns = _turns(turn_at)
    best = turn_at == "best"
    if turns or best:
        turned_scene(scene)  # rejects brakes without a band that can be turned
    issues = Issues()
    issues.unless(step is None or step >= 1, "step", step, "at least 1 stop")
    issues.unless(0 < tolerance < 1, "tolerance", tolerance, "between 0 and 1")
    issues.report()
    assert scene.wear is not None
    brake = _Brake(
        scene, limit, tolerance, None if step is None else float(step), options
    )
    with brake.progress:
        first = brake.look(0.0, np.asarray(scene.wear.worn), False)
        paths = brake.life(first, turns)
        unturned = None
        if best:
            unturned = paths[0].end.done
            turns = (_best_turn(brake, paths[0]),)
            paths = brake.life(first, turns)
    points = [
        point
        for path in paths
        for point in (*(step.start for step in path.steps), path.end)
    ]
    columns = [np.asarray(column) for column in list(zip(*points, strict=True))[:4]]
    end = points[-1]
    each = end.done + _Step(end).until(limit)
    where = int(
        np.argmin(limit - end.worn - 1e-9 * limit * (end.wear / np.max(end.wear)))
    )
    done = tuple(turn for turn in turns if turn < end.done)
    return LiningLife(
        end.done,
        where + 1,
        each,
        limit,
        done,
        unturned,
        LifeHistory(*columns),
        brake.runs,
    )


def _turns(turn_at: TurnAt) -> tuple[float, ...]:
    if turn_at is None or turn_at == "best":
        return ()
    try:
        turns = tuple(float(x) for x in np.atleast_1d(np.asarray(turn_at, np.float64)))
    except (TypeError, ValueError):
        raise input_error(
            "turn_at", f"{turn_at!r} is not a number of stops", 'numbers, or "best"'
        ) from None
    if any(not b > a for a, b in zip((0.0, *turns), turns, strict=False)):
        raise input_error(
            "turn_at", f"{list(turns)} do not increase from 0", "stops since the start"
        )
    return turns
