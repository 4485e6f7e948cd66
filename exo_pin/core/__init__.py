"""What every room stands on: errors, checks of input, conventions of orientation, progress, files."""
