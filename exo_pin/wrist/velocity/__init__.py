"""Velocities, accelerations, and the orientation from sensors."""
