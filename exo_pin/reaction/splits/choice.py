"""Which splits a design can be asked with, and which one a question takes that names none."""

from __future__ import annotations

from ...core.errors import ExoPinError
from ...design import Mechanism
from .registry import SPLITS

__all__ = ["comparable_splits", "default_split", "splits_with_bounds"]


def splits_with_bounds() -> list[str]:
    """Splits that take bounds of the side forces."""
    return [name for name, law in SPLITS.items() if "constraint_bounds" in law.options]


def comparable_splits(mechanism: Mechanism) -> list[str]:
    """Splits that fit a design and need no stiffness."""
    return [name for name, law in SPLITS.items() if not law.determines_sides and _fits(name, mechanism)]


def default_split(mechanism: Mechanism, bounded: bool = False) -> str:
    """The split of a question that names none.

    With bounds of the side forces the one that takes them; by stiffness where the design has all stiffnesses, that of
    the shoulder among them; else limbs without side force.
    """
    if bounded:
        return splits_with_bounds()[0]
    by_stiffness = mechanism.shoulder.stiffness is not None and _fits("elastic", mechanism)
    return "elastic" if by_stiffness else next(iter(SPLITS))


def _fits(name: str, mechanism: Mechanism) -> bool:
    try:
        SPLITS[name].check(mechanism)
    except ExoPinError:
        return False
    return True
