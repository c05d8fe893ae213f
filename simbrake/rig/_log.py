"""A rig's log: its channels by their meaning, in SI units, and what was assumed while
it was read."""

import dataclasses
import functools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError, Issues
from .._base._nulls import NULLS, take_nulls, told_as_null
from .._base._numbers import digits
from .._base._progress import counting
from .._base._table import Column, Table, Tabular, frozen, plain
from .._base._units import Unit, unit
from ._clock import start_of, times_of
from ._formats import Table as FileTable
from ._formats import tables_of


class Role(NamedTuple):
    """Meaning of a channel: its SI unit, the meaning in words, and patterns of its names
    (letters and digits alone), the best first."""

    unit: str
    meaning: str
    names: tuple[str, ...]


_BLOCK = r"(?:TRAVELL?ING)?(?:BLOCK|BLK|HOOK)"
#: meanings of channels, in the order in which names are matched
ROLES: dict[str, Role] = {
    "compensated_position": Role(
        "m",
        "height of the block less the heave of the rig",
        (
            r"BLOCKCOMP\w*",
            r"BPOSCOMP\w*",
            rf"{_BLOCK}(?:POS\w*|HEIGHT)(?<!UN)COMP\w*",
            rf"COMPENSATED{_BLOCK}\w*",
        ),
    ),
    "block_position": Role(
        "m",
        "height of the block, upwards, as the drum moves it",
        (
            r"BLOCKUN?COMP\w*",
            r"BPOSUN?COMP\w*",
            r"BPOS(?:AVG?|A)?",
            r"BLK?POS\w*",
            rf"{_BLOCK}(?:POSITION|POS|HEIGHT|HT|HGT)(?:AVG|AVERAGE)?",
            r"T[VB]?BPOS",
            r"BHT|BHEIGHT|BLKH",
            r"TOPDRIVE(?:POSITION|HEIGHT)|TDPOS|TDHEIGHT",
        ),
    ),
    "hook_load_min": Role(
        "N",
        "lowest hook load since the row before",
        (r"HKLD?MI?N|HKLN|WOHMIN", r"HOOKLOADMIN(?:IMUM)?|MIN(?:IMUM)?HOOKLOAD"),
    ),
    "hook_load_max": Role(
        "N",
        "highest hook load since the row before",
        (r"HKLD?MA?X|HKLX|WOHMAX", r"HOOKLOADMAX(?:IMUM)?|MAX(?:IMUM)?HOOKLOAD"),
    ),
    "hook_load": Role(
        "N",
        "load of the hook, block included",
        (
            r"HKLDAVG?|HKLAVG|HKLA",
            r"HKLD?|HKLI|HKLO",
            r"WOH(?:AVG)?|WEIGHTONHOOK",
            r"(?:TOTAL|AVG|AVERAGE)?HOOK(?:LOAD|LD|WEIGHT)(?:AVG|AVERAGE)?|HLOAD|HAKENLAST",
        ),
    ),
    "heave": Role("m", "heave of the rig", (r"RIGHEAVE|HEAVE?", r"HEAVEPOS\w*")),
    "bit_depth": Role(
        "m",
        "depth of the bit",
        (r"DBTM|DBIT|BITDEP\w*|DEPTHBIT|BDEP|BITMD|BITPOS\w*|BITMEASUREDDEPTH",),
    ),
    "hole_depth": Role(
        "m", "depth of the hole", (r"DMEA|HOLEDEP\w*|TOTALDEPTH|DEPTHHOLE|DEPTH?",)
    ),
    "weight_on_bit": Role(
        "N", "weight on the bit", (r"WOB(?:AVG?|A)?|SWOB|WEIGHTONBIT",)
    ),
    "activity": Role(
        "",
        "activity as the log has it",
        (r"ACTC[12]?|(?:RIG)?ACTIVITY(?:CODE)?|RIGSTATE|RIGMODE|ACTCODE?",),
    ),
    "lines_strung": Role(
        "1", "lines strung", (r"LINESSTRUNG|NLINES|(?:NUM|NUMBER)(?:OF)?LINES|LINS",)
    ),
}
#: channels without which no lowering can be found
_NEEDED = ("block_position", "hook_load")
#: channels from which motion and work are computed
_MOTION = (*_NEEDED, "compensated_position", "hook_load_min", "hook_load_max", "heave")
#: sizes, by SI unit, that no rig has
_ABSURD = {"m": 1e6, "N": 1e12}
#: units as logs write them (in lower case), by the SI unit; the table of simbrake has
#: the others
_POUND = 4.4482216152605
_TONNE = 9806.65
_SPELLED: dict[str, dict[str, float]] = {
    "m": {
        "m meter meters metre metres mtr": 1.0,
        "ft f feet foot": 0.3048,
        "in inch inches": 0.0254,
    },
    "N": {
        "n": 1.0,
        "dan": 10.0,
        "kn": 1e3,
        "kdan": 1e4,
        "lbf lb lbs lbm": _POUND,
        "klbf klb klbs klbm kip kips 1000lbf 1000lb 1000lbs": 1e3 * _POUND,
        "kgf kg kgs": _TONNE / 1e3,
        "t tf tonf ton tons tonne tonnes mt mton te": _TONNE,
        "tonfus": 2e3 * _POUND,
        "tonfuk": 2240.0 * _POUND,
    },
}
_SPELLINGS = {
    si: {name: factor for names, factor in units.items() for name in names.split()}
    for si, units in _SPELLED.items()
}
#: spellings that have another meaning elsewhere
_DOUBTFUL = {"tonf", "ton", "tons", "mt"}
#: what logs write where a channel has no unit
_NO_UNIT = {
    "",
    "unitless",
    "none",
    "-",
    "--",
    "---",
    "n/a",
    "na",
    "euc",
    "null",
    "dimensionless",
    "undefined",
}
#: spacing of rows from which it is a gap: a multiple of the usual spacing, at least (s)
_GAP = 10.0
_GAP_S = 20.0


