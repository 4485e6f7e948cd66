"""What every other part of the package may use: writing files, copying records."""
