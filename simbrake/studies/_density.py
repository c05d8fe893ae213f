"""Log-density of a scene's parameters given recordings, for samplers: differentiable,
under `jit` and `vmap`."""

import dataclasses
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._base._faults import Fault, Issues
from ..hybrid.arrays import Array
from ..parts.scene import Scene
from ..runs.edit import with_values
from ..runs.simulate import room_for, simulate
from ._recordings import (
    Bounds,
    FitModel,
    MeasuredValues,
    Recording,
    box_of_all,
    recordings_of,
    solver_within,
)
from .bounds import Box, Paths
from .evaluating import Solver
from .measured import Measured

#: log-density of a value, or of those of all recordings (n,), up to a constant
Prior: TypeAlias = Callable[[Any], Any]
#: how many times the step attempts of a run at the start any other run may take
_LONGER = 4
#: the nearest that a start, and any other number, may be to a bound, over the range
_START = 0.01
_EDGE = 1e-9
_HALF_LOG_TAU = 0.5 * np.log(2 * np.pi)


@dataclasses.dataclass(frozen=True, eq=False)
class LogDensity:
    """Log-density of parameters given recordings, up to a constant, as a function of
    unconstrained numbers `x` (d,).

        log p(x) = Σ log N(measured; model(θ), σ) + log prior(θ) + log |dθ/dx|,   θ =
        low + (high − low)/(1 + e^−x)

    It runs under `jit`, `vmap` and `grad`. Other data may be put in, also traced ones:
    `dataclasses.replace(density, measured=y)`.

    - `names` of the numbers in `x`, as in `Calibration`, and `omega_sigma` of a
      standard deviation that is not known
    - `initial` (d,): the start
    - `measured`, `sigma` (n, m): of n recordings, NaN where there is nothing
    """

    initial: Float[Array, " d"]
    measured: Float[Array, "n m"]
    sigma: Float[Array, "n m"]
    shared: tuple[str, ...]
    own: tuple[str, ...]
    noise: tuple[str, ...]
    box: Box
    priors: Mapping[str, Prior]
    settings: Mapping[str, Any]
    find: MeasuredValues
    #: of all recordings: their scenes, the times that `find` is given, where it has the
    #: measured values
    runs: tuple[Scene, Array, Int[Array, "n m"]]
    #: (n, m): which of `noise` a value has, −1: `sigma`
    noisy: Int[Array, "n m"]

    @property
    def names(self) -> tuple[str, ...]:
        return self.box.paths.names

    def _split(self, numbers: Any) -> dict[str, Any]:
        """One number for each one in `x` by path: () of what all recordings share, (n,)
        of what each has."""
        k = len(self.shared)
        n = self.measured.shape[0]
        each = numbers[k : k + n * len(self.own)].reshape(n, len(self.own))
        parts = {path: numbers[i] for i, path in enumerate(self.shared)}
        parts |= {path: each[:, i] for i, path in enumerate(self.own)}
        return parts | {
            name: numbers[k + each.size + i] for i, name in enumerate(self.noise)
        }

    def values(self, x: Float[Array, " d"]) -> dict[str, Array]:
        """Parameters by path: numbers, and arrays (n,) of those that differ between
        recordings."""
        return self._split(self.box.up(jax.nn.sigmoid(x), jnp))

    def unconstrained(self, values: Mapping[str, float]) -> Float[np.ndarray, " d"]:
        """`x` (d,) of values by name, as `Calibration.values`, within the bounds;
        others are as in `initial`."""
        start = self.box.up(1 / (1 + np.exp(-np.asarray(self.initial))))
        named = [values.get(name, x) for name, x in zip(self.names, start, strict=True)]
        return _unconstrained(self.box, np.asarray(named, float), _EDGE)

    def _runs(
        self, values: Mapping[str, Any]
    ) -> tuple[Float[Array, "n m"], Int[Array, " n"]]:
        count = self.measured.shape[0]

        def run(
            scene: Scene, ts: Array, where: Array, numbers: dict[str, Array]
        ) -> tuple[Array, Array]:
            result = simulate(with_values(scene, numbers), **self.settings)
            return self.find(result, ts)[0][where], result.record.code

        numbers: Any = {
            path: jnp.broadcast_to(values[path], (count,))
            for path in (*self.shared, *self.own)
        }
        return jax.vmap(run)(*self.runs, numbers)

    def model(self, values: Mapping[str, Any]) -> Float[Array, "n m"]:
        """What runs with these values give in the place of `measured`; `inf` where an
        event does not occur."""
        return jnp.where(jnp.isnan(self.measured), jnp.nan, self._runs(values)[0])

    def codes(self, values: Mapping[str, Any]) -> Int[Array, " n"]:
        """Result code of the run of each recording: where one is not 0, the density is
        0."""
        return self._runs(values)[1]

    def log_likelihood(self, values: Mapping[str, Any]) -> Float[Array, ""]:
        """`Σ log N(measured; model, σ)` of values by path; −inf where a run fails or
        lacks a measured event.

        It is what a hierarchical model needs that draws the parameters of the
        recordings itself.
        """
        model, codes = self._runs(values)
        there = ~jnp.isnan(self.measured)
        valid = jnp.isfinite(model) & (codes == 0)[:, None]
        sigma = self.sigma
        if self.noise:
            unknown = jnp.stack([jnp.asarray(values[name]) for name in self.noise])
            sigma = jnp.where(self.noisy >= 0, unknown[self.noisy], sigma)
        used = there & valid
        sigma = jnp.where(used, sigma, 1.0)
        residual = jnp.where(used, model - self.measured, 0.0) / sigma
        terms = jnp.where(
            there, -0.5 * residual**2 - jnp.log(sigma) - _HALF_LOG_TAU, 0.0
        )
        return jnp.where(jnp.all(valid | ~there), jnp.sum(terms), -jnp.inf)

    def log_prior(self, x: Float[Array, " d"]) -> Float[Array, ""]:
        """Logarithm of the prior of `x`, with `log |dθ/dx|`."""
        # of a uniform share of the range
        inside = -jax.nn.softplus(x) - jax.nn.softplus(-x)
        numbers = self.box.up(jax.nn.sigmoid(x), jnp)
        values = self._split(numbers)
        slopes = self._split(jnp.log(self.box.slope(numbers, jnp)))
        return jnp.sum(inside) + sum(
            jnp.sum(prior(values[path]) + slopes[path])
            for path, prior in self.priors.items()
        )

    def __call__(self, x: Float[Array, " d"]) -> Float[Array, ""]:
        return self.log_prior(x) + self.log_likelihood(self.values(x))


