"""Meshcat, and Pinocchio's visualizer on it, in one place."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # Meshcat 0.3.2 imports an old road to ZeroMQ on the way; nothing here takes it.
    warnings.filterwarnings("ignore", message="zmq.eventloop.ioloop", category=DeprecationWarning)
    import meshcat
    import meshcat.geometry as mg
    from pinocchio.visualize import MeshcatVisualizer

__all__ = ["MeshcatVisualizer", "meshcat", "mg"]
