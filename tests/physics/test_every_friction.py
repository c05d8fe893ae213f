"""Every friction law, factor, memory and change over time on every kind of brake and
pair: all act as a change of μ.

All combinations are checked, and refused where they cannot be. Those of `RUNS` run:
every row and every kind of brake at least twice, each mechanism with memory and changes
in all of its pairs, and kinds of one mechanism in turn.
"""

import contextlib
import dataclasses
import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, input_error, near

import simbrake as sb
from simbrake.friction import (
    ChangingFriction,
    FrictionChange,
    FrictionWithMemory,
    LinearFade,
    MemoryProcess,
    ProductFriction,
    StribeckFriction,
)

R = 0.59
R_B = 0.64
J = 900.0
AREA = 0.03
HOT = 393.15
# of the second band, where there is one
ANGLES = np.radians([70.0, 50.0, 60.0]), np.radians([45.0, 80.0])
#: coefficients of linings on the rim or on the band, and of a bandage on the rim; a
#: factor of them
F = 0.4
F_INNER = 0.22
LESS = 0.6


def plain(n, f=F):
    return StribeckFriction(np.full(n, 1.15 * f), np.full(n, f), 3.0)


class Fall(sb.profiles.AbstractProfile):
    """`end + (start − end) e^{−t/τ}`."""

    start: object = sb.quantity("SI", "value at 0", default=1.0)
    end: object = sb.quantity("SI", "last value", default=1.0)
    time: object = sb.quantity("s", "time constant", positive=True, default=0.5)

    def value(self, t, piece):
        return self.end + (self.start - self.end) * jnp.exp(-t / self.time)

    def scale(self):
        return jnp.maximum(self.start, self.end)


def wrapped(n, f=F):
    """Memory and changes over time around a law of the speed, each without effect."""
    law = FrictionWithMemory(
        plain(n, f), (MemoryProcess(np.ones(n), rate=2.0),), np.ones(n)
    )
    jump = sb.PiecewiseLinear([0.0, 0.0], [1.0, 1.0])
    return ChangingFriction(law, (FrictionChange(Fall()), FrictionChange(jump, [1, 1])))


def band_brake(make, stiffness=None, segments=None, spring=None, staged=False):
    n = 3
    bandage = None
    if staged or spring:
        bandage = sb.Bandage(
            np.full(n, 15.0) if spring else 45.0, make(n, F_INNER), 900.0, AREA, spring
        )
    linings = sb.Lining(make(n), ANGLES[0], AREA, 40.0 if segments else None)
    return sb.Brake(
        sb.Pulley(R, J), sb.Band(R_B, stiffness, segments), linings, bandage
    )


def bands(make, **of_each):
    count = len(next(iter(of_each.values())))
    each = [{name: values[j] for name, values in of_each.items()} for j in range(count)]
    linings = [sb.Lining(make(angle.size), angle, AREA) for angle in ANGLES[:count]]
    lined = tuple(
        sb.brakes.LinedBand(own, **given)
        for own, given in zip(linings, each, strict=True)
    )
    return sb.brakes.MultiBandBrake(sb.Pulley(R, J), R_B, lined)


PLATES = sb.brakes.LiningsOnPlates(
    "210 GPa", "13 cm^2", slack_end=0.3, tight_end=0.5, linkage=3e5
)
KINDS = {
    "rigid band": band_brake,
    "elastic band": functools.partial(band_brake, stiffness=2e5),
    "band by its geometry": functools.partial(band_brake, stiffness=PLATES),
    "parallel bands": functools.partial(
        band_brake, stiffness=sb.brakes.ParallelBands((PLATES, 1e5))
    ),
    "staged, rigid band": functools.partial(band_brake, staged=True),
    "staged, elastic band": functools.partial(band_brake, staged=True, stiffness=2e5),
    "chain": functools.partial(
        band_brake, stiffness=2e5, segments=sb.Segments(4e5, 0.3, 2e3)
    ),
    "bandage on springs": functools.partial(band_brake, spring=2e5),
    "several bands by shares": functools.partial(bands, share=(1.0, 2.0)),
    "several bands by stiffness": functools.partial(bands, stiffness=(2e5, 1e5)),
    "several bands, one": functools.partial(bands, share=(1.0,)),
    "disc brake": lambda make: sb.DiscBrake(J, sb.Pads(make(3), 0.5, 0.6, 1.0, 3)),
    "double-shoe brake": lambda make: sb.ShoeBrake(
        J, sb.Shoes(make(2), R, 0.1, 0.2, 2.0), 0.5, 0.8
    ),
}


