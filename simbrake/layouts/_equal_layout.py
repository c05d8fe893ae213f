"""Lining angles and areas that level a quantity along the band, at full slip or over a whole braking."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._base._progress import Line, duration
from .._base._quantity import as_number
from .._hybrid import Code
from .._hybrid._arrays import Array
from .._parts._band import running_product
from .._parts._layout import InfeasibleLayout, equal_increment_angles, equal_load_angles
from .._parts._scene import Scene, band_brake, faults, read_by_linings
from .._physics._assemble import assemble
from .._physics._sliding import Grip
from .._run._integral import as_tree
from .._run._measure import name_of
from .._run._outcome import FAILURES, SimulationError
from .._run._result import Result
from .._run._rubbing import Rubbing, fault_of_pair, friction_work, lining_mean, quantity_of, wear, wearing
from .._run._simulate import room_for, simulate, solver_of

#: what can be equal for all linings, with units at full slip and over a braking
TARGETS = {
    "tension_increment": ("N", "N"),
    "normal_load": ("N", "N"),
    "pressure": ("Pa", "Pa"),
    "wear": ("m/s", "m"),
    "friction_work": ("W", "J"),
}

#: a target's name, or a function of a `Result` to one number per lining
Target = str | Callable[[Result], Any]


def full_slip(scene: Scene) -> tuple[Rubbing, Array]:
    """Linings that all slide ahead as the run starts, and their coefficients of friction (model §2.2).

        T_i = T_0 Π_i,   N_i = (T_i + T_{i−1}) sin(β_i/2)

    at the speed and the temperatures of the start and the greatest slack tension of the lever; traceable.
    """
    system, y, _ = assemble(scene)
    grip, linings = system.grip, scene.brake.linings
    assert isinstance(grip, Grip)
    T_0 = jnp.asarray(scene.duty.lever.scale())
    v = jnp.full(linings.count, jnp.abs(jnp.asarray(scene.brake.radius) * jnp.asarray(scene.initial.omega)))
    hot = system.surfaces(y)[0]
    f = grip.coefficients(T_0, v, hot, jnp.asarray(False), static=False).f
    along = T_0 * running_product(grip.ratios(f)[0])
    before = jnp.concatenate([T_0[None], along[:-1]])
    normal = (along + before) * grip.sine
    pressure = None if linings.area is None else normal / jnp.asarray(linings.area)
    return Rubbing(along - before, normal, v, pressure, None if hot is None else hot.T), f


_full_slip_compiled = DeviceJit(full_slip)


def friction_at_start(scene: Scene) -> Float[np.ndarray, " n"]:
    """Coefficients of friction of sliding linings as the run starts."""
    return np.asarray(_full_slip_compiled(scene)[1], float)


def at_full_slip(scene: Scene, target: str, rate: Any) -> Float[Array, " n"]:
    """A target at the instant of `full_slip`: wear in m/s, friction work as power in W."""
    r, _ = full_slip(scene)
    if target == "wear":
        return wearing(rate, r)
    return quantity_of("friction_power" if target == "friction_work" else target, r)


def over_braking(result: Result, target: Target, rate: Any, pair: str) -> Float[Array, " n"]:
    """A target over a run: sums of wear and friction work, else means over the distance that a lining rubs."""
    if not isinstance(target, str):
        return jnp.asarray(target(result))
    if target == "wear":
        return wear(result, rate, pair=pair)
    if target == "friction_work":
        return friction_work(result, pair=pair)
    return lining_mean(result, target, over="slip", pair=pair)


def closed_form(scene: Scene, target: Target, *, areas: bool = True) -> tuple[Float[np.ndarray, " n"] | None, str]:
    """Angles of model §2.2 that level a target at full slip, with the friction of the start; else why there are none.

    Equal friction work is equal tension increments, equal wear is equal pressure (exact for a constant wear rate);
    without `areas` the areas are free, and angles need not level what they can.
    """
    n = scene.brake.linings.count
    f, wrap = friction_at_start(scene), float(np.sum(np.asarray(band_brake(scene).linings.angle)))
    area = scene.brake.linings.area
    try:
        if target in ("tension_increment", "friction_work"):
            return equal_increment_angles(f, n, n, wrap).angle, ""
        if target == "normal_load":
            return equal_load_angles(f, n, wrap).angle, ""
        if target in ("pressure", "wear") and areas and area is not None:
            return equal_load_angles(f, n, wrap, area=np.broadcast_to(np.asarray(area, float), (n,))).angle, ""
    except InfeasibleLayout as error:
        return None, str(error)
    return None, "there is no closed form for it"


FREE = ("angle", "area", "both")
OVER = ("static", "braking")
STARTS = ("closed form", "given")
#: targets that look at the areas
NEEDS_AREA = ("pressure", "wear")


def faults_of_wish(
    scene: Scene, targets: tuple[Target, ...], free: str, over: str, rate: Any, pair: str, start: str
) -> list[Fault]:
    """Everything wrong with a layout asked for, the scene's own faults included (arguments as of `equal_layout`)."""
    found = faults(scene)
    if start not in STARTS:
        found.append(Fault("start", f"{start!r} is unknown", f"there are: {', '.join(STARTS)}"))
    if free not in FREE:
        found.append(Fault("free", f"{free!r} cannot be freed", f"there are: {', '.join(FREE)}"))
    if over not in OVER:
        found.append(Fault("over", f"{over!r} is unknown", f"there are: {', '.join(OVER)}"))
    pairs = list(band_brake(scene).pairs)
    if missing := fault_of_pair(pair, pairs):
        found.append(missing)
    elif pair != pairs[0] and over == "static":
        found.append(Fault("pair", "statics are those of the band on the linings", 'give over="braking"'))
    for one in targets:
        if isinstance(one, str) and one not in TARGETS:
            hint = f"there are: {', '.join(TARGETS)}, or a function of a result to one number per lining"
            found.append(Fault("target", f"{one!r} is unknown", hint))
        elif not isinstance(one, str) and over == "static":
            found.append(Fault("target", "a function of a result needs a run", 'give over="braking"'))
    if len(targets) != (2 if free == "both" else 1):
        hint = 'as ("tension_increment", "pressure"): the first for the angles, the second for the areas'
        words = f"{free!r} levels {2 if free == 'both' else 1}, there are {len(targets)}"
        found.append(Fault("target", words, hint if free == "both" else 'free="both" levels two'))
    if "wear" in targets and rate is None:
        found.append(Fault("rate", "is missing", "wear needs a wear rate in m³/(N·m)"))
    return found + _faults_of_areas(scene, targets, free, pair)


