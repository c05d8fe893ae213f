"""Shared parts of the commands: options, loading the scene, printing and writing, exit
codes."""

import contextlib
import dataclasses
import gc
import json
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from cyclopts import Parameter

from .._base._faults import Fault, InputError, Issues, faults_of_place
from .._base._faults import whole_file as whole_file
from .._base._progress import saying
from ..files.shipped_scenes import scene_file

if TYPE_CHECKING:
    from cyclopts import Token

    from ..parts.scene import Scene
    from ..runs.result import Result as Result
    from ..runs.verdict import Verdict
else:
    Scene = Result = Verdict = object  # their modules load JAX, which `--help` must not

T = TypeVar("T")


def named_file(_: object, tokens: "Sequence[Token]") -> Path:
    """The file of a scene by its path or name; an unknown one is told when it is
    opened."""
    path = Path(tokens[0].value)
    with contextlib.suppress(InputError):
        return scene_file(path)
    return path


def named_source(type_: object, tokens: "Sequence[Token]") -> Path:
    """The same, but a folder is that of a result."""
    path = Path(tokens[0].value)
    return path if path.is_dir() else named_file(type_, tokens)


# --- options of several commands, with their help texts; other help is in the commands' docstrings

#: an option that may be repeated
REPEATED = Parameter(negative="", consume_multiple=False)
Many = Annotated[list[str] | None, REPEATED]
Flag = Annotated[bool, Parameter(negative="", show_default=False)]
_SCENE = (
    "Scene: a TOML file, a Python file with a function scene(), whose code is run, or "
    "the name of a template or shipped scene (simbrake new lists these)."
)
SceneFile = Annotated[Path, Parameter(name="SCENE", help=_SCENE, converter=named_file)]
_REPLAY = f"Replay the recording on the brake of a scene. {_SCENE}"
ReplayScene = Annotated[
    Path | None, Parameter(name="--scene", help=_REPLAY, converter=named_file)
]
_OUT = "Folder for the files that the command writes, made if it does not exist."
Out = Annotated[Path | None, Parameter(name=["--out", "-o"], help=_OUT)]
_ONE = "Folder or file name; a folder is made if it does not exist."
OutFile = Annotated[Path | None, Parameter(name=["--out", "-o"], help=_ONE)]
_RESULT = f"{_OUT} With the ending .nc: one file that holds the result alone."
OutResult = Annotated[Path | None, Parameter(name=["--out", "-o"], help=_RESULT)]
_SET = (
    "PATH=VALUE: set a parameter of the scene, in SI or with its unit, as "
    '"duty.load.mass=30 t"; of a TOML file also '
    "one of its keys, as brake.linings.count=18; may be repeated. simbrake scene show "
    "SCENE lists the paths."
)
Set = Annotated[Many, Parameter(help=_SET)]
Rtol = Annotated[float, Parameter(help="Relative tolerance of the integration.")]
Json = Annotated[Flag, Parameter(help="Print the results as JSON, alone on stdout.")]
_UNITS = (
    "Units of what is printed, and of a report: SI, or those of a rig (klbf, ft, "
    "ft·lbf, hp, °F). JSON and other files stay in SI."
)
Units = Annotated[Literal["si", "rig"], Parameter(help=_UNITS)]
_LIMIT = (
    "METRIC=VALUE: maximum allowed value of a metric or of max_pressure, in SI or with "
    "its unit, as "
    '"max_tension=120 kN" or "peak_rim_temperature=450 degC"; may be repeated.'
)
Limits = Annotated[Many, Parameter(help=_LIMIT)]
_FAIL = (
    "Exit with code 3 if the verdict is red (a limit is exceeded, or the load is not "
    "stopped or held), or the run did "
    "not show what it was to show. Without it such a run exits with 0."
)
FailOnLimit = Annotated[Flag, Parameter(help=_FAIL)]

# --- before a command works ----------------------------------------------------------