@frozen
class Channel:
    """A column of a log: `value` (n,) at the times `t` (n,) of the rows, NaN where it
    has none.

    - `mnemonic`, `unit`: as in the file
    - `si`: unit of `value`; empty for a column without a role, which stays in its unit
    - `role`: key of `simbrake.rig.ROLES`, or empty
    - `nulls`: number of rows without value
    - `words`: in a column of words `value` is the place in this list
    """

    mnemonic: str
    unit: str
    role: str
    si: str
    t: np.ndarray = dataclasses.field(repr=False)
    value: np.ndarray = dataclasses.field(repr=False)
    words: tuple[str, ...] = ()

    @functools.cached_property
    def nulls(self) -> int:
        return int(np.isnan(self.value).sum())

    @functools.cached_property
    def updates(self) -> np.ndarray:
        """Rows (k,) in which the value differs from the last value before; in the other
        rows it is held."""
        rows = np.flatnonzero(~np.isnan(self.value))
        x = self.value[rows]
        return rows[np.append(True, x[1:] != x[:-1])] if rows.size else rows

    @functools.cached_property
    def interval(self) -> float:
        """Usual time (s) between two updates while the value changes; NaN where it
        hardly does.

        The median of the times between updates, weighted by the change, so that a block
        at rest does not count; only over times up to twice the shortest tenth (of the
        updates, or of the change), so that a load which is constant between two steps
        does not count either.
        """
        t = self.t[self.updates]
        x = self.value[self.updates]
        if t.size < 4:
            return np.nan
        spacing = np.diff(t)
        weight = np.abs(np.diff(x))
        order = np.argsort(spacing)
        spacing = spacing[order]
        weight = weight[order]

        def quantile(share: float, weight: np.ndarray) -> float:
            total = np.cumsum(weight)
            return float(spacing[np.searchsorted(total, share * total[-1])])

        short = min(quantile(0.1, weight), quantile(0.1, np.ones(weight.size)))
        return quantile(0.5, np.where(spacing <= 2.0 * short, weight, 0.0))

    @functools.cached_property
    def period(self) -> float:
        """Mean time (s) between two updates while the value changes; 0 where it changes
        in nearly each row.

        A value that is read each 5 s stands in rows of 2 s for 4 and 6 s by turns;
        `interval` is one of these times, and `period` their mean.
        """
        t = self.t[self.updates]
        x = self.value[self.updates]
        if not np.isfinite(self.interval):
            return 0.0
        row = np.median(np.diff(self.t))
        spacing = np.diff(t)
        change = np.abs(np.diff(x))
        usual = np.abs(spacing - self.interval) < 1.5 * row
        mean = float(np.average(spacing[usual], weights=change[usual]))
        return mean if mean > 1.1 * row else 0.0

    @property
    def factor(self) -> float:
        """SI units of `value` in one unit of the file."""
        if self.si in ("", "1") or _plain_unit(self.unit) in _NO_UNIT:
            return 1.0
        return float(_unit_of(self.unit, self.si).factor)

    @property
    def held(self) -> bool:
        """Whether values are repeated between updates, so that differences of rows are
        no rates."""
        row = np.median(np.diff(self.t)) if self.t.size > 3 else np.inf
        return bool(self.interval > 1.5 * row)


