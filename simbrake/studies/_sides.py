"""Derivatives of runs against differences on both sides: where they are one-sided, and
where there is none.

At a tie (two equal values of a table, a number at its bound, two events at one instant)
the derivative of a run is that of the branch that it takes, which is one side's; at a
jump it says nothing. Structure does not tell where; some more runs do. First all
numbers `p` are changed at once in a direction `δ` without meaning,

    E(h) = M(p + h δ) − M(p) − h M'(p) δ,   k = 4 E(h/2) − E(h)

so that curvature cancels in `k`: it is 0 where the metric `M` has a derivative, and
that is `M'`. Only where it is not the numbers are halved, down to single ones, and
their differences are taken on either side. Numbers at a bound are looked at one by one,
unless they are many.
"""

import enum
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._base._faults import InputError
from .._base._part import Leaf
from .._base._progress import Progress
from .._base._quantity import Characteristic, IndexedBy
from ..runs.edit import with_values
from ..runs.result import Result
from .bounds import Paths, numbers_of
from .evaluating import PointEvaluator, values_of

#: largest change of a number, in steps `h = √rtol` of its size
_REACH = 10.0
#: share of the step that a mismatch must exceed, and how many tolerances of the run:
#: its rounding and that of its steps
_SHARE = 3e-3
_NOISE = 30.0
#: numbers at a bound up to which each is looked at by itself, as a small corner hides
#: among other numbers
_SINGLY = 16
#: relative difference below which two derivatives agree
_AGREE = 2e-3
#: ratio of the difference quotients of a step and of its quarter from which on they
#: diverge (of a root 2, of a jump 4)
_DIVERGES = 1.6


class SideKind(enum.Enum):
    """What differences on one side give: a derivative; none, as they diverge, the
    metric has no value there, or the numbers there are out of range."""

    GIVEN = enum.auto()
    DIVERGES = enum.auto()
    LOST = enum.auto()
    REFUSED = enum.auto()


class Side(NamedTuple):
    """A one-sided derivative by differences, and its error."""

    kind: SideKind
    value: float = np.nan
    error: float = 0.0


class Slope(NamedTuple):
    """The derivative to report, and the note on it."""

    value: float
    note: str


#: derivatives that are not those of both sides, by the number of the metric, the path,
#: and the index of an entry (`None`: a list as a whole)
Slopes = dict[tuple[int, str, tuple[int, ...] | None], Slope]


def typical_size(leaf: Leaf, machine: Characteristic) -> np.ndarray:
    """Magnitude of every entry, of a 0 that of its list, or its typical size in the
    machine within its bound."""
    values = np.abs(np.asarray(leaf.value, np.float64))
    most = np.max(values, initial=0.0) or min(
        leaf.about.high or np.inf, float(leaf.about.size(machine))
    )
    return np.where(values > 0, values, most)


def _tied(leaf: Leaf) -> np.ndarray:
    """Entries of a table or profile that are equal to a neighbour: points at one place
    cannot pass each other."""
    values = np.ravel(np.asarray(leaf.value, np.float64))
    if values.size < 2 or leaf.about.many is not IndexedBy.ROWS:
        return np.zeros(values.size, bool)
    equal = np.diff(values) == 0
    return np.append(equal, False) | np.append(False, equal)


