"""Times of a recording: dates and clocks, clocks alone, or numbers, as seconds from the
first row."""

import dataclasses
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Issues
from .._base._units import unit
from ._formats import Table
from ._grammar import (
    TimeParts,
    day_of,
    east_of,
    forms,
    is_date_name,
    is_open,
    says_time,
    seconds_of,
    time_parts,
)

_ISO = re.compile(
    r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}(?:\.\d+)?(?P<zone>Z|[+-]\d{2}:\d{2})?"
)
#: parts of a format of `strptime` that say a clock, a year, a month, a day
_OF_CLOCKS, _OF_YEARS, _OF_MONTHS, _OF_DAYS = (
    set(x) for x in ("HIMSpfXc", "yYcx", "mbBjcx", "djcx")
)
_DAY = 86400.0
#: seconds from 1970 to the first and after the last time that has a date
_FIRST = -62135596800.0
_LAST = 253402300800.0
#: names of a column of times, the more certain ones first
_NAMES = [
    "DATETIME",
    "TIMESTAMP",
    "TIME",
    "RIGTIME",
    "ETIM",
    "ELAPSEDTIME",
    "ELAPSED",
    "SECONDS",
    "T",
    "CLOCK",
    "INDEX",
]


class Times(NamedTuple):
    """Seconds (n,) of the rows, since 1970 if `dated`; `zone` is `Z` in a file with
    one; places of the used columns."""

    seconds: np.ndarray
    dated: bool
    zone: str
    used: tuple[int, ...]
    remarks: list[str]


def start_of(seconds: float, zone: str) -> str:
    """Time in ISO 8601 of the seconds since 1970."""
    text = (
        datetime.fromtimestamp(round(seconds, 6), UTC).replace(tzinfo=None).isoformat()
    )
    return f"{text}{zone}"


def times_of(
    table: Table, where: str, time: Sequence[str], faults: Issues
) -> Times | None:
    """Times of a table in the order of its rows; errors are added to `faults`, of which
    the caller makes a report.

    - `time`: names of the columns, and a format of `strptime` for the whole time, or
      for its date alone
    """
    with np.errstate(over="ignore"):
        times = _times_of(table, where, time, faults)
    if times is None:
        return None
    wrong = np.flatnonzero((times.seconds < _FIRST) | (times.seconds >= _LAST))
    if not wrong.size:
        return times
    what = "is outside of the years 1 to 9999"
    faults.add(
        f"{where} {table.row(wrong[0])}, time", what, "is it in the unit of its column?"
    )
    return None


def _times_of(
    table: Table, where: str, time: Sequence[str], faults: Issues
) -> Times | None:
    """Times as `times_of` has them, of any size."""
    columns = [name for name in time if name in table.names or "%" not in name]
    form = " ".join(name for name in time if name not in columns)
    unknown = [name for name in columns if name not in table.names]
    if unknown:
        faults.add(
            f"time {', '.join(unknown)}",
            "is no column",
            f"there are: {', '.join(table.names)}",
        )
        return None
    places = [table.names.index(name) for name in columns] or _places(table)
    if not places:
        hint = "time='COLUMN', or time=('DATE', 'TIME'), says which it is"
        index = f": its index is {table.index_type!r}" if table.index_type else ""
        faults.add(where, f"has no usable time{index}", f"{hint}; {forms()}")
        return None
    if len(places) == 1 and places[0] not in table.texts and not form:
        return _of_numbers(table, places[0], table.values[places[0]], where, faults)
    texts = [table.texts[i] for i in places if i in table.texts]
    if len(texts) != len(places):
        names = ", ".join(table.names[i] for i in places)
        what = (
            "are no date and clock"
            if len(places) > 1
            else f"holds numbers, which {form!r} does not read"
        )
        faults.add(
            f"{where} column{'s' * (len(places) > 1)} {names}",
            what,
            "time=('DATE', 'TIME')",
        )
        return None
    if len(texts) == 1 and not form and (numbers := _numbers(texts[0])) is not None:
        return _of_numbers(table, places[0], numbers, where, faults)
    joined = (
        texts[0]
        if len(texts) == 1
        else [" ".join(cells) for cells in zip(*texts, strict=True)]
    )
    found = _Texts(
        table, places, [text.strip() for text in joined], where, faults
    ).times(form)
    if found is not None and not found.dated and not columns:
        _unread_date(table, places, where, faults)
    return found


