"""The steps of bounded complementarity: each goes down, few are made, and each part is what its definition says."""

import numpy as np
import pytest

from exo_pin import SolverFailed
from exo_pin.numerics import complementarity
from exo_pin.numerics.complementarity import _size, bounded_complementarity


@pytest.fixture
def points(monkeypatch):
    """The forces at which a direction is asked for, in their order, and the directions' matrices."""
    seen, sizes, kernel = [], complementarity._size, complementarity._descent
    last = []
    monkeypatch.setattr(complementarity, "_size", lambda A, c, f: last.append(f.copy()) or sizes(A, c, f))
    monkeypatch.setattr(complementarity, "_descent", lambda *given: seen.append((last[-1], given)) or kernel(*given))
    return seen


def contact(seed, n, rank):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(n, rank))
    return B @ B.T, 3.0 * rng.normal(size=n), np.zeros(n), np.full(n, np.inf)


def test_the_largest_error_is_put_right_first(points):
    """About as many passes as forces at the answer, a third fewer than by taking the first error."""
    count = 0
    for seed in range(8):
        A, c, low, high = contact(seed, 16, 16)
        found = bounded_complementarity(A, c, low, high)
        assert (found.force >= 0.0).all()
        assert (A @ found.force + c >= -1e-11).all()
        assert abs(found.force @ (A @ found.force + c)) < 1e-10
        count += len(points) - 1.2 * (found.force > 0.0).sum()
        points.clear()
    assert count < 8.0


@pytest.mark.parametrize("seed", range(12))
def test_every_step_goes_down(points, seed):
    """½ fᵀA f + cᵀf, with forces within their bounds all the way."""
    rng = np.random.default_rng(300 + seed)
    B = rng.normal(size=(6, 6)) * 10.0 ** rng.uniform(-1.5, 0.0, 6)
    A, c, high = B @ B.T, rng.normal(size=6), rng.uniform(0.1, 1.0, 6)
    found = bounded_complementarity(A, c, -high, high)
    unit = np.exp2(np.round(0.5 * np.log2(np.diag(A))))  # of the forces within
    way = [f / unit for f, _ in points] + [found.force]
    values = [0.5 * f @ A @ f + c @ f for f in way]
    assert (np.diff(values) <= 1e-14 * np.abs(values).max()).all()
    assert values[-1] < values[0]
    assert all((np.abs(f) <= high).all() for f in way)


def test_where_nothing_is_wrong_nothing_is_solved(points):
    A, c, low, high = contact(3, 5, 5)
    found = bounded_complementarity(A, np.abs(c), low, high)
    np.testing.assert_array_equal(found.force, 0.0)
    np.testing.assert_allclose(found.rate, np.abs(c), rtol=1e-15)
    assert not points
    # With one force that is free from the start one direction is asked for, of that one alone.
    low[2] = -np.inf
    bounded_complementarity(np.diag(np.diag(A)), np.abs(c), low, high)
    assert [given[1].shape for _, given in points] == [(1,)]


def test_after_twenty_errors_the_first_one_is_put_right(points):
    """Uncoupled forces: each is put right by a pass of its own, by the size of its error and then by its number."""
    c = -np.r_[np.arange(1.0, 6.0), 10.0 + np.arange(25.0)]
    bounded_complementarity(np.eye(30), c, np.zeros(30), np.full(30, np.inf))
    freed = [round(-given[1].min()) for _, given in points]
    assert freed == [*range(34, 14, -1), 1, 2, 3, 4, 5, 10, 11, 12, 13, 14]


def test_an_end_that_is_never_reached_is_told(monkeypatch):
    monkeypatch.setattr(complementarity, "_MOST", 2)
    with pytest.raises(SolverFailed, match="too many steps"):
        bounded_complementarity(np.eye(3), -np.ones(3), np.zeros(3), np.ones(3))
    monkeypatch.setattr(complementarity, "_MOST", 4)
    np.testing.assert_array_equal(
        bounded_complementarity(np.eye(3), -np.ones(3), np.zeros(3), np.ones(3)).force, np.ones(3)
    )