class _Search:
    """Runs near a scene, and what they say of the derivatives of its metrics.

    - `values` (m,), `jacobian` (m, k): of the metrics at the scene
    """

    def __init__(
        self,
        run: PointEvaluator,
        base: Result,
        chosen: Sequence[Leaf],
        values: np.ndarray,
        jacobian: np.ndarray,
    ) -> None:
        self.run = run
        self.base = base
        self.known = values
        self.jacobian = jacobian
        self.paths = Paths.of(chosen)
        self.x = numbers_of(chosen)
        machine = base.record.system.machine  # pyright: ignore
        sizes = [np.ravel(typical_size(leaf, machine)) for leaf in chosen]
        self.size = np.concatenate(sizes)
        self.step = np.sqrt(run.rtol)
        self.refused = set[str]()
        effects = np.max(np.abs(jacobian) * self.size, axis=1, initial=0.0)
        scale = np.maximum(np.abs(values), effects)
        self.scale = np.where(scale > 0, scale, 1.0)
        self.noise = _NOISE * run.rtol * self.scale
        # all numbers move the metrics alike, as far as their sizes allow: none hides
        # another one
        with np.errstate(divide="ignore"):
            even = np.min(self.scale[:, None] / np.abs(jacobian), axis=0)
        self.move = self.step * np.minimum(even, _REACH * self.size)
        # (k, 2): whether each number may become smaller, and larger
        ways = [
            leaf.about.admits(self.x[span] + side * self.move[span])
            for leaf, span in zip(chosen, self.paths.spans, strict=True)
            for side in (-1, 1)
        ]
        self.ways = np.stack([np.hstack(ways[::2]), np.hstack(ways[1::2])], axis=1)

    def values(self, change: np.ndarray) -> np.ndarray | None:
        """Metrics (m,) of the run with changed numbers, NaN if it fails; `None` if its
        input is refused."""
        moves = self.paths.values(change)
        numbers = self.paths.values(self.x + change)
        numbers = {path: x for path, x in numbers.items() if np.any(moves[path])}
        try:
            result = self.run.result(with_values(self.base.scene, numbers), throw=False)
        except InputError as error:
            self.refused = {fault.path for fault in error.faults}
            return None
        return (
            values_of(result, self.run.find)
            if result.ok
            else np.full(len(self.known), np.nan)
        )

    def suspects(self, entries: np.ndarray) -> list[int]:
        """Single numbers in whose direction a metric may have another derivative than
        that of the run."""
        if entries.size <= 1:
            return entries.tolist()
        doubt = self._doubtful(entries)
        # those that cannot be changed together with others are looked at by themselves
        if doubt is None:
            aside = [
                i
                for i in entries
                if any(
                    _belongs(self.paths.entries[i][0], path) for path in self.refused
                )
            ]
            if 0 < len(aside) < entries.size:
                return [*aside, *self.suspects(np.setdiff1d(entries, aside))]
        if doubt is False:
            return []
        half = entries.size // 2
        return [*self.suspects(entries[:half]), *self.suspects(entries[half:])]

    def _doubtful(self, entries: np.ndarray) -> bool | None:
        """Whether `k` is not 0 in a direction of these numbers, or the opposite one;
        `None`: the input is refused."""
        rng = np.random.default_rng(entries.size)
        limit = _SHARE * self.step * self.scale + self.noise
        signs = rng.choice([-1.0, 1.0], self.x.size)
        far = np.zeros(self.x.size)
        far[entries] = rng.uniform(0.5, 1.0, entries.size) * self.move[entries]
        below, above = self.ways.T
        for turn in (1.0, -1.0):
            change = far * np.where(
                below & above, turn * signs, np.where(above, 1.0, -1.0)
            )
            left = 0.0
            for share in (1.0, 0.5):
                values = self.values(share * change)
                if values is None:
                    return None
                if not np.all(np.isfinite(values)):
                    return True
                linear = self.known + self.jacobian @ (share * change)
                left = values - linear - left / 4
                if np.all(np.abs(left) <= share**2 * limit):
                    break
            else:
                return True
        return False

    def side(self, change: np.ndarray, by: float) -> list[Side]:
        """One-sided derivatives of every metric along a change of the numbers, per `by`
        (signed)."""
        far = self.values(change)
        near = self.values(change / 4)
        if far is None or near is None:
            return [Side(SideKind.REFUSED)] * len(self.known)
        sides = []
        for base, noise, a, b in zip(self.known, self.noise, far, near, strict=True):
            if not np.isfinite(a + b):
                sides.append(Side(SideKind.LOST))
                continue
            a = (a - base) / by
            b = 4 * (b - base) / by
            noise = 0.4 * noise / abs(by)
            if abs(b) > _DIVERGES * abs(a) + noise and abs(b - a) > 5 * noise:
                sides.append(Side(SideKind.DIVERGES))
            else:
                sides.append(
                    Side(SideKind.GIVEN, (4 * b - a) / 3, abs(b - a) / 3 + noise)
                )
        return sides


