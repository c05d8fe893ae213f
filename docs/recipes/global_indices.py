"""Which numbers cause the scatter of the stopping time, which are negligible? Sobol indices and Morris' screening."""

import pandas as pd
from SALib.analyze import morris, sobol
from SALib.sample import morris as trajectories
from SALib.sample import sobol as points

import simbrake as sb

ranges = {
    "brake.linings.friction.coefficient": (0.3, 0.4),
    "duty.load.mass": ("50 t", "70 t"),
    "initial.omega": ("18 rad/s", "24 rad/s"),
}
run = sb.studies.evaluator(sb.read_scene("u2_5_5_stop"), ranges, "stopping_time")
problem = {"num_vars": len(run.names), "names": run.names, "bounds": run.bounds}

X = points.sample(problem, 128, calc_second_order=False, seed=1)
shares = sobol.analyze(problem, run.evaluate(X)[:, 0], calc_second_order=False, seed=3)
X = trajectories.sample(problem, 20, seed=1)
effects = morris.analyze(problem, X, run.evaluate(X)[:, 0], seed=3)
columns = {
    "share of variance, alone S1": shares["S1"],
    "with others ST": shares["ST"],
    "mean effect over the range, s": effects["mu"],
    "σ of effects, s": effects["sigma"],
}
print(pd.DataFrame(columns, run.names).to_string(float_format="{:.3f}".format))
