"""Where a result comes from, running it again, and what differs between two."""

import getpass
import json
import math
import platform
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
from helpers import input_error, near
from result_scenes import heated_stop
from scenes import stop_run, stop_scene
from staged_scenes import stop as staged_stop

import simbrake as sb


@pytest.fixture(scope="module")
def plain():
    return stop_run()


# --- provenance and running again ---------------------------------------------------


def test_provenance_says_what_ran(plain):
    found = sb.results.provenance(plain)
    text = json.dumps(found, allow_nan=False)
    assert found["simbrake"] == sb.__version__
    assert found["versions"]["jax"] == jax.__version__
    numbers = {
        row["path"]: (row["value"], row["unit"]) for row in found["scene"]["numbers"]
    }
    assert numbers["brake.pulley.inertia"] == (800.0, "kg*m^2")
    assert len(numbers) == len(sb.files.leaves(plain.scene))
    home = (str(Path.home()), str(Path.cwd()))
    for secret in (platform.node(), f'"{getpass.getuser()}"', *home):
        assert secret not in text


def test_run_again_to_the_last_bit(tmp_path):
    """With the settings of the file, also in another scene of the same structure."""
    settings = {"rtol": 1e-7, "max_step": 0.02, "max_steps": 600, "max_events": 50}
    scene = stop_scene(n=3, T0=3e4)
    first = sb.simulate(scene, solver=diffrax.Tsit5(), **settings)
    told = sb.results.provenance(first)["settings"]
    assert told == {"method": "Tsit5"} | settings
    path = sb.save(first, tmp_path / "x.nc")
    again = sb.results.rerun(path, scene=stop_scene(n=3, T0=11e3, f=0.3))
    assert float(again.stopping_time) == float(first.stopping_time)
    assert sb.compare(path, again, rtol=0.0).equal
    for other in (stop_scene(n=4), stop_scene(n=3, lever=sb.ramp(0.0, 1e3, 0.0, 1.0))):
        with input_error(match="stored run"):
            sb.results.rerun(path, scene=other)


@pytest.mark.parametrize("scene", [stop_scene, heated_stop, staged_stop])
def test_run_again_from_the_text_alone(scene, tmp_path):
    result = sb.simulate(scene())
    path = sb.save(result, tmp_path / "x.nc")
    again = sb.results.rerun(path)
    assert float(again.stopping_time) == float(result.stopping_time)
    assert sb.compare(path, again, rtol=0.0).equal


class OwnLaw(sb.friction.AbstractFriction):
    """A law that no scene file knows."""

    level: Any = eqx.field(converter=np.asarray)

    def kinetic(self, contact):
        return jnp.broadcast_to(self.level, contact.v.shape)

    def static(self, contact):
        return self.kinetic(contact)

    def faults(self, path):
        return []


def test_a_law_of_ones_own_needs_the_scene(tmp_path):
    scene = stop_scene(n=3, law=OwnLaw(0.3))
    first = sb.simulate(scene)
    path = sb.save(first, tmp_path / "x.nc")
    parts = sb.results.provenance(first)["scene"]["parts"]
    assert parts["brake.linings.friction"] == f"{__name__}.OwnLaw"
    with input_error(match="scene="):
        sb.results.rerun(path)
    again = sb.results.rerun(path, scene=scene)
    assert float(again.stopping_time) == float(first.stopping_time)


def test_rerun_needs_provenance(plain):
    data = sb.dataset(plain, [0.0, 1.0])
    about = json.loads(data.attrs["provenance"])
    about["settings"]["method"] = "Euler"
    wrong = data.assign_attrs(provenance=json.dumps(about))
    for given in (data.assign_attrs(provenance="{"), xr.Dataset(), 3, wrong):
        with input_error():
            sb.results.rerun(given)


# --- comparing ----------------------------------------------------------------------


def rows_of(changes):
    """Name → absolute and relative difference, whether it differs."""
    return {
        row["name"]: (row["absolute"], row["relative"], row["differs"])
        for row in changes
    }


def test_compare_finds_the_changed_numbers(plain, tmp_path, request):
    """In memory as in files; the difference of stopping times over the larger."""
    changes = {"brake.linings.angle[4]": 0.24, "brake.pulley.inertia": 810.0}
    other = sb.simulate(sb.with_values(plain.scene, changes))
    assert_kept(request, "comparison", f"{sb.compare(plain, other, rtol=1e-6)}\n")
    files = (sb.save(x, tmp_path / f"{i}.nc") for i, x in enumerate((plain, other)))
    for a, b in ((plain, other), (*files,)):
        found = sb.compare(a, b)
        assert not found.equal
        told = {row["name"]: (row["a"], row["b"]) for row in found.scene}
        assert told == {
            "brake.linings.angle[4]": (float(np.radians(13.5)), 0.24),
            "brake.pulley.inertia": (800.0, 810.0),
        }
        times = rows_of(found.events)
        early, late = (float(run.stopping_time) for run in (plain, other))
        relative = pytest.approx((late - early) / late, rel=1e-12)
        assert times["stop"] == (late - early, relative, True)
        assert not times["slip_onset"][2]
        change, *_ = rows_of(found.energies)["energy.kinetic_change"]
        near(change, -0.5 * 10 * 20**2, 1e-9)
        moved = {row["name"] for row in found.series if row["differs"]}
        assert "omega" in moved
        assert "slack_tension" not in moved


#: what a run counts
COUNTS = ("accepted", "rejected", "retaken", "segments")


