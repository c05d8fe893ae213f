"""Results as labelled data, in files, and compared."""
