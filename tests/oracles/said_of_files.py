"""What of robots' files is refused, left out or read, and what is said of it: tables, by name."""

import pytest
import yaml
from places import REPOSITORY

ROWS = yaml.safe_load((REPOSITORY / "tests" / "chain" / "formats" / "said_of_files.yaml").read_text(encoding="utf-8"))
#: The rows as cases of tests, which have numbers as names.
SAID = {name: [pytest.param(*row, id=str(k)) for k, row in enumerate(rows)] for name, rows in ROWS.items()}
