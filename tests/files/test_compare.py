"""Where a result comes from, running it again, and what differs between two."""

import json
import math
import re
from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from commands import call
from goldens import assert_kept
from result_scenes import heated_stop
from staged_scenes import stop as staged_stop
from stop_scenes import stop_scene

import simbrake as sb


@pytest.fixture(scope="module")
def plain():
    return sb.simulate(stop_scene())


@pytest.fixture(scope="module")
def heated():
    return sb.simulate(heated_stop())


@pytest.fixture(scope="module")
def staged():
    return sb.simulate(staged_stop())


@pytest.fixture(params=["plain", "heated", "staged"])
def result(request):
    return request.getfixturevalue(request.param)


def test_provenance_says_what_ran(plain):
    import getpass
    import platform
    from datetime import datetime

    found = sb.results.provenance(plain)
    text = json.dumps(found, allow_nan=False)
    assert found["simbrake"] == sb.__version__
    assert found["versions"]["jax"] == jax.__version__
    assert found["settings"] == {
        "method": "Dopri8",
        "rtol": 1e-10,
        "max_step": None,
        "max_steps": None,
        "max_events": 10_000,
    }
    assert datetime.fromisoformat(found["date"]).utcoffset().total_seconds() == 0
    numbers = {
        row["path"]: (row["value"], row["unit"]) for row in found["scene"]["numbers"]
    }
    assert numbers["brake.pulley.inertia"] == (800.0, "kg*m^2")
    assert len(numbers) == len(sb.files.leaves(plain.scene))
    assert found["scene"]["parts"]["duty.slack_tension"] == "Constant"
    for secret in (
        platform.node(),
        f'"{getpass.getuser()}"',
        str(Path.home()),
        str(Path.cwd()),
    ):
        assert secret not in text


class OwnLaw(sb.friction.AbstractFriction):
    """A law that no scene file knows."""

    level: Any = eqx.field(converter=np.asarray)

    def kinetic(self, contact):
        return jnp.broadcast_to(self.level, contact.v.shape)

    def static(self, contact):
        return self.kinetic(contact)

    def faults(self, path):
        return []


def test_run_again_to_the_last_bit(tmp_path):
    scene = stop_scene(n=3, T0=30e3)
    first = sb.simulate(
        scene,
        solver=diffrax.Tsit5(),
        rtol=1e-7,
        max_step=0.02,
        max_steps=600,
        max_events=50,
    )
    assert sb.results.provenance(first)["settings"] == {
        "method": "Tsit5",
        "rtol": 1e-7,
        "max_step": 0.02,
        "max_steps": 600,
        "max_events": 50,
    }
    path = sb.save(first, tmp_path / "x.nc")
    # other numbers in the scene given do not matter: those stored count
    again = sb.results.rerun(path, scene=stop_scene(n=3, T0=11e3, f=0.3))
    assert float(again.stopping_time) == float(first.stopping_time)
    assert sb.compare(path, again, rtol=0.0).equal
    with pytest.raises(
        sb.InputError, match=r"brake\.linings\.angle: is of shape \(4,\)"
    ):
        sb.results.rerun(path, scene=stop_scene(n=4))
    with pytest.raises(sb.InputError) as caught:
        sb.results.rerun(path, scene=stop_scene(n=3, lever=sb.ramp(0.0, 1e3, 0.0, 1.0)))
    assert [str(fault).partition(" — ")[0] for fault in caught.value.faults] == [
        "duty.slack_tension: is PiecewiseLinear, in the stored run Constant",
        "duty.slack_tension.level: is absent in the scene given",
        "duty.slack_tension.times: is absent in the stored run",
        "duty.slack_tension.values: is absent in the stored run",
    ]


def test_run_again_from_the_text_alone(result, tmp_path):
    path = sb.save(result, tmp_path / "x.nc")
    again = sb.results.rerun(path)
    assert float(again.stopping_time) == float(result.stopping_time)
    assert sb.compare(path, again, rtol=0.0).equal


