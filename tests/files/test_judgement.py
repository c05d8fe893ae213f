"""What a brake was to do, and whether it did: one decision, the same on every surface
and in every writing."""

import dataclasses
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from commands import call
from goldens import assert_refused
from helpers import near
from scenes import PI, lining_ratio

import simbrake as sb
from simbrake.loads import (
    BearingFriction,
    HydrodynamicBrake,
    Motor,
    Phase,
    Phases,
    SpeedHold,
    ViscousDrag,
)

WEIGHT = 60e3 * 9.80665 * 0.4 / 8
STATIC = 1.1
PER_NEWTON = 0.623 * (PI - 1)  # torque of the sliding brake
HELD_PER_NEWTON = 0.623 * (lining_ratio(STATIC * 0.35, np.radians(13.5)) ** 20 - 1)
STRENGTH = sb.brakes.Strength(band_area=3e-3, band_stress="400 MPa")
LININGS = sb.uniform_linings(
    20,
    "270 deg",
    sb.ConstantFriction(0.35, STATIC),
    area=0.02,
    permissible_pressure="3 MPa",
)
BRAKE = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, strength=STRENGTH), LININGS)


def lever(*values):
    """Four tensions, at 0, 10, 12 and 60 s, so that all histories share one program."""
    return sb.PiecewiseLinear([0.0, 10.0, 12.0, 60.0], list(values))


def scene(
    pull,
    *,
    w0=0.0,
    end=40.0,
    hydro=0.0,
    drag=0.0,
    bearings=0.0,
    of_load=0.0,
    mass=60e3,
    motor=None,
    wants="",
):
    """Auxiliary brake, drag and bearings are always there, with 0 where they are
    not."""
    shaft = (HydrodynamicBrake(hydro), ViscousDrag(drag), BearingFriction(bearings))
    load = sb.HookLoad(mass, 0.4, 8, drag=of_load)
    return sb.Scene(
        BRAKE,
        sb.Duty(pull, load, wants=wants),
        sb.Initial(w0),
        end,
        shaft=shaft,
        motor=motor,
    )


FULL = lever(20e3, 20e3, 20e3, 20e3)
WEAK = lever(9e3, 9e3, 9e3, 9e3)
WEAKER = lever(8e3, 8e3, 8e3, 8e3)
EASED = lever(20e3, 20e3, 8e3, 8e3)
LOST = lever(20e3, 20e3, 0.0, 0.0)
OPEN = lever(0.0, 0.0, 0.0, 0.0)
LATE = sb.PiecewiseLinear([0.0, 55.0, 56.0, 60.0], [0.0, 0.0, 16e3, 16e3])

#: scene, reason, colour, want: histories, all in one program
HISTORIES = {
    "stops": (scene(FULL, w0=10.0), "H4", "green", "rest"),
    "stops, not shown": (scene(FULL, w0=10.0, end=0.2), "S2", "amber", "rest"),
    "eased after its stop": (scene(EASED, w0=10.0, hydro=60.0), "H1", "red", "hold"),
    "eased, without an auxiliary brake": (scene(EASED, w0=10.0), "H1", "red", "hold"),
    "let go": (scene(LOST, hydro=60.0), "H5", "amber", "released"),
    "let go, without an auxiliary brake": (scene(LOST), "H5", "amber", "released"),
    "three times the load": (
        scene(FULL, w0=10.0, hydro=60.0, mass=180e3),
        "S1",
        "red",
        "rest",
    ),
    "three times the load, alone": (
        scene(FULL, w0=10.0, mass=180e3),
        "S3",
        "red",
        "rest",
    ),
    "weak beside a hydrodynamic brake": (
        scene(WEAK, w0=10.0, hydro=60.0),
        "S1",
        "red",
        "rest",
    ),
    "weak beside drag of the shaft": (
        scene(WEAK, w0=8.0, drag=600.0),
        "S1",
        "red",
        "rest",
    ),
    "weak beside drag of the load": (
        scene(WEAK, w0=8.0, of_load=600.0),
        "S1",
        "red",
        "rest",
    ),
    "thrown upwards": (scene(WEAK, w0=-5.0, hydro=60.0), "S1", "red", "rest"),
    "stopped by bearings": (
        scene(lever(7e3, 7e3, 7e3, 7e3), bearings=15e3),
        "H2",
        "red",
        "hold",
    ),
    "eased, held by bearings": (
        scene(lever(20e3, 7e3, 20e3, 20e3), w0=0.0, bearings=15e3),
        "H2",
        "red",
        "hold",
    ),
    "open, held by bearings": (scene(OPEN, bearings=30e3), "H6", "red", "free"),
    "open": (scene(OPEN), "X1", "red", "free"),
    "lowered by the auxiliary brake": (scene(LATE, hydro=60.0), "L4", "green", "lower"),
    "lowered, no pull given": (scene(OPEN, hydro=60.0), "L5", "amber", "lower"),
    "lowered by drag of the load": (
        scene(LATE, of_load=2000.0),
        "L4",
        "green",
        "lower",
    ),
    "nothing hangs": (scene(OPEN, w0=5.0, mass=0.0), "X0", "green", "free"),
    "held": (scene(FULL), "H4", "green", "hold"),
    "held by static friction alone": (
        scene(lever(1.05e4, 1.05e4, 1.05e4, 1.05e4)),
        "H4",
        "amber",
        "hold",
    ),
}

