"""Forces along movements: histories, peaks, noise, files."""