def _structure(scene: Scene) -> tuple[Any, list[tuple[int, ...]]]:
    numbers, structure = jax.tree.flatten(scene)
    return structure, [np.shape(number) for number in numbers]


def _unconstrained(box: Box, numbers: np.ndarray, edge: float) -> np.ndarray:
    z = np.clip(box.down(numbers), edge, 1 - edge)
    return np.log(z / (1 - z))


def _faults_of_noise(
    runs: Sequence[Recording], noise: Mapping[str, tuple[float, float]]
) -> Iterator[Fault]:
    """Errors of the bounds of unknown standard deviations, and values without any."""
    measured = {part.name for each in runs for part in each.data.all}
    for name, pair in noise.items():
        if name not in measured:
            names = ", ".join(sorted(measured))
            yield Fault(
                f"noise of {name}", "it was not measured", f"there are: {names}"
            )
        if not (len(pair) == 2 and 0 < pair[0] < pair[1] < np.inf):
            what = f"the bounds {pair!r} are out of range"
            yield Fault(f"noise of {name}", what, "0 < low < high")
    for each in runs:
        for part in each.data.all:
            if part.sigma is None and part.name not in noise:
                hint = (
                    f'give its measuring error, or noise={{"{part.name}": (low, high)}}'
                )
                yield Fault(each.label(part.name), "has no standard deviation", hint)


def _faults_of_priors(
    priors: Mapping[str, Prior], parameters: Container[str]
) -> Iterator[Fault]:
    for path, prior in priors.items():
        if path not in parameters:
            hint = "a path of shared or per_recording"
            yield Fault(f"prior of {path}", "is of no parameter", hint)
        elif not callable(prior):
            what = f"{prior!r} is no function"
            yield Fault(f"prior of {path}", what, "log_prob of a distribution")


def _faults_of_structure(runs: Sequence[Recording]) -> Iterator[Fault]:
    """Recordings that cannot run side by side with the first."""
    for each in runs[1:]:
        if _structure(each.scene) != _structure(runs[0].scene):
            what = f"has another structure than {runs[0].name}"
            hint = "known lists must be as long for all recordings"
            yield Fault(each.label("scene"), what, hint)


def _rows(rows: Iterable[Any], longest: int, value: float) -> np.ndarray:
    """Rows of different lengths as one array, each continued by a value."""
    return np.stack(
        [np.pad(row, (0, longest - len(row)), constant_values=value) for row in rows]
    )


