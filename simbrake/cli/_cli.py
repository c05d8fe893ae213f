"""The command line, its output on any terminal, and its completion.

Exit codes: 0 success, 1 failure, 2 the input is wrong, 3 no pass (`--fail-on-limit`);
of `calibrate` also 4, the data do not determine a parameter.
"""

import codecs
import inspect
import itertools
import sys
import unicodedata
from io import StringIO, TextIOWrapper
from typing import Any

import cyclopts

import simbrake as sb

from .._base._faults import InputError
from . import _checks, _rig, _runs, _scenes, _studies
from . import _options as cli

# --- ω as omega, ≤ as <=, without encoding errors
# ----------------------------------------------------------------------

_NAME = "simbrake-readable"

#: symbols in letters and signs of ASCII; none of these is a quote or a backslash, which
#: have a meaning in JSON and TOML
_SYMBOLS = {
    **dict(zip("µ·⋅×•–—−≈∝∂∘ℓ“”’\N{NO-BREAK SPACE}", "u**x*---~~dol''' ", strict=True)),
    **{dotted: f"{plain}'" for dotted, plain in zip("ċėġḣṪẋẏ", "ceghTxy", strict=True)},
    "°": "deg",
    "§": "section ",
    "…": "...",
    "→": "->",
    "½": "1/2",
    "⅔": "2/3",
    "±": "+/-",
    "∓": "-/+",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
    "≫": ">>",
    "∞": "inf",
    "∇": "grad ",
    "∫": "int",
    "∏": "prod",
    "√": "sqrt",
    "✓": "ok",
    "ẍ": "x''",
    "\N{COMBINING DOT ABOVE}": "'",
    "\N{COMBINING MACRON}": "",
    "\N{COMBINING CIRCUMFLEX ACCENT}": "",
}


def _kind(character: str) -> str:
    """`^` before characters written high, `_` before those written low, else
    nothing."""
    form = unicodedata.decomposition(character)
    return (
        "^" if form.startswith("<super>") else "_" if form.startswith("<sub>") else ""
    )


def _spelled(character: str) -> str:
    """One character in ASCII: a symbol in words, anything else as the escape that JSON
    and TOML have for it; a byte that was no text is kept."""
    if character.isascii() or "\udc80" <= character <= "\udcff":
        return character
    if character in _SYMBOLS:
        return _SYMBOLS[character]
    name = unicodedata.name(character, "")
    if name.startswith("GREEK ") and "LETTER" in name:
        letter = name.split()[-1].lower().replace("lamda", "lambda")
        return letter.capitalize() if "CAPITAL" in name else letter
    if name.startswith("BOX DRAWINGS"):
        return (
            "-"
            if name.endswith("HORIZONTAL")
            else "|"
            if name.endswith("VERTICAL")
            else "+"
        )
    return (
        f"\\u{ord(character):04x}"
        if ord(character) < 0x10000
        else f"\\U{ord(character):08x}"
    )


def readable(text: str) -> str:
    """Convert text to readable ASCII: `10⁻⁶ m²` as `10^-6 m^2`, `ω̇ ≤ T₀` as
    `omega' <= T_0`."""
    parts = []
    for kind, group in itertools.groupby(text, _kind):
        run = "".join(group)
        plain = unicodedata.normalize("NFKD", run) if kind else run
        parts.append(kind + "".join(_spelled(character) for character in plain))
    return "".join(parts)


