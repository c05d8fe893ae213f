"""`simbrake explain`: what it says of each kind of run, with the numbers in closed form."""

import dataclasses
import json
import math
from types import SimpleNamespace

import pytest
import staged_scenes as staged
from disc_scenes import FRICTION, RATIO, F, N, disc_scene
from disc_scenes import LOAD as DISC_LOAD
from disc_scenes import TORQUE as DISC_TORQUE
from helpers import main
from shoe_scenes import shoe_scene
from stop_scenes import stop_scene
from test_shaft import GAIN
from test_shaft import scene as shaft_scene
from test_verdict import ANGLE, LOAD, PI, STOP, T0, TORQUE, W0, J, R, Z, rigid

import simbrake as sb
from simbrake._base._faults import Fault
from simbrake._run._duty import DutyKind
from simbrake._run._measure import LimitVerdict
from simbrake.results import Judged, VerdictRow, _explain

explain = sb.results.explain


@pytest.fixture(scope="module")
def stop():
    return sb.simulate(rigid())


@pytest.fixture(scope="module")
def told(stop):
    return explain(stop, limits={"stopping_time": 1.02 * STOP})


def test_torque_budget_of_a_stop(told):
    """`M_b = M_load + J α` with constant torques."""
    found = told["balance"].numbers
    assert found["angle"] == pytest.approx(ANGLE, rel=1e-9)
    for name, torque in (("brake", TORQUE), ("load", LOAD), ("inertia", TORQUE - LOAD)):
        assert found[f"{name}_torque"] == pytest.approx(torque, rel=1e-9)
    assert found["others_torque"] == pytest.approx(0.0, abs=1e-6)
    assert found["governs"] == ("load" if LOAD > TORQUE - LOAD else "inertia")
    shares = [100 * LOAD / TORQUE, 100 * (TORQUE - LOAD) / TORQUE]
    assert told["balance"].text == (
        f"Averaged over the {ANGLE:.5g} rad of the stop, the brake gives {TORQUE / 1e3:.5g} kN·m: "
        f"{LOAD / 1e3:.5g} kN·m ({shares[0]:.3g} %) against the load, {(TORQUE - LOAD) / 1e3:.5g} kN·m "
        f"({shares[1]:.3g} %) against the inertia. The inertia governs: the brake mainly takes kinetic energy."
    )


def test_course_limits_linings_and_stability_of_a_stop(told):
    assert told["outcome"].numbers == {"colour": "amber", "status": "stopped", "exceeded": 0}
    assert told["course"].numbers["stopping_time"] == pytest.approx(STOP, rel=1e-9)
    assert f"comes to rest after {STOP:.6g} s and {ANGLE:.6g} rad" in told["course"].text
    most = told["linings"].numbers["max_normal_load"]
    mu = PI ** (1 / 20)
    loads = [T0 * mu**i * (1 + mu) * math.sin(math.radians(13.5) / 2) for i in range(20)]
    assert (most["lining"], most["over_mean"]) == (20, pytest.approx(20 * loads[-1] / sum(loads), rel=1e-9))
    assert told["limits"].text.startswith("Stopping time is nearest its limit: ")
    last = told["linings"].text
    assert last.startswith(f"Lining 20 is the most loaded: {loads[-1] / 1e3:.6g} kN at 0 s, ")
    assert last.endswith(f"{most['over_mean']:.3g} times the mean. Linings count from the slack end, 1 to 20.")
    said = told["stability"].text
    assert f"is lining {told['stability'].numbers['self_locking']['lining']}: f·tan(β/2) = {0.35 * Z:.4g}, " in said
    assert said.startswith("Nearest self-locking at the start is ")
    assert f"margin {1 - 0.35 * Z:.4g}. Under the maximum force of the lever the sliding brake gives at least" in said
    assert f"runaway margin {100 * (TORQUE / LOAD - 1):.4g} %. Held at rest the reserve is at least" in said
    assert not said.endswith("small.")
    stability = told["stability"].numbers
    assert stability["self_locking"]["margin"] == pytest.approx(1 - 0.35 * Z, rel=1e-12)
    assert stability["runaway"]["margin"] == pytest.approx(TORQUE / LOAD - 1, rel=1e-9)
    assert stability["holding_reserve"] == pytest.approx(TORQUE / LOAD, rel=1e-9)


