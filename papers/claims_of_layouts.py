"""Claims of Z: linings along a band, their loads, onset and stop."""

import dataclasses
import math

import numpy as np
from claim import (
    FRICTIONS,
    LININGS,
    WRAP,
    Found,
    Runs,
    claim,
    even,
    judged,
    loads,
    of_each,
    stop,
    uniform,
)

import simbrake as sb


@claim(
    "Z",
    "abstract, conclusions",
    "uniform pitch loads the tight side 1.5 to 3 times as much as the slack side",
    fast=True,
)
def tight_side(_: Runs) -> Found:
    ratio = np.asarray([(n := loads(f, uniform(f))[1])[-1] / n[0] for f in FRICTIONS])
    fine = np.linspace(0.05, 0.5, 451)
    inside = [
        f for f in fine if 1.5 <= (n := loads(f, uniform(f))[1])[-1] / n[0] <= 3.0
    ]
    text = (
        f"$N_{{10}}/N_1$ = {of_each(ratio)} at f = {of_each(FRICTIONS, '.1f')}; "
        f"between 1.5 and 3 for f from {inside[0]:.2f} to {inside[-1]:.2f}"
    )
    return Found(ratio[1], text, judged((ratio >= 1.5) & (ratio <= 3.0), inside))


@claim(
    "Z",
    "tables 2, 4",
    "variable pitch lowers the maximum load, by 1.85 at f = 0.4",
    "equal lever and torque",
    fast=True,
)
def variable_pitch(_: Runs) -> Found:
    ratio = []
    for f in FRICTIONS:
        T, N = loads(f, even(f))
        # the uniform pitch that has the same ratio of tensions: the same torque of the
        # same lever
        from scipy.optimize import brentq

        def more(wrap: float, f: float = f, T: np.ndarray = T) -> float:
            return float(loads(f, np.full(LININGS, wrap / LININGS))[0][-1] - T[-1])

        wrap = brentq(more, 0.5 * WRAP, 1.5 * WRAP)
        ratio.append(
            float(np.max(loads(f, np.full(LININGS, wrap / LININGS))[1]) / np.max(N))
        )
    ratio = np.asarray(ratio)
    text = (
        f"maximum load lower by the factor {of_each(ratio)} at f = "
        f"{of_each(FRICTIONS, '.1f')}; halved "
        f"from f = {np.interp(2.0, ratio, FRICTIONS):.2f} on"
    )
    return Found(ratio[3], text, judged(ratio >= 1.5, ratio >= 1.5))


@claim(
    "Z",
    "after table 4",
    "the arc on which linings slide grows with friction",
    "equal last angles; equal torque",
    fast=True,
)
def sliding_arc(_: Runs) -> Found:
    last = math.radians(20.0)
    found = [
        sb.layouts.chord_equal_load_angles(f, 7, last, last) for f in (0.1, 0.2, 0.4)
    ]
    arc = np.degrees([np.sum(angle[:-1]) for angle in found])
    needed = np.degrees(math.log(2.0) / FRICTIONS[[0, 1, 3]])
    text = (
        f"with the last chords given, {of_each(arc, '.1f')}° at f = 0.1, 0.2, 0.4, but "
        "the ratio of tensions grows with it; for one ratio (2) the arc falls, "
        f"{of_each(needed, '.0f')}°"
    )
    return Found(
        arc[-1] / arc[0],
        text,
        judged(
            np.all(np.diff(arc) > 0) and np.all(np.diff(needed) > 0), np.diff(arc) > 0
        ),
    )


@claim(
    "Z",
    "after table 4",
    "from f = 0.5 on the layout of equal loads no longer fits on the pulley",
    fast=True,
)
def infeasible(_: Runs) -> Found:
    def fits(f: float) -> bool:
        try:
            sb.layouts.chord_equal_load_angles(
                f, 7, math.radians(20.0), math.radians(20.0)
            )
        except sb.layouts.InfeasibleLayout:
            return False
        return True

    low = 0.4
    high = 0.6
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    text = f"the chords of 7 linings with the last two of 20° fit up to f = {low:.3f}"
    return Found(
        low, text, judged(not fits(0.5) and abs(low - 0.5) < 0.02, not fits(0.5))
    )


