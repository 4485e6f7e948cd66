"""Poses that the sliders of a live page ask for: drawn in a thread of their own, and of several the newest alone."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Callable

from ...core.records import OneProcess

#: Flexion, abduction and internal rotation, degrees.
Angles = tuple[float, float, float]
#: No slider goes further, degrees.
_FARTHEST = 360.0


class PoseRequests(OneProcess):
    """What browsers ask for, and what draws it.

    Parameters
    ----------
    draw : callable
        Draws the pose of three angles, degrees.
    """

    def __init__(self, draw: Callable[[Angles], None]) -> None:
        self._draw = draw
        self._lock = threading.Lock()
        self._newest: Angles | None = None
        self._thread: threading.Thread | None = None

    def put(self, message: str | bytes) -> None:
        """Take a message of a browser, and return at once. What is no pose is ignored."""
        angles = _angles(message)
        if angles is None:
            return
        with self._lock:
            self._newest = angles
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._work, name="exo_pin sliders", daemon=True)
                self._thread.start()

    def finish(self) -> None:
        """Wait until all is drawn."""
        with self._lock:
            thread = self._thread
        if thread is not None:
            thread.join()

    def _work(self) -> None:
        while True:
            with self._lock:
                angles, self._newest = self._newest, None
                if angles is None:
                    self._thread = None
                    return
            self._draw(angles)


def _angles(message: str | bytes) -> Angles | None:
    """The angles of ``{"pose": [60, 30, 0]}``."""
    try:
        first, second, third = (float(value) for value in json.loads(message)["pose"])
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    angles = (first, second, third)
    return angles if all(math.isfinite(value) and abs(value) <= _FARTHEST for value in angles) else None
