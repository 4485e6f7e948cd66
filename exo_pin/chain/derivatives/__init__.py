"""Derivatives of inverse dynamics and of reactions along the closed loops."""