def log_density(
    scene: Scene,
    recordings: Measured | Sequence[Measured] | Mapping[str, Measured],
    *,
    shared: Bounds | None = None,
    per_recording: Bounds | None = None,
    priors: Mapping[str, Prior] | None = None,
    noise: Mapping[str, tuple[float, float]] | None = None,
    start: Mapping[str, float | str] | None = None,
    rtol: float = 1e-8,
    solver: Solver | None = None,
    max_steps: int | None = None,
) -> LogDensity:
    """Log-density of a scene's parameters given recordings, for samplers as numpyro's
    NUTS.

    - `recordings`, `per_recording`, `start`, `rtol`, `solver`: as for `calibrate`
    - `shared`: its `bounds`
    - `priors`: `{path: log_prob}`, a function of the value, or of those of all
      recordings (n,), as `numpyro.distributions.Normal(0.35, 0.05).log_prob`, cut off
      at the bounds. By default values are uniform within the bounds, and uniform in the
      logarithm where these are positive and their ratio exceeds 100
    - `noise`: `{"omega": (0.01, 1.0)}`: bounds of a standard deviation that is not
      known, one for all recordings, instead of those in the data; its prior,
      `priors["omega_sigma"]`, is uniform in the logarithm by default
    - `max_steps`: by default eight times as many as runs at the start take; a run that
      needs more has the density 0 (`LogDensity.codes` says so)

    All recordings are run side by side under `vmap`, so that their scenes must have one
    structure. Raises `InputError` with all errors.

    Example:
        >>> stop = lambda time: sb.studies.Measured.of(events={"stopping_time": (time, 0.02)})
        >>> friction = {"brake.linings.friction.coefficient": (0.2, 0.5)}
        >>> density = sb.studies.log_density(scene, [stop(1.25), stop(1.27)], shared=friction)
        >>> density.names, density.initial.shape
        (('brake.linings.friction.coefficient',), (1,))
        >>> bool(density(density.initial) > density(density.initial + 0.5))
        True
    """
    issues = Issues()
    own = per_recording or {}
    shared = shared or {}
    noise = noise or {}
    priors = priors or {}
    runs = recordings_of(scene, recordings, issues)
    box = box_of_all(runs, shared, own, start or {}, issues)
    issues += _faults_of_noise(runs, noise)
    spreads = {f"{name}_sigma": pair for name, pair in noise.items()}
    issues += _faults_of_priors(priors, {**shared, **own, **spreads})
    issues += _faults_of_structure(runs)
    issues.report()
    solver = solver_within(runs, {**shared, **own}) if solver is None else solver
    layout = FitModel(
        runs, tuple(shared), tuple(own), solver=solver, rtol=rtol, max_steps=max_steps
    )
    layout.check(box.start)
    if max_steps is None:
        runs_at_start = (
            simulate(each, solver=solver, rtol=rtol, throw=False)
            for each in layout.scenes(box.start)
        )
        rooms = [room_for(each, differentiated=True) for each in runs_at_start]
        max_steps = _LONGER * max(rooms)
    longest = max(where.size for where in layout.where)
    ends = np.asarray([*spreads.values()], float).reshape(-1, 2)
    columns = (*ends.T, np.sqrt(ends.prod(axis=1)), np.ones(len(ends), bool))
    columns = (np.append(*pair) for pair in zip(box[1:], columns, strict=True))
    box = Box(Paths.each((*box.paths.names, *spreads)), *columns)
    values, sigmas = zip(*(each.data.arrays for each in runs), strict=True)
    places = {name: i for i, name in enumerate(noise)}
    noisy = (
        [
            places.get(part.name, -1)
            for part in each.data.all
            for _ in np.ravel(part.value)
        ]
        for each in runs
    )
    return LogDensity(
        initial=_unconstrained(box, box.start, _START),
        measured=_rows(values, longest, np.nan),
        sigma=_rows(sigmas, longest, np.nan),
        shared=tuple(shared),
        own=tuple(own),
        noise=tuple(spreads),
        box=box,
        priors=dict(priors),
        settings={"solver": solver, "rtol": rtol, "max_steps": max_steps},
        find=layout.measured,
        runs=(
            jax.tree.map(
                lambda *leaves: np.stack(leaves), *(each.scene for each in runs)
            ),
            np.stack(layout.given),
            _rows(layout.where, longest, 0),
        ),
        noisy=_rows(noisy, longest, -1),
    )
