"""Gaps of links and cables, against capsules of a collision library and by hand."""

import itertools
import re
from dataclasses import replace

import coal
import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.wrist.clearance.gaps import named

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


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "3rps-passive-ball"])
def test_gaps_of_links_are_those_of_coal(name):
    """To the body, and of links of different limbs; joints of the second lie away from the shoulder's centre."""
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    body, pose = ep.BodyShape.of(MAN), exo.pose(60.0, 40.0, 10.0)
    chain, R = exo.chain, pose.as_matrix()
    q = exo.configurations(pose)
    least, links = [np.inf, np.inf, np.inf], []
    for shape in chain.description.shapes:
        frame = chain.model.frames[chain.model.getFrameId(shape.frame)]
        if frame.parentJoint in (0, exo.device.arm_index):
            continue
        place = chain.placement(q, shape.frame) * shape.place
        half = shape.size[1] / 2.0 if shape.kind == "cylinder" else 0.0
        ends = [place.act(np.array([0.0, 0.0, sign * half])) for sign in (-1.0, 1.0)]
        link = [*ends[0], *ends[1], shape.size[0]]
        links.append((re.match(r"limb_\d|cuff|", shape.frame)[0], link))
        for part, rows in enumerate((body.arm, body.torso)):
            turn = R if part == 0 else np.eye(3)
            for row in rows:
                own = [*(turn @ row[:3]), *(turn @ row[3:6]), row[6]]
                least[part] = min(least[part], distance(link, own))
    for (one, link), (other, beside) in itertools.combinations(links, 2):
        if one != other and one and other:
            least[2] = min(least[2], distance(link, beside))
    assert np.isfinite(least[2]) == (name != "serial-y-x-z")
    np.testing.assert_allclose(exo.device.gaps(R[None]).least[0], least, atol=1e-6)


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


def test_a_chain_says_which_joints_lie_beyond_the_elbow_as_its_wrist_does():
    wrist, chain = (
        ep.load(each).worn_by(ep.Wearer(1.55, 48.0, "female")) for each in ("six-cables", URDF / "six-cables.urdf")
    )
    told = "1 of 6 joints on the upper arm lies beyond the wearer's elbow, by up to 30 mm."
    assert [exo.device.gaps(np.eye(3)[None]).beside for exo in (wrist, chain)] == [told, told]


#: Kind, size, half length of the capsule's axis, its direction in the shape's frame, and its radius, m.
SHAPES = (
    ("sphere", (0.03,), 0.0, 2, 0.03),
    ("cylinder", (0.02, 0.12), 0.06, 2, 0.02),
    ("capsule", (0.015, 0.08), 0.04, 2, 0.015),
    ("box", (0.04, 0.20, 0.03), 0.10, 1, 0.025),
    ("box", (0.30, 0.06, 0.08), 0.15, 0, 0.05),
    ("ellipsoid", (0.02, 0.03, 0.11), 0.08, 2, 0.03),
    ("ellipsoid", (0.12, 0.02, 0.05), 0.07, 0, 0.05),
)


def with_shape(**changes):
    """The serial device with one shape alone."""
    chain = ep.load(URDF / "serial-y-x-z.urdf").chain
    shape = replace(chain.description.shapes[0], **changes)
    return ep.ShoulderExo.from_chain(ep.ClosedChain(chain.model, replace(chain.description, shapes=(shape,))))


def body(torso, arm):
    """Points with a radius on the torso and on the arm, m."""
    rows = [np.concatenate([places, places, np.full((len(places), 1), size)], axis=1) for places, size in (torso, arm)]
    return ep.BodyShape(torso=rows[0], arm=rows[1])


@pytest.mark.parametrize(("kind", "size", "half", "axis", "radius"), SHAPES)
def test_a_shape_is_its_capsule_wherever_it_is(kind, size, half, axis, radius):
    rng = np.random.default_rng(len(size) + axis)
    link, at, turn = "link_2", rng.uniform(-0.1, 0.1, 3), Rotation.random(rng=rng)
    place = {"translation": tuple(at.tolist()), "quaternion": tuple(turn.as_quat().tolist())}
    exo = with_shape(frame=link, kind=kind, size=size, **place)
    poses = exo.pose([20.0, 70.0], [40.0, 10.0], [30.0, -10.0])
    for k, q in enumerate(exo.configurations(poses)):
        place, R = exo.chain.placement(q, link), poses[k].as_matrix()
        ends = [place.act(at + sign * half * turn.as_matrix()[:, axis]) for sign in (-1.0, 1.0)]
        line = ends[1] - ends[0]
        for torso, arm in rng.normal(size=(4, 2, 3)) * 0.3:
            found = exo.device.gaps(R[None], body=body((torso[None], 0.01), (arm[None], 0.04)))
            for part, (point, thick) in enumerate(((R @ arm, 0.04), (torso, 0.01))):
                share = np.clip((point - ends[0]) @ line / max(line @ line, 1e-30), 0.0, 1.0)
                far = np.linalg.norm(point - ends[0] - share * line) - radius - thick
                assert found.least[0, part] == pytest.approx(far, abs=1e-12)
            assert np.isinf(found.least[0, 2])
    # Points on the surface of the shape lie inside.
    points = rng.normal(size=(20, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    extents = {"sphere": np.ones(3) * size[0], "ellipsoid": np.array(size), "box": np.array(size) / 2.0}
    if kind == "box":
        points = points / np.abs(points).max(axis=1)[:, None]
    if kind in extents:
        own = np.array([place.act(spot) for spot in turn.apply(points * extents[kind]) + at])
        for spot in own:
            assert exo.device.gaps(R[None], body=body((spot[None], 0.0), (spot[None], 0.0))).least[0, 1] <= 1e-9


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_of_more_than_three_parts_the_number_is_given(count):
    said = ("a passes", "a and b pass", "a, b and c pass", "4 links pass")
    assert named(["a", "b", "c", "d"][:count], "links") == f"{said[count - 1]} through"


def test_nothing_is_known_of_the_gaps_of_a_limb_without_a_radius():
    exo = ep.load("four-linear-actuators-worn")
    bare = exo.replace(limbs=[exo.limbs[0], replace(exo.limbs[1], actuator=None), *exo.limbs[2:]])
    gaps = bare.device.gaps(exo.pose([10.0, 50.0]).as_matrix())
    assert gaps.unknown == ("radius of limb 2 (family of the actuator, or limb_radius)",)
    assert np.isnan(gaps.least).all()
    assert np.isnan(gaps.each(np.arange(2))).all()
    assert gaps.words == ""
