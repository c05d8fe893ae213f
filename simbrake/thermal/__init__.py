"""Thermal networks: bodies, links between them, materials, and how friction feeds them."""
