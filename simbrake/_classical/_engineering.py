"""Engineering estimates of a scene or of a run: the classical formulas beside the simulation."""

from .._base._quantity import Fault, InputError
from .._parts._scene import Scene, check
from .._run._result import Result
from ._classical_stop import classical_stop
from ._estimate_basis import Basis
from ._estimate_data import EstimateData, settle
from ._estimate_report import EngineeringEstimates
from ._estimate_rows import balance_rows, contact_rows, depth_rows, partition_rows, power_rows, stop_rows
from ._estimate_run import run_values
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

    Raises `InputError` for a scene with faults, for a scene alone that has no classical stop (at rest at the start, a
    lever that holds the speed, a load that outweighs the brake, a self-locking lining), for a run in which nothing
    slides, a traced or batched one, and for a staged brake, whose two pairs share the friction.
    """
    basis, about = basis_of(run, data)
    rows = tuple(row for group in _GROUPS for row in group(basis))
    return EngineeringEstimates(f"engineering estimates{about}", tuple(basis.inputs.values()), rows)


def basis_of(run: Scene | Result, data: EstimateData | None) -> tuple[Basis, str]:
    """What the estimates of a scene or of a run are made from, and of which braking they are, in words.

    Raises `InputError` as `estimates`.
    """
    result = run if isinstance(run, Result) else None
    scene = run.scene if isinstance(run, Result) else run
    if result is not None and not result.concrete:
        raise InputError([Fault("run", "is traced or a batch", "give one result with values")])
    check(scene)
    if scene.brake.bandage is not None:
        raise InputError([Fault("brake.bandage", "is not for these estimates", "they are of a brake with one pair")])
    inputs, stop = settle(scene, data), classical_stop(scene)
    if result is None:
        if stop is None:
            hint = "it must begin in motion and the brake outweigh its load; or simulate it and give the result"
            raise InputError([Fault("scene", "has no classical stop", hint)])
        basis = Basis(scene, inputs, stop, None, None, stop.time, stop.work, float(scene.initial.omega))
        about = "; time and friction work are those of a classical stop"
    else:
        values = run_values(result)
        if values is None:
            raise InputError([Fault("run", "has no friction work", "nothing ever slides in it")])
        work, first = float(values.work[-1]), float(abs(values.omega[0]))
        basis = Basis(scene, inputs, stop, result, values, values.duration, work, first)
        which = "the braking" if values.brakings == 1 else f"the hardest of {values.brakings} stretches of sliding"
        about = (
            f" beside the simulation; time and friction work are those of {which} "
            f"from {values.t[0]:.6g} s to {values.t[-1]:.6g} s"
        )
    return basis, about