def _first(table: Table, i: int) -> str:
    return next((cell.strip() for cell in table.texts.get(i, ()) if cell.strip()), "")


def _parts_in(table: Table, i: int) -> tuple[bool, bool]:
    """Whether a column has dates, and whether it has clocks, by its first cell; of
    digits alone its name decides."""
    text = _first(table, i)
    name = table.names[i].upper()
    cell = time_parts(text)
    if cell is None:
        return False, False
    if not says_time(text):
        return "DATE" in name and bool(cell.date), "TIME" in name and bool(cell.clock)
    return bool(cell.date), bool(cell.clock)


def _places(table: Table) -> list[int]:
    """Columns that hold the times: the file's index, date and clock, or the one that is
    named as a time."""
    parts = {i: _parts_in(table, i) for i in table.texts}
    dates = sorted(
        (i for i, has in parts.items() if has == (True, False)),
        key=lambda i: (
            table.names[i].upper() != "DATE",
            not is_date_name(table.names[i]),
        ),
    )
    clocks = [i for i, has in parts.items() if has == (False, True)]

    def with_other(i: int) -> list[int]:
        """A column, and that of the dates or clocks which it lacks, dates first."""
        if i in dates:
            return [i, *clocks[:1]]
        return [*dates[:1], i] if i in clocks else [i]

    left_out = None
    if table.index is not None:
        kind = table.index_type.lower()
        depth = "depth" in kind or (
            not kind
            and table.names[table.index].upper() in ("DEPT", "DEPTH", "MD", "TVD")
        )
        if not depth:
            return with_other(table.index)
        left_out = None if parts.get(table.index, (False,))[0] else table.index
    named = {
        re.sub(r"[^A-Z]", "", name.upper()): i
        for i, name in reversed(list(enumerate(table.names)))
        if i != left_out
    }
    whole = [i for i, has in parts.items() if all(has)]
    if whole:
        best = [named[name] for name in _NAMES if named.get(name) in whole]
        return [(best or whole)[0]]
    if clocks:
        return with_other(clocks[0])
    return next(([named[name]] for name in _NAMES if name in named), [])


def _unread_date(table: Table, used: Sequence[int], where: str, faults: Issues) -> None:
    """An error for a column of dates beside clocks that is not understood."""
    for i, name in enumerate(table.names):
        if i in used or not is_date_name(name):
            continue
        numbers = table.values[i][np.isfinite(table.values[i])]
        text = _first(table, i) or (f"{numbers[0]:.15g}" if numbers.size else "")
        if text:
            clock = table.names[used[0]]
            hint = (
                f"time=({name!r}, {clock!r}, '%d/%m/%Y') says how to read it, "
                f"time={clock!r} leaves it out"
            )
            faults.add(
                f"{where} column {name}", f"{text!r} is no date", f"{forms()}; {hint}"
            )
            return


def _numbers(texts: list[str]) -> np.ndarray | None:
    """Texts that are all plain numbers, as of a column that is called TIME."""
    if not all(
        re.fullmatch(r"\s*-?\d*[.,]?\d*(?:[eE][-+]?\d+)?\s*", text)
        for text in texts[:20]
    ):
        return None
    if all(re.fullmatch(r"\s*\d\d[0-5]\d[0-5]\d\s*", text) for text in texts[:200]):
        return None  # 052324 is a clock
    if all(map(says_time, (text.strip() for text in texts[:200]))):
        return None  # 20200129052324 is a date and a clock
    try:
        return np.array(
            [
                float(text.replace(",", ".")) if text.strip() else np.nan
                for text in texts
            ]
        )
    except ValueError:
        return None


