"""Stops to be fitted: speeds of a rigid band on a straight line, events and speeds of
an elastic one."""

import numpy as np
from scenes import GAIN, closed_form, stop_scene

import simbrake as sb

OMEGA = "initial.omega"
T0 = "duty.slack_tension.level"
J = "brake.pulley.inertia"
F = "brake.linings.friction.coefficient"


TS = np.linspace(0.02, 0.6, 30)  # all before the stop of the rigid scene at 0.649 s


SIGMA = 0.2


LINE = {OMEGA: (5.0, 60.0), T0: (2e3, 3e4)}


START = {OMEGA: 15.0, T0: 6e3}


def rigid(**changes):
    return stop_scene(C=None, **changes)


def rate(T=1.0):
    """Deceleration (rad/s²) of the rigid scene, ω = ω_0 − rate·t, per newton of slack
    tension."""
    return GAIN / 800.0 * T


def line(w0=20.0, T=8e3, noise=None):
    exact = w0 - rate(T) * TS
    return exact if noise is None else exact + SIGMA * noise.standard_normal(TS.size)


def speeds(values, sigma=SIGMA):
    return sb.studies.Measured.of(
        TS, {"omega": values}, sigma=None if sigma is None else {"omega": sigma}
    )


ELASTIC = {F: (0.1, 0.6), "brake.band.stiffness": (1e4, 1e7), J: (200.0, 3e3)}


EVENTS = ("slip_onset_time", "full_slip_time", "stopping_time")


def elastic_data():
    """Closed-form event times, and speeds in the elastic stage and after it, of f 0.31,
    C 1.5e5, J 900."""
    case = {"f": 0.31, "C": 1.5e5, "J": 900.0}
    form = closed_form(**case)
    run = sb.simulate(stop_scene(**case), rtol=1e-12)
    ts = np.array([0.001, 0.004, 0.008, 0.1, 0.3, 0.5, 4.0])
    events = dict(
        zip(
            EVENTS,
            ((form["t0"], 1e-5), (form["t1"], 1e-5), (form["stop"], 1e-3)),
            strict=True,
        )
    )
    return sb.studies.Measured.of(
        ts, {"omega": run.series(ts).omega}, sigma={"omega": 0.1}, events=events
    )