#: shipped scenes of all kinds of duty
SHIPPED = (
    "u2_5_5_stop",
    "drag_lowering",
    "unequal_bands",
    "standard",
    "disc",
    "shoe",
    "rig",
)
STOP = Phase(20e3, "rest", "brake")
#: of a brake that slides on
SLIDES = {"w0": 8.0, "end": 60.0, "hydro": 60.0}


def phases(*some, **others):
    return scene(Phases(tuple(some)), **others)


def then_held(pull):
    return phases(STOP, Phase(pull, "20 s", "hold"), **SLIDES)


def driven(*speeds, torque="60 kN*m"):
    course = sb.PiecewiseLinear([0.0, 3.0], list(speeds))
    return Motor(torque, "2 MW", "40 rad/s", course)


#: the same of phases, motors, levers that follow a speed, and of what the duty says
OTHERS = {
    "slips off in a hold": (
        then_held(8e3),
        ("H3", "red", "hold"),
    ),
    "slips in a hold, and is caught later": (
        phases(
            STOP,
            Phase(8e3, "3 s", "hold"),
            STOP,
            Phase(20e3, "5 s", "hold"),
            **SLIDES,
        ),
        ("H1", "red", "hold"),
    ),
    "falls in a phase that does not end": (
        phases(Phase(0.0, "travel 500 m", "lower"), end=3.0),
        ("T1", "red", "lower"),
    ),
    "rests on bearings in a phase that does not end": (
        phases(Phase(0.0, "rest", "power fails"), end=10.0, bearings=35e3),
        ("T1", "red", "rest"),
    ),
    "rests on a weak brake in a phase that does not end": (
        phases(Phase(8e3, "rest", "brake"), end=10.0, bearings=15e3),
        ("T1", "red", "rest"),
    ),
    "a strong brake whose phase has too little time": (
        phases(STOP, w0=10.0, end=0.2),
        ("T1", "amber", "rest"),
    ),
    "let go in a hold": (
        then_held(LOST),
        ("H1", "red", "hold"),
    ),
    "a timed brake that is too weak": (
        phases(Phase(9e3, "10 s", "brake"), **SLIDES),
        ("U1", "red", "unsaid"),
    ),
    "a timed brake, said to lower": (
        phases(Phase(9e3, "30 s", "brake", wants="lower"), **SLIDES),
        ("L4", "red", "lower"),
    ),
    "a brake that never comes to rest": (
        phases(Phase(9e3, "rest", "brake"), w0=8.0, end=40.0, hydro=60.0),
        ("T1", "red", "rest"),
    ),
    "held by the motor": (
        scene(OPEN, w0=5.0, motor=driven(5.0, 0.0)),
        ("H7", "amber", "rest"),
    ),
    "a motor against the brake": (
        scene(lever(*[10e3] * 4), w0=1.0, motor=driven(0.0, 10.0, torque="20 kN*m")),
        ("M3", "amber", "lower"),
    ),
    "held by the motor and a weak brake": (
        scene(WEAKER, w0=5.0, motor=driven(5.0, 0.0)),
        ("H2", "red", "rest"),
    ),
    "breaks away, as is meant": (
        scene(WEAKER, hydro=60.0, wants="free"),
        ("X1", "amber", "free"),
    ),
    "let go before it rested": (
        scene(lever(5e3, 0.0, 0.0, 0.0), w0=8.0, hydro=60.0),
        ("H5", "amber", "released"),
    ),
    "hoisted": (scene(LATE, motor=driven(0.0, -5.0)), ("M1", "green", "hoist")),
    "lowered by the lever": (
        scene(SpeedHold("30 kN"), w0=3.0),
        ("L1", "green", "lower"),
    ),
    "its lever at the limit": (
        scene(SpeedHold("9 kN"), w0=3.0),
        ("L2", "red", "lower"),
    ),
    "a fall that is meant": (
        scene(OPEN, end=2.0, wants="free"),
        ("X1", "amber", "free"),
    ),
}


