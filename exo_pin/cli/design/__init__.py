"""Commands on designs: list, check, export, sweep."""
