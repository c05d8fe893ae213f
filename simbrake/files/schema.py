"""Format of scene files: one description of every part, from which files are read and
written."""

import dataclasses
import functools
import inspect
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from .._base._faults import InputError
from .._base._part import Whole, about_of, alternatives, takes_values, unit_below
from .._base._quantity import Quantity
from ..brakes import _bands as _bands  # kinds of brake, found as subclasses
from ..brakes import _pressed as _pressed
from ..brakes._bands import MultiBandBrake
from ..brakes.design import AbstractBrake, Brake, Lining, uniform_linings
from ..hybrid.struct import Struct
from ..parts.programme import programme_scene
from ..parts.scene import AbstractDuty, Scene
from ..profiles import AbstractProfile, PiecewiseLinear, ramp
from ..profiles import held as samples_held
from ..runs import measure as measure  # limits, found as a subclass
from ..thermal._builders import (
    layered_heat,
    lumped_heat,
    with_external_pair,
    with_pulley_structure,
    with_water_jacket,
)
from ..thermal._coolant import Liquid, water
from ..thermal.heat import Heat


@takes_values
def history(
    file: Path,
    column: str,
    unit: str = "SI",
    time: str = "t",
    begin: Annotated[float, Quantity("s", "shift")] = 0.0,
    held: bool = False,
) -> PiecewiseLinear:
    """A profile of straight lines between the rows of a CSV file; every row is a time
    breakpoint, at which a step ends.

    - `column`, `time`: names of the columns; units stand in the header as
      `slack_tension [kN]`, `t [ms]`, SI without
    - `unit`: SI unit of the column;  `begin` (s) is added to the times
    - `held`: each value holds up to the next instead

    Two rows at one time are a jump. Rows with an empty cell, or a null value of a
    logger such as -999.25, are left out. Raises `InputError` with every error of the
    file: line, column, value and hint.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     np.savetxt(f"{folder}/a.csv", [[0, 2], [500, 12]], "%g", ",", header="t [ms],lever [kN]", comments="")
        ...     sb.files.history(f"{folder}/a.csv", "lever", "N")
        PiecewiseLinear(times=[0, 0.5] s, values=[2000, 12000])
    """
    return histories(file, {column: unit}, time, begin, held)[column]


@takes_values
def histories(
    file: str | Path,
    columns: Mapping[str, str],
    time: str = "t",
    begin: Annotated[float, Quantity("s", "shift")] = 0.0,
    held: bool = False,
) -> dict[str, PiecewiseLinear]:
    """Several columns of a CSV file as profiles, by name: `history` of each, with all
    errors of the file in one report.

    - `columns`: SI unit of each column, `{"speed": "m/s", "air": "K"}`

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     _ = (Path(folder) / "a.csv").write_text("t,v [km/h],air [degC]\\n0,36,20\\n1,72,25")
        ...     found = sb.files.histories(f"{folder}/a.csv", {"v": "m/s", "air": "K"})
        >>> [profile.values.tolist() for profile in found.values()]
        [[10.0, 20.0], [293.15, 298.15]]
    """
    from .._base._csv_file import CsvFile  # few scenes read a file

    table = CsvFile(Path(file))
    names = {head.name: i for i, head in enumerate(table.heads)}
    known = [name for name in (time, *columns) if name in names]
    if table.heads:
        there_are = f"there are: {', '.join(names)}"
        for name in {time, *columns} - {*known}:
            hint = f"{there_are}; time= names that of the times"
            table.fault(
                " header",
                f"has no column {name}",
                hint if name == time else there_are,
            )
    found = {
        name: table.column(
            names[name], columns.get(name, "s"), needed=name not in columns
        )
        for name in known
    }
    t = found.get(time, np.empty(0))
    profiles = {}
    for name in columns if time in found else ():
        there = np.isfinite(t) & np.isfinite(found.get(name, t))
        if name in found and not there.any():
            table.fault(f" column {name}", "has no value")
        if not table.faults:
            make = samples_held if held else PiecewiseLinear
            profiles[name] = make(t[there] + begin, found[name][there])
    back = np.flatnonzero(np.diff(t[np.isfinite(t)]) < 0)
    if back.size:
        line = table.places[np.isfinite(t)][back[0] + 1]
        table.fault(
            f" line {line}, column {time}",
            "is earlier than the line before",
            "sort the rows by time",
        )
    if table.faults:
        raise InputError(table.faults)
    return profiles


