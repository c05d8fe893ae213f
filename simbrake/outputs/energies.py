"""Energies of a run, and the two balances that they form."""

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from ..hybrid import Record
from ..hybrid.arrays import Array
from ..physics._brake import BrakeSystem
from ..physics.heated import thermal_of
from ..physics.shaft import Shaft
from ..shaft import names_of
from ..thermal.heat import PowerSplit
from .metrics import HEAT, METRICS, RESIDUALS, Account, ByName
from .programs import EndOfRun, RunJit, ends_of

#: energies of a run by name (J), `None` in a failed run for what left the range of
#: numbers
Energies: TypeAlias = Mapping[str, Any]


#: terms of both balances in words
ENERGY_WORDS = {
    "load_work": "load",
    "rope_work": "ropes",
    "lever_work": "lever",
    "motor_work": "motor",
    "kinetic_release": "kinetic energy",
    "kinetic_change": "kinetic energy gained",
    "friction_heat": "friction heat",
    "damper_heat": "dampers",
    "shaft_work": "other torques on the shaft",
    "pick_up_heat": "chain picked up and laid down",
    "electrical_work": "electrical work of friction",
    "mechanical_work": "mechanical work of friction",
    "elastic_change": "elastic energy",
    "heat_to_metal": "friction into metal",
    "heat_to_linings": "friction into linings",
    "heat_to_band": "friction into the band",
    "heat_elsewhere": "friction into no body",
    "heat_supplied": "supplied",
    "heat_stored": "stored",
    "heat_lost": "lost to surroundings",
    "heat_to_coolant": "carried away by the coolant",
}


class Balance(NamedTuple):
    """Both sides of a balance: energies (J) by name, each of them once; the sums of
    `into` and `out` are equal.

    Every text, page and explanation that shows a balance takes its terms from here.
    """

    into: dict[str, Any]
    out: dict[str, Any]

    @property
    def positive(self) -> "Balance":
        """The same with negative terms as positive ones on the other side, and without
        those that are 0."""
        terms = [
            *self.into.items(),
            *((name, -value) for name, value in self.out.items()),
        ]
        return Balance(
            *(
                {name: sign * value for name, value in terms if sign * value > 0}
                for sign in (1, -1)
            )
        )


def energy_balance(e: Energies) -> Balance:
    """Balance of the mechanical energy: works and kinetic energy given up, and what
    became of them.

    `kinetic_release` is `−kinetic_change`; energies that a run does not have are left
    out.
    """
    change = e["kinetic_change"]
    given = ("load_work", "rope_work", "lever_work")
    into = {name: e[name] for name in given if name in e}
    into |= {"motor_work": e["motor_work"]} if "motor_work" in e else {}
    into["kinetic_release"] = None if change is None else -change
    out = (
        "friction_heat",
        "damper_heat",
        "shaft_work",
        "pick_up_heat",
        "electrical_work",
        "mechanical_work",
        "elastic_change",
    )
    return Balance(into, {name: e[name] for name in out if name in e})


def heat_balance(e: Energies) -> Balance:
    """Balance of the heat: where the friction heat entered, heat of other sources, and
    where all of it went.

    The first four terms are the friction heat.
    """
    into = (
        "heat_to_metal",
        "heat_to_linings",
        "heat_to_band",
        "heat_elsewhere",
        "shaft_work",
        "heat_supplied",
    )
    out = ("heat_stored", "heat_lost", "heat_to_coolant")
    return Balance(
        *({name: e[name] for name in side if name in e} for side in (into, out))
    )


def _account(system: BrakeSystem, start: EndOfRun, end: EndOfRun) -> Account:
    shares = system.grip.shares
    thermal = thermal_of(system)
    # both ends by the same operations, so that what does not change has not changed,
    # whatever the rounding
    both = jax.tree.map(lambda *ends: jnp.stack(ends), start, end)
    (kinetic, elastic), ledger = jax.tree.map(
        lambda x: x[1] - x[0], (jax.vmap(system.stored)(*both), both[1].ledger)
    )
    work = sum(ledger.friction[1:], start=ledger.friction[0])
    stored = {}
    if thermal is not None:
        change = thermal.capacity * (end[1].heat - start[1].heat)
        stored = {
            name: jnp.sum(change[span]) for name, span in thermal.spans.stores.items()
        }
    friction = PowerSplit(work, None, None) if shares is None else shares.split(work)
    stretches = system.mechanism.banded or end[1].hook is not None
    return Account(ledger, friction, kinetic, elastic if stretches else None, stored)


def _energies(
    system: BrakeSystem, start: EndOfRun, end: EndOfRun
) -> tuple[dict[str, Array], Mapping[str, Array]]:
    a = _account(system, start, end)
    rows = {
        name: entry for name, entry in (METRICS | RESIDUALS).items() if entry.energy
    }
    heated = a.ledger.heat is not None
    values = {
        name.removeprefix("energy."): x.find(a)
        for name, x in rows.items()
        if heated or x.needs is not HEAT
    }
    if len(system.pair_names) > 1:
        hot = 1.0 if system.grip.shares is None else system.grip.shares.heat
        pairs = zip(system.pair_names, a.ledger.friction, strict=True)
        values |= {f"heat_{pair}": hot * work for pair, work in pairs}
    if (shaft := system.feature(Shaft)) is not None:
        names = names_of(shaft.laws)
        values |= {
            f"shaft_{name}": work
            for name, work in zip(names, a.ledger.shaft, strict=True)
        }
    return {
        name: value for name, value in values.items() if value is not None
    }, a.stored


_energies_of_ends = RunJit(_energies, quick=True)


def energies(record: Record) -> ByName:
    """Energies over the run in J, and the residuals of their balances over the largest
    exchanged (model §1)."""
    return ByName(_energies_of_ends(record.system, *ends_of(record))[0])


def energies_between(record: Record, first: int, last: int) -> dict[str, Array]:
    """Energies (J) of a concrete run from row to row."""

    def instant(row: int) -> EndOfRun:
        t = np.asarray(record.rows.t)[row]
        state, mode = (
            jax.tree.map(lambda column: np.asarray(column)[row], x)
            for x in (record.states, record.modes)
        )
        return t, state, mode

    return _energies_of_ends(record.system, instant(first), instant(last))[0]


def stored_heat(record: Record) -> ByName:
    """Heat stored in every body of the network since the start (J)."""
    return ByName(_energies_of_ends(record.system, *ends_of(record))[1])
