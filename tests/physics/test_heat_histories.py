"""Networks under histories of speed, power, air and coolant: closed forms, SciPy,
derivatives by every point, files, a fit, and what a long record costs."""

import dataclasses
import itertools
import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_near, faults_of, near
from scenes import scene_of
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares, minimize_scalar

import simbrake as sb

SIGMA = sb.thermal.STEFAN_BOLTZMANN
line = sb.PiecewiseLinear


def lump(C=4e3, T_0=350.0, *links):
    """A disc of the capacity `C` in the air."""
    return sb.Heat(
        (sb.thermal.Lump("disc", C, T_0), sb.thermal.Reservoir("air")), links
    )


@pytest.mark.slow
def test_air_that_rises_and_swings():
    """`Ṫ = (T_a − T)/τ`: on a line of slope `r` `T_a − r τ` and what decays; under a
    sine the amplitude `A/√(1 + ω²τ²)`, late by `atan ωτ`."""
    C, G, r = 4e3, 20.0, 0.25
    tau = C / G
    t = np.linspace(0.0, 900.0, 31)
    heat = lump(C, 350.0, sb.thermal.Conductance("disc", "air", G))
    ramp = line([0.0, 400.0], [290.0, 290.0 + 400 * r])

    def on_line(t, T_0, begin, slope):
        late = begin - slope * tau
        return late + slope * t + (T_0 - late) * np.exp(-t / tau)

    rising = on_line(t, 350.0, 290.0, r)
    after = on_line(t - 400, on_line(400.0, 350.0, 290.0, r), 390.0, 0.0)
    run = sb.simulate_heat(heat, t, air=ramp, rtol=1e-12)
    truth = np.where(t <= 400, rising, after)
    all_near(run.temperature[:, 0], truth, 1e-12)
    assert abs(run.closure) < 1e-13

    w, A = 0.02, 15.0
    swing = sb.profiles.FunctionProfile(lambda t, A: 300 + A * jnp.sin(w * t), A)
    lag = np.arctan(w * tau)
    steady = A * np.cos(lag)
    truth = 300 + steady * np.sin(w * t - lag)
    truth += (50 + steady * np.sin(lag)) * np.exp(-t / tau)
    run = sb.simulate_heat(heat, t, air=swing, rtol=1e-12)
    all_near(run.temperature[:, 0], truth, 1e-11)
    assert abs(run.closure) < 1e-13


# --- beside SciPy ---------------------------------------------------------------------

C_DISC, C_HUB, AREA = 4e3, 9e3, 0.12
T = np.linspace(0.0, 60.0, 41)
T_FEW = np.linspace(0.0, 60.0, 16)
WATER = sb.thermal.water("30 degC")
PARTS = (
    sb.thermal.Lump("disc", C_DISC, 420.0),
    sb.thermal.Lump("hub", C_HUB, 320.0),
    sb.thermal.Reservoir("air"),
    sb.thermal.Reservoir("water"),
)
LINKS = (
    sb.thermal.Convection("disc", AREA, sb.thermal.LinearCoefficient(10.0, 2.0)),
    sb.thermal.Convection("hub", AREA, sb.thermal.SpeedCoefficient(8.0, 4.0)),
    sb.thermal.Radiation("disc", AREA, 0.7),
    sb.thermal.Conductance("disc", "hub", 15.0),
    sb.thermal.WaterJacket("hub", 0.05, 2e-5, WATER, 900.0),
)
NETWORK = sb.Heat(PARTS, LINKS)
VALUES = {
    "speed": 30 + 25 * np.sin(T_FEW / 15),
    "power": np.maximum(0.0, 20e3 * np.cos(T / 5)),
    "air": 295 + 4 * np.sin(T / 20),
    "coolant": 300 + 8 * np.cos(T_FEW / 9),
}


def histories(values, t=T, t_few=T_FEW):
    """The courses of a run; the power is held from sample to sample."""
    return {
        "speed": line(t_few, values["speed"]),
        "power": {"disc": sb.profiles.held(t, values["power"])},
        "air": line(t, values["air"]),
        "coolant": line(t_few, values["coolant"]),
    }


def by_scipy(ts):
    """Temperatures, and heat lost, supplied and to the coolant at the end."""
    rate = WATER.density * WATER.specific_heat * 2e-5
    jacket = rate * -np.expm1(-900.0 * 0.05 / rate)
    knots = np.unique(np.concatenate([T, T_FEW, ts]))
    y = np.array([420.0, 320.0, 0.0, 0.0, 0.0])
    found = [y]
    for a, b in itertools.pairwise(knots):
        P = VALUES["power"][np.searchsorted(T, a, side="right") - 1]

        def rates(t, y, P=P):
            v, inlet = (np.interp(t, T_FEW, VALUES[x]) for x in ("speed", "coolant"))
            air = np.interp(t, T, VALUES["air"])
            disc, hub = y[:2]
            to_air = AREA * (10 + 2 * v) * (disc - air)
            to_air += 0.7 * SIGMA * AREA * (disc**4 - air**4)
            of_hub = AREA * 8 * (1 + (v / 4) ** 2) ** 0.4 * (hub - air)
            wet = jacket * (hub - inlet)
            q = 15.0 * (disc - hub)
            disc_rate = (P - to_air - q) / C_DISC
            return disc_rate, (q - of_hub - wet) / C_HUB, to_air + of_hub, P, wet

        y = solve_ivp(rates, (a, b), y, "DOP853", rtol=1e-12, atol=1e-10).y[:, -1]
        found.append(y)
    return np.array(found)[np.searchsorted(knots, ts)]


