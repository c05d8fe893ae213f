"""Input and output errors in one report. Free of JAX, so that a command can report them before JAX loads.

Files are written whole or not at all.
"""

import contextlib
import dataclasses
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


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


class InputError(ValueError):
    """All errors of an input in one report.

    Example:
        >>> try:
        ...     sb.Pulley("590 kg", 1200)
        ... except sb.InputError as error:
        ...     print(error.faults[0].path)
        Pulley.radius
    """

    def __init__(self, faults: list[Fault]) -> None:
        self.faults = tuple(faults)
        count = "1 input error" if len(faults) == 1 else f"{len(faults)} input errors"
        super().__init__("\n".join([f"{count}:", *(f"  {fault}" for fault in faults)]))


# --- arguments of formulas --------------------------------------------------------------------------------------------


def require_positive(**values: Any) -> None:
    """Raise `ValueError` naming every value that is not a finite number above 0; `None` is not checked."""
    _require("positive", lambda x: x > 0, values)


def require_not_negative(**values: Any) -> None:
    """Raise `ValueError` naming every value that is not a finite number of at least 0; `None` is not checked."""
    _require("at least 0", lambda x: x >= 0, values)


def require_share(**values: Any) -> None:
    """Raise `ValueError` naming every value outside 0…1."""
    _require("between 0 and 1", lambda x: (x >= 0) & (x <= 1), values)


def _require(what: str, good: Callable[[Any], Any], values: dict[str, Any]) -> None:
    import numpy as np  # a command that only reports an error does not import it

    numbers = {name: np.asarray(value, float) for name, value in values.items() if value is not None}
    bad = [name for name, x in numbers.items() if not np.all(good(x) & np.isfinite(x))]
    if bad:
        raise ValueError("; ".join(f"{name} = {values[name]} must be {what}" for name in bad))


# --- files ------------------------------------------------------------------------------------------------------------


def existing_file(file: Path, *kinds: str) -> Path:
    """The file. Raises `InputError` naming the available files where the path is a folder or does not exist."""
    if file.exists() and not file.is_dir():
        return file
    folder = file if file.is_dir() else file.parent if file.parent.is_dir() else Path(".")
    there = sorted(str(one) for kind in kinds for one in folder.glob(kind))
    hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a scene file"
    raise InputError([Fault(str(file), "is a folder" if file.is_dir() else "there is no such file", hint)])


@contextlib.contextmanager
def _scratch_beside(place: Path) -> Iterator[Path]:
    """Temporary folder beside `place`, on the same disk; `InputError` where nothing can be written."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=".simbrake-", dir=place.parent))
        try:
            yield scratch
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise InputError([Fault(str(place), what, "give another place")]) from error


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Temporary path to write to; its file replaces `path` if no error occurred."""
    with _scratch_beside(path) as scratch:
        yield scratch / path.name
        os.replace(scratch / path.name, path)


@contextlib.contextmanager
def whole_folder(folder: Path) -> Iterator[tuple[Path, list[Path]]]:
    """Temporary folder whose files move to `folder` only if all were written; the list then names them."""
    written: list[Path] = []
    with _scratch_beside(folder) as scratch:
        yield scratch, written
        folder.mkdir(exist_ok=True)
        for file in sorted(scratch.iterdir()):
            os.replace(file, folder / file.name)
            written.append(folder / file.name)
