"""Lowerings in recordings of a rig, and the ledger: known work in every sampling,
states, flags, what is refused."""

import json
import re

import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_near, input_error, near
from rig_recordings import (
    SMALL,
    TIMES,
    log_of,
    recording,
    sampled,
    trip,
    witsml,
    written,
)

import simbrake as sb

BLOCK = 3.0e5
STRING = 1.2e6
#: travel, speed, acceleration, load lowered, load at rest (in slips: the block's) and
#: hoisted
STANDS = [
    (28.0, 1.1, 0.4, STRING, BLOCK),
    (27.0, 2.0, 0.5, STRING, BLOCK),
    (38.0, 1.6, 0.3, BLOCK, BLOCK),
    (9.0, 0.5, 0.2, STRING, BLOCK),
    (30.0, 0.9, 0.6, 0.9 * STRING, BLOCK),
    (28.0, 1.3, 0.3, STRING, BLOCK),
]


def lowered(*columns, **options):
    return sb.rig.lowerings(recording(*columns, **options))


@pytest.mark.parametrize(
    ("kind", "name"), [("fine", "a.csv"), ("decimated", "a.las"), ("held", "a.xml")]
)
def test_work_of_known_lowerings(tmp_path, kind, name):
    """The work is load times travel, inertia included; the interval holds it, and is a
    few percent wide."""
    t, h, load, true = trip(STANDS)
    log = recording(
        tmp_path, *sampled(t, h, load, kind, np.random.default_rng(1)), name
    )
    assert log.position.held == (kind == "held")
    result = sb.rig.lowerings(log)
    assert len(result.valid) == len(result) == len(true)
    inside = 0
    for one, (begin, end, travel, work), (_, speed, *_) in zip(
        result.lowerings, true, STANDS, strict=True
    ):
        near(one.begin, begin, abs=7.0)
        near(one.end, end, abs=7.0)
        near(one.travel, travel, 0.01)
        # readings that are 5 to 6 s apart
        assert 0.9 * speed < one.top_speed < (1.12 if kind == "held" else 1.01) * speed
        near(one.hook_work, work, 0.02)
        near(one.mean_load, one.hook_work / one.travel)
        near(one.static_load, work / travel, 0.01)
        assert one.hook_work_high - one.hook_work_low < 0.08 * work
        inside += one.hook_work_low <= work <= one.hook_work_high
    assert inside >= 5
    assert [one.kind for one in result.lowerings] == [
        "string",
        "string",
        "block",
        "string",
        "string",
        "string",
    ]
    assert result.tare.low <= 1.01 * BLOCK
    assert result.tare.high >= 0.99 * BLOCK
    shares = result.as_dict()["states"]
    assert shares["in slips"] > 0.5
    near(shares["down"], shares["up"], 0.2)


def test_bounds_by_lowest_and_highest_loads(tmp_path):
    """Readings at rows that miss what is between them: bounds by lowest and highest
    loads hold the work."""
    t, h, load, true = trip(STANDS)
    load = load * (1 + 0.05 * np.sin(2.1 * t))
    rows = np.arange(0, t.size, 125)
    pieces = np.split(load, rows[1:] + 1)
    ends = {
        "HKLD_MIN": ("kN", [piece.min() for piece in pieces[: rows.size]]),
        "HKLD_MAX": ("kN", [piece.max() for piece in pieces[: rows.size]]),
    }
    result = lowered(tmp_path, t[rows], h[rows], load[rows], **ends)
    assert "bounds" in result.interval_by
    for one, (begin, end, *_) in zip(result.lowerings, true, strict=True):
        inside = (t >= begin) & (t <= end)
        work = float(np.trapezoid(load[inside], -h[inside]))
        assert one.hook_work_low < work < one.hook_work_high
        assert one.hook_work_high - one.hook_work_low < 0.3 * work


def shape(*pieces):
    """Heights and times of straight pieces, `(seconds, metres)`, in rows of 2 s."""
    seconds, metres = np.cumsum([[0, 40], *pieces], axis=0).T
    t = np.arange(0.0, seconds[-1], 2.0)
    return t, np.interp(t, seconds, metres), 5e5 + 0.0 * t


