"""Chunks of an ensemble: the pool of workers that computes them, and the folder that
keeps the finished ones."""

import contextlib
import dataclasses
import hashlib
import itertools
import json
import os
import queue
import signal
import threading
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import jax
import numpy as np

from .._base._faults import InputError, input_error, text_of_file, whole_file
from ..hybrid import Code
from .many_points import Columns, Job, run_chunk


@dataclasses.dataclass(frozen=True, eq=False)
class Task:
    """One chunk: which runs (from 0), and their numbers (runs, numbers)."""

    limit: int  # of the steps
    runs: np.ndarray
    rows: np.ndarray
    last: bool = True  # no higher limit of the steps follows

    def final(self, columns: Columns) -> np.ndarray:
        """Which runs are done: the others reached the limit of the steps and get a
        higher one."""
        return (columns["code"] != int(Code.STEP_LIMIT)) | self.last


class LostWorkersError(Exception):
    """Those who computed the chunks are gone for good, in words."""


class Pool:
    """Chunks at work on `workers`; `start` begins those of one job.

    `idle` is called about every half second without a result; it, and `lost` of an
    error in a chunk (`None`: cancelled by somebody else), raise `LostWorkersError`
    where none is to come.
    """

    def __init__(
        self,
        workers: int,
        start: Callable[[Job, list[Task]], list[Future[Columns]]],
        on_cpu: bool = True,
        *,
        idle: Callable[[], object] = lambda: None,
        lost: Callable[[BaseException | None], object] = lambda error: None,
    ) -> None:
        self.workers = workers
        self._start = start
        self.on_cpu = on_cpu
        self._idle = idle
        self._lost = lost
        self._waiting: dict[Future[Columns], Task] = {}
        self._ended = False
        self.check_interrupt: Callable[[], None] = lambda: None

    def submit(self, job: Job, tasks: list[Task]) -> None:
        self._waiting |= zip(self._start(job, tasks), tasks, strict=True)

    def results(self) -> Iterator[tuple[Task, Columns]]:
        """Finished tasks in the order in which they finish, until none is left."""
        while self._waiting:
            self.check_interrupt()
            # in between, Ctrl-C is handled
            finished, _ = wait(self._waiting, timeout=0.5, return_when=FIRST_COMPLETED)
            if not finished and not self._ended:
                self._idle()
            for future in finished:
                task = self._waiting.pop(future)
                cancelled = future.cancelled()
                error = None if cancelled else future.exception()
                if error is None and not cancelled:
                    yield task, future.result()
                elif not self._ended:
                    self._lost(error)
                    future.result()

    def cancel(self) -> None:
        """Start nothing new; what is running finishes and is among the results."""
        self._ended = True
        self._waiting = {
            future: task
            for future, task in self._waiting.items()
            if not future.cancel()
        }


@contextlib.contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """A function that raises `KeyboardInterrupt` after Ctrl-C, which is raised nowhere
    else meanwhile: in a callback of JAX it would be lost."""
    came = threading.Event()

    def check_interrupt() -> None:
        if came.is_set():
            came.clear()
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield check_interrupt
        return
    signal.signal(signal.SIGINT, lambda *_: came.set())
    try:
        yield check_interrupt
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextlib.contextmanager
def threads(workers: int | None) -> Iterator[Pool]:
    """Threads that each hand chunks to a compiled program, which runs outside of
    Python's lock: on a CPU one per core, on accelerators one per device, at most
    `workers`."""
    devices = jax.devices()
    free = queue.SimpleQueue[Any]()
    on_cpu = devices[0].platform == "cpu"
    count = len(devices)
    if on_cpu:
        cores = (
            len(os.sched_getaffinity(0))
            if "sched_getaffinity" in dir(os)
            else os.cpu_count() or 1
        )
        count = max(cores, count)
    count = count if workers is None else min(workers, count)
    for device in itertools.islice(itertools.cycle(devices), count):
        free.put(device)

    def run(job: Job, task: Task) -> Columns:
        device = free.get()
        try:
            return run_chunk(job, task.rows, device)
        finally:
            free.put(device)

    executor = ThreadPoolExecutor(count, thread_name_prefix="simbrake")
    try:
        yield Pool(
            count,
            lambda job, tasks: [executor.submit(run, job, task) for task in tasks],
            on_cpu,
        )
    finally:
        executor.shutdown(cancel_futures=True)


