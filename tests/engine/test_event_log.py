"""The event log of long runs: events where their conditions are met, and work that grows with their number alone."""

import math
from types import SimpleNamespace
from typing import NamedTuple

import jax
import numpy as np
import pytest
import staged_scenes as staged
from heat_scenes import fading
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._phases import Ended
from simbrake._physics._mechanism import BandMode, BrakeCode, Label
from simbrake._run import _log, _report, _scan
from simbrake._run._log import Phase
from simbrake.hybrid import Code
from simbrake.results import Event, Status

LININGS, BETA, F, T0 = 20, 0.2, 0.4, 1e4


def swinging(cycles: int) -> sb.Result:
    """A run of an elastic band under a load that swings by ±100 kN·m in every second, past the grip either way."""
    linings = sb.Lining(sb.ConstantFriction(F, 1.1), np.full(LININGS, BETA))
    brake = sb.Brake(sb.Pulley(0.7, 2000.0), sb.Band(0.7, 3e5), linings)
    load = sb.TorqueLoad(sb.Repeated([0.0, 0.25, 0.75, 1.0], [0.0, 1e5, -1e5, 0.0], 1.0, cycles))
    return sb.simulate(sb.Scene(brake, sb.Duty(sb.Constant(T0), load), sb.Initial(0.5), float(cycles)), max_steps=16384)


@pytest.fixture(scope="module")
def logs():
    """Long runs of 60 and 240 cycles, and what each log handed to every compiled program: the shapes of all arrays, per
    call."""
    given: dict[str, list[tuple[tuple[int, ...], ...]]] = {}
    runs = []

    def counted(name, original):
        def call(*arguments, **named):
            given.setdefault(name, []).append(tuple(np.shape(leaf) for leaf in jax.tree.leaves(arguments)))
            return original(*arguments, **named)

        return call

    with pytest.MonkeyPatch.context() as patch:
        for name in ("_sights_quick", "_sights_optimised", "_sights_inside_compiled"):
            patch.setattr(_scan, name, counted(name, getattr(_scan, name)))
        for cycles in (60, 240):
            given.clear()
            result = swinging(cycles)
            assert len(result.events) > 35 * cycles
            runs.append((result, dict(given)))
    return runs


@pytest.mark.slow
def test_every_lining_limit_is_where_the_tension_is_at_the_limit(logs):
    """`T_n = T_0 μ^i` when lining `i` comes to its limit, `T_0/μ^(n+1−i)` counted from the anchor (model §3)."""
    result, _ = logs[0]
    events = [e for e in result.events if e.name == "lining_limit"]
    assert len(events) > 700
    z = 1.1 * F * np.tan(BETA / 2)
    mu = (1 + z) / (1 - z)
    i = np.array([e.lining for e in events])
    tension = np.asarray(result.series([e.time for e in events], left=True).tight_tension) / T0
    ahead, back = mu**i, mu ** (i - 1.0 - LININGS)
    np.testing.assert_allclose(tension, np.where(tension > 1, ahead, back), rtol=1e-9)


@pytest.mark.slow
def test_every_full_slip_follows_the_limits_of_all_linings(logs):
    """Counted from the slack end, or from the anchor when the band slides back."""
    result, _ = logs[1]
    slips = [k for k, e in enumerate(result.events) if e.name == "full_slip"]
    ahead = list(range(1, LININGS + 1))
    assert len(slips) > 110
    for k in slips:
        before = result.events[k - LININGS : k]
        assert {e.name for e in before} == {"lining_limit"}
        assert [e.lining for e in before] in (ahead, ahead[::-1])


@pytest.mark.slow
def test_the_work_grows_with_the_number_of_events(logs):
    (short, few), (long, many) = logs
    ratio = len(long.events) / len(short.events)
    assert ratio == pytest.approx(4.0, abs=0.2)
    assert list(few) == list(many)
    for name, calls in few.items():
        assert len(many[name]) < 1.1 * ratio * len(calls)
        # nothing compiles for the length of a run
        assert {*calls} == {*many[name]} == {calls[0]}


