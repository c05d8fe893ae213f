"""Log-density of parameters given recordings: against the normal distribution of a stop
on a straight line."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from fit_scenes import OMEGA, T0, F, J, rigid
from helpers import all_near, faults_of, near
from scenes import GAIN
from scipy.stats import norm
from test_many_recordings import EACH, INERTIAS, TIMES, deceleration, stops

import simbrake as sb

NAMES = (T0, *(f"{OMEGA}@{name}" for name in INERTIAS), "omega_sigma")
LOW = np.array([2e3, 5.0, 5.0, 5.0, 0.01])
HIGH = np.array([3e4, 60.0, 60.0, 60.0, 2.0])


@pytest.fixture(scope="module")
def density():
    prior = {T0: lambda T: -0.5 * ((T - 8e3) / 500.0) ** 2}
    shared = {T0: (2e3, 3e4)}
    noise = {"omega": (0.01, 2.0)}
    return sb.studies.log_density(
        rigid(), stops(), shared=shared, per_recording=EACH, priors=prior, noise=noise
    )


def closed(x, data):
    """The same by speeds on straight lines; the ratio of the bounds of σ makes it
    logarithmic."""
    z = 1 / (1 + jnp.exp(-x))
    T, first, second, third = (LOW + (HIGH - LOW) * z)[:4]
    sigma = LOW[4] * (HIGH[4] / LOW[4]) ** z[4]
    total = (
        jnp.sum(jnp.log(z) + jnp.log1p(-z))
        - 0.5 * ((T - 8e3) / 500.0) ** 2
        + jnp.log(HIGH[0] - LOW[0])
    )
    for (name, inertia), w0 in zip(
        INERTIAS.items(), (first, second, third), strict=True
    ):
        r = (
            w0 - deceleration(inertia) * T * TIMES[name] - data[name].points[0].value
        ) / sigma
        total += jnp.sum(-0.5 * r**2 - jnp.log(sigma) - 0.5 * jnp.log(2 * jnp.pi))
    return total


@pytest.mark.slow
def test_density_and_its_gradient_are_the_closed_ones(density):
    assert density.names == NAMES
    x = density.unconstrained({T0: 7.8e3, f"{OMEGA}@second": 23.2, "omega_sigma": 0.3})
    points = x + 0.05 * np.random.default_rng(1).standard_normal((4, x.size))
    value = jax.jit(jax.vmap(jax.value_and_grad(density)))
    got, slope = map(np.asarray, value(points))
    want, exact = jax.vmap(jax.value_and_grad(lambda x: closed(x, stops())))(points)
    all_near(got, want, 1e-9)
    all_near(slope, exact, 1e-7, 1e-7 * np.abs(exact).max())
    # other data by replacing them, and parameters by path for models of one's own
    changed = stops(seed=5)
    rows = [each.points[0].value for each in changed.values()]
    y = np.stack([np.append(row, np.full(30 - row.size, np.nan)) for row in rows])
    other = dataclasses.replace(density, measured=y)
    near(other(points[0]), closed(points[0], changed), 1e-9)
    values = density.values(x)
    likelihood = norm.logpdf(y, density.model(values), 0.3)
    near(other.log_likelihood(values), np.nansum(likelihood), 1e-9)
    assert density.codes(values).tolist() == [0, 0, 0]


@pytest.mark.slow
def test_event_that_does_not_occur_has_no_density():
    """A stopping time t = J ω/(R T_0 (Π − 1)) after the end of the run."""
    data = sb.studies.Measured.of(events={"stopping_time": (0.6, 0.01)})
    scene = sb.with_values(rigid(end=1.0), {OMEGA: 20.0, T0: 9e3})
    density = sb.studies.log_density(scene, data, shared={T0: (2e3, 3e4)})
    weak = density.unconstrained({T0: 3e3})
    strong = density.unconstrained({T0: 9e3})
    assert density(weak) == -np.inf
    time = 800.0 * 20.0 / (GAIN * 9e3)
    near(density.log_likelihood({T0: 9e3}), norm.logpdf(0.6, time, 0.01), 1e-7)
    assert np.isfinite(jax.grad(density)(strong)).all()


def test_errors_of_a_density_come_at_once():
    data = stops() | {"fourth": sb.studies.Measured.of([0.1], {"phi": [1.0]})}
    faults = faults_of(
        sb.studies.log_density,
        rigid(),
        data,
        shared={T0: (2e3, 3e4), J: (1.0, 1e4)},
        priors={F: 0.3, T0: 0.3},
        noise={"omega": (0.0, 1.0), "speed": (0.1, 1.0)},
    )
    assert len(faults) == 6