#: key of a scene file that says in which format it is written, and the present one
FORMAT = "format"
VERSION = "simbrake scene 1"
#: a class, or a function that makes an object of one
Maker: TypeAlias = Callable[..., object]
#: functions that make an object of a class, by name in a file as the classes themselves
#: are
BUILDERS: dict[type, tuple[Maker, ...]] = {
    Lining: (uniform_linings,),
    AbstractProfile: (ramp, history),
    Scene: (programme_scene,),
    Heat: (
        layered_heat,
        lumped_heat,
        with_pulley_structure,
        with_external_pair,
        with_water_jacket,
    ),
    Liquid: (water,),
}
#: families whose classes have no keys that would do for another one of them
TOLD_BY_KEYS: set[type] = {AbstractBrake, Brake, MultiBandBrake, AbstractDuty}


class Part(NamedTuple):
    """One field of a class, or parameter of a builder.

    - `kind`: `float` of a number, `eqx.Module` of an object, else `int`, `str`, `bool`
      or `Path` (a file), `None` of objects that a file cannot hold;  `many`: a list of
      them
    - `about`: of a number or whole number
    - `classes` of an object, which may also replace a number
    - `unit`: meaning of the unit `SI` below it, `SI` where that depends on the parent
    """

    name: str
    kind: type | None
    about: Quantity | Whole | None
    classes: tuple[type, ...]
    many: bool
    nullable: bool
    default: object
    unit: str

    @property
    def needed(self) -> bool:
        return self.default is dataclasses.MISSING and not self.nullable

    @property
    def makers(self) -> dict[str, Maker]:
        return makers_of(self.classes)

    def unit_at(self, unit: str) -> str:
        """Unit of the field where `SI` means `unit`."""
        return unit if self.unit == "SI" else self.unit


#: kinds beside numbers and objects: in words, and in JSON Schema
PLAIN = {
    int: ("whole number", "integer"),
    str: ("text", "string"),
    bool: ("true or false", "boolean"),
    Path: ("CSV file", "string"),
}


@functools.cache
def parts_of(maker: Maker) -> tuple[Part, ...]:
    """The fields of a class, or the parameters of a builder, in their order.

    Without the unit of a history's column: in a file it is that of the field that holds
    the history.
    """
    if isinstance(maker, type):
        hints = typing.get_type_hints(maker)
        fields = [field for field in dataclasses.fields(maker) if field.init]
        return tuple(_of_field(field, hints[field.name]) for field in fields)
    annotated = inspect.unwrap(maker)
    hints = typing.get_type_hints(annotated, include_extras=True)
    parameters = [
        parameter
        for parameter in inspect.signature(annotated).parameters.values()
        if parameter.name != "unit"
    ]
    return tuple(
        _of_parameter(parameter, hints[parameter.name]) for parameter in parameters
    )


def _of_field(field: dataclasses.Field, hint: object) -> Part:
    about = about_of(field, "SI") or field.metadata.get("whole")
    return _part(field.name, hint, about, field.default, unit_below(field, "SI"))


def _of_parameter(parameter: inspect.Parameter, hint: object) -> Part:
    about = None
    if typing.get_origin(hint) is Annotated:
        hint, about = typing.get_args(hint)
    default = (
        dataclasses.MISSING
        if parameter.default is inspect.Parameter.empty
        else parameter.default
    )
    return _part(
        parameter.name,
        hint,
        about,
        default,
        about.unit if isinstance(about, Quantity) else "SI",
    )


def _part(
    name: str, hint: object, about: Quantity | Whole | None, default: object, unit: str
) -> Part:
    many = typing.get_origin(hint) is tuple
    kinds = alternatives(typing.get_args(hint)[0] if many else hint)
    classes = tuple(t for t in kinds if isinstance(t, type) and issubclass(t, Struct))
    nullable = type(None) in kinds or default is None
    plain = Struct if classes else next((t for t in kinds if t in PLAIN), None)
    kind = float if isinstance(about, Quantity) else plain
    return Part(name, kind, about, classes, many, nullable, default, unit)


@functools.cache
def makers_of(classes: tuple[type, ...]) -> dict[str, Maker]:
    """Classes and builders that give one of the `classes` and can be written in
    a file: name → maker."""
    makers: dict[str, Maker] = {}
    for base in classes:
        family = [base]
        visited = set()
        while family:
            kind = family.pop(0)
            family += kind.__subclasses__()
            own = kind.__module__.partition(".")[0] == __name__.partition(".")[0]
            if (
                kind in visited
                or not own
                or kind.__name__.startswith(("Abstract", "_"))
            ):
                continue
            visited.add(kind)
            # custom functions cannot be written
            if all(part.kind for part in parts_of(kind)):
                makers[kind.__name__] = kind
        for builder in BUILDERS.get(base, ()):
            makers[builder.__name__] = builder
    return makers


def several(classes: tuple[type, ...]) -> bool:
    """Whether a table of one of the `classes` must name its own; builders are
    told by their keys."""
    if set(classes) <= TOLD_BY_KEYS:
        return False
    return sum(isinstance(maker, type) for maker in makers_of(classes).values()) > 1
