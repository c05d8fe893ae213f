"""Options of the commands and what they reach: the computing calls have stand-ins, so
that nothing is compiled."""

import operator
import shlex
from types import SimpleNamespace

import pytest
import xarray as xr
from commands import call, no_cache  # noqa: F401

import simbrake as sb


class Answer(list):
    """A result that says what was asked of it: text, JSON, verdict, and rows."""

    ok = True
    outcome = "converged"
    status = "stopped"
    message = "said"
    equal = True
    values = {"initial.omega": 12.5}  # noqa: RUF012
    exceeded = ()
    residuals = ()
    line = "small errors"

    def __init__(self, *rows, **other):
        super().__init__(rows)
        vars(self).update(other)

    def __str__(self):
        return "a text"

    def as_dict(self):
        return {"a": 1}

    def as_list(self):
        return [1]


#: data of a study by the codes of its runs
CODES = [
    xr.Dataset(
        {
            "stopping_time": ("run", [1.0] * 3, {"units": "s"}),
            "status": ("run", ["stopped"] * 3),
            "code": ("run", codes),
            "reason": ("run", ["S1"] * 3),
            "colour": ("run", ["red"] * 3),
            "steps": ("run", [7] * 3),
        },
        {"run": range(3), "initial.omega": ("run", [1.0, 2.0, 3.0], {"units": "1"})},
    )
    for codes in ([0, 0, 0], [0, 1, 0], [-1, 1, 0])
]
CALCULATING = (
    "simulate",
    "lining_life",
    "estimates",
    "synthesize",
    "compare_materials",
)
ANSWERS = {name: Answer() for name in (*CALCULATING, "calibrate")} | {
    "sensitivity": [Answer()],
    "read_measured": "measured",
    "sweep": CODES[0],
    "ensemble": CODES[0],
    "studies.samples": {"drawn": [1.0]},
    "plot.animate": None,
}


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """What names of simbrake are called with, in lists by their names; they answer at
    once."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "standard.toml").write_text(
        sb.files.shipped("standard").read_text("utf-8"), "utf-8"
    )
    calls = {name: [] for name in ANSWERS}

    def stand_in(name, answer):
        def called(*arguments, **named):
            calls[name].append((arguments, named))
            return answer

        place, _, function = name.rpartition(".")
        monkeypatch.setattr(
            operator.attrgetter(place)(sb) if place else sb, function, called
        )

    for name, answer in ANSWERS.items():
        stand_in(name, answer)
    calls["instead"] = stand_in
    return calls


def run(capsys, line):
    command, *arguments = shlex.split(line)
    return call(capsys, command, "standard.toml", *arguments)


OUTCOMES = {"converged": 0, "not_converged": 1, "not_determined": 4}
FIT = "calibrate a.csv --fit initial.omega=10:30"
VARY = "sweep --vary initial.omega=1:4:4 --metrics stopping_time"


@pytest.mark.parametrize(
    ("line", "name", "options"),
    [
        (
            VARY,
            "sweep",
            {
                "rtol": 1e-10,
                "max_steps": None,
                "workers": None,
                "directory": None,
                "client": None,
            },
        ),
        (
            f"{VARY} --rtol 1e-7 --max-steps 9 --workers 2",
            "sweep",
            {"rtol": 1e-7, "max_steps": 9, "workers": 2},
        ),
        (
            "sweep --vary initial.omega=1:4 --sample 5 --metrics steps",
            "ensemble",
            {"rtol": 1e-10},
        ),
        ("sensitivity", "sensitivity", {"span": 0.01, "rtol": 1e-10}),
        (
            "sensitivity --span 0 --rtol 1e-8",
            "sensitivity",
            {"span": None, "rtol": 1e-8},
        ),
        ("life", "lining_life", {"turn_at": None, "rtol": 1e-10}),
        ("life --turn-at best", "lining_life", {"turn_at": "best"}),
        ("life --turn-at 10 --turn-at 2.5", "lining_life", {"turn_at": [10.0, 2.5]}),
        (FIT, "calibrate", {"start": {}, "loss": "linear", "starts": 1, "rtol": 1e-8}),
        (
            f"{FIT} --start initial.omega=20 --loss huber",
            "calibrate",
            {"start": {"initial.omega": 20.0}, "loss": "huber"},
        ),
        (f"{FIT} --starts 4", "calibrate", {"starts": 4}),
        (
            f"{FIT} --profile --each end_time=1:2",
            "calibrate",
            {"profile": True, "per_recording": {"end_time": (1.0, 2.0)}},
        ),
        (FIT, "read_measured", {"sigma": {}, "columns": None}),
        (
            f"{FIT} --sigma omega=0.1 --column omega",
            "read_measured",
            {"sigma": {"omega": 0.1}, "columns": ["omega"]},
        ),
        (
            "animate x.gif",
            "plot.animate",
            {"duration": 6.0, "fps": 20, "start": None, "end": None},
        ),
        (
            "animate x.gif --duration 3 --fps 50 --start 1 --end 2",
            "plot.animate",
            {"fps": 50, "start": 1.0, "end": 2.0},
        ),
        ("animate x.gif", "simulate", {"rtol": 1e-10, "throw": False}),
        ("estimates", "simulate", {"rtol": 1e-10, "throw": False}),
        ("synthesize", "synthesize", {"partition": None}),
        (
            "materials",
            "compare_materials",
            {"energy": None, "run": True, "inertia": False, "rtol": 1e-10},
        ),
        (
            "materials --no-run --inertia --energy '0.5 J, 2 kJ'",
            "compare_materials",
            {"energy": [0.5, 2e3], "run": False},
        ),
        (
            "materials --energy initial.omega=120rpm,24",
            "compare_materials",
            {"inertia": False},
        ),
    ],
)
def test_options_reach_the_call(capsys, asked, line, name, options):
    assert run(capsys, line)[0] == 0
    found = asked[name][-1][1]
    assert {option: found[option] for option in options} == options


@pytest.mark.parametrize(
    ("line", "name", "answer", "code"),
    [
        (VARY, "sweep", CODES[1], 1),
        (VARY, "sweep", CODES[2], 130),
        *(
            (FIT, "calibrate", Answer(outcome=sb.studies.Outcome(x)), i)
            for x, i in OUTCOMES.items()
        ),
        ("animate x.gif", "simulate", Answer(ok=False), 1),
        ("estimates", "simulate", Answer(ok=False), 1),
        ("synthesize", "synthesize", Answer(exceeded=("rim",)), 0),
        ("synthesize --fail-on-limit", "synthesize", Answer(exceeded=("rim",)), 3),
        (
            "materials --fail-on-limit",
            "compare_materials",
            Answer(SimpleNamespace(admissible=True)),
            0,
        ),
        (
            "materials --fail-on-limit",
            "compare_materials",
            Answer(SimpleNamespace(admissible=False)),
            3,
        ),
        (
            "materials",
            "compare_materials",
            Answer(SimpleNamespace(admissible=False)),
            0,
        ),
    ],
)
def test_exit_codes(capsys, asked, line, name, answer, code):
    asked["instead"](name, answer)
    assert run(capsys, line)[0] == code
