"""Bounded least squares in space as the kernels are written: small programs of every kind, and each part by hand."""

import itertools

import numpy as np
import pytest
from box_enumeration import by_enumeration

from exo_pin import InfeasibleBounds, InvalidInput
from exo_pin.numerics import least_force, least_forces
from exo_pin.numerics.bounded.box_descent import (
    _basis,
    _entrant,
    _moved,
    _share,
    descend,
    force_of,
    scratch,
    shorten,
    size_of,
)
from exo_pin.numerics.bounded.box_program import _scale, _unbounded, _within, duality_gap

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


@pytest.mark.parametrize("m", [4, 5])
def test_shortening_keeps_the_force_and_ends_shortest(m):
    rng = np.random.default_rng(152)
    for _ in range(10):
        G, low, high = rng.normal(size=(3, m)), -rng.random(m), rng.random(m)
        start = rng.uniform(low, high)
        c = -G @ start
        z = start.copy()
        shorten(c, G, low, high, z, 1.0, scratch(m))
        np.testing.assert_allclose(G @ z, -c, atol=1e-12)
        np.testing.assert_allclose(z, by_enumeration(c, G, low, high)[2], atol=1e-10)


def test_parts_by_hand():
    G = np.array([[1.0, 0.0, 3.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0]])
    c, z = np.array([1.0, 2.0, 3.0]), np.array([1.0, -1.0, 0.5])
    assert force_of(c, G, z) == (3.5, 0.0, 5.0)
    assert size_of((2.0, 3.0, 6.0)) == 7.0
    assert _scale(np.array([1.0, -7.0, 3.0]), np.array([-INF, -2.0]), np.array([5.0, INF])) == 7.0
    assert _scale(np.zeros(3), np.array([-INF, -9.0]), np.array([5.0, INF])) == 9.0
    assert _scale(np.zeros(3), np.array([-INF]), np.array([INF])) == 0.0
    q1, q2, q3, u1, u2, u3 = _basis(G, 2, 1, 0)
    np.testing.assert_allclose(q1, [0.6, 0.0, 0.8], rtol=1e-15)
    assert (q2, u1, u2) == ((0.0, 1.0, 0.0), 5.0, 2.0)
    np.testing.assert_allclose(q3, [0.8, 0.0, -0.6], rtol=1e-14)
    assert u3 == pytest.approx(0.8, rel=1e-15)
    assert _basis(G, -1, -1, -1) == ((0.0, 0.0, 0.0),) * 3 + (1.0,) * 3
    low, high = np.array([0.0, -1.0]), np.array([1.0, 1.0])
    assert _within(np.array([0.0, 1.0]), low, high)
    for off in ([-0.1, 0.0], [1.1, 0.0], [0.5, -1.1], [0.5, 1.1], [np.nan, 0.0]):
        assert not _within(np.array(off), low, high)


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


def test_the_entrant_gains_most_along_what_its_column_adds():
    G = np.array([[1.0, 2.0, 0.1], [0.0, 1.0, 0.2], [0.0, 0.0, 0.0]])
    r, low, high, z = (0.3, 0.4, 0.5), -np.ones(3), np.ones(3), np.zeros(3)
    none, tried = ((0.0, 0.0, 0.0),) * 3, np.zeros(3, dtype=np.int64)

    def entrant(**change):
        terms = {
            "basis": none,
            "free": (-1, -1, -1),
            "z": z,
            "low": low,
            "high": high,
            "tried": tried,
            "gain": 0.0,
        } | change
        return _entrant(r, G, *(terms[k] for k in ("low", "high", "z", "basis", "free", "tried", "gain")), 2.3)

    gains = [np.array(r) @ G[:, i] / np.linalg.norm(G[:, i]) for i in range(3)]
    order = np.argsort(gains)[::-1].tolist()
    assert entrant() == order[0]
    assert entrant(tried=np.eye(3, dtype=np.int64)[order[0]]) == order[1]
    assert entrant(free=(order[0], -1, -1)) == order[1]
    assert entrant(free=(-1, order[0], -1)) == order[1]
    assert entrant(free=(-1, order[1], order[0])) == order[2]
    # All forces fall with z: those on their lower bounds cannot enter, nor those that cannot move.
    assert entrant(z=np.where(np.arange(3) == order[0], -1.0, 0.0)) == order[1]
    assert entrant(high=np.where(np.arange(3) == order[0], -1.0, 1.0)) == order[1]
    assert entrant(z=-np.ones(3)) == -1
    assert entrant(gain=max(gains) + 1e-9) == -1
    assert entrant(gain=max(gains) - 1e-9) == order[0]
    # Along x nothing is new: then the part across it counts, which is the same for the others.
    across = entrant(basis=((1.0, 0.0, 0.0), none[0], none[0]), free=(0, -1, -1))
    assert across in (1, 2)
    assert entrant(basis=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), none[0]), free=(0, 1, -1)) == -1


def test_unbounded_answers_are_the_shortest_and_count_the_rank():
    rng = np.random.default_rng(153)
    for m, rank in ((1, 1), (2, 2), (3, 3), (3, 2), (3, 1), (5, 3), (5, 2), (3, 0)):
        G, c, z = rng.normal(size=(3, rank)) @ rng.normal(size=(rank, m)), rng.normal(size=3), np.empty(m)
        assert _unbounded(c, G, z, scratch(m)) == rank
        np.testing.assert_allclose(z, -np.linalg.pinv(G, rcond=1e-10) @ c, rtol=1e-10, atol=1e-11)
    for thin in (1e-4, 1e-7, 1e-9):  # near the singular surface: no force is left over
        U, V = np.linalg.qr(rng.normal(size=(3, 3)))[0], np.linalg.qr(rng.normal(size=(3, 3)))[0]
        G, c, z = U @ np.diag([1.0, 1.0, thin]) @ V, rng.normal(size=3), np.empty(3)
        assert _unbounded(c, G, z, scratch(3)) == 3
        assert np.abs(c + G @ z).max() < 1e-15 / thin


