"""Recordings on the command line: the commands that check, convert and judge them."""
