"""Statics and dynamics of the wrist with massless limbs, side forces, wrench feasibility."""
