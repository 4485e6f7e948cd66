"""What a device puts on the arm of its wearer, by the lines of its limbs and by a free body of the arm."""

import re

import numpy as np
import pytest
from places import URDF

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep

MAN = ep.Person(1.75, 75, "male")
SHIFT = np.array([0.004, -0.006, 0.008])


def wrench(exo, poses, f, shift=0.0):
    """About O: tensions along the limbs, and the weight of the device's own part; both ends are shifted alike."""
    R, geometry = poses.as_matrix(), exo.geometry
    b = np.einsum("...ij,nj->...ni", R, geometry.platform_points + shift)
    pull = geometry.base_points + shift - b
    pull = f[..., None] * pull / np.linalg.norm(pull, axis=-1, keepdims=True)
    (own,) = (part for part in exo.arm.parts if part.device)
    weight, at = own.mass * exo.mechanism.gravity, R @ own.centre_of_mass
    forces = pull.sum(axis=-2) + weight
    return np.concatenate([forces, np.cross(b, pull).sum(axis=-2) + np.cross(at, weight)], axis=-1)


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables").worn_by(MAN)


@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_pull_along_their_lines_whoever_chooses(cables, side):
    exo = cables if side == "left" else cables.mirrored()
    poses = exo.pose([[20.0, 60.0], [80.0, 40.0]], [[20.0, 10.0], [20.0, 40.0]])
    given = exo.reaction(poses).actuator_forces
    low, high = 0.0, exo.limbs[0].actuator.pull_limit
    for forces in (given, given[0, 0], "least_effort", "least_contact"):
        for shift in (None, SHIFT):
            told = exo.joint_contact(poses, MAN, forces, centre_offset=shift)
            f = told.device_forces
            np.testing.assert_allclose(
                told.device_wrench, wrench(exo, poses, f, 0.0 if shift is None else shift), atol=1e-7
            )
            if isinstance(forces, str):
                assert low - 1e-6 <= f.min() <= f.max() <= high + 1e-6
                assert told.held.all()
                assert not told.caution.startswith("Limb")
            else:
                np.testing.assert_array_equal(f, np.broadcast_to(forces, f.shape))
            assert told.assumptions["device"].endswith("; no side forces")


def spoken(contact):
    """Share in percent and moment left, N m, as the answer says them."""
    text = re.search(r"it (carries|adds) (-?\d+) %.*?([\d.]+) N m", str(contact).replace("\n", " "))
    return text[1], int(text[2]), float(text[3])


@pytest.mark.parametrize("angles", [(60.0, 0.0), (0.0, 90.0), (100.0, 30.0)])
def test_a_passive_device_carries_what_its_spring_does(angles):
    exo = ep.load(URDF / "spring-support.urdf")
    pose = exo.pose(*angles)
    (spring,) = exo.device.springs
    start, middle = (np.array(point.point) for point in spring.route.points)
    middle = exo.chain.placement(exo.chain.neutral(), "cuff_middle").translation + middle
    at = pose.as_matrix() @ middle
    size = np.linalg.norm(at - start)
    push = float(spring.law.force(size)) * (start - at) / size
    weight = MAN.arm.mass * np.array([0.0, 0.0, -9.81])
    bare = np.cross(pose.as_matrix() @ MAN.arm.centre_of_mass, weight)
    # The links on the arm weigh on it, too.
    own = exo.arm.parts[-1]
    assert own.device
    links = np.cross(pose.as_matrix() @ own.centre_of_mass, own.mass * np.array([0.0, 0.0, -9.81]))
    left = np.linalg.norm(bare + links + np.cross(at, push))
    word, share, moment = spoken(exo.joint_contact(pose, MAN))
    assert word == "carries"
    assert share == pytest.approx(100.0 * (1.0 - left / np.linalg.norm(bare)), abs=0.51)
    assert moment == pytest.approx(left, abs=0.0051)
    worn = exo.worn_by(MAN).reaction(pose)
    assert np.linalg.norm(worn.actuator_forces) == pytest.approx(left)
    # The answer of the device says the same.
    assert spoken(exo.joint_contact(pose, MAN, worn)) == (word, share, moment)