def _replaced(error: UnicodeError) -> tuple[str | bytes, int]:
    """Handler for characters that an output cannot encode; undecodable bytes of file
    names are kept."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = readable(error.object[error.start : error.end])
    return text.encode("ascii", "surrogateescape"), error.end


def print_readably() -> None:
    """Let stdout and stderr replace characters that they cannot encode, unless an error
    handler was chosen."""
    codecs.register_error(_NAME, _replaced)
    for stream, usual in (
        (sys.stdout, ("strict", "surrogateescape")),
        (sys.stderr, ("backslashreplace",)),
    ):
        if isinstance(stream, TextIOWrapper) and stream.errors in usual:
            stream.reconfigure(errors=_NAME)


# --- the commands -------------------------------------------------------------------


def _version() -> str:
    """simbrake with the versions that its numbers depend on."""
    python, *others = _checks.versions().items()
    return ", ".join(
        [*(f"{name} {number}" for name, number in others), f"Python {python[1]}"]
    )


def _words_of(error: cyclopts.CycloptsError) -> Any:
    """Error text of a wrong command line: cyclopts' own, except for arguments that no
    option takes."""
    if not isinstance(error, cyclopts.UnusedCliTokensError) or not error.unused_tokens:
        return cyclopts.CycloptsPanel(error)
    token = error.unused_tokens[0]
    command = " ".join(error.command_chain or ())
    takes = inspect.signature(error.target).parameters if error.target else {}
    usual = ("vary", "set_") if ":" in token else ("set_", "vary")
    option = next(
        (f"--{name.strip('_')}" for name in usual if name in takes and "=" in token),
        None,
    )
    hint = (
        f'; did you mean {option} "{token}"?'
        if option
        else f"; simbrake {command} --help lists what it takes"
    )
    return cyclopts.CycloptsPanel(
        f'"{token}" belongs to no option of simbrake {command}{hint}'
    )


app = cyclopts.App(
    name="simbrake",
    error_formatter=_words_of,
    suppress_keyboard_interrupt=False,  # `main` tells of it
    help="""Dynamic simulator of band-shoe brakes of drilling drawworks: stick and slip of every lining, heat, events,
    and derivatives of all results. A scene is a file: a brake, its duty and its initial state. First steps:

    * Start from a commented template: `simbrake new standard mine.toml`
    * Run it, with figures and tables in a folder: `simbrake run mine.toml --out stop`
    * Read what happened and why: `simbrake explain mine.toml`
    * Change one parameter: `simbrake run mine.toml --set "duty.load.mass=80 t"`
    * List every parameter of a scene: `simbrake scene show mine.toml`; the file format: `simbrake scene schema`
    * See what each parameter does to the stopping time: `simbrake sensitivity mine.toml`
    * Write a report to share: `simbrake report mine.toml`
    * Move a slider for every parameter: `simbrake app mine.toml`
    * Read what a rig asked of its brakes from its log: `simbrake rig log.xml`
    """,
    help_format="markdown",
    help_epilogue="Exit codes: 0 success; 1 the run failed; 2 the input is wrong, with "
    "all its errors; 3 a limit is "
    "exceeded. Every command's --help says which it has.",
    version=_version,
)


#: commands and options that went, and what to use instead
_GONE = {
    "fmu": "simbrake export SCENE --fmu FILE.fmu writes an FMU that needs no Python",
    "report --with-spread": "simbrake.uncertainty takes ranges of inputs; report "
    "--sensitivity shows ± 1 % of each",
    "report --lining": "simbrake.uncertainty takes ranges of inputs; report "
    "--sensitivity shows ± 1 % of each",
}

app.register_install_completion_command(
    add_to_startup=False, help_epilogue=_scenes.CODES
)
app.command(_scenes.scene)
for _module in (_scenes, _runs, _studies, _rig, _checks):
    for _command, _codes in _module.COMMANDS.items():
        app.command(_command, help_epilogue=f"Exit codes: {_codes}")


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the `simbrake` command."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller
            setattr(sys, name, StringIO())
    print_readably()
    named = sys.argv[1:] if arguments is None else arguments
    for gone, instead in _GONE.items():
        command, *option = gone.split()
        if named[:1] == [command] and set(option) <= set(named):
            _end(f"{gone} went: {instead}", 2)
    try:
        code = app(
            arguments,
            exit_on_error=False,
            print_error=True,
            result_action="return_value",
        )
        sys.stdout.flush()
        sys.exit(code if isinstance(code, int) else 0)
    except cyclopts.CycloptsError:
        sys.exit(2)
    except InputError as error:
        _end(error, 2)
    except RuntimeError as error:
        if not isinstance(error, sb.SimulationError | sb.formulas.SynthesisError):
            raise
        _end(error, 1)
    except KeyboardInterrupt:
        _end(
            "interrupted; finished runs in --resume DIR are kept; the same command continues",
            130,
        )
    except BrokenPipeError:
        cli.redirect_output()
        sys.exit(1)
    except OSError as error:  # of the output: other files are input errors
        cli.redirect_output()
        _end(f"the output cannot be written: {error.strerror or error}", 1)


def _end(message: object, code: int) -> None:
    print(f"{cli.coloured('simbrake:', '31', sys.stderr)} {message}", file=sys.stderr)
    sys.exit(code)
