"""Following solutions: arrival, folds and poles."""

import numpy as np
import pytest

from exo_pin.numerics.continuation import _corrected, _state, follow

ONE = np.ones(1)


def equations_of(residual, slope, rate):
    def equations(rows, x, at):
        return residual(rows, x, at), slope(rows, x, at)[:, :, None] * np.eye(1), rate(rows, x, at)

    return equations


def test_arrives_and_stops_at_a_fold():
    """x - x² = λ c has a fold at λ c = 1/4."""
    c = np.array([0.1, 0.2499, 0.3])
    fold = equations_of(
        lambda rows, x, at: x - x**2 - (at * c[rows])[:, None],
        lambda rows, x, at: 1.0 - 2.0 * x,
        lambda rows, x, at: -c[rows][:, None] + 0.0 * x,
    )
    path = follow(fold, np.arange(3), ONE)
    np.testing.assert_array_equal(path.reached >= 1.0, [True, True, False])
    np.testing.assert_allclose(path.x[:2, 0], 0.5 - np.sqrt(0.25 - c[:2]), atol=1e-12)
    assert abs(path.reached[2] * 0.3 - 0.25) < 1e-3


def test_does_not_jump_over_a_pole():
    """x (1/2 - λ) = λ: x goes to infinity at λ = 1/2, and comes back from the other side."""
    pole = equations_of(
        lambda rows, x, at: x * (0.5 - at)[:, None] - at[:, None],
        lambda rows, x, at: (0.5 - at)[:, None] + 0.0 * x,
        lambda rows, x, at: -x - 1.0,
    )
    path = follow(pole, np.arange(1), ONE)
    assert path.reached[0] < 0.5


def test_rows_that_cannot_be_evaluated_stay_behind():
    def equations(rows, x, at):
        bad = np.where(rows == 1, np.nan, 1.0)[:, None]
        return (x - at[:, None]) * bad, np.ones((len(rows), 1, 1)) * bad[..., None], -np.ones((len(rows), 1)) * bad

    path = follow(equations, np.array([0, 1, 2]), ONE)
    np.testing.assert_array_equal(path.reached, [1.0, 0.0, 1.0])
    np.testing.assert_allclose(path.x[:, 0], [1.0, 0.0, 1.0])


def test_corrections_have_to_contract():
    """A Jacobian that is too large by 1/(1 - q) makes each correction q times the one before."""
    for ratio, reaches in ((0.2, True), (0.5, False)):
        equations = equations_of(
            lambda rows, x, at: x - 0.02 * (at**2)[:, None],
            lambda rows, x, at, q=ratio: 1.0 / (1.0 - q) + 0.0 * x,
            lambda rows, x, at: -0.04 * at[:, None] + 0.0 * x,
        )
        path = follow(equations, np.arange(1), ONE)
        assert (path.reached[0] >= 1.0) == reaches


def test_a_path_ends_on_its_own_branch():
    """x (x - 1) (x + 1) + λ c has folds at x = ±1/√3: beyond them only other branches go on."""
    c = np.array([0.38, 0.39, -0.38, -0.39])
    cubic = equations_of(
        lambda rows, x, at: x - x**3 - (at * c[rows])[:, None],
        lambda rows, x, at: 1.0 - 3.0 * x**2,
        lambda rows, x, at: -c[rows][:, None] + 0.0 * x,
    )
    path = follow(cubic, np.arange(4), ONE)
    np.testing.assert_array_equal(path.reached >= 1.0, [True, False, True, False])
    for x, load in zip(path.x[::2, 0], c[::2], strict=True):
        roots = np.roots([-1.0, 0.0, 1.0, -load])
        assert x == pytest.approx(roots[np.abs(roots).argmin()].real, abs=1e-11)
    np.testing.assert_allclose(path.reached[1::2] * 0.39, 2.0 / np.sqrt(27.0), atol=1e-3)


def test_every_unknown_has_to_contract_and_only_scaled_ones_are_tested():
    """Two unknowns of which the second has a Jacobian that is too large, as above."""
    for scale, reaches in (([1.0, 1.0], False), ([1.0, np.inf], True), ([np.inf, 1.0], False)):

        def equations(rows, x, at):
            residual = x - 0.02 * (at**2)[:, None]
            jacobian = np.broadcast_to(np.diag([1.0, 2.0]), (len(rows), 2, 2))
            return residual, jacobian, -0.04 * at[:, None] + 0.0 * x

        path = follow(equations, np.arange(1), np.array(scale))
        assert (path.reached[0] >= 1.0) == reaches
        if reaches:
            np.testing.assert_allclose(path.x[0, 0], 0.02, rtol=1e-12)