#: what is tried, and the kinds of brake on which it runs
RUNS = {
    "memory and changes": (
        "rigid band",
        "elastic band",
        "staged, rigid band",
        "chain",
        "bandage on springs",
        "several bands by stiffness",
        "disc brake",
        "double-shoe brake",
    ),
    "temperature": (
        "band by its geometry",
        "staged, elastic band",
        "bandage on springs",
        "several bands by shares",
    ),
    "pressure": ("parallel bands", "staged, rigid band", "several bands, one"),
    "torques": (
        "band by its geometry",
        "staged, elastic band",
        "chain",
        "double-shoe brake",
    ),
    "speed hold": ("rigid band", "several bands, one", "disc brake"),
    "running in": (
        "elastic band",
        "staged, rigid band",
        "several bands by shares",
        "double-shoe brake",
    ),
    "flash": ("rigid band", "parallel bands", "several bands by stiffness"),
    "custom law": ("rigid band", "several bands by stiffness"),
    "oil later": ("several bands by shares", "disc brake"),
}
#: quick to compile
DAILY = {"memory and changes": ("rigid band",)}


def runs_of(row):
    """The kinds of brake on which a row runs; those that take long to compile are slow
    tests."""
    fast = DAILY.get(row, ())
    kinds = [
        pytest.param(kind, marks=[] if kind in fast else [pytest.mark.slow])
        for kind in RUNS[row]
    ]
    return pytest.mark.parametrize("kind", kinds)


class OnFace(NamedTuple):
    """A friction law of a brake: its path, its coefficient, its pair, and its linings
    among those of the pair."""

    path: str
    law: sb.friction.AbstractFriction
    f: float
    pair: int
    here: slice

    @property
    def n(self):
        return self.here.stop - self.here.start


def laws_of(brake):
    if isinstance(brake, sb.brakes.MultiBandBrake):
        last = np.cumsum([band.linings.count for band in brake.bands]).tolist()
        each = enumerate(zip(brake.bands, [0, *last], last, strict=False))
        return [
            OnFace(
                f"brake.bands[{j}].linings.friction",
                own.linings.friction,
                F,
                0,
                slice(first, end),
            )
            for j, (own, first, end) in each
        ]
    given = {"linings": F, "bandage": F_INNER}
    n = brake.linings.count
    names = [place.field for place in brake.pairs.values()]
    laws = [getattr(brake, name).friction for name in names]
    return [
        OnFace(f"brake.{name}.friction", laws[i], given[name], i, slice(0, n))
        for i, name in enumerate(names)
    ]


def scene(kind, make, **parts):
    """A stop under a rising lever, then a load that tears the brake loose."""
    brake = KINDS[kind](make)
    lever = sb.PiecewiseLinear(
        [0.0, 1.0], np.array([2e3, 6e3]) * (1 + brake.in_series if brake.banded else 5)
    )
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 8.0, 12.0], [300.0, 300.0, 4e4]))
    duty = sb.Duty(lever, load) if brake.banded else sb.ForceDuty(lever, load)
    start = sb.Initial(20.0, 2e3 / 2e5 if kind == "chain" else 0.0)
    # (a chain that is torn loose swings)
    return sb.Scene(brake, duty, start, 7.0 if kind == "chain" else 12.0, **parts)


def still_heat(brake):
    """Bodies so large that their temperature stays."""
    n = brake.linings.count
    half = sb.thermal.ConstantPartition(0.5)
    staged = brake.in_series
    bodies = [
        sb.thermal.Lump("rim", 1e15, HOT),
        sb.thermal.Lump("linings", 1e15, HOT, n),
    ]
    return sb.Heat(
        (*bodies, *([sb.thermal.Lump("band", 1e15, HOT)] if staged else [])),
        friction=sb.thermal.FrictionHeat("rim", "linings", half),
        external=sb.thermal.FrictionHeat("band", "linings", half) if staged else None,
    )


def warm(kind, make):
    start = scene(kind, make)
    return dataclasses.replace(start, heat=still_heat(start.brake))


def course(result):
    """Numbers of a run that friction moves: stopping time, work, speed and angle after
    the load has torn it loose."""
    end = result.record.y_end
    found = np.array(
        [
            result.stopping_time,
            result.energy["friction_heat"] / 1e5,
            end.omega,
            end.phi,
        ],
        float,
    )
    assert np.all(np.isfinite(found))
    return found


