"""What is found once and kept: compiled programs, and facts about the structure of a
scene. An answer is looked up in memory, then in a folder on disk, and only then made.

Memory has a bound, from which the answers used least recently go.

The folder is `SIMBRAKE_CACHE_DIR` (empty: none), else `simbrake/programs` in the user's
cache folder. Its files are run and unpickled, so nobody else may have written them: the
folder has the mode 0700, it and all folders above it belong to the user or to root,
nobody else may write to them, and no symbolic link leads there.

The name of a file is the hash of all that its content depends on: the structure
(classes, static fields, shapes), the versions and sources of simbrake and of what it
computes with, and the device. User-defined classes and functions may change without any
of these, and are not kept on disk.
"""

import contextlib
import ctypes
import dataclasses
import enum
import functools
import gc
import hashlib
import itertools
import logging
import os
import pickle
import platform
import stat
import sys
import tempfile
import threading
import time
import types
from collections import OrderedDict
from collections.abc import Callable, Hashable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import jax
import numpy as np

from ._packing import Packing

_Answer = TypeVar("_Answer")

MEMORY_VARIABLE = "SIMBRAKE_PROGRAM_MEMORY"
FOLDER_VARIABLE = "SIMBRAKE_CACHE_DIR"
SIZE_VARIABLE = "SIMBRAKE_CACHE_SIZE"
#: MB that answers may take in memory, and all files together
DEFAULT_MEMORY = 320.0
DEFAULT_SIZE = 512.0
#: MB that an answer takes which is no program, with its key
_SMALL = 0.02
#: the first bytes of every file; another number here makes earlier files unreadable
_MAGIC = b"simbrake cache 2\n"
_DIGEST = hashlib.sha256().digest_size
#: packages of whose classes and functions everything is known by their versions
_KNOWN = (
    "simbrake",
    "jax",
    "jaxlib",
    "numpy",
    "equinox",
    "diffrax",
    "jaxtyping",
    "builtins",
    "functools",
)

#: libraries that simbrake computes with
LIBRARIES = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "optimistix", "lineax")

_log = logging.getLogger("simbrake")


def _megabytes(variable: str, default: float) -> float:
    try:
        return max(0.0, float(os.environ.get(variable, default)))
    except ValueError:
        return default


def memory_bound() -> float:
    """MB that all answers in memory may take; looked up when one is made."""
    return _megabytes(MEMORY_VARIABLE, DEFAULT_MEMORY)


def size_bound() -> float:
    """MB that all files together may take; those unused for longest go first."""
    return _megabytes(SIZE_VARIABLE, DEFAULT_SIZE)


# --- in memory ----------------------------------------------------------------------


class Memory:
    """Answers by key, as many as the bound allows, the last one in any case.

    What has gone is found again when it is next asked for. Whoever holds an answer (a
    `Prepared`, a run in another thread) keeps it alive.
    """

    def __init__(self) -> None:
        self._answers: OrderedDict[Hashable, tuple[Any, float]] = OrderedDict()
        self._lock = threading.Lock()
        self._locks: dict[Hashable, Any] = {}
        self.megabytes = 0.0
        self._gone = 0.0  # MB, since JAX's caches were cleared

    def get(
        self,
        key: Hashable,
        make: Callable[[], _Answer],
        size: Callable[[_Answer], float] = lambda _: _SMALL,
    ) -> _Answer:
        """The answer of a key, made where there is none; of several threads one makes
        it, the others wait.

        `size(answer)`: estimate of the memory that it takes, in MB.
        """
        known = self._answers.get(key)
        if known is None:
            with self._locks.setdefault(key, threading.RLock()):
                known = self._answers.get(key)
                if known is None:
                    answer = make()
                    known = answer, size(answer)
                    self._add(key, known)
            self._locks.pop(key, None)
        with contextlib.suppress(KeyError):  # another thread has dropped it
            self._answers.move_to_end(key)
        return known[0]

    def _add(self, key: Hashable, known: tuple[Any, float]) -> None:
        bound = memory_bound()
        with self._lock:
            self._answers[key] = known
            self.megabytes += known[1]
            while self.megabytes > bound and len(self._answers) > 1:
                _, (_, size) = self._answers.popitem(last=False)
                self.megabytes -= size
                self._gone += size
            full = self._gone > bound
            if full:
                self._gone = 0.0
        if full:
            # JAX keeps some 4 MB of each structure that it has traced, and glibc keeps
            # what was freed: without both 1000 structures would take 5 GB
            jax.clear_caches()
            gc.collect()
            with contextlib.suppress(OSError, AttributeError, TypeError):
                ctypes.CDLL(None).malloc_trim(0)

    def forget(self) -> None:
        """Drop all answers."""
        with self._lock:
            self._answers.clear()
            self.megabytes = 0.0