def test_hottest_lining_over_the_mean_is_counted_from_20_degc():
    """Insulated linings that keep their own heat, which is in proportion to `μ^i`."""
    pair = sb.thermal.FrictionHeat(None, "linings", sb.thermal.ConstantPartition(0.0))
    heat = sb.Heat((sb.thermal.Lump("linings", 5e3, count=20),), (), pair, linings="linings")
    found = explain(sb.simulate(dataclasses.replace(rigid(), heat=heat)), influence=False)["linings"]
    hottest, mu = found.numbers["peak_lining_temperature"], PI ** (1 / 20)
    assert hottest["lining"] == 20
    assert hottest["over_mean"] == pytest.approx(20 * mu**19 * (mu - 1) / (PI - 1), rel=1e-8)
    assert ", counted from 20 °C" in found.text


def test_elasticities_of_a_stop(told):
    """`t = J ω_0/(M_b − M_load)` with `M_b = T_0 R_b (Π − 1)`; the friction changes `Π` by `2 n f z Π/(1 − f² z²)`."""
    g = TORQUE / (TORQUE - LOAD)
    by_friction = -g * (2 * 20 * 0.35 * Z / (1 - (0.35 * Z) ** 2)) * PI / (PI - 1)
    found = told["influence"].numbers
    assert found["metric"] == "stopping_time"
    names = list(found["parameters"])
    assert len(names) == 3
    elasticity = {name: row["elasticity"] for name, row in found["parameters"].items()}
    assert elasticity["brake.linings.friction.coefficient"] == pytest.approx(by_friction, rel=1e-7)
    half, h = math.radians(13.5) / 2, 0.35 * Z
    by_angle = -g * (2 * 20 * h / (1 - h**2)) * PI / (PI - 1) * 2 * half / math.sin(2 * half)
    assert elasticity["brake.linings.angle[:]"] == pytest.approx(by_angle, rel=1e-7)
    assert (
        f"1 % more of brake.linings.friction.coefficient (0.35) {by_friction:.3g} %".replace("-", "−")
        in told["influence"].text
    )
    assert told["influence"].text.startswith("What changes the stopping time most: ")
    third = {"brake.band.radius": -g, "duty.slack_tension.values[:]": -g}
    assert elasticity[names[2]] == pytest.approx(third[names[2]], rel=1e-7)


@pytest.mark.parametrize(("released", "longest"), [(0.5, 1), (3.0, 2)])
def test_many_stops(released, longest):
    """A release after the first stop: totals, and the balance of the longer of the two applications alone."""
    again = 2.0 + released
    lever = sb.PiecewiseLinear([0.0, 2.0, 2.0, again, again, 99.0], [T0, T0, 0.0, 0.0, T0, T0])
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 1.0, 2.0, 3.0, 4.0, 99.0], [LOAD] * 6))
    found = explain(stop_scene(C=None, lever=lever, load=load, end=20.0), influence=False)
    second = released * LOAD / (TORQUE - LOAD)
    assert (second > STOP) == (longest == 2)
    assert found["course"].numbers["braking_time"] == pytest.approx(STOP + second, rel=1e-9)
    assert found["course"].numbers["longest"]["stop"] == longest
    assert "influence" not in found
    times = [f"{x:.6g} s" for x in (STOP, second, max(STOP, second))]
    assert found["course"].text.endswith(
        f"and {STOP + second:.6g} s braked. The first takes {times[0]} of braking, the last {times[1]}, "
        f"the longest {times[2]} (stop {longest})."
    )
    assert f" rad of stop {longest}, the longest, from the onset of slip on, the" in found["balance"].text
    balance = found["balance"].numbers
    assert balance["stop"] == longest
    assert balance["brake_torque"] == pytest.approx(TORQUE, rel=1e-9)
    assert balance["load_torque"] == pytest.approx(LOAD, rel=1e-9)
    assert balance["inertia_torque"] == pytest.approx(TORQUE - LOAD, rel=1e-9)


