"""Bounded least squares where rounding decides: ties, steps without gain, nearly dependent columns, other units."""

import numpy as np
import pytest
from box_enumeration import by_enumeration

from exo_pin import SolverFailed
from exo_pin.numerics import least_force, least_forces
from exo_pin.numerics.bounded import box_program as one_box_program
from exo_pin.numerics.bounded.box_descent import scratch, shorten
from exo_pin.numerics.bounded.box_program import _is_unique

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize(
    ("c", "G", "low", "high"),
    [
        ([1, -2, 0], [[1, 1, 1], [0, 1, 0], [0, 0, 0]], [-2, -2, -1], [0, 1, 2]),
        ([2, 3, 2], [[1, -1, 1], [0, -1, 1], [1, 0, 0]], [-2, 0, -1], [-1, 3, 2]),
        ([2, 0, 0], [[-1, 1, 0, 1], [-1, -1, 1, -1], [0, -1, 1, -1]], [0, -2, -2, -1], [0, -1, 1, 1]),
        ([0, 2, 1], [[1, -1, -1, -1], [1, 0, -1, 0], [1, -1, 1, -1]], [-1, -1, -1, -2], [-1, 2, 0, 0]),
        ([0, 0, -3], [[0, 0, 0, -1], [-1, 1, 0, 0], [1, -1, 1, 1]], [0, -1, -1, -2], [2, 1, 0, 1]),
        ([3, 0, -1], [[-1, 1, 1, 0, 1], [0, -1, 0, -1, 1], [-1, 1, 1, -1, 1]], [-2, -2, 0, 0, -1], [1, -1, 2, 3, 0]),
        ([-1, 0, 1], [[-1, 1, 1, -1, 0], [0, -1, -1, -1, -1], [0, 0, 0, 0, -1]], [-2, -2, -1, 0, -1], [-2, 0, 2, 1, 1]),
    ],
)
def test_a_bound_that_is_passed_by_rounding_alone_does_not_hold(c, G, low, high):
    """Several bounds are reached together; held one by one they would leave too few variables for the force."""
    c, G, low, high = (np.array(part, dtype=float) for part in (c, G, low, high))
    found = least_forces(c[None], G[None], low[None], high[None])
    force, _, z = by_enumeration(c, G, low, high)
    np.testing.assert_allclose(found.variables[0], z, atol=1e-12)
    assert np.linalg.norm(found.forces[0]) == pytest.approx(force, abs=1e-14)


def test_scratch_is_as_large_as_it_has_to_be():
    """Columns, their basis and its triangle are of three numbers each; m variables have three lines of work and two of
    marks."""
    for m in (1, 5):
        shapes = {"A": (3, m), "c": (3,), "Q": (m, 3), "U": (3, 3), "goal": (m,), "saved": (m,)}
        assert {k: part.shape for k, part in scratch(m)._asdict().items()} == shapes | {"movable": (m,), "mark": (m,)}


def test_what_rests_on_a_bound_without_a_multiplier_counts_as_free():
    """And what is inside its bounds, whatever its gradient's last digits."""
    G = np.column_stack([np.eye(3), [0.5, 0.6, 0.7]])
    low, high, none = -np.ones(4), np.ones(4), np.zeros(4)
    for at in range(4):
        for bound in (-1.0, 1.0):
            z = np.where(np.arange(4) == at, bound, 0.0)
            for pull, unique in ((0.0, False), (0.9e-8, False), (1.1e-8, True), (-0.9e-8, False), (-1.1e-8, True)):
                assert _is_unique(G, low, high, z, np.where(np.arange(4) == at, pull, 0.0)) == unique
    assert not _is_unique(G, low, high, none, np.ones(4))
    assert not _is_unique(G[:, [0, 1, 1]], low[:3], high[:3], none[:3], none[:3])
    assert _is_unique(G[:, 1:], low[1:], high[1:], none[1:], none[1:])
    # The smallest of three singular values counts, not the middle one.
    for thin, unique in ((1e-11, True), (1e-13, False)):
        assert _is_unique(np.diag([1.0, 1.0, thin]), low[:3], high[:3], none[:3], none[:3]) == unique


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_an_answer_that_misses_its_conditions_anywhere_is_refused(monkeypatch, wrong):
    exact = one_box_program.least_forces
    c, G, low, high = np.array([4.0, 0.1, -0.2]), np.eye(3), -np.ones(3), np.ones(3)
    for off, refused in ((0.0, False), (0.9e-8, False), (1.2e-8, True), (1e-3, True)):

        def spoilt(*given, off=off):
            answer = exact(*given)
            z = answer.variables + np.where(np.arange(3) == wrong, off, 0.0)
            return answer._replace(variables=z, forces=given[0] + z)

        monkeypatch.setattr(one_box_program, "least_forces", spoilt)
        if refused:
            with pytest.raises(SolverFailed):
                least_force(4.0 * c, G, 4.0 * low, 4.0 * high)
        else:
            assert least_force(c, G, low, high).residual == pytest.approx(off, abs=1e-15)


@pytest.mark.parametrize(
    ("seed", "rank"), [(116, 2), (318, 2), (351, 2), (131, 3), (184, 3), (236, 3), (283, 3), (383, 3)]
)
def test_the_shortest_variables_meet_the_conditions_of_their_program(seed, rank):
    """z = Gᵀλ + μ with μ that presses onto the bounds: from starts whose way needs several multipliers at once."""
    rng = np.random.default_rng(seed)
    G = rng.normal(size=(3, rank)) @ rng.normal(size=(rank, 6))
    low, high = -rng.random(6) * rng.choice([0.1, 1]), rng.random(6)
    start = np.where(rng.random(6) < 0.5, low + 0.02 * (high - low), high - 0.02 * (high - low))
    z = start.copy()
    shorten(-G @ start, G, low, high, z, 1.0, scratch(6))
    np.testing.assert_allclose(G @ z, G @ start, atol=1e-13)
    on_low, on_high = z == low, z == high
    free = ~on_low & ~on_high
    assert free.sum() >= rank
    pressing = z - G.T @ np.linalg.lstsq(G[:, free].T, z[free], rcond=1e-10)[0]
    np.testing.assert_allclose(pressing[free], 0.0, atol=1e-13)
    assert (pressing[on_low] >= -1e-13).all()
    assert (pressing[on_high] <= 1e-13).all()
    assert (on_low | on_high).sum() > 0
