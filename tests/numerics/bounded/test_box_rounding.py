"""Bounded least squares where rounding decides: ties, steps without gain, nearly dependent columns, other units."""

import itertools

import numpy as np
import pytest
from box_enumeration import by_enumeration
from scipy.optimize import nnls

from exo_pin import SolverFailed
from exo_pin.numerics import least_force, least_forces
from exo_pin.numerics.bounded import box_program as one_box_program
from exo_pin.numerics.bounded.box_descent import descend, scratch, shorten
from exo_pin.numerics.bounded.box_program import _is_unique, _scale, _unbounded, least_bounded

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


def calls_of(monkeypatch, function, name):
    """A list that grows with the arguments of each call of another function by this one."""
    used, asked = function.plain.__globals__, []
    kernel = used[name]
    monkeypatch.setitem(used, name, lambda *given: asked.append(given) or kernel(*given))
    return asked


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


def programs(kind, count=6):
    rng = np.random.default_rng(160)
    for case in range(count):
        m = 2 + case % 4
        G, low, high, c = rng.normal(size=(3, m)), -rng.random(m), rng.random(m), 2.0 * rng.normal(size=3)
        if kind == "in a plane":
            G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m))
        if kind == "nearly in a plane":
            G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m)) + 1e-9 * rng.normal(size=(3, m))
            low[rng.random(m) < 0.4], high[rng.random(m) < 0.4] = -INF, INF
        if kind == "force-free":
            c = -G @ rng.uniform(low, high)
        yield c, G, low, high


@pytest.mark.parametrize("power", [-70, 70])
@pytest.mark.parametrize("kind", ["any", "in a plane", "nearly in a plane", "force-free"])
def test_forces_in_another_unit_change_no_digit(kind, power):
    """All that counts as rounding is a share of the largest force: a power of two changes exponents alone."""
    unit = 2.0**power
    for c, G, low, high in programs(kind, 12):
        one = least_forces(c[None], G[None], low[None], high[None])
        other = least_forces(unit * c[None], G[None], unit * low[None], unit * high[None])
        np.testing.assert_array_equal(other.variables, unit * one.variables)
        np.testing.assert_array_equal(other.forces, unit * one.forces)
        np.testing.assert_array_equal(other.gaps, one.gaps)


@pytest.mark.parametrize("first", [0, 1, 2])
def test_a_step_without_gain_is_undone_and_others_go_on(first):
    """The variable of the largest gain is one digit from its bound: the force is the same digit by digit there."""
    order = np.roll(np.arange(3), first)
    G = np.array([[1.0, 0.9, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 1e-3]])[:, order]
    c, low, high = np.array([-10.0, 0.0, 0.1]), -np.ones(3), np.ones(3)
    start = np.array([np.nextafter(1.0, 0.0), 0.0, 0.0])[order]
    z, tried, before = start.copy(), np.zeros(3, dtype=np.int64), np.zeros(3)
    assert np.abs(c + G @ start)[0] == 9.0  # as on the bound
    descend(c, G, low, high, z, 10.0, tried, before)
    np.testing.assert_allclose(z, np.array([1.0, 1.0, -1.0])[order], rtol=1e-15)
    # With no room for the others nothing is left to gain, and z is as it was.
    z = start.copy()
    still = np.array([0.0, 0.0, 0.0])[order] == start
    descend(c, G, np.where(still, 0.0, low), np.where(still, 0.0, high), z, 10.0, tried, before)
    np.testing.assert_array_equal(z, start)
    assert tried.sum() == 1


def test_descent_takes_a_round_for_each_variable_of_columns_across_each_other(monkeypatch):
    """Whatever their order: a variable that has come in stays in, and the one of the largest force comes first."""
    entrants = calls_of(monkeypatch, descend, "_entrant")
    for sizes in itertools.permutations((1.0, 2.0, 3.0)):
        for bound, rest in ((9.0, 0.0), (2.5, 0.5)):
            c, z = np.array(sizes), np.zeros(3)
            entrants.clear()
            descend(c, np.eye(3), -np.full(3, bound), np.full(3, bound), z, 9.0, np.zeros(3, dtype=int), np.zeros(3))
            np.testing.assert_array_equal(z, -np.minimum(c, bound))
            assert len(entrants) == 4
            assert next(given[6] for given in entrants) == (-1, -1, -1)
            assert np.abs(c + z).max() == rest


