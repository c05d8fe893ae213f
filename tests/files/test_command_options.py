"""Options of the commands and what they reach: the computing calls have stand-ins, so that nothing is compiled."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from commands import call, no_cache  # noqa: F401

import simbrake as sb


class Answer:
    """A result that says what was asked of it: text, JSON, verdict."""

    ok, outcome, status, message, equal = True, "converged", "stopped", "said", True
    values, exceeded, residuals, line = {"initial.omega": 12.5}, (), (), "small errors"

    def __init__(self, **other):
        vars(self).update(other)

    def __str__(self):
        return "a text"

    def as_dict(self):
        return {"a": 1}

    def as_list(self):
        return [1]

    def accuracy(self):
        return vars(self).setdefault("found", Answer())


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """A function that lets a name of simbrake answer with something: the arguments of its calls, in a list."""

    monkeypatch.chdir(tmp_path)
    (tmp_path / "standard.toml").write_text(sb.files.shipped("standard").read_text("utf-8"), "utf-8")

    def stand_in(place, name, answer):
        calls = []

        def called(*arguments, **named):
            calls.append((arguments, named))
            return answer(*arguments) if callable(answer) else answer

        monkeypatch.setattr(place, name, called)
        return calls

    return stand_in


DATA = xr.Dataset(
    {
        "stopping_time": ("run", [1.0, 2.0, np.nan, 4.0], {"units": "s"}),
        "steps": ("run", [7, 8, 9, 10]),
        "energy.closure": ("run", [0.0, 0.5, 0.25, 0.125], {"units": "J"}),
        "status": ("run", ["stopped", "stopped", "step_limit", "stopped"]),
        "code": ("run", [0, 0, 1, 0]),
        **{name: ("run", [0] * 4) for name in ("method", "rejected", "retaken", "segments")},
    },
    {"run": range(4), "initial.omega": ("run", [1.0, 2.0, 3.0, 4.0], {"units": "rad/s"})},
)


def test_options_of_sweep(capsys, asked, tmp_path):
    vary = ("sweep", "standard.toml", "--vary", "initial.omega=1:4:4", "--metrics", "stopping_time")
    charts = asked(
        sb.plot, "sweep", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8"))
    )
    for codes, code in (([0] * 4, 0), ([0, 0, 1, 0], 1), ([0, -1, 1, 0], 130)):
        (data,) = [DATA.assign(code=("run", codes))]
        calls = asked(sb, "sweep", data)
        assert call(capsys, *vary, "--rtol", "1e-7", "--max-steps", "9", "--workers", "2", "--out", "out")[0] == code
        ((scene, axes, metrics), options) = calls[0]
        assert (float(scene.initial.omega), metrics, list(axes["initial.omega"])) == (
            24.0,
            ("stopping_time",),
            [1, 2, 3, 4],
        )
        assert options == {"rtol": 1e-7, "max_steps": 9, "workers": 2, "directory": None, "client": None}
    assert charts[0][0][0] is not None
    rows = (tmp_path / "out" / "runs.csv").read_text("utf-8").splitlines()
    assert rows[0].startswith("initial.omega [rad/s],stopping_time [s],steps,energy.closure [J],status,code,")
    assert rows[3].startswith("3,,9,0.25,step_limit,1,")
    assert (tmp_path / "out" / "sweep.png").read_text("utf-8") == "130 dots"
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["runs.csv", "runs.nc", "sweep.png"]


def test_summary_of_a_sweep(capsys, asked, tmp_path):
    """In words the quantiles of the runs that have a metric, as JSON every run."""
    asked(sb, "sweep", DATA)
    vary = ("sweep", "standard.toml", "--vary", "initial.omega=1:4:4", "--metrics", "stopping_time,energy.closure")
    lines = [line.split() for line in call(capsys, *vary)[1].splitlines()]
    assert lines[0] == ["4", "runs:", "1", "step", "limit,", "3", "stopped"]
    assert lines[2:4] == [
        ["stopping_time", "1", "2", "4", "s", "3"],
        ["energy.closure", "0", "0.1875", "0.5", "J", "4"],
    ]
    told = json.loads(call(capsys, *vary, "--json", "--rtol", "1e-8")[1])
    assert (told["counts"], told["rtol"]) == ({"step_limit": 1, "stopped": 3}, 1e-8)
    assert told["units"]["stopping_time"] == "s"
    run = told["runs"][2]
    assert (run["run"], run["values"], run["status"], run["code"]) == (2, {"initial.omega": 3.0}, "step_limit", 1)
    assert (run["metrics"]["stopping_time"], run["solver"]["steps"]) == (None, 9)


def test_samples_and_too_many_runs(capsys, asked):
    samples, calls = asked(sb.studies, "samples", {"drawn": [1.0]}), asked(sb, "ensemble", DATA)
    vary = ("sweep", "standard.toml", "--vary", "initial.omega=1:4")
    vary = (*vary, "--metrics", "stopping_time")
    assert call(capsys, *vary, "--sample", "5", "--json")[0] == 1
    (scene, axes, count, seed), _ = samples[0]
    assert (axes, count, seed, float(scene.initial.omega)) == ({"initial.omega": (1.0, 4.0)}, 5, 0, 24.0)
    assert (calls[0][0][1], calls[0][1]["rtol"]) == ({"drawn": [1.0]}, 1e-10)
    call(capsys, *vary, "--sample", "5", "--seed", "3")
    assert samples[1][0][3] == 3
    many = ("--vary", "initial.omega=1:2:1000000", "--vary", "end_time=1:2:101")
    for options, words in (
        (many, "--vary: 101000000 runs are too many — at most 100000000"),
        (("--vary", "initial.omega=1:4", "--sample", "100000001"), "--vary: 100000001 runs are too many"),
        ((), "--vary: is missing — PATH=LOW:HIGH:COUNT, PATH=a,b,c, or PATH=LOW:HIGH with --sample"),
        (("--vary", "initial.omega=1:4", "--sample", "0"), "--sample: 0 is out of range"),
    ):
        code, _, err = call(capsys, "sweep", "standard.toml", *options)
        assert code == 2
        assert words in err
    sweeps = asked(sb, "sweep", DATA)
    most = ("--vary", "initial.omega=1:2:1000000", "--vary", "end_time=1:2:100", "--metrics", "stopping_time")
    call(capsys, "sweep", "standard.toml", *most)
    assert len(sweeps) == 1  # a hundred million are allowed


def test_options_of_sensitivity_and_life(capsys, asked, tmp_path):
    table = Answer()
    calls = asked(sb, "sensitivity", [table, table])
    assert call(capsys, "sensitivity", "standard.toml")[:2] == (0, "a text\n\na text\n")
    (scene, metrics, wrt), options = calls[0]
    assert (float(scene.initial.omega), metrics, wrt, options) == (
        24.0,
        ["stopping_time"],
        None,
        {"span": 0.01, "rtol": 1e-10},
    )
    given = ("--metric", "max_tension", "--wrt", "brake.band", "--span", "0", "--rtol", "1e-8", "--json")
    assert json.loads(call(capsys, "sensitivity", "standard.toml", *given)[1]) == [{"a": 1}] * 2
    assert calls[1][0][1:] == (["max_tension"], ["brake.band"])
    assert calls[1][1] == {"span": None, "rtol": 1e-8}
    for span, code in (("0.99", 0), ("1", 2), ("-0.01", 2)):
        assert call(capsys, "sensitivity", "standard.toml", f"--span={span}")[0] == code
    lives = asked(sb, "lining_life", Answer())
    for given, permissible, turns in (
        ((), None, None),
        (("--permissible", "6 mm", "--turn-at", "best"), "6 mm", "best"),
        (("--turn-at", "10", "--turn-at", "2.5"), None, [10.0, 2.5]),
    ):
        assert call(capsys, "life", "standard.toml", *given)[:2] == (0, "a text\n")
        (scene, wanted), options = lives.pop()
        assert (float(scene.initial.omega), wanted, options) == (24.0, permissible, {"turn_at": turns, "rtol": 1e-10})
    asked(sb.plot, "wear", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8")))
    code, out, _ = call(capsys, "life", "standard.toml", "--json", "--out", "out")
    assert (code, json.loads(out)) == (0, {"a": 1})
    assert (tmp_path / "out" / "wear.png").read_text("utf-8") == "130 dots"
    assert json.loads((tmp_path / "out" / "life.json").read_text("utf-8")) == {"a": 1}


def test_options_of_calibrate(capsys, asked, tmp_path):
    reads = asked(sb, "read_measured", "measured")
    part = SimpleNamespace(
        name="omega",
        unit="rad/s",
        t=np.asarray([0.5, 1.5]),
        **{
            name: np.asarray([i, i + 10.0])
            for i, name in enumerate(("measured", "sigma", "before", "model", "scaled"), 1)
        },
    )
    event = SimpleNamespace(**vars(part) | {"name": "stop", "unit": "s", "t": None})
    calls = asked(sb, "calibrate", Answer(residuals=(part, event)))
    asked(sb.plot, "calibration", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8")))
    fit = ("calibrate", "standard.toml", "a.csv", "--fit", "initial.omega=10:30")
    code, out, _ = call(capsys, *fit, "--set", "duty.load.mass=50 t", "--out", "out")
    assert (code, out.splitlines()[1]) == (
        0,
        "run it   simbrake run standard.toml --set 'duty.load.mass=50 t' --set initial.omega=12.5",
    )
    assert reads[0] == ((Path("a.csv"),), {"sigma": {}, "columns": None})
    (scene, limits, measured), options = calls[0]
    assert (float(scene.duty.load.mass), limits, measured) == (50e3, {"initial.omega": (10.0, 30.0)}, "measured")
    assert options == {"start": {}, "loss": "linear", "starts": 1, "rtol": 1e-8}
    assert (tmp_path / "out" / "residuals.csv").read_text("utf-8").splitlines() == [
        "name,unit,t [s],measured,sigma,before,fitted,residual over sigma",
        "omega,rad/s,0.5,1,2,3,4,5",
        "omega,rad/s,1.5,11,12,13,14,15",
        "stop,s,,1,2,3,4,5",
        "stop,s,,11,12,13,14,15",
    ]
    assert (tmp_path / "out" / "calibration.png").read_text("utf-8") == "130 dots"
    calls = asked(sb, "calibrate", Answer(outcome="not_converged"))
    more = (
        "--start",
        "initial.omega=20",
        "--sigma",
        "omega=0.1",
        "--events",
        "e.csv",
        "--column",
        "omega",
        "--loss",
        "huber",
    )
    code, out, _ = call(capsys, *fit, *more, "--starts", "4", "--json")
    assert (code, json.loads(out)) == (1, {"a": 1})
    assert reads[-1] == ((Path("a.csv"), Path("e.csv")), {"sigma": {"omega": 0.1}, "columns": ["omega"]})
    assert calls[0][1] == {"start": {"initial.omega": 20.0}, "loss": "huber", "starts": 4, "rtol": 1e-8}
    for outcome in sb.studies.Outcome:
        asked(sb, "calibrate", Answer(outcome=outcome))
        known = {"converged": 0, "not_converged": 1, "not_determined": 4, "stuck": 5}
        assert call(capsys, *fit)[0] == known[outcome]
    for wrong, words in (
        (("--fit", "initial.omega=1"), "--fit initial.omega=1: is not of the form PATH=LOW:HIGH"),
        (("--sigma", "omega=x"), "--sigma omega=x: is not of the form NAME=VALUE"),
        (("--fit", "end_time=1:2", *("--start", "end_time=1") * 2), "--start end_time: is given twice"),
        ((), "--fit: no parameter is to be fitted — --fit brake.pulley.inertia=500:2000"),
    ):
        code, _, err = call(capsys, "calibrate", "standard.toml", "a.csv", *wrong)
        assert code == 2
        if wrong:
            assert words in err


def test_options_of_animate(capsys, asked, tmp_path):
    runs, films = asked(sb, "simulate", Answer()), asked(sb.plot, "animate", None)
    assert call(capsys, "animate", "standard.toml", "x.gif")[:2] == (0, "written  x.gif\n")
    assert runs[0][1] == {"rtol": 1e-10, "throw": False, "progress": None}
    assert films[0][0][1] == Path("x.gif")
    assert films[0][1] == {"duration": 6.0, "fps": 20, "start": None, "end": None}
    given = ("--duration", "3", "--fps", "50", "--start", "1", "--end", "2")
    call(capsys, "animate", "standard.toml", "x.gif", *given)
    assert films[1][1] == {"duration": 3.0, "fps": 50, "start": 1.0, "end": 2.0}
    for given, fault in (
        (("--duration", "600"), None),
        (("--duration", "600.5"), "--duration: 600.5 is out of range"),
        (("--duration", "0"), "--duration: 0.0 is out of range"),
        (("--fps", "1"), None),
        (("--fps", "51"), "--fps: 51 is out of range"),
        (("--fps", "0"), "--fps: 0 is out of range"),
    ):
        code, _, err = call(capsys, "animate", "standard.toml", "x.gif", *given)
        assert (code, (fault or "") in err) == (0 if fault is None else 2, True)
    assert "give .gif or .html" in call(capsys, "animate", "standard.toml", "x.mp4")[2]
    asked(sb, "simulate", Answer(ok=False))
    assert call(capsys, "animate", "standard.toml", "x.gif")[0] == 1


def test_options_of_estimates_and_synthesis(capsys, asked, tmp_path):
    result = Answer()
    runs, tables = asked(sb, "simulate", result), asked(sb, "estimates", Answer())
    assert call(capsys, "estimates", "standard.toml")[:2] == (0, "a text\n")
    assert tables[0][0] == (result,)
    assert (runs[0][1]["rtol"], runs[0][1]["throw"]) == (1e-10, False)
    assert json.loads(call(capsys, "estimates", "standard.toml", "--no-run", "--json")[1]) == {"a": 1}
    assert float(tables[1][0][0].initial.omega) == 24.0
    assert len(runs) == 1
    for exceeded, options, code in (((), (), 0), (("rim",), (), 0), (("rim",), ("--fail-on-limit",), 3)):
        figures = asked(sb, "synthesize", Answer(exceeded=exceeded))
        assert call(capsys, "synthesize", "standard.toml", *options)[0] == code
    assert call(capsys, "synthesize", "standard.toml", "--no-run", "--out", "x.json")[:2] == (
        0,
        "a text\nwritten  x.json\n",
    )
    assert json.loads((tmp_path / "x.json").read_text("utf-8")) == [1]
    call(capsys, "synthesize", "standard.toml", "--out", "out")
    assert (tmp_path / "out" / "synthesis.txt").read_text("utf-8") == "a text\n"
    call(capsys, "synthesize", "standard.toml", "--out", "out", "--json", "--transmission")
    assert json.loads((tmp_path / "out" / "synthesis.json").read_text("utf-8")) == [1]
    assert figures[0][0][0] is result
    assert figures[0][1]["partition"] is None
    assert float(figures[1][0][0].initial.omega) == 24.0
    assert figures[3][1]["partition"] is not None
    asked(sb, "simulate", Answer(ok=False))
    assert call(capsys, "estimates", "standard.toml")[0] == 1
    assert call(capsys, "synthesize", "standard.toml")[0] == 1


def test_options_of_materials(capsys, asked, tmp_path):
    class Rows(Answer, list):
        pass

    good, bad = SimpleNamespace(admissible=True), SimpleNamespace(admissible=False)
    for rows, options, code in (
        ([good], ("--fail-on-limit",), 0),
        ([good, bad], ("--fail-on-limit",), 3),
        ([bad], (), 0),
    ):
        found = Rows()
        found.extend(rows)
        calls = asked(sb, "compare_materials", found)
        assert call(capsys, "materials", "standard.toml", *options)[0] == code
    (scene, rims, linings), options = calls[0]
    assert float(scene.initial.omega) == 24.0
    assert {"steel_20L"} < set(rims)
    assert {"FK-24A"} < set(linings)
    assert options == {"energy": None, "run": True, "inertia": False, "rtol": 1e-10}
    asked(sb.plot, "materials", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8")))
    given = ("--rim", "brass", "--lining", "retinax", "--no-run", "--inertia", "--energy", "0.5 J, 2 kJ")
    assert call(capsys, "materials", "standard.toml", *given, "--out", "out")[1].endswith(
        "written  out/materials.png\n"
    )
    assert calls[1][0][1:] == (["brass"], ["retinax"])
    assert calls[1][1] == {"energy": [0.5, 2e3], "run": False, "inertia": True, "rtol": 1e-10}
    assert (tmp_path / "out" / "materials.png").read_text("utf-8") == "120 dots"
    assert "give .png, .svg or .pdf" in call(capsys, "materials", "standard.toml", "--out", "x.gif")[2]
    given = ("--no-run", "--energy", "initial.omega = 120 rpm,24")
    call(capsys, "materials", "standard.toml", *given)
    assert calls[-1][1]["energy"] == {"initial.omega": [pytest.approx(4 * math.pi), 24.0]}
    for text, word in (
        ("0 J", "0 J"),
        ("brake.linings.angle=1", "brake.linings.angle"),
        ("omega=1", "not a single number"),
    ):
        code, _, err = call(capsys, "materials", "standard.toml", "--no-run", "--energy", text)
        assert (code, word in err) == (2, True)


def test_options_of_pages_and_files(capsys, asked, tmp_path):
    fmus = asked(sb.files, "write_fmu", None)
    assert call(capsys, "fmu", "standard.toml")[:2] == (0, "written  standard.fmu\n")
    assert fmus[0][0][1:] == (Path("standard.fmu"), None)
    call(capsys, "fmu", "standard.toml", "--input", "lever", "--out", "out", "--set", "initial.omega=9")
    assert fmus[1][0][1:] == (Path("out/standard.fmu"), ["lever"])
    assert float(fmus[1][0][0].initial.omega) == 9.0
    for port in ("65536", "-1"):
        code, _, err = call(capsys, "app", "standard.toml", f"--port={port}")
        assert (code, f"--port: {port} is out of range" in err) == (2, True)