@runs_of("memory and changes")
def test_memory_and_changes_act_on_friction(kind):
    """From the start on, of all linings of a pair, of the first and of the last one;
    and while friction falls."""
    start = scene(kind, wrapped)

    def run(values):
        return course(
            sb.simulate(sb.with_values(start, values), rtol=1e-11, max_steps=1024)
        )

    dry = run({})
    for one in laws_of(start.brake):
        path = one.path
        n = one.n
        f = one.f
        memory = f"{path}.base"
        curve = f"{path}.base.base"
        for number, chosen in (
            (None, slice(None)),
            (1.0, slice(0, 1)),
            (float(n), slice(n - 1, n)),
        ):
            less = np.ones(n)
            less[chosen] = LESS
            truth = run(
                {
                    f"{curve}.static_coefficient": 1.15 * f * less,
                    f"{curve}.kinetic_coefficient": f * less,
                }
            )
            assert np.max(np.abs(truth - dry)) > 1e-2
            ways = [{f"{memory}.initial": less, f"{memory}.processes[0].end": less}]
            over = f"{path}.changes[{0 if number is None else 1}]"
            if number is None:
                ways.append({f"{over}.factor.start": LESS, f"{over}.factor.end": LESS})
            else:
                ways.append(
                    {
                        f"{over}.linings": [number, number],
                        f"{over}.factor.values": [1.0, LESS],
                    }
                )
            for way in ways:
                all_near(run(way), truth, 1e-9, err_msg=str(way))
        falling = run({f"{memory}.processes[0].end": np.full(n, LESS)})
        assert np.max(np.abs(falling - dry)) > 1e-3
        all_near(run({f"{path}.changes[0].factor.end": LESS}), falling, 1e-8)


class Even(sb.friction.AbstractFactor):
    """A factor that is asked for at every pressure, and is the same at all."""

    value: object = sb.quantity("1", "factor", low=0.0, default=1.0)

    def factor(self, contact):
        return self.value + 0.0 * contact.p


def graded(n, f=F, pressed=False):
    """Fade, a table over the temperature and a factor of the pressure, each without
    effect."""
    fade = (
        LinearFade(0.0, HOT - 100.0),
        sb.friction.TabulatedFade([HOT - 100.0, HOT, HOT + 100.0], [1.0, 1.0, 1.0]),
    )
    return ProductFriction(plain(n, f), (*fade, *([Even()] if pressed else [])))


@runs_of("temperature")
def test_factors_act_as_another_coefficient(kind):
    """On linings whose temperature stays."""
    start = warm(kind, graded)

    def run(values):
        return course(
            sb.simulate(sb.with_values(start, values), rtol=1e-11, max_steps=1024)
        )

    for one in laws_of(start.brake):
        curve = f"{one.path}.base"
        low = np.full(one.n, one.f * LESS)
        truth = run(
            {
                f"{curve}.static_coefficient": 1.15 * low,
                f"{curve}.kinetic_coefficient": low,
            }
        )
        for way in (
            {f"{one.path}.factors[0].slope": (1 - LESS) / 100.0},
            {f"{one.path}.factors[1].values": [1.0, LESS, 0.1]},
        ):
            all_near(run(way), truth, 1e-8, err_msg=str(way))


PRESSED = functools.partial(graded, pressed=True)


@runs_of("pressure")
def test_pressure_factor_acts(kind):
    start = warm(kind, PRESSED)
    for one in laws_of(start.brake):
        low = np.full(one.n, one.f * LESS)
        curve = f"{one.path}.base"
        truth, other = (
            course(
                sb.simulate(sb.with_values(start, values), rtol=1e-11, max_steps=1024)
            )
            for values in (
                {
                    f"{curve}.static_coefficient": 1.15 * low,
                    f"{curve}.kinetic_coefficient": low,
                },
                {f"{one.path}.factors[2].value": LESS},
            )
        )
        all_near(other, truth, 1e-9)


