"""URDF: a strict check of the file, reading through Pinocchio, writing."""
