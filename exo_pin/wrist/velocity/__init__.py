"""Velocities, accelerations, and what sensors measure of the orientation."""
