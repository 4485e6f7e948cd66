"""Newton's method on three equations from hard starts: what it reaches, in how many evaluations, by which steps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.wrist.kinematics.assembly import CONTINUUM, assemble, polish

pytestmark = pytest.mark.usefixtures("plain")


def unit_rows(rng, count=3):
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.fixture
def noted(monkeypatch, plain):
    """Evaluations of the equations and sizes of turns, in lists that fill."""
    evaluated, turns = [], []
    used = polish.plain.__globals__
    fill_rows, rotate = used["fill_rows"], used["rotate"]

    def fill_noted(*arguments):
        evaluated.append(fill_rows(*arguments))
        return evaluated[-1]

    def rotate_noted(R, *turn):
        turns.append(np.linalg.norm(turn))
        rotate(R, *turn)

    monkeypatch.setitem(used, "fill_rows", fill_noted)
    monkeypatch.setitem(used, "rotate", rotate_noted)
    return evaluated, turns


def polished(start, u, v, c):
    R, rows, error = start.as_matrix().copy(), np.empty((3, 3)), np.empty(3)
    worst = polish(R, u, v, c, rows, error, np.empty((3, 3)))
    np.testing.assert_allclose(error, c - np.einsum("ij,ij->i", u, v @ R.T), atol=5e-16)
    return R, worst


@pytest.mark.parametrize(
    ("gap", "off", "most"), [(1e-2, 1e-3, 21), (1e-2, 1e-7, 24), (1e-3, 1e-7, 18), (1e-4, 1e-5, 14), (1e-6, 1e-3, 17)]
)
def test_two_close_solutions_are_reached_from_between_them(noted, gap, off, most):
    """Newton's matrix is nearly singular there and its steps lead far away: damped ones arrive, in so many on average.

    The two are about twice the gap apart.
    """
    evaluated, turns = noted
    rng = np.random.default_rng(240)
    for _ in range(8):
        u, v, R = unit_rows(rng), unit_rows(rng), Rotation.random(rng=rng)
        u[0] = R.apply(v[0])
        c = np.einsum("ij,ij->i", u, R.apply(v))
        c[0] = np.cos(gap)
        start = Rotation.from_rotvec(off * unit_rows(rng, 1)[0]) * R
        found, worst = polished(start, u, v, c)
        assert worst < 1e-15
        np.testing.assert_allclose(found @ found.T, np.eye(3), atol=3e-16)
        away = (Rotation.from_matrix(found) * R.inv()).magnitude()
        assert 0.99 * gap < away < 5.0 * gap + 2e-8
    assert len(evaluated) <= 8 * most
    assert max(turns) <= 0.2


def test_a_solution_at_the_start_takes_no_step(noted):
    evaluated, turns = noted
    rng = np.random.default_rng(241)
    u, v, R = unit_rows(rng), unit_rows(rng), Rotation.random(rng=rng)
    c = np.einsum("ij,ij->i", u, v @ R.as_matrix().T)
    _, worst = polished(R, u, v, c)
    assert worst < 2.3e-16
    assert len(turns) <= 1
    assert len(evaluated) <= 4


@pytest.mark.parametrize(("off", "most"), [(1e-10, 3.5), (1e-6, 4.5), (1e-3, 5.5), (0.1, 6.5)])
def test_regular_solutions_take_newtons_number_of_steps(noted, off, most):
    """Each step squares the error; the first evaluation and the last are no steps."""
    evaluated, _ = noted
    rng, count = np.random.default_rng(242), 0
    for _ in range(80):
        u, v, R = unit_rows(rng), unit_rows(rng), Rotation.random(rng=rng)
        if np.linalg.svd(np.cross(R.apply(v), u), compute_uv=False)[-1] < 0.4:
            continue
        c = np.einsum("ij,ij->i", u, R.apply(v))
        found, worst = polished(Rotation.from_rotvec(off * unit_rows(rng, 1)[0]) * R, u, v, c)
        assert worst <= 4.5e-16
        np.testing.assert_allclose(found, R.as_matrix(), atol=5e-15)
        count += 1
    assert count > 8
    assert len(evaluated) <= most * count


def test_steps_of_more_than_a_fifth_of_a_radian_are_not_taken(noted):
    """They would lead to another solution than the one beside the start."""
    _, turns = noted
    rng, far = np.random.default_rng(243), 0
    for _ in range(30):
        u, v, R = unit_rows(rng), unit_rows(rng), Rotation.random(rng=rng)
        rows = np.cross(R.apply(v), u)
        if np.linalg.svd(rows, compute_uv=False)[-1] < 0.3:
            continue
        c = np.einsum("ij,ij->i", u, R.apply(v))
        start = Rotation.from_rotvec(0.3 * unit_rows(rng, 1)[0]) * R
        step = np.linalg.solve(np.cross(start.apply(v), u), c - np.einsum("ij,ij->i", u, start.apply(v)))
        far += np.linalg.norm(step) > 0.21
        polished(start, u, v, c)
    assert far > 5
    assert max(turns) <= 0.2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cosines_of_one_are_folded_and_those_beyond_have_no_solution(sign):
    """One by rounding, too; and no curve of solutions where all equations are one that has none."""
    rng = np.random.default_rng(244)
    u, v, R = unit_rows(rng), unit_rows(rng), Rotation.random(rng=rng)
    u[1] = sign * R.apply(v[1])
    c = np.einsum("ij,ij->i", u, R.apply(v))
    out = np.empty((8, 3, 3)), np.empty(8)
    for exact in (sign, sign * (1.0 + 2.0**-52), sign * (1.0 + 8e-15)):
        c[1] = exact
        count = assemble(u, v, c, *out)
        assert count >= 1
        assert np.abs(out[0][:count] - R.as_matrix()).max(axis=(1, 2)).min() < 1e-6
    c[1] = sign * (1.0 + 3e-14)
    assert assemble(u, v, c, *out) == 0
    u[:], v[:] = u[1], v[1]
    assert assemble(u, v, np.full(3, sign * 1.1), *out) == 0
    assert assemble(u, v, np.full(3, sign * 0.9), *out) == CONTINUUM
