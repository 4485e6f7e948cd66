"""Seeing it: the scene in three dimensions by Meshcat, and plots by matplotlib (:mod:`exo_pin.view.plots`)."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .browser import Browser, find_browser
    from .chain_scene import ChainScene
    from .human import human_urdf
    from .recording import Recording
    from .scene import Scene
    from .sliders import Sliders

__all__ = [
    "LIMB_STYLES",
    "Browser",
    "ChainScene",
    "Recording",
    "Scene",
    "Sliders",
    "find_browser",
    "human_urdf",
]

#: How limbs can be drawn.
LIMB_STYLES = ("rods", "muscles")

# Meshcat takes half a second to import, which a table or a plot need not wait for.
_HOMES = {
    "Browser": "browser",
    "ChainScene": "chain_scene",
    "Recording": "recording",
    "Scene": "scene",
    "Sliders": "sliders",
    "find_browser": "browser",
    "human_urdf": "human",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