# --- finished chunks on disk --------------------------------------------------------


class Store:
    """A folder with a manifest and a file for every finished chunk, each written whole
    or not at all.

    The manifest has a hash of the study and, by name, what this is made of (`about`: a
    name with "the" is that of a hash), to tell what differs. Without `about` the folder
    is one that another process has begun.
    """

    def __init__(
        self, folder: Path, study: str, about: dict[str, object] | None = None
    ) -> None:
        self.folder = Path(folder)
        self.study = study
        manifest = self.folder / "manifest.json"
        if self.folder.exists() and not self.folder.is_dir():
            raise input_error("directory", f"{folder} is a file", "give a folder")
        if manifest.exists():
            self._compare(manifest, dict(about or {}))
            return
        if about is None:
            raise input_error("directory", f"{manifest} is not there")
        if self.folder.is_dir() and any(self.folder.iterdir()):
            what = f"{folder} holds other files and no manifest of an ensemble"
            raise input_error("directory", what, "give a new or an empty folder")
        text = json.dumps({"study": study, **about}, indent=2)
        with whole_file(manifest) as scratch:
            scratch.write_text(f"{text}\n", "utf-8")

    def _compare(self, manifest: Path, about: dict[str, Any]) -> None:
        try:
            there = json.loads(text_of_file(manifest, "a manifest"))
            there = {**there, **there.get("versions", {})}
        except (ValueError, TypeError, RecursionError) as error:
            words = (
                error.faults[0].problem
                if isinstance(error, InputError)
                else f"cannot be read: {error}"
            )
            raise input_error(
                "directory", f"{manifest} {words}", "give another folder"
            ) from error
        versions = about.pop("versions", {})
        here = {**about, **versions}
        differences = [
            f"{name} differs"
            if name.startswith("the ")
            else f"{name}: {there.get(name)} there, {value} here"
            for name, value in here.items()
            if there.get(name) != value
        ]
        if not differences and there.get("study") == self.study:
            return
        hint = (
            "give another folder, or remove this one if its runs are no longer wanted"
        )
        what = "; ".join(differences) or "the study differs"
        words = f"{self.folder} holds another ensemble: {what}"
        raise input_error("directory", words, hint)

    def _file(self, task: Task) -> Path:
        mark = hashlib.sha256(
            np.asarray(task.runs, np.int64).tobytes() + str(task.limit).encode()
        ).hexdigest()[:16]
        return self.folder / f"chunk-{int(task.runs[0]):08d}-{mark}.npz"

    def write(self, task: Task, columns: Columns) -> None:
        """Keeps the numbers of a chunk, and which of its runs are final."""
        file = self._file(task)
        if not file.exists():
            named: dict[str, Any] = {
                f"_{name}": column for name, column in columns.items()
            }
            with whole_file(file) as scratch:
                np.savez(scratch, run=task.runs, final=task.final(columns), **named)

    def read(self, task: Task) -> Columns | None:
        kept = _load(self._file(task))
        return None if kept is None else kept[2]

    def finished(self) -> Iterator[tuple[np.ndarray, Columns]]:
        for runs, final, columns in filter(
            None, map(_load, sorted(self.folder.glob("chunk-*.npz")))
        ):
            yield runs[final], {name: column[final] for name, column in columns.items()}


def _load(file: Path) -> tuple[np.ndarray, np.ndarray, Columns] | None:
    """Runs, which of them are final, and columns; a corrupted file (e.g. disk full)
    counts as missing."""
    try:
        with file.open("rb") as stream, np.load(stream) as data:
            return (
                data["run"],
                data["final"],
                {name[1:]: data[name] for name in data.files if name.startswith("_")},
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
