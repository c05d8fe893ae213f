"""What a run gives back: states at any time, event log, metrics, energies and a result code."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ._choice import stiffness
from ._heat import node_names
from ._hybrid import FINISHED, Record
from ._log import Event, Phase, event_log, marks_passed
from ._metrics import METRICS, Peak, energies, numbers, peak, peaks_of, stored_heat
from ._modes import BandMode
from ._observe import mark_names
from ._outcome import FAILURES, STATUS_MESSAGES, status_of
from ._probe import SAMPLES, Probe, probe_at, probe_many
from ._scene import Scene, warnings
from ._summary import text


class Series(NamedTuple):
    """States and forces at the times `t` (m,), SI units; arrays over linings are (m, n)."""

    t: Float[Array, " m"]
    phi: Float[Array, " m"]  # angle, rad
    omega: Float[Array, " m"]  # speed, rad/s
    elongation: Float[Array, " m"] | None  # x, m; None for a rigid band
    slack_tension: Float[Array, " m"]  # T_0, N
    tight_tension: Float[Array, " m"]  # T_n, N
    load_torque: Float[Array, " m"]  # N·m
    brake_torque: Float[Array, " m"]  # N·m
    slip_speed: Float[Array, " m"]  # m/s
    at_limit: Int[Array, " m"]  # k, number of linings at their limit
    band_mode: Int[Array, " m"]  # BandMode
    load_work: Float[Array, " m"]  # J
    lever_work: Float[Array, " m"]  # J
    friction_heat: Float[Array, " m"]  # J
    tension: Float[Array, "m n"]  # behind each lining, N
    normal_load: Float[Array, "m n"]  # N
    friction_force: Float[Array, "m n"]  # N
    temperature: Float[Array, "m k"] | None = None  # of every thermal node (`Result.nodes`), K; None without heat
    rim_temperature: Float[Array, "m r"] | None = None  # surface of the rim, K; None where the scene names none
    lining_temperature: Float[Array, "m l"] | None = None  # surfaces of the linings, K
    band_temperature: Float[Array, "m b"] | None = None  # K
    heat_lost: Float[Array, " m"] | None = None  # J
    friction_coefficient: Float[Array, "m n"] | None = None  # of every lining, sliding; None without heat


#: units of the columns of a Series, "" where there is none
SERIES_UNITS = {
    "t": "s",
    "phi": "rad",
    "omega": "rad/s",
    "elongation": "m",
    "slack_tension": "N",
    "tight_tension": "N",
    "load_torque": "N*m",
    "brake_torque": "N*m",
    "slip_speed": "m/s",
    "at_limit": "",
    "band_mode": "",
    "load_work": "J",
    "lever_work": "J",
    "friction_heat": "J",
    "tension": "N",
    "normal_load": "N",
    "friction_force": "N",
    "temperature": "K",
    "rim_temperature": "K",
    "lining_temperature": "K",
    "band_temperature": "K",
    "heat_lost": "J",
    "friction_coefficient": "",
}


class Result(eqx.Module):
    """The outcome of `simulate`: a PyTree, through which jit, vmap and grad pass.

    Times of events that did not happen are `inf` here and `null` in the summary. First derivatives of everything
    continuous are available, forward and reverse.
    """

    scene: Scene
    record: Record
    rtol: Any
    method_name: str = eqx.field(static=True)

    # --- metrics that pass through jit, vmap and grad -----------------------------------------------------------

    @property
    def code(self) -> Int[Array, "..."]:
        """0 if the run reached its end time, else a failure code (`simbrake.FAILURES`)."""
        return self.record.code

    @property
    def slip_onset_time(self) -> Array:
        """First onset of slip t0 (s): the band is taut, `C x = T_0`."""
        return _metric(self, "slip_onset_time")

    @property
    def full_slip_time(self) -> Array:
        """First time at which every lining slides, t1 (s)."""
        return _metric(self, "full_slip_time")

    @property
    def stopping_time(self) -> Array:
        """First time at which the brake brings the pulley to rest (s)."""
        return _metric(self, "stopping_time")

    @property
    def stopping_angle(self) -> Array:
        """Angle from the start to the first stop (rad)."""
        return _metric(self, "stopping_angle")

    @property
    def hook_travel(self) -> Array:
        """Travel of the hook from the start to the first stop (m), `inf` without a hook."""
        return _metric(self, "hook_travel")

    @property
    def max_tension(self) -> Peak:
        """Greatest tension of the band at either side of any lining (N), with its time and lining."""
        return _metric(self, "max_tension")

    @property
    def max_normal_load(self) -> Peak:
        """Greatest normal load on any lining (N), with its time and lining."""
        return _metric(self, "max_normal_load")

    @property
    def peak_rim_temperature(self) -> Peak:
        """Greatest surface temperature of the rim (K), with its time."""
        return _metric(self, "peak_rim_temperature")

    @property
    def peak_lining_temperature(self) -> Peak:
        """Greatest surface temperature of any lining (K), with its time and lining."""
        return _metric(self, "peak_lining_temperature")

    @property
    def peak_band_temperature(self) -> Peak:
        """Greatest temperature of the band (K), with its time."""
        return _metric(self, "peak_band_temperature")

    @property
    def nodes(self) -> list[str]:
        """Names of the thermal nodes, in the order of `Series.temperature`."""
        return [] if self.scene.heat is None else node_names(self.scene.heat)

    @property
    def end_temperatures(self) -> Array:
        """Temperatures (K) at the end of the nodes with capacity."""
        system: Any = self.record.system
        if system.forces.thermal is None:
            raise ValueError("the scene has no heat")
        return system.forces.thermal.temperatures(self.record.y_end.heat)

    @property
    def stored_heat(self) -> dict[str, Array]:
        """Heat stored in every body since the start (J)."""
        return stored_heat(self.record)

    @property
    def energy(self) -> dict[str, Array]:
        """Energies over the run in J, and the closure of their balance as a share of the largest exchanged.

        `kinetic_change + elastic_change = load_work + lever_work − friction_heat` (model §1)
        """
        return _metric(self, "energy")

    def series(self, ts: Any, *, left: bool = False) -> Series:
        """States and forces at the times `ts` (m,), each as accurate as the integration itself.

        At an event the values after it, or with `left` those before. Times outside the run take its ends.
        """
        if _concrete(self):
            xp, record, look = np, self.record.compact(), probe_many
        else:
            xp, record, look = jnp, self.record, probe_at
        ts = xp.atleast_1d(xp.asarray(ts, np.float64))
        index = record.find(ts, left=left)
        t = record.rows.t
        p = look(record, index, xp.clip(ts, t[0], t[record.count]) - t[index])
        return Series(
            t=p.t,
            phi=p.y.phi,
            omega=p.y.omega,
            elongation=p.y.x,
            slack_tension=p.flows.slack_tension,
            tight_tension=p.flows.tight_tension,
            load_torque=p.flows.load_torque,
            brake_torque=p.flows.brake_torque,
            slip_speed=p.flows.slip_speed,
            at_limit=p.linings.at_limit.sum(axis=1),
            band_mode=p.mode.band,  # pyright: ignore
            load_work=p.y.ledger.load_work,
            lever_work=p.y.ledger.lever_work,
            friction_heat=p.y.ledger.friction_heat,
            tension=p.linings.tension,
            normal_load=p.linings.normal,
            friction_force=p.linings.friction,
            **self._thermal_columns(p),
        )

    def _thermal_columns(self, p: Probe) -> dict[str, Any]:
        now = p.flows.thermal
        if now is None:
            return {}
        xp = np if _concrete(self) else jnp
        return {
            "temperature": xp.concatenate([now.T, now.T_junctions], axis=1),
            "rim_temperature": p.surfaces.get("rim"),
            "lining_temperature": p.surfaces.get("linings"),
            "band_temperature": p.surfaces.get("band"),
            "heat_lost": p.y.ledger.heat.lost,
            "friction_coefficient": p.coefficient,
        }

    # --- for people: concrete results only ---------------------------------------------------------------------

    @property
    def ok(self) -> bool:
        """Whether the run reached its end time."""
        return int(self.code) == 0

    @property
    def status(self) -> str:
        """`stopped`, `held`, `not_stopped`, `released`, or the name of a failure code."""
        if not self.ok:
            return FAILURES[int(self.code)][0]  # pyright: ignore
        moved = bool(np.any(np.asarray(self.record.rows.y)[: int(self.record.count) + 1, 1] != 0.0))
        return str(status_of(self._band_at_end(), moved))

    @property
    def message(self) -> str:
        """The status in words, with what to do next where it failed."""
        if self.ok:
            return STATUS_MESSAGES[self.status]  # pyright: ignore
        _, what, hint = FAILURES[int(self.code)]  # pyright: ignore
        n = int(self.record.count)
        end, bands = np.asarray(self.record.rows.t)[n], np.asarray(self.record.rows.mode)[: n + 1, 0]
        changes = bands[np.append(True, np.diff(bands) != 0)][-4:]
        words = " → ".join(BandMode(int(band)).name.lower().replace("_", " ") for band in changes)
        return f"{what} (at t = {end:.9g} s; last band modes {words}): {hint}"

    def _band_at_end(self) -> int:
        return int(np.asarray(self.record.rows.mode)[int(self.record.count), 0])

    def _scan(self) -> tuple[Record, np.ndarray, np.ndarray, Probe]:
        """All steps of the run sampled: record without unused rows, row and offset of each sample, and the probe."""
        record = self.record.compact()
        n, t = int(record.count), np.asarray(record.rows.t)
        samples = _samples(n)
        index = np.repeat(np.arange(n), samples)
        share = np.tile(np.linspace(0.0, 1.0, samples), n)
        h = share * (t[index + 1] - t[index])
        if n == 0:
            index, h = np.zeros(1, int), np.zeros(1)
        return record, index, h, probe_many(record, index, h)

    def report(self) -> "Report":
        """Event log, metrics and summary of a concrete result; the last one made is kept, as it scans the whole run."""
        global _last_report
        if _last_report is None or _last_report.result.record.rows.t is not self.record.rows.t:
            _last_report = Report(self)
        return _last_report

    @property
    def events(self) -> list[Event]:
        """The event log: mode changes and lining limits in order of time."""
        return self.report().events

    @property
    def metrics(self) -> dict[str, float | None]:
        """Main numbers of the run in SI units, `None` where something did not happen."""
        return self.report().metrics

    def summary(self) -> dict[str, Any]:
        """Everything that `simbrake run --json` prints."""
        return self.report().summary()

    def __str__(self) -> str:
        if not _concrete(self):
            return "Result(traced)"
        return text(self.summary())

    def __repr__(self) -> str:
        return str(self)


def _metric(result: Result, name: str) -> Any:
    """A metric of a traced result, a batch of results or a concrete one (then from one small compiled program)."""
    if jnp.ndim(result.record.count) > 0:
        return jax.vmap(lambda one: _metric(one, name))(result)
    travel = result.scene.duty.load.travel()
    if name.startswith(("max_", "peak_")):
        known = peaks_of(result.record.system)
        if name not in known:
            raise ValueError(f"the scene has no {name}: its heat part names no such place")
        return result.report().peaks[name] if _concrete(result) else peak(result.record, known[name])
    if _concrete(result):
        values, energy = numbers(result.record, travel)
        return energy if name == "energy" else values[name]
    return energies(result.record) if name == "energy" else METRICS[name](result.record, travel)


def _samples(steps: int) -> int:
    """Looks per step when a whole run is scanned; a long run has many steps in every part of it."""
    return SAMPLES if steps <= 1500 else 3


def _concrete(result: Result) -> bool:
    arrays = jax.tree.leaves(result)
    return not any(isinstance(leaf, Tracer) for leaf in arrays) and jnp.ndim(result.record.count) == 0


_last_report: "Report | None" = None


class Report:
    """What a person reads of one concrete result; the run is scanned once for all of it."""

    def __init__(self, result: Result):
        self.result = result
        self._record, self._index, self._offset, self._probe = result._scan()
        self._numbers = numbers(result.record, result.scene.duty.load.travel())
        self.events = self._events()
        known = peaks_of(result.record.system)
        self.peaks = {name: self._peak(lambda p, pick=pick: np.asarray(pick(p))) for name, pick in known.items()}

    def _events(self) -> list[Event]:
        record = self._record
        n = int(record.count)
        kind, t = np.asarray(record.rows.kind)[:n], np.asarray(record.rows.t)[: n + 1]
        band = np.asarray(record.rows.mode)[: n + 1, 0]
        phases: list[Phase] = []
        start, samples = 0, _samples(n)
        for i in range(n):
            if kind[i] >= FINISHED or i == n - 1:
                phases.append(Phase(int(band[i]), start * samples, (i + 1) * samples - 1, t[start], t[i + 1]))
                start = i + 1
        if n and band[n] != band[n - 1]:  # an event at the very end
            phases.append(Phase(int(band[n]), n * samples - 1, n * samples - 1, t[n], t[n]))
        if phases and phases[0].band == BandMode.OPEN and phases[0].end == phases[0].start:
            phases = phases[1:]  # the settling of the first mode
        margins = np.asarray(self._probe.margins)
        events = event_log(phases, margins, self._locate, margins.shape[1] // 2)
        return sorted([*events, *self._marks()], key=lambda event: event.time)

    def _marks(self) -> list[Event]:
        """Events of marks that heat passes, and of linings that come to lock themselves."""
        system: Any = self._record.system
        found: list[Event] = []
        crossings = marks_passed(np.asarray(self._probe.passing), self._index)
        if crossings:
            times, names = self._locate(crossings, "passing"), mark_names(system)
            found += [Event(float(t), *names[j]) for t, (_, j) in zip(times, crossings, strict=True)]
        if system.forces.grip.varies:  # the fifth entry of a mode says whether a lining locks itself
            locks = np.asarray(self._record.rows.mode)[: int(self._record.count) + 1, 4]
            began = np.flatnonzero(np.diff(locks) > 0) + 1
            found += [Event(float(np.asarray(self._record.rows.t)[i]), "self_locking") for i in began]
        return found

    def _locate(self, crossings: list[tuple[int, int]], which: str = "margins") -> np.ndarray:
        """Times at which margins rise through zero: bisection and secants on partial steps of the method."""
        sample = np.asarray([i for i, _ in crossings])
        mark = np.asarray([j for _, j in crossings])
        row = self._index[sample]
        low, high = self._offset[sample].copy(), self._offset[sample + 1].copy()
        margins = np.asarray(getattr(self._probe, which))
        f_low, f_high = margins[sample, mark].copy(), margins[sample + 1, mark].copy()
        side = np.zeros(len(row), int)
        for _ in range(60):  # Illinois
            span = np.where(f_high > f_low, f_high - f_low, 1.0)
            h = np.where(f_high > f_low, low - f_low * (high - low) / span, 0.5 * (low + high))
            f = np.asarray(getattr(probe_many(self._record, row, h), which))[np.arange(len(row)), mark]
            above = f > 0
            f_low = np.where(above & (side == 1), 0.5 * f_low, f_low)
            f_high = np.where(~above & (side == -1), 0.5 * f_high, f_high)
            side = np.where(above, 1, -1)
            done = np.abs(f) <= 1e-15
            high, f_high = np.where(above | done, h, high), np.where(above, f, f_high)
            low, f_low = np.where(~above | done, h, low), np.where(~above, f, f_low)
            if np.all(high - low <= 1e-15 * np.maximum(np.abs(high), 1e-300)) or np.all(done):
                break
        return np.asarray(self._record.rows.t)[row] + high

    def _peak(self, pick: Any) -> Peak:
        values = pick(self._probe)
        best = int(np.argmax(values.max(axis=1)))
        low = max(best - 1, 0) if self._index[max(best - 1, 0)] == self._index[best] else best
        top = min(best + 1, len(values) - 1)
        high = top if self._index[top] == self._index[best] else best
        h = np.linspace(self._offset[low], self._offset[high], 4 * SAMPLES + 1)
        probe = probe_many(self._record, np.full(h.shape, self._index[best]), h)
        values = pick(probe)
        i = int(np.argmax(values.max(axis=1)))
        j = int(np.argmax(values[i]))
        return Peak(values[i, j], np.asarray(probe.t)[i], np.asarray(j + 1))

    def _per_lining(self, name: str) -> bool:
        if name.startswith("max_"):
            return True
        return name == "peak_lining_temperature" and np.shape(self._probe.surfaces["linings"])[1] > 1

    @property
    def metrics(self) -> dict[str, float | None]:
        energy = self._numbers[1]
        values = {**self._numbers[0], **{name: peak.value for name, peak in self.peaks.items()}}
        hot = {f"{name}_time": p.time for name, p in self.peaks.items() if name.startswith("peak_")}
        given = ("heat_to_metal", "heat_to_linings", "heat_to_band", "heat_lost")
        values = {**values, **hot, **{name: energy[name] for name in given if name in energy}}
        return {name: float(v) if np.isfinite(v) else None for name, v in values.items()}

    def summary(self) -> dict[str, Any]:
        r, stats = self.result, self.result.record.stats
        return {
            "status": r.status,
            "message": r.message,
            "warnings": warnings(r.scene),
            "events": [event.as_dict() for event in self.events],
            "metrics": self.metrics,
            "at": {
                **{f"{name}_time": float(peak.time) for name, peak in self.peaks.items()},
                **{f"{name}_lining": int(p.lining) for name, p in self.peaks.items() if self._per_lining(name)},
            },
            "energy": {name: float(value) for name, value in self._numbers[1].items()},
            "solver": {
                "method": r.method_name,
                "reason": stiffness(r.scene)[1],
                "rtol": float(r.rtol),
                "steps": int(stats.accepted),
                "rejected": int(stats.rejected),
                "retaken": int(stats.retaken),
                "events": int(stats.events),
                "segments": int(stats.segments),
            },
        }
