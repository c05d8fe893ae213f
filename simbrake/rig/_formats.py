"""Recordings as they are in files: WITSML, LAS and rig CSV as columns of numbers and
texts, before any meaning."""

import dataclasses
import io
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from .._base._faults import Fault, InputError, Issues, input_error, needed
from .._base._nulls import EMPTY
from .._base._text_table import HEAD, PIECE, File, Rows, cells_of, opened
from ._grammar import is_date_name, says_time

#: bytes of a whole file, unpacked; columns of a table; depth of an XML; errors of one
#: kind that are listed
_MOST_BYTES = 1 << 32
_MOST_COLUMNS = 2000
_DEEPEST = 50
_LISTED = 5
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?")


@dataclasses.dataclass
class Table:
    """Columns of one table of a file: names, units and descriptions as written,
    numbers, and texts of the others.

    - `texts`: of the columns that hold times or words, by their place
    - `nulls`: the file's null values
    - `index`: place of the column that the file calls its index, `index_type` what it
      says of it
    - `row_word`, `row_numbers`: how a row is named in a message
    - `well`: its name, as the file has it
    - `remarks`: what was assumed while reading
    """

    names: list[str]
    units: list[str]
    descriptions: list[str]
    nulls: tuple[float, ...] = ()
    index: int | None = None
    index_type: str = ""
    well: str = ""
    remarks: list[str] = dataclasses.field(default_factory=list)
    values: list[np.ndarray] = dataclasses.field(default_factory=list)
    texts: dict[int, list[str]] = dataclasses.field(default_factory=dict)
    row_word: str = "row"
    row_numbers: Any = None

    def row(self, i: int) -> str:
        """Name of the row `i` (from 0) as the file counts it."""
        return f"{self.row_word} {int(self.row_numbers[i])}"

    def fill(self, rows: Rows) -> None:
        """Take the rows. Raises `InputError` for damaged ones; the last one may be cut
        off, which is told."""
        self.row_numbers, self.values = rows.finish()
        self.texts = rows.texts
        self.row_word = rows.word
        short = [
            (row, count)
            for row, count in rows.ragged[-1:]
            if row > self.row_numbers.max(initial=0) and count < rows.count
        ]
        wrong = rows.ragged[: len(rows.ragged) - len(short)]
        faults = Issues()
        for row, count in wrong[:_LISTED]:
            what = f"has {count} cells under {rows.count} columns"
            faults.add(
                f"{rows.path} {rows.word} {row}",
                what,
                "the row is damaged: remove or repair it",
            )
        if wrong[_LISTED:]:
            faults.add(
                str(rows.path),
                f"has {len(wrong)} rows with another number of cells in all",
            )
        if not self.row_numbers.size and not faults:
            faults.add(
                str(rows.path),
                "has no rows of values",
                "it is cut off: export the log again",
            )
        faults.report()
        for i, (count, row, text) in rows.odd.items():
            if np.isfinite(self.values[i]).sum() < count:
                # which may be names of people
                self.remarks.append(f"{self.names[i]}: holds words, not used")
            else:
                where = f"{text[:40]!r} in {rows.word} {row}"
                self.remarks.append(
                    f"{self.names[i]}: {count} cells are no numbers ({where}), taken as missing"
                )
        for row, count in short:
            self.remarks.append(
                f"{rows.word} {row}, the last, has {count} of {rows.count} cells: left out"
            )


def tables_of(
    path: Path, progress: Callable[[int], object], texts: Sequence[str] = ()
) -> list[Table]:
    """Tables of a WITSML, LAS or CSV file, packed (`.xz`, `.gz`) or not; `texts` names
    columns to be kept as text.

    `progress` is called with the bytes of the file that have been read. Raises
    `InputError` with what cannot be read.
    """
    kinds = ("*.xml", "*.xml.xz", "*.las", "*.csv")
    with opened(path, *kinds, most=_MOST_BYTES, progress=progress) as file:
        if not file.head.strip():
            raise input_error(
                str(path), "is empty", "give a WITSML, LAS or CSV recording"
            )
        text = file.head.decode(file.encoding or "latin-1", "replace").lstrip(
            "\ufeff\xef\xbb\xbf \t\r\n"
        )
        if text.startswith("<"):
            return _Witsml(file, texts).read()
        first = next(
            (
                line
                for line in text.splitlines()
                if line.strip() and not line.startswith("#")
            ),
            "",
        )
        return _las(file, texts) if first.startswith("~") else [_csv(file, texts)]


