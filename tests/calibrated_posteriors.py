"""Simulation-based calibration of `log_density`: is the truth spread among posterior
draws as it must be?

`python tests/calibrated_posteriors.py [SETS [SEED]]` (needs `simbrake[bayes]`) draws
the truth of 60 data sets from the prior: friction that two stops share, their initial
speeds, and the standard deviation of the speeds. Two chains of NUTS for each data set,
all side by side, give draws of its posterior. Among these the rank of the truth must be
uniform (χ²), and lie in the middle of about 90 % as often as it has to (binomial). A
sound density fails in 1 % of all seeds, both tests of all parameters together. Prints
JSON; exit code 1 if it fails.

Source: Talts et al., Validating Bayesian Inference Algorithms with Simulation-Based
Calibration, arXiv:1804.06788.
"""

import dataclasses
import json
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
from fit_scenes import OMEGA, T0, F, rigid
from numpyro.infer.hmc import hmc
from scipy.stats import binom, chi2

import simbrake as sb

#: of each chain; every 24th draw is ranked, as neighbours are alike
WARMUP = 200
DRAWS = 384
THIN = 24
CHAINS = 2
BINS = 5
TIMES = np.linspace(0.04, 0.2, 5)  # before any of the stops


def density():
    """Of two stops with different lever forces: five speeds of unknown noise each, and
    the stopping time."""
    stops = [
        sb.studies.Measured.of(
            TIMES,
            {"omega": 20.0 - TIMES},
            events={"stopping_time": (1.0, 0.05)},
            known={T0: force},
        )
        for force in (6e3, 8e3)
    ]
    bounds = {
        "shared": {F: (0.25, 0.5)},
        "per_recording": {OMEGA: (15.0, 25.0)},
        "noise": {"omega": (0.1, 1.0)},
    }
    return sb.studies.log_density(rigid(end=6.0, load=2e3), stops, **bounds)


def posteriors(model, y, key):
    """Draws (data sets, chains, draws, d) for data y (data sets, n, m), and how many
    ended in a divergence."""
    begin, step = hmc(
        potential_fn_gen=lambda y: lambda x: -dataclasses.replace(model, measured=y)(x),
        algo="NUTS",
    )

    def chain(key, y):
        start, key = jax.random.split(key)
        state = begin(
            0.5 * jax.random.normal(start, model.initial.shape),
            num_warmup=WARMUP,
            max_tree_depth=6,
            dense_mass=True,  # friction and speeds depend on each other
            model_args=(y,),
            rng_key=key,
        )

        def draw(state, _):
            state = step(state, (y,))
            return state, (state.z, state.diverging)

        return jax.lax.scan(draw, state, None, length=WARMUP + DRAWS)[1]

    keys = jax.random.split(key, (len(y), CHAINS))
    draws, diverging = jax.jit(jax.vmap(jax.vmap(chain, (0, None))))(keys, y)
    return np.asarray(draws)[:, :, WARMUP:], int(np.sum(diverging[:, :, WARMUP:]))


def main(sets=60, seed=0):
    begun = time.process_time()
    model = density()
    at, noise, chains = jax.random.split(jax.random.key(seed), 3)
    truth = jax.scipy.special.logit(jax.random.uniform(at, (sets, model.initial.size)))
    exact, spread = jax.jit(
        jax.vmap(lambda x: (model.model(v := model.values(x)), v["omega_sigma"]))
    )(truth)
    sigma = jnp.where(model.noisy >= 0, spread[:, None, None], model.sigma)
    draws, diverging = posteriors(
        model, exact + sigma * jax.random.normal(noise, exact.shape), chains
    )
    ranked = draws[:, :, ::THIN].reshape(sets, -1, model.initial.size)
    ranks = np.sum(ranked < np.asarray(truth)[:, None], axis=1)
    count = ranked.shape[1] + 1
    # (by ranks, as quantiles of some draws hold less than their share)
    out = round(0.05 * count)
    share = 1 - 2 * out / count
    inside = np.sum((ranks >= out) & (ranks < count - out), axis=0)
    within = draws.var(axis=2).mean(axis=1)
    between = draws.mean(axis=2).var(axis=1, ddof=1)
    edges = np.ceil(np.linspace(0, count, BINS + 1))
    level = 0.01 / (2 * len(model.names))
    expected = sets * np.diff(edges) / count
    ends = binom.ppf([level / 2, 1 - level / 2], sets, share)
    parameters = {}
    calibrated = True
    for name, rank, held in zip(model.names, ranks.T, inside.tolist(), strict=True):
        bins = np.histogram(rank, edges - 0.5)[0]
        p = float(chi2.sf(np.sum((bins - expected) ** 2 / expected), BINS - 1))
        parameters[name] = {
            "ranks": bins.tolist(),
            "probability": p,
            "in_the_middle": held,
        }
        calibrated &= p > level and bool(ends[0] <= held <= ends[1])
    about = {"sets": sets, "draws": draws.shape[1:3], "divergences": diverging}
    about["middle"] = {"share": round(share, 4), "admissible": ends.tolist()}
    about["largest_r_hat"] = float(np.sqrt(1 + np.max(between / within)))
    about["cpu_seconds"] = round(time.process_time() - begun)
    print(
        json.dumps(
            about | {"parameters": parameters, "calibrated": calibrated}, indent=1
        )
    )
    return 0 if calibrated else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
