"""The event log of long runs: events where their conditions are met, and work that grows with their number alone."""

import jax
import numpy as np
import pytest

import simbrake as sb
from simbrake._run import _report, _scan

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