@claim(
    "Z",
    "after table 4",
    "from the second lining on the loads hardly depend on friction",
    "equal lever",
    fast=True,
)
def loads_and_friction(_: Runs) -> Found:
    found = []
    for f in (0.1, 0.2, 0.4):
        angle = sb.layouts.chord_equal_load_angles(
            f, 7, math.radians(20.0), math.radians(20.0)
        )
        found.append(
            float(
                np.asarray(
                    sb.brakes.chord_tensions(1.0, f, np.append(0.0, angle)).normal
                )[-1]
            )
        )
    text = (
        f"$N/T_0$ = {of_each(found)} at f = 0.1, 0.2, 0.4 (Z's own table 2): they "
        "are equal among linings, not over f"
    )
    return Found(found[-1] / found[0], text, judged(found[-1] / found[0] < 1.2))


@claim(
    "Z",
    "Fig. 2",
    "linings of twice the arc have lower pressures at both edges",
    "equal load; equal tension",
    fast=True,
)
def edges(_: Runs) -> Found:
    f = 0.3
    arc = WRAP / LININGS

    def pressures(angle: float, load: float | None) -> np.ndarray:
        """At the slack and the tight edge, over the tension at the slack one and the
        face of one arc (1/(R b))."""
        tension, normal = loads(f, np.asarray([angle]))
        mean = (normal[0] if load is None else load) / angle
        return np.asarray(
            [
                float(sb.brakes.pressure_within(mean, tension[0], place))
                for place in (0.0, 1.0)
            ]
        )

    same_load = pressures(2 * arc, 1.0) / pressures(arc, 1.0)
    same_tension = pressures(2 * arc, None) / pressures(arc, None)
    text = (
        f"edges of a lining of 54° over those of 27° at f = 0.3: {of_each(same_load)} "
        f"(slack, tight) with the same load, {of_each(same_tension)} with the same "
        "tension at its slack side, where it takes more load"
    )
    return Found(
        float(same_load[1]),
        text,
        judged([same_load < 1, same_tension < 1], same_load < 1),
    )


@claim(
    "Z",
    "equation before Z-16",
    "slip begins at a time in proportion to $T_0/(C R \\omega_0)$, whatever the layout",
    fast=False,
)
def onset(_: Runs) -> Found:
    found = []
    for C, w, angle in (
        (1e5, 24.0, uniform(0.3)),
        (2e5, 12.0, uniform(0.3)),
        (1e5, 18.0, even(0.3)),
    ):
        of = sb.with_values(
            stop(0.3, angle, C), {"brake.band.stiffness": C, "initial.omega": w}
        )
        of = dataclasses.replace(
            of, duty=sb.Duty(sb.Constant(12e3), sb.TorqueLoad(sb.Constant(0.0)))
        )
        t = next(e.time for e in sb.simulate(of).events if e.name == "slip_onset")
        found.append(t * C * float(of.brake.band.radius) * w / 12e3)
    text = (
        f"$t_0 C R_b \\omega_0/T_0$ = {of_each(found, '.6f')} for two stiffnesses, "
        "three speeds and two layouts"
    )
    return Found(found[0], text, judged(np.abs(np.asarray(found) - 1) < 1e-4))


@claim(
    "Z",
    "tables 5, 6",
    "stopping time hardly depends on the layout, maximum load and angles on friction",
    "equal lever",
)
def stopping_times(_: Runs) -> Found:
    spread = []
    load = []
    for f in (0.3, 0.5):
        runs = [sb.simulate(stop(f, angle(f))) for angle in (uniform, even)]
        times, highest = (
            [r.metrics[name] for r in runs]
            for name in ("stopping_time", "max_normal_load")
        )
        spread.append(100 * abs(times[1] / times[0] - 1))
        load.append(highest[0] / highest[1])
    text = (
        f"between uniform and variable pitch it differs by {of_each(spread)} % at f = "
        f"0.3, 0.5, the maximum load by the factor {of_each(load)}"
    )
    return Found(
        spread[0], text, judged(np.asarray(spread) < 10.0, np.asarray(spread) < 10.0)
    )


