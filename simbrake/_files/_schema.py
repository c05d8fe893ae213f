"""What may stand in a scene: one description of every part, read off the classes and builders themselves."""

import dataclasses
import functools
import importlib
import inspect
import pkgutil
import sys
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx

from .._base._quantity import Quantity, Whole, about_of, unit_below
from .._parts._builders import layered_heat, lumped_heat, with_external_pair, with_pulley_structure
from .._parts._compliance import AbstractStiffness, GivenStiffness
from .._parts._design import AbstractBrake, Lining, uniform_linings
from .._parts._duty import AbstractProfile, Constant, ramp
from .._parts._friction import AbstractFriction, ConstantFriction
from .._parts._heat import AbstractPartition, ConstantPartition, Heat
from .._parts._lever import Lever
from .._parts._loads import AbstractLoad, TorqueLoad
from .._parts._programme import programme_scene
from .._parts._scene import AbstractDuty, Scene
from .._parts._wear import AbstractWearRate, ConstantWear
from ._history import history

#: functions that make an object of a class, by name in a file as the classes themselves are
BUILDERS: dict[type, tuple[Callable[..., Any], ...]] = {
    Lining: (uniform_linings,),
    AbstractProfile: (ramp, history),
    Scene: (programme_scene,),
    Heat: (layered_heat, lumped_heat, with_pulley_structure, with_external_pair),
}
#: what a bare number stands for where an object is wanted
SHORT: dict[type, Callable[..., Any]] = {
    AbstractFriction: ConstantFriction,
    AbstractProfile: Constant,
    AbstractStiffness: GivenStiffness,
    AbstractPartition: ConstantPartition,
    AbstractLoad: TorqueLoad,
    AbstractWearRate: ConstantWear,
}
#: families whose classes have no keys that would do for another one of them
TOLD_BY_KEYS: set[type] = {AbstractBrake, AbstractDuty}
assert Lever  # its class is found as a subclass of a profile only if its module is loaded


class Part(NamedTuple):
    """One field of a class, or parameter of a builder.

    - `kind`: number, whole, text, flag, file, or object;  `many`: a list of them
    - `about`: of a number or whole number;  `wanted`: classes of an object, which may also replace a number
    - `unit`: what the unit `SI` means below it, `SI` where that depends on what is above
    """

    name: str
    kind: str
    about: Quantity | Whole | None
    wanted: tuple[type, ...]
    many: bool
    nullable: bool
    default: Any
    unit: str

    @property
    def needed(self) -> bool:
        return self.default is dataclasses.MISSING


_KINDS = {str: "text", bool: "flag", int: "whole", Path: "file"}


@functools.cache
def parts_of(maker: Callable[..., Any]) -> tuple[Part, ...]:
    """The fields of a class, or the parameters of a builder, in their order."""
    if isinstance(maker, type):
        hints = typing.get_type_hints(maker)
        fields = [field for field in dataclasses.fields(maker) if field.init]
        return tuple(_of_field(field, hints[field.name]) for field in fields)
    hints = typing.get_type_hints(maker, include_extras=True)
    return tuple(
        _of_parameter(parameter, hints[parameter.name]) for parameter in inspect.signature(maker).parameters.values()
    )


def _of_field(field: dataclasses.Field, hint: Any) -> Part:
    default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
    about = about_of(field, "SI") or field.metadata.get("whole")
    return _part(field.name, hint, about, default, unit_below(field, "SI"))


def _of_parameter(parameter: inspect.Parameter, hint: Any) -> Part:
    about = None
    if typing.get_origin(hint) is typing.Annotated:
        hint, about = typing.get_args(hint)
    default = dataclasses.MISSING if parameter.default is inspect.Parameter.empty else parameter.default
    return _part(parameter.name, hint, about, default, about.unit if isinstance(about, Quantity) else "SI")


def _part(name: str, hint: Any, about: Any, default: Any, unit: str) -> Part:
    many = typing.get_origin(hint) is tuple
    alternatives = _alternatives(typing.get_args(hint)[0] if many else hint)
    wanted = tuple(t for t in alternatives if isinstance(t, type) and issubclass(t, eqx.Module))
    nullable = type(None) in alternatives or default is None
    if isinstance(about, Quantity):
        kind = "number"
    elif wanted:
        kind = "object"
    else:
        kind = next((_KINDS[t] for t in alternatives if t in _KINDS), "")
    return Part(name, kind, about, wanted, many, nullable, default, unit)


def _alternatives(hint: Any) -> tuple[Any, ...]:
    origin = typing.get_origin(hint)
    return typing.get_args(hint) if origin in (typing.Union, types.UnionType) else (hint,)


@functools.cache
def _import_all_parts() -> None:
    """Classes are found among the subclasses of their family, so all of them must be there."""
    package = Scene.__module__.rpartition(".")[0]
    for module in pkgutil.iter_modules(sys.modules[package].__path__, f"{package}."):
        importlib.import_module(module.name)


@functools.cache
def makers_of(wanted: tuple[type, ...]) -> dict[str, Callable[..., Any]]:
    """Classes and builders that give one of the `wanted` classes and can be written in a file: name → maker."""
    _import_all_parts()
    found: dict[str, Callable[..., Any]] = {}
    for base in wanted:
        family, seen = [base], set()
        while family:
            one = family.pop(0)
            family += one.__subclasses__()
            own = one.__module__.partition(".")[0] == __name__.partition(".")[0]
            if one in seen or not own or inspect.isabstract(one):
                continue
            seen.add(one)
            if all(part.kind for part in parts_of(one)):  # functions of one's own cannot be written
                found[one.__name__] = one
        for builder in BUILDERS.get(base, ()):
            found[builder.__name__] = builder
    return found


def several(wanted: tuple[type, ...]) -> bool:
    """Whether a table of one of the `wanted` classes must name its own; builders are told by their keys."""
    if set(wanted) <= TOLD_BY_KEYS:
        return False
    return sum(isinstance(maker, type) for maker in makers_of(wanted).values()) > 1


def short_of(wanted: tuple[type, ...]) -> Callable[..., Any] | None:
    """What a bare number stands for where one of the `wanted` classes is expected."""
    return next((SHORT[base] for base in wanted if base in SHORT), None)


@functools.cache
def all_makers() -> dict[str, Callable[..., Any]]:
    """Everything that a scene file may name or imply, from the scene down: name → maker."""
    found: dict[str, Callable[..., Any]] = dict(makers_of((Scene,)))
    open_ends: list[Callable[..., Any]] = list(found.values())
    while open_ends:
        for part in parts_of(open_ends.pop(0)):
            for name, maker in makers_of(part.wanted).items():
                if name not in found:
                    found[name] = maker
                    open_ends.append(maker)
    return found