def test_the_search_starts_beside_an_only_answer_and_else_from_the_shortest_variables(monkeypatch):
    """The answer of least norm may be huge, where columns are nearly dependent, and its rounding too."""
    used, starts = least_bounded.plain.__globals__, []
    kernel = used["descend"]
    monkeypatch.setitem(used, "descend", lambda *given: starts.append(given[4].copy()) or kernel(*given))
    G = np.array([[1.0, 0.2, 0.1, 0.3], [0.0, 1.0, 0.3, 0.1], [0.1, 0.0, 1.0, 0.2]])
    c, low, high = np.array([1.0, -2.0, 0.5]), np.array([-0.4, 0.1, 0.2, -1.0]), np.array([1.0, 0.9, 0.6, -0.1])
    for m, start in ((3, np.linalg.solve(G[:, :3], -c)), (4, np.zeros(4))):
        starts.clear()
        z = np.empty(m)
        least_bounded(c, np.ascontiguousarray(G[:, :m]), low[:m], high[:m], z, scratch(m))
        np.testing.assert_allclose(starts, [np.clip(start, low[:m], high[:m])], rtol=1e-13)


def test_shorter_variables_are_not_paid_for_with_force():
    """Beside dependent columns rounding can cost more than rounding; then the longer ones stay."""
    kept, rng = 0, np.random.default_rng(161)
    for _ in range(40):
        m = 5
        G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m)) + 1e-11 * rng.normal(size=(3, m))
        c, low, high = rng.normal(size=3), -rng.random(m), rng.random(m)
        low[rng.random(m) < 0.4], high[rng.random(m) < 0.4] = -INF, INF
        scale, longer, z = _scale(c, low, high), np.clip(np.zeros(m), low, high), np.empty(m)
        descend(c, G, low, high, longer, scale, np.zeros(m, dtype=int), np.zeros(m))
        least_bounded(c, G, low, high, z, scratch(m))
        if not (np.abs(z) > 1e6).any():
            assert np.linalg.norm(c + G @ z) <= np.linalg.norm(c + G @ longer) + 2e-13 * scale
        kept += (z == longer).all()
    assert 3 < kept < 40


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_second_pass_is_made_for_variables_over_a_hundred_times_the_force(monkeypatch, size):
    asked = calls_of(monkeypatch, _unbounded, "least_norm")
    for times, passes in ((1.0, 1), (90.0, 1), (110.0, 2), (190.0, 2), (1e4, 2)):
        for axis in range(3):
            asked.clear()
            along = np.eye(3)[axis]
            G, z = np.hstack([np.diag(np.where(along > 0.0, 1.0 / times, 1.0)), np.zeros((3, 1))]), np.empty(4)
            assert _unbounded(size * along, G, z, scratch(4)) == 3
            np.testing.assert_allclose(z, [*(-times * size * along), 0.0], rtol=1e-14)
            assert len(asked) == passes


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


def test_one_and_no_movable_variable_are_as_short_as_can_be():
    G, low, high = np.array([[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]]), np.array([-1.0, 0.5]), np.array([3.0, 0.5])
    for at, c, expected in ((1.0, -2.0, 1.0), (3.0, -9.0, 3.0), (-1.0, 9.0, -1.0)):
        z = np.array([at, 0.5])
        shorten(np.array([c, 0.0, 0.0]), G, low, high, z, 9.0, scratch(2))
        np.testing.assert_array_equal(z, [expected, 0.5])
    # A variable that has no effect on the force is as near to zero as it may be.
    for low, high, expected in ((-1.0, 3.0, 0.0), (0.5, 3.0, 0.5), (-3.0, -0.5, -0.5)):
        z = np.array([high])
        shorten(np.ones(3), np.zeros((3, 1)), np.array([low]), np.array([high]), z, 3.0, scratch(1))
        np.testing.assert_array_equal(z, [expected])


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


