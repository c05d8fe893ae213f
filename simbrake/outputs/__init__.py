"""What a run says: quantities at every instant, maxima and marks between the steps,
metrics, events, stops."""
