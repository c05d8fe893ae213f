"""Tables with units, the type of all results with rows.

A table is text, dictionaries for JSON, a data frame, and HTML in a notebook. A study,
an estimate or a comparison returns a `Tabular`: lines of text and tables, in the order
in which they are read.
"""

import abc
import dataclasses
import enum
import html
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar, dataclass_transform

import numpy as np

from ._numbers import digits, pretty, scale

#: an object of JSON
JsonObject = dict[str, Any]

#: default number format of a table
_SHOWN = ".6g"


class Column(NamedTuple):
    """A column of a table.

    - `name`: of the values in dictionaries and data frames
    - `unit` (SI, `1` or empty: none) and `meaning`
    - `heading`: above the values, by default the name
    - `display_units`: unit beside it, of values that `show` converts
    - `show`: how a value is written, a format as `.4g` or a function of it; what is
      absent stays empty
    - `left`: text that begins at the left edge of the column
    - `hidden`: not in the text, only in dictionaries
    """

    name: str
    unit: str = ""
    meaning: str = ""
    heading: str | None = None
    display_units: str | None = None
    show: str | Callable[[Any], str] = _SHOWN
    left: bool = False
    hidden: bool = False

    @property
    def title(self) -> str:
        """Heading and unit."""
        unit = pretty(self.unit) if self.display_units is None else self.display_units
        heading = self.name.replace("_", " ") if self.heading is None else self.heading
        return f"{heading}, {unit}" if unit and heading else heading or unit

    def scaled(self, like: float, count: int = 4) -> "Column":
        """The same with `count` digits, in the unit for reading values such as `like`
        (SI)."""
        factor, offset, name = scale(self.unit, like, absolute=True)
        return self._replace(
            display_units=name,
            show=lambda x: "" if x != x else digits(x * factor + offset, count),
        )

    def text(self, value: object) -> str:
        """A value as shown in the table."""
        if value is None:
            return ""
        if not isinstance(self.show, str):
            return self.show(value)
        if isinstance(value, bool | np.bool_):
            return "yes" if value else "no"
        if isinstance(value, float | int | np.number):
            return format(
                value, "d" if isinstance(value, int | np.integer) else self.show
            )
        return str(value)


