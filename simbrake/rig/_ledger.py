"""The duty of a rig's brakes, lowering by lowering: energies at hook and drum, what
cannot be separated, totals."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from .._base._faults import Issues, input_error
from .._base._numbers import digits, number
from .._base._retired import answers
from .._base._table import Column, Table, Tabular, frozen, plain
from ._found import COLUMNS, LOADS, Lowering, Lowerings, column_of, counted, in_seconds
from ._log import Log
from ._lowerings import lowerings

_GRAVITY = 9.80665  # m/s^2
#: tension of a rope after a turning sheave with roller bearings over that before it
_SHEAVE = 1.04
#: kinds of brakes of the drum
BRAKES = {
    "friction": "friction brakes alone",
    "auxiliary": "friction brakes and an auxiliary brake (eddy current, water)",
    "regenerative": "friction brakes and a motor that brakes",
}
#: share of the travel that the heave may have where the height is compensated
_HEAVE = 0.01


def tackle_efficiency(lines: float, sheave: float = _SHEAVE) -> float:
    """Efficiency of a tackle in lowering: pull of the fast line times the lines, over
    the load of the hook.

        T_f = W (K − 1)/(K (K^n − 1)),    η = n T_f/W

    The rope runs from the drum into the tackle, so that its tension grows by `K`
    (`sheave`) at each of `n` sheaves: `W = T_f (K + K² + … + K^n)`. `K` is 1.04 with
    roller bearings (API RP 9B).

    Example:
        >>> round(sb.rig.tackle_efficiency(8), 4), sb.rig.tackle_efficiency(8, 1.0)
        (0.8348, 1.0)
    """
    if sheave == 1.0:
        return 1.0
    return lines * (sheave - 1.0) / (sheave * (sheave**lines - 1.0))


@frozen
class Entry:
    """What one lowering asks of the brakes, in SI units; `None` where the log and the
    arguments do not say it.

    - `lowering`: travel, load and work of the hook
    - `mean_power`: its work over its duration
    - `kinetic_energy`: `½ m v²` of the load at the top speed, which the brakes take in
      the stop (it is in the work)
    - `tackle_loss`, `drum_work`: the part of the work that the sheaves take, and that
      at the drum, with its interval
    - `drum_speed`: of the top speed, rad/s;  `drum_torque`: of the mean load, N·m
    - `auxiliary_work`, `friction_work`: of an auxiliary brake or a motor, and of the
      friction brakes
    - `refused`: why nothing is said of the drum
    """

    lowering: Lowering
    mean_power: float
    kinetic_energy: float
    tackle_loss: float | None = None
    drum_work: float | None = None
    drum_work_low: float | None = None
    drum_work_high: float | None = None
    drum_speed: float | None = None
    drum_torque: float | None = None
    auxiliary_work: float | None = None
    friction_work: float | None = None
    refused: str = ""


_ENTRY = tuple(
    field.name for field in dataclasses.fields(Entry) if field.name != "lowering"
)
_SUMS = [
    "travel",
    "hook_work",
    "hook_work_low",
    "hook_work_high",
    "tackle_loss",
    "drum_work",
    "auxiliary_work",
    "friction_work",
]


@frozen
class Ledger(Tabular):
    """Energies of all lowerings of a log, with totals by trip and by day; flagged
    lowerings are in no total.

    - `entries`: one for each lowering;  `settings`: the arguments;  `notes`: to be read
    - `separable`: whether the work of the friction brakes is told apart from that of an
      auxiliary brake or motor
    """

    lowerings: Lowerings
    entries: tuple[Entry, ...]
    settings: dict[str, Any]
    separable: bool
    notes: tuple[str, ...]

    def parts(self) -> Iterator[str | Table]:
        yield from self.answer
        yield from self.tables
        given = [f"{name} = {text}" for name, text in self.given.items()]
        yield f"given: {', '.join(given)}"
        yield from self.lowerings.basis
        yield from (
            f"- {note}"
            for note in dict.fromkeys((*self.lowerings.log.guesses, *self.notes))
        )

    @property
    def given(self) -> dict[str, str]:
        """The arguments that are known, in words."""
        known = {name: x for name, x in self.settings.items() if x is not None}
        return {
            name: digits(x, 4) if isinstance(x, int | float) else str(x)
            for name, x in known.items()
        }

    @property
    def largest(self) -> Entry | None:
        """The lowering with the largest work, `None` where all are flagged."""
        valid = [entry for entry in self.entries if not entry.lowering.flags]
        return max(valid, key=lambda entry: entry.lowering.hook_work, default=None)

    @property
    def counts(self) -> dict[str, int]:
        """Lowerings in the totals, those of them whose load is not decidable, and those
        that are flagged."""
        valid = self.lowerings.valid
        every = len(self.lowerings)
        unsure = sum(lowering.kind == LOADS[0] for lowering in valid)
        return {
            "valid": len(valid),
            "not_decidable": unsure,
            "flagged": every - len(valid),
        }

    @property
    def answer(self) -> tuple[str, ...]:
        """What a crew asks: the largest lowering, the whole work, what is not
        decidable, flagged, or hidden by gaps."""
        counts = self.counts
        totals = self.totals
        largest = self.largest
        flags = sorted(
            {flag for lowering in self.lowerings.lowerings for flag in lowering.flags}
        )
        aside = f"flagged and left out: {counts['flagged']}" + (
            f" ({', '.join(flags)})" if flags else ""
        )
        if refused := sum(bool(entry.refused) for entry in self.entries):
            aside += f"; motion of the drum refused: {refused}"
        lost = self.lowerings.lost
        if largest is None:
            return ("no lowering without flags", aside, *lost)
        lowering = largest.lowering
        when = (
            in_seconds(lowering.start)
            if lowering.start
            else f"{digits(lowering.begin, 6)} s"
        )
        assumed = (
            " (by an assumed share; at most all of it)"
            if any(shares_of(self.settings["auxiliary"]).values())
            else ""
        )
        at_drum = {
            "drum_work": "at the drum",
            "friction_work": f"by the friction brakes{assumed}",
        }
        drum = (
            f", {number(totals[x], 'J', count=3)} {words}"
            for x, words in at_drum.items()
            if totals[x] is not None
        )
        return (
            f"largest lowering: {_work(dataclasses.asdict(lowering))} at the hook, "
            f"{number(lowering.travel, 'm', count=3)} at up "
            f"to {number(lowering.top_speed, 'm/s', count=3)}, {when}",
            f"all of {counted(counts['valid'])}: {_work(totals)} at the hook{''.join(drum)}",
            f"load of string or block not decidable: {counts['not_decidable']}; {aside}",
            *lost,
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """For reading: the lowerings at the hook, at the drum if it is known, gaps,
        totals by trip and by day."""
        rows = self.table
        first = "start" if self.lowerings.log.start else "begin"
        drum = rows.readable(first, *_DRUM, title="at the drum")
        known = any(
            not column.hidden for column in drum.columns if column.name != first
        )
        totals = (
            table.readable(*(column.name for column in table.columns))
            for table in (self.by_trip, self.by_day)
        )
        gaps = self.lowerings.gap_table.readable(
            first, "duration", "change", "cut", "rest", title="gaps"
        )
        return (
            rows.readable(first, *_HOOK, title="at the hook"),
            *([drum] if known else []),
            *([gaps] if self.lowerings.gaps else []),
            *totals,
        )

    @property
    def table(self) -> Table:
        """A row for each lowering, hook and drum."""
        names = [*COLUMNS, *_ENTRY]
        return Table(
            map(column_of, names),
            ([_value(entry, name) for name in names] for entry in self.entries),
        )

    def _totals(self, name: str, key: Callable[[Lowering], object]) -> Table:
        groups: dict[object, list[Entry]] = {}
        for entry in self.entries:
            if not entry.lowering.flags:
                groups.setdefault(key(entry.lowering), []).append(entry)
        rows = [
            [label, len(members), *(_sum(members, what) for what in _SUMS)]
            for label, members in groups.items()
        ]
        return Table(
            [name, Column("lowerings"), *map(column_of, _SUMS)], rows, f"by {name}"
        )

    @property
    def by_day(self) -> Table:
        """Totals of each day, of the calendar where the log has dates, else of 24 h
        from the first row."""
        return self._totals(
            "day",
            lambda lowering: (
                lowering.start[:10]
                if lowering.start
                else f"{int(lowering.begin // 86400) + 1}"
            ),
        )

    @property
    def by_trip(self) -> Table:
        """Totals between pauses without a lowering of more than `trip_pause`."""
        pauses = {}
        end = None
        trip = 0
        for lowering in self.lowerings.valid:
            trip += end is None or lowering.begin - end > self.settings["trip_pause"]
            end = lowering.end
            pauses[lowering.begin] = trip
        return self._totals("trip", lambda lowering: pauses[lowering.begin])

    @property
    def totals(self) -> dict[str, float | None]:
        """Sums over all lowerings without flags; `None` where one of them lacks it."""
        members = [entry for entry in self.entries if not entry.lowering.flags]
        return {name: _sum(members, name) for name in _SUMS}

    def as_dict(self) -> dict[str, Any]:
        """Everything in SI units, as `write` puts it into `ledger.json`."""
        about = self.lowerings.as_dict()
        return plain(
            {
                **about,
                "lowerings": self.table,
                **self.counts,
                "totals": self.totals,
                "trips": self.by_trip,
                "days": self.by_day,
                "separable": self.separable,
                "settings": self.settings,
                "notes": self.notes,
            }
        )

    __getattr__ = staticmethod(
        answers(
            "Ledger",
            gone={"write": "simbrake.pages.write_ledger(book, folder) writes it"},
        )
    )


#: columns for reading
_HOOK = [
    "duration",
    "travel",
    "top_speed",
    "static_load",
    "hook_work",
    "hook_work_low",
    "hook_work_high",
    "mean_power",
    "kinetic_energy",
    "kind",
    "flags",
]
_DRUM = tuple(name for name in _ENTRY if name not in _HOOK)


def _work(values: Mapping[str, Any]) -> str:
    """Work of the hook with its interval."""
    work, low, high = (
        number(values[f"hook_work{end}"], "J", count=3) for end in ("", "_low", "_high")
    )
    return f"{work} ({low} to {high})"


def _value(entry: Entry, name: str) -> Any:
    """A number of the drum, or of the lowering itself."""
    return getattr(entry if name in _ENTRY else entry.lowering, name)


def _sum(members: list[Entry], name: str) -> float | None:
    values = [_value(entry, name) for entry in members]
    return None if any(x is None for x in values) else float(sum(values))


def ledger(
    of: Log | Lowerings,
    *,
    lines: float | None = None,
    drum_radius: float | None = None,
    efficiency: float | None = None,
    block_mass: float | None = None,
    brake: str | None = None,
    auxiliary: float | Mapping[str, float] | None = None,
    trip_pause: float = 3600.0,
) -> Ledger:
    """The duty ledger of a log: energies of each lowering at hook and drum, totals by
    trip and by day.

        W_drum = η W_hook,   W_loss = (1 − η) W_hook,   ω = n v/r,   M = η F r/n,   E =
        ½ m v²

    - `of`: a log, or its lowerings where thresholds other than the usual ones are
      wanted
    - `lines`: lines strung `n`, else those that the log has
    - `drum_radius` `r` (m): effective, to the middle of the rope
    - `efficiency` `η` of the tackle in lowering, else `tackle_efficiency(lines)`, which
      is told
    - `block_mass` (kg): of block and top drive, the mass `m` where they are lowered
      alone; else `m` is static load/g
    - `brake`: `friction`, `auxiliary` or `regenerative` (`simbrake.rig.BRAKES`)
    - `auxiliary`: share of the work at the drum that the auxiliary brake or the motor
      takes, one number or one by kind of load. Without it the two are not separable
      from the log, and stay one: `drum_work`
    - `trip_pause` (s): a longer time without lowerings ends a trip

    The motion of the drum needs the distance between block and crown. Where the log has
    a heave-compensated height alone, and the heave is unknown or exceeds 1 % of a
    lowering, nothing is said of the drum in it (`Entry.refused`).

    Raises `InputError` with all arguments that cannot be, and where the lines strung
    change in the log.

    Example:
        >>> import pathlib, tempfile
        >>> t = np.arange(0.0, 120.0, 2.0)
        >>> rows = [f"{a},{b},500\\n" for a, b in zip(t, 30.0 - np.clip(t - 40.0, 0.0, 20.0))]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder, "rig.csv")
        ...     _ = file.write_text("Time,BPOS,HKLD\\ns,m,kN\\n" + "".join(rows))
        ...     book = sb.rig.ledger(sb.rig.read(file), lines=8, drum_radius=0.4, efficiency=0.9, brake="friction")
        >>> book.totals["hook_work"] / 1e6, book.totals["friction_work"] / 1e6
        (10.0, 9.0)
        >>> book.entries[0].drum_speed
        20.0
    """
    settings: dict[str, Any] = {
        "lines": lines,
        "drum_radius": drum_radius,
        "efficiency": efficiency,
    }
    settings |= {
        "block_mass": block_mass,
        "brake": brake,
        "auxiliary": auxiliary,
        "trip_pause": trip_pause,
    }
    faults_of_settings(**settings).report()
    found = of if isinstance(of, Lowerings) else lowerings(of)
    notes = list(found.notes)
    shares = shares_of(auxiliary)
    strung = lines_of(found.log, notes) if lines is None else lines
    if efficiency is None and strung is not None:
        efficiency = tackle_efficiency(strung)
        notes.append(
            f"efficiency of the tackle {digits(efficiency, 3)}, by sheaves of "
            f"{_SHEAVE}; efficiency= if not"
        )
    if strung is not None:
        notes.append(
            "the recorded load is taken as that of the hook; a gauge at the dead line "
            "reads more in lowering"
        )
    if brake == "friction":
        shares |= dict.fromkeys(LOADS, 0.0)
    separable = all(
        shares.get(kind) is not None
        for kind in {lowering.kind for lowering in found.valid}
    )
    if not separable:
        what = (
            "an auxiliary brake or a motor"
            if brake is None
            else BRAKES[brake].partition("and ")[2]
        )
        notes.append(
            f"the shares of friction brakes and of {what} are not separable from this "
            "log: auxiliary= gives them"
        )
    if efficiency is None:
        notes.append(
            "without lines= or efficiency= nothing is said of the tackle and the drum"
        )
    entries = tuple(
        _entry(found.log, lowering, strung, drum_radius, efficiency, block_mass, shares)
        for lowering in found.lowerings
    )
    refused = [entry for entry in entries if entry.refused]
    if refused and efficiency is not None:
        notes.append(
            f"drum: {len(refused)} of {len(entries)} lowerings are refused, {refused[0].refused}"
        )
    settings |= {"lines": strung, "efficiency": efficiency}
    return Ledger(found, entries, settings, separable, tuple(notes))


def shares_of(auxiliary: float | Mapping[str, float] | None) -> dict[str, Any]:
    """Share of the auxiliary brake by kind of load."""
    return (
        dict(auxiliary)
        if isinstance(auxiliary, Mapping)
        else dict.fromkeys(LOADS, auxiliary)
    )


#: positive arguments of `ledger` with their SI units
POSITIVE = {"lines": "1", "drum_radius": "m", "block_mass": "kg", "trip_pause": "s"}


def faults_of_settings(
    efficiency: float | None,
    brake: str | None,
    auxiliary: float | Mapping[str, float] | None,
    **positive: float | None,
) -> Issues:
    """Errors of arguments of `ledger`."""
    shares = shares_of(auxiliary)
    faults = Issues()
    for name, x in positive.items():
        if x is not None and not (np.isfinite(x) and x > 0):
            unit = POSITIVE[name]
            faults.add(
                name,
                f"{x} is not a positive number",
                "" if unit == "1" else f"in {unit}",
            )
    if efficiency is not None and not 0 < efficiency <= 1:
        faults.add("efficiency", f"{efficiency} is out of range", "0 < efficiency ≤ 1")
    if brake is not None and brake not in BRAKES:
        faults.add(
            "brake", f"unknown kind {brake!r}", f"there are: {', '.join(BRAKES)}"
        )
    for kind, share in shares.items():
        if kind not in LOADS:
            faults.add(
                f"auxiliary {kind}",
                "is no kind of load",
                f"there are: {', '.join(LOADS)}",
            )
        if share is not None and not 0 <= share <= 1:
            faults.add(
                "auxiliary",
                f"{share} is out of range",
                "a share of the work at the drum, 0 to 1",
            )
    if brake == "friction" and any(shares.values()):
        faults.add(
            "auxiliary",
            "is given beside brake='friction'",
            "which has no auxiliary brake",
        )
    return Issues(dict.fromkeys(faults))


def lines_of(log: Log, notes: list[str]) -> float | None:
    """Lines strung as the log has them."""
    channel = log.channels.get("lines_strung")
    if channel is None:
        return None
    rows = channel.updates
    if rows.size > 1:
        first, then, when = (
            digits(float(x), 6) for x in (*channel.value[rows[:2]], log.t[rows[1]])
        )
        what = (
            f"lines strung change from {first} to {then} {when} s after the first row"
        )
        raise input_error(
            f"{log.source} column {channel.mnemonic}",
            what,
            "split the log there, or give lines=",
        )
    count = float(channel.value[rows[0]]) if rows.size else 0.0
    if count < 1:
        return None
    notes.append(f"lines strung: {digits(count)}, by {channel.mnemonic}")
    return count


def refusal(log: Log, lowering: Lowering) -> str:
    """Why the motion of the drum is not known in a lowering."""
    if not log.compensated:
        return ""
    name = log.position.mnemonic
    heave = log.channels.get("heave")
    if heave is None:
        return f"{name} is heave-compensated, and the heave is not recorded"
    inside = heave.value[
        slice(*np.searchsorted(log.t, (lowering.begin, lowering.end), side="right"))
    ]
    inside = inside[~np.isnan(inside)]
    if not inside.size:
        return f"{name} is heave-compensated, and the heave has no value"
    moved = np.ptp(inside)
    if moved <= _HEAVE * lowering.travel:
        return ""
    return (
        f"{name} is heave-compensated, and the heave of {digits(moved, 3)} m "
        f"exceeds 1 % of {digits(lowering.travel, 3)} m"
    )


def _entry(
    log: Log,
    lowering: Lowering,
    lines: float | None,
    radius: float | None,
    efficiency: float | None,
    block_mass: float | None,
    shares: Mapping[str, float | None],
) -> Entry:
    mass = (
        block_mass
        if block_mass is not None and lowering.kind == "block"
        else lowering.static_load / _GRAVITY
    )
    entry = Entry(
        lowering,
        lowering.hook_work / lowering.duration,
        0.5 * mass * lowering.top_speed**2,
        refused=refusal(log, lowering),
    )
    if efficiency is None or entry.refused:
        return entry
    drum: dict[str, float | None] = {
        "tackle_loss": (1 - efficiency) * lowering.hook_work,
        "drum_work": efficiency * lowering.hook_work,
        "drum_work_low": efficiency * lowering.hook_work_low,
        "drum_work_high": efficiency * lowering.hook_work_high,
    }
    if lines is not None and radius is not None:
        drum["drum_speed"] = lines * lowering.top_speed / radius
        drum["drum_torque"] = efficiency * lowering.mean_load * radius / lines
    share = shares.get(lowering.kind)
    if share is not None:
        drum["auxiliary_work"] = share * efficiency * lowering.hook_work
        drum["friction_work"] = (1 - share) * efficiency * lowering.hook_work
    return dataclasses.replace(entry, **drum)
