"""What everything stands on: quantities and their faults, units, compiling, progress."""