def test_custom_law_needs_the_scene(tmp_path):
    scene = stop_scene(n=3, law=OwnLaw(0.3))
    first = sb.simulate(scene)
    path = sb.save(first, tmp_path / "x.nc")
    stored = sb.results.provenance(first)["scene"]
    assert stored["toml"] is None
    assert stored["parts"]["brake.linings.friction"] == f"{__name__}.OwnLaw"
    assert stored["parts"]["brake.linings.friction.level"] == 0.3
    with pytest.raises(sb.InputError, match="scene="):
        sb.results.rerun(path)
    again = sb.results.rerun(path, scene=scene)
    assert float(again.stopping_time) == float(first.stopping_time)


def test_compare_finds_the_changed_number(plain, tmp_path, request):
    stiffer = sb.simulate(
        sb.with_values(
            plain.scene, {"brake.linings.angle[4]": 0.24, "brake.pulley.inertia": 810.0}
        )
    )
    assert_kept(request, "comparison", f"{sb.compare(plain, stiffer, rtol=1e-6)}\n")
    for a, b in (
        (plain, stiffer),
        (sb.save(plain, tmp_path / "a.nc"), sb.save(stiffer, tmp_path / "b.nc")),
    ):
        found = sb.compare(a, b)
        assert not found.equal
        assert {row["name"]: (row["a"], row["b"]) for row in found.scene} == {
            "brake.linings.angle[4]": (float(np.radians(13.5)), 0.24),
            "brake.pulley.inertia": (800.0, 810.0),
        }
        times = rows_of(found.events)
        later = float(stiffer.stopping_time) - float(plain.stopping_time)
        larger = max(float(plain.stopping_time), float(stiffer.stopping_time))
        assert times["stop"] == (
            later,
            pytest.approx(abs(later) / larger, rel=1e-12),
            True,
        )
        assert not times["slip_onset"][2]  # T_0/(C R ω_0) knows neither
        heat, *_ = rows_of(found.energies)["energy.kinetic_change"]
        assert heat == pytest.approx(-0.5 * 10 * 20**2, rel=1e-9)
        moved = {row["name"] for row in found.series if row["differs"]}
        assert "omega" in moved
        assert "slack_tension" not in moved
        assert (
            json.loads(json.dumps(found.as_dict(), allow_nan=False))["equal"] is False
        )


def test_command_compares_files_and_scenes(plain, tmp_path, capsys):
    folder = tmp_path / "out"
    a = sb.save(plain, folder / "result.nc")
    b = sb.save(plain, tmp_path / "b.nc")
    code, out, _ = call(capsys, "compare", str(folder), str(b))
    assert (code, out.startswith("equal")) == (0, True)
    scenes = (Path(__file__).parents[1] / "stop_scenes.py").read_text("utf-8")
    program = scenes + "\n\ndef scene():\n    return stop_scene(w0=21.0)\n"
    (tmp_path / "faster.py").write_text(program, "utf-8")
    code, out, _ = call(
        capsys, "compare", str(a), str(tmp_path / "faster.py"), "--json"
    )
    assert code == 1
    assert [(row["name"], row["a"], row["b"]) for row in json.loads(out)["scene"]] == [
        ("initial.omega", 20.0, 21.0)
    ]
    for wrong in (tmp_path / "no.nc", tmp_path / "x.docx", tmp_path):
        assert call(capsys, "compare", str(wrong), str(b))[0] == 2
    assert call(capsys, "compare", str(a), str(b), "--rtol", "nan")[0] == 2
    with pytest.raises(sb.InputError, match="is not a result"):
        sb.compare(a, 3)
    with pytest.raises(sb.InputError, match="without status"):
        sb.compare(a, sb.dataset(plain).drop_vars("status"))


# --- small data sets by hand --------------------------------------------------------