def test_several_links_beside_scipy():
    """Temperatures and heats; the balance closes with boundaries that change."""
    run = sb.simulate_heat(NETWORK, T, **histories(VALUES), rtol=1e-11)
    truth = by_scipy(T)
    all_near(run.temperature, truth[:, :2], 1e-9)
    heats = np.stack([run.lost, run.supplied, run.coolant], axis=1)
    all_near(heats, truth[:, 2:], 1e-9, 1e-4)
    assert abs(run.closure) < 1e-13


def hub_at_end(values, t, t_few):
    run = sb.simulate_heat(
        NETWORK,
        [0.0, 60.0],
        **histories(values, t, t_few),
        rtol=1e-10,
        solver=sb.hybrid.Rodas5P(),
    )
    return run.temperature[-1, 1]


@pytest.mark.slow
def test_derivatives_by_every_point():
    """Along random changes of all values and of inner times, against central
    differences."""
    random = np.random.default_rng(3)

    def moves(size):
        move = 0.05 * random.normal(size=size)
        move[[0, -1]] = 0.0
        return move

    start = (VALUES, T, T_FEW)
    ways = {name: random.normal(size=x.size) for name, x in VALUES.items()}
    way = (ways, moves(T.size), moves(T_FEW.size))
    slope = jax.jit(jax.grad(hub_at_end, (0, 1, 2)))(*start)
    both = zip(jax.tree.leaves(slope), jax.tree.leaves(way), strict=True)
    h = 1e-3
    low, high = (
        hub_at_end(*jax.tree.map(lambda x, d, k=k: x + k * d, start, way))
        for k in (-h, h)
    )
    along = sum(np.vdot(g, d) for g, d in both)
    near(along, (high - low) / (2 * h), 2e-6)


@pytest.mark.slow
def test_friction_heat_enters_by_its_partition():
    """The share of the rim as a source there; the rest, of linings that are not
    modelled, is lost at once."""
    cooling = sb.thermal.Conductance("disc", "air", 9.0)
    heat = lump(4e3, 350.0, cooling)
    rubbed = dataclasses.replace(
        heat, friction=sb.thermal.FrictionHeat("disc", None, 0.9)
    )
    P = np.array([0.0, 5e3, 1e3])
    whole, share = (line([0.0, 4.0, 9.0], k * P) for k in (1.0, 0.9))
    friction = sb.simulate_heat(rubbed, [0.0, 9.0], power=whole)
    source = sb.simulate_heat(heat, [0.0, 9.0], power={"disc": share})
    all_near(friction.temperature, source.temperature)
    near(friction.supplied[-1], 25e3, 1e-12)
    near(friction.lost[-1], source.lost[-1] + 2.5e3, 1e-12)
    assert abs(friction.closure) < 1e-13


@pytest.mark.slow
def test_peak_of_a_scene_under_histories():
    """A brake at rest: the maximum of the rim, inside a step, under a source and an air
    of straight lines is that of `C Ṫ = P(t) − G (T − T_a(t))`."""
    C, G = 2e3, 40.0
    t = np.array([0.0, 60.0, 180.0])
    P, air = np.array([0.0, 8e3, 0.0]), np.array([290.0, 300.0, 330.0])
    heat = sb.lumped_heat(
        rim=C, partition=1.0, rim_cooling=G, temperature=300.0, ambient=line(t, air)
    )
    sources = (sb.thermal.Source("rim", line(t, P)),)
    heat = dataclasses.replace(heat, sources=sources)
    scene = scene_of(1e3, end=180.0, w0=0.0, C=None, heat=heat)
    result = sb.simulate(scene)

    def after_60(x):
        """From the top of the source on: both fall and rise on lines."""
        late = C / G
        slope = np.array([-8e3 / 120, 30 / 120])
        steady = 300 + 8e3 / G + slope @ [1 / G, 1.0] * (x - late)
        return steady, late

    def course(x):
        up = 290 + (8e3 / 60 / G + 10 / 60) * (np.array([0.0, 60.0]) - C / G)
        at_60 = up[1] + (300 - up[0]) * np.exp(-60 * G / C)
        start, _ = after_60(0.0)
        return after_60(x)[0] + (at_60 - start) * np.exp(-x * G / C)

    top = minimize_scalar(lambda x: -course(x), (0.0, 120.0), bounds=(0.0, 120.0))
    peak = result.metrics["peak_rim_temperature"]
    near(peak, -top.fun, 1e-9)


# --- files, errors, a fit, cost -------------------------------------------------------

