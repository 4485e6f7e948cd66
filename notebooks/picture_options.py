"""Options of the scripts beside it that draw a picture of a page."""

from __future__ import annotations

import argparse
from pathlib import Path

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"


def picture_options(about: str, picture: str) -> argparse.Namespace:
    """Where the picture goes, and whether a coarse one is enough."""
    parser = argparse.ArgumentParser(description=about.split("\n")[0])
    parser.add_argument("--out", type=Path, default=PICTURES / picture, metavar="FILE", help="picture to write")
    parser.add_argument("--coarse", action="store_true", help="few poses: shows that the script runs, no result")
    return parser.parse_args()
