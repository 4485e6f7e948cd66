"""Inverse and forward kinematics of the wrist."""
