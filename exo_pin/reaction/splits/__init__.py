"""How the part of the forces that equilibrium does not determine is shared."""