def test_held_load():
    found = explain(rigid(w0=0.0), influence=False)
    assert found["balance"].numbers["capacity"] == pytest.approx(TORQUE, rel=1e-9)
    assert f"{100 * LOAD / TORQUE:.4g} % of its static capacity" in found["balance"].text
    assert "runaway" not in found["stability"].numbers
    assert found["course"].text == "The load is held from the start, for 4 s: nothing moves."
    free = explain(rigid(0.0, w0=0.0), influence=False)["balance"]
    assert (free.text, free.numbers) == ("There is no load to hold.", {})


def test_lowering_under_the_brake_and_at_the_terminal_speed():
    drag = explain(stop_scene(C=None, lever=sb.SpeedHold(T0), load=LOAD, end=3.0), influence=False)
    assert drag["balance"].numbers["load_power"] == pytest.approx(LOAD * W0, rel=1e-9)
    assert drag["balance"].numbers["friction"] == pytest.approx(LOAD * W0, rel=1e-9)
    assert f"up to {LOAD / GAIN / 1e3:.6g} kN of its 8 kN" in drag["balance"].text
    c = 600.0
    steady = explain(shaft_scene(sb.loads.ViscousDrag(c), load=LOAD, w0=LOAD / c), influence=False)
    assert steady["outcome"].text.startswith(f"Lowered at a steady {LOAD / c:.6g} rad/s")
    assert steady["balance"].numbers["other"] == pytest.approx(LOAD**2 / c, rel=1e-9)


def test_runaway_and_failure_say_what_to_do():
    away = explain(rigid(1.25 * TORQUE, end=0.5), influence=False)
    assert away["outcome"].numbers["colour"] == "red"
    assert away["remedy"].numbers["factor"] == pytest.approx(1.25, rel=1e-9)
    assert away["stability"].numbers["runaway"]["margin"] == pytest.approx(-0.2, rel=1e-9)
    assert away["balance"].text == (
        f"At the end the sliding brake gives {TORQUE / 1e3:.6g} kN·m against {1.25 * TORQUE / 1e3:.6g} kN·m of the "
        f"load: {0.25 * TORQUE / 1e3:.6g} kN·m too little."
    )
    assert "sliding brake gives too little" in away["stability"].text
    assert "The load first speeds the pulley up from 20 rad/s to " in away["course"].text
    turning = explain(rigid(end=0.2), influence=False)
    assert turning["balance"].text.endswith(f" of the load: {(TORQUE - LOAD) / 1e3:.6g} kN·m are left to slow it down.")
    speed = W0 - 0.2 * (TORQUE - LOAD) / J
    angle = math.degrees(0.1 * (W0 + speed))
    assert f"At 0.2 s it turns at {speed:.6g} rad/s, after {angle:.6g}°." in turning["course"].text
    assert "remedy" not in turning
    failed = explain(sb.simulate(rigid(), max_steps=2, throw=False))
    assert failed["remedy"].numbers["status"] == "step_limit"
    assert "raise max_steps" in failed["remedy"].text.lower()
    assert all(sentence[:1].isupper() and not sentence[1:2].isupper() for sentence in failed["remedy"].text.split(". "))


def test_disc_shoe_and_staged_brakes():
    disc = explain(disc_scene(), influence=False)
    assert disc["balance"].numbers["brake_torque"] == pytest.approx(DISC_TORQUE, rel=1e-9)
    assert disc["stability"].numbers["holding_reserve"] == pytest.approx(RATIO * DISC_TORQUE / DISC_LOAD, rel=1e-9)
    assert "self_locking" not in disc["stability"].numbers
    assert disc["linings"].text == "All pads are alike, most loaded with 20 kN at 0 s."
    assert pytest.approx(N * FRICTION * F * 0.4) == DISC_TORQUE
    shoe = explain(shoe_scene(), influence=False)
    assert 0 < shoe["stability"].numbers["self_locking"]["margin"] < 1
    assert "the shoes act" in shoe["course"].text.lower()
    assert "the self-locking ratio = " in shoe["stability"].text
    both = explain(staged.stop(), influence=False)
    assert "slide on the rim from" in both["course"].text


