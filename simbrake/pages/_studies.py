"""What studies write into a folder: tables, JSON and figures, all or nothing."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .. import plot
from .._base._faults import Issues, whole_folder
from ..results.stored import Source
from ..studies._fitted import Calibration
from ..studies._lining_life import LiningLife
from ..studies._overview import Overview
from ..studies._sensitivity_table import Sensitivity, SensitivityTable
from ._page import write_json


def write_sensitivities(tables: Sequence[SensitivityTable], folder: Path) -> list[Path]:
    """Write `sensitivity.json`, and of each metric its rows as CSV and its tornado
    chart."""
    with whole_folder(folder) as (scratch, written):
        write_json(scratch / "sensitivity.json", [table.as_dict() for table in tables])
        for table in tables:
            name = table.metric.replace(".", "_")
            with (scratch / f"sensitivity_{name}.csv").open(
                "w", encoding="utf-8", newline=""
            ) as file:
                writer = csv.writer(file)
                writer.writerow(Sensitivity._fields)
                writer.writerows(table.rows)
            plot.tornado(table).figure.savefig(scratch / f"tornado_{name}.png", dpi=130)  # pyright: ignore
    return written


def write_runs(found: Overview, folder: Path) -> list[Path]:
    """Write all runs as `runs.csv` and `runs.nc` (netCDF), and `sweep.png`, a figure of
    the metrics, where one can be drawn."""
    heads = [
        column.name if column.unit in ("", "1") else f"{column.name} [{column.unit}]"
        for column in found.table.columns
    ]
    # there is none of three parameters or more, and where nothing varies
    chart = Issues().attempt(plot.sweep, found.data)
    with whole_folder(folder) as (scratch, written):
        frame = found.table.frame()
        frame.to_csv(scratch / "runs.csv", header=heads, **_CSV, float_format="%.15g")
        found.data.to_netcdf(scratch / "runs.nc", engine="scipy")
        if chart is not None:
            chart.savefig(scratch / "sweep.png", dpi=130)
    return written


_CSV: dict[str, Any] = {"index": False, "lineterminator": "\n"}


def write_calibration(fit: Calibration, folder: Path) -> list[Path]:
    """Write a fit as `calibration.json` and `.txt`, every measured value as
    `residuals.csv`, and the chart `calibration.png`."""
    heads = ["name", "unit", "t [s]", "measured", "sigma", "before", "fitted"]
    rows = []
    for part in fit.residuals:
        t = np.nan if part.t is None else part.t
        values = (part.measured, part.sigma, part.before, part.model, part.scaled)
        rows += [(part.name, part.unit, *row) for row in np.broadcast(t, *values)]
    table = pd.DataFrame(rows, columns=[*heads, "residual over sigma"])
    with whole_folder(folder) as (scratch, written):
        write_json(scratch / "calibration.json", fit.as_dict())
        (scratch / "calibration.txt").write_text(f"{fit}\n", "utf-8")
        table.to_csv(scratch / "residuals.csv", **_CSV, float_format="%.12g")
        plot.calibration(fit).savefig(scratch / "calibration.png", dpi=130)
    return written


def write_life(life: LiningLife, folder: Path) -> list[Path]:
    """Write the life of linings as `life.json` and its figure `wear.png`."""
    with whole_folder(folder) as (scratch, written):
        write_json(scratch / "life.json", life.as_dict())
        plot.wear(life).savefig(scratch / "wear.png", dpi=130)
    return written


def write_comparison(
    data: dict[str, Any], results: Mapping[str, Source], folder: Path
) -> list[Path]:
    """Write the differences between results as `compare.json`, and the results over
    each other as `compare.png`."""
    with whole_folder(folder) as (scratch, written):
        write_json(scratch / "compare.json", data)
        plot.compare(results).savefig(scratch / "compare.png", dpi=130)
    return written
