"""The splits by name."""

from __future__ import annotations

from .elastic import Elastic
from .minimal import Minimal
from .split import Spherical, Split
from .standalone import Standalone

_ALL = (Spherical(), Minimal(), Elastic(), Elastic("locked"), Standalone())
#: Splits that come with the package. The first is the default.
SPLITS: dict[str, Split] = {split.name: split for split in _ALL}
