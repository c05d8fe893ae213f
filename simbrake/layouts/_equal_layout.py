"""Lining angles and areas that level a quantity along the band, at full slip or over a whole braking."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._base._progress import Line, duration
from .._base._quantity import as_number
from .._base._table import Column, Table, Tabular, plain
from .._parts._scene import Scene, band_brake, faults, read_by_linings
from .._physics._assemble import assemble
from .._physics._sliding import Grip
from .._run._linings import Rubbing, fault_of_pair, friction_work, lining_mean, lining_wear, quantity_of, wearing
from .._run._log import FAILURES, SimulationError
from .._run._measure import name_of
from .._run._probe import as_tree
from .._run._result import Result
from ..brakes._band import running_product
from ..hybrid._arrays import Array
from ..studies._evaluator import Evaluation, Evaluator
from ._closed_form import InfeasibleLayout, equal_increment_angles, equal_load_angles

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

    at the speed and the temperatures of the start and the maximum slack tension of the lever; traceable.
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
        return lining_wear(result, rate, pair=pair)
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


def validate_request(
    scene: Scene, targets: tuple[Target, ...], free: str, over: str, rate: Any, pair: str, start: str
) -> list[Fault]:
    """Everything wrong with a requested layout, errors of the scene included (arguments as of `equal_layout`)."""
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
        """Maximum over minimum of a target along the band, of the worst target; `nan` where it could not be found."""
        if not self.values:
            return float("nan")
        return float(max(np.max(value) / np.min(value) for value in self.values.values()))

    def as_dict(self) -> dict[str, Any]:
        """Everything as numbers, lists and words."""
        return {**plain(self), "non_uniformity": plain(self.non_uniformity)}


@dataclasses.dataclass(frozen=True)
class LayoutDesign(Tabular):
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
        """Maximum over minimum of the target along the band."""
        return self.row("optimum").non_uniformity

    def as_dict(self) -> dict[str, Any]:
        """Everything but the scene, as numbers, lists and words."""
        found = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        rows, _ = found.pop("rows"), found.pop("scene")
        return plain(found) | {"layouts": [row.as_dict() for row in rows]}

    def parts(self) -> Iterator[str | Table]:
        over = "at full slip" if self.over == "static" else "over the braking"
        freed = {"angle": "angles", "area": "areas", "both": "angles and areas"}[self.free]
        yield f"equal {' and '.join(self.target)} {over}: {freed} found in {self.iterations} iterations"
        if self.note:
            yield f"no closed form to compare with: {self.note}"
        columns, values = [Column("lining")], [np.arange(1, len(self.angle) + 1)]
        for row in self.rows:
            columns.append(Column(f"{row.name} β", "rad", shown_in="°", show=lambda x: f"{np.degrees(x):.5g}"))
            values.append(row.angle)
            if self.free != "angle" and row.area is not None:
                columns.append(Column(f"{row.name} A", "m^2", shown_in="cm²", show=lambda x: f"{1e4 * x:.5g}"))
                values.append(row.area)
            for name, value in row.values.items():
                columns.append(Column(f"{row.name} {name}", row.units[name], show=".5g"))
                values.append(np.asarray(value))
        yield Table(columns, zip(*(column.tolist() for column in values), strict=True))
        yield Table(
            [Column("layout", left=True), Column("max/min", show=".7g")],
            [(row.name, row.non_uniformity) for row in self.rows],
        )


Place = Callable[[Scene, Any, Any], Scene]


def _placed(scene: Scene, angle: Any, area: Any) -> Scene:
    """The scene with other lining angles, and areas where it has any."""
    scene = eqx.tree_at(lambda s: s.brake.linings.angle, scene, angle)
    return scene if area is None else eqx.tree_at(lambda s: s.brake.linings.area, scene, area, is_leaf=_is_none)


def _is_none(leaf: Any) -> bool:
    return leaf is None


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


class _Unfolded(NamedTuple):
    """The way of the unknowns into the scene."""

    free: str
    place: Place

    def __call__(self, scene: Scene, w: Any, given: Any) -> Scene:
        angle, area, _ = given
        return self.place(scene, *_unfolded(w, angle, area, self.free))


class _Levelled(NamedTuple):
    """Residuals, and the targets themselves, of a layout: of its scene at full slip, or of its run."""

    targets: tuple[Target, ...]
    over: str
    pair: str

    def __call__(self, found: Any, given: Any) -> tuple[Array, list[Array]]:
        angle, _, rate = given
        if self.over == "static":
            values = [at_full_slip(found, one, rate) for one in self.targets]  # pyright: ignore
        else:
            values = [over_braking(found, one, rate, self.pair) for one in self.targets]
        contrasts = jnp.asarray(_contrasts(angle.shape[0]))
        logs = [jnp.log(jnp.where(value > 0, value, jnp.nan)) for value in values]
        return jnp.concatenate([contrasts @ log for log in logs]), values


class _Search:
    """Residuals and Jacobians for SciPy, from a starting layout `given`: angles, areas and the wear rate."""

    def __init__(self, run: Evaluator, free: str, levelled: _Levelled, friction: np.ndarray):
        self.run, self.free, self.levelled, self.friction = run, free, levelled, friction
        self.progress = Line("layout")

    @property
    def size(self) -> int:
        """How many unknowns there are."""
        return (2 if self.free == "both" else 1) * (len(self.run.given[0]) - 1)

    def look(self, w: np.ndarray, given: Any = None) -> Evaluation:
        """A layout; one in which a lining would lock itself is not run."""
        angle, area, _ = self.run.given if given is None else given
        angle = np.asarray(_unfolded(w, angle, area, self.free)[0])
        if np.max(angle) >= np.pi or np.max(self.friction * np.tan(angle / 2)) >= 1:
            size = len(self.levelled.targets) * (len(angle) - 1)
            return Evaluation(np.full(size, np.nan), np.full((size, len(w)), np.nan), 0, None)
        before, found = self.run.runs, self.run(w, given)
        if self.run.runs > before:
            worst = max(np.max(np.asarray(v)) / np.min(np.asarray(v)) for v in found.more)
            spent = duration(self.progress.spent)
            self.progress.show(f"run {self.run.runs}, maximum over minimum {worst:.9g}, {spent}")
        return found if found.code == 0 else found._replace(values=np.full_like(found.values, np.nan))


def _start(scene: Scene, targets: tuple[Target, ...], free: str) -> tuple[Any, Any, str]:
    """Angles and areas in closed form (the scene's own where there is none), and why there is none."""
    linings = band_brake(scene).linings
    angle = np.asarray(linings.angle, float)
    area, note = _areas(linings, angle), ""
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


def _areas(linings: Any, like: np.ndarray) -> np.ndarray | None:
    return None if linings.area is None else np.broadcast_to(np.asarray(linings.area, float), like.shape)


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
    - `tolerance`: maximum over minimum of the target, less 1, at which the layout is level

    Raises `InputError` with all errors at once, `InfeasibleLayout` where the target cannot be levelled, and
    `SimulationError` where the run of the starting layout fails.
    """
    targets = target if isinstance(target, tuple) else (target,)
    if found := validate_request(scene, targets, free, over, rate, pair, start):
        raise InputError(found)
    wear_rate = as_tree(rate) if callable(rate) else None if rate is None else jnp.asarray(as_number(rate))
    angle, area, note = _start(scene, targets, free)
    closed = None if note else _placed(scene, angle, area)
    if start == "given":
        linings = band_brake(scene).linings
        angle, area = np.asarray(linings.angle, float), None if area is None else _areas(linings, angle)
    levelled, given = _Levelled(targets, over, pair), (angle, area, wear_rate)
    settings: dict[str, Any] = {"run": over == "braking", "solver": solver, "rtol": rtol}
    run = Evaluator(scene, _Unfolded(free, place), levelled, given=given, **settings)
    if over == "braking":
        run.like(run.result())
    search = _Search(run, free, levelled, friction_at_start(scene))
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
        runs=run.runs,
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
        raise InfeasibleLayout(_why_not(rows[-1], search.levelled.targets, search.friction))
    return tuple(rows), iterations


def _solve(search: _Search, tolerance: float, max_iterations: int) -> tuple[np.ndarray, int]:
    from scipy.optimize import least_squares  # imported where it is used: most runs design no layout

    w = np.zeros(search.size)
    residual, _, code, _ = search.look(w)
    if code != 0:
        name, what, hint = FAILURES[code]
        raise SimulationError(f"{name}: the starting layout's run fails, {what}: {hint}", None)
    if not np.all(np.isfinite(residual)):
        raise InfeasibleLayout(
            "the starting layout has no positive target at every lining: do all linings slide in the run, and does no "
            "lining lock itself (f·tan(β/2) ≥ 1)?"
        )
    found = least_squares(
        lambda w: search.look(w).values,
        w,
        lambda w: search.look(w).jacobian,  # pyright: ignore
        method="trf",
        ftol=1e-15,
        xtol=1e-15,
        gtol=0.01 * tolerance,
        max_nfev=max_iterations,
    )
    return found.x, int(found.njev)


def _row(name: str, scene: Scene | None, search: _Search, w: np.ndarray | None = None) -> LayoutRow:
    """One layout with its targets: that of a scene, or the one of the unknowns `w`."""
    angle, area, rate = search.run.given
    if scene is not None:
        linings = band_brake(scene).linings
        angle = np.asarray(linings.angle, float)
        area = _areas(linings, angle)
        values = search.look(np.zeros(search.size), (angle, area, rate)).more
    else:
        assert w is not None
        values = search.look(w).more
        angle, area = (None if x is None else np.asarray(x) for x in _unfolded(w, angle, area, search.free))
    asked = search.levelled
    named = [name_of(one) for one in asked.targets]
    units = [TARGETS[one][asked.over == "braking"] if isinstance(one, str) else "" for one in asked.targets]
    columns = {} if values is None else {k: np.asarray(v) for k, v in zip(named, values, strict=True)}
    return LayoutRow(name, angle, area, columns, dict(zip(named, units, strict=True)))  # pyright: ignore


def _why_not(best: LayoutRow, targets: tuple[Target, ...], f: np.ndarray) -> str:
    grip = f * np.tan(best.angle / 2)
    words = " and ".join(name_of(one) for one in targets)
    return (
        f"{words} cannot be made equal: the best layout found has a maximum over minimum of {best.non_uniformity:.6g}; "
        f"lining {int(np.argmax(grip)) + 1} is nearest to locking itself, f·tan(β/2) = {np.max(grip):.4g}"
    )
