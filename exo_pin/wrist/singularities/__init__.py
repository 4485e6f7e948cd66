"""Singular poses of the wrist: measures, the nearest one, the singular surface, regions free of it."""