def prepare_jax() -> None:
    """Set 64 bits, and run the garbage collector less often."""
    # messages of XLA on programs read from disk are not logged
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    gc.disable()  # imports leave no garbage
    with saying("loading…"):
        import jax

    jax.config.update("jax_enable_x64", True)
    # tracing makes millions of small objects and few reference cycles: run the
    # collector less often
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)
    gc.enable()
    if (
        callable(signal.getsignal(signal.SIGINT))
        and threading.current_thread() is threading.main_thread()
    ):
        # from here on Ctrl-C is handled by what runs
        signal.signal(signal.SIGINT, signal.default_int_handler)


def opened(
    file: Path,
    set_: list[str] | None,
    rtol: float = 1e-10,
    *,
    folder: Path | None = None,
    faults: Iterable[Fault] = (),
    undriven: bool = False,
    **counts: int | None,
) -> Scene:
    """The scene of a command with the parameters of `--set`, after JAX is prepared.

    - `folder`: of `--out`
    - `counts`: options that are at least 1
    - `undriven`: see `read_scene`
    - `faults`: errors of other options

    Raises one `InputError` with the errors of options, scene and parameters.
    """
    errors = Issues(faults)
    errors.unless(1e-15 < rtol < 0.1, "--rtol", rtol, "0 < rtol < 0.1")
    for name, count in counts.items():
        option = f"--{name.replace('_', '-')}"
        errors.unless(count is None or count >= 1, option, count, "at least 1")
    errors += faults_of_place("--out", folder)
    if errors.attempt(scene_file, file) is None:
        raise InputError(errors)  # known before JAX is loaded
    prepare_jax()
    with saying("reading the scene…"):
        from ..files._scene_file import read_scene

        values = errors.attempt(values_to_set, set_ or [])
        scene = errors.attempt(read_scene, file, values or {}, undriven=undriven)
    return checked(scene, errors)


def checked(value: T | None, faults: Issues) -> T:
    """A value that is there. Raises `InputError` if there are errors."""
    if faults or value is None:
        raise InputError(faults)
    return value


def file_in(out: Path, name: str) -> Path:
    """The one file that a command writes: `--out` itself where that has an ending, else
    `name` in that folder."""
    return out if out.suffix and not out.is_dir() else out / name


def faults_of_file(file: Path | None, *endings: str) -> list[Fault]:
    """Error of the name of a file to be written; `endings`: allowed endings, any if
    none are given."""
    faults = Issues()
    if file is None:
        return faults
    if file.is_dir():
        faults.add("--out", f"{file} is a folder", "give a file")
    elif file.parent.exists() and not file.parent.is_dir():
        hint = "give a folder, or a name with an ending"
        faults.add("--out", f"{file.parent} is a file", hint)
    elif endings and file.suffix not in endings:
        kind = file.suffix or "a name without ending"
        hint = f"give {', '.join(endings[:-1])} or {endings[-1]}"
        faults.add(str(file), f"{kind} is not a format of this file", hint)
    return faults


def assignments(
    option: str,
    form: str,
    texts: list[str] | None,
    parse: Callable[[str], T],
    faults: Issues,
) -> dict[str, T]:
    """Values by name from texts of the `form` NAME=VALUE; those that `parse` refuses
    (`ValueError`) go to `faults`."""
    values: dict[str, T] = {}
    for text in texts or []:
        name, _, value = (part.strip() for part in text.partition("="))
        if name in values:
            faults.add(f"{option} {name}", "is given twice", "give each parameter once")
            continue
        try:
            values[name] = parse(value if name else "")
        except ValueError:
            hint = "numbers are in SI, or have their unit"
            faults.add(f"{option} {text}", f"is not of the form {form}", hint)
    return values


def values_to_set(texts: list[str]) -> dict[str, Any]:
    """Values by path from texts `path=value`: numbers, with a unit if need be, lists in
    brackets, or `none` for physics to be absent."""
    values: dict[str, Any] = {}
    faults = Issues()
    for text in texts:
        path, _, value = (part.strip() for part in text.partition("="))
        if not path or not value:
            hint = "as in brake.band.stiffness=2e5"
            faults.add(text, "is not of the form path=value", hint)
            continue
        # (a list, or a number with its unit, is read where the path is known)
        values[path] = None if value.lower() == "none" else value
        with contextlib.suppress(ValueError):
            values[path] = float(value)
    faults.report()
    return values


