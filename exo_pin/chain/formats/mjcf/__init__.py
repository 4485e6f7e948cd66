"""MJCF: reading through MuJoCo's compiled model, writing."""
