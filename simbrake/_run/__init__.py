"""Running a scene and reading its results: events, series, metrics, peaks."""
