"""What a run gives back: states at any time, event log, metrics, energies and a result code."""

import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ._band import LiningForces
from ._compiling import cpu_compiler_options
from ._hybrid import FINISHED, LANDED, SKIPPED, Record
from ._log import Event, Phase, event_log
from ._modes import BandMode, Mode, slips
from ._outcome import FAILURES, STATUS_MESSAGES, status_of
from ._scene import Scene, warnings
from ._summary import text
from ._system import BrakeSystem, Flows, State

_SAMPLES = 9  # per step, when a whole run is scanned
_LANES = 512  # times looked at in one call of the compiled probe


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
}


class _Probe(NamedTuple):
    t: Array
    y: State
    mode: Mode
    flows: Flows
    linings: LiningForces
    margins: Array


def _probe(record: Record, index: Array, share: Array) -> _Probe:
    """Everything at a share (0…1) of the steps named, by a partial step of the method itself.

    The share is of the time up to the next row, so that ends of steps move with their events under differentiation.
    """
    t = record.rows.t
    h = share * (t[jnp.minimum(index + 1, record.count)] - t[index])
    return _probe_at(record, index, h)


def _probe_at(record: Record, index: Array, h: Array) -> _Probe:
    system: BrakeSystem = record.system  # pyright: ignore
    t, y = record.inside(index, h)
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[index])
    flows = jax.vmap(system.flows)(t, y, mode)
    forces = jax.vmap(system.lining_forces)(t, y, mode)
    margins = jax.vmap(system.lining_margins)(t, y, mode)
    return _Probe(t, y, mode, flows, forces, margins)


@functools.cache
def _probe_compiled() -> Any:
    return jax.jit(_probe_at, compiler_options=cpu_compiler_options())


@jax.jit
def _numbers(result: "Result") -> tuple[dict[str, Array], dict[str, Array]]:
    """Scalar metrics and energies in one program."""
    travel = result.hook_travel
    metrics = {
        "slip_onset_time": result.slip_onset_time,
        "full_slip_time": result.full_slip_time,
        "stopping_time": result.stopping_time,
        "stopping_angle": result.stopping_angle,
        "hook_travel": jnp.asarray(jnp.inf) if travel is None else travel,
    }
    return metrics, result.energy


def _probe_many(record: Record, index: np.ndarray, h: np.ndarray) -> _Probe:
    """The probe outside of jit, in calls of one size so that it compiles once."""
    parts = []
    for start in range(0, len(index), _LANES):
        i, s = index[start : start + _LANES], h[start : start + _LANES]
        pad = _LANES - len(i)
        out = _probe_compiled()(record, np.pad(i, (0, pad), mode="edge").astype(np.int32), np.pad(s, (0, pad), mode="edge"))
        parts.append(jax.tree.map(lambda leaf, n=len(i): np.asarray(leaf)[:n], out))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


class Peak(NamedTuple):
    """A greatest value over a run, when it occurs (s) and at which lining (from 1)."""

    value: Array
    time: Array
    lining: Array


