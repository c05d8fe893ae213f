"""A linearly implicit method for stiff systems, in the flat loop like any other."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ._bordered import (
    Bordered,
    ChainRows,
    Couplings,
    Factored,
    factor,
    jacobian,
    linear_rows,
    solve,
)
from ._method import AbstractMethod, Pullback, square, weighted
from .arrays import Array, Rhs, RhsOf, Scalar, State, TwoArrays, put, take
from .struct import structural

# Rodas5P, coefficients in the form without products by the Jacobian (Hairer & Wanner,
# Solving ODEs II, IV.7):
#     (I/(γ h) − J) u_i = f(t + c_i h, y + Σ a_ij u_j) + Σ C_ij u_j / h + d_i h ∂f/∂t,
#     y₁ = y + Σ m_i u_i
_GAMMA = 0.21193756319429014
_A6 = (
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
)
_A = (
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    _A6,
    (*_A6, 1.0),
    (*_A6, 1.0, 1.0),
)
_C76 = -28.087943162872662
_C86 = -54.66780262877968
_C87 = -9.48861652309627
_C = (
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (
        24.854864614690072,
        -3.0009227002832186,
        47.4931110020768,
        5.5814197821558125,
        -0.6610691825249471,
    ),
    (
        30.91273214028599,
        -3.1208243349937974,
        77.79954646070892,
        34.28646028294783,
        -19.097331116725623,
        _C76,
    ),
    (
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        _C86,
        _C87,
    ),
)
_NODES = (
    0.0,
    0.6358126895828704,
    0.4095798393397535,
    0.9769306725060716,
    0.4288403609558664,
    1.0,
    1.0,
    1.0,
)
_D = (
    0.21193756319429014,
    -0.42387512638858027,
    -0.3384627126235924,
    1.8046452872882734,
    2.325825639765069,
    0,
    0,
    0,
)


_a = square(_A)
_c = square(_C)
_m = np.append(np.asarray(_A[-1]), 1.0)
# the classical weights, for quadratures: k = Γ⁻¹ u, Γ⁻¹ = I/γ − C, so that y₁ = y + Σ
# b_i k_i with b = m Γ
_b = _m @ np.linalg.inv(np.eye(len(_m)) / _GAMMA - _c)
# those of their error estimate, the last increment
_e = np.linalg.inv(np.eye(len(_m)) / _GAMMA - _c)[-1]
_bd, _ed = (float(weights @ np.asarray(_D)) for weights in (_b, _e))
_TABLE = (_a, _c, np.asarray(_NODES), np.asarray(_D, float), _b)
_TABLE_WITH_ERROR = (*_TABLE[:4], np.stack([_b, _e], axis=1))


#: a step of length 0 is taken as one so short that nothing can overflow
_LEAST = 1e-30


class Rodas5P(AbstractMethod):
    """Rosenbrock method of order 5(4) with 8 stages, stiffly accurate and A-stable.

    One Jacobian and one factorisation a step, no Newton iteration; the last increment
    is the error estimate. States on which no rate depends (ledgers, wear), or which
    only change at events, stay out of the linear systems and are summed with the same
    weights, so that sums which the equations conserve are conserved to rounding; their
    errors are estimated as those of all others. `couplings` gives the sparsity of the
    Jacobian; without it, it is dense.

    Derivatives of a step include those of the Jacobian: each linear solve is
    differentiated by its residual.

    Reference: G. Steinebach, *Construction of Rosenbrock–Wanner method Rodas5P and
    numerical benchmarks within the Julia Differential Equations package*, BIT 63 (2023)
    27.

    Example:
        >>> sb.simulate(scene, solver=sb.hybrid.Rodas5P()).status
        'stopped'
    """

    couplings: Couplings | None = structural(default=None)
    # rows of the Jacobian; constant rows are already correct
    linear: ChainRows | None = None
    order: int = structural(default=5)
    # an attempt is to be differentiated forwards
    differentiated: bool = structural(default=False)

    def rolled(self) -> "Rodas5P":
        return self

    def fitted(self, couplings: Couplings | None) -> "Rodas5P":
        return Rodas5P(couplings)

    def with_tangents(self) -> "Rodas5P":
        return Rodas5P(self.couplings, self.linear, differentiated=True)

    def with_fixed_jacobian(self, rhs: Rhs, t: Scalar, y: State) -> "Rodas5P":
        places = self._couplings(y)
        if places.varying is None or len(places.varying) == len(places.chain):
            return self
        rows = linear_rows(_linearised(rhs, t, y, places).inside, places)
        rows = jax.lax.stop_gradient(rows)
        return Rodas5P(self.couplings, rows, differentiated=self.differentiated)

    def _couplings(self, y: State) -> Couplings:
        return self.couplings or Couplings(tuple(range(y.shape[0])), (), ())

    def _matrix(self, near: "_Linearised", h: Array) -> tuple[Bordered, Array]:
        """`I/(γ h) − J`, and `∂f/∂t`."""
        J, drift = jacobian(near.inside, self._couplings(near.y), self.linear)
        scale = 1.0 / (_GAMMA * h)
        eye = jnp.eye(J.core.shape[0])
        return Bordered(
            scale * eye - J.core,
            -J.right,
            -J.below,
            -J.lower,
            scale - J.diagonal,
            -J.upper,
        ), drift

    @property
    def looks_at(self) -> tuple[float, ...]:
        return _NODES

    def attempt(
        self, rhs: Rhs, t: Scalar, y: State, f: State, h: Scalar
    ) -> tuple[State, State]:
        near = _linearised(rhs, t, y, self._couplings(y))
        inner = near.inner
        outer = near.outer
        x = take(y, inner)
        nothing = jnp.zeros_like(y)
        moves = h != 0
        h = jnp.where(moves, h, _LEAST)
        matrix, drift = self._matrix(near, h)
        if self.differentiated:
            drift = near.drift
            solved = _by_residual(rhs, t, y, h, inner, matrix)
        else:
            lu = factor(matrix)
            solved = functools.partial(solve, lu)
        u, sums, _ = _stages(
            rhs, t, y, h, inner, outer, drift, solved, _TABLE_WITH_ERROR
        )
        y1 = put(y, inner, x + weighted(jnp.asarray(_m), u))
        error = put(nothing, inner, u[-1])
        if outer:
            bends = jax.vmap(near.outside)(
                h * np.asarray([_bd, _ed]),
                weighted(jnp.asarray([_b, _e]).T, u[:, None]),
            )
            change, off = h * (sums + bends)
            y1 = put(y1, outer, take(y, outer) + change)
            error = put(error, outer, off)
        return jnp.where(moves, y1, y), error

    def step_with_rate(
        self, rhs: Rhs, t: Scalar, y: State, h: Scalar
    ) -> tuple[State, State]:
        near = _linearised(rhs, t, y, self._couplings(y))
        inner = near.inner
        outer = near.outer
        x = take(y, near.inner)
        moves = h != 0
        full_step = h
        h = jnp.where(moves, h, _LEAST)
        solved = _by_residual(
            rhs, t, y, h, inner, self._matrix(near, h)[0], backwards=True
        )
        u, total, _ = _stages(rhs, t, y, h, inner, outer, near.drift, solved)
        y1 = put(y, inner, x + weighted(jnp.asarray(_m), u))
        if outer:
            along = put(jnp.zeros_like(y), inner, weighted(jnp.asarray(_b), u))
            bend = jax.jvp(rhs, (t, y), (_bd * h, along))[1]
            y1 = put(y1, outer, take(y, outer) + h * (total + take(bend, outer)))
        y1 = jnp.where(moves, y1, y)
        return y1, rhs(t + full_step, y1)

    def state_after(self, rhs: Rhs, t: Scalar, y: State, h: Scalar) -> State:
        # it has no use for the rate at the start
        return self.attempt(rhs, t, y, jnp.zeros_like(y), h)[0]

    def pullback(
        self, rhs: RhsOf, params: PyTree, t: Scalar, y: State, h: Scalar
    ) -> Pullback:
        rate = functools.partial(rhs, params)
        near = _linearised(rate, t, y, self._couplings(y))
        inner = near.inner
        outer = near.outer
        nothing = jnp.zeros_like(y)
        moves = h != 0
        h = jnp.where(moves, h, _LEAST)
        matrix, drift = self._matrix(near, h)
        lu = factor(matrix)
        lu_transposed = factor(matrix.transposed)
        n = len(_NODES)
        a = np.pad(_a, ((0, 1), (0, 1)))
        c = np.pad(_c, ((0, 1), (0, 1)))
        nodes = (*_NODES, 1.0)
        d = (*_D, 0.0)
        # one stage more is the rate at the end, from which nothing else follows
        a[n, :n] = _m
        b = np.append(_b, 0.0)
        table = (a, c, np.asarray(nodes), np.asarray(d, float), b)
        u, total, (arguments, fulls) = _stages(
            rate, t, y, h, inner, outer, drift, lambda b: solve(lu, b), table, keep=True
        )
        u = u[:n]
        bent = put(nothing, inner, weighted(jnp.asarray(_b), u))
        y1 = put(y, inner, arguments[-1])
        if outer:
            bend = near.outside(_bd * h, weighted(jnp.asarray(_b), u))
            y1 = put(y1, outer, take(y, outer) + h * (total + bend))

        def back(c_y: State, c_f: State) -> tuple[PyTree, Scalar, State]:
            c_moved = jnp.where(moves, c_y, 0.0)
            c_x = take(c_moved, inner)
            c_outer = h * take(c_moved, outer)
            leans = put(nothing, outer, c_outer)  # cotangent of the bend
            through = jax.linear_transpose(
                lambda v: near.outside(0.0, v), take(y, inner)
            )(c_outer)[0]

            def stage(
                carry: tuple[Array, PyTree], entry: tuple[Array, ...]
            ) -> tuple[tuple[Array, PyTree], Array]:
                c_u, total = carry
                i, a, c, node, b, argument = entry
                c_b = solve(
                    lu_transposed, jax.lax.dynamic_index_in_dim(c_u, i, 0, False)
                )
                c_full = put(put(nothing, inner, c_b), outer, b * c_outer)
                c_full = jnp.where(i == n, c_f, c_full)
                cotangents = jax.vjp(
                    rhs, params, t + node * h, put(y, inner, argument)
                )[1](c_full)
                c_argument = take(cotangents[2], inner) + jnp.where(i == n, c_x, 0.0)
                c_u = c_u + a[:, None] * c_argument + c[:, None] * (c_b / h)
                # (rates may depend on quadratures that are constant in a step, as on
                # the begin of a phase)
                c_start = put(cotangents[2], inner, c_argument)
                total = jax.tree.map(jnp.add, total, (*cotangents[:2], c_start))
                return (c_u, total), c_b

            start = (
                jnp.asarray(b)[:, None] * through,
                jax.tree.map(jnp.zeros_like, (params, t, y)),
            )
            entries = (
                jnp.arange(n + 1, dtype=jnp.int32),
                *(jnp.asarray(v) for v in (a, c, nodes, b)),
                arguments,
            )
            (_, total), c_b = jax.lax.scan(stage, start, entries, reverse=True)
            c_b = c_b[:n]
            # changes of the matrix, the drift and the bend: derivatives along
            # directions, each with its cotangent
            times = jnp.concatenate(
                [jnp.zeros(n), jnp.stack([jnp.ones_like(h), _bd * h])]
            )
            ways = jnp.concatenate(
                [
                    jax.vmap(lambda u: put(nothing, inner, u))(u),
                    jnp.stack([nothing, bent]),
                ]
            )
            drifts = h * weighted(jnp.asarray(d)[:n], c_b)
            weights = jax.vmap(lambda v: put(nothing, inner, v))(
                jnp.concatenate([c_b, drifts[None]])
            )
            weights = jnp.concatenate([weights, leans[None]])

            def bends(
                params: PyTree, t: Scalar, y: State, v_t: Scalar, v: State, w: State
            ) -> PyTree:
                return jax.jvp(
                    lambda t, y: jax.vjp(rhs, params, t, y)[1](w), (t, y), (v_t, v)
                )[1]

            curved = jax.vmap(lambda v_t, v, w: bends(params, t, y, v_t, v, w))(
                times, ways, weights
            )
            total = jax.tree.map(lambda x, z: x + jnp.sum(z, axis=0), total, curved)
            kept = put(jnp.where(moves, 0.0, c_y), outer, take(c_y, outer))
            return total[0], total[1], total[2] + kept

        y1 = jnp.where(moves, y1, y)
        return Pullback(y1, fulls[-1], back)


def _by_residual(
    rhs: Rhs,
    t: Scalar,
    y: State,
    h: Scalar,
    inner: tuple[int, ...],
    matrix: Bordered,
    *,
    backwards: bool = False,
) -> Callable[[Array], Array]:
    """Solutions with the matrix whose derivatives are those of the residual
    `v/(γ h) − J v`: one direction of the rates for each, where those of the matrix
    itself would take all its columns. `backwards`: also in reverse."""
    matrix = jax.lax.stop_gradient(matrix)
    x = take(y, inner)
    lu = factor(matrix)
    back = (
        functools.partial(_solved_by, factor(matrix.transposed)) if backwards else None
    )

    def residual(v: Array) -> Array:
        return (
            v / (_GAMMA * h)
            - jax.jvp(lambda x: take(rhs(t, put(y, inner, x)), inner), (x,), (v,))[1]
        )

    def solved(b: Array) -> Array:
        return jax.lax.custom_linear_solve(
            residual, b, functools.partial(_solved_by, lu), transpose_solve=back
        )

    return solved


def _solved_by(lu: Factored, _: Callable[[Array], Array], b: Array) -> Array:
    return solve(lu, b)


class _Linearised(NamedTuple):
    """The linear part of the rates at one instant, over the entries that linear systems
    are for and the quadratures."""

    # derivative along a change of time and state
    push: Callable[[Scalar, State], State]
    y: State
    inner: tuple[int, ...]
    outer: tuple[int, ...]

    def _along(self, dt: Scalar | float, v: Float[Array, " inner"]) -> State:
        return self.push(
            jnp.asarray(dt, self.y.dtype), put(jnp.zeros_like(self.y), self.inner, v)
        )

    def inside(
        self, dt: Scalar | float, v: Float[Array, " inner"]
    ) -> Float[Array, " inner"]:
        return take(self._along(dt, v), self.inner)

    def outside(
        self, dt: Scalar | float, v: Float[Array, " inner"]
    ) -> Float[Array, " outer"]:
        return take(self._along(dt, v), self.outer)

    @property
    def drift(self) -> Float[Array, " inner"]:
        """`∂f/∂t`."""
        return self.inside(1.0, jnp.zeros(len(self.inner), self.y.dtype))


def _linearised(rhs: Rhs, t: Scalar, y: State, places: Couplings) -> _Linearised:
    return _Linearised(
        jax.linearize(rhs, t, y)[1], y, places.core + places.chain, places.quadrature
    )


def _stages(
    rhs: Rhs,
    t: Scalar,
    y: State,
    h: Scalar,
    inner: tuple[int, ...],
    outer: tuple[int, ...],
    drift: Float[Array, " inner"],
    solved: Callable[[Array], Array],
    table: tuple[np.ndarray, ...] = _TABLE,
    keep: bool = False,
) -> tuple[Float[Array, "stage inner"], Float[Array, "*sums outer"], PyTree]:
    """Increments of all stages and the weighted sum, or sums, of the quadratures'
    rates; to `keep`: arguments and rates."""
    x = take(y, inner)
    n = len(table[0])

    def stage(
        carry: TwoArrays, entry: tuple[Array, ...]
    ) -> tuple[TwoArrays, TwoArrays | None]:
        u, total = carry
        i, a, c, node, d, b = entry
        argument = x + weighted(a, u)
        full = rhs(t + node * h, put(y, inner, argument))
        new = solved(take(full, inner) + weighted(c, u) / h + d * h * drift)
        u = jax.lax.dynamic_update_slice(u, new[None], (i, jnp.zeros_like(i)))
        return (u, total + b[..., None] * take(full, outer)), (
            argument,
            full,
        ) if keep else None

    start = (jnp.zeros((n, x.shape[0])), jnp.zeros((*table[-1].shape[1:], len(outer))))
    (u, total), kept = jax.lax.scan(
        stage, start, (jnp.arange(n, dtype=jnp.int32), *map(jnp.asarray, table))
    )
    return u, total, kept