#: one lowering by 20 m
ONCE = shape((40, 0), (20, -20), (60, 0))


def test_work_of_a_load_that_grows_with_the_travel(tmp_path):
    """Trapezoids are exact where load and height are straight lines:
    `∫ (F + k x) dx = F L + k L²/2`."""
    t, h, load = shape((40, 0), (40, -20), (60, 0))
    (one,) = lowered(tmp_path, t, h, load + 1e4 * (40.0 - h)).lowerings
    true = 5e5 * 20.0 + 1e4 * 20.0**2 / 2
    near(one.hook_work, true, 1e-9)
    # the load is that of 1 s before: half an interval of the rows, which the interval
    # of the work allows for
    late = np.interp(t - 1.0, t, load + 1e4 * (40.0 - h))
    (one,) = lowered(tmp_path, t, h, late).lowerings
    assert one.hook_work_low < true < one.hook_work_high
    assert one.hook_work < 0.995 * true


@pytest.mark.parametrize(("step", "grid"), [(7.3, 1e-3), (0.5, 0.3048)])
def test_intervals_hold_the_work_of_rare_and_coarse_readings(tmp_path, step, grid):
    """Each 7.3 s, or in whole feet: a load that swings, its true work by the fine
    curve."""
    rng = np.random.default_rng(3)
    stands = [
        (rng.uniform(15, 30), rng.uniform(0.5, 1.6), 0.4, 1.2e6, BLOCK)
        for _ in range(20)
    ]
    t, h, load, true = trip(stands)
    load = load * (1 + 0.03 * np.sin(0.4 * t))
    rows = np.arange(0, t.size, round(step / 0.02))
    result = lowered(tmp_path, t[rows], np.round(h[rows] / grid) * grid, load[rows])
    inside = []
    width = []
    for one, (begin, end, *_) in zip(result.lowerings, true, strict=True):
        span = (t >= begin) & (t <= end)
        work = float(np.trapezoid(load[span], -h[span]))
        inside.append(one.hook_work_low <= work <= one.hook_work_high)
        width.append((one.hook_work_high - one.hook_work_low) / work)
    assert np.mean(inside) >= 0.85
    assert np.median(width) < 0.1


@pytest.mark.parametrize("ahead", [0.0, 3.0, -3.0])
def test_clocks_that_differ_are_told(tmp_path, ahead):
    """By the inertia in the load; with the offset of the note the intervals hold the
    work again."""
    t, h, load, true = trip(STANDS)
    rows = np.arange(0.0, t[-1], 1.0)
    read = np.interp(rows - ahead, t, load) * np.random.default_rng(5).normal(
        1.0, 0.003, rows.size
    )
    columns = {"BPOS": ("m", np.interp(rows, t, h).round(3)), "HKLD": ("kN", read)}
    file = written(tmp_path, "a.xml", witsml(rows, columns))

    def found(offset):
        result = sb.rig.lowerings(sb.rig.read(file, offset=offset))
        pairs = zip(result.lowerings, true, strict=True)
        said = [re.search(r"offset=(\S+) brings", note) for note in result.notes]
        hit = np.mean(
            [
                one.hook_work_low <= work <= one.hook_work_high
                for one, (*_, work) in pairs
            ]
        )
        return hit, [float(match[1]) for match in said if match]

    hit, offsets = found(None)
    if ahead:
        assert hit < 0.5
        near(offsets, [ahead], abs=0.5)
        hit, offsets = found(*offsets)
    assert hit > 0.8
    assert not offsets


@pytest.mark.parametrize(
    ("pieces", "travels"),
    [
        ([(40, 0), (10, -10), (8, 0), (10, -10), (60, 0)], [20]),
        ([(40, 0), (10, -10), (24, 0), (10, -10), (60, 0)], [10, 10]),
        ([(40, 0), (10, -10), (4, 0.2), (10, -10), (60, 0)], [19.8]),
        ([(40, 0), (10, -10), (6, 1), (10, -10), (60, 0)], [10, 10]),
        ([(40, 0), (10, -1.5), (60, 0), (20, 1.5), (10, -8), (100, -1), (60, 0)], [8]),
    ],
)
def test_pauses_heave_and_ends(tmp_path, pieces, travels):
    result = lowered(tmp_path, *shape(*pieces))
    near([one.travel for one in result.lowerings], travels, abs=0.05)
    all_near([one.hook_work for one in result.lowerings], 5e5 * np.array(travels), 0.01)


