"""What of robots' files is refused, left out or read, and what is said of it: tables, by name."""

import yaml
from places import REPOSITORY

ROWS = yaml.safe_load((REPOSITORY / "tests" / "chain" / "formats" / "said_of_files.yaml").read_text(encoding="utf-8"))
