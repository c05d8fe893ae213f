"""Validation of tensions along a band: chords, and linings that slide, with masses too,
by linear equations."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import cases_of, differentiated

from simbrake.brakes import (
    chord_tensions,
    sliding_tensions,
)

_T0 = 8e3
_F = np.array([0.30, 0.42, 0.35])


def _solved(equations):
    """Unknowns of linear equations, each `{name: coefficient}` and its right side."""
    names = sorted({name for left, _ in equations for name in left})
    matrix = np.array(
        [[left.get(name, 0.0) for name in names] for left, _ in equations]
    )
    return dict(
        zip(
            names,
            np.linalg.solve(matrix, np.array([right for _, right in equations])),
            strict=True,
        )
    )


def chord_cases():
    """Three point linings between chords of unequal angles: forces along and across the
    rim at each."""
    beta = np.radians([12.0, 31.0, 18.0, 25.0])

    def along(angles, k=3):
        c = np.cos(angles / 2)
        s = np.sin(angles / 2)
        T = {"T0": 1.0}
        equations = [(T, _T0)]
        for i in range(1, k + 1):
            before = f"T{i - 1}"
            after = f"T{i}"
            N = f"N{i}"
            equations.append(({after: c[i], before: -c[i - 1], N: -_F[i - 1]}, 0.0))
            equations.append(({after: s[i], before: s[i - 1], N: -1.0}, 0.0))
        return _solved(equations)

    def of_third(angle):
        return along(np.array([*beta[:2], angle, beta[3]]))["T3"]

    def run():
        T_0 = jnp.asarray(_T0)
        forces = chord_tensions(T_0, _F, beta)
        return forces, jax.grad(lambda b: chord_tensions(T_0, _F, b).tension[2])(
            jnp.asarray(beta)
        )

    truth = along(beta)
    source = "linear equations: T_i c_i − T_(i−1) c_(i−1) = f N_i, N_i = T_i s_i + T_(i−1) s_(i−1)"
    rows = [
        (f"tension {i}", f"{source} [Z-1…4]", truth[f"T{i}"], f"0.tension.{i - 1}")
        for i in (1, 2, 3)
    ]
    rows += [
        (f"load {i}", f"{source} [Z-1…4]", truth[f"N{i}"], f"0.normal.{i - 1}")
        for i in (1, 2, 3)
    ]
    rows.append(
        (
            "∂(tension 3)/∂β_2",
            f"{source}, differentiated",
            differentiated(of_third, beta[2]),
            "1.2",
        )
    )
    return cases_of("chords", jax.jit(run), 1e-13, rows)


def sliding_cases():
    """Three unequal linings that all slide: at rest on the band, and with masses, of
    which one lifts off."""
    beta = np.radians([28.0, 51.0, 36.0])
    pushed = np.array([150.0, 80.0, 210.0])
    thrown = np.array([900.0, 300.0, 1500.0])
    far = np.array([0.0, 3e4, 0.0])
    c = np.cos(beta / 2)
    s = np.sin(beta / 2)

    def along(ma, mrw, f=_F, lifted=None):
        equations = [({"T0": 1.0}, _T0)]
        for i in range(3):
            before = f"T{i}"
            after = f"T{i + 1}"
            N = f"N{i + 1}"
            slides = 0.0 if i == lifted else f[i]
            equations.append(({after: c[i], before: -c[i], N: -slides}, -ma[i]))
            off = {N: 1.0} if i == lifted else {after: s[i], before: s[i], N: -1.0}
            equations.append((off, 0.0 if i == lifted else mrw[i]))
        return _solved(equations)

    def tight(f):
        return along(pushed, thrown, np.array([_F[0], f, _F[2]]))["T3"]

    def last(f):
        return sliding_tensions(
            jnp.asarray(_T0), f, beta, inertia_force=pushed, centrifugal_force=thrown
        ).tension[2]

    def unbalanced(found):
        """All forces on the band by components, over the tight tension; each lining is
        on the angle of its middle."""
        T, N, F = (np.asarray(x) for x in (found.tension, found.normal, found.friction))
        ends = np.concatenate([[0.0], np.cumsum(beta)])
        middle = 0.5 * (ends[1:] + ends[:-1])
        pull = T[-1] * np.exp(1j * (ends[-1] + math.pi / 2)) - _T0 * np.exp(
            1j * math.pi / 2
        )
        return float(abs(pull + np.sum((N - 1j * F) * np.exp(1j * middle))) / T[-1])

    def run():
        massive = {"inertia_force": pushed, "centrifugal_force": thrown}
        return (
            sliding_tensions(jnp.asarray(_T0), _F, beta),
            sliding_tensions(jnp.asarray(_T0), _F, beta, **massive),
            sliding_tensions(
                jnp.asarray(_T0), _F, beta, centrifugal_force=far, inertia_force=pushed
            ),
            jax.grad(last)(jnp.asarray(_F)),
        )

    source = (
        "linear equations: (T_i − T_(i−1)) c_i + m a_i = f_i N_i, N_i = (T_i + "
        "T_(i−1)) s_i − m R ω²"
    )
    still = along(np.zeros(3), np.zeros(3))
    moved = along(pushed, thrown)
    off = along(pushed, far, lifted=1)
    rows = [
        ("tension 3", f"{source} [Z-12…14]", still["T3"], "0.tension.2"),
        (
            "forces on the band",
            "their sum is 0 in both directions",
            0.0,
            lambda x: unbalanced(x[0]),
        ),
        ("tension 3 with masses", source, moved["T3"], "1.tension.2"),
        ("load 2 with masses", source, moved["N2"], "1.normal.1"),
        ("friction 1 with masses", source, _F[0] * moved["N1"], "1.friction.0"),
        ("tension 3, lining 2 off", f"{source}, N_2 = 0", off["T3"], "2.tension.2"),
        ("load 2, lining 2 off", f"{source}, N_2 = 0", 0.0, "2.normal.1"),
        (
            "∂(tension 3)/∂f_2",
            f"{source}, differentiated",
            differentiated(tight, _F[1]),
            "3.1",
        ),
    ]
    return cases_of("sliding linings", jax.jit(run), 1e-13, rows)


CASES = (
    chord_cases,
    sliding_cases,
)
