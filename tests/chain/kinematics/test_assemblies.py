"""All closed configurations of chains with some joints held: published counts, and counts by other equations."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from singular_poses import _circle, _legs, _planar_platform, _spherical_3rrr


def _crossings(values, valid=True):
    """Sign changes along a closed curve, where both values are valid."""
    valid = np.broadcast_to(valid, values.shape)
    return int(((np.sign(values[1:]) != np.sign(values[:-1])) & valid[1:] & valid[:-1]).sum())


def _planar_count(base, plate, lengths):
    """Real angles of a platform on three legs R-P-R: its position is linear in the differences of the equations."""
    angle = np.linspace(0.0, 2.0 * np.pi, 100_001)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    one, other = (np.einsum("ijn,j->in", turn, plate[k]) - base[k][:, None] for k in (1, 2))
    right = [(lengths[k] ** 2 - lengths[0] ** 2 - (d * d).sum(0)) / 2 for k, d in ((1, one), (2, other))]
    determinant = one[0] * other[1] - one[1] * other[0]
    x, y = right[0] * other[1] - right[1] * one[1], one[0] * right[1] - other[0] * right[0]
    return _crossings(x * x + y * y - (lengths[0] * determinant) ** 2)


def test_a_planar_platform_on_three_legs_has_six():
    """The example of C. Innocenti and V. Parenti-Castelli with six real configurations, by another equation, too."""
    base, lengths, sides = (
        np.array([(0, 0), (15.91, 0), (0, 10)]),
        np.array([14.98, 15.38, 12.0]),
        (17.04, 16.54, 20.84),
    )
    corner = np.arccos((sides[0] ** 2 + sides[2] ** 2 - sides[1] ** 2) / (2 * sides[0] * sides[2]))
    plate = np.array([(0, 0), (sides[0], 0), (sides[2] * np.cos(corner), sides[2] * np.sin(corner))])
    assert _planar_count(base, plate, lengths) == 6
    drawn = plate + np.array([3.0, 9.0])
    chain = _planar_platform(base, drawn).chain()
    q = chain.neutral()
    for name, length, foot, tip in zip(chain.roles.actuated, lengths, base, drawn, strict=True):
        q[chain.configuration_slice(name)] = length - np.linalg.norm(tip - foot)
    found = chain.assemblies(chain.roles.actuated, q)
    assert (len(found), found.is_complete, found.unseen, found.meeting.any()) == (6, True, 0.0, False)
    assert found.hits.min() >= 3
    assert found.since * found.hits.min() >= 9 * found.hits.sum()
    assert (np.diff(found.hits) <= 0).all()
    for row in found.configurations:
        assert np.abs(chain.residual(row)).max() <= 1e-11
        held = [chain.configuration_slice(name).start for name in chain.roles.actuated]
        np.testing.assert_array_equal(row[held], q[held])
    assert "6 closed configurations from" in str(found)
    again = chain.assemblies(chain.roles.actuated, q)
    np.testing.assert_array_equal(again.configurations, found.configurations)
    # Few starts see few, and say so.
    few = chain.assemblies(chain.roles.actuated, q, starts=6)
    assert not few.is_complete
    assert few.starts == 6
    # One that is three times rarer than the rarest is missed with exp(-3): 3 * 3 * (6 + 3) = 81 = 3 hits * 27.
    rare = [
        replace(few, hits=np.array(hits), since=since) for hits, since in (([6, 3], 26), ([6, 3], 27), ([7, 2], 99))
    ]
    assert [one.is_complete for one in rare] == [False, True, False]


def _octahedral_count(feet, tips):
    """Real configurations of a 6-3 platform: each corner turns about the line of its two feet (Nanua et al. 1990)."""
    turn = np.linspace(0.0, 2.0 * np.pi, 40_001)[:, None]
    circles = []
    for a, b, tip in zip(feet[::2], feet[1::2], tips[::2], strict=True):
        axis = (b - a) / np.linalg.norm(b - a)
        centre = a + (tip - a) @ axis * axis
        u = np.cross(axis, [0.0, 0.0, 1.0])
        u /= np.linalg.norm(u)
        circles.append((centre, np.linalg.norm(tip - centre), u, np.cross(axis, u)))
    corner, (one, two, three) = tips[::2], circles
    first = one[0] + one[1] * (np.cos(turn) * one[2] + np.sin(turn) * one[3])

    def beside(circle, side):
        centre, radius, u, v = circle
        d = centre - first
        a, b, c = 2 * radius * d @ u, 2 * radius * d @ v, side**2 - radius**2 - (d * d).sum(-1)
        size, middle = np.hypot(a, b), np.arctan2(b, a)
        half = np.arccos(np.clip(c / size, -1.0, 1.0))
        for angle in ((middle + half)[:, None], (middle - half)[:, None]):
            yield centre + radius * (np.cos(angle) * u + np.sin(angle) * v), np.abs(c) <= size

    side = [np.linalg.norm(corner[i] - corner[k]) for i, k in ((0, 1), (0, 2), (1, 2))]
    return sum(
        _crossings(np.linalg.norm(p - r, axis=1) - side[2], ok & fine)
        for p, ok in beside(two, side[0])
        for r, fine in beside(three, side[1])
    )


@pytest.mark.parametrize(("seed", "count"), [(None, 8), (8, 12)])
def test_an_octahedral_platform_has_as_many_as_circles_that_meet(seed, count):
    feet, tips = _circle(0.3, np.array([-20, 20, 100, 140, 220, 260])), _circle(0.2, np.array([0, 120, 240]), 0.35)
    if seed is not None:
        rng = np.random.default_rng(0)
        for _ in range(seed + 1):
            moved = feet + rng.normal(size=(6, 3)) * [0.03, 0.03, 0.0]
            tips = _circle(rng.uniform(0.1, 0.4), np.array([0, 120, 240]), rng.uniform(0.1, 0.5))
            tips = tips + rng.normal(size=(3, 3)) * 0.05
        feet = moved
    tips = np.repeat(tips, 2, axis=0)
    assert _octahedral_count(feet, tips) == count
    chain = _legs(feet, tips).chain()
    # A universal joint may be turned over: the platform alone counts.
    found = chain.assemblies(chain.roles.actuated, frame="link_3")
    assert (len(found), found.is_complete) == (count, True)


def test_a_spherical_3rrr_has_eight():
    """The most that C. M. Gosselin, J. Sefrioui and M. J. Richard (1994) give; orientations by Newton's method, too."""
    rng = np.random.default_rng(127)
    tips, elbows = (np.array([v / np.linalg.norm(v) for v in rng.normal(size=(3, 3))]) for _ in range(2))
    wanted, turns = (elbows * tips).sum(1), Rotation.random(400, random_state=0).as_matrix()
    for _ in range(60):
        seen = np.einsum("nij,kj->nki", turns, tips)
        off, J = np.einsum("nki,ki->nk", seen, elbows) - wanted, np.cross(seen, elbows[None])
        matrix = np.swapaxes(J, 1, 2) @ J + (1e-12 + 0.1 * (off**2).sum(1))[:, None, None] * np.eye(3)
        step = -np.linalg.solve(matrix, np.swapaxes(J, 1, 2) @ off[..., None])[..., 0]
        turns = Rotation.from_rotvec(np.clip(step, -1.0, 1.0)).as_matrix() @ turns
    roots = np.unique(np.round(turns[np.abs(off).max(1) < 1e-12], 5), axis=0)
    chain = _spherical_3rrr(elbows, tips).chain()
    found = chain.assemblies(chain.roles.actuated, frame="link_2")
    assert len(found) == len(roots) == 8


