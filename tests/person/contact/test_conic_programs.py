"""Cone programs with answers in closed form, and what is made of a solver that errs."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

from exo_pin.person.contact.conic import _AIMS, ACCEPTED, ConicProgram


def program(P, q, *blocks):
    made = ConicProgram(np.array(P, dtype=float), np.array(q, dtype=float))
    for cone, A, b in blocks:
        made.add(cone, np.array(A, dtype=float), np.array(b, dtype=float))
    return made


def nearest(p, *blocks):
    """The program of the point nearest to p."""
    return program(np.eye(len(p)), -np.asarray(p), *blocks)


def proved(answer):
    assert answer.is_optimal
    assert not answer.is_infeasible
    assert max(answer.kkt, answer.gap) < 1e-8
    return answer.x


@pytest.mark.parametrize("seed", range(4))
def test_nearest_point_of_a_second_order_cone(seed):
    for t, *v in np.random.default_rng(seed).normal(size=(3, 3)):
        size = np.linalg.norm(v)
        if size <= abs(t):
            expected = np.concatenate([[t], v]) if t > 0.0 else np.zeros(3)
        else:
            expected = 0.5 * (1.0 + t / size) * np.concatenate([[size], v])
        answer = nearest([t, *v], ("second_order", -np.eye(3), np.zeros(3))).solve()
        np.testing.assert_allclose(proved(answer), expected, atol=1e-4 if size <= -t else 1e-8)
        assert answer.active[0].shape == (1,)
        assert answer.active[0][0] == (size > t)


def test_nearest_point_of_a_box_and_which_bounds_hold_it():
    p = np.array([-0.7, 0.2, 1.9, 0.9, -0.1, 2.0])
    one = np.eye(6)
    answer = nearest(
        p, ("zero", one[3:4], [0.4]), ("positive", np.vstack([-one, one]), [*np.zeros(6), *np.ones(6)])
    ).solve()
    expected = np.clip(p, 0.0, 1.0)
    expected[3] = 0.4
    np.testing.assert_allclose(proved(answer), expected, atol=1e-8)
    low, high = answer.active[1][:6], answer.active[1][6:]
    assert low.tolist() == (expected == 0.0).tolist()
    assert high.tolist() == (expected == 1.0).tolist()


@pytest.mark.parametrize("worth", [0.3, 3.0, 12.0])
def test_cube_of_what_is_worth_its_price(worth):
    """t - worth * a, t >= a³, is least where 3 a² = worth."""
    cube = -np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    x = proved(program(np.zeros((2, 2)), [1.0, -worth], ("cube", cube, [0.0, 1.0, 0.0])).solve())
    a = np.sqrt(worth / 3.0)
    np.testing.assert_allclose(x, [a**3, a], rtol=1e-4)


@pytest.mark.parametrize("aim", _AIMS)
def test_either_aim_is_enough(aim):
    rng = np.random.default_rng(5)
    for _ in range(4):
        A, p = rng.normal(size=(2, 5)), rng.normal(size=5)
        made = nearest(p, ("zero", A, A @ p + 0.1), ("positive", -np.eye(5)[:2], np.ones(2)))
        closest = p + np.linalg.pinv(A) @ np.full(2, 0.1)
        if (closest[:2] < -1.0).any():
            continue
        np.testing.assert_allclose(proved(made._solve(aim)), closest, atol=1e-7)


def test_no_point_is_proved_and_no_end_is_no_answer(capfd):
    x = ("positive", [[1.0], [-1.0]], [-1.0, -1.0])
    none = program([[1.0]], [0.0], x).solve()
    assert none.is_infeasible
    assert not none.is_optimal
    endless = program([[0.0]], [-1.0], ("positive", [[-1.0]], [0.0])).solve()
    assert not endless.is_infeasible
    assert not endless.is_optimal
    assert capfd.readouterr() == ("", "")


class Told:
    """In place of Clarabel: says what it is told, and notes what it was asked."""

    def __init__(self, *answers):
        self.answers, self.settings = list(answers), []
        self.DefaultSettings = SimpleNamespace
        self.NonnegativeConeT = lambda rows: rows

    def DefaultSolver(self, P, q, A, b, cones, settings):
        self.settings.append(settings)
        x, z, s, status = self.answers.pop(0)
        return SimpleNamespace(solve=lambda: SimpleNamespace(x=[x], z=[z], s=[s], status=status))


def told(P, q, least, *answers):
    """½ P x² + q x for x >= least, in one variable, by a solver that is told its answers x, z, s, status."""
    made = program([[P]], [q], ("positive", [[-1.0]], [-least]))
    made._clarabel = Told(*answers)
    return made, made._clarabel


GOOD = (2.0, 7.0, 0.0, "Solved")


@pytest.mark.parametrize(
    ("answer", "accepted"),
    [
        (GOOD, True),
        ((*GOOD[:3], "AlmostSolved"), True),
        ((*GOOD[:3], "InsufficientProgress"), True),
        ((*GOOD[:3], "MaxIterations"), False),
        ((*GOOD[:3], "PrimalInfeasible"), False),
        ((2.0, 7.0, 1e-6, "Solved"), False),  # the constraint
        ((2.0, 7.0, -1e-6, "Solved"), False),
        ((2.0, 7.0 + 1e-6, 0.0, "Solved"), False),  # stationarity
        ((2.0, 7.0 - 1e-6, 0.0, "Solved"), False),
        ((np.nan, 7.0, 0.0, "Solved"), False),
        ((2.0, np.inf, 0.0, "Solved"), False),
        ((1e200, 7.0, 0.0, "Solved"), False),
    ],
)
def test_an_answer_counts_by_its_own_residuals(answer, accepted):
    """x² + 3 x from x = 2 on: least there, multiplier 7."""
    made, _ = told(2.0, 3.0, 2.0, answer, answer)
    found = made.solve()
    assert found.is_optimal == accepted
    assert found.is_infeasible == (answer[3] == "PrimalInfeasible")
    if accepted:
        assert found.kkt == found.gap == 0.0
        assert found.active[0].tolist() == [True]


def test_a_second_try_follows_a_failed_one_only():
    bad, none = (2.0, 7.1, 0.0, "Solved"), (*GOOD[:3], "PrimalInfeasible")
    for answers, tries in (((GOOD, bad), 1), ((none, bad), 1), ((bad, GOOD), 2), ((bad, bad), 2)):
        made, solver = told(2.0, 3.0, 2.0, *answers)
        assert made.solve().is_optimal == (GOOD in answers)
        assert len(solver.settings) == tries
    first, second = solver.settings
    assert first.static_regularization_constant < second.static_regularization_constant < ACCEPTED
    for each in solver.settings:
        assert each.tol_gap_abs == each.tol_gap_rel < ACCEPTED
        assert each.tol_feas < ACCEPTED
        # Workers solve beside each other.
        assert each.max_threads == 1


@pytest.mark.parametrize(("q", "accepted"), [(1e4, True), (0.0, True), (-1e4, False)])
def test_a_gap_is_measured_by_the_size_of_what_is_made_small(q, accepted):
    """x² + q x from x = 10⁴ on is 2 · 10⁸, 10⁸ or 0 at its least; a multiplier off by 5e-8 leaves a gap of 5e-4."""
    made, _ = told(2.0, q, 1e4, *[(1e4, 2e4 + q + 5e-8, 0.0, "Solved")] * 2)
    found = made.solve()
    assert found.kkt < ACCEPTED
    assert found.gap == pytest.approx(5e-4, rel=0.1)
    assert found.is_optimal == accepted


@pytest.mark.parametrize("wrong", ["x", "z"])
@pytest.mark.parametrize("place", [0, 1])
def test_one_wrong_row_among_right_ones_is_seen(wrong, place):
    """x² + 3 x of two variables, each from 2 on."""
    made = program(2.0 * np.eye(2), [3.0, 3.0], ("positive", -np.eye(2), [-2.0, -2.0]))
    parts = {"x": np.full(2, 2.0), "z": np.full(2, 7.0), "s": np.zeros(2)}
    parts["s" if wrong == "x" else "z"][place] += 1e-6
    made._clarabel = Told()
    made._clarabel.DefaultSolver = lambda *_: SimpleNamespace(solve=lambda: SimpleNamespace(status="Solved", **parts))
    found = made.solve()
    assert found.kkt == pytest.approx(1e-6)
    assert not found.is_optimal


@pytest.mark.parametrize(("share", "accepted"), [(0.2, True), (0.5, False)])
def test_a_gap_of_what_is_smaller_than_one_is_measured_as_it_is(share, accepted):
    """x² - 4 x from x = 4 on is 0 at its least; an error of the multiplier is four times that in the gap."""
    made, _ = told(2.0, -4.0, 4.0, *[(4.0, 4.0 + share * ACCEPTED, 0.0, "Solved")] * 2)
    found = made.solve()
    assert found.kkt < ACCEPTED
    assert found.gap == pytest.approx(4.0 * share * ACCEPTED, rel=1e-6)
    assert found.is_optimal == accepted
