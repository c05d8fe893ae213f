"""Maximum values over a run: of metrics, and of any quantity of a probe.

Values and places are found on the run as it is (`hybrid.extremes`); derivatives are
those of a probe at the place.
"""

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ..hybrid import Record
from ..hybrid._derivative import no_tangent
from ..hybrid.arrays import Array, TwoArrays, Vector, numpy_of
from ..hybrid.extremes import SAME, Extremes, Watched, greatest, greatest_of_rows
from ..hybrid.system import Flat, unravel
from ..physics._brake import BrakeSystem
from ._wants import holding_rows
from .metrics import HOLDING, METRICS, Peak, identity_of
from .probe import (
    Probe,
    RunJit,
    Sight,
    SightOfOne,
    in_lanes,
    is_traced_run,
    states_inside,
)

#: of a probe, (m, n): that of which the maximum over the run is wanted
Pick = Callable[[Probe], Array]


def _sighted(
    system: BrakeSystem, t: Array, y: PyTree, mode: PyTree, picks: Sequence[Pick]
) -> list[Array]:
    """The entries of each pick at one instant."""
    sight: Any = SightOfOne(Sight(system, t, y, mode))
    return [jnp.ravel(pick(sight)) for pick in picks]


def _rated(
    system: BrakeSystem,
    t: Array,
    y: PyTree,
    mode: PyTree,
    f: PyTree,
    picks: Sequence[Pick],
) -> tuple[list[Array], list[Array]]:
    """Values and rates of the entries of each pick; `f`: the rates of the states."""
    return jax.jvp(
        lambda t, y: _sighted(system, t, y, mode, picks), (t, y), (jnp.ones_like(t), f)
    )


def _watched(flat: Flat, picks: Sequence[Pick]) -> Watched:
    """The entries of all picks, as the integrator follows them."""
    system: BrakeSystem = flat.system  # pyright: ignore

    def watch(t: Array, y: Array, mode: Array, f: Array) -> TwoArrays:
        state = flat.unpack_state(y)
        modes = flat.unpack_mode(mode)
        values, rates = _rated(system, t, state, modes, flat.unpack_state(f), picks)
        return jnp.concatenate(values), jnp.concatenate(rates)

    def entries_at(t: Array, y: PyTree, mode: PyTree) -> list[Array]:
        return _sighted(system, t, y, mode, picks)

    entries = jax.eval_shape(
        entries_at, jax.ShapeDtypeStruct((), np.float64), flat.y_like, flat.mode_like
    )
    return Watched(watch, tuple(entry.size for entry in entries))


def _places(
    record: Record,
    picks: Sequence[Pick],
    counts: Int[Array, "row group"] | None = None,
    *,
    each: bool = False,
) -> Extremes:
    """Where in a traced run each pick is greatest, or `each` of its entries."""
    watched = _watched(record.flat, picks)
    if each:
        watched = watched._replace(groups=(1,) * sum(watched.groups))
    return greatest(record, watched, counts)


def _into(record: Record, places: Extremes) -> TwoArrays:
    """Rows of places, and times from the start of each (s), which move with the ends of
    the row."""
    t = record.rows.t
    return places.row, places.share * (t[places.row + 1] - t[places.row])


# --- of metrics ---------------------------------------------------------------------


def _picks(asked: Sequence[Any]) -> list[Pick]:
    """What metrics are the maxima of; each by its name, or by its function where it is
    a user's own."""
    return [
        METRICS[metric].find if isinstance(metric, str) else metric for metric in asked
    ]


def _asked(names: Iterable[str]) -> tuple[Any, ...]:
    return tuple(map(identity_of, names))


def _counts(record: Record, names: Sequence[str]) -> Int[Array, "row group"] | None:
    """What of each row counts (see `greatest`): all of it, but for the holding
    reserve."""
    if HOLDING not in names:
        return None
    holding = holding_rows(record)
    xp = numpy_of(record.rows.t)
    whole = xp.full(record.rows.t.shape[0], 2, np.int32)
    of_broken = xp.where(holding.broken, 1, 0)
    to_hold = xp.where(holding.to_hold, 2, of_broken).astype(np.int32)
    return xp.stack([to_hold if name == HOLDING else whole for name in names], axis=1)


