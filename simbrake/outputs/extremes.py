"""Maximum values over a run: of metrics, and of any quantity of a probe.

`hybrid.extremes` finds values and places on the run; derivatives are those of a probe
at the place.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ..hybrid import Record
from ..hybrid._derivative import no_tangent
from ..hybrid.arrays import Array, TwoArrays, Vector, numpy_of
from ..hybrid.extremes import SAME, Extremes, Watched, greatest, greatest_of_rows
from ..hybrid.system import Flat, unravel
from ..parts.scene import Scene
from ..physics._brake import BrakeSystem
from ._wants import holding_rows
from .metrics import HOLDING, METRICS, Peak, identity_of
from .probe import LazyProbe, Probe, WithTimeAxis, states_inside
from .programs import RunJit, in_lanes, is_traced_run

#: the quantity (m, n) of a system and its probe whose maximum over the run is wanted;
#: equal picks have to be the same quantity, as programs are compiled for each
Pick = Callable[[BrakeSystem, Probe], Array]


class _OfMetric(NamedTuple):
    """The quantity whose maximum a metric is, by its `identity_of`."""

    metric: Any

    def __call__(self, system: BrakeSystem, p: Probe) -> Array:
        by_name = isinstance(self.metric, str)
        return (METRICS[self.metric].find if by_name else self.metric)(p)


def _picks_of(names: Sequence[str]) -> tuple[_OfMetric, ...]:
    return tuple(_OfMetric(identity_of(name)) for name in names)


#: for each pick its entries
_Entries = list[Array]


def _entries_at(
    system: BrakeSystem, t: Array, y: PyTree, mode: PyTree, picks: Sequence[Pick]
) -> _Entries:
    """The entries of each pick at one instant."""
    probe: Any = WithTimeAxis(LazyProbe(system, t, y, mode))
    return [jnp.ravel(pick(system, probe)) for pick in picks]


def _rated(
    system: BrakeSystem,
    t: Array,
    y: PyTree,
    mode: PyTree,
    f: PyTree,
    picks: Sequence[Pick],
) -> tuple[_Entries, _Entries]:
    """Values and rates of the entries of each pick; `f`: the rates of the states."""
    return jax.jvp(
        lambda t, y: _entries_at(system, t, y, mode, picks),
        (t, y),
        (jnp.ones_like(t), f),
    )


def _watched(flat: Flat, picks: Sequence[Pick], *, each: bool = False) -> Watched:
    """The entries of all picks, as the integrator follows them; whether `each` entry is
    a group of its own."""
    system: BrakeSystem = flat.system  # pyright: ignore

    def watch(t: Array, y: Array, mode: Array, f: Array) -> TwoArrays:
        state = flat.unpack_state(y)
        modes = flat.unpack_mode(mode)
        values, rates = _rated(system, t, state, modes, flat.unpack_state(f), picks)
        return jnp.concatenate(values), jnp.concatenate(rates)

    def entries_at(t: Array, y: PyTree, mode: PyTree) -> _Entries:
        return _entries_at(system, t, y, mode, picks)

    entries = jax.eval_shape(
        entries_at, jax.ShapeDtypeStruct((), np.float64), flat.y_like, flat.mode_like
    )
    sizes = tuple(entry.size for entry in entries)
    return Watched(watch, (1,) * sum(sizes) if each else sizes)


def watched_metrics(flat: Flat, names: Sequence[str]) -> Watched:
    """The quantities whose maxima metrics are, to be followed in a run that is not
    recorded.

    Only the largest entry of each metric is followed: where another lining becomes the
    largest inside a step, only the ends of the step show it.
    """

    def largest(pick: Pick) -> Pick:
        return lambda system, p: jnp.max(pick(system, p), axis=1)

    return _watched(flat, [*map(largest, _picks_of(names))])


def _counts(record: Record, picks: Sequence[Pick]) -> Int[Array, "row group"] | None:
    """What of each row counts (see `greatest`): all of it, except for the holding
    reserve."""
    reserve = _OfMetric(HOLDING)
    if reserve not in picks:
        return None
    holding = holding_rows(record)
    xp = numpy_of(record.rows.t)
    whole = xp.full(record.rows.t.shape[0], 2, np.int32)
    of_broken = xp.where(holding.broken, 1, 0)
    to_hold = xp.where(holding.to_hold, 2, of_broken).astype(np.int32)
    return xp.stack([to_hold if pick == reserve else whole for pick in picks], axis=1)


def _into(record: Record, places: Extremes) -> TwoArrays:
    """Rows of places, and times from the start of each (s), which move with the ends of
    the row."""
    t = record.rows.t
    return places.row, places.share * (t[places.row + 1] - t[places.row])


# --- of a traced run ----------------------------------------------------------------


@functools.partial(jax.custom_jvp, nondiff_argnums=(1, 2))
def _found(
    record: Record, picks: tuple[Pick, ...], each: bool
) -> tuple[Extremes, Array]:
    """Maxima over a traced run, of each pick or of `each` of its entries, and their
    times."""
    watched = _watched(record.flat, picks, each=each)
    found = greatest(record, watched, _counts(record, picks))
    index, h = _into(record, found)
    return found, record.rows.t[index] + h


@_found.defjvp
def _(
    picks: tuple[Pick, ...],
    each: bool,
    primals: tuple[Record],
    tangents: tuple[Record],
) -> tuple[Any, Any]:
    """Derivatives of values are those of a probe at places that stay where they are in
    their steps. The time `t` of a maximum inside a step also moves by `−dr/(dr/dt)`, as
    the rate `r` of its quantity stays 0."""
    (record,) = primals
    found, t = _found(record, picks, each)
    numbers = jnp.arange(found.entry.size, dtype=jnp.int32)
    system: BrakeSystem = record.system  # pyright: ignore

    def places(record: Record) -> tuple[Array, PyTree, PyTree]:
        t, y = record.inside(*_into(record, found))
        return t, y, jax.vmap(record.flat.unpack_mode)(record.rows.mode[found.row])

    def look(system: Any, i: Array, t: Array, y: PyTree, mode: PyTree) -> TwoArrays:
        """Value and rate of the quantity of a place."""
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        values, rates = _rated(system, t, y, mode, f, picks)
        sizes = [entries.size for entries in values]
        begins = np.cumsum([0, *sizes[:-1]], dtype=np.int32)
        place = i if each else jnp.asarray(begins)[i] + found.entry[i]
        return jnp.concatenate(values)[place], jnp.concatenate(rates)[place]

    def there(record: Record) -> tuple[TwoArrays, Array]:
        t, y, mode = places(record)
        looks = jax.vmap(functools.partial(look, record.system))(numbers, t, y, mode)
        return looks, t

    def curvature(i: Array, t: Array, y: PyTree, mode: PyTree) -> Array:
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        along = (jnp.ones_like(t), f)
        rate = lambda t, y: look(system, i, t, y, mode)[1]
        return jax.jvp(rate, (t, y), along)[1]

    _, ((moves, of_rate), of_time) = jax.jvp(there, primals, tangents)
    curved = jax.vmap(curvature)(numbers, *places(record))
    inside = (found.share > 0) & (found.share < 1) & (curved != 0)
    shift = of_rate / jnp.where(inside, curved, 1.0)
    of_time = of_time - jnp.where(inside, shift, 0.0)
    still = jax.tree.map(no_tangent, found)
    return (found, t), (still._replace(value=moves), of_time)


# --- of a concrete run --------------------------------------------------------------


def _looked(
    system: BrakeSystem, t: Array, y: PyTree, mode: PyTree, *, picks: tuple[Pick, ...]
) -> tuple[_Entries, _Entries]:
    def look(t: Array, y: PyTree, mode: PyTree) -> tuple[_Entries, _Entries]:
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        return _rated(system, t, y, mode, f, picks)

    return jax.vmap(look)(t, y, mode)


_LOOKED = RunJit(_looked, static_argnames=("picks",), quick=True)
#: rows that are looked at in one call
_LANES = 32


def _looked_at(
    record: Record, row: Array, share: Array, picks: tuple[Pick, ...]
) -> tuple[_Entries, _Entries]:
    """Values and rates (m, n) of each pick in rows (m,) of a concrete record, at shares
    of their steps."""
    rows = record.rows
    h = share * (rows.t[row + 1] - rows.t[row])
    y = np.asarray(rows.y)[row]
    inside = np.flatnonzero(share > 0)
    if inside.size:
        y[inside] = states_inside(record, row[inside], h[inside])[1]

    def look(
        t: np.ndarray, y: np.ndarray, mode: np.ndarray
    ) -> tuple[_Entries, _Entries]:
        return _LOOKED(
            record.system,
            t,
            unravel(y, record.y_like),
            unravel(mode, record.mode_like),
            picks=picks,
        )

    times = np.asarray(rows.t[row] + h)
    modes = np.asarray(rows.mode[row])
    return in_lanes(look, times, y, modes, lanes=_LANES)


class _Found(NamedTuple):
    """Maxima (group,) over a run, and their times; of a concrete run also the maxima
    between pairs of rows (k, group), and how many entries each pick has."""

    whole: Extremes
    time: Array
    between: Array | tuple[()] = ()
    widths: tuple[int, ...] = ()


def _found_in_rows(
    record: Record,
    picks: tuple[Pick, ...],
    each: bool,
    spans: Sequence[tuple[int, int]],
) -> _Found:
    """As `_found`, of a concrete run."""
    span = np.zeros(max(int(record.count), 1), np.int32)
    for k, (first, last) in enumerate(spans, 1):
        span[first:last] = k
    widths: list[int] = []

    def look(row: Array, share: Array) -> tuple[_Entries, _Entries]:
        values, rates = _looked_at(record, row, share, picks)
        widths[:] = [entries.shape[1] for entries in values]
        return values, rates

    found = greatest_of_rows(
        record, look, _counts(record, picks), span, len(spans) + 1, each=each
    )
    # of equal maxima the first
    top = np.max(found.value, axis=0)
    same = found.value >= top - SAME * np.abs(top)
    first = np.argmin(np.where(same, found.row + found.share, np.inf), axis=0)
    whole = Extremes(
        *(np.take_along_axis(column, first[None], axis=0)[0] for column in found)
    )
    index, h = _into(record, whole)
    return _Found(whole, record.rows.t[index] + h, found.value[1:], tuple(widths))


# --- of any run ---------------------------------------------------------------------


def _search(
    record: Record,
    picks: tuple[Pick, ...],
    *,
    each: bool = False,
    spans: Sequence[tuple[int, int]] = (),
) -> _Found:
    """Maxima over a run of each pick, or of `each` of its entries."""
    if is_traced_run(record):
        return _Found(*_found(record, picks, each))
    return _found_in_rows(record, picks, each, spans)


class Maxima(NamedTuple):
    """Maximum values over a run by metric.

    - `whole`: over the whole run
    - `between`: between pairs of rows (k,) of a concrete run
    - `widths`: how many entries the quantity has, of a concrete run
    """

    whole: dict[str, Peak]
    between: dict[str, Float[np.ndarray, " k"]]
    widths: dict[str, int]


def maxima(
    record: Record,
    scene: Scene,
    names: Sequence[str],
    spans: Sequence[tuple[int, int]] = (),
) -> Maxima:
    """Maximum values over a run, with their derivatives, all from one pass over it;
    `spans`: pairs of rows of a concrete run between which they are wanted as well."""
    if not names:
        return Maxima({}, {}, {})
    found = _search(record, _picks_of(names), spans=spans)
    whole = {}
    columns = found.whole.value, found.time, found.whole.entry + 1
    for name, *column in zip(names, *columns, strict=True):
        peak = Peak(*column)
        if name == HOLDING:  # 0 where nothing was to be held
            value = numpy_of(peak.value).where(peak.value >= 0, peak.value, 0.0)
            peak = peak._replace(value=value)
        whole[name] = METRICS[name].of_peak(peak, scene)
    between = np.transpose(found.between)
    return Maxima(
        whole,
        dict(zip(names, between, strict=False)),
        dict(zip(names, found.widths, strict=False)),
    )


def peak_of_each(record: Record, pick: Pick) -> Vector:
    """Maximum value over a run of each entry (n,) of `pick` (m, n)."""
    return _search(record, (pick,), each=True).whole.value
