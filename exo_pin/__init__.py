"""The force that a parallel shoulder exoskeleton puts on the shoulder joint."""

from __future__ import annotations

__version__ = "0.1.0"
