"""Given functions of time from CSV files: what a load cell or a lever sensor recorded."""

from pathlib import Path
from typing import Annotated

import numpy as np

from .._base._faults import InputError
from .._base._quantity import Quantity, takes_values
from ..profiles import PiecewiseLinear
from ..studies._measured import CsvFile


@takes_values
def history(
    file: Path, column: str, unit: str = "SI", time: str = "t", begin: Annotated[float, Quantity("s", "shift")] = 0.0
) -> PiecewiseLinear:
    """A profile of straight lines between the rows of a CSV file; every row is a known time, at which a step ends.

    - `column`, `time`: names of the columns; units stand in the header as `slack_tension [kN]`, `t [ms]`, SI without
    - `unit`: SI unit of the column;  `begin` (s) is added to the times

    Two rows at one time are a jump. Rows with an empty cell are left out. Raises `InputError` with every fault of the
    file: line, column, value and what to do.
    """
    table = CsvFile(Path(file))
    names = {head.name: i for i, head in enumerate(table.heads)}
    if table.heads:
        for name in (time, column):
            if name not in names:
                table.fault(" header", f"has no column {name}", f"there are: {', '.join(names)}")
    if table.faults:
        raise InputError(table.faults)
    t, values = table.column(names[time], "s", needed=True), table.column(names[column], unit)
    there = np.isfinite(t) & np.isfinite(values)
    if not table.faults and not there.any():
        table.fault(f" column {column}", "has no value")
    if not table.faults and np.any(np.diff(t[there]) < 0):
        first = int(np.flatnonzero(np.diff(t[there]) < 0)[0])
        line = [line for (line, _), kept in zip(table.rows, there, strict=True) if kept][first + 1]
        table.fault(f" line {line}, column {time}", "is earlier than the line before", "sort the rows by time")
    if table.faults:
        raise InputError(table.faults)
    return PiecewiseLinear(t[there] + begin, values[there])
