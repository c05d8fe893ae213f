"""`simbrake doctor`: what an installation has, beside what its own packages say."""

import json
import os
import subprocess
import sys
from importlib.metadata import version

import jax
import pytest
from commands import call


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
    assert [note.split(":")[0] for note in found["notes"]] == ["JAX's own cache is on"]
    assert found["xla_flags"] == os.environ.get("XLA_FLAGS", "")


def test_notes_on_caches(capsys, kept, monkeypatch):
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", "")
    found = json.loads(call(capsys, "doctor", "--json")[1])
    assert (found["ok"], found["cache"]["folder"]) == (True, "")
    assert any("SIMBRAKE_CACHE_DIR" in note for note in found["notes"])


def test_time_of_a_run(capsys, kept):
    code, out, _ = call(capsys, "doctor", "--time")
    assert code == 0
    assert kept in out
    assert 0 <= float(out.rsplit("error ", 1)[1]) < 1e-9


def test_installation_that_cannot_compute():
    environment = dict(os.environ, JAX_PLATFORMS="no_such_platform")
    command = [sys.executable, "-m", "simbrake", "doctor"]
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, timeout=120
    )
    assert done.returncode == 1
    assert done.stdout.startswith("simbrake cannot compute here.")
    assert "Traceback" not in done.stderr


def test_files_by_kind_and_their_sizes(capsys, kept, monkeypatch):
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "30")
    for name, size in (
        ("run-1", 2_000_000),
        ("run-2", 150_000),
        ("_energies-34", 40_000),
    ):
        with open(os.path.join(kept, name), "wb") as file:
            file.truncate(size)
    os.remove(os.path.join(kept, "run-12"))
    found = json.loads(call(capsys, "cache", "--json")[1])
    assert found == {
        "folder": kept,
        "programs": 3,
        "bytes": 2_190_000,
        "limit_bytes": 30_000_000,
        "kinds": {
            "run": {"files": 2, "bytes": 2_150_000},
            "energies": {"files": 1, "bytes": 40_000},
        },
        "removed": 0,
    }
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", "")
    for option in ((), ("--clear",)):
        assert call(capsys, "cache", *option)[:2] == (
            0,
            "compiled programs are not cached\n",
        )
    assert json.loads(call(capsys, "cache", "--json", "--clear")[1])["folder"] == ""