def test_lever_and_band_are_told_where_they_count():
    """What brake, load and inertia leave of the balance: an elastic band stores work, its lever moves."""
    found = explain(stop_scene(), influence=False)["balance"]
    torques = found.numbers
    others = torques["brake_torque"] - torques["load_torque"] - torques["inertia_torque"]
    assert torques["others_torque"] == pytest.approx(others, abs=1e-9 * torques["brake_torque"])
    share = 100 * others / torques["brake_torque"]
    assert abs(share) > 0.05
    assert f"({share:.3g} %) from lever, band and shaft. The inertia".replace("-", "−") in found.text


def test_command_explains_scenes_and_results(tmp_path, capsys, stop):
    scene, saved = tmp_path / "stop.toml", tmp_path / "stop.nc"
    sb.write_scene(stop.scene, scene)
    sb.save(stop, saved)
    texts = []
    for file in (scene, saved):
        with pytest.raises(SystemExit) as ended:
            main(["explain", str(file), "--no-influence", "--limit", f"stopping_time={0.9 * STOP}", "--fail-on-limit"])
        assert ended.value.code == 3
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert texts[0].startswith("outcome      Stopped after")
    with pytest.raises(SystemExit):
        main(["explain", str(scene), "--no-influence", "--json"])
    found = json.loads(capsys.readouterr().out)["findings"]
    (tmp_path / "out").mkdir()
    saved.rename(tmp_path / "out" / "result.nc")
    assert str(explain(tmp_path / "out", influence=False)) == str(explain(stop, influence=False))
    assert [one["topic"] for one in found] == ["outcome", "course", "balance", "linings", "limits", "stability"]


def test_inertia_governs_without_a_load():
    found = explain(rigid(0.0), influence=False)
    assert found["balance"].numbers["governs"] == "inertia"
    assert found["balance"].numbers["inertia_work"] == pytest.approx(J * W0**2 / 2, rel=1e-9)
    assert pytest.approx(found["balance"].numbers["brake_torque"], rel=1e-9) == R * T0 * (PI - 1)


def test_a_load_that_breaks_away_turns_again_and_a_small_reserve_is_said():
    torn = explain(rigid((LOAD, LOAD, 1.01 * TORQUE, 1.01 * TORQUE), w0=1.0, end=2.5), influence=False)
    course = torn["course"].text
    assert "It turns again from 2 s on. At 2.5 s it turns at " in course
    assert explain(rigid(TORQUE / 1.2, w0=1.0), influence=False)["stability"].text.endswith(", below 1.25: small.")


@pytest.mark.parametrize("end", [4.0, 0.5])
def test_travel_of_the_hook(end):
    """`x = φ r/n` in the first layer."""
    hook = sb.HookLoad(mass=2e4, drum_radius=0.4, line_count=8)
    load = 2e4 * 9.80665 * 0.4 / 8
    rate = (TORQUE - load) / (J + 2e4 * (0.4 / 8) ** 2)
    stop = W0 / rate
    angle = W0 * stop / 2 if end > stop else W0 * end - rate * end**2 / 2
    found = explain(stop_scene(C=None, lever=sb.Constant(T0), load=hook, end=end), influence=False)["course"].text
    assert found.endswith(f" {angle:.6g} rad, hook travel {angle * 0.4 / 8:.6g} m.")
    assert ("comes to rest" in found) == (end > stop)


# --- findings by hand -------------------------------------------------------------------------------------------------


def told_of(*, ok=True, worn=None, metrics=None, words=sb.Brake.words, pairs=("external",), banded=True, **summary):
    """A result as far as explanations look at it."""
    found = {"at": {}, "metrics": metrics or {}, "capacity": None, "worn_thickness": worn, **summary}
    brake = SimpleNamespace(words=words, pairs=dict.fromkeys(pairs), banded=banded, linings=SimpleNamespace(count=3))
    report = SimpleNamespace(summary=found)
    return SimpleNamespace(
        ok=ok, rtol=1e-9, metrics=found["metrics"], scene=SimpleNamespace(brake=brake), report=lambda: report
    )


