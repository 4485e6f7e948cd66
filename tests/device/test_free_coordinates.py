"""Freedoms of a device that leave the arm where it is: they follow the least motion, whatever the file or the steps."""

from pathlib import Path

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import postures
from exo_pin.device.device_model import device_model

ROLES = """schema = 1
name = "again"
robot = "{}"
[roles]
arm = "arm"
shoulder = "root_joint"
cuff = "cuff_middle"
actuated = {}
"""


@pytest.fixture(scope="module")
def rps():
    return ep.load(URDF / "3rps-passive-ball.urdf")


def test_a_device_with_a_freedom_of_its_own_has_one_answer_in_two_formats(rps, tmp_path):
    robot = Path(rps.chain.to_sdf(tmp_path))
    drives = str(list(rps.chain.roles.actuated)).replace("'", '"')
    robot.with_suffix(".device.toml").write_text(ROLES.format(robot.name, drives))
    poses = rps.pose([60.0, 80.0], [30.0, 10.0], [10.0, -10.0])
    one, other = (exo.reaction(poses, limits="none").shoulder_force for exo in (rps, ep.load(robot)))
    np.testing.assert_allclose(other, one, atol=1e-9)


def test_the_free_coordinate_is_that_of_the_least_motion(rps, monkeypatch):
    model = device_model(rps.device)
    matrix = rps.pose(60.0, 30.0, 10.0).as_matrix()[None]
    at_rest = postures.closed_at_rest(model)
    slide = model.held.configuration_slice("cuff_slide")
    found = postures.postures(model, matrix, at_rest).q[0, slide]
    # The velocities of least norm, integrated in steps that are a tenth as long.
    monkeypatch.setattr(postures, "_INTEGRATED", 0.1 * postures._INTEGRATED)
    exact = postures.postures(model, matrix, at_rest).q[0, slide]
    assert abs(exact[0]) > 1e-3
    np.testing.assert_allclose(found, exact, atol=2e-7)
