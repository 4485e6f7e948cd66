"""Errors, checks of input, conventions of orientation, progress and files, used by every room."""
