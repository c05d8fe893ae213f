"""Scenes with smoothed friction for diffrax, one module each: a `Smooth` that one solve
runs."""
