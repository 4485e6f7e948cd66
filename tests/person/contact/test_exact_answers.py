"""Newton's answer on an active set, and the shortest choice, against closed forms, differences and enumeration."""

from itertools import product

import numpy as np
import pytest
import scipy

pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

from exo_pin.person.contact.conic import (
    ActiveSet,
    ConicAnswer,
    ConicProgram,
    EffortProgram,
    _cost,
    _outside_of_cone,
    _surface,
    polished,
    shortest_choice,
)

NONE = np.zeros((0, 4))


def effort(A, b, low=-np.inf, high=np.inf, C=NONE, c=(), B=NONE, d=(), weights=(1.0, 2.0, 0.5, 3.0), power=2):
    """A program of four variables."""
    A, b, C, c, B, d, weights = (np.array(part, dtype=float) for part in (A, b, C, c, B, d, weights))
    return EffortProgram(weights, power, A, b, C, c, np.full(4, low), np.full(4, high), B, d)


def active(program, lower=(), upper=(), rows=None, cone=False):
    own = np.zeros(len(program.c), dtype=bool) if rows is None else np.array(rows)
    return ActiveSet(np.isin(np.arange(4), lower), np.isin(np.arange(4), upper), own, cone)


def held_sums(seed=3):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.5, 1.5, (1, 4)), rng.uniform(1.0, 2.0, 1)


def least_squares(weights, A, b):
    """min Σ w x² with A x = b."""
    unit = np.asarray(weights) ** -0.5
    return unit * (np.linalg.pinv(A * unit) @ b)


@pytest.mark.parametrize("power", [2, 3])
def test_cost_and_its_derivatives_agree_with_differences(power):
    program = effort(*held_sums(), power=power, weights=(1.0, 2.0, 0.5))
    x, step = np.array([0.3, 0.02, 1.7, 5.0]), 1e-5 * np.eye(4)

    def cost(x):
        return float((program.weights * x[:3] ** power).sum())

    gradient, curvature = _cost(program, x)
    np.testing.assert_allclose(gradient, [(cost(x + h) - cost(x - h)) / 2e-5 for h in step], atol=1e-8)
    sides = [(_cost(program, x + h)[0] - _cost(program, x - h)[0]) / 2e-5 for h in step]
    np.testing.assert_allclose(np.diag(curvature), sides, atol=1e-8)
    # A pull below nothing costs nothing.
    assert (power == 3) == (_cost(program, -x)[1] == 0.0).all()
    np.testing.assert_array_equal(_cost(program, -x)[0], 0.0)


def test_surface_of_the_cone_and_its_derivatives_agree_with_differences():
    rng = np.random.default_rng(8)
    B, d, x, step = rng.normal(size=(3, 4)), rng.normal(size=3), rng.normal(size=4), 1e-5 * np.eye(4)
    program = effort(*held_sums(), B=B, d=d)
    for at in (x, 1e-2 * x):
        gap, slope, bend = _surface(program, at)
        v = B @ at + d
        assert gap == pytest.approx(np.sqrt(v[1] ** 2 + v[2] ** 2) - v[0])
        sides = np.array([(_surface(program, at + h)[0] - _surface(program, at - h)[0]) / 2e-5 for h in step])
        np.testing.assert_allclose(slope, sides, atol=1e-8)
        sides = np.array([(_surface(program, at + h)[1] - _surface(program, at - h)[1]) / 2e-5 for h in step])
        np.testing.assert_allclose(bend, sides, atol=1e-8)
    # At the tip of the cone only the first row is left.
    gap, slope, _ = _surface(program._replace(d=np.array([0.3, 0.0, 0.0])), np.zeros(4))
    assert gap == -0.3
    np.testing.assert_array_equal(slope, -B[0])


def test_newton_ends_at_the_least_of_the_equations():
    A, b = held_sums()
    program = effort(A, b)
    x, kkt = polished(program, np.full(4, 0.3), active(program))
    np.testing.assert_allclose(x, least_squares(program.weights, A, b), atol=1e-14)
    assert kkt < 1e-13


def test_newton_ends_at_the_least_sum_of_cubes():
    """w a² is then proportional to the lever: 3 w a² = m A."""
    A, weights = np.array([[1.0, 2.0, 0.5, 0.7]]), np.array([1.0, 2.0, 0.5, 3.0])
    a = np.sqrt(A[0] / weights)
    program = effort(A, A @ a, power=3)
    x, kkt = polished(program, a + 0.05, active(program))
    np.testing.assert_allclose(x, a, atol=1e-13)
    assert kkt < 1e-12


