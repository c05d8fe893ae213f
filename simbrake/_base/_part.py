"""Parts of a scene: fields with units, checked when a part is made, and the walk over a
scene, number by number."""

import dataclasses
import functools
import inspect
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, TypeVar, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ..hybrid.struct import Struct, struct_field, structural
from ._arguments import explained, with_nearest
from ._faults import Fault, Faults, Issues, of_radius
from ._numbers import plain_text, value_text
from ._packing import is_traced
from ._quantity import (
    IndexedBy,
    NumberReader,
    Quantity,
    as_number,
    example,
    has_units,
    in_si,
    shown,
    unit_suffix,
)
from ._table import rows_table

#: family of parts → class made from a bare number where one of them is expected
_SHORT: dict[type, type] = {}
#: numbers of a scene
_MOST_NUMBERS = 1_000_000


def quantity(
    unit: str,
    meaning: str,
    low: float | None = None,
    high: float | None = None,
    *,
    positive: bool = False,
    difference: bool = False,
    many: bool | IndexedBy = False,
    may_be_empty: bool = False,
    typical: float | None = None,
    instead: str = "",
    default: Any = dataclasses.MISSING,
    kw_only: bool = False,
) -> Any:
    """A numeric field: an array leaf in SI units, with its unit, range and meaning.

    The unit `SI` is that of the field that holds the object (`holding`, or the quantity
    it replaces). `typical`: size where the unit alone does not tell it (derivatives of
    a number that is 0 are resolved for such a change). `instead`: what to write where
    it is out of its range.
    """
    keywords = {} if default is dataclasses.MISSING else {"default": default}
    low = 0.0 if positive else low
    may_be_empty = may_be_empty or many is IndexedBy.GAPS or default == ()
    about = Quantity(
        unit,
        meaning,
        low,
        high,
        positive,
        difference,
        many,
        may_be_empty,
        typical,
        instead,
    )
    words = ("float | Sequence[float]" if many else "float") + (
        " | None" if default is None else ""
    )
    converter = _converter(in_si, words, about=about)
    return struct_field(
        converter=converter, metadata={"quantity": about}, kw_only=kw_only, **keywords
    )


def positive_quantity(unit: str, meaning: str, **about: Any) -> Any:
    """A `quantity` that must be > 0."""
    return quantity(unit, meaning, positive=True, **about)


class _AcceptsAnything(type):
    """Types that show accepted inputs in a signature; values are checked when the part
    is made."""

    def __instancecheck__(cls, instance: object) -> bool:
        return True


def _converter(
    reader: Callable[..., Any], words: str, **fixed: Any
) -> Callable[[Any], Any]:
    """A converter of a field; `words`: the type shown in the signature of the class."""
    converter = functools.partial(reader, **fixed)
    kind = inspect.Parameter.POSITIONAL_ONLY
    annotation = _AcceptsAnything(words, (), {"__module__": "builtins"})
    vars(converter)["__signature__"] = inspect.Signature(
        [inspect.Parameter("x", kind, annotation=annotation)]
    )
    return converter


@dataclasses.dataclass(frozen=True)
class Whole:
    """Meaning and range of a whole number that belongs to the structure; `guesses`:
    other names that people try."""

    meaning: str
    low: int
    high: int
    guesses: tuple[str, ...] = ()


def whole(
    meaning: str,
    *,
    low: int = 1,
    high: int = 100_000,
    guesses: tuple[str, ...] = (),
    **keywords: Any,
) -> Any:
    """A field with a whole number of the structure (static: another number is another
    program)."""
    about = Whole(meaning, low, high, guesses)
    return structural(
        converter=_converter(_plain_whole, "int"),
        metadata={"whole": about},
        **keywords,
    )


def _plain_whole(x: Any) -> Any:
    return int(x) if isinstance(x, np.integer) else x


_T = TypeVar("_T", bound=type)
_Build = TypeVar("_Build", bound=Callable)


def short_for(family: type) -> Callable[[_T], _T]:
    """Mark a class as the one of its `family` that a bare number makes: the number is
    its first field."""

    def marked(maker: _T) -> _T:
        _SHORT[family] = maker
        return maker

    return marked