def test_the_log_takes_few_partial_steps(logs):
    """Two or three for each event, and one for each step that ends with one: samples of steps take none."""
    for result, calls in logs:
        steps = sum(shapes[-1][0] for shapes in calls["_sights_inside_compiled"])
        assert steps < 3.5 * len(result.events) + 1024


def test_a_slow_zero_does_not_hold_up_the_others():
    """`(x − a)^p` rises through 0 at `a`: at a flat zero (p = 9) secants hardly help, at p = 1 one is enough."""
    a, p = np.linspace(0.2, 0.7, 1001), np.ones(1001)
    p[500] = 9
    evaluated = np.zeros(1001, int)

    def function(some, x):
        evaluated[some] += 1
        return (x - a[some]) ** p[some]

    low, high = np.zeros(1001), np.ones(1001)
    found = _report._rise(function, low, high, (low - a) ** p, (high - a) ** p)
    np.testing.assert_allclose(np.delete(found, 500), np.delete(a, 500), rtol=3e-15)
    assert abs(found[500] - a[500]) <= 1e-15 ** (1 / 9)  # |f| ≤ 1e-15 is taken for 0
    assert evaluated[500] > 10
    assert np.delete(evaluated, 500).max() <= 5


@pytest.mark.slow
def test_the_log_of_a_run_that_fails_is_the_beginning_of_the_whole_one():
    whole = sb.simulate(stop_scene())
    for steps in (2, 4, 5, 8):
        failed = sb.simulate(stop_scene(), max_steps=steps, throw=False)
        end = float(failed.record.rows.t[steps])
        wanted = [event for event in whole.events if event.time <= end]
        assert [event[1:] for event in failed.events] == [event[1:] for event in wanted]
        np.testing.assert_allclose(failed.events.times, [event.time for event in wanted], rtol=1e-10)
    assert [event.name for event in sb.simulate(stop_scene(end=float(whole.stopping_time))).events][-2:] == [
        "full_slip",
        "stop",
    ]


# --- the log by hand --------------------------------------------------------------------------------------------------

OPEN, TAKE_UP, ELASTIC, SLIP, SLIP_BACK, HELD = map(Label, BandMode)


def logged(phases, margins, times, start=OPEN):
    """Events of three linings as texts, and the crossings whose times are asked for."""
    asked = []

    def locate(crossings):
        asked.extend(crossings)
        return np.asarray(times)

    events = _log.event_log(phases, np.asarray(margins, float), locate, 3, start)
    return [f"{e.name}{'' if e.lining is None else f' {e.lining}'} {e.time:g}" for e in events], asked