def test_long_first_corrections_shorten_the_step():
    """x = k λ² needs a correction of k h² at a step of h: within 0.03 of the scale in one step, or in several."""
    for k, calls in ((0.029, 1), (0.031, 3)):
        seen = []

        def equations(rows, x, at, k=k, seen=seen):
            seen.append(at[0])
            one = np.ones((len(rows), 1, 1))
            return x - k * (at**2)[:, None], one, -2.0 * k * at[:, None] + 0.0 * x

        path = follow(equations, np.arange(1), ONE)
        np.testing.assert_allclose(path.x, k, rtol=1e-13)
        assert len({at for at in seen if at > 0.0}) == (1 if calls == 1 else 2)


@pytest.mark.parametrize(
    ("sizes", "good", "evaluations"),
    [
        ([0.0], True, 1),
        ([0.9e-12], True, 1),  # rounding: no correction after it
        ([0.9e-9, 1e-13], True, 2),
        ([0.029, 0.01, 0.9e-9, 0.0], True, 4),
        ([0.029, 0.0102, 0.0], False, 2),  # contracts by no more than 0.35
        ([0.029, 0.01, 0.0036, 0.0], False, 3),
        ([0.031], False, 1),  # a first one that is too long
        ([0.029, 0.01, 0.003, 1e-3, 3e-4, 1e-4, 3e-5], False, 7),  # not near after seven
        ([0.029, 0.01, 0.003, 1e-3, 3e-4, 1e-4, 0.9e-9], True, 7),
        ([0.029, 0.01, 0.003, 1e-3, 3e-4, 1e-4, 3e-5, 0.9e-9], False, 7),
        ([0.9e-9, 2e-10, 0.9e-12], True, 3),  # near, and then as far as rounding goes
        ([5e-12, 0.9e-12], True, 2),
        ([1e-3, np.nan], False, 2),
        ([np.nan], False, 1),
        ([1e-3, np.inf], False, 2),
    ],
)
@pytest.mark.parametrize("scale", [1.0, 50.0])
def test_corrections_are_accepted_by_their_sizes(sizes, good, evaluations, scale):
    """Residuals of prescribed sizes beside a matrix of one; a row beside it that is solved from the start."""
    asked = []

    def equations(rows, x, at):
        size = np.where(rows == 3, sizes[len(asked)] if len(asked) < len(sizes) else 0.0, 0.0)
        asked.append(rows.tolist())
        one = np.broadcast_to(np.eye(2), (len(rows), 2, 2))
        return np.stack([-scale * size, np.zeros(len(rows))], axis=1), one, np.zeros((len(rows), 2))

    x = np.zeros((2, 2))
    found = _corrected(equations, np.array([7, 3]), x, np.ones(2), np.array([scale, scale]))
    np.testing.assert_array_equal(found, [True, good])
    assert len(asked) == evaluations
    assert asked[0] == [7, 3]
    assert all(rows == [3] for rows in asked[1:])
    if good:
        assert x[1, 0] == pytest.approx(scale * sum(sizes[:evaluations]), rel=1e-14)


def test_tangents_are_of_rows_with_a_finite_one_alone():
    def equations(rows, x, at):
        diagonals = np.array([[2.0, 1.0], [1.0, -3.0], [1.0, 1.0], [1.0, 0.0], [1e-300, 1.0]])[rows]
        rate = np.array([[1.0, 2.0], [1.0, 3.0], [1.0, np.nan], [1.0, 1.0], [1e10, 1.0]])[rows]
        return 0.0 * x, diagonals[:, :, None] * np.eye(2), rate

    tangent, sign = _state(equations, np.arange(5), np.zeros((5, 2)), np.zeros(5))
    np.testing.assert_array_equal(sign, [1.0, -1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(tangent[:2], [[-0.5, -2.0], [-1.0, 1.0]])
    path = follow(equations, np.arange(5), np.ones(2))
    np.testing.assert_array_equal(path.reached[2:], 0.0)
    nothing = _state(equations, np.arange(0), np.zeros((0, 2)), np.zeros(0))
    assert [len(part) for part in nothing] == [0, 0]


def test_steps_are_doubled_after_each_that_is_accepted_and_halved_after_each_that_is_not():
    """From the whole path down to a thousandth of it, and no farther."""
    tried, open_from = [], 0.3

    def equations(rows, x, at):
        tried.append(float(at[0]))
        bad = np.where(at > open_from, np.nan, 1.0)
        return (x - at[:, None]) * bad[:, None], np.ones((len(rows), 1, 1)), -np.ones((len(rows), 1))

    path = follow(equations, np.arange(1), ONE)
    goals = list(dict.fromkeys(at for at in tried if at > 0.0))
    # 1, 1/2 and 1/4; from there 1/2 more, 1/4, ... until the steps are below 2**-10.
    expected, at, step = [], 0.0, 1.0
    while step >= 2.0**-10:
        goal = min(at + step, 1.0)
        expected.append(goal)
        at, step = (goal, 2.0 * step) if goal <= open_from else (at, 0.5 * step)
    assert goals == list(dict.fromkeys(expected))
    assert open_from - 2.0**-10 < path.reached[0] <= open_from
    np.testing.assert_allclose(path.x[0], path.reached)