@claim(
    "Z",
    "review, [7]",
    "under the tight branch friction is lower than under the slack one",
    "one stop, halves of the band",
)
def lower_friction(runs: Runs) -> Found:
    result = runs.fading
    f = np.asarray(
        result.series([0.98 * result.metrics["stopping_time"]]).friction_coefficient
    )[0]
    half = LININGS // 2
    ratio = float(np.mean(f[half:]) / np.mean(f[:half]))
    text = (
        "mean of the tight half over that of the slack half at the end of a hot stop: "
        f"{ratio:.3f}; by heating alone, cold they are equal"
    )
    return Found(ratio, text, judged(ratio < 1))


@claim(
    "Z",
    "review, [5]",
    "at a high energy load the brake torque falls sharply as friction falls with temperature",
    "equal lever",
)
def torque_falls(runs: Runs) -> Found:
    result = runs.fading
    hot = 0.98 * result.metrics["stopping_time"]
    cold = sb.simulate(stop(stiffness=None))
    ends = [
        float(np.asarray(r.series([t]).brake_torque)[0])
        for r, t in ((result, hot), (cold, 0.9 * cold.metrics["stopping_time"]))
    ]
    ratio = ends[0] / ends[1]
    f = float(np.mean(np.asarray(result.series([hot]).friction_coefficient)) / 0.35)
    text = (
        f"friction falls to {100 * f:.0f} %, the torque of the same lever to "
        f"{100 * ratio:.0f} % of that of a cold brake"
    )
    return Found(ratio, text, judged(ratio < f, ratio < 1))


def faces(angle: np.ndarray) -> np.ndarray:
    """Areas of linings in proportion to their angles, over a quarter less than their
    sections (m²)."""
    return 0.75 * angle * 0.590 * 0.220


@claim(
    "Z",
    "abstract, after Fig. 4",
    "areas that follow the angles of the linings level the pressure",
    "equal lever; areas of the sections, and of one size",
    fast=True,
)
def areas(_: Runs) -> Found:
    # maximum over minimum pressure: both layouts with areas by their angles, variable
    # pitch with equal ones
    found = []
    for f in FRICTIONS:
        of = {pitch: (loads(f, pitch(f))[1], pitch(f)) for pitch in (uniform, even)}
        pressure = [normal / faces(angle) for normal, angle in of.values()] + [
            of[even][0]
        ]
        found.append([float(np.max(p) / np.min(p)) for p in pressure])
    plain, follow, equal = np.asarray(found).T
    text = (
        f"maximum over minimum pressure at f = {of_each(FRICTIONS, '.1f')}: uniform "
        f"pitch {of_each(plain)}, variable {of_each(follow)} if areas follow the "
        f"angles, {of_each(equal)} if all areas are equal: a longer lining takes load "
        "in proportion"
    )
    return Found(follow[2], text, judged(follow < 1.1, follow < 0.9 * plain))


@claim(
    "Z",
    "review, [7]",
    "only unequal numbers and areas of linings on the two branches level the wear",
    "f = 0.35, each branch half of the wrap",
    fast=True,
)
def branches(_: Runs) -> Found:
    def uneven(slack: int, areas: bool) -> float:
        """Maximum over minimum pressure, which wear follows; `areas`: those of a branch
        by its mean load."""
        tight = LININGS - slack
        normal = loads(
            0.35, np.repeat([WRAP / 2 / slack, WRAP / 2 / tight], [slack, tight])
        )[1]
        area = (
            np.repeat(
                [np.mean(normal[:slack]), np.mean(normal[slack:])], [slack, tight]
            )
            if areas
            else 1.0
        )
        return float(np.max(normal / area) / np.min(normal / area))

    slack = (5, 4, 3, 2)
    alike, given = (
        np.asarray([uneven(number, areas) for number in slack])
        for areas in (False, True)
    )
    normal = loads(0.35, even(0.35))[1]
    variable = float(np.max(normal) / np.min(normal))
    text = (
        f"maximum over minimum wear {of_each(alike)} with {of_each(slack, 'd')} of ten "
        f"linings on the slack branch, {of_each(given)} if the areas of a branch "
        f"follow its mean load; {variable:.2f} with variable pitch and linings of one "
        "size"
    )
    best = min(alike.min(), given.min())
    return Found(best, text, judged(best < min(variable, alike[0]), best < alike[0]))
