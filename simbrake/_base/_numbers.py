"""Numbers as people write them, with or without a unit, as numbers in SI."""

import json
import re
from typing import Any

import numpy as np

from ._faults import Fault
from ._quantity import Quantity
from ._units import to_si, unit

#: what stands for a value that could not be read
BAD = object()
_NUMBER = re.compile(r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(?P<unit>[^\d\s.].*|1/.*|)")
_LIST = re.compile(r"\s*(?P<list>\[[^\[\]]*\])\s*(?P<unit>.*)")


class NumberReader:
    """Reads numbers and keeps every fault: path, value, unit, why, and what is admissible."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def fault(self, path: str, problem: str, hint: str = "") -> Any:
        self.faults.append(Fault(path or "scene", problem, hint))
        return BAD

    def number(self, value: Any, about: Quantity, path: str, unit: str) -> Any:
        """A number or a list of numbers in SI, inside its range."""
        if isinstance(value, str) and (match := _LIST.fullmatch(value)):
            try:
                listed = json.loads(match["list"])
            except ValueError:
                return self.fault(path, f"{shown(value)} is no list of numbers", 'as in "[0.2, 0.3] rad"')
            value = [f"{x!r} {match['unit']}" if isinstance(x, int | float) else x for x in listed]
        if isinstance(value, list) and not about.many:
            return self.fault(path, "is a list", f"one number is wanted: {about.meaning}{example(unit)}")
        if isinstance(value, list):
            entries = [self._scalar(one, about, f"{path}[{i}]", unit) for i, one in enumerate(value)]
            return BAD if any(one is BAD for one in entries) else np.asarray(entries, np.float64)
        return self._scalar(value, about, path, unit)

    def _scalar(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        number = self._in_si(value, about, path, si)
        if number is BAD or about.admits(np.asarray(number)).all():
            return number
        words = f"{about.meaning} must be {about.wanted(number)}" + ("" if si in ("1", "SI") else f" {si}")
        same = isinstance(value, str) and f"{number:g} {si}" != value and np.isfinite(number)
        return self.fault(path, f"{shown(value)}{f' = {number:g} {si}' if same else ''} is not admissible", words)

    def _in_si(self, value: Any, about: Quantity, path: str, si: str) -> Any:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            return self.fault(path, f"{shown(value)} is no number", f"{about.meaning}{example(si)}")
        if not isinstance(value, str):
            try:
                return float(value)
            except OverflowError:
                return self.fault(path, f"{shown(value)} is too large")
        match = _NUMBER.fullmatch(value)
        if match is None:
            return self.fault(path, f"{shown(value)} is no number with a unit", f"{about.meaning}{example(si)}")
        try:
            of = unit(match["unit"], si)
        except ValueError as error:
            what = f"{match['unit'].strip()!r} is no unit of {about.meaning}, which is in {si}"
            return self.fault(path, f"{shown(value)}: {what}", str(error))
        if about.difference and of.offset:
            return self.fault(path, f"{shown(value)} is a temperature, not a difference of two", "give it in K")
        number = float(match["number"])
        return to_si(number, of)


def shown(value: Any) -> str:
    """A value of a file, short enough for a message."""
    text = repr(value) if not isinstance(value, dict) else "a table"
    return text if len(text) <= 60 else text[:57] + "…"


def example(si: str) -> str:
    """How a number in the unit `si` may be written."""
    examples = {"N": "120 kN", "rad": "270 deg", "K": "450 degC", "m": "590 mm", "rad/s": "24 rad/s", "s": "0.35 s"}
    return f', in SI units or with its unit, as in "{examples.get(si, f"1.5 {si}")}"' if si not in ("1", "SI") else ""
