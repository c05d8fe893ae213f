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
from helpers import stop_scene
from result_scenes import SUFFIXES, heated_stop
from staged_scenes import stop as staged_stop

import simbrake as sb
from simbrake._commands._runs import compare as compare_run


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


def test_provenance_says_what_ran_and_not_who(plain):
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
    numbers = {row["path"]: (row["value"], row["unit"]) for row in found["scene"]["numbers"]}
    assert numbers["brake.pulley.inertia"] == (800.0, "kg*m^2")
    assert len(numbers) == len(sb.files.leaves(plain.scene))
    assert found["scene"]["parts"]["duty.slack_tension"] == "Constant"
    for secret in (platform.node(), f'"{getpass.getuser()}"', str(Path.home()), str(Path.cwd())):
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
    first = sb.simulate(scene, solver=diffrax.Tsit5(), rtol=1e-7, max_step=0.02, max_steps=600, max_events=50)
    assert sb.results.provenance(first)["settings"] == {
        "method": "Tsit5",
        "rtol": 1e-7,
        "max_step": 0.02,
        "max_steps": 600,
        "max_events": 50,
    }
    for suffix in SUFFIXES:
        path = sb.save(first, tmp_path / f"x{suffix}")
        # other numbers in the scene given do not matter: those stored count
        again = sb.results.rerun(path, scene=stop_scene(n=3, T0=11e3, f=0.3))
        assert float(again.stopping_time) == float(first.stopping_time)
        assert sb.compare(path, again, rtol=0.0).equal
    with pytest.raises(sb.InputError, match=r"brake\.linings\.angle: is of shape \(4,\)"):
        sb.results.rerun(path, scene=stop_scene(n=4))
    with pytest.raises(sb.InputError, match=r"duty\.slack_tension: is PiecewiseLinear, in the stored run Constant"):
        sb.results.rerun(path, scene=stop_scene(n=3, lever=sb.ramp(0.0, 1e3, 0.0, 1.0)))


def test_run_again_from_the_text_alone(result, tmp_path):
    path = sb.save(result, tmp_path / "x.nc")
    again = sb.results.rerun(path)
    assert float(again.stopping_time) == float(result.stopping_time)
    assert sb.compare(path, again, rtol=0.0).equal


def test_a_law_of_ones_own_needs_the_scene(tmp_path):
    scene = stop_scene(n=3, law=OwnLaw(0.3))
    first = sb.simulate(scene)
    path = sb.save(first, tmp_path / "x.csv")
    stored = sb.results.provenance(first)["scene"]
    assert stored["toml"] is None
    assert stored["parts"]["brake.linings.friction"] == f"{__name__}.OwnLaw"
    assert stored["parts"]["brake.linings.friction.level"] == 0.3
    with pytest.raises(sb.InputError, match="scene="):
        sb.results.rerun(path)
    again = sb.results.rerun(path, scene=scene)
    assert float(again.stopping_time) == float(first.stopping_time)


def test_compare_finds_the_number_that_was_changed(plain, tmp_path):
    stiffer = sb.simulate(sb.with_values(plain.scene, {"brake.linings.angle[4]": 0.24, "brake.pulley.inertia": 810.0}))
    for a, b in ((plain, stiffer), (sb.save(plain, tmp_path / "a.nc"), sb.save(stiffer, tmp_path / "b.csv"))):
        found = sb.compare(a, b)
        assert not found.equal
        assert {row.name: (row.a, row.b) for row in found.scene} == {
            "brake.linings.angle[4]": (float(np.radians(13.5)), 0.24),
            "brake.pulley.inertia": (800.0, 810.0),
        }
        times = {row.name: row for row in found.events}
        stop = times["stop"]
        assert stop.absolute == float(stiffer.stopping_time) - float(plain.stopping_time)
        larger = max(float(plain.stopping_time), float(stiffer.stopping_time))
        assert stop.relative == pytest.approx(abs(stop.absolute) / larger, rel=1e-12)
        assert not times["slip_onset"].differs  # T_0/(C R ω_0) knows neither
        heat = next(row for row in found.energies if row.name == "energy.kinetic_change")
        assert heat.absolute == pytest.approx(-0.5 * 10 * 20**2, rel=1e-9)
        moved = {row.name for row in found.series if row.differs}
        assert "omega" in moved
        assert "slack_tension" not in moved
        text = str(found)
        assert re.search(r"brake\.pulley\.inertia +800 +810 +kg·m² +\+10 ", text)
        assert "stop  " in text
        assert json.loads(json.dumps(found.as_dict(), allow_nan=False))["equal"] is False


