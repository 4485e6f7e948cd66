"""Equilibrium of the wearer's arm with its muscles, and the force in the shoulder joint."""
