"""The search for devices that fit: starts that hold the answer, descents, twins and choices against all of them."""

import numpy as np
import pytest
from answers import changes, each_of
from measured_devices import measured, near, poses, random_exo
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from exo_pin.calibration.calibrate_device import nominal_model
from exo_pin.calibration.length_model import CalibrationProblem, MeasurementErrors, estimate, whitening
from exo_pin.calibration.search.solutions import descend, misfits
from exo_pin.calibration.search.starts import (
    best_combinations,
    combined,
    distances,
    in_sensors,
    limb_options,
    near_body_axes,
    starts,
    with_offsets,
)

MOUNTINGS = ("torso_mounting", "arm_mounting")
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


def begun(limbs, count, unknowns, *, searched=(), turns=0, joints=0.0, offsets=0.0, tolerances=None):
    """Misfits of all starts, how far they are from the design and how they turn sensors; offsets; the best start."""
    rng = np.random.default_rng(90)
    exo, axes = random_exo(rng, limbs), Rotation.create_group("O")
    device = near(exo, rng, joints=joints, offsets=offsets)._replace(torso=axes[turns], arm=axes[2 * turns])
    seen, lengths = measured(device, poses(rng, count))
    lengths[::7] += 0.02
    problem = asked(exo, unknowns, seen, lengths, tolerances=tolerances)
    model, found = problem.model, starts(problem, searched)
    misfit = np.abs(model.lengths(found, problem.measured) - lengths).mean(axis=1)
    turned = [turn.magnitude() for turn in model.mountings(found)]
    best = near_body_axes(model, found[misfit.sum(axis=1).argmin()] + 0.1, searched)
    placed_at = (best[0].torso, best[0].arm, best[1])
    return misfit, distances(model, found), turned, with_offsets(model, problem.measured, lengths).offsets, placed_at


def optional(size, unknowns, axis=False):
    """Limbs that give the lengths of a device nearly, devices of them and the choices of any joints that are best."""
    rng = np.random.default_rng(97)
    exo = random_exo(rng, 3)
    arm = Rotation.from_rotvec(np.outer(np.linspace(0.0, 2.0, 30), [0.6, -0.64, 0.48]))
    arm = Rotation.from_rotvec(size * rng.normal(size=(30, 3))) * arm if axis else poses(rng, 30)
    seen, lengths = measured(near(exo, rng, joints=0.0), arm)
    model = asked(exo, unknowns, seen, lengths).model
    device = 0.03 * rng.normal(size=(1, model.size))
    options = limb_options(model, np.concatenate([device, device + 1e-6, device + 0.01]), seen.as_matrix())
    u, v = (0.2 * rng.normal(size=(3, 4, 3)) for _ in range(2))
    devices = combined(model, options, 40)
    return (
        [(len(own), np.abs(own).sum(axis=0)) for own in options],
        (distances(model, devices), *(joints.mean(axis=1) for joints in in_sensors(model, devices[:5]))),
        best_combinations(model, list(u), list(v), 60) @ [100, 10, 1],
    )


ASKED = {
    "starts": lambda: [
        begun(4, 24, (*JOINTS, "length_offsets"), joints=0.05, offsets=0.1),
        begun(3, 11, (*JOINTS, "length_scale", "torso_mounting"), joints=0.05, tolerances={"arm_mounting": 0.1}),
        *(begun(3, count, JOINTS)[1] for count in (10, 11)),
        *(begun(3, count, (*JOINTS, "length_offsets"))[1] for count in (11, 12)),
        begun(4, 60, (*MOUNTINGS, "length_offsets"), searched=MOUNTINGS, turns=7, offsets=0.2),
        begun(4, 30, ("torso_mounting", *CENTRE), searched=("torso_mounting",), turns=5),
        begun(3, 30, ("arm_mounting", "cuff_offset"), searched=("arm_mounting",), turns=7),
    ],
    "options": lambda: [
        optional(0.0, JOINTS, True),
        *(optional(size, (*JOINTS, "length_offsets"), True) for size in (0.06, 0.15)),
        optional(0.0, ("platform_points", *MOUNTINGS)),
        optional(0.0, ("base_points", "torso_mounting", "base_offset")),
        optional(0.0, ("length_scale", "torso_mounting", *CENTRE)),
    ],
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
