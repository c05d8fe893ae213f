"""What a hard case is: a name, what makes it hard, and a function that gives measured
and expected values.

The tests `test_hard_*.py` check every case, `docs/make_hard_cases.py` writes them for
`docs/claims_and_evidence.md`.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scenes import lining_ratio

import simbrake as sb


@dataclasses.dataclass(frozen=True)
class Value:
    """Measured and expected numbers, and how far they may be apart: relative, or
    `absolute`; one tolerance or more."""

    what: str
    got: Any
    expected: Any
    tolerance: Any = 1e-9
    absolute: bool = False

    @property
    def errors(self):
        got = np.asarray(self.got, float)
        expected = np.asarray(self.expected, float)
        assert got.shape == expected.shape, (self.what, got.shape, expected.shape)
        apart = np.abs(got - expected)
        size = np.ones_like(expected) if self.absolute else np.abs(expected)
        # a zero that is hit exactly has no error in either sense
        return np.where(
            apart == 0, 0.0, apart / np.where(size > 0, size, np.finfo(float).tiny)
        )

    def check(self):
        assert np.all(np.isfinite(np.asarray(self.got, float))), (self.what, self.got)
        assert np.all(self.errors <= self.tolerance), (
            self.what,
            self.got,
            self.expected,
            self.errors,
        )

    def __str__(self):
        if np.max(self.tolerance) == 0:
            error = "exact"
        else:
            # a power of ten, and nothing below 1e-13: the last digits of an error
            # depend on the machine
            error = f"error < 1e{math.ceil(math.log10(max(float(np.max(self.errors)), 1e-13)))}"
        if self.absolute and not np.any(self.expected):
            return f"{self.what} {'0, exact' if error == 'exact' else error.removeprefix('error ')}"
        number = (
            f"{np.asarray(self.got, float).item():.6g}, "
            if np.size(self.got) == 1
            else ""
        )
        return f"{self.what}: {number}{error}"


@dataclasses.dataclass(frozen=True)
class Named:
    """What a run ends with, or raises: a status, a code, a list of events, words of a
    message."""

    what: str
    got: Any
    expected: Any

    def check(self):
        assert self.got == self.expected, (self.what, self.got, self.expected)

    def __str__(self):
        if self.got is True:
            return self.what
        got = (
            (", ".join(self.got) or "none")
            if isinstance(self.got, list | tuple)
            else str(self.got)
        )
        return f"{self.what} `{got}`" if self.what else f"`{got}`"


@dataclasses.dataclass(frozen=True)
class Case:
    """One hard case."""

    name: str
    why: str
    run: Callable[[], list[Value | Named]]
    slow: bool = False


def cases_to_test(cases):
    """The cases, for `pytest.mark.parametrize`."""
    return [
        pytest.param(case, id=case.name, marks=[pytest.mark.slow] if case.slow else [])
        for case in cases
    ]


def check(case):
    """All assertions of a case."""
    found = case.run()
    assert found
    for one in found:
        print(one)
        one.check()


# --- one scene for most of the cases: a program is compiled once, and new numbers do not re-trace it

R = 0.5
J = 100.0
C = 1e5
T0 = 2e3
W0 = 20.0
N = 4
BETA = math.radians(60.0)


def scene(
    f=0.3,
    beta=BETA,
    stiffness=None,
    lever=None,
    load=None,
    omega=W0,
    end=5.0,
    inertia=J,
    radius=R,
    drag=0.0,
    ratio=1.0,
    elongation=0.0,
    n=N,
):
    """Four linings; lever and load by three points each, so that every one of these
    scenes is the same program.

    `lever`, `load`: a number, or a list of three pairs (time, value).
    """

    def profile(given, level):
        if given is None or np.ndim(given) == 0:
            given = [(-3.0, level if given is None else given)] * 3
        times, values = np.asarray(given, float).T
        return sb.PiecewiseLinear(times, values)

    linings = sb.Lining(
        sb.ConstantFriction(np.broadcast_to(f, n).astype(float), ratio),
        np.broadcast_to(beta, n) * 1.0,
    )
    return sb.Scene(
        sb.Brake(sb.Pulley(radius, inertia), sb.Band(radius, stiffness), linings),
        sb.Duty(profile(lever, T0), sb.TorqueLoad(profile(load, 0.0), drag)),
        sb.Initial(omega, elongation),
        end,
    )


def run(given, **options):
    """A run with room for 1024 steps, so that all share one program."""
    return sb.simulate(given, max_steps=1024, throw=False, **options)


def ratio_of(f, beta, n=N):
    """`Π = ∏ (1 + f z)/(1 − f z)`."""
    return float(np.prod(lining_ratio(np.broadcast_to(f, n), np.broadcast_to(beta, n))))


@dataclasses.dataclass(frozen=True)
class Stop:
    """Closed form of a stop without load under a constant lever (model §3): onset, full
    slip, stop."""

    onset: float
    full_slip: float
    stop: float


def stop_times(Pi, inertia=J, radius=R, stiffness=C, T_0=T0, omega=W0):
    if stiffness is None:
        return Stop(0.0, 0.0, inertia * omega / (radius * T_0 * (Pi - 1)))
    onset = T_0 / (stiffness * radius * omega)
    chi = radius * math.sqrt(stiffness / inertia)
    reach = chi * T_0 * (Pi - 1) / (stiffness * radius * omega)
    if reach >= 1:
        return Stop(onset, math.inf, onset + math.pi / 2 / chi)
    # ω_1 = ω_0 √(1 − reach²), without the cancellation of a cosine near 0
    slow = math.sqrt((1 - reach) * (1 + reach))
    full = onset + math.asin(reach) / chi
    return Stop(onset, full, full + omega * slow * inertia / (radius * T_0 * (Pi - 1)))


class Numbers(eqx.Module):
    """What the gradients of a case are taken of."""

    stop: Any
    omega: Any
    phi: Any


def _numbers(given):
    result = sb.simulate(given, max_steps=256)
    end = result.record.y_end
    return Numbers(result.stopping_time, end.omega, end.phi)


@functools.cache
def _reverse():
    return jax.jit(jax.jacrev(_numbers))


def gradients(given):
    """Reverse-mode derivatives of stopping time and of speed and angle at the end by
    every number of a scene."""
    return _reverse()(jax.tree.map(jnp.asarray, given))
