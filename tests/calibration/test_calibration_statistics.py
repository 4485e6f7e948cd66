"""Estimates lie within their covariance: chi-square and coverage over many sets of measurements."""

import numpy as np
import pytest
from calibration_cases import case, true_values
from measured_devices import measured, near, random_exo
from scipy import stats
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput

JOINTS = ("base_points", "platform_points")
SETS = 60


def vector(device, exo, unknowns):
    """True values of the unknowns, as changes from the design."""
    geometry = exo.geometry
    parts = {
        "base_points": (device.base - geometry.base_points).ravel(),
        "platform_points": (device.platform - geometry.platform_points).ravel(),
    }
    return np.concatenate([parts[name] for name in unknowns])


def judge(errors, covariances, lowest=0.005):
    """The errors are normal with these covariances: chi-square of each set, and coverage of single unknowns."""
    squares = np.array([e @ np.linalg.solve(C, e) for e, C in zip(errors, covariances, strict=True)])
    assert stats.kstest(squares, stats.chi2(errors.shape[1]).cdf).pvalue > lowest
    z = errors / np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    inside = (np.abs(z) < 1.96).mean()
    assert inside == pytest.approx(0.95, abs=0.025)


@pytest.mark.full
@pytest.mark.parametrize(("length", "turn"), [pytest.param(3e-4, 0.0, marks=pytest.mark.full), (3e-4, np.radians(0.2))])
def test_stated_noise(length, turn):
    rng = np.random.default_rng(20)
    exo = random_exo(rng, 3)
    errors, covariances, probabilities = [], [], []
    for _ in range(SETS):
        device = near(exo, rng)
        seen, lengths = measured(device, Rotation.random(40, rng), rng, length, turn)
        found = ep.calibrate(seen, lengths, exo, length_noise=length, orientation_noise=turn)
        errors.append(found.values - vector(device, exo, JOINTS))
        covariances.append(found.covariance)
        probabilities.append(found.probability)
    judge(np.array(errors), np.array(covariances))
    assert stats.kstest(probabilities, "uniform").pvalue > 0.005


@pytest.mark.full
def test_estimated_noise():
    rng = np.random.default_rng(21)
    exo = random_exo(rng, 3)
    ratios = []
    for _ in range(SETS):
        device = near(exo, rng)
        found = ep.calibrate(*measured(device, Rotation.random(20, rng), rng, 3e-4), exo)
        error = found.values - vector(device, exo, JOINTS)
        ratios.append(error @ np.linalg.solve(found.covariance, error) / 18)
    # Hotelling: with the variance estimated from 60 - 18 lengths the ratio is F distributed.
    assert stats.kstest(ratios, stats.f(18, 42).cdf).pvalue > 0.005


@pytest.mark.full
def test_tolerances():
    # Four poses alone determine nothing; the tolerances of the workshop and the poses together do.
    rng = np.random.default_rng(22)
    exo = random_exo(rng, 3)
    errors, covariances = [], []
    for _ in range(SETS):
        device = near(exo, rng, joints=0.002)
        found = ep.calibrate(
            *measured(device, Rotation.random(4, rng), rng, 3e-4),
            exo,
            length_noise=3e-4,
            tolerances=dict.fromkeys(JOINTS, 0.002),
        )
        errors.append(found.values - vector(device, exo, JOINTS))
        covariances.append(found.covariance)
    assert len(found.undetermined) >= 6
    assert (found.standard_deviations < 0.002).all()
    judge(np.array(errors), np.array(covariances))


def covered(seeds):
    """Of each clean case in which all is determined, which unknowns lie in their 95 % intervals."""
    for seed in seeds:
        generated = case(seed, "clean", turned=0.2)
        found = generated.calibrated()
        if found.undetermined:
            continue
        low, high = found.interval().T
        truth = true_values(found, generated.device)
        yield (low <= truth) & (truth <= high)


@pytest.mark.full
def test_sample_of_intervals_holds_the_truth():
    # One unknown of each case is independent of all others: their number is binomial.
    rng = np.random.default_rng(25)
    inside = [bool(rng.choice(each)) for each in covered(range(3000, 3018))]
    low, high = stats.binom.interval(0.999, len(inside), 0.95)
    assert len(inside) >= 15
    assert low <= sum(inside) <= high


@pytest.mark.long
def test_intervals_of_95_percent_hold_the_truth_in_93_to_97():
    # All sets of unknowns, losses, stated and estimated noise, with and without errors of the orientations.
    shares = [each.mean() for each in covered(range(4000, 4220))]
    assert len(shares) >= 200
    assert 0.93 < np.mean(shares[:200]) < 0.97


def test_intervals_are_those_of_student_where_the_noise_is_estimated():
    rng = np.random.default_rng(26)
    exo = random_exo(rng, 3)
    seen, lengths = measured(near(exo, rng), Rotation.random(20, rng), rng, 3e-4)
    for noise, law in ((3e-4, stats.norm), (None, stats.t(60 - 18))):
        found = ep.calibrate(seen, lengths, exo, length_noise=noise)
        half = law.ppf(0.9) * found.standard_deviations
        np.testing.assert_allclose(found.interval(0.8), np.stack([found.values - half, found.values + half], axis=1))
    for wrong in (0.0, 1.0, -1.0, np.nan, "95"):
        with pytest.raises(InvalidInput):
            found.interval(wrong)
