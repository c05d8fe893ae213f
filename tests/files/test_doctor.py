"""`simbrake doctor`: what an installation has, beside what its own packages say."""

import json
import os
import subprocess
import sys
import time
from importlib.metadata import version

import jax
import pytest
from commands import call

import simbrake as sb
from simbrake._base._compiling import WORTH, accelerators
from simbrake._commands import _checks


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


REPORT = {
    "ok": True,
    "notes": ["be careful"],
    "versions": {"python": "3.12", "jax": "0.10"},
    "tested_jax": "0.9 to below 0.13",
    "x64": True,
    "devices": {"all": ["cpu:0", "cpu:1"], "single_runs": "cpu:0", "ensembles": ["cpu:0", "cpu:1"]},
    "cache": {"folder": "/kept", "programs": 3, "bytes": 1_050_000},
    "memory": {"megabytes": 384.0, "mappings": 15_000},
    "xla_flags": "",
    "accelerators": [
        {"name": "a", "in_force": True, "worth": "half"},
        {"name": "b", "in_force": False, "worth": "all"},
    ],
    "timing": {"compiling": 1.25, "warm_run": 52.5e-6, "error": 1.5e-12},
}


def test_the_report_in_words():
    assert _checks._text(REPORT).splitlines() == [
        "simbrake can compute here.",
        "  note: be careful",
        "",
        "versions      python 3.12, jax 0.10",
        "              tested with JAX 0.9 to below 0.13",
        "precision     64 bits",
        "devices       cpu:0, cpu:1",
        "              single runs on cpu:0, ensembles on cpu:0, cpu:1",
        "programs      /kept (3 files, 1.1 MB)",
        "              in a process at most some 384 MB and 15,000 memory mappings",
        "XLA_FLAGS     not set (simbrake never sets it)",
        f"accelerators  {'a':<38}in force  half",
        f"              {'b':<38}refused   all",
        "timing        standard stop: compiling 1.2 s, a warm run 52.5 µs of processor time, error 1.5e-12",
    ]
    bare = REPORT | {"ok": False, "x64": False, "xla_flags": "--a", "cache": {"folder": "", "programs": 0, "bytes": 0}}
    lines = _checks._text(bare).splitlines()
    assert lines[0] == "simbrake cannot compute here."
    assert {"precision     32 bits", "programs      not cached", "XLA_FLAGS     --a (simbrake never sets it)"} <= set(
        lines
    )


def test_notes_and_codes(capsys, kept, monkeypatch):
    def told(*arguments, **changed):
        monkeypatch.setattr(
            _checks,
            "_examined",
            lambda: {k: v for k, v in REPORT.items() if k not in ("ok", "notes", "timing")} | changed,
        )
        code, out, _ = call(capsys, "doctor", "--json", *arguments)
        return code, json.loads(out)

    took = {"compiling": 2.0, "warm_run": 1.0, "error": 0.0}
    monkeypatch.setattr(_checks, "_timing", lambda: took)
    fine = {"accelerators": REPORT["accelerators"][:1], "cache": REPORT["cache"] | {"jax": False}}
    code, found = told(**fine)
    assert (code, found["ok"], found["notes"], "timing" in found) == (0, True, [], False)
    assert told("--time", **fine)[1]["timing"] == took
    code, found = told("--time", **fine | {"x64": False})
    assert (code, found["ok"], "timing" in found) == (1, False, False)
    code, found = told(cache=REPORT["cache"] | {"folder": "", "jax": True})
    assert found["notes"] == [
        "XLA refuses b: results are the same, but slower (see accelerators)",
        "compiled programs are not cached: every command compiles again; set SIMBRAKE_CACHE_DIR",
    ]
    code, found = told(**fine | {"cache": REPORT["cache"] | {"jax": True}})
    assert [note.split(":")[0] for note in found["notes"]] == ["JAX's own cache is on"]
    for error, platforms, note in (
        (RuntimeError("no\nmore"), None, "RuntimeError: no"),
        (ImportError("jax"), "cuda", "ImportError: jax (JAX_PLATFORMS is cuda: try without it)"),
        (sb.InputError([sb.Fault("x", "is odd")]), None, "x: is odd"),
    ):

        def failing(error=error):
            raise error

        monkeypatch.setattr(_checks, "_examined", failing)
        monkeypatch.delenv("JAX_PLATFORMS", raising=False)
        if platforms:
            monkeypatch.setenv("JAX_PLATFORMS", platforms)
        code, out, _ = call(capsys, "doctor", "--json")
        assert (code, json.loads(out)["ok"], json.loads(out)["notes"]) == (1, False, [note])
        assert json.loads(out)["versions"]["jax"] == version("jax")


def test_what_a_run_takes_is_part_of_what_is_spent():
    begin = time.process_time()
    found = _checks._timing()
    spent = time.process_time() - begin
    assert 0 < found["warm_run"] < spent / 200
    assert 0 < found["compiling"] < spent - 200 * found["warm_run"] + 0.1
    assert 0 <= found["error"] < 1e-9


def test_devices_and_settings_that_were_found(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--a")
    found = _checks._examined()
    assert (found["xla_flags"], found["x64"]) == ("--a", True)
    assert [(row["name"], row["in_force"], row["worth"]) for row in found["accelerators"]] == [
        (name, name not in accelerators("cpu").refused, worth) for name, worth in WORTH.items()
    ]


def test_files_by_kind_and_their_sizes(capsys, kept, monkeypatch):
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "30")
    for name, size in (("run-1", 2_000_000), ("run-2", 150_000), ("_energies-34", 40_000)):
        with open(os.path.join(kept, name), "wb") as file:
            file.truncate(size)
    os.remove(os.path.join(kept, "run-12"))
    found = json.loads(call(capsys, "cache", "--json")[1])
    assert found == {
        "folder": kept,
        "programs": 3,
        "bytes": 2_190_000,
        "limit_bytes": 30_000_000,
        "kinds": {"run": {"files": 2, "bytes": 2_150_000}, "energies": {"files": 1, "bytes": 40_000}},
        "removed": 0,
    }
    code, out, _ = call(capsys, "cache")
    assert code == 0
    assert [line.split() for line in out.splitlines()] == [
        ["3", "files,", "2.2", "of", "at", "most", "30", "MB,", "in", kept],
        [],
        ["program", "or", "answer", "files", "MB"],
        ["energies", "1", "0.04"],
        ["run", "2", "2.15"],
    ]
    assert call(capsys, "cache", "--clear")[1] == f"3 files removed from {kept}\n"
    assert call(capsys, "cache")[1] == f"0 files, 0.0 of at most 30 MB, in {kept}\n"
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", "")
    for option in ((), ("--clear",)):
        assert call(capsys, "cache", *option)[:2] == (0, "compiled programs are not cached\n")
    assert json.loads(call(capsys, "cache", "--json", "--clear")[1])["folder"] == ""
