"""Recordings as they are in files: WITSML, LAS and rig CSV as columns of numbers and texts, before any meaning.

Rows are parsed in pieces of a few MB, so that a week of 80 columns needs little more memory than its numbers.
"""

import csv
import dataclasses
import gzip
import io
import lzma
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO
from xml.parsers import expat

import numpy as np

from .._base._faults import Fault, InputError, existing_file, needed
from .._base._nulls import EMPTY
from ._grammar import is_date_name, says_time

#: bytes of a piece of a file; the most of a whole one, unpacked, and of a row; columns of a table; depth of an XML
_PIECE, _MOST_BYTES, _LONGEST_ROW, _MOST_COLUMNS, _DEEPEST = 1 << 22, 1 << 32, 1 << 24, 2000, 50
#: errors of one kind that are listed
_LISTED = 5
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?")


@dataclasses.dataclass
class Table:
    """Columns of one table of a file: names, units and descriptions as written, numbers, and texts of the others.

    - `texts`: of the columns that hold times or words, by their place;  `nulls`: the file's null values
    - `index`: place of the column that the file calls its index, `index_type` what it says of it
    - `row_word`, `first_row`: how a row is named in a message;  `well`: its name, as the file has it
    - `remarks`: what was assumed while reading
    """

    names: list[str]
    units: list[str]
    descriptions: list[str]
    values: list[np.ndarray]
    texts: dict[int, list[str]]
    nulls: tuple[float, ...] = ()
    index: int | None = None
    index_type: str = ""
    decreasing: bool = False
    row_word: str = "row"
    row_numbers: Any = None
    well: str = ""
    remarks: list[str] = dataclasses.field(default_factory=list)

    def row(self, i: int) -> str:
        """Name of the row `i` (from 0) as the file counts it."""
        return f"{self.row_word} {int(self.row_numbers[i]) if self.row_numbers is not None else i + 1}"