@pytest.mark.parametrize(
    ("row", "held"), [(2, 5), (2, 3), (3, 5), (3, 7), (4, 6), (1, 2.5), (2, 6)]
)
def test_top_speed_of_heights_that_are_held(tmp_path, row, held):
    """0.8 m/s; readings stand in the rows for longer and shorter times by turns, which
    are no speeds."""
    t = np.arange(0.0, 1600.0, row)
    read = np.floor(t / held + 1e-9) * held % 200.0
    height = np.interp(
        read, [60, 70, 110, 120, 130, 140, 180, 190], [40, 38, 6, 4, 4, 6, 38, 40]
    )
    result = lowered(tmp_path, t, height.round(3), 5e5 + 0.0 * t)
    assert len(result) == 8
    all_near([one.top_speed for one in result.lowerings], 0.8, 0.03)


@pytest.mark.parametrize("speed", [30 / 3600, 60 / 3600])
@pytest.mark.parametrize(("row", "step"), [(1, 0.1), (2, 0.1), (1, 0.01), (5, 0.3048)])
def test_drilling_is_no_lowering(tmp_path, speed, row, step):
    """8 m at 0.5 m/s to the bottom, and 26 m of drilling at once, of which the height
    shows steps."""
    t = np.arange(0.0, 100.0 + 26.0 / speed, row)
    h = 40.0 - np.interp(t, [40, 56, 56 + 26.0 / speed], [0, 8, 34])
    (one,) = lowered(tmp_path, t, (h / step).round() * step, 1e6 + 0.0 * t).lowerings
    near(one.travel, 8.0, abs=0.4)
    near(one.duration, 16.0, abs=10.0)


@pytest.mark.parametrize(
    ("row", "jump", "flags"),
    [(2, 6, ("jump",)), (2, 4, ("jump",)), (6, 0, ()), (2, 1, ())],
)
def test_a_jump_within_a_lowering_is_flagged(tmp_path, row, jump, flags):
    """The encoder is set back by some metres; and a block that falls by twice as much
    in one of its updates."""
    t = np.arange(0.0, 180.0, row)
    h = np.interp(t, [40, 46, 58, 64, 70, 76], [40, 37.5, 32, 25, 22, 19.5])
    if jump:
        h = np.interp(t, [40, 68], [36, 12]) - jump * (t > 54)
    (one,) = lowered(tmp_path, t, h, 5e5 + 0.0 * t).lowerings
    assert one.flags == flags


def test_artefacts_are_flagged_and_left_out(tmp_path):
    t, h, load = shape(
        (40, 0),
        (20, -20),
        (60, 0),
        (20, 5),
        (60, 0),
        (20, -28),
        (60, 0),
        (10, -10),
        (60, 0),
    )
    reset = h.copy()
    reset[(t > 80) & (t < 100)] += 17.0  # 17 m up in one row, and down again in one
    load[t > 270] = np.nan
    result = sb.rig.lowerings(recording(tmp_path, t, reset, load), pause=6.0)
    flags = {round(one.travel): one.flags for one in result.lowerings}
    assert flags == {
        20: (),
        17: ("single update", "too fast"),
        28: ("below floor",),
        10: ("below floor", "load missing"),
    }
    assert [round(one.travel) for one in result.valid] == [20]
    near(result.as_dict()["totals"]["hook_work"], 1e7, 0.01)


