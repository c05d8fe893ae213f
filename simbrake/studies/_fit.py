"""The search of a fit: bounded least squares from one or more starts, and profiles."""

import dataclasses

import numpy as np

from .._base._faults import Fault, InputError
from .._base._progress import Progress
from ._determined import cost
from ._recordings import FitModel
from .bounds import Box
from .evaluating import Evaluation

#: why a search has ended
_DONE = "the residual no longer decreases"
_LIMITED = "the limit of evaluations was reached"
#: a parameter this close to an active bound (over the range) at the end is set to it
_NEAR = 1e-3
#: relative error of the root of a rise of χ² at the end of a profile; the root beyond
#: the runs that have all events
_CLOSE = 1e-6
_BEYOND = 1e3


@dataclasses.dataclass
class Search:
    """Least squares from one or more starts, all points evaluated once; at most `most`
    evaluations from each."""

    model: FitModel
    box: Box
    measured: np.ndarray
    sigma: np.ndarray
    loss: str
    loss_scale: float
    method: str
    most: int
    starts: int
    best: tuple[float, np.ndarray, Evaluation] | None = None
    ends: list[tuple[float, np.ndarray]] = dataclasses.field(default_factory=list)
    converged: bool = False
    message: str = ""

    def __post_init__(self) -> None:
        self.progress = Progress("calibrate", "compiling…")

    def evaluate(self, z: np.ndarray) -> Evaluation:
        """The model at a point; the best valid one is kept."""
        before = self.model.points
        evaluation = self.model(self.box.up(z))
        if evaluation.more is None and self.model.points > before:
            if self.best is None or self.cost(evaluation) < self.best[0]:
                self.best = (self.cost(evaluation), z.copy(), evaluation)
            # a search mostly ends long before its limit: the time left is shown as a
            # bound
            most = self.most * self.starts
            chi2 = np.sum(self.residual(self.best[2]) ** 2)
            count = min(self.model.points, most)
            self.progress.now("run", count, most, also=f", chi² {chi2:.6g}")
        return evaluation

    @property
    def noise(self) -> float:
        """Relative rounding of values and derivatives: they are those of the steps
        taken, which differ from the motion by the tolerance."""
        return max(10 * self.model.run.rtol, 1e-12)

    def residual(self, evaluation: Evaluation) -> np.ndarray:
        return (evaluation.values - self.measured) / self.sigma

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Derivatives (m, p) of the residual by the unknowns."""
        slope = self.box.slope(self.box.up(z))
        return self.evaluate(z).jacobian * slope / self.sigma[:, None]

    def cost(self, evaluation: Evaluation) -> float:
        return cost(self.residual(evaluation), self.loss, self.loss_scale)

    def run(self) -> None:
        try:
            with self.progress:
                for z in self._spread(self.box.down(self.box.start)):
                    if self.evaluate(z).more is None:
                        self._descend(z)
        except KeyboardInterrupt:
            if self.best is None:
                raise
            self.converged = False
            self.message = "interrupted: this is the best point found so far"
        if self.best is None:
            hint = "give another start, or try several (starts=8)"
            raise InputError(
                [
                    Fault(
                        "start",
                        reason,
                        f"{n} of the starts"
                        if self.starts > 1
                        else f"raise end_time, {hint}"
                        if "does not occur" in reason
                        else hint,
                    )
                    for reason, n in self.model.failures.items()
                ]
            )

    def _spread(self, first: np.ndarray) -> list[np.ndarray]:
        """The first start, and others spread over the unit cube, without its corner."""
        from scipy.stats import qmc  # slow to import, and rarely needed

        others = (
            qmc.Halton(first.size, scramble=False)
            .fast_forward(1)
            .random(self.starts - 1)
        )
        return [first, *others]

    def _descend(self, z: np.ndarray) -> None:
        """Search from one start; parameters at active bounds are fixed there, and the
        others searched again."""
        assert self.best is not None
        free = np.ones(z.size, bool)
        z, cost, converged, message = self._minimise(z, free)
        while (pressed := self.pressed(z) & free).any():
            on = np.where(pressed, np.round(z), z)
            evaluation = self.evaluate(on)
            worse = cost * (1 + 1e-9)
            if evaluation.more is not None or self.cost(evaluation) > worse:
                break
            free = free & ~pressed
            z, cost, converged, message = self._minimise(on, free)
        # the bound itself, not a neighbour that is better by rounding
        if cost <= self.best[0] * (1 + 1e-9):
            self.best = (cost, z, self.evaluate(z))
        if not self.ends or cost <= min(end[0] for end in self.ends):
            self.converged = converged
            self.message = message
        self.ends.append((cost, z))

    def profile(
        self, z: np.ndarray, i: int, rise: float, width: float
    ) -> tuple[float, float]:
        """Unknowns `i` below and above that of a best point `z` at which `min Σ r²`
        over all the others is larger by `rise`; `∓inf` where it is not up to the bound.
        `width`: how far away they are to first order, `inf` if unknown.

        The root of the rise is nearly linear in the unknown, so that few fits of the
        others find it.
        """
        from scipy.optimize import brentq  # imported only by fits

        least = self.cost(self.evaluate(z))
        free = np.arange(z.size) != i
        solved = {float(z[i]): (-1.0, z)}

        def excess(x: float) -> float:
            if x not in solved:
                nearest = min(solved, key=lambda other: abs(other - x))
                point = solved[nearest][1].copy()
                point[i] = x
                if self.evaluate(point).more is not None:
                    return _BEYOND  # no run has the measured events there
                point, cost, *_ = self._minimise(point, free)
                rose = np.sqrt(max(2 * (cost - least), 0.0) / rise)
                solved[x] = (float(rose) - 1, point)
            return solved[x][0]

        def end(side: int) -> float:
            bound = max(side, 0.0)
            near = np.clip(z[i] + side * width, 0.0, 1.0) if width > 0 else bound
            if near != bound and excess(near) < -_CLOSE:
                near = bound
            if near == z[i] or excess(near) < -_CLOSE:
                return side * np.inf
            if excess(near) < _CLOSE:
                return near
            return brentq(excess, *sorted((z[i], near)), xtol=1e-9, rtol=1e-8)  # pyright: ignore

        return end(-1), end(1)

    def pressed(self, z: np.ndarray) -> np.ndarray:
        """Unknowns (p,) that a bound keeps from a lower cost."""
        r = self.residual(self.evaluate(z))
        J = self.jacobian(z)
        push = J.T @ r
        strong = np.abs(push) > 1e-8 * np.linalg.norm(J, axis=0) * np.linalg.norm(r)
        return strong & (((z < _NEAR) & (push > 0)) | ((z > 1 - _NEAR) & (push < 0)))

    def _minimise(
        self, z: np.ndarray, free: np.ndarray
    ) -> tuple[np.ndarray, float, bool, str]:
        from scipy.optimize import least_squares  # imported only by fits

        def whole(x: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[free] = x
            return full

        barrier: str | None = None  # why trial points near the best one were rejected
        least = np.inf

        def residual(x: np.ndarray) -> np.ndarray:
            nonlocal barrier, least
            evaluation = self.evaluate(whole(x))
            if evaluation.more is not None:
                barrier = evaluation.more
                return np.full(self.measured.shape, np.inf)
            if self.cost(evaluation) < least * (1 - 1e-6):  # not the best start
                barrier = None
                least = self.cost(evaluation)
            return self.residual(evaluation)

        if not free.any():
            return z, self.cost(self.evaluate(z)), True, "every parameter is at a bound"
        solution = least_squares(
            residual,
            np.clip(z[free], 0.0, 1.0),
            lambda x: self.jacobian(whole(x))[:, free],  # pyright: ignore
            bounds=(0.0, 1.0),
            method=self.method,
            loss=self.loss,
            f_scale=self.loss_scale,
            x_scale="jac",
            ftol=1e-14,
            xtol=self.noise,  # shorter steps move a run by less than its tolerance
            gtol=1e-12,
            max_nfev=self.most,
        )
        ended = solution.status > 0
        message = _DONE if ended else _LIMITED
        if solution.status != 1 and barrier is not None:
            ended = False
            message = f"ended beside rejected points: {barrier}"
        return whole(solution.x), float(solution.cost), ended, message