@runs_of("torques")
def test_torques_phases_and_shares_act(kind):
    """A drag on the shaft is one in the load, a phase its lever; heat is what the
    shares leave of the friction work."""
    start = scene(kind, plain)
    duty = start.duty
    field = start.duty.lever_field
    dragged = dataclasses.replace(
        start,
        duty=dataclasses.replace(duty, load=dataclasses.replace(duty.load, drag=25.0)),
    )
    phase = sb.loads.Phases((sb.loads.Phase(duty.lever, "7 s"),))
    shaft = (sb.shaft.ViscousDrag(25.0, place="rim"),)
    shares = sb.PowerShares(0.2, 0.1)
    parts = {"shaft": shaft, "power_shares": shares, "heat": still_heat(start.brake)}
    phased = dataclasses.replace(
        start, duty=dataclasses.replace(duty, **{field: phase}), end_time=7.5, **parts
    )
    free, one, other = (
        sb.simulate(each, rtol=1e-11, max_steps=1024)
        for each in (start, dragged, phased)
    )
    assert float(one.stopping_time) < 0.995 * float(free.stopping_time)
    near(other.stopping_time, one.stopping_time, 1e-9)
    energy = {name: float(value) for name, value in other.energy.items()}
    into = (
        energy["heat_to_metal"]
        + energy["heat_to_linings"]
        + energy.get("heat_to_band", 0.0)
    )
    near(into, 0.7 * float(one.series([7.0]).friction_work[0]), 1e-8)


def holding(kind):
    start = scene(kind, plain)
    duty = dataclasses.replace(
        start.duty,
        **{start.duty.lever_field: sb.SpeedHold(1e6)},
        load=sb.TorqueLoad(500.0),
    )
    return dataclasses.replace(start, duty=duty, end_time=2.0)


@runs_of("speed hold")
def test_lever_holds_the_speed(kind):
    near(sb.simulate(holding(kind), rtol=1e-11).record.y_end.omega, 20.0, 1e-9)


RUN_IN = 1.2
WEAR = 1e-14


def running_in(n, f=F):
    """Friction that runs in by the work of its own face:
    `ċ = (c_1 − c) f c p v/w_0`."""
    return FrictionWithMemory(
        f, (MemoryProcess(RUN_IN, work=2e6),), np.linspace(0.6, 0.8, n)
    )


def wearing(kind):
    inner = sb.wear.ConstantWear(WEAR) if KINDS[kind](running_in).in_series else None
    return scene(kind, running_in, wear=sb.Wear(WEAR, internal=inner))


@runs_of("running in")
def test_running_in_and_wear_share_pressure(kind):
    """`ċ = (c_1 − c) f c p v/w_0` and `ḣ = k p v` of one face: `ln[c/(c_1 − c)]` rises
    by `c_1 f h/(k w_0)`.

    Of wide linings, where `p v` at the face is 0.77 to 0.92 of the friction heat of the
    band over `f A`.
    """
    start = wearing(kind)
    end = sb.simulate(start, rtol=1e-11, max_steps=1024).record.y_end
    for one in laws_of(start.brake):
        c = np.asarray(jax.tree.leaves(end.memory[one.pair])[0])[one.here]
        c_0 = np.asarray(one.law.initial)
        h = np.asarray(end.worn[one.pair])[one.here]
        rise = np.log(c / (RUN_IN - c)) - np.log(c_0 / (RUN_IN - c_0))
        truth = RUN_IN * one.f * h / (WEAR * 2e6)
        assert np.max(truth) > 0.02, one.path
        all_near(rise, truth, 1e-7, 1e-12, err_msg=one.path)


def flashing(kind):
    start = warm(kind, lambda n, f=F: ProductFriction(f, (LinearFade(5e-3, HOT),)))
    flash = sb.thermal.FlashTemperature(1e-3, conductivity=1.0, diffusivity=1e-6)
    return dataclasses.replace(start, heat=dataclasses.replace(start.heat, flash=flash))


@runs_of("flash")
def test_flash_keeps_the_work(kind):
    """`f = f_0 (1 − s ΔT)`, `ΔT = (2 f p v/λ) √(a l/(π v))`, with load, speed and
    coefficient of the results."""
    start = flashing(kind)
    seen = sb.simulate(start, rtol=1e-10, max_steps=1024).series([0.5])
    f = seen.friction_coefficient[0]
    v = float(seen.omega[0]) * R_B
    rise = 2 * f * (seen.normal_load[0] / AREA) * v * np.sqrt(1e-6 * 1e-3 / (np.pi * v))
    all_near(f, F * (1 - 5e-3 * rise), 1e-8)
    assert np.min(rise) > 1.0


