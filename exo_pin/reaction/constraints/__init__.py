"""Bounds on side forces and limb forces, and the glenoid cone."""