def _faults_of_areas(scene: Scene, targets: tuple[Target, ...], free: str, pair: str) -> list[Fault]:
    brake, found = band_brake(scene), []
    n = int(np.size(brake.linings.angle))
    if n < 2:
        found.append(Fault("brake.linings.angle", "one lining has no layout", "give two or more"))
    first, *others = brake.pairs
    looked_at = {pair} & set(brake.pairs) if any(one in NEEDS_AREA for one in targets) else set()
    looked_at |= {first} if free in ("area", "both") else set()
    for one in sorted(looked_at):
        if brake.rubbing_part(one).area is None:
            found.append(Fault(f"brake.{brake.pairs[one].field}.area", "is missing", "the areas are looked at"))
    if free != "angle" and pair in others:
        found.append(Fault("free", "the areas that can be freed are those towards the band", 'free="angle"'))
    if free == "area" and not read_by_linings(scene).p:
        for one in targets:
            if isinstance(one, str) and one in TARGETS and one not in NEEDS_AREA:
                found.append(Fault("target", f"{one} does not depend on the areas", "free the angles"))
    return found


@dataclasses.dataclass(frozen=True)
class LayoutRow:
    """One layout: `angle` (n,) in rad, `area` (n,) in m² or `None`, and every target (n,) by name, with its unit."""

    name: str
    angle: Float[np.ndarray, " n"]
    area: Float[np.ndarray, " n"] | None
    values: dict[str, Any]
    units: dict[str, str]

    @property
    def non_uniformity(self) -> float:
        """Greatest over least of a target along the band, of the worst target; `nan` where it could not be found."""
        if not self.values:
            return float("nan")
        return float(max(np.max(value) / np.min(value) for value in self.values.values()))

    def as_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "angle": self.angle.tolist(),
            "area": None if self.area is None else self.area.tolist(),
            "values": {name: np.asarray(value).tolist() for name, value in self.values.items()},
            "units": dict(self.units),
            "non_uniformity": self.non_uniformity,
        }


