"""Numbers with units: how a field of a scene says its unit, its admissible range and its meaning."""

import dataclasses
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer
from jaxtyping import Float

from .._hybrid._arrays import Array
from ._faults import Fault
from ._tested import warn_of_untested_jax

if TYPE_CHECKING:
    Scalar = Any  # what a caller may write: a number, a list, an array
else:
    #: what a field holds: one number, or an array of them
    Scalar = Float[Array, "..."] | Float[np.ndarray, "..."]


warn_of_untested_jax(jax.__version_info__)  # here, as every scene and every command that computes imports this module

#: magnitude beyond which squares and products of a scene's numbers would leave the range of 64 bits
LARGEST = 1e40


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Unit (SI), meaning and admissible range of a number; bounds are inclusive unless `open_low`."""

    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    difference: bool = False  # of temperatures: 20 degC would be another number
    many: bool = False  # one number, or one for each lining, node or row of a table
    may_be_empty: bool = False  # of many: none at all is a meaning, too

    def admits(self, value: np.ndarray) -> np.ndarray:
        ok = np.asarray(np.abs(value) <= LARGEST)  # a NaN is not
        if self.low is not None:
            ok = ok & ((value > self.low) if self.open_low else (value >= self.low))
        if self.high is not None:
            ok = ok & (value <= self.high)
        return np.asarray(ok)

    def wanted(self, value: float) -> str:
        """What a number that is not admitted should have been."""
        return f"at most {LARGEST:g} in magnitude" if LARGEST < abs(value) < np.inf else self.range

    @property
    def range(self) -> str:
        parts = []
        if self.low is not None:
            parts.append(f"{'>' if self.open_low else '≥'} {self.low:g}")
        if self.high is not None:
            parts.append(f"≤ {self.high:g}")
        return "finite" if not parts else " and ".join(parts)


def as_number(x: Any) -> Any:
    """Python and NumPy numbers as float64 arrays, so that a new value never re-traces; JAX arrays stay as they are."""
    if x is None or isinstance(x, jax.Array) or not isinstance(x, int | float | list | tuple | np.ndarray | np.generic):
        return x
    return np.asarray(x, dtype=np.float64)


def positive(unit: str, meaning: str, high: float | None = None) -> Quantity:
    """What is known of a number that must be > 0, for the annotation of a parameter."""
    return Quantity(unit, meaning, 0.0, high, open_low=True)


def quantity(
    unit: str,
    meaning: str,
    *,
    low: float | None = None,
    high: float | None = None,
    positive: bool = False,
    difference: bool = False,
    many: bool = False,
    default: Any = dataclasses.MISSING,
) -> Any:
    """A numeric field: an array leaf in SI units, with what a reader and a checker must know of it.

    The unit `SI` is that of the field in which the object stands (`holding`, or the quantity it stands for).
    """
    about = Quantity(unit, meaning, 0.0 if positive else low, high, positive, difference, many, default == ())
    keywords = {} if default is dataclasses.MISSING else {"default": default}
    return eqx.field(converter=as_number, metadata={"quantity": about}, **keywords)


@dataclasses.dataclass(frozen=True)
class Whole:
    """Meaning and admissible range of a whole number that belongs to the structure."""

    meaning: str
    low: int
    high: int


def whole(meaning: str, *, low: int = 1, high: int = 100_000, default: Any = dataclasses.MISSING) -> Any:
    """A field with a whole number of the structure (static: another number is another program)."""
    keywords = {} if default is dataclasses.MISSING else {"default": default}
    return eqx.field(static=True, metadata={"whole": Whole(meaning, low, high)}, **keywords)


def holding(unit: str, **keywords: Any) -> Any:
    """A field with an object whose numbers of the unit `SI` are in `unit`, as the profile of a tension in N."""
    return eqx.field(metadata={"unit": unit}, **keywords)


def unit_below(field: dataclasses.Field, unit: str) -> str:
    """What the unit `SI` means below a field that stands where it means `unit`."""
    about = field.metadata.get("quantity")
    given = field.metadata.get("unit") if about is None else about.unit
    return unit if given in (None, "SI") else given


def about_of(field: dataclasses.Field, unit: str) -> Quantity | None:
    """What is known of a numeric field that stands where the unit `SI` means `unit`; `None` for other fields."""
    about = field.metadata.get("quantity")
    return dataclasses.replace(about, unit=unit) if about is not None and about.unit == "SI" else about


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number (or array of numbers) of a scene: its path, its value and what is known of it."""

    path: str
    value: Any
    about: Quantity


def leaves(node: Any, path: str = "", unit: str = "SI") -> list[Leaf]:
    """Every quantity below `node`, in the order of the fields; `unit`: what `SI` means here."""
    found: list[Leaf] = []
    if isinstance(node, tuple | list):
        for i, child in enumerate(node):
            found += leaves(child, f"{path}[{i}]", unit)
        return found
    if not dataclasses.is_dataclass(node) or isinstance(node, type):
        return found
    for field in dataclasses.fields(node):
        value = getattr(node, field.name)
        here = f"{path}.{field.name}" if path else field.name
        about = about_of(field, unit)
        if about is not None and not dataclasses.is_dataclass(value):  # where a law may stand for a number, its numbers
            if value is not None:
                found.append(Leaf(here, value, about))
        else:
            found += leaves(value, here, unit_below(field, unit))
    return found


def faults_of_values(node: Any, path: str = "") -> list[Fault]:
    """Values that are not numbers, not finite, outside their range or of too few bits. Traced values pass the rest."""
    faults = []
    for leaf in leaves(node, path):
        dtype = getattr(leaf.value, "dtype", np.dtype(np.float64))
        if np.issubdtype(dtype, np.floating) and dtype != np.float64:
            what = f"is {dtype}, in which events cannot be located"
            faults.append(Fault(leaf.path, what, f"give {leaf.about.meaning} as float64"))
            continue
        if isinstance(leaf.value, Tracer):
            continue
        if not isinstance(leaf.value, np.ndarray | jax.Array):
            faults.append(Fault(leaf.path, f"{leaf.value!r} is not a number", f"give a number in {leaf.about.unit}"))
            continue
        value = np.asarray(leaf.value)
        if value.ndim > leaf.about.many:
            hint = "give one number" + (", or a list of numbers" if leaf.about.many else "")
            faults.append(Fault(leaf.path, f"has the shape {value.shape}", hint))
            continue
        if value.size == 0 and not leaf.about.may_be_empty:
            faults.append(Fault(leaf.path, "is an empty list", f"give {leaf.about.meaning}"))
            continue
        bad = ~leaf.about.admits(value)
        if bad.any():
            which = "" if value.ndim == 0 else "[" + ", ".join(str(i) for i in np.argwhere(bad)[0]) + "]"
            worst = value[bad].flat[0]
            faults.append(
                Fault(
                    leaf.path + which,
                    f"{worst:g} {leaf.about.unit} is not admissible",
                    f"{leaf.about.meaning} must be {leaf.about.wanted(worst)} {leaf.about.unit}",
                )
            )
    return faults


def faults_of_tolerance(rtol: Any) -> list[Fault]:
    """A relative tolerance outside 1e-15…0.1. A traced one cannot be looked at and passes."""
    if isinstance(rtol, Tracer):
        return []
    value = np.asarray(rtol)
    # written so that a NaN is a fault
    admissible = np.all((value > 1e-15) & (value < 0.1))
    return [] if admissible else [Fault("rtol", f"{rtol} is not admissible", "must be > 1e-15 and < 0.1")]
