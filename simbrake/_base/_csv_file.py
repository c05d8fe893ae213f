"""A CSV file of named columns with units: what is read, in SI, and every error with its
place."""

from collections import Counter
from collections.abc import Collection, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._faults import Fault, InputError, Issues
from ._nulls import EMPTY, NULLS, take_nulls, told_as_null
from ._text_table import HEAD, Rows, cells_of, opened
from ._units import Unit, spelled
from ._units import unit as unit_of_text

#: errors of values listed in full; a broken logger makes thousands
_LISTED = 50
#: columns and bytes of a file
_MOST_COLUMNS = 10_000
_MOST_BYTES = 1 << 28


class Head(NamedTuple):
    """One column of a file: its header, the name in it and the unit in brackets."""

    text: str
    name: str
    unit: str


class CsvFile:
    """One CSV file while it is read: its columns and errors.

    - `words`: names of the columns that hold words
    - `places` (n,): lines of its rows
    - `values`: numbers (n,) of each column as they are written, `texts` the words
    - `notes`: what was assumed
    """

    def __init__(
        self, path: Path, null: Sequence[float] = NULLS, words: Collection[str] = ()
    ) -> None:
        self.path = path
        self._words = words
        self.notes: list[str] = []
        self.heads: list[Head] = []
        self.places = np.empty(0, np.int64)
        self._null = tuple(null)
        self._listed = Issues()
        self._left_out = 0
        try:
            with opened(path, "*.csv", most=_MOST_BYTES) as file:
                self._lines = [line for piece in file.lines() for line in piece]
            self.notes += file.remarks
            self._split()
        except InputError as error:
            self._listed += error.faults

    @property
    def faults(self) -> list[Fault]:
        """The first errors, and how many more there are."""
        rest = Fault(str(self.path), f"{self._left_out} more errors", "fix these first")
        return [*self._listed, rest] if self._left_out else self._listed

    def fault(self, where: str, problem: str, hint: str = "") -> None:
        if len(self._listed) < _LISTED:
            self._listed.add(f"{self.path}{where}", problem, hint)
        else:
            self._left_out += 1

    def _split(self) -> None:
        lines = ["" if line.lstrip().startswith("#") else line for line in self._lines]
        first = next((i for i, line in enumerate(lines) if line.strip()), len(lines))
        if not any(map(str.strip, lines[first + 1 :])):
            self.fault(
                "",
                "has no header with values below it",
                "the first line names the columns",
            )
            return
        self._separator = max(",;\t", key=lines[first].count)
        heads = [_head(cell) for cell in cells_of(lines[first], self._separator)]
        if len(heads) > _MOST_COLUMNS:
            self.fault(
                " header", f"has {len(heads)} columns", f"at most {_MOST_COLUMNS}"
            )
            return
        words = [i for i, head in enumerate(heads) if head.name in self._words]
        rows = Rows(
            self.path,
            len(heads),
            self._separator,
            words,
            decimal="." if self._separator == "," else ",",
        )
        rows.add(lines[first + 1 :], first + 2)
        self.places, self.values = rows.finish()
        self.texts = rows.texts
        self._odd = rows.odd
        self.heads = heads
        for line, count in rows.ragged:
            what = f"has {count} cells under {len(heads)} columns"
            self.fault(
                f" line {line}", what, "leave cells empty that were not measured"
            )
        for name in sorted(
            name
            for name, count in Counter(head.name for head in heads).items()
            if count > 1
        ):
            self.fault(" header", f"names {name} twice", "one column each")

    def column(
        self,
        i: int,
        si: str,
        *,
        needed: np.ndarray | bool = False,
        spread_of: int | None = None,
    ) -> np.ndarray:
        """A column in SI, NaN where a cell is empty or faulty; a standard deviation
        takes the unit of its column.

        `needed`: where an empty cell is an error, at each time (`True`) or beside some
        measured values (n,).
        """
        head = self.heads[i]
        text = head.unit or self.heads[i if spread_of is None else spread_of].unit
        of = self.unit(f" header, column {head.text}", text, si)
        self.written(i, needed, spread_of is not None)
        return self.in_si(i, np.arange(self.places.size), of, si, spread_of is not None)

    def _cell(self, k: Any, i: int) -> tuple[str, str]:
        """A cell as it is written, and its place."""
        line = self.places[k]
        text = cells_of(self._lines[line - 1], self._separator)[i].strip()
        return text, f" line {line}, column {self.heads[i].text}"

    def written(
        self, i: int, needed: np.ndarray | bool = False, spread: bool = False
    ) -> np.ndarray:
        """Numbers of a column, NaN for null values, which is told; times that reach
        below one are none."""
        x = self.values[i]
        empty = np.isnan(x)
        for null in take_nulls(x, self._null, times=needed is True):
            self.notes += (
                [] if needed is True else [told_as_null(null, [self.heads[i].text])]
            )
        missing = np.isnan(x) & needed
        for k in np.flatnonzero(missing | (empty & (i in self._odd))):
            cell, where = self._cell(k, i)
            if empty[k] and cell not in EMPTY:
                hint = "numbers as in 12.5 or 1.25e1; an empty cell: not measured"
                self.fault(where, f"{cell!r} is not a number", hint)
            elif missing[k]:
                hint = (
                    "give its standard deviation"
                    if spread
                    else "every line needs its time"
                )
                self.fault(
                    where,
                    f"{cell} is a null value"
                    if cell
                    else "is empty beside a measured value",
                    hint,
                )
        return x

    def unit(self, where: str, text: str, si: str) -> Unit:
        try:
            return unit_of_text(text, si)
        except ValueError as error:
            self.fault(
                where,
                f"{text!r} is not a unit of a quantity in {si or '1'}",
                str(error),
            )
            return Unit(1.0)

    def in_si(
        self, i: int, rows: np.ndarray, of: Unit, si: str, spread: bool
    ) -> np.ndarray:
        """Cells of a column in SI, standard deviations if `spread`, NaN where they are
        empty or faulty."""
        written = self.values[i][rows]
        ratio = Fraction(of.factor)  # 350 ms is 0.35 s: a quotient is rounded once
        with np.errstate(over="ignore"):
            values = written * float(ratio.numerator) / float(ratio.denominator) + (
                0.0 if spread else float(of.offset)
            )
        wrong = np.isinf(values) | (
            (written <= 0) if spread else (values < 0) & (si == "K")
        )
        for k in np.flatnonzero(wrong):
            text, where = self._cell(rows[k], i)
            if np.isinf(values[k]):
                self.fault(
                    where,
                    f"{text!r} is not finite",
                    "leave the cell empty: not measured",
                )
            elif spread:
                self.fault(
                    where,
                    f"{written[k]:g} is not a standard deviation",
                    "it must be > 0",
                )
            else:
                self.fault(
                    where,
                    f"{written[k]:g} is below absolute zero",
                    "is the unit in the header right?",
                )
        return np.where(wrong, np.nan, values)


def _head(cell: str) -> Head:
    """Name and unit of a header; brackets without a space before them may also hold an
    entry, `tension[3]`."""
    text = cell.strip()
    match = HEAD.match(text)
    if match is None or not (
        text[match.end("name")].isspace() or spelled(match["unit"])
    ):
        return Head(text, text, "")
    return Head(text, match["name"], match["unit"].strip())
