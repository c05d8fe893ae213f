"""From a scene to the equations of its brake: forces, modes, heat, their coupling."""
