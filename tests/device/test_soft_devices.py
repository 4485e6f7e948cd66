"""Devices whose cuff and harness give way: limits of stiffness, misalignment, and balance."""

import numpy as np
import pytest
from places import URDF
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import exo_pin as ep

MAN = ep.Wearer(1.755, 85.0, "male")
CUFF = ep.Interface.upper_arm_cuff(distance=0.189)


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def on_springs(exo, **parts):
    return exo.replace(interfaces=ep.Interfaces(**parts))


def test_a_soft_cuff_carries_by_its_stiffness_what_equilibrium_leaves_open(serial):
    poses = serial.pose([60.0, 30.0, 0.0], [30.0, 60.0, 20.0])
    rigid, soft = serial.reaction(poses), on_springs(serial, cuff=CUFF).reaction(poses, split="elastic")
    assert (rigid.certificate.undetermined == 3).all()
    assert (soft.certificate.undetermined == 3).all()
    assert "Assumed: the stiffness of what gives way" in str(soft.certificate)
    assert (soft.status == "ok").all()
    assert soft.residual.max() < 1e-9
    # The wrench of the cuff, with the weight of the links on it, is that of its spring, in the arm's axes.
    slip, R = soft.cuff_slip, poses.as_matrix()
    force = np.einsum("kij,kj->ki", R, (CUFF.stiffness @ slip[..., None])[:, :3, 0])
    own = soft.cuff_wrench[:, :3]
    np.testing.assert_allclose(force, own, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("axis", range(3))
def test_ten_millimetres_of_misalignment(serial, axis):
    soft, shift = on_springs(serial, cuff=CUFF), 0.01 * np.eye(3)[axis]
    rest = serial.pose(0, 0)
    plain = soft.reaction(rest, split="elastic")
    moved = soft.reaction(rest, split="elastic", centre_offset=ep.CentreOffset(shift, np.zeros(3)))
    change = moved.shoulder_force - plain.shoulder_force
    assert moved.residual < 1e-9
    assert moved.can_hold
    if axis == 2:
        # Along the arm that hangs the drives cannot follow: 2.25 N/mm of the cuff times 10 mm, upward on the arm.
        np.testing.assert_allclose(np.linalg.norm(change), 22.5, rtol=0.05)
    else:
        # Across it they can: the moment that they hold fixes the force at the cuff, but for what the cuff turns.
        assert np.linalg.norm(change) < 22.5
    # Forces of a shift grow in proportion to it where it is small.
    tenth = soft.reaction(rest, split="elastic", centre_offset=ep.CentreOffset(0.1 * shift, np.zeros(3)))
    tenfold = 10.0 * (tenth.shoulder_force - plain.shoulder_force)[axis]
    np.testing.assert_allclose(tenfold, change[axis], rtol=0.05)


def test_cuff_and_harness_in_series_are_softer_than_either(serial):
    rest, lift = serial.pose(0, 0), ep.CentreOffset([0.0, 0.0, 0.01], np.zeros(3))
    harness = ep.Interface.of(4000.0, 400.0, (0.0, 0.0, 0.0))
    pulls = []
    for parts in ({"cuff": CUFF}, {"harness": harness}, {"cuff": CUFF, "harness": harness}):
        soft = on_springs(serial, **parts)
        with_, without = (soft.reaction(rest, split="elastic", centre_offset=o).cuff_pull for o in (lift, None))
        pulls.append(abs(float(with_ - without)))
    np.testing.assert_allclose(1.0 / pulls[2], 1.0 / pulls[0] + 1.0 / pulls[1], rtol=0.1)


@pytest.mark.parametrize("name", ["spherical-3rrr", "3rps-passive-ball"])
def test_loops_with_forces_of_their_own_and_idle_motions_leave_the_arm_in_balance(name):
    """The 3RRR stresses itself in six ways that do not reach the arm; the ball of the 3RPS turns on its own."""
    exo = on_springs(ep.load(URDF / f"{name}.urdf"), cuff=CUFF)
    answer = exo.reaction(exo.pose([0.0, 30.0, 60.0], [0.0, 20.0, 30.0]), split="elastic")
    assert (answer.equilibrium_status == "ok").all()
    assert answer.residual.max() < 1e-12
    # The 3RPS cannot turn the arm about the line from O to its ball, which a soft cuff moves a little off the arm.
    own = answer.actuator_forces[:, 3:]
    assert np.abs(own).max(initial=0.0) < 0.1
    stiff = on_springs(exo, cuff=ep.Interface(1e3 * CUFF.stiffness, CUFF.at))
    left = stiff.reaction(exo.pose([0.0, 30.0, 60.0], [0.0, 20.0, 30.0]), split="elastic").actuator_forces[:, 3:]
    np.testing.assert_allclose(left, 1e-3 * own, atol=2e-5)
    # The same from the arm's own weight: what the attachments do not carry the shoulder does.
    weight = exo.arm.mass * np.array([0.0, 0.0, -9.81])
    on_arm = answer.limb_wrenches[..., :3].sum(axis=-2)
    np.testing.assert_allclose(answer.shoulder_force + on_arm + weight, np.zeros((3, 3)), atol=1e-9)


def test_a_soft_device_without_an_equilibrium_says_how_much_it_bears(serial):
    """A cuff at O of stiffness k about all axes bears moments up to π k; smaller ones turn it by the moment over k."""
    pose, arm = serial.pose(60, 45), serial.arm.person
    asked = np.linalg.norm(np.cross(pose.apply(np.array(arm.centre_of_mass)), arm.mass * serial.device.gravity))
    for stiffness in (1.0, 2.0, 4.0):
        cuff = ep.Interface.of(1e4, stiffness, np.zeros(3))
        answer = on_springs(serial, cuff=cuff).reaction(pose, split="elastic", limits="none")
        if asked < np.pi * stiffness:
            assert answer.status == "ok"
            assert np.linalg.norm(answer.interface_displacements[1, 3:]) == pytest.approx(asked / stiffness, rel=1e-6)
            continue
        assert answer.status == "no_equilibrium"
        assert np.isnan(answer.shoulder_force).all()
        share = float(answer.load_share)
        assert share == pytest.approx(np.pi * stiffness / asked, abs=2.0**-9)
        assert f"At {100 * share:.0f} % of load and offset what is soft gives way." in answer.verdict
    assert asked < np.pi * stiffness


def test_an_arm_in_a_soft_cuff_turns_about_the_axis_that_two_hinges_leave_to_it():
    """With locked drives it rests where its weight and the cuff's springs have the least energy."""
    man = ep.Wearer(1.755, 85.0, "male", elbow_flexion=0.6, payload=0.5)
    chain = ep.load(URDF / "serial-y-x-z.urdf").device.chain
    held = chain.locked(["internal_rotation"], chain.reference_configuration())
    two = ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held)).worn_by(man)
    at, per_metre, per_turn = np.array([0.0, 0.0, -0.19]), 4e3, 20.0
    soft = on_springs(two, cuff=ep.Interface.of(per_metre, per_turn, at=at))
    pose, arm = soft.pose(45, 45), ep.Arm.of_wearer(man)
    weight, R = arm.mass * np.array([0.0, 0.0, -9.81]), pose.as_matrix()

    def turned(v):
        return Rotation.from_rotvec(v).as_matrix() @ R

    def energy(v):
        slip = (turned(v) - R) @ at
        return 0.5 * (per_metre * slip @ slip + per_turn * v @ v) - weight @ turned(v) @ arm.centre_of_mass

    v = minimize(energy, np.zeros(3), tol=1e-13).x
    answer = soft.reaction(pose, split="elastic_locked")
    assert answer.held
    np.testing.assert_allclose(answer.arm_orientation, turned(v), atol=1e-6)
    np.testing.assert_allclose(answer.shoulder_force, per_metre * (turned(v) - R) @ at - weight, atol=1e-3)
    kept = soft.reaction(pose, split="elastic")
    assert not kept.held
    assert any("elastic_locked" in caution for caution in kept.cautions)
    assert not any("elastic_locked" in caution for caution in answer.cautions)