def judged(said):
    return said.reason, str(said.colour), said.wants


@pytest.mark.parametrize("name", HISTORIES)
def test_histories_are_judged_by_what_they_want(name):
    case, *expected = HISTORIES[name]
    said = sb.simulate(case).verdict()
    assert [*judged(said)] == expected
    if said.numbers["reserve"] is not None:
        near(
            said.numbers["load_torque"],
            float(case.duty.load.mass) / 60e3 * WEIGHT,
            1e-12,
        )
        assert any(row.name.startswith("Holding reserve") for row in said.rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_other_duties_are_judged_by_what_they_want(name):
    case, expected = OTHERS[name]
    said = sb.simulate(case, throw=False).verdict()
    assert judged(said) == expected


def test_numbers_are_those_of_the_friction_brake_alone():
    """Static and sliding capacity over the hanging load, whatever else acts on the
    shaft."""
    for name, pull in (
        ("weak beside drag of the load", 9e3),
        ("weak beside a hydrodynamic brake", 9e3),
    ):
        numbers = sb.simulate(HISTORIES[name][0]).verdict().numbers
        near(numbers["sliding_over_load"], PER_NEWTON * pull / WEIGHT, 1e-9)
        near(numbers["reserve"], HELD_PER_NEWTON * pull / WEIGHT, 1e-9)
    lowered = (
        sb.simulate(HISTORIES["lowered by the auxiliary brake"][0]).verdict().numbers
    )
    assert lowered["greatest_pull"] == 16e3  # which the run never sees
    near(lowered["reserve"], HELD_PER_NEWTON * 16e3 / WEIGHT, 1e-9)
    alone = sb.simulate(HISTORIES["held by static friction alone"][0]).verdict()
    assert alone.numbers["sliding_over_load"] < 1 < alone.numbers["reserve"]


def test_what_a_duty_says_is_checked(request):
    nothing_hangs = sb.Duty(FULL, sb.TorqueLoad(0.0), wants="lower")
    wrong = (
        scene(FULL, wants="stop"),
        scene(FULL, wants="hoist"),
        scene(SpeedHold("9 kN"), wants="rest"),
        phases(STOP, wants="rest"),
        phases(Phase(20e3, "travel 5 m", wants="rest")),
        phases(Phase(20e3, "5 s", wants="hoist")),
        dataclasses.replace(scene(FULL), duty=nothing_hangs),
    )
    assert_refused(request, "wants", wrong)


# --- surfaces -----------------------------------------------------------------------


def test_runs_of_an_ensemble_have_the_same_reasons():
    """All histories as the runs of one ensemble."""
    cases = {
        name: entry
        for name, entry in HISTORIES.items()
        if not name.startswith("lowered")
    }  # (other times)
    base, *_ = HISTORIES["stops"]
    numbers = {
        name: {leaf.path: np.asarray(leaf.value) for leaf in sb.files.leaves(case)}
        for name, (case, *_) in cases.items()
    }
    first = {leaf.path: np.asarray(leaf.value) for leaf in sb.files.leaves(base)}
    varied = [
        path
        for path in first
        if any(np.any(each[path] != first[path]) for each in numbers.values())
    ]
    values = {
        path: np.stack([each[path] for each in numbers.values()]) for path in varied
    }
    data = sb.ensemble(base, values, ["stopping_time"], progress=False)
    found = dict(
        zip(
            cases,
            zip(data["reason"].values, data["colour"].values, strict=True),
            strict=True,
        )
    )
    # (what is held by static friction alone, or by bearings, is so from the start: no
    # margin was smaller before)
    assert found == {
        name: (reason, colour) for name, (_, reason, colour, _) in cases.items()
    }


def test_loads_of_many_runs_break_away_one_after_the_other():
    """Also where other runs have their events while one begins to move."""
    base = scene(lever(20e3, 20e3, 13e3, 3e3), w0=10.0, hydro=60.0)
    masses = np.linspace(48e3, 60e3, 200)
    data = sb.ensemble(
        base, {"duty.load.mass": masses}, ["stopping_time"], progress=False
    )
    assert set(data["reason"].values) == {"H1"}


def variations(scene):
    """Numbers by path: with the lever lost or eased, a third of the friction, three
    times the load, ended early."""
    leaves = {
        leaf.path: np.asarray(leaf.value, float) for leaf in sb.files.leaves(scene)
    }

    def scaled(factor, places, which=...):
        found = {
            path: x.copy() for path, x in leaves.items() if re.fullmatch(places, path)
        }
        for x in found.values():
            x[which] *= factor
        return found

    pull = rf"duty\.{scene.duty.lever_field}.*values"
    start = float(scene.initial.time)
    yield "as it is", {}
    yield "lost", scaled(0.0, pull, -1)
    yield "eased", scaled(0.4, pull, -1)
    yield "a third of the friction", scaled(1 / 3, r"brake\..*coefficient")
    yield (
        "three times the load",
        scaled(3.0, r"duty\.load\.(mass|string|profile\.level)"),
    )
    yield "ended early", {"end_time": start + 0.1 * (leaves["end_time"] - start)}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenes_have_one_reason_everywhere(name):
    """Single runs and the runs of an ensemble; and no load that was to stop or to hold
    is green while it moves."""
    base = sb.read_scene(name)
    first = {leaf.path: np.asarray(leaf.value, float) for leaf in sb.files.leaves(base)}
    changes = dict(variations(base))
    paths = sorted({path for change in changes.values() for path in change})
    values = {
        path: np.stack([change.get(path, first[path]) for change in changes.values()])
        for path in paths
    }
    data = sb.ensemble(base, values, [], progress=False)
    for i, (change, numbers) in enumerate(changes.items()):
        result = sb.simulate(sb.with_values(base, numbers), throw=False)
        said = result.verdict()
        moves = result.ok and not result.status.startswith(
            ("stopped", "held", "driven")
        )
        if (
            moves
            and said.wants in ("rest", "hold", "released", "unsaid")
            and said.numbers["reserve"] is not None
        ):
            assert said.colour != "green", change
        assert said.reason == str(data["reason"].values[i]), change


@pytest.mark.parametrize(
    "name", ["stops", "stops, not shown", "three times the load", "let go", "held"]
)
def test_commands_say_the_same(name, tmp_path, capsys):
    case, reason, colour, wants = HISTORIES[name]
    file = tmp_path / "scene.toml"
    sb.write_scene(case, file)
    code, text, _ = call(capsys, "run", str(file), "--fail-on-limit")
    fails = colour == "red" or reason == "S2"
    assert code == (3 if fails else 0)
    assert f"verdict  {colour} {reason}: " in text
    code, text, _ = call(capsys, "run", str(file), "--json")
    said = json.loads(text)["verdict"]
    assert (code, said["reason"], said["colour"], said["wants"]) == (
        0,
        reason,
        colour,
        wants,
    )
    code, text, _ = call(
        capsys, "explain", str(file), "--json", "--no-influence", "--fail-on-limit"
    )
    assert f'"reason": "{reason}"' in text
    assert code == (3 if fails else 0)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
def test_c_of_a_scene_says_the_same(tmp_path):
    """One file of C, with the numbers of each history."""
    sb.export_c(HISTORIES["stops"][0], tmp_path / "scene.c", max_steps=2000)
    cases = {
        name: (case, reason, colour)
        for name, (case, reason, colour, _) in HISTORIES.items()
    }
    runs = []
    for case, *_ in cases.values():
        for leaf in sb.files.leaves(case.as_run):
            place = re.sub(r"[^A-Z0-9]+", "_", leaf.path.upper()).strip("_")
            values = enumerate(np.ravel(np.asarray(leaf.value, float)))
            runs += [
                f"numbers[SCENE_NUMBER_{place} + {i}] = {float(value)!r};"
                for i, value in values
            ]
        runs.append("run();")
    body = "\n  ".join(runs)
    (tmp_path / "main.c").write_text(
        f"""#include <stdio.h>
#include "scene.c"
static double numbers[SCENE_NUMBERS];
static void run(void) {{
  static scene_result result;
  const int code = scene_run(scene_new(), numbers, 1e-10, &result);
  printf("%d %s %d\\n", code, scene_reason_names[result.reason], result.colour);
}}
int main(void) {{
  {body}
}}
""",
        "utf-8",
    )
    subprocess.run(
        ["gcc", "-O1", "-o", "main", "main.c", "-lm"], cwd=tmp_path, check=True
    )
    printed = subprocess.run(
        [tmp_path / "main"], cwd=tmp_path, check=True, capture_output=True, text=True
    ).stdout
    found = dict(
        zip(cases, (line.split() for line in printed.splitlines()), strict=True)
    )
    shades = ("green", "amber", "red")
    assert {
        name: (reason, shades[int(colour)])
        for name, (_, reason, colour) in found.items()
    } == {name: (reason, colour) for name, (_, reason, colour) in cases.items()}
