"""Recordings on the command line: the options that read them, and the command that checks and converts them."""