UNDER_A_BANDAGE = {"staged, rigid band", "staged, elastic band", "bandage on springs"}
#: what is tried, the kinds of brake that refuse it, and in which words
REFUSED = {
    "memory and changes": (lambda kind: scene(kind, wrapped), set(), ""),
    "temperature": (lambda kind: warm(kind, graded), set(), ""),
    "pressure": (
        lambda kind: warm(kind, PRESSED),
        {"bandage on springs", "double-shoe brake"},
        "cannot depend on the pressure",
    ),
    "speed hold": (
        holding,
        UNDER_A_BANDAGE
        | {"elastic band", "band by its geometry", "parallel bands", "chain"},
        r"hold.* the speed",
    ),
    "running in": (wearing, {"bandage on springs"}, "cannot depend on the pressure"),
    "flash": (
        flashing,
        UNDER_A_BANDAGE | {"chain", "disc brake", "double-shoe brake"},
        r"heat\.flash: is not",
    ),
}


@pytest.mark.parametrize("row", REFUSED)
def test_each_kind_takes_it_or_refuses(row):
    made, refuse, words = REFUSED[row]
    assert not refuse & set(RUNS[row])
    for kind in KINDS:
        with input_error(match=words) if kind in refuse else contextlib.nullcontext():
            sb.check_scene(made(kind))


class Half(sb.friction.AbstractFriction):
    """A custom law around another one, without a word about states, changes or
    tables."""

    base: sb.friction.AbstractFriction

    def kinetic(self, contact):
        return 0.5 * self.base.kinetic(contact)

    def static(self, contact):
        return 0.5 * self.base.static(contact)


@runs_of("custom law")
def test_custom_law_takes_memory_and_changes(kind):
    start = scene(kind, lambda n, f=F: Half(wrapped(n, 2 * f)))
    for one in laws_of(start.brake):
        less = np.full(one.n, LESS)
        memory = {
            f"{one.path}.base.base.initial": less,
            f"{one.path}.base.base.processes[0].end": less,
        }
        change = {
            f"{one.path}.base.changes[0].factor.{name}": LESS
            for name in ("start", "end")
        }
        curve = one.law.base.base.base
        names = ("static_coefficient", "kinetic_coefficient")
        low = {
            f"{one.path}.base.base.base.{name}": LESS * np.asarray(getattr(curve, name))
            for name in names
        }
        truth, *others = (
            course(sb.simulate(sb.with_values(start, x), rtol=1e-11))
            for x in (low, memory, change)
        )
        for other in others:
            all_near(other, truth, 1e-9)


def oiled(f=F, chosen=None):
    return ChangingFriction(
        f, (FrictionChange(sb.PiecewiseLinear([1.0, 1.0], [1.0, LESS]), chosen),)
    )


@runs_of("oil later")
def test_oil_that_comes_later(kind):
    """A stop whose friction falls at 0.5 s ends as one that begins there with the
    friction that is left."""
    brake = KINDS[kind](lambda n, f=F: oiled(f, [n]))
    duty = (sb.Duty if brake.banded else sb.ForceDuty)(
        2e4 if kind == "disc brake" else 4e3, 300.0
    )
    changed = [f"{one.path}.changes[0].factor.times" for one in laws_of(brake)]
    start = sb.Scene(brake, duty, sb.Initial(20.0), 9.0)
    never = {path: [99.0, 99.0] for path in changed}
    for path in changed:
        values = never | {path: [0.5, 0.5]}
        whole = sb.simulate(sb.with_values(start, values), rtol=1e-11)
        omega = float(whole.series([0.5]).omega[0])
        rest = sb.simulate(
            sb.with_values(
                start, values | {"initial.omega": omega, "initial.time": 0.5}
            ),
            rtol=1e-11,
        )
        dry = sb.simulate(sb.with_values(start, never), rtol=1e-11)
        near(whole.stopping_time, rest.stopping_time, 1e-10)
        assert float(whole.stopping_time) > 1.01 * float(dry.stopping_time)


class Own(Half):
    """A custom law with a contact of its own, which lacks the factor of changes."""

    def kinetic(self, contact):
        return 0.5 * self.base.kinetic(
            sb.friction.Contact(contact.v, contact.T, contact.p)
        )

    def static(self, contact):
        return self.kinetic(contact)


class Forgetful(Half):
    def start(self, n):
        return None


def without_changes(n, f=F):
    return Own(oiled())


def without_states(n, f=F):
    return Forgetful(running_in(n))


def off_its_table(n, f=F):
    table = sb.friction.TabulatedFade([HOT - 200.0, HOT - 10.0], [1.0, 0.9])
    return Half(ProductFriction(F, (table,)))
