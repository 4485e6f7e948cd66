"""Equations of motion of a closed chain: inverse and forward dynamics, reactions, simulation."""
