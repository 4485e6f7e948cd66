import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_wrist
from published_urdf import published_urdf
from scipy.spatial.transform import Rotation

from exo_pin import shoulder_rotation, thesis_rotation
from exo_pin.chain import ClosedChain
from exo_pin.design import preset, published
from exo_pin.wrist_chain import (
    mechanism_urdf,
)

FOLDER = Path(__file__).parents[2] / "urdf"
PUBLISHED = published_urdf()
URDFS = sorted(name for name in PUBLISHED if name.endswith(".urdf"))


def turned_wrist():
    """A wrist whose neutral pose is not the identity."""
    mechanism = random_wrist(31, "USUU", with_masses=True)
    geometry = mechanism.geometry.replace(neutral=thesis_rotation(0.3, -0.2, 0.4))
    return mechanism.replace(geometry=geometry)


MECHANISMS = {name: preset(name) for name in published()} | {
    "right": preset("prototype").mirrored(),
    "mixed": random_wrist(30, "USUSU", with_masses=True),
    "turned": turned_wrist(),
}


def test_the_folder_is_up_to_date(tmp_path):
    assert {path.name for path in FOLDER.iterdir()} == set(PUBLISHED)
    for name, text in PUBLISHED.items():
        (tmp_path / name).write_text(text)
    for name in PUBLISHED:
        (now, found), (then, expected) = (_skeleton_and_numbers(folder / name) for folder in (tmp_path, FOLDER))
        assert now == then, f"{name} is stale"
        # The last digit is the processor's affair: linear algebra rounds as its instructions do.
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14, err_msg=f"{name} is stale")


def _skeleton_and_numbers(path):
    """A file's text without its numbers, and the numbers."""
    text = path.read_text()
    number = r"-?\d+\.?\d*(?:e[+-]?\d+)?"
    return re.sub(number, "#", text), [float(value) for value in re.findall(number, text)]


@pytest.mark.parametrize("name", URDFS)
def test_mujoco_reads_the_published_files(name):
    mujoco = pytest.importorskip("mujoco")
    theirs = mujoco.MjModel.from_xml_path(str(FOLDER / name))
    # MuJoCo fixes the root link to the world; the rest of the tree is the same.
    ours = ClosedChain.from_urdf(FOLDER / name).model
    moving = [joint for joint in range(1, ours.njoints) if ours.names[joint] != "root_joint"]
    assert theirs.njnt == len(moving)
    mass = sum(ours.inertias[joint].mass for joint in moving)
    assert theirs.body_mass.sum() == pytest.approx(mass, rel=1e-12)


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("part", ["whole", "wrist", "floating"])
def test_the_tree_is_laid_out_as_stated(name, part):
    mechanism = MECHANISMS[name]
    geometry = mechanism.geometry
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root.stop - 4 : root.stop] = geometry.neutral.as_quat()
    # Everything closed and at zero, all link frames parallel to {O_B}, in the neutral pose.
    assert np.abs(chain.residual(q)).max() < 1e-15
    turn = geometry.neutral.as_matrix()
    placements = chain.placements(q)
    for frame, pose in placements.items():
        if frame != "universe":
            np.testing.assert_allclose(pose.rotation, turn, atol=1e-15, err_msg=frame)
    b = geometry.platform_points @ turn.T
    data = chain.model.createData()
    pin.computeJointJacobians(chain.model, data, q)

    def axis(joint):
        """What a unit of the joint's coordinate does: the velocity at its own origin."""
        return pin.getJointJacobian(
            chain.model, data, chain.model.getJointId(joint), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )[:, chain.velocity_slice(joint)][:, 0]

    for i, limb in enumerate(mechanism.limbs):
        name_i, a_i = f"limb_{i + 1}", geometry.base_points[i]
        direction = (b[i] - a_i) / np.linalg.norm(b[i] - a_i)
        normal = -np.cross(a_i, b[i]) / np.linalg.norm(np.cross(a_i, b[i]))
        expected = {
            "platform_y": (b[i], np.r_[0, 0, 0, -b[i] / np.linalg.norm(b[i])]),
            "platform_x": (b[i], np.r_[0, 0, 0, normal]),
            "slide": (a_i, np.r_[-direction, 0, 0, 0]),
            "base_x": (a_i, np.r_[0, 0, 0, normal]),
            "base_y": (a_i, np.r_[0, 0, 0, -a_i / np.linalg.norm(a_i)]),
        }
        for joint, (place, motion) in expected.items():
            joint = f"{name_i}_{joint}"
            if limb.kind == "SPS" and "base" in joint:
                assert joint not in chain.model.names
                continue
            np.testing.assert_allclose(placements[joint].translation, place, atol=1e-15)
            np.testing.assert_allclose(axis(joint), motion, atol=1e-14)


@pytest.mark.parametrize("name", MECHANISMS)
def test_slides_are_the_limbs_lengths(name):
    mechanism = MECHANISMS[name]
    geometry = mechanism.geometry
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    rng = np.random.default_rng(32)
    slides = [chain.configuration_slice(joint) for joint in chain.roles.actuated]

    def lengths(orientation):
        return np.linalg.norm(geometry.platform_points @ orientation.as_matrix().T - geometry.base_points, axis=-1)

    for _ in range(10):
        orientation = geometry.neutral * Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3))
        q = chain.neutral()
        q[:4] = orientation.as_quat()
        q = chain.close(q, hold=["root_joint"])
        found = np.array([q[part][0] for part in slides])
        np.testing.assert_allclose(found, lengths(orientation) - lengths(geometry.neutral), atol=1e-12)
        # Within the joint limits that the file states.
        assert (chain.model.lowerPositionLimit <= q + 1e-12).all()
        assert (q <= chain.model.upperPositionLimit + 1e-12).all()


def test_the_dummys_unit_turns_in_the_order_y_x_z_and_locks_at_90_degrees():
    chain = ClosedChain.from_urdf(FOLDER / "dummy-shoulder.urdf")
    rng = np.random.default_rng(37)
    for angles in rng.uniform(-1.0, 1.0, (10, 3)):
        flexion, abduction, internal = angles
        q = chain.neutral()
        q[chain.configuration_slice("shoulder_y")] = np.cos(-flexion), np.sin(-flexion)
        q[chain.configuration_slice("shoulder_x")] = abduction
        q[chain.configuration_slice("shoulder_z")] = -internal
        expected = shoulder_rotation(*angles).as_matrix()
        np.testing.assert_allclose(chain.placement(q, "arm").rotation, expected, atol=1e-15)
    q = chain.neutral()

    def turning_rank(abduction):
        q[chain.configuration_slice("shoulder_x")] = abduction
        data = chain.model.createData()
        J = pin.computeJointJacobians(chain.model, data, q)
        return np.linalg.matrix_rank(J[3:], tol=1e-9)

    assert turning_rank(np.pi / 2) == 2
    assert turning_rank(0.3) == 3
    part = chain.configuration_slice("shoulder_x")
    assert chain.model.lowerPositionLimit[part][0] == pytest.approx(np.radians(-5.0))
    assert chain.model.upperPositionLimit[part][0] == pytest.approx(np.radians(185.0))