def _kept_as_text(
    names: Sequence[str], sample: Sequence[Sequence[str]], wanted: Sequence[str]
) -> list[int]:
    """Columns of times, and of names of activities, by the names and by some rows of
    cells."""
    kept = []
    for i, name in enumerate(names):
        cells = [
            row[i].strip()
            for row in sample
            if i < len(row) and row[i].strip() not in EMPTY
        ][:20]
        letters = re.sub(r"[^A-Z]", "", name.upper())
        # without separators in its cells (`20261127`, `052324`) only a name says that a
        # column has dates or clocks
        named = (
            name in wanted
            or is_date_name(name)
            or letters in ("TIME", "CLOCK", "HHMMSS")
        )
        timed = sum(map(says_time, cells)) > 0.5 * len(cells)
        active = (
            re.search(r"ACTIVITY|ACTC|STATE$|MODE$", letters)
            and cells
            and not _NUMBER.fullmatch(cells[0])
        )
        if named or timed or active:
            kept.append(i)
    return kept


# --- WITSML -------------------------------------------------------------------------


class _Witsml(ElementTree.TreeBuilder):
    """Logs of a WITSML 1.3 or 1.4 document, while its tree is built; rows leave the
    tree as they come.

    A document type is refused: no log has one, and its entities may grow without bounds
    or name files.
    """

    def __init__(self, file: File, texts: Sequence[str]) -> None:
        super().__init__()
        self.file = file
        self.wanted = texts
        self.tables: list[Table] = []
        self._open: list[Any] = []
        self._length = 0
        self._rows: Rows | None = None
        self._lines: list[str] = []
        self._size = 0
        self._count = 0

    def read(self) -> list[Table]:
        parser = ElementTree.XMLParser(target=self)
        try:
            for piece in self.file.pieces():
                parser.feed(piece)
            root = parser.close()
        except ElementTree.ParseError as error:
            raise InputError([self._damaged(error)]) from None
        except InputError:
            raise
        # an encoding that the parser does not know
        except (LookupError, ValueError) as error:
            self._refuse(f"cannot be read: {error}", "give it in UTF-8")
        if not self.tables:
            other = root.tag not in ("logs", "log")
            what = (
                f"has no log with data: its root is <{root.tag}>"
                if other
                else "has no data"
            )
            self._refuse(what, "give a WITSML 1.3 or 1.4 log")
        return self.tables

    def _refuse(self, what: str, hint: str) -> Any:
        raise input_error(str(self.file.path), what, hint)

    def _damaged(self, error: ElementTree.ParseError) -> Fault:
        inside = f" in <{self._open[-1].tag}>" if self._open else ""
        rows = self._count + len(self._lines)
        after = f", after row {rows}" if rows else ""
        errors = expat.errors
        words = expat.ErrorString(error.code)
        place = f"{self.file.path} line {error.position[0]}"
        if words in (
            errors.XML_ERROR_NO_ELEMENTS,
            errors.XML_ERROR_UNCLOSED_TOKEN,
            errors.XML_ERROR_PARTIAL_CHAR,
        ):
            return Fault(
                place, f"ends{inside}{after}", "it is cut off: export the log again"
            )
        return Fault(
            place, f"is no well-formed XML ({words}){inside}{after}", "repair it"
        )

    def doctype(self, *_: object) -> None:
        self._refuse(
            "declares a document type (DTD), which no log needs",
            "remove it from the XML",
        )

    def start(self, tag: Any, attrs: Any) -> Any:
        element = super().start(tag.rpartition("}")[2], attrs)
        self._length = 0
        self._open.append(element)
        if len(self._open) > _DEEPEST:
            self._refuse(f"nests more than {_DEEPEST} elements", "no log does")
        return element

    def data(self, data: Any) -> None:
        self._length += len(data)
        self.file.check_row(self._length)
        super().data(data)

    def end(self, tag: Any) -> Any:
        element = super().end(tag)
        if element.tag == "data":
            self._add(element.text or "")
            for parent in self._open[-2:-1]:
                parent.remove(element)
        elif element.tag == "logData":
            self._finish()
        if element.tag in ("log", "logData"):
            element.clear()  # so that what the next one lacks is not found here
        self._open.pop()
        return element

    def _add(self, line: str) -> None:
        if self._rows is None:
            self._begin(line)
        self._lines.append(line.strip().replace("\n", " "))
        self._size += len(line)
        if self._size > PIECE:
            self._flush()

    def _begin(self, line: str) -> None:
        """The columns, where the first row of a log comes."""

        def text_of(name: str) -> str:
            return next(
                (
                    element.text.strip()
                    for element in self._open[0].iter(name)
                    if element.text
                ),
                "",
            )

        curves = [
            {x.tag: (x.text or "").strip() for x in curve}
            for curve in self._open[0].iter("logCurveInfo")
        ]
        curves.sort(key=lambda curve: _whole(curve.get("columnIndex")))
        listed = text_of("mnemonicList") or text_of("header")
        names = (
            [name.strip() for name in listed.split(",")]
            if listed
            else [c.get("mnemonic", "") for c in curves]
        )
        if not names or len(names) > _MOST_COLUMNS:
            what = (
                "lists no curves"
                if not names
                else f"lists {len(names)} curves, more than {_MOST_COLUMNS}"
            )
            where = f"{self.file.path} <log>"
            raise input_error(where, what, "mnemonicList, or logCurveInfo, names them")
        by_name = {curve.get("mnemonic", ""): curve for curve in curves}
        units = [unit.strip() for unit in text_of("unitList").split(",")]
        if len(units) != len(names):
            units = [by_name.get(name, {}).get("unit", "") for name in names]
        nulls = [
            _real(element.text or "") for element in self._open[0].iter("nullValue")
        ]
        index = text_of("indexCurve") or names[0]
        column = next(
            (
                _whole(x.get("columnIndex")) - 1
                for x in self._open[0].iter("indexCurve")
            ),
            -1,
        )
        place = (
            names.index(index)
            if index in names
            else column
            if 0 <= column < len(names)
            else 0
        )
        self._table = Table(
            names,
            units,
            [by_name.get(name, {}).get("curveDescription", "") for name in names],
            nulls=tuple(sorted({x for x in nulls if x is not None})),
            index=place,
            index_type=text_of("indexType"),
            well=text_of("nameWell"),
        )
        delimiter = text_of("dataDelimiter") or ","
        texts = {place, *_kept_as_text(names, [line.split(delimiter)], self.wanted)}
        self._rows = Rows(
            self.file.path, len(names), delimiter, sorted(texts), word="row"
        )

    def _flush(self) -> None:
        if self._rows is not None:
            self._rows.add(self._lines, self._count + 1)
        self._count += len(self._lines)
        self._lines = []
        self._size = 0

    def _finish(self) -> None:
        self._flush()
        self._count = 0
        if self._rows is not None:
            self._table.fill(self._rows)
            self.tables.append(self._table)
            self._rows = None


