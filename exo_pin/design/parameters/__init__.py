"""Parameters of a design by name: one language for sweeps, searches, Python and the command line."""