def test_states_and_the_log_s_own_codes(tmp_path):
    t, h, load, _ = trip(STANDS, dt=0.1)
    load[(t > 1) & (t < 20)] = 1e5
    codes = np.full(t.size, 99.0)
    columns = {"RIGACTIVITYCODE": ("", codes[::20])}
    result = lowered(tmp_path, t[::20], h[::20], load[::20], **columns)
    assert {one.activity for one in result.lowerings} == {"99"}
    words = np.array(sb.rig.STATES)[result.state]
    assert set(words[(t[::20] > 4) & (t[::20] < 18)]) == {"slack"}
    assert words[np.searchsorted(t[::20], 50.0)] == "down"
    told = sb.rig.lowerings(result.log, tare=(1e6, 1.1e6))
    assert {one.kind for one in told.lowerings} == {"block"}


@pytest.mark.parametrize("stand", [3e4, 4.5e4, 6e4])
def test_a_stand_in_the_elevators_is_not_the_block(tmp_path, stand):
    """Running in from nothing: the block rests longer with a stand than without one."""
    seconds = [40, 28, 110, 28, 10]
    metres = [0, 28, 0, -28, 0]
    ends = np.cumsum(seconds * 5)
    t = np.arange(0.0, ends[-1], 2.0)
    h = 10.0 + np.interp(t, [0, *ends], np.cumsum([0, *(metres * 5)]))
    loads = np.concatenate(
        [BLOCK + stand * np.array([0, 0, 1, n, n]) for n in range(1, 6)]
    )
    noise = np.random.default_rng(4).normal(1.0, 0.005, t.size)
    result = lowered(
        tmp_path, t, h, loads[np.searchsorted(ends, t, side="right")] * noise
    )
    near(result.tare.value, BLOCK, 0.01)
    assert 0.98 * BLOCK < result.tare.low < result.tare.high < 1.02 * BLOCK
    heavy = [
        one.kind
        for n, one in enumerate(result.lowerings, 1)
        if n * stand > 0.29 * BLOCK
    ]
    assert set(heavy) == {"string"}


def test_one_level_is_not_decidable(tmp_path):
    result = lowered(tmp_path, *ONCE)
    assert not result.decidable
    assert {one.kind for one in result.lowerings} == {"not decidable"}


#: true lowerings: 28 m from 40 to 68 s, 27 m from 186 to 204 s, …, 30 m from 591 to 625
#: s
@pytest.mark.parametrize("kind", ["fine", "decimated", "held"])
@pytest.mark.parametrize(
    ("begin", "end", "lost", "cut"),
    [
        pytest.param(48.0, 82.0, [0], 1, id="into a rest"),
        pytest.param(20.0, 58.0, [0], 1, id="out of a rest"),
        pytest.param(184.0, 206.0, [1], 0, id="a whole lowering"),
        pytest.param(602.0, 617.0, [4], 2, id="inside a lowering"),
        pytest.param(84.0, 104.0, [], 0, id="a rest"),
        pytest.param(84.0, 220.0, [1], 0, id="hoisting and lowering"),
        pytest.param(-1.0, 0.5, [], 0, id="no gap"),
    ],
)
def test_a_gap_is_told_and_a_lowering_that_it_cuts_left_out(
    tmp_path, kind, begin, end, lost, cut
):
    """The others keep their work; what the block did in the gap is in no total, and
    that is said."""
    t, h, load, true = trip(STANDS)
    rows, height, force = sampled(t, h, load, kind, np.random.default_rng(1))
    kept = (rows < begin) | (rows > end)
    result = lowered(tmp_path, rows[kept], height[kept], force[kept])
    whole = [one for i, one in enumerate(true) if i not in lost]
    near(
        [one.travel for one in result.valid],
        [travel for _, _, travel, _ in whole],
        0.01,
    )
    work = sum(work for *_, work in whole)
    told = result.as_dict()
    out = result.left_out
    near(told["totals"]["hook_work"], work, 0.02)
    assert told["left_out"] == out
    assert (out["flagged"], out["cut"]) == (cut, cut)
    assert [one.flags[0] for one in result.lowerings if one.flags] == [
        "cut by a gap"
    ] * cut
    if end < 1.0:
        assert (result.gaps, result.lost, out["gaps"]) == ((), (), 0)
        return
    (gap,) = result.gaps
    before = rows[kept][rows[kept] < begin][-1]
    behind = rows[kept][rows[kept] > end][0]
    near((gap.begin, gap.duration), (before, behind - before))
    near(gap.change, height[rows == behind][0] - height[rows == before][0])
    assert (gap.cut, gap.rest) == (cut, not lost)
    assert told["gaps"][0]["change"] == gap.change
    if lost:
        assert (out["gaps"], out["travel"], out["hook_work"]) == (1, None, None)
        near(out["gap_fall"] - out["gap_rise"], -gap.change)


