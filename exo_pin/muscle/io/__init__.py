"""Parameter sets and tables of measurements as files."""
