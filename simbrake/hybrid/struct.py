"""Frozen dataclasses that are PyTrees of JAX: what systems, methods and records are
made of.

They are what `equinox.Module` is, made in a third of its time: a scene loads some 180
of them, and whoever runs one waits for that. Fields are declared as for Equinox
(`equinox.field` may be used), whose functions work on them as on any PyTree; it is
imported by those of our own that call it, none of which a stored program needs.
"""

import abc
import copy
import dataclasses
import functools
import inspect
import operator
import re
from collections.abc import Callable, Sequence
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    NamedTuple,
    TypeVar,
    cast,
    dataclass_transform,
)

import jax
import numpy as np

if TYPE_CHECKING:
    from equinox import AbstractClassVar as AbstractClassVar
    from equinox import AbstractVar as AbstractVar
else:
    #: a field, or a value of the class, that classes derived from this one have to give
    AbstractVar = AbstractClassVar = ClassVar

_Tree = TypeVar("_Tree")
_Function = TypeVar("_Function", bound=Callable)


def struct_field(
    *,
    converter: Callable[[Any], Any] | None = None,
    static: bool = False,
    metadata: dict | None = None,
    **named: Any,
) -> Any:
    """A field of a `Struct`, as `dataclasses.field`.

    - `converter`: makes the value of what is given
    - `static`: part of the structure, not a leaf
    """
    about = dict(metadata or {}, **({"static": True} if static else {}))
    return dataclasses.field(
        metadata=about if converter is None else about | {"converter": converter},
        **named,
    )


def structural(**named: Any) -> Any:
    """A field that belongs to the structure of a part: no leaf."""
    return struct_field(static=True, **named)


class _Layout(NamedTuple):
    """What is known of a class: the names of its fields, and how they are read and
    converted."""

    names: tuple[str, ...]
    converters: tuple[tuple[str, Callable[[Any], Any]], ...]
    checks: tuple[Callable[[Any], None], ...]
    declared: frozenset[str]  # by `AbstractVar` and `AbstractClassVar`
    missing: tuple[str, ...]  # of them, those that are not given
    by_fields: bool  # its `__init__` is that of a dataclass


_LAYOUTS: dict[type, _Layout] = {}
#: objects that are being made, and may be changed
_IN_MAKING: set[int] = set()


def _reader(names: Sequence[str]) -> Callable[[Any], tuple]:
    """The values of fields as a tuple."""
    if len(names) > 1:
        return operator.attrgetter(*names)
    if not names:
        return lambda part: ()
    get = operator.attrgetter(*names)
    return lambda part: (get(part),)


def _register(cls: type, leaves: tuple[str, ...], static: tuple[str, ...]) -> None:
    values = _reader(leaves)
    structure = _reader(static)
    keys = tuple(map(jax.tree_util.GetAttrKey, leaves))
    new = object.__new__

    def flatten(part: Any) -> tuple[tuple, tuple]:
        return values(part), structure(part)

    def flatten_with_keys(part: Any) -> tuple[tuple, tuple]:
        return tuple(zip(keys, values(part), strict=True)), structure(part)

    def unflatten(structure: tuple, values: Any) -> Any:
        part = new(cls)
        part.__dict__.update(zip(leaves, values, strict=True))
        part.__dict__.update(zip(static, structure, strict=True))
        return part

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)


