"""What can go wrong between two steps: order, coincidence, zeros at the start, dips,
corners, chains, limits."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import (
    DOPRI8,
    TSIT5,
    all_near,
    event_guards,
    event_times,
    near,
    settings,
    solve,
)
from small_systems import BouncingBall, Oscillator, Smooth, arrays, first_event_times

import simbrake as sb


class Timed(Smooth):
    """`ẏ = 1` from 0 and guards given over time; every firing moves that guard's count
    in the mode by one.

    `corner`, if finite, is a known time at which the slope changes to 2.
    """

    curves: Any
    corner: Any

    def rhs(self, t, y, mode):
        return jnp.where(mode[1] > 0, 2.0, 1.0) * jnp.ones_like(y)

    def guards(self, t, y, mode):
        return jnp.where(mode[0] > 0, 1.0, value_of(self.curves, t))

    def transition(self, t, y, mode, fired, at_stop):
        return (
            mode[0] + fired.astype(jnp.int32),
            mode[1] + at_stop.astype(jnp.int32),
        ), 0

    def next_stop(self, mode):
        return jnp.where(mode[1] > 0, jnp.inf, self.corner)

    def scales(self):
        return 1.0


class Curve(NamedTuple):
    """`offset + slope Π (root − t)` over the finite roots, and a dip of that depth
    about `centre`.

    All guards are of this one form, so that their tests share one program.
    """

    offset: float = 0.0
    slope: float = 0.0
    roots: tuple = ()
    dip: float = 0.0
    centre: float = 0.5


WIDTH = 1 / 16


def value_of(curve, t):
    product = jnp.prod(
        jnp.where(jnp.isfinite(curve.roots), curve.roots - t, 1.0), axis=-1
    )
    # below 0 for a time WIDTH where the offset is 1 and the dip 1 + depth
    bump = jnp.exp(
        -(((t - curve.centre) / WIDTH) ** 2) * jnp.log(jnp.maximum(curve.dip, 1.0)) * 4
    )
    return curve.offset + curve.slope * product - curve.dip * bump


def run(curves, corner=np.inf, guard_samples=15):
    """At most three guards; those that are missing never fire."""
    curves = [*curves, *[Curve(1.0)] * (3 - len(curves))]
    curves = [
        one._replace(roots=[*one.roots, *[np.inf] * (3 - len(one.roots))])
        for one in curves
    ]
    system = Timed(
        Curve(*map(jnp.asarray, zip(*curves, strict=True))), jnp.asarray(corner)
    )
    return solved(system, 3, guard_samples)


def solved(system, count, guard_samples):
    """From 0 to 1, with so many guards."""
    start = jnp.zeros(count, jnp.int32), jnp.asarray(0)
    how = settings(1e-10, guard_samples=guard_samples)
    return solve(system, jnp.asarray(0.0), start, 0.0, 1.0, how, TSIT5)


def down(at, slope=1.0):
    return Curve(slope=slope, roots=(at,))


FIRST = down(0.3)
SECOND = down(0.7, slope=50.0)


@pytest.mark.parametrize("order", [(FIRST, SECOND), (SECOND, FIRST)])
def test_two_guards_in_a_step_earliest_first(order):
    r = run(order)
    all_near(event_times(r), [0.3, 0.7], 1e-12)
    assert event_guards(r) == [order.index(FIRST), order.index(SECOND)]
    t = np.asarray(r.rows.t)
    h = np.asarray(r.rows.h)
    assert np.any((t < 0.3) & (t + h > 0.7))  # both did lie in one attempt


def test_simultaneous_guards_fire_together():
    r = run([FIRST, down(0.3, slope=2.0), SECOND])
    all_near(event_times(r), [0.3, 0.7], 1e-12)
    assert [int(m) for m in r.mode_end[0]] == [1, 1, 1]


@pytest.mark.parametrize("gap", [1e-12, 1e-9])
def test_two_events_close_together(gap):
    r = run([FIRST, down(0.3 + gap)])
    assert [int(m) for m in r.mode_end[0]] == [1, 1, 0]
    times = event_times(r)
    assert len(times) in (1, 2)
    all_near(times, 0.3, atol=2 * gap)


@pytest.mark.parametrize(
    ("guard", "truth"),
    [
        (Curve(slope=-1.0, roots=(0.0,)), []),  # 0 at the start, rising
        (Curve(slope=1.0, roots=(0.0,)), [0.0]),  # 0 at the start, falling
        # 0 at the start, rises and returns
        (Curve(slope=-1.0, roots=(0.0, 0.5)), [0.5]),
        (Curve(slope=1.0, roots=(0.0, 0.0, 0.5)), [0.5]),  # the same with zero slope
        (Curve(0.0), []),  # 0 for ever
        (Curve(1e-16), []),
        (Curve(-1e-16), []),
        (Curve(-1.0), [0.0]),  # negative from the start
    ],
)
def test_guard_that_is_zero_at_the_start(guard, truth):
    r = run([guard])
    assert int(r.code) == 0
    all_near(event_times(r), truth, 1e-10, 1e-12)


class ZeroAtRestart(Timed):
    """The first event, at 0.3, puts a guard in force that is exactly 0 there, rises and
    returns to 0 at 0.8."""

    def guards(self, t, y, mode):
        first = jnp.where(mode[0][0] == 0, 0.3 - t, 1.0)
        second = jnp.where(
            (mode[0][0] > 0) & (mode[0][1] == 0), (t - 0.3) * (0.8 - t), 1.0
        )
        return jnp.stack([first, second])


def test_guard_that_is_zero_at_a_restart():
    system = ZeroAtRestart(curves=(), corner=jnp.asarray(jnp.inf))
    start = (jnp.zeros(2, jnp.int32), jnp.asarray(0))
    r = solve(system, jnp.asarray(0.0), start, 0.0, 1.0, settings(), TSIT5)
    all_near(event_times(r), [0.3, 0.8], 1e-10)


class ZeroThenDown(Timed):
    """A guard that is 0 but for a rate of rounding up to 0.4, as a force that is none
    so far, and falls from there."""

    def guards(self, t, y, mode):
        return jnp.where(mode[0] > 0, 1.0, jnp.where(t < 0.4, self.curves * t, 0.4 - t))


@pytest.mark.parametrize("rate", [0.0, 1e-17, -1e-17])
def test_guard_that_falls_from_zero_inside_a_step(rate):
    start = (jnp.zeros(1, jnp.int32), jnp.asarray(0))
    system = ZeroThenDown(curves=jnp.asarray(rate), corner=jnp.asarray(jnp.inf))
    r = solve(system, jnp.asarray(0.0), start, 0.0, 1.0, settings(), TSIT5)
    assert int(r.code) == 0
    all_near(event_times(r), [0.4], 1e-10)


@pytest.mark.parametrize(
    ("centre", "depth"),
    [(0.09, 1.0), (0.283, 0.05), (0.5, 0.05), (0.71, 1.0), (0.93, 0.05)],
)
def test_excursion_inside_one_step_is_found(centre, depth):
    """`ẏ = 1` takes steps as long as the run; below zero for 1/16 of it. Times against
    the closed form."""
    r = run([Curve(1.0, dip=1.0 + depth, centre=centre)])
    all_near(event_times(r)[:1], [centre - WIDTH / 2], 1e-9)


@pytest.mark.parametrize("depth", [1e-2, 1e-6])
def test_dip_within_a_step_found_by_slopes(depth):
    """A guard that is positive, with its minimum in the step, at both of its ends;
    nothing is sampled inside."""
    r = run([Curve(-depth, 1.0, (0.4, 0.4))], guard_samples=0)
    all_near(event_times(r)[:1], [0.4 - np.sqrt(depth)], 1e-9)


@pytest.mark.parametrize("samples", [0, 15])
@pytest.mark.parametrize("offset", [0.0, 1e-6])
def test_touch_without_crossing_is_no_event(offset, samples):
    assert (
        len(event_times(run([Curve(offset, 1.0, (0.5, 0.5))], guard_samples=samples)))
        == 0
    )


@pytest.mark.parametrize("shift", [0.0, 1e-15, -1e-13])
def test_corner_that_coincides_with_an_event(shift):
    r = run([down(0.5 + shift)], corner=0.5)
    all_near(event_times(r), [0.5], 1e-12)
    assert [int(m) for m in r.mode_end[0]] == [1, 0, 0]
    assert int(r.mode_end[1]) == 1  # the corner was passed as well
    near(r.y_end, 0.5 + 2 * 0.5, abs=1e-12)


@pytest.mark.parametrize("gap", [1e-10, 1e-8, 1e-6])
def test_event_behind_a_corner_is_after_it(gap):
    r = run([down(0.5 + gap)], corner=0.5)
    all_near(event_times(r), [0.5 + gap], 1e-14)


class Limit(Timed):
    """A limit that comes near 0 at the corner, with slope −1, and goes on from there
    with another one."""

    def rhs(self, t, y, mode):
        return self.corner * jnp.ones_like(y)

    def guards(self, t, y, mode):
        offset, slope = self.curves
        after = offset + slope * (t - self.corner)
        return jnp.where(
            mode[0] > 0, 1.0, jnp.where(mode[1] > 0, after, offset + self.corner - t)
        )[None]

    def limits(self, mode, guards):
        return jnp.ones_like(guards, bool)


def limited(offset, slope, guard_samples=15):
    system = Limit((jnp.asarray(offset), jnp.asarray(slope)), jnp.asarray(0.5))
    return solved(system, 1, guard_samples)


@pytest.mark.parametrize("samples", [0, 15])
@pytest.mark.parametrize(
    ("offset", "slope", "truth"),
    [
        (0.0, 1.0, []),  # touched
        (0.0, 0.0, []),
        (1e-9, 1.0, []),
        (-1e-16, 1.0, []),
        (0.0, -2.0, [0.5]),  # exceeded from the corner on
        (1e-9, -2.0, [0.5 + 5e-10]),
        (-1e-9, 1.0, [0.5 - 1e-9]),
    ],
)
def test_limit_that_is_touched_at_a_corner_is_not_exceeded(
    offset, slope, truth, samples
):
    record = limited(offset, slope, samples)
    all_near(event_times(record), truth, 1e-13)
    assert int(record.mode_end[1]) == 1


def test_event_of_a_limit_at_a_corner_has_the_derivative_of_the_limit():
    """`0 = offset − slope (t − 1/2)` behind the corner, and not the corner's own
    time."""
    slope = jax.grad(lambda offset: first_event_times(limited(offset, -2.0), 1)[0])
    near(jax.jit(slope)(0.0), 0.5, 1e-12)


class Chain(Smooth):
    """At t = 0.5 five modes pass at one instant; with `loop` they go round for ever."""

    loop: Any = False

    def rhs(self, t, y, mode):
        return jnp.ones_like(y)

    def guards(self, t, y, mode):
        done = (mode >= 5) & ~jnp.asarray(self.loop)
        return jnp.where(mode == 0, 0.5 - t, jnp.where(done, 1.0, -1.0))[None]

    def transition(self, t, y, mode, fired, at_stop):
        return jnp.where(self.loop, 1 + mode % 5, mode + 1), 0

    def scales(self):
        return 1.0


class Walls(Chain):
    """A point that runs through two walls and a gate, each with its own count in the
    mode."""

    def guards(self, t, y, mode):
        walls = jnp.where(mode["walls"] > 0, 1.0, jnp.asarray([0.75, 0.25]) - y)
        return {"walls": walls, "gate": jnp.where(mode["gate"] > 0, 1.0, 0.5 - y)}

    def transition(self, t, y, mode, fired, at_stop):
        return {name: jnp.where(fired[name], 1, mode[name]) for name in mode}, 0


def test_guards_have_names():
    mode = {"gate": jnp.asarray(0), "walls": jnp.zeros(2, int)}
    r = solve(Walls(), jnp.asarray(0.0), mode, 0.0, 1.0, settings())
    assert [(event.name, round(event.time, 9)) for event in r.events] == [
        ("walls 2", 0.25),
        ("gate", 0.5),
        ("walls 1", 0.75),
    ]
    assert int(r.mode_end["gate"]) == 1
    assert r.mode_end["walls"].tolist() == [1, 1]
    assert r.last_guards(2) == ["gate", "walls 1"]


def test_mode_changes_chain_at_one_instant():
    r = solve(
        Chain(jnp.asarray(False)),
        jnp.asarray(0.0),
        jnp.asarray(0),
        0.0,
        1.0,
        settings(),
    )
    all_near(event_times(r), [0.5] * 5, 1e-12)
    assert int(r.mode_end) == 5


def test_chatter_ends_in_a_named_code():
    r = solve(
        Chain(jnp.asarray(True)), jnp.asarray(0.0), jnp.asarray(0), 0.0, 1.0, settings()
    )
    assert int(r.code) == sb.hybrid.Code.CHATTER
    near(r.t_end, 0.5, abs=1e-12)


def test_zeno_ends_in_a_named_code():
    ball = arrays(BouncingBall(v_min=0.0))
    r = solve(ball, Oscillator(1.0, 0.0), jnp.asarray(0), 0.0, 3.0, settings())
    assert int(r.code) == sb.hybrid.Code.ZENO
    fall = np.sqrt(2 / 9.81)
    near(r.t_end, fall * (1 + 2 * 0.7 / 0.3), abs=1e-4)


def test_limits_end_in_named_codes():
    ball = arrays(BouncingBall())
    few = solve(
        ball, Oscillator(1.0, 0.0), jnp.asarray(0), 0.0, 3.0, settings(max_events=4)
    )
    assert int(few.code) == sb.hybrid.Code.EVENT_LIMIT
    short = solve(
        ball, Oscillator(1.0, 0.0), jnp.asarray(0), 0.0, 3.0, settings(max_steps=32)
    )
    assert int(short.code) == sb.hybrid.Code.STEP_LIMIT
    nan = solve(
        arrays(BouncingBall(g=np.nan)),
        Oscillator(1.0, 0.0),
        jnp.asarray(0),
        0.0,
        3.0,
        settings(),
    )
    assert int(nan.code) == sb.hybrid.Code.NOT_FINITE


class Explosion(Chain):
    """`ẏ = exp(y)`: infinite at `t = exp(−y_0)`."""

    def rhs(self, t, y, mode):
        return jnp.exp(y)

    def guards(self, t, y, mode):
        return jnp.ones(1)


def test_overflow_ends_in_a_named_code():
    r = solve(Explosion(), jnp.asarray(0.0), jnp.asarray(0), 0.0, 2.0, settings(1e-8))
    assert int(r.code) in (
        sb.hybrid.Code.STEP_TOO_SMALL,
        sb.hybrid.Code.NOT_FINITE,
        sb.hybrid.Code.STEP_LIMIT,
    )
    near(r.t_end, 1.0, abs=1e-3)
    fine = solve(
        Explosion(), jnp.asarray(0.0), jnp.asarray(0), 0.0, 0.9, settings(1e-10)
    )
    near(fine.y_end, -np.log(0.1), 1e-8)


def test_many_events():
    """10,000 firings of one guard, each at its time."""

    class Clock(Chain):
        def guards(self, t, y, mode):
            return ((mode + 1).astype(float) * 1e-3 - t)[None] * 100

        def transition(self, t, y, mode, fired, at_stop):
            return mode + 1, 0

    r = solve(
        Clock(),
        jnp.asarray(0.0),
        jnp.asarray(0),
        0.0,
        10.0005,
        settings(1e-8, max_steps=65536),
    )
    times = event_times(r)
    assert len(times) == 10_000
    all_near(times, 1e-3 * np.arange(1, 10_001), 1e-10)
    assert int(r.stats.accepted + r.stats.rejected + r.stats.retaken) < 4 * 10_000


def test_batch_equals_single_runs():
    ball = arrays(BouncingBall())
    bounces = [0.7, 0.6, 0.5, 0.3]
    start = Oscillator(1.0, 0.0), jnp.asarray(0), 0.0, 3.0

    def numbers(record):
        return record.y_end.x, record.stats.events, record.t_end, jnp.max(record.rows.t)

    def run(e):
        return numbers(
            sb.hybrid.hybridsolve(
                BouncingBall(ball.g, e, ball.v_min), *start, DOPRI8, settings()
            )
        )

    many = jax.jit(jax.vmap(run))(jnp.asarray(bounces))
    for i, e in enumerate(bounces):
        one = numbers(solve(arrays(BouncingBall(e=e)), *start, settings()))
        assert int(one[1]) == int(many[1][i])
        all_near(one[0], many[0][i], 0, 1e-14)
