"""The command line in this process."""

import re

from exo_pin.cli import _START, COMMANDS, main, overview
from exo_pin.cli.command import command, examples


def run(capsys, *arguments):
    status = main(list(arguments))
    return status, *capsys.readouterr()


def options_of(name):
    """The options and arguments of a command, as its parser has them."""
    return [
        each
        for each in command(name).assemble_argument_collection(parse_docstring=True)
        if each.parse and not each.children
    ]


def shown():
    """Commands in all help texts, one a line."""
    lines = [line for name in COMMANDS for line in examples(name)]
    lines += [line.split("  ")[0] for line in re.findall(r"exo-pin [a-z][^\n]*", f"{_START}\n{overview()}")]
    return [line for line in dict.fromkeys(lines) if not line.startswith("exo-pin COMMAND")]


def called(line):
    """The name of the command of a line, with its second word where it has one."""
    words = line.split()[1:]
    return next(name for name in (" ".join(words[:2]), words[0]) if name in COMMANDS)
