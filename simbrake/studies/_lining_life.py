"""Life of the linings in stops: steps of many stops, with the worn brake simulated in
each step."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .._base._faults import Issues, input_error
from .._base._table import Column, Table, Tabular, frozen, plain
from ..parts.scene import Scene, require_scene
from ..parts.scene_checks import check_scene
from ..parts.worn import worn_scene as worn_scene
from ..runs.edit import with_values
from ..runs.result import Result
from ._turned import turned_scene
from ._worn_stops import StepOfStops, WornBrake, best_turn

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
            f"and {self.over_least[0]:.4g} times the minimum initially, "
            f"{self.over_mean[-1]:.4g} and {self.over_least[-1]:.4g} times at the end"
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
    limit = np.broadcast_to(wear.permissible, (n,))
    worn = np.broadcast_to(wear.worn, (n,))
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
    brake = WornBrake(
        scene, limit, tolerance, None if step is None else float(step), options
    )
    with brake.progress:
        first = brake.after(0.0, scene.wear.worn, False)
        paths = brake.life(first, turns)
        unturned = None
        if best:
            unturned = paths[0].end.done
            turns = (best_turn(brake, paths[0]),)
            paths = brake.life(first, turns)
    points = [
        point
        for path in paths
        for point in (*(step.start for step in path.steps), path.end)
    ]
    columns = [np.asarray(column) for column in list(zip(*points, strict=True))[:4]]
    end = points[-1]
    each = end.done + StepOfStops(end).until(limit)
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
