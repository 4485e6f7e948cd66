"""What tests of the viewer's scene share."""

from pathlib import Path

import numpy as np
import pytest
from described_scenes import commands

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


def panel(scene, name):
    return next(item["data"] for item in commands(scene) if item["type"] == "panel" and item["name"] == name)


def place(scene, path):
    """Where a node is, shape (4, 4)."""
    return placements(scene)[path]


def placements(scene):
    """Where each node is, path to matrix of shape (4, 4)."""
    placed = (item for item in commands(scene) if item["type"] == "set_transform")
    return {item["path"]: np.reshape(item["matrix"], (4, 4)).T for item in placed}
