"""Recordings of a rig with a known truth, and the files in which loggers write them."""

import datetime
import tempfile
from pathlib import Path

import numpy as np
from scenes import drawworks_brake

import simbrake as sb

START = datetime.datetime(2026, 3, 1, 23, 50, tzinfo=datetime.UTC)
FACTORS = {
    "m": 1.0,
    "ft": 0.3048,
    "N": 1.0,
    "kN": 1e3,
    "kdaN": 1e4,
    "tonf": 9806.65,
    "klbf": 4448.2216152605,
}
#: columns of a small recording: name, unit, SI values (None: a null)
SMALL = {
    "BPOS": ("m", [30.0, 28.5, 28.5, 24.0, 24.0]),
    "HKLD": ("kN", [9.0e5, 8.8e5, 8.9e5, None, 9.1e5]),
    "DBTM": ("m", [1500.0, 1501.5, 1501.5, 1506.0, 1506.0]),
}
TIMES = [0.0, 2.0, 4.0, 6.0, 8.0]


def stamp(t, form=None):
    at = START + datetime.timedelta(seconds=float(t))
    return (
        at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
        if form is None
        else at.strftime(form)
    )


def cells(times, columns, null="-999.25"):
    """Rows of texts in the units of the columns."""
    ready = []
    for unit, values in columns.values():
        scale = FACTORS.get(unit, 1.0)
        ready.append(
            [
                null if x is None or x != x else repr(round(float(x) / scale, 9))
                for x in values
            ]
        )
    return [list(row) for row in zip(*ready, strict=True)]


def witsml(times, columns, version="1.4.1.1"):
    rows = [
        [stamp(t), *row] for t, row in zip(times, cells(times, columns), strict=True)
    ]
    names = ["TIME", *columns]
    units = ["s", *(unit for unit, _ in columns.values())]
    curves = "".join(
        f"<logCurveInfo><mnemonic>{name}</mnemonic><unit>{unit}</unit><columnIndex>{i + 1}</columnIndex></logCurveInfo>"
        for i, (name, unit) in enumerate(zip(names, units, strict=True))
    )
    new = version.startswith("1.4")
    lists = (
        f"<mnemonicList>{','.join(names)}</mnemonicList><unitList>{','.join(units)}</unitList>"
        if new
        else ""
    )
    index = (
        "<indexCurve>TIME</indexCurve>"
        if new
        else '<indexCurve columnIndex="1">TIME</indexCurve>'
    )
    data = "".join(f"<data>{','.join(row)}</data>" for row in rows)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<logs xmlns="http://www.witsml.org/schemas/1series" version="{version}">'
        f"<log><indexType>date time</indexType>{index}<nullValue>-999.25</nullValue>{curves}"
        f"<logData>{lists}{data}</logData></log></logs>"
    )


def las(times, columns, wrap=False):
    names = "".join(
        f"{name}.{unit} : a curve\n"
        for name, (unit, _) in {"TIME": ("S", ()), **columns}.items()
    )
    rows = [
        [f"{t:g}", *row] for t, row in zip(times, cells(times, columns), strict=True)
    ]
    lines = "".join(("\n" if wrap else " ").join(row) + "\n" for row in rows)
    return (
        f"~Version\nVERS. 2.0 : CWLS\nWRAP. {'YES' if wrap else 'NO'} : "
        f"lines\n~Well\nSTRT.S {times[0]:g} :\n"
        f"STOP.S {times[-1]:g} :\nSTEP.S 0 :\nNULL. -999.25 :\n~Curve\n{names}~A\n{lines}"
    )


def table(times, columns, *, separator=",", units="row", time="iso", comma=False):
    """A CSV: `units` in a `row`, or `behind` the names; `time` as a logger writes
    it."""
    before = {
        "iso": (["Time"], [[stamp(t)] for t in times]),
        "date and clock": (
            ["YYYY/MM/DD", "HH:MM:SS"],
            [[stamp(t, "%Y/%m/%d"), stamp(t, "%H:%M:%S")] for t in times],
        ),
        "day first": (
            ["Date", "Time"],
            [[stamp(t, "%d.%m.%Y"), stamp(t, "%H:%M:%S")] for t in times],
        ),
        "clock": (["Clock"], [[stamp(t, "%H:%M:%S")] for t in times]),
        "am and pm": (
            ["Date Time"],
            [[stamp(t, "%m/%d/%Y %I:%M:%S %p")] for t in times],
        ),
        "seconds": (["Elapsed Time"], [[f"{t:g}"] for t in times]),
    }[time]
    names = list(before[0])
    lines = before[1]
    named = [
        f"{name} ({unit})" if units == "behind" else name
        for name, (unit, _) in columns.items()
    ]
    head = [separator.join([*names, *named])]
    if units == "row":
        first = ["s" if time == "seconds" else ""] + [""] * (len(names) - 1)
        head.append(separator.join([*first, *(unit for unit, _ in columns.values())]))
    rows = [
        separator.join([*a, *b])
        for a, b in zip(lines, cells(times, columns), strict=True)
    ]
    text = "\n".join([*head, *rows]) + "\n"
    return text.replace(".", ",") if comma else text