def by_hand(times=(0.0, 1.0, 2.0), sides=(0, 0, 0), omega=(3.0, 2.0, 1.0), **other):
    """A data set with few variables; `other`: name → unit and value instead."""
    n = len(times)
    given = {
        "omega": ("rad/s", omega),
        "load": ("N", np.full((n, 2), 20.0)),
        "event_time": ("s", [0.5, 1.0, 1.5]),
        "event_name": ("1", ["lining_limit", "lining_limit", "stop"]),
        "event_lining": ("1", [2, 2, 0]),
        "status": ("1", "stopped"),
        "stopping_time": ("s", 2.0),
        "energy.friction_heat": ("J", 1000.0),
        "energy.kinetic_change": ("J", -2000.0),
        "energy.closure": ("1", 0.0),
    }
    dims = {"omega": ("time",), "load": ("time", "lining")}
    variables = {
        name: (
            dims.get(name, ("event",) if name.startswith("event_") else ()),
            np.asarray(value),
            {"units": unit},
        )
        for name, (unit, value) in (given | other).items()
    }
    scene = {"toml": None, "why": "it is none", "numbers": [], "parts": {}}
    origin = {"simbrake": "1.0", "versions": {}, "machine": {}, "scene": scene}
    origin |= {
        "settings": {"method": "Dopri8", "rtol": 1e-9},
        "outcome": dict.fromkeys(COUNTS, 1),
    }
    coords = {"time": ("time", np.asarray(times, float), {"units": "s"})}
    coords |= {"side": ("time", np.asarray(sides)), "lining": [1, 2]}
    about = {"format": "simbrake result 1", "provenance": json.dumps(origin)}
    return xr.Dataset(variables, coords, about)


@pytest.mark.parametrize(
    ("a", "b", "wanted"),
    [
        (2.0, 2.5, (0.5, 0.2, True)),
        (-2.5, 2.0, (4.5, 1.8, True)),
        (2.0, 2.2, (0.2, 0.2 / 2.2, False)),
        (math.inf, math.inf, (0.0, 0.0, False)),
        (2.0, math.inf, (math.inf, math.inf, True)),
    ],
)
def test_numbers_are_judged_by_the_larger(a, b, wanted):
    left, right = (by_hand(stopping_time=("s", x)) for x in (a, b))
    found = rows_of(sb.compare(left, right, rtol=0.15).metrics)["stopping_time"]
    near(found, wanted)
    with input_error(match="rtol"):
        sb.compare(left, right, rtol=1.0)


def test_energies_and_columns_are_judged_by_the_largest():
    """An energy by the largest energy, a column of newtons by the largest of these."""
    load = np.full((3, 2), 20.0)
    load[1, 1] = 23.0
    changed = {"energy.friction_heat": ("J", 990.0), "load": ("N", load)}
    found = sb.compare(by_hand(), by_hand(**changed), rtol=0.1)
    energies = rows_of(found.energies)
    assert energies["energy.friction_heat"] == (-10.0, 0.005, False)
    (row,) = [row for row in found.series if row["name"] == "load"]
    assert (row["absolute"], row["relative"]) == (3.0, pytest.approx(3 / 23))
    assert (row["time"], row["place"], row["differs"]) == (1.0, "lining 2", True)
    assert not found.equal
    assert sb.compare(by_hand(), by_hand(), rtol=0.0).equal


def test_times_that_both_have():
    """A jump has two values at its time; without common times nothing is judged."""
    jump = by_hand((0.0, 1.0, 1.0, 2.0), (0, -1, 1, 0), (0.0, 1.0, 5.0, 3.0))
    other = by_hand((0.5, 1.0, 1.0), (0, -1, 1), (0.0, 1.0, 2.0))
    for a, b in ((jump, other), (other, jump)):
        found = sb.compare(a, b)
        assert found.judged
        assert (found.series[0]["absolute"], found.series[0]["time"]) == (3.0, 1.0)
    apart = sb.compare(by_hand(), by_hand((2.5, 3.0, 4.0)))
    assert (len(apart.series), apart.judged) == (0, False)


def test_events_are_matched():
    """The second of a lining with the second, and what only one of the two has."""
    b = by_hand(
        event_time=("s", [0.25, 1.25, 1.5]),
        event_name=("1", ["lining_limit", "restart", "stop"]),
        event_lining=("1", [2, 0, 0]),
    )
    found = sb.compare(by_hand(), b)
    times = rows_of(found.events)
    assert times["lining_limit of lining 2"] == (-0.25, 0.5, True)
    assert times["stop"] == (0.0, 0.0, False)
    assert found.only_a == ["lining_limit of lining 2 (2) at 1 s"]
    assert found.only_b == ["restart at 1.25 s"]


def test_command_compares_files_and_scenes(plain, tmp_path, capsys):
    a = sb.save(plain, tmp_path / "out" / "result.nc")
    sb.write_scene(stop_scene(w0=21.0), tmp_path / "faster.toml")
    assert call(capsys, "compare", str(a.parent), str(a))[0] == 0
    code, out, _ = call(
        capsys, "compare", str(a), str(tmp_path / "faster.toml"), "--json"
    )
    (row,) = json.loads(out)["scene"]
    assert (code, row["name"], row["a"], row["b"]) == (1, "initial.omega", 20.0, 21.0)
    for wrong in (tmp_path / "no.nc", tmp_path / "x.docx", tmp_path):
        assert call(capsys, "compare", str(wrong), str(a))[0] == 2
