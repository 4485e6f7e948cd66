"""Steps of the search for a posture, on functions of two slides whose steps are known by hand."""

from types import SimpleNamespace

import mechanisms
import numpy as np
import pytest
from mechanisms import four_bar
from posture_functions import INF, NONE, Function, bowl, circle, problem, sliders

from exo_pin.chain.postures.constrained_minimum import (
    STATIONARY,
    Minimum,
    _moving,
    _point,
    minimum,
)

pytestmark = pytest.mark.usefixtures("plain")


def trials(objective, start=(0.0, 0.0), **options):
    """The minimum and the places along x that the search tried, without those where it stays."""
    found = minimum(problem(objective, **options), np.array(start))
    places = [q[0] for q in objective.tried]
    return found, [x for k, x in enumerate(places) if k == 0 or x != places[k - 1]]


def test_steps_of_a_bowl_double_from_a_tenth_to_four_tenths_and_end_with_newtons():
    found, places = trials(bowl((2.0, 0.0)))
    np.testing.assert_allclose(places[:8], [0.0, 0.1, 0.3, 0.7, 1.1, 1.5, 1.9, 2.0], atol=1e-9)
    assert len(places) <= 9  # one more for the rounding of the differences
    np.testing.assert_allclose(found.q, [2.0, 0.0], atol=1e-12)
    assert found.kkt <= 1e-13
    assert found.doubts == ()
    # At the minimum already nothing is tried but the place itself.
    _, places = trials(bowl((0.0, 0.0)))
    assert places == [0.0]


@pytest.mark.parametrize(("share", "second"), [(0.74, 0.2), (0.76, 0.3), (2e-4, 0.2)])
def test_steps_double_where_at_least_three_quarters_of_the_promise_is_kept(share, second):
    _, places = trials(bowl((2.0, 0.0), share))
    np.testing.assert_allclose(places[:3], [0.0, 0.1, second], atol=1e-9)


@pytest.mark.parametrize("share", [5e-5, 0.0, -1.0])
def test_a_step_that_keeps_less_than_a_ten_thousandth_is_quartered_until_it_is_rounding(share):
    found, places = trials(bowl((2.0, 0.0), share))
    sizes = np.array(places[1:])
    np.testing.assert_allclose(sizes[:6], 0.1 * 0.25 ** np.arange(6), rtol=1e-6)
    assert sizes.min() > 0.9e-13
    assert sizes.min() < 1e-12
    assert found.q[0] == 0.0
    assert found.kkt == pytest.approx(2.0)
    assert "hold to 2.0e+00 only" in found.doubts[0]


def test_a_step_within_the_radius_leaves_the_radius():
    """A stiff start: Newton's step is half the radius; behind it the slope is steep."""
    slope = lambda x: x - 0.05 if x < 0.02 else -10.0  # noqa: E731
    value = lambda x: 0.5 * (x - 0.05) ** 2 if x < 0.02 else -10.0 * x  # noqa: E731
    objective = Function(lambda q: value(q[0]), lambda q: np.array([slope(q[0]), q[1]]))
    _, places = trials(objective)
    np.testing.assert_allclose(places[1:4], [0.05, 0.15, 0.35], atol=1e-6)


def test_the_search_ends_after_a_hundred_steps():
    """A slope without an end, in steps of at most 0.4."""
    found, places = trials(Function(lambda q: -float(q[0]), lambda q: np.array([-1.0, 0.0])))
    assert len(places) == 101
    assert found.q[0] == pytest.approx(0.1 + 0.2 + 98 * 0.4, rel=1e-3)


def test_scale_of_kkt_and_of_curvature():
    found, _ = trials(bowl((2.0, 0.0), -1.0, scale=5.0))
    assert found.kkt == pytest.approx(0.4)
    # No scale at all is one.
    found, _ = trials(bowl((2.0, 0.0), -1.0, scale=0.0))
    assert found.kkt == pytest.approx(2.0)
    for curvatures, scale, expected in (((4.0, 1.0), 1.0, 0.25), ((1e-5, 2e-5), 1.0, 0.01), ((-1.0, 4.0), 2.0, -0.25)):
        found, _ = trials(bowl((0.0, 0.0), 1.0, curvatures, scale), limited=True, held=NONE)
        if expected < 0.0:
            continue
        assert found.curvature == pytest.approx(expected, rel=1e-4)
        assert found.idle == ()
    # No curvature, but no slope either: the joint is idle.
    found, _ = trials(bowl((0.05, 0.0), 1.0, (1.0, 1e-9)))
    assert found.idle == ("z",)
    assert abs(found.curvature) < 1e-7
    found, _ = trials(bowl((0.05, 0.0), 1.0, (1.0, 1e-5)))
    assert found.idle == ()
    assert found.curvature == pytest.approx(1e-5, rel=1e-3)
    # Nothing can move.
    found = minimum(problem(bowl((1.0, 1.0)), held=np.arange(2)), np.zeros(2))
    assert (found.curvature, found.kkt, found.at_limits) == (INF, 0.0, ())


