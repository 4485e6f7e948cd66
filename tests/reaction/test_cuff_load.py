"""What the cuff puts on the arm and how far it slips: free bodies, springs, and the words for them."""

import numpy as np
import pytest
from wrists import PERSON

import exo_pin as ep


@pytest.fixture(scope="module")
def worn():
    return ep.load("four-cables").worn_by(PERSON)


def test_the_cuff_carries_what_the_shoulder_does_not(worn):
    """F_s, the cuff and the weight hold the arm; the pull is the part along it, towards the hand."""
    poses = worn.pose([30, 70, 100], [0, 20, -10])
    answer = worn.reaction(poses, limits="none")
    weight = worn.arm.mass * worn.mechanism.gravity
    force = answer.cuff_wrench[..., :3]
    # What moves with the arm of the device itself hangs on the platform, outside the cuff.
    moving = (worn.arm.mass - PERSON.mass) * worn.mechanism.gravity
    np.testing.assert_allclose(force + answer.shoulder_force + weight - moving, 0.0, atol=1e-9)
    along = poses.apply([0.0, 0.0, -1.0])
    np.testing.assert_allclose(answer.cuff_pull, (force * along).sum(axis=1), rtol=1e-12)


def test_pressure_is_the_force_across_over_the_area_and_slip_that_of_the_springs(worn):
    cuff = ep.Interface(np.diag([1e4, 2e4, 5e3, 10.0, 20.0, 5.0]), np.array([0.0, 0.0, -0.2]))
    exo = worn.replace(interfaces=ep.Interfaces(None, cuff, cuff_area=0.02))
    pose = exo.pose(60, 20)
    answer = exo.reaction(pose, limits="none")
    R, wrench = pose.as_matrix(), answer.cuff_wrench
    force = R.T @ wrench[:3]
    assert answer.cuff_pressure == pytest.approx(np.hypot(force[0], force[1]) / 0.02, rel=1e-9)
    slip = answer.cuff_slip
    # The platform moves against the arm as the limbs pull it, and pushes the arm that way.
    np.testing.assert_allclose(np.abs(slip[:3]), np.abs(force) / [1e4, 2e4, 5e3], rtol=1e-9)
    moment = R.T @ wrench[3:] - np.cross([0.0, 0.0, -0.2], force)
    np.testing.assert_allclose(np.abs(slip[3:]), np.abs(moment) / [10.0, 20.0, 5.0], rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(np.sign(slip[:5]), np.sign([*force, *moment[:2]]))
    columns = answer.columns()
    assert [name for name in columns if "cuff" in name] == ["cuff_pull_N", "cuff_slip_m", "cuff_pressure_Pa"]
    assert columns["cuff_slip_m"] == pytest.approx(np.linalg.norm(slip[:3]))
    text = answer.cuff_text()
    way = "shoulder" if answer.cuff_pull < 0.0 else "hand"
    assert text.startswith(f"The cuff pulls along the arm with {abs(answer.cuff_pull):.0f} N, towards the {way}; ")
    assert f"it slips {1e3 * np.linalg.norm(slip[:3]):.1f} mm and " in text
    assert f"turns {np.degrees(np.linalg.norm(slip[3:])):.1f}°. " in text
    assert text.endswith(f"is {1e-3 * answer.cuff_pressure:.1f} kPa, on 200 cm².")
