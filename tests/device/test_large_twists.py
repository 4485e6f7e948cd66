"""A cuff that a bent elbow turns by more than a radian, against the spring and the arm alone."""

import numpy as np
import pytest
from places import URDF
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import exo_pin as ep

CUFF = ep.Interface.upper_arm_cuff(distance=0.19)
AT = np.array(CUFF.at)
#: Of these the last four came to rest at 41 to 92 % of the load, where motions of the rest were counted on.
ANGLES = [(0, 45, 0), (90, 0, 0), (0, 90, 0), (0, 90, -30), (45, 0, 45), (90, 0, 45)]


def energy(turn):
    """Of the cuff's spring where the device has turned about O relative to the arm, N m; arm axes."""
    moved = np.concatenate([turn.apply(AT) - AT, turn.as_rotvec()])
    return 0.5 * moved @ CUFF.stiffness @ moved


def moment(turn):
    """Of the spring on the arm about O: what the energy loses when the arm turns and the device stays, N m."""
    steps = 1e-5 * np.eye(3)
    return (
        np.array([energy(Rotation.from_rotvec(s) * turn) - energy(Rotation.from_rotvec(-s) * turn) for s in steps])
        / 2e-5
    )


@pytest.mark.parametrize(
    "angles", [pytest.param(each, marks=() if k == 0 else pytest.mark.full) for k, each in enumerate(ANGLES)]
)
def test_a_device_that_holds_the_centre_turns_its_cuff_as_far_as_the_arm_asks(angles):
    exo = ep.load(URDF / "spherical-3rrr.urdf").worn_by(ep.Wearer(1.755, 85.0, "male", elbow_flexion=np.pi / 2))
    exo = exo.replace(interfaces=ep.Interfaces(cuff=CUFF))
    pose = exo.pose(*angles)
    answer = exo.reaction(pose, split="elastic", limits="none")
    assert answer.load_share == 1.0
    arm = exo.arm.person
    weight = pose.inv().apply(arm.mass * exo.device.gravity)
    asked = np.cross(arm.centre_of_mass, weight)
    # The way to the whole load, in steps that no fold is missed by.
    turn = np.zeros(3)
    for share in np.linspace(0.02, 1.0, 50):
        found = least_squares(
            lambda x, share=share: moment(Rotation.from_rotvec(x)) + share * asked,
            turn,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        assert np.linalg.norm(found.fun) < 1e-6
        turn = found.x
    assert np.linalg.norm(turn) > 0.05
    apart = Rotation.from_rotvec(turn).apply(AT) - AT
    force = -(CUFF.stiffness[:3] @ np.concatenate([apart, turn]))
    np.testing.assert_allclose(np.linalg.norm(answer.interface_displacements[1, 3:]), np.linalg.norm(turn), rtol=1e-5)
    np.testing.assert_allclose(pose.inv().apply(np.array(answer.shoulder_force)), force - weight, atol=1e-3)
