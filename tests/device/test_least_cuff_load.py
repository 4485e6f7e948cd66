"""What a rigid answer leaves at the cuff: no couple and no pull that drives do not need, links on the arm counted."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

MAN = ep.Wearer(1.755, 85.0, "male")
GRAVITY = np.array([0.0, 0.0, -9.81])
#: Devices whose joints hold the shoulder's centre a second time, with 0.29 to 1.66 kg welded to the arm.
TWICE = ["serial-y-x-z", "nesm", "spherical-3rrr"]


@pytest.fixture(scope="module", params=TWICE)
def exo(request):
    return ep.load(URDF / f"{request.param}.urdf").worn_by(MAN)


def cuff_middle(exo):
    return exo.chain.placement(exo.chain.neutral(), "cuff_middle").translation


def force_by_hand(exo, pose, motion=None):
    """F_s from the person's arm alone, which a force across it at the cuff and moments about it hold."""
    own = ep.Arm.of_wearer(MAN)
    R = pose.as_matrix()
    centre = R @ own.centre_of_mass
    force, moment = own.mass * GRAVITY, np.cross(centre, own.mass * GRAVITY)
    if motion is not None:
        w, a = motion.angular_velocity, motion.angular_acceleration
        push = -own.mass * (np.cross(a, centre) + np.cross(w, np.cross(w, centre)))
        inertia = R @ own.inertia @ R.T
        force = force + push
        moment = moment + np.cross(centre, push) - inertia @ a - np.cross(w, inertia @ w)
    at = R @ cuff_middle(exo)
    # at x across + moment = 0 in all directions but along the arm.
    across = np.cross(at, moment) / (at @ at)
    return -force - across


@pytest.mark.parametrize("motion", [None, ep.Motion([0.5, -1.0, 0.7], [3.0, 4.0, -2.0])])
def test_the_shoulder_bears_what_the_arm_alone_asks_whatever_is_welded_to_it(exo, motion):
    for angles in ((60.0, 0.0, 0.0), (0.0, 30.0, 0.0), (30.0, 45.0, 30.0)):
        pose = exo.pose(*angles)
        answer = exo.reaction(pose, motion, limits="none")
        assert answer.certificate.undetermined == 3
        np.testing.assert_allclose(answer.shoulder_force, force_by_hand(exo, pose, motion), atol=1e-9)
        # The cuff of the answer has no pull; its couple is about the arm alone.
        R, wrench = pose.as_matrix(), answer.cuff_wrench
        couple = R.T @ (wrench[3:] - np.cross(R @ cuff_middle(exo), wrench[:3]))
        assert abs(answer.cuff_pull) < 1e-9
        np.testing.assert_allclose(couple[:2], 0.0, atol=1e-9)


def test_a_stiff_cuff_that_may_turn_comes_to_the_rigid_answer(exo):
    poses, missing = exo.pose([60.0, 30.0], [30.0, 45.0]), []
    rigid = exo.reaction(poses, limits="none").shoulder_force
    for stiff in (1e6, 1e7):
        cuff = ep.Interface.of([stiff, stiff, stiff], [1e-2, 1e-2, 2e3], cuff_middle(exo))
        soft = exo.replace(interfaces=ep.Interfaces(cuff=cuff)).reaction(poses, split="elastic", limits="none")
        missing.append(np.linalg.norm(soft.shoulder_force - rigid, axis=1).max())
    # What is left is that of the stiffness: it falls in proportion.
    assert missing[0] < 0.02
    assert missing[1] == pytest.approx(0.1 * missing[0], rel=0.01)