def not_empty(text: str) -> str:
    """A text that is not empty. Raises `ValueError`."""
    if not text:
        raise ValueError
    return text


def bounds(text: str) -> list[str]:
    """The two numbers of `LOW:HIGH`, as texts. Raises `ValueError`."""
    low, high = text.split(":")
    return [low, high]


def in_si(
    scene: Scene | None, option: str, texts: Mapping[str, Sequence[str]], faults: Issues
) -> dict[str, tuple[float, ...]]:
    """Numbers by the path of a parameter, in SI from texts with or without unit; errors
    go to `faults`."""
    if scene is None:
        return {}
    from ..runs.edit import read_numbers

    values = {}
    for path, numbers in texts.items():
        try:
            values[path] = tuple(read_numbers(scene, path, numbers))
        except InputError as error:
            argument = f"{option} {path}={':'.join(numbers)}"
            faults += [
                dataclasses.replace(fault, path=argument) for fault in error.faults
            ]
    return values


def limits_of(
    scene: Scene, texts: list[str] | None, metrics: Sequence[str] = ()
) -> dict[str, float]:
    """Limits of `--limit` in SI.

    Raises one `InputError` with the errors of all, and of the names of other `metrics`.
    """
    from ..runs.measure import check_metrics, read_limits

    faults = Issues()
    limit_texts = assignments("--limit", "METRIC=VALUE", texts, not_empty, faults)
    limits, wrong = read_limits(scene, limit_texts, "--limit {}")
    faults += wrong
    faults.attempt(check_metrics, scene, metrics)
    return checked(limits, faults)


# --- after it has worked ------------------------------------------------------------


def redirect_output() -> None:
    """Discard further output: its reader has closed the pipe."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say(text: object) -> None:
    """Print and flush. A closed pipe, as after `head -1`, does not end the remaining
    work."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        redirect_output()


def as_json(data: object) -> str:
    return json.dumps(data, indent=1, allow_nan=False)


def tell(result: Any, json_: bool, data: object = None, ok: bool | None = None) -> None:
    """Print a result as text, or its `data` as JSON, by default `result.as_dict()`;
    `ok`: whether the verdict that the text begins with is good."""
    if json_:
        say(as_json(result.as_dict() if data is None else data))
    else:
        say(highlighted(str(result), ok))


_RED = "31"
_GREEN = "32"
_YELLOW = "33"
#: words of a text that a terminal shows in colour
_WORDS = {r"\bexceeded\b": _RED, r"\bwithin limit\b": _GREEN, r"^warning\b": _YELLOW}


def coloured(text: str, colour: str, stream: Any) -> str:
    """The text in a colour where the stream is a terminal and the environment variable
    NO_COLOR is not set."""
    plain = (
        not stream.isatty()
        or os.environ.get("NO_COLOR")
        or os.environ.get("TERM") == "dumb"
    )
    return text if plain else f"\x1b[{colour}m{text}\x1b[0m"


def is_good(verdict: Verdict) -> bool | None:
    """Whether a verdict is green or red, for the colour of the printed status; `None`:
    it is amber."""
    return {"green": True, "red": False}.get(verdict.colour)


def highlighted(text: str, ok: bool | None = None) -> str:
    """A printed text with its verdicts in colour, on a terminal."""
    for words, colour in _WORDS.items():
        text = re.sub(
            words,
            lambda match, c=colour: coloured(match[0], c, sys.stdout),
            text,
            flags=re.MULTILINE,
        )
    verdict, colon, rest = text.partition(":")
    if ok is None or "\n" in verdict or not colon:
        return text
    return coloured(verdict, _GREEN if ok else _RED, sys.stdout) + colon + rest


def print_written(written: Iterable[Path], json_: bool) -> None:
    if not json_:
        say("written  " + ", ".join(str(path) for path in written))


def exit_code(ok: bool, fails: bool = False) -> int:
    """Exit code: 0 success, 1 failure, 3 no pass (with `--fail-on-limit`)."""
    return 1 if not ok else 3 if fails else 0
