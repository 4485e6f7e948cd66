"""Imports of Meshcat and of Pinocchio's visualizer for it."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # Meshcat 0.3.2 imports a deprecated part of ZeroMQ, which is not used here.
    warnings.filterwarnings("ignore", message="zmq.eventloop.ioloop", category=DeprecationWarning)
    import meshcat
    import meshcat.geometry as mg
    from pinocchio.visualize import MeshcatVisualizer

__all__ = ["MeshcatVisualizer", "meshcat", "mg"]
