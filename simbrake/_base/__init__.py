"""Basics used by every package: quantities, input errors, units, compiling,
progress."""