@frozen
class Log(Tabular):
    """A recording of a rig in SI units: `log["hook_load"].value`,
    `log["BPOS"].updates`.

    - `source`: what it is called in results, see `show_names` of `read`
    - `t` (n,): seconds from the first row
    - `start`: time of the first row in ISO 8601, `None` in a log without date
    - `channels`: by role
    - `columns`: all channels
    - `guesses`: what was assumed, in sentences for the user to check
    - `gaps` (g, 2): begin and end of the times without rows
    - `repeated`: rows with the time of the row before
    - `compensated`: whether the only block position is heave-compensated, which the
      drum does not follow
    """

    source: str
    start: str | None
    t: np.ndarray = dataclasses.field(repr=False)
    channels: Mapping[str, Channel]
    columns: tuple[Channel, ...] = dataclasses.field(repr=False)
    gaps: np.ndarray
    repeated: int
    guesses: tuple[str, ...]

    def __getitem__(self, name: str) -> Channel:
        """The channel of a role or of a mnemonic; `KeyError` with the known names."""
        if name in self.channels:
            return self.channels[name]
        for column in self.columns:
            if column.mnemonic == name:
                return column
        there = ", ".join(
            [*self.channels, *(c.mnemonic for c in self.columns if not c.role)]
        )
        raise KeyError(f"no channel {name!r}; there are: {there}")

    def __contains__(self, name: str) -> bool:
        return name in self.channels or any(
            column.mnemonic == name for column in self.columns
        )

    @property
    def compensated(self) -> bool:
        return "block_position" not in self.channels

    @property
    def position(self) -> Channel:
        """Height of the block as the drum moves it, or else the heave-compensated
        height."""
        role = "compensated_position" if self.compensated else "block_position"
        return self.channels[role]

    @property
    def interval(self) -> float:
        """Usual time between rows (s)."""
        return float(np.median(np.diff(self.t)))

    def parts(self) -> Iterator[str | Table]:
        hours = (
            f"{self.t.size} rows over {digits(self.t[-1] / 3600, 3)} h, one each "
            f"{digits(self.interval, 3)} s"
        )
        yield f"{self.source}: {hours}, from {self.start or 'a time without date'}"
        yield self._table
        lost = np.sum(self.gaps[:, 1] - self.gaps[:, 0])
        yield f"gaps: {len(self.gaps)}" + (
            f", {digits(lost, 4)} s in all" if len(self.gaps) else ""
        )
        yield "assumed:" if self.guesses else "nothing assumed"
        yield from (f"- {guess}" for guess in self.guesses)

    @property
    def _table(self) -> Table:
        columns = [
            "role",
            "mnemonic",
            "unit",
            Column("nulls"),
            Column("updates"),
            Column("interval", "s", heading="update interval", show=".3g"),
            Column("held"),
            Column("low", show=".5g"),
            Column("high", show=".5g"),
            ("si", "in"),
        ]
        rows = []
        for role, x in self.channels.items():
            some = x.nulls < x.value.size
            low, high = (
                (np.nanmin(x.value), np.nanmax(x.value)) if some else (None, None)
            )
            rows.append(
                (
                    role,
                    x.mnemonic,
                    x.unit,
                    x.nulls,
                    len(x.updates),
                    x.interval,
                    x.held,
                    low,
                    high,
                    x.si,
                )
            )
        return Table(columns, rows)

    def as_dict(self) -> dict[str, Any]:
        """The log and its channels, without the values."""
        return plain(
            {
                "source": self.source,
                "start": self.start,
                "rows": self.t.size,
                "duration": float(self.t[-1]),
                "interval": self.interval,
                "gaps": self.gaps,
                "repeated": self.repeated,
                "guesses": self.guesses,
                "compensated": self.compensated,
                "channels": self._table,
            }
        )


