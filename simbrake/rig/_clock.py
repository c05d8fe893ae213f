"""Times of a recording: ISO, date and clock, clock alone, or numbers, as seconds from the first row."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault
from .._base._table import unit
from ._formats import CLOCK, DATE, Table

_WHOLE = re.compile(rf"(?:(?P<date>{DATE})|(?P<digits>\d{{8}}))?[T ]*\s*(?P<clock>{CLOCK}|\d{{6}})?\s*(?P<zone>\S+)?")
_ISO = re.compile(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}(\.\d+)?(?P<zone>Z|[+-]\d{2}:\d{2})?")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DAY = 86400.0
#: seconds from 1970 to the first and behind the last time that has a date
_FIRST, _LAST = -62135596800.0, 253402300800.0
#: names of a column of times, the more certain ones first
_NAMES = (
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
)


class Times(NamedTuple):
    """Seconds (n,) of the rows, since 1970 if `dated`; `zone` is `Z` in a file with one; places of the used columns."""

    seconds: np.ndarray
    dated: bool
    zone: str
    used: tuple[int, ...]
    remarks: list[str]


def start_of(seconds: float, zone: str) -> str:
    """Time in ISO 8601 of the seconds since 1970."""
    text = datetime.fromtimestamp(round(seconds, 6), UTC).replace(tzinfo=None).isoformat()
    return f"{text}{zone}"


def times_of(table: Table, where: str, time: Sequence[str], faults: list[Fault]) -> Times | None:
    """Times of a table in the order of its rows; errors are added to `faults`, of which the caller makes a report.

    - `time`: names of the columns, and a format as `%d/%m/%Y` where a date may be read in two ways
    """
    with np.errstate(over="ignore"):
        times = _times_of(table, where, time, faults)
    if times is None:
        return None
    wrong = np.flatnonzero((times.seconds < _FIRST) | (times.seconds >= _LAST))
    if not wrong.size:
        return times
    what = "is outside of the years 1 to 9999"
    faults.append(Fault(f"{where} {table.row(wrong[0])}, time", what, "is it in the unit of its column?"))
    return None


def _times_of(table: Table, where: str, time: Sequence[str], faults: list[Fault]) -> Times | None:
    """Times as `times_of` has them, of any size."""
    columns = [name for name in time if "%" not in name]
    form = next((name for name in time if "%" in name), "")
    unknown = [name for name in columns if name not in table.names]
    if unknown:
        faults.append(Fault(f"time {', '.join(unknown)}", "is no column", f"there are: {', '.join(table.names)}"))
        return None
    places = [table.names.index(name) for name in columns] or _places(table)
    if not places:
        hint = "time='COLUMN', or time=('DATE', 'TIME'), says which it is"
        said = f": its index is {table.index_type!r}" if table.index_type else ""
        faults.append(Fault(where, f"has no usable time{said}", hint))
        return None
    if len(places) == 1 and places[0] not in table.texts:
        return _of_numbers(table, places[0], table.values[places[0]], where, faults)
    texts = [table.texts[i] for i in places if i in table.texts]
    if len(texts) != len(places):
        names = ", ".join(table.names[i] for i in places)
        faults.append(Fault(f"{where} columns {names}", "are no date and clock", "time=('DATE', 'TIME')"))
        return None
    if len(texts) == 1 and (numbers := _numbers(texts[0])) is not None:
        return _of_numbers(table, places[0], numbers, where, faults)
    joined = texts[0] if len(texts) == 1 else [" ".join(cells) for cells in zip(*texts, strict=True)]
    return _of_texts(table, places, joined, form, where, faults)


def _places(table: Table) -> list[int]:
    """Columns that hold the times: the file's index, date and clock, or the one that is named as a time."""

    def first(i: int) -> str:
        return next((cell.strip() for cell in table.texts[i] if cell.strip()), "")

    left_out = None
    if table.index is not None:
        kind = table.index_type.lower()
        depth = "depth" in kind or (not kind and table.names[table.index].upper() in ("DEPT", "DEPTH", "MD", "TVD"))
        if not depth:
            return _with_date(table, table.index, first)
        left_out = None if re.search(DATE, first(table.index)) else table.index
    named = {
        re.sub(r"[^A-Z]", "", name.upper()): i for i, name in reversed(list(enumerate(table.names))) if i != left_out
    }
    whole = [i for i in table.texts if re.fullmatch(rf"{DATE}[T ]\s*{CLOCK}.*", first(i))]
    if whole:
        best = [named[name] for name in _NAMES if named.get(name) in whole]
        return [(best or whole)[0]]
    clocks = [i for i in table.texts if re.fullmatch(CLOCK, first(i)) or _six(table, i, first(i))]
    if clocks:
        return _with_date(table, clocks[0], first)
    return next(([named[name]] for name in _NAMES if name in named), [])


