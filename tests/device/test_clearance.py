"""Clearance at every door: the same gaps, parts and words of any device, against capsules of a collision library."""

import coal
import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.device.clearance import link_capsules

pytestmark = pytest.mark.usefixtures("plain")

MAN = ep.Wearer(1.755, 85.0, "male")


def distance(first, second):
    """Between two capsules (two ends and a radius, m), by Coal, from their axes."""
    shapes, places = [], []
    for row in (first, second):
        a, b = np.array(row[:3]), np.array(row[3:6])
        length = np.linalg.norm(b - a)
        turn = np.eye(3) if length < 1e-9 else Rotation.align_vectors([b - a], [[0.0, 0.0, 1.0]])[0].as_matrix()
        shapes.append(coal.Capsule(1e-4, max(length, 1e-9)))
        places.append(coal.Transform3s(turn, (a + b) / 2.0))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    coal.distance(shapes[0], places[0], shapes[1], places[1], request, result)
    return result.min_distance + 2e-4 - first[6] - second[6]


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def test_a_link_through_the_wearer_is_named_where_the_workspace_is_not_clear(serial):
    poses = serial.pose([80.0, 30.0], [80.0, 30.0])
    found = serial.workspace(poses, ["clearance"])
    assert found.inside.tolist() == [False, True]
    answer = serial.reaction(poses)
    np.testing.assert_allclose(answer.clearance, found.margins["clearance"], atol=1e-12)
    assert "In 1 of 2 poses link_1 and frame pass through the wearer's arm, by up to 62 mm." in answer.verdict
    one = serial.reaction(poses[0])
    assert one.verdict.startswith(
        "The device can hold this pose. As it is worn, link_1 passes through the wearer's arm"
    )
    assert "frame passes through the wearer's arm (18 mm deep)" in one.verdict
    assert one.as_dict()["clearance"] == pytest.approx(float(found.margins["clearance"][0]), abs=1e-12)
    assert serial.reaction(poses[1]).verdict == "The device can hold this pose."
    contact = serial.joint_contact(poses[0], ep.Person(1.755, 85.0, "male"), outside="mark")
    assert "link_1 passes through the wearer's arm (62 mm deep)" in contact.caution


def test_links_of_a_device_that_gives_way_are_displaced_with_it(serial):
    pose = serial.pose(80.0, 80.0)
    there = serial.reaction(pose)
    soft = serial.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.2)))
    answer = soft.reaction(pose, split="elastic")
    # Its links give way by some millimetres.
    assert answer.clearance == pytest.approx(float(there.clearance), abs=0.02)
    assert answer.clearance != there.clearance
    assert "link_1 passes through the wearer's arm" in answer.verdict


def test_what_is_not_known_is_said(serial):
    bare = ep.load(URDF / "nesm.urdf")
    (said,) = (text for text in bare.reaction(bare.pose(30)).cautions if "touches the body" in text)
    assert said.endswith("Not known: who wears it (worn_by, --person).")
    assert np.isnan(bare.reaction(bare.pose(30)).clearance)
    support = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    (said,) = (text for text in support.reaction(support.pose(30)).cautions if "touches the body" in text)
    assert said.endswith("Not known: shapes of the links.")
    assert (
        "Not checked for clearance: links of one limb beside one another." in serial.reaction(serial.pose(30)).cautions
    )


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "3rps-passive-ball"])
def test_gaps_of_links_are_those_of_coal(name):
    """Joints of the second lie away from the shoulder's centre."""
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    body, pose = ep.BodyShape.of(MAN), exo.pose(60.0, 40.0, 10.0)
    chain, R = exo.chain, pose.as_matrix()
    q = exo.configurations(pose)
    least = [np.inf, np.inf]
    for shape in chain.description.shapes:
        frame = chain.model.frames[chain.model.getFrameId(shape.frame)]
        if frame.parentJoint in (0, exo.device.arm_index):
            continue
        place = chain.placement(q, shape.frame) * shape.place
        half = shape.size[1] / 2.0 if shape.kind == "cylinder" else 0.0
        ends = [place.act(np.array([0.0, 0.0, sign * half])) for sign in (-1.0, 1.0)]
        link = [*ends[0], *ends[1], shape.size[0]]
        for part, rows in enumerate((body.arm, body.torso)):
            turn = R if part == 0 else np.eye(3)
            for row in rows:
                own = [*(turn @ row[:3]), *(turn @ row[3:6]), row[6]]
                least[part] = min(least[part], distance(link, own))
    np.testing.assert_allclose(exo.device.gaps(R[None]).least[0, :2], least, atol=1e-6)