def bounded(A, b, low, high):
    """Which bounds hold at the least Σ x², by enumeration, and the answer."""
    best = None
    for state in product((-1, 0, 1), repeat=4):
        state = np.array(state)
        x = np.where(state < 0, low, np.where(state > 0, high, 0.0))
        free = state == 0
        x[free] = np.linalg.pinv(A[:, free]) @ (b - A @ x)
        fits = np.abs(A @ x - b).max() < 1e-9 and (x >= low - 1e-9).all() and (x <= high + 1e-9).all()
        if fits and (best is None or x @ x < best[0] - 1e-12):
            best = x @ x, state, x
    return best


@pytest.mark.parametrize("seed", range(4))
def test_no_active_set_but_the_right_one_is_taken(seed):
    """Bounds of wrong signs, and bounds that are broken, of all 81 sets of four variables."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(1, 4))
    b = A @ rng.uniform(0.2, 1.5, 4)
    program = effort(A, b, low=0.1, high=0.6, weights=np.ones(4))
    best = bounded(A, b, 0.1, 0.6)
    taken = 0
    for state in product((-1, 0, 1), repeat=4):
        state = np.array(state)
        found = polished(
            program, np.full(4, 0.3), active(program, np.flatnonzero(state < 0), np.flatnonzero(state > 0))
        )
        if found is not None:
            taken += 1
            np.testing.assert_allclose(found[0], best[2], atol=1e-9)
    assert taken == (0 if best is None else 1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_inequality_holds_where_it_pushes(sign):
    A, b = held_sums()
    plain = least_squares(np.ones(4), A, b)
    C = sign * np.array([[1.0, -1.0, 0.5, 0.2]])
    for room in (0.1, -0.1):
        program = effort(A, b, C=C, c=C @ plain + room, weights=np.ones(4))
        tight = least_squares(np.ones(4), np.vstack([A, C]), np.concatenate([b, program.c]))
        loose_one, tight_one = (polished(program, np.zeros(4), active(program, rows=[on])) for on in (False, True))
        right, wrong, expected = (loose_one, tight_one, plain) if room > 0.0 else (tight_one, loose_one, tight)
        assert wrong is None
        np.testing.assert_allclose(right[0], expected, atol=1e-13)
        assert right[1] < 1e-13


def test_the_cone_holds_where_it_pushes():
    """Nearest to 0 with x_1 = 1 and |(x_2 - 2, x_3)| <= x_0 + s: on the line from (0, 2) or free."""
    A, b, B = np.array([[0.0, 1.0, 0.0, 0.0]]), np.ones(1), np.eye(4)[[0, 2, 3]]
    for room in (3.0, 1.0):
        program = effort(A, b, low=0.0, B=B, d=[room, -2.0, 0.0], weights=np.ones(4))
        # min x_0² + x_2² with 2 - x_2 = x_0 + room: x_0 = x_2 = (2 - room) / 2.
        half = 0.5 * (2.0 - room)
        expected = np.array([half, 1.0, half, 0.0]) if room < 2.0 else np.array([0.0, 1.0, 0.0, 0.0])
        start = expected + np.array([0.1, 0.0, 0.1, 0.0])
        loose, tight = (polished(program, start, active(program, cone=on)) for on in (False, True))
        right, wrong = (loose, tight) if room > 2.0 else (tight, loose)
        assert wrong is None
        np.testing.assert_allclose(right[0], expected, atol=1e-12)
        assert right[1] < 1e-12


def test_equations_that_contradict_each_other_have_no_answer():
    program = effort(np.ones((2, 4)), [1.0, 1.1])
    assert polished(program, np.full(4, 0.25), active(program)) is None


def test_shortest_choice_without_bounds_is_the_least_of_the_sums():
    A, b = held_sums()
    program = effort(A, b)
    start = least_squares(program.weights, A, b) + scipy.linalg.null_space(A) @ [1.0, -2.0, 0.5]
    free = np.zeros(4, dtype=bool)
    np.testing.assert_allclose(
        shortest_choice(program, start, NONE, free), least_squares(program.weights, A, b), atol=1e-13
    )
    # A held sum stays, and so does a fixed variable.
    sums = np.array([[1.0, 0.0, -1.0, 0.0]])
    for held, fixed, rows in ((sums, free, sums), (NONE, np.arange(4) == 2, np.eye(4)[2:3])):
        both = np.vstack([A, rows])
        expected = least_squares(program.weights, both, both @ start)
        np.testing.assert_allclose(shortest_choice(program, start, held, fixed), expected, atol=1e-13)
    # Nothing is left to choose; a row of nothing holds nothing.
    assert shortest_choice(program, start, np.eye(4), free) is start
    np.testing.assert_allclose(
        shortest_choice(program, start, np.zeros((2, 4)), free), least_squares(program.weights, A, b), atol=1e-13
    )


def test_variables_without_a_weight_count_by_their_size():
    A, b = held_sums()
    program = effort(A, b, weights=(4.0, 9.0))
    start = np.linalg.pinv(A) @ b + scipy.linalg.null_space(A) @ [0.5, 0.5, 0.5]
    expected = least_squares([4.0, 9.0, 1.0, 1.0], A, b)
    np.testing.assert_allclose(shortest_choice(program, start, NONE, np.zeros(4, dtype=bool)), expected, atol=1e-13)


@pytest.mark.parametrize("seed", range(6))
def test_shortest_choice_within_bounds_is_that_of_an_enumeration(seed):
    rng = np.random.default_rng(seed)
    A, start = rng.normal(size=(1, 4)), rng.uniform(0.15, 0.55, 4)
    program = effort(A, A @ start, low=0.1, high=0.6, weights=np.ones(4))
    found = shortest_choice(program, start, NONE, np.zeros(4, dtype=bool))
    np.testing.assert_allclose(found, bounded(A, program.b, 0.1, 0.6)[2], atol=1e-6)


def test_shortest_choice_stays_within_inequality_and_cone():
    A, b = np.array([[0.0, 0.0, 0.0, 1.0]]), np.ones(1)
    start, free = np.array([2.0, 2.0, 1.0, 1.0]), np.zeros(4, dtype=bool)
    # x_0 + x_1 >= 1, of weights 1 and 2: multipliers alike, so 2/3 and 1/3.
    program = effort(A, b, C=[[-1.0, -1.0, 0.0, 0.0]], c=[-1.0])
    np.testing.assert_allclose(shortest_choice(program, start, NONE, free), [2 / 3, 1 / 3, 0.0, 1.0], atol=1e-6)
    # |(x_0 - 2, x_1)| <= x_2 + 1, of weights 1: x_0 = x_2 = ½.
    program = effort(A, b, B=np.eye(4)[[2, 0, 1]], d=[1.0, -2.0, 0.0], weights=np.ones(4))
    np.testing.assert_allclose(
        shortest_choice(program, np.array([1.5, 0.1, 1.0, 1.0]), NONE, free), [0.5, 0.0, 0.5, 1.0], atol=1e-6
    )


@pytest.mark.parametrize(
    ("goal", "taken"),
    [
        ((0.5, 0.3, 0.3, 1.0), True),
        ((0.9, 0.3, 0.3, 1.0), False),  # longer
        ((0.05, 0.3, 0.3, 1.0), False),  # below the lower bound
        ((0.5, 0.2, 0.3, 1.0), False),  # breaks the inequality
        ((0.5, 0.3, 0.2, 1.0), False),  # leaves the cone
        ((np.nan, 0.3, 0.3, 1.0), False),
        ((np.inf, 0.3, 0.3, 1.0), False),
        ((-1e300, 0.3, 0.3, 1.0), False),
    ],
)
def test_a_choice_of_an_erring_solver_is_not_taken(monkeypatch, goal, taken):
    A, start = np.array([[0.0, 0.0, 0.0, 1.0]]), np.array([0.6, 0.3, 0.3, 1.0])
    rows = {
        "C": [[0.0, -1.0, 0.0, 0.0]],
        "c": [-0.25],
        "B": np.diag([0.0, 0.0, 1.0, 0.0])[[2, 0, 1]],
        "d": [-0.22, 0, 0],
    }
    program = effort(A, np.ones(1), low=0.1, high=2.0, weights=np.ones(4), **rows)
    with np.errstate(invalid="ignore"):
        y = scipy.linalg.null_space(A).T @ (np.array(goal) - start)
    monkeypatch.setattr(ConicProgram, "solve", lambda _: ConicAnswer(y, [], 0.0, 0.0, True, False))
    found = shortest_choice(program, start, NONE, np.zeros(4, dtype=bool))
    if taken:
        np.testing.assert_allclose(found, goal, atol=1e-15)
    else:
        assert found is start


def test_what_inequalities_and_cone_miss():
    A, b = held_sums()
    program = effort(A, b, C=np.eye(4)[:2], c=[1.0, 2.0], B=np.eye(4)[1:], d=[0.0, 0.0, 0.0])
    for x, missed in (
        ((0.5, 1.0, 0.3, 0.4), 0.0),
        ((1.2, 1.0, 0.3, 0.4), 0.2),
        ((1.2, 2.7, 0.3, 0.4), 0.7),
        ((0.5, 0.1, 0.3, 0.4), 0.4),
    ):
        assert _outside_of_cone(program, np.array(x)) == pytest.approx(missed, abs=1e-15)
    assert _outside_of_cone(effort(A, b), np.ones(4)) == 0.0


def test_shortest_choice_ends_on_one_upper_bound():
    """Four equal shares of 2, but for one that may be 0.2 at most."""
    program = effort(np.ones((1, 4)), [2.0], 0.0, (0.2, 1.0, 1.0, 1.0), weights=np.ones(4))
    found = shortest_choice(program, np.array([0.1, 1.0, 0.5, 0.4]), NONE, np.zeros(4, dtype=bool))
    np.testing.assert_allclose(found, [0.2, 0.6, 0.6, 0.6], atol=1e-7)
