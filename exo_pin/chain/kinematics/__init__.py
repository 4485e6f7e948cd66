"""Closing loops, motions that keep them closed, mobility and singular configurations."""
