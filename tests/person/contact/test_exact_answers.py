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