def short_of(classes: Iterable[object]) -> type | None:
    """Class that a bare number makes where one of the `classes` is expected."""
    return next((_SHORT[family] for family in classes if family in _SHORT), None)


def as_part(x: Any, family: type, unit: str = "SI") -> Any:
    """A part of a scene, made from a bare number where one is given; `unit`: meaning of
    `SI` in it."""
    maker = short_of((family,))
    if maker is None or x is None or isinstance(x, Struct) or callable(x):
        return x
    return (
        x
        if _faults_of_short(maker, x, unit, "")
        else maker(in_si(x, _number_in(maker, unit)))
    )


def _number_in(maker: type, unit: str) -> Quantity:
    """Metadata of the number that alone makes a part; `unit`: meaning of `SI` in it."""
    first = dataclasses.fields(maker)[0]
    if (below := short_of((first.metadata.get("part"),))) is not None:
        return _number_in(below, unit_below(first, unit))
    about = about_of(first, unit)
    assert about is not None, f"the first field of {maker.__name__} is no number"
    return about


def _faults_of_short(maker: type, x: object, unit: str, path: str) -> Faults:
    """Error of a text given in place of a part."""
    return (
        _faults_of_leaf(Leaf(path, x, _number_in(maker, unit)), converted=False)
        if has_units(x)
        else []
    )


def part(family: type, unit: str | None = None, **keywords: Any) -> Any:
    """A field with a part of a scene, or a number that makes one; numbers of the unit
    `SI` in it are in `unit`."""
    metadata = {"part": family} if unit is None else {"part": family, "unit": unit}
    words = f"{family.__name__} | float" + (
        "" if keywords.get("default", family) is not None else " | None"
    )
    converter = _converter(as_part, words, family=family, unit=unit or "SI")
    return struct_field(converter=converter, metadata=metadata, **keywords)


class _PartMeta(type(Struct)):
    """Names the nearest fields where a part is made with an argument that it does not
    have."""

    def __call__(cls, *args: Any, **named: Any) -> Any:
        try:
            return super().__call__(*args, **named)
        except TypeError as error:
            fields = {field.name for field in dataclasses.fields(cls)}
            hints = (meant_by(cls, name, named) for name in named if name not in fields)
            if hint := next(hints, ""):
                raise TypeError(f"{error}; {hint}") from None
            if (told := with_nearest(error, cls.__init__, named)) is not error:
                raise told from None
            raise


