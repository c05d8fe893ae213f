"""A run and what it tells: events, series, metrics, peaks, the result."""
