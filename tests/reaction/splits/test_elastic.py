"""The elastic split at the displaced geometry: limits, interfaces, refusals, and what an answer says of itself."""

import pickle

import numpy as np
import pytest
from guided_limbs import guided
from maximal_elastic import Device
from mirror_image import MIRROR, mirrored
from sockets import hanging
from wrists import PERSON, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import SPLITS

DEGREES = {"degrees": True}
LIFTED = ep.shoulder_rotation(60, 30, 0, **DEGREES)
OFFSET = np.array([0.006, -0.004, 0.008])
STIFF = ep.LimbGuide(60.0, 50.0)


@pytest.fixture(scope="module")
def worn():
    return guided(ep.load("prototype").worn_by(PERSON), STIFF, 2e4)


@pytest.fixture(scope="module")
def four():
    return guided(ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(21), 4)), STIFF, 2e4)


@pytest.mark.full
@pytest.mark.parametrize("soft", [False, True], ids=["rigid", "soft"])
def test_limits_hold_at_the_displaced_geometry(four, soft):
    """A limb at its limit holds that force, and with this tension the equilibrium is where the answer has it."""
    exo = four
    if soft:
        exo = four.replace(interfaces=ep.Interfaces(cuff=ep.Interface.of(5e4, 500.0, [0, 0, -0.2])))
    poses = regular_poses(exo.mechanism, np.random.default_rng(22), 4 if soft else 8, margin=0.1)
    limited = exo.reaction(poses, split="elastic", centre_offset=OFFSET, limits=(-15.0, 60.0))
    free = exo.reaction(poses, split="elastic", centre_offset=OFFSET)
    seen = 0
    for k in np.flatnonzero(limited.held & free.held):
        f = limited.actuator_forces[k]
        assert (f >= -15.0 - 1e-9).all()
        assert (f <= 60.0 + 1e-9).all()
        if np.abs(f - free.actuator_forces[k]).max() < 1e-6:
            continue
        seen += 1
        # One tension is on its limit, and with a little less of what balances itself it would be beyond it.
        assert np.minimum(np.abs(f + 15.0), np.abs(f - 60.0)).min() < 1e-9
        device = Device(exo, poses[k], OFFSET, OFFSET, stress=f)
        z = device.solve()
        device.residual(z, 1.0)
        np.testing.assert_allclose(device.tensions, f, atol=1e-6 * np.abs(f).max())
        np.testing.assert_allclose(limited.centre_displacement[k], z[:3], atol=1e-7 * np.abs(z[:3]).max() + 1e-10)
        less = Device(exo, poses[k], OFFSET, OFFSET, stress=0.98 * f)
        less.residual(less.solve(), 1.0)
        assert (less.tensions < -15.0).any() or (less.tensions > 60.0).any()
    assert seen >= 1
    assert soft or (limited.status == "infeasible").any()


def test_locked_actuators_are_checked_and_refuse_a_cone(worn):
    free = worn.reaction(LIFTED, split="elastic_locked", limits="none")
    pulled = worn.reaction(LIFTED, split="elastic_locked", limits="pull")
    np.testing.assert_array_equal(pulled.actuator_forces, free.actuator_forces)
    assert free.actuator_forces.min() < 0.0
    assert pulled.infeasibility is None
    assert not pulled.can_hold
    with pytest.raises(ep.InvalidInput, match='split="elastic"'):
        worn.reaction(LIFTED, split="elastic_locked", cone=hanging(muscle_compression=100.0))
    with pytest.raises(ep.InvalidInput, match="held"):
        type(SPLITS["elastic"])("frozen")
    seven = guided(ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(25), 7)))
    with pytest.raises(ep.InvalidInput, match="at most six"):
        seven.reaction(LIFTED, split="elastic_locked")


def test_rigid_is_the_limit_of_stiff_interfaces(worn):
    rigid = worn.reaction(LIFTED, split="elastic", centre_offset=OFFSET)
    stiff = ep.Interface.of(1e11, 1e11, [0.0, 0.1, -0.1])
    near = worn.replace(interfaces=ep.Interfaces(stiff, stiff))
    answer = near.reaction(LIFTED, split="elastic", centre_offset=OFFSET)
    np.testing.assert_allclose(answer.shoulder_force, rigid.shoulder_force, rtol=1e-5)
    np.testing.assert_array_equal(rigid.interface_displacements, 0.0)
    # A measured cuff takes most of the misfit.
    soft = worn.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.2)))
    answer = soft.replace(gravity=[0, 0, 0]).reaction(LIFTED, split="elastic", centre_offset=OFFSET)
    assert (
        answer.magnitude
        < worn.replace(gravity=[0, 0, 0]).reaction(LIFTED, split="elastic", centre_offset=OFFSET).magnitude
    )
    wrench = answer.cuff_wrench[:3] @ LIFTED.as_matrix()
    np.testing.assert_allclose(
        answer.interface_displacements[1, :3] * [3700.0, 3150.0, 2250.0], wrench, atol=1e-9 * np.abs(wrench).max()
    )