def test_greatest_difference_of_a_series_is_where_it_is(plain, tmp_path):
    data = sb.dataset(plain)
    other = data.copy(deep=True)
    other["normal_load"][500, 6] += 3.0
    found = sb.compare(data, other)
    (row,) = [row for row in found.series if row.differs]
    assert (row.name, row.place, row.time) == ("normal_load", "lining 7", float(data["time"][500]))
    assert row.absolute == pytest.approx(3.0, rel=1e-9)
    force = max(
        float(np.abs(data[name]).max()) for name in ("tension", "tight_tension", "normal_load", "friction_force")
    )
    assert row.relative == pytest.approx(3.0 / force, rel=1e-9)
    assert sb.compare(data, other, rtol=1.1 * row.relative).equal


def test_series_at_other_times_are_interpolated_and_not_judged(plain):
    found = sb.compare(sb.dataset(plain, np.linspace(0.0, 5.0, 400)), sb.dataset(plain, np.linspace(0.1, 4.9, 333)))
    assert found.how.startswith("interpolated")
    assert found.equal
    phi = next(row for row in found.series if row.name == "phi")
    # between two times h apart a straight line is off by h² |φ''|/8 at most, here in both
    slowing = max(
        abs(np.diff(sb.dataset(plain)["omega"].values) / np.diff(sb.dataset(plain)["time"].values).clip(1e-3))
    )
    assert 0 < phi.absolute <= (0.0126**2 + 0.0151**2) / 8 * slowing


def test_compare_of_other_events_parts_and_times(plain):
    other = sb.simulate(stop_scene(end=0.5, lever=sb.ramp(0.0, 8e3, 0.0, 0.1)))
    found = sb.compare(plain, other)
    assert found.status.a == "stopped"
    assert found.status.b == "not_stopped"
    # both are evaluated at the same times, up to the earlier end
    assert found.how.startswith("at ")
    assert found.how.endswith(" times that both have")
    assert any(name.startswith("stop at") for name in found.only_a)
    assert ("duty.slack_tension", "Constant", "PiecewiseLinear") in found.parts
    stopping = next(row for row in found.metrics if row.name == "stopping_time")
    assert stopping.b == math.inf
    assert stopping.differs
    assert next(row for row in found.as_dict()["metrics"] if row["name"] == "stopping_time")["b"] is None
    assert "duty.slack_tension.level" in {row.name for row in found.scene if row.b is None}
    assert "status   stopped → not_stopped" in str(found)


def test_the_command_compares_files_folders_and_scenes(plain, tmp_path, capsys):
    folder = tmp_path / "out"
    a, b = sb.save(plain, folder / "result.nc"), sb.save(plain, tmp_path / "b.parquet")
    assert compare_run(folder, b) == 0
    assert capsys.readouterr().out.startswith("equal: relative tolerance 1e-09")
    program = (
        Path(__file__).with_name("helpers.py").read_text("utf-8") + "\n\ndef scene():\n    return stop_scene(w0=21.0)\n"
    )
    (tmp_path / "faster.py").write_text(program, "utf-8")
    assert compare_run(a, tmp_path / "faster.py", json_=True) == 1
    found = json.loads(capsys.readouterr().out)
    assert [(row["name"], row["a"], row["b"]) for row in found["scene"]] == [("initial.omega", 20.0, 21.0)]
    for wrong in (tmp_path / "no.nc", tmp_path / "x.docx", tmp_path):
        with pytest.raises(sb.InputError):
            compare_run(wrong, b)
    with pytest.raises(sb.InputError, match="rtol"):
        compare_run(a, b, rtol=math.nan)
    with pytest.raises(sb.InputError, match="is not a result"):
        sb.compare(a, 3)
    with pytest.raises(sb.InputError, match="without status"):
        sb.compare(a, sb.dataset(plain).drop_vars("status"))


def test_the_example_of_the_docs_runs(scenarios, tmp_path, monkeypatch, capsys):
    text = (scenarios.parent / "docs" / "results.md").read_text("utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.S)
    (tmp_path / "scenarios").symlink_to(scenarios)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "results.md", "exec"), {})
    assert re.search(r"duty\.load\.mass +60000 +50000 +kg ", capsys.readouterr().out)
