"""What is made of programs without an answer and of a solver that errs."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

from exo_pin.person.contact.conic import ACCEPTED, ConicProgram


def program(P, q, *blocks):
    made = ConicProgram(np.array(P, dtype=float), np.array(q, dtype=float))
    for cone, A, b in blocks:
        made.add(cone, np.array(A, dtype=float), np.array(b, dtype=float))
    return made


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


@pytest.mark.parametrize("share", [0.97, 1.05])
@pytest.mark.parametrize("missed", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0 / 0.7, 2.0 / 0.7, 1.0 / 0.7)])
def test_answers_are_accepted_to_a_ten_millionth(missed, share):
    """Of the constraint, of stationarity, and of the duality gap, 7 x over a cost of 10."""
    x, z, s = np.array(GOOD[:3]) + 1e-7 * share * np.array(missed)
    answer = (x, z, s, "Solved")
    assert told(2.0, 3.0, 2.0, answer, answer)[0].solve().is_optimal == (share < 1.0)


def test_a_second_try_follows_a_failed_one_only():
    bad, none = (2.0, 7.1, 0.0, "Solved"), (*GOOD[:3], "PrimalInfeasible")
    for answers, tries in (((GOOD, bad), 1), ((none, bad), 1), ((bad, GOOD), 2), ((bad, bad), 2)):
        made, solver = told(2.0, 3.0, 2.0, *answers)
        assert made.solve().is_optimal == (GOOD in answers)
        assert len(solver.settings) == tries
    asked = [(one.tol_feas, one.tol_gap_abs, one.static_regularization_constant) for one in solver.settings]
    assert asked == [(1e-9, 1e-11, 1e-12), (1e-8, 1e-9, 1e-8)]
    for each in solver.settings:
        assert each.tol_gap_abs == each.tol_gap_rel < ACCEPTED
        # Workers solve beside each other.
        assert each.max_threads == 1
