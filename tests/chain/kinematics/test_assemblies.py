"""All closed configurations of chains with some joints held: published counts, and counts by other equations."""

import numpy as np
import pytest
from singular_poses import _legs, _planar_platform


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
