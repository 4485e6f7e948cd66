"""Tensions that are chosen, their optimality and scale, and limits that are refused."""

import numpy as np
import pytest

import exo_pin as ep

NAN, INF = np.nan, np.inf


def test_the_optimality_of_tensions_is_in_newtons():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose(60.0), limits=(20.0, 400.0))
    assert answer.source.chosen.unjudged.all()
    split, poses, f = answer.source.split, answer.source.poses, answer.actuator_forces
    best = split.judged(poses, 0, f, np.zeros(4))
    assert best.kkt < 1e-8
    assert abs(best.gap) < 1e-6
    # A step along the tensions that balance themselves costs; the gap bounds by how much, N.
    stress = poses.tensions.self_stress[0, :, 0]
    way = stress if ((f + stress) >= 20.0 - 1e-9).all() else -stress
    for step in (1.0, 5.0):
        other = f + step * way
        assert (other >= 20.0 - 1e-9).all()
        worse = split.judged(poses, 0, other, np.zeros(4))
        excess = np.linalg.norm(other) - np.linalg.norm(f)
        assert excess > 0.0
        assert worse.gap >= excess - 1e-9
        assert worse.gap <= np.linalg.norm(other)


class Given:
    """An actuator whose limits are written down, one row a pose."""

    def __init__(self, lower, upper):
        self.ends = np.array(lower, dtype=float), np.array(upper, dtype=float)

    def force_limits(self, length):
        return self.ends


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([0.0, INF], [1.0, INF], "no force can meet"),
        ([0.0, -INF], [1.0, -INF], "no force can meet"),
        ([0.0, 2.0], [1.0, 1.0], "above its upper"),
        ([0.0, -1e30], [1.0, 1.0], "more than"),
        ([0.0, 0.0], [1.0, 1e30], "more than"),
    ],
)
def test_limits_of_one_pose_that_cannot_be_meant_are_refused(lower, upper, message):
    exo = ep.load("four-cables").replace(limbs=None)
    poses = exo.pose([20.0, 30.0], 30.0)
    with pytest.raises(ep.InvalidInput, match=message):
        exo.reaction(poses, limits=[Given([0.0, 0.0], [1.0, 1.0])] * 3 + [Given(lower, upper)])
    # Where its limits are not known an actuator cannot be, so that the pose is out of its stroke.
    found = exo.reaction(poses, limits=[Given([0.0, NAN], [1e4, 2.0])] * 4)
    assert found.status.tolist() == ["ok", "out_of_stroke"]
    np.testing.assert_array_equal(found.limits.length_error[1], [INF] * 4)
