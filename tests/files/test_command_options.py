"""Options of the commands and what they reach: the computing calls have stand-ins, so that nothing is compiled."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from commands import call, no_cache  # noqa: F401
from helpers import Waiting, open_scene

import simbrake as sb
from simbrake._base._table import Column, Table
from simbrake._commands import _runs, _studies


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

    class Named(Waiting):
        def __init__(self, name, what):
            assert name.isidentifier()
            assert what.endswith("…")
            super().__init__(name, what)

    monkeypatch.setattr(_runs, "Waiting", Named)
    monkeypatch.setattr(_studies, "Waiting", Named)
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


def test_values_of_varied_parameters():
    for text, values in (
        ("1:2:3", (["1", "2"], 3)),
        ("1 t:2 t:2", (["1 t", "2 t"], 2)),
        ("1:2:1000000", (["1", "2"], 1_000_000)),
        ("1, 2,3", (["1", " 2", "3"], 0)),
        ("7", (["7"], 0)),
    ):
        assert _studies._grid(text) == values
    for text in ("1:2", "1:2:1", "1:2:3:4", "1:2:1000001", "1:2:x"):
        with pytest.raises(ValueError, match=r"."):
            _studies._grid(text)
    assert _studies._sampled("1:2") == (["1", "2"], 0)
    scene, axes = open_scene(sb.files.shipped("standard")), {}
    given = {
        "initial.omega": _studies._Values(["2", "1"], 3),
        "duty.load.mass": _studies._Values(["2 t", "1 t"]),
        "end_time": _studies._Values(["1", "3"], 3),
        "nothing": _studies._Values(["1", "3"], 3),
    }
    faults = _studies._axes(scene, given, axes)
    assert str(faults[0]) == "--vary initial.omega: 2 is not below 1 — give LOW:HIGH:COUNT"
    assert [fault.path for fault in faults][1:] == ["--vary nothing=1:3"]
    assert {path: list(values) for path, values in axes.items()} == {
        "duty.load.mass": [2e3, 1e3],
        "end_time": [1, 2, 3],
    }
    assert _studies._metrics_of(scene, " stopping_time,, max_tension") == ("stopping_time", "max_tension")
    usual, every = _studies._metrics_of(scene, None), _studies._metrics_of(scene, "all")
    assert "stopping_time" in usual
    assert set(usual) < set(every)
    assert "max_tension" in set(every) - set(usual)


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


def test_runs_of_a_sweep_in_a_table_in_words_and_as_json(capsys, asked, tmp_path):
    runs = _studies._table_of(DATA)
    assert [(one.name, one.unit) for one in runs.columns][:3] == [
        ("initial.omega", "rad/s"),
        ("stopping_time", "s"),
        ("steps", ""),
    ]
    assert runs["stopping_time"][:2] == [1.0, 2.0]
    lines = [line.split() for line in _studies._text(runs, ("stopping_time", "energy.closure")).splitlines()]
    assert lines == [
        ["4", "runs:", "1", "step", "limit,", "3", "stopped"],
        ["metric", "minimum", "median", "maximum", "unit", "of", "how", "many", "runs"],
        ["stopping_time", "1", "2", "4", "s", "3"],
        ["energy.closure", "0", "0.1875", "0.5", "J", "4"],
    ]
    none = Table(["status", Column("x", "s")], [("failed", np.nan)])
    assert _studies._text(none, ("x",)).splitlines()[-1].split() == ["x", "—", "s", "0"]
    told = _studies._summary(runs, ["initial.omega"], ("stopping_time",), 1e-8)
    assert (told["counts"], told["rtol"]) == ({"step_limit": 1, "stopped": 3}, 1e-8)
    assert told["units"] == {"initial.omega": "rad/s", "stopping_time": "s"}
    assert told["runs"][2] == {
        "run": 2,
        "values": {"initial.omega": 3.0},
        "status": "step_limit",
        "code": 1,
        "metrics": {"stopping_time": None},
        "energy": {"closure": 0.25},
        "solver": {"method": 0, "steps": 9, "rejected": 0, "retaken": 0, "segments": 0},
    }
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


def test_a_sample_is_drawn_within_its_bounds_and_too_many_runs_are_refused(capsys, asked):
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


def test_options_of_calibrate_and_the_command_that_runs_its_result(capsys, asked, tmp_path):
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
    from simbrake._pages import _page

    pages = asked(_page, "film_page", "a page")
    assert call(capsys, "animate", "standard.toml", "x.gif")[:2] == (0, "written  x.gif\n")
    assert runs[0][1] == {"rtol": 1e-10, "throw": False, "progress": None}
    assert films[0][0][1] == Path("x.gif")
    assert films[0][1] == {"duration": 6.0, "fps": 20, "start": None, "end": None}
    given = ("--duration", "3", "--fps", "50", "--start", "1", "--end", "2")
    call(capsys, "animate", "standard.toml", "x.gif", *given)
    assert films[1][1] == {"duration": 3.0, "fps": 50, "start": 1.0, "end": 2.0}
    code, out, _ = call(capsys, "animate", "standard.toml", "x.html", *given, "--json")
    assert (code, json.loads(out)) == (0, {"status": "stopped", "message": "said", "written": "x.html"})
    title = (tmp_path / "standard.toml").read_text("utf-8").splitlines()[0].lstrip("# ").rstrip(".")
    assert pages[0][0][1:] == (title, 150, 3.0, 1.0, 2.0)
    assert (tmp_path / "x.html").read_text("utf-8") == "a page"
    call(capsys, "animate", "standard.toml", "x.html", "--duration", "0.05")
    assert pages[1][0][2:] == (2, 0.05, None, None)  # two pictures at least
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
    from simbrake.formulas._material_table import DEFAULT_LININGS, DEFAULT_RIMS

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
    assert (float(scene.initial.omega), rims, linings) == (24.0, DEFAULT_RIMS, DEFAULT_LININGS)
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
    scene = open_scene(sb.files.shipped("standard"))
    assert _runs._energy(scene, "initial.omega = 120 rpm,24") == {"initial.omega": [pytest.approx(4 * math.pi), 24.0]}
    for text, words in (
        ("0 J", "0 J' is out of range|friction works"),
        ("brake.linings.angle=1", "brake.linings.angle is not a single number of the scene"),
        ("omega=1", "omega is not a single number of the scene"),
    ):
        with pytest.raises(sb.InputError, match=words):
            _runs._energy(scene, text)


def test_options_of_compare(capsys, asked, tmp_path):
    (tmp_path / "other").mkdir()
    for name in ("other/standard.toml", "kept.toml"):
        (tmp_path / name).write_text((tmp_path / "standard.toml").read_text("utf-8"), "utf-8")
    (tmp_path / "a.nc").touch()
    asked(sb, "simulate", lambda scene: f"run {float(scene.initial.omega):g}")
    calls = asked(sb, "compare", Answer())
    assert call(capsys, "compare", "a.nc", "kept.toml")[:2] == (0, "a text\n")
    assert calls == [((Path("a.nc"), "run 24", 1e-9), {})]
    charts = asked(
        sb.plot, "compare", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8"))
    )
    paths = ("standard.toml", "other/standard.toml", "a.nc", "a.nc")
    code, out, _ = call(capsys, "compare", *paths, "--out", "out", "--json")
    told = {"equal": True, "results": list(paths), "comparisons": [{"a": 1}] * 3}
    told["results"] = ["standard.toml", "other/standard.toml", "a.nc", "a.nc"]
    assert (code, json.loads(out)) == (0, told)
    assert json.loads((tmp_path / "out" / "compare.json").read_text("utf-8")) == told
    assert (tmp_path / "out" / "compare.png").read_text("utf-8") == "130 dots"
    assert list(charts[0][0][0].items()) == [
        ("standard.toml", "run 24"),
        ("other/standard.toml", "run 24"),
        ("a.nc, 3", Path("a.nc")),
        ("a.nc, 4", Path("a.nc")),
    ]
    assert [(one[0][0], one[0][1]) for one in calls[1:]] == [("run 24", "run 24")] + [("run 24", Path("a.nc"))] * 2
    code, out, _ = call(capsys, "compare", "a.nc", "kept.toml", "standard.toml")
    assert (code, out) == (0, "a: a, b: kept\na text\n\na: a, b: standard\na text\n")
    (tmp_path / "out.toml").mkdir()
    call(capsys, "compare", "out.toml", "a.nc")
    assert calls[-1][0] == (Path("out.toml"), Path("a.nc"), 1e-9)
    asked(sb, "compare", Answer(equal=False))
    assert call(capsys, "compare", "a.nc", "kept.toml", "--rtol", "1e-3")[0] == 1
    for given, words in (
        (("a.nc", "b.nc"), "b.nc: there is no such file"),
        (("a.nc", "a.nc", "--out", "a.nc"), "is a file"),
    ):
        code, _, err = call(capsys, "compare", *given)
        assert (code, words in err) == (2, True)


def test_options_of_pages_and_files(capsys, asked, tmp_path):
    from simbrake._pages import _app, _publish

    fmus = asked(sb.files, "write_fmu", None)
    assert call(capsys, "fmu", "standard.toml")[:2] == (0, "written  standard.fmu\n")
    assert fmus[0][0][1:] == (Path("standard.fmu"), None)
    call(capsys, "fmu", "standard.toml", "--input", "lever", "--out", "out", "--set", "initial.omega=9")
    assert fmus[1][0][1:] == (Path("out/standard.fmu"), ["lever"])
    assert float(fmus[1][0][0].initial.omega) == 9.0
    pages = asked(_publish, "publish", Answer())
    code, out, _ = call(
        capsys, "publish", "standard.toml", "--vary", "initial.omega=1:2:3", "--limit", "max_tension=9 kN"
    )
    assert (code, out) == (0, "a text\nwritten  standard_sliders.html\n")
    (scene, axes, out), options = pages[0]
    assert (float(scene.initial.omega), out, axes[0].path) == (24.0, Path("standard_sliders.html"), "initial.omega")
    assert (options["limits"], options["rtol"]) == ({"max_tension": 9e3}, 1e-10)
    code, _, err = call(capsys, "publish", "standard.toml", "--limit", "max_tensoin=1")
    assert (code, "max_tensoin" in err, "--vary" in err) == (2, True, True)
    made = asked(_app, "App", SimpleNamespace(warm=lambda: None))

    def serve():
        raise KeyboardInterrupt

    closed = []
    server = SimpleNamespace(address="http://x", serve_forever=serve, server_close=lambda: closed.append(1))
    served = asked(_app, "Server", server)
    assert call(capsys, "app", "standard.toml")[:2] == (
        0,
        "the app is at http://x\nfor this computer alone; Ctrl+C ends it\nended\n",
    )
    assert json.loads(call(capsys, "app", "standard.toml", "--json", "--port", "65535")[1]) == {"address": "http://x"}
    assert [one[0][1] for one in served] == [0, 65535]
    assert closed == [1, 1]
    assert made[0][0][1:2] + made[0][0][3:] == ({}, 1e-10)
    for port in ("65536", "-1"):
        code, _, err = call(capsys, "app", "standard.toml", f"--port={port}")
        assert (code, f"--port: {port} is out of range" in err) == (2, True)


def test_options_of_explain_and_report(capsys, asked, tmp_path):
    result = Answer(scene=open_scene(sb.files.shipped("standard")), verdict=lambda checks: Answer())
    runs, reruns = asked(sb, "simulate", result), asked(sb.results, "rerun", result)

    class Found(Answer, dict):
        pass

    for exceeded, options, code in ((0, (), 0), (1, (), 0), (1, ("--fail-on-limit",), 3), (0, ("--fail-on-limit",), 0)):
        found = Found()
        found["outcome"] = SimpleNamespace(numbers={"exceeded": exceeded})
        said = asked(sb.results, "explain", found)
        assert call(capsys, "explain", "standard.toml", "--limit", "max_tension=9 kN", *options)[:2] == (
            code,
            "a text\n",
        )
    (one, options) = said[0]
    assert (one, options["limits"], options["influence"]) == ((result,), {"max_tension": 9e3}, True)
    assert runs[0][1]["rtol"] == 1e-10
    assert reruns == []
    (tmp_path / "out.toml").mkdir()
    for place, read in (("a.nc", "a.nc"), ("out.toml", "out.toml/result.nc")):
        assert json.loads(call(capsys, "explain", place, "--json", "--no-influence")[1]) == {"a": 1}
        assert reruns.pop()[0] == (Path(read),)
    assert said[-1][1]["influence"] is False
    code, _, err = call(capsys, "explain", "a.nc", "--set", "initial.omega=3")
    assert (code, "--set: changes a scene, not a result — give the scene file" in err) == (2, True)
    from simbrake._run import _measure

    asked(_measure, "limit_checks", [])
    reports = asked(sb, "report", None)
    code, out, _ = call(capsys, "report", "standard.toml")
    said = "stopped: said\nverdict  a text\naccuracy small errors\nwritten  standard.html\n"
    assert (code, out) == (0, said)
    (one, options) = reports[0]
    assert one == (result, Path("standard.html"))
    assert {name: options[name] for name in ("sensitivity", "limits", "check", "spread")} == {
        "sensitivity": [],
        "limits": {},
        "check": result.accuracy(),
        "spread": False,
    }
    assert list(options["files"]) == ["standard.toml"]
    given = ("--sensitivity", "stopping_time", "--no-check", "--with-spread", "--json", "--out", "out")
    for more, spread in (((), True), (("--lining", "woven"), "woven")):
        told = json.loads(call(capsys, "report", "standard.toml", *given, *more)[1])
        assert (told["status"], told["message"], told["written"]) == ("stopped", "said", "out/standard.html")
        assert told["accuracy"] is None
        assert reports[-1][1]["spread"] == spread
    assert (reports[-1][1]["sensitivity"], reports[-1][1]["check"]) == (["stopping_time"], False)
    code, _, err = call(capsys, "report", "standard.toml", "--lining", "woven", "--sensitivity", "x", "--limit", "y=1")
    assert (code, [words in err for words in ("--lining: says what", "3 input errors")]) == (2, [True] * 2)


def test_options_of_run(capsys, asked, tmp_path):
    from simbrake._pages import _page
    from simbrake._run import _measure
    from simbrake.studies import _measured

    result = Answer()
    runs, saves = asked(sb, "simulate", result), asked(sb, "save", lambda found, place: place)
    checks = asked(_measure, "limit_checks", [SimpleNamespace(verdict=_measure.LimitVerdict.EXCEEDED)])
    texts, told = asked(_measure, "text_with_limits", "stopped: text"), asked(_measure, "summary_with_limits", {"a": 1})
    pages = asked(_page, "write", lambda found, out, *_: [out / "a.png"])
    limits = ("--limit", "max_tension=9 kN")
    for options, code, out in (
        ((), 0, "stopped: text\n"),
        (("--json", *limits), 0, '{\n "a": 1\n}\n'),
        ((*limits, "--fail-on-limit"), 3, "stopped: text\n"),
        (("--out", "x.nc"), 0, "stopped: text\nwritten  x.nc\n"),
        (("--out", "out"), 0, "stopped: text\nwritten  out/a.png\n"),
    ):
        assert call(capsys, "run", "standard.toml", *options)[:2] == (code, out)
    assert {name: runs[0][1][name] for name in ("rtol", "max_steps", "max_events", "throw")} == {
        "rtol": 1e-10,
        "max_steps": None,
        "max_events": 10_000,
        "throw": False,
    }
    assert [one[0] for one in checks][:2] == [(result, {}), (result, {"max_tension": 9e3})]
    assert texts[0] == told[0]
    assert texts[0][0][0] is result
    assert saves == [((result, Path("x.nc")), {})]
    assert pages[0][0][:3] == (result, Path("out"), None)
    (tmp_path / "kept.nc").mkdir()
    assert call(capsys, "run", "standard.toml", "--out", "kept.nc")[1].endswith("written  kept.nc/a.png\n")
    reads, overlays = (
        asked(sb, "read_measured", "recorded"),
        asked(sb.plot, "overlay", SimpleNamespace(savefig=lambda place, dpi: place.write_text(f"{dpi} dots", "utf-8"))),
    )
    looks = asked(_measured, "check_measured", None)
    for options, words in (
        ((), "--measured: is drawn into a figure — give its folder: --out"),
        (("--out", "x.nc"), "--measured: is drawn into a figure — give --out a folder, not x.nc"),
    ):
        code, _, err = call(capsys, "run", "standard.toml", "--measured", "a.csv", *options)
        assert (code, words in err, "1 input error" in err) == (2, True, True)
    code, out, _ = call(capsys, "run", "standard.toml", "--measured", "a.csv", "--measured", "b.csv", "--out", "out")
    assert (code, out) == (0, "stopped: text\nwritten  out/a.png, out/overlay.png\n")
    assert reads == [(("a.csv", "b.csv"), {})]
    assert (looks[0][0][0], overlays[0][0]) == ("recorded", (result, "recorded"))
    assert (tmp_path / "out" / "overlay.png").read_text("utf-8") == "130 dots"
    asked(sb, "simulate", Answer(ok=False))
    assert call(capsys, "run", "standard.toml", *limits, "--fail-on-limit")[0] == 1


def test_options_of_validate(capsys, asked):
    for ok, code in ((True, 0), (False, 1)):
        cases, crosses = asked(sb, "validate", Answer(ok=ok)), asked(sb, "cross_check", Answer(ok=ok))
        assert call(capsys, "validate", "--only", "band")[:2] == (code, "a text\n")
        assert cases == [(("band",), {"progress": None})]
        assert json.loads(call(capsys, "validate", "--json", "--cross-check", "standard.toml", "--list")[1]) == [1]
        assert crosses[0][1] == {
            "method": None,
            "rtol": 1e-10,
            "tolerance": None,
            "max_evaluations": 400_000,
            "progress": None,
        }
        given = ("--method", "Radau", "--rtol", "1e-8", "--allowed", "1e-3", "--max-evaluations", "9")
        assert call(capsys, "validate", "--cross-check", "standard.toml", *given, "--set", "initial.omega=9")[0] == code
        assert [*crosses[1][1].values()] == ["Radau", 1e-8, 1e-3, 9, None]
        assert float(crosses[1][0][0].initial.omega) == 9.0
    rows = json.loads(call(capsys, "validate", "--list", "--json")[1])
    lines = call(capsys, "validate", "--list")[1].splitlines()
    assert lines[0].split() == ["case", "tolerance", "source"]
    assert len(lines) == len(rows) + 1
    assert list(rows[0]) == ["case", "tolerance", "source", "truth"]
    assert lines[1].startswith(f"{rows[0]['case']}  ")
    assert f" {rows[0]['tolerance']:.0e}  {rows[0]['source']}" in lines[1]
