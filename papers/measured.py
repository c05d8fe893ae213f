"""Compare simulated runs with a measured machine: a positioning drive with dry
friction.

    python papers/measured.py [--json] [--page]

The recording (papers/emps) has the force of the motor and the position of a table on a
screw, 24.8 s with many reversals. The force is the load of a pulley of radius 1 m, whose
inertia is the moved mass, and whose brake is open: it turns against dry friction alone,
through all of the record in one run, without correction by the measured position.

Parameters are those that the authors published, and those of fits on the first 6.24 s
with more and more of the friction: by direction, viscous friction by direction as well,
and curved at low speed. `--page` writes docs/measurements.md with its figures, `--json`
prints the numbers.
"""

import argparse
import gzip
import json
import pathlib
import re
import sys
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

import simbrake as sb
from simbrake.loads import BearingFriction, ViscousDrag

HERE = pathlib.Path(__file__).parent
PAGE = HERE.parent / "docs" / "measurements.md"
#: rows of the record that are fitted (the first of its four periods), and their spacing
FITTED = 6240
EVERY = 10
#: standard deviation of the position that a fit assumes (m): it scales what is said of
#: the quality of a fit, not the parameters
SIGMA = 1e-4
RTOL = 1e-8
#: half of the time over which the recorded position gives a speed (rows of 1 ms)
SPEED_OVER = 10

MASS = "brake.pulley.inertia"
DRY = "shaft[0].friction_torque"


class Model(NamedTuple):
    """What is assumed of the friction: its laws, and which numbers are fitted between
    which bounds, none of the published ones."""

    name: str
    laws: tuple[sb.loads.AbstractShaftTorque, ...]
    fitted: dict[str, tuple[float, float]]


def _both(number: str, low: float, high: float) -> dict[str, tuple[float, float]]:
    """A number of the friction in both directions, and its bounds."""
    each = (f"shaft[0].{number}", f"shaft[0].reverse.{number}")
    return dict.fromkeys(each, (low, high))


# Published: M = 95.1089 kg, F_v = 203.5034 N·s/m, F_c = 20.3935 N, and an offset of the
# force of −3.1648 N, which is a part of the friction that does not change its sign
_MASS = 95.1089
_VISCOUS = 203.5034
_FORWARD = 20.3935 - 3.1648
_BACKWARD = 20.3935 + 3.1648
_PUBLISHED = (
    BearingFriction(_FORWARD, reverse=BearingFriction(_BACKWARD)),
    ViscousDrag(_VISCOUS),
)
_MASSES = {MASS: (80.0, 120.0)}
_DRY_BOTH = _both("friction_torque", 5.0, 40.0)

MODELS = (
    Model("published parameters", _PUBLISHED, {}),
    Model(
        "the same form, fitted",
        _PUBLISHED,
        {**_MASSES, **_DRY_BOTH, "shaft[1].coefficient": (100.0, 300.0)},
    ),
    Model(
        "viscous friction by direction",
        (
            BearingFriction(
                _FORWARD,
                viscous=_VISCOUS,
                reverse=BearingFriction(_BACKWARD, viscous=_VISCOUS),
            ),
        ),
        {**_MASSES, **_DRY_BOTH, **_both("viscous", 100.0, 300.0)},
    ),
    Model(
        "curved at low speed, by direction",
        (
            BearingFriction(
                _FORWARD,
                25.0,
                0.02,
                175.0,
                reverse=BearingFriction(_BACKWARD, 28.0, 0.02, 238.0),
            ),
        ),
        {
            **_MASSES,
            **_DRY_BOTH,
            **_both("static", 0.0, 60.0),
            **_both("stribeck_speed", 1e-3, 0.2),
            **_both("viscous", 100.0, 300.0),
        },
    ),
)


class Recording(NamedTuple):
    """Time (s), force of the motor (N) and position (m) from its start."""

    t: np.ndarray
    force: np.ndarray
    position: np.ndarray

    @property
    def speed(self) -> np.ndarray:
        """Speed (m/s) by differences over 20 ms, `nan` at both ends."""
        speed = np.full(len(self.t), np.nan)
        n = SPEED_OVER
        moved = self.position[2 * n :] - self.position[: -2 * n]
        speed[n:-n] = moved / (self.t[2 * n :] - self.t[: -2 * n])
        return speed