def test_what_no_force_moves_keeps_its_rate_and_moves_nothing():
    """Beside others, with a diagonal of zero or of rounding."""
    for small in (0.0, 1e-30, 0.9e-24):
        A = np.diag([2.0, small, 1.0, small])
        A[0, 2] = A[2, 0] = 0.5
        A[0, 1] = A[1, 0] = 0.7 * np.sqrt(2.0 * small)
        c, high = np.array([-3.0, 0.25, -2.0, -0.5]), np.full(4, 9.0)
        found = bounded_complementarity(A, c, -high, high)
        np.testing.assert_allclose(
            found.force[[0, 2]], np.linalg.solve([[2.0, 0.5], [0.5, 1.0]], [3.0, 2.0]), rtol=1e-14
        )
        np.testing.assert_array_equal(found.force[[1, 3]], [-9.0, 9.0])
        np.testing.assert_array_equal(found.rate, [0.0, 0.25, 0.0, -0.5])
    # Not of rounding: it comes to rest like the others.
    found = bounded_complementarity(
        np.diag([1.0, 1.1e-24]), np.array([1.0, 1e-12]), np.full(2, -1e13), np.full(2, 1e13)
    )
    np.testing.assert_allclose(found.force, [-1.0, -1e-12 / 1.1e-24], rtol=1e-12)


def test_the_largest_term_is_that_of_a_rate_or_of_forces_in_a_row():
    A, f = np.array([[1.0, -2.0], [-2.0, 5.0]]), np.array([3.0, -1.0])
    for c, expected in (([0.0, 0.0], 11.0), ([-20.0, 1.0], 20.0), ([1.0, 12.0], 12.0), ([0.5, 7.0], 11.0)):
        assert _size(A, np.array(c), f) == expected
    assert _size(A, np.array([0.0, -3.0]), np.zeros(2)) == 3.0
    assert _size(A[:1, :1], np.zeros(1), np.array([-4.0])) == 4.0
    assert _size(np.zeros((0, 0)), np.zeros(0), np.zeros(0)) == 0.0


@pytest.mark.parametrize(("off", "free"), [(0.0, False), (0.5e-12, False), (2e-12, True)])
def test_forces_on_bounds_are_unique_unless_their_rate_is_of_rounding(off, free):
    """Two that share one load: on their bounds they can change against each other where neither is pressed."""
    A = np.ones((2, 2))
    found = bounded_complementarity(A, np.full(2, -2.0 - off), np.zeros(2), np.ones(2))
    np.testing.assert_array_equal(found.force, [1.0, 1.0])
    assert found.unique.all() == free
    # Of forces that cannot move each is the only one.
    found = bounded_complementarity(A, np.full(2, -2.0), np.ones(2), np.ones(2))
    assert found.unique.all()


def test_redundant_forces_are_told_by_the_least_curvature():
    """Two forces of almost one effect: their difference counts as free below a curvature of 1e-12 of the largest, 2."""
    for off, unique in ((0.0, False), (1.5e-12, False), (2.5e-12, True), (1e-9, True)):
        A = np.array([[1.0, 1.0 - off], [1.0 - off, 1.0]])
        found = bounded_complementarity(A, np.zeros(2), -np.ones(2), np.ones(2))
        assert found.unique.all() == unique
        assert found.unique.any() == unique


@pytest.mark.parametrize(
    ("force", "error"), [([1.0, -1.0, 0.0], 0.0), ([1.0, 1.0, 0.0], 2.0), ([-1.0, -1.0, 0.0], 4.0),
                         ([1.0, -1.0, 0.5], 0.5), ([1.0, -1.0, -0.25], 0.25), ([0.5, -1.0, 0.0], 2.5)]
)  # fmt: skip
def test_errors_are_those_of_the_conditions_each_on_its_side(monkeypatch, force, error):
    """A wrong walk is noticed on a lower bound, on an upper one and between them; what cannot move has no error."""
    low, high = np.array([-1.0, -1.0, -1.0, 0.5]), np.array([1.0, 1.0, 1.0, 0.5])
    c = np.array([-3.0, 1.0, 0.0, 7.0])
    f = np.array([*force, 0.5])
    monkeypatch.setattr(complementarity, "_walk", lambda *given: (f, True, np.zeros(4, dtype=bool)))
    if error == 0.0:
        found = bounded_complementarity(np.eye(4), c, low, high)
        np.testing.assert_array_equal(found.rate, [-2.0, 0.0, 0.0, 7.5])
        assert found.residual == 0.0
    else:
        with pytest.raises(SolverFailed) as told:
            bounded_complementarity(np.eye(4), c, low, high)
        assert told.value.residual == pytest.approx(error / 7.0, rel=1e-14)
