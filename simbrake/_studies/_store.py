"""Chunks of an ensemble on disk, so that a restart only runs what is missing."""

import dataclasses
import hashlib
import json
import os
import types
import zipfile
from pathlib import Path
from typing import Any
from uuid import uuid4

import jax
import numpy as np

from .._base._faults import Fault, InputError

_FORMAT = 1


def fingerprint(*parts: Any) -> str:
    """A hash of values, structures and functions that is the same in every process."""
    digest = hashlib.sha256()
    _feed(digest.update, parts)
    return digest.hexdigest()


def _feed(update: Any, part: Any) -> None:
    if isinstance(part, jax.Array | np.ndarray | np.generic | float | int):
        array = np.asarray(part)
        update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())
    elif isinstance(part, types.FunctionType):
        update(f"{part.__module__}.{part.__qualname__}".encode() + part.__code__.co_code)
        inner = [c.cell_contents for c in part.__closure__ or ()]
        _feed(update, [part.__defaults__, inner, part.__code__.co_names, *_constants(part.__code__)])
    elif dataclasses.is_dataclass(part) and not isinstance(part, type):
        update(type(part).__qualname__.encode())
        _feed(update, {field.name: getattr(part, field.name, None) for field in dataclasses.fields(part)})
    elif isinstance(part, dict):
        _feed(update, [*part.items()])
    elif isinstance(part, tuple | list):
        update(f"({len(part)}".encode())
        for one in part:
            _feed(update, one)
    elif part is None or isinstance(part, str | bytes):
        update(repr(part).encode())
    else:
        named = getattr(part, "__qualname__", None)
        update((named or type(part).__qualname__).encode())


def _constants(code: types.CodeType) -> list[Any]:
    """Constants of a function, those of functions inside it as well."""
    found: list[Any] = []
    for constant in code.co_consts:
        found += [constant.co_code, *_constants(constant)] if isinstance(constant, types.CodeType) else [constant]
    return [c for c in found if c is None or isinstance(c, str | bytes | float | int | tuple)]


class Store:
    """A folder with a manifest and a file for every finished chunk, each written whole or not at all."""

    def __init__(self, folder: Path, key: str, about: dict[str, Any] | None):
        self.folder, self.key = Path(folder), key
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError([Fault("directory", f"{folder} is a file", "give a folder")])
        manifest = self.folder / "manifest.json"
        if manifest.exists():
            self._compare(manifest, key, about or {})
            return
        if about is None:
            raise InputError([Fault("directory", f"{manifest} is not there")])
        if self.folder.is_dir() and any(self.folder.iterdir()):
            what = f"{folder} holds other files and no manifest of an ensemble"
            raise InputError([Fault("directory", what, "give a new or an empty folder")])
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"format": _FORMAT, "fingerprint": key, **about}, indent=2)
        self._replace(manifest, lambda file: file.write(text.encode() + b"\n"))

    def _compare(self, manifest: Path, key: str, about: dict[str, Any]) -> None:
        try:
            there = json.loads(manifest.read_text("utf-8"))
        except (OSError, ValueError) as error:
            fault = Fault("directory", f"{manifest} cannot be read: {error}", "give another folder")
            raise InputError([fault]) from error
        if there.get("fingerprint") == key and there.get("format") == _FORMAT:
            return
        differ = [name for name, value in about.items() if there.get(name) != value]
        what = ", ".join(differ) or "numbers or structure of the scene, or the values"
        hint = "give another folder, or remove this one if its runs are no longer wanted"
        raise InputError([Fault("directory", f"{self.folder} holds another ensemble: {what} differ", hint)])

    def _replace(self, file: Path, write: Any) -> None:
        scratch = file.with_name(f".{file.name}.{uuid4().hex[:8]}")
        try:
            with open(scratch, "wb") as out:
                write(out)
                out.flush()
                os.fsync(out.fileno())
            os.replace(scratch, file)
        finally:
            scratch.unlink(missing_ok=True)

    def _file(self, runs: np.ndarray, limit: int) -> Path:
        mark = hashlib.sha256(np.asarray(runs, np.int64).tobytes() + str(limit).encode()).hexdigest()[:16]
        return self.folder / f"chunk-{int(runs[0]):08d}-{mark}.npz"

    def write(self, runs: np.ndarray, limit: int, columns: dict[str, np.ndarray], final: np.ndarray) -> None:
        """Keeps the numbers of a chunk; `final` marks the runs that are not repeated with a higher limit."""
        file = self._file(runs, limit)
        if not file.exists():
            arrays: dict[str, Any] = {"run": runs, "final": final, **{f"_{name}": c for name, c in columns.items()}}
            self._replace(file, lambda out: np.savez(out, **arrays))

    def read(self, runs: np.ndarray, limit: int) -> dict[str, np.ndarray] | None:
        """Numbers of a chunk that was kept, `None` if it was not."""
        found = _load(self._file(runs, limit))
        return None if found is None else found[2]

    def finished(self) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
        """All runs that are done, chunk by chunk."""
        kept = [_load(file) for file in sorted(self.folder.glob("chunk-*.npz"))]
        return [
            (runs[final], {name: column[final] for name, column in columns.items()})
            for runs, final, columns in filter(None, kept)
        ]


def _load(file: Path) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]] | None:
    """Runs, which of them are final, and columns; a file that a full disk or the like has spoilt counts as missing."""
    try:
        with np.load(file) as data:
            return data["run"], data["final"], {name[1:]: data[name] for name in data.files if name.startswith("_")}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def store_at(folder: Path, key: str) -> Store | None:
    """The same folder seen from another process, `None` where it is not there."""
    try:
        return Store(folder, key, None)
    except InputError:
        return None