class Part(Struct, metaclass=_PartMeta):
    """A part of a scene. It checks its concrete values when it is made; traced values
    are not checked.

    A number may be a Python or NumPy number, a list, an array, or a text with its unit,
    as "590 mm". Where a friction law, load or profile is expected, a number makes a
    constant one.

    Raises `InputError` with every value that is not a number, not finite or outside its
    range, and every part of the wrong kind. Conditions across several parts are checked
    by `check_scene` and before a run.
    """

    #: names that are no fields and that people try, with what to write in place of each
    instead: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def meant_by(cls, name: str, given: Mapping[str, Any]) -> str:
        """What to write in place of a `name` that is no field, with what is `given` by
        name; empty if nobody knows."""
        return cls.instead.get(name, "") or of_radius(
            name, [field.name for field in dataclasses.fields(cls)]
        )

    def __check_init__(self) -> None:

        name = type(self).__name__
        faults = Issues()
        hints = _hints(type(self))
        for field in dataclasses.fields(self):
            if (
                type(getattr(self, field.name)) is list
                and entry_of(hints.get(field.name)) is not None
            ):
                object.__setattr__(self, field.name, tuple(getattr(self, field.name)))
            value = getattr(self, field.name)
            path = f"{name}.{field.name}"
            about = field.metadata.get("quantity")
            if about is not None and value is None:
                absent = _may_be_absent(type(self), field)
                faults += (
                    []
                    if absent
                    else [
                        Fault(
                            path, "is missing", f"{about.meaning}{example(about.unit)}"
                        )
                    ]
                )
            elif about is not None and not isinstance(value, Struct):
                faults += _faults_of_leaf(Leaf(path, value, about), converted=False)
            elif isinstance(about_whole := field.metadata.get("whole"), Whole):
                faults += faults_of_whole(path, value, about_whole)
            elif (maker := short_of((field.metadata.get("part"),))) is not None:
                faults += _faults_of_short(maker, value, unit_below(field, "SI"), path)
        unread = {fault.path for fault in faults}
        wrong = self.faults_of_kinds(name)
        faults += (
            [fault for fault in wrong if fault.path not in unread]
            if wrong
            else self.faults_of_presence(name)
        )
        faults.report()

    def faults_of_kinds(self, path: str) -> Faults:
        """Errors of the part at a path where something else than its fields name stands
        in them."""
        faults = Issues()
        hints = _hints(type(self))
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            hint = hints.get(field.name, Any)
            about = field.metadata.get("quantity")
            if about is None:
                faults += _faults_of_kind(below(path, field), value, hint)
            elif isinstance(value, Struct):
                faults += _faults_of_law(below(path, field), value, hint, about)
        return faults

    def faults_of_presence(self, path: str) -> Faults:
        """Errors of the part at a path where one of its numbers or another one has to
        be given."""
        return []

    def faults(self, path: str) -> Faults:
        """Errors of the part at a path beyond the ranges of single numbers; those below
        it tell their own (concrete values only)."""
        return []

    def __repr__(self) -> str:
        return _part_text(self)

    def _repr_html_(self) -> str:
        rows = [
            (
                leaf.path,
                value_text(
                    leaf.value, leaf.about.unit, absolute=not leaf.about.difference
                ),
                leaf.about.meaning,
            )
            for leaf in leaves(self)
        ]
        return rows_table(rows, type(self).__name__)._repr_html_()


#: characters of a printed part that fit on a line
_WIDTH = 100


def _entries(name: str, entries: list[str], brackets: str = "()") -> str:
    """`Name(a, b)` on one line where it fits, else with one entry a line."""
    first, last = brackets
    line = f"{name}{first}{', '.join(entries)}{last}"
    if len(line) <= _WIDTH and "\n" not in line:
        return line
    body = "".join(
        f"  {entry},\n".replace("\n", "\n  ").rstrip(" ") for entry in entries
    )
    return f"{name}{first}\n{body}{last}"


def _part_text(node: Any, unit: str = "SI") -> str:
    """A part and all below it with values in readable units; what is absent, or as
    usual and no number, is left out.

    `unit` is what the unit `SI` of a field means here. A value that is no part is
    written as it is.
    """
    if not (isinstance(node, Struct) and dataclasses.is_dataclass(node)):
        return plain_text(node)
    entries = []
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        about = about_of(field, unit)
        inner = unit_below(field, unit)
        if isinstance(value, Struct):
            text = _part_text(value, inner)
        elif isinstance(value, tuple) and any(isinstance(x, Struct) for x in value):
            text = _entries("", [_part_text(entry, inner) for entry in value])
        elif about is not None and value is not None and np.size(value):
            text = value_text(value, about.unit, absolute=not about.difference)
        elif about is None and value not in (None, (), field.default):
            text = plain_text(value)
        else:
            continue
        entries.append(f"{field.name}={text}")
    return _entries(type(node).__name__, entries)


def tried_for(maker: object) -> Iterable[str]:
    """Names that people try for a class or a builder, and that it does not have."""
    return maker.instead if isinstance(maker, type) and issubclass(maker, Part) else ()


def meant_by(maker: object, name: str, given: Mapping[str, Any]) -> str:
    """What to write in place of a name that a class or a builder does not have; empty
    if nobody knows."""
    return (
        maker.meant_by(name, given)
        if isinstance(maker, type) and issubclass(maker, Part)
        else ""
    )


@functools.cache
def _hints(cls: type) -> dict[str, object]:
    """Types of the fields of a class."""
    try:
        return typing.get_type_hints(cls)
    except NameError:  # of a class inside a function: its names cannot be looked up
        return {}


