"""Tables in text files: lines in pieces, and rows of cells that become columns of
numbers.

Rows are parsed in pieces of a few MB, so that a week of 80 columns needs little more
memory than its numbers.
"""

import contextlib
import csv
import gzip
import io
import lzma
import re
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ._faults import existing_file, input_error
from ._nulls import EMPTY

#: bytes or characters of a piece of a file; the most of a row
PIECE = 1 << 22
_LONGEST_ROW = 1 << 24
#: a unit behind a name: `Hook Load (klbf)`, `BPOS [m]`
HEAD = re.compile(r"^(?P<name>.*\S)\s*[\[(](?P<unit>[^\[\]()]*)[\])]$")
#: bytes that are not UTF-8, as Python decodes them
_ESCAPED = re.compile(r"[\udc80-\udcff]")


@contextlib.contextmanager
def opened(
    path: Path,
    *kinds: str,
    most: int,
    progress: Callable[[int], object] = lambda _: None,
) -> Iterator["File"]:
    """A regular file, unpacked if it is packed (`.xz`, `.gz`), of at most so many
    bytes; `kinds` as `*.csv` for a hint.

    `progress` is called with the bytes of the file that have been read. Raises
    `InputError` with what cannot be read.
    """
    existing_file(path, *kinds)
    try:
        with path.open("rb") as raw:
            packed: dict[bytes, Any] = {
                b"\xfd7zXZ\0": lzma.open,
                b"\x1f\x8b": gzip.open,
            }
            start = raw.peek(8)
            unpack = next(
                (way for mark, way in packed.items() if start.startswith(mark)), None
            )
            yield File(
                path,
                raw if unpack is None else unpack(raw),
                most,
                lambda: progress(raw.tell()),
            )
    except (lzma.LZMAError, EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise input_error(
            str(path), f"cannot be unpacked: {error}", "it is cut off or damaged"
        ) from None
    except OSError as error:
        raise input_error(
            str(path), f"cannot be read: {error.strerror or error}"
        ) from None


class File:
    """A file while it is read; `remarks` say what was assumed."""

    def __init__(
        self, path: Path, stream: Any, most: int, progress: Callable[[], object]
    ) -> None:
        self.path = path
        self.head: bytes = stream.peek(4096)[:4096]
        self.remarks: list[str] = []
        self._stream: BinaryIO = stream
        self._most = most
        self._progress = progress

    def pieces(self, stream: Any = None) -> Iterator[Any]:
        """The bytes of the file, or the characters of a `stream` of them: a small
        packed file may be of any size."""
        left = self._most
        while piece := (stream or self._stream).read(PIECE):
            left -= len(piece)
            if left < 0:
                what = f"is larger than {self._most / 1e9:.2g} GB when it is unpacked"
                raise input_error(str(self.path), what, "split it")
            self._progress()
            yield piece

    def check_row(self, length: int) -> None:
        """Raise `InputError` for a row that no table has."""
        if length > _LONGEST_ROW:
            raise input_error(
                str(self.path),
                f"has a row of more than {_LONGEST_ROW >> 20} MB",
                "repair it",
            )

    @property
    def encoding(self) -> str | None:
        """The encoding that the first bytes show; `None` for UTF-8 or Latin-1."""
        if self.head.startswith((b"\xff\xfe", b"\xfe\xff")):
            return "utf-16"
        low = self.head[::2].count(0)
        high = self.head[1::2].count(0)
        if max(low, high) <= 0.2 * len(self.head):
            return None
        return "utf-16-le" if high > low else "utf-16-be"

    def lines(self) -> Iterator[list[str]]:
        """Lists of whole lines without their ends."""
        coded = self.encoding
        latin = "not UTF-8: read as Latin-1"
        rest = ""
        count = 1
        with io.TextIOWrapper(
            self._stream,
            coded or "utf-8-sig",
            "replace" if coded else "surrogateescape",
        ) as stream:
            for piece in self.pieces(stream):
                if latin in self.remarks or _ESCAPED.search(piece):
                    piece = piece.encode("utf-8", "surrogateescape").decode("latin-1")
                    self.remarks = [latin]
                *lines, rest = (rest + piece).split("\n")
                self.check_row(len(rest))
                count += len(lines)
                yield lines
        yield [rest]
        if rest.strip() and count > 1:
            cut = "has no end: if the file was cut off there, its last number is wrong"
            self.remarks.append(f"line {count}, the last, {cut}")


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line, which may be in quotes; between blanks if the separator is a
    blank."""
    if separator == " ":
        return (
            [cell.strip('"') for cell in re.findall(r'"[^"]*"|\S+', line)]
            if '"' in line
            else line.split()
        )
    try:
        return (
            next(csv.reader([line], delimiter=separator))
            if '"' in line
            else line.split(separator)
        )
    except (csv.Error, StopIteration):
        return line.split(separator)


class Rows:
    """Rows of text that become columns, a piece at a time; `word` calls a row in a
    message.

    - `texts`: columns that are kept as texts, by place
    - `ragged`: number of a row and count of its cells where these are not as many as
      there are columns
    - `odd`: by column, how many cells hold no number, the row of the first, and its
      text
    """

    def __init__(
        self,
        path: Path,
        count: int,
        separator: str,
        texts: Iterable[int],
        *,
        decimal: str = ".",
        word: str = "line",
    ) -> None:
        self.path = path
        self.count = count
        self.separator = separator
        self.word = word
        self.texts = {i: list[str]() for i in texts}
        self.ragged: list[tuple[int, int]] = []
        self.odd: dict[int, tuple[int, int, str]] = {}
        self._decimal = decimal
        self._pieces: list[list[np.ndarray]] = []

    def add(self, lines: Sequence[str], first: int) -> None:
        """Rows, of which the first has the number `first`; rows without text are left
        out."""
        empty = self.separator + " \t\r"
        kept: list[str] = []
        places: list[int] = []
        for place, line in enumerate(lines, first):
            if not line.strip(empty):
                continue
            quick = self.separator != " " and '"' not in line
            count = (
                line.count(self.separator) + 1
                if quick
                else len(cells_of(line, self.separator))
            )
            if count == self.count:
                kept.append(line)
                places.append(place)
            else:
                self.ragged.append((place, count))
        if kept:
            self._pieces.append([np.array(places), *self._parsed(kept, places)])

    def _parsed(self, lines: list[str], places: list[int]) -> Iterator[np.ndarray]:
        import pandas as pd

        blank = self.separator == " "
        try:
            frame: Any = pd.read_csv(
                io.StringIO("\n".join(lines)),
                sep=r"\s+" if blank else self.separator,
                skipinitialspace=not blank,
                header=None,
                names=list(range(self.count)),
                index_col=False,
                dtype=dict.fromkeys(self.texts, str),
                na_values=list(EMPTY),
                keep_default_na=False,
                skip_blank_lines=False,
                decimal=self._decimal,
                low_memory=False,
            )
        except (pd.errors.ParserError, ValueError):
            frame = ()
        if len(frame) != len(lines):
            at = next(
                (
                    place
                    for line, place in zip(lines, places, strict=True)
                    if line.count('"') % 2
                ),
                places[0],
            )
            where = f"{self.path} {self.word} {at}"
            raise input_error(
                where, "cannot be split into cells", "is a quote left open?"
            )
        for i in range(self.count):
            column = frame[i]
            if i in self.texts:
                self.texts[i] += column.fillna("").str.strip().tolist()
                yield np.empty(0)
            elif column.dtype.kind in "fiub":
                yield column.to_numpy(np.float64)
            else:
                texts = column.fillna("").astype(str).str.strip()
                numbers = pd.to_numeric(
                    texts.str.replace(self._decimal, ".", regex=False), errors="coerce"
                )
                values = np.asarray(numbers, np.float64)
                rows = np.flatnonzero(np.isnan(values) & ~texts.isin(EMPTY).to_numpy())
                if rows.size:
                    count, row, text = self.odd.get(
                        i, (0, places[rows[0]], texts.iloc[rows[0]])
                    )
                    self.odd[i] = count + rows.size, row, text
                yield values

    def finish(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """The number of each row, and the numbers (n,) of each column, NaN where it has
        none; none of texts."""
        columns = []
        for i in range(self.count + 1):
            columns.append(
                np.concatenate([piece[i] for piece in self._pieces] or [np.empty(0)])
            )
            for piece in self._pieces:
                piece[i] = np.empty(0)  # so that only one column is there twice
        return columns[0].astype(np.int64), columns[1:]
