"""Closing loops, motions with closed loops, mobility and singular configurations."""
