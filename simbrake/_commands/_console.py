"""The terminal around the commands: outputs that take fewer characters than UTF-8, and the completion of shells."""

import codecs
import itertools
import os
import re
import shlex
import sys
import unicodedata
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import Literal, get_args

from .._base._faults import Fault, InputError, whole_file

# --- ω as omega, ≤ as <=, and nothing that fails ----------------------------------------------------------------------

_NAME = "simbrake-readable"

#: symbols in letters and signs of ASCII; none of these is a quote or a backslash, which mean something in JSON and TOML
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
    """`^` before characters written high, `_` before those written low, else nothing."""
    form = unicodedata.decomposition(character)
    return "^" if form.startswith("<super>") else "_" if form.startswith("<sub>") else ""


def _spelled(character: str) -> str:
    """One character in ASCII: a symbol in words, anything else as the escape that JSON and TOML have for it."""
    if character.isascii():
        return character
    if character in _SYMBOLS:
        return _SYMBOLS[character]
    name = unicodedata.name(character, "")
    if name.startswith("GREEK ") and "LETTER" in name:
        letter = name.split()[-1].lower().replace("lamda", "lambda")
        return letter.capitalize() if "CAPITAL" in name else letter
    if name.startswith("BOX DRAWINGS"):
        return "-" if name.endswith("HORIZONTAL") else "|" if name.endswith("VERTICAL") else "+"
    return f"\\u{ord(character):04x}" if ord(character) < 0x10000 else f"\\U{ord(character):08x}"


def readable(text: str) -> str:
    """Text in ASCII that can still be read: `10⁻⁶ m²` as `10^-6 m^2`, `ω̇ ≤ T₀` as `omega' <= T_0`."""
    parts = []
    for kind, group in itertools.groupby(text, _kind):
        run = "".join(group)
        plain = unicodedata.normalize("NFKD", run) if kind else run
        parts.append(kind + "".join(_spelled(character) for character in plain))
    return "".join(parts)


def _replaced(error: UnicodeError) -> tuple[str | bytes, int]:
    """Handler for characters that an output does not take; bytes of file names that are no text stay as they are."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    bare = len(list(itertools.takewhile(lambda character: "\udc80" <= character <= "\udcff", text)))
    if bare:
        return bytes(ord(character) - 0xDC00 for character in text[:bare]), error.start + bare
    whole = "".join(itertools.takewhile(lambda character: not "\udc80" <= character <= "\udcff", text))
    return readable(whole), error.start + len(whole)


def print_readably() -> None:
    """Lets stdout and stderr write what their encoding lacks in other characters, unless a way to do so was chosen."""
    codecs.register_error(_NAME, _replaced)
    for stream, usual in ((sys.stdout, ("strict", "surrogateescape")), (sys.stderr, ("backslashreplace",))):
        if isinstance(stream, TextIOWrapper) and stream.errors in usual:
            stream.reconfigure(errors=_NAME)


# --- the completion script of a shell in one file, and the line that loads it -----------------------------------------

Shell = Literal["zsh", "bash", "fish", "powershell"]


def write_completion(generate: Callable[..., str], shell: Shell | None, output: Path | None) -> str:
    """Writes the completion script that `generate(shell=…)` gives to `output`, whole or not at all, and nothing else.

    Returns what was written, and how the shell is made to load it. Raises `InputError` where the shell is not known or
    the file cannot be written.
    """
    name = shell or Path(os.environ.get("SHELL", "")).name
    if name not in get_args(Shell):
        what = f"unknown shell (SHELL is {name!r})" if name else "SHELL is not set"
        raise InputError([Fault("--shell", what, "give --shell bash, zsh, fish or powershell")])
    script, home = generate(shell=name), Path.home()
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    config = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
    # zsh is told by name which function of the script completes
    found = re.search(r"^(\w+)\(\)", script, re.MULTILINE)
    function = found[1] if found else "_simbrake"
    # where the shell looks for completions of a user, its start file, the line there that loads a file
    usual, start, line = {
        "bash": (data / "bash-completion" / "completions" / "simbrake", "~/.bashrc", ". {}"),
        "zsh": (
            home / ".zsh" / "completions" / function,
            "~/.zshrc, after compinit",
            f". {{}} && compdef {function} simbrake",
        ),
        "fish": (config / "fish" / "completions" / "simbrake.fish", "~/.config/fish/config.fish", "source {}"),
        "powershell": (None, "your profile ($PROFILE)", ". {}"),
    }[name]
    place = output or usual
    if place is None:
        raise InputError([Fault("--output", f"is missing: {name} has no standard place for it", "give a file")])
    place = place.absolute()
    with whole_file(place) as scratch:
        # Windows PowerShell takes a script without a mark for one in the machine's old encoding
        scratch.write_text("\ufeff" * (name == "powershell") + script, "utf-8")
    if output is None and name == "fish":
        return f"written  {place}\nno start file was changed: fish loads it from there"
    if output is None and name == "bash":
        start += ", where bash-completion 2.8 or later does not load it from there"
    path = f"'{str(place).replace(chr(39), 2 * chr(39))}'" if name == "powershell" else shlex.quote(str(place))
    how = f"no start file was changed; a line that loads it, to be added to {start}:"
    return f"written  {place}\n{how}\n    {line.format(path)}"
