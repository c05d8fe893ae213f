"""Arguments of the wrong kind, told by their names where a call has failed; a call that
succeeds is not looked at.

Free of JAX, so that what is free of it can be decorated: only a call that failed
imports it.
"""

import collections.abc
import dataclasses
import functools
import inspect
import itertools
import numbers
import os
import re
import sys
import traceback
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

import lazy_loader

from ._faults import Fault, Faults, InputError, near, shown

_Function = TypeVar("_Function", bound=Callable)
#: entries of a mapping or a sequence that are looked at
_ENTRIES = 50


def explained(function: _Function) -> _Function:
    """Decorate a public function or class, so that a call that fails on an argument of
    the wrong kind raises `InputError`.

    The error names every argument that does not fit its annotation, and what would, or
    the user's function that does with traced values what JAX cannot. Other errors pass.
    """
    if isinstance(function, type):
        type.__setattr__(function, "__init__", explained(function.__init__))
        return cast(_Function, function)

    @functools.wraps(function)
    def called(*args: Any, **named: Any) -> Any:
        try:
            return function(*args, **named)
        except Exception as error:
            if isinstance(error, InputError) and not error.of_arguments:
                raise
            if (
                isinstance(error, TypeError)
                and (told := with_nearest(error, function, named)) is not error
            ):
                raise told from None
            if faults := faults_of_tracing(error):
                raise InputError(faults) from error
            # an error of a function that this one has called is told in the names of
            # its own arguments
            if faults := _misfits(
                function, args, named, lists=not isinstance(error, TypeError)
            ):
                raise InputError(faults, of_arguments=True) from error
            raise

    called.explained = True  # pyright: ignore
    return cast(_Function, called)


