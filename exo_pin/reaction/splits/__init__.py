"""Assumptions (splits) that determine the forces that equilibrium alone does not."""