#: of the process
MEMORY = Memory()


# --- what identifies a structure ----------------------------------------------------


class UnknownStructureError(Exception):
    """Something whose meaning is not fixed by its name and the versions of known
    packages."""


def canonical(value: Any, static: bool = False, by_name: bool = False) -> str:
    """A text that is the same in every process for the same structure: classes, static
    values, shapes.

    The numbers in arrays belong to it only where they are `static`. Raises
    `UnknownStructureError` for user-defined classes and functions, unless these too are
    told apart `by_name` alone.
    """
    text = functools.partial(canonical, static=static, by_name=by_name)
    name_of = functools.partial(_name, unknown=by_name)
    if value is None or isinstance(
        value, bool | int | float | complex | str | bytes | np.dtype
    ):
        return repr(value)
    if isinstance(value, enum.Enum):
        return f"{name_of(type(value))}.{value.name}"
    if isinstance(value, type | types.FunctionType | types.BuiltinFunctionType):
        return name_of(value)
    if isinstance(value, tuple | list):
        return f"{name_of(type(value))}({','.join(text(entry) for entry in value)})"
    if isinstance(value, dict):
        entries = [f"{text(key)}:{text(entry)}" for key, entry in value.items()]
        return f"{{{','.join(entries)}}}"
    if isinstance(value, np.ndarray | np.generic | jax.Array | jax.ShapeDtypeStruct):
        about = f"{value.dtype}{list(value.shape)}"
        if not static:
            return about
        return about + hashlib.sha256(np.asarray(value).tobytes()).hexdigest()
    if isinstance(value, functools.partial):  # those of JAX too
        return f"{name_of(type(value))}{text((value.func, value.args, value.keywords))}"
    if isinstance(value, jax.tree_util.PyTreeDef):
        return text(jax.tree.unflatten(value, [_LEAF] * value.num_leaves))
    if isinstance(value, types.MethodType):
        return text((value.__func__, value.__self__))
    if dataclasses.is_dataclass(value):
        fields = []
        for field in dataclasses.fields(value):
            is_static = static or field.metadata.get("static", False)
            entry = text(getattr(value, field.name), static=is_static)
            fields.append(f"{field.name}={entry}")
        return f"{name_of(type(value))}({','.join(fields)})"
    if by_name:
        return name_of(type(value))
    raise UnknownStructureError(_name(type(value), unknown=True))


_LEAF = jax.ShapeDtypeStruct((), np.dtype(bool))


def _name(named: Any, unknown: bool) -> str:
    """Module and name of a class or function of a known package, or of an `unknown` one
    too."""
    module = getattr(named, "__module__", None) or "builtins"
    name = named.__qualname__
    if unknown:
        return f"{module}.{name}"
    if (
        module.partition(".")[0] not in _KNOWN
        or "<" in name
        or "__wrapped__" in getattr(named, "__dict__", {})
    ):
        raise UnknownStructureError(f"{module}.{name}")
    return f"{module}.{name}"


@functools.cache
def versions() -> dict[str, str]:
    """Versions of everything that the numbers of a run depend on, and a hash of
    simbrake's source, which changes without its version in a working copy."""
    source = hashlib.sha256()
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        source.update(file.read_bytes())
    libraries = {name: version(name) for name in ("simbrake", *LIBRARIES)}
    python = ".".join(platform.python_version_tuple()[:2])
    return libraries | {"source of simbrake": source.hexdigest(), "Python": python}


@functools.cache
def _surroundings() -> str:
    """Versions and the processor: what was compiled for one is of no use on another."""
    about = [*map(str, versions().items()), sys.platform, platform.machine()]
    about.append(str(os.cpu_count()))
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        first = itertools.takewhile(str.strip, file)
        kinds = ("model", "flags", "Features", "CPU")
        about += [line for line in first if line.startswith(kinds)]
    return "\n".join(about)