def test_gaps_are_the_force_less_the_dual_bound():
    rng = np.random.default_rng(154)
    for _ in range(20):
        c, G, low, high = drawn(rng, "any", 3)
        z = rng.uniform(low, high)
        r = c + G @ z
        corners = [r @ (c + G @ np.array(at)) for at in itertools.product(*zip(low, high, strict=True))]
        expected = np.linalg.norm(r) - max(0.0, min(corners) / np.linalg.norm(r))
        assert duality_gap(c, G, low, high, z, 1.0) == pytest.approx(expected, rel=1e-12)
    assert duality_gap(np.zeros(3), G, low, high, np.zeros(3), 1.0) == 0.0
    assert duality_gap(np.full(3, np.nan), G, low, high, np.zeros(3), 1.0) == INF


def test_one_program_has_its_conditions_in_the_units_of_its_force():
    rng = np.random.default_rng(155)
    for size in (1e-6, 1.0, 1e6):
        c, G, low, high = drawn(rng, "any", 4)
        answer = least_force(size * c, G, size * low, size * high)
        force, _, z = by_enumeration(c, G, low, high)
        np.testing.assert_allclose(answer.variables / size, z, atol=1e-9)
        assert np.linalg.norm(answer.force) == pytest.approx(size * force, rel=1e-10)
        assert answer.residual < 1e-12
        assert answer.gap <= 1e-11 * size
    assert least_force(np.zeros(3), np.eye(3), -np.ones(3), np.ones(3)).residual == 0.0
    with pytest.raises(InfeasibleBounds):
        least_force(c, G, high, low)


@pytest.mark.parametrize(
    ("columns", "force", "low", "high", "unique"),
    [
        (3, [9.0, 0, 0], -1.0, 1.0, True),
        (4, [0.1, 0.2, 0.3], -1.0, 1.0, False),
        (4, [0.1, 0.2, 0.3], 0.0, 0.0, True),  # none can move
        (4, [9.0, 9.0, 9.0], -1.0, 1.0, True),  # all are pressed onto their bounds
    ],
)
def test_whether_the_variables_are_unique(columns, force, low, high, unique):
    G = np.column_stack([np.eye(3), [0.5, 0.6, 0.7]])[:, :columns]
    assert least_force(np.array(force), G, np.full(columns, low), np.full(columns, high)).unique == unique
    # Two columns that differ by less than rounding are one.
    for off, expected in ((1e-13, False), (1e-9, True)):
        two = np.array([[1.0, 1.0], [0.0, off], [0.0, 0.0]])
        assert least_force(np.array([0.1, 0.0, 0.0]), two, -np.ones(2), np.ones(2)).unique == expected


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


def test_a_second_pass_is_made_beside_dependent_columns_alone(monkeypatch):
    used, asked = _unbounded.plain.__globals__, []
    kernel = used["least_norm"]

    def noted(*arguments):
        asked.append(arguments[1].copy())
        return kernel(*arguments)

    monkeypatch.setitem(used, "least_norm", noted)
    rng = np.random.default_rng(156)
    U, V = np.linalg.qr(rng.normal(size=(3, 3)))[0], np.linalg.qr(rng.normal(size=(4, 4)))[0]
    c = U @ np.array([0.3, -0.2, 0.5])
    for thin, passes in ((1.0, 1), (0.1, 1), (1e-4, 2), (1e-8, 2)):
        asked.clear()
        G, z = U @ np.diag([1.0, 1.0, thin]) @ V[:3], np.empty(4)
        assert _unbounded(c, G, z, scratch(4)) == 3
        assert len(asked) == passes
        np.testing.assert_array_equal(asked[0], c)
        assert np.abs(c + G @ z).max() < 1e-15 / thin


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


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_columns_are_the_same_by_their_relative_difference(size):
    for off, expected in ((1e-13, False), (1e-9, True)):
        two = size * np.array([[1.0, 1.0], [0.0, off], [0.0, 0.0]])
        found = least_force(np.array([0.1, 0.0, 0.0]), two, -np.full(2, 1e4), np.full(2, 1e4))
        assert found.unique == expected


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


def test_variables_on_a_bound_without_a_multiplier_may_move():
    """A force of zero and the shortest variables for it, of which one is on its bound by chance."""
    rng = np.random.default_rng(157)
    G, inside = rng.normal(size=(3, 4)), rng.uniform(-0.5, 0.5, 4)
    c = -G @ inside
    shortest = -np.linalg.pinv(G) @ c
    low = -np.ones(4)
    low[2] = shortest[2]
    found = least_force(c, G, low, np.ones(4))
    np.testing.assert_allclose(found.variables, shortest, atol=1e-12)
    assert found.variables[2] == pytest.approx(low[2], abs=1e-15)
    assert not found.unique


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize(("off", "expected"), [(1e-13, -1), (1e-10, 1)])
def test_a_column_enters_by_what_it_adds_against_the_longest(size, off, expected):
    """A trillionth of it is rounding, whatever the unit."""
    G = size * np.array([[1.0, 1.0], [0.0, off], [0.0, 0.0]])
    basis = ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    ends, tried = np.ones(2), np.zeros(2, dtype=np.int64)
    assert _entrant((0.0, 1.0, 0.0), G, -ends, ends, 0.0 * ends, basis, (0, -1, -1), tried, 0.0, size) == expected