def _whole(text: str | None) -> int:
    return int(text) if text and text.strip().isdigit() else 0


def _real(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


# --- LAS ----------------------------------------------------------------------------

#: sections of rows: ~A of LAS 1 and 2, ~Log_Data[1] | Log_Definition[1] and ~ASCII |
#: CURVE of LAS 3
_DATA = re.compile(
    r"~(?:A\w*|(?P<kind>Log|Drilling)_Data(?P<number>\[\d+\])?)\s*(?:\|\s*(?P<of>\S+))?.*",
    re.IGNORECASE,
)
_OTHER_DATA = re.compile(r"~(\w+_Data)\b.*", re.IGNORECASE)


def _las(file: File, texts: Sequence[str]) -> list[Table]:
    """Tables of a LAS 1.2, 2 or 3 file: the headers by lasio, the rows as those of the
    other formats."""
    head: dict[str, list[str]] = {}  # lines of the header by the title of their section
    section: list[str] | _LasTable | None = None
    found: list[_LasTable] = []
    remarks: list[str] = []
    first = 1
    for piece in file.lines():
        titles = [i for i, line in enumerate(piece) if line.lstrip().startswith("~")]
        for a, b in pairwise([-1, *titles, len(piece)]):
            if a >= 0:
                title = piece[a].strip()
                data = _DATA.fullmatch(title)
                other = _OTHER_DATA.match(title)
                if data is not None:
                    section = _LasTable(
                        file.path,
                        title.split()[0],
                        _header(file.path, head, data),
                        texts,
                    )
                    found.append(section)
                elif other is not None:
                    section = None
                    remarks.append(f"~{other[1]} is not read")
                else:
                    section = head.setdefault(
                        title[1:].split("|")[0].strip().lower(), []
                    )
            lines = [
                "" if line.lstrip().startswith("#") else line
                for line in piece[a + 1 : b]
            ]
            if isinstance(section, _LasTable):
                section.add(lines, first + a + 1)
            elif section is not None:
                section += lines
        first += len(piece)
    tables = [table.finish(table.rows) for table in found if table.rows is not None]
    if not tables:
        what = "has no section ~A, or ~Log_Data of LAS 3, with rows"
        raise input_error(str(file.path), what, "it is cut off: export the log again")
    for table in tables:
        table.remarks[:0] = [*file.remarks, *remarks]
    return tables


def _header(path: Path, head: Mapping[str, list[str]], data: re.Match[str]) -> Any:
    """Version, well and curves of a section of rows, as lasio reads them."""
    lasio = needed("lasio", "reads the header of LAS files", "rig")
    kind = data["kind"]
    curves = data["of"] or (f"{kind}_Definition{data['number'] or ''}" if kind else "C")
    # a curve section of LAS 2 is named by its letter, and ~Curve and ~Log_Definition
    # are one
    begins = {
        "Version": ("v",),
        "Well": ("w",),
        "Curve": (curves.lower(), *(() if kind == "Drilling" else ("c",))),
    }
    text = ""
    for title, starts in begins.items():
        lines = [
            lines
            for start in starts
            for name, lines in head.items()
            if name.startswith(start)
        ]
        text += "".join(
            f"{line}\n" for line in [f"~{title}", *(lines[0] if lines else ())]
        )
    try:
        return lasio.read(
            io.StringIO(text + "~A\n"), ignore_data=True, ignore_header_errors=False
        )
    except Exception as error:  # any exception of the parser: the header is not LAS
        what = f"is no LAS file that lasio reads: {error}"
        raise input_error(str(path), what, "LAS 1.2, 2 and 3 are read") from None


class _LasTable:
    """Rows of one section `~A` or `~Log_Data` on their way to a table."""

    def __init__(self, path: Path, title: str, las: Any, texts: Sequence[str]) -> None:
        self.path = path
        self.texts = texts
        if not las.curves or len(las.curves) > _MOST_COLUMNS:
            what = f"lists {len(las.curves)} curves"
            raise input_error(
                f"{path} ~Curve", what, f"name the columns of {title} there"
            )

        def value(name: str) -> str:
            return next(
                (str(s[name].value) for s in (las.version, las.well) if name in s), ""
            )

        separators = {"COMMA": ",", ",": ",", "TAB": "\t"}
        self.separator = separators.get(value("DLM").strip().upper(), " ")
        self.wrapped = value("WRAP").upper().startswith("Y")
        null = _real(value("NULL"))
        described = [_described(curve.descr or "") for curve in las.curves]
        self.table = Table(
            [curve.original_mnemonic for curve in las.curves],
            [
                curve.unit or form
                for curve, (_, form) in zip(las.curves, described, strict=True)
            ],
            [words for words, _ in described],
            nulls=() if null is None else (null,),
            index=0,
            well=value("WELL"),
        )
        self.rows: Rows | None = None
        self._kept: list[str] = []
        self._row = 1

    def add(self, lines: list[str], first: int) -> None:
        """Lines of which the first has the number `first` in the file."""
        names = self.table.names
        if self.wrapped:
            self._kept += " ".join(lines).split()
            count = len(names)
            whole = len(self._kept) // count * count
            lines = [
                " ".join(self._kept[i : i + count]) for i in range(0, whole, count)
            ]
            del self._kept[:whole]
            first = self._row
            self._row += len(lines)
        if self.rows is None:
            sample = next((line for line in lines if line.strip()), None)
            if sample is None:
                return
            texts = {
                0,
                *_kept_as_text(names, [cells_of(sample, self.separator)], self.texts),
            }
            word = "row" if self.wrapped else "line"
            self.rows = Rows(
                self.path, len(names), self.separator, sorted(texts), word=word
            )
        self.rows.add(lines, first)

    def finish(self, rows: Rows) -> Table:
        if self._kept:
            rows.add([" ".join(self._kept)], self._row)
        self.table.fill(rows)
        return self.table


def _described(text: str) -> tuple[str, str]:
    """The description of a curve without the format after it, `{F10.4}`, and the
    format of a date."""
    match = re.search(r"\s*\{(.*?)\}.*", text)
    if match is None:
        return text, ""
    return text[: match.start()], match[1] if "YY" in match[1].upper() else ""


# --- CSV ----------------------------------------------------------------------------


def _csv(file: File, texts: Sequence[str]) -> Table:
    """Columns of a rig CSV: a row of names, perhaps one of units, then rows of
    values."""
    pieces = file.lines()
    start = next(pieces, [])
    separator, header = _header_of(file.path, start)
    place = f"{file.path} line {header + 1}"
    split = [
        [cell.strip() for cell in cells_of(line, separator)]
        for line in start[header : header + 40]
    ]
    names = split[0]
    units = [""] * len(names)
    remarks = (
        [f"line {header + 1} names the columns; the lines before it are left out"]
        if header
        else []
    )
    first = header + 1
    under = next((i for i, row in enumerate(split[1:], 1) if any(row)), 0)
    if under and not any(map(_is_value, split[under])):
        units = [*(cell.strip("[]()") for cell in split[under]), *units][: len(names)]
        first += under
        remarks.append(f"line {first} has the units")
    for i, name in enumerate(names):
        match = HEAD.match(name)
        if match is not None and not (
            units[i] or re.search(r"yyyy|hh:?mm", name, re.IGNORECASE)
        ):
            names[i] = match["name"]
            units[i] = match["unit"].strip()
    if len(names) > _MOST_COLUMNS:
        raise input_error(
            place, f"has {len(names)} columns", f"at most {_MOST_COLUMNS}"
        )
    for name, times in Counter(filter(None, names)).items():
        if times > 1:
            raise input_error(place, f"names {name} {times} times", "one column each")
    sample = [
        cells_of(line, separator) for line in start[first : first + 200] if line.strip()
    ]
    number = re.compile(r"\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?\s*")
    comma = separator != "," and any(
        number.fullmatch(cell) for row in sample for cell in row
    )
    if comma:
        remarks.append("numbers have decimal commas")
    wanted = _kept_as_text(names, sample, texts)
    rows = Rows(file.path, len(names), separator, wanted, decimal="," if comma else ".")
    rows.add(start[first:], first + 1)
    first = len(start)
    for piece in pieces:
        rows.add(piece, first + 1)
        first += len(piece)
    table = Table(names, units, [""] * len(names), remarks=[*file.remarks, *remarks])
    table.fill(rows)
    return table


def _is_value(cell: str) -> bool:
    """Whether a cell is a number, a time or a null, which no unit is."""
    return bool(_NUMBER.fullmatch(cell) or says_time(cell)) and cell not in ("", "1")


def _header_of(path: Path, lines: list[str]) -> tuple[str, int]:
    """Separator, and place of the row of names: the first one with as many cells as
    most of the rows below."""
    for separator in (";", "\t", ",", "|"):
        head = [
            [cell.strip() for cell in cells_of(line, separator)] if line.strip() else []
            for line in lines[:200]
        ]
        counts = [len(cells) for cells in head if len(cells) > 1]
        wide = max(counts, key=counts.count, default=0)
        if counts.count(wide) < 2 or len(counts) < 0.5 * sum(map(bool, head)):
            continue
        for i, cells in enumerate(head):
            named = sum(bool(cell) and not _is_value(cell) for cell in cells)
            if len(cells) == wide and named >= max(2, 0.6 * wide):
                return separator, i
    hint = "name the columns in the first row, as Time,BPOS"
    raise input_error(str(path), "has no row of column names", hint)
