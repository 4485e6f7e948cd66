"""Affine equilibrium with random numbers: its laws by their definitions, as one linear system where there is one."""

import numpy as np
import pytest

from exo_pin.wrist.forces.affine_state import AffineState, BalancedTensions


def states(rng, count, n, side_moments=True):
    closure, of_f, of_g, share = rng.normal(size=(4, count, n, 6))
    if not side_moments:
        of_g[..., 3:] = 0.0
    return AffineState.of_closures(closure, of_f, of_g, share, rng.normal(size=(count, 6))), closure, of_f, of_g, share


def test_closures_and_shoulder_carry_the_wrench():
    rng = np.random.default_rng(95)
    closure, of_f, of_g, share = rng.normal(size=(4, 5, 4, 6))
    wrench, f, g = rng.normal(size=(5, 6)), rng.normal(size=(5, 4)), rng.normal(size=(5, 4))
    state = AffineState.of_closures(closure, of_f, of_g, share, wrench)
    own = closure + f[..., None] * of_f + g[..., None] * of_g
    np.testing.assert_allclose(state.closures(f, g), own, rtol=1e-14)
    on_arm, on_torso = state.wrenches(f, g)
    np.testing.assert_allclose(on_arm, own - share, atol=1e-14)
    np.testing.assert_allclose(on_torso, -own, atol=1e-14)
    np.testing.assert_allclose(state.on_arm_of(f, g), own - closure, atol=1e-14)
    # F_s is what is left of the force; what is left of the moment is zero where M_f f + M_g g = m.
    left = wrench - own.sum(axis=1)
    np.testing.assert_allclose(state.shoulder_force(f, g), left[:, :3], atol=1e-13)
    miss = state.moment - np.einsum("kij,kj->ki", state.moment_of_f, f) - np.einsum("kij,kj->ki", state.moment_of_g, g)
    np.testing.assert_allclose(miss, left[:, 3:], atol=1e-13)
    one = state.row(2)
    np.testing.assert_allclose(one.shoulder_force(f[2], g[2]), left[2, :3], atol=1e-13)


@pytest.mark.parametrize("n", [3, 5])
def test_side_forces_follow_springs(n):
    """g = k (Sᵀδ + misfit) and F_s = -K δ = s_0 + S_f f + S g, solved at once for δ."""
    rng = np.random.default_rng(96)
    state = states(rng, 1, n)[0].row(0)
    root = rng.normal(size=(3, 3))
    K, k, misfit, f = root @ root.T + np.eye(3), rng.uniform(0.0, 2.0, n), rng.normal(size=n), rng.normal(size=n)
    S = state.shoulder_of_g
    delta = np.linalg.solve(K + S @ np.diag(k) @ S.T, -state.shoulder - state.shoulder_of_f @ f - S @ (k * misfit))
    g = k * (S.T @ delta + misfit)
    follower = state.following(K, k, misfit)
    np.testing.assert_allclose(follower.g + follower.g_of_f @ f, g, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(follower.state.shoulder_force(f, 0.0 * g), -K @ delta, rtol=1e-10, atol=1e-12)
    kept = follower.state.moment - follower.state.moment_of_f @ f
    np.testing.assert_allclose(kept, state.moment - state.moment_of_f @ f - state.moment_of_g @ g, atol=1e-11)


@pytest.mark.parametrize("side_moments", [True, False])
@pytest.mark.parametrize("n", [3, 5])
def test_balanced_tensions_are_the_shortest(n, side_moments):
    rng = np.random.default_rng(97)
    state = states(rng, 4, n, side_moments)[0]
    found = BalancedTensions.of(state)
    np.testing.assert_allclose(found.singular_values, np.linalg.svd(state.moment_of_f, compute_uv=False), rtol=1e-12)
    for k in range(4):
        M = state.moment_of_f[k]
        expected = np.linalg.lstsq(M, state.moment[k], rcond=None)[0]
        np.testing.assert_allclose(found.f[k], expected, rtol=1e-10, atol=1e-12)
        of_g = -np.linalg.pinv(M) @ state.moment_of_g[k]
        np.testing.assert_allclose(found.f_of_g[k], of_g, atol=1e-11)
        stress = found.self_stress[k]
        np.testing.assert_allclose(stress.T @ stress, np.eye(n - 3), atol=1e-14)
        np.testing.assert_allclose(M @ stress, 0.0, atol=1e-13)
        g, y = rng.normal(size=n), rng.normal(size=n - 3)
        force = state.row(k).shoulder_force(expected + of_g @ g + stress @ y, g)
        own = found.shoulder[k] + found.shoulder_of_g[k] @ g + found.shoulder_of_stress[k] @ y
        np.testing.assert_allclose(own, force, atol=1e-11)


def test_tensions_beside_a_singular_pose_are_refined():
    """Where f is a million times the moment, what it leaves of the moment is rounding of the moment."""
    rng = np.random.default_rng(98)
    state = states(rng, 20, 3)[0]
    U, values, Vt = np.linalg.svd(state.moment_of_f)
    values[:, 2] = 1e-8
    state = state._replace(moment_of_f=U * values[:, None] @ Vt)
    found = BalancedTensions.of(state)
    left = state.moment - np.einsum("kij,kj->ki", state.moment_of_f, found.f)
    assert np.abs(found.f).max() > 1e7
    assert np.abs(left).max() < 1e-7
    flat = state._replace(moment_of_f=U * np.where(np.arange(3) < 2, values, 0.0)[:, None] @ Vt)
    assert np.isfinite(BalancedTensions.of(flat).f).all()


@pytest.mark.parametrize("n", [3, 5])
def test_elastic_answers_solve_springs_and_balance_at_once(n):
    rng = np.random.default_rng(99)
    state = states(rng, 4, n)[0]
    found = BalancedTensions.of(state)
    root = rng.normal(size=(3, 3))
    K, k, misfit = root @ root.T + 5.0 * np.eye(3), rng.uniform(0.0, 0.3, (4, n)), rng.normal(size=(4, n))
    sides = state.shoulder_of_g
    g, delta = found.elastic(sides, K, k, misfit)
    system, load = found.elastic_system(sides, K, k, misfit)
    for i in range(4):
        np.testing.assert_allclose(g[i], k[i] * (sides[i].T @ delta[i] + misfit[i]), atol=1e-12)
        f = found.f[i] + found.f_of_g[i] @ g[i]
        np.testing.assert_allclose(state.row(i).shoulder_force(f, g[i]), -K @ delta[i], atol=1e-9)
        np.testing.assert_allclose(system[i] @ delta[i], load[i], atol=1e-10)


def test_a_direction_without_stiffness_has_no_answer():
    state = states(np.random.default_rng(100), 3, 3, side_moments=False)[0]
    found = BalancedTensions.of(state)
    none = np.zeros((3, 3))
    for loose, firm in ((1e-13, False), (1e-11, True)):
        g, delta = found.elastic(state.shoulder_of_g, np.diag([1.0, 1.0, loose]), none, none)
        assert np.isfinite(delta).all() == firm
        assert np.isnan(delta).all() != firm
        assert np.isfinite(g).all() == firm
