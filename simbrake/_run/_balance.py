"""Energies and heat of a run with their balance, and what its brake could hold: functions of its record."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import DeviceJit
from .._hybrid import Record
from .._hybrid._arrays import Array
from .._physics._brake import BrakeSystem, Capacity
from ._probe import LANES, Probe


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
    shares = system.shares
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
    shares = system.shares
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
