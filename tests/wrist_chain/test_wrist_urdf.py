import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_wrist
from published_devices import DEVICES
from published_urdf import published_urdf
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName, shoulder_rotation, thesis_rotation
from exo_pin.chain import ClosedChain
from exo_pin.cli import main
from exo_pin.design import WristGeometry, preset, published
from exo_pin.wrist_chain import (
    AssumedMasses,
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


def test_the_published_files_are_written_as_they_stand(tmp_path, capsys):
    assert main(["export", "--published", str(tmp_path)]) == 0
    assert {Path(line).name for line in capsys.readouterr().out.split()} == set(PUBLISHED)
    assert all((tmp_path / name).read_bytes() == (FOLDER / name).read_bytes() for name in PUBLISHED)


def _skeleton_and_numbers(path):
    """A file's text without its numbers, and the numbers."""
    text = path.read_text()
    number = r"-?\d+\.?\d*(?:e[+-]?\d+)?"
    return re.sub(number, "#", text), [float(value) for value in re.findall(number, text)]


def test_the_folder_has_every_published_mechanism():
    wrists = {f"{name}-wrist.urdf" for name in published()}
    devices = {f"{name}.urdf" for name in DEVICES}
    others = {"prototype.urdf", "prototype-shoulder.urdf", "dummy-shoulder.urdf", "six-cables.urdf"}
    assert set(URDFS) == wrists | devices | others


@pytest.mark.parametrize("name", URDFS)
def test_a_published_file_is_closed_in_its_neutral_pose_and_has_masses(name):
    chain = ClosedChain.from_urdf(FOLDER / name)
    assert np.abs(chain.residual(chain.neutral())).max(initial=0.0) <= 1e-12
    for joint in range(1, chain.model.njoints):
        inertia = chain.model.inertias[joint]
        assert inertia.mass > 0.0
        assert np.linalg.eigvalsh(inertia.inertia)[0] > 0.0
    assert ("assumed" in (FOLDER / name).read_text()) == (name != "prototype-shoulder.urdf")
    links = ET.parse(FOLDER / name).findall("link")
    assert all(link.find("visual") is not None for link in links if link.get("name") != "cuff_middle")


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


def test_the_arm_is_written_exactly():
    mechanism = preset("prototype")
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    inertia = chain.model.inertias[1]
    assert inertia.mass == mechanism.arm.mass
    np.testing.assert_allclose(inertia.lever, mechanism.arm.centre_of_mass, rtol=0, atol=1e-17)
    np.testing.assert_allclose(inertia.inertia, mechanism.arm.inertia, rtol=1e-14, atol=1e-18)
    np.testing.assert_array_equal(chain.model.gravity.linear, mechanism.gravity)


def test_limb_halves_carry_their_mass_on_the_limbs_line():
    mechanism = random_wrist(33, "USU", with_masses=True)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    geometry = mechanism.geometry
    for i, limb in enumerate(mechanism.limbs):
        b, a = geometry.platform_points[i], geometry.base_points[i]
        s = (b - a) / np.linalg.norm(b - a)
        for key, half, start, along in (
            ("platform_body", limb.platform_body, b, -s),
            ("base_body", limb.base_body, a, s),
        ):
            frame = next(f for f in chain.model.frames if f.name == f"limb_{i + 1}_{key}")
            inertia = chain.model.inertias[frame.parentJoint]
            pose = chain.placement(chain.neutral(), frame.name)
            assert inertia.mass == half.mass
            np.testing.assert_allclose(pose.translation, start, atol=1e-15)
            np.testing.assert_allclose(inertia.lever, half.centre * along, atol=1e-15)
            np.testing.assert_allclose(inertia.inertia @ s, half.axial_inertia * s, atol=1e-15)
            across = np.cross(s, [1.0, 0.0, 0.0])
            np.testing.assert_allclose(inertia.inertia @ across, half.transverse_inertia * across, atol=1e-15)


def test_no_mass_is_assumed_by_default():
    for name in ("scenario-one", "appendix-d", "prototype"):
        xml, _ = mechanism_urdf(preset(name), "wrist")
        masses = {link.get("name") for link in ET.fromstring(xml).findall("link") if link.find("inertial") is not None}
        assert masses == (set() if name == "scenario-one" else {"arm"})
        assert "assumed" not in xml
        assumed, _ = mechanism_urdf(preset(name), "wrist", AssumedMasses())
        assert all(link.find("inertial") is not None for link in ET.fromstring(assumed).findall("link"))
        assert AssumedMasses().statement in assumed


def test_given_masses_are_not_overruled_by_assumed_ones():
    mechanism = random_wrist(34, "UUU", with_masses=True)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, assumed=AssumedMasses()))
    index = next(f.parentJoint for f in chain.model.frames if f.name == "limb_1_base_body")
    assert chain.model.inertias[index].mass == mechanism.limbs[0].base_body.mass