def written(folder, name, text, encoding="utf-8"):
    file = folder / name
    file.write_bytes(text.encode(encoding))
    return file


def log_of(*file, **more):
    """What is read of a file that is written."""
    return sb.rig.read(written(*file, **more))


WRITERS = {"a.xml": witsml, "a.las": las, "a.csv": table}


def recording(folder, t, height, load, name="a.xml", **other):
    """What is read of a file of heights (m) and hook loads (N)."""
    columns = {"BPOS": ("m", height), "HKLD": ("kN", load), **other}
    return log_of(folder, name, WRITERS[name](t, columns))


def values(columns, name):
    return np.array([np.nan if x is None else x for x in columns[name][1]])


def trip(stands, *, dt=0.02, inertia=60e3):
    """A block that goes down and up: times, heights, hook loads, and the true work of
    each lowering.

    Of each stand: travel (m), speed (m/s), acceleration (m/s^2), load (N) while
    lowering and 12 s before and after, and else. The load is less `inertia` (kg) times
    the acceleration, so that the work of a lowering is load times travel.
    """
    speed = [np.zeros(round(40 / dt))]
    weight = [np.full(round(40 / dt), stands[0][4])]
    spans = []
    count = 0
    count = speed[0].size
    for travel, top, rate, lowered, idle in stands:
        ramp = np.arange(0.0, top, rate * dt)
        whole = np.concatenate(
            [ramp, np.full(round((travel / top - top / rate) / dt), top), ramp[::-1]]
        )
        whole *= travel / (whole.sum() * dt)
        rest = np.zeros(round(45 / dt))
        speed += [whole, rest, -whole, rest]
        weight += [np.full(whole.size, lowered)] + [
            np.full(x.size, idle) for x in (rest, whole, rest)
        ]
        weight[-5][-round(12 / dt) :] = weight[-3][: round(12 / dt)] = lowered
        spans.append((count, count + whole.size))
        count += 2 * (whole.size + rest.size)
    v = np.concatenate(speed)
    w = np.concatenate(weight)
    t = np.arange(v.size) * dt
    h = 42.0 - np.concatenate([[0.0], np.cumsum(v)[:-1] * dt])
    load = w - inertia * np.gradient(v, dt)
    work = [
        (t[a], t[b], travel, lowered * travel)
        for (a, b), (travel, _, _, lowered, _) in zip(spans, stands, strict=True)
    ]
    return t, h, load, work


def sampled(t, h, load, kind, rng):
    """What a logger makes of it: `fine` 0.1 s, `decimated`, or `held` with heights that
    are read each 5 to 6 s."""
    step = {"fine": 0.1, "decimated": 3.1, "held": 2.4}[kind]
    rows = np.clip(
        np.round(np.arange(0.0, t[-1], step) / (t[1] - t[0])).astype(int), 0, t.size - 1
    )
    noise = load[rows] * (1 + rng.normal(0, 0.003, rows.size))
    if kind == "held":
        read = np.round(
            np.cumsum(rng.uniform(5, 6, int(t[-1] / 5) + 2)) / (t[1] - t[0])
        ).astype(int)
        read = np.concatenate([[0], read])
        at = read[np.searchsorted(read, rows, side="right") - 1]
        return t[rows], h[np.minimum(at, t.size - 1)].round(3), noise
    return t[rows], h[rows].round(3), noise


def book():
    """A small ledger of three lowerings: a string, an empty block, and a jump of the
    encoder."""
    stands = [
        (28.0, 1.1, 0.4, 1.2e6, 3e5),
        (27.0, 2.0, 0.5, 3e5, 3e5),
        (20.0, 1.0, 0.5, 1.1e6, 3e5),
    ]
    t, h, load, _ = trip(stands, dt=0.1)
    rows = slice(None, None, 20)
    height = h[rows].copy()
    height[3:6] += 12.0
    with tempfile.TemporaryDirectory() as folder:
        file = written(
            Path(folder),
            "a.xml",
            witsml(t[rows], {"BPOS": ("m", height), "HKLD": ("kN", load[rows])}),
        )
        return sb.rig.ledger(sb.rig.read(file), lines=8)


def comparison():
    """A replay of two lowerings of a string on a small scene, beside its recording."""
    brake = drawworks_brake()
    heat = sb.lumped_heat(rim=2e5, partition=0.9, rim_cooling=400.0, linings=8e4)
    scene = sb.Scene(
        brake, sb.Duty("20 kN", sb.HookLoad("60 t", 0.4, 8)), sb.Initial(0.0), 1.0, heat
    )
    t, h, load, _ = trip(
        [(28.0, 1.1, 0.15, 6e5, 1.5e5), (27.0, 1.6, 0.2, 6e5, 1.5e5)], dt=0.1
    )
    columns = {"BPOS": ("m", h[::20].round(3)), "HKLD": ("kN", load[::20])}
    with tempfile.TemporaryDirectory() as folder:
        log = log_of(Path(folder), "a.xml", witsml(t[::20], columns))
    return sb.rig.compare(sb.rig.replay(log, scene))
