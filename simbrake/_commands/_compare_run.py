"""The command `simbrake compare`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .._base._progress import Waiting
from .._run._simulate import simulate
from ..results._compare import compare, dumps


def run(a: Path, b: Path, read: Callable[[Path], Any], *, rtol: float = 1e-9, json_: bool = False) -> int:
    """Prints what differs between two results; 0: equal within `rtol`, 1: different.

    Each is a result file, a folder of `run --out`, or a scene (`.toml`, `.py`), which `read` gives and which is run.
    """
    with Waiting("compare", "reads") as told:
        first, second = (_source(path, read, told) for path in (a, b))
        told.now("compares")
        found = compare(first, second, rtol)
    print(dumps(found) if json_ else found)
    return 0 if found.equal else 1


def _source(path: Path, read: Callable[[Path], Any], told: Waiting) -> Any:
    scene = path.suffix.lower() in (".toml", ".py") and not path.is_dir()
    return simulate(read(path), throw=False, progress=told) if scene else path
