"""Acceptance tests as data: `simbrake test FILE`, against closed forms of a stop."""

import json

import pytest
from commands import call
from helpers import paths_of

import simbrake as sb
from simbrake.files.shipped_scenes import shipped_test_names

QUICK = ("lift_tests", "winder_tests")
#: the standard template under a constant lever: it stops after ω J/(M_b − M), or never
SCENE = """
format = "simbrake scene 1"
end_time = "6 s"
initial.omega = "20 rad/s"
duty = { slack_tension = "12 kN", load = "4 kN*m" }
[brake]
pulley = { radius = "0.6 m", inertia = 1000 }
band.radius = "0.62 m"
linings = { count = 8, wrap = "270 deg", friction = 0.35 }
"""


@pytest.fixture
def file(tmp_path):
    """A file of tests next to its scene."""
    (tmp_path / "stop.toml").write_text(SCENE)
    hook = "{ mass = 0, drum_radius = 0.4, line_count = 8 }"
    (tmp_path / "empty_hook.toml").write_text(SCENE.replace('"4 kN*m"', hook))
    bearings = '[[shaft]]\ntype = "BearingFriction"\nfriction_torque = "5 kN*m"\n'
    for name, force in (("on_bearings", 0), ("helped", "1.2e3")):
        scene = SCENE.replace('"20 rad/s"', "0").replace('"12 kN"', f"{force}")
        (tmp_path / f"{name}.toml").write_text(scene + bearings)
    jerk = 'type = "PiecewiseLinear", times = [0, 3, 3.1, 3.3], values = [4e3, 4e3, 40e3, 4e3]'
    load = f'{{ type = "TorqueLoad", profile = {{ {jerk} }} }}'
    (tmp_path / "jerked.toml").write_text(SCENE.replace('"4 kN*m"', load))

    def write(text):
        path = tmp_path / "tests.toml"
        path.write_text(f'scene = "stop.toml"\n{text}')
        return path

    return write


def test_each_result_and_the_worst_of_a_range(file):
    """Numbers are those of runs one by one; the worst of a range is at an end."""
    tests = sb.checks.read_tests(
        file("""
        [[test]]
        name = "stops"
        must = "stops"
        set."duty.load.profile.level" = { low = "2 kN*m", high = "8 kN*m", count = 3 }
        within.stopping_time = "0.8 s"
        within.min_holding_reserve = 4.5
        [[test]]
        name = "holds"
        must = "holds"
        set."initial.omega" = 0
        [[test]]
        name = "held by its bearings"
        must = "holds"
        scene = "on_bearings.toml"
        [[test]]
        name = "held with the help of its bearings"
        must = "holds"
        scene = "helped.toml"
        [[test]]
        name = "breaks away between two stops"
        must = "stops"
        scene = "jerked.toml"
        [[test]]
        name = "lever lost"
        must = "does not stop"
        set."duty.slack_tension.level" = 0
        [[test]]
        name = "nothing hangs"
        must = "stops"
        scene = "empty_hook.toml"
        within.min_holding_reserve = 1.25
        [[test]]
        name = "slips"
        must = "breaks away"
        set."initial.omega" = 0
        set."duty.load.profile.level" = "80 kN*m"
        """)
    )
    found = sb.checks.run_tests(tests)
    scene = tests[0].scene
    runs = [
        sb.simulate(sb.with_values(scene, {"duty.load.profile.level": load}))
        for load in (2e3, 5e3, 8e3)
    ]
    times = [float(run.stopping_time) for run in runs]
    worst = found.answers[0].worst
    reserve = runs[2]["min_holding_reserve"]
    assert worst["stopping_time"] == (max(times), {"duty.load.profile.level": 8e3})
    assert worst["min_holding_reserve"].value == reserve
    assert [answer.passed for answer in found.answers] == [
        max(times) <= 0.8 and reserve >= 4.5,
        True,
        False,
        False,
        False,
        True,
        True,
        True,
    ]
    assert json.dumps(found.as_dict(), allow_nan=False)
    assert "dry friction alone" in found.answers[2].result
    assert "alone does not hold" in found.answers[3].result
    assert "broke away" in found.answers[4].result
    assert [answer.runs for answer in found.answers] == [3, 1, 1, 1, 1, 1, 1, 1]


@pytest.mark.parametrize(
    ("limit", "code"), [('"10 s"', 0), ('"0.1 s"', 3), ('"soon"', 2), ("0", 2)]
)
def test_exit_codes_and_json(file, capsys, limit, code):
    path = file(f"""
        [[test]]
        name = "stops"
        must = "stops"
        within.stopping_time = {limit}
        """)
    got, out, _ = call(capsys, "test", str(path), "--json")
    assert got == code
    if code != 2:
        told = json.loads(out)
        assert told["passed"] == (code == 0)
        (check,) = told["tests"][0]["within"]
        assert check["passed"] == (code == 0)


def test_every_error_at_once(file):
    path = file("""
        tests = 1
        [[test]]
        must = "hold"
        set."duty.load.profile.levl" = 1.0
        [[test]]
        must = "holds"
        within.stopping_tim = "1 s"
        [[test]]
        must = "does not stop"
        within.stopping_time = "1 s"
        set."duty.load.profile.level" = { low = "8 kN*m", high = "2 kN*m", count = 1 }
        [[test]]
        [[test]]
        set = "no table"
        within = { max_tension = -1, min_holding_reserve = 0 }
        """)
    assert paths_of(sb.checks.read_tests, path) == [
        "tests",
        "test[0].must",
        "test[0].set.duty.load.profile.levl",
        "test[1].within.stopping_tim",
        "test[1].must",
        "test[2].set.duty.load.profile.level.count",
        "test[2].set.duty.load.profile.level",
        "test[2].within.stopping_time",
        "test[3]",
        "test[4].set",
        "test[4].within.max_tension",
        "test[4].within.min_holding_reserve",
    ]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in shipped_test_names()
    ],
)
def test_shipped_tests_pass(name):
    """Every shipped file runs, and passes."""
    found = sb.checks.run_tests(sb.checks.read_tests(name))
    assert found.passed, str(found)
