"""`simbrake rig`: a crew's answer first, the ledger in every form, no names, and bad
input with exit code 2."""

import json
import re

import numpy as np
import pytest
from commands import call
from helpers import near
from rig_recordings import witsml, written

T = np.arange(0.0, 400.0, 2.0)
#: 20 m down at 1 m/s, up again, and 10 m down at 0.5 m/s, under 500 kN
HEIGHT = (
    30.0
    - np.clip(T - 40, 0, 20)
    + np.clip(T - 120, 0, 20)
    - np.clip(0.5 * (T - 240), 0, 10)
)
COLUMNS = {"BPOS": ("m", HEIGHT), "HKLD": ("kN", np.full(T.size, 5e5))}
RIG = ("--lines", "8", "--drum-radius", "40 cm", "--efficiency", "0.9")


@pytest.fixture
def log(tmp_path):
    return str(written(tmp_path, "log.xml", witsml(T, COLUMNS)))


def test_the_answer_comes_first(capsys, log, tmp_path):
    code, out, err = call(
        capsys, "rig", log, *RIG, "--auxiliary", "0.75", "--out", str(tmp_path / "duty")
    )
    assert (code, err) == (0, "")
    first = out.splitlines()[0]
    assert {file.suffix for file in (tmp_path / "duty").iterdir()} == {
        ".csv",
        ".html",
        ".json",
        ".png",
        ".txt",
    }
    page = (tmp_path / "duty" / "ledger.html").read_text("utf-8")
    assert (
        re.findall(r"<(?:script|link|iframe)\b|(?:src|href)=\"(?!data:|#)", page) == []
    )
    for words in (
        first[1:],
        "by trip",
        "by day",
        "Assumptions and refusals",
        "spacing",
    ):
        assert words in page


SCENE = """
format = "simbrake scene 1"
end_time = 1
initial = { omega = 0 }
[brake]
pulley = { radius = "590 mm", inertia = "1200 kg*m^2" }
band = { radius = "623 mm" }
linings = { count = 8, wrap = "270 deg", friction = 0.35 }
[duty]
slack_tension = "20 kN"
load = { mass = "60 t", drum_radius = "40 cm", line_count = 8 }
[heat]
rim = "200 kJ/K"
partition = 1
rim_cooling = 0
permissible_rim = "400 degC"
"""


def test_a_log_is_replayed_on_a_scene(capsys, log, tmp_path):
    scene = str(written(tmp_path, "rig.toml", SCENE))
    out = tmp_path / "duty"
    code, said, _ = call(
        capsys, "rig", log, "--scene", scene, "--out", str(out), "--json"
    )
    assert code == 0
    replay = json.loads(said)["replay"]
    assert replay["hottest"] == 1
    assert replay["code"] == 0
    heat = replay["energy"]["friction_heat"]
    near(heat, 15e6, 0.02)  # and what the motor drives the drum down with
    near(replay["metrics"]["peak_rim_temperature"] - 293.15, heat / 200e3, 1e-3)
    near([row["hook_work"] for row in replay["lowerings"]], [10e6, 5e6], 0.01)
    assert json.loads(said)["settings"]["lines"] == 8
    assert "Hottest lowering" in (out / "ledger.html").read_text("utf-8")
    assert {"replay.csv", "replay.png"} <= {file.name for file in out.iterdir()}
    assert (
        (out / "replay.csv").read_text("utf-8").splitlines()[1].endswith(",")
    )  # no flags
    for options, words in (
        (["--set", "duty.load.mass=3"], "--set: has no effect"),
        (["--scene", scene, "--lines", "10"], "8 lines are strung, the log has 10"),
        (["--scene", str(tmp_path / "no.toml"), "--lines", "0"], "no.toml"),
    ):
        code, said, err = call(capsys, "rig", log, *options)
        assert code == 2
        assert words in err


def test_json_and_options(capsys, log, tmp_path):
    names = (
        "--auxiliary",
        "not decidable=0.5",
        "--threshold",
        "travel=15 m",
        "--tare",
        "90 kN:110 kN",
        "--null=-1",
    )
    code, out, _ = call(
        capsys,
        "rig",
        log,
        *RIG,
        *names,
        "--json",
        "--block-mass",
        "30 t",
        "--offset",
        "-0 s",
    )
    assert code == 0
    (row,) = json.loads(out)["lowerings"]
    assert (row["begin"], row["duration"], row["start"]) == (
        40.0,
        20.0,
        "2026-03-01T23:50:40Z",
    )
    assert [row[name] for name in ("travel", "top_speed", "kind", "flags")] == [
        20.0,
        1.0,
        "string",
        [],
    ]
    near(row["mean_load"], 5e5)
    assert row["hook_work_low"] <= row["hook_work"] <= row["hook_work_high"]
    near((row["drum_work"], row["drum_speed"], row["drum_torque"]), (9e6, 20.0, 22.5e3))
    given = ("--lines", "8", "--units", "rig", "--out", str(tmp_path / "field"))
    _, out, _ = call(capsys, "rig", log, *given)
    page = (tmp_path / "field" / "ledger.html").read_text("utf-8")
    assert "klbf" in out
    assert "klbf" in page
    assert not re.search(r"\d (kN|MJ)\b", page)


def test_names_stay_out_unless_asked_for(capsys, tmp_path):
    text = witsml(T, {**COLUMNS, "DRILLER": ("", T)}).replace(
        "<indexType>", "<nameWell>Kraken 7</nameWell><indexType>"
    )
    text = re.sub(r",[\d.]+</data>", ",Jane Roe</data>", text)
    file = str(written(tmp_path, "kraken.xml", text))
    for names in (False, True):
        asked = ["--names"] if names else []
        said = []
        for form in ([], ["--json"]):
            code, out, err = call(
                capsys, "rig", file, "--out", str(tmp_path / "duty"), *form, *asked
            )
            assert code == 0
            said += [out, err]
        said += [
            path.read_text("utf-8")
            for path in (tmp_path / "duty").iterdir()
            if path.suffix != ".png"
        ]
        assert "Jane" not in "".join(said)
        assert ("kraken" in "".join(said).lower()) is names
    assert all(
        "Kraken 7, kraken.xml" in said[i] for i in (2, 4, 5) if "source" in said[i]
    )


@pytest.mark.parametrize(
    ("text", "options", "hint"),
    [
        (witsml(T, COLUMNS).replace("BPOS", "PIT"), "", "has no block position"),
        (witsml(T, {**COLUMNS, "BPOS": ("m", 0.1 * T)}), "", "nothing is lowered"),
        (
            witsml(T, COLUMNS),
            "--lines=-8 --drum-radius 14kg --threshold pauze=3 --tare 300kN "
            "--column load=HKLD --column HKLD",
            "6 input errors",
        ),
        (witsml(T, COLUMNS).replace(",kN<", ",acres<"), "--lines 0", "2 input errors"),
    ],
)
def test_bad_input_ends_with_2_and_writes_nothing(
    capsys, tmp_path, text, options, hint
):
    file = str(written(tmp_path, "log.xml", text))
    out = tmp_path / "duty"
    code, said, err = call(capsys, "rig", file, "--out", str(out), *options.split())
    assert (code, said, hint in err, out.exists()) == (2, "", True, False)
