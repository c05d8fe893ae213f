"""The command `simbrake validate`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ._cli_options import Json, Set, limit, opened, prepare_jax, tolerance


def validate(
    *,
    only: str | None = None,
    list_: Annotated[bool, Parameter(name="--list", negative="")] = False,
    cross_check: Path | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    allowed: float | None = None,
    max_evaluations: int = 400_000,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Compare simbrake with answers from outside: closed forms and published numbers; or a scene with SciPy.

    Parameters
    ----------
    only
        Run the cases whose name holds this, or fits it as a pattern with *.
    list_
        Print the cases without running them.
    cross_check
        Scene to repeat with SciPy instead: changes of mode, event times, state and energies at the end, side by side.
    method
        Of scipy.integrate.solve_ivp, for --cross-check: DOP853, RK45, RK23, Radau, BDF, LSODA.
    rtol
        Relative tolerance of both runs of --cross-check.
    allowed
        Relative difference allowed by --cross-check, 100 times rtol by default.
    max_evaluations
        Evaluations of the right-hand side that SciPy may take in --cross-check.
    json_
        Print a list of {case, source, value, truth, error, tolerance, verdict}, alone on stdout.
    """
    prepare_jax()
    from ._validate_run import run, run_cross_check

    if cross_check is None:
        return run(only, list_=list_, json_=json_)
    limits = {"rtol": tolerance(rtol), "max_evaluations": limit(max_evaluations)}
    scene = opened(cross_check, set_, None, **limits)
    options = {"method": method, "rtol": rtol, "tolerance": allowed, "max_evaluations": max_evaluations}
    return run_cross_check(scene, json_=json_, **options)
