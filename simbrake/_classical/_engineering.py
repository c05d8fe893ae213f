"""Engineering estimates of a scene or of a run: the classical formulas beside the simulation."""

from .._base._faults import Fault, InputError
from .._parts._scene import Scene, band_brake, check
from .._run._result import Result
from ._classical_staged import StagedStop, classical_staged_stop
from ._classical_stop import ClassicalStop, classical_stop
from ._estimate_basis import Basis
from ._estimate_data import EstimateData, Input, settle
from ._estimate_report import EngineeringEstimates
from ._estimate_rows import balance_rows, contact_rows, depth_rows, partition_rows, power_rows, stop_rows
from ._estimate_run import run_values
from ._estimate_staged import staged_rows
from ._estimate_temperatures import stress_rows, temperature_rows

_GROUPS = (
    stop_rows,
    power_rows,
    depth_rows,
    partition_rows,
    temperature_rows,
    contact_rows,
    balance_rows,
    stress_rows,
)


def estimates(run: Scene | Result, data: EstimateData | None = None) -> EngineeringEstimates:
    """Classical estimates of a braking from its scene, and where they part from its simulation (model §6.3).

    - `run`: a `Scene`, from which a classical stop gives time and friction work (all linings slide from the first
      moment under the lever's greatest tension); or a `Result`: time and work are then those of its hardest braking,
      and every estimate stands beside the simulated number where the run has one
    - `data`: numbers that the scene does not have, or others in their place; what neither says is taken from the papers
      or assumed, and the report says so beside each

    Rows: stop and friction power with its shares (S-7…11), depth of heat, Fourier numbers and effective volumes (S-15,
    steps 1–3), partition (S-41, Charron), bulk, surface, flash and maximum temperatures (S-25…28), real contact and
    surfaces (S-34…38), heat balance over four revolutions (S-17…21), thermal stress of the rim.

    Of a staged brake: its stages and the friction work of both pairs (after K), then the rows above for each pair by
    itself, band and linings (`…, external pair`) and linings and rim (`…, internal pair`); balance and thermal stress
    are of the rim alone.

    Raises `InputError` for a scene with faults, for a scene alone that has no classical stop (at rest at the start, a
    lever that holds the speed, a load that outweighs the brake, a self-locking lining), for a run in which nothing
    slides, and a traced or batched one.
    """
    basis, stages, about = basis_of(run, data)
    in_series = basis.scene.brake.in_series
    rows = staged_rows(basis, stages) if in_series else [row for group in _GROUPS for row in group(basis)]
    return EngineeringEstimates(f"engineering estimates{about}", tuple(basis.inputs.values()), tuple(rows))


def basis_of(run: Scene | Result, data: EstimateData | None) -> tuple[Basis, StagedStop | None, str]:
    """What the estimates of a scene or of a run are made from: the basis, stages, and of which braking, in words.

    Raises `InputError` as `estimates`.
    """
    result = run if isinstance(run, Result) else None
    scene = run.scene if isinstance(run, Result) else run
    if result is not None and not result.concrete:
        raise InputError([Fault("run", "is traced or a batch", "give one result with values")])
    check(scene)
    band_brake(scene)
    inputs, staged = settle(scene, data), scene.brake.in_series
    stop = None if staged else classical_stop(scene)
    stages = classical_staged_stop(scene) if staged else None
    if result is None:
        of = stages if staged else stop
        if of is None:
            hint = "it must begin in motion and the brake outweigh its load; or simulate it and give the result"
            raise InputError([Fault("scene", "has no classical stop", hint)])
        basis = Basis(scene, inputs, stop, None, None, of.time, of.work, float(scene.initial.omega))
        about = "; time and friction work are those of a classical stop"
    else:
        basis, about = _of_run(result, inputs, stop)
    return basis, stages, about


def _of_run(result: Result, inputs: dict[str, Input], stop: ClassicalStop | None) -> tuple[Basis, str]:
    """Basis and heading for the hardest braking of a run."""
    values = run_values(result)
    if values is None:
        raise InputError([Fault("run", "has no friction work", "nothing ever slides in it")])
    work, first = float(values.work[-1]), float(abs(values.omega[0]))
    basis = Basis(result.scene, inputs, stop, result, values, values.duration, work, first)
    which = "the braking" if values.brakings == 1 else f"the hardest of {values.brakings} stretches of sliding"
    about = (
        f" beside the simulation; time and friction work are those of {which} "
        f"from {values.t[0]:.6g} s to {values.t[-1]:.6g} s"
    )
    return basis, about