#: P. Dietmaier, The Stewart-Gough platform of general geometry can have 40 real postures, in Advances in Robot
#: Kinematics (1998): feet, tips and lengths, six decimals.
_FEET = [
    (0, 0, 0), (1.107915, 0, 0), (0.549094, 0.756063, 0), (0.735077, -0.223935, 0.525991),
    (0.514188, -0.526063, -0.368418), (0.590473, 0.094733, -0.205018),
]  # fmt: skip
_TIPS = [
    (0, 0, 0), (0.542805, 0, 0), (0.956919, -0.528915, 0), (0.665885, -0.353482, 1.402538),
    (0.478359, 1.158742, 0.107672), (-0.137087, -0.235121, 0.353913),
]  # fmt: skip
_LENGTHS = (1.0, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071)


@pytest.mark.full
def test_dietmaiers_forty_are_found():
    """A general platform on six legs with forty real postures, the most; several lie within 1e-3 of each other."""
    drawn = np.array(_TIPS) + np.array([0.1, 0.2, 1.5])
    chain = _legs(_FEET, drawn).chain()
    q = chain.neutral()
    for name, length, foot, tip in zip(chain.roles.actuated, _LENGTHS, _FEET, drawn, strict=True):
        q[chain.configuration_slice(name)] = length - np.linalg.norm(tip - foot)
    found = chain.assemblies(chain.roles.actuated, q, frame="link_3", starts=8192)
    assert len(found) == 40
    assert max(np.abs(chain.residual(row)).max() for row in found.configurations) <= 1e-11
