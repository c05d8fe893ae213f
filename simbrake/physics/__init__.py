"""Equations of a brake from its scene: forces, modes, heat, coupling."""