def test_log_of_a_band_that_slides_and_sticks_again():
    """Margins of linings 1 to 3 from the slack end, then from the anchor: the last of each comes with full slip."""
    past = [1.0] * 3
    margins = [
        *([[-1.0] * 6] * 2),  # taken up
        [-1.0, 0.0, -1.0, -1.0, -1.0, -1.0],  # at its limit at once and on the way up: 2
        [-0.5, 0.2, -1.0, -1.0, -1.0, -1.0],
        [0.5, 0.4, -0.1, -1.0, -1.0, -1.0],  # 1 comes to its limit before this sample
        [1.0, 0.6, 0.1, -1.0, -1.0, -1.0],
        *([[*past, -1.0, -1.0, -1.0]] * 2),  # slides
        [*past, -1.0, -1.0, -1.0],  # sticks: nothing is new
        [-1.0, 0.5, -0.1, -1.0, -1.0, -1.0],
        [-1.0, 0.5, -0.1, -1.0, 0.0, -1.0],
        [1.0, 0.5, -0.1, 0.1, 1.0, -1.0],
        [1.0, 0.5, -0.1, -1.0, 1.0, -1.0],  # on another layer of the rope: the same linings
        [1.0, 0.5, -0.1, -1.0, 1.0, 1.0],
        *([[-1.0] * 6] * 2),
    ]
    phases = [
        Phase(TAKE_UP, 0, 1, 0.0, 1.0),
        Phase(ELASTIC, 2, 5, 1.0, 2.0),
        Phase(SLIP, 6, 7, 2.0, 3.0),
        Phase(ELASTIC, 8, 11, 3.0, 4.0),
        Phase(ELASTIC._replace(layer=1), 12, 13, 4.0, 5.0),
        Phase(HELD._replace(layer=1), 14, 15, 5.0, 6.0),
    ]
    found, asked = logged(phases, margins, [1.5, 3.75, 3.25, 4.5])
    assert asked == [(3, 0), (10, 0), (10, 4), (12, 5)]
    assert found == [
        *("slip_onset 1", "lining_limit 2 1", "lining_limit 1 1.5", "lining_limit 3 2", "full_slip 2", "restick 3"),
        *("lining_limit 2 3.25", "lining_limit 1 3.75", "layer_change 4", "lining_limit 3 4.5", "stop 5"),
    ]


def test_log_of_a_band_that_slides_back_and_of_a_run_that_fails_at_once():
    margins = [[-1.0, -1.0, -1.0, -1.0, -1e-13, 0.5], [-1.0, -1.0, -1.0, -1.0, 0.2, 0.6]] + [[-1.0] * 6] * 2
    phases = [Phase(ELASTIC, 0, 1, 0.0, 1.0), Phase(SLIP_BACK, 2, 3, 1.0, 2.0)]
    found, asked = logged(phases, margins, [0.25])
    assert asked == [(0, 4)]
    wanted = ["slip_onset 0", "lining_limit 3 0", "lining_limit 2 0.25", "lining_limit 1 1", "full_slip 1"]
    assert found == wanted
    # after a rest the count begins anew; a phase of one sample has no way up
    margins = [[1.0] * 6, [0.5, 0.0, -1.0, -1.0, -1.0, -1.0]]
    found, asked = logged([Phase(HELD, 0, 0, 0.0, 1.0), Phase(ELASTIC, 1, 1, 1.0, 1.0)], margins, [], start=HELD)
    assert (found, asked) == (["restart 1", "lining_limit 1 1"], [])
    # all at once; what was at its limit as the band let go is so again
    phases = [Phase(SLIP, 0, 0, 0.0, 1.0), Phase(OPEN, 0, 0, 1.0, 2.0), Phase(SLIP_BACK, 0, 0, 2.0, 3.0)]
    back = logged([Phase(SLIP_BACK, 0, 0, 0.0, 1.0)], [[1.0] * 6], [])[0]
    assert back == ["slip_onset 0", *(f"lining_limit {i} 0" for i in (3, 2, 1)), "full_slip 0"]
    limits = [f"lining_limit {i} 0" for i in (1, 2, 3)], [f"lining_limit {i} 2" for i in (3, 2, 1)]
    found = logged(phases, [[1.0] * 6], [])[0]
    assert found == ["slip_onset 0", *limits[0], "full_slip 0", "release 1", "slip_onset 2", *limits[1], "full_slip 2"]


def test_ends_of_phases_follow_the_stop_and_precede_the_rest():
    events = [Event(0.5, "a"), Event(1.0, "stop"), Event(1.0, "restart"), Event(2.0, "b")]
    ends = [Event(t, f"end {i}") for i, t in enumerate((1.0, 1.0, 2.0, 3.0))]
    found = [event.name for event in _log.with_phases(events, ends)]
    assert found == ["a", "stop", "end 0", "end 1", "restart", "end 2", "b", "end 3"]
    assert len(events) == 4
    events = [Event(1.0, "stop"), Event(1.0, "c"), Event(1.0, "stop"), Event(1.0, "d"), Event(4.0, "stop")]
    found = [event.name for event in _log.with_phases(events, ends[:1])]
    assert found == ["stop", "c", "stop", "end 0", "d", "stop"]


