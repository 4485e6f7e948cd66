"""Following solutions: arrival, folds and poles."""

import numpy as np
import pytest

from exo_pin.numerics.continuation import follow

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
