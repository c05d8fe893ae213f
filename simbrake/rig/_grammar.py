"""Texts that say a time: the forms of dates, clocks and zones that loggers write, each
by an example."""

import functools
import re
from datetime import datetime, timedelta
from typing import NamedTuple
from zoneinfo import ZoneInfo

_MONTHS = [
    "jan(?:uary)?",
    "feb(?:ruary)?",
    "mar(?:ch)?",
    "apr(?:il)?",
    "may",
    "june?",
    "july?",
    "aug(?:ust)?",
    "sept?(?:ember)?",
    "oct(?:ober)?",
    "nov(?:ember)?",
    "dec(?:ember)?",
]
_WEEKDAYS = [
    "mon",
    "tue(?:s)?",
    "wed(?:nes)?",
    "thu(?:rs?)?",
    "fri",
    "sat(?:ur)?",
    "sun",
]
_MONTH = f"(?:{'|'.join(_MONTHS)})"
_WEEKDAY = rf"(?:(?P<weekday>(?:{'|'.join(_WEEKDAYS)})(?:day)?)\.?,?\s*)?"
#: dates by an example; of `a`, `b`, `c` only the column as a whole tells which is the
#: day
DATES = {
    "2020-01-29": rf"{_WEEKDAY}(?P<y>\d{{4}})[-/. ](?P<m>\d{{1,2}}|{_MONTH})[-/. ](?P<d>\d{{1,2}})",
    "29/01/2020": rf"{_WEEKDAY}(?P<a>\d{{1,2}})[-/.](?P<b>\d{{1,2}})[-/.](?P<c>\d{{4}}|\d{{2}})",
    "29-Jan-2020": (
        rf"{_WEEKDAY}(?P<d>\d{{1,2}})(?:st|nd|rd|th|\.)?[-/ ]?(?P<m>{_MONTH})[-/., ]{{0,2}}(?P<y>\d{{4}}|\d{{2}})"
    ),
    "Wed Jan 29, 2020": (
        rf"{_WEEKDAY}(?P<m>{_MONTH})[-/. ]{{0,2}}(?P<d>\d{{1,2}})(?:st|nd|rd|th)?[-/, ]{{1,2}}(?P<y>\d{{4}})"
    ),
    "20200129": r"(?P<y>(?:19|20)\d{2})(?P<m>\d{2})(?P<d>\d{2})",
}
#: clocks by an example
CLOCKS = {
    "03:00:00.5": r"(?P<hour>\d{1,3}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d+|:\d{3})?)",
    "03:00": r"(?P<hour>\d{1,3}):(?P<minute>\d{2})",
    "03.00.00": r"(?P<hour>\d{1,2})\.(?P<minute>\d{2})\.(?P<second>\d{2}(?:[.,]\d+)?)",
    "3:00:00 am": r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}(?:[.,]\d+)?))?\s*(?P<half>[ap])\.?m\.?",
    "030000": r"(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2}(?:[.,]\d+)?)",
}
#: hours east of UTC of the zones that an abbreviation names
_ABBREVIATIONS = {
    0: "Z UT UTC GMT WET",
    1: "WEST BST CET",
    2: "CEST EET",
    3: "EEST MSK",
    -4: "EDT",
    -5: "EST CDT",
    -6: "CST MDT",
    -7: "MST PDT",
    -8: "PST",
}
_EAST = {
    name: hours for hours, names in _ABBREVIATIONS.items() for name in names.split()
}
#: zones by an example
ZONES = {
    "Z": "Z",
    "+01:00": r"(?:UTC|GMT)?\s*(?P<sign>[-+\u2212])(?P<hours>\d{1,2})(?::?(?P<minutes>\d{2}))?",
    "CET": rf"(?P<name>{'|'.join(_EAST)})",
    "Europe/Oslo": r"(?P<place>[a-z]+(?:/[a-z_]+)+)",
}


def _any(forms: dict[str, str]) -> str:
    """A pattern of all forms, without the names of their parts."""
    return (
        "(?:"
        + "|".join(re.sub(r"\(\?P<\w+>", "(?:", form) for form in forms.values())
        + ")"
    )


def _patterns(forms: dict[str, str]) -> list[re.Pattern[str]]:
    return [re.compile(form, re.IGNORECASE) for form in forms.values()]


_DATES = _patterns(DATES)
_CLOCKS = _patterns(CLOCKS)
_ZONES = _patterns(ZONES)


