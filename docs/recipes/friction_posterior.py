"""What does a measured stop tell of friction and load? Their posterior, sampled by emcee."""

import emcee
import numpy as np

import simbrake as sb

ranges = {"brake.linings.friction.coefficient": (0.25, 0.45), "duty.load.mass": ("50 t", "70 t")}
run = sb.studies.evaluator(sb.read_scene("u2_5_5_stop"), ranges, ["stopping_time", "hook_travel"])
low, high = run.bounds.T
# s, m
measured = np.array([1.31, 0.97])
deviation = np.array([0.02, 0.02])


def log_density(X: np.ndarray) -> np.ndarray:
    """Of even priors within the ranges and normal errors of measurement; −∞ where a run has no value."""
    values = np.full(len(X), -np.inf)
    inside = np.all((low < X) & (high > X), axis=1)
    values[inside] = -0.5 * np.sum(((run.evaluate(X[inside]) - measured) / deviation) ** 2, axis=1)
    return np.nan_to_num(values, nan=-np.inf)


begin = np.random.default_rng(0).uniform(low, high, (16, len(ranges)))
sampler = emcee.EnsembleSampler(*begin.shape, log_density, vectorize=True)
sampler.run_mcmc(begin, 400)
chain = sampler.get_chain(discard=100, flat=True)
for name, unit, some in zip(run.names, run.units, np.quantile(chain, [0.05, 0.5, 0.95], axis=0).T, strict=True):
    print(f"{name}: {some[1]:.4g} {unit}, 90 % within {some[0]:.4g} … {some[2]:.4g}")