@dataclasses.dataclass(frozen=True)
class LayoutDesign:
    """A layout that levels a target: the scene with it, and the layouts it is compared with.

    - `rows`: the layout `given`, that of the `closed form` (where there is one, else `note` says why not), `optimum`
    - `iterations` of the search, `runs` of the simulation with its derivatives (static: evaluations)
    """

    scene: Scene
    target: tuple[str, ...]
    over: str
    free: str
    rows: tuple[LayoutRow, ...]
    iterations: int
    runs: int
    note: str = ""

    def row(self, name: str) -> LayoutRow:
        """One of `rows` by its name. Raises `KeyError` where there is none."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    @property
    def angle(self) -> Float[np.ndarray, " n"]:
        """Lining angles (rad)."""
        return self.row("optimum").angle

    @property
    def area(self) -> Float[np.ndarray, " n"] | None:
        """Lining areas (m²)."""
        return self.row("optimum").area

    @property
    def non_uniformity(self) -> float:
        """Greatest over least of the target along the band."""
        return self.row("optimum").non_uniformity

    def as_dict(self) -> dict[str, Any]:
        """Everything but the scene, as numbers, lists and words."""
        return {
            "target": list(self.target),
            "over": self.over,
            "free": self.free,
            "layouts": [row.as_dict() for row in self.rows],
            "iterations": self.iterations,
            "runs": self.runs,
            "note": self.note,
        }

    def __str__(self) -> str:
        over = "at full slip" if self.over == "static" else "over the braking"
        freed = {"angle": "angles", "area": "areas", "both": "angles and areas"}[self.free]
        lines = [f"equal {' and '.join(self.target)} {over}: {freed} found in {self.iterations} iterations"]
        if self.note:
            lines.append(f"no closed form to compare with: {self.note}")
        columns = [column for row in self.rows for column in self._columns(row)]
        spans = [(row.name, sum(len(c[0]) + 2 for c in self._columns(row))) for row in self.rows]
        lines.append(" " * 8 + "".join(f"{name:>{width}}" for name, width in spans))
        lines.append("lining  " + "".join(f"  {head}" for head, _ in columns))
        for i in range(len(self.angle)):
            cells = "".join(f"  {values[i]:{len(head)}.5g}" for head, values in columns)
            lines.append(f"{i + 1:6}  {cells}")
        ends = "".join(f"{row.non_uniformity:>{width}.7g}" for row, (_, width) in zip(self.rows, spans, strict=True))
        lines.append(f"max/min {ends}")
        return "\n".join(lines)

    def _columns(self, row: LayoutRow) -> list[tuple[str, np.ndarray]]:
        found = [("     β, °", np.degrees(row.angle))]
        if self.free != "angle" and row.area is not None:
            found.append(("  A, cm²", 1e4 * row.area))
        for name, value in row.values.items():
            unit = f", {row.units[name]}" if row.units[name] else ""
            found.append((f"{name + unit:>12}", value))
        return found


Place = Callable[[Scene, Any, Any], Scene]


def _placed(scene: Scene, angle: Any, area: Any) -> Scene:
    """The scene with other lining angles, and areas where it has any."""
    scene = eqx.tree_at(lambda s: s.brake.linings.angle, scene, angle)
    return scene if area is None else eqx.tree_at(lambda s: s.brake.linings.area, scene, area, is_leaf=_is_none)


def _is_none(leaf: Any) -> bool:
    return leaf is None


@dataclasses.dataclass(frozen=True)
class _Spec:
    """What decides the structure of the search's program."""

    targets: tuple[Target, ...]
    free: str
    over: str
    pair: str
    place: Place
    solver: Any = None
    max_steps: int = 0
    rtol: float = 1e-10