@dataclass_transform(
    eq_default=False, field_specifiers=(dataclasses.field, struct_field, structural)
)
class StructMeta(abc.ABCMeta):
    """Makes a class a dataclass and a PyTree, and its objects frozen once they are
    made."""

    def __new__(
        mcs, name: str, bases: tuple, content: dict[str, Any], /, **named: Any
    ) -> Any:
        cls: Any = super().__new__(mcs, name, bases, content, **named)
        earlier = [_LAYOUTS[base] for base in cls.__mro__[1:] if base in _LAYOUTS]
        # a function `__init__` is inherited, which those who write one expect
        by_fields = "__init__" not in content and (not earlier or earlier[0].by_fields)
        text = cls.__doc__
        # a dataclass without one gets its signature, which takes long
        cls.__doc__ = text or name
        dataclasses.dataclass(eq=False, repr=False, init=by_fields)(cls)
        cls.__doc__ = text
        fields = dataclasses.fields(cls)
        converters = tuple(
            (field.name, field.metadata["converter"])
            for field in fields
            if "converter" in field.metadata
        )
        if by_fields:
            cls.__init__.__annotations__ |= {
                name: _taken(converter) for name, converter in converters
            }
        names = tuple(field.name for field in fields)
        static = tuple(field.name for field in fields if field.metadata.get("static"))
        # a dataclass keeps the place of what is declared for the field that is given
        # later
        declared = frozenset(cls.__dataclass_fields__).difference(names)
        for name in declared:
            del cls.__dataclass_fields__[name]
        declared = declared.union(*(layout.declared for layout in earlier))
        _LAYOUTS[cls] = _Layout(
            names,
            converters,
            tuple(
                check
                for base in cls.__mro__
                if (check := vars(base).get("__check_init__"))
            ),
            declared,
            tuple(
                sorted(
                    name
                    for name in declared.difference(names)
                    if not hasattr(cls, name)
                )
            ),
            by_fields,
        )
        _register(cls, tuple(name for name in names if name not in static), static)
        return cls

    def __call__(cls: Any, *args: Any, **named: Any) -> Any:
        layout = _LAYOUTS[cls]
        if layout.missing:
            raise TypeError(
                f"{cls.__name__} does not define {' and '.join(layout.missing)}"
            )
        part = cls.__new__(cls)
        _IN_MAKING.add(id(part))
        try:
            part.__init__(*args, **named)
        finally:
            _IN_MAKING.discard(id(part))
        for name in layout.names:
            if name not in part.__dict__ and not hasattr(part, name):
                raise TypeError(f"{cls.__name__}.__init__ does not set {name}")
        for name, converter in layout.converters:
            object.__setattr__(part, name, converter(getattr(part, name)))
        for check in layout.checks:
            check(part)
        return part

    @property
    def __signature__(cls: Any) -> inspect.Signature:
        signature = inspect.signature(cls.__init__)
        _, *rest = signature.parameters.values()
        return signature.replace(parameters=rest)


def _taken(converter: Callable[[Any], Any]) -> Any:
    """The type that a converter takes, as its signature says, which is shown in place
    of what it makes."""
    try:
        signature = getattr(converter, "__signature__", None) or inspect.signature(
            converter
        )
        first = next(iter(signature.parameters.values())).annotation
    except (ValueError, StopIteration):  # of a class written in C
        return Any
    return Any if first is inspect.Parameter.empty else first


class Struct(metaclass=StructMeta):
    """A frozen dataclass whose fields are a PyTree, but for the static ones, which
    belong to its structure.

    A method `__check_init__` looks at an object when it has been made. Two are equal
    that have the same structure and equal leaves.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if id(self) not in _IN_MAKING:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")

    def __hash__(self) -> int:
        return hash(
            (type(self), *(getattr(self, name) for name in _LAYOUTS[type(self)].names))
        )

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        (mine, structure) = jax.tree.flatten(self)
        (theirs, other_structure) = jax.tree.flatten(other)
        return structure == other_structure and all(map(_equal, mine, theirs))

    def __repr__(self) -> str:
        from equinox import tree_pformat

        return tree_pformat(self)


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray | np.generic | jax.Array) and isinstance(
        b, np.ndarray | np.generic | jax.Array
    ):
        return a is b or (
            a.shape == b.shape and a.dtype == b.dtype and np.array_equal(a, b)
        )
    return a is b or (type(a) is type(b) and bool(a == b))


def traced_once(function: _Function) -> _Function:
    """A function that all programs trace once for each structure of its arguments
    (`equinox.filter_jit`)."""

    @functools.cache
    def jitted() -> Callable:
        import equinox

        return equinox.filter_jit(function)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        return jitted()(*arguments)

    return cast(_Function, call)


def with_fields(part: _Tree, **values: Any) -> _Tree:
    """A `Struct` with other values in some fields, as they are: neither converted nor
    checked."""
    names = _LAYOUTS[type(part)].names
    assert values.keys() <= set(names), (
        f"{type(part).__name__} has no field {', '.join(values.keys() - set(names))}"
    )
    new: Any = object.__new__(type(part))
    new.__dict__.update({name: getattr(part, name) for name in names}, **values)
    return new


def with_value_at(tree: _Tree, path: str, value: Any) -> _Tree:
    """A tree of `Struct`s and lists with another value at a path, as in `"a.b[2].c"`;
    neither converted nor checked."""

    def changed(node: Any, steps: list[str]) -> Any:
        if not steps:
            return value
        step, *rest = steps
        if step.isdigit():
            return type(node)(
                [
                    changed(entry, rest) if i == int(step) else entry
                    for i, entry in enumerate(node)
                ]
            )
        if isinstance(node, Struct):
            return with_fields(node, **{step: changed(getattr(node, step), rest)})
        new = copy.copy(node)  # a dataclass of another kind
        object.__setattr__(new, step, changed(getattr(node, step), rest))
        return new

    return changed(tree, re.findall(r"[^.\[\]]+", path))
