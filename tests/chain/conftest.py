"""Lets the tests of this folder import the named mechanisms beside it, also when they run alone."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
