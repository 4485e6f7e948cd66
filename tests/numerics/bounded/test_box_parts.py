"""Bounded least squares in space as the kernels are written: small programs of every kind, and each part by hand."""

import numpy as np
import pytest
from box_enumeration import by_enumeration

from exo_pin import InfeasibleBounds, InvalidInput
from exo_pin.numerics import least_forces
from exo_pin.numerics.bounded.box_descent import (
    _moved,
    _share,
    descend,
    scratch,
    shorten,
)
from exo_pin.numerics.bounded.box_program import _scale, _unbounded

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


def drawn(rng, kind, m):
    G, low, high = rng.normal(size=(3, m)), -rng.random(m), rng.random(m)
    c = 2.0 * rng.normal(size=3)
    if kind == "whole numbers":
        G, c = rng.integers(-1, 2, (3, m)).astype(float), rng.integers(-2, 3, 3).astype(float)
        low = -rng.integers(0, 3, m).astype(float)
        high = low + rng.integers(0, 4, m)
    if kind == "in a plane":
        G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m))
        c = -G @ rng.uniform(low, high)
    if kind == "on a line":
        G = rng.normal(size=(3, 1)) @ rng.normal(size=(1, m))
    if kind == "half open":
        G[:, m - 1] = 0.5 * G[:, 0]
        low[rng.random(m) < 0.4], high[rng.random(m) < 0.4] = -INF, INF
    if kind == "force-free":
        c = -G @ rng.uniform(low, high)
    return c, G, low, high


@pytest.mark.parametrize("kind", ["any", "whole numbers", "in a plane", "on a line", "half open", "force-free"])
def test_the_shortest_of_least_force(kind):
    rng = np.random.default_rng(150)
    for case in range(24):
        c, G, low, high = drawn(rng, kind, 1 + case % 4)
        found = least_forces(c[None], G[None], low[None], high[None])
        force, _, z = by_enumeration(c, G, low, high)
        assert np.linalg.norm(found.forces[0]) == pytest.approx(force, abs=1e-12)
        np.testing.assert_allclose(found.variables[0], z, atol=1e-9)
        np.testing.assert_allclose(found.forces[0], c + G @ found.variables[0], atol=1e-14)
        assert found.gaps[0] < 1e-12


@pytest.mark.parametrize("kind", ["any", "whole numbers", "in a plane", "half open"])
def test_descent_from_any_corner_has_the_least_force(kind):
    rng = np.random.default_rng(151)
    for case in range(16):
        c, G, low, high = drawn(rng, kind, 1 + case % 4)
        z = np.where(rng.random(len(low)) < 0.5, low, high)
        z = np.where(np.isfinite(z), z, np.clip(0.0, low, high))
        descend(c, G, low, high, z, _scale(c, low, high), np.empty(len(low), dtype=np.int64), z.copy())
        assert (z >= low).all()
        assert (z <= high).all()
        assert np.linalg.norm(c + G @ z) == pytest.approx(by_enumeration(c, G, low, high)[0], abs=1e-11)


@pytest.mark.parametrize(
    ("z", "goal", "share"), [(0.0, 0.5, 2.0), (0.0, 2.0, 0.5), (0.0, -4.0, 0.25), (1.0, 2.0, 0.0), (-1.0, -1.0, 0.0),
                             (0.5, 1.0, 1.0), (0.0, -1.0, 1.0), (1.5, 2.0, 0.0)]
)  # fmt: skip
def test_shares_of_a_step_to_bounds_of_minus_one_and_one(z, goal, share):
    assert _share(z, goal, -1.0, 1.0) == share
    at = np.array([z, 9.0])
    _moved(at, 0, goal, share, np.array([-1.0, 0.0]), np.array([1.0, 0.0]))
    assert at[0] == pytest.approx(np.clip(z + min(share, 1.0) * (goal - z), -1.0, 1.0), abs=1e-15)
    assert at[1] == 9.0


@pytest.mark.parametrize("seed", [16, 37, 66])
def test_variables_that_block_early_are_released(seed):
    """From a start beside the bounds the first way ends on bounds that the shortest answer leaves again."""
    rng = np.random.default_rng(seed)
    G, low, high = rng.normal(size=(3, 6)), -rng.random(6) * rng.choice([0.1, 1]), rng.random(6)
    near = rng.random(6) < 0.5
    start = np.where(near, low + 0.02 * (high - low), high - 0.02 * (high - low))
    c, z = -G @ start, start.copy()
    shorten(c, G, low, high, z, 1.0, scratch(6))
    np.testing.assert_allclose(G @ z, -c, atol=1e-12)
    np.testing.assert_allclose(z, by_enumeration(c, G, low, high)[2], atol=1e-10)


def test_crossed_bounds_are_named_and_shapes_are_checked():
    c, G, low, high = np.zeros((2, 3)), np.ones((2, 3, 4)), np.zeros((2, 4)), np.ones((2, 4))
    low[1, 2] = 3.0
    with pytest.raises(InfeasibleBounds) as told:
        least_forces(c, G, low, high)
    assert told.value.limbs == (2,)
    for wrong in (
        (c[:, :2], G, low * 0, high), (c, G[:, :2], low * 0, high), (c[:1], G, low * 0, high),
        (c, G, low[:, :3] * 0, high), (c, G, low * 0, high[:, :3]), (c, G, low * 0, high[:1]),
        (c[0], G[0], low[0], high[0]),
    ):  # fmt: skip
        with pytest.raises(InvalidInput, match="expected"):
            least_forces(*wrong)
    low[1, 2] = 0.0
    for k, spoiled in ((0, np.inf), (1, np.nan), (0, np.nan), (1, np.inf), (2, np.nan), (3, np.nan)):
        parts = [part.copy() for part in (c, G, low, high)]
        parts[k].flat[-1] = spoiled
        with pytest.raises(InvalidInput, match="finite"):
            least_forces(*parts)


def test_a_part_of_a_step_moves_a_variable_by_that_part():
    at = np.array([0.5, -0.25])
    low, high = -np.ones(2), np.ones(2)
    _moved(at, 0, 0.9, 0.5, low, high)
    assert at[0] == pytest.approx(0.7, rel=1e-15)
    _moved(at, 1, -0.75, 0.25, low, high)
    assert at[1] == pytest.approx(-0.375, rel=1e-15)
    _moved(at, 1, 0.8, 2.0, low, high)
    assert at.tolist() == pytest.approx([0.7, 0.8])


@pytest.mark.parametrize("size", [1e-2, 1.0, 1e2])
def test_three_clearly_independent_columns_are_solved_at_once(monkeypatch, size):
    """Whatever their length; nearly dependent ones by the general way."""
    used, asked = _unbounded.plain.__globals__, []
    kernel = used["least_norm"]
    monkeypatch.setitem(used, "least_norm", lambda *arguments: asked.append(1) or kernel(*arguments))
    G, c, z = np.array([[1.0, 0.2, 0.1], [0.0, 1.0, 0.3], [0.1, 0.0, 1.0]]), np.array([1.0, -2.0, 0.5]), np.empty(3)
    G *= size
    assert _unbounded(c, G, z, scratch(3)) == 3
    np.testing.assert_allclose(z, np.linalg.solve(G, -c), rtol=1e-13)
    assert not asked
    G[:, 2] = G[:, 1] + 1e-7 * G[:, 2]
    assert _unbounded(c, G, z, scratch(3)) == 3
    assert asked
