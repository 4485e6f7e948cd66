"""Drives of the limbs: pneumatic muscles in line or over a tackle, cables on winches, linear actuators."""
