"""What a mechanism is: pure data, frozen and checked when it is made."""

from __future__ import annotations

from .arm import Arm
from .files import preset, presets, read_mechanism, write_mechanism
from .geometry import CircleDimensions, WristGeometry
from .guide import LimbGuide
from .limb import Limb, LimbBody, Stroke
from .loading import CentreOffset, Load, Motion
from .mechanism import Mechanism
from .path import CentrePath
from .shoulder import Shoulder

__all__ = [
    "Arm",
    "CentreOffset",
    "CentrePath",
    "CircleDimensions",
    "Limb",
    "LimbBody",
    "LimbGuide",
    "Load",
    "Mechanism",
    "Motion",
    "Shoulder",
    "Stroke",
    "WristGeometry",
    "preset",
    "presets",
    "read_mechanism",
    "write_mechanism",
]
