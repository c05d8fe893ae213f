"""Many runs: sensitivities, ensembles, uncertainty, calibration."""
