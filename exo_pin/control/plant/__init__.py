"""The plant: arm, shoulder, muscles, air and valves, as one set of differential equations in time."""
