"""Devices that are not wrists, and their report on a pose."""
