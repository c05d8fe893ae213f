"""Oracles of mechanisms: a staged stop, a chain, linings on springs."""

import math

import numpy as np
from oracles.independent.banded import Banded
from oracles.independent.chain import Chain
from oracles.independent.sprung import Sprung
from oracles.independent.stepping import Lines, integrate
from oracles.stops import BY_SLOPE, SMOOTH, slope


def numbers(n, f, beta, lever, **own):
    """Of a model of `independent` without a load, heat or wear."""
    absent = dict.fromkeys(("C", "bandage", "heat", "wear"))
    zero = dict.fromkeys(("drag", "hook_inertia", "hook_torque"), 0.0)
    law = {"kinetic": np.full(n, f), "static": np.full(n, f)}
    load = Lines([0.0], [0.0])
    return {
        **absent,
        **zero,
        "n": n,
        "law": law,
        "beta": np.full(n, beta),
        "lever": lever,
        "load": load,
        **own,
    }


def staged_stop():
    """Slip on the rim, the lock and a stop in stage 3 on an elastic band; the grip
    depends on its tensions."""

    def run(f_i=0.22, preload=900.0):
        law = {"kinetic": np.full(8, f_i), "static": np.full(8, f_i)}
        bandage = {"J": 45.0, "law": law, "preload": np.full(8, preload)}
        given = {
            "J": 900.0,
            "R": 0.59,
            "R_b": 0.64,
            "omega": 20.0,
            "end": 4.0,
            "C": 3e5,
            "x": 0.0,
        }
        given |= {"bandage": bandage, "load": Lines([0.0], [300.0])}
        model = Banded(
            numbers(
                8,
                0.40,
                math.radians(33.0),
                Lines([0.0, 7.5], [200.0, 30200.0]),
                **given,
            )
        )
        integrate(model)
        return {event.name: event.time for event in model.log}

    source = (
        "SciPy DOP853, stage by stage; M_i = r f_i Σ ((T_i + T_{i−1}) sin β/2 + N_p)"
    )
    found = run()
    yield "internal slip", found["internal_slip"], source, SMOOTH
    yield "external lock", found["external_lock"], source, SMOOTH
    yield "stopping time", found["stop"], source, SMOOTH
    yield (
        "∂(stopping time)/∂f_i",
        slope(lambda x: run(x)["stop"], 0.22, 2e-3),
        source,
        BY_SLOPE,
    )
    yield (
        "∂(stopping time)/∂N_p",
        slope(lambda x: run(preload=x)["stop"], 900.0, 2e-3),
        source,
        BY_SLOPE,
    )


def chain_of_one():
    """A lining of mass m under a band with a spring and a damper: sticks, slides,
    sticks."""

    def run(C=5.0):
        segments = {
            "mass": np.array([0.05]),
            "stiffness": np.zeros(0),
            "damping": np.zeros(0),
            "anchor": 0.03,
        }
        given = {
            "J": 0.5,
            "R_b": 0.9,
            "omega": 0.6,
            "end": 2.0,
            "C": C,
            "x": 0.2,
            "segments": segments,
        }
        model = Chain(numbers(1, 0.3, math.radians(27.0), Lines([0.0], [1.0]), **given))
        y = integrate(model)
        return [event.time for event in model.log if event.lining], y

    source = "SciPy DOP853: m v̇ = G + T_0 − T, stick and slip event by event"
    times, y = run()
    yield "first slip", times[0], source, SMOOTH
    yield "first stick", times[1], source, SMOOTH
    yield "speed at the end", y[1], source, 1e-8
    yield "∂(speed)/∂C", slope(lambda C: run(C)[1][1], 5.0, 2e-4), source, 1e-6


def stop_on_springs(K=2e3, second=900.0):
    """Two linings with a spring between: each lets go of the rim, slides on both, and
    rests on the band."""
    law = {"kinetic": np.full(2, 0.2), "static": np.full(2, 0.2)}
    bandage = {
        "J": np.array([1.2, 1.5]),
        "law": law,
        "preload": np.array([1500.0, second]),
    }
    bandage |= {"spring": np.array([K]), "damping": np.array([0.05])}
    given = {
        "J": 200.0,
        "R": 0.59,
        "R_b": 0.64,
        "omega": 20.0,
        "end": 6.0,
        "bandage": bandage,
    }
    model = Sprung(
        numbers(2, 0.4, math.radians(50.0), Lines([0.0, 0.3], [100.0, 6000.0]), **given)
    )
    y = integrate(model)
    return {(event.name, event.lining): event.time for event in reversed(model.log)}, y[
        model.OWN
    ][0]


BY_MODES = (
    "SciPy DOP853, mode by mode: J_i ω̇_i = M_i + Q_i − R_b (T_i − T_(i−1)), "
    "Q_i of spring and damper"
)


def linings_on_springs():
    log, elongation = stop_on_springs()
    for i in (1, 2):
        yield f"lining {i} slips", log["lining_internal_slip", i], BY_MODES, SMOOTH
    for i in (1, 2):
        yield (
            f"lining {i} rests on the band",
            log["lining_external_stick", i],
            BY_MODES,
            SMOOTH,
        )
    yield "stopping time", log["stop", None], BY_MODES, SMOOTH
    yield "elongation at rest", elongation, BY_MODES, SMOOTH


def slopes_of_springs():
    def stop(K=2e3, second=900.0):
        return stop_on_springs(K, second)[0]["stop", None]

    yield "∂(stopping time)/∂K", slope(stop, 2e3, 1e-3), BY_MODES, BY_SLOPE
    yield (
        "∂(stopping time)/∂N_pre",
        slope(lambda x: stop(second=x), 900.0, 1e-3),
        BY_MODES,
        BY_SLOPE,
    )
