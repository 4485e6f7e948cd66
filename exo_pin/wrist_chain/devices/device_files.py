"""The devices by the names of their files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...chain.structure.description import Closures
from .serial_devices import serial_device
from .spherical_3rrr import agile_eye

#: Of every device, by the name of its files, what makes its XML and closures.
DEVICES: dict[str, Callable[[], tuple[str, Closures]]] = {
    "serial-y-x-z": partial(serial_device, "yxz"),
    "nesm": partial(serial_device, "xyz"),
    "spherical-3rrr": agile_eye,
}
