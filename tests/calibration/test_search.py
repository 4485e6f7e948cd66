"""The search for devices that fit: starts that hold the answer, descents, twins and choices against all of them."""

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from exo_pin.calibration.calibrate_device import nominal_model
from exo_pin.calibration.length_model import CalibrationProblem, MeasurementErrors, estimate, whitening
from exo_pin.calibration.search.solutions import descend, misfits
from exo_pin.calibration.search.starts import (
    distances,
    in_sensors,
    near_body_axes,
    placed,
    starts,
)

JOINTS, CENTRE = ("base_points", "platform_points"), ("base_offset", "cuff_offset")
MOUNTINGS = ("torso_mounting", "arm_mounting")


def asked(exo, unknowns, seen, lengths, noise=1e-3, turn=0.0, prior=np.inf, tolerances=None):
    model = nominal_model(exo, unknowns, tolerances=tolerances)
    errors = MeasurementErrors(noise, turn)
    return CalibrationProblem(model, seen.as_matrix(), lengths, errors, np.full(model.size, prior))


def worst_misfits(problem, values):
    return np.abs(problem.model.lengths(values, problem.measured) - problem.lengths).max(axis=(1, 2))


@pytest.mark.parametrize("offsets", [0.0, 0.1])
def test_the_linear_fit_of_exact_lengths_is_a_device_that_fits_whatever_the_design(offsets):
    rng = np.random.default_rng(90)
    exo = random_exo(rng, 4)
    device = near(exo, rng, joints=0.05, offsets=offsets)
    for count in (12 if offsets else 11, 10):
        seen, lengths = measured(device, Rotation.random(count, rng), None)
        problem = asked(exo, (*JOINTS, "length_offsets") if offsets else JOINTS, seen, lengths)
        found = starts(problem, ())
        exact = worst_misfits(problem, found) < 1e-8
        assert not found[0, :24].any()
        # Nearest first; ten poses determine no linear fit, and with an offset more eleven neither.
        assert exact.sum() == (0 if count == 10 else 6)
        assert len(found) == 15 + exact.sum()
        if exact.any():
            a, b = problem.model.joints(found[exact][0])
            np.testing.assert_allclose(np.stack([a, b]), [device.base, device.platform], atol=1e-7)
            np.testing.assert_allclose(problem.model.length_offsets(found[exact][0]), device.offsets, atol=1e-7)
            apart = distances(problem.model, found[exact])
            assert (np.diff(apart) >= 0.0).all()


@pytest.mark.parametrize("offsets", [0.0, 0.2])
def test_sensors_along_other_axes_of_the_body_are_a_start(offsets):
    """Both mounted so: one of 24 · 24 starts fits, and it comes first."""
    rng = np.random.default_rng(92)
    exo = random_exo(rng, 4)
    turns = Rotation.create_group("O")
    device = near(exo, rng, joints=0.0, offsets=offsets)._replace(torso=turns[7], arm=turns[17])
    seen, lengths = measured(device, poses(rng, 60))
    problem = asked(exo, (*MOUNTINGS, "length_offsets") if offsets else MOUNTINGS, seen, lengths)
    model, found = problem.model, starts(problem, MOUNTINGS)
    torso, arm = model.mountings(found[1])
    assert (torso * device.torso.inv()).magnitude() < 1e-9
    assert (arm * device.arm.inv()).magnitude() < 1e-9
    assert worst_misfits(problem, found[1:2]) < 1e-9
    assert (worst_misfits(problem, found[2:13]) > 1e-4).all()
    # The same device, seen from these mountings and from others.
    other = found[1].copy()
    other[model.places["torso_mounting"]] = (Rotation.from_rotvec([0.1, 0.2, -0.3]) * torso).as_rotvec()
    other[model.places["arm_mounting"]] = (arm * Rotation.from_rotvec([-0.3, 0.1, 0.2])).as_rotvec()
    near_model, values = near_body_axes(model, other, MOUNTINGS)
    np.testing.assert_allclose(near_model.lengths(values, problem.measured), model.lengths(other, problem.measured))
    assert (near_model.torso * device.torso.inv()).magnitude() < 1e-9
    assert (near_model.arm * device.arm.inv()).magnitude() < 1e-9
    np.testing.assert_allclose(near_model.group("torso_mounting", values), [0.1, 0.2, -0.3], atol=1e-9)
    np.testing.assert_allclose(near_model.group("arm_mounting", values), [-0.3, 0.1, 0.2], atol=1e-9)


