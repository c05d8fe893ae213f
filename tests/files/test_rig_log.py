"""Recordings of rigs: every format gives the same log, what is assumed is told, damaged
files are errors in words."""

import contextlib
import datetime
import gzip
import pathlib
import re
import tempfile

import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_equal, all_near, faults_of, input_error, near
from rig_recordings import (
    SMALL,
    TIMES,
    las,
    log_of,
    stamp,
    table,
    values,
    witsml,
    written,
)

import simbrake as sb


def faults(*arguments, **settings):
    return [str(fault) for fault in faults_of(sb.rig.read, *arguments, **settings)]


HERE = pathlib.Path()
IN_FEET = {
    "Block Height": ("ft", SMALL["BPOS"][1]),
    "Hook Load": ("klbf", SMALL["HKLD"][1]),
    "Bit Depth": ("ft", SMALL["DBTM"][1]),
}
IN_TONS = {
    "BLKPOS": ("m", SMALL["BPOS"][1]),
    "WOH": ("kdaN", SMALL["HKLD"][1]),
    "DBIT": ("m", SMALL["DBTM"][1]),
}
IN_NEWTONS = {**SMALL, "HKLD": ("N", SMALL["HKLD"][1])}
FILES = {
    "six digits": ("a.csv", table(TIMES, IN_NEWTONS), "utf-8"),
    "six digits in XML": ("a.xml", witsml(TIMES, IN_NEWTONS), "utf-8"),
    "witsml 1.4": ("a.xml", witsml(TIMES, SMALL), "utf-8"),
    "witsml 1.3": ("a.xml", witsml(TIMES, IN_FEET, "1.3.1.1"), "utf-8"),
    "las": ("a.las", las(TIMES, IN_TONS), "utf-8"),
    "wrapped las": ("a.las", las(TIMES, IN_TONS, wrap=True), "utf-8"),
    "iso": ("a.csv", table(TIMES, SMALL), "utf-8"),
    "date and clock": (
        "a.csv",
        table(TIMES, IN_FEET, units="behind", time="date and clock"),
        "utf-8-sig",
    ),
    "german": (
        "a.csv",
        table(TIMES, IN_TONS, separator=";", comma=True, time="clock"),
        "utf-16",
    ),
    "day first": (
        "a.csv",
        table(TIMES, IN_TONS, separator="\t", time="day first"),
        "utf-8",
    ),
    "empty rows": (
        "a.csv",
        table(TIMES, SMALL).replace(",m,kN,m\n", ",m,kN,m\n,,,\n") + ",,,\n",
        "utf-8",
    ),
    "latin": (
        "a.csv",
        "Größe der Anlage,;\n" + table(TIMES, IN_TONS, separator=";", comma=True),
        "latin-1",
    ),
    "am and pm": ("a.csv", table(TIMES, IN_FEET, time="am and pm"), "utf-16-le"),
    "quoted": (
        "a.csv",
        re.sub(r"([^,\n]+)", r'"\1"', table(TIMES, IN_FEET, units="behind")),
        "utf-8",
    ),
    "old lines": ("a.csv", table(TIMES, SMALL).replace("\n", "\r"), "utf-8"),
    "seconds": ("a.csv", table(TIMES, SMALL, time="seconds"), "utf-8"),
}


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_log(tmp_path, name):
    log = log_of(tmp_path, *FILES[name])
    all_near(log.t, TIMES)
    for role, column in (
        ("block_position", "BPOS"),
        ("hook_load", "HKLD"),
        ("bit_depth", "DBTM"),
    ):
        all_near(log[role].value, values(SMALL, column), 1e-9)
    assert log["hook_load"].nulls == 1
    dated = name not in ("las", "wrapped las", "german", "seconds")
    assert (log.start or "none").startswith("2026-03-01T23:50:00" if dated else "none")


def test_clock_passes_midnight_and_time_zones(tmp_path):
    times = [0.0, 400.0, 800.0, 1200.0, 1600.0]
    log = log_of(tmp_path, "a.csv", table(times, SMALL, time="clock"))
    all_near(log.t, times)
    zoned = table(TIMES, SMALL).replace("T23:50:0", "T23:50:0").replace("Z,", "+02:00,")
    assert log_of(tmp_path, "b.csv", zoned).start == "2026-03-01T21:50:00Z"


