"""Inverse and forward kinematics of the wrist, and distances between its limbs."""
