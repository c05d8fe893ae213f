"""Fresh processes as a user starts them, in processor time of all that they started,
and the unit: `import jax`."""

import contextlib
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Self

ROOT = pathlib.Path(__file__).resolve().parents[1]
#: set for the benchmark's own process, not for a user's, whose Python also keeps the
#: bytecode of what it imports
_OURS = (
    "XLA_FLAGS",
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "JAX_COMPILATION_CACHE_DIR",
    "PYTHONDONTWRITEBYTECODE",
    "PYTHONPYCACHEPREFIX",
)
#: a process that imports JAX and ends
_UNIT = ["-c", "import jax"]


class Done(NamedTuple):
    """A process: its processor time (s) and what it printed."""

    cpu: float
    out: str


def fresh(arguments: Sequence[str], cache: str | None = None, code: int = 0) -> Done:
    """Runs Python with these arguments in a fresh process.

    - `cache`: folder for whatever is kept between processes; `None`: one that is empty
    - `code`: the exit code that it has to come to
    """
    if cache is None:
        with tempfile.TemporaryDirectory() as empty:
            return fresh(arguments, empty, code)
    environment = {
        name: value for name, value in os.environ.items() if name not in _OURS
    }
    environment |= {
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        "XDG_CACHE_HOME": cache,
        "SIMBRAKE_CACHE_DIR": os.path.join(cache, "simbrake"),
        "TF_CPP_MIN_LOG_LEVEL": "3",
    }
    before = _children()
    done = subprocess.run(
        [sys.executable, *arguments],
        env=environment,
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    cpu = _children() - before
    if done.returncode != code:
        raise RuntimeError(
            f"python {' '.join(arguments)[:200]} ended with "
            f"{done.returncode}:\n{done.stderr[-2000:]}"
        )
    return Done(cpu, done.stdout)


def _children() -> float:
    """Processor time of all children that have ended, and of theirs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@contextlib.contextmanager
def cache_folder() -> Iterator[str]:
    """An empty folder for what is kept between processes."""
    with tempfile.TemporaryDirectory(prefix="cache") as folder:
        yield folder


class Rounds(NamedTuple):
    """Processor time of several processes, once per round, and the unit of that round:
    other work meets all alike."""

    units: list[float]
    cpu: dict[str, list[float]]

    @classmethod
    def of(cls, count: int, turn: Callable[[], dict[str, float]]) -> Self:
        """`count` rounds: the unit, then what `turn` measures."""
        fresh(_UNIT)  # from now on its files are in memory
        found = cls([], {})
        for _ in range(count):
            found.units.append(fresh(_UNIT).cpu)
            for name, cpu in turn().items():
                found.cpu.setdefault(name, []).append(cpu)
        return found

    def seconds(self, name: str) -> float:
        """Median processor time."""
        return statistics.median(self.cpu[name])

    def in_units(self, name: str, less: float = 0.0) -> float:
        """Median over the rounds of processor time, `less` taken off, in units of its
        round."""
        return statistics.median(
            (x - less) / u for x, u in zip(self.cpu[name], self.units, strict=True)
        )
