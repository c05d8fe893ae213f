"""Stops of a rigid brake under constant torques, whose verdicts and explanations have
closed forms."""

import math

from scenes import PI, stop_scene

import simbrake as sb

J = 800.0
W0 = 20.0
R = 0.725
T0 = 8e3
LOAD = 1.2e4
Z = math.tan(math.radians(13.5) / 2)
TORQUE = R * T0 * (PI - 1)
STOP = J * W0 / (TORQUE - LOAD)
ANGLE = STOP * W0 / 2


def flat(*values):
    """A profile of four points, so that all levers and loads share one program."""
    return sb.PiecewiseLinear([0.0, 2.0, 2.0, 9.0], list(values))


def rigid(load=LOAD, *, lever=(T0,) * 4, w0=W0, end=4.0, **parts):
    load = (load,) * 4 if isinstance(load, float) else load
    parts |= {"lever": flat(*lever), "load": sb.TorqueLoad(flat(*load))}
    return stop_scene(C=None, w0=w0, end=end, **parts)


def rigid_run(*load, **parts):
    return sb.simulate(rigid(*load, **parts))


def helped_hold(share, after):
    """A load of `share` times what the brake holds, which bearings help to hold; at 2 s
    it changes to `after`, and the lever is let go."""
    loads = (share * TORQUE, share * TORQUE, after * TORQUE, after * TORQUE)
    bearings = sb.loads.BearingFriction(0.3 * TORQUE)
    return rigid(loads, lever=(T0, T0, 0.0, 0.0), w0=0.0, shaft=(bearings,))


def two_stops(again, end):
    """Released at 2 s and braked anew at the time `again`."""
    lever = sb.PiecewiseLinear(
        [0.0, 2.0, 2.0, again, again, 99.0], [T0, T0, 0.0, 0.0, T0, T0]
    )
    load = sb.TorqueLoad(
        sb.PiecewiseLinear([0.0, 1.0, 2.0, 3.0, 4.0, 99.0], [LOAD] * 6)
    )
    return stop_scene(C=None, lever=lever, load=load, end=end)
