"""Scenes under CyRK and numba, one module each; all search their events in the same way (`until`)."""
