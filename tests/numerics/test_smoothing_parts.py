"""Each part of the smoothing splines by its definition: knots, penalty, scores, and which curve is chosen."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.smoothing import smoothing_splines as splines
from exo_pin.numerics.smoothing.smoothing_splines import (
    FEWEST,
    SmoothedSamples,
    _bands,
    _noise_of_differences,
    _Search,
    fit_samples,
    interpolate_samples,
    log_determinant,
    smooth_samples,
)


def noisy(seed, count=60, noise=0.05, components=1):
    rng = np.random.default_rng(seed)
    x = np.arange(float(count))
    phases = np.arange(components)
    return x, np.sin(x[:, None] / 6.0 + phases) + noise * rng.normal(size=(count, components))


def test_bands_and_determinants_are_those_of_the_matrix():
    rng = np.random.default_rng(111)
    half = np.tril(rng.normal(size=(12, 12))) * (np.subtract.outer(range(12), range(12)) <= 7) + 3.0 * np.eye(12)
    A = half @ half.T
    bands = _bands(scipy.sparse.csr_array(A))
    assert bands.shape == (8, 12)
    for k in range(8):
        np.testing.assert_array_equal(bands[k, : 12 - k], np.diagonal(A, -k))
        assert (bands[k, 12 - k :] == 0.0).all()
    banded = np.array([np.append(np.diagonal(half, -k), np.zeros(k)) for k in range(8)])
    assert log_determinant(banded) == pytest.approx(np.linalg.slogdet(A)[1], rel=1e-12)


def test_pure_cubics_in_noise_take_the_stiffest_curve():
    x, _ = noisy(117, 40)
    y = 0.1 * np.random.default_rng(117).normal(size=(40, 1)) + (x[:, None] / 20.0 - 1.0) ** 3
    smooth = smooth_samples(x, y, 1, 5.0)
    cubic = np.polynomial.Polynomial.fit(x, y[:, 0], 3)
    np.testing.assert_allclose(smooth.values[0][:, 0], cubic(x), atol=1e-3)
    np.testing.assert_allclose(smooth.values[1][:, 0], cubic.deriv()(x), atol=1e-3)


def test_noise_is_the_residual_over_the_degrees_of_freedom_that_are_left():
    x, y = noisy(118, components=3)
    for components in (2, 3):
        smooth = smooth_samples(x, y, components)
        basis = _Search(x, y, components, None).basis(smooth.penalty)
        hat = basis.values(np.eye(60), basis.factor(smooth.penalty))[0]
        left = components * (60 - np.trace(hat))
        assert smooth.noise == pytest.approx(np.sqrt(((y - hat @ y) ** 2).sum() / left), rel=1e-4)
        np.testing.assert_allclose(smooth.values[0], hat @ y, atol=1e-10)
        np.testing.assert_allclose(smooth.covariance, basis.covariance(basis.factor(smooth.penalty)), rtol=1e-12)


def test_divided_differences_of_order_eight_leave_noise_alone():
    """A polynomial of degree 7 vanishes; white noise keeps its size; windows across a gap are left out."""
    rng = np.random.default_rng(119)
    x = np.cumsum(rng.uniform(0.8, 1.2, 300))
    curve = np.polynomial.chebyshev.chebval(x / x[-1], rng.normal(size=8))
    noise = rng.normal(size=(300, 2))
    found = _noise_of_differences(x, curve[:, None] + 1e-3 * noise, 2)
    assert found == pytest.approx(1e-3, rel=0.1)
    assert found == pytest.approx(1e-3 * _noise_of_differences(x, noise, 2), rel=1e-6)
    # By definition: the unit vector across all polynomials of degree 7 in each window of nine.
    squares = []
    for k in range(292):
        across = scipy.linalg.null_space(np.vander((x[k : k + 9] - x[k + 4]) / 4.0, 8).T)[:, 0]
        squares.append(((across @ noise[k : k + 9]) ** 2).sum())
    assert _noise_of_differences(x, noise, 2) == pytest.approx(np.sqrt(np.mean(squares) / 2.0), rel=1e-9)
    assert _noise_of_differences(x, noise, 1) == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-9)
    gap = x + 12.0 * (x > x[150])  # a window across it is two and a half times as long
    kept = [k for k in range(292) if not (k <= 150 < k + 8)]
    assert _noise_of_differences(gap, noise, 2) == pytest.approx(
        np.sqrt(np.mean(np.array(squares)[kept]) / 2.0), rel=1e-9
    )


def test_roughness_is_the_mean_noise_of_the_second_derivative():
    covariance = np.zeros((4, 3, 3))
    covariance[:, 2, 2] = [1.0, 4.0, 9.0, 2.0]
    assert SmoothedSamples(np.zeros((3, 4, 1)), 1.0, covariance, 0.0).roughness(0.5) == 1.0


@pytest.mark.parametrize(
    ("plain_noise", "smooth_noise", "smooth_rough", "kept"),
    [(1.0, 1.0, 0.9, "smooth"), (1.0, 1.0, 1.1, "plain"), (1.0, 2.0, 0.12, "smooth"), (1.0, 2.0, 0.13, "plain"),
     (1.0, 0.5, 0.9, "smooth"), (1.0, 0.5, 1.1, "smooth"), (1.0, 0.5, 2.1, "plain"), (0.0, 0.1, 0.1, "plain")],
)  # fmt: skip
def test_the_curve_of_less_noise_in_the_second_derivative_is_taken(
    monkeypatch, plain_noise, smooth_noise, smooth_rough, kept
):
    """A residual that is larger than the noise of differences is bias: its square counts, too."""

    def curve(noise, rough):
        covariance = np.zeros((12, 3, 3))
        covariance[:, 2, 2] = rough**2
        return SmoothedSamples(np.zeros((3, 12, 1)), noise, covariance, 0.0)

    plain, smooth = curve(plain_noise, 1.0), curve(smooth_noise, smooth_rough)
    monkeypatch.setattr(splines, "interpolate_samples", lambda *_: plain)
    monkeypatch.setattr(splines, "smooth_samples", lambda *_: smooth)
    assert fit_samples(np.arange(12.0), np.zeros((12, 1)), 1) is (plain if kept == "plain" else smooth)
    assert fit_samples(np.arange(12.0), np.zeros((12, 1)), 1, noise=0.0) is plain
    assert fit_samples(np.arange(FEWEST - 1.0), np.zeros((11, 1)), 1) is plain


def test_curves_are_free_at_their_ends_unless_they_are_to_rest():
    x, y = noisy(124)
    free, held = fit_samples(x, y, 1), fit_samples(x, y, 1, rest=True)
    assert free.penalty > 0.0
    np.testing.assert_array_equal(free.values, fit_samples(x, y, 1, None, False).values)
    assert np.abs(free.values[1, [0, -1]]).min() > 1e-3
    assert np.abs(held.values[1:, [0, -1]]).max() < 1e-8
    np.testing.assert_array_equal(free.values, smooth_samples(x, y, 1).values)


@pytest.mark.parametrize(("count", "degree"), [(4, 3), (5, 3), (6, 5), (FEWEST - 1, 5), (FEWEST, 7)])
def test_splines_of_few_samples_have_the_degree_that_they_determine(count, degree):
    """A polynomial of that degree is met with its derivatives, one of the next degree is not."""
    x = np.linspace(0.0, count - 1.0, count)
    for power in (degree, degree + 1):
        exact = np.polynomial.Polynomial.basis(power, domain=[0.0, x[-1]], window=[-1.0, 1.0])
        found = interpolate_samples(x, exact(x)[:, None], 1)
        np.testing.assert_allclose(found.values[0, :, 0], exact(x), atol=1e-10)
        off = np.abs(found.values[1, :, 0] - exact.deriv()(x)).max()
        assert (off < 1e-8) == (power == degree)
        assert np.isnan(found.noise) == (count < FEWEST)
    noisy_line = np.random.default_rng(120).normal(size=(count, 1))
    assert np.isnan(fit_samples(x, noisy_line, 1).noise) == (count < FEWEST)