#: values and rates by metric, (m, n) each
_Looks = tuple[list[Array], list[Array]]


def _looked(
    system: BrakeSystem, t: Array, y: PyTree, mode: PyTree, *, asked: tuple[Any, ...]
) -> _Looks:
    def look(t: Array, y: PyTree, mode: PyTree) -> _Looks:
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        return _rated(system, t, y, mode, f, _picks(asked))

    return jax.vmap(look)(t, y, mode)


_LOOKED = RunJit(_looked, static_argnames=("asked",), quick=True)
#: rows that are looked at in one call
_LANES = 32


@functools.partial(jax.custom_jvp, nondiff_argnums=(1,))
def _found(record: Record, names: tuple[str, ...]) -> tuple[Extremes, Array]:
    """Maxima of metrics over a traced run, and their times."""
    found = _places(record, _picks(_asked(names)), _counts(record, names))
    index, h = _into(record, found)
    return found, record.rows.t[index] + h


@_found.defjvp
def _(
    names: tuple[str, ...], primals: tuple[Record], tangents: tuple[Record]
) -> tuple[Any, Any]:
    """Derivatives of values are those of a probe at the places, which stay where they
    are in their steps. Inside a step the time `t` of a maximum moves on top of that, so
    that the rate `r` of its quantity stays 0: by `−dr/(dr/dt)`."""
    found, t = _found(*primals, names)
    picks = _picks(_asked(names))
    each = jnp.arange(len(names))
    system: BrakeSystem = primals[0].system  # pyright: ignore

    def places(record: Record) -> tuple[Array, PyTree, PyTree]:
        t, y = record.inside(*_into(record, found))
        return t, y, jax.vmap(record.flat.unpack_mode)(record.rows.mode[found.row])

    def look(system: Any, i: Array, t: Array, y: PyTree, mode: PyTree) -> TwoArrays:
        """Value and rate of the quantity of a place."""
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        both = _rated(system, t, y, mode, f, picks)
        entries = zip(*both, found.entry, strict=True)
        value, rate = zip(*((q[j], r[j]) for q, r, j in entries), strict=True)
        return jnp.stack(value)[i], jnp.stack(rate)[i]

    def there(record: Record) -> tuple[TwoArrays, Array]:
        t, y, mode = places(record)
        looks = jax.vmap(functools.partial(look, record.system))(each, t, y, mode)
        return looks, t

    def curvature(i: Array, t: Array, y: PyTree, mode: PyTree) -> Array:
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        along = (jnp.ones_like(t), f)
        rate = lambda t, y: look(system, i, t, y, mode)[1]
        return jax.jvp(rate, (t, y), along)[1]

    _, ((moves, of_rate), of_time) = jax.jvp(there, primals, tangents)
    curved = jax.vmap(curvature)(each, *places(primals[0]))
    inside = (found.share > 0) & (found.share < 1) & (curved != 0)
    shift = of_rate / jnp.where(inside, curved, 1.0)
    of_time = of_time - jnp.where(inside, shift, 0.0)
    still = jax.tree.map(no_tangent, found)
    return (found, t), (still._replace(value=moves), of_time)


def peaks(record: Record, names: Sequence[str]) -> dict[str, Peak]:
    """Maximum values over a traced run by name, with their derivatives, all from one
    walk."""
    if not names:
        return {}
    found, t = _found(record, tuple(names))
    each = zip(names, found.value, t, found.entry, strict=True)
    return {
        name: _or_none(name, Peak(value, time, entry + 1))
        for name, value, time, entry in each
    }


def watched_metrics(flat: Flat, names: Sequence[str]) -> Watched:
    """What metrics are the greatest values of, to be followed in a run that is not
    recorded.

    Of each metric the largest entry alone: where one lining takes over from another
    inside a step, only the ends of the step show it.
    """

    def largest(pick: Pick) -> Pick:
        return lambda p: jnp.max(pick(p), axis=1)

    return _watched(flat, [*map(largest, _picks(_asked(names)))])


