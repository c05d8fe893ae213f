"""One step of a Runge–Kutta method, its stages unrolled from a tableau that diffrax
ships."""

import abc
import importlib.resources
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ._bordered import Couplings
from .arrays import Array, Count, Rhs, RhsOf, Scalar, State
from .struct import AbstractVar, Struct, structural

if TYPE_CHECKING:
    import diffrax

_Stages = Float[Array, "stage state"]


def _frozen(value: Any) -> Any:
    """Lists as tuples, at any depth."""
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


class Pullback(NamedTuple):
    """A step from `(t, y)` over `h`: the new state, `rhs` there, and the map from
    cotangents of both to those of `(params, t, y)`."""

    y: State
    f: State
    back: Callable[[Array, Array], tuple[PyTree, Array, Array]]


class AbstractMethod(Struct):
    """A one-step method for the flat loop.

    Example:
        >>> result.record.method.order
        8
    """

    order: AbstractVar[int]

    @property
    def name(self) -> str:
        """What the method is called in results."""
        return type(self).__name__

    @abc.abstractmethod
    def rolled(self) -> "AbstractMethod":
        """The same method as a smaller program: quicker to compile, slower to run."""

    @abc.abstractmethod
    def fitted(self, couplings: Couplings | None) -> "AbstractMethod":
        """The same method for a system whose states couple like this; explicit methods
        do not care."""

    def with_fixed_jacobian(self, rhs: Rhs, t: Scalar, y: State) -> "AbstractMethod":
        """The same method with what stays the same in a run computed, for `rhs` at any
        of its instants."""
        return self

    def with_tangents(self) -> "AbstractMethod":
        """The same method, its attempts made for forward derivatives."""
        return self

    @abc.abstractmethod
    def attempt(
        self, rhs: Rhs, t: Scalar, y: State, f: State, h: Scalar
    ) -> tuple[State, State]:
        """From `(t, y)` with `f = rhs(t, y)` over `h`: the new state, and its error
        estimate but for `h error_of_rate rhs(t + h, y₁)`."""

    @property
    def error_of_rate(self) -> float:
        """Weight of the rate at the end of a step in its error estimate."""
        return 0.0

    @property
    @abc.abstractmethod
    def looks_at(self) -> tuple[float, ...]:
        """Shares of a step at which its error estimate looks at the rates."""

    @property
    def blind(self) -> float:
        """Largest share of a step between two of these looks."""
        return float(np.max(np.diff(np.unique([0.0, *self.looks_at, 1.0]))))

    @abc.abstractmethod
    def step_with_rate(
        self, rhs: Rhs, t: Scalar, y: State, h: Scalar
    ) -> tuple[State, State]:
        """The new state of a step and `rhs` there, as a program with as few call sites
        of `rhs` as possible."""

    def state_after(self, rhs: Rhs, t: Scalar, y: State, h: Scalar) -> State:
        """The new state of a step, as the smallest program: it is not to be
        differentiated."""
        return self.step_with_rate(rhs, t, y, h)[0]

    @abc.abstractmethod
    def pullback(
        self, rhs: RhsOf, params: PyTree, t: Scalar, y: State, h: Scalar
    ) -> Pullback:
        """`step_with_rate` and its derivatives backwards, `h` frozen."""


def _stages(
    rhs: Rhs,
    t: Scalar,
    y: State,
    h: Scalar,
    k: _Stages,
    first: int,
    a: np.ndarray,
    c: np.ndarray,
) -> tuple[_Stages, _Stages]:
    """The rates `k` with those of the stages from `first` on, which have the rows `a`
    of weights and the nodes `c`; and where `rhs` is taken for them."""

    def stage(
        k: _Stages, entry: tuple[Count, Float[Array, " stage"], Scalar]
    ) -> tuple[_Stages, State]:
        i, weights, c = entry
        argument = y + h * weighted(weights, k)
        k = jax.lax.dynamic_update_slice(
            k, rhs(t + c * h, argument)[None], (i, jnp.zeros_like(i))
        )
        return k, argument

    places = jnp.arange(first, first + len(c), dtype=jnp.int32)
    return jax.lax.scan(stage, k, (places, jnp.asarray(a), jnp.asarray(c)))


