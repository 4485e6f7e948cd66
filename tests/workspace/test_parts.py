"""The list of parts: what drives must do, products that fit, and masses."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.cli import main


def light():
    """A design whose drives hold 0.3 kg."""
    exo = ep.load("four-linear-actuators")
    return exo.replace(arm=ep.Arm(0.3, (0.0, 0.0, -0.2)))


@pytest.mark.full
def test_a_design_whose_drives_have_mass_is_heavier_by_their_moment(tmp_path):
    """Balance of the arm by hand: each limb hangs on two joints, and its weight on the cuff is by the lever rule."""
    path = tmp_path / "heavy.toml"
    assert main(["parts", "--step", "40", "--drive-mass", "0.4", "--with-masses", str(path)]) == 0
    light, heavy = ep.load("four-linear-actuators-worn"), ep.load(path)
    pose = heavy.pose(50.0, 20.0)
    answer, R = heavy.reaction(pose, limits="none"), pose.as_matrix()
    A, B = light.geometry.base_points, light.geometry.platform_points @ R.T
    arm, down = light.mechanism.arm, np.array([0.0, 0.0, -9.81])
    moment = np.cross(R @ arm.centre_of_mass, arm.mass * down)
    for a, b, limb in zip(A, B, light.limbs, strict=True):
        stroke, length = limb.stroke, np.linalg.norm(b - a)
        short = stroke.nominal_length * stroke.shortest + stroke.end_fitting
        # The case hangs from the frame, the rod from the cuff; both are as long as the retracted limb.
        share = 0.4 * (0.85 * short / 2.0 + 0.15 * (length - short / 2.0)) / length
        along = (down @ (b - a)) * (b - a) / length**2
        # Along the limb the cuff carries the rod alone, and the drive is between.
        moment = moment + np.cross(b, share * (down - along) + 0.15 * 0.4 * along)
    pull = np.cross(B, (A - B) / np.linalg.norm(A - B, axis=1)[:, None])
    np.testing.assert_allclose(pull.T @ answer.actuator_forces + moment, 0.0, atol=1e-8)
    assert np.abs(pull.T @ light.reaction(pose, limits="none").actuator_forces + moment).max() > 0.1
