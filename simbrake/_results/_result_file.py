"""Results in files: netCDF, Parquet and CSV, each with everything that a data set holds, read back without loss."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._whole import whole_file
from .._run._result import Result
from ..studies._chunks import fingerprint
from ._columns import as_lines, from_lines, join, normalised, split
from ._labelled import FORMAT, dataset

_COMMENT = "# "
_CHECK = "checksum"


def save(result: Any, path: Any) -> Path:
    """Writes a result, or a data set of `simbrake.dataset`, to one file: whole, or not at all.

    By the suffix of `path`: `.nc` netCDF (classic, opened by xarray, MATLAB, Octave, R, Panoply …), `.parquet` (one
    row per time; needs `pip install 'simbrake[tables]'`), `.csv` (one row per time, the rest in lines that begin with
    `#`). `load` gives the same data set back, to the last bit. Raises `InputError`.
    """
    path = Path(path)
    kind = _kind_of(path)
    data = normalised(dataset(result) if isinstance(result, Result) else result)
    if data.attrs.get("format") != FORMAT:
        raise InputError([Fault(str(path), "what is to be saved is no result", "give a Result, or its dataset")])
    data.attrs[_CHECK] = _checksum(data)
    if path.is_dir():
        raise InputError([Fault(str(path), "is a folder", "give the name of a file")])
    with whole_file(path) as scratch:
        kind.write(data, scratch)
    return path


def load(path: Any) -> Any:
    """The data set (`xarray.Dataset`) of a result file, or of a folder of `simbrake run --out`.

    Raises `InputError` for a file that is not there, of another kind, damaged, or changed after it was written.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "result.nc"
    kind = _kind_of(path)
    if not path.is_file():
        names = sorted(p.name for p in path.parent.glob("*") if p.suffix in KINDS) if path.parent.is_dir() else []
        hint = f"there are: {', '.join(names[:8])}" if names else "give the path of a result"
        raise InputError([Fault(str(path), "there is no such file", hint)])
    try:
        data = normalised(kind.read(path))
        found = data.attrs.pop(_CHECK, None)
    except InputError:
        raise
    except Exception as error:  # whatever stands in somebody's file is told in one line
        words = f"cannot be read as a result ({type(error).__name__})"
        raise InputError([Fault(str(path), words, f"give {kind.name} as `simbrake.save` writes it")]) from error
    if data.attrs.get("format") != FORMAT:
        raise InputError([Fault(str(path), "is no result of a run", f"its attribute `format` would be {FORMAT!r}")])
    if found != _checksum(data):
        raise InputError([Fault(str(path), "is damaged, or was changed after it was written", "save the result again")])
    return data


def _checksum(data: Any) -> str:
    """A hash of everything in a normalised data set, the same for all file formats."""
    variables = {
        str(name): [list(map(str, variable.dims)), _bytes(variable.values), sorted(variable.attrs.items())]
        for name, variable in sorted({**data.coords, **data.data_vars}.items())
    }
    attrs = sorted((key, value) for key, value in data.attrs.items() if key != _CHECK)
    return fingerprint(sorted(map(str, data.coords)), variables, attrs)


def _bytes(values: np.ndarray) -> Any:
    return values.tolist() if values.dtype.kind == "U" else values.astype(values.dtype.newbyteorder("<"))


def _write_netcdf(data: Any, path: Path) -> None:
    data.to_netcdf(path, engine="scipy")


def _read_netcdf(path: Path) -> Any:
    import xarray as xr

    return xr.load_dataset(path, engine="scipy", decode_times=False)


def _write_csv(data: Any, path: Path) -> None:
    header, columns = split(data)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"{_COMMENT}{line}\n" for line in [FORMAT, *as_lines(header)])
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        # the shortest text that gives the very same number
        texts = ([x if isinstance(x, str) else repr(x) for x in column.tolist()] for column in columns.values())
        writer.writerows(zip(*texts, strict=True))


_PYTHON: dict[str, Callable[[str], Any]] = {"float64": float, "int64": int, "str": str}


def _read_csv(path: Path) -> Any:
    text = path.read_text("utf-8")
    if not text.startswith(f"{_COMMENT}{FORMAT}\n"):
        raise InputError([Fault(str(path), "is no result of a run", f"its first line would be {_COMMENT}{FORMAT}")])
    lines = text.split("\n")
    count = next(i for i, line in enumerate(lines) if not line.startswith(_COMMENT))
    header = from_lines([line.removeprefix(_COMMENT) for line in lines[1:count]])
    names, *rows = csv.reader(lines[count:-1])
    kinds = {name: about["kind"] for about in header["variables"].values() for name in about.get("columns", ())}
    cells = zip(*rows, strict=True)
    columns = {
        name: np.asarray([_PYTHON[kinds[name]](cell) for cell in column])
        for name, column in zip(names, cells, strict=True)
    }
    return join(header, columns)


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        hint = "pip install 'simbrake[tables]'"
        raise InputError([Fault("pyarrow", "is missing, which reads and writes Parquet", hint)]) from None
    return pyarrow


def _write_parquet(data: Any, path: Path) -> None:
    pa = _pyarrow()
    header, columns = split(data)
    meta = {"simbrake": json.dumps(header, ensure_ascii=False, allow_nan=False)}
    fields, arrays = [], []
    for about in header["variables"].values():
        for name in about.get("columns", ()):
            arrays.append(pa.array(columns[name]))
            fields.append(pa.field(name, arrays[-1].type, nullable=False, metadata=about["attrs"]))
    pa.parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=meta)), path)


def _read_parquet(path: Path) -> Any:
    pa = _pyarrow()
    table = pa.parquet.read_table(path, partitioning=None)
    text = (table.schema.metadata or {}).get(b"simbrake")
    if text is None:
        raise InputError([Fault(str(path), "is no result of a run", "its metadata would have an entry `simbrake`")])
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return join(json.loads(text), columns)


class Kind(NamedTuple):
    """A file format: its name, and how it is written and read."""

    name: str
    write: Callable[[Any, Path], None]
    read: Callable[[Path], Any]


#: file formats by suffix
KINDS = {
    ".nc": Kind("netCDF", _write_netcdf, _read_netcdf),
    ".parquet": Kind("Parquet", _write_parquet, _read_parquet),
    ".csv": Kind("CSV", _write_csv, _read_csv),
}


def _kind_of(path: Path) -> Kind:
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        hint = ", ".join(f"{suffix} ({one.name})" for suffix, one in KINDS.items())
        raise InputError([Fault(str(path), f"has the suffix {path.suffix!r}", f"there are: {hint}")])
    return kind
