"""Styles in which limbs are drawn."""

from __future__ import annotations

LIMB_STYLES = ("rods", "muscles")
