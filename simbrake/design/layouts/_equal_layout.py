"""Lining angles and areas that level a quantity along the band: in closed form, at full
slip, over a run.

The closed forms take and return NumPy float64: a layout is designed once, not inside a
simulation.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._base._compiling import Compiled
from ..._base._faults import Issues
from ..._base._progress import Progress
from ..._base._quantity import as_number
from ..._base._table import Column, Table, Tabular, frozen, plain
from ...brakes.band import running_product
from ...hybrid.arrays import Array
from ...hybrid.struct import with_value_at
from ...outputs.log import FAILURES, SimulationError
from ...outputs.probe import as_tree
from ...outputs.quantities import Rubbing
from ...parts.at_start import read_by_linings
from ...parts.scene import Scene, band_brake
from ...parts.scene_checks import faults
from ...physics.assemble import assemble
from ...physics.sliding import LiningFriction
from ...runs.linings import (
    fault_of_pair,
    friction_work,
    lining_mean,
    lining_wear,
    wearing,
)
from ...runs.measure import name_of
from ...runs.result import Result
from ...runs.simulate import Solver
from ...studies.evaluating import Evaluation, PointEvaluator

#: what can be equal for all linings, with units at full slip and over a brake
#: application
TARGETS = {
    "tension_increment": ("N", "N"),
    "normal_load": ("N", "N"),
    "pressure": ("Pa", "Pa"),
    "wear": ("m/s", "m"),
    "friction_work": ("W", "J"),
}
#: what can be free, and its name
FREE = {"angle": "angles", "area": "areas", "both": "angles and areas"}
#: targets that depend on the areas
NEEDS_AREA = ("pressure", "wear")

#: a target's name, or a function of a `Result` to one number per lining
Target: TypeAlias = str | Callable[[Result], Any]
#: a wear rate in m³/(N·m), or a function of pressure, slip speed and temperature
Rate: TypeAlias = Any
#: a number for each lining; areas are `None` where there are none
ByLining: TypeAlias = Float[np.ndarray, " n"]
Areas: TypeAlias = ByLining | None


# --- closed forms -------------------------------------------------------------------


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq  # imported where used: most runs design no layout

    return float(brentq(function, low, high, xtol=1e-16, rtol=1e-14))  # pyright: ignore


class InfeasibleLayout(ValueError):
    """No such layout exists; the message states which limit is exceeded and where."""


@frozen
class Layout:
    """`angle` (n,) in rad from the slack to the tight end, `ratio` `Π_k = T_k/T_0` with
    `k` linings at their limit."""

    angle: ByLining
    ratio: float
    k: int


def equal_increment_angles(f: float | ByLining, n: int, k: int, wrap: float) -> Layout:
    """Angles for equal tension increments, i.e. equal torque, of the first `k` of `n`
    linings (Z tables 5, 6).

        1/(f_i z_i) = 1/(f_{i+1} z_{i+1}) − 2,   β_{k+1} = … = β_n = β_k,   Σβ = wrap
        Π_k = (1/(f_k z_k) + 1)/(1/(f_1 z_1) − 1),   feasible while f_1 z_1 < 1

    - `f`: coefficient of friction, one or per lining;  `wrap` (rad);  `1 ≤ k ≤ n`

    Raises `InfeasibleLayout` where the wrap cannot be reached before `f_1 z_1 = 1`.
    """
    if not 1 <= k <= n:
        raise InfeasibleLayout(
            f"k = {k} linings at their limit must lie between 1 and n = {n}"
        )
    friction = np.broadcast_to(np.asarray(f, float), (n,))[:k]
    if np.any(friction <= 0) or not 0 < wrap <= 2 * math.pi * (1 + 1e-12):
        raise InfeasibleLayout(
            "friction must be positive and the wrap between 0 and 360°"
        )

    def angles(z_k: float) -> ByLining:
        # 1/(f_k z_k) − 2 (k − i)
        inverse = 1.0 / (friction[-1] * z_k) - 2.0 * np.arange(k - 1, -1, -1)
        beta = 2 * np.arctan(1.0 / (friction * inverse))
        return np.append(beta, np.full(n - k, beta[-1]))

    z_max = 1.0 / (friction[-1] * (1.0 + 2.0 * (k - 1)))  # there f_1 z_1 = 1
    if np.sum(angles(z_max)) <= wrap:
        raise InfeasibleLayout(
            f"equal tension increments of {k} of {n} linings reach f·tan(β_1/2) = 1 at a wrap of "
            f"{math.degrees(np.sum(angles(z_max))):.1f}°, below the requested "
            f"{math.degrees(wrap):.1f}°"
        )
    z_k = _root(lambda z: np.sum(angles(z)) - wrap, 1e-12 * z_max, z_max)
    beta = angles(z_k)
    first = friction[0] * math.tan(beta[0] / 2)
    last = friction[-1] * z_k
    return Layout(beta, (1 / last + 1) / (1 / first - 1), k)


def equal_load_angles(
    f: float | ByLining, n: int, wrap: float, *, area: float | ByLining = 1.0
) -> Layout:
    """Angles for equal normal loads `N_i` of `n` sliding linings, or equal pressures
    `N_i/A_i` (model §2.2).

        s_i/((1 + f_i z_i) A_i) = s_{i+1}/((1 − f_{i+1} z_{i+1}) A_{i+1}),   Σβ = wrap

    followed from the tight end on the branch `z < f^(−1/3)`, where the left side peaks.

    Raises `InfeasibleLayout` where no lining of the branch carries the load, or a
    lining would be self-locking.
    """
    friction = np.broadcast_to(np.asarray(f, float), (n,))
    areas = np.broadcast_to(np.asarray(area, float), (n,))
    if np.any(friction <= 0) or np.any(areas <= 0):
        raise InfeasibleLayout("friction and areas must be positive")

    def side(z: float, i: int, sign: float) -> float:
        return z / math.sqrt(1 + z * z) / (1 + sign * friction[i] * z) / areas[i]

    def chain(z_n: float) -> ByLining | int:
        """`z` of all linings, or the index of the one that cannot carry the load."""
        z = np.empty(n)
        z[-1] = z_n
        for i in range(n - 2, -1, -1):
            if friction[i + 1] * z[i + 1] >= 1:
                return i + 1
            load = side(z[i + 1], i + 1, -1.0)
            peak = friction[i] ** (-1 / 3)
            if load > side(peak, i, 1.0):
                return i
            z[i] = _root(lambda s, i=i, load=load: side(s, i, 1.0) - load, 0.0, peak)
        return z if friction[0] * z[0] < 1 else 0

    def surplus(z_n: float) -> float:
        z = chain(z_n)
        return 2 * math.pi if isinstance(z, int) else np.sum(2 * np.arctan(z)) - wrap

    low = 1e-12
    high = math.tan(min(wrap, 0.999 * math.pi) / 2)
    if surplus(high) < 0:
        raise InfeasibleLayout(
            f"{n} linings of equal load cannot span {math.degrees(wrap):.1f}°"
        )
    # bisection: the chain ends abruptly where it becomes infeasible
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) < 0 else (low, middle)
    z = chain(low)
    if isinstance(z, int) or abs(np.sum(2 * np.arctan(z)) - wrap) > 1e-9:
        at = chain(high)
        where = f"lining {at + 1}" if isinstance(at, int) else "a lining"
        raise InfeasibleLayout(
            f"equal loads on {n} linings over {math.degrees(wrap):.1f}°: {where} "
            "cannot carry the load (the load of one lining peaks at tan(β/2) = "
            "f^(−1/3), and f·tan(β/2) must stay below 1)"
        )
    fz = friction * z
    return Layout(2 * np.arctan(z), float(np.prod((1 + fz) / (1 - fz))), n)


def chord_equal_load_angles(
    f: float, k: int, beta_k: float, beta_k1: float
) -> Float[np.ndarray, " k"]:
    """Chord angles `β_1…β_k` (rad) for equal normal loads `N_2 = … = N_k`, `β_k` and
    `β_{k−1}` given.

        m_j = (1 + f z_j)/(1 − f z_j),  p_j = z_j/(1 − f z_j),  j = k…3                                     (Z-11)
        z_{j−2} = m_{j−1} p_j/(1 − f m_{j−1} p_j)

    Raises `InfeasibleLayout` where a `1 − f z` or a denominator is not positive, or the
    chords do not fit.
    """
    z = np.full(k + 1, np.nan)
    z[k] = math.tan(beta_k / 2)
    z[k - 1] = math.tan(beta_k1 / 2)
    for j in range(k, 2, -1):
        for i in (j, j - 1):
            if 1 - f * z[i] <= 0:
                raise InfeasibleLayout(
                    f"chord {i}: 1 − f·tan(β_{i}/2) = {1 - f * z[i]:.4g} is not positive"
                )
        m = (1 + f * z[j - 1]) / (1 - f * z[j - 1])
        p = z[j] / (1 - f * z[j])
        denominator = 1 - f * m * p
        if denominator <= 0:
            raise InfeasibleLayout(
                f"chord {j - 2}: the denominator 1 − f m p = {denominator:.4g} is not positive"
            )
        z[j - 2] = m * p / denominator
    beta = 2 * np.arctan(z[1:])
    if 1 - f * z[1] <= 0:
        raise InfeasibleLayout(
            f"chord 1: 1 − f·tan(β_1/2) = {1 - f * z[1]:.4g} is not positive"
        )
    if np.sum(beta) > 2 * math.pi:
        raise InfeasibleLayout(
            f"the chords span {math.degrees(np.sum(beta)):.1f}°, more than the pulley has"
        )
    return beta


# --- targets of a scene -------------------------------------------------------------


def full_slip(scene: Scene) -> tuple[Rubbing, Array]:
    """Linings that all slide ahead as the run starts, and their coefficients of
    friction (model §2.2).

        T_i = T_0 Π_i,   N_i = (T_i + T_{i−1}) sin(β_i/2)

    at the speed and the temperatures of the start and the maximum slack tension of the
    lever; traceable.
    """
    system, y, mode = assemble(scene)
    grip = system.grip
    linings = scene.brake.linings
    assert isinstance(grip, LiningFriction)
    T_0 = jnp.asarray(scene.lever.scale())
    v = jnp.full(
        linings.count,
        jnp.abs(jnp.asarray(scene.brake.radius) * jnp.asarray(scene.start_speed)),
    )
    hot = system.surfaces(jnp.asarray(scene.initial.time), y, mode)[0]
    f = grip.coefficients(T_0, v, hot, jnp.asarray(False), static=False).f
    ratios = grip.ratios(f)[0]
    along = T_0 * running_product(ratios)
    before = jnp.concatenate([T_0[None], along[:-1]])
    normal = grip.pressed(before, ratios)
    pressure = None if linings.area is None else normal / jnp.asarray(linings.area)
    return Rubbing(
        along - before,
        normal,
        v,
        pressure,
        None if hot is None else hot.T,
        along / before,
    ), f


_full_slip_compiled = Compiled(full_slip)


def friction_at_start(scene: Scene) -> ByLining:
    """Coefficients of friction of sliding linings as the run starts."""
    return np.asarray(_full_slip_compiled(scene)[1], float)


def at_full_slip(scene: Scene, target: str, rate: Rate) -> Float[Array, " n"]:
    """A target at the instant of `full_slip`: wear in m/s, friction work as power in
    W."""
    r, _ = full_slip(scene)
    if target == "wear":
        return wearing(rate, r)
    quantities = {
        "friction_work": r.power,
        "tension_increment": r.increment,
        "normal_load": r.normal,
    }
    return quantities.get(target, r.pressure)  # pyright: ignore


def own_layout(scene: Scene) -> tuple[ByLining, Areas]:
    """Angles and areas of a scene's linings."""
    linings = band_brake(scene).linings
    angle = np.asarray(linings.angle, float)
    return angle, None if linings.area is None else np.broadcast_to(
        np.asarray(linings.area, float), angle.shape
    )