def read(
    path: str | Path,
    *,
    names: Mapping[str, str] | None = None,
    null: float | Sequence[float] | None = None,
    time: str | Sequence[str] | None = None,
    offset: float | None = None,
    show_names: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Log:
    """Read the recording of a rig: WITSML 1.3 or 1.4 (XML), LAS 1.2 to 3 (extra `rig`),
    or CSV, also as `.xz` or `.gz`.

    Columns are recognised by their mnemonic and unit; what was assumed is in
    `Log.guesses` and printed with the log.

    - `names`: columns by role, `{"block_position": "BLK [ft]"}`, the unit in brackets
      where the file lacks it
    - `null`: numbers that mean no value, instead of those of the file and of -999.25
      and the like
    - `time`: the column of times, or those of date and clock, and the format that each
      row must have, of its date, `("Day", "Clock", "%d/%m/%Y")`, or of all,
      `("Time", "%H:%M:%S %d/%m/%Y")`
    - `offset`: seconds by which the clock of the hook load is ahead of that of the
      block position
    - `show_names`: call the log by its well and its file in results; otherwise `log`, as
      both may be confidential
    - `progress`: as for an ensemble: `True`, `False`, or a function of the bytes read
      and their number

    CSV: a row of names, perhaps one of units; commas, semicolons (then decimal commas),
    tabs; UTF-8, UTF-16 or Latin-1.

    Times: date and clock in either order, in one or two columns, perhaps with a zone, a
    clock alone (midnight is seen), or numbers. Whether `03/02/2020` is in February or
    in March is decided by all rows; where they leave it open, the guess is among the
    guesses. The error of a time that is not understood lists the accepted forms.

    Raises `InputError` with all of these at once: no block position, no hook load, no
    usable time, times that run backwards, an unknown unit, nothing but nulls; for a
    damaged file with row or element. A document type or an entity in an XML is refused.

    Example:
        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder, "rig.csv")
        ...     _ = file.write_text("Time,BPOS,HKLD\\ns,ft,klbf\\n0,90,150\\n2,80,150\\n4,70,-999.25\\n")
        ...     log = sb.rig.read(file)
        >>> log["block_position"].value.round(3)
        array([27.432, 24.384, 21.336])
        >>> log["hook_load"].nulls
        1
    """
    file = Path(path)
    wanted = dict(names or {})
    faults = Issues(
        Fault(f"names {role}", "is no role", f"there are: {', '.join(ROLES)}")
        for role in wanted
        if role not in ROLES
    )
    if offset is not None and not np.isfinite(offset):
        faults.add(
            "offset",
            f"{offset} is no time",
            "seconds, positive where the load's clock is ahead",
        )
    clock = [time] if isinstance(time, str) else list(time or ())
    size = file.stat().st_size if file.is_file() else 0
    try:
        with counting(size, progress, "log: bytes read", after=2.0) as done:
            tables = tables_of(file, done, clock)
            done(size)
    except InputError as error:
        raise InputError([*faults, *error.faults]) from None
    wanted = {role: wanted[role] for role in wanted if role in ROLES}
    table = max(tables, key=lambda table: _usefulness(table, wanted))
    guesses = [*table.remarks]
    if len(tables) > 1:
        read = f"the one with {len(table.names)} curves is read"
        guesses.insert(0, f"the file has {len(tables)} logs: {read}")
    given = null if null is None or isinstance(null, Sequence) else [null]
    source = ", ".join(filter(None, (table.well, file.name))) if show_names else "log"
    return _Reading(
        str(path), source, table, wanted, given, clock, offset or 0.0, guesses, faults
    ).log()


def _usefulness(table: FileTable, names: Mapping[str, str]) -> tuple[bool, int]:
    """Whether a table has a block position, and how many roles it has."""
    roles = _roles(table, names, [], Issues())
    return "block_position" in roles, len(roles)


def _plain_unit(text: str) -> str:
    return re.sub(r"[\s.*·_]", "", text.lower())


def _unit_of(text: str, si: str) -> Unit:
    """A unit as logs write it. Raises `ValueError` for a text that is no unit."""
    factor = _SPELLINGS.get(si, {}).get(_plain_unit(text))
    # (in lower case milli- and meganewton are alike)
    if factor is None or text.strip() in ("mN", "MN"):
        return unit(text, si)
    return Unit(factor)


def _rank(role: Role, name: str) -> int | None:
    """Place of the first pattern of a role that fits a name; `None`: none fits."""
    letters = re.sub(r"[^A-Z0-9]", "", name.upper())
    fits = (k for k, p in enumerate(role.names) if re.fullmatch(p, letters))
    return next(fits, None)


def _roles(
    table: FileTable, names: Mapping[str, str], guesses: list[str], faults: Issues
) -> dict[str, tuple[int, str]]:
    """Column and unit of each role: by `names`, or by mnemonic, or else by the
    description."""
    roles: dict[str, tuple[int, str]] = {}
    for role, text in names.items():
        match = re.fullmatch(r"(?P<name>.*?)\s*\[(?P<unit>[^\[\]]*)\]", text)
        name = text
        unit_text = None
        if match is not None and text not in table.names:
            name = match["name"]
            unit_text = match["unit"]
        if name not in table.names:
            faults.add(
                f"names {role}",
                f"{text!r} is no column",
                f"there are: {', '.join(table.names)}",
            )
            continue
        i = table.names.index(name)
        roles[role] = i, table.units[i] if unit_text is None else unit_text
    taken = {i for i, _ in roles.values()}
    by_name: dict[str, list[tuple[int, int]]] = {}
    for i, name in enumerate(table.names):
        if i in taken or i == table.index:
            continue
        for role, about in ROLES.items():
            rank = _rank(about, name)
            if rank is not None:
                by_name.setdefault(role, []).append((rank, i))
                break
    for role, about in ROLES.items():
        if role in roles or (
            role == "compensated_position" and "block_position" in names
        ):
            continue
        columns = [i for _, i in sorted(by_name.get(role, ()))]
        if not columns:
            columns = [
                i
                for i, words in enumerate(table.descriptions)
                if i not in taken and _rank(about, words) is not None
            ]
            guesses += [
                f"{role}: {table.names[i]}, by its description {table.descriptions[i]!r}"
                for i in columns[:1]
            ]
        if columns:
            roles[role] = columns[0], table.units[columns[0]]
            if columns[1:]:
                others = ", ".join(table.names[i] for i in columns[1:])
                guesses.append(
                    f"{role}: {table.names[columns[0]]} rather than {others}"
                )
    return roles


def _merged(x: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The last value in each `group` (n,) of rows with one time: each of them may have
    values of other columns."""
    import pandas as pd

    return pd.Series(x).groupby(group).last().to_numpy()


@dataclasses.dataclass
class _Reading:
    """A table of a file on its way to a log, with its errors and what is assumed;
    `null`, `clock`, `offset` as given to `read`."""

    path: str
    source: str
    table: FileTable
    names: Mapping[str, str]
    null: Sequence[float] | None
    clock: Sequence[str]
    offset: float
    guesses: list[str]
    faults: Issues

    def log(self) -> Log:
        table = self.table
        roles = _roles(table, self.names, self.guesses, self.faults)
        times = times_of(table, self.path, self.clock, self.faults)
        if times is not None:
            self.guesses += times.remarks
        self._nulls(() if times is None else times.used)
        motion = [
            table.values[i]
            for role, (i, _) in roles.items()
            if role in _MOTION and table.values[i].size
        ]
        # rows that share a time may be readings of their own, or of one column each
        each = any(np.isnan(x).mean() < 0.4 for x in motion)
        ordered = None if times is None else self._ordered(times.seconds, spread=each)
        of_column = {i: (role, text) for role, (i, text) in roles.items()}
        scales = {
            i: self._scale(role, i, text) for i, (role, text) in of_column.items()
        }
        for i, scale in scales.items():
            role = of_column[i][0]
            if scale is not None and role in _MOTION:
                self._check_size(i, ROLES[role].unit, float(scale.factor))
        if not {"block_position", "compensated_position"} & roles.keys():
            there = ", ".join(
                f"{n} [{u}]" if u else n
                for n, u in zip(table.names, table.units, strict=True)
            )
            self.fault(
                "",
                "has no block position",
                f"names={{'block_position': 'COLUMN'}}; there are: {there}",
            )
        if "hook_load" not in roles:
            self.fault(
                "",
                "has no hook load",
                "names={'hook_load': 'COLUMN'} says which column it is",
            )
        if self.faults or ordered is None or times is None:
            raise InputError(self.faults)
        seconds, rows = ordered
        # times since 1970 are known to a microsecond at best
        t = np.round(seconds - seconds[0], 6)
        t_load = t - self.offset if self.offset else t
        channels: list[Channel] = []
        for i, name in enumerate(table.names):
            role, text = of_column.get(i, ("", table.units[i]))
            if i in times.used or (i in table.texts and role != "activity"):
                continue
            if i in table.texts:
                words, x = self._words(table.texts[i])
            else:
                words = ()
                x = table.values[i]
            scale = scales.get(i)
            if scale is not None:
                x *= float(scale.factor)
            x = x[rows] if self._group is None else _merged(x[rows], self._group)
            table.values[i] = np.empty(0)
            role = "" if scale is None and role != "activity" else role
            si = ROLES[role].unit if role else ""
            times_of_channel = t_load if role.startswith("hook_load") else t
            channels.append(Channel(name, text, role, si, times_of_channel, x, words))
        return Log(
            self.source,
            start_of(seconds[0], times.zone) if times.dated else None,
            t,
            {role: c for role in ROLES for c in channels if c.role == role},
            tuple(channels),
            self._gaps(t),
            self._repeated,
            tuple(self._remarks(channels)),
        )

    def fault(self, where: str, problem: str, hint: str = "") -> None:
        self.faults.add(f"{self.path}{where}", problem, hint)

    def _ordered(
        self, seconds: np.ndarray, spread: bool
    ) -> tuple[np.ndarray, Any] | None:
        """Times that increase, and the rows that have them; `None` after an error.

        - `spread`: rows that share a time are readings of their own
        """
        self._repeated = 0
        self._group = None
        if seconds.size < 2:
            self.fault("", f"has {seconds.size} rows", "a recording has at least two")
            return None
        rows: Any = slice(None)
        steps = np.diff(seconds)
        if np.all(steps <= 0) and steps.any():
            self.guesses.append("rows are from the last to the first: turned round")
            rows = np.arange(seconds.size)[::-1]
            seconds = seconds[::-1]
            steps = np.diff(seconds)
        back = np.flatnonzero(steps < 0)
        if back.size:
            i = int(back[0]) + 1
            many = f", as {back.size} rows do" if back.size > 1 else ""
            what = f"runs {digits(-steps[i - 1], 4)} s backwards{many}"
            hint = "sort the rows, or split the recording where its clock was set"
            self.fault(f" {self.table.row(i)}, time", what, hint)
            return None
        self._repeated = int(np.sum(steps == 0))
        if not steps.any():
            hint = "time='COLUMN' says which column the time is"
            self.fault("", "has the same time in all rows", hint)
            return None
        first = np.append(True, steps > 0)
        group = np.cumsum(first) - 1
        starts = seconds[first]
        if spread and self._repeated > 0.5 * steps.size:
            usual = np.median(np.diff(starts))
            length = np.minimum(np.diff(starts, append=starts[-1] + usual), usual)
            count = np.bincount(group)
            place = np.arange(seconds.size) - np.flatnonzero(first)[group]
            seconds = starts[group] + length[group] * place / count[group]
            self.guesses.append(
                f"{self._repeated} rows repeat a time: rows of one time are spread "
                "evenly up to the next"
            )
        elif self._repeated:
            self._group = group
            seconds = starts
            self.guesses.append(
                f"{self._repeated} rows repeat the time of the row before: they are read as one row"
            )
        return seconds, rows

    def _nulls(self, times: Sequence[int]) -> None:
        """Sets NaN for null values: as given, or those of the file and of loggers."""
        table = self.table
        own = set(table.nulls)
        nulls = self.null if self.null is not None else sorted({*own, *NULLS})
        other: dict[float, list[str]] = {}
        for i, x in enumerate(table.values):
            if not x.size or i in times:
                continue
            if np.isinf(x).any():
                self.guesses.append(
                    f"{table.names[i]}: infinite values are taken as missing"
                )
                x[np.isinf(x)] = np.nan
            for value in take_nulls(x, nulls):
                if value not in own and self.null is None:
                    other.setdefault(value, []).append(table.names[i])
        self.guesses += [
            told_as_null(value, columns) for value, columns in other.items()
        ]

    def _scale(self, role: str, i: int, text: str) -> Unit | None:
        """The unit of a column with a role; `None` where it is left without one."""
        about = ROLES[role]
        name = self.table.names[i]
        x = self.table.values[i]
        where = f" column {name}"
        if role == "activity":
            return None
        empty = not x.size or np.isnan(x).all()
        if empty or (role.startswith("hook_load") and not np.nanmax(x) > 0):
            what = "has nothing but nulls" if empty else "has no load above zero"
            if role in _NEEDED or role == "compensated_position":
                what = "holds words, not numbers" if i in self.table.texts else what
                self.fault(
                    where,
                    what,
                    f"names={{{role!r}: 'COLUMN'}} says which other column it is",
                )
            else:
                self.guesses.append(f"{role}: {name} {what}, not used")
            return None
        if about.unit == "1":
            return Unit(1.0)
        key = _plain_unit(text)
        if key in _NO_UNIT:
            return self._without_unit(role, name, x)
        try:
            of = _unit_of(text, about.unit)
            if key in _DOUBTFUL and about.unit == "N":
                size = f"the metric one, {digits(float(of.factor) / 1e3)} kN"
                self.guesses.append(
                    f"{name}: {text} is {size}; if not, names={{{role!r}: '{name} [tonfUS]'}}"
                )
            return of
        except ValueError as error:
            also = ", kdaN, klbs, tonf" if about.unit == "N" else ""
            self.fault(
                where,
                f"{text!r} is not a unit of {about.meaning}",
                f"names={{{role!r}: '{name} [unit]'}}; {error}{also}",
            )
            return None

    def _check_size(self, i: int, si: str, factor: float) -> None:
        """Adds an error for values of a size that no rig has."""
        x = self.table.values[i]
        rows = np.flatnonzero(np.abs(x) > _ABSURD[si] / factor)
        if rows.size:
            where = f" {self.table.row(rows[0])}, column {self.table.names[i]}"
            many = f", as {rows.size} rows do" if rows.size > 1 else ""
            what = f"has {x[rows[0]]:g}{many}: no rig has"
            self.fault(where, what, "remove the row, or give this as a null value")

    def _without_unit(self, role: str, name: str, x: np.ndarray) -> Unit | None:
        """SI as a guess where the size of the values agrees with it; else an error for a
        needed channel, and `None`."""
        high = float(np.nanquantile(np.abs(x), 0.99))
        si = ROLES[role].unit
        if role in _MOTION and (high <= 60.0 if si == "m" else high >= 2e4):
            size = f"by the size of its values (up to {digits(high, 3)})"
            self.guesses.append(f"{name}: no unit, taken as {si} {size}")
            return Unit(1.0)
        if role in _NEEDED or role == "compensated_position":
            may = "m or ft" if si == "m" else "kN, t or klbf"
            hint = f"names={{{role!r}: '{name} [{may.split()[-1]}]'}}"
            self.fault(
                f" column {name}",
                f"has no unit, and values up to {digits(high, 3)} may be {may}",
                hint,
            )
        else:
            self.guesses.append(f"{role}: {name} has no unit, not used")
        return None

    def _words(self, texts: list[str]) -> tuple[tuple[str, ...], np.ndarray]:
        texts = [text.strip() for text in texts]
        words = tuple(dict.fromkeys(filter(None, texts)))
        place = {text: i for i, text in enumerate(words)}
        return words, np.array([place.get(text, np.nan) for text in texts], float)

    def _gaps(self, t: np.ndarray) -> np.ndarray:
        steps = np.diff(t)
        i = np.flatnonzero(steps > max(_GAP * np.median(steps), _GAP_S))
        return np.stack([t[i], t[i + 1]], axis=1) if i.size else np.empty((0, 2))

    def _remarks(self, channels: list[Channel]) -> list[str]:
        phrases = list(dict.fromkeys(self.guesses))
        by_role = {c.role: c for c in channels if c.role}
        if "block_position" not in by_role:
            name = by_role["compensated_position"].mnemonic
            phrases.append(
                f"{name} is heave-compensated: the motion of the drum only while the "
                "rig does not heave"
            )
        for role, c in by_role.items():
            if c.held and role in _MOTION:
                phrases.append(
                    f"{c.mnemonic}: updated each {digits(c.interval, 3)} s and held "
                    "between, updates alone are used"
                )
        if self.offset:
            phrases.append(
                f"times of the hook load are reduced by {digits(self.offset, 4)} s (offset)"
            )
        return phrases