RECORD = """t [s],v [km/h],air [degC],P [kW]
0,36,20,3
10,72,,5
20,108,30,0
"""


@pytest.mark.slow
def test_a_record_with_units(tmp_path):
    """Columns in SI; an empty cell leaves out its row of that column alone; samples
    that hold."""
    file = tmp_path / "record.csv"
    file.write_text(RECORD)
    units = {"v": "m/s", "air": "K", "P": "W"}
    found = sb.files.histories(file, units)
    all_near(found["v"].values, [10.0, 20.0, 30.0])
    all_near(found["air"].times, [0.0, 20.0])
    all_near(found["air"].values, [293.15, 303.15])
    held = sb.files.history(file, "P", "W", held=True)
    run = sb.simulate_heat(lump(), [0.0, 20.0], power={"disc": held})
    near(run.supplied[-1], 80e3)


def test_all_errors_of_a_record_at_once(tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    bad = RECORD.replace("72", "x").replace("20,108,30", "5,108,-300")
    (tmp_path / "record.csv").write_text(bad)
    units = {"v": "m/s", "air": "K", "P": "K", "w": "m/s"}
    cases = [lambda: sb.files.histories("record.csv", units)]
    assert_refused(request, "records", cases)


def test_a_record_without_its_column_of_times(tmp_path):
    file = tmp_path / "record.csv"
    file.write_text(RECORD.replace("t [s]", "time [s]"))
    (fault,) = faults_of(sb.files.histories, file, {"v": "m/s"})
    assert "no column t" in str(fault)
    assert "time=" in fault.hint
    found = sb.files.histories(file, {"v": "m/s"}, time="time")
    all_near(found["v"].times, [0.0, 10.0, 20.0])


def test_all_errors_of_a_run_at_once(request):
    acting = {
        "speed": line([0.0, 2.0, 1.0], [1.0, 2.0, 3.0]),
        "air": line([0.0, 1.0], [-4.0, 300.0]),
        "coolant": 300.0,
        "power": {"disk": 3.0, "disc": "3 m"},
    }
    cooled = lump(4e3, 350.0, sb.thermal.Conductance("disc", "air", 20.0))
    options = acting | {"closed": 2.0, "rtol": 5.0}
    run = lambda: sb.simulate_heat(cooled, [1.0, 0.0], **options)
    assert_refused(request, "histories", [run])


def race(n):
    """Speed (m/s), power lost by 350 kg (W) and air (K) of a car, at `n` s."""
    t = np.arange(float(n))
    v = np.clip(45 + 25 * np.sin(t / 14) + 8 * np.sin(t / 3), 8.0, 85.0)
    return t, v, np.maximum(0.0, -350 * v * np.gradient(v, t)), 295 + 5 * np.sin(t / 90)


def disc_of_race(numbers, record, ts):
    """Temperatures for coefficients of convection, emissivity, and share of power."""
    a, b, emissivity, share = numbers
    t, v, lost, air = record
    links = (
        sb.thermal.Convection("disc", 0.12, sb.thermal.LinearCoefficient(a, b)),
        sb.thermal.Radiation("disc", 0.12, emissivity),
    )
    power = {"disc": line(t, share * lost)}
    run = sb.simulate_heat(
        lump(5e3, 350.0, *links), ts, speed=line(t, v), air=line(t, air), power=power
    )
    return run.temperature[:, 0]


@pytest.mark.slow
def test_a_fit_to_part_of_a_record():
    """Numbers of a record that SciPy made are found from its first half, by exact
    derivatives."""
    record = t, v, lost, air = race(600)
    true = np.array([12.0, 1.6, 0.7, 0.6])

    def rates(x, T):
        v_, lost_, air_ = (np.interp(x, t, y) for y in (v, lost, air))
        out = 0.12 * (12 + 1.6 * v_) * (T - air_) + 0.7 * SIGMA * 0.12 * (
            T**4 - air_**4
        )
        return (0.6 * lost_ - out) / 5e3

    measured = solve_ivp(
        rates, (0, 599), [350.0], "DOP853", t[::5], rtol=1e-9, max_step=0.25
    ).y[0]
    ts = t[:300:5]
    by_numbers = jax.jit(jax.jacfwd(lambda p: disc_of_race(p, record, ts)))
    fit = least_squares(
        lambda p: disc_of_race(p, record, ts) - measured[:60],
        0.7 * true,
        lambda p: np.asarray(by_numbers(p)),
        x_scale=true,
    )
    all_near(fit.x, true, 2e-3)
    predicted = disc_of_race(fit.x, record, t[::5])
    all_near(predicted, measured, atol=0.02)


@pytest.mark.slow
def test_cost_of_twenty_minutes():
    """12,000 samples of speed, power and air in a second of CPU time, warm."""
    t = np.arange(12_000) * 0.1
    record = t, *(np.interp(t, race(1200)[0], x) for x in race(1200)[1:])
    numbers = np.array([12.0, 1.6, 0.7, 0.6])
    disc_of_race(numbers, record, t)
    begun = time.process_time()
    disc_of_race(numbers, record, t)
    assert time.process_time() - begun < 1.0
