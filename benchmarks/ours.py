"""simbrake on the scenes of the benchmark: `simbrake_runner` gives the call that is
timed."""

import functools
from collections.abc import Callable
from typing import Any

from benchmarks.scenes import CASES, ROOM, Answer, Case

#: step attempts to make room for at first
_ROOM = 256


def methods(case: Case) -> dict[str, str | None]:
    stability = "explicit on a stiff scene: stability asks for millions of steps"
    hot = case.simbrake().heat is not None
    found: dict[str, str | None] = {
        f"simbrake {m}": stability if case.stiff else None for m in ("Tsit5", "Dopri8")
    }
    found["simbrake Rodas5P"] = None if hot else "for scenes with heat"
    return found


def configure() -> None:
    """What has to be set before JAX computes anything."""
    import jax

    jax.config.update("jax_cpu_enable_async_dispatch", False)


def solver_named(name: str) -> Any:
    """A method by its name."""
    import diffrax

    import simbrake as sb

    return {
        "Tsit5": diffrax.Tsit5,
        "Dopri8": diffrax.Dopri8,
        "Rodas5P": sb.hybrid.Rodas5P,
    }[name]()


@functools.cache
def _prepared(name: str, solver: str, room: int) -> Any:
    """One program for all tolerances."""
    import jax.numpy as jnp

    import simbrake as sb

    case = CASES[name]

    def times(result: Any) -> Any:
        return jnp.stack(event_times(result, case))

    return sb.prepare(
        case.simbrake(),
        [times, final_state],
        solver=solver_named(solver),
        max_steps=room,
    )


def final_state(result: Any) -> Any:
    """The state that is compared."""
    import jax.numpy as jnp

    y = result.record.y_end
    if len(y.ledger.friction) > 1:
        return jnp.stack([y.phi, *y.ledger.friction])
    if result.scene.brake.band.segments is not None:
        return jnp.concatenate([jnp.stack([y.phi, y.omega]), y.own.e, y.own.v])
    heat = jnp.zeros(0) if result.scene.heat is None else result.end_temperatures - ROOM
    elongation = [] if result.scene.brake.band.stiffness is None else [y.own.x]
    return jnp.concatenate([jnp.stack([y.phi, *elongation]), heat])


def event_times(result: Any, case: Case) -> list[Any]:
    """Times of the scene's events."""
    if case.events.count("stop") > 1:
        return _all_of(result, case)
    if result.scene.brake.band.segments is not None:
        return _first_slips(result)
    properties = {
        "slip onset": "slip_onset_time",
        "full slip": "full_slip_time",
        "stop": "stopping_time",
        "internal slip": "internal_slip_time",
        "external lock": "external_lock_time",
    }
    return [getattr(result, properties[event]) for event in case.events]


def _all_of(result: Any, case: Case) -> list[Any]:
    """Times of all stops and restarts, in turn: where the pulley came to rest, and
    where it left it."""
    import jax.numpy as jnp

    from simbrake.physics.mechanism import BandMode

    record = result.record
    rest = record.modes.band == BandMode.HELD
    used = jnp.arange(1, rest.shape[0], dtype=jnp.int32) <= record.count
    # the mode in which it stands at the start is found at the start, and is no event
    changed = used & (rest[1:] != rest[:-1]) & (record.rows.t[1:] > record.rows.t[0])
    # rows are in the order of time (a sort would be a call of a library, and break the
    # program up)
    count = jnp.cumsum(changed, dtype=jnp.int32)
    wanted = jnp.arange(1, len(case.events) + 1, dtype=jnp.int32)
    row = jnp.searchsorted(count, wanted)
    return list(
        jnp.where(
            wanted <= count[-1],
            record.rows.t[1:][jnp.minimum(row, count.size - 1)],
            jnp.nan,
        )
    )


def _first_slips(result: Any) -> list[Any]:
    """When each lining of a chain first slid, from the tight end on."""
    import jax.numpy as jnp

    record = result.record
    used = (
        jnp.arange(record.modes.own.linings.shape[0], dtype=jnp.int32) <= record.count
    )
    slides = used[:, None] & (record.modes.own.linings != 0)
    return list(
        jnp.min(jnp.where(slides, record.rows.t[:, None], jnp.inf), axis=0)[::-1]
    )


def simbrake_runner(case: Case, method: str, tolerance: float) -> Callable[[], Answer]:
    """The call that is timed: one warm run, its answer on the host."""
    import simbrake as sb

    solver = method.removeprefix("simbrake ")
    # of one step attempt; Rodas5P: eight stages and the columns of its Jacobian,
    # counted as one each
    stages = {"Tsit5": 6, "Dopri8": 13, "Rodas5P": 8}[solver]
    run = _prepared(case.name, solver, _ROOM)
    run(rtol=tolerance)  # makes room for all the steps it needs

    def call() -> Answer:
        answer = run(rtol=tolerance)
        if answer.code:
            raise RuntimeError(
                f"{method} ends with {sb.results.FAILURES[answer.code][0]}"
            )
        evaluations = (
            stages * (answer.accepted + answer.rejected + answer.retaken)
            + answer.segments
        )
        return Answer(
            answer.metrics["times"],
            answer.metrics["final_state"],
            evaluations,
            answer.accepted,
        )

    return call
