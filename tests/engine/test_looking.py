"""Looking at a result: what is read off the cubic between the ends of steps equals what partial steps find."""

import dataclasses
import time

import diffrax
import numpy as np
import pytest
from heat_scenes import T0, fading, lump, rigid_stop
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._run import _report, _scan

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
def test_peaks_are_those_of_a_search_by_partial_steps(result):
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
def test_a_maximum_near_the_end_of_a_step_is_found_as_exactly_as_any_other():
    """`C θ' = P_0 (1 − t/t_s) − G θ` of a cooled rim: hottest at `ln(1 + G t_s/C)/(G/C)`, in many places of a step."""
    n, J, w_0, C = 20, 800.0, 20.0, 2e4
    torque = 0.725 * 8e3 * (closed_form(n=n)["Pi"] - 1)
    t_s, near = J * w_0 / torque, []
    for G in np.linspace(4e3, 4e4, 25):
        heat = sb.lumped_heat(rim=C, partition=1.0, rim_cooling=G)
        scene = dataclasses.replace(stop_scene(n=n, C=None, end=2.0), heat=heat)
        result = sb.simulate(scene, rtol=1e-12, solver=diffrax.Dopri8())
        peak, at = result.peak_rim_temperature, np.log(1 + G / C * t_s) / (G / C)
        rise = torque * w_0 / G * (1 - at / t_s)
        assert peak.time == pytest.approx(at, rel=1e-5)
        assert peak.value - 293.15 == pytest.approx(rise, rel=1e-9)
        steps = np.asarray(result.record.rows.t)[: int(result.record.count) + 1]
        near.append(np.min(np.abs(steps - at)) / t_s)
    assert min(near) < 5e-3  # the end of a step lies next to one of them


@pytest.mark.slow
def test_marks_are_where_partial_steps_pass_them(result):
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
def test_a_stiff_run_is_looked_at_with_few_partial_steps(monkeypatch):
    """Samples and smooth maxima take none: steps are as costly as those of the run."""
    taken, original = [], _scan.rows_in_lanes
    monkeypatch.setattr(_scan, "small", lambda record: False)
    monkeypatch.setattr(_scan, "rows_in_lanes", lambda r, f, row, h: taken.append(len(row)) or original(r, f, row, h))
    result = SCENES["stiff"]()
    assert result.summary()["events"]
    assert sum(taken) < 0.5 * int(result.record.count)


@pytest.mark.slow
def test_a_look_at_a_long_run_costs_less_than_the_run():
    scene = swinging_load(cycles=150)

    def seconds(function):
        begun = time.process_time()
        function()
        return time.process_time() - begun

    def run():
        return sb.simulate(scene, max_steps=1 << 15, solver=sb.hybrid.Rodas5P(), rtol=1e-8)

    run().summary()  # compiles
    # a run and a look right after each other, several times: what else the machine does slows both
    pairs = []
    for _ in range(5):
        took, result = seconds(run), run()
        pairs.append((seconds(result.summary), took))
    assert min(look - 2.0 * took for look, took in pairs) < 0.2


# --- the pieces -------------------------------------------------------------------------------------------------------


def test_the_interpolant_through_k_ends_is_exact_for_polynomials_up_to_2k_minus_1():
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


def test_streaks_count_what_goes_on_before_each_place():
    assert _scan._streaks(np.asarray([1, 1, 0, 1, 1, 1, 0], bool)).tolist() == [0, 1, 2, 0, 1, 2, 3, 0]


def test_zeros_of_samples_and_their_refinement():
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
