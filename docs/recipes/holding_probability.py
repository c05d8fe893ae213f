"""How likely does a brake not hold its load? FORM with exact gradients, beside Monte Carlo."""

import openturns as ot

import simbrake as sb

scattered = {
    "brake.linings.friction.coefficient": ot.TruncatedDistribution(ot.Normal(0.30, 0.03), 0.1, 0.5),
    "duty.load.mass": ot.TruncatedNormal(60e3, 6e3, 30e3, 90e3),  # kg
    "duty.slack_tension.values": ot.TruncatedNormal(24e3, 2e3, 12e3, 36e3),  # N
}
at_rest = {"initial.omega": 0.0, "duty.slack_tension.values": 24e3, "end_time": 0.1}
scene = sb.with_values(sb.read_scene("u2_5_5_stop"), at_rest)
# static capacity over the load's torque: below 1 the load moves off
run = sb.studies.evaluator(scene, list(scattered), lambda result: result.series([0.0]).holding_reserve[0])
function = ot.PythonFunction(3, 1, run.evaluate, gradient=lambda x: run.jacobian(x).T, func_sample=run.evaluate)
inputs = ot.RandomVector(ot.JointDistribution(list(scattered.values())))
lost = ot.ThresholdEvent(ot.CompositeRandomVector(function, inputs), ot.Less(), 1.0)
search = ot.AbdoRackwitz()
search.setStartingPoint(run.start)
form = ot.FORM(search, lost)
form.run()
first = form.getResult()
runs = function.getEvaluationCallsNumber()
print(f"FORM         {first.getEventProbability():.4f}  {runs} runs")
sampled = ot.ProbabilitySimulationAlgorithm(lost, ot.MonteCarloExperiment())
sampled.setBlockSize(1000)
sampled.setMaximumCoefficientOfVariation(0.05)
sampled.run()
many = sampled.getResult()
print(f"Monte Carlo  {many.getProbabilityEstimate():.4f} ± {many.getStandardDeviation():.4f}")