class Result(eqx.Module):
    """The outcome of `simulate`: a PyTree, through which jit, vmap and grad pass.

    Times of events that did not happen are `inf` here and `null` in the summary. First derivatives of everything
    continuous are available, forward and reverse.
    """

    scene: Scene
    record: Record
    rtol: Array
    method_name: str = eqx.field(static=True)

    # --- events and metrics that pass through jit, vmap and grad ------------------------------------------------

    @property
    def code(self) -> Int[Array, ""]:
        """0 if the run reached its end time, else a failure code (`simbrake.FAILURES`)."""
        return self.record.code

    def _changes(self) -> tuple[Array, Array, Array]:
        """For every row: whether an event ended it, and the band mode before and after."""
        rows, n = self.record.rows, self.record.rows.t.shape[0]
        band = rows.mode[:, 0]
        after = jnp.append(band[1:], band[-1])
        used = jnp.arange(n, dtype=jnp.int32) < self.record.count
        return used & (rows.kind >= LANDED), band, after

    def _first_time(self, mask: Bool[Array, " row"]) -> Float[Array, ""]:
        i = jnp.argmax(mask)
        times = self.record.rows.t
        return jnp.where(jnp.any(mask), times[jnp.minimum(i + 1, times.shape[0] - 1)], jnp.inf)

    def _engaged(self) -> Bool[Array, " row"]:
        event, before, after = self._changes()
        slack = (before == BandMode.OPEN) | (before == BandMode.TAKE_UP)
        return event & slack & ((after == BandMode.ELASTIC) | slips(after))

    @property
    def slip_onset_time(self) -> Float[Array, ""]:
        """First onset of slip t0 (s): the band is taut, `C x = T_0`."""
        return self._first_time(self._engaged())

    @property
    def full_slip_time(self) -> Float[Array, ""]:
        """First time at which every lining slides, t1 (s)."""
        event, before, after = self._changes()
        return self._first_time(event & slips(after) & (before != after))

    def _stop(self) -> Bool[Array, " row"]:
        event, before, after = self._changes()
        return event & (after == BandMode.HELD) & (before != BandMode.HELD) & (before != BandMode.OPEN)

    @property
    def stopping_time(self) -> Float[Array, ""]:
        """First time at which the brake brings the pulley to rest (s)."""
        return self._first_time(self._stop())

    @property
    def stopping_angle(self) -> Float[Array, ""]:
        """Angle from the start to the first stop (rad)."""
        mask = self._stop()
        i = jnp.minimum(jnp.argmax(mask) + 1, mask.shape[0] - 1)
        phi = jax.vmap(self.record.flat.unpack_state)(self.record.rows.y).phi
        return jnp.where(jnp.any(mask), phi[i], jnp.inf)

    @property
    def hook_travel(self) -> Float[Array, ""] | None:
        """Travel of the hook from the start to the first stop (m), `None` without a hook."""
        travel = self.scene.duty.load.travel()
        return None if travel is None else self.stopping_angle * jnp.asarray(travel)

    def _peak(self, pick: Any) -> Peak:
        """Greatest of `pick(probe)` (m, n) over the run, refined once inside the step that holds it."""
        record = self.record
        n = record.rows.t.shape[0]
        index = jnp.repeat(jnp.arange(n, dtype=jnp.int32), _SAMPLES)
        share = jnp.tile(jnp.linspace(0.0, 1.0, _SAMPLES), n)
        used = jnp.repeat((jnp.arange(n, dtype=jnp.int32) < record.count) & (record.rows.kind != SKIPPED), _SAMPLES)

        def look(index, share, used):
            p = _probe(record, index, share)
            values = jnp.where(used[:, None], pick(p), -jnp.inf)
            best = jnp.argmax(jnp.max(values, axis=1))
            return best, jnp.argmax(values[best]), values, p.t

        best, _, _, _ = jax.lax.stop_gradient(look(index, share, used))
        row, middle = index[best], share[best]
        width = 1.0 / (_SAMPLES - 1)
        fine = jnp.linspace(jnp.maximum(middle - width, 0.0), jnp.minimum(middle + width, 1.0), 4 * _SAMPLES + 1)
        best, lining, values, t = look(jnp.full(fine.shape, row), fine, jnp.ones(fine.shape, bool))
        return Peak(values[best, lining], t[best], lining + 1)

    @property
    def max_tension(self) -> Peak:
        """Greatest tension of the band behind any lining, or before the first (N)."""
        return self._peak(lambda p: jnp.maximum(p.linings.tension, _only_first(p.flows.slack_tension, p.linings)))

    @property
    def max_normal_load(self) -> Peak:
        """Greatest normal load on any lining (N)."""
        return self._peak(lambda p: p.linings.normal)

    @property
    def energy(self) -> dict[str, Array]:
        """Energies over the run in J, and the closure of their balance as a share of the largest exchanged.

        `kinetic_change + elastic_change = load_work + lever_work − friction_heat` (model §1)
        """
        record = self.record
        system: BrakeSystem = record.system  # pyright: ignore
        start = record.flat.unpack_state(record.rows.y[0])
        end, ledger = record.y_end, record.y_end.ledger
        kinetic = 0.5 * system.inertia * (end.omega**2 - start.omega**2)
        elastic = jnp.zeros_like(kinetic)
        if system.stiffness is not None:
            elastic = 0.5 * system.stiffness * (end.x**2 - start.x**2)
        residual = kinetic + elastic - (ledger.load_work + ledger.lever_work - ledger.friction_heat)
        terms = [kinetic, elastic, ledger.load_work, ledger.lever_work, ledger.friction_heat]
        largest = jnp.max(jnp.abs(jnp.stack(terms)))
        closure = jnp.where(largest > 0, jnp.abs(residual) / jnp.where(largest > 0, largest, 1.0), 0.0)
        return {
            "load_work": ledger.load_work,
            "lever_work": ledger.lever_work,
            "friction_heat": ledger.friction_heat,
            "kinetic_change": kinetic,
            "elastic_change": elastic,
            "closure": closure,
        }

    def series(self, ts: Any, *, left: bool = False) -> Series:
        """States and forces at the times `ts` (m,), each as accurate as the integration itself.

        At an event the values after it, or with `left` those before. Times outside the run take its ends.
        """
        record = self.record
        ts = jnp.atleast_1d(jnp.asarray(ts, jnp.float64))
        index = record.find(ts, left=left)
        h = jnp.clip(ts, record.rows.t[0], record.t_end) - record.rows.t[index]
        if _concrete(self):
            p = _probe_many(record, np.asarray(index), np.asarray(h))
        else:
            p = _probe_at(record, index, h)
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
            at_limit=jnp.sum(p.linings.at_limit, axis=1),
            band_mode=p.mode.band,  # pyright: ignore
            load_work=p.y.ledger.load_work,
            lever_work=p.y.ledger.lever_work,
            friction_heat=p.y.ledger.friction_heat,
            tension=p.linings.tension,
            normal_load=p.linings.normal,
            friction_force=p.linings.friction,
        )

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
        band = BandMode(self._band_at_end()).name.lower()
        end = np.asarray(self.record.rows.t)[int(self.record.count)]
        return f"{what} (at t = {end:.9g} s, band {band.replace('_', ' ')}): {hint}"

    def _band_at_end(self) -> int:
        return int(np.asarray(self.record.rows.mode)[int(self.record.count), 0])

    def _scan(self) -> tuple[Record, np.ndarray, np.ndarray, _Probe]:
        """All steps of the run sampled: record without unused rows, row and offset of each sample, and the probe."""
        record = self.record.compact()
        n, t = int(record.count), np.asarray(record.rows.t)
        index = np.repeat(np.arange(n), _SAMPLES)
        share = np.tile(np.linspace(0.0, 1.0, _SAMPLES), n)
        h = share * (t[index + 1] - t[index])
        if n == 0:
            index, h = np.zeros(1, int), np.zeros(1)
        return record, index, h, _probe_many(record, index, h)

    def report(self) -> "Report":
        """Event log, metrics and summary of a concrete result, computed once."""
        return Report(self)

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


