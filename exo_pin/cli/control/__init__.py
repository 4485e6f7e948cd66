"""The machine in motion."""