# --- request and result -------------------------------------------------------------


def validate_request(
    scene: Scene,
    targets: tuple[Target, ...],
    free: str,
    over: str,
    rate: Rate,
    pair: str,
    start: str,
) -> None:
    """Raise `InputError` with all errors of a requested layout, errors of the scene
    included."""
    brake = band_brake(scene)
    errors = Issues(faults(scene))
    errors.choice("start", start, ("closed form", "given"))
    errors.choice("free", free, FREE)
    errors.choice("over", over, ("static", "braking"))
    first, *others = brake.pairs
    if missing := fault_of_pair(pair, list(brake.pairs)):
        errors.append(missing)
    elif pair != first and over == "static":
        errors.add(
            "pair",
            "statics are those of the band on the linings",
            'give over="braking"',
        )
    for target in targets:
        if isinstance(target, str) and target not in TARGETS:
            hint = (
                f"there are: {', '.join(TARGETS)}, or a function of a result to one "
                "number per lining"
            )
            errors.add("target", f"{target!r} is unknown", hint)
        elif not isinstance(target, str) and over == "static":
            errors.add(
                "target", "a function of a result needs a run", 'give over="braking"'
            )
        elif (
            free == "area"
            and target in TARGETS
            and target not in NEEDS_AREA
            and not read_by_linings(scene).p
        ):
            errors.add(
                "target", f"{target} does not depend on the areas", "free the angles"
            )
    count = 2 if free == "both" else 1
    if len(targets) != count:
        hint = (
            'as ("tension_increment", "pressure"): the first for the angles, the '
            "second for the areas"
        )
        words = f"{free!r} levels {count}, there are {len(targets)}"
        errors.add(
            "target", words, hint if free == "both" else 'free="both" levels two'
        )
    if "wear" in targets and rate is None:
        errors.add("rate", "is missing", "wear needs a wear rate in m³/(N·m)")
    if np.size(brake.linings.angle) < 2:
        errors.add(
            "brake.linings.angle", "one lining has no layout", "give two or more"
        )
    if brake.linings.continuous and free != "area":
        hint = 'free="area", its width along the band'
        errors.add(
            "brake.linings.continuous",
            "has no blocks to lay out: its angles are arbitrary",
            hint,
        )
    looked_at = (
        {pair} & set(brake.pairs)
        if any(name in NEEDS_AREA for name in targets)
        else set()
    )
    for rubbing_pair in sorted(
        looked_at | ({first} if free in ("area", "both") else set())
    ):
        if brake.rubbing_part(rubbing_pair).area is None:
            errors.add(
                f"brake.{brake.pairs[rubbing_pair].field}.area",
                "is missing",
                "the target depends on the areas",
            )
    if free != "angle" and pair in others:
        errors.add(
            "free",
            "the areas that can be freed are those towards the band",
            'free="angle"',
        )
    errors.report()