@pytest.mark.parametrize("unit", [1.0, 1e6])
def test_variables_that_are_pressed_or_fixed_are_not_searched(monkeypatch, unit):
    """On a bound, by a force that would fall beyond it, more than rounding; the others are, on which side ever."""
    looked_at = calls_of(monkeypatch, shorten, "row_rank")
    cases = [(-1.0, 1.0, False), (-1.0, -1.0, True), (1.0, -1.0, False), (1.0, 1.0, True), (0.3, 1.0, True),
             (0.3, -1.0, True), (-1.0, 0.0, True), (1.0, 0.0, True), (-1.0, 0.9e-10, True), (-1.0, 1.1e-10, False),
             (1.0, -0.9e-10, True), (1.0, -1.1e-10, False)]  # fmt: skip
    G = np.array([[slope for _, slope, _ in cases], [0.0] * len(cases), [0.0] * len(cases)])
    z, high = unit * np.array([at for at, _, _ in cases]), np.full(len(cases), unit)
    before = G @ z
    shorten(unit * np.array([1.0, 0.0, 0.0]) - before, G, -high, high, z, unit, scratch(len(cases)))
    ((searched, _, _),) = looked_at
    assert searched.shape[1] == sum(moves for _, _, moves in cases)
    np.testing.assert_allclose(G @ z, before, atol=1e-14 * unit)
    pressed = [k for k, (_, _, moves) in enumerate(cases) if not moves]
    np.testing.assert_array_equal(z[pressed], [unit * cases[k][0] for k in pressed])
    # None of those that are fixed, whatever pulls at them.
    looked_at.clear()
    z = unit * np.array([1.0, 0.5])
    shorten(unit * np.array([1.0, 0.0, 0.0]), G[:, :2], z.copy(), z.copy(), z, unit, scratch(2))
    ((searched, _, _),) = looked_at
    assert searched.shape[1] == 0


@pytest.mark.parametrize("power", [-50, -20, 0, 20])
def test_effects_of_any_size_are_used(power):
    """Variables that are not negative, without an upper bound, by SciPy's own method."""
    rng = np.random.default_rng(162)
    for case in range(8):
        m = 2 + case % 3
        G, c = 2.0**power * rng.normal(size=(3, m)), rng.normal(size=3)
        found = least_forces(c[None], G[None], np.zeros((1, m)), np.full((1, m), INF))
        x, rest = nnls(G, -c)
        np.testing.assert_allclose(found.variables[0], x, rtol=1e-9, atol=1e-12 * 2.0**-power)
        assert np.linalg.norm(found.forces[0]) == pytest.approx(rest, abs=1e-13)


def test_a_program_is_solved_in_units_of_its_force_at_the_start(monkeypatch):
    """That of the variables which are nearest to zero; its residual is a share of that."""
    exact, given = one_box_program.least_forces, []
    monkeypatch.setattr(one_box_program, "least_forces", lambda *of: given.append(of) or exact(*of))
    rng = np.random.default_rng(163)
    for low in (np.array([-1.0, 0.5, -3.0]), np.array([2.0, -1.0, 0.25])):
        c, G, high = 7.0 * rng.normal(size=3), rng.normal(size=(3, 3)), np.full(3, 4.0)
        high[2] = max(low[2], -0.5) + 0.1
        given.clear()
        answer = least_force(c, G, low, high)
        (((scaled,), (same,), (lower,), (upper,)),) = given
        np.testing.assert_array_equal(same, G)
        assert np.linalg.norm(scaled + G @ np.clip(np.zeros(3), lower, upper)) == pytest.approx(1.0, rel=1e-14)
        size = np.linalg.norm(c + G @ np.clip(np.zeros(3), low, high))
        for part, expected in ((scaled, c), (lower, low), (upper, high)):
            np.testing.assert_allclose(size * part, expected, rtol=1e-14)
        np.testing.assert_allclose(answer.force, c + G @ answer.variables, atol=1e-13)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_free_variables_solve_their_equations_in_whatever_order_they_come_in(order):
    """Columns that are not across each other, and a force that leaves one variable after the other to come in."""
    rng = np.random.default_rng(164)
    for count in (2, 3):
        for _ in range(3):
            G = rng.normal(size=(3, 3))[:, order]
            c, z, bound = rng.normal(size=3), np.zeros(3), np.full(3, 1e6)
            bound[[k for k in range(3) if order[k] >= count]] = 0.0
            descend(c, G, -bound, bound, z, 10.0, np.zeros(3, dtype=int), np.zeros(3))
            free = bound > 0.0
            np.testing.assert_allclose(z[free], np.linalg.lstsq(G[:, free], -c, rcond=None)[0], rtol=1e-10)
            assert (z[~free] == 0.0).all()
