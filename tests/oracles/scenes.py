"""What tests of the viewer's scene share."""

import struct
from pathlib import Path

import pytest
import umsgpack

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.view import human_urdf

URDF = Path(__file__).parents[2] / "urdf"


PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


def pose(*angles, side="left"):
    return ep.shoulder_rotation(*angles, side=side, degrees=True)


def has_human():
    try:
        human_urdf()
    except errors.MissingExtra:
        return False
    return True


needs_human = pytest.mark.skipif(not has_human(), reason="example-robot-data is not installed")


def commands(scene):
    """The scene's commands as a browser reads them."""
    data, at, found = scene._stage.snapshot(), 0, []
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        found.append(umsgpack.unpackb(data[at + 4 : at + 4 + size]))
        at += 4 + size
    return found


def panel(scene, name):
    return next(item["data"] for item in commands(scene) if item["type"] == "panel" and item["name"] == name)


def place(scene, path):
    return scene._stage.placements()[path]