def by_hand(
    times=(0.0, 1.0, 2.0),
    sides=(0, 0, 0),
    omega=(3.0, 2.0, 1.0),
    *,
    numbers=(),
    parts=(),
    about=(),
    **other,
):
    """A data set with few variables; `other`: replaces them, `None` leaves one out."""

    def over_time(values, unit, *dims):
        return ("time", *dims), np.asarray(values, float), {"units": unit}

    n = len(times)
    variables = {
        "omega": over_time(omega, "rad/s"),
        "load": over_time(np.full((n, 2), 20.0), "N", "lining"),
        "pull": over_time(np.full(n, -60.0), "N"),
        "share": over_time(np.full(n, 4.0), "1"),
        "rim_layer_temperature": over_time(
            np.full((n, 2), 300.0 + len(other)), "K", "layer"
        ),
        "event_time": ("event", np.asarray([0.5, 1.0, 1.5]), {"units": "s"}),
        "event_name": (
            "event",
            np.asarray(["lining_limit", "lining_limit", "stop"]),
            {"units": "1"},
        ),
        "event_lining": ("event", np.asarray([2, 2, 0]), {"units": "1"}),
        "status": ((), "stopped", {"units": "1"}),
        "steps": ((), 10 + len(other), {"units": "1"}),
        "stopping_time": ((), 2.0, {"units": "s"}),
        "max_load": ((), 20.0, {"units": "N"}),
        "max_load_time": ((), 1.0, {"units": "s"}),
        "peak_x_lining": ((), 2, {"units": "1"}),
        "energy.friction_heat": ((), 1000.0, {"units": "J"}),
        "energy.kinetic_change": ((), -2000.0, {"units": "J"}),
        "energy.closure": ((), 0.0, {"units": "1"}),
    }
    variables = {
        name: one for name, one in (variables | other).items() if one is not None
    }
    rows = [
        {"path": path, "value": value, "unit": unit} for path, value, unit in numbers
    ]
    origin = {
        "simbrake": "1.0",
        "versions": {"jax": "0.1"},
        "machine": {"cores": 2},
        "scene": {
            "toml": None,
            "why": "it is none",
            "numbers": rows,
            "parts": dict(parts),
        },
        "settings": {"method": "Dopri8", "rtol": 1e-9},
        "outcome": {
            "accepted": 10,
            "rejected": 1,
            "retaken": 2,
            "segments": 3,
            "message": "x",
        },
    }
    for key, value in about:
        origin[key] = origin[key] | value if isinstance(value, dict) else value
    coords = {
        "time": ("time", np.asarray(times, float), {"units": "s"}),
        "side": ("time", np.asarray(sides, int)),
    }
    coords["lining"] = [1, 2]
    return xr.Dataset(
        variables,
        coords,
        {"format": "simbrake result 1", "provenance": json.dumps(origin)},
    )


def rows_of(changes):
    return {
        row["name"]: (row["absolute"], row["relative"], row["differs"])
        for row in changes
    }


def entries(table):
    return [tuple(row.values()) for row in table]


def test_numbers_are_judged_by_their_size():
    cases = [
        ((2.0, 2.5), (0.5, 0.2, True)),
        ((-2.5, 2.0), (4.5, 1.8, True)),
        ((2.0, 2.0), (0.0, 0.0, False)),
        ((math.inf, math.inf), (0.0, 0.0, False)),
        ((2.0, math.inf), (math.inf, math.inf, True)),
        ((-math.inf, 2.0), (math.inf, math.inf, True)),
    ]
    for (a, b), wanted in cases:
        found = sb.compare(by_hand(), by_hand(x=((), a, {"units": "s"}))).metrics
        assert entries(found)[-1] == ("x", None, a, "s", None, None, True)
        both = (by_hand(x=((), value, {"units": "s"})) for value in (a, b))
        assert rows_of(sb.compare(*both, rtol=0.15).metrics)["x"] == pytest.approx(
            wanted
        )
    assert sb.compare(by_hand(), by_hand()).equal
    left = by_hand(stopping_time=((), 2.0, {"units": "s"}))
    right = by_hand(stopping_time=((), 2.5, {"units": "s"}))
    assert [sb.compare(left, right, rtol=rtol).equal for rtol in (0.19, 0.21)] == [
        False,
        True,
    ]
    for rtol in (-0.1, 1.0, [0.1]):
        with pytest.raises(sb.InputError, match="0 ≤ rtol < 1"):
            sb.compare(left, right, rtol=rtol)


