"""The commands of ``exo-pin``, as ``commands.toml`` lists them.

Only the module of the command that is called is imported: ``exo-pin --help`` and ``--version`` need no physics, and so
not the package's reader of TOML either.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple


class Command(NamedTuple):
    """A command: its module in :mod:`exo_pin.cli`, and the texts of its help."""

    module: str
    help: str
    description: str
    examples: list[str]
    notes: str = ""


COMMANDS = {
    name: Command(**entry)
    for name, entry in tomllib.loads(Path(__file__).with_name("commands.toml").read_text(encoding="utf-8")).items()
}
