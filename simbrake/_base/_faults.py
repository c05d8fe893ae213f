"""Input and output errors in one report. Free of JAX, so that a command can report them
before JAX loads.

Files are written whole or not at all.
"""

import contextlib
import dataclasses
import difflib
import errno
import importlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Container, Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar


@dataclasses.dataclass(frozen=True)
class Fault:
    """One input error: where it is, what the problem is, and how to fix it.

    Example:
        >>> str(sb.Fault("end_time", "is missing", "give a time"))
        'end_time: is missing — give a time'
    """

    path: str
    problem: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}" + (f" — {self.hint}" if self.hint else "")


Faults = list[Fault]


class InputError(ValueError):
    """All errors of an input in one report.

    Example:
        >>> try:
        ...     sb.Pulley("590 kg", 1200)
        ... except sb.InputError as error:
        ...     print(error.faults[0].path)
        Pulley.radius
    """

    def __init__(self, faults: list[Fault], of_arguments: bool = False) -> None:
        self.faults = tuple(faults)
        self.of_arguments = of_arguments
        count = "1 input error" if len(faults) == 1 else f"{len(faults)} input errors"
        super().__init__("\n".join([f"{count}:", *(f"  {fault}" for fault in faults)]))


def input_error(path: str, problem: str, hint: str = "") -> InputError:
    """An input with this error alone."""
    return InputError([Fault(path, problem, hint)])


#: effective radius of a drum: that of its rope, not of the drum itself
DRUM_RADIUS = "drum_radius"


def of_radius(name: str, names: Container[str]) -> str:
    """Hint for a diameter where the radius is known, and the other way round; empty for
    any other name."""
    if "diameter" in name and DRUM_RADIUS in names:
        return (
            f"give {DRUM_RADIUS}, to the middle of the rope in the first layer: "
            "(diameter of drum + rope)/2"
        )
    for given, other, share in (
        ("diameter", "radius", "half of it"),
        ("radius", "diameter", "twice that"),
    ):
        if given in name and (known := name.replace(given, other)) in names:
            return f"give {share} as {known}"
    return ""


def near(name: str, names: Iterable[str]) -> str:
    """Words of the public names that are most like one that is unknown; nothing where
    none is."""
    known = (
        []
        if name.startswith("_")
        else [public for public in names if not public.startswith("_")]
    )
    if hint := of_radius(name, known):
        return f"; {hint}"
    alike = nearest(name, known, "")
    return f"; {alike}" if alike else ""


def nearest(
    name: str,
    names: Iterable[str],
    otherwise: str | None = None,
    *,
    count: int = 3,
    cutoff: float = 0.5,
) -> str:
    """Hint for a name that is unknown: those most like it; else what is to be said
    `otherwise`, by default all."""
    known = list(names)
    alike = difflib.get_close_matches(name, known, count, cutoff)
    if alike:
        return f"nearest: {', '.join(alike)}"
    return f"there are: {', '.join(known)}" if otherwise is None else otherwise


def shown(value: object) -> str:
    """A value of a file, shortened for a message."""
    text = " ".join(repr(value).split()) if not isinstance(value, dict) else "a table"
    return text if len(text) <= 60 else text[:57] + "…"


# --- arguments of formulas ----------------------------------------------------------


def require_positive(**values: Any) -> None:
    """Raise `ValueError` naming every value that is not a finite number above 0; `None`
    is not checked."""
    _require("positive", lambda x: x > 0, values)


def require_not_negative(**values: Any) -> None:
    """Raise `ValueError` naming every value that is not a finite number of at least 0;
    `None` is not checked."""
    _require("at least 0", lambda x: x >= 0, values)


def require_share(**values: Any) -> None:
    """Raise `ValueError` naming every value outside 0…1."""
    _require("between 0 and 1", lambda x: (x >= 0) & (x <= 1), values)


def _require(what: str, good: Callable[[Any], Any], values: dict[str, Any]) -> None:
    import numpy as np  # a command that only reports an error does not import it

    numbers = {
        name: np.asarray(value, float)
        for name, value in values.items()
        if value is not None
    }
    bad = [name for name, x in numbers.items() if not np.all(good(x) & np.isfinite(x))]
    if bad:
        raise ValueError(
            "; ".join(f"{name} = {values[name]} must be {what}" for name in bad)
        )


def needed(package: str, use: str, extra: str) -> ModuleType:
    """The module of a package that comes with an extra of simbrake. Raises `InputError`
    where it is missing."""
    try:
        return importlib.import_module(package)
    except ImportError:
        raise input_error(
            package, f"is missing, which {use}", f"pip install 'simbrake[{extra}]'"
        ) from None


# --- files --------------------------------------------------------------------------


def existing_file(file: Path, *kinds: str) -> Path:
    """The file. Raises `InputError` naming the available files where the path is a
    folder or does not exist."""
    try:
        what = (
            "is a folder"
            if file.is_dir()
            else "is not a regular file"
            if file.exists()
            else "there is no such file"
        )
    except OSError as error:  # a name that is too long
        raise input_error(
            str(file)[:200], f"cannot be read: {error.strerror}", "give another path"
        ) from None
    if file.is_file():
        return file
    folder = (
        file if file.is_dir() else file.parent if file.parent.is_dir() else Path(".")
    )
    there = sorted(str(path) for kind in kinds for path in folder.glob(kind))
    hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a file"
    raise input_error(str(file), what, hint)