def test_a_day_of_rest_between_two_trips_is_a_rest(tmp_path):
    t, h, load = shape(
        (40, 0), (20, -20), (60, 0), (20, 18), (60, 0), (20, -15), (60, 0)
    )
    log = recording(tmp_path, np.where(t > 90, t + 86400.0, t), h, load)
    result = sb.rig.lowerings(log)
    near([one.travel for one in result.valid], [20.0, 15.0])
    assert result.lost == (
        "gaps in the log: 1, 24 h in all; after each of them the block is where it "
        "was: taken as a rest",
    )
    assert [row["lowerings"] for row in sb.rig.ledger(result).by_trip] == [1, 1]


def test_a_log_whose_only_lowering_is_in_a_gap_is_read(tmp_path):
    t, h, load = ONCE
    kept = (t < 38) | (t > 62)
    book = sb.rig.ledger(recording(tmp_path, t[kept], h[kept], load[kept]), lines=8)
    assert book.answer[0] == "no lowering without flags"
    assert book.answer[-1] == (
        "gaps in the log: 1, 28 s in all; unknown, and in no total: travel and energy "
        "in 1 of them, after which the block is 20 m lower in all"
    )
    assert book.totals["hook_work"] == 0.0


def test_what_has_no_lowerings_is_refused(tmp_path, request):
    rare = witsml([100 * t for t in TIMES], {x: SMALL[x] for x in ("BPOS", "HKLD")})
    low, up, down = (
        recording(tmp_path, *shape((40, 0), (20, metres), (60, 0)))
        for metres in (-1, 20, -20)
    )
    lowerings = sb.rig.lowerings
    cases = (
        lambda: lowerings(down, pause=-1.0),
        lambda: lowerings(low),
        lambda: lowerings(up),
        lambda: lowerings(log_of(tmp_path, "r.xml", rare)),
    )
    assert_refused(request, "lowerings", cases)


# --- the ledger ---------------------------------------------------------------------


def test_energies_at_hook_and_drum(tmp_path):
    """Against the balance by hand: a string and an empty block, eight lines on a drum
    of 0.4 m."""
    t, h, load, true = trip(STANDS)
    found = lowered(
        tmp_path, *sampled(t, h, load, "decimated", np.random.default_rng(2))
    )
    given = {
        "lines": 8,
        "drum_radius": 0.4,
        "efficiency": 0.9,
        "block_mass": 30e3,
        "brake": "auxiliary",
    }
    book = sb.rig.ledger(found, **given, auxiliary={"string": 0.7, "block": 0.0})
    for entry, (_, _, travel, work), (_, speed, *_) in zip(
        book.entries, true, STANDS, strict=True
    ):
        near(entry.drum_work, 0.9 * work, 0.02)
        near(entry.tackle_loss + entry.drum_work, entry.lowering.hook_work)
        near(entry.drum_torque, 0.9 * work / travel * 0.4 / 8, 0.02)
        near(entry.drum_speed, 8 * speed / 0.4, 0.02)
        string = entry.lowering.kind == "string"
        near(entry.friction_work, (0.3 if string else 1.0) * entry.drum_work)
        mass = work / travel / 9.80665 if string else 30e3
        near(entry.kinetic_energy, 0.5 * mass * speed**2, 0.04)
    assert book.separable
    near(book.totals["hook_work"], sum(work for *_, work in true), 0.01)
    near(
        book.totals["auxiliary_work"] + book.totals["friction_work"],
        book.totals["drum_work"],
    )


