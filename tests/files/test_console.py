"""The command line around its commands: outputs that are not UTF-8, `python -m`, completion of shells."""

import ast
import io
import json
import os
import pathlib
import subprocess
import sys
import tomllib

import pytest
from helpers import main

import simbrake
from simbrake._commands import _cli
from simbrake._commands._cli import readable

PACKAGE = pathlib.Path(simbrake.__file__).parent


def printed(monkeypatch, encoding, *arguments):
    """Exit code and the bytes on stdout and stderr of a command whose outputs have an encoding."""
    kept = [io.BytesIO(), io.BytesIO()]
    streams = [
        io.TextIOWrapper(*each) for each in zip(kept, [encoding] * 2, ["strict", "backslashreplace"], strict=True)
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
def test_an_output_that_is_not_utf_8_gets_what_it_can_show(monkeypatch, scenarios, encoding):
    scene = str(scenarios / "u2_5_5_stop.toml")
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    code, out, err = printed(monkeypatch, encoding, "run", scene)
    assert (code, err) == (0, b"")
    dots = b"..." if encoding == "ascii" else "…".encode(encoding)
    assert b"lining limits 1%b20 0.00152167%b0.00896396 s" % (dots, dots) in out
    code, out, err = printed(monkeypatch, encoding, "scene", "schema")
    assert (code, err) == (0, b"")
    assert b"stand         0       number, kg  - mass of the stand that each cycle adds, >= 0" in out.replace(
        "—".encode(encoding, "replace"), b"-"
    )
    degree = b"deg" if encoding == "ascii" else "°".encode(encoding)
    code, out, err = printed(monkeypatch, encoding, "scene", "check", scene, "--set", "brake.linings.angle=0.1")
    assert (code, err) == (0, b"")
    assert b"wrap 114.59%b, usual are" % degree in out
    code, out, err = printed(monkeypatch, encoding, "reproduce")
    assert (code, err) == (0, b"note: this command becomes: python papers/reproduce.py\n")
    code, out, err = printed(monkeypatch, encoding, "run", "обод.toml")
    name = "обод.toml".encode(encoding) if encoding == "cp1251" else rb"\u043e\u0431\u043e\u0434.toml"
    assert (code, out) == (2, b"")
    assert name + b": there is no such file" in err


def test_the_command_in_a_process_of_its_own(tmp_path):
    """`PYTHONIOENCODING` as a user sets it; `python -m simbrake` is the command, help and all."""
    programs = (
        [sys.executable, "-m", "simbrake"],
        [sys.executable, "-c", "from simbrake._commands._cli import main; main()"],
    )
    asked = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "80"}
    helps = []
    for program in programs:
        done = subprocess.run([*program, "--help"], env=asked, capture_output=True, timeout=300, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, b"")
        helps.append(done.stdout.decode("ascii"))
    assert helps[0] == helps[1]
    assert helps[0].startswith("Usage: simbrake COMMAND\n")
    done = subprocess.run([*programs[0], "run", "ω.toml"], env=asked, capture_output=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.decode("ascii").startswith("simbrake: 1 input error:")
    assert b"omega.toml: there is no such file" in done.stderr


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
def test_symbols_are_spelled(text, plain):
    assert readable(text) == plain


def test_names_stay_what_they_are_in_json_and_toml():
    name = "обод № 1, Bremstrommel für é"
    assert tomllib.loads(f'name = "{readable(name)}"') == {"name": name}
    assert json.loads(f'"{readable(name)}"') == name


def string_constants(file):
    return [n.value for n in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(n, ast.Constant)]


def test_every_symbol_that_the_package_prints_is_spelled():
    texts = [text for file in PACKAGE.rglob("*.py") for text in string_constants(file) if isinstance(text, str)]
    texts.append((PACKAGE / "checks" / "truths.csv").read_text("utf-8"))
    symbols = {character for text in texts for character in text if not character.isascii() and character.isprintable()}
    assert {"ω", "²", "…"} <= symbols
    names = set("éöøü")  # of authors, in docstrings
    assert {character for character in symbols - names if "\\" in readable(character)} == set()


def test_every_text_file_is_opened_with_its_encoding():
    """The default is that of the machine: a file written on one could not be read on another."""
    unsaid = []
    for file in PACKAGE.rglob("*.py"):
        for call in (n for n in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(n, ast.Call)):
            words = ast.unparse(call.func)
            if words.split(".")[-1] not in ("open", "read_text", "write_text", "savetxt") or words == "os.open":
                continue
            said = [word.value for word in call.keywords if word.arg == "encoding"] + call.args
            values = [node.value for node in said if isinstance(node, ast.Constant)]
            if not {"utf-8", "utf-8-sig", "rb", "wb"} & {value for value in values if isinstance(value, str)}:
                unsaid.append(f"{file.name}: {ast.unparse(call)}")
    assert unsaid == []
    # read by lazy_loader in the encoding of the machine
    assert (PACKAGE / "__init__.pyi").read_bytes().isascii()


def files_under(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_completion_is_written_and_no_start_file_changed(monkeypatch, tmp_path, shell):
    home, file = tmp_path / "home", tmp_path / "my files" / "complete"
    home.mkdir()
    starts = {".bashrc": "# mine\n", ".zshrc": "# mine\n"}
    for name, text in starts.items():
        (home / name).write_text(text, "utf-8")
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    with pytest.raises(SystemExit) as stop:
        main(["--install-completion", "--shell", shell, "--output", str(file)])
    assert stop.value.code == 0
    assert {name: (home / name).read_text("utf-8") for name in files_under(home)} == starts
    script = file.read_text("utf-8-sig")
    assert all(command in script for command in ("calibrate", "max-events"))
    if shell == "bash":
        program = f"source '{file}'\ncomplete -p simbrake"
        done = subprocess.run(["bash", "-c", program], capture_output=True, text=True, timeout=60)
        assert done.stdout == "complete -F _simbrake simbrake\n"


def encoded(text, errors="simbrake-readable"):
    _cli.print_readably()
    return text.encode("ascii", errors)


def test_bytes_of_file_names_stay_what_they_are():
    """Undecodable bytes between characters that the output lacks; other errors are raised."""
    name = b"a\xff\xfe\x80".decode("utf-8", "surrogateescape")
    assert encoded(f"ω{name}λµ{name}b") == b"omegaa\xff\xfe\x80lambdaua\xff\xfe\x80b"
    with pytest.raises(UnicodeDecodeError):
        b"\xff".decode("ascii", "simbrake-readable")


def test_only_streams_without_a_handler_of_their_own_get_one(monkeypatch):
    for errors, wanted in (("strict", "simbrake-readable"), ("surrogateescape", "simbrake-readable"), ("replace",) * 2):
        stream = io.TextIOWrapper(io.BytesIO(), "ascii", errors)
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "stderr", io.StringIO())  # no such stream
        _cli.print_readably()
        monkeypatch.undo()
        assert stream.errors == wanted


def test_ends_of_the_command_have_a_code_and_one_line(monkeypatch, capsys):
    """What a command returns or raises: its code; an error that nobody expects is a traceback."""

    def ends(what):
        def app(arguments, **options):
            assert options == {"exit_on_error": False, "print_error": True, "result_action": "return_value"}
            if isinstance(what, BaseException):
                raise what
            return what

        monkeypatch.setattr(_cli, "app", app)
        with pytest.raises(SystemExit) as stop:
            main([])
        return stop.value.code, capsys.readouterr().err

    monkeypatch.setattr(_cli.cli, "redirect_output", lambda: None)
    fault = simbrake.Fault("a", "is odd")
    for what, code, said in (
        (3, 3, ""),
        (None, 0, ""),
        ("text", 0, ""),
        (simbrake.InputError([fault]), 2, "simbrake: 1 input error:\n  a: is odd\n"),
        (simbrake.formulas.SynthesisError("no_convergence", "x"), 1, "simbrake: no_convergence: x\n"),
        (
            KeyboardInterrupt(),
            130,
            "simbrake: interrupted; finished runs in --resume DIR are kept; the same command continues\n",
        ),
        (BrokenPipeError(), 1, ""),
        (OSError(28, "No space"), 1, "simbrake: the output cannot be written: No space\n"),
        (OSError("odd"), 1, "simbrake: the output cannot be written: odd\n"),
    ):
        assert ends(what) == (code, said)
    with pytest.raises(RuntimeError, match="unexpected"):
        ends(RuntimeError("unexpected"))
    assert _cli._version().endswith(f", Python {sys.version.split()[0]}")
    assert _cli._version().startswith(f"simbrake {simbrake.__version__}, jax ")
