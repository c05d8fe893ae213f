"""The command line around its commands: outputs that are not UTF-8, `python -m`,
completion of shells."""

import io
import os
import pathlib
import subprocess
import sys

import pytest
from commands import call
from helpers import main

import simbrake


def printed(monkeypatch, encoding, *arguments):
    """Exit code and the bytes on stdout and stderr of a command whose outputs have an
    encoding."""
    kept = [io.BytesIO(), io.BytesIO()]
    streams = [
        io.TextIOWrapper(*each)
        for each in zip(
            kept, [encoding] * 2, ["strict", "backslashreplace"], strict=True
        )
    ]
    monkeypatch.setattr(sys, "stdout", streams[0])
    monkeypatch.setattr(sys, "stderr", streams[1])
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    monkeypatch.undo()
    for stream in streams:
        stream.flush()
    return stop.value.code, *(stream.getvalue() for stream in kept)


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp1251"])
def test_output_that_is_not_utf_8(monkeypatch, scenarios, encoding):
    scene = str(scenarios / "u2_5_5_stop.toml")
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    code, out, err = printed(monkeypatch, encoding, "run", scene)
    assert (code, err) == (0, b"")
    dots = b"..." if encoding == "ascii" else "…".encode(encoding)
    assert b"lining limits 1%b20 0.00152167%b0.00896396 s" % (dots, dots) in out
    code, out, err = printed(monkeypatch, encoding, "scene", "schema")
    assert (code, err) == (0, b"")
    assert (
        b"stand         0       number, kg  - mass of the stand that each cycle adds, >= 0"
        in out.replace("—".encode(encoding, "replace"), b"-")
    )
    degree = b"deg" if encoding == "ascii" else "°".encode(encoding)
    code, out, err = printed(
        monkeypatch,
        encoding,
        "scene",
        "check",
        scene,
        "--set",
        "brake.linings.angle=0.1",
    )
    assert (code, err) == (0, b"")
    assert b"wrap 114.59%b, usual are" % degree in out
    code, out, err = printed(monkeypatch, encoding, "reproduce")
    assert (code, err) == (
        0,
        b"note: this command becomes: python papers/reproduce.py\n",
    )
    code, out, err = printed(monkeypatch, encoding, "run", "обод.toml")
    name = (
        "обод.toml".encode(encoding)
        if encoding == "cp1251"
        else rb"\u043e\u0431\u043e\u0434.toml"
    )
    assert (code, out) == (2, b"")
    assert name + b": there is no such file" in err


def test_command_in_its_own_process(tmp_path):
    """`PYTHONIOENCODING` as a user sets it; `python -m simbrake` is the command, help
    and all."""
    programs = (
        [sys.executable, "-m", "simbrake"],
        [str(pathlib.Path(sys.executable).with_name("simbrake"))],
    )
    asked = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "80"}
    helps = []
    for program in programs:
        done = subprocess.run(
            [*program, "--help"],
            env=asked,
            capture_output=True,
            timeout=300,
            cwd=tmp_path,
        )
        assert (done.returncode, done.stderr) == (0, b"")
        helps.append(done.stdout.decode("ascii"))
    assert helps[0] == helps[1]
    done = subprocess.run(
        [*programs[0], "run", "ω.toml"],
        env=asked,
        capture_output=True,
        timeout=300,
        cwd=tmp_path,
    )
    assert done.returncode == 2
    assert b"omega.toml: there is no such file" in done.stderr


def spell(capsys, text):
    """A text in ASCII as the command prints it: it registers a handler of errors of
    encoding."""
    call(capsys, "--version")
    return text.encode("ascii", "simbrake-readable")


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("ω̇ ≤ T₀·Πₙ", "omega' <= T_0*Pi_n"),
        ("10⁻⁶ m², 20 °C, ½ λ", "10^-6 m^2, 20 degC, 1/2 lambda"),
        ("∂t/∂C ≈ −1 … +2 → ∞", "dt/dC ~ -1 ... +2 -> inf"),
        ("╭─┤ẋ│", "+-+x'|"),
        ("Ω Λ λ ς ⍺", "Omega Lambda lambda sigma \\u237a"),
        ("x²³ y₁₂z", "x^23 y_12z"),
        ("Ж 𝛀 ᴬ", "\\u0416 \\U0001d6c0 ^A"),
    ],
)
def test_symbols_are_spelled(capsys, text, plain):
    assert spell(capsys, text) == plain.encode()


def test_bytes_of_file_names(capsys):
    """Undecodable bytes between characters that the output lacks; other errors are
    raised."""
    name = b"a\xff\xfe\x80".decode("utf-8", "surrogateescape")
    spelled = spell(capsys, f"ω{name}λµ{name}b")
    assert spelled == b"omegaa\xff\xfe\x80lambdaua\xff\xfe\x80b"
    with pytest.raises(UnicodeDecodeError):
        b"\xff".decode("ascii", "simbrake-readable")


def test_version_names_its_packages(capsys):
    out = call(capsys, "--version")[1].strip()
    assert out.startswith(f"simbrake {simbrake.__version__}, jax ")
    assert out.endswith(f", Python {sys.version.split()[0]}")