def recording() -> Recording:
    """The recording as it is shipped."""
    with gzip.open(HERE / "emps" / "emps.csv.gz", "rt") as file:
        t, force, position = np.loadtxt(file, delimiter=",", skiprows=1).T
    return Recording(t, force, position - position[0])


def scene(data: Recording, laws: tuple[sb.loads.AbstractShaftTorque, ...]) -> sb.Scene:
    """The drive under the recorded force. The brake is open: only radius and inertia of
    its pulley matter."""
    brake = sb.Brake(
        sb.Pulley(radius=1.0, inertia=_MASS),
        sb.Band(1.02),
        sb.uniform_linings(4, "180 deg", 0.3),
    )
    load = sb.TorqueLoad(sb.PiecewiseLinear(data.t, data.force))
    return sb.Scene(
        brake,
        sb.Duty(0.0, load, wants="free"),
        sb.Initial(0.0),
        float(data.t[-1]),
        shaft=laws,
    )


class Outcome(NamedTuple):
    """A model beside the recording: its numbers, and the courses of the run."""

    model: Model
    values: dict[str, float]
    position: np.ndarray
    speed: np.ndarray
    #: largest change of the position with a tolerance of the integration of 1e-10 (m)
    integration: float
    #: what a fit says of itself
    message: str


def run(data: Recording, model: Model) -> Outcome:
    """Fit what is to be fitted on the first part, and run through the whole record."""
    whole = scene(data, model.laws)
    message = "as published"
    values: dict[str, float] = {}
    if model.fitted:
        first = Recording(*(column[:FITTED] for column in data))
        t = first.t[::EVERY]
        column = {"phi": first.position[::EVERY]}
        measured = sb.studies.Measured.of(t, column, sigma={"phi": SIGMA})
        part = scene(first, model.laws)
        fit = sb.calibrate(part, model.fitted, measured, rtol=RTOL)
        values = {path: float(value) for path, value in fit.values.items()}
        message = fit.message.partition(";")[0]
        whole = sb.with_values(whole, values)
    series = sb.simulate(whole, rtol=RTOL).series(data.t)
    tight = sb.simulate(whole, rtol=1e-10).series(data.t)
    position = np.asarray(series.phi)
    change = float(np.abs(position - np.asarray(tight.phi)).max())
    speed = np.asarray(series.omega)
    return Outcome(model, values, position, speed, change, message)


def errors(data: Recording, outcome: Outcome) -> dict[str, float]:
    """Root mean square and largest errors of position (m) and speed (m/s), in the first
    part and in the rest."""
    found = {}
    apart = {
        "position": outcome.position - data.position,
        "speed": outcome.speed - data.speed,
    }
    for part, rows in (("first", slice(0, FITTED)), ("rest", slice(FITTED, None))):
        for name, error in apart.items():
            own = error[rows]
            found[f"{name}_rms_{part}"] = float(np.sqrt(np.nanmean(own**2)))
            found[f"{name}_max_{part}"] = float(np.nanmax(np.abs(own)))
    return found


def as_dict(data: Recording, outcomes: list[Outcome]) -> dict[str, Any]:
    """All numbers, SI."""
    return {
        "rows": len(data.t),
        "fitted_until": float(data.t[FITTED - 1]),
        "travel": float(np.ptp(data.position)),
        "models": [
            {
                "name": outcome.model.name,
                "fitted": outcome.values,
                "message": outcome.message,
                "integration": outcome.integration,
                **errors(data, outcome),
            }
            for outcome in outcomes
        ],
    }


# --- the page -------------------------------------------------------------------------