@functools.cache
def alternatives(hint: object) -> tuple[Any, ...]:
    """The members of a union, or the hint alone."""
    origin = typing.get_origin(hint)
    return (
        typing.get_args(hint) if origin in (typing.Union, types.UnionType) else (hint,)
    )


@functools.cache
def entry_of(hint: object) -> object | None:
    """The type of the entries of a tuple of any length; `None` for other types."""
    inner = typing.get_args(hint)
    return (
        inner[0] if typing.get_origin(hint) is tuple and inner[1:] == (...,) else None
    )


def _faults_of_kind(path: str, value: object, hint: object) -> Faults:
    """Errors of a value that is none of the parts that its field names, or of entries
    of a tuple of such.

    Fields for other types are not checked.
    """
    entry = entry_of(hint)
    kinds = alternatives(hint if entry is None else entry)
    words = _words_of(kinds)
    if not words:
        return []
    if entry is None:
        return (
            []
            if isinstance(value, kinds)
            else [Fault(path, f"{shown(value)} does not fit here", f"give {words}")]
        )
    if not isinstance(value, tuple):
        return [
            Fault(
                path,
                f"{shown(value)} does not fit here",
                f"give a list; an entry is {words}",
            )
        ]
    return [
        fault
        for i, child in enumerate(value)
        for fault in _faults_of_kind(f"{path}[{i}]", child, entry)
    ]


@functools.cache
def _words_of(kinds: tuple[Any, ...]) -> str:
    """What may stand in a field, in words; empty if that is anything but parts of a
    scene, texts, and yes or no."""
    parts = _parts_among(kinds)
    if set(kinds) - {*parts, *_PLAIN, type(None)}:
        return ""
    plain = [words for kind, words in _PLAIN.items() if kind in kinds]
    return " or ".join([f"a {_words_of_family(part)}" for part in parts] + plain)


#: kinds of fields that are neither numbers nor parts, in words
_PLAIN = {str: "a text", bool: "True or False"}


def _parts_among(kinds: tuple[Any, ...]) -> list[type]:
    return [
        kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Struct)
    ]


def _faults_of_law(path: str, value: Struct, hint: object, about: Quantity) -> Faults:
    """Error of a part in place of numbers that takes no such profile or law."""
    kinds = alternatives(hint)
    parts = _parts_among(kinds)
    if isinstance(value, tuple(parts)) if parts else Any in kinds:
        return []
    words = " or ".join(
        [about.meaning, *(f"a {_words_of_family(part)}" for part in parts)]
    )
    return [
        Fault(
            path,
            f"{shown(value)} does not fit here",
            f"give {words}{example(about.unit)}",
        )
    ]


def _words_of_family(family: type) -> str:
    """A class, or an abstract one with its public kinds."""
    if not family.__name__.startswith("Abstract"):
        return family.__name__
    kinds = list[type]()
    below = [family]
    for kind in below:
        below += kind.__subclasses__()
        own = kind.__module__.partition(".")[0] == __name__.partition(".")[0]
        if own and not kind.__name__.startswith(("Abstract", "_")):
            kinds.append(kind)
    names = ", ".join(dict.fromkeys(kind.__name__ for kind in kinds))
    words = family.__name__.removeprefix("Abstract")
    return f"{words} ({names})" if names else words


def faults_of_whole(path: str, value: Any, about: Whole) -> Faults:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        return [
            Fault(
                path,
                f"{shown(value)} is not a whole number",
                f"{about.meaning}, as in {max(about.low, 1)}",
            )
        ]
    if about.low <= value <= about.high:
        return []
    return [
        Fault(
            path,
            f"{value} is out of range",
            f"{about.meaning} must be {about.low}…{about.high}",
        )
    ]


