"""Looking into a run at any time: states and forces, integrals over it, its energies and their balance."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._base._compiling import DeviceJit
from .._base._progress import piece
from .._physics._brake import BrakeSystem, Capacity, passing, surfaces
from .._physics._mechanism import Shown
from ..hybrid import SKIPPED, Record
from ..hybrid._arrays import Array

SAMPLES = 9  # per step, when a whole run is scanned
LANES = 512  # times looked at in one call of the compiled probe


class Probe(NamedTuple):
    """States, forces and margins at the times `t` (m,)."""

    t: Array
    y: Any
    mode: Any
    flows: Any
    shown: Shown
    margins: Array
    greater_tension: Any  # of the two sides of each lining; None without a band
    surfaces: dict[str, Array]  # surface temperatures of rim, linings, band (m, nodes), where the scene has them
    passing: Array  # (m, marks): by how much marks that only heat can pass are passed (see `mark_names`)


def probe(record: Record, index: Array, share: Array) -> Probe:
    """Everything at a share (0…1) of the steps named, by a partial step of the method itself.

    The share is of the time up to the next row, so that ends of steps move with their events under differentiation.
    """
    t = record.rows.t
    h = share * (t[jnp.minimum(index + 1, record.count)] - t[index])
    return probe_at(record, index, h)


def probe_at(record: Record, index: Array, h: Array) -> Probe:
    system: BrakeSystem = record.system  # pyright: ignore
    t, y = record.inside(index, h)
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[index])

    def look(t: Array, y: Any, mode: Any) -> Any:
        q, mechanism = system.variables(t, y, mode), system.mechanism
        hot = surfaces(system, q)
        return (
            q,
            mechanism.shown(q.lever_tension, y.omega, y.own, mode, system.surfaces(y), q.contact),
            mechanism.lining_margins(mode, q.contact),
            hot,
            passing(system, mode, q, hot),
        )

    flows, shown, margins, hot, passed = jax.vmap(look)(t, y, mode)
    greater = None
    if shown.tension is not None:
        before = jnp.concatenate([flows.contact.slack_tension[:, None], shown.tension[:, :-1]], axis=1)
        greater = jnp.maximum(shown.tension, before)
    return Probe(t, y, mode, flows, shown, margins, greater, hot, passed)


_probe_compiled = DeviceJit(probe_at)


def probe_many(record: Record, index: Any, h: Any) -> Probe:
    """The probe of a compact record outside of jit.

    A call gets the rows that it looks at, always as many, instead of the whole record: the work grows with the number
    of times, not with that times the length of the run, and runs of any length share one compiled program.
    """
    parts, index, h = [], np.asarray(index), np.asarray(h)
    lanes = np.arange(LANES, dtype=np.int32)
    for start in range(0, len(index), LANES):
        if len(index) > LANES:  # somebody may be waiting
            piece(start // LANES, -(-len(index) // LANES))
        i, s = index[start : start + LANES], h[start : start + LANES]
        used = len(i)
        here, offset = (np.pad(part, (0, LANES - used), mode="edge") for part in (i, s))
        rows = jax.tree.map(lambda column, here=here: column[here], record.rows)
        out = _probe_compiled(dataclasses.replace(record, rows=rows), lanes, offset)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], out))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


# --- integrals over a run, by quadrature inside every step ------------------------------------------------------------

#: Gauss–Legendre points in every step: exact to the order 2 · 6 − 1, above that of the methods that integrate
POINTS = 6


def as_tree(function: Callable[..., Any]) -> Any:
    """A function as a PyTree, so that it can be an argument of a compiled program; PyTrees stay as they are."""
    leaf = jax.tree.structure(0)
    return jax.tree_util.Partial(function) if jax.tree.structure(function) == leaf else function


def is_traced(tree: Any) -> bool:
    """Whether any leaf is being traced by a transformation of JAX."""
    return any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(tree))


def _integrate(record: Record, pick: Any, *, points: int) -> Any:
    rows = record.rows
    n = rows.t.shape[0]
    here = jnp.arange(n, dtype=jnp.int32)
    used = (here < record.count) & (rows.kind != SKIPPED)
    span = jnp.where(used, rows.t[jnp.minimum(here + 1, record.count)] - rows.t, 0.0)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    # rows that were never written hold nothing that could be looked at: there the first row is, with weight 0
    index = jnp.repeat(jnp.where(used, here, 0), points)
    values = pick(probe(record, index, jnp.tile(jnp.asarray(0.5 * (nodes + 1)), n)))
    weight = jnp.repeat(span, points) * jnp.tile(jnp.asarray(0.5 * weights), n)
    return jax.tree.map(lambda leaf: jnp.tensordot(weight, leaf, axes=1), values)


_compiled = DeviceJit(_integrate, static_argnames="points")


def integral(run: Any, pick: Callable[[Probe], Any], *, points: int = POINTS) -> Any:
    """`∫ pick(probe) dt` over a run, from its start to its end.

        ∫ q dt = Σ_steps h Σ_k w_k q(t + s_k h)        (Gauss–Legendre, `points` nodes s_k in each recorded step)

    - `run`: a `Result` or its record, concrete or traced; under `vmap` map the call, not a batch of results
    - `pick`: function of a probe of `m` times to an array (m, …), or a PyTree of such: what is looked at there are
      `p.t`, `p.y`, `p.mode`, `p.flows`, `p.shown` (friction pairs, tensions), `p.surfaces`. Use one function again, or
      a `jax.tree_util.Partial` of one: a new function compiles anew

    Between two events a run is smooth and its states inside a step are those of the method itself, so that the error
    is that of the integration. What is not smooth inside a step (linings that come to their limit one by one while a
    band is elastic) converges more slowly; `points` tells. Differentiable forward and reverse, ends of steps move
    with their events. Heat that is booked at an instant (a restart, a break-away, a release of an elastic band) is no
    integral and not in it.
    """
    record: Record = getattr(run, "record", run)
    pick = as_tree(pick)
    if is_traced((record, pick)):
        return _integrate(record, pick, points=points)
    return _compiled(record.compact(), pick, points=points)


# --- energies, heat and capacity --------------------------------------------------------------------------------------


def friction_work(ledger: Any) -> Any:
    """Work of all friction pairs in a ledger (J)."""
    return sum(ledger.friction[1:], start=ledger.friction[0])


def energies(record: Record) -> dict[str, Array]:
    """Energies over the run in J, and the closure of their balance as a share of the largest exchanged.

    `kinetic_change + elastic_change = load_work + lever_work − friction_heat − damper_heat` (model §1); without a band
    there is no `elastic_change`; where the scene has `power_shares`, `electrical_work` and `mechanical_work` of the
    friction go off as well (S-8…11).
    """
    system: BrakeSystem = record.system  # pyright: ignore
    ledger = record.y_end.ledger
    ends = [(record.rows.t[i], *_row_of(record, i)) for i in (jnp.zeros_like(record.count), record.count)]
    (kinetic_0, elastic_0), (kinetic_1, elastic_1) = (system.stored(*end) for end in ends)
    kinetic, elastic = kinetic_1 - kinetic_0, elastic_1 - elastic_0
    shares = system.grip.shares
    work, hot, more = friction_work(ledger), 1.0 if shares is None else shares.heat, {}
    if len(ledger.friction) > 1:
        pairs = zip(system.pair_names, ledger.friction, strict=True)
        more = {f"heat_{pair}": hot * friction for pair, friction in pairs}
    if shares is not None:
        split = shares.split(work)
        more |= {"electrical_work": split.electrical, "mechanical_work": split.mechanical}
    damped = jnp.zeros_like(kinetic)
    if ledger.damper_heat is not None:
        damped = more["damper_heat"] = ledger.damper_heat
    residual = kinetic + elastic - (ledger.load_work + ledger.lever_work - work - damped)
    terms = [kinetic, elastic, ledger.load_work, ledger.lever_work, work, damped]
    found = {
        "load_work": ledger.load_work,
        "lever_work": ledger.lever_work,
        "friction_heat": hot * work,
        **more,
        "kinetic_change": kinetic,
        **({"elastic_change": elastic} if system.mechanism.banded else {}),
        "closure": _closure(residual, terms),
    }
    return found if system.thermal is None else found | _heats(record)


def _row_of(record: Record, i: Array) -> tuple[Any, Any]:
    """State and mode at the start of row `i`."""
    return record.flat.unpack_state(record.rows.y[i]), record.flat.unpack_mode(record.rows.mode[i])


def _closure(residual: Any, terms: list[Any]) -> Array:
    largest = jnp.max(jnp.abs(jnp.stack(terms)))
    return jnp.where(largest > 0, jnp.abs(residual) / jnp.where(largest > 0, largest, 1.0), 0.0)


def stored_heat(record: Record) -> dict[str, Array]:
    """Heat stored in every body of the network since the start (J)."""
    system: BrakeSystem = record.system  # pyright: ignore
    thermal = system.thermal
    if thermal is None:
        return {}
    start = record.flat.unpack_state(record.rows.y[0])
    change = thermal.capacity * (record.y_end.heat - start.heat)
    return {name: jnp.sum(change[here]) for name, here in thermal.spans.stores.items()}


def _heats(record: Record) -> dict[str, Array]:
    """What became of the friction heat (J): `friction_heat + heat_supplied = heat_stored + heat_lost`.

    `heat_to_metal`, `heat_to_linings`, `heat_to_band`: where the friction heat entered (on a standard brake nothing
    rubs on the band); `heat_lost`: to the air and other reservoirs, and what goes to parts that are not modelled.
    """
    system: BrakeSystem = record.system  # pyright: ignore
    ledger = record.y_end.ledger
    booked = ledger.heat
    stored = sum(stored_heat(record).values(), start=jnp.zeros(()))
    shares = system.grip.shares
    heat = friction_work(ledger) if shares is None else shares.heat * friction_work(ledger)
    residual = heat + booked.supplied - stored - booked.lost
    terms = [heat, booked.supplied, stored, booked.lost]
    return {
        "heat_to_metal": booked.to_metal,
        "heat_to_linings": booked.to_linings,
        "heat_to_band": jnp.zeros_like(booked.to_metal) if booked.to_band is None else booked.to_band,
        "heat_supplied": booked.supplied,
        "heat_stored": stored,
        "heat_lost": booked.lost,
        "heat_closure": _closure(residual, terms),
    }


_energies_compiled = DeviceJit(energies)


def energies_of(record: Record) -> dict[str, Array]:
    """`energies` of a concrete record."""
    return _energies_compiled(record)


def end_capacity(record: Record) -> Capacity:
    """Load torque and capacity of the brake at the end of a run; of meaning where the pulley still turns."""
    return _capacity(record.system, record.t_end, record.y_end, record.mode_end, record.rows.t[0])


def _capacity(system: Any, t: Any, y: Any, mode: Any, start: Any) -> Capacity:
    return system.capacity(t, y, mode, start)


_capacity_compiled = DeviceJit(_capacity)


def end_capacity_of(record: Record) -> Capacity:
    """`end_capacity` of a concrete record."""
    start = np.asarray(record.rows.t)[0]
    found = _capacity_compiled(record.system, record.t_end, record.y_end, record.mode_end, start)
    return jax.tree.map(np.asarray, found)


_capacities_compiled = DeviceJit(jax.vmap(_capacity, in_axes=(None, 0, 0, 0, None)))


def capacities_at(record: Record, p: Probe, index: np.ndarray) -> Capacity:
    """Load torque and capacity of the brake of a concrete record at the samples named of a probe."""
    start, parts = np.asarray(record.rows.t)[0], []
    for at in np.split(index, range(LANES, len(index), LANES)):
        padded = np.pad(at, (0, LANES - len(at)), mode="edge")  # calls of one size compile once
        t, y, mode = jax.tree.map(lambda column, here=padded: np.asarray(column)[here], (p.t, p.y, p.mode))
        found, used = _capacities_compiled(record.system, t, y, mode, start), len(at)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], found))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)