def public_names(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package: the names in its
    `__init__.pyi`, whose modules are imported at their first use, the functions among
    them `explained`."""
    named, listed, names = lazy_loader.attach_stub(package, file)

    def found(name: str) -> Any:
        value = named(name)
        if inspect.isfunction(value) and not hasattr(value, "explained"):
            value = explained(value)
            # what is pickled is looked up in its module
            for home in (package, value.__module__):
                setattr(sys.modules[home], name, value)
        return value

    return found, listed, names


def with_nearest(
    error: TypeError, function: Callable, named: Mapping[str, Any]
) -> TypeError:
    """The error of a call; if it has an argument that the function does not have, one
    with the nearest names."""
    parameters = inspect.signature(function).parameters
    if any(
        parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()
    ):
        return error
    unknown = next((name for name in named if name not in parameters), None)
    return (
        error
        if unknown is None
        else TypeError(f"{error}{near(unknown, [*parameters])}")
    )


#: words of errors that NumPy and JAX have for any array
_ONE_NUMBER = re.compile("truth value of an array|scalar arrays can be converted")
_LIBRARIES = sys.stdlib_module_names | {
    "simbrake",
    "jax",
    "jaxlib",
    "equinox",
    "numpy",
    "jaxtyping",
    "beartype",
}


def faults_of_tracing(error: Exception) -> Faults:
    """Error of a user's function that takes a traced value for a number of Python or
    for an array of NumPy."""
    import jax
    from jax.core import Tracer

    if not isinstance(error, jax.errors.JAXTypeError) and not _ONE_NUMBER.search(
        str(error)
    ):
        return []
    for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
        if str(frame.f_globals.get("__name__")).partition(".")[0] in _LIBRARIES:
            continue
        if not any(
            isinstance(value, Tracer) for value in jax.tree.leaves(dict(frame.f_locals))
        ):
            return []
        name = frame.f_code.co_qualname.rpartition("<locals>.")[2]
        file = Path(frame.f_code.co_filename).name
        what = f"needs the value of a number that JAX only traces ({file}, line {line})"
        return [
            Fault(
                name,
                what,
                "take jnp.where in place of `if`, and jax.numpy in place of numpy, "
                "math and float()",
            )
        ]
    return []


def _misfits(
    function: Callable, args: tuple[Any, ...], named: dict[str, Any], lists: bool
) -> Faults:
    """Arguments that do not fit their annotations; none where the call has not the
    right arguments at all.

    `lists`: whether a list can stand for an array
    """
    signature = inspect.signature(function)
    try:
        given = signature.bind(*args, **named).arguments
    except TypeError:
        return []
    faults = []
    for name, value in given.items():
        parameter = signature.parameters[name]
        hint = _meaning(parameter.annotation, inspect.unwrap(function))
        several = parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        values = (
            value.values()
            if isinstance(value, dict) and several
            else value
            if several
            else [value]
        )
        wrong = [
            entry
            for entry in values
            if not (entry is parameter.default or _fits(entry, hint, lists))
        ]
        faults += [
            Fault(name, f"{shown(entry)} does not fit here", f"give {_words(hint)}")
            for entry in wrong[:1]
        ]
    return faults


def _meaning(annotation: Any, function: Callable) -> Any:
    """An annotation as an object, `Any` where there is none or its names are for a type
    checker alone."""
    if isinstance(annotation, str):
        try:
            annotation = eval(annotation, function.__globals__)
        except Exception:
            return Any
    return Any if annotation is inspect.Parameter.empty else annotation


def _of_arrays(kind: type) -> bool:
    import jax
    import numpy as np
    from jaxtyping import AbstractArray

    from ..hybrid.arrays import Array

    return issubclass(kind, AbstractArray) or kind in (np.ndarray, jax.Array, Array)


def _fits(value: Any, hint: Any, lists: bool) -> bool:
    """Whether a value is of the kind that an annotation describes; whatever has no test
    here fits."""
    origin = typing.get_origin(hint)
    inner = typing.get_args(hint)
    if hint is Any:
        return True
    if origin is typing.Annotated:
        return _fits(value, inner[0], lists)
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, option, lists) for option in inner)
    if origin is Literal:
        return any(
            value is option or (type(value) is type(option) and value == option)
            for option in inner
        )
    if isinstance(hint, TypeVar):
        return hint.__bound__ is None or _fits(value, hint.__bound__, lists)
    kind = origin or hint
    if hint is None or hint is type(None):
        return value is None
    if not isinstance(kind, type):
        return True
    if _of_arrays(kind):
        return _numeric(value) and (lists or not isinstance(value, list | tuple))
    if kind in (float, int, complex):
        real = isinstance(value, numbers.Real) or (
            _numeric(value) and getattr(value, "ndim", 1) == 0
        )
        return (
            real
            and not (kind is int and isinstance(value, float))
            and _representable(value)
        )
    if kind is os.PathLike:
        return isinstance(value, os.PathLike)
    if kind is collections.abc.Callable:
        return callable(value)
    if not isinstance(value, kind):
        return False
    if hint in (list, tuple):  # of numbers, in place of an array
        return lists and _numeric(value)
    if isinstance(value, collections.abc.Mapping) and len(inner) == 2:
        entries = itertools.islice(value.items(), _ENTRIES)
        return all(
            _fits(key, inner[0], lists) and _fits(entry, inner[1], lists)
            for key, entry in entries
        )
    if isinstance(value, tuple) and kind is tuple and inner and inner[-1] is not ...:
        return len(value) == len(inner) and all(
            _fits(*pair, lists) for pair in zip(value, inner, strict=True)
        )
    if inner and isinstance(value, str | bytes):  # (a list of texts, of its letters)
        return inner[0] in (str, Any)
    if inner and isinstance(value, collections.abc.Collection):
        return all(
            _fits(entry, inner[0], lists) for entry in itertools.islice(value, _ENTRIES)
        )
    return True


def _numeric(value: Any) -> bool:
    """Whether a value is a number or an array of numbers, or a list that makes one."""
    import jax
    import numpy as np

    if isinstance(value, numbers.Real | jax.Array):
        return _representable(value)
    if not isinstance(value, np.ndarray | np.generic | list | tuple):
        return False
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except ValueError:  # lists of unequal lengths
        return False


def _representable(value: Any) -> bool:
    try:
        return not isinstance(value, int) or abs(float(value)) >= 0
    except OverflowError:
        return False


def _words(hint: Any) -> str:
    """What fits an annotation, in words."""
    origin = typing.get_origin(hint)
    inner = typing.get_args(hint)
    if hint is Any:
        return "a value"
    if origin is typing.Annotated:
        return _words(inner[0])
    if origin in (typing.Union, types.UnionType):
        words = dict.fromkeys(_words(option) for option in inner)
        if "a number" in words:
            words.pop("a whole number", None)
        return " or ".join(words)
    if origin is Literal:
        return " or ".join(map(repr, inner))
    kind = origin or hint
    if hint is None or hint is type(None):
        return "None"
    if not isinstance(kind, type):
        return "something else"
    if _of_arrays(kind):
        return "an array of numbers"
    plain = {
        float: "a number",
        int: "a whole number",
        bool: "True or False",
        str: "a text",
        object: "a value",
    }
    if kind.__module__ == "numpy":  # (arrays have gone)
        return "a number"
    if kind in plain:
        return plain[kind]
    if kind is Path or kind is os.PathLike:
        return "a path"
    if kind is collections.abc.Callable:
        return "a function"
    if issubclass(kind, collections.abc.Mapping):
        return (
            f"a dict from {_words(inner[0])} to {_words(inner[1])}"
            if len(inner) == 2
            else "a dict"
        )
    if (
        issubclass(kind, collections.abc.Iterable)
        and inner
        and not dataclasses.is_dataclass(kind)
    ):
        return f"a list, each {_words(inner[0])}"
    return f"a {kind.__name__.removeprefix('Abstract')}"