@functools.cache
def _wholes(date: str) -> list[re.Pattern[str]]:
    """Patterns of times with dates as `date`: before the clock, after it, or around it
    as in `Jan 29 03:00 2020`."""
    clock = rf"(?P<clock>{_any(CLOCKS)})(?:\s*[(\[]?(?P<zone>{_any(ZONES)})[)\]]?)?"
    between = r"(?:\s*[T,;_:/-]\s*|\s+|(?<=\d{8})(?=\d{6}))"
    first = rf"(?P<date>{date})(?:{between}{clock})?"
    last = rf"{clock}(?:{between}(?P<date>{date}))?"
    around = rf"(?P<date>{re.sub('P<weekday>', ':', _WEEKDAY)}{_MONTH} +\d{{1,2}})\s+{clock}\s+(?P<year>\d{{4}})"
    return [re.compile(whole, re.IGNORECASE) for whole in (first, last, around)]


class TimeParts(NamedTuple):
    """The parts of a text that says a time, empty where it lacks them."""

    date: str
    clock: str
    zone: str


def time_parts(text: str, date: str = _any(DATES)) -> TimeParts | None:
    """The parts of a time, of which all of the text is one; `None` where it is none;
    `date` is the pattern of dates."""
    found = None
    for pattern in _wholes(date):
        match = pattern.fullmatch(text)
        if match is not None and (found is None or match["clock"]):
            day = " ".join(filter(None, (match["date"], match.groupdict().get("year"))))
            found = TimeParts(day, match["clock"] or "", match["zone"] or "")
            if found.clock:
                break
    return found


def is_date_name(name: str) -> bool:
    """Whether a column is called a date."""
    letters = re.sub(r"[^A-Z]", "", name.upper())
    return bool(re.search(r"^DATE|(?<!UP)DATE$|YYYYMMDD|DDMMYY|MMDDYY|YYMMDD", letters))


def says_time(text: str) -> bool:
    """Whether a cell is a time by its looks: a number is one only where it is a date
    and a clock."""
    cell = time_parts(text)
    return cell is not None and (
        bool(cell.date and cell.clock) or not re.fullmatch(r"\d+[.,]?\d*", text)
    )


def forms() -> str:
    """All accepted forms, in words."""
    dates, clocks, zones = (" | ".join(kind) for kind in (DATES, CLOCKS, ZONES))
    return (
        f"accepted: dates as {dates} (with - / or . between, also after the name of "
        f"their day), clocks as {clocks}, one after the other in any order, after the "
        f"clock its zone as {zones}; or numbers in a unit of time"
    )


def _parts(patterns: list[re.Pattern[str]], text: str) -> dict[str, str]:
    return next(
        {k: x for k, x in m.groupdict().items() if x}
        for p in patterns
        if (m := p.fullmatch(text))
    )


def is_open(date: str) -> bool:
    """Whether a date may be read in several ways."""
    return "a" in _parts(_DATES, date)


def day_of(date: str, order: str) -> int | None:
    """Days since 1970 of a date, its numbers in an `order` as `dmy` where it is open;
    `None` where it is no day."""
    of = _parts(_DATES, date)
    if "a" in of:
        of |= dict(zip(order, (of["a"], of["b"], of["c"]), strict=True))
    names = [month[:3] for month in _MONTHS]
    month = int(of["m"]) if of["m"].isdigit() else names.index(of["m"][:3].lower()) + 1
    year = int(of["y"])
    if len(of["y"]) <= 2:
        year += 1900 if year >= 69 else 2000  # as POSIX does
    try:
        at = datetime(year, month, int(of["d"]))
    except ValueError:
        return None
    weekday = of.get("weekday", _WEEKDAYS[at.weekday()])
    return (
        at.toordinal() - 719163
        if _WEEKDAYS[at.weekday()].startswith(weekday[:3].lower())
        else None
    )


def seconds_of(clock: str) -> float | None:
    """Seconds since midnight, of more than a day too; `None` where a clock never shows
    it."""
    of = _parts(_CLOCKS, clock)
    hour = int(of["hour"])
    minute = int(of["minute"])
    second = float(re.sub("[:,]", ".", of.get("second", "0")))
    if "half" in of:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + 12 * (of["half"].lower() == "p")
    # (60 is a leap second)
    return (
        hour * 3600.0 + minute * 60.0 + second if minute < 60 and second < 61 else None
    )


def east_of(zone: str, local: float) -> float | None:
    """Seconds by which a zone is ahead of UTC at a `local` time (s since 1970); `None`
    where there is no such zone."""
    of = _parts(_ZONES, zone)
    if "sign" in of:
        hours = int(of["hours"])
        minutes = int(of.get("minutes", "0"))
        size = hours * 3600.0 + minutes * 60.0
        return (
            (size if of["sign"] == "+" else -size)
            if hours < 15 and minutes < 60
            else None
        )
    if "place" not in of:
        return 3600.0 * _EAST[zone.upper()]
    try:
        at = datetime(1970, 1, 1, tzinfo=ZoneInfo(of["place"])) + timedelta(
            seconds=local
        )
    except (KeyError, ValueError, OverflowError):  # ZoneInfoNotFoundError is a KeyError
        return None
    offset = at.utcoffset()
    return None if offset is None else offset.total_seconds()
