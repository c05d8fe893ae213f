"""Every picture; nothing else loads Matplotlib."""
