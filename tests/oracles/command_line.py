"""The command line in this process."""

import argparse
import re

from exo_pin.cli import COMMANDS, _parser, main

POSE = ["--flexion", "60", "--abduction", "30"]


def run(capsys, *arguments):
    status = main(list(arguments))
    return status, *capsys.readouterr()


def helps(parser):
    """Help texts of a parser and of those within."""
    yield parser.format_help()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for inner in dict.fromkeys(action.choices.values()):
                yield from helps(inner)


def shown():
    """Commands in all help texts, one a line."""
    texts = [text for name in COMMANDS for text in helps(_parser([name]))] + [_parser([]).format_help()]
    lines = [found.rstrip(". ") for text in texts for found in re.findall(r"^ {2}(exo-pin .*)$", text, re.M)]
    lines += re.findall(r"Begin with: (exo-pin [^.]*)", " ".join(texts[-1].split()))
    return list(dict.fromkeys(lines))