def test_a_mark_is_passed_inside_a_step_alone():
    passing = [[-1.0, 1.0, 0.0], [1.0, -1.0, -1.0], [0.0, 1.0, 0.0], [2.0, 1.0, 1.0], [3.0, 0.0, -1.0]]
    found = _log.marks_passed(np.asarray(passing), np.asarray([0, 0, 1, 1, 1]))
    assert found == [(0, 0), (2, 0), (2, 2)]


def test_how_a_run_ends():
    cases = [
        ((HELD, True, False, False), Status.STOPPED),
        ((HELD, False, True, True), Status.HELD),
        ((OPEN._replace(turn=0), True, True, True), Status.STOPPED),
        ((HELD._replace(inner=1), True, False, False), Status.NOT_STOPPED),  # of a staged brake the bandage rests
        ((SLIP, True, True, True), Status.LOWERING),
        ((OPEN, True, True, True), Status.LOWERING),
        ((OPEN, True, True, False), Status.RELEASED),
        ((SLIP, True, True, False), Status.RUNAWAY),
        ((SLIP, True, False, False), Status.NOT_STOPPED),
    ]
    for (label, moved, exceeded, steady), status in cases:
        assert _log.status_of(label, moved, lambda x=exceeded: x, lambda x=steady: x) == status
    words = sb.brakes.DiscBrake.words
    assert _log.failure_of(Code.EVENT_LIMIT, words)[1] == "raise max_events"
    assert _log.failure_of(BrakeCode.SINGULAR_GEOMETRY, words) == (words.locking, words.unlocking)


def test_events_as_dictionaries_and_by_name():
    assert Event(1.0, "stop").as_dict() == {"time": 1.0, "name": "stop"}
    assert Event(1.0, "lining_limit", 0).as_dict() == {"time": 1.0, "name": "lining_limit", "lining": 0}
    entry = {"time": 1.0, "name": "phase_end", "phase": 2, "cycle": 3, "until": "rest"}
    assert Event(1.0, "phase_end", phase=Ended("", 2, 3, "rest")).as_dict() == entry
    assert Event(1.0, "phase_end", phase=Ended("x", 2, 3, "rest")).as_dict() == entry | {"phase_name": "x"}
    log = sb.results.Events([Event(1.0, "stop"), Event(2.0, "restart"), Event(3.0, "stop")])
    assert log["stop"].times == [1.0, 3.0]
    assert log[1].time == 2.0
    with pytest.raises(KeyError, match="nearest: stop"):
        log["stopp"]
    with pytest.raises(KeyError, match="nearest: slip_onset, lining_limit, full_slip"):
        log["#"]


# --- stages by hand ---------------------------------------------------------------------------------------------------


class Ledger(NamedTuple):
    friction: tuple
    lever_work: np.ndarray
    load_work: np.ndarray


