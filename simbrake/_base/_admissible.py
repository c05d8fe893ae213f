"""Arguments of engineering formulas: numbers that must be positive, or not negative."""

from typing import Any

import numpy as np


def require_positive(**values: Any) -> None:
    """Raises `ValueError` that names every value which is not a finite number above 0; `None` is not looked at."""
    _require("positive", {name: np.asarray(value) > 0 for name, value in values.items() if value is not None}, values)


def require_not_negative(**values: Any) -> None:
    """Raises `ValueError` that names every value which is not a finite number of at least 0; `None` is left out."""
    good = {name: np.asarray(value) >= 0 for name, value in values.items() if value is not None}
    _require("at least 0", good, values)


def require_share(**values: Any) -> None:
    """Raises `ValueError` that names every value outside 0…1."""
    good = {name: (np.asarray(v) >= 0) & (np.asarray(v) <= 1) for name, v in values.items() if v is not None}
    _require("between 0 and 1", good, values)


def _require(what: str, good: dict[str, Any], values: dict[str, Any]) -> None:
    bad = [name for name, ok in good.items() if not np.all(ok & np.isfinite(np.asarray(values[name], float)))]
    if bad:
        raise ValueError("; ".join(f"{name} = {values[name]} must be {what}" for name in bad))