def table(data: Recording, outcomes: list[Outcome]) -> str:
    """Errors of all models as a table in Markdown."""
    lines = [
        "| friction | numbers fitted | position, first 6.24 s: rms, maximum | "
        "position, rest | speed, first | speed, rest |",
        "|---|---|---|---|---|---|",
    ]
    for outcome in outcomes:
        e = errors(data, outcome)
        cells = [outcome.model.name, str(len(outcome.values) or "none")]
        for name, unit, factor in (("position", "mm", 1e3), ("speed", "mm/s", 1e3)):
            for part in ("first", "rest"):
                rms = factor * e[f"{name}_rms_{part}"]
                most = factor * e[f"{name}_max_{part}"]
                cells.append(f"{rms:.3g}, {most:.3g} {unit}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def courses(data: Recording, outcomes: list[Outcome]) -> Figure:
    """Position of the recording and of the runs, and what is left between them."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(data.t, 1e3 * data.position, color="0.4", lw=3, label="recorded")
    shown = [outcome for i, outcome in enumerate(outcomes) if i != 1]
    for outcome, colour in zip(shown, ("#D55E00", "#0072B2", "#009E73"), strict=True):
        name = outcome.model.name
        above.plot(data.t, 1e3 * outcome.position, color=colour, lw=0.9, label=name)
        left = 1e3 * (outcome.position - data.position)
        below.plot(data.t, left, color=colour, lw=0.9)
    above.set_ylabel("position, mm")
    below.set(xlabel="time, s", ylabel="run − recording, mm")
    for axes in (above, below):
        axes.axvspan(0, data.t[FITTED], color="0.9", zorder=0)
        axes.grid(alpha=0.3)
    above.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False)
    return figure


def friction(data: Recording, outcomes: list[Outcome]) -> Figure:
    """Friction over speed as the recording has it (force less mass times acceleration,
    means over 50 ms), and the laws."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.subplots()
    n = 25
    window = np.ones(2 * n + 1) / (2 * n + 1)
    smooth = np.convolve(data.position, window, "same")
    speed = np.gradient(smooth, data.t)
    acceleration = np.gradient(np.convolve(speed, window, "same"), data.t)
    force = np.convolve(data.force, window, "same")
    best = outcomes[-1]
    left = force - best.values[MASS] * acceleration
    inside = slice(4 * n, -4 * n, 10)
    axes.plot(speed[inside], left[inside], ".", ms=2, color="0.5", label="recorded")
    v = np.linspace(-0.17, 0.17, 801)
    for outcome, colour in ((outcomes[0], "#D55E00"), (best, "#009E73")):
        laws = sb.with_values(scene(data, outcome.model.laws), outcome.values).shaft
        drawn = [
            sum(float(law.turning(0.0, x, None, 0.0, np.sign(x))) for law in laws)
            for x in v
        ]
        axes.plot(v, drawn, color=colour, label=outcome.model.name)
    axes.set(xlabel="speed, m/s", ylabel="friction, N")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False)
    return figure


def write_page(data: Recording, outcomes: list[Outcome]) -> None:
    """The table and the figures of docs/measurements.md."""
    text = PAGE.read_text("utf-8")
    new = f"<!-- table -->\n{table(data, outcomes)}\n<!-- end -->"
    text = re.sub(
        r"<!-- table -->.*<!-- end -->", new.replace("\\", r"\\"), text, flags=re.S
    )
    PAGE.write_text(text, "utf-8")
    pictures = PAGE.parent / "pictures"
    courses(data, outcomes).savefig(pictures / "measured_position.png", dpi=100)
    friction(data, outcomes).savefig(pictures / "measured_friction.png", dpi=100)


def main(arguments: list[str] | None = None) -> int:
    """Print the comparison; the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")
    parser.add_argument(
        "--page", action="store_true", help="write the page of the docs"
    )
    options = parser.parse_args(arguments)
    data = recording()
    outcomes = []
    for model in MODELS:
        print(f"{model.name} …", file=sys.stderr)
        outcomes.append(run(data, model))
    if options.json:
        print(json.dumps(as_dict(data, outcomes), indent=1))
    else:
        print(table(data, outcomes))
        for outcome in outcomes:
            values = ", ".join(f"{path} {x:.5g}" for path, x in outcome.values.items())
            print(f"{outcome.model.name}: {outcome.message}; {values or 'none fitted'}")
            print(f"  error of the integration {1e6 * outcome.integration:.2g} µm")
    if options.page:
        write_page(data, outcomes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
