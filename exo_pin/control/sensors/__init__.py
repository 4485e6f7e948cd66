"""Sensors between plant and controller, with their errors."""
