"""Which poses to measure: against measurement itself, every subset of a few candidates, and bad input."""

import itertools

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.calibration import pose_information, suggest_poses

JOINTS = ("base_points", "platform_points")


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


def reached(exo, orientations, least=0.05):
    """By definition: every limb within its stroke, regular, and det X of the sign that it has at rest."""
    lengths = exo.inverse_kinematics(orientations).lengths
    strokes = [limb.stroke for limb in exo.mechanism.limbs]
    ends = [[s.end_fitting + share * s.nominal_length for share in (s.shortest, s.longest)] for s in strokes]
    low, high = np.array(ends).T
    beyond = exo.singularity(orientations).determinant * exo.singularity(exo.pose()).determinant < 0.0
    squares = np.linalg.svd(exo.jacobian(orientations), compute_uv=False) ** 2
    margin = np.sqrt(3.0 / (1.0 / squares).sum(axis=-1) / squares.mean(axis=-1))
    return ((lengths >= low) & (lengths <= high)).all(axis=1) & ~beyond & (margin >= least)


def daily(exo):
    """Poses of daily activities that a device reaches, as the documentation takes them."""
    box = ep.adl_box(15.0)
    return box[exo.workspace(box, ["stroke", "singularity"]).inside]


def test_suggested_poses_can_be_reached_and_are_better_than_random_ones():
    exo = ep.load("three-linear-actuators")
    found = daily(exo)[suggest_poses(exo, 20, daily(exo), length_noise=3e-4)]
    assert reached(exo, found).all()
    rng = np.random.default_rng(52)
    arm = poses(rng, 2000)
    inside = arm[reached(exo, arm)]
    assert len(inside) < 1950
    sets = [found, *(inside[rng.choice(len(inside), 20)] for _ in range(15))]
    information = [pose_information(each, exo, length_noise=3e-4) for each in sets]
    rms = [np.sqrt((each.standard_deviations**2).mean()) for each in information]
    assert rms[0] < min(rms[1:])
    assert rms[0] < 0.85 * np.median(rms[1:])


def test_what_cannot_be_determined_is_left_aside():
    exo = ep.load("three-linear-actuators")
    asked = {"unknowns": (*JOINTS, "base_offset"), "length_noise": 3e-4}
    found = pose_information(daily(exo)[suggest_poses(exo, 12, daily(exo), **asked)], exo, **asked)
    # The base's joints one way and its offset the other.
    moved = {frozenset(part.split()[-1] for part in each.description.split(", ")) for each in found.undetermined}
    assert moved == {frozenset(axis) for axis in "xyz"}
    assert all("base offset" in each.description for each in found.undetermined)
    assert "do not determine 3 of 21 directions" in str(found)


def test_bad_input_is_refused():
    exo, rng = ep.load("prototype"), np.random.default_rng(53)
    for count, candidates, options in (
        (0, poses(rng, 8), {}),
        (2.5, poses(rng, 8), {}),
        (True, poses(rng, 8), {}),
        (3, None, {}),
        (9, poses(rng, 8), {}),
        (3, poses(rng, 8)[0], {}),
        (3, poses(rng, 8), {"length_noise": 0.0}),
        (3, poses(rng, 8), {"orientation_noise": -1.0}),
        (3, poses(rng, 8), {"unknowns": ()}),
        (3, poses(rng, 8), {"tolerances": {"base_points": 0.0}}),
    ):
        with pytest.raises(InvalidInput):
            suggest_poses(exo, count, candidates, **{"length_noise": 3e-4} | options)
    with pytest.raises(InvalidInput):
        pose_information(poses(rng, 8), exo.geometry, length_noise=3e-4)
