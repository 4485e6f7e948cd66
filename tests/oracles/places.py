"""Where the repository and its robots are."""

from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
URDF = REPOSITORY / "urdf"