def _contrasts(n: int) -> Float[np.ndarray, "m n"]:
    """`n − 1` orthonormal directions along which entries change and their sum does not (Helmert)."""
    i = np.arange(1, n)[:, None]
    j = np.arange(n)[None, :]
    return np.where(j < i, 1.0, np.where(j == i, -i, 0.0)) / np.sqrt(i * (i + 1))


def _unfolded(w: Any, angle: Any, area: Any, free: str) -> tuple[Any, Any]:
    """Angles and areas for the unknowns `w`: shares that stay positive, `x_i = Σx · softmax(ln x⁰ + Hᵀ w)_i`."""
    n = angle.shape[0]
    directions = jnp.asarray(_contrasts(n)).T

    def scaled(start: Any, w: Any) -> Any:
        return jnp.sum(start) * jax.nn.softmax(jnp.log(start) + directions @ w)

    if free != "area":
        angle = scaled(angle, w[: n - 1])
    return angle, area if free == "angle" else scaled(area, w[-(n - 1) :])


def _evaluate(w: Any, scene: Scene, angle: Any, area: Any, rate: Any, *, spec: _Spec) -> Any:
    """Residuals, their derivatives by `w`, the targets and the result code for one layout."""
    contrasts = jnp.asarray(_contrasts(angle.shape[0]))

    def levelled(w: Any) -> Any:
        laid = spec.place(scene, *_unfolded(w, angle, area, spec.free))
        if spec.over == "static":
            values = [at_full_slip(laid, one, rate) for one in spec.targets]  # pyright: ignore
            code = jnp.zeros((), jnp.int32)
        else:
            result = simulate(laid, solver=spec.solver, rtol=spec.rtol, max_steps=spec.max_steps)
            values = [over_braking(result, one, rate, spec.pair) for one in spec.targets]
            code = result.code
        logs = [jnp.log(jnp.where(value > 0, value, jnp.nan)) for value in values]
        residual = jnp.concatenate([contrasts @ log for log in logs])
        return residual, (residual, values, code)

    jacobian, (residual, values, code) = jax.jacfwd(levelled, has_aux=True)(w)
    return residual, jacobian, values, code


_compiled = DeviceJit(_evaluate, static_argnames="spec")


class _Search:
    """Residuals and Jacobians for SciPy: each layout is run once for both."""

    def __init__(self, scene: Scene, angle: np.ndarray, area: Any, rate: Any, spec: _Spec, f: np.ndarray):
        self.arguments, self.spec, self.friction = (scene, angle, area, rate), spec, f
        self.runs = 0
        self.progress = Line("layout")
        self._last: tuple[bytes, Any] | None = None

    def look(self, w: np.ndarray) -> Any:
        if self._last is not None and self._last[0] == w.tobytes():
            return self._last[1]
        angle = np.asarray(_unfolded(w, *self.arguments[1:3], self.spec.free)[0])
        size = len(self.spec.targets) * (len(angle) - 1)
        if np.max(angle) >= np.pi or np.max(self.friction * np.tan(angle / 2)) >= 1:  # a lining would lock itself
            found = (np.full(size, np.nan), np.full((size, len(w)), np.nan), None, 0)
        else:
            found = self._run(w)
        self._last = (w.tobytes(), found)
        return found

    def _run(self, w: np.ndarray) -> Any:
        self.runs += 1
        residual, jacobian, values, code = _compiled(w, *self.arguments, spec=self.spec)
        if int(code) == Code.STEP_LIMIT and self.spec.max_steps < 16384:
            self.spec = dataclasses.replace(self.spec, max_steps=4 * self.spec.max_steps)
            return self._run(w)
        residual = np.asarray(residual) if int(code) == 0 else np.full(residual.shape, np.nan)
        worst = max(np.max(np.asarray(v)) / np.min(np.asarray(v)) for v in values)
        self.progress.show(f"run {self.runs}, greatest over least {worst:.9g}, {duration(self.progress.spent)}")
        return residual, np.asarray(jacobian), values, int(code)

    def residual(self, w: np.ndarray) -> np.ndarray:
        return self.look(w)[0]

    def jacobian(self, w: np.ndarray) -> np.ndarray:
        return self.look(w)[1]


