"""Workspaces with the device's centre off the shoulder's, constant, one a pose, or on the path of a shoulder."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from workspace_examples import free_design

import exo_pin as ep
from exo_pin import CentrePath
from exo_pin.load_case import CentreOffset
from exo_pin.workspace import Criteria, limb_table
from exo_pin.wrist import BodyShape

ELEVATIONS = np.linspace(0.0, np.pi, 7)


#: A shoulder that goes back, in and up, as in docs/concepts/wearer.md, and a device that is off at rest, too.
PATH = CentrePath(
    ELEVATIONS,
    0.03 * np.stack([-np.sin(0.5 * ELEVATIONS), -0.5 * np.sin(0.4 * ELEVATIONS) ** 2, 0.4 * ELEVATIONS], axis=-1),
    (0.004, -0.003, 0.006),
)


BODY = BodyShape.of(ep.Wearer(1.75, 75, "male"))


def cases(count, seed=0):
    """Random poses with offsets of their own."""
    rng = np.random.default_rng(seed)
    poses = Rotation.random(count, rng=rng)
    return poses, CentreOffset(rng.uniform(-0.03, 0.03, (count, 3)), rng.uniform(-0.02, 0.02, (count, 3)))


def balanced_design(limb_count, seed):
    """A design that can hold many poses: three limbs push, too."""
    return free_design(limb_count, seed, "linear" if limb_count == 3 else "cable")


def through_pinocchio(exo, poses, offset, rows):
    """Least |F_s| of the same limits and no side forces, in some of the poses."""
    return exo.reaction(
        poses[rows],
        split="minimal",
        limits=(-300.0 if exo.geometry.limb_count == 3 else 0.0, 400.0),
        constraint_bounds=(0.0, 0.0),
        centre_offset=CentreOffset(offset.base[rows], offset.cuff[rows]),
    )


@pytest.mark.parametrize("limb_count", [3, 4, 6])
def test_forces_agree_with_pinocchio(limb_count):
    exo = balanced_design(limb_count, seed=2)
    poses, offset = cases(100, seed=limb_count)
    found = exo.workspace(poses, ["forces"], centre_offset=offset)
    held = np.flatnonzero(found.margins["forces"] >= 0.0)
    assert held.size >= 8
    # The offset is no detail: other poses are held without it, or with other forces.
    aligned = exo.workspace(poses, ["forces"])
    assert np.nanmax(np.abs(aligned.magnitude - found.magnitude)) > 1.0
    answer = through_pinocchio(exo, poses, offset, held)
    scale = np.abs(found.tensions[held]).max(axis=1)
    # The square of |F_s| is what both make small: where it can be zero, |F_s| has half as many digits.
    aim = np.where(answer.magnitude > 1e-3 * scale, 1e-9, 1e-7) * scale
    assert (np.abs(answer.magnitude - found.magnitude[held]) <= aim).all()
    if limb_count == 3:
        assert (np.abs(answer.actuator_forces - found.tensions[held]).max(axis=1) <= 1e-9 * scale).all()
        np.testing.assert_allclose(np.abs(found.margin[held]), answer.margin, rtol=1e-9)


@pytest.mark.parametrize("limb_count", [3, 4, 6])
def test_poses_that_are_not_held_are_infeasible_in_pinocchio_too(limb_count):
    exo = balanced_design(limb_count, seed=3)
    poses, offset = cases(40, seed=10 + limb_count)
    found = exo.workspace(poses, ["forces"], centre_offset=offset)
    lost = np.flatnonzero(found.margins["forces"] < -1e-6)
    assert lost.size >= 3
    answer = through_pinocchio(exo, poses, offset, lost)
    assert (answer.has_answer & ~answer.held).all()


def free_body(exo, R, base, cuff, f):
    """What is missing in the balance of forces and of moments about O, and F_s, of an arm cut free in a pose."""
    joints = exo.geometry.base_points + base
    ends = (exo.geometry.platform_points + cuff) @ R.T
    pulls = f[:, None] * (joints - ends) / np.linalg.norm(joints - ends, axis=1)[:, None]
    weight = exo.arm.mass * np.array([0.0, 0.0, -9.81])
    moment = np.cross(ends, pulls).sum(axis=0) + np.cross(R @ exo.arm.centre_of_mass, weight)
    return moment, -pulls.sum(axis=0) - weight


@pytest.mark.parametrize("limb_count", [3, 5])
def test_arm_as_a_free_body_is_in_equilibrium(limb_count):
    exo = balanced_design(limb_count, seed=2)
    poses, offset = cases(60, seed=1)
    found = exo.workspace(poses, ["forces"], centre_offset=offset)
    held = np.flatnonzero(np.isfinite(found.magnitude))
    assert held.size >= 10
    for k in held:
        moment, shoulder = free_body(exo, poses[k].as_matrix(), offset.base[k], offset.cuff[k], found.tensions[k])
        scale = np.abs(found.tensions[k]).max()
        assert np.abs(moment).max() <= 1e-9 * scale
        np.testing.assert_allclose(found.shoulder_force[k], shoulder, atol=1e-9 * scale)


def test_tensions_balance_gravity_in_mujoco():
    exo = balanced_design(4, seed=2)
    poses, offset = cases(120, seed=1)
    found = exo.workspace(poses, ["forces"], centre_offset=offset)
    held = np.flatnonzero(np.isfinite(found.magnitude))
    sites = "".join(f'<site name="a{i}" pos="1 2 3"/>' for i in range(4))  # not in a frame of their own
    ends = "".join(f'<site name="b{i}" pos="1 2 3"/>' for i in range(4))
    tendons = "".join(f'<spatial name="t{i}"><site site="a{i}"/><site site="b{i}"/></spatial>' for i in range(4))
    c = exo.arm.centre_of_mass
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><worldbody>{sites}<body><joint type="ball"/><inertial pos="{c[0]:.17g} '
        f'{c[1]:.17g} {c[2]:.17g}" mass="{exo.arm.mass:.17g}" diaginertia="0.1 0.1 0.01"/>{ends}</body></worldbody>'
        f"<tendon>{tendons}</tendon></mujoco>"
    )
    data = mujoco.MjData(model)
    assert held.size >= 10
    for k in held:
        model.site_pos[:4] = exo.geometry.base_points + offset.base[k]
        model.site_pos[4:] = exo.geometry.platform_points + offset.cuff[k]
        data.qpos[:] = np.roll(poses[k].as_quat(), 1)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.ten_length, found.lengths[k], rtol=1e-12)
        scale = np.abs(found.tensions[k]).max()
        assert np.abs(-data.ten_J.reshape(4, 3).T @ found.tensions[k] - data.qfrc_bias).max() <= 1e-8 * scale


def moved(exo, base, cuff):
    """The design with its joints where an offset has them."""
    geometry = exo.geometry
    return exo.replace(
        geometry=geometry.replace(
            base_points=geometry.base_points + base, platform_points=geometry.platform_points + cuff
        )
    )


@pytest.mark.parametrize("name", ["four-cables", "three-linear-actuators"])
def test_every_criterion_is_that_of_the_displaced_geometry(name):
    exo = ep.load(name)
    limits = Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BODY, least_gap=0.012)
    poses = exo.pose(
        flexion=[0.0, 40.0, 80.0, 60.0], abduction=[0.0, 20.0, 40.0, 85.0], internal_rotation=[0, 30, 60, 9]
    )
    found = exo.workspace(poses, limits, centre_offset=PATH)
    assert found.centre_offset is not None
    for k in range(4):
        base, cuff = found.centre_offset.base[k], found.centre_offset.cuff[k]
        np.testing.assert_allclose(base, np.asarray(PATH.fit) - PATH.at(elevation(poses[k])), atol=1e-12)
        torso = BODY.torso.copy()
        torso[:, :3] += (base - cuff) * (np.abs(BODY.torso[:, :3]).max(axis=1) > 0.0)[:, None]
        torso[:, 3:6] += (base - cuff) * (np.abs(BODY.torso[:, 3:6]).max(axis=1) > 0.0)[:, None]
        expected = moved(exo, base, cuff).workspace(poses[k], limits.replace(body=BodyShape(torso, BODY.arm)))
        for criterion, margin in expected.margins.items():
            np.testing.assert_allclose(found.margins[criterion][k], margin, rtol=1e-9, atol=1e-9, err_msg=criterion)
        np.testing.assert_allclose(found.gaps[k], expected.gaps, atol=1e-12)


def elevation(pose):
    """Angle between arm and vertical, rad."""
    return np.arccos(np.clip(pose.as_matrix()[2, 2], -1.0, 1.0))


def test_constant_offset_is_a_device_that_sits_elsewhere():
    """Joints on torso and arm moved alike, and the torso where it is: also for paths from rest on the grid."""
    exo, shift = ep.load("three-linear-actuators"), np.array([0.008, -0.006, 0.01])
    limits = Criteria(largest_shoulder_force=150.0, body=BODY)
    found = exo.workspace(20.0, limits, centre_offset=shift)
    expected = moved(exo, shift, shift).workspace(20.0, limits)
    for criterion, margin in expected.margins.items():
        np.testing.assert_allclose(found.margins[criterion], margin, rtol=1e-9, atol=1e-12, err_msg=criterion)
    assert found.index != exo.workspace(20.0, limits).index


def test_end_of_a_capsule_at_the_shoulder_stays_with_it():
    exo = balanced_design(3, seed=0)
    rise = CentreOffset([0.0, 0.0, -0.05], [0.0, 0.0, 0.0])  # the shoulder is 50 mm above its place at rest
    chest = np.array([[0.0, -0.4, -0.3, 0.0, -0.4, -0.3, 0.05]])
    girdle = np.array([[0.0, -0.4, 0.0, 0.0, 0.0, 0.0, 0.03]])
    arm = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.03]])
    away = exo.replace(
        geometry=ep.WristGeometry([[0.4, -0.4, 0.3], [0.5, 0.1, 0.4], [0.45, 0.3, 0.1]],
                                  [[0.4, -0.4, -0.2], [0.5, 0.1, -0.2], [0.45, 0.3, -0.2]])
    )  # fmt: skip
    limits = Criteria(names=("clearance",), limb_radius=0.01, body=BodyShape(chest, arm))
    found = away.workspace(Rotation.identity(), limits, centre_offset=rise)
    # The first limb is upright at x = 0.4, y = -0.4; the chest beside it stays level with it.
    assert float(found.gaps[1]) == pytest.approx(0.4 - 0.05 - 0.01 + np.hypot(0.4, 0.15) - 0.4, abs=1e-12)
    both = away.workspace(Rotation.identity(), limits.replace(body=BodyShape(girdle, arm)), centre_offset=rise)
    # Of the girdle only the end at the neck goes down by 50 mm; it is the nearest to the limb, whose end is above it.
    low, high = np.array([0.0, -0.4, -0.05]), np.zeros(3)
    first = np.array([0.4, -0.4, 0.25]), np.array([0.4, -0.4, -0.2])
    assert float(both.gaps[1]) == pytest.approx(_least_distance(low, high, *first) - 0.04, abs=1e-4)


def _least_distance(p, q, r, t):
    """Between two segments, by trying 1,000 points of each."""
    share = np.linspace(0.0, 1.0, 1000)[:, None]
    one, other = p + share * (q - p), r + share * (t - r)
    return np.sqrt(((one[:, None] - other[None]) ** 2).sum(axis=-1)).min()


def test_joint_angles_are_those_of_the_displaced_limbs():
    exo = ep.load("prototype")
    limbs = [ep.Limb("UPU", joint_limit=1.6, joint_straight=(0.0, 0.0, 1.0))] * 3
    poses, offset = cases(20)
    found = exo.replace(limbs=limbs).workspace(poses, ["joint_angles"], centre_offset=offset)
    geometry = exo.geometry
    for k in range(20):
        R, least = poses[k].as_matrix(), np.inf
        for i in range(3):
            a = geometry.base_points[i] + offset.base[k]
            s = R @ (geometry.platform_points[i] + offset.cuff[k]) - a
            s /= np.linalg.norm(s)
            for frame, along in ((geometry.base_frames[i], s), (geometry.platform_frames[i], -(R.T @ s))):
                x, y, z = frame.T @ along
                least = min(least, 1.6 - abs(np.arcsin(-y)) - abs(np.arctan2(x, z)))
        assert float(found.margins["joint_angles"][k]) == pytest.approx(least, abs=1e-12)


def test_limbs_with_mass_agree_with_the_full_equilibrium():
    exo = ep.load("four-cables")
    heavy = exo.replace(limbs=[_with_mass(limb) for limb in exo.limbs])
    poses = exo.pose(flexion=[20.0, 50.0, 70.0], abduction=[10.0, 30.0, 40.0])
    found = heavy.workspace(poses, ["forces"], centre_offset=PATH)
    assert np.isfinite(found.magnitude).all()
    answer = heavy.reaction(poses, split="minimal", limits="design", constraint_bounds=(0.0, 0.0), centre_offset=PATH)
    np.testing.assert_allclose(found.magnitude, answer.magnitude, rtol=1e-9)


def _with_mass(limb):
    body = ep.LimbBody(0.15, 0.05, 1e-4, 1e-5)
    return ep.Limb(limb.kind, stroke=limb.stroke, actuator=limb.actuator, base_body=body, platform_body=body)


def test_limb_table_uses_the_offset_of_the_workspace():
    exo, limits = ep.load("four-cables"), Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BODY)
    found = exo.workspace(10.0, limits, centre_offset=PATH)
    table = limb_table(exo.mechanism, found)
    inside = found.inside
    np.testing.assert_allclose(table["used_from_m"], found.lengths[inside].min(axis=0))
    for column, gap in zip(("gap_arm_m", "gap_torso_m", "gap_limbs_m"), found.gaps[inside].min(axis=0), strict=True):
        assert np.min(table[column]) == pytest.approx(gap, abs=1e-12)
    assert np.min(table["base_cone_deg"]) != np.min(
        limb_table(exo.mechanism, exo.workspace(10.0, limits))["base_cone_deg"]
    )


def test_a_harness_on_the_torso_costs_four_cables_abduction():
    """What docs/evidence/designs_found.md says of a man's shoulder, and of tensions and |F_s| there."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    exo, path = ep.load("four-cables"), ep.Person(1.75, 75.0, "male").centre_path()
    poses = exo.pose(abduction=[60.0, 85.0, 90.0])
    found = exo.workspace(poses, Criteria(names=("forces",), least_tension=5.0), centre_offset=path)
    assert found.inside.tolist() == [True, True, False]
    assert found.magnitude[0] == pytest.approx(95.0, abs=0.5)
    assert found.magnitude[1] == pytest.approx(425.0, abs=1.0)
    assert found.tensions[1] == pytest.approx([229.5, 399.6, 5.0, 378.9], abs=0.1)
