"""Seeing it: the scene in three dimensions by Meshcat, and plots by matplotlib (:mod:`exo_pin.view.plots`)."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # Meshcat 0.3.2 takes an old road to ZeroMQ, which this package does not use.
    warnings.filterwarnings("ignore", message="zmq.eventloop.ioloop", category=DeprecationWarning)
    import meshcat  # noqa: F401

from .additions import glenoid_axis
from .browser import Browser, find_browser
from .human import human_urdf
from .recording import Recording
from .scene import LIMB_STYLES, Scene
from .sliders import Sliders

__all__ = ["LIMB_STYLES", "Browser", "Recording", "Scene", "Sliders", "find_browser", "glenoid_axis", "human_urdf"]