def test_what_the_log_does_not_separate(tmp_path):
    log = recording(tmp_path, *ONCE)
    book = sb.rig.ledger(log, lines=10, brake="regenerative")
    assert not book.separable
    assert (book.entries[0].friction_work, book.totals["auxiliary_work"]) == (
        None,
        None,
    )
    # the rope over each of ten sheaves, one after the other
    near(book.entries[0].drum_work, 1e7 * 10 / sum(1.04**k for k in range(1, 11)))
    assert sb.rig.ledger(log).entries[0].drum_work is None
    assert (
        sb.rig.ledger(log, lines=10, brake="friction").entries[0].friction_work
        == book.entries[0].drum_work
    )


def test_a_compensated_height_is_no_motion_of_the_drum(tmp_path):
    t, h, load = ONCE
    columns = {"BLOCKCOMP": ("m", h), "HKLD": ("kN", load)}

    def book(**heave):
        file = written(tmp_path, "c.xml", witsml(t, {**columns, **heave}))
        return sb.rig.ledger(sb.rig.read(file), lines=8, drum_radius=0.4)

    calm, rough = (book(RIGHEAVE=("m", size * np.sin(t))) for size in (0.05, 1.0))
    near(calm.entries[0].drum_speed, 20.0)
    for other, words in (
        (rough, r"m exceeds 1 % of 20 m"),
        (book(), "the heave is not recorded"),
    ):
        assert words in other.entries[0].refused
        assert (
            other.entries[0].drum_work
            is other.entries[0].drum_speed
            is other.totals["drum_work"]
            is None
        )
        near(other.entries[0].lowering.hook_work, 1e7, 1e-6)
        assert other.answer[-1].endswith("motion of the drum refused: 1")


def test_trips_days_and_files(tmp_path):
    up = (20, 20)
    down = (20, -20)
    rest = (60, 0)
    pieces = [(40, 0), down, rest, up, (300, 0), down, (4000, 0), up, rest, down, rest]
    log = recording(tmp_path, *shape(*pieces))  # begins 10 min before midnight
    book = sb.rig.ledger(log, lines=8)
    assert [(row["day"], row["lowerings"]) for row in book.by_day] == [
        ("2026-03-01", 2),
        ("2026-03-02", 1),
    ]
    assert [row["lowerings"] for row in book.by_trip] == [2, 1]
    assert [
        row["lowerings"] for row in sb.rig.ledger(log, trip_pause=200.0).by_trip
    ] == [1, 1, 1]
    files = {file.name: file for file in sb.pages.write_ledger(book, tmp_path / "out")}
    assert sorted(files) == [
        "ledger.csv",
        "ledger.html",
        "ledger.json",
        "ledger.png",
        "ledger.txt",
    ]
    kept = json.loads(files["ledger.json"].read_text("utf-8"))
    first = kept["lowerings"][0]
    assert (first["start"], first["begin"]) == ("2026-03-01T23:50:40Z", 40.0)
    near(kept["totals"]["hook_work"], 3e7, 1e-6)
    header, *lines = files["ledger.csv"].read_text("utf-8").splitlines()
    assert len(lines) == 3
    assert (
        float(lines[0].split(",")[header.split(",").index("drum_work")])
        == first["drum_work"]
    )


def test_lines_strung_of_the_log(tmp_path):
    t, h, load = ONCE
    log = recording(tmp_path, t, h, load, LINES_STRUNG=("", 12.0 + 0.0 * t))
    assert sb.rig.ledger(log).settings["lines"] == 12
    changed = recording(
        tmp_path, t, h, load, LINES_STRUNG=("", np.where(t < 60, 12.0, 10.0))
    )
    with input_error(
        match="LINES_STRUNG: lines strung change from 12 to 10 60 s after the first row"
    ):
        sb.rig.ledger(changed)
    assert sb.rig.ledger(changed, lines=10).settings["lines"] == 10


def test_arguments_of_a_ledger_that_cannot_be(tmp_path, request):
    log = recording(tmp_path, *ONCE)
    wrong = {"lines": 0, "drum_radius": float("nan"), "efficiency": 1.1, "brake": "air"}
    cases = (
        lambda: sb.rig.ledger(log, **wrong, auxiliary={"pipe": 2.0}),
        lambda: sb.rig.ledger(log, brake="friction", auxiliary=0.5),
    )
    assert_refused(request, "ledger", cases)
