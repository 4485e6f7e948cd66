"""The command line in this process."""

from exo_pin.cli import main

POSE = ["--flexion", "60", "--abduction", "30"]


def run(capsys, *arguments):
    status = main(list(arguments))
    return status, *capsys.readouterr()
