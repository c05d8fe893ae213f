"""How a run is read: words of its events, the log, what is found between the ends of steps."""

import itertools
import math
from types import SimpleNamespace

import jax
import numpy as np
import pytest
import staged_scenes as staged
from heat_scenes import T0, fading, lump, rigid_stop
from shipped import load

import simbrake as sb
from simbrake._physics import _chain, _mechanism, _sprung
from simbrake._physics._mechanism import BrakeCode, Label
from simbrake._run import _log, _report, _scan
from simbrake._run._duty import Stop, rows_of
from simbrake._run._linings import overlaps
from simbrake._run._log import Phase
from simbrake._run._measure import check_metrics, happened, measure, name_of, unit_of
from simbrake.hybrid import Code
from simbrake.results import METRICS, BandMode, Status, metric_names

LABELS = [_mechanism.Label(int(band), inner) for band in BandMode for inner in (-1, 0, 1)]


def test_every_mode_change_is_named_in_a_row():
    emitted = {
        name
        for before, after in itertools.product(LABELS, LABELS)
        for first in (True, False)
        for name in _mechanism.events_of_change(before, after, first)
    }
    assert {"slip_onset", "full_slip", "stop", "restart", "external_lock", "internal_restick"} <= emitted
    assert emitted <= _log.EVENTS.keys()


def test_single_lining_contacts_have_rows():
    chain = _chain.ChainMode(*[None] * len(_chain.ChainMode._fields))
    bandage = _sprung.SprungMode(*[None] * len(_sprung.SprungMode._fields))
    names = {
        f"{contact}_{what}" for mode in (chain, bandage) for contact in mode.contacts for what in ("slip", "stick")
    }
    assert len(names) == 6
    assert names <= _log.EVENTS.keys()


def test_modes_stages_and_codes_have_words():
    assert set(_mechanism.BAND_MODES) == set(BandMode)
    assert {_log.stage_of(label) for label in LABELS} == set(_log.STAGES)
    assert set(_log.STATUS_MESSAGES) == set(_log.Status)
    assert set(_log.FAILURES) == (set(Code) | set(_mechanism.BrakeCode)) - {Code.COMPLETED}
    assert all(len(words) == 2 and all(words) for words in _mechanism.BAND_MODES.values())
    assert all(about.meaning and about.brakes for about in _log.EVENTS.values())


@pytest.mark.slow
def test_log_work_grows_with_event_number(monkeypatch):
    """What the log of 60 and of 240 cycles of a swinging load hands to compiled programs, call by call."""
    given: dict[str, list[tuple[tuple[int, ...], ...]]] = {}

    def counted(name, original):
        def call(*arguments, **named):
            given.setdefault(name, []).append(tuple(np.shape(leaf) for leaf in jax.tree.leaves(arguments)))
            return original(*arguments, **named)

        return call

    for name in ("_sights_quick", "_sights_optimised", "_sights_inside_compiled"):
        monkeypatch.setattr(_scan, name, counted(name, getattr(_scan, name)))
    runs = []
    for cycles in (60, 240):
        given.clear()
        events = sb.simulate(swinging_load(cycles=cycles), max_steps=16384).events
        runs.append((len(events), dict(given)))
        # two or three partial steps for each event, and one for each step that ends with one
        assert sum(shapes[-1][0] for shapes in given["_sights_inside_compiled"]) < 3.5 * len(events) + 1024
    (short, few), (long, many) = runs
    assert long / short == pytest.approx(4.0, abs=0.2)
    assert list(few) == list(many)
    for name, calls in few.items():
        assert len(many[name]) < 1.1 * long / short * len(calls)
        assert {*calls} == {*many[name]} == {calls[0]}  # nothing compiles for the length of a run


def test_a_slow_zero_does_not_hold_up_others():
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


OPEN, TAKE_UP, ELASTIC, SLIP, SLIP_BACK, HELD = map(Label, BandMode)


def logged(phases, margins, times, start=OPEN):
    """Events of three linings as texts, and the crossings whose times are asked for."""
    asked = []

    def locate(crossings):
        asked.extend(crossings)
        return np.asarray(times)

    events = _log.event_log(phases, np.asarray(margins, float), locate, 3, start)
    return [f"{e.name}{'' if e.lining is None else f' {e.lining}'} {e.time:g}" for e in events], asked


def test_log_of_a_band_that_sticks_again():
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


HOT = 273.15 + 30.0


#: columns of the series of which a metric is the maximum
COLUMNS = {
    "max_tension": ("tension", "slack_tension"),
    "max_normal_load": ("normal_load",),
    "peak_rim_temperature": ("rim_temperature",),
    "peak_lining_temperature": ("lining_temperature",),
}


