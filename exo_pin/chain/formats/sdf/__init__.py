"""SDF: a strict check of the file, reading, writing."""