def file_of(name: str, subject: Any, device: Any = None) -> str | None:
    """Name of the file of an answer; `None` for what cannot be kept."""
    config: Any = jax.config
    if config.jax_disable_jit or config.jax_debug_nans or config.jax_debug_infs:
        return None
    try:
        text = canonical(subject)
    except UnknownStructureError:
        return None
    place = ""
    if device is not None:
        client = device.client
        place = f"{device.id} {device.device_kind} {client.platform_version}"
    flags = os.environ.get("XLA_FLAGS", "")
    settings = f"{config.jax_default_matmul_precision} {flags}"
    whole = "\n".join([name, text, place, settings, _surroundings()])
    return f"{name}-{hashlib.sha256(whole.encode()).hexdigest()[:40]}"


# --- the folder ---------------------------------------------------------------------


class _UnsafeError(OSError):
    """A folder to which another user could write."""


def place() -> Path | None:
    """Folder of the cache, looked up at each call; `None` if the cache is switched
    off."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen is None:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.join(
            os.path.expanduser("~"), ".cache"
        )
        # (who has no home gets "~" for it)
        chosen = (
            os.path.join(base, "simbrake", "programs") if os.path.isabs(base) else ""
        )
    return Path(os.path.abspath(chosen)) if chosen else None


def _require_private(path: Path) -> None:
    """Make a folder if need be, of mode 0700. Raises `OSError` where another user could
    write to it or replace it."""
    uid = os.getuid()
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    for folder in (path, *path.parents[:-1]):
        about = folder.lstat()
        own = folder == path
        if stat.S_ISLNK(about.st_mode) and folder.parent != Path(
            path.anchor
        ):  # only root can put one there
            raise _UnsafeError(f"{folder} is a symbolic link")
        about = folder.stat()
        if about.st_uid not in ((uid,) if own else (uid, 0)):
            raise _UnsafeError(f"{folder} belongs to another user")
        # (in a folder as /tmp nobody can replace what belongs to somebody else)
        if about.st_mode & 0o022 and (own or not about.st_mode & stat.S_ISVTX):
            raise _UnsafeError(f"others may write to {folder} (chmod go-w helps)")
    path.chmod(0o700)


class Entry(NamedTuple):
    """One file of the folder: its name, its size in bytes and when it was last used (s
    since 1970)."""

    name: str
    size: int
    used: float


class Folder:
    """A private folder. All its methods raise `OSError`."""

    def __init__(self, path: Path) -> None:
        if os.name != "posix":
            raise _UnsafeError(
                "owners and modes of folders are not known on this system"
            )
        _require_private(path)
        self.path = path

    def read(self, name: str) -> bytes | None:
        """The content of a file, `None` if there is none. Raises `ValueError` if it is
        damaged."""
        file = self.path / name
        try:
            about = file.lstat()
            if (
                not stat.S_ISREG(about.st_mode)
                or about.st_uid != os.getuid()
                or about.st_mode & 0o077
            ):
                raise _UnsafeError(f"{file} is not a private file")
            content = file.read_bytes()
            os.utime(file)
        except FileNotFoundError:
            return None
        head = len(_MAGIC) + _DIGEST
        body = content[head:]
        if content[:head] != _MAGIC + hashlib.sha256(body).digest():
            raise ValueError(f"{file} is damaged")
        return body

    def write(self, name: str, body: bytes) -> None:
        """Put a whole file in its place at once, or none."""
        with tempfile.NamedTemporaryFile(
            dir=self.path, prefix=".", delete=False
        ) as file:
            try:
                file.write(_MAGIC + hashlib.sha256(body).digest() + body)
                file.flush()
                os.replace(file.name, self.path / name)
            except BaseException:
                os.unlink(file.name)
                raise
        self._shrink()

    def remove(self, name: str) -> None:
        (self.path / name).unlink(missing_ok=True)

    def entries(self) -> list[Entry]:
        """All files, the one used last first."""
        entries = []
        for file in self.path.iterdir():
            with contextlib.suppress(
                FileNotFoundError
            ):  # another process has removed it
                about = file.lstat()
                if stat.S_ISREG(about.st_mode):
                    entries.append(Entry(file.name, about.st_size, about.st_mtime))
        return sorted(entries, key=lambda entry: -entry.used)

    def _shrink(self) -> None:
        total = 0
        for entry in self.entries():
            total += entry.size
            forgotten = (
                entry.name.startswith(".") and time.time() - entry.used > 3600
            )  # of a process that was killed
            if total > size_bound() * 1e6 or forgotten:
                self.remove(entry.name)


@functools.lru_cache(maxsize=4)
def _opened(path: Path) -> Folder | None:
    try:
        return Folder(path)
    except OSError as error:
        _log.warning(
            "simbrake: compiled programs are not cached: %s; %s= turns this off",
            _words(error),
            FOLDER_VARIABLE,
        )
        return None


def _words(error: Exception) -> str:
    named = isinstance(error, OSError) and error.filename
    return f"{error.filename}: {error.strerror}" if named else str(error)  # pyright: ignore


def folder() -> Folder | None:
    """The opened folder; `None`, reported once in one line, if it cannot be used."""
    path = place()
    return None if path is None else _opened(path)


def kept_on_disk(
    file: str | None,
    make: Callable[[], _Answer],
    *,
    anew: bool = False,
    written: bool = True,
) -> _Answer:
    """The answer in a file of the folder; where there is none that is usable, it is
    made and written.

    `anew`: it is not read;  `written`: whether it may be written.
    """
    store = None if file is None else folder()
    if file is None or store is None:
        return make()
    try:
        body = None if anew else store.read(file)
        if body is not None:
            return pickle.loads(body)
    except Exception as error:  # whatever a damaged file or another system leads to
        words = _words(error) or type(error).__name__
        _log.warning(
            "simbrake: cache file %s is unusable and will be replaced: %s", file, words
        )
        with contextlib.suppress(OSError):
            store.remove(file)
    answer = make()
    if written:
        try:
            store.write(file, pickle.dumps(answer, pickle.HIGHEST_PROTOCOL))
        except Exception as error:  # a full disk, or what cannot be pickled
            _unwritable(getattr(error, "strerror", None) or str(error))
    return answer


@functools.cache
def _unwritable(words: str) -> None:
    _log.warning("simbrake: a compiled program is not cached: %s", words)


def kept(subject: tuple, make: Callable[[], _Answer]) -> _Answer:
    """`make()`, which depends on the structure of the `subject` (a name, and whatever
    it is about) alone: found once, kept in memory and on disk."""
    name, *rest = subject
    return MEMORY.get(subject, lambda: kept_on_disk(file_of(name, rest), make))


def trace_anew() -> None:
    """Forget all programs, and all answers that were found by tracing.

    JAX takes a user's function for the same one as before when a global value that it
    reads has changed.
    """
    MEMORY.forget()
    jax.clear_caches()


def cached_by_values(
    of: Callable[[Any], Any],
) -> Callable[[Callable[[Any], _Answer]], Callable[[Any], _Answer]]:
    """A function of a scene or part, found once for each set of numbers in `of(part)`,
    on which alone it depends.

    Numbers that are traced, or no arrays, are looked at anew.
    """

    def remembering(find: Callable[[Any], _Answer]) -> Callable[[Any], _Answer]:
        @functools.wraps(find)
        def answer(part: Any) -> _Answer:
            leaves, structure = jax.tree.flatten(of(part))
            if not all(type(leaf) is np.ndarray for leaf in leaves):
                return find(part)
            shapes = tuple(leaf.shape for leaf in leaves)
            kinds = tuple(leaf.dtype for leaf in leaves)
            numbers = b"".join([leaf.tobytes() for leaf in leaves])
            key = find, structure, shapes, kinds, numbers
            size = _SMALL + len(numbers) / 1e6
            return MEMORY.get(key, lambda: find(part), lambda _: size)

        return answer

    return remembering


def cached_by_structure(find: Callable[..., _Answer]) -> Callable[..., _Answer]:
    """A function of a part (a PyTree of numbers, traced ones included) whose answer
    holds for all of its numbers.

    It is found once for each structure: `find` gets shapes and types in place of
    numbers, and further arguments that can be hashed.
    """

    @functools.wraps(find)
    def answer(part: Any, *arguments: Hashable, **named: Hashable) -> _Answer:
        like = Packing.of(part)
        more = tuple(sorted(named.items()))
        subject = find.__name__, find, like, arguments, more
        return kept(subject, lambda: find(like.stand_in(), *arguments, **named))

    return answer