def _with_date(table: Table, i: int, first: Any) -> list[int]:
    """A column of times, and before it that of dates where it holds clocks alone."""
    if i not in table.texts or re.search(DATE, first(i)):
        dates = [i for i in table.texts if re.fullmatch(DATE, first(i))]
        clocks = [k for k in table.texts if k != i and (re.fullmatch(CLOCK, first(k)) or _six(table, k, first(k)))]
        return [i, clocks[0]] if i in dates and clocks else [i]
    if re.fullmatch(CLOCK, first(i)) or _six(table, i, first(i)):
        dates = [k for k in table.texts if k != i and (re.fullmatch(DATE, first(k)) or _eight(table, k, first(k)))]
        return [dates[0], i] if dates else [i]
    return [i]


def _six(table: Table, i: int, text: str) -> bool:
    return bool(re.fullmatch(r"\d{6}", text)) and "TIME" in table.names[i].upper()


def _eight(table: Table, i: int, text: str) -> bool:
    return bool(re.fullmatch(r"\d{8}", text)) and "DATE" in table.names[i].upper()


def _numbers(texts: list[str]) -> np.ndarray | None:
    """Texts that are all plain numbers, as of a column that is called TIME."""
    if not all(re.fullmatch(r"\s*-?\d*[.,]?\d*(?:[eE][-+]?\d+)?\s*", text) for text in texts[:20]):
        return None
    if all(re.fullmatch(r"\s*\d\d[0-5]\d[0-5]\d\s*", text) for text in texts[:200]):
        return None  # 052324 is a clock
    try:
        return np.array([float(text.replace(",", ".")) if text.strip() else np.nan for text in texts])
    except ValueError:
        return None


def _of_numbers(table: Table, i: int, x: np.ndarray, where: str, faults: list[Fault]) -> Times | None:
    name, text = table.names[i], table.units[i]
    place = f"{where} column {name}"
    bad = np.flatnonzero(~np.isfinite(x) | np.isin(x, table.nulls))
    if bad.size:
        faults.append(Fault(f"{where} {table.row(bad[0])}, column {name}", "has no time", _more(bad.size)))
        return None
    plain = text.strip().lower()
    remarks: list[str] = []
    if plain in ("d", "day", "days") or (not plain and 2e4 < x[0] < 8e4):
        excel = 2e4 < x[0] < 8e4
        remarks += [f"{name}: days since 1899-12-30, as spreadsheets count them"] if excel else []
        return Times((x - (25569.0 if excel else 0.0)) * _DAY, excel, "", (i,), remarks)
    words = {"sec": "s", "secs": "s", "second": "s", "seconds": "s", "hr": "h", "hrs": "h", "hour": "h", "hours": "h"}
    words |= {"minute": "min", "minutes": "min", "mins": "min", "msec": "ms", "unitless": "", "-": "", "none": ""}
    try:
        seconds = x * float(
            unit(words.get(plain, text.strip() if plain not in ("s", "ms", "min", "h") else plain), "s").factor
        )
    except ValueError as error:
        faults.append(Fault(place, f"{text!r} is not a unit of time", str(error)))
        return None
    if not words.get(plain, plain):
        milli = 8e11 < x[0] < 4e12
        remarks.append(f"{name}: no unit, taken as {'milliseconds' if milli else 'seconds'}")
        seconds = x * (1e-3 if milli else 1.0)
    dated = bool(8e8 < seconds[0] < 4e9)
    if dated:
        remarks.append(f"{name}: seconds since 1970-01-01 (UTC)")
    return Times(seconds, dated, "Z" if dated else "", (i,), remarks)


def _more(count: int) -> str:
    return "every row needs its time" + (f"; {count} rows have none" if count > 1 else "")