def test_an_arm_of_unknown_inertia_is_a_stated_point_mass():
    xml, closures = mechanism_urdf(preset("appendix-d"))
    assert "inertia of the arm about its centre of mass is not known" in xml
    inertia = ClosedChain.from_urdf(xml, closures).model.inertias[1]
    assert inertia.mass == 2.0
    np.testing.assert_array_equal(inertia.inertia, np.zeros((3, 3)))


def test_a_folded_limb_is_refused_if_it_needs_a_plane():
    base = [[0.1, 0, -0.1], [-0.1, 0.1, 0], [0, -0.1, 0.1]]
    platform = [[0.2, 0, -0.2], [-0.1, 0, -0.2], [0.1, 0.1, -0.2]]
    axes = {"base_axis": [0.0, 1.0, 0.0], "platform_axis": [0.0, 0.0, 1.0]}
    mechanism = random_wrist(35, "UUU").replace(geometry=WristGeometry(base, platform, **axes))
    with pytest.raises(InvalidInput, match="limb_1"):
        mechanism_urdf(mechanism)
    sps = mechanism.replace(limbs=random_wrist(35, "SUU").limbs)
    chain = ClosedChain.from_urdf(*mechanism_urdf(sps))
    q = chain.neutral()
    q[:4] = thesis_rotation(0.2, 0.1, -0.3).as_quat()
    assert np.abs(chain.residual(chain.close(q, hold=["root_joint"]))).max() <= 1e-12
    touching = random_wrist(36, "UUU")
    points = touching.geometry.platform_points.copy()
    points[1] = touching.geometry.base_points[1]
    axes_geometry = WristGeometry(touching.geometry.base_points, points, **axes)
    with pytest.raises(InvalidInput, match="no length"):
        mechanism_urdf(touching.replace(geometry=axes_geometry))


def test_unknown_part():
    with pytest.raises(UnknownName, match="floating"):
        mechanism_urdf(preset("prototype"), "arm")


def test_names_are_escaped(tmp_path):
    mechanism = preset("prototype").replace(name='a<"b">', title="one -- two")
    xml, closures = mechanism_urdf(mechanism)
    assert ET.fromstring(xml).get("name") == 'a<"b">-whole'
    chain = ClosedChain.from_urdf(xml, closures)
    assert np.abs(chain.residual(chain.neutral())).max() < 1e-15


def test_to_urdf_makes_a_pair_that_loads(tmp_path):
    path = ep.load("prototype").to_urdf(tmp_path / "new", "floating", None)
    assert sorted(item.name for item in path.parent.iterdir()) == [
        "prototype-floating.closures.toml",
        "prototype-floating.urdf",
    ]
    chain = ClosedChain.from_urdf(path)
    assert chain.roles.shoulder == "shoulder"
    assert chain.row_count == 21
    with pytest.raises(InvalidInput, match="name"):
        ep.ShoulderExo.from_mechanism(preset("prototype").replace(name="../out")).to_urdf(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="Not a directory"):
        ep.load("prototype").to_urdf(tmp_path / "file")


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
