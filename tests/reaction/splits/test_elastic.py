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


def test_three_limbs_within_limits(worn):
    poses = regular_poses(worn.mechanism, np.random.default_rng(23), 12, margin=0.1)
    free = worn.reaction(poses, split="elastic", centre_offset=OFFSET, limits="none")
    pulled = worn.reaction(poses, split="elastic", centre_offset=OFFSET, limits=(-300.0, 300.0))
    within = (np.abs(free.actuator_forces) <= 300.0).all(axis=1) & free.has_answer
    np.testing.assert_array_equal(pulled.held, within)
    np.testing.assert_array_equal(pulled.status[free.has_answer & ~within], "beyond_limits")
    np.testing.assert_allclose(pulled.shoulder_force[within], free.shoulder_force[within], atol=1e-9)


def test_cone_at_the_displaced_geometry(four):
    poses = regular_poses(four.mechanism, np.random.default_rng(24), 6, margin=0.1)
    cone = hanging(muscle_compression=150.0, faces=8)
    answer = four.reaction(poses, split="elastic", centre_offset=OFFSET, cone=cone)
    N, h = cone.half_spaces(four.side)
    good = answer.held
    assert good.any()
    assert (answer.shoulder_force[good] @ N.T <= h + 1e-6).all()
    np.testing.assert_allclose(answer.shoulder_force[good], -2e4 * answer.centre_displacement[good], atol=1e-5)


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


def test_locked_arm_finds_its_pose(worn):
    answer = worn.reaction(LIFTED, split="elastic_locked", centre_offset=OFFSET)
    held = worn.reaction(LIFTED, split="elastic", centre_offset=OFFSET)
    np.testing.assert_allclose(answer.limb_lengths, worn.inverse_kinematics(LIFTED).lengths, atol=1e-12)
    np.testing.assert_array_equal(held.arm_orientation, LIFTED.as_matrix())
    turn = np.arccos((np.trace(answer.arm_orientation @ LIFTED.as_matrix().T) - 1) / 2)
    assert 0.01 < turn < 0.5
    assert answer.residual < 1e-9
    assert np.abs(answer.shoulder_force - held.shoulder_force).max() > 1.0


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


def test_heavy_limbs_and_motion(worn):
    half = ep.LimbBody.rod(0.2, 0.12, 0.012)
    heavy = worn.replace(limbs=[ep.Limb("UPU", half, half, guide=STIFF)] * 3)
    motion = ep.Motion([0.4, -0.8, 0.2], [3.0, 1.0, -2.0])
    for split in ("elastic", "elastic_locked"):
        answer = heavy.reaction(LIFTED, motion, split=split, centre_offset=OFFSET)
        light = worn.reaction(LIFTED, motion, split=split, centre_offset=OFFSET)
        assert answer.residual < 1e-9
        np.testing.assert_allclose(answer.shoulder_force, -2e4 * answer.centre_displacement, atol=1e-8)
        assert np.abs(answer.shoulder_force - light.shoulder_force).max() > 1.0


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


def test_status_of_what_is_lost(worn):
    weak = guided(worn, ep.LimbGuide(60.0, 50.0, largest_bending_moment=1.0, largest_torque=0.5), 2e4)
    answer = weak.reaction(LIFTED, split="elastic", centre_offset=[0.015, 0.0, 0.01])
    assert answer.status == "guide_overloaded"
    assert np.isnan(answer.shoulder_force).all()
    assert answer.guide_load.max() > 1.0
    strong = guided(worn, ep.LimbGuide(60.0, 50.0, largest_bending_moment=500.0), 2e4)
    answer = strong.reaction(LIFTED, split="elastic", centre_offset=[0.015, 0.0, 0.01])
    assert answer.status == "ok"
    assert (answer.guide_load < 1.0).all()
    bare = worn.reaction(LIFTED, split="elastic")
    assert np.isnan(bare.guide_load).all()
    # A shoulder as soft as this cannot hold the arm near the pose.
    lost = guided(worn, STIFF, 10.0).reaction(LIFTED, split="elastic", load=ep.Load([0, 0, -200.0]))
    assert lost.status == "no_equilibrium"
    assert lost.load_share < 1.0 or np.isnan(lost.centre_displacement).all()
    assert np.isnan(lost.actuator_forces).all()
    loose = worn.replace(shoulder=ep.Shoulder(stiffness=0.0), limbs=[ep.Limb()] * 3)
    assert loose.reaction(LIFTED, split="elastic").status == "no_equilibrium"
    # Neither the shoulder nor anything else gives way.
    with pytest.raises(ep.MissingData, match="shoulder stiffness"):
        worn.replace(shoulder=ep.Shoulder(), limbs=[ep.Limb()] * 3).reaction(LIFTED, split="elastic")


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


