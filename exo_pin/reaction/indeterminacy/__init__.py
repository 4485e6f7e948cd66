"""Which reactions equilibrium determines, and poses that cannot be held."""