def test_doubts_name_steps_that_stopped_and_saddles():
    def answer(kkt, curvature):
        return Minimum(np.zeros(2), 0.0, kkt, curvature, (), (), ("elbow", "wrist")).doubts

    assert answer(STATIONARY, 0.0) == ()
    assert answer(0.5 * STATIONARY, -0.9e-7) == ()
    assert len(answer(1.01 * STATIONARY, 1.0)) == 1
    assert "conditions" in answer(np.nan, 1.0)[0]
    (text,) = answer(0.0, -2e-7)
    assert "saddle (least curvature -2.0e-07" in text
    (text,) = answer(1.0, -1.0)
    assert "elbow, wrist could still move" in text


def test_a_saddle_is_left_along_its_falling_way():
    """x⁴/4 - x²/2 has its minima at one and minus one, its saddle at zero."""
    objective = Function(
        lambda q: float(q[0] ** 4 / 4 - q[0] ** 2 / 2 + q[1] ** 2), lambda q: np.array([q[0] ** 3 - q[0], 2 * q[1]])
    )
    found, places = trials(objective)
    assert abs(places[1]) == pytest.approx(1e-4)  # a thousandth of the first radius
    assert abs(found.q[0]) == pytest.approx(1.0, abs=1e-12)
    assert found.curvature == pytest.approx(1.0, rel=1e-6)
    assert found.doubts == ()


def test_limits_stop_a_search_and_balance_its_slope():
    state = sliders(low=(-1.0, -INF), high=(0.25, 3.0))
    objective = bowl((2.0, 1.0))
    found = minimum(problem(objective, state, limited=True), np.zeros(2))
    np.testing.assert_allclose(found.q, [0.25, 1.0], atol=1e-12)
    assert found.at_limits == ("x",)
    assert found.kkt <= 1e-12
    assert found.curvature == pytest.approx(1.0)
    below = minimum(problem(bowl((-2.0, 1.0)), state, limited=True), np.zeros(2))
    np.testing.assert_allclose(below.q, [-1.0, 1.0], atol=1e-12)
    assert below.at_limits == ("x",)
    both = minimum(problem(bowl((-2.0, 5.0)), state, limited=True), np.zeros(2))
    np.testing.assert_allclose(both.q, [-1.0, 3.0], atol=1e-12)
    assert both.at_limits == ("x", "z")
    # A limit that is not reached, or that the minimum leaves, pushes nothing.
    free = minimum(problem(bowl((-0.5, 1.0)), state, limited=True), np.array([0.25, 0.0]))
    np.testing.assert_allclose(free.q, [-0.5, 1.0], atol=1e-12)
    assert free.at_limits == ()
    beyond = minimum(problem(objective, state), np.zeros(2))
    np.testing.assert_allclose(beyond.q, [2.0, 1.0], atol=1e-12)


@pytest.mark.parametrize(("room", "active"), [(0.0, True), (0.9e-9, True), (1.1e-9, False), (1e-3, False)])
def test_a_limit_is_reached_within_a_billionth(room, active):
    state = sliders(low=(-5.0, -INF), high=(1.0, INF))
    at = _point(problem(bowl((2.0, 0.0)), state, limited=True), np.array([1.0 - room, 0.0]))
    # Rows: the upper limits, then the lower ones, of x alone; y is along the motions, of any sign.
    assert at.stops.ends.tolist() == [0, 0]
    assert at.stops.sign.tolist() == [1.0, -1.0]
    np.testing.assert_allclose(at.stops.room, [room, 6.0 - room], atol=1e-15)
    np.testing.assert_allclose(at.stops.rows, [at.motions[0], -at.motions[0]])
    assert at.stops.active.tolist() == [active, False]
    assert at.kkt == pytest.approx(0.0 if active else 1.0 + room, abs=1e-12)
    assert minimum(problem(bowl((1.0 - room, 0.0)), state, limited=True), at.motions @ at.motions.T @ [
        1.0 - room, 0.0,
    ]).at_limits == (("x",) if active else ())  # fmt: skip