@pytest.mark.parametrize("share", [None, 0.5])
def test_stages_by_hand(share):
    """What lasts no time counts as the next stage's, what a held brake lets go as well; equal neighbours are one."""
    both = SLIP._replace(inner=1)
    labels = [OPEN, SLIP, both, SLIP, HELD, SLIP, *[HELD._replace(inner=1)] * 2]
    external = np.asarray([0.0, 1.0, 3.0, 7.0, 15.0, 31.0, 63.0, 127.0])
    spare = np.full(2, 1e9)  # rows behind the end
    columns = [np.append(k * external, spare) for k in (1, 10, 100, 1000)]
    record = SimpleNamespace(
        count=7,
        rows=SimpleNamespace(t=np.append([0.5, 1.0, 3.0, 3.0, 4.0, 6.0, 7.0, 9.0], spare)),
        states=SimpleNamespace(ledger=Ledger((columns[0], columns[1]), columns[2], columns[3])),
        system=SimpleNamespace(
            grip=SimpleNamespace(shares=None if share is None else SimpleNamespace(heat=np.asarray(share)))
        ),
    )
    wanted = [
        ("open", 0.5, 1.0, 1.0),
        ("stage_1", 1.0, 4.0, 2.0 + 4.0 + 8.0),
        ("held", 4.0, 6.0, 0.0),
        ("stage_1", 6.0, 7.0, 16.0 + 32.0),
        ("stage_3", 7.0, 9.0, 64.0),
    ]
    h = share or 1.0
    stages = _log.stages_of(record, labels)
    assert stages == [(*row[:3], h * row[3], 10 * h * row[3], 100 * row[3], 1000 * row[3]) for row in wanted]
    assert [stage.duration for stage in stages] == [0.5, 3.0, 2.0, 1.0, 2.0]
    assert stages[0].as_dict()["duration"] == 0.5
    assert [_log.stage_of(label) for label in labels[:3]] == ["open", "stage_1", "stage_2"]
    record.count = 5  # ends held
    assert _log.stages_of(record, labels)[-1] == ("held", 4.0, 6.0, 16.0 * h, 160.0 * h, 1600.0, 16000.0)
    record.count = 3  # ends with what lasts no time
    assert [stage.name for stage in _log.stages_of(record, labels)] == ["open", "stage_1"]


def test_a_missing_stage_has_its_reason():
    brake, J = staged.brake(), staged.J
    tension = float(sb.results.internal_slip_tension(brake, J, 100.0))

    def absent(brake, seen, greatest):
        found = _log.absent_stages(brake, J, 100.0, set(seen.split()), greatest, (None, None))
        return {one["name"]: one["reason"] for one in found}

    weak = absent(brake, "stage_1", 0.9 * tension)
    assert list(weak) == ["stage_2", "stage_3"]
    assert weak["stage_2"] == (
        f"the internal pair slides from a slack tension of {tension / 1e3:.5g} kN on, "
        f"the lever gave at most {0.9 * tension / 1e3:.5g} kN"
    )
    assert weak["stage_3"] == "the internal pair never slid"
    late = absent(brake, "stage_1", 1.1 * tension)
    assert late["stage_2"] == "the pulley came to rest before the internal pair had to slide"
    assert absent(brake, "stage_1 stage_2", tension) == {
        "stage_3": "the bandage did not come to rest while the pulley turned in it"
    }
    assert absent(brake, "stage_2 stage_3", tension) == {"stage_1": "the internal pair slid from the start"}
    assert absent(brake, "held", tension)["stage_1"] == "the pulley never turned with its bandage"
    assert absent(brake, "stage_1 stage_3", tension) == {}
    warm = staged.brake(law=fading(slope=1e-3))
    tension = float(sb.results.internal_slip_tension(warm, J, 100.0, 400.0, 300.0))
    assert tension != pytest.approx(float(sb.results.internal_slip_tension(warm, J, 100.0, 300.0, 400.0)), rel=1e-3)
    (found, _) = _log.absent_stages(warm, J, 100.0, {"stage_1"}, 0.0, (np.asarray(400.0), np.asarray(300.0)))
    assert f"from a slack tension of {tension / 1e3:.5g} kN on" in found["reason"]
    z = staged.F_EXT * math.tan(staged.BETA / 2)
    Pi = ((1 + z) / (1 - z)) ** np.arange(staged.N + 1)
    drive = staged.R_B * (Pi[-1] - 1) * J / (J + staged.J_B)
    growth = 0.6 * staged.R * np.sum(Pi[1:] + Pi[:-1]) * math.sin(staged.BETA / 2)
    strong = absent(staged.brake(f_int=0.6), "stage_1", 2 * tension)
    assert f"with {drive:.4g} N·m, the rim drives it with up to {growth:.4g} N·m" in strong["stage_2"]