def tables_of(path: Path, progress: Callable[[int], object], texts: Sequence[str] = ()) -> list[Table]:
    """Tables of a WITSML, LAS or CSV file, packed (`.xz`, `.gz`) or not; `texts` names columns to be kept as text.

    `progress` is called with the bytes of the file that have been read. Raises `InputError` with what cannot be read.
    """
    existing_file(path, "*.xml", "*.xml.xz", "*.las", "*.csv")
    try:
        with path.open("rb") as raw:
            counted = _Counted(raw, progress)
            start = raw.read(8)
            raw.seek(0)
            packed = {b"\xfd7zXZ\0": lzma.open, b"\x1f\x8b": gzip.open}
            opened = next((way for mark, way in packed.items() if start.startswith(mark)), None)
            stream: Any = counted if opened is None else opened(counted, "rb")
            return _tables(path, _Limited(stream, path), texts)
    except (lzma.LZMAError, EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError([Fault(str(path), f"cannot be unpacked: {error}", "it is cut off or damaged")]) from None
    except OSError as error:
        raise InputError([Fault(str(path), f"cannot be read: {error.strerror or error}")]) from None


def _tables(path: Path, stream: "_Limited", texts: Sequence[str]) -> list[Table]:
    head = stream.peek(4096)
    if not head.strip():
        raise InputError([Fault(str(path), "is empty", "give a WITSML, LAS or CSV recording")])
    text = head.decode(_encoding(head) or "latin-1", "replace").lstrip("\ufeff \t\r\n")
    if text.startswith("<"):
        return _Witsml(path, texts).read(stream)
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    lines = _Lines(stream, _encoding(head))
    return _Las(path, texts).read(lines) if first.startswith("~") else [_csv(path, lines, texts)]


class _Counted(io.RawIOBase):
    """A file whose reading is reported."""

    def __init__(self, file: BinaryIO, progress: Callable[[int], object]) -> None:
        self._file, self._progress, self._done = file, progress, 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        count = self._file.readinto(buffer)  # pyright: ignore
        self._done += count
        if self._done % _PIECE < count:
            self._progress(self._done)
        return count

    def seekable(self) -> bool:
        return False


class _Limited:
    """Bytes of a file, unpacked, up to a limit: a small packed file may be of any size."""

    def __init__(self, stream: Any, path: Path) -> None:
        self._stream = io.BufferedReader(stream, _PIECE)
        self._path, self._left = path, _MOST_BYTES

    def peek(self, count: int) -> bytes:
        return self._stream.peek(count)[:count]

    def check_row(self, length: int) -> None:
        """Raise `InputError` for a row that no log has."""
        if length > _LONGEST_ROW:
            raise InputError([Fault(str(self._path), f"has a row of more than {_LONGEST_ROW >> 20} MB", "repair it")])

    def read(self, count: int = _PIECE) -> bytes:
        piece = self._stream.read(count)
        self._left -= len(piece)
        if self._left < 0:
            what = f"is larger than {_MOST_BYTES >> 30} GB when it is unpacked"
            raise InputError([Fault(str(self._path), what, "split the recording")])
        return piece


def _encoding(head: bytes) -> str | None:
    """The encoding that the first bytes show; `None` for UTF-8 or Latin-1, which only all bytes tell apart."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    pairs = np.frombuffer(head[: len(head) // 2 * 2], np.uint8).reshape(-1, 2)
    zeros = (pairs == 0).mean(0) if len(pairs) else np.zeros(2)
    if zeros.max() > 0.4:
        return "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"
    return None


class _Lines:
    """Lines of a text file in pieces, and the encoding that they turned out to have."""

    def __init__(self, stream: _Limited, encoding: str | None) -> None:
        import codecs

        #: whether the last line lacks the end that the others have: its last number may be cut off
        self.latin, self.cut = False, False
        self._stream, self._rest, self._count = stream, "", 0
        self._decoder = codecs.getincrementaldecoder(encoding)("replace") if encoding else None
        self._bytes = b""

    def pieces(self) -> Iterator[list[str]]:
        """Lists of whole lines without their ends."""
        while piece := self._stream.read():
            yield from self._split(self._text(piece))
        yield from self._split(self._text(b"", last=True), last=True)

    def _text(self, piece: bytes, *, last: bool = False) -> str:
        if self._decoder is not None:
            return self._decoder.decode(piece, last)
        piece = self._bytes + piece
        # a character is never cut by a line
        cut = len(piece) if last else max(piece.rfind(b"\n"), piece.rfind(b"\r")) + 1
        self._bytes = piece[cut:]
        self._stream.check_row(len(self._bytes))
        if not self.latin:
            try:
                return piece[:cut].decode("utf-8").removeprefix("\ufeff")
            except UnicodeDecodeError:
                self.latin = True
        return piece[:cut].decode("latin-1")

    def _split(self, text: str, *, last: bool = False) -> Iterator[list[str]]:
        text, self._rest = self._rest + text, ""
        if text.endswith("\r") and not last:  # its line feed may come with the next piece
            text, self._rest = text[:-1], "\r"
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        lines = text.split("\n")
        self._count += len(lines) - 1
        if not last:
            self._rest = lines.pop() + self._rest
            self._stream.check_row(len(self._rest))
        else:
            self.cut = bool(self._count and lines[-1].strip())
        if lines:
            yield lines

    @property
    def remarks(self) -> list[str]:
        cut = f"line {self._count + 1}, the last, has no end: if the file was cut off there, its last number is wrong"
        return ["not UTF-8: read as Latin-1"] * self.latin + [cut] * self.cut


class _Rows:
    """Rows of text that become columns of numbers, a piece at a time."""

    def __init__(
        self, path: Path, count: int, separator: str, texts: Sequence[int], word: str, decimal: str = "."
    ) -> None:
        self.path, self.count, self.separator, self.decimal, self.word = path, count, separator, decimal, word
        self.empty = separator + " \t\r"  # characters of a row without cells
        self.texts = {i: list[str]() for i in texts}
        self.numbers: list[np.ndarray] = []
        self.faults: list[Fault] = []
        self.wrong, self.total = 0, 0
        self.odd: dict[int, tuple[int, int, str]] = {}  # column: count, first row, text of what is no number
        self._pieces: list[list[np.ndarray]] = []
        self._short: tuple[int, int] | None = None

    def add(self, lines: list[str], first: int) -> None:
        """Rows of which the first has the number `first`; rows without text are left out."""
        numbers, filled = np.arange(first, first + len(lines)), [line.strip(self.empty) for line in lines]
        if not all(filled):
            kept = [i for i, text in enumerate(filled) if text]
            lines, numbers = [lines[i] for i in kept], numbers[kept]
        if not lines:
            return
        cells = np.fromiter(map(self._cells, lines), np.int64, len(lines))
        if self._short is not None:  # it was not the last row
            self._wrong(*self._short)
            self._short = None
        bad = np.flatnonzero(cells != self.count)
        if bad.size:
            if bad[-1] == len(lines) - 1 and cells[-1] < self.count:
                self._short, bad = (int(numbers[-1]), int(cells[-1])), bad[:-1]
            for i in bad:
                self._wrong(int(numbers[i]), int(cells[i]))
            good = np.flatnonzero(cells == self.count)
            lines, numbers = [lines[i] for i in good], numbers[good]
        if lines:
            self._pieces.append(self._parsed(lines, numbers))
            self.numbers.append(numbers)
            self.total += len(lines)

    def _cells(self, line: str) -> int:
        if self.separator == " ":
            return len(_words(line))
        return len(_split(line, self.separator)) if '"' in line else line.count(self.separator) + 1

    def _wrong(self, row: int, cells: int) -> None:
        self.wrong += 1
        if self.wrong <= _LISTED:
            what = f"has {cells} cells under {self.count} columns"
            self.faults.append(Fault(f"{self.path} {self.word} {row}", what, "the row is damaged: remove or repair it"))

    def _parsed(self, lines: list[str], numbers: np.ndarray) -> list[np.ndarray]:
        import pandas as pd

        separator: dict[str, Any] = (
            {"sep": r"\s+"} if self.separator == " " else {"sep": self.separator, "skipinitialspace": True}
        )
        try:
            frame: Any = pd.read_csv(
                io.StringIO("\n".join(lines)),
                header=None,
                names=list(range(self.count)),
                index_col=False,
                dtype=dict.fromkeys(self.texts, str),
                na_values=list(EMPTY),
                keep_default_na=False,
                skip_blank_lines=False,
                decimal=self.decimal,
                low_memory=False,
                **separator,
            )
        except (pd.errors.ParserError, ValueError) as error:
            where = f"{self.path} {self.word}s {numbers[0]} to {numbers[-1]}"
            raise InputError([Fault(where, f"cannot be split into cells: {error}", "is a quote left open?")]) from None
        if len(frame) != len(lines):
            where = f"{self.path} {self.word}s {numbers[0]} to {numbers[-1]}"
            raise InputError([Fault(where, "cannot be split into cells", "is a quote left open?")])
        columns = []
        for i in range(self.count):
            column = frame[i]
            if i in self.texts:
                self.texts[i] += column.fillna("").tolist()
                columns.append(np.empty(0))
            elif column.dtype.kind in "fiub":
                columns.append(column.to_numpy(np.float64))
            else:
                texts = column.str.strip() if self.decimal == "." else column.str.strip().str.replace(",", ".")
                values = np.asarray(pd.to_numeric(texts, errors="coerce"), np.float64)
                odd = np.flatnonzero(np.isnan(values) & column.notna().to_numpy())
                if odd.size:
                    count, row, text = self.odd.get(i, (0, int(numbers[odd[0]]), str(column.iloc[odd[0]])))
                    self.odd[i] = count + odd.size, row, text
                columns.append(values)
        return columns

    def finish(self, names: Sequence[str]) -> tuple[list[np.ndarray], np.ndarray, list[str]]:
        """Columns, the number of each row, and remarks; raises `InputError` for damaged rows."""
        if self.wrong > _LISTED:
            self.faults.append(Fault(str(self.path), f"has {self.wrong} rows with another number of cells in all"))
        if not self.total and not self.faults:
            self.faults.append(Fault(str(self.path), "has no rows of values", "it is cut off: export the log again"))
        if self.faults:
            raise InputError(self.faults)
        columns = []
        for i in range(self.count):
            columns.append(np.concatenate([piece[i] for piece in self._pieces]) if self._pieces else np.empty(0))
            for piece in self._pieces:
                piece[i] = np.empty(0)  # so that only one column is there twice
        remarks = []
        for i, (count, row, text) in self.odd.items():
            if np.isfinite(columns[i]).sum() < count:
                remarks.append(f"{names[i]}: holds words, not used")  # which may be names of people
            else:
                where = f"{text[:40]!r} in {self.word} {row}"
                remarks.append(f"{names[i]}: {count} cells are no numbers ({where}), taken as missing")
        if self._short is not None:
            row, cells = self._short
            remarks.append(f"{self.word} {row}, the last, has {cells} of {self.count} cells: left out")
        return columns, np.concatenate(self.numbers) if self.numbers else np.empty(0, np.int64), remarks


# --- WITSML -----------------------------------------------------------------------------------------------------------

#: elements whose text is kept
_HEADER = (
    "nameWell",
    "indexType",
    "indexCurve",
    "direction",
    "nullValue",
    "dataDelimiter",
    "mnemonicList",
    "unitList",
    "header",
)
_CURVE = ("mnemonic", "unit", "nullValue", "columnIndex", "curveDescription")


class _Witsml:
    """Logs of a WITSML 1.3 or 1.4 document, by the events of the standard library's parser.

    A document type or an entity is refused: no log has one, and it may grow without bounds or name files.
    """

    def __init__(self, path: Path, texts: Sequence[str]) -> None:
        self.path, self.wanted = path, texts
        self.stack: list[str] = []
        self.tables: list[Table] = []
        self.root = ""
        self._log, self._curves, self._curve = dict[str, str](), list[dict[str, str]](), dict[str, str]()
        self._text: list[str] | None = None
        self._rows: _Rows | None = None
        self._lines: list[str] = []
        self._size, self._count = 0, 0

    def read(self, stream: _Limited) -> list[Table]:
        parser = expat.ParserCreate()
        parser.buffer_text = True
        self._check_row = stream.check_row
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.CharacterDataHandler = self._characters
        parser.StartDoctypeDeclHandler = self._refused("a document type (DTD)")
        parser.EntityDeclHandler = self._refused("an entity")
        try:
            while piece := stream.read():
                parser.Parse(piece)
            parser.Parse(b"", True)
        except expat.ExpatError as error:
            raise InputError([self._damaged(error)]) from None
        except InputError:
            raise
        except (LookupError, ValueError) as error:  # an encoding that the parser does not know
            raise InputError([Fault(str(self.path), f"cannot be read: {error}", "give it in UTF-8")]) from None
        if not self.tables:
            what = (
                f"has no log with data: its root is <{self.root}>"
                if self.root not in ("logs", "log")
                else "has no data"
            )
            raise InputError([Fault(str(self.path), what, "give a WITSML 1.3 or 1.4 log")])
        return self.tables

    def _damaged(self, error: expat.ExpatError) -> Fault:
        inside = f" in <{self.stack[-1]}>" if self.stack else ""
        rows = self._count + len(self._lines)
        after = f", after row {rows}" if rows else ""
        ended = error.code in (expat.errors.codes[expat.errors.XML_ERROR_NO_ELEMENTS],
                               expat.errors.codes[expat.errors.XML_ERROR_UNCLOSED_TOKEN],
                               expat.errors.codes[expat.errors.XML_ERROR_PARTIAL_CHAR])  # fmt: skip
        what = "ends" if ended else f"is no well-formed XML ({expat.ErrorString(error.code)})"
        place = f"{self.path} line {error.lineno}"
        return Fault(place, f"{what}{inside}{after}", "it is cut off: export the log again" if ended else "repair it")

    def _refused(self, what: str) -> Callable[..., None]:
        def refuse(*_: object) -> None:
            raise InputError([Fault(str(self.path), f"declares {what}, which no log needs", "remove it from the XML")])

        return refuse

    def _start(self, name: str, attributes: Mapping[str, str]) -> None:
        name = name.rpartition(":")[2]
        self.root = self.root or name
        self.stack.append(name)
        if len(self.stack) > _DEEPEST:
            raise InputError([Fault(str(self.path), f"nests more than {_DEEPEST} elements", "no log does")])
        self._length = 0
        if name == "data":
            self._text = []
        elif name == "log":
            self._log, self._curves = {}, []
        elif name == "logCurveInfo":
            self._curve = {}
        elif name == "logData":
            self._count = 0
            self._log.pop("mnemonicList", None)
        elif name in _HEADER or name in _CURVE:
            self._text = []
            if name == "indexCurve" and "columnIndex" in attributes:
                self._log["indexColumn"] = attributes["columnIndex"]

    def _characters(self, text: str) -> None:
        if self._text is not None:
            self._text.append(text)
            self._length += len(text)
            self._check_row(self._length)

    def _end(self, _: str) -> None:
        name = self.stack.pop()
        if name == "data":
            self._add("".join(self._text or ()))
            self._text = None
        elif name == "logCurveInfo":
            self._curves.append(self._curve)
        elif name == "logData":
            self._finish()
        elif self._text is not None:
            kept = self._curve if self.stack and self.stack[-1] == "logCurveInfo" else self._log
            kept[name] = "".join(self._text).strip()
            self._text = None

    def _add(self, line: str) -> None:
        if self._rows is None:
            self._begin(line)
        self._lines.append(line.strip().replace("\n", " "))
        self._size += len(line)
        if self._size > _PIECE:
            self._flush()

    def _begin(self, line: str) -> None:
        """The columns, where the first row of a log comes."""
        delimiter = self._log.get("dataDelimiter") or ","
        listed = self._log.get("mnemonicList") or self._log.get("header") or ""
        curves = sorted(self._curves, key=lambda curve: _whole(curve.get("columnIndex"), 0))
        names = [name.strip() for name in listed.split(",")] if listed else [c.get("mnemonic", "") for c in curves]
        if not names or len(names) > _MOST_COLUMNS:
            what = "lists no curves" if not names else f"lists {len(names)} curves, more than {_MOST_COLUMNS}"
            raise InputError([Fault(f"{self.path} <log>", what, "mnemonicList, or logCurveInfo, names them")])
        units = [unit.strip() for unit in self._log.get("unitList", "").split(",")]
        by_name = {curve.get("mnemonic", ""): curve for curve in self._curves}
        if len(units) != len(names):
            units = [by_name.get(name, {}).get("unit", "") for name in names]
        cells = [cell.strip() for cell in line.split(delimiter)]
        wanted = [
            i
            for i, cell in enumerate(cells[: len(names)])
            if says_time(cell) or names[i] in self.wanted or _is_words(names[i], cell)
        ]
        nulls = [self._log.get("nullValue"), *(curve.get("nullValue") for curve in self._curves)]
        index = self._log.get("indexCurve") or names[0]
        column = _whole(self._log.get("indexColumn"), 0) - 1
        place = names.index(index) if index in names else column if 0 <= column < len(names) else 0
        self._table = Table(
            names,
            units,
            [by_name.get(name, {}).get("curveDescription", "") for name in names],
            [],
            {},
            nulls=tuple(sorted({x for text in nulls if (x := _real(text)) is not None})),
            index=place,
            index_type=self._log.get("indexType", ""),
            decreasing=self._log.get("direction") == "decreasing",
            well=self._log.get("nameWell", ""),
        )
        self._rows = _Rows(self.path, len(names), delimiter, sorted({*wanted, place}), "row")

    def _flush(self) -> None:
        if self._rows is not None:
            self._rows.add(self._lines, self._count + 1)
        self._count += len(self._lines)
        self._lines, self._size = [], 0

    def _finish(self) -> None:
        if self._rows is None:
            return
        self._flush()
        table = self._table
        table.values, table.row_numbers, table.remarks = self._rows.finish(table.names)
        table.texts = self._rows.texts
        self.tables.append(table)
        self._rows = None


def _whole(text: str | None, default: int) -> int:
    return int(text) if text and text.strip().isdigit() else default


def _real(text: str | None) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return None


# --- LAS --------------------------------------------------------------------------------------------------------------


#: sections of rows: ~A of LAS 1 and 2, ~Log_Data[1] | Log_Definition[1] and ~ASCII | CURVE of LAS 3
_DATA = re.compile(
    r"~(?:A\w*|(?P<kind>Log|Drilling)_Data(?P<number>\[\d+\])?)\s*(?:\|\s*(?P<of>\S+))?.*", re.IGNORECASE
)
_OTHER_DATA = re.compile(r"~(\w+_Data)\b.*", re.IGNORECASE)


class _Las:
    """Tables of a LAS 1.2, 2 or 3 file: the headers by lasio, the rows as those of the other formats."""

    def __init__(self, path: Path, texts: Sequence[str]) -> None:
        self.path, self.wanted = path, texts
        self.tables: list[Table] = []
        self._remarks: list[str] = []
        #: lines of the header by the title of their section, and those of the section that is being read
        self._head: dict[str, list[str]] = {}
        self._section: list[str] | None = None
        self._table: _LasTable | None = None

    def read(self, lines: _Lines) -> list[Table]:
        first = 1
        for piece in lines.pieces():
            titles = [i for i, line in enumerate(piece) if "~" in line and line.lstrip().startswith("~")]
            for a, b in zip([-1, *titles], [*titles, len(piece)], strict=True):
                if a >= 0:
                    self._open(piece[a].strip())
                self._add(piece[a + 1 : b], first + a + 1)
            first += len(piece)
        self._finish()
        if not self.tables:
            what = "has no section ~A, or ~Log_Data of LAS 3, with rows"
            raise InputError([Fault(str(self.path), what, "it is cut off: export the log again")])
        for table in self.tables:
            table.remarks[:0] = [*lines.remarks, *self._remarks]
        return self.tables

    def _open(self, title: str) -> None:
        self._finish()
        data, other = _DATA.fullmatch(title), _OTHER_DATA.match(title)
        if data is not None:
            self._table = _LasTable(self.path, title.split()[0], self._header(data), self.wanted)
        elif other is not None:
            self._remarks.append(f"~{other[1]} is not read")
            self._section = None
        else:
            self._section = self._head.setdefault(title[1:].split("|")[0].strip().lower(), [])

    def _add(self, lines: list[str], first: int) -> None:
        if self._table is not None:
            self._table.add(lines, first)
        elif self._section is not None:
            self._section += lines

    def _finish(self) -> None:
        if self._table is not None and self._table.rows is not None:
            self.tables.append(self._table.finish(self._table.rows))
        self._table = None

    def _header(self, data: re.Match[str]) -> Any:
        """Version, well and curves of a section of rows, as lasio reads them."""
        lasio = needed("lasio", "reads the header of LAS files", "rig")
        kind = data["kind"]
        curves = data["of"] or (f"{kind}_Definition{data['number'] or ''}" if kind else "C")
        parts = {"Version": "v", "Well": "w", "Curve": curves.lower()}
        text = ""
        for title, begin in parts.items():
            # a curve section of LAS 2 is named by its letter, and ~Curve and ~Log_Definition are one
            begins = (begin, "c") if title == "Curve" and kind != "Drilling" else (begin,)
            names = [name for start in begins for name in self._head if name.startswith(start)]
            text += "".join(f"{line}\n" for line in [f"~{title}", *(self._head[names[0]] if names else ())])
        try:
            return lasio.read(io.StringIO(text + "~A\n"), ignore_data=True, ignore_header_errors=False)
        except Exception as error:  # any exception of the parser: the header is not LAS
            what = f"is no LAS file that lasio reads: {error}"
            raise InputError([Fault(str(self.path), what, "LAS 1.2, 2 and 3 are read")]) from None


class _LasTable:
    """Rows of one section `~A` or `~Log_Data` on their way to a table."""

    def __init__(self, path: Path, title: str, las: Any, texts: Sequence[str]) -> None:
        self.path, self.title, self.texts = path, title, texts
        curves = [(c.original_mnemonic, c.unit or "", *_described(c.descr or "")) for c in las.curves]
        if not curves or len(curves) > _MOST_COLUMNS:
            what = f"lists {len(curves)} curves"
            raise InputError([Fault(f"{path} ~Curve", what, f"name the columns of {title} there")])

        def value(name: str) -> str:
            return next((str(s[name].value) for s in (las.version, las.well) if name in s), "")

        delimiter = value("DLM").strip()
        self.separator = {"COMMA": ",", ",": ",", "TAB": "\t"}.get(delimiter.upper(), " ")
        self.wrapped = value("WRAP").upper().startswith("Y")
        self.null, self.well = _real(value("NULL")), value("WELL")
        self.names, self.descriptions = [c[0] for c in curves], [c[2] for c in curves]
        self.units = [unit or form for _, unit, _, form in curves]
        self.rows: _Rows | None = None
        self._kept, self._row = list[str](), 1

    def _cells(self, line: str) -> list[str]:
        return _words(line) if self.separator == " " else [cell.strip() for cell in _split(line, self.separator)]

    def _unwrapped(self, piece: list[str]) -> list[str]:
        """Whole rows of wrapped lines."""
        self._kept += " ".join(piece).split()
        count = len(self.names)
        whole = len(self._kept) // count * count
        made = [" ".join(self._kept[i : i + count]) for i in range(0, whole, count)]
        del self._kept[:whole]
        return made

    def add(self, piece: list[str], first: int) -> None:
        """Lines of which the first has the number `first` in the file."""
        if self.wrapped:
            piece = self._unwrapped([line for line in piece if not line.lstrip().startswith("#")])
            first = self._row
            self._row += len(piece)
        else:
            piece = ["" if line.lstrip().startswith("#") else line for line in piece]
        if self.rows is None:
            sample = next((self._cells(line) for line in piece if line.strip()), None)
            if sample is None:
                return
            wanted = [i for i, name in enumerate(self.names) if name in self.texts or _looks_like_time(name)]
            for i, cell in enumerate(sample[: len(self.names)]):
                if i == 0 or (not _NUMBER.fullmatch(cell) and says_time(cell)) or _is_words(self.names[i], cell):
                    wanted.append(i)
            word = "row" if self.wrapped else "line"
            self.rows = _Rows(self.path, len(self.names), self.separator, sorted(set(wanted)), word)
        self.rows.add(piece, first)

    def finish(self, rows: _Rows) -> Table:
        if self._kept:
            rows.add([" ".join(self._kept)], self._row)
        values, numbers, remarks = rows.finish(self.names)
        return Table(
            self.names,
            self.units,
            self.descriptions,
            values,
            rows.texts,
            nulls=() if self.null is None else (self.null,),
            index=0,
            row_word=rows.word,
            row_numbers=numbers,
            well=self.well,
            remarks=remarks,
        )


def _words(line: str) -> list[str]:
    """Cells between blanks, those in quotes with their blanks."""
    return [cell.strip('"') for cell in re.findall(r'"[^"]*"|\S+', line)] if '"' in line else line.split()


def _described(text: str) -> tuple[str, str]:
    """The description of a curve without the format behind it, `{F10.4}`, and the format of a date."""
    match = re.search(r"\s*\{(.*?)\}.*", text)
    if match is None:
        return text, ""
    return text[: match.start()], match[1] if "YY" in match[1].upper() else ""


# --- CSV --------------------------------------------------------------------------------------------------------------

#: a unit behind a name: `Hook Load (klbf)`, `BPOS [m]`
_BEHIND = re.compile(r"^(?P<name>.*\S)\s*[\[(](?P<unit>[^\[\]()]*)[\])]$")


def _is_words(name: str, cell: str) -> bool:
    """Whether a column holds names of activities, which are kept as text: no number, and called an activity."""
    named = re.search(r"ACTIVITY|ACTC|STATE$|MODE$", re.sub(r"[^A-Z]", "", name.upper()))
    return bool(named and cell and not _NUMBER.fullmatch(cell))


def _looks_like_time(name: str) -> bool:
    """Whether a column without separators in its cells (`20261127`, `052324`) is named as a date or a clock."""
    return is_date_name(name) or re.sub(r"[^A-Z]", "", name.upper()) in ("TIME", "CLOCK", "HHMMSS")


def _csv(path: Path, lines: _Lines, texts: Sequence[str]) -> Table:
    """Columns of a rig CSV: a row of names, perhaps one of units, then rows of values."""
    pieces = lines.pieces()
    start = next(pieces, [])
    separator, header = _header_of(path, start)
    split = [_split(line, separator) for line in start[header : header + 40]]
    names, units, first = [cell.strip() for cell in split[0]], [""] * len(split[0]), header + 1
    remarks = [f"line {header + 1} names the columns; the lines before it are left out"] if header else []
    while (
        names and not names[-1] and all(len(row) < len(names) or not row[len(names) - 1].strip() for row in split[1:])
    ):
        names.pop()  # a separator at the end of each row
    count = len(split[0])
    under = next((i for i, row in enumerate(split[1:], 1) if any(cell.strip() for cell in row)), None)
    if under is not None and not any(_is_value(cell) for cell in split[under]):
        units = [cell.strip().strip("[]()") for cell in split[under]]
        units += [""] * (count - len(units))
        first = header + under + 1
        remarks.append(f"line {first} has the units")
    for i, name in enumerate(names):
        match = _BEHIND.match(name)
        if match is not None and not (units[i] or _is_date_format(name)):
            names[i], units[i] = match["name"], match["unit"].strip()
    names += [""] * (count - len(names))
    if len(names) > _MOST_COLUMNS:
        raise InputError([Fault(f"{path} line {header + 1}", f"has {len(names)} columns", f"at most {_MOST_COLUMNS}")])
    for name, times in Counter(name for name in names if name).items():
        if times > 1:
            raise InputError([Fault(f"{path} line {header + 1}", f"names {name} {times} times", "one column each")])
    sample = [_split(line, separator) for line in start[first : first + 200] if line.strip()]
    if not sample:
        raise InputError([Fault(str(path), "has no rows of values", "it is cut off: export the log again")])
    comma = separator != "," and _decimal_comma(sample)
    if comma:
        remarks.append("numbers have decimal commas")

    def timed(i: int) -> bool:
        cells = [row[i].strip() for row in sample if i < len(row) and row[i].strip() not in EMPTY]
        return sum(map(says_time, cells[:20])) > 0.5 * len(cells[:20])

    wanted = [i for i, name in enumerate(names) if name in texts or _looks_like_time(name) or timed(i)]
    cells = [
        next((row[i].strip() for row in sample if i < len(row) and row[i].strip() not in EMPTY), "")
        for i in range(count)
    ]
    wanted += [i for i, name in enumerate(names) if i not in wanted and _is_words(name, cells[i])]
    rows = _Rows(path, count, separator, wanted, "line", "," if comma else ".")
    rows.add(start[first:], first + 1)
    first = len(start)
    for piece in pieces:
        rows.add(piece, first + 1)
        first += len(piece)
    values, numbers, odd = rows.finish(names)
    return Table(
        names,
        units,
        [""] * count,
        values,
        rows.texts,
        row_word="line",
        row_numbers=numbers,
        remarks=[*lines.remarks, *remarks, *odd],
    )


def _split(line: str, separator: str) -> list[str]:
    """Cells of a line, which may be in quotes."""
    try:
        return next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)
    except (csv.Error, StopIteration):
        return line.split(separator)


def _is_date_format(name: str) -> bool:
    return bool(re.search(r"yyyy|hh:?mm", name, re.IGNORECASE))


def _is_value(cell: str) -> bool:
    """Whether a cell is a number, a time or a null, which no unit is."""
    text = cell.strip()
    return bool(_NUMBER.fullmatch(text) or says_time(text)) and text not in ("", "1")


def _header_of(path: Path, lines: list[str]) -> tuple[str, int]:
    """Separator, and place of the row of names: the first one with as many cells as most of the rows below."""
    head = lines[:200]
    for separator in (";", "\t", ",", "|"):
        counts = [len(_split(line, separator)) if line.strip() else 0 for line in head]
        wide = Counter(count for count in counts if count > 1).most_common(1)
        if not wide or wide[0][1] < 2 or sum(count > 1 for count in counts) < 0.5 * sum(map(bool, counts)):
            continue
        for i, line in enumerate(head):
            cells = [cell.strip() for cell in _split(line, separator)]
            named = sum(bool(cell) and not _is_value(cell) for cell in cells)
            if counts[i] == wide[0][0] and named >= 2 and named >= 0.6 * len(cells):
                return separator, i
    raise InputError(
        [Fault(str(path), "has no row of column names", "name the columns in the first row, as Time,BPOS")]
    )


def _decimal_comma(rows: list[list[str]]) -> bool:
    cells = [cell.strip() for row in rows for cell in row]
    return any(re.fullmatch(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?", cell) for cell in cells)