#: maximum bytes of a scene or a manifest
_MOST_BYTES = 1 << 25


def text_of_file(path: Path, what: str = "a TOML file") -> str:
    """The text of a regular file in UTF-8. Raises `InputError` for any other file, and
    for one that is too large.

    A pipe or a device might never end, wherever a scene names one as its data.
    """
    try:
        with open(
            path,
            "rb",
            opener=lambda name, flags: os.open(
                name, flags | getattr(os, "O_NONBLOCK", 0)
            ),
        ) as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise input_error(
                    str(path), "is not a regular file", f"give {what} on a disk"
                )
            if about.st_size > _MOST_BYTES:
                size = (
                    f"{about.st_size / 1e6:.0f} MB are more than the "
                    f"{_MOST_BYTES / 1e6:.0f} MB of {what}"
                )
                raise input_error(str(path), size, "make it smaller")
            return (
                file.read(_MOST_BYTES)
                .decode("utf-8-sig")
                .replace("\r\n", "\n")
                .replace("\r", "\n")
            )
    except InputError:
        raise
    except FileNotFoundError:
        raise input_error(
            str(path), "there is no such file", f"give the path of {what}"
        ) from None
    except (OSError, ValueError) as error:
        words = error.strerror if isinstance(error, OSError) else error
        raise input_error(
            str(path), f"cannot be read: {words}", f"give {what} in UTF-8"
        ) from None


def faults_of_place(option: str, place: Path | None) -> list[Fault]:
    """Error of a folder in which nothing could be written, before anything is computed
    for it."""
    if place is None:
        return []
    try:
        there = next(
            path for path in (place, *place.absolute().parents) if path.exists()
        )
    except OSError as error:
        return [Fault(option, f"{place}: {error.strerror}", "give another folder")]
    if not there.is_dir():
        return [Fault(option, f"{there} is a file", "give a folder")]
    if os.access(there, os.W_OK | os.X_OK):
        return []
    return [Fault(option, f"{there} is read-only", "give another folder")]


_SCRATCH = ".simbrake-"
#: s after which a temporary folder is that of a process that was killed
_FORGOTTEN = 3600.0


@contextlib.contextmanager
def _scratch_beside(place: Path) -> Iterator[Path]:
    """Temporary folder beside `place`, on the same disk; `InputError` where nothing can
    be written."""
    if "\0" in str(place):
        raise input_error(repr(str(place)), "has a null character", "give another name")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=_SCRATCH, dir=place.parent))
        for other in place.parent.glob(f"{_SCRATCH}*"):
            with contextlib.suppress(OSError):  # another process has removed it
                if time.time() - other.stat().st_mtime > _FORGOTTEN:
                    shutil.rmtree(other, ignore_errors=True)
        try:
            yield scratch
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise input_error(str(place), what, "give another place") from error


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Temporary path to write to; its file replaces `path` if no error occurred."""
    with _scratch_beside(path) as scratch:
        yield scratch / path.name
        os.replace(scratch / path.name, path)


@contextlib.contextmanager
def whole_folder(folder: Path) -> Iterator[tuple[Path, list[Path]]]:
    """Temporary folder whose files move to `folder` only if all were written; the list
    then names them."""
    written: list[Path] = []
    with _scratch_beside(folder) as scratch:
        yield scratch, written
        folder.mkdir(exist_ok=True)
        for file in scratch.iterdir():
            if (folder / file.name).is_dir():
                raise IsADirectoryError(
                    errno.EISDIR,
                    "there is a folder of that name",
                    str(folder / file.name),
                )
        for file in sorted(scratch.iterdir()):
            os.replace(file, folder / file.name)
            written.append(folder / file.name)


Made = TypeVar("Made")


class Issues(list[Fault]):
    """Errors of an input, collected so that all are in one report."""

    def add(self, path: str, problem: str, hint: str = "") -> None:
        """Adds an error."""
        self.append(Fault(path, problem, hint))

    def attempt(
        self, make: Callable[..., Made], *arguments: Any, **named: Any
    ) -> Made | None:
        """Result of `make`, or `None` where it raises an `InputError`, whose errors are
        added."""
        try:
            return make(*arguments, **named)
        except InputError as error:
            self.extend(error.faults)
            return None

    def unless(self, good: object, name: str, value: object, hint: str) -> None:
        """Adds that a setting is out of range, unless it is `good`."""
        if not good:
            self.add(name, f"{value!r} is out of range", hint)

    def share(self, name: str, value: float, example: float) -> None:
        """Adds that a setting is not between 0 and 1, unless it is."""
        if not 0 < value < 1:
            self.add(
                name, f"{value!r} is not a share", f"between 0 and 1, as {example:g}"
            )

    def choice(self, name: str, value: object, known: Iterable[str]) -> None:
        """Adds that a setting is unknown, unless it is one of those known."""
        if value not in (known := tuple(known)):
            self.add(name, f"{value!r} is unknown", f"one of {', '.join(known)}")

    def report(self) -> None:
        """Raises `InputError` if anything is wrong."""
        if self:
            raise InputError([*dict.fromkeys(self)])
