"""Design studies: several designs over the same poses, as one tidy table."""

from __future__ import annotations

from .parameters import PARAMETERS
from .sweep import FIGURES, adl_box, compare, evaluate, sweep
from .table import StudyTable
from .trade import non_dominated

__all__ = ["FIGURES", "PARAMETERS", "StudyTable", "adl_box", "compare", "evaluate", "non_dominated", "sweep"]
