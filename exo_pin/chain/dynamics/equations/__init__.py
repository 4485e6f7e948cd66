"""Equations of motion of a chain at a state, all their solutions, and when they have none."""