def test_energies_are_judged_by_the_largest():
    changed = {
        "energy.friction_heat": ((), 990.0, {"units": "J"}),
        "energy.closure": ((), 1e-3, {"units": "1"}),
        "energy.shaft_work": ((), 1.0, {"units": "J"}),
        "max_load": ((), 25.0, {"units": "N"}),
        "max_load_time": ((), 2.0, {"units": "s"}),
        "peak_x_lining": ((), 1, {"units": "1"}),
    }
    for a, b, sign in (
        (by_hand(), by_hand(**changed), 1),
        (by_hand(**changed), by_hand(), -1),
    ):
        found = sb.compare(a, b)
        assert rows_of(found.energies) == {
            "energy.friction_heat": (-10.0 * sign, 0.005, True),
            "energy.kinetic_change": (0.0, 0.0, False),
            "energy.closure": (1e-3 * sign, 1e-3, True),
            "energy.shaft_work": (None, None, True),
        }
        assert rows_of(found.metrics) == {
            "stopping_time": (0.0, 0.0, False),
            "max_load": (5.0 * sign, 0.2, True),
            "max_load_time": (sign, 0.5, False),
            "peak_x_lining": (-sign, 0.5, False),
        }
        assert found.energies["unit"] == ["J", "J", "1", "J"]
        assert entries(found.metrics)[0] == (
            "stopping_time",
            2.0,
            2.0,
            "s",
            0.0,
            0.0,
            False,
        )


def test_columns_are_judged_by_their_unit():
    load = np.full((3, 2), 20.0)
    share = np.asarray([4.0, 4.0, 4.5])
    load[1, 1] = 23.0
    changed = {
        "load": (("time", "lining"), load, {"units": "N"}),
        "share": ("time", share, {"units": "1"}),
    }
    found = sb.compare(by_hand(), by_hand(**changed), rtol=0.04)
    assert entries(found.series) == [
        ("omega", "rad/s", 0.0, 0.0, 0.0, "", False),
        ("load", "N", 3.0, 0.05, 1.0, "lining 2", True),
        ("pull", "N", 0.0, 0.0, 0.0, "", False),
        ("share", "1", 0.5, 0.5, 2.0, "", True),
    ]
    assert (found.how, found.judged, found.equal) == (
        "at 3 times that both have",
        True,
        False,
    )
    still = {"pull": ("time", np.zeros(3), {"units": "m"})}
    pull = entries(sb.compare(by_hand(**still), by_hand(**still)).series)[2]
    assert pull == ("pull", "m", 0.0, 0.0, 0.0, "", False)
    for dims, values in (
        (("time", "node"), np.ones((3, 2))),
        (("time", "lining"), np.ones((3, 1))),
    ):
        other = (
            by_hand()
            .drop_vars(["load", "lining"])
            .assign(load=(dims, values, {"units": "N"}))
        )
        assert sb.compare(by_hand(), other).series[1]["place"] == "of another shape"
    lost = {
        row[0]: row
        for row in entries(sb.compare(by_hand(pull=None), by_hand(share=None)).series)
    }
    assert lost["share"] == ("share", "1", None, None, None, "only in a", True)
    assert lost["pull"] == ("pull", "N", None, None, None, "only in b", True)


def test_times_that_both_have():
    """A jump has two values at its time; where few times are in common the series are
    not compared."""
    jump = by_hand((0.0, 1.0, 1.0, 2.0), (0, -1, 1, 0), (0.0, 1.0, 5.0, 3.0))
    other = by_hand((0.5, 1.0, 1.0), (0, -1, 1), (0.0, 1.0, 2.0))
    for a, b in ((jump, other), (other, jump)):
        found = sb.compare(a, b)
        assert (found.how, found.judged) == ("at 2 times that both have", True)
        assert entries(found.series)[0] == ("omega", "rad/s", 3.0, 0.6, 1.0, "", True)
    for times in ((2.5, 3.0, 4.0), (2.0, 3.0, 4.0)):
        apart = sb.compare(by_hand(), by_hand(times))
        count = times.count(2.0)
        assert (len(apart.series), apart.how) == (
            0,
            f"not compared: {count} times that both have",
        )
        assert (apart.judged, apart.equal) == (False, True)


