"""The parametric synthesis: S's twelve steps over a scene or a run, as one chain."""

from .._base._faults import Fault, InputError
from .._parts._scene import Scene, band_brake, faults
from .._run._result import Result
from ..thermal._heat import AbstractPartition
from ._engineering import basis_of
from ._estimate_data import EstimateData
from ._given_numbers import faults_of_data
from ._property_iteration import refine
from ._synthesis_chain import Chain, Permissible, seen, start_temperatures, with_properties
from ._synthesis_heating import heating_rows
from ._synthesis_layers import layer_rows, maximum_rows
from ._synthesis_operation import balance_steps, operating_rows, stress_steps
from ._synthesis_report import Synthesis


def synthesize(
    run: Scene | Result,
    data: EstimateData | None = None,
    *,
    permissible: Permissible | None = None,
    partition: AbstractPartition | None = None,
    tolerance: float = 1e-9,
    rounds: int = 100,
) -> Synthesis:
    """Parametric synthesis of a brake for one braking, after S: twelve steps from the depth of heat to operation.

    1. effective depth of heat `b = 1.73 √(a τ)`;  2. Fourier numbers;  3. effective volumes;  4. partition of the heat;
    5. mean bulk temperatures;  6. properties at these, where they exceed 150 °C;  7. depth, Fourier numbers, volumes
    and partition once more, until the temperatures change no more;  8. temperatures of the rim's layers, rational
    thickness of rim and lining;  9. maximum temperature;  10. heat balance;  11. thermal stress;  12. operating
    characteristics with the permissible limits.

    - `run`: a `Scene`, of which a classical stop gives time and work, or a `Result`: its hardest braking, and every
      figure stands beside the simulated one where the run has it
    - `data`: numbers that the scene does not have, or others in their place (as for `estimates`)
    - `permissible`: limits of temperature, pressure and power
    - `partition`: law of step 4, as `TransmissionPartition` for S-41; by default `data.share`, else the scene's law,
      else effusivities at the properties of the round
    - `tolerance` (K) of the repeat of step 7 and greatest number of its `rounds`

    Raises `InputError` as `estimates` does, for a staged brake, and for wrong options, `SynthesisError` with the
    code `no_convergence` or `material_range` where step 7 finds no temperature.
    """
    limits = permissible or Permissible()
    scene = run.scene if isinstance(run, Result) else run
    wrong = faults_of_synthesis(scene, data, limits) + _faults_of_options(tolerance, rounds)
    if wrong:
        raise InputError(wrong)
    before, _, about = basis_of(run, data)
    found = seen(before)
    start = start_temperatures(before, found)
    refined = refine(before, start, partition, tolerance, rounds)
    settled = limits.settled(before.scene)
    after = with_properties(before, refined.last)
    chain = Chain(before, after, refined, start, {limit.name: float(limit.value) for limit in settled}, found)
    rows = [
        *heating_rows(chain),
        *layer_rows(chain),
        *maximum_rows(chain),
        *balance_steps(chain),
        *stress_steps(chain),
        *operating_rows(chain),
    ]
    inputs = (*before.inputs.values(), *settled)
    return Synthesis(f"parametric synthesis{about}", inputs, tuple(rows), refined.rounds, refined.replaced)


def faults_of_synthesis(scene: Scene, data: EstimateData | None, limits: Permissible) -> list[Fault]:
    """All that stands against a synthesis before anything is simulated."""
    found = [*faults(scene), *faults_of_data(data, limits)]
    if band_brake(scene).in_series:
        found.append(
            Fault(
                "brake.bandage",
                "is not for this synthesis",
                "it is of a brake with one friction pair; `estimates` takes both pairs of a staged one",
            )
        )
    return found


def _faults_of_options(tolerance: float, rounds: int) -> list[Fault]:
    found = []
    if not 0 < tolerance < float("inf"):
        found.append(Fault("tolerance", f"{tolerance} is not admissible", "must be > 0 K"))
    if rounds < 1:
        found.append(Fault("rounds", f"{rounds} is not admissible", "at least 1"))
    return found