def test_text_of_an_explanation():
    findings = _explain.Finding("outcome", "word " * 40, {}), _explain.Finding("course", "It stands.", {})
    lines = str(_explain.Explanation(findings)).splitlines()
    assert lines[0] == "outcome      " + " ".join(["word"] * 19)
    assert lines[1] == " " * 13 + " ".join(["word"] * 19)
    assert lines[-1] == "course       It stands."
    with pytest.raises(KeyError, match="no topic 'x'; there are: outcome, course"):
        _explain.Explanation(findings)["x"]


def test_the_weaker_pair_is_named():
    capacity = {"load_torque": 3e3, "brake_torque": 4e3, "pairs": [5e3, 4e3]}
    (found,) = _explain._balance(told_of(duty="turning", capacity=capacity, pairs=("external", "internal")))
    assert found.text == (
        "At the end the sliding brake gives 4 kN·m, limited by its internal pair against 3 kN·m of the load: "
        "1 kN·m are left to slow it down."
    )
    assert found.numbers == {"brake_torque": 4e3, "load_torque": 3e3}
    (found,) = _explain._balance(told_of(duty="turning", capacity=capacity))
    assert "limited" not in found.text
    assert _explain._balance(told_of(duty="failed")) == []
    assert _explain._balance(told_of(duty="turning", capacity=capacity | {"brake_torque": 0.0})) == []


def test_wear_of_the_linings():
    (found,) = _explain._linings(told_of(worn=[1e-6, 3e-6, 2e-6]))
    count = " Linings count from the slack end, 1 to 3."
    assert found.text == f"Lining 2 wears the most: 3 µm, 1.5 times the mean.{count}"
    assert found.numbers == {"greatest_wear": {"lining": 2, "value": 3e-6, "over_mean": pytest.approx(1.5)}}
    pads = sb.brakes.DiscBrake.words
    (found,) = _explain._linings(told_of(worn=[3e-6] * 3, words=pads, banded=False))
    assert found.text == "All pads wear alike, by 3 µm."
    assert _explain._linings(told_of(worn=[0.0] * 3)) == []


def test_limits_in_words():
    names = {"a": LimitVerdict.EXCEEDED, "b": LimitVerdict.EXCEEDED, "c": LimitVerdict.EXCEEDED}
    names |= {"d": LimitVerdict.SMALL, "e": LimitVerdict.WITHIN, "f": LimitVerdict.NOT_EVALUATED}
    rows = {name: VerdictRow(f"Force {name}", f"{name} N", f"≤ {name} kN", f"{name} %", x) for name, x in names.items()}

    covered = Judged(3, 3, {}, ())

    def told_of_rows(names):
        (found,) = _explain._limits([rows[name] for name in names], covered)
        return found.text

    first = "Force a is exceeded: a N, allowed ≤ a kN, margin a %."
    assert told_of_rows("abc") == f"{first} Exceeded as well: Force b, Force c."
    assert told_of_rows("ade") == f"{first} Next: Force d d N, allowed ≤ d kN, margin d %."
    assert told_of_rows("fdf") == "Force d is nearest its limit: d N, allowed ≤ d kN, margin d %."
    assert told_of_rows("f").startswith("No limit was given")
    (found,) = _explain._limits([rows["a"]], covered)
    assert found.numbers == {"rows": [{**rows["a"]._asdict(), "state": "exceeded"}]}


