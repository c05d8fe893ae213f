"""Fitting numbers of a scene to measured data: bounded least squares with exact derivatives through all events."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._identify import LOSSES
from .._base._quantity import Leaf, leaves
from .._parts._scene import Scene, check
from .._run._choice import stiffness
from .._run._edit import with_values
from .._run._simulate import solver_for
from ._assess import assess
from ._calibration import Calibration
from ._fit_model import FitModel, measured_arrays
from ._measured import Measured, check_measured
from ._search import Scale, Search

#: bounds whose ratio is greater are searched on a logarithmic scale
_DECADES = 100.0


def calibrate(
    scene: Scene,
    bounds: Mapping[str, tuple[float, float]],
    data: Measured,
    *,
    start: Mapping[str, float] | None = None,
    rtol: float = 1e-8,
    solver: Any = None,
    max_steps: int | None = None,
    loss: str = "linear",
    loss_scale: float = 1.0,
    absolute: bool | None = None,
    confidence: float = 0.95,
    starts: int = 1,
    method: str = "trf",
    max_evaluations: int = 200,
) -> Calibration:
    """Fits numbers of a scene, within bounds, to measured data: `min ½ Σ ρ(((model − measured)/σ)²)`.

    - `bounds`: `{"brake.linings.friction.coefficient": (0.2, 0.5)}` in SI units, paths as in `with_values`; where both
      are positive and their ratio exceeds 100 the search is logarithmic
    - `data`: `read_measured(…)` or `Measured.of(…)`;  `start`: start values, by default the scene's
    - `rtol`, `solver`, `max_steps`: as for `simulate`
    - `loss`: `linear`, or against outliers `soft_l1`, `huber`, `cauchy`, `arctan` of residuals beyond `loss_scale` σ
    - `absolute`: whether the σ are absolute (errors from them alone) or only weights (errors scaled by the scatter of
      the residuals, Student's t); by default absolute where all are given
    - `starts`: so many starts, the first at `start`, the others spread over the bounds (Halton); the best fit counts
    - `method`: `trf` or `dogbox` of `scipy.optimize.least_squares`;  `max_evaluations` of each start

    A trial point whose run fails, or in which a measured event does not occur, is refused: the step is shortened, and
    the reason is counted in `Calibration.failures`. Ctrl-C ends the search with the best point found so far.

    Raises `InputError` with all faults at once, also where no start has all measured events.
    Source: errors after Björck, Numerical Methods for Least Squares Problems (1996), 1.1, 2.7.
    """
    choices = {"loss": (loss, LOSSES), "method": (method, ("trf", "dogbox"))}
    faults = [Fault(n, f"{v!r} is not known", f"one of {', '.join(k)}") for n, (v, k) in choices.items() if v not in k]
    limits = (
        ("starts", starts, starts >= 1),
        ("confidence", confidence, 0 < confidence < 1),
        ("loss_scale", loss_scale, loss_scale > 0),
        ("rtol", rtol, 1e-15 < rtol < 0.1),
        ("max_evaluations", max_evaluations, max_evaluations >= 1),
    )
    faults += [Fault(name, f"{value} is not admissible") for name, value, ok in limits if not ok]
    first = _first(scene, bounds, start or {}, faults)
    absolute = _absoluteness(data, absolute, len(bounds), faults)
    if faults:
        raise InputError(faults)
    before = with_values(scene, dict(zip(bounds, first, strict=True)))
    check(before)
    check_measured(data, before)
    low, high = (np.asarray([pair[i] for pair in bounds.values()], float) for i in (0, 1))
    scale = Scale(low, high, (low > 0) & (high > _DECADES * low))
    solver = _solver(before, bounds) if solver is None else solver
    model = FitModel(before, tuple(bounds), data, solver=solver, rtol=rtol, max_steps=max_steps)
    search = Search(model, scale, *measured_arrays(data), loss, loss_scale, method, max_evaluations, starts)
    search.run(scale.down(first))
    return assess(search, before, data, first, absolute=absolute, confidence=confidence, rtol=rtol)


def _first(scene: Scene, bounds: Mapping[str, Any], start: Mapping[str, float], faults: list[Fault]) -> np.ndarray:
    """Start values; adds what is wrong with them and with the bounds."""
    known: dict[str, Leaf] = {leaf.path: leaf for leaf in leaves(scene)}
    first = []
    if not bounds:
        faults.append(Fault("bounds", "no parameter is to be fitted", '{"brake.pulley.inertia": (500, 2000)}'))
    for path in sorted(set(start) - set(bounds)):
        faults.append(Fault(path, "has a start value but no bounds", "give bounds, or set it in the scene"))
    for path, pair in bounds.items():
        value = start.get(path)
        try:
            low, high = (float(end) for end in pair)
            with_values(scene, {path: low})
        except InputError as error:
            faults += error.faults
            continue
        except (TypeError, ValueError):
            faults.append(Fault(path, f"{pair!r} are no bounds", "two numbers (low, high)"))
            continue
        leaf = known.get(path) or known.get(path.rpartition("[")[0])
        if not (np.isfinite([low, high]).all() and low < high):
            faults.append(Fault(path, f"the bounds {low:g}…{high:g} are not admissible", "finite, low < high"))
            continue
        if leaf is not None:
            faults += [
                Fault(path, f"the bound {end:g} {leaf.about.unit} is not admissible", f"must be {leaf.about.range}")
                for end in (low, high)
                if not leaf.about.admits(np.asarray(end))
            ]
        value = _value(known, path) if value is None else float(value)
        if value is None:
            faults.append(Fault(path, "has no one value in the scene", "give its start value"))
        elif not low <= value <= high:
            faults.append(Fault(path, f"the start {value:g} is outside the bounds {low:g}…{high:g}", "give a start"))
        else:
            first.append(value)
    return np.asarray(first)


def _value(known: dict[str, Leaf], path: str) -> float | None:
    if path in known:
        values = np.asarray(known[path].value, float)
        return float(values.flat[0]) if values.size and np.ptp(values) == 0 else None
    base, _, index = path.rpartition("[")
    return float(np.asarray(known[base].value, float)[int(index[:-1])]) if base in known else None


def _absoluteness(data: Measured, wanted: bool | None, parameters: int, faults: list[Fault]) -> bool:
    """Whether standard deviations are absolute; adds what is wrong with them."""
    parts = (*data.points, *data.singles)
    without = [part.name for part in parts if part.sigma is None]
    hint = "give its measuring error, as a column …_sigma or by sigma={…}"
    if without and (len(parts) > 1 or wanted):
        faults += [Fault(name, "has no standard deviation", hint) for name in without]
    absolute = not without if wanted is None else wanted
    if not absolute and data.count <= parameters:
        what = f"{data.count} values do not show their own scatter beside {parameters} parameters"
        faults.append(Fault("data", what, "measure more, or give standard deviations"))
    return absolute


def _solver(scene: Scene, bounds: Mapping[str, Any]) -> Any:
    """The method that `simulate` would take at the start or with any parameter at a bound: the stiff one if any is."""
    trials = [scene, *(with_values(scene, {path: end}) for path, pair in bounds.items() for end in pair)]
    return solver_for(scene.heated and any(stiffness(trial)[0] for trial in trials))