def _belongs(path: str, fault: str) -> bool:
    return (
        path == fault
        or path.startswith((f"{fault}.", f"{fault}["))
        or fault.startswith((f"{path}.", f"{path}["))
    )


def judged(slope: float, below: Side, above: Side) -> Slope | None:
    """The derivative to report instead, or `None` to keep that of the run."""

    def agree(a: float, b: float, error: float) -> bool:
        return bool(abs(a - b) <= max(_AGREE * max(abs(a), abs(b)), error))

    sides = {"below": below, "above": above}
    at = {
        kind: [name for name, side in sides.items() if side.kind is kind]
        for kind in SideKind
    }
    if at[SideKind.DIVERGES]:
        where = " and ".join(at[SideKind.DIVERGES])
        return Slope(
            np.nan,
            f"none: differences diverge {where} (a jump, or an event that is only just reached)",
        )
    usable = [sides[name] for name in at[SideKind.GIVEN]]
    if not usable:
        return (
            Slope(np.nan, "none: no value on either side")
            if at[SideKind.LOST]
            else None
        )
    words = ", ".join(
        [*(f"{sides[name].value:.6g} {name}" for name in at[SideKind.GIVEN])]
    )
    words += "".join(f", no value {name}" for name in at[SideKind.LOST])
    fits = any(agree(slope, side.value, side.error) for side in usable)
    if len(usable) == 2 and agree(below.value, above.value, below.error + above.error):
        mean = 0.5 * (below.value + above.value)
        return (
            None
            if fits
            else Slope(
                mean, f"by differences: {words} (the run itself gives {slope:.6g})"
            )
        )
    if fits:
        return None if at[SideKind.REFUSED] else Slope(slope, f"one-sided: {words}")
    return Slope(usable[-1].value, f"one-sided, by differences: {words}")


def compare_sides(
    run: PointEvaluator,
    base: Result,
    chosen: Sequence[Leaf],
    values: np.ndarray,
    jacobian: np.ndarray,
    progress: Progress,
) -> Slopes:
    """Derivatives that are not those of both sides.

    - `values` (m,), `jacobian` (m, k): the metrics of `base`, and their derivatives by
      all entries of `chosen`
    """
    progress.now("differences on both sides")
    search = _Search(run, base, chosen, values, jacobian)
    slopes = Slopes()
    entries = search.paths.entries
    # most corners are of numbers at a bound, or 0: with these apart, one look is enough
    # for the others
    at_bound = ~search.ways.all(axis=1)
    tied = np.concatenate([_tied(leaf) for leaf in chosen])
    if np.sum(at_bound) <= _SINGLY:
        tied |= at_bound
    apart = at_bound | (search.x == 0)
    suspects = sorted(
        [
            *np.flatnonzero(tied).tolist(),
            *search.suspects(np.flatnonzero(~tied & apart)),
            *search.suspects(np.flatnonzero(~tied & ~apart)),
        ]
    )
    changes = {}
    for i in suspects:
        reach = min(search.move[i], search.step * search.size[i])
        changes[entries[i]] = np.eye(tied.size)[i] * reach
    for path, span in zip(search.paths.names, search.paths.spans, strict=True):
        if any(name == path and index for name, index in changes):
            reach = np.minimum(search.move[span], search.step * search.size[span])
            changes[path, None] = np.zeros(tied.size)
            changes[path, None][span] = np.min(reach)
    for (path, index), change in changes.items():
        by = float(np.max(change))
        both = search.side(-change, -by), search.side(change, by)
        for k, (below, above) in enumerate(zip(*both, strict=True)):
            slope = judged(float(jacobian[k] @ change) / by, below, above)
            if slope is not None:
                slopes[k, path, index] = slope
    return slopes
