"""The thesis's experiments and others on the simulated prototype, by name, with tables and verdicts."""