def takes_values(build: _Build) -> _Build:
    """Decorate a function that makes a part, so that its arguments behave like fields
    of parts.

    Metadata of a number are in its annotation,
    `Annotated[float, positive("m", "thickness")]`; the signature that people see has
    only the type. Raises `InputError` with all values that are out of range.
    """
    hints = typing.get_type_hints(build, include_extras=True)
    about = {
        name: typing.get_args(hint)[1]
        for name, hint in hints.items()
        if typing.get_origin(hint) is Annotated
    }
    plain = typing.get_type_hints(build)
    signature = inspect.signature(build)
    built = explained(build)

    @functools.wraps(built)
    def checked(*args: Any, **named: Any) -> Any:
        try:
            bound = signature.bind(*args, **named)
            faults = Issues()
        except TypeError:
            return built(*args, **named)  # whose error names the nearest arguments
        for name, value in bound.arguments.items():
            annotation = about.get(name)
            if value is None or isinstance(value, Struct):
                continue
            if isinstance(annotation, Quantity):
                faults += _faults_of_leaf(
                    Leaf(name, value, annotation), converted=False
                )
                if has_units(value):
                    converted = in_si(value, annotation)
                    value = (
                        converted.tolist()
                        if isinstance(converted, np.ndarray)
                        else converted
                    )
            elif isinstance(annotation, Whole):
                faults += faults_of_whole(name, value, annotation)
            elif (family := short_of(alternatives(plain.get(name)))) is not None:
                value = family(value)
            bound.arguments[name] = value
        faults.report()
        return built(*bound.args, **bound.kwargs)

    parameters = [
        parameter.replace(annotation=plain.get(name, parameter.annotation))
        for name, parameter in signature.parameters.items()
    ]
    vars(checked)["__signature__"] = signature.replace(
        parameters=parameters, return_annotation=plain.get("return")
    )
    checked.__annotations__ = plain
    return cast(_Build, checked)


def unit_below(field: dataclasses.Field, unit: str) -> str:
    """Meaning of the unit `SI` below a field, where it means `unit` at the field."""
    about = field.metadata.get("quantity")
    own_unit = field.metadata.get("unit") if about is None else about.unit
    return unit if own_unit in (None, "SI") else own_unit


#: what the values of a profile are, by their unit
_VALUES = {
    **{"N": "forces", "N*m": "torques", "Pa": "pressures", "rad/s": "speeds"},
    **{"kg": "masses", "K": "temperatures", "m^3/s": "flows", "W": "powers"},
}


def about_of(field: dataclasses.Field, unit: str) -> Quantity | None:
    """Metadata of a numeric field where the unit `SI` means `unit`; `None` for other
    fields."""
    about = field.metadata.get("quantity")
    if about is None or about.unit != "SI":
        return about
    meaning = about.meaning.replace("values", _VALUES.get(unit, "values"))
    return dataclasses.replace(about, unit=unit, meaning=meaning)


def parts_below(
    node: Any, path: str = "", unit: str = "SI"
) -> Iterator[tuple[str, Any, str]]:
    """A part and all parts below it: path, the part, and the meaning of the unit `SI`
    in it."""
    if isinstance(node, tuple | list):
        for i, child in enumerate(node):
            yield from parts_below(child, f"{path}[{i}]", unit)
    elif dataclasses.is_dataclass(node) and not isinstance(node, type):
        yield path, node, unit
        for field in dataclasses.fields(node):
            yield from parts_below(
                getattr(node, field.name), below(path, field), unit_below(field, unit)
            )


def faults_below(node: Any, path: str = "") -> Faults:
    """Errors of a part and of all parts below it, each by itself."""
    return [
        fault
        for where, child, _ in parts_below(node, path)
        if isinstance(child, Part)
        for fault in child.faults(where)
    ]


def presence_below(node: Any) -> Faults:
    """Errors of a scene in which an edit has left out what a part needs, given it
    twice, or put in a part of another kind; also of traced values."""
    return _faults_of_structure(node) if _has_faults(jax.tree.structure(node)) else []


@functools.lru_cache(maxsize=256)
def _has_faults(structure: Any) -> bool:
    return bool(
        _faults_of_structure(
            jax.tree.unflatten(structure, [np.zeros(())] * structure.num_leaves)
        )
    )