def warming(end=1.5):
    """Rim and linings get hot and cool again while a lever with corners brakes."""
    heat = lump(2e3, 0.9, 1e3, 400.0, permissible=HOT)
    lever = sb.PiecewiseLinear([0.0, 0.3, 0.7, end], [0.2 * T0, T0, 0.6 * T0, 0.6 * T0])
    return rigid_stop(fading(slope=1e-3), heat, end, lever)


def swinging_load(stiffness=3e5, cycles=3):
    """An elastic band under a load that swings past the grip either way: limits of linings, and jumps of tension."""
    linings = sb.Lining(sb.ConstantFriction(0.4, 1.1), np.full(6, 0.4))
    brake = sb.Brake(sb.Pulley(0.7, 2000.0), sb.Band(0.7, stiffness), linings)
    load = sb.TorqueLoad(sb.Repeated([0.0, 0.25, 0.75, 1.0], [0.0, 1e5, -1e5, 0.0], 1.0, cycles))
    return sb.Scene(brake, sb.Duty(sb.Constant(1e4), load), sb.Initial(0.5), float(cycles))


SCENES = {
    "explicit": lambda: sb.simulate(warming(), rtol=1e-8),
    "stiff": lambda: sb.simulate(warming(), solver=sb.hybrid.Rodas5P(), rtol=1e-9),
    "jumps": lambda: sb.simulate(swinging_load()),
}