def _only_first(value: Array, forces: LiningForces) -> Array:
    """`value` (m,) at the first lining, 0 at the others: tension before the first lining counts with it."""
    first = jnp.arange(forces.tension.shape[-1], dtype=jnp.int32) == 0
    return jnp.where(first, jnp.asarray(value)[..., None], 0.0)


def _concrete(result: Result) -> bool:
    arrays = jax.tree.leaves(result)
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in arrays) and jnp.ndim(result.record.count) == 0


class Report:
    """What a person reads of one concrete result; the run is scanned once for all of it."""

    def __init__(self, result: Result):
        self._result = result
        self._record, self._index, self._offset, self._probe = result._scan()
        self._numbers = _numbers(result)
        self.events = self._events()
        self._peaks = {
            "max_tension": self._peak(_tension_with_slack_end),
            "max_normal_load": self._peak(lambda p: np.asarray(p.linings.normal)),
        }

    def _events(self) -> list[Event]:
        record = self._record
        n = int(record.count)
        kind, t = np.asarray(record.rows.kind)[:n], np.asarray(record.rows.t)[: n + 1]
        band = np.asarray(record.rows.mode)[: n + 1, 0]
        phases: list[Phase] = []
        start = 0
        for i in range(n):
            if kind[i] >= FINISHED or i == n - 1:
                phases.append(Phase(int(band[i]), start * _SAMPLES, (i + 1) * _SAMPLES - 1, t[start], t[i + 1]))
                start = i + 1
        if n and band[n] != band[n - 1]:  # an event at the very end
            phases.append(Phase(int(band[n]), n * _SAMPLES - 1, n * _SAMPLES - 1, t[n], t[n]))
        if phases and phases[0].band == BandMode.OPEN and phases[0].end == phases[0].start:
            phases = phases[1:]  # the settling of the first mode
        margins = np.asarray(self._probe.margins)
        return event_log(phases, margins, self._locate, margins.shape[1] // 2)

    def _locate(self, crossings: list[tuple[int, int]]) -> np.ndarray:
        """Times at which margins rise through zero: bisection and secants on partial steps of the method."""
        sample = np.asarray([i for i, _ in crossings])
        mark = np.asarray([j for _, j in crossings])
        row = self._index[sample]
        low, high = self._offset[sample].copy(), self._offset[sample + 1].copy()
        margins = np.asarray(self._probe.margins)
        f_low, f_high = margins[sample, mark].copy(), margins[sample + 1, mark].copy()
        side = np.zeros(len(row), int)
        for _ in range(60):  # Illinois
            span = np.where(f_high > f_low, f_high - f_low, 1.0)
            h = np.where(f_high > f_low, low - f_low * (high - low) / span, 0.5 * (low + high))
            f = np.asarray(_probe_many(self._record, row, h).margins)[np.arange(len(row)), mark]
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
        h = np.linspace(self._offset[low], self._offset[high], 4 * _SAMPLES + 1)
        probe = _probe_many(self._record, np.full(h.shape, self._index[best]), h)
        values = pick(probe)
        i = int(np.argmax(values.max(axis=1)))
        j = int(np.argmax(values[i]))
        return Peak(values[i, j], np.asarray(probe.t)[i], np.asarray(j + 1))

    @property
    def metrics(self) -> dict[str, float | None]:
        values = {**self._numbers[0], **{name: peak.value for name, peak in self._peaks.items()}}
        return {name: float(v) if np.isfinite(v) else None for name, v in values.items()}

    def summary(self) -> dict[str, Any]:
        r, stats = self._result, self._result.record.stats
        return {
            "status": r.status,
            "message": r.message,
            "warnings": warnings(r.scene),
            "events": [event.as_dict() for event in self.events],
            "metrics": self.metrics,
            "at": {
                **{f"{name}_time": float(peak.time) for name, peak in self._peaks.items()},
                **{f"{name}_lining": int(peak.lining) for name, peak in self._peaks.items()},
            },
            "energy": {name: float(value) for name, value in self._numbers[1].items()},
            "solver": {
                "method": r.method_name,
                "rtol": float(r.rtol),
                "steps": int(stats.accepted),
                "rejected": int(stats.rejected),
                "retaken": int(stats.retaken),
                "events": int(stats.events),
                "segments": int(stats.segments),
            },
        }


def _tension_with_slack_end(p: _Probe) -> np.ndarray:
    tension = np.array(p.linings.tension)
    tension[:, 0] = np.maximum(tension[:, 0], np.asarray(p.flows.slack_tension))
    return tension