@pytest.mark.parametrize("unknowns", [JOINTS, (*MOUNTINGS, *CENTRE), ("torso_mounting", "cuff_offset", "arm_mounting")])
def test_a_device_is_placed_as_it_is(unknowns):
    """Of joints in the frames of the sensors come the unknowns, and what the known rings miss: nothing."""
    rng = np.random.default_rng(95)
    exo = random_exo(rng, 5)
    problem = asked(exo, (*unknowns, "length_offsets"), Rotation.identity(1), np.ones((1, 5)))
    model = problem.model
    values = 0.1 * rng.normal(size=(3, model.size))
    u, v = in_sensors(model, values)
    offsets = model.length_offsets(values)
    found, missed = placed(model, u, v, offsets)
    np.testing.assert_allclose(found, values, atol=1e-12)
    moved = np.stack([model.group(name, values, (5, 3)) for name in JOINTS], axis=1)
    np.testing.assert_allclose(missed, moved, atol=1e-12)
    # Of the first limbs alone, and with a joint off its ring: by Kabsch's fit less than it is off.
    u[:, 0, 0] += 0.01
    _, missed = placed(model, u[:, :4], v[:, :4], offsets)
    assert missed.shape == (3, 2, 4, 3)
    if "base_points" not in unknowns:
        off = np.linalg.norm(missed[:, 0], axis=(1, 2))
        assert ((off > 1e-3) & (off < 0.01)).all()


@pytest.mark.parametrize(("turn", "prior"), [(0.0, np.inf), (0.004, np.inf), (0.0, 0.002)])
def test_descents_end_where_another_optimiser_does(turn, prior):
    """With weights as they are at the answer; a tolerance pulls towards the design."""
    rng = np.random.default_rng(96)
    exo = random_exo(rng, 3)
    device = near(exo, rng, mounting=0.05)
    seen, lengths = measured(device, poses(rng, 25), rng, 1e-3, turn)
    unknowns = (*JOINTS, "arm_mounting") if np.isfinite(prior) else JOINTS
    problem = asked(exo, unknowns, seen, lengths, 1e-3, turn, prior)
    model = problem.model
    begun = 0.003 * rng.normal(size=(4, model.size))
    found = descend(problem, begun)
    here = model.evaluate(found[0], problem.measured)
    spread = np.sqrt(1e-6 + turn**2 * (here.by_orientation**2).sum(axis=-1))
    np.testing.assert_allclose(misfits(problem, found[0]), (lengths - here.values) / spread, rtol=1e-12)
    scaled = np.minimum(problem.prior, 1.0)

    def cost(x):
        left = (lengths - model.lengths(x, problem.measured)) / spread
        return np.concatenate([left.ravel(), x / scaled])

    other = least_squares(cost, begun[0], x_scale=model.scales, xtol=1e-12, ftol=1e-12)
    best = (cost(other.x) ** 2).sum()
    costs = [(cost(x) ** 2).sum() for x in found]
    # At the end of least squares nothing pulls any more, with the weights that are those of the answer.
    answer = estimate(problem, begun[0])
    pull = answer.jacobian.T @ answer.residuals - answer.values / problem.prior**2
    assert np.abs(pull * model.scales).max() < 1e-4 * np.linalg.norm(answer.jacobian * model.scales)
    whiten = whitening(model.evaluate(answer.values, problem.measured), 1e-3, turn)
    left = lengths - model.lengths(answer.values, problem.measured)
    np.testing.assert_allclose(answer.residuals.reshape(25, 3), np.einsum("kij,kj->ki", whiten, left), atol=1e-3)
    assert max(costs) < best * (1.01 if turn else 1.001)
    if not turn:
        diagonal = whitening(here, 1e-3, 0.0)
        np.testing.assert_allclose(diagonal, np.tile(1e3 * np.eye(3), (25, 1, 1)), rtol=1e-12)