def _or_none(name: str, peak: Peak) -> Peak:
    """The maximum, 0 of a holding reserve where nothing was to be held."""
    if name != HOLDING:
        return peak
    xp = numpy_of(peak.value)
    return peak._replace(value=xp.where(peak.value >= 0, peak.value, 0.0))


def _looked_at(
    record: Record, row: Array, share: Array, *, asked: tuple[Any, ...]
) -> _Looks:
    """Values and rates (m, n) of metrics in rows (m,) of a concrete record, at shares
    of their steps."""
    rows = record.rows
    h = share * (rows.t[row + 1] - rows.t[row])
    y = np.asarray(rows.y)[row]
    inside = np.flatnonzero(share > 0)
    if inside.size:
        y[inside] = states_inside(record, row[inside], h[inside])[1]

    def look(t: np.ndarray, y: np.ndarray, mode: np.ndarray) -> _Looks:
        return _LOOKED(
            record.system,
            t,
            unravel(y, record.y_like),
            unravel(mode, record.mode_like),
            asked=asked,
        )

    times = np.asarray(rows.t[row] + h)
    modes = np.asarray(rows.mode[row])
    return in_lanes(look, times, y, modes, lanes=_LANES)


class Maxima:
    """Maximum values of metrics over a concrete run, from one walk.

    - `whole`: by name, over the whole run
    - `between`: by name, between each pair of the rows `spans` (k,)
    """

    def __init__(
        self,
        record: Record,
        names: Sequence[str],
        spans: Sequence[tuple[int, int]] = (),
    ) -> None:
        self.whole: dict[str, Peak] = {}
        #: how many entries each quantity has
        self.widths: dict[str, int] = {}
        self.between: dict[str, Float[np.ndarray, " k"]] = {
            name: np.zeros(len(spans)) for name in names
        }
        if not names:
            return
        span = np.zeros(max(int(record.count), 1), np.int32)
        for k, (first, last) in enumerate(spans, 1):
            span[first:last] = k

        def look(row: Array, share: Array) -> _Looks:
            looks = _looked_at(record, row, share, asked=_asked(names))
            self.widths = {
                name: values.shape[1]
                for name, values in zip(names, looks[0], strict=True)
            }
            return looks

        found = greatest_of_rows(
            record, look, _counts(record, names), span, len(spans) + 1
        )
        # over the whole run: of equal ones the first
        top = np.max(found.value, axis=0)
        same = found.value >= top - SAME * np.abs(top)
        first = np.argmin(np.where(same, found.row + found.share, np.inf), axis=0)
        whole = [np.take_along_axis(column, first[None], axis=0)[0] for column in found]
        index, h = _into(record, Extremes(*whole))
        t = record.rows.t[index] + h
        for i, name in enumerate(names):
            self.whole[name] = _or_none(name, Peak(whole[0][i], t[i], whole[3][i] + 1))
            self.between[name] = np.asarray(found.value)[1:, i]


# --- of any quantity ----------------------------------------------------------------


def peak_of_each(record: Record, pick: Pick) -> Vector:
    """Maximum values over a run of each of the entries (n,) that `pick` (m, n) has; of
    a `SightOfOne`, hashable by what it picks."""
    if not is_traced_run(record):

        def look(row: Array, share: Array) -> _Looks:
            [values], [rates] = _looked_at(record, row, share, asked=(pick,))
            each = range(values.shape[1])
            return [values[:, i, None] for i in each], [rates[:, i, None] for i in each]

        return greatest_of_rows(record, look).value[0]

    frozen = jax.lax.stop_gradient(record)
    found = _places(frozen, [pick], each=True)
    t, y = record.inside(*_into(record, found))
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[found.row])

    def entries_at(t: Array, y: PyTree, mode: PyTree) -> Array:
        system: BrakeSystem = record.system  # pyright: ignore
        return _sighted(system, t, y, mode, [pick])[0]

    return jnp.diagonal(jax.vmap(entries_at)(t, y, mode))