def test_held_values_are_updates(tmp_path):
    """A block falls at 1 m/s, rows are each 2 s, its height is read each 6 s: the
    updates have the speed."""
    t = np.arange(0.0, 240.0, 2.0)
    true = 40.0 - np.clip(t - 60.0, 0.0, 30.0)
    held = true[(np.arange(t.size) // 3) * 3]
    columns = {"BPOS": ("m", held), "HKLD": ("kN", 9e5 + 1e3 * np.sin(t))}
    log = log_of(tmp_path, "a.xml", witsml(t, columns))
    position = log.position
    assert position.held
    near(position.interval, 6.0)
    falls = np.diff(position.value[position.updates]) / np.diff(
        position.t[position.updates]
    )
    all_near(falls[1:], -1.0)
    assert not log["hook_load"].held
    near(log["hook_load"].interval, 2.0)


def test_repeated_times_gaps_and_reversed_rows(tmp_path):
    t = np.concatenate([np.arange(0.0, 60.0, 2.0), np.arange(200.0, 260.0, 2.0)])
    t[5] = t[4]
    columns = {"BPOS": ("m", 30.0 - 0.1 * t), "HKLD": ("kN", 9e5 + t)}
    log = log_of(tmp_path, "a.xml", witsml(t, columns))
    all_near(log.gaps, [[58.0, 200.0]])
    assert log.repeated == 1
    near(log["HKLD"].value[4], 9e5 + t[5])
    turned = {name: (unit, x[::-1]) for name, (unit, x) in columns.items()}
    back = log_of(tmp_path, "b.xml", witsml(t[::-1], turned))
    assert np.all(np.diff(back["BPOS"].value) < 0)
    whole = {"BPOS": ("m", np.arange(40.0, 0.0, -1)), "HKLD": ("kN", 9e5 * np.ones(40))}
    text = table(np.arange(40) // 4 * 1.0, whole, time="clock")
    coarse = log_of(tmp_path, "c.csv", text)
    all_near(coarse.t, 0.25 * np.arange(40))


def test_other_words_for_columns(tmp_path):
    text = table(
        TIMES,
        {"A": ("m", SMALL["BPOS"][1]), "B": ("", [100.0, 90.0, -1.0, 95.0, 96.0])},
    )
    file = written(tmp_path, "a.csv", text)
    told = faults(file)
    assert len(told) == 2
    assert "has no block position" in told[0]
    assert "has no hook load" in told[1]
    log = sb.rig.read(
        file,
        names={"block_position": "A", "hook_load": "B [kdaN]"},
        null=-1,
        offset=1.5,
    )
    all_near(log["hook_load"].value, [1e6, 9e5, np.nan, 9.5e5, 9.6e5])
    all_near(log["hook_load"].t, np.array(TIMES) - 1.5)
    all_near(log["block_position"].t, TIMES)
    assert "(offset)" in log.guesses[-1]


def at(times, rows=4, head="Time", **settings):
    """A log whose rows, 2 s apart from 23:59:56 on 29 January 2020, have times of a
    form of `strftime` or texts."""
    first = datetime.datetime(2020, 1, 29, 23, 59, 56)
    every = [first + datetime.timedelta(seconds=2 * i) for i in range(rows)]
    texts = [one.strftime(times) for one in every] if isinstance(times, str) else times
    lines = "".join(f"{text};{30 - i};900\n" for i, text in enumerate(texts))
    units = ";" * head.count(";")
    text = f"{head};BPOS;HKLD\n{units};m;kN\n{lines}"
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return sb.rig.read(written(HERE, "a.csv", text), **settings)


def refused(*arguments, **settings):
    with input_error() as caught:
        at(*arguments, **settings)
    return str(caught.value)


@pytest.mark.parametrize(
    ("form", "head"),
    [
        ("%H:%M:%S %d/%m/%Y", "Time"),
        ("%d/%m/%Y-%H:%M:%S", "Time"),
        ("%Y-%m-%d-%H:%M:%S", "Time"),
        ("%Y-%m-%dT%H:%M:%S.000", "Time"),
        ("%Y/%m/%d_%H:%M:%S:000", "Time"),
        ("%d-%b-%y %I:%M:%S %p", "Time"),
        ("%A, %d %B %Y, %H:%M:%S", "Time"),
        ("%a %b %d %H:%M:%S %Y", "Time"),
        ("%b %d, %Y %H:%M:%S", "Time"),
        ("%d.%m.%Y %H.%M.%S", "Time"),
        ("%H.%M.%S %d.%m.%Y", "Time"),
        ("%Y%m%dT%H%M%S", "Time"),
        ("%Y%m%d%H%M%S", "Time"),
        ("%y-%m-%d %H:%M:%S", "Stamp"),
        ("%d/%b/%Y:%H:%M:%S", "Stamp"),
        ("%d/%m/%Y;%H:%M:%S", "Date;Time"),
        ("%H:%M:%S;%d.%m.%Y", "Clock;Day"),
        ("%Y%m%d;%H%M%S", "Rig Date;Time"),
    ],
)
def test_dates_and_clocks_in_any_order(form, head):
    log = at(form, head=head)
    assert log.start == "2020-01-29T23:59:56"
    all_equal(log.t, [0.0, 2.0, 4.0, 6.0])


@pytest.mark.parametrize(
    ("zone", "start"),
    [
        ("Z", "2020-01-29T23:59:56"),
        (" UTC", "2020-01-29T23:59:56"),
        ("+01:00", "2020-01-29T22:59:56"),
        (" UTC+1", "2020-01-29T22:59:56"),
        ("-0030", "2020-01-30T00:29:56"),
        (" (CET)", "2020-01-29T22:59:56"),
        (" Europe/Oslo", "2020-01-29T22:59:56"),
        (" EST", "2020-01-30T04:59:56"),
    ],
)
def test_zones_behind_clocks(zone, start):
    for form in (f"%Y-%m-%d %H:%M:%S{zone}", f"%H:%M:%S{zone} %d/%m/%Y"):
        log = at(form)
        assert log.start == f"{start}Z"
    summer = at(
        [
            f"2020-03-29 {clock}"
            for clock in ("01:59:58 CET", "03:00:00 CEST", "03:00:02 Europe/Oslo")
        ]
    )
    all_equal(summer.t, [0.0, 2.0, 4.0])


#: texts of a column of times, some of which are none
NO_TIMES = (
    "%H:%M:%S yesterday",
    "%Y-%m-%d %H:%M:%S NN",
    ["2020-01-29 10:00", "2020-01-29 10:61"],
    ["2020-01-29 10:00", "2020-01-29 25:00"],
    ["2020-01-29 10:00Z", "2020-01-29 10:01"],
    ["2020-01-29 10:00", "2020-01-29 10:01", "10:02"],
    ["2020-01-29 10:00", "2020-01-29"],
    ["03/02/2020 10:00", "05/02/2020 10:00", "31/02/2020 10:00"],
    ["Wed 29/01/2020 10:00", "Wed 30/01/2020 10:00"],
    ["2020-01-29 10:00", ""],
)


def test_a_time_that_is_not_understood_is_refused(request):
    assert_refused(request, "rig_times", (lambda x=x: at(x) for x in NO_TIMES))


@pytest.mark.parametrize("head", ["Date;Time", "Time;RIG DATE"])
def test_a_date_beside_clocks_is_not_dropped(head):
    date = "%d%m%y"
    clock = "%H:%M:%S"
    form = f"{date};{clock}" if head.startswith("Date") else f"{clock};{date}"
    assert "'290120' is no date" in refused(form, head=head)
    assert at(form, head=head, time="Time").start is None
    names = head.split(";")
    ordered = names if names[0] == "Date" else names[::-1]
    assert at(form, head=head, time=(*ordered, "%d%m%y")).start == "2020-01-29T23:59:56"


@pytest.mark.parametrize(
    ("form", "other"),
    [("%H:%M:%S %d/%m/%Y", "10:00:07 2/29/2020"), ("%Y-%j %H%M%S", "")],
)
def test_a_format_is_obeyed_in_each_row(form, other):
    days = [datetime.datetime(2020, 2, day, 10, 0, 7) for day in (3, 4, 5, 6)]
    texts = [day.strftime(form) for day in days]
    assert at(texts, time=("Time", form)).start == "2020-02-03T10:00:07"
    told = refused([*texts[:2], other, texts[3]], time=("Time", form))
    assert f"line 5, column Time: {other!r} does not fit" in told


@pytest.mark.parametrize(
    ("days", "head", "start"),
    [
        (["03/02/2020", "03/13/2020"], "Time", "2020-03-02"),
        (["03/02/2020", "13/02/2020"], "Time", "2020-02-03"),
        (["03/02/2020", "04/02/2020"], "Time", "2020-02-03"),
        (["03/02/2020"], "Time (DD/MM/YYYY hh:mm:ss)", "2020-02-03"),
    ],
)
def test_day_and_month_are_settled(days, head, start):
    """By the column, by days that follow each other, by the name of the column; what
    does not settle it is told."""
    log = at([f"{day} 10:00:0{i}" for day in days for i in (0, 2)], head=head)
    assert log.start == f"{start}T10:00:00"
    same = at(["03/02/2020 10:00:00", "03/02/2020 10:00:02"])
    assert "which the log does not decide" in same.guesses[-1]


LAS3 = """~Version
VERS. 3.0 : CWLS LOG ASCII STANDARD
WRAP. NO : one line a step
DLM. {dlm} : between the cells
~Well
NULL. -1 :
WELL. Kraken :
~Tops_Definition
TOPN. : name {{S}}
~Tops_Data | Tops_Definition
Shale
~{head}
DATE. : day {{DD/MM/YYYY}}
HOUR. : clock {{hh:mm:ss}}
XPOS.M : Block Position {{F10.3}}
HKLD.KN : load {{F10.3}} | Log_Parameter[1]
~{rows}
03/02/2020{sep}10:00:00{sep}30{sep}900
# a remark
03/02/2020{sep}10:00:02{sep}29.5{sep}-1
03/02/2020{sep}10:00:04{sep}29{sep}910
~Inclinometry_Definition
MD.M : depth
"""


@pytest.mark.parametrize(
    ("dlm", "sep"), [("SPACE", " "), ("COMMA", ","), ("TAB", "\t")]
)
@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("Curve", "ASCII | Curve"),
        ("Log_Definition", "Log_Data | Log_Definition"),
        ("CURVE", "A"),
        ("Log_Definition[2]", "Log_Data[2] | Log_Definition[2]"),
        ("Drilling_Definition", "DRILLING_DATA"),
    ],
)
def test_las_3(tmp_path, dlm, sep, head, rows):
    log = log_of(tmp_path, "a.las", LAS3.format(dlm=dlm, sep=sep, head=head, rows=rows))
    assert log.start == "2020-02-03T10:00:00"
    all_equal(log.t, [0.0, 2.0, 4.0])
    all_equal(log["block_position"].value, [30.0, 29.5, 29.0])
    all_equal(log["hook_load"].value, [9e5, np.nan, 9.1e5])


def test_compensated_position_is_told(tmp_path):
    columns = {"BLOCKCOMP": SMALL["BPOS"], "HKLD": SMALL["HKLD"]}
    log = log_of(tmp_path, "a.xml", witsml(TIMES, columns))
    assert log.compensated
    both = log_of(
        tmp_path, "b.xml", witsml(TIMES, {**columns, "BLOCKUCOMP": SMALL["BPOS"]})
    )
    assert (both.compensated, both.position.mnemonic) == (False, "BLOCKUCOMP")


SHORT = {"BPOS": SMALL["BPOS"], "HKLD": SMALL["HKLD"]}
BOMB = (
    '<!DOCTYPE logs [<!ENTITY a "aaaaaaaaaa"><!ENTITY b '
    '"&a;&a;&a;&a;&a;">]><logs><log><logData><data>&b;</data>'
    "</logData></log></logs>"
)
OUTSIDE = '<!DOCTYPE logs [<!ENTITY x SYSTEM "file:///etc/hostname">]><logs><log>&x;</log></logs>'
XML = witsml(TIMES, SHORT)
CSV = table(TIMES, SHORT)
DAMAGED = [
    # bomb
    BOMB,
    # outside
    OUTSIDE,
    # cut
    XML[: XML.index("890.0")],
    # not closed
    XML.replace("</data></logData>", "</logData>"),
    # other XML
    "<svg><g/></svg>",
    # deep
    "<logs>" + "<a>" * 60,
    # no rows
    witsml([], {name: (unit, []) for name, (unit, _) in SHORT.items()}, "1.4.1.1"),
    # torn row
    XML.replace(",890.0<", "<"),
    # huge
    CSV.replace("28.5,880.0", "1e308,1e308"),
    # huge loads
    CSV.replace(".0\n", "e300\n"),
    # huge times
    CSV.replace("\n,", "\nd,")
    .replace("2026-", "1")
    .replace("03-01T23:50:0", "0")
    .replace(".000Z", "e305"),
    # year 0
    CSV.replace("2026-", "0000-"),
    # no loads
    re.sub(r",\d+\.0\n", ",0\n", CSV),
    # negative
    re.sub(r",(\d+\.0)\n", r",-\1\n", CSV),
    # torn line
    CSV.replace(",890.0\n", "\n"),
    # unknown unit
    CSV.replace("kN", "bananas"),
    # other kind
    CSV.replace("kN", "kg/m3"),
    # no unit
    CSV.replace(",m,kN", ",m,"),
    # nulls
    witsml(TIMES, {**SHORT, "HKLD": ("kN", [None] * 5)}),
    # no time
    CSV.replace(stamp(2), "x"),
    # by depth
    re.sub(r">20[^,]*,", ">1.5,", XML).replace("date time", "measured depth"),
    # backwards
    XML.replace(stamp(6), stamp(3)),
    # one time
    re.sub(r"23:50:0\d", "23:50:00", XML),
    # empty
    "\n \n",
    # words
    "once upon a time\nthere was a rig\n",
    # twice
    CSV.replace("HKLD", "BPOS"),
    # las without data
    las(TIMES, SHORT).split("~A")[0],
]


def test_damaged_files_are_errors_in_words(tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    files = (lambda text=text: log_of(HERE, "a.txt", text) for text in DAMAGED)
    assert_refused(request, "rig_logs", files)


@pytest.mark.parametrize("start", [CSV, XML[: XML.index(",890.0")]])
def test_a_row_without_end_is_refused_before_memory_is(tmp_path, start):
    file = written(tmp_path, "a.gz", "")
    with gzip.open(file, "wb", 1) as packed:
        packed.write(start.encode() + b"1" * (20 << 20) + b"\n2")
    assert "has a row of more than 16 MB" in faults(file)[0]


def test_all_errors_at_once(tmp_path):
    text = (
        CSV.replace("kN", "bananas")
        .replace(",m,", ",acres,")
        .replace(stamp(6), stamp(3))
    )
    told = faults(written(tmp_path, "a.csv", text))
    assert len(told) == 3
    assert len(faults(tmp_path)) == 1
    assert "LAS" in faults(written(tmp_path, "a.las", "~V\nVERS 2\n~A\n1 2\n"))[0]
    assert (
        len(faults(tmp_path / "none.csv", names={"load": "HKLD"}, offset=float("nan")))
        == 3
    )


def test_cells_that_are_no_numbers_are_told(tmp_path):
    text = CSV.replace("880.0", "Bad Input").replace("910.0\n", f"910.0\n{stamp(10)}\n")
    log = log_of(tmp_path, "a.csv", text)
    assert log["HKLD"].nulls == 2
    assert any(
        "1 cells are no numbers ('Bad Input' in line 4)" in guess
        for guess in log.guesses
    )
    assert any(
        "line 8, the last, has 1 of 3 cells: left out" in guess for guess in log.guesses
    )


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_file_that_is_cut_inside_its_last_number(tmp_path, end):
    """91 of 910 kN may be the reading: it is read, and told; not with a line end more."""
    text = CSV.replace("\n", end)
    log = log_of(tmp_path, "a.csv", text[: -len(f"0.0{end}")])
    assert (log.t.size, log["HKLD"].value[-1]) == (5, 91e3)
    assert any("the last, has no end" in guess for guess in log.guesses)
    whole = log_of(tmp_path, "a.csv", text)
    assert whole["HKLD"].value[-1] == 910e3
    assert not any("has no end" in guess for guess in whole.guesses)


@pytest.mark.parametrize("name", ["a.csv", "a.xml"])
def test_activities_in_words(tmp_path, name):
    text = (
        {"a.csv": CSV, "a.xml": XML}[name]
        .replace("HKLD", "HKLD,Rig Activity")
        .replace(",m,kN", ",m,kN,")
    )
    text = re.sub(r"(\d\.0|-999\.25)(?=\n|</data>)", r"\1,Trip in", text)
    activity = log_of(tmp_path, name, text)["activity"]
    assert activity.words == ("Trip in",)
    assert activity.nulls == 0


def test_a_long_recording_is_read_in_pieces_with_progress(tmp_path):
    t = 2.0 * np.arange(60_000)
    columns = {"BPOS": ("m", 20 + 10 * np.sin(t)), "HKLD": ("kN", 9e5 + t)}
    columns |= {f"C{i}": ("", t) for i in range(18)}
    file = written(tmp_path, "a.csv", table(t, columns))
    seen = []
    log = sb.rig.read(file, progress=lambda *done: seen.append(done))
    all_near(log["HKLD"].value, columns["HKLD"][1], 1e-9)
    all_near(log["C17"].value, t)
    assert len(seen) >= 3
    assert seen == sorted(seen)
    assert seen[-1] == (file.stat().st_size,) * 2