def _start(scene: Scene, targets: tuple[Target, ...], free: str) -> tuple[Any, Any, str]:
    """Angles and areas in closed form (the scene's own where there is none), and why there is none."""
    linings = band_brake(scene).linings
    angle = np.asarray(linings.angle, float)
    area = None if linings.area is None else np.broadcast_to(np.asarray(linings.area, float), angle.shape)
    note = ""
    if free != "area":
        found, note = closed_form(scene, targets[0], areas=free == "angle")
        angle = angle if found is None else found
    if free != "angle" and area is not None:
        if targets[-1] in NEEDS_AREA:  # A_i ∝ N_i at full slip
            laid = _placed(scene, angle, area)
            normal = np.asarray(at_full_slip(laid, "normal_load", None))
            area = area.sum() * normal / normal.sum()
        else:
            note = note or "there is no closed form for the areas"
    return angle, area, note


def _prepared(scene: Scene, spec: _Spec, rate: Any, start: str) -> tuple[_Search, Scene | None, str]:
    """The search from its starting layout, the scene with the closed form, or why there is none."""
    angle, area, note = _start(scene, spec.targets, spec.free)
    closed = None if note else _placed(scene, angle, area)
    if start == "given":
        linings = band_brake(scene).linings
        angle = np.asarray(linings.angle, float)
        area = None if area is None else np.broadcast_to(np.asarray(linings.area, float), angle.shape)
    return _Search(scene, angle, area, rate, spec, friction_at_start(scene)), closed, note


def equal_layout(
    scene: Scene,
    target: Target | tuple[Target, ...],
    *,
    free: str = "angle",
    over: str = "static",
    rate: Any = None,
    pair: str = "external",
    place: Place = _placed,
    start: str = "closed form",
    solver: Any = None,
    rtol: float = 1e-10,
    tolerance: float = 1e-8,
    max_iterations: int = 50,
) -> LayoutDesign:
    """Angles `β_i` (Σβ fixed) or areas `A_i` (ΣA fixed) for which a target is the same for every lining.

        ln q_i(β, A) − mean ln q = 0,   β_i = Σβ · softmax(ln β⁰ + Hᵀ w)_i

    by SciPy's trust-region least squares with the exact Jacobian, of the simulation where there is one, from the closed
    forms of model §2.2. Gaps of a band's geometry stay as they are.

    - `target`: `tension_increment`, `normal_load`, `pressure`, `wear`, `friction_work`, or a function of a `Result` to
      one positive number per lining; with `free="both"` two: one for the angles and one for the areas
    - `free`: `angle`, `area` or `both`
    - `over`: `static`: all linings slide, with the friction, the speed and the temperatures of the start and the
      greatest slack tension; `braking`: over the run of the scene, wear and friction work summed, the others as means
      over the distance that a lining rubs
    - `rate`: wear rate (m³/(N·m)), as in `wear`;  `pair`: as in `rubbing`
    - `place(scene, angle, area)`: how a layout enters the scene, where more than the linings depends on it (areas of
      the walls that heat them); by default `brake.linings` alone
    - `start`: `closed form`, or `given` for the scene's own layout
    - `tolerance`: greatest over least of the target, less 1, at which the layout is level

    Raises `InputError` with all faults at once, `InfeasibleLayout` where the target cannot be levelled, and
    `SimulationError` where the run of the starting layout fails.
    """
    targets = target if isinstance(target, tuple) else (target,)
    if found := faults_of_wish(scene, targets, free, over, rate, pair, start):
        raise InputError(found)
    wear_rate = as_tree(rate) if callable(rate) else None if rate is None else jnp.asarray(as_number(rate))
    spec = _Spec(targets, free, over, pair, place)
    if over == "braking":
        solver = solver_of(scene, solver)
        room = room_for(simulate(scene, solver=solver, rtol=rtol))
        spec = dataclasses.replace(spec, solver=solver, max_steps=room, rtol=rtol)
    search, closed, note = _prepared(scene, spec, wear_rate, start)
    rows, iterations = _searched(search, scene, closed, tolerance, max_iterations)
    best = rows[-1]
    laid = place(scene, jnp.asarray(best.angle), None if best.area is None else jnp.asarray(best.area))
    return LayoutDesign(
        scene=jax.tree.map(np.asarray, laid),
        target=tuple(name_of(one) for one in targets),
        over=over,
        free=free,
        rows=rows,
        iterations=iterations,
        runs=search.runs,
        note=note,
    )


