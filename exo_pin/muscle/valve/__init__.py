"""Air: valves after ISO 6358, restrictors, pulse-width modulation, supply, and the air in a muscle."""
