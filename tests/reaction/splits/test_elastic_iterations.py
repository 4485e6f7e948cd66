"""Steps of the elastic split within limits: searches for a geometry, loads of guides, poses with a choice."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.reaction import elastic_poses
from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.elastic_poses import ElasticPoses, _fixed_point


def test_a_zero_with_a_kink_is_found_from_where_small_steps_lead():
    """The way leads on by steps with a jump in them; where there is no zero, none is given."""
    scale = np.array([1e-3, 1.0])

    def apart(y):
        x = y * scale
        led = np.array([1e-3 if x[1] > -0.5 else 2e-3, 0.25 * np.tanh(4.0 * x[1])])
        return (led - x) / scale

    for start in (np.array([0.0, 0.3]), np.array([5.0, -3.0]), np.array([0.0, 0.0])):
        found = _fixed_point(apart, start, scale)
        assert np.abs(apart(found) * scale).max() <= 1e-9

    def lost(y):
        return np.where(y < 0.5, 1.0, -1.0) + 0.0 * y

    with pytest.raises(ep.SolverFailed, match="elastic device within its limits"):
        _fixed_point(lost, np.array([0.0, 0.0]), scale)


def test_small_steps_go_a_share_of_the_way(monkeypatch):
    """Each search begins where twenty halves of the way lead, and the first one from the start itself."""
    begun = []

    def root(apart, near, **_):
        begun.append(np.array(near))
        zero = np.array([2.0, 2.0]) if len(begun) == 4 else np.array([50.0, 50.0])
        return SimpleNamespace(x=zero)

    monkeypatch.setattr(elastic_poses.scipy.optimize, "root", root)
    found = _fixed_point(lambda y: 0.1 * (2.0 - y), np.array([0.0, 3.0]), np.ones(2))
    np.testing.assert_array_equal(found, [2.0, 2.0])
    away = np.array([-2.0, 1.0])
    for start, share, steps in zip(begun, (0.0, 0.5, 0.25, 0.1), (0, 20, 40, 100), strict=True):
        np.testing.assert_allclose(start, 2.0 + away * (1.0 - 0.1 * share) ** steps, rtol=1e-12)


def test_a_guide_is_loaded_by_the_larger_of_bending_and_torque():
    def guide(moment, torque):
        return SimpleNamespace(guide=SimpleNamespace(largest_bending_moment=moment, largest_torque=torque))

    limbs = (guide(2.0, 4.0), guide(None, 4.0), guide(2.0, None), guide(None, None), SimpleNamespace(guide=None))
    side = SimpleNamespace(
        stiffness=np.full((2, 5), 10.0), deflection=np.array([[0.5] * 5, [-0.1] * 5]), bending=np.full((2, 5), 0.2),
        torque=np.array([[-0.6] * 5, [0.6] * 5]),
    )  # fmt: skip
    own = SimpleNamespace(
        device=SimpleNamespace(displaced=SimpleNamespace(side=side)),
        mechanism=SimpleNamespace(limbs=limbs, limb_count=5),
        status=np.array([0, 1], dtype=np.int8),
    )
    # |g| = 5 and 1 N: bending 1 and 0.2 N m of 2, torque 3 and 0.6 N m of 4.
    expected = np.array([[0.75, 0.75, 0.5, np.nan, np.nan], [0.15, 0.15, 0.1, np.nan, np.nan]])
    np.testing.assert_allclose(ElasticPoses.guide_load.fget(own), expected)
    side.bending[:] = 0.5
    np.testing.assert_allclose(ElasticPoses.guide_load.fget(own)[0], [1.25, 0.75, 1.25, np.nan, np.nan])
    own.guide_load = ElasticPoses.guide_load.fget(own)
    ElasticPoses._mark_overloaded(own)
    assert [QUERY_STATUS[code] for code in own.status] == ["guide_overloaded", "near_singular"]
    # One without an equilibrium stays so.
    own.status[:] = QUERY_STATUS.index("no_equilibrium")
    ElasticPoses._mark_overloaded(own)
    assert (own.status == QUERY_STATUS.index("no_equilibrium")).all()


def test_which_poses_of_a_soft_device_need_a_choice():
    met = np.array([True, False, True, False, False])
    limits = SimpleNamespace(reachable=np.array([True, True, True, False, True]), met=lambda f, rows: met[rows])

    class Stack(SimpleNamespace):
        def _replace(self, **_):
            return self

    def rows(limb_count=4, locked=False, socket=None):
        displaced = SimpleNamespace(state=None, tensions=None, side=SimpleNamespace(stiffness=None))
        own = SimpleNamespace(
            status=np.array([0, 1, 0, 0, QUERY_STATUS.index("singular")], dtype=np.int8),
            split=SimpleNamespace(locked=locked, plain=lambda poses, rows: (None, None)),
            mechanism=SimpleNamespace(limb_count=limb_count),
            device=SimpleNamespace(displaced=displaced, misfit=None),
        )
        return ElasticPoses._to_limit(own, Stack(socket=socket, limits=limits)).tolist()

    # Of four limbs those whose tensions are beyond a limit, within their stroke and in equilibrium.
    assert rows() == [1]
    assert rows(3) == []
    assert rows(locked=True) == rows(locked=True, socket="cone") == []
    # A socket is looked at in all of them, with three limbs, too.
    assert rows(socket="cone") == rows(3, socket="cone") == [0, 1, 2]


@pytest.mark.parametrize("miss", [5e-10, 5e-6])
def test_a_geometry_that_its_forces_lead_to_is_not_searched_for(miss, monkeypatch):
    """Metres and radians count, whatever the scale of the unknowns."""
    searched = []

    def found(apart, start, scale):
        searched.append(start * scale)
        return (start * scale + miss) / scale

    monkeypatch.setattr(elastic_poses, "_fixed_point", found)
    monkeypatch.setattr(elastic_poses, "is_held", lambda program: program == "held")
    x = np.array([[0.0, 0.0], [0.01, -0.02]])
    for program, held in (("held", True), ("lost", False)):
        own = SimpleNamespace(
            x=x.copy(), equations=SimpleNamespace(scale=np.array([1e-3, 10.0])),
            _led_to=lambda poses, row, y: y + miss, _program=lambda poses, row, y, program=program: (program, None),
        )  # fmt: skip
        assert ElasticPoses._limit(own, None, 1) == held
        moves = held and miss > 1e-9
        np.testing.assert_allclose(own.x[1], x[1] + (miss if moves else 0.0), rtol=1e-12)
        np.testing.assert_array_equal(own.x[0], x[0])
    assert len(searched) == (2 if miss > 1e-9 else 0)
    for start in searched:
        np.testing.assert_allclose(start, x[1])
