"""Which numbers cause the scatter of the stopping time, which are negligible? Sobol indices and Morris' screening."""

import numpy as np
from SALib.analyze import morris, sobol
from SALib.sample import morris as trajectories
from SALib.sample import sobol as points

import simbrake as sb

ranges = {
    "brake.linings.friction.coefficient": (0.3, 0.4),
    "duty.load.mass": (50e3, 70e3),  # kg
    "initial.omega": (18.0, 24.0),  # rad/s
}
scene = sb.read_scene("u2_5_5_stop")
problem = {"num_vars": len(ranges), "names": list(ranges), "bounds": list(ranges.values())}


def stopping_time(X: np.ndarray) -> np.ndarray:
    return sb.ensemble(scene, dict(zip(ranges, X.T, strict=True)), ["stopping_time"]).stopping_time.values


X = points.sample(problem, 128, calc_second_order=False, seed=1)
print(sobol.analyze(problem, stopping_time(X), calc_second_order=False, seed=2).to_df())
X = trajectories.sample(problem, 20, seed=1)
print(morris.analyze(problem, X, stopping_time(X), seed=2).to_df())
