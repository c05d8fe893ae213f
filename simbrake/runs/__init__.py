"""Running a scene: simulate, prepare, results, limits, verdict, accuracy."""
