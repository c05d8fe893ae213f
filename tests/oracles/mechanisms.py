"""Oracle of linings on springs."""

import math

import numpy as np
from oracles.independent.sprung import Sprung
from oracles.independent.stepping import Lines, integrate
from oracles.stops import BY_SLOPE, SMOOTH, slope


def stop_on_springs(K=2e3, second=900.0):
    """Two linings with a spring between: each lets go of the rim, slides on both, and
    rests on the band."""
    outer, inner = (
        {"kinetic": np.full(2, f), "static": np.full(2, f)} for f in (0.4, 0.2)
    )
    bandage = {
        "J": np.array([1.2, 1.5]),
        "law": inner,
        "preload": np.array([1500.0, second]),
        "spring": np.array([K]),
        "damping": np.array([0.05]),
    }
    absent = dict.fromkeys(("C", "heat", "wear"))
    zero = dict.fromkeys(("drag", "hook_inertia", "hook_torque"), 0.0)
    given = {
        "n": 2,
        "law": outer,
        "beta": np.full(2, math.radians(50.0)),
        "lever": Lines([0.0, 0.3], [100.0, 6000.0]),
        "load": Lines([0.0], [0.0]),
        "J": 200.0,
        "R": 0.59,
        "R_b": 0.64,
        "omega": 20.0,
        "end": 6.0,
        "bandage": bandage,
    }
    model = Sprung(absent | zero | given)
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