def test_the_number_that_matters_in_each_duty():
    hot, rim, reserve = "peak_lining_temperature", "peak_rim_temperature", "min_holding_reserve"
    capacity = {"load_torque": 3.0, "brake_torque": 4.0}
    cases = [
        ((DutyKind.STOP, [hot], None), "stopping_time"),
        ((DutyKind.STOPS, [hot, rim], None), hot),
        ((DutyKind.STOPS, [rim], None), rim),
        ((DutyKind.STOPS, [], None), "stopping_time"),
        ((DutyKind.HOLD, [reserve], None), reserve),
        ((DutyKind.HOLD, [], None), "energy.friction_heat"),
        ((DutyKind.DRAG, [rim], None), rim),
        ((DutyKind.DRAG, ["max_tension"], None), "max_tension"),
        ((DutyKind.DRAG, [], None), "max_normal_load"),
        ((DutyKind.STEADY, [], None), "terminal_speed"),
        ((DutyKind.TURNING, [], capacity), _explain.torque_over_load),
        ((DutyKind.RUNAWAY, [], capacity), _explain.torque_over_load),
        ((DutyKind.TURNING, [], None), "energy.friction_heat"),
        ((DutyKind.TURNING, [], capacity | {"load_torque": 0.0}), "energy.friction_heat"),
        ((DutyKind.TURNING, [], capacity | {"brake_torque": 0.0}), "energy.friction_heat"),
    ]
    for (duty, names, capacity), wanted in cases:
        result = told_of(duty=duty, metrics=dict.fromkeys(names, 1.0), capacity=capacity)
        assert _explain._subject(result) == wanted


def test_what_changes_a_run_most(monkeypatch):
    """One percent of a parameter, one kelvin of a temperature; what nobody can change is left out."""

    def row(path, value, unit, elasticity, derivative, note=""):
        numbers = {"value": value, "elasticity": elasticity, "derivative": derivative}
        return SimpleNamespace(path=path, unit=unit, note=note, **numbers)

    rows = [
        row("x.gravity", 9.8, "m/s^2", 9.0, 9.0),
        row("m", 50.0, "kg", 0.5, 0.04),
        row("T", 300.0, "K", 3.0, -0.2),
        row("f", 0.4, "1", -3.0, -30.0),
        row("none", 0.0, "N", 7.0, 1.0),
        row("odd", 1.0, "N", math.nan, 1.0),
        row("r", 2.0, "m", 1.0, 2.0, "one-sided: 2 below, 3 above"),
    ]
    table = SimpleNamespace(value=4.0, matters=rows)
    monkeypatch.setattr(_explain, "sensitivities", lambda *_, **__: table)
    (found,) = _explain._influence(told_of(duty=DutyKind.STOP), None)
    assert found.text == (
        "What changes the stopping time most: 1 K more of T (26.85 °C) −5 %; "
        "1 % more of f (0.4) −3 %; 1 % more of r (2 m) 1 % (one-sided derivative)."
    )
    assert found.numbers["metric"] == "stopping_time"
    assert found.numbers["parameters"]["f"] == {"elasticity": -3.0, "derivative": -30.0, "value": 0.4}
    hot = told_of(duty=DutyKind.STOPS, metrics={"peak_rim_temperature": 400.0})
    table.value, table.matters = 400.0, rows[1:2]
    assert _explain._influence(hot, None)[0].text.endswith("1 % more of m (50 kg) 2 K.")
    table.matters = rows[:1]
    capacity = {"load_torque": 3.0, "brake_torque": 4.0}
    (found,) = _explain._influence(told_of(duty=DutyKind.TURNING, capacity=capacity), None)
    assert found.text == "No parameter changes the torque of the sliding brake over the load."

    def refused(*_, **__):
        raise sb.InputError([Fault("a", "has none", "x"), Fault("b", "neither", "x")])

    monkeypatch.setattr(_explain, "sensitivities", refused)
    assert _explain._influence(told_of(duty=DutyKind.STOP), None)[0].text == "No derivative: has none."


def test_a_brake_that_locks_itself_is_said(monkeypatch, stop):
    for margin, begins in ((0.25, "Nearest self-locking at the start is lining 4"), (0.0, "Locks itself: lining 4")):
        lock = SimpleNamespace(lining=4, ratio=1 - margin, margin=margin)
        monkeypatch.setattr(_explain, "nearest_locking", lambda _, lock=lock: lock)
        (found,) = _explain._stability(stop)
        assert found.text.startswith(f"{begins}: f·tan(β/2) = {1 - margin:g}, margin {margin:g}.")
    none = SimpleNamespace(lining=1, ratio=0.0, margin=1.0)
    monkeypatch.setattr(_explain, "nearest_locking", lambda _: none)
    assert list(_explain._stability(stop)[0].numbers) == ["runaway", "holding_reserve"]
