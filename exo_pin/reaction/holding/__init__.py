"""Whether the device can hold a pose: what its actuators can do beside what equilibrium demands of them."""
