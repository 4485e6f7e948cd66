"""Drives, brakes, springs and their laws, and routes over the links."""
