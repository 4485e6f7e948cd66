"""Which poses to measure: against measurement itself, every subset of a few candidates, and the data's covariance."""

import itertools
import re

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.calibration import pose_information, suggest_poses


@pytest.mark.parametrize("turn", [0.0, 0.003])
def test_expected_deviations_are_those_of_a_measurement(turn):
    rng = np.random.default_rng(50)
    exo, arm = ep.load("prototype"), poses(rng, 40)
    expected = pose_information(arm, exo, length_noise=3e-4, orientation_noise=turn)
    seen, lengths = measured(near(exo, rng, joints=1e-5), arm)
    found = ep.calibrate(seen, lengths, exo, length_noise=3e-4, orientation_noise=turn)
    np.testing.assert_allclose(expected.standard_deviations, found.standard_deviations, rtol=5e-3)
    # Singular values, from their definition.
    if not turn:
        jacobian = found.model.evaluate(np.zeros(18), arm.as_matrix()).by_unknowns.reshape(-1, 18) / 3e-4
        np.testing.assert_allclose(expected.singular_values, np.linalg.svd(jacobian, compute_uv=False), rtol=1e-9)
    assert str(expected).startswith("40 poses determine all 18 unknowns")


def test_suggested_poses_are_nearly_the_best_of_all_subsets():
    rng = np.random.default_rng(51)
    exo = random_exo(rng, 3)
    candidates = Rotation.random(10, rng)

    def cost(chosen):
        information = pose_information(candidates[list(chosen)], exo, length_noise=1e-3)
        return (information.standard_deviations**2).sum() if not information.undetermined else np.inf

    costs = [cost(subset) for subset in itertools.combinations(range(10), 7)]
    found = suggest_poses(exo, 7, candidates, length_noise=1e-3)
    assert len(set(found.tolist())) == 7
    # An exchange of single poses stops at a local optimum.
    assert np.mean(np.array(costs) < cost(found) * (1 - 1e-9)) < 0.02


def test_the_deviation_of_a_direction_is_that_of_the_data_along_it():
    """Poses within two degrees: a direction is as uncertain as its eigenvector of the covariance is long."""
    rng = np.random.default_rng(71)
    exo = random_exo(rng, 3)
    arm = Rotation.from_rotvec(0.02 * rng.normal(size=(30, 3)))
    told = pose_information(arm, exo, unknowns=("base_offset", "length_offsets"), length_noise=1e-3)
    variances, axes = np.linalg.eigh(told.covariance)
    lost = np.flatnonzero(np.sqrt(variances) > 0.1 * told.model.reach)
    assert len(told.undetermined) == len(lost) > 0
    for each in told.undetermined:
        # In the space of the lost ones, along the direction whose largest component is one.
        along = axes[:, lost].T @ each.direction / np.linalg.norm(each.direction)
        size = np.sqrt((along**2 * variances[lost]).sum()) / np.linalg.norm(each.direction)
        assert each.standard_deviation == pytest.approx(size, rel=1e-6)
        assert f"(standard deviation {1e3 * each.standard_deviation:.3g} mm or mrad)" in str(each)
        largest = np.argsort(-np.abs(each.direction))[:4]
        named = [told.names[k] for k in largest if abs(each.direction[k]) > 0.05]
        assert re.findall(r"[+-][\d.e-]+ ([^,(]+?)(?:,|$)", each.description.removesuffix(", ...")) == named
