"""Scenes as expressions of CasADi, one module each: a `Form` that its integrators run
with all events in one call."""