def _of_numbers(
    table: Table, i: int, x: np.ndarray, where: str, faults: Issues
) -> Times | None:
    name = table.names[i]
    text = table.units[i]
    place = f"{where} column {name}"
    missing = ~np.isfinite(x) | np.isin(x, table.nulls)
    # (a time of 0 begins a recording, also where 0 means no value)
    missing[:1] &= x[:1] != 0.0
    bad = np.flatnonzero(missing)
    if bad.size:
        more = f"; {bad.size} rows have none" if bad.size > 1 else ""
        faults.add(
            f"{where} {table.row(bad[0])}, column {name}",
            "has no time",
            f"every row needs its time{more}",
        )
        return None
    plain = text.strip().lower()
    remarks: list[str] = []
    if plain in ("d", "day", "days") or (not plain and 2e4 < x[0] < 8e4):
        excel = 2e4 < x[0] < 8e4
        remarks += (
            [f"{name}: days since 1899-12-30, as spreadsheets count them"]
            if excel
            else []
        )
        return Times((x - (25569.0 if excel else 0.0)) * _DAY, excel, "", (i,), remarks)
    plain = "" if plain in ("unitless", "-", "none") else plain
    try:
        seconds = x * float(unit(plain, "s").factor)
    except ValueError as error:
        faults.add(place, f"{text!r} is not a unit of time", str(error))
        return None
    if not plain:
        milli = 8e11 < x[0] < 4e12
        remarks.append(
            f"{name}: no unit, taken as {'milliseconds' if milli else 'seconds'}"
        )
        seconds = x * (1e-3 if milli else 1.0)
    dated = bool(8e8 < seconds[0] < 4e9)
    if dated:
        remarks.append(f"{name}: seconds since 1970-01-01 (UTC)")
    return Times(seconds, dated, "Z" if dated else "", (i,), remarks)


#: days since 1970 of each distinct date, `None` where there is no such day
_Days = list[int | None]


