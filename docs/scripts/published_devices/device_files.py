"""The devices by the names of their files, and the texts of these.

Three files a device: URDF, closures file and, where it has springs with a law of their own or cables that run past its
links, a **device file** ``NAME.device.toml``::

    schema = 1
    name = "NAME"

    [[springs]]
    name = "strut"
    law = "table"
    coordinates_m = [0.2, 0.6]       # length between its points, rising
    forces_N = [-1.0, -5.0]          # pull: negative pushes
    [[springs.points]]               # its ends, in a link of the URDF or on the torso
    link = "universe"
    point_m = [0.0, 0.0, -0.4]
    [[springs.points]]
    link = "cuff_middle"
    point_m = [0.0, 0.0, 0.0]
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from exo_pin.core.files.toml_tables import toml_text
from exo_pin.wrist_chain.wrist_urdf import closures_beside

from .device_document import DeviceFiles
from .rps_device import rps_device
from .serial_devices import serial_device
from .spherical_3rrr import agile_eye
from .spring_support import spring_support

__all__ = ["DEVICES", "device_texts"]

#: Of every device, by the name of its files, what makes them.
DEVICES: dict[str, Callable[[], DeviceFiles]] = {
    "serial-y-x-z": partial(serial_device, "yxz"),
    "nesm": partial(serial_device, "xyz"),
    "spherical-3rrr": agile_eye,
    "3rps-passive-ball": rps_device,
    "spring-support": spring_support,
}


def device_texts() -> dict[str, str]:
    """The texts of all devices' files by the files' names."""
    texts: dict[str, str] = {}
    for name, made in DEVICES.items():
        xml, closures, more = made()
        texts |= {f"{name}.urdf": xml, f"{name}.closures.toml": closures_beside(closures, name)}
        if more:
            head = f"# Springs and cables of {name}.urdf. Written by exo_pin.\n"
            texts[f"{name}.device.toml"] = head + toml_text({"schema": 1, "name": name, **more})
    return texts