class Table(Sequence[dict[str, Any]]):
    """Rows and columns with units and meanings.

    - `columns`: `Column`s, or names of texts, also `(name, heading)`
    - `rows`: of each a sequence in their order or a
      mapping by their names (missing: absent values);  `title`: above the text
    - `table[0]` is a row as a dictionary, `table["path"]` a column as a list,
      `len(table)` the number of rows
    - `str(table)` is the text, `as_list()` rows for JSON, `frame()` a data frame

    Raises `ValueError` for rows that do not fit the columns, `KeyError` with the known
    names.

    Example:
        >>> print(Table(["part", Column("mass", "kg", show=".1f")], [("rim", 412.0), ("lining", 3.25)]))
        part      mass, kg
        rim          412.0
        lining         3.2
    """

    def __init__(
        self,
        columns: Iterable[Column | str | tuple[str, str]],
        rows: Iterable[Sequence | Mapping],
        title: str = "",
    ) -> None:
        self.columns = tuple(
            column if isinstance(column, Column) else _of_words(column)
            for column in columns
        )
        self.title = title
        self._rows = [self._ordered(row) for row in rows]

    def _ordered(self, row: Any) -> tuple[Any, ...]:
        names = [column.name for column in self.columns]
        if isinstance(row, Mapping):
            if unknown := set(row) - set(names):
                raise ValueError(
                    f"no column {sorted(unknown)}; there are: {', '.join(names)}"
                )
            return tuple(row.get(name) for name in names)
        if len(row) != len(names):
            raise ValueError(
                f"a row of {len(row)} values for {len(names)} columns: {', '.join(names)}"
            )
        return tuple(row)

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, key: Any) -> Any:
        names = [column.name for column in self.columns]
        if isinstance(key, str):
            if key not in names:
                raise KeyError(f"no column {key!r}; there are: {', '.join(names)}")
            return [row[names.index(key)] for row in self._rows]
        if isinstance(key, slice):
            return Table(self.columns, self._rows[key], self.title)
        return dict(zip(names, self._rows[key], strict=True))

    def readable(self, *names: str, title: str = "") -> "Table":
        """The named columns for reading, all numbers of one in the unit that suits the
        largest; empty ones left out."""
        columns = []
        for column in self.columns:
            there = [x for x in self[column.name] if x not in (None, "", ()) and x == x]
            numbers = [abs(x) for x in there if isinstance(x, float)]
            shown = (
                column.scaled(max(numbers))
                if numbers and column.unit not in ("", "s")
                else column
            )
            columns.append(shown._replace(hidden=column.name not in names or not there))
        return Table(columns, self._rows, title or self.title)

    def as_list(self) -> list[dict[str, Any]]:
        """Rows as dictionaries of JSON: `None` for what is absent or not finite."""
        return [plain(row) for row in self]

    def frame(self) -> Any:
        """The same as a `pandas.DataFrame`, units and meanings in `attrs`."""
        import pandas as pd

        frame = pd.DataFrame(
            list(self._rows), columns=[column.name for column in self.columns]
        )
        frame.attrs = {
            column.name: {"unit": column.unit, "meaning": column.meaning}
            for column in self.columns
        }
        return frame

    def _written(self, how: str) -> str:
        from tabulate import tabulate

        shown = [
            (i, column) for i, column in enumerate(self.columns) if not column.hidden
        ]
        cells = [[column.text(row[i]) for i, column in shown] for row in self._rows]
        align = ["left" if column.left else "right" for _, column in shown]
        return tabulate(
            cells,
            [column.title for _, column in shown],
            tablefmt=how,
            disable_numparse=True,
            colalign=align if cells else None,
        )

    def __str__(self) -> str:
        lines = [line.rstrip() for line in self._written("plain").splitlines()]
        return "\n".join([self.title, *lines] if self.title else lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        title = f"<p>{html.escape(self.title)}</p>" if self.title else ""
        return title + self._written("html")

    def markdown(self) -> str:
        """The same as a table of Markdown."""
        return self._written("github")


def _of_words(column: str | tuple[str, str]) -> Column:
    name, heading = (column, None) if isinstance(column, str) else column
    return Column(name, heading=heading, left=True)


_Kind = TypeVar("_Kind")


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def frozen(kind: type[_Kind]) -> type[_Kind]:
    """Decorate a class of results: a dataclass whose fields stay as they are."""
    return dataclasses.dataclass(frozen=True)(kind)


class Tabular(abc.ABC):
    """A result shown as lines of text and tables: `str` returns all of it, a notebook
    shows HTML tables."""

    @abc.abstractmethod
    def parts(self) -> Iterable[str | Table]:
        """Lines and tables in order; an empty line sets parts off."""

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self.parts())

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return "".join(
            part._repr_html_()
            if isinstance(part, Table)
            else f"<div>{html.escape(part) or '&nbsp;'}</div>"
            for part in self.parts()
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are
        `None`."""
        return plain(self)


def plain(value: Any) -> Any:
    """Convert a value for JSON: arrays and tuples as lists, records as dictionaries,
    `None` for what is not finite."""
    if isinstance(value, Table):
        return value.as_list()
    if isinstance(value, enum.Enum):
        return plain(value.value)
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if dataclasses.is_dataclass(value):
        return {
            field.name: plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
        }
    if names := getattr(value, "_fields", None):
        return {name: plain(entry) for name, entry in zip(names, value, strict=True)}
    if isinstance(value, tuple | list | set | frozenset):
        return [plain(entry) for entry in value]
    return plain(np.asarray(value).tolist())


def rows_table(rows: list[tuple[str, str, str]], title: str) -> Table:
    """Name, value with unit and meaning, for a notebook."""
    return Table(["name", Column("value", left=True, show=str), "meaning"], rows, title)


def coloured(text: str, colour: str) -> str:
    """A banner of HTML for a notebook."""
    ink, paper = {
        "red": ("#b3261e", "#fcebea"),
        "amber": ("#8a5a00", "#fdf3e0"),
        "green": ("#1a7440", "#e7f4ec"),
    }[colour]
    style = (
        f"border-left:5px solid {ink};background:{paper};color:{ink};padding:.5em "
        ".8em;margin:.3em 0"
    )
    return f'<div style="{style}">{html.escape(text)}</div>'