@dataclasses.dataclass
class _Texts:
    """Times as texts (n,) of one or more columns on their way to seconds; errors go to
    `faults`."""

    table: Table
    places: Sequence[int]
    texts: list[str]
    where: str
    faults: Issues

    @property
    def names(self) -> str:
        return " and ".join(self.table.names[i] for i in self.places)

    def times(self, form: str) -> Times | None:
        """Times by a format of `strptime` for the whole or for the dates alone, or else
        by the grammar."""
        if set(re.findall(r"%(.)", form)) & _OF_CLOCKS:
            return self._formatted(form)
        iso = [] if form else [_ISO.fullmatch(text) for text in self.texts]
        if (
            iso
            and None not in iso
            and len({match["zone"] is None for match in iso}) == 1  # pyright: ignore
        ):
            stamps = self._stamps(self.texts, "ISO8601")
            if not np.isnan(stamps).any():
                return self._made(stamps, dated=True, zone=iso[0]["zone"] is not None)  # pyright: ignore
        return self._by_grammar(form)

    def _made(
        self,
        seconds: np.ndarray,
        *,
        dated: bool,
        zone: bool,
        remarks: Sequence[str] = (),
    ) -> Times:
        """Times of rows; clocks alone go on after midnight."""
        remarks = [f"{self.names}: {remark}" for remark in remarks]
        if not dated:
            turns = np.append(0, np.cumsum(np.diff(seconds) < -_DAY / 2))
            seconds = seconds + _DAY * turns
            if turns[-1]:
                remarks.append(
                    f"{self.names}: a clock without date that passes midnight {turns[-1]} times"
                )
        return Times(
            seconds, dated, "Z" if dated and zone else "", tuple(self.places), remarks
        )

    def _wrong(self, rows: Sequence[int] | np.ndarray, what: str, hint: str) -> None:
        """An error of rows, of which the first is named."""
        many = f"; {len(rows)} rows are so" if len(rows) > 1 else ""
        self.faults.add(
            f"{self.where} {self.table.row(rows[0])}, column {self.names}",
            what,
            f"{hint}{many}".lstrip("; "),
        )

    @property
    def _way_out(self) -> str:
        names = ", ".join(repr(self.table.names[i]) for i in self.places)
        return f"{forms()}; else time=({names}, '%H:%M:%S %d/%m/%Y') gives its format"

    # --- by a format -----------------------------------------------------------------

    def _stamps(self, texts: Sequence[str], form: str) -> np.ndarray:
        """Seconds since 1970 by a format, NaN where a text does not fit; raises
        `ValueError` for what is no format."""
        import pandas as pd

        cells = pd.Series(texts, dtype=object)
        read: Any = pd.to_datetime(
            cells.where(cells.str.contains(r"\d")),
            format=form,
            errors="coerce",
            utc=True,
        )
        return np.where(
            read.isna(), np.nan, read.dt.as_unit("us").astype("int64").to_numpy() / 1e6
        )

    def _formatted(self, form: str) -> Times | None:
        """Times that all fit a format with a clock."""
        parts = set(re.findall(r"%(.)", form))
        dated = [bool(parts & of) for of in (_OF_YEARS, _OF_MONTHS, _OF_DAYS)]
        try:
            stamps = self._stamps(self.texts, form)
        except ValueError as error:
            self.faults.add(
                "time", f"{form!r} is no format: {error}", "as '%d/%m/%Y %H:%M:%S'"
            )
            return None
        if any(dated) and not all(dated):
            self.faults.add(
                "time", f"{form!r} has no day, month and year", "as '%d/%m/%Y %H:%M:%S'"
            )
            return None
        bad = np.flatnonzero(np.isnan(stamps))
        if bad.size:
            return self._wrong(
                bad,
                f"{self.texts[bad[0]]!r} does not fit {form!r}",
                "every row is read by this format",
            )
        if not any(dated):
            stamps = stamps % _DAY
        return self._made(stamps, dated=any(dated), zone=bool(parts & {"z", "Z"}))

    # --- by the grammar --------------------------------------------------------------

    def _by_grammar(self, form: str) -> Times | None:
        """Times by the grammar, of which a format may give that of the dates."""
        every = [time_parts(text, *([".*?"] if form else ())) for text in self.texts]
        clocks = [
            None if cell is None or not cell.clock else seconds_of(cell.clock)
            for cell in every
        ]
        most = _DAY if any(cell.date for cell in every if cell) else np.inf
        bad = [i for i, clock in enumerate(clocks) if clock is None or clock > most]
        if bad:
            text = self.texts[bad[0]]
            cell = every[bad[0]]
            bare = (
                "has no clock" if cell is not None and not cell.clock else "is no time"
            )
            return self._wrong(
                bad, f"{text!r} {bare}" if text else "has no time", self._way_out
            )
        whole: list[TimeParts] = every  # pyright: ignore
        bare = [i for i, cell in enumerate(whole) if not cell.date]
        if bare and len(bare) < len(whole):
            return self._wrong(
                bare,
                f"{self.texts[bare[0]]!r} has no date, as other rows have",
                self._way_out,
            )
        clock = np.array(clocks, float)
        remarks = list[str]()
        if bare and clock.max() >= _DAY + 3600.0:
            remarks.append("hours above 24 count from the start")
        days = (
            self._days([cell.date for cell in whole], form, remarks)
            if not bare
            else np.zeros(len(whole))
        )
        if days is None:
            return None
        local = days * _DAY + clock
        zones = [cell.zone for cell in whole]
        east = self._east(zones, local)
        for name in sorted(
            {zone.upper() for zone in zones if zone.isalpha()}
            - {"Z", "UT", "UTC", "GMT"}
        ):
            remarks.append(
                f"{name} read as UTC{(east_of(name, 0.0) or 0.0) / 3600.0:+g}"
            )
        return (
            None
            if east is None
            else self._made(
                local - east, dated=not bare, zone=bool(whole[0].zone), remarks=remarks
            )
        )

    def _east(self, zones: list[str], local: np.ndarray) -> np.ndarray | None:
        """Seconds by which each row is ahead of UTC."""
        if not any(zones):
            return np.zeros(local.size)
        same = {
            zone: east_of(zone, 0.0) for zone in set(zones) if zone and "/" not in zone
        }
        east = [
            None if not zone else same.get(zone, east_of(zone, at))
            for zone, at in zip(zones, local, strict=True)
        ]
        bad = [i for i, seconds in enumerate(east) if seconds is None]
        if bad:
            zone = zones[bad[0]]
            what = (
                f"{zone!r} is no time zone"
                if zone
                else f"{self.texts[bad[0]]!r} has no time zone, as other rows have"
            )
            return self._wrong(bad, what, self._way_out)
        return np.array(east, float)

    def _days(
        self, dates: list[str], form: str, remarks: list[str]
    ) -> np.ndarray | None:
        """Days since 1970 of each row by the format of a date, or in the order of day,
        month and year that fits all."""
        distinct = list(dict.fromkeys(dates))
        if form:
            try:
                found = self._stamps(distinct, form) / _DAY
            except ValueError as error:
                self.faults.add(
                    "time", f"{form!r} is no format: {error}", "as '%d/%m/%Y'"
                )
                return None
            order = ""
            days: _Days = [None if np.isnan(day) else int(day) for day in found]
        else:
            order, days = self._ordered(distinct, remarks)
        number = dict(zip(distinct, days, strict=True))
        bad = [i for i, date in enumerate(dates) if number[date] is None]
        if not bad:
            return np.array([number[date] for date in dates], float)
        text = dates[bad[0]]
        what = f"{text!r} does not fit {form!r}" if form else f"{text!r} is no date"
        if order and any(day is not None for day in days):
            what += f" in the order {_spelled(order)} of the others"
        return self._wrong(
            bad, what, "every row is read by this format" if form else self._way_out
        )

    def _ordered(self, dates: list[str], remarks: list[str]) -> tuple[str, _Days]:
        """Distinct dates in the order of their numbers that fits best: all of them,
        then that in which they follow."""
        if not any(map(is_open, dates)):
            return "", [day_of(date, "") for date in dates]
        example = next(date for date in dates if is_open(date))
        orders = ["dmy", "mdy", "ymd"] if "." in example else ["mdy", "dmy", "ymd"]
        read: dict[str, _Days] = {
            order: [day_of(date, order) for date in dates] for order in orders
        }
        whole: dict[str, Any] = {
            order: days for order, days in read.items() if None not in days
        }
        if not whole:
            return min(read.items(), key=lambda pair: pair[1].count(None))
        told = self._order_of_file
        if told in whole:
            return told, whole[told]
        # the dates follow each other, forwards or backwards
        likely = {
            order: days
            for order, days in whole.items()
            if days in (sorted(days), sorted(days)[::-1])
        } or whole
        spans = {order: max(days) - min(days) for order, days in likely.items()}
        best = min(spans, key=spans.__getitem__)  # the first of equal ones
        if any(days != whole[best] for days in whole.values()):
            open_ = list(spans.values()).count(spans[best]) > 1
            why = (
                "which the log does not decide"
                if open_
                else "so that the dates follow each other closely"
            )
            remarks.append(f"{example} read as {_spelled(best)}, {why}")
        return best, whole[best]

    @property
    def _order_of_file(self) -> str:
        """The order in which name, unit or description of the column say that its dates
        are, as `DD/MM/YYYY`."""
        table = self.table
        part = r"(d{1,2}|m{1,3}|y{2,4})"
        for i in self.places:
            words = f"{table.names[i]} {table.units[i]} {table.descriptions[i]}".lower()
            for match in re.finditer(
                rf"(?<![a-z]){part}[-/. ]?{part}[-/. ]?{part}", words
            ):
                order = "".join(x[0] for x in match.groups())
                if sorted(order) == ["d", "m", "y"]:
                    return order
        return ""


def _spelled(order: str) -> str:
    return ", ".join({"d": "day", "m": "month", "y": "year"}[x] for x in order)
