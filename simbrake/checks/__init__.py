"""Validation against cases from outside, and with SciPy."""
