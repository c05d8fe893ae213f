"""Files that are written whole or not at all."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ._faults import Fault, InputError


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
