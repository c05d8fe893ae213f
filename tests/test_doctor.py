"""`simbrake doctor`: what an installation has, beside what its own packages say."""

import json
import os
import subprocess
import sys
from importlib.metadata import version

import jax
import pytest
from test_cli import call

from simbrake._base._compiling import WORTH, accelerators


@pytest.fixture
def kept(monkeypatch, tmp_path):
    """A folder of kept programs with two files in it."""
    folder = tmp_path / "programs"
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(folder))
    folder.mkdir(mode=0o700)
    (folder / "run-12").write_bytes(b"12345")
    (folder / "_energies-34").write_bytes(b"678")
    return str(folder)


def test_numbers_of_the_installation(capsys, kept):
    code, out, _ = call(capsys, "doctor", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["ok"] is True
    for name in ("simbrake", "jax", "numpy"):
        assert found["versions"][name] == version(name)
    assert found["devices"]["single_runs"] == str(jax.local_devices(backend="cpu")[0])
    assert found["cache"]["folder"] == kept
    assert found["cache"]["programs"] >= 2
    in_force = {row["name"]: row["in_force"] for row in found["accelerators"]}
    assert in_force == {name: name not in accelerators("cpu").refused for name in WORTH}
    assert found["xla_flags"] == os.environ.get("XLA_FLAGS", "")


def test_report_says_what_is_refused_and_what_a_run_takes(capsys, kept, monkeypatch):
    usual = accelerators("cpu")
    lacking = usual._replace(refused=("xla_backend_optimization_level",))
    monkeypatch.setattr("simbrake._base._compiling.accelerators", lambda platform: lacking)
    code, out, _ = call(capsys, "doctor", "--time")
    assert code == 0
    assert out.startswith("simbrake can compute here.\n  note: XLA refuses xla_backend_optimization_level:")
    assert f"programs      {kept} (" in out
    (row,) = (line for line in out.splitlines() if line.strip().startswith("xla_backend_optimization_level"))
    assert "refused" in row
    assert WORTH["xla_backend_optimization_level"] in row
    assert float(out.rsplit("error ", 1)[1]) < 1e-9


def test_an_installation_that_cannot_compute_is_told_in_words():
    environment = dict(os.environ, JAX_PLATFORMS="no_such_platform")
    command = [sys.executable, "-m", "simbrake", "doctor"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 1
    assert done.stdout.startswith("simbrake cannot compute here.")
    assert "JAX_PLATFORMS is no_such_platform" in done.stdout
    assert "Traceback" not in done.stderr
