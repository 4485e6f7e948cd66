"""Forces and margins of a workspace, against Pinocchio, a quadratic program and the exact condition."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from workspace_examples import free_design

import exo_pin as ep


@pytest.mark.parametrize("limb_count", [3, 4, 5, 6])
def test_forces_agree_with_pinocchio_and_with_the_exact_condition(limb_count):
    exo = free_design(limb_count, seed=2, family="linear" if limb_count == 3 else "cable")
    poses = Rotation.random(12, rng=np.random.default_rng(1))
    found = exo.workspace(poses, ["forces"])
    lower = -300.0 if limb_count == 3 else 0.0
    exact = exo.replace(limbs=[ep.Limb("SPS")] * limb_count).reaction(poses, limits=(lower, 400.0))
    held = found.margins["forces"] >= 0.0
    assert held.any()
    np.testing.assert_array_equal(held, exact.held)
    other = exo.reaction(poses[held], split="minimal", limits=(lower, 400.0))
    np.testing.assert_allclose(found.magnitude[held], other.magnitude, rtol=1e-7, atol=1e-7)
    assert np.isnan(found.magnitude[~held]).all()


def test_limits_that_bind_give_the_same_least_force_as_the_quadratic_program():
    exo = free_design(6, seed=5)
    poses = Rotation.random(60, rng=np.random.default_rng(3))
    limits = ep.Criteria(names=("forces",), least_tension=20.0)
    found = exo.workspace(poses, limits)
    held = np.flatnonzero(found.margins["forces"] >= 0.0)[:12]
    at_limit = np.isclose(found.tensions[held], 20.0).any(axis=1)
    assert at_limit.sum() >= 3
    other = exo.reaction(poses[held], split="minimal", limits=(20.0, 400.0))
    np.testing.assert_allclose(found.magnitude[held], other.magnitude, rtol=1e-7, atol=1e-7)
    assert (found.tensions[held] >= 20.0 - 1e-6).all()


def test_the_margin_of_more_limbs_is_that_of_the_singular_values_of_their_moments():
    exo = free_design(5)
    found = exo.workspace(Rotation.random(8, rng=np.random.default_rng(4)), ["singularity"])
    values = np.linalg.svd(exo.jacobian(found.poses), compute_uv=False)
    expected = 3.0 / np.sqrt((values**2).sum(axis=1) * (values**-2.0).sum(axis=1))
    np.testing.assert_allclose(found.margin, expected, rtol=1e-9)