def test_locked_lengths_of_a_rigid_shoulder_are_three(worn):
    four = ep.load("four-linear-actuators")
    guided_four = four.replace(limbs=[ep.Limb("UPU", guide=STIFF)] * 4)
    with pytest.raises(ep.InvalidInput, match="at most three limbs"):
        guided_four.reaction(LIFTED, split="elastic_locked")


def test_design_files_hold_interfaces(tmp_path, worn):
    soft = ep.Interface(np.diag([4e4, 5e4, 6e4, 500, 600, 700]) + 50.0, [0.01, 0.02, -0.2], "measured")
    limits = ep.LimbGuide(60.0, 50.0, largest_bending_moment=20.0, largest_torque=9.0)
    exo = guided(worn, limits).replace(interfaces=ep.Interfaces(soft, ep.Interface.upper_arm_cuff(0.2)))
    exo.save(tmp_path / "worn.toml")
    back = ep.load(tmp_path / "worn.toml")
    for name in ("harness", "cuff"):
        old, new = (getattr(one.mechanism.interfaces, name) for one in (exo, back))
        np.testing.assert_array_equal(new.stiffness, old.stiffness)
        np.testing.assert_array_equal(new.at, old.at)
        assert new.source == old.source
    assert back.limbs == exo.limbs
    sized = exo.replace(interfaces=ep.Interfaces(cuff_area=0.0123))
    sized.save(tmp_path / "sized.toml")
    back = ep.load(tmp_path / "sized.toml", side="right").mechanism.interfaces
    assert back.cuff_area == 0.0123
    assert back.are_rigid
    exo.replace(interfaces=ep.Interfaces(harness=soft)).save(tmp_path / "harness.toml")
    assert ep.load(tmp_path / "harness.toml").mechanism.interfaces.cuff is None


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ep.Interface(np.eye(3)), "interface stiffness"),
        (lambda: ep.Interface(np.diag([1.0, 1, 1, 1, 1, 0])), "diagonal"),
        (lambda: ep.Interface(np.eye(6) + np.eye(6, k=1)), "symmetric"),
        (lambda: ep.Interface(np.ones((6, 6))), "positive definite"),
        (lambda: ep.Interface.of(1e4, -1.0), "rotational"),
        (lambda: ep.Interface.of(1e4, 1.0, [0, 0, 200.0]), "millimetres"),
        (lambda: ep.Interfaces(cuff=3.0), "Interface or None"),
        (lambda: ep.LimbGuide(1.0, 1.0, largest_torque=0.0), "largest_torque"),
        (lambda: ep.load("prototype").replace(interfaces=None), "Interfaces"),
    ],
)
def test_bad_interfaces(make, message):
    with pytest.raises(ep.InvalidInput, match=message):
        make()


def test_no_offset_is_the_query_without_one(worn):
    poses = regular_poses(worn.mechanism, np.random.default_rng(30), 6, margin=0.1)
    a, b = worn.reaction(poses, split="elastic"), worn.reaction(poses, split="elastic", centre_offset=np.zeros(3))
    assert a.has_answer.all()
    np.testing.assert_allclose(a.shoulder_force, b.shoulder_force, rtol=1e-12)
