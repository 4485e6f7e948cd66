"""Shapes of links in any place: each lies in a capsule, and points of a wearer are as far from it as by hand."""

from dataclasses import replace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.chain.structure.description import Shape

pytestmark = pytest.mark.usefixtures("plain")

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


def with_shapes(*shapes):
    """The serial device with these shapes alone."""
    chain = ep.load(URDF / "serial-y-x-z.urdf").chain
    return ep.ShoulderExo.from_chain(type(chain)(chain.model, replace(chain.description, shapes=shapes)))


def body(torso, arm):
    """Points with a radius on the torso and on the arm, m."""
    rows = [np.concatenate([places, places, np.full((len(places), 1), size)], axis=1) for places, size in (torso, arm)]
    return ep.BodyShape(torso=rows[0], arm=rows[1])


@pytest.mark.parametrize(("kind", "size", "half", "axis", "radius"), SHAPES)
def test_a_shape_is_its_capsule_wherever_it_is(kind, size, half, axis, radius):
    rng = np.random.default_rng(len(size) + axis)
    link, at, turn = "link_2", rng.uniform(-0.1, 0.1, 3), Rotation.random(rng=rng)
    exo = with_shapes(Shape(link, kind, size, tuple(at.tolist()), tuple(turn.as_quat().tolist())))
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
