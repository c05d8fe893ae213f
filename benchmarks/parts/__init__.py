"""The parts of `benchmarks/costs.py`; each module has `NAME`, `TITLE` and `measure(quick)`, which gives a `Part`."""
