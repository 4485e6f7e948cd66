"""Workspaces with the device's centre off the shoulder's, constant, one a pose, or on the path of a shoulder."""

import itertools

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from workspace_examples import free_design

import exo_pin as ep
from exo_pin.load_case import CentreOffset
from exo_pin.workspace import Criteria, limb_table
from exo_pin.workspace.evaluation import PoseOffsets, rest_side
from exo_pin.workspace.optimisation.search_poses import centre_text
from exo_pin.wrist import BodyShape

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


def test_constant_offset_is_a_device_that_sits_elsewhere():
    """Joints on torso and arm moved alike, and the torso where it is: also for paths from rest on the grid."""
    exo, shift = ep.load("three-linear-actuators"), np.array([0.008, -0.006, 0.01])
    limits = Criteria(largest_shoulder_force=150.0, body=BODY)
    found = exo.workspace(20.0, limits, centre_offset=shift)
    expected = moved(exo, shift, shift).workspace(20.0, limits)
    for criterion, margin in expected.margins.items():
        np.testing.assert_allclose(found.margins[criterion], margin, rtol=1e-9, atol=1e-12, err_msg=criterion)
    assert found.index != exo.workspace(20.0, limits).index


@pytest.mark.parametrize("sides", [(1, 0), (0, 1)])
def test_an_offset_of_one_side_is_one(sides):
    base, cuff = (side * np.array([[0.0, 0.01, 0.0]]) for side in sides)
    off = PoseOffsets(base, cuff)
    assert not off.is_aligned
    assert PoseOffsets.none().is_aligned
    both = PoseOffsets.joined([PoseOffsets.none(), off], 2)
    for found, side in ((both.base, base), (both.cuff, cuff)):
        np.testing.assert_array_equal(found, np.concatenate([np.zeros((2, 3)), side, side]))


def test_offsets_in_words():
    displacement = [[0.0, 0.003, 0.004], [0.0, -0.012, 0.016]]
    moves = "The shoulder's centre moves with the arm, by at most 20 mm on its path"
    assert centre_text(ep.CentrePath([0.1, 0.9], displacement)) == f"{moves}."
    fitted = ep.CentrePath([0.1, 0.9], displacement, [0.002, 0.0, -0.0015])
    assert centre_text(fitted) == f"{moves}, and is off by (2, 0, -1.5) mm at rest."
    apart = ep.CentreOffset([0.01, 0.0, -0.005], [0.0, 0.012, 0.0])
    where = "(10, 0, -5) mm at the base and (0, 12, 0) mm at the cuff"
    assert centre_text(apart) == f"The device's centre is off the shoulder's by {where}."


def test_the_side_of_rest_is_that_of_most_poses_where_rest_is_singular():
    margins = np.array([0.3, -0.2, -0.1, 0.0])
    assert [rest_side(rest, margins) for rest in (0.2, -0.2, 1e-10, -1e-10, 0.0)] == [1.0, -1.0, -1.0, -1.0, -1.0]
    assert rest_side(0.0, -margins) == rest_side(0.0, margins[:2]) == 1.0


def opening(directions):
    """Half angle of the smallest cone around few directions: it touches two of them, or three."""
    sets = [subset for size in (2, 3) for subset in itertools.combinations(directions, size)]
    axes = [np.linalg.lstsq(np.array(subset), np.ones(len(subset)))[0] for subset in sets]
    return min(np.arccos((directions @ (axis / np.linalg.norm(axis))).min()) for axis in axes)


def test_cones_of_a_displaced_device_hold_its_limbs():
    """Base and cuff are off the shoulder by their own: lines from A_i to B_i of the displaced rings."""
    exo = ep.load("four-linear-actuators")
    poses, base, cuff = (
        exo.pose([10, 40, 60], [0, 20, 10]),
        np.array([0.01, 0.0, -0.005]),
        np.array([0.0, 0.012, 0.006]),
    )
    found = exo.workspace(poses, Criteria(names=("singularity",)), centre_offset=ep.CentreOffset(base, cuff))
    assert found.inside.all()
    # The same of both, one a pose.
    both = [base, cuff, base]
    for given in (both, ep.CentreOffset(both, both)):
        lengths = exo.workspace(poses, ["singularity"], centre_offset=given).lengths
        each = [
            exo.workspace(pose, ["singularity"], centre_offset=off).lengths
            for pose, off in zip(poses, both, strict=True)
        ]
        np.testing.assert_allclose(lengths, each, rtol=1e-12)
    table, geometry = limb_table(exo.mechanism, found), exo.geometry
    for i in range(4):
        lines = poses.apply(geometry.platform_points[i] + cuff) - geometry.base_points[i] - base
        lengths = np.linalg.norm(lines, axis=1)
        assert table["used_from_m"][i] == pytest.approx(lengths.min())
        assert table["used_to_m"][i] == pytest.approx(lengths.max())
        along = lines / lengths[:, None]
        for name, rows in (("base_cone_deg", along), ("arm_cone_deg", poses.inv().apply(-along))):
            assert table[name][i] == pytest.approx(np.degrees(opening(rows)), abs=1e-6)
