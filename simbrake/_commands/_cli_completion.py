"""`simbrake --install-completion`: the completion script of a shell in one file, and the line that loads it."""

import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from cyclopts import Parameter

Shell = Literal["zsh", "bash", "fish", "powershell"]
OUTPUT = Parameter(name=["--output", "-o"])


def _shell_in_use() -> Shell:
    """The shell that the environment names. Raises `InputError` if it is none of those known."""
    from .._base._faults import Fault, InputError

    name = Path(os.environ.get("SHELL", "")).name
    if name == "zsh" or name == "bash" or name == "fish":
        return name
    what = f"the environment names no shell that is known (SHELL is {name!r})" if name else "SHELL is not set"
    raise InputError([Fault("--shell", what, "give --shell bash, zsh, fish or powershell")])


def _usual_place(shell: Shell, function: str) -> Path:
    """Where a shell looks for completions of a user. Raises `InputError` for one that has no such place."""
    from .._base._faults import Fault, InputError

    home = Path.home()
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    config = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
    places = {
        "bash": data / "bash-completion" / "completions" / "simbrake",
        "zsh": home / ".zsh" / "completions" / function,
        "fish": config / "fish" / "completions" / "simbrake.fish",
    }
    if shell not in places:
        raise InputError([Fault("--output", f"is missing: {shell} has no place of its own for it", "give a file")])
    return places[shell]


def _how_to_load(shell: Shell, file: Path, function: str, usual: bool) -> str:
    """The line that a user can add to a start file, and whether the shell finds the file without it."""
    path = f"'{str(file).replace(chr(39), 2 * chr(39))}'" if shell == "powershell" else shlex.quote(str(file))
    start, line = {
        "bash": ("~/.bashrc", f". {path}"),
        "zsh": ("~/.zshrc, after compinit", f". {path} && compdef {function} simbrake"),
        "fish": ("~/.config/fish/config.fish", f"source {path}"),
        "powershell": ("your profile ($PROFILE)", f". {path}"),
    }[shell]
    if usual and shell == "fish":
        return "no start file was changed: fish loads it from there"
    if usual and shell == "bash":
        start = f"{start}, where bash-completion 2.8 or later does not load it from there"
    return f"no start file was changed; a line that loads it, to be added to {start}:\n    {line}"


def write_completion(generate: Callable[..., str], shell: Shell | None, output: Path | None) -> str:
    """Writes the completion script that `generate(shell=…)` gives to `output`, whole or not at all, and nothing else.

    Returns what was written, and how the shell is made to load it. Raises `InputError` where the shell is not known or
    the file cannot be written.
    """
    from .._base._faults import whole_file

    shell = shell or _shell_in_use()
    script = generate(shell=shell)
    # zsh is told by name which function of the script completes
    found = re.search(r"^(\w+)\(\)", script, re.MULTILINE)
    function = found[1] if found else "_simbrake"
    place = (_usual_place(shell, function) if output is None else output).absolute()
    with whole_file(place) as scratch:
        # Windows PowerShell takes a script without a mark for one in the machine's old encoding
        scratch.write_text("\ufeff" * (shell == "powershell") + script, "utf-8")
    return f"written  {place}\n{_how_to_load(shell, place, function, output is None)}"
