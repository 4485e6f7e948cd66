"""Styles in which limbs are drawn."""

from __future__ import annotations

__all__ = ["LIMB_STYLES"]

LIMB_STYLES = ("rods", "muscles")
