"""Devices that are no wrists, and their report on a pose."""