def test_only_limits_that_a_motion_meets_are_stops():
    state = sliders(low=(-INF, -2.0), high=(1.0, 0.5))
    for held, limited, ends in ((NONE, True, [0, 1, 1]), (np.array([1]), True, [0]), (NONE, False, [])):
        stops = _point(problem(bowl((2.0, 0.0)), state, held, limited), np.zeros(2)).stops
        assert stops.ends.tolist() == ends
        assert [len(part) for part in stops] == 4 * [len(ends)]
        assert stops.sign.tolist() == [1.0, 1.0, -1.0][: len(ends)]


def test_a_slope_away_from_a_limit_counts():
    state = sliders(low=(-5.0, -INF), high=(1.0, INF))
    at = _point(problem(bowl((0.5, 0.0)), state, limited=True), np.array([1.0, 0.0]))
    assert at.kkt == pytest.approx(0.5)


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.2])
def test_curvature_on_a_circle_is_that_of_the_function_and_of_the_way(angle):
    """f = g·q + ½ c·q² on radius r: f'' = tᵀ c t - n·(g + c q)/r along the way."""
    state, r, g, c = circle(), 0.5, np.array([0.4, -1.1]), np.array([2.0, 0.7])
    q = r * np.array([np.cos(angle), np.sin(angle)])
    n, t = q / r, np.array([-np.sin(angle), np.cos(angle)])
    objective = Function(lambda q: float(g @ q + 0.5 * c @ q**2), lambda q: g + c * q, 3.0)
    at = _point(problem(objective, state), q)
    unit = at.motions[:, 0]
    size = np.linalg.norm(unit)
    np.testing.assert_allclose(np.abs(unit), size * np.abs(t), atol=1e-12)
    assert at.gradient[0] == pytest.approx(unit @ (g + c * q))
    assert at.kkt == pytest.approx(abs(at.gradient[0]) / 3.0)
    assert at.value == pytest.approx(objective._value(q))
    expected = size**2 * (c @ t**2 - n @ (g + c * q) / r)
    np.testing.assert_allclose(at.matrix, [[expected]], rtol=1e-8, atol=1e-9)


def test_curvature_on_redundant_loops_is_that_of_the_closed_way():
    named = four_bar()
    chain = named.chain()
    state, q = chain._state, chain.close(named.q, tolerance=1e-14)
    g = np.array([0.7, -0.2, 0.4])
    at = _point(problem(Function(lambda q: float(g @ q), lambda q: g), state), q)
    h = 1e-3
    ends = [g @ chain.close(q + s * h * at.motions[:, 0], tolerance=1e-14) for s in (1, 0, -1)]
    assert abs(at.matrix[0, 0]) > 1e-3
    np.testing.assert_allclose(at.matrix, [[(ends[0] - 2 * ends[1] + ends[2]) / h**2]], rtol=1e-4)
    assert at.gradient[0] == pytest.approx((ends[0] - ends[2]) / (2 * h), rel=1e-4)


def test_weight_on_a_circle_ends_below():
    state = circle()
    objective = Function(lambda q: float(q[1]), lambda q: np.array([0.0, 1.0]))
    found = minimum(problem(objective, state), np.array([0.5, 0.0]))
    np.testing.assert_allclose(found.q, [0.0, -0.5], atol=1e-10)
    assert found.curvature == pytest.approx(1.0)
    assert len(objective.tried) < 25


@pytest.mark.parametrize("length", [0.1, 10.0])
def test_joints_that_move_do_so_by_a_share_of_the_characteristic_length(length):
    state = mechanisms.sliders(length).chain()._state
    point = SimpleNamespace(motions=np.eye(3))
    ways = 1e-3 * state.topology.length * np.array([[0.9, 0.0, 1.1], [0.5, -1.1, 0.0]]).T
    found = _moving(SimpleNamespace(state=state), point, ways, 1e-3)
    assert found == tuple(str(state.model.names[1 + k]) for k in (1, 2))
