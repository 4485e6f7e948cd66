"""``exo-pin thesis``: the published numbers recomputed."""

from __future__ import annotations

import argparse
from typing import Any

from ..thesis import condensed, ledger, ledger_table
from ..thesis.reading_searches import searches
from . import add_flag

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("thesis")
    add_flag(parser, "--all", "print every value, with notes; without it long tables are summed up")
    add_flag(parser, "--readings", "search for readings under which unreproduced numbers follow")
    parser.set_defaults(run=_thesis)


def _thesis(options: argparse.Namespace) -> int:
    if options.readings:
        print("\n".join(map(str, searches())))
        return 0
    rows = ledger()
    print(ledger_table(rows) if options.all else condensed(rows))
    verdicts = [row.verdict for row in rows]
    print("\n" + ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in sorted(set(verdicts))))
    return 0
