"""What a run says: quantities at every instant, maxima and marks between the steps,
metrics, events, stops."""

from . import means as means  # (its metrics join the registry)