def cables_of_a_chain(exo):
    """The cables of a wrist as routes from the torso to the arm of a chain without limbs."""
    alone = ep.load(URDF / "prototype-shoulder.urdf").device
    names = [f"limb {i + 1}" for i in range(exo.geometry.limb_count)]
    drives = [
        Drive(name, route=Route.over(("universe", a), (str(alone.chain.roles.arm), b)), lower=0.0, upper=400.0)
        for name, a, b in zip(names, exo.geometry.base_points, exo.geometry.platform_points, strict=True)
    ]
    return alone.replace(drives=drives, arm=exo.arm)


@pytest.mark.parametrize("joined", [False, True])
def test_cables_of_a_chain_are_as_near_as_the_limbs_of_the_wrist(joined):
    exo = ep.load("six-cables")
    if joined:
        points = np.array(exo.geometry.base_points)
        points[1] = points[0]
        exo = exo.replace(geometry=exo.geometry.replace(base_points=points))
    device = cables_of_a_chain(exo)
    assert isinstance(device, ChainDevice)
    poses = exo.pose([10.0, 60.0, 80.0, 30.0], [10.0, 20.0, 80.0, 70.0])
    gaps = exo.workspace(poses, ["clearance"]).gaps
    np.testing.assert_allclose(device.gaps(poses.as_matrix()).least, gaps, atol=1e-9)
    # And off the shoulder's centre.
    held, carried = [0.006, -0.002, 0.004], [0.001, 0.003, -0.002]
    found = exo.workspace(poses, ["clearance"], centre_offset=ep.CentreOffset(held, carried)).gaps
    offset = np.array([held]), np.array([carried])
    np.testing.assert_allclose(device.gaps(poses.as_matrix(), offset).least, found, atol=1e-9)
    assert np.abs(found - gaps).max() > 1e-3
    one = ep.ShoulderExo.from_device(device)
    for k in range(4):
        told = [text.split("As it is worn")[1] if "As it is worn" in text else "" for text in (
            exo.reaction(poses[k]).verdict, one.reaction(poses[k]).verdict)]  # fmt: skip
        assert told[0].split("of 6 joints")[0].replace("another limb", "another limb or cable") == told[1]


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", pytest.param("four-cables", marks=pytest.mark.full)])
def test_a_wrist_as_its_own_chain_is_as_near(name, tmp_path):
    """Limbs between their joints, whatever they look like: also off the centre, and read from the wrist's own URDF."""
    exo = ep.load(name).worn_by(ep.Wearer(1.755, 85.0, "male"))
    read = ep.load(exo.to_urdf(tmp_path))
    poses = exo.pose([0.0, 45.0, 90.0, 30.0], [10.0, 0.0, 45.0, 70.0])
    for offset in (None, [0.006, -0.002, 0.004]):
        near = exo.reaction(poses, limits="none", centre_offset=offset)
        for device in (exo.device.as_chain(), read.device):
            other = ep.ShoulderExo.from_device(device).reaction(poses, limits="none", centre_offset=offset)
            np.testing.assert_allclose(other.clearance, near.clearance, atol=1e-9)
            assert not [text for text in other.cautions if "clearance" in text]


@pytest.mark.parametrize(
    ("name", "angles", "touch"),
    [
        ("spherical-3rrr", (0.0, 0.0, 0.0), True),
        ("3rps-passive-ball", (0.0, 0.0, 0.0), False),
        ("3rps-passive-ball", (60.0, 96.0, 85.0), True),
    ],
)
def test_links_of_different_limbs_are_as_near_as_sampled_axes(name, angles, touch):
    """The arcs of the 3RRR lie on one sphere for all limbs, so that they cross, wherever the arm is."""
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    pose, chain = exo.pose(*angles), exo.chain
    ends, radii, names, _ = link_capsules(exo.device)
    frames = chain.placements(exo.configurations(pose))
    t = np.linspace(0.0, 1.0, 80)[:, None]
    axes, limbs = [], []
    for row, link in zip(ends, names, strict=True):
        place = frames[chain.model.names[int(row[6])]]
        axes.append((1 - t) * place.act(row[:3]) + t * place.act(row[3:6]))
        limbs.append(link.split("_")[1] if link.startswith("limb") else "cuff" if link.startswith("cuff") else "")
    least = dict.fromkeys(names, np.inf)
    for i in range(len(names)):
        for j in range(i):
            if limbs[i] != limbs[j] and limbs[i] and limbs[j]:
                gap = np.linalg.norm(axes[i][:, None] - axes[j][None], axis=-1).min() - radii[i] - radii[j]
                for link in (names[i], names[j]):
                    least[link] = min(least[link], gap)
    gaps = exo.device.gaps(pose.as_matrix()[None])
    found = dict(zip(gaps.parts, gaps.each(np.array([0]))[:, 2], strict=True))
    for link, gap in least.items():
        assert found[link] <= gap + 1e-9
        assert np.isinf(gap) or gap - found[link] < 2e-3
    assert (min(least.values()) < 0.0) == ("another limb" in gaps.words) == touch