def _searched(
    search: _Search, scene: Scene, closed: Scene | None, tolerance: float, most: int
) -> tuple[tuple[LayoutRow, ...], int]:
    """The layouts given, in closed form where there is one, and level; and how many iterations that took."""
    try:
        rows = [_row("given", scene, search)]
        rows += [] if closed is None else [_row("closed form", closed, search)]
        w, iterations = _solve(search, tolerance, most)
        rows.append(_row("optimum", None, search, w))
    finally:
        search.progress.done()
    if not rows[-1].non_uniformity <= 1 + tolerance:
        raise InfeasibleLayout(_why_not(rows[-1], search.spec.targets, search.friction))
    return tuple(rows), iterations


def _solve(search: _Search, tolerance: float, max_iterations: int) -> tuple[np.ndarray, int]:
    from scipy.optimize import least_squares  # imported where it is used: most runs design no layout

    n = len(search.arguments[1])
    w = np.zeros((2 if search.spec.free == "both" else 1) * (n - 1))
    residual, _, _, code = search.look(w)
    if code != 0:
        name, what, hint = FAILURES[code]
        raise SimulationError(f"{name}: the starting layout's run fails, {what}: {hint}", None)
    if not np.all(np.isfinite(residual)):
        raise InfeasibleLayout(
            "the starting layout has no positive target at every lining: do all linings slide in the run, and does no "
            "lining lock itself (f·tan(β/2) ≥ 1)?"
        )
    found = least_squares(
        search.residual,
        w,
        search.jacobian,  # pyright: ignore
        method="trf",
        ftol=1e-15,
        xtol=1e-15,
        gtol=0.01 * tolerance,
        max_nfev=max_iterations,
    )
    return found.x, int(found.njev)


def _row(name: str, scene: Scene | None, search: _Search, w: np.ndarray | None = None) -> LayoutRow:
    """One layout with its targets: that of a scene, or the one of the unknowns `w`."""
    base, angle, area, rate = search.arguments
    if scene is not None:
        angle, own = np.asarray(band_brake(scene).linings.angle, float), scene.brake.linings.area
        area = None if own is None else np.broadcast_to(np.asarray(own, float), angle.shape)
        at = _Search(base, angle, area, rate, search.spec, search.friction)
        w = np.zeros((2 if at.spec.free == "both" else 1) * (len(angle) - 1))
        values = at.look(w)[2]
        search.runs, search.spec = search.runs + at.runs, at.spec
    else:
        assert w is not None
        values = search.look(w)[2]
        angle, area = (None if x is None else np.asarray(x) for x in _unfolded(w, angle, area, search.spec.free))
    units = [_unit(one, search.spec.over) for one in search.spec.targets]
    named = [name_of(one) for one in search.spec.targets]
    columns = {} if values is None else {k: np.asarray(v) for k, v in zip(named, values, strict=True)}
    return LayoutRow(name, angle, area, columns, dict(zip(named, units, strict=True)))  # pyright: ignore


def _unit(target: Target, over: str) -> str:
    return TARGETS[target][over == "braking"] if isinstance(target, str) else ""


def _why_not(best: LayoutRow, targets: tuple[Target, ...], f: np.ndarray) -> str:
    grip = f * np.tan(best.angle / 2)
    words = " and ".join(name_of(one) for one in targets)
    return (
        f"{words} cannot be made equal: the best layout found has a greatest over least of {best.non_uniformity:.6g}; "
        f"lining {int(np.argmax(grip)) + 1} is nearest to locking itself, f·tan(β/2) = {np.max(grip):.4g}"
    )
