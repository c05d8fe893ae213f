"""The cache on disk of what depends on the structure of a scene alone: compiled
programs, and facts about parts.

The folder is `SIMBRAKE_CACHE_DIR` (empty: none), else `simbrake/programs` in the user's
cache folder. Its files are run and unpickled, so nobody else may have written them: the
folder has the mode 0700, it and all folders above it belong to the user or to root,
nobody else may write to them, and no symbolic link leads there.

The name of a file is the hash of all that its content depends on: the structure
(classes, static fields, shapes), the versions and sources of simbrake and of what it
computes with, and the device. User-defined classes and functions may change without any
of these, and are not cached.
"""

import contextlib
import dataclasses
import enum
import functools
import hashlib
import logging
import os
import pickle
import platform
import stat
import sys
import tempfile
import time
import types
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import jax
import numpy as np

_Answer = TypeVar("_Answer")

FOLDER_VARIABLE = "SIMBRAKE_CACHE_DIR"
SIZE_VARIABLE = "SIMBRAKE_CACHE_SIZE"
#: MB that all files together may take; the files unused for longest go first
DEFAULT_SIZE = 512.0
#: the first bytes of every file; another number here makes earlier files unreadable
_MAGIC = b"simbrake cache 1\n"
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


class UnknownStructureError(Exception):
    """Something whose meaning is not fixed by its name and the versions of known
    packages."""


# --- what identifies a structure ----------------------------------------------------


def canonical(value: Any, static: bool = False, by_name: bool = False) -> str:
    """A text that is the same in every process for the same structure: classes, static
    values, shapes.

    The numbers in arrays belong to it only where they are `static`. Raises
    `UnknownStructureError` for user-defined classes and functions, unless these too are
    told apart `by_name` alone.
    """
    text = functools.partial(canonical, static=static, by_name=by_name)
    name_of = functools.partial(_name, unknown=by_name)
    if value is None or isinstance(value, bool | int | float | complex | str | bytes):
        return repr(value)
    if isinstance(value, enum.Enum):
        return f"{name_of(type(value))}.{value.name}"
    if isinstance(value, type | types.FunctionType | types.BuiltinFunctionType):
        return name_of(value)
    if isinstance(value, tuple | list):
        return f"{name_of(type(value))}({','.join(text(entry) for entry in value)})"
    if isinstance(value, dict):
        return f"{{{','.join(f'{text(key)}:{text(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, np.ndarray | np.generic | jax.Array | jax.ShapeDtypeStruct):
        digest = (
            hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
            if static
            else ""
        )
        return f"{value.dtype}{list(value.shape)}{digest}"
    if isinstance(value, functools.partial):  # those of JAX too
        return f"{name_of(type(value))}{text((value.func, value.args, value.keywords))}"
    if isinstance(value, jax.tree_util.PyTreeDef):
        return text(jax.tree.unflatten(value, [_LEAF] * value.num_leaves))
    if isinstance(value, types.MethodType):
        return text((value.__func__, value.__self__))
    if isinstance(value, np.dtype):
        return str(value)
    if dataclasses.is_dataclass(value):
        fields = [
            f"{field.name}={text(getattr(value, field.name), static=static or field.metadata.get('static', False))}"
            for field in dataclasses.fields(value)
        ]
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
    """Versions, sources and the processor: what was compiled for one is of no use on
    another."""
    package = Path(__file__).parents[1]
    sources = []
    for folder, _, files in os.walk(package):
        for file in sorted(files):
            if not file.endswith((".pyc", ".pyi")):
                about = os.stat(os.path.join(folder, file))
                sources.append(
                    f"{os.path.relpath(folder, package)}/{file} {about.st_size} {about.st_mtime_ns}"
                )
    lines = [sys.version, *sorted(sources)]
    for name in LIBRARIES:
        with contextlib.suppress(PackageNotFoundError):
            lines.append(f"{name} {version(name)}")
    return "\n".join([*lines, *_processor()])


def _processor() -> list[str]:
    about = [platform.machine(), platform.system(), str(os.cpu_count())]
    with contextlib.suppress(OSError), open("/proc/cpuinfo", "rb") as file:
        first = file.read(16384).decode("ascii", "replace").split("\n\n")[0]
        about += [
            line
            for line in first.splitlines()
            if line.startswith(("model", "flags", "Features", "CPU"))
        ]
    return about


def key_of(name: str, subject: Any, device: Any = None) -> str | None:
    """Name of the file of a program or fact; `None` for what cannot be cached."""
    if (
        jax.config.jax_disable_jit
        or jax.config.jax_debug_nans
        or jax.config.jax_debug_infs
    ):  # pyright: ignore
        return None
    try:
        text = canonical(subject)
    except UnknownStructureError:
        return None
    place = (
        ""
        if device is None
        else f"{device.platform} {device.device_kind} {device.client.platform_version}"
    )
    settings = (
        f"{jax.config.jax_default_matmul_precision} {os.environ.get('XLA_FLAGS', '')}"  # pyright: ignore
    )
    whole = "\n".join([name, text, place, settings, _surroundings()])
    return f"{name}-{hashlib.sha256(whole.encode()).hexdigest()[:40]}"


def of_jax() -> bool:
    """Whether JAX's own cache of compiled programs is on
    (`JAX_COMPILATION_CACHE_DIR`)."""
    return bool(jax.config.jax_compilation_cache_dir)  # pyright: ignore


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
        body = content[len(_MAGIC) + _DIGEST :]
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
            if total > limit() * 1e6 or forgotten:
                self.remove(entry.name)


def limit() -> float:
    """Maximum size of all files together in MB."""
    try:
        return max(0.0, float(os.environ.get(SIZE_VARIABLE, DEFAULT_SIZE)))
    except ValueError:
        return DEFAULT_SIZE


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


@contextlib.contextmanager
def _reported(name: str) -> Iterator[None]:
    """Report an error of a file in one line and remove the file, which is then written
    again."""
    try:
        yield
    except Exception as error:  # whatever a damaged file or another system leads to
        _log.warning(
            "simbrake: cache file %s is unusable and will be replaced: %s",
            name,
            _words(error) or type(error).__name__,
        )
        store = folder()
        if store is not None:
            with contextlib.suppress(OSError):
                store.remove(name)


def read(key: str | None, restore: Callable[[Any], _Answer]) -> _Answer | None:
    """Return `restore(content)` of the file with this key; `None` if there is none, or
    none that is usable."""
    if key is None or (store := folder()) is None:
        return None
    with _reported(key):
        body = store.read(key)
        return None if body is None else restore(pickle.loads(body))
    return None


def write(key: str | None, content: Callable[[], Any]) -> None:
    """Write what `content` returns to the file with this key, if possible."""
    if key is None or (store := folder()) is None:
        return
    try:
        store.write(key, pickle.dumps(content(), pickle.HIGHEST_PROTOCOL))
    # a full disk; something that cannot be pickled; a device that cannot store programs
    except Exception as error:
        _unwritable(
            error.strerror
            if isinstance(error, OSError) and error.strerror
            else f"{error}"
        )


@functools.cache
def _unwritable(words: str) -> None:
    _log.warning("simbrake: a compiled program is not cached: %s", words)


def cached(name: str, subject: Any, find: Callable[[], _Answer]) -> _Answer:
    """Return `find()`, which depends only on the structure of the `subject`; computed
    once and cached on disk."""
    key = key_of(name, subject)
    content = read(key, lambda answer: (answer,))
    if content is not None:
        return content[0]
    answer = find()
    write(key, lambda: answer)
    return answer