@pytest.mark.parametrize("split", ["elastic", "elastic_locked"])
def test_mirror_image(worn, split):
    soft = ep.Interface(np.diag([4e4, 5e4, 6e4, 500, 600, 700]) + 50.0, [0.01, 0.02, -0.2])
    left = worn.replace(interfaces=ep.Interfaces(soft, soft))
    poses = regular_poses(left.mechanism, np.random.default_rng(26), 4, margin=0.1)
    a = left.reaction(poses, split=split, centre_offset=OFFSET)
    b = left.mirrored().reaction(mirrored(poses), split=split, centre_offset=MIRROR @ OFFSET)
    assert a.has_answer.any()
    np.testing.assert_array_equal(a.status, b.status)
    scale = np.nanmax(np.abs(a.actuator_forces))
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-8 * scale)
    np.testing.assert_allclose(b.actuator_forces, a.actuator_forces, atol=1e-8 * scale)


def test_stack_equals_single_poses(worn):
    poses = regular_poses(worn.mechanism, np.random.default_rng(27), 4, margin=0.05)
    loads = ep.Load(np.random.default_rng(28).normal(size=(4, 3)) * 20, at=[0, 0, -0.3], frame="arm")
    for split in ("elastic", "elastic_locked"):
        stack = worn.reaction(poses, load=loads, split=split, centre_offset=OFFSET)
        for k in range(4):
            one = worn.reaction(
                poses[k], load=ep.Load(loads.force[k], at=[0, 0, -0.3], frame="arm"), split=split, centre_offset=OFFSET
            )
            np.testing.assert_allclose(one.shoulder_force, stack.shoulder_force[k], rtol=1e-9, atol=1e-9)
    again = pickle.loads(pickle.dumps(stack))
    np.testing.assert_array_equal(again.centre_displacement, stack.centre_displacement)


def test_a_guide_bears_a_share_of_its_bending_moment_and_of_its_torque(worn):
    """The larger share counts, and a guide of which one limit is known is judged by that."""

    def load(**limits):
        strong = guided(worn, ep.LimbGuide(60.0, 50.0, **limits), 2e4)
        return strong.reaction(LIFTED, split="elastic", centre_offset=[0.015, 0.0, 0.01]).guide_load

    bent, turned = load(largest_bending_moment=500.0), load(largest_torque=500.0)
    np.testing.assert_allclose(load(largest_bending_moment=1000.0), bent / 2.0, rtol=1e-9)
    assert (np.abs(bent - turned) > 1e-4).all()
    for share in (1.0, 20.0):
        both = load(largest_bending_moment=500.0, largest_torque=500.0 * share)
        np.testing.assert_allclose(both, np.maximum(bent, turned / share), rtol=1e-9)


@pytest.mark.parametrize("split", ["elastic", "elastic_locked"])
@pytest.mark.parametrize("part", ["", "cuff"])
def test_a_rigid_shoulder_is_the_limit_of_stiff_ones(worn, split, part):
    """The difference falls as 1/K, with guides that are all that gives way, and with a cuff besides."""
    parts = {"cuff": ep.Interface.upper_arm_cuff(0.2, times=20.0)} if part else {}
    exo = guided(worn, STIFF).replace(interfaces=ep.Interfaces(**parts))
    question = {"split": split, "centre_offset": [0.0, 0.008, -0.005], "limits": "none"}
    rigid = exo.replace(shoulder=ep.Shoulder()).reaction(LIFTED, **question)
    assert rigid.status == "ok"
    assert rigid.residual < 1e-9
    assert (rigid.centre_displacement == 0.0).all()
    # Guides carry side forces, which a shoulder of any stiffness bears.
    assert np.abs(rigid.constraint_forces).max() > 1.0
    missing = []
    for K in (1e6, 1e7, 1e8, 1e9):
        soft = exo.replace(shoulder=ep.Shoulder(stiffness=K)).reaction(LIFTED, **question)
        missing.append(K * np.linalg.norm(soft.shoulder_force - rigid.shoulder_force))
    assert missing[0] > 1e3
    np.testing.assert_allclose(missing[1:], missing[-1], rtol=0.05)