@frozen
class LayoutRow:
    """One layout: `angle` (n,) in rad, `area` (n,) in m² or `None`, and every target
    (n,) by name, with its unit."""

    name: str
    angle: ByLining
    area: Areas
    values: dict[str, Any]
    units: dict[str, str]

    @property
    def non_uniformity(self) -> float:
        """Maximum over minimum of a target along the band, of the worst target; `nan`
        where it could not be found."""
        return float(
            max(
                (np.max(value) / np.min(value) for value in self.values.values()),
                default=np.nan,
            )
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text."""
        return plain(vars(self) | {"non_uniformity": self.non_uniformity})


@frozen
class LayoutDesign(Tabular):
    """A layout that levels a target: the scene with it, and the layouts it is compared
    with.

    - `rows`: the layout `given`, that of the `closed form` (where there is one, else
      `note` gives the reason), `optimum`
    - `iterations` of the search, `runs` of the simulation with its derivatives (static:
      evaluations)
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
        return {row.name: row for row in self.rows}[name]

    @property
    def angle(self) -> ByLining:
        """Lining angles (rad)."""
        return self.row("optimum").angle

    @property
    def area(self) -> Areas:
        """Lining areas (m²)."""
        return self.row("optimum").area

    @property
    def non_uniformity(self) -> float:
        """Maximum over minimum of the target along the band."""
        return self.row("optimum").non_uniformity

    def as_dict(self) -> dict[str, Any]:
        """Return the data without the scene as numbers, lists and text."""
        data = {
            name: value
            for name, value in vars(self).items()
            if name not in ("scene", "rows")
        }
        return plain(data) | {"layouts": [row.as_dict() for row in self.rows]}

    def parts(self) -> Iterator[str | Table]:
        over = "at full slip" if self.over == "static" else "over the braking"
        yield (
            f"equal {' and '.join(self.target)} {over}: {FREE[self.free]} found in "
            f"{self.iterations} iterations"
        )
        if self.note:
            yield f"no closed form to compare with: {self.note}"
        columns = [Column("lining")]
        values = [np.arange(1, len(self.angle) + 1)]
        for row in self.rows:
            columns.append(
                Column(
                    f"{row.name} β",
                    "rad",
                    display_units="°",
                    show=lambda x: f"{np.degrees(x):.5g}",
                )
            )
            values.append(row.angle)
            if self.free != "angle" and row.area is not None:
                columns.append(
                    Column(
                        f"{row.name} A",
                        "m^2",
                        display_units="cm²",
                        show=lambda x: f"{1e4 * x:.5g}",
                    )
                )
                values.append(row.area)
            for name, value in row.values.items():
                columns.append(
                    Column(f"{row.name} {name}", row.units[name], show=".5g")
                )
                values.append(np.asarray(value))
        yield Table(columns, zip(*(column.tolist() for column in values), strict=True))
        uneven = [(row.name, row.non_uniformity) for row in self.rows]
        yield Table(["layout", Column("max/min", show=".7g")], uneven)


# --- the search ---------------------------------------------------------------------

Place: TypeAlias = Callable[[Scene, Any, Any], Scene]
#: angles, areas and the wear rate from which a search starts
LayoutAndRate: TypeAlias = tuple[Float[Array, " n"], Float[Array, " n"] | None, Rate]


def _placed(scene: Scene, angle: Array, area: Array | None) -> Scene:
    """The scene with other lining angles, and areas where it has any."""
    scene = with_value_at(scene, "brake.linings.angle", angle)
    return scene if area is None else with_value_at(scene, "brake.linings.area", area)


def _contrasts(n: int) -> Float[np.ndarray, "m n"]:
    """`n − 1` orthonormal directions along which entries change and their sum does not
    (Helmert)."""
    i = np.arange(1, n)[:, None]
    j = np.arange(n)[None, :]
    return np.where(j < i, 1.0, np.where(j == i, -i, 0.0)) / np.sqrt(i * (i + 1))


def _unfolded(
    w: Array, angle: Array, area: Array | None, free: str
) -> tuple[Array, Array | None]:
    """Angles and areas for the unknowns `w`: shares that stay positive,
    `x_i = Σx · softmax(ln x⁰ + Hᵀ w)_i`."""
    n = angle.shape[0]
    directions = jnp.asarray(_contrasts(n)).T

    def scaled(start: Any, w: Array) -> Array:
        return jnp.sum(start) * jax.nn.softmax(jnp.log(start) + directions @ w)

    if free != "area":
        angle = scaled(angle, w[: n - 1])
    return angle, area if free == "angle" else scaled(area, w[-(n - 1) :])


class _Unfolded(NamedTuple):
    """Map from the unknowns to the scene."""

    free: str
    place: Place

    def __call__(self, scene: Scene, w: Array, layout_and_rate: LayoutAndRate) -> Scene:
        return self.place(scene, *_unfolded(w, *layout_and_rate[:2], self.free))


class _Levelled(NamedTuple):
    """Residuals, and the targets themselves, of a layout: of its scene at full slip, or
    of its run."""

    targets: tuple[Target, ...]
    over: str
    pair: str

    def __call__(
        self, outcome: Scene | Result, layout_and_rate: LayoutAndRate
    ) -> tuple[Array, list[Array]]:
        angle, _, rate = layout_and_rate
        values = [self._value(outcome, target, rate) for target in self.targets]
        contrasts = jnp.asarray(_contrasts(angle.shape[0]))
        logs = [jnp.log(jnp.where(value > 0, value, jnp.nan)) for value in values]
        return jnp.concatenate([contrasts @ log for log in logs]), values

    def _value(
        self, outcome: Scene | Result, target: Target, rate: Rate
    ) -> Float[Array, " n"]:
        """Of a run: sums of wear and friction work, else means over the distance that a
        lining rubs."""
        if isinstance(outcome, Scene):
            return at_full_slip(outcome, target, rate)  # pyright: ignore
        if not isinstance(target, str):
            return jnp.asarray(target(outcome))
        if target == "wear":
            return lining_wear(outcome, rate, pair=self.pair)
        if target == "friction_work":
            return friction_work(outcome, pair=self.pair)
        return lining_mean(outcome, target, over="slip", pair=self.pair)


class _Search:
    """Residuals and Jacobians for SciPy, from the layout that the evaluator is
    given."""

    def __init__(
        self, run: PointEvaluator, free: str, levelled: _Levelled, friction: np.ndarray
    ) -> None:
        self.run = run
        self.free = free
        self.levelled = levelled
        self.friction = friction
        self.progress = Progress("layout", "compiling…")
        self.start = np.zeros((2 if free == "both" else 1) * (len(run.given[0]) - 1))

    def look(
        self, w: np.ndarray, layout_and_rate: LayoutAndRate | None = None
    ) -> Evaluation:
        """Evaluate a layout; one with a self-locking lining is not run."""
        angle, area, _ = self.run.given if layout_and_rate is None else layout_and_rate
        angle = np.asarray(_unfolded(w, angle, area, self.free)[0])
        if np.max(angle) >= np.pi or np.max(self.friction * np.tan(angle / 2)) >= 1:
            size = len(self.levelled.targets) * (len(angle) - 1)
            return Evaluation(
                np.full(size, np.nan), np.full((size, len(w)), np.nan), 0, None
            )
        before = self.run.runs
        trial = self.run(w, layout_and_rate)
        if self.run.runs > before:
            worst = max(
                np.max(values) / np.min(values)
                for values in map(np.asarray, trial.more)
            )
            self.progress.now(f"run {self.run.runs}, maximum over minimum {worst:.9g}")
        return (
            trial
            if trial.code == 0
            else trial._replace(values=np.full_like(trial.values, np.nan))
        )

    def row(
        self, name: str, layout: tuple[Array, Array | None], evaluation: Evaluation
    ) -> LayoutRow:
        """A layout with its targets."""
        asked = self.levelled
        named = [name_of(target) for target in asked.targets]
        units = [
            TARGETS[target][asked.over == "braking"] if isinstance(target, str) else ""
            for target in asked.targets
        ]
        columns = (
            {}
            if evaluation.more is None
            else dict(zip(named, map(np.asarray, evaluation.more), strict=True))
        )
        angle, area = (None if x is None else np.asarray(x) for x in layout)
        return LayoutRow(
            name,
            angle,  # pyright: ignore
            area,
            columns,
            dict(zip(named, units, strict=True)),  # pyright: ignore
        )

    def solve(self, tolerance: float, max_iterations: int) -> tuple[np.ndarray, int]:
        """The unknowns at the end, and the number of iterations."""
        # imported where used: most runs design no layout
        from scipy.optimize import least_squares

        residual, _, code, _ = self.look(self.start)
        if code != 0:
            name, what, hint = FAILURES[code]
            raise SimulationError(
                f"{name}: the starting layout's run fails, {what}: {hint}", None
            )
        if not np.all(np.isfinite(residual)):
            raise InfeasibleLayout(
                "the starting layout has no positive target at every lining: do all "
                "linings slide in the run, and is none self-locking (f·tan(β/2) ≥ 1)?"
            )
        fit = least_squares(
            lambda w: self.look(w).values,
            self.start,
            lambda w: self.look(w).jacobian,  # pyright: ignore
            method="trf",
            ftol=1e-15,
            xtol=1e-15,
            gtol=0.01 * tolerance,
            max_nfev=max_iterations,
        )
        return fit.x, int(fit.njev)


def _start(
    scene: Scene, targets: tuple[Target, ...], free: str
) -> tuple[tuple[ByLining, Areas], str]:
    """Angles and areas of model §2.2 that level the targets at full slip, with the
    friction of the start; those of the scene, and the reason, where there is no closed
    form.

    Equal friction work is equal tension increments, equal wear is equal pressure (exact
    for a constant wear rate). Angles need not level a target that areas can level.
    """
    angle, area = own_layout(scene)
    target = targets[0]
    note = ""
    f = friction_at_start(scene)
    n = len(angle)
    wrap = np.sum(angle)
    try:
        if free == "area":
            pass
        elif target in ("tension_increment", "friction_work"):
            angle = equal_increment_angles(f, n, n, wrap).angle
        elif target == "normal_load":
            angle = equal_load_angles(f, n, wrap).angle
        elif target in NEEDS_AREA and free == "angle" and area is not None:
            angle = equal_load_angles(f, n, wrap, area=area).angle
        else:
            note = "there is no closed form for it"
    except InfeasibleLayout as error:
        note = str(error)
    if free != "angle" and area is not None:
        if targets[-1] in NEEDS_AREA:  # A_i ∝ N_i at full slip
            normal = np.asarray(
                at_full_slip(_placed(scene, angle, area), "normal_load", None)
            )
            area = area.sum() * normal / normal.sum()
        else:
            note = note or "there is no closed form for the areas"
    return (angle, area), note


def equal_layout(
    scene: Scene,
    target: Target | tuple[Target, ...],
    *,
    free: str = "angle",
    over: str = "static",
    rate: Rate = None,
    pair: str = "external",
    place: Place = _placed,
    start: str = "closed form",
    solver: Solver | None = None,
    rtol: float = 1e-10,
    tolerance: float = 1e-8,
    max_iterations: int = 50,
) -> LayoutDesign:
    """Angles `β_i` (Σβ fixed) or areas `A_i` (ΣA fixed) for which a target is the same
    for every lining.

        ln q_i(β, A) − mean ln q = 0,   β_i = Σβ · softmax(ln β⁰ + Hᵀ w)_i

    by SciPy's trust-region least squares with the exact Jacobian, of the simulation
    where there is one, from the closed forms of model §2.2. Gaps of a band's geometry
    stay as they are.

    - `target`: `tension_increment`, `normal_load`, `pressure`, `wear`, `friction_work`,
      or a function of a `Result` to one positive number per lining; with `free="both"`
      two: one for the angles and one for the areas
    - `free`: `angle`, `area` or `both`
    - `over`: `static`: all linings slide, with the friction, the speed and the
      temperatures of the start and the maximum slack tension; `braking`: over the run
      of the scene, wear and friction work summed, the others as means over the distance
      that a lining rubs
    - `rate`: wear rate (m³/(N·m)), as in `wear`;  `pair`: as in `rubbing`
    - `place(scene, angle, area)`: puts a layout into the scene, where more than the
      linings depends on it (areas of the walls that heat them); by default
      `brake.linings` alone
    - `start`: `closed form`, or `given` for the layout of the scene
    - `tolerance`: maximum over minimum of the target, less 1, at which the layout is
      level

    Raises `InputError` with all errors, `InfeasibleLayout` where the target cannot be
    levelled, and `SimulationError` where the run of the starting layout fails.
    """
    targets = target if isinstance(target, tuple) else (target,)
    validate_request(scene, targets, free, over, rate, pair, start)
    wear_rate = (
        as_tree(rate)
        if callable(rate)
        else None
        if rate is None
        else jnp.asarray(as_number(rate))
    )
    closed, note = _start(scene, targets, free)
    layouts = {"given": own_layout(scene)} | ({} if note else {"closed form": closed})
    levelled = _Levelled(targets, over, pair)
    layout_and_rate = (*(layouts["given"] if start == "given" else closed), wear_rate)
    run = PointEvaluator(
        scene,
        _Unfolded(free, place),
        levelled,
        given=layout_and_rate,
        run=over == "braking",
        solver=solver,
        rtol=rtol,
    )
    if over == "braking":
        run.like(run.result())
    search = _Search(run, free, levelled, friction_at_start(scene))
    with search.progress:
        rows = [
            search.row(name, layout, search.look(search.start, (*layout, wear_rate)))
            for name, layout in layouts.items()
        ]
        w, iterations = search.solve(tolerance, max_iterations)
        best = search.row(
            "optimum", _unfolded(w, *layout_and_rate[:2], free), search.look(w)
        )
    named = tuple(map(name_of, targets))
    if not best.non_uniformity <= 1 + tolerance:
        grip = search.friction * np.tan(best.angle / 2)
        raise InfeasibleLayout(
            f"{' and '.join(named)} cannot be made equal: the best layout found has a "
            f"maximum over minimum of {best.non_uniformity:.6g}; lining "
            f"{int(np.argmax(grip)) + 1} is nearest to self-locking, f·tan(β/2) = "
            f"{np.max(grip):.4g}"
        )
    laid = place(
        scene,
        jnp.asarray(best.angle),
        None if best.area is None else jnp.asarray(best.area),
    )
    best_scene = jax.tree.map(np.asarray, laid)
    return LayoutDesign(
        best_scene, named, over, free, (*rows, best), iterations, run.runs, note
    )