def _faults_of_structure(node: Any) -> Faults:
    return [
        fault
        for path, part, _ in parts_below(node)
        if isinstance(part, Part)
        for fault in part.faults_of_kinds(path) or part.faults_of_presence(path)
    ]


def below(path: str, field: dataclasses.Field) -> str:
    """Path of a field of the part at a path."""
    return f"{path}.{field.name}" if path else field.name


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One parameter (number or array) of a scene: path, value and metadata."""

    path: str
    value: Any
    about: Quantity


def _may_be_absent(cls: type, field: dataclasses.Field) -> bool:
    hint = _hints(cls).get(field.name)
    return hint is None or type(None) in alternatives(hint) or field.default is None


@explained
def leaves(node: object, path: str = "", unit: str = "SI") -> list[Leaf]:
    """Every quantity below `node`, in the order of the fields; `unit`: meaning of `SI`
    here.

    Example:
        >>> sb.files.leaves(scene.initial)[0].about.unit
        'rad/s'
    """
    if isinstance(node, tuple | list):
        return [
            leaf
            for i, child in enumerate(node)
            for leaf in leaves(child, f"{path}[{i}]", unit)
        ]
    if not dataclasses.is_dataclass(node) or isinstance(node, type):
        return []
    quantities: list[Leaf] = []
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        child_path = below(path, field)
        about = about_of(field, unit)
        # where a law replaces a number, the numbers of the law
        if about is not None and not dataclasses.is_dataclass(value):
            if value is not None or not _may_be_absent(type(node), field):
                quantities.append(Leaf(child_path, value, about))
        else:
            quantities += leaves(value, child_path, unit_below(field, unit))
    return quantities


class Numbers:
    """The numbers of a tree of parts: whether all are float64 arrays of NumPy, or else
    some are being traced."""

    def __init__(self, node: object) -> None:
        self.node = node
        self.values, self.structure = jax.tree.flatten(node)
        self.plain = all(
            type(x) is np.ndarray and x.dtype == np.float64 for x in self.values
        )
        self.traced = not self.plain and is_traced(self.values)

    def faults(self) -> Faults:
        """Their errors, as `faults_of_values` finds them; numbers that are all right
        take one pass."""
        ranges = (
            _ranges(self.structure, tuple(x.shape for x in self.values))
            if self.plain
            else None
        )
        if ranges is not None and len(ranges[0]) <= _MOST_NUMBERS:
            low, high, above = ranges
            whole = np.concatenate([x.ravel() for x in self.values])
            if np.all((whole >= low) & (whole <= high) & (whole > above)):
                return []
        return faults_of_values(self.node)


def as_arrays(node: Any) -> Any:
    """A tree of parts whose numbers are all arrays, also those put in by `eqx.tree_at`
    without a converter."""
    if isinstance(node, tuple | list):
        converted = [as_arrays(child) for child in node]
        return (
            node
            if all(a is b for a, b in zip(converted, node, strict=True))
            else type(node)(converted)
        )
    if not dataclasses.is_dataclass(node) or isinstance(node, type):
        return node
    changed = {}
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        number = field.metadata.get(
            "quantity"
        ) is not None and not dataclasses.is_dataclass(value)
        new = as_number(value) if number else as_arrays(value)
        if new is not value:
            changed[field.name] = new
    return dataclasses.replace(node, **changed) if changed else node


def faults_of_values(node: object, path: str = "") -> Faults:
    """Errors of values that are not numbers, not finite, out of range, or of too few
    bits; traced values pass."""
    numbers = leaves(node, path)
    if (count := sum(np.size(leaf.value) for leaf in numbers)) > _MOST_NUMBERS:
        return [
            Fault(path or "scene", f"has {count} numbers", f"at most {_MOST_NUMBERS}")
        ]
    return [fault for leaf in numbers for fault in _faults_of_leaf(leaf)]


@functools.lru_cache(maxsize=256)
def _ranges(
    structure: Any, shapes: tuple[tuple[int, ...], ...]
) -> tuple[np.ndarray, ...] | None:
    """Minimum and maximum values of all numbers, and their exclusive lower bounds.

    `None` where a list or anything else stands for a number, or where a list is empty
    that may not be.
    """
    places = [np.zeros(shape) for shape in shapes]
    node = jax.tree.unflatten(structure, places)
    index_of = {id(place): i for i, place in enumerate(places)}
    rows: list[tuple[np.ndarray, ...]] = [()] * len(shapes)
    for leaf in leaves(node):
        about = leaf.about
        i = index_of.get(id(leaf.value))
        if (
            i is None
            or len(shapes[i]) > bool(about.many)
            or (0 in shapes[i] and not about.may_be_empty)
        ):
            return None
        low, high = about.ends
        rows[i] = tuple(
            np.full(shapes[i], end)
            for end in (low, high, low if about.open_low else -np.inf)
        )
    if () in rows:
        return None  # a number without metadata
    return tuple(np.concatenate([np.ravel(row[k]) for row in rows]) for k in range(3))


def _faults_of_leaf(leaf: Leaf, *, converted: bool = True) -> Faults:
    """Error of one value.

    `converted`: it is in a part that has been made, where texts have been read, and
    lists are only where allowed; until then a list may be for many parts side by side.
    """
    about = leaf.about
    raw = leaf.value
    if (
        type(raw) is np.ndarray
        and raw.ndim == 0
        and raw.dtype == np.float64
        and about.admits_one(raw.item())
    ):
        return []  # as nearly all are
    dtype = getattr(raw, "dtype", np.dtype(np.float64))
    if jnp.issubdtype(dtype, jnp.floating) and dtype != np.float64:
        what = f"is {dtype}, in which events cannot be located"
        return [Fault(leaf.path, what, f"give {about.meaning} as float64")]
    if isinstance(raw, Tracer | jax.ShapeDtypeStruct):
        return []
    if has_units(raw) and not converted:
        if about.unit == "SI":
            what = (
                f"{shown(raw)} cannot be read here, as the unit depends on the "
                "field that holds it"
            )
            hint = (
                "give it in SI units, without a unit; in a scene file it may have one"
            )
            return [Fault(leaf.path, what, hint)]
        reader = NumberReader()
        reader.number(
            list(raw) if isinstance(raw, tuple) else raw, about, leaf.path, about.unit
        )
        return reader.faults
    raw = as_number(raw)  # a Python number, put in by `eqx.tree_at`
    if not isinstance(raw, np.ndarray | jax.Array) or raw.dtype.kind not in "fiu":
        unit = (
            " in SI units"
            if about.unit == "SI"
            else ""
            if about.unit == "1"
            else f" in {about.unit}"
        )
        return [
            Fault(leaf.path, f"{shown(raw)} is not a number", f"give a number{unit}")
        ]
    value = np.asarray(raw)
    if converted and value.ndim > bool(about.many):
        hint = "give one number" + (", or a list of numbers" if about.many else "")
        return [Fault(leaf.path, f"has the shape {value.shape}", hint)]
    if value.size == 0 and not about.may_be_empty:
        return [Fault(leaf.path, "is an empty list", f"give {about.meaning}")]
    bad = ~about.admits(value)
    if not bad.any():
        return []
    which = (
        ""
        if value.ndim == 0
        else "[" + ", ".join(str(i) for i in np.argwhere(bad)[0]) + "]"
    )
    worst = value[bad].flat[0]
    return [
        Fault(
            leaf.path + which,
            f"{worst:g}{unit_suffix(about.unit)} is out of range",
            about.hint(worst, about.unit),
        )
    ]


def faults_of_sizes(node: object, path: str, n: int) -> Faults:
    """Lists without an entry for each of `n` linings, or for each gap between two."""
    faults = Issues()
    for leaf in leaves(node, path):
        entries = {True: n, IndexedBy.GAPS: n - 1}.get(leaf.about.many)
        if entries is not None and np.shape(leaf.value) not in ((), (entries,)):
            faults.add(
                leaf.path,
                f"does not fit {n} linings",
                f"give one number, or a list of {entries}",
            )
    return faults
