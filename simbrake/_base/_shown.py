"""Parts as people read them: values with units, arrays abbreviated, traced values by type and shape."""

import dataclasses
import functools
import html
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer

from ._table import Column, Table, number, numbers

#: characters that fit on a line
_WIDTH = 100


def value_text(value: Any, unit: str = "", *, absolute: bool = True) -> str:
    """A number or an array with its unit; traced values and shapes as `f64[20]`, anything else as it is.

    Example:
        >>> value_text(0.59, "m"), value_text([0.2, 0.2, 0.2], "m"), value_text(0.35)
        ('0.59 m', '3 × 0.2 m', '0.35')
    """
    if isinstance(value, Tracer | jax.ShapeDtypeStruct):
        kind = np.dtype(value.dtype)
        return f"{kind.kind}{8 * kind.itemsize}[{','.join(str(n) for n in value.shape)}]"
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        return plain_text(value)
    if array.size == 1 and not np.isfinite(array).all():
        return str(float(array.ravel()[0]))
    if array.ndim == 0:
        return str(number(array, unit, absolute=absolute))
    shown = numbers(array, unit, absolute=absolute)
    return str(shown._replace(text=f"[{shown.text}]") if ", " in shown.text else shown)


def plain_text(value: Any) -> str:
    """What is neither a number nor a part: a name, a count, a function."""
    if callable(value) and not isinstance(value, type):
        return getattr(value, "__qualname__", type(value).__name__)
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def joined(name: str, entries: list[str], brackets: str = "()") -> str:
    """`Name(a, b)` on one line where it fits, else with one entry a line."""
    first, last = brackets
    line = f"{name}{first}{', '.join(entries)}{last}"
    if len(line) <= _WIDTH and "\n" not in line:
        return line
    body = "".join(f"  {entry},\n".replace("\n", "\n  ").rstrip(" ") for entry in entries)
    return f"{name}{first}\n{body}{last}"


def part_text(node: Any, about_of: Callable[..., Any], unit_below: Callable[..., str], unit: str = "SI") -> str:
    """A part and all below it with values in readable units; what is absent, or as usual and no number, is left out.

    - `about_of`, `unit_below`: metadata of a field, and of those below it, where the unit `SI` means `unit`
    """
    entries = []
    for field in dataclasses.fields(node):
        value, about = getattr(node, field.name), about_of(field, unit)
        below = functools.partial(part_text, about_of=about_of, unit_below=unit_below, unit=unit_below(field, unit))
        if isinstance(value, eqx.Module):
            text = below(value) if dataclasses.is_dataclass(value) else plain_text(value)
        elif isinstance(value, tuple) and any(isinstance(one, eqx.Module) for one in value):
            text = joined("", [below(one) if isinstance(one, eqx.Module) else plain_text(one) for one in value])
        elif about is not None and value is not None and np.size(value):
            text = value_text(value, about.unit, absolute=not about.difference)
        elif about is None and value not in (None, (), field.default):
            text = plain_text(value)
        else:
            continue
        entries.append(f"{field.name}={text}")
    return joined(type(node).__name__, entries)


def rows_table(rows: list[tuple[str, str, str]], title: str) -> Table:
    """Name, value with unit and meaning, for a notebook."""
    return Table(["name", Column("value", left=True, show=str), "meaning"], rows, title)


def coloured(text: str, colour: str) -> str:
    """A banner of HTML for a notebook."""
    ink, paper = {"red": ("#b3261e", "#fcebea"), "amber": ("#8a5a00", "#fdf3e0"), "green": ("#1a7440", "#e7f4ec")}[
        colour
    ]
    style = f"border-left:5px solid {ink};background:{paper};color:{ink};padding:.5em .8em;margin:.3em 0"
    return f'<div style="{style}">{html.escape(text)}</div>'