class ExplicitRungeKutta(AbstractMethod):
    """An embedded explicit Runge–Kutta pair, `y₁ = y + h Σ bᵢ kᵢ`,
    `kᵢ = f(t + cᵢ h, y + h Σ aᵢⱼ kⱼ)`.

    Any explicit diffrax solver with an error estimate gives its tableau
    (`diffrax.Tsit5()`, `diffrax.Dopri8()`, …). The order is the one the step-size
    controller assumes for the local error. `unrolled` writes every stage out: the
    fastest program; otherwise the stages are a loop, and the program contains the
    equations once.

    Example:
        >>> import diffrax
        >>> sb.hybrid.ExplicitRungeKutta(diffrax.Tsit5()).order
        5
    """

    a: tuple[tuple[float, ...], ...] = structural()
    b: tuple[float, ...] = structural()
    b_error: tuple[float, ...] = structural()
    c: tuple[float, ...] = structural()
    fsal: bool = structural()
    order: int = structural()
    unrolled: bool = structural()
    solver: str = structural()

    def __init__(self, solver: "diffrax.AbstractERK", *, unrolled: bool = True) -> None:
        # importing it takes longer than most runs: it is not loaded where the tableau
        # is known
        import diffrax

        if not isinstance(solver, diffrax.AbstractERK):
            raise TypeError(
                "an explicit Runge–Kutta solver of diffrax is needed (Tsit5, Dopri8, "
                f"…), not {solver!r}"
            )
        tableau: Any = solver.tableau

        def numbers(row: np.ndarray) -> tuple[float, ...]:
            return tuple(float(x) for x in row)

        self.a = tuple(numbers(row) for row in tableau.a_lower)
        self.b = numbers(tableau.b_sol)
        self.b_error = numbers(tableau.b_error)
        self.c = numbers(tableau.c)
        self.unrolled = unrolled
        self.fsal = bool(tableau.fsal)
        order = solver.order(diffrax.ODETerm(lambda t, y, args: y))
        assert order is not None
        self.order = int(order)
        self.solver = type(solver).__name__

    @property
    def looks_at(self) -> tuple[float, ...]:
        return tuple(
            c for c, weight in zip((0.0, *self.c), self.b_error, strict=False) if weight
        )

    @classmethod
    def shipped(cls, solver: str) -> "ExplicitRungeKutta":
        """The method of a diffrax solver whose tableau is in `tableaus.json`, without
        the import of diffrax."""
        text = (
            importlib.resources.files("simbrake.hybrid") / "tableaus.json"
        ).read_text("utf-8")
        tableau = {
            name: _frozen(value) for name, value in json.loads(text)[solver].items()
        }
        return cls._of(**tableau, unrolled=True, solver=solver)

    @classmethod
    def _of(cls, **fields: Any) -> "ExplicitRungeKutta":
        method = object.__new__(cls)
        for name in cls.__dataclass_fields__:
            object.__setattr__(method, name, fields[name])
        return method

    @property
    def name(self) -> str:
        return self.solver

    def fitted(self, couplings: Couplings | None) -> "ExplicitRungeKutta":
        return self

    def rolled(self) -> "ExplicitRungeKutta":
        return self._of(**{**vars(self), "unrolled": False})

    @property
    def error_of_rate(self) -> float:
        return self.b_error[-1] if self.fsal else 0.0

    def attempt(
        self, rhs: Rhs, t: Scalar, y: State, f: State, h: Scalar
    ) -> tuple[State, State]:
        # FSAL: the last stage is taken at (t + h, y₁) itself, where the rate is found
        # in any case
        rows, nodes = (self.a[:-1], self.c[:-1]) if self.fsal else (self.a, self.c)
        if not self.unrolled:
            return self._in_a_loop(rows, nodes, rhs, t, y, f, h)
        stages = [f]
        for row, c in zip(rows, nodes, strict=True):
            stages.append(rhs(t + c * h, y + h * _combine(row, stages)))
        weights = self.a[-1] if self.fsal else self.b
        return y + h * _combine(weights, stages), h * _combine(
            self.b_error[: len(stages)], stages
        )

    def _in_a_loop(
        self,
        rows: tuple[tuple[float, ...], ...],
        nodes: tuple[float, ...],
        rhs: Rhs,
        t: Scalar,
        y: State,
        f: State,
        h: Scalar,
    ) -> tuple[State, State]:
        n = len(rows) + 1
        k = jnp.zeros((n, y.shape[0]), y.dtype).at[0].set(f)
        k, _ = _stages(rhs, t, y, h, k, 1, square(((), *rows))[1:], np.asarray(nodes))
        weights = self.a[-1] if self.fsal else self.b
        both = h * weighted(jnp.asarray([weights[:n], self.b_error[:n]]).T, k[:, None])
        return y + both[0], both[1]

    def _all_stages(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of weights and nodes of all stages; the argument of the last one is the
        new state (as if FSAL)."""
        rows = ((), *self.a, *(() if self.fsal else (self.b,)))
        return square(rows), np.asarray([0.0, *self.c] + ([] if self.fsal else [1.0]))

    def _arguments(
        self, rhs: Rhs, t: Scalar, y: State, h: Scalar
    ) -> tuple[_Stages, _Stages]:
        """Where `rhs` is taken in every stage, and its values."""
        a, c = self._all_stages()
        k = jnp.zeros((len(c), y.shape[0]), y.dtype)
        return _stages(rhs, t, y, h, k, 0, a, c)

    def step_with_rate(
        self, rhs: Rhs, t: Scalar, y: State, h: Scalar
    ) -> tuple[State, State]:
        k, arguments = self._arguments(rhs, t, y, h)
        return arguments[-1], k[-1]

    def pullback(
        self, rhs: RhsOf, params: PyTree, t: Scalar, y: State, h: Scalar
    ) -> Pullback:
        k, arguments = self._arguments(lambda t, y: rhs(params, t, y), t, y, h)
        a, c = self._all_stages()
        n = len(c)

        def back(c_y: State, c_f: State) -> tuple[PyTree, Scalar, State]:
            def stage(
                carry: tuple[_Stages, PyTree], entry: tuple[Array, ...]
            ) -> tuple[tuple[_Stages, PyTree], None]:
                c_k, total = carry
                i, weights, c, argument = entry
                cotangents = jax.vjp(rhs, params, t + c * h, argument)[1](
                    jax.lax.dynamic_index_in_dim(c_k, i, 0, False)
                )
                c_argument = cotangents[2] + jnp.where(i == n - 1, c_y, 0.0)
                c_k = c_k + h * weights[:, None] * c_argument
                return (
                    c_k,
                    jax.tree.map(jnp.add, total, (*cotangents[:2], c_argument)),
                ), None

            nothing = jax.tree.map(jnp.zeros_like, (params, t, y))
            start = (jnp.zeros_like(k).at[-1].set(c_f), nothing)
            entries = (
                jnp.arange(n, dtype=jnp.int32),
                jnp.asarray(a),
                jnp.asarray(c),
                arguments,
            )
            return jax.lax.scan(stage, start, entries, reverse=True)[0][1]

        return Pullback(arguments[-1], k[-1], back)


def square(rows: tuple[tuple[float, ...], ...]) -> np.ndarray:
    """Rows of a lower triangle as a square matrix."""
    full = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        full[i, : len(row)] = row
    return full


def weighted(
    weights: Float[Array, "k *columns"], rows: Float[Array, "k ..."]
) -> Float[Array, "..."]:
    """`Σ w_i x_i`; no matrix product, which XLA may hand to a library and then cannot
    join with all the rest."""
    return jnp.sum(
        weights.reshape(*weights.shape, *(1,) * (rows.ndim - weights.ndim)) * rows,
        axis=0,
    )


def _combine(weights: tuple[float, ...], stages: list[Array]) -> Array:
    terms = [w * k for w, k in zip(weights, stages, strict=True) if w != 0.0]
    return sum(terms[1:], start=terms[0]) if terms else jnp.zeros_like(stages[0])
