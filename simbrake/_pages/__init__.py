"""HTML report and output folder of a run."""
