"""Files of a run: chart, series and summary, written all or not at all."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import whole_folder
from .._base._progress import Waiting, waiting
from .._run._measure import LimitCheck, limit_checks, summary_with_limits, text_with_limits
from .._run._result import Result
from .._run._series import flat, unit_of_column
from ..results._dataset import save
from ..studies._sensitivity import Sensitivity, SensitivityTable
from ._page import pictures_of


def series_table(result: Result, count: int = 1001) -> tuple[list[str], np.ndarray]:
    """Column names with units, and the series on an even grid with the values before and after every event."""
    record = result.record
    start, end = float(np.asarray(record.rows.t)[0]), float(np.asarray(record.rows.t)[int(record.count)])
    times = np.unique([e.time for e in result.events])
    grid = np.setdiff1d(np.linspace(start, end, count), times)
    series = [result.series(np.append(grid, times)), result.series(times, left=True)] if times.size else []
    if not series:
        series = [result.series(grid)]
    names: list[str] = []
    columns: list[np.ndarray] = []
    tables = [flat(s, pairs=result.tells_pairs_apart) for s in series]
    for field in tables[0]:
        values = np.concatenate([np.asarray(one[field]) for one in tables])
        unit = f" [{unit_of_column(field)}]" if unit_of_column(field) else ""
        if values.ndim == 1:
            names.append(field + unit)
            columns.append(values)
        else:
            each = ["_".join(str(i + 1) for i in place) for place in np.ndindex(values.shape[1:])]
            labels = result.nodes if field == "temperature" else each
            names += [f"{field}_{label}{unit}" for label in labels]
            columns += list(values.reshape(len(values), -1).T)
    table = np.stack(columns, axis=1)
    # in order of time, at an event the left value first
    before = np.append(np.ones(len(grid) + len(times)), np.zeros(len(times))) if times.size else np.ones(len(grid))
    return names, table[np.lexsort((before, table[:, 0]))]


def write(
    result: Result, folder: Path, progress: Any = False, checks: Sequence[LimitCheck] | None = None
) -> list[Path]:
    """Writes `summary.json`, `summary.txt`, `series.csv`, `result.nc`, and every picture that the run has as PNG.

    - `progress`: says on stderr what is done, `True`, or `None` on a terminal only
    - `checks`: limits that the summaries tell, by default those of the scene
    """
    with waiting(progress, "run", "series") as told:
        return _write(result, folder, told, limit_checks(result, {}) if checks is None else checks)


def _write(result: Result, folder: Path, told: Waiting, checks: Sequence[LimitCheck]) -> list[Path]:
    summary = summary_with_limits(result, checks)
    names, table = series_table(result)
    with whole_folder(folder) as (scratch, written):
        (scratch / "summary.json").write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", "utf-8")
        (scratch / "summary.txt").write_text(text_with_limits(result, checks) + "\n", "utf-8")
        file, head = scratch / "series.csv", ",".join(names)
        np.savetxt(file, table, fmt="%.12g", delimiter=",", header=head, comments="", encoding="utf-8")
        told.now("labelled data")
        save(result, scratch / "result.nc")
        pictures = list(pictures_of(result))
        for i, picture in enumerate(pictures):
            told.now("pictures", i, len(pictures))
            picture.figure(result).savefig(scratch / f"{picture.key}.png", dpi=130)
    return written


def write_published(folder: Path) -> list[Path]:
    """Writes the figures of the papers that a formula gives, and pictures of their tables, as PNG."""
    from ..plot._published import PUBLISHED, file_stem, published

    with whole_folder(folder) as (scratch, written):
        for name in PUBLISHED:
            published(name).savefig(scratch / f"{file_stem(name)}.png", dpi=130)
    return written


def write_sensitivities(tables: Sequence[SensitivityTable], folder: Path) -> list[Path]:
    """Writes `sensitivity.json`, and of each metric its rows as CSV and its tornado chart."""
    from .. import plot

    with whole_folder(folder) as (scratch, written):
        found = [table.as_dict() for table in tables]
        (scratch / "sensitivity.json").write_text(json.dumps(found, indent=2, allow_nan=False) + "\n", "utf-8")
        for table in tables:
            name = table.metric.replace(".", "_")
            with (scratch / f"sensitivity_{name}.csv").open("w", encoding="utf-8", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(Sensitivity._fields)
                writer.writerows(["" if cell is None else cell for cell in row] for row in table.rows)
            plot.tornado(table).savefig(scratch / f"tornado_{name}.png", dpi=130)
    return written
