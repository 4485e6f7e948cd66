"""Forces of massless limbs in closed form against least squares of the balance of the arm."""

import numpy as np
import pytest
import scipy
from wrists import random_mechanism, regular_poses

from exo_pin.wrist.forces.force_kernels import open_effects, spherical_forces, standalone_forces
from exo_pin.wrist.limbs import classify

pytestmark = pytest.mark.usefixtures("plain")


def solved(n, upu, seed):
    """Limbs of a pose, a load, and what the kernels make of them."""
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, n, ["UPU" if i in upu else "SPS" for i in range(n)])
    limbs = classify(mechanism, regular_poses(mechanism, rng, 1).as_matrix())
    s, X, reach, b = limbs.s[0], limbs.X[0], limbs.reach[0], limbs.b[0]
    F, M = rng.normal(size=(2, 3))
    f, shoulder, Q, U = np.empty(n), np.empty(3), np.empty((n, 3)), np.zeros((3, 3))
    spherical_forces(s, X, reach, tuple(F.tolist()), tuple(M.tolist()), f, shoulder, Q, U)
    return s, X, b, F, M, f, shoulder, Q, np.array(upu, dtype=np.int64)


@pytest.mark.parametrize("n", [3, 4, 6])
def test_tensions_are_the_shortest_that_hold_the_moment(n):
    for seed in range(4):
        s, _, b, F, M, f, shoulder, _, _ = solved(n, range(n), seed)
        expected = np.linalg.lstsq(np.cross(b, s).T, M, rcond=None)[0]
        np.testing.assert_allclose(f, expected, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(shoulder, f @ s - F, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("n", "upu"), [(3, (0, 2)), (4, (1, 3)), (6, ()), (6, (0, 4))])
def test_undetermined_forces_are_self_stress_and_side_forces(n, upu):
    s, X, b, _, _, _, _, Q, chosen = solved(n, upu, 5)
    N, G = np.empty((n, n - 3)), np.full((3, n - 3 + len(upu)), np.nan)
    open_effects(s, X, chosen, Q, N, G)
    np.testing.assert_allclose(N.T @ N, np.eye(n - 3), atol=1e-13)
    np.testing.assert_allclose(np.cross(b, s).T @ N, 0.0, atol=1e-14)
    np.testing.assert_allclose(G[:, : n - 3], s.T @ N, atol=1e-14)
    np.testing.assert_array_equal(G[:, n - 3 :], X[list(upu)].T)


@pytest.mark.parametrize(("n", "upu"), [(3, (0, 1, 2)), (4, (0, 1, 3)), (5, (1,)), (6, ()), (6, (0, 4))])
def test_limbs_that_carry_everything_have_the_least_squares(n, upu):
    s, X, b, F, M, f, shoulder, Q, chosen = solved(n, upu, 6)
    u = len(upu)
    g, N, G = np.zeros(n), np.empty((n, n - 3)), np.empty((3, n - 3 + u))
    assert standalone_forces(s, X, chosen, Q, f, g, shoulder, N, G, np.empty(3), np.empty(n - 3 + u))
    balance = np.block([[np.cross(b, s).T, np.zeros((3, u))], [s.T, X[list(upu)].T]])
    expected = np.linalg.lstsq(balance, np.concatenate([M, F]), rcond=None)[0]
    np.testing.assert_allclose(f, expected[:n], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(g[list(upu)], expected[n:], rtol=1e-8, atol=1e-9)
    assert (np.delete(g, upu) == 0.0).all()
    assert (shoulder == 0.0).all()


def test_too_few_undetermined_forces_cannot_carry_everything():
    for n, upu in ((4, ()), (4, (1,)), (5, ())):
        s, X, _, _, _, f, shoulder, Q, chosen = solved(n, upu, 7)
        count = n - 3 + len(upu)
        before, own = shoulder.copy(), f.copy()
        room = np.empty((n, n - 3)), np.empty((3, count)), np.empty(3), np.empty(count)
        assert not standalone_forces(s, X, chosen, Q, f, np.zeros(n), shoulder, *room)
        np.testing.assert_array_equal(shoulder, before)
        np.testing.assert_array_equal(f, own)


def test_the_complement_of_one_basis_is_that_of_scipy():
    s, _, b, _, _, _, _, Q, _ = solved(5, (), 8)
    own = scipy.linalg.null_space(np.cross(b, s).T)
    np.testing.assert_allclose(np.eye(5) - Q @ Q.T, own @ own.T, atol=1e-12)
