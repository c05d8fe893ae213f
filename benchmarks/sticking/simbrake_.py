"""simbrake: one contact is a disc brake, two in series are a staged brake, a contact
with a spring behind it is a resolved band of one lining.

All radii are 1 m, so that forces are torques. Event times of the staged brake are
differentiated by JAX.
"""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import simbrake as sb

from . import number, with_number

#: friction of a rim that its preload alone makes grip: a power of 2, without rounding
SMALL = 2.0**-80
RTOL = 1e-12
#: events of contacts by their names in simbrake
KINDS = {
    "restart": ("slip", 0),
    "internal_slip": ("slip", 0),
    "internal_restick": ("stick", 0),
    "external_lock": ("stick", 1),
    "external_release": ("slip", 1),
    "lining_slip": ("slip", 0),
    "lining_stick": ("stick", 0),
}
#: that have derivatives: contact events
METRICS = {
    ("slip", 0): "internal_slip_time",
    ("stick", 1): "external_lock_time",
    ("stick", 0): "stopping_time",
}


def profile(given: Any, factor: float = 1.0) -> sb.PiecewiseLinear:
    """A number or points, times a factor."""
    if not isinstance(given, dict):
        given = {"times": [0.0, 1.0], "values": [given, given]}
    return sb.PiecewiseLinear(given["times"], factor * jnp.asarray(given["values"]))


def scene(problem: dict[str, Any]) -> sb.Scene:
    A, *others = problem["bodies"].values()
    contact, *more = problem["contacts"]
    load = sb.TorqueLoad(profile(A["torque"]))
    elongation = 0.0
    if not others:
        friction = sb.ConstantFriction(0.5, contact.get("static_ratio", 1.0))
        brake = sb.DiscBrake(A["inertia"], sb.Pads(friction, 0.5, 1.5, 1.0))
        duty = sb.ForceDuty(profile(contact["limit"]), load)
    elif more:
        # tension ratio 3: the torque is twice the slack tension
        friction = sb.ConstantFriction(0.5)
        brake = sb.Brake(
            sb.Pulley(1.0, A["inertia"]),
            sb.Band(1.0),
            sb.Lining(friction, np.array([math.pi / 2])),
            sb.Bandage(
                others[0]["inertia"],
                sb.ConstantFriction(SMALL),
                contact["limit"] / SMALL,
            ),
        )
        duty = sb.Duty(profile(more[0]["limit"], 0.5), load)
    else:
        share = contact["limit_per_spring_torque"]
        stiffness = problem["springs"][0]["stiffness"]
        tension = contact["limit"] / (2 * share)
        elongation = tension / stiffness
        brake = sb.Brake(
            sb.Pulley(1.0, A["inertia"]),
            sb.Band(1.0, stiffness, sb.Segments(1.0)),
            sb.Lining(
                sb.ConstantFriction(share),
                np.array([math.pi / 2]),
                mass=others[0]["inertia"],
            ),
        )
        duty = sb.Duty(profile(tension), load)
    return sb.Scene(brake, duty, sb.Initial(A["speed"], elongation), problem["end"])


class Run:
    """A run of a problem."""

    def __init__(self, problem: dict[str, Any]):
        self.problem = problem
        self.result = sb.simulate(scene(problem), rtol=RTOL)
        self.events = []
        in_series = len(problem["contacts"]) > 1
        elastic = "springs" in problem
        for event in self.result.events:
            kind = KINDS.get(event.name)
            if event.name == "stop" and not elastic:
                # A comes to rest on B, if B rests
                rests = [what for what, c, _ in self.events if c == 1][-1:] == ["stick"]
                kind = ("stick", int(in_series and not rests))
            if kind and not (in_series and event.name == "restart"):
                self.events.append((*kind, float(event.time)))

    def state(self, body: str, t: float) -> tuple[float, float]:
        series = self.result.series(np.array([t]))
        angle = float(series.phi[0])
        if body == "A":
            return angle, float(series.omega[0])
        # A turns on B against one torque: their friction work is its angle
        work = float(series.pairs["internal"].friction_work[0].sum())
        limit = self.problem["contacts"][0]["limit"]
        return angle - work / limit, float(series.bandage_speed[0])

    def turns(self, body: str) -> list[float]:
        # a band that springs back only begins to rest there
        names = ("reversal", "stop") if "springs" in self.problem else ("reversal",)
        return [float(e.time) for e in self.result.events if e.name in names]


solve = Run


def derivatives(problem: dict[str, Any], asked: dict[str, Any]) -> dict[str, float]:
    """By JAX."""
    places = list({str(one["by"]): one["by"] for one in asked.values()}.values())

    def times(values: Any) -> Any:
        changed = problem
        for paths, value in zip(places, values, strict=True):
            changed = with_number(changed, paths, value)
        result = sb.simulate(scene(changed), rtol=RTOL)
        return jnp.stack([getattr(result, name) for name in METRICS.values()])

    values = jnp.array([number(problem, paths[0]) for paths in places])
    slopes = jax.jacfwd(times)(values)
    found = {}
    for label, one in asked.items():
        event = problem["answers"][one["derivative_of"]]["asked"]
        row = list(METRICS).index((event["time_of"], event["contact"]))
        found[label] = float(slopes[row, places.index(one["by"])])
    return found
