"""Cases with truths that are independent of simbrake: how they are written down, and
what they read from a run.

A case is a `simbrake.checks.Case`: a number that simbrake computes beside its truth.
"""

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import diffrax
import jax
import numpy as np

import simbrake as sb
from simbrake import simulate
from simbrake.checks import Case

#: beginning of the source of most reference values
FORM = "closed form: "
SIGMA = 5.670374419e-8  # W/(m²·K⁴), CODATA 2018
AIR = 293.15  # K
Solver = Any
#: where a scene would be given another method
EXPLICIT = sb.hybrid.ExplicitRungeKutta(diffrax.Dopri8())
STIFF = sb.hybrid.Rodas5P()


class Slope(NamedTuple):
    """A derivative to be compared, by the number at a `path` of the scene; `of`: which
    of several quantities.

    - of an array by the sum of its numbers, or by that whose place ends the path
    """

    path: str
    of: int | None = None


#: quantity that a case reads from a result: a function of it, or names, keys and places
#: in it as `energy.friction_heat`
Reader = str | Callable[[Any], Any] | Slope
#: name, source of the truth, truth, quantity read from the result, and the tolerance if
#: not the default
Row = tuple[str, str, float, Reader] | tuple[str, str, float, Reader, float]


def cases_of(subject, run, tolerance, rows):
    """Cases that read one result, `run()`, which is made when the first of them is
    run."""
    once = functools.cache(run)
    found = []
    for what, source, truth, read, *other in rows:
        value = functools.partial(_read, once, read)
        found.append(
            Case(
                f"{subject}/{what}",
                source,
                truth,
                other[0] if other else tolerance,
                value,
            )
        )
    return found


def cases_of_run(
    subject,
    scene,
    rows,
    tolerance=1e-11,
    rtol=1e-12,
):
    """Cases that read the result of a scene."""
    return cases_of(subject, lambda: simulate(scene, rtol=rtol), tolerance, rows)


def stopping_time(result):
    return result.stopping_time


def differentiated(of, x):
    """Derivative of a closed form at `x` by a complex step: no difference of near
    numbers."""
    return of(x + 1e-200j).imag / 1e-200


@functools.cache
def _with_slope(name, of, solver=None):
    """One program for a result and a derivative, in forward mode: the other mode takes
    several times as long."""

    def both(scene, tangent):
        def found(scene):
            result = simulate(scene, rtol=1e-12, max_steps=1024, solver=solver)
            return of(result), result

        _, slope, result = jax.jvp(found, (scene,), (tangent,), has_aux=True)
        return result, slope

    return jax.jit(both)


def _towards(scene, path):
    tangent = jax.tree.map(lambda x: np.zeros(np.shape(x)), scene)
    head, _, last = path.rpartition(".")
    above = _read(lambda: tangent, head)
    if isinstance(above, np.ndarray):
        above[int(last)] = 1.0
    else:
        _read(lambda: tangent, path)[...] = 1.0
    return tangent


def cases_with_slopes(
    subject,
    scene,
    rows,
    of=stopping_time,
    tolerance=1e-11,
    program=None,
    solver=None,
):
    """Cases that read the result of a scene, of which those of a `Slope` are
    derivatives of `of(result)`.

    - `program`: name of the compiled program that subjects share, whose scenes differ
      in their numbers alone
    - `solver`: as of `simulate`; an explicit one takes less than half as long to
      compile
    """
    rows = list(rows)
    run = _with_slope(program or subject, of, solver)

    @functools.cache
    def along(path):
        return run(jax.tree.map(np.asarray, scene), _towards(scene, path))

    first = next(
        (row[3].path for row in rows if isinstance(row[3], Slope)), "initial.omega"
    )

    def slope(at):
        found = along(at.path)[1]
        return found if at.of is None else found[at.of]

    made = cases_of(subject, lambda: along(first)[0], tolerance, rows)
    return [
        case._replace(value=functools.partial(slope, row[3]))
        if isinstance(row[3], Slope)
        else case
        for case, row in zip(made, rows, strict=True)
    ]


def _read(run, what):
    found = run()
    if not isinstance(what, str):
        return what(found)
    for name in what.split("."):
        if name.isdigit():
            found = found[int(name)]
        else:
            found = found[name] if isinstance(found, Mapping) else getattr(found, name)
    return found


def rows_of(oracle, reads):
    """Rows of an oracle, each with what is read from the result."""
    return [
        (what, source, float(truth), reads[what], tolerance)
        for what, truth, source, tolerance in oracle()
    ]
