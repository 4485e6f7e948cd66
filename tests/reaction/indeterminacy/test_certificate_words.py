"""Sentences of certificates, of cautions and of ranges, from records that are written down, and ends of intervals."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy

import exo_pin as ep
from exo_pin.reaction import Certificate, Components, ForceRange
from exo_pin.reaction.effort_sharing import EffortSharing
from exo_pin.reaction.holding.cautions import _large_side_forces, _of_device, _slack
from exo_pin.reaction.holding.force_range import (
    _along_directions,
    _at_vertices,
    _ForceSets,
    _is_unbounded,
    _least,
    _sphere,
)
from exo_pin.reaction.indeterminacy.certificate import is_determined
from exo_pin.reaction.indeterminacy.component_assumptions import Freedom, _end, _ranges

NAN, INF = np.nan, np.inf


def components(actuators, intervals, needed=("luck",)):
    """Of two poses: the first three components as given, the rest unique."""
    f = np.array(actuators)
    ends = np.array(intervals, dtype=float)
    unique, none = np.full((2, 3), "unique"), np.full((2, 3, 2), NAN)
    return Components(f, unique, unique, ends, none, none, needed)


def test_components_word_by_word():
    ends = [[[1.0, 2.0], [-0.004, 30.0], [0.0, INF]], [[0.5, 1.5], [3.0, 4.0], [NAN, NAN]]]
    mixed = components([["optimiser", "unique", "bounded"], ["optimiser", "bounded", "none"]], ends)
    rest = "g_1, g_2, g_3, F_s x, F_s y, F_s z"
    assert str(mixed) == (
        f"Unique by equilibrium: f_2 (1 of 2 poses), {rest}. Chosen by an optimiser: f_1. Bounded only, other values "
        "do as well: f_2 (1 of 2 poses), f_3 (1 of 2 poses). Without an answer: f_3 (1 of 2 poses). Between bounds: "
        "f_1 0.50 to 2.00 N, f_2 3.00 to 4.00 N, f_3 0.00 to inf N. To determine them: luck."
    )
    open_ = components([["assumed"] * 3] * 2, [[[-INF, INF], [NAN, NAN], [-0.0049, 0.006]]] * 2, ())
    assert str(open_) == (
        f"Unique by equilibrium: {rest}. Fixed by the assumption of the split: f_1, f_2, f_3. Between bounds: f_3 0.00 "
        "to 0.01 N."
    )
    sure = components([["unique"] * 3] * 2, np.zeros((2, 3, 2)))
    assert "To determine" not in str(sure)
    assert "Between bounds" not in str(sure)


def certificate(undetermined, f, g, shoulder, torso=True, **more):
    flags = (np.array(flag) for flag in (f, g, shoulder, torso))
    return Certificate(np.array(undetermined), np.array(0), *flags, "a wish", **more)


def test_statements_word_by_word():
    assert certificate(-1, False, False, False).statement == "The arm cannot be held in this pose."
    assert certificate([-1, -1], [False] * 2, [False] * 2, [False] * 2).statement == "No pose has a solution."
    sure = certificate([0, -1], [True, False], [True, False], [True, False], [True, False])
    assert str(sure) == "Equilibrium determines every reaction."
    one = certificate(3, [True, True], [False, True], False)
    assert str(one) == (
        "Equilibrium alone does not determine 3 of the reactions. Determined: limb forces f, total wrench on the "
        "torso. Not determined: side forces g, shoulder force F_s. Assumed: a wish."
    )
    some = certificate([1, 0, 3, -1], [[True]] * 3 + [[False]], [[True]] * 4, [[True]] * 4, [True] * 4)
    assert some.statement == (
        "Equilibrium alone does not determine 0 to 3 of the reactions. Determined: limb forces f, side forces g, "
        "shoulder force F_s, total wrench on the torso. Not determined: none."
    )
    assert str(some).endswith("Not determined: none. Assumed: a wish.")
    other = certificate([2], [[False]], [[False]], [[False]], [False], words=("efforts", "structure"))
    assert "Determined: none. Not determined: efforts, structure, shoulder force F_s" in other.statement
    with pytest.raises(ep.InvalidInput, match="comes with the answer"):
        _ = other.components


def test_what_no_self_stress_changes_is_determined():
    np.testing.assert_array_equal(
        is_determined(np.array([[0.0, 1e-10], [0.0, -1e-8], [2.0, 0.0], [0.0, 0.0]])), [True, False, False, True]
    )
    assert is_determined(np.zeros((2, 0))).all()


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_ends_of_intervals_are_those_of_all_corners(count):
    """Against the corners of the limits, by enumeration: an end of a bounded program lies in one."""
    rng = np.random.default_rng(count)
    for k in range(4):
        rows = np.vstack([np.eye(count), rng.normal(size=(3, count))])
        lower, upper = -rng.uniform(0.1, 3.0, len(rows)), rng.uniform(0.1, 3.0, len(rows))
        effect = rng.normal(size=count) * (k > 0)
        points = [np.zeros(count)]
        if count:
            G, h = np.vstack([rows, -rows]), np.concatenate([upper, -lower])
            points = []
            for active in np.array(np.meshgrid(*[np.arange(len(G))] * count)).reshape(count, -1).T:
                if abs(np.linalg.det(G[active])) > 1e-9:
                    point = np.linalg.solve(G[active], h[active])
                    points += [point] if (G @ point <= h + 1e-9).all() else []
        values = [effect @ point for point in points]
        assert _end(effect, rows, lower, upper, 1.0) == pytest.approx(min(values), abs=1e-8)
        assert _end(effect, rows, lower, upper, -1.0) == pytest.approx(max(values), abs=1e-8)
        # In units of nanonewtons as of giganewtons.
        assert _end(effect, rows, 1e9 * lower, 1e9 * upper, -1.0) == pytest.approx(1e9 * max(values), rel=1e-8)


@pytest.mark.parametrize("count", [1, 2])
def test_ends_without_limits_or_without_room(count):
    rows, free, none = np.eye(count), np.full(count, INF), np.zeros(count)
    one = np.eye(count)[0]
    for sign in (1.0, -1.0):
        assert _end(one, rows, -free, free, sign) == -sign * INF
        assert _end(-one, rows, -free, free, sign) == -sign * INF
        twice = np.vstack([rows, one])
        assert np.isnan(_end(one, twice, np.append(none + 1.0, -2.0), np.append(none + 2.0, -1.0), sign))
        assert _end(none, rows, none - 1.0, none + 1.0, sign) == 0.0
    half = np.where(one == 1.0, 0.0, -INF), np.where(one == 1.0, INF, INF)
    assert _end(one, rows, *half, 1.0) == pytest.approx(0.0)
    assert _end(one, rows, *half, -1.0) == INF
    assert _end(-2.0 * one, rows, *half, -1.0) == pytest.approx(0.0)
    # Rows that no variable moves hold or do not hold; to rounding they do.
    more = np.vstack([rows, np.zeros((1, count))])
    for slack, expected in ((-1e-12, -1.0), (-1e-3, NAN)):
        found = _end(one, more, np.append(none - 1.0, -1.0), np.append(none + 1.0, slack), 1.0)
        assert found == pytest.approx(expected, nan_ok=True)
        found = _end(one, more, np.append(none - 1.0, -slack), np.append(none + 1.0, 1.0), 1.0)
        assert found == pytest.approx(expected, nan_ok=True)
    touching = _end(one, rows, none + 1.0, none + 1.0 - 1e-13, 1.0)
    assert touching == pytest.approx(1.0)


def test_ranges_without_limits_of_the_tensions_are_sums_of_boxes():
    of_f, of_g, of_shoulder = (
        np.array([[1.0, -2.0], [0.0, 1e-11]]),
        np.array([[0.0, 1.0], [0.0, 0.0]]),
        np.zeros((3, 2)),
    )
    freedom = Freedom(1, of_f, of_g, of_shoulder, None, None)
    box = np.array([-1.0, 0.0]), np.array([3.0, INF])
    np.testing.assert_array_equal(_ranges(freedom, box, None), [[-INF, 3.0], [0.0, 0.0], [0.0, INF], *[[0.0, 0.0]] * 4])
    np.testing.assert_array_equal(freedom.of_tensions[:2], of_f[:, :1])
    # With limits of f the first may not fall by more than 4 N.
    cut = np.array([-4.0, -INF]), np.array([INF, INF])
    np.testing.assert_allclose(
        _ranges(freedom, box, cut), [[-4.0, 3.0], [0.0, 0.0], [0.0, 3.5], *[[0.0, 0.0]] * 4], atol=1e-9
    )


def test_what_leaves_the_shoulder_force_as_it_is():
    rng = np.random.default_rng(3)
    for columns in (0, 1, 3, 5):
        effect = rng.normal(size=(3, columns))
        rest = Freedom(0, np.zeros((2, columns)), np.zeros((2, columns)), effect, None, None).without_shoulder()
        assert rest.shape == (columns, max(0, columns - 3))
        np.testing.assert_allclose(effect @ rest, 0.0, atol=1e-12)
        np.testing.assert_allclose(rest.T @ rest, np.eye(rest.shape[1]), atol=1e-12)
    # An effect counts beside the largest one, and so does a rank that is lost.
    for size in (1e-6, 1.0, 1e6):
        for least, left in ((1e-8, 2), (1e-10, 3)):
            ways = np.linalg.qr(rng.normal(size=(5, 5)))[0]
            effect = size * np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag([1.0, 0.5, least]) @ ways[:3]
            rest = Freedom(0, np.zeros((2, 5)), np.zeros((2, 5)), effect, None, None).without_shoulder()
            assert rest.shape == (5, left)


def box_sets(low, high, force, effect, scale=2.0):
    """Sets of forces in a box."""
    d = len(low)
    rows, ends = np.vstack([np.eye(d), -np.eye(d)]), np.concatenate([high, -np.array(low)])
    acts = np.isfinite(ends)
    return _ForceSets(rows[acts], ends[acts], np.array(force), np.array(effect), scale)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_least_and_greatest_force_of_a_box(d):
    rng = np.random.default_rng(d)
    for size in (1.0, 1e-3):
        low, high = -rng.uniform(0.1, 2.0, d), rng.uniform(0.1, 2.0, d)
        force, effect = 3.0 * size * rng.normal(size=3), size * rng.normal(size=(3, d))
        sets = box_sets(low, high, force, effect)
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(d, -1)
        sizes = np.linalg.norm(force[:, None] + effect @ corners, axis=0)
        np.testing.assert_allclose(np.sort(_at_vertices(sets)), np.sort(sizes), rtol=1e-12)
        least = scipy.optimize.lsq_linear(effect, -force, (low, high), tol=1e-14, method="bvls")
        assert _least(sets) == pytest.approx(2.0 * np.sqrt(2.0 * least.cost), rel=1e-7)
        found, bound = _along_directions(sets)
        assert found <= 2.0 * sizes.max() * (1.0 + 1e-12)
        assert bound >= 2.0 * sizes.max() * (1.0 - 1e-12)
        assert 0.9 * bound <= found
        assert not _is_unbounded(sets)
        for side in (low, high):
            far = np.where(np.arange(d) == d - 1, INF if side is high else -INF, side)
            open_ = box_sets(far if side is low else low, far if side is high else high, force, effect)
            assert _is_unbounded(open_)
            still = open_._replace(effect=effect * (np.arange(d) < d - 1))
            assert not _is_unbounded(still)
    nothing = sets._replace(rows=np.zeros((0, d)), ends=np.zeros(0))
    assert _is_unbounded(nothing)
    assert _at_vertices(nothing).size == 0


def test_directions_cover_the_sphere_as_closely_as_they_say():
    directions, cosine = _sphere()
    assert directions.shape == (64, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(directions.T @ directions / 64.0, np.eye(3) / 3.0, atol=0.005)
    rng = np.random.default_rng(1)
    tried = rng.normal(size=(20000, 3))
    nearest = (tried / np.linalg.norm(tried, axis=1)[:, None] @ directions.T).max(axis=1).min()
    assert cosine <= nearest + 1e-12 < cosine + 0.01
    assert cosine > np.cos(np.radians(22.0))


def test_ranges_word_by_word():
    def told(*ends):
        return ForceRange(*(np.array(end) for end in ends))

    assert str(told(NAN, NAN, NAN)) == "no set of forces is allowed"
    assert str(told(3.0, INF, INF)) == "3.0 N to unbounded"
    assert str(told(3.0, 3.0 + 1e-7, 3.0)) == "3.0 N, the only value"
    assert str(told(3.0, 3.001, 3.001)) == "3.0 to 3.0 N"
    assert str(told(3.0, 9.0, 9.0)) == "3.0 to 9.0 N"
    assert str(told(3.0, 9.0, 8.0)) == "3.0 to at most 9.0 N (at least 8.0 N)"
    assert str(told(0.0, 1e-10, 1e-10)) == "0.0 N, the only value"
    assert told([0.0, 1.0], [1e-8, 1.0], [0.0, 1.0]).is_single.tolist() == [False, True]
    stack = told([1.0, NAN, 2.0], [4.0, NAN, 9.0], [4.0, NAN, 9.0])
    assert str(stack) == "3 poses, largest |F_s| of the allowed forces 9.0 N"
    assert str(told([1.0, 2.0], [INF, 7.0], [INF, 7.0])).endswith("forces 7.0 N; unbounded in 1")
    assert str(told([1.0], [INF], [INF])) == "1 poses, largest |F_s| of the allowed forces -; unbounded in 1"


def source(values, lower=0.0, upu=None, **poses):
    """What cautions ask of an answer."""
    values = np.array(values, dtype=float)
    limits = SimpleNamespace(lower=np.full((len(values), 2), lower))
    held = np.ones(len(values), dtype=bool)
    limb = SimpleNamespace(actuator=object())
    mechanism = SimpleNamespace(
        limb_count=2, limbs=(limb, limb), limb_words=lambda numbers: f"limbs {numbers}", is_upu=np.zeros(2, dtype=bool)
    )
    return SimpleNamespace(values=values, held=held, poses=SimpleNamespace(mechanism=mechanism, limits=limits, **poses))


def test_cautions_of_slack_limbs_and_large_side_forces():
    def slack(values, lower=0.0):
        own = source(values, lower)
        return list(_slack(own.poses.mechanism, own, own.held))

    rest = "slack: a least_tension of the actuator keeps a limb taut."
    assert slack([[0.0, 10.0, 0, 0, 1, 1, 1]]) == [f"Limbs [1] is {rest}"]
    assert slack([[1e-8, 10.0, 0, 0, 1, 1, 1]]) == [f"Limbs [1] is {rest}"]
    assert slack([[1e-7, 10.0, 0, 0, 1, 1, 1]]) == []
    assert slack([[0.0, 10.0, 0, 0, 1, 1, 1]], lower=-5.0) == []
    both = [[0.0, 10.0, 0, 0, 1, 1, 1], [9.0, 0.0, 0, 0, 1, 1, 1], [9.0, 9.0, 0, 0, 1, 1, 1]]
    taut = rest.removeprefix("slack")
    assert slack(both) == [f"Limbs [1, 2] are slack in 2 of 3 held poses{taut}"]
    assert slack(both[1:]) == [f"Limbs [2] is slack in 1 of 2 held poses{taut}"]

    def large(sides, f=(3.0, 4.0), shoulder=(6.0, 8.0, 0.0)):
        tensions = SimpleNamespace(f=np.array([f] * len(sides)), shoulder=np.array([shoulder] * len(sides)))
        own = source([[1.0, 1.0, *side, 0, 0, 0] for side in sides], tensions=tensions)
        return list(_large_side_forces(own, own.held))

    assert large([(99.0, -1.0)]) == []
    assert large([(1.0, -99.0), (1.0, -151.0), (120.0, 0.0)]) == [
        "Side forces reach 151 N, 15 times the forces without them: nothing bounds them there (constraint_bounds does)."
    ]
    assert large([(99.0, 0.0)], f=(30.0, 4.0)) == []
    assert len(large([(1e-3, 0.0)], f=(0.0, 0.0), shoulder=(0.0, 0.0, 0.0))) == 1


def test_cautions_of_a_device():
    def of_device(upu, cuff, unknown=(), free=1):
        sharing, tensions = EffortSharing(None, unknown, None), SimpleNamespace(self_stress=np.zeros((1, 4, free)))
        own = source([[10.0, -20.0, 0, 0, 1, 1, 1]], sharing=sharing, tensions=tensions)
        own.poses.mechanism.is_upu[0] = upu
        own.poses.mechanism.cuff_is_known = cuff is not None
        own.poses.mechanism.structure = SimpleNamespace(idle=0)
        return list(_of_device(own))

    assert of_device(True, "cuff") == []
    assert of_device(False, None) == []
    assert of_device(False, None, ("lift", "rope")) == [
        "Efforts in N and in N m are shared by their numbers: no limit is known of lift and rope, to compare them by."
    ]
    # With nothing to share there is nothing to compare.
    assert of_device(False, None, ("lift", "rope"), free=0) == []
    assert of_device(True, None) == [
        "Not known: where the cuff is ([roles] cuff); couples are least at the single attachments instead."
    ]


def test_what_an_answer_was_chosen_by_names_limits_and_socket_where_a_pose_keeps_them():
    exo = ep.load("four-cables")
    poses, far = exo.pose([40.0, 40.0], 20.0), np.array([0.0, 900.0])
    facing = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)

    def chosen_by(moments, **asked):
        couples = np.array(moments)[:, None] * [1.0, 0.0, 0.0]
        return exo.reaction(poses, load=ep.Load(np.zeros(3), couples), **asked).certificate.chosen_by

    plain = chosen_by(far, limits="none")
    limits, socket = ", within the limits of the limbs", ", with regard to the socket"
    assert chosen_by(far) == plain + limits
    assert chosen_by(far + 900.0) == plain
    soft = ep.GlenoidCone(orientation=facing, penalty=1.0)
    assert chosen_by(far, cone=soft) == plain + limits + socket
    assert chosen_by(far, limits="none", cone=soft) == plain + socket
