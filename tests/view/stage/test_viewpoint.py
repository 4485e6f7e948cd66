"""The camera's default place: what belongs to the design is in the picture."""

import numpy as np
import pytest
from scenes import panel, place

import exo_pin as ep
from exo_pin.view import Scene


def in_the_picture(camera, points):
    """Places in the picture, -1 to 1 each way, shape (k, 2), of a pinhole that fits the camera's extent."""
    eye, target = np.array(camera["position"]), np.array(camera["target"])
    ahead = target - eye
    distance = np.linalg.norm(ahead)
    ahead /= distance
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rays = points - eye
    seen = np.column_stack([rays @ right, rays @ np.cross(right, ahead)]) / (rays @ ahead)[:, None]
    return distance * seen / camera["extent"]


@pytest.mark.full
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("name", ep.presets())
def test_every_joint_of_a_design_is_in_the_picture(name, side):
    exo = ep.load(name, side=side)
    if exo.arm is None:
        exo = exo.worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    scene = Scene(exo, human=False)
    joints = np.vstack([exo.geometry.base_points, exo.geometry.platform_points])
    places = in_the_picture(panel(scene, "camera"), joints)
    assert np.abs(places).max() < 1.0
    weight = place(scene, "/meshcat/forces/weight/shaft")
    tip = weight[:3, 3] + weight[:3, 2]
    assert np.abs(in_the_picture(panel(scene, "camera"), tip[None])).max() < 1.0
