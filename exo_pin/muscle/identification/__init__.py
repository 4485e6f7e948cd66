"""Force laws and their parameters from measurements."""
