"""Whether the device can hold a pose: forces and lengths of equilibrium, compared with the actuators' limits."""
