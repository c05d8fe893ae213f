"""Temperatures of surfaces without capacity, and the heat flows through them: the faces
of linings and rims."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..hybrid.arrays import Array

#: values of surfaces by their number, or of two coupled ones by both
Values = dict[Any, Array]

#: Newton steps where laws depend on surface temperatures: flows are exact to 1e-10 on
#: rims, 1e-6 on linings
_SURFACE_STEPS = 2


class End(NamedTuple):
    """End of a link: the temperature (of a wall: of its outermost layer), and the
    number of the surface where the link ends at one without capacity."""

    T: Array
    surface: int | None


class Path(NamedTuple):
    """A link between two ends.

    - `flows`: how many flows it has side by side
    - `g` (W/K): its conductance, or `None` where `law(T_a, T_b)` gives it
    - `constant`: whether the balances began with `g` in their `e`
    """

    a: End
    b: End
    flows: int
    g: Array | None
    law: Callable[[Array, Array], Array]
    constant: bool

    def flow(self, T_a: Array, T_b: Array) -> Array:
        """Flow from `b` to `a` (W)."""
        g = self.law(T_a, T_b) if self.g is None else self.g
        return jnp.broadcast_to(g * (T_b - T_a), (self.flows,))


class Tangent(NamedTuple):
    """A flow from `b` to `a` that is linear in the temperatures there:
    `q − g_a (T_a − S_a) + g_b (T_b − S_b)`."""

    q: Array
    g_a: Array
    g_b: Array
    S_a: Array
    S_b: Array


@dataclasses.dataclass
class Balances:
    """Linear balances of surfaces without capacity, gathered flow by flow.

        (e_c + Σ_d W_cd) S_c = b_c + Σ_d W_cd S_d

    `sizes`: how many temperatures each surface has
    """

    sizes: dict[int, int] = dataclasses.field(default_factory=dict)
    e: Values = dataclasses.field(default_factory=dict)
    b: Values = dataclasses.field(default_factory=dict)
    W: Values = dataclasses.field(default_factory=dict)

    def copy(self) -> "Balances":
        return Balances(dict(self.sizes), dict(self.e), dict(self.b), dict(self.W))

    def _add(self, to: Values, key: Any, size: int, value: Array, flows: int) -> None:
        value = gathered(value, size, flows)
        to[key] = to[key] + value if key in to else value

    def begin(self, c: int, size: int, e: Array | None) -> None:
        """Begin the balance of a surface of `size` temperatures; `e`: its constant
        part."""
        self.sizes[c] = size
        if e is not None:
            self.e[c] = e

    def enter(self, c: int, e: Array | None, b: Array, flows: int) -> None:
        """Enter flows `b − e S_c`; `e`: `None` where the balance began with it."""
        if e is not None:
            self._add(self.e, c, self.sizes[c], e, flows)
        self._add(self.b, c, self.sizes[c], b, flows)

    def _couple(self, c: int, d: int, g: Array, flows: int) -> None:
        self._add(self.W, (c, d), max(self.sizes[c], self.sizes[d]), g, flows)

    def conduct(self, path: Path, g: Array) -> None:
        """Enter the flow `g (T_b − T_a)`; there is none inside one surface."""
        if path.a.surface == path.b.surface:
            return
        for here, there in ((path.a, path.b), (path.b, path.a)):
            if here.surface is not None and there.surface is not None:
                self._couple(here.surface, there.surface, g, path.flows)
            elif here.surface is not None:
                self.enter(
                    here.surface, None if path.constant else g, g * there.T, path.flows
                )

    def follow(self, path: Path, at: Tangent) -> None:
        """Enter a flow by its tangent."""
        a = path.a.surface
        b = path.b.surface
        n = path.flows
        if a is not None and b is not None:
            q = at.q + at.g_a * at.S_a - at.g_b * at.S_b
            more = at.g_a - at.g_b
            self._couple(a, b, at.g_b, n)
            self._couple(b, a, at.g_a, n)
            self.enter(a, more, q, n)
            self.enter(b, -more, -q, n)
        elif a is not None:
            self.enter(a, at.g_a, at.q + at.g_a * at.S_a, n)
        elif b is not None:
            self.enter(b, at.g_b, at.g_b * at.S_b - at.q, n)

    def solve(self) -> Values:
        """Temperatures of all surfaces, by elimination without subtractions (Grassmann,
        Taksar & Heyman 1985).

        Surfaces with one temperature per lining go first: their linings are independent
        of each other, and add up in the balance of a surface with a single temperature.
        """
        order = sorted(self.e, key=lambda c: self.sizes[c] == 1)
        rows = []
        for i, c in enumerate(order):
            neighbours = [d for d in order[i + 1 :] if (c, d) in self.W]
            per_kelvin = self.e[c]
            n = self.sizes[c]
            for d in neighbours:
                per_kelvin = per_kelvin + self.W[c, d]
            inverse = 1 / per_kelvin
            for d in neighbours:
                share = self.W[d, c] * inverse
                self.enter(d, share * self.e[c], share * self.b[c], n)
                for other in neighbours:
                    if other != d:
                        self._couple(d, other, share * self.W[c, other], n)
            rows.append((c, neighbours, inverse))
        S: Values = {}
        for c, neighbours, inverse in reversed(rows):
            b = self.b[c]
            for d in neighbours:
                b = b + self.W[c, d] * S[d]
            S[c] = b * inverse
        return S


def gathered(values: Array, size: int, flows: int) -> Array:
    """Values of `flows` flows at a surface of `size` temperatures: as they are, or where
    it has a single temperature their sum."""
    if size > 1 or flows == 1:
        return values
    return jnp.sum(jnp.broadcast_to(values, (flows,)), keepdims=True)


def flows_of(paths: list[Path], linear: Balances) -> tuple[list[Array], Values]:
    """Flow through each path from `b` to `a` (W), and the temperatures of the surfaces.

    Linear paths are exact. Where a law depends on temperatures of surfaces, Newton's
    method takes two steps from the temperatures behind them.

    - `linear`: balances of the surfaces without the flows of the paths
    """
    for path in paths:
        if path.g is not None:
            linear.conduct(path, path.g)
    nonlinear = [
        i
        for i, path in enumerate(paths)
        if path.g is None and {path.a.surface, path.b.surface} != {None}
    ]
    S: Values = {}
    tangents: dict[int, Tangent] = {}
    for _ in range(_SURFACE_STEPS if nonlinear else 1):
        balances = linear.copy()
        for i in nonlinear:
            path = paths[i]
            tangents[i] = _tangent(path, _T_at(path.a, S), _T_at(path.b, S))
            balances.follow(paths[i], tangents[i])
        S = balances.solve()
    flows = []
    for i, path in enumerate(paths):
        T_a = _T_at(path.a, S)
        T_b = _T_at(path.b, S)
        if i not in tangents:
            flows.append(path.flow(T_a, T_b))
            continue
        at = tangents[i]
        flow = at.q
        if path.a.surface is not None:
            flow = flow - at.g_a * (T_a - at.S_a)
        if path.b.surface is not None:
            flow = flow + at.g_b * (T_b - at.S_b)
        flows.append(flow)
    return flows, S


def _T_at(end: End, S: Values) -> Array:
    return end.T if end.surface is None else S.get(end.surface, end.T)


def _tangent(path: Path, T_a: Array, T_b: Array) -> Tangent:
    q = path.flow(T_a, T_b)
    zero = jnp.zeros(path.flows)
    g_a = g_b = zero
    if path.a.surface is not None:
        q, rate = jax.jvp(lambda T: path.flow(T, T_b), (T_a,), (jnp.ones_like(T_a),))
        g_a = -rate
    if path.b.surface is not None:
        q, g_b = jax.jvp(lambda T: path.flow(T_a, T), (T_b,), (jnp.ones_like(T_b),))
    return Tangent(q, g_a, g_b, T_a, T_b)
