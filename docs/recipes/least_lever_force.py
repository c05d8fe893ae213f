"""With how little force at the slack end does a brake stop, if it must be neither too hot nor pressed too hard?"""

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize

import simbrake as sb

scene = sb.read_scene("heated")
free = {
    "duty.slack_tension.values[1]": ("12 kN", "40 kN"),
    "duty.slack_tension.times[1]": ("0.2 s", "1.5 s"),
}
area = float(scene.brake.linings.area)
most = {"peak_lining_temperature": 273.15 + 180.0, "max_normal_load": 1.0e6 * area}  # K, N: 1 MPa
run = sb.studies.evaluator(scene, free, list(most))
low = run.bounds[:, 0]
width = np.ptp(run.bounds, axis=1)
limits = np.array([*most.values()])

allowed = NonlinearConstraint(  # of shares of the ranges, 0 … 1
    lambda z: run.evaluate(low + width * z) / limits,
    -np.inf,
    1.0,
    jac=lambda z: run.jacobian(low + width * z) * width / limits[:, None],
)
force = lambda z: z[0]
slope = lambda z: np.array([1.0, 0.0])
found = minimize(force, [0.5, 0.2], jac=slope, bounds=[(0, 1)] * 2, constraints=allowed, method="SLSQP")
best = low + width * found.x
print(found.message)
print(dict(zip(run.names, best.round(4).tolist(), strict=True)))
print(dict(zip(run.metrics, run.evaluate(best).round(4).tolist(), strict=True)))