def test_events_are_matched():
    """The second of one lining, those of no lining, and what one of the two alone
    has."""
    b = {
        "event_time": ("event", np.asarray([0.25, 1.25, 1.5, 1.75]), {"units": "s"}),
        "event_name": (
            "event",
            np.asarray(["lining_limit", "restart", "stop", "stop"]),
            {"units": "1"},
        ),
        "event_lining": ("event", np.asarray([2, 0, 0, 0]), {"units": "1"}),
    }
    for left, right, sign in (
        (by_hand(), by_hand(**b), 1),
        (by_hand(**b), by_hand(), -1),
    ):
        found = sb.compare(left, right)
        assert rows_of(found.events) == {
            "lining_limit of lining 2": (-0.25 * sign, 0.5, True),
            "stop": (0.0, 0.0, False),
        }
        alone = {
            1: ["lining_limit of lining 2 (2) at 1 s"],
            -1: ["restart at 1.25 s", "stop (2) at 1.75 s"],
        }
        assert (found.only_a, found.only_b) == (alone[sign], alone[-sign])


def test_numbers_parts_and_versions_differ():
    a = by_hand(
        numbers=[
            ("m", 2.0, "kg"),
            ("x", [[1.0, 2.0], [3.0, 4.0]], "m"),
            ("only", 1.0, "s"),
            ("list", [1.0], "N"),
        ],
        parts=[("", "Scene"), ("law", "Faded"), ("kept", 1)],
    )
    b = by_hand(
        numbers=[
            ("m", 2.5, "kg"),
            ("x", [[1.0, 2.0], [5.0, 4.0]], "m"),
            ("list", [1.0, 2.0], "N"),
            ("new", 3.0, "W"),
        ],
        parts=[("", "Other"), ("kept", 1), ("count", 3)],
        about=[
            ("simbrake", "1.1"),
            ("settings", {"rtol": 1e-8}),
            ("outcome", {"accepted": 12, "segments": 4}),
        ],
    )
    found = sb.compare(a, b)
    assert entries(found.scene) == [
        ("m", 2.0, 2.5, "kg", 0.5, 0.2, True),
        ("x[1,0]", 3.0, 5.0, "m", 2.0, 0.4, True),
        ("only", 1.0, None, "s", None, None, True),
        ("list[1]", None, 2.0, "N", None, None, True),
        ("new", None, 3.0, "W", None, None, True),
    ]
    assert entries(found.parts) == [
        ("scene", "Scene", "Other"),
        ("law", "Faded", None),
        ("count", None, 3),
    ]
    assert entries(found.solver) == [
        ("rtol", 1e-9, 1e-8),
        ("steps accepted", 10, 12),
        ("segments", 3, 4),
    ]
    assert entries(found.versions) == [("simbrake", "1.0", "1.1")]
    assert not sb.compare(by_hand(parts=[("a", 1)]), by_hand(parts=[("a", 2)])).equal


def test_compare_at_times_inside_both(plain):
    later = sb.simulate(sb.with_values(plain.scene, {"initial.time": 0.25}))
    for a, b in ((plain, later), (later, plain)):
        found = sb.compare(a, b)
        assert found.judged
        assert int(re.fullmatch(r"at (\d+) times that both have", found.how)[1]) >= 1001
        (slack,) = [row for row in found.series if row["name"] == "slack_tension"]
        assert slack["time"] == 0.25  # the later one starts open
    for a, b in ((plain, sb.dataset(plain)), (sb.dataset(plain), plain)):
        assert sb.compare(a, b).equal
    batch = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), plain)
    for a, b in ((plain, batch), (batch, plain)):
        with pytest.raises(ValueError, match="outside of jit"):
            sb.compare(a, b)


def test_rerun_needs_provenance(plain):
    data = sb.dataset(plain, [0.0, 1.0])
    for wrong in (data.assign_attrs(provenance="{"), xr.Dataset(), 3):
        with pytest.raises(sb.InputError, match="data set: has no provenance"):
            sb.results.rerun(wrong)
    about = json.loads(data.attrs["provenance"])
    for name in (
        "Euler",
        "Nix",
        "diffeqsolve",
    ):  # no method that adapts its steps, none at all, no class
        about["settings"]["method"] = name
        with pytest.raises(
            sb.InputError, match=rf"settings\.method: {name} cannot be made by its name"
        ):
            sb.results.rerun(data.assign_attrs(provenance=json.dumps(about)))
    with pytest.raises(
        sb.InputError, match=r"is not in the file as text \(it is none\)"
    ):
        sb.results.rerun(by_hand())