@pytest.fixture(scope="module", params=SCENES)
def result(request):
    """A run, looked at on interpolants between the ends of its steps: also where it is short, or a step little work."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_scan, "_SHORT", 0)
        patch.setattr(_scan, "small", lambda record: False)
        found = SCENES[request.param]()
        assert found.metrics
        yield found


def dense(result, points=40):
    """Times all over the steps of a run, also just before and just after all events."""
    record = result.record.compact()
    assert len(record.rows.t) == max(64, 1 << int(record.count).bit_length())  # the least power of two that holds it
    rows = record.rows.t[: int(record.count) + 1]
    share = np.linspace(0.0, 1.0, points, endpoint=False)
    return np.unique((rows[:-1, None] + share * np.diff(rows)[:, None]).ravel())


@pytest.mark.slow
def test_peaks_are_those_of_partial_steps(result):
    times = dense(result)
    looks = result.series(times), result.series(times, left=True)
    for name, columns in COLUMNS.items():
        if name not in result.report().peaks:
            continue
        found = result.report().peaks[name]
        seen = np.concatenate([np.ravel(getattr(look, column)) for look in looks for column in columns])
        assert found.value >= seen.max() * (1 - 1e-12), name
        assert found.value == pytest.approx(seen.max(), rel=1e-4), name
        at = [result.series([found.time], left=left) for left in (False, True)]
        there = np.asarray([np.max(getattr(look, column)) for look in at for column in columns])
        # as exact as the run: the time of an interior maximum hardly matters
        assert np.min(np.abs(there / found.value - 1)) < 0.1 * float(result.rtol), name


@pytest.mark.slow
def test_marks_are_those_of_partial_steps(result):
    """The permissible temperature, or the limits of linings (`T_n = T_0 μ^i`, and from the anchor)."""
    if result.scene.heated:
        (mark,) = [event.time for event in result.events if event.name == "permissible_temperature"]
        assert np.max(result.series([mark]).lining_temperature) == pytest.approx(HOT, rel=1e-11)
        assert result.metrics["peak_lining_temperature"] > HOT + 5.0
        return
    limits = [event for event in result.events if event.name == "lining_limit"]
    z = 1.1 * 0.4 * np.tan(0.2)
    mu, i = (1 + z) / (1 - z), np.asarray([event.lining for event in limits])
    assert len(limits) > 20
    tension = np.asarray(result.series([event.time for event in limits], left=True).tight_tension) / 1e4
    np.testing.assert_allclose(tension, np.where(tension > 1, mu**i, mu ** (i - 7.0)), rtol=1e-9)


@pytest.mark.slow
def test_partial_steps_of_a_stiff_run(monkeypatch):
    """Samples and smooth maxima take none: steps are as costly as those of the run."""
    taken, original = [], _scan.rows_in_lanes
    monkeypatch.setattr(_scan, "small", lambda record: False)
    monkeypatch.setattr(_scan, "rows_in_lanes", lambda r, f, row, h: taken.append(len(row)) or original(r, f, row, h))
    result = SCENES["stiff"]()
    assert result.summary()["events"]
    assert sum(taken) < 0.5 * int(result.record.count)


def test_interpolant_exact_for_polynomials():
    rng = np.random.default_rng(4)
    nodes = np.sort(rng.uniform(-3.0, 4.0, (5, 6)), axis=1)
    there = np.ones((5, 6), bool)
    there[1:, 0] = there[2:, 5] = there[3:, 2] = False
    x = rng.uniform(0.0, 1.0, 5)
    for m in range(5):
        p = np.polynomial.Polynomial(rng.normal(size=2 * int(there[m].sum())) / 4.0 ** np.arange(2 * there[m].sum()))
        of_values, of_slopes = _scan._weights(nodes, there, x)
        found = np.sum(of_values[m] * p(nodes[m]) + of_slopes[m] * p.deriv()(nodes[m]))
        assert found == pytest.approx(p(x[m]), rel=1e-9)
        assert not of_values[m][~there[m]].any()


def test_zeros_of_samples_are_refined():
    a = np.linspace(0.02, 0.98, 200)
    functions = [
        lambda some, x: np.tanh(3 * (x - a[some])) + 0.1 * (x - a[some]) ** 2,
        lambda some, x: (x - a[some]) ** 3,
    ]
    nodes = np.linspace(0.0, 1.0, 9)
    place = np.minimum((a * 8).astype(int), 7)
    for smooth, function in zip((True, False), functions, strict=True):
        seen = np.stack([function(np.arange(200), np.full(200, node)) for node in nodes], axis=1)
        start, slope = _report._zero_of_samples(seen, place)
        assert np.all((start >= place / 8) & (start <= (place + 1) / 8))
        found, doubtful = _report._refined(function, start, slope)
        if smooth:
            assert doubtful.size == 0
            np.testing.assert_allclose(found, a, rtol=0, atol=1e-14)
        else:  # where secants do not help the caller is told
            assert set(np.flatnonzero(np.abs(found - a) > 1e-4)) <= set(doubtful)


def test_rests_end_with_restarts():
    slides, held = SimpleNamespace(rests=False, band=BandMode.SLIP), SimpleNamespace(rests=True, band=BandMode.HELD)
    falls = SimpleNamespace(rests=False, band=BandMode.OPEN)
    # rows:   0      1      2     3      4       5     6     7     8
    course = [falls, slides, held, held, slides, held, held, falls, slides]
    assert rows_of(course) == [Stop(0, 1, 2, 4), Stop(4, 4, 5, 7)]
    assert rows_of([held, slides, held]) == [Stop(1, 1, 2, 2)]  # begins at rest
    assert rows_of([slides, falls]) == []


def test_overlaps_of_a_station_are_its_angle():
    angle, psi = np.radians([20.0, 70.0, 45.0]), np.linspace(-9.0, 9.0, 37)
    for count in (1, 2, 5, 26):
        np.testing.assert_allclose(overlaps(angle, count, psi).sum(axis=2), np.tile(angle, (37, 1)), rtol=1e-12)
        assert np.max(overlaps(angle, count, psi)) <= 2 * math.pi / count * (1 + 1e-12)


@pytest.mark.parametrize(
    "name",
    ["u2_5_5_stop", pytest.param("staged_vs_standard", marks=pytest.mark.slow), "slip_onset_chain", "resolved_bandage"],
)
def test_scene_names_are_those_of_its_run(name):
    scene = load(name).scene()
    seen = {}

    def run(scene):
        result = sb.simulate(scene)
        for one in set(METRICS) & set(metric_names(scene)):
            seen[one] = measure(result, one)
        for one in set(METRICS) - set(metric_names(scene)) - {"hook_travel"}:
            with pytest.raises(ValueError, match=f"the scene has no {one}: "):
                measure(result, one)
        seen.update({f"energy.{key}": None for key in result.energy if not key.endswith("closure")})
        return measure(result, "energy.load_work"), measure(result, "stopping_time")

    shapes = jax.eval_shape(run, scene)
    assert set(metric_names(scene)) == set(seen)
    assert all(shape.shape == () and shape.dtype == "float64" for shape in shapes)
    assert all(unit_of(one) for one in metric_names(scene))


def test_missing_metrics_in_one_report():
    scene = load("u2_5_5_stop").scene()
    with pytest.raises(sb.InputError) as error:
        check_metrics(scene, ["stoping_time", "peak_rim_temperature", 3.0, "stopping_time"])
    text = str(error.value)
    assert "3 input errors" in text
    assert "nearest: stopping_time" in text


def test_functions_of_a_result_are_metrics():
    def work_ratio(result):
        return result.energy["load_work"] / result.energy["friction_heat"]

    result = sb.simulate(load("u2_5_5_stop").scene())
    assert name_of(work_ratio) == "work_ratio"
    assert unit_of(work_ratio) == ""
    expected = float(result.energy["load_work"]) / float(result.energy["friction_heat"])
    assert float(measure(result, work_ratio)) == expected
    assert happened(measure(result, "stopping_time"))
