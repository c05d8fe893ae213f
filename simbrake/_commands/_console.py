"""What is printed where the output takes fewer characters than UTF-8: ω as omega, ≤ as <=, and nothing that fails."""

import codecs
import itertools
import sys
import unicodedata
from io import TextIOWrapper

_NAME = "simbrake-readable"

#: symbols in letters and signs of ASCII; none of these is a quote or a backslash, which mean something in JSON and TOML
_SYMBOLS = {
    "°": "deg",
    "µ": "u",
    "§": "section ",
    "·": "*",
    "⋅": "*",
    "×": "x",
    "•": "*",
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "→": "->",
    "½": "1/2",
    "⅔": "2/3",
    "±": "+/-",
    "∓": "-/+",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
    "≈": "~",
    "∝": "~",
    "≫": ">>",
    "∞": "inf",
    "∂": "d",
    "∇": "grad ",
    "∫": "int",
    "∏": "prod",
    "√": "sqrt",
    "∘": "o",
    "ℓ": "l",
    "“": "'",
    "”": "'",
    "’": "'",
    "✓": "ok",
    **{dotted: f"{plain}'" for dotted, plain in zip("ċėġḣṪẋẏ", "ceghTxy", strict=True)},
    "ẍ": "x''",
    "\N{NO-BREAK SPACE}": " ",
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