def _of_texts(
    table: Table, places: list[int], texts: list[str], form: str, where: str, faults: list[Fault]
) -> Times | None:
    names = " and ".join(table.names[i] for i in places)
    start = _ISO.fullmatch(texts[0].strip()) if texts else None
    if start is not None and not form and (seconds := _iso(texts)) is not None:
        return Times(seconds, True, "Z" if start["zone"] else "", tuple(places), [])
    matches = [_WHOLE.fullmatch(text.strip()) for text in texts]
    bad = [i for i, match in enumerate(matches) if match is None or match["clock"] is None]
    if bad:
        text = texts[bad[0]].strip()
        faults.append(Fault(f"{where} {table.row(bad[0])}, column {names}", f"{text!r} is no time", _more(len(bad))))
        return None
    clock = np.array([_clock(match["clock"]) for match in matches])  # pyright: ignore
    dates = [match["date"] or match["digits"] or "" for match in matches]  # pyright: ignore
    remarks: list[str] = []
    if not all(dates):
        turns = np.concatenate([[0], np.cumsum(np.diff(clock) < -_DAY / 2)])
        if turns[-1]:
            remarks.append(f"{names}: a clock without date that passes midnight {turns[-1]} times")
        return Times(clock + _DAY * turns, False, "", tuple(places), remarks)
    days, said = _days(dates, form)
    if days is None:
        faults.append(Fault(f"{where} column {names}", said, "time=('COLUMN', '%d/%m/%Y') says how to read it"))
        return None
    remarks += [f"{names}: {said}"] if said else []
    zones = {match["zone"] for match in matches}  # pyright: ignore
    shift, utc = _zone(zones.pop() if len(zones) == 1 else "")
    if zones:
        remarks.append(f"{names}: several time zones, left out")
    return Times(days * _DAY + clock - shift, True, "Z" if utc else "", tuple(places), remarks)


def _iso(texts: list[str]) -> np.ndarray | None:
    """Seconds since 1970 of times in ISO 8601; `None` where one is not."""
    import pandas as pd

    try:
        stamps = pd.to_datetime(pd.Series(texts), format="ISO8601", utc=True)
    except (ValueError, TypeError):
        return None
    if stamps.isna().any():
        return None
    return stamps.dt.as_unit("us").astype("int64").to_numpy() / 1e6


def _clock(text: str) -> float:
    """Seconds since midnight."""
    if text.isdigit():
        return int(text[:2]) * 3600.0 + int(text[2:4]) * 60.0 + int(text[4:])
    half = text[-2:].lower() if text[-1].isalpha() else ""
    hours, minutes, *rest = text.removesuffix(text[-2:] if half else "").strip().split(":")
    hour = int(hours) % 12 + 12 * (half == "pm") if half else int(hours)
    return hour * 3600.0 + int(minutes) * 60.0 + (float(rest[0].replace(",", ".")) if rest else 0.0)


def _zone(text: str | None) -> tuple[float, bool]:
    """Seconds east of UTC, and whether a zone is named."""
    match = re.fullmatch(r"([+-])(\d{2}):?(\d{2})", text or "")
    if match:
        return (1 if match[1] == "+" else -1) * (int(match[2]) * 3600.0 + int(match[3]) * 60.0), True
    return 0.0, (text or "").upper() in ("Z", "UTC")


def _days(texts: list[str], form: str) -> tuple[np.ndarray | None, str]:
    """Days since 1970 of each date, and how they were read, or why they cannot be."""
    distinct = list(dict.fromkeys(texts))
    parts = [re.split(r"[-/. ]", text) for text in distinct]
    if all(len(text) == 8 and text.isdigit() for text in distinct):
        orders, said = ["ymd"], ""
        parts = [[text[:4], text[4:6], text[6:]] for text in distinct]
    elif form:
        letters = re.findall(r"%([dmbyY])", form)
        order = "".join(letters).lower().replace("b", "m")
        if sorted(order) != ["d", "m", "y"]:
            return None, f"{form!r} has no day, month and year"
        orders, said = [order], ""
    elif len(parts[0][0]) == 4:
        orders, said = ["ymd"], ""
    elif parts[0][1].isalpha():
        orders, said = ["dmy"], ""
    else:
        orders, said = ["dmy", "mdy"] if "." in distinct[0] else ["mdy", "dmy"], ""
    read = {order: days for order in orders if (days := _numbered(parts, order)) is not None}
    read = {order: days for order, days in read.items() if np.all(np.diff(days) >= 0)} or read
    if not read:
        return None, f"{distinct[0]!r} is no date"
    order = min(read, key=lambda order: (np.ptp(read[order]), orders.index(order)))
    if len(read) > 1 and np.ptp(read[orders[0]]) == np.ptp(read[orders[1]]):
        spelled = {"d": "day", "m": "month", "y": "year"}
        said = f"{distinct[0]} read as {', '.join(spelled[x] for x in order)}, which the log does not decide"
    number = dict(zip(distinct, read[order], strict=True))
    return np.array([number[text] for text in texts], float), said


def _numbered(parts: list[list[str]], order: str) -> np.ndarray | None:
    days = []
    for cells in parts:
        try:
            of = dict(zip(order, cells, strict=True))
            month = _MONTHS.index(of["m"][:3].lower()) + 1 if of["m"].isalpha() else int(of["m"])
            year = int(of["y"]) + (2000 if len(of["y"]) <= 2 else 0)
            days.append(datetime(year, month, int(of["d"])).toordinal() - 719163)
        except (ValueError, KeyError):
            return None
    return np.array(days)
