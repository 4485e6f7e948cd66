"""The built machine as a simulation: the plant that controllers drive."""
