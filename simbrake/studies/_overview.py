"""Many runs in one text: how they ended, the range of every metric, and its limits."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .._base._faults import InputError
from .._base._numbers import digits, number, reading
from .._base._table import Column, Table, Tabular
from ..outputs.judgement import REASONS
from ..outputs.metrics import HOLDING, is_least
from ..parts.scene import Scene
from ..results.stored import Dataset
from ..runs.measure import as_metrics, read_limits, unit_of
from .limits import LimitsOfManyRuns, kept

#: minimum, median and maximum
_RANGE = (0.0, 0.5, 1.0)
#: where a load breaks away without a jump its reserve is 1 but for this
_ROUNDING = 1e-9
#: what a verdict of many runs leaves out
_UNJUDGED = "; of parts without a limit, and of small margins, they say nothing"


class Overview(Tabular):
    """What the runs of `simbrake.sweep` or `simbrake.ensemble` say together: print it,
    or take `as_dict()` (SI).

    - `data`: the data set, with the colour of each run: red also where a limit is
      exceeded. What did not happen exceeds its limit
    - `table`: a row per run
    - `limits`: how many runs exceed each limit, of how many that have a value or should
      have one, and the names of limits that were not looked at; `None` without limits

    Example:
        >>> data = sb.sweep(scene, {"duty.load.mass": [18e3, 22e3]}, ["stopping_time"], progress=False)
        >>> found = sb.studies.overview(scene, data, ["stopping_time"], {"stopping_time": 1.3})
        >>> found.limits["checked"][0]["exceeded"]
        1
    """

    def __init__(
        self, data: Dataset, metrics: Sequence[str], limited: LimitsOfManyRuns
    ) -> None:
        self.data = data.assign(colour=_colours(data, limited))
        self.metrics = tuple(metrics)
        self._limited = limited

    @cached_property
    def table(self) -> Table:
        """A row per run: varied parameters, metrics, and status."""
        data = self.data
        rows = data.to_dataframe().reset_index()
        names = [str(name) for name in (*data.coords, *data.data_vars) if name != "run"]
        columns = [Column(name, data[name].attrs.get("units", "")) for name in names]
        return Table(columns, rows[names].itertuples(index=False, name=None))

    @cached_property
    def limits(self) -> dict[str, Any] | None:
        done = self.data["code"].values == 0
        checked = []

        def check(name: str, limit: float, exceeded: np.ndarray) -> None:
            counts = {"exceeded": int(exceeded.sum()), "of": exceeded.size}
            checked.append({"name": name, "limit": limit, **counts})

        for name, bound in self._limited.limits.items():
            # what did not happen, as a stop that never came, exceeds its limit
            check(name, bound, ~kept(self.data, name, bound).values[done])
        if HOLDING in self.metrics and HOLDING not in self._limited.limits:
            # a reserve is of runs in which something holds; all others exceed a limit
            # with what never happened
            reserves = self.data[HOLDING].values[done]
            reserves = reserves[np.isfinite(reserves)]
            check(HOLDING, 1.0, reserves <= 1 + _ROUNDING)
        aside = self._limited.aside
        if not checked and not set(aside) - {HOLDING}:
            return None
        return {"checked": checked, "runs": int(done.sum()), "not_checked": [*aside]}

    def as_dict(self) -> dict[str, object]:
        """Every run with its numbers (`None`: did not happen), units and counts."""
        paths = [str(name) for name in self.data.coords if name != "run"]
        names = dict.fromkeys([*self.metrics, "energy.closure"])
        energies = [name for name in names if name.startswith("energy.")]
        others = [name for name in self.metrics if name not in energies]
        solver = ("method", "steps", "rejected", "retaken", "segments")
        rows = [
            {
                "run": i,
                "values": {path: row[path] for path in paths},
                "status": row["status"],
                "reason": row["reason"],
                "colour": row["colour"],
                "code": row["code"],
                "metrics": {name: row[name] for name in others},
                "energy": {
                    name.removeprefix("energy."): row[name] for name in energies
                },
                "solver": {name: row[name] for name in solver},
            }
            for i, row in enumerate(self.table.as_list())
        ]
        named = (*paths, *self.metrics)
        columns = self.table.columns
        return {
            "units": {each.name: each.unit for each in columns if each.name in named},
            "counts": self._counts("status"),
            "reasons": self._counts("reason"),
            "runs": rows,
            "limits": self.limits,
        }

    def _counts(self, column: str) -> dict[str, int]:
        return dict(sorted(Counter(self.table[column]).items()))

    def parts(self) -> Iterator[str | Table]:
        ended = [
            f"{n} {x.replace('_', ' ')}" for x, n in self._counts("status").items()
        ]
        words = {reason.id: reason.words for reason in REASONS}
        rows = [row for row in self.table.as_list() if row["reason"]]
        judged = Counter((row["colour"], row["reason"]) for row in rows)
        verdicts = "; ".join(
            f"{n} {colour} {id} ({words[id]})"
            for (colour, id), n in sorted(judged.items())
        )
        yield f"{len(self.table)} runs: {', '.join(ended)}"
        yield f"verdicts {verdicts or 'none'}{_UNJUDGED}"
        yield self._ranges()
        yield from self._limits_in_words()

    def _ranges(self) -> Table:
        """The range of every metric, in the unit that suits its largest value."""
        rows = []
        for name in self.metrics:
            values = self.data[name].values
            values = values[np.isfinite(values)]
            most = float(np.abs(values).max(initial=0.0))
            shown = reading(self.data[name].attrs.get("units", ""), most)
            texts = [None, "—", None]
            if values.size:
                texts = [digits(x, 5) for x in shown(np.quantile(values, _RANGE))]
            rows.append((name, *texts, shown.name, values.size))
        three = [Column(title) for title in ("minimum", "median", "maximum")]
        return Table(["metric", *three, "unit", Column("of how many runs")], rows)

    def _limits_in_words(self) -> list[str]:
        if self.limits is None:
            return []
        texts = []
        for check in self.limits["checked"]:
            name = check["name"]
            side = "below" if is_least(name) else "above"
            bound = f"{side} {number(check['limit'], unit_of(name))}"
            if name == HOLDING and HOLDING not in self._limited.limits:
                bound = "of 1 or less"
            without = self.limits["runs"] - check["of"]
            has = "has" if without == 1 else "have"
            rest = f" that have it ({without} {has} none)" if without else ""
            of = f"{check['exceeded']} of {check['of']} runs{rest}"
            texts.append(f"{name} {bound} in {of}")
        if self.limits["not_checked"]:
            texts.append(
                f"not among --metrics: {', '.join(self.limits['not_checked'])}"
            )
        return [f"limits   {'; '.join(texts)}"]


def overview(
    scene: Scene,
    data: Dataset,
    metrics: str | Sequence[str],
    limits: Mapping[str, int | float | str] | None = None,
) -> Overview:
    """An `Overview` of the runs of a scene.

    - `data`: of `simbrake.sweep` or `simbrake.ensemble`; `metrics`: names in it
    - `limits`: metric → permissible value (SI, or with its unit as "3 s"), the greatest,
      or the least of a metric that begins with `min_`, besides those that the parts of
      the scene have

    Raises `InputError` for limits of unknown metrics or in other units.

    Example:
        >>> data = sb.sweep(scene, {"duty.load.mass": [18e3, 22e3]}, ["stopping_time"], progress=False)
        >>> print(str(sb.studies.overview(scene, data, ["stopping_time"])).splitlines()[0])
        2 runs: 2 stopped
    """
    bounds, faults = read_limits(scene, limits or {})
    if faults:
        raise InputError(faults)
    names: Any = as_metrics(metrics)
    return Overview(data, names, LimitsOfManyRuns.of(scene, bounds, names))


def _colours(data: Dataset, limited: LimitsOfManyRuns) -> Any:
    """Colours of the reasons, red where a limit is exceeded.

    The least holding reserve of a run is in its reason only as far as its end shows it.
    """
    colours = data["colour"]
    failed = data["code"] != 0
    if HOLDING in data:
        colours = colours.where(failed | ~(data[HOLDING] <= 1), "red")
    for name, bound in limited.limits.items():
        colours = colours.where(failed | kept(data, name, bound), "red")
    meaning = "colour of the reason, red where a limit that was checked is exceeded"
    return colours.assign_attrs(meaning=meaning)
