"""What is wrong with inputs and outputs, in one report; free of JAX, so that a command can say it before it loads.

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
    """One thing wrong with an input: where, what stands there, and what to do."""

    path: str
    problem: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}" + (f" — {self.hint}" if self.hint else "")


class InputError(ValueError):
    """All faults of an input in one report."""

    def __init__(self, faults: list[Fault]) -> None:
        self.faults = tuple(faults)
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        super().__init__("\n".join([f"the input has {count}:", *(f"  {fault}" for fault in faults)]))


# --- arguments of formulas --------------------------------------------------------------------------------------------


def require_positive(**values: Any) -> None:
    """Raises `ValueError` that names every value which is not a finite number above 0; `None` is not looked at."""
    _require("positive", lambda x: x > 0, values)


def require_not_negative(**values: Any) -> None:
    """Raises `ValueError` that names every value which is not a finite number of at least 0; `None` is left out."""
    _require("at least 0", lambda x: x >= 0, values)


def require_share(**values: Any) -> None:
    """Raises `ValueError` that names every value outside 0…1."""
    _require("between 0 and 1", lambda x: (x >= 0) & (x <= 1), values)


def _require(what: str, good: Callable[[Any], Any], values: dict[str, Any]) -> None:
    import numpy as np  # not paid for by a command that only reports an error

    numbers = {name: np.asarray(value, float) for name, value in values.items() if value is not None}
    bad = [name for name, x in numbers.items() if not np.all(good(x) & np.isfinite(x))]
    if bad:
        raise ValueError("; ".join(f"{name} = {values[name]} must be {what}" for name in bad))


# --- files ------------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _scratch_beside(place: Path) -> Iterator[Path]:
    """A folder beside `place`, on the same disk, that is gone afterwards; `InputError` where nothing can be written."""
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
    """A path to write to; what was written there becomes `path` if nothing went wrong, and replaces what was there."""
    with _scratch_beside(path) as scratch:
        yield scratch / path.name
        os.replace(scratch / path.name, path)


@contextlib.contextmanager
def whole_folder(folder: Path) -> Iterator[tuple[Path, list[Path]]]:
    """A folder to write into, whose files move to `folder` only if all could be written; the list names them then."""
    written: list[Path] = []
    with _scratch_beside(folder) as scratch:
        yield scratch, written
        folder.mkdir(exist_ok=True)
        for file in sorted(scratch.iterdir()):
            os.replace(file, folder / file.name)
            written.append(folder / file.name)
