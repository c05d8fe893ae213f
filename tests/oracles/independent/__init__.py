"""Every kind of brake once more in NumPy and SciPy, written from the equations of
docs/theory; nothing of simbrake."""
