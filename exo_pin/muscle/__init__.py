"""Pneumatic muscles: force laws, their dynamics, and how both are identified."""
