"""Scenes and histories in files."""
