"""The search for devices that fit: starts that hold the answer, descents, twins and choices against all of them."""

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
from scipy.optimize import least_squares

from exo_pin.calibration.calibrate_device import nominal_model
from exo_pin.calibration.length_model import CalibrationProblem, MeasurementErrors, estimate, whitening
from exo_pin.calibration.search.solutions import descend, misfits

JOINTS, CENTRE = ("base_points", "platform_points"), ("base_offset", "cuff_offset")


def asked(exo, unknowns, seen, lengths, noise=1e-3, turn=0.0, prior=np.inf, tolerances=None):
    model = nominal_model(exo, unknowns, tolerances=tolerances)
    errors = MeasurementErrors(noise, turn)
    return CalibrationProblem(model, seen.as_matrix(), lengths, errors, np.full(model.size, prior))


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
