"""The classical estimates and published tables beside a simulation."""
