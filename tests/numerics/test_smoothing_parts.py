"""Each part of the smoothing splines by its definition: knots, penalty, scores, and which curve is chosen."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.smoothing import smoothing_splines as splines
from exo_pin.numerics.smoothing.smoothing_splines import (
    FEWEST,
    SmoothedSamples,
    SplineBasis,
    _apart,
    _bands,
    _interpolation_noise,
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


@pytest.mark.parametrize("stride", [1, 3])
def test_knots_are_inner_samples_and_even_beyond_the_ends(stride):
    x = np.sort(np.random.default_rng(110).uniform(0.0, 29.0, 30))
    knots = SplineBasis(x, stride).knots
    inner = x[4:-4][::stride]
    np.testing.assert_array_equal(knots[8:-8], inner)
    step = (x[-1] - x[0]) / (len(inner) + 1)
    np.testing.assert_allclose(knots[:8], x[0] - step * np.arange(7, -1, -1), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(knots[-8:], x[-1] + step * np.arange(8), rtol=1e-13)


def test_knots_keep_apart_from_each_other_and_from_the_ends():
    knots = np.array([0.1, 0.3, 0.5, 0.9, 1.1, 1.9])
    np.testing.assert_array_equal(_apart(knots, 0.0, 2.0, 0.25), [0.3, 0.9])
    np.testing.assert_array_equal(_apart(knots, 0.0, 2.0, 0.05), knots)
    np.testing.assert_array_equal(_apart(np.array([0.0, 1.0, 1.0, 2.0]), 0.0, 2.0, 0.0), [1.0])


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


def test_the_penalty_is_the_integral_of_the_fourth_derivative_squared():
    """Of x⁴ and x⁵, which the splines contain: ∫ 24² and ∫ (120 x)²."""
    x = np.arange(20.0)
    basis = SplineBasis(x)
    count = basis._penalty.shape[1]
    P = sum(
        scipy.sparse.diags_array([basis._penalty[k, : count - k]] * (2 if k else 1), offsets=[k, -k] if k else [0])
        for k in range(8)
    ).toarray()
    for power, expected in ((3, 0.0), (4, 24.0**2 * 19.0), (5, 120.0**2 * 19.0**3 / 3.0)):
        weights = scipy.linalg.solveh_banded(basis._normal, basis.rows[0].T @ x**power, lower=True)
        np.testing.assert_allclose(basis.rows[0] @ weights, x**power, rtol=1e-6, atol=1e-3)
        assert weights @ P @ weights == pytest.approx(expected, rel=1e-5, abs=1e-3)


def test_curves_at_rest_start_and_end_so():
    x, y = noisy(112)
    for rest in (True, False):
        basis = SplineBasis(x, rest=rest)
        value, rate, change = basis.values(y, basis.factor(1.0))
        ends = np.abs([rate[0], rate[-1], change[0], change[-1]])
        assert (ends.max() < 1e-8) if rest else (ends.min() > 1e-6)
        np.testing.assert_allclose(value[30], y[30], atol=0.2)


@pytest.mark.parametrize("noise", [None, 0.05])
def test_scores_are_those_of_the_hat_matrix(noise):
    x, y = noisy(113, components=2)
    search = _Search(x, y, 2, noise)
    for penalty in (0.1, 10.0, 1e3):
        basis = search.basis(penalty)
        hat = basis.values(np.eye(60), basis.factor(penalty))[0]
        squares, freedom = ((y - hat @ y) ** 2).sum(), 1.4 * np.trace(hat)
        if noise is None:
            expected = np.log(squares / (60.0 - freedom) ** 2)
        else:
            expected = squares / 2.0 + 2.0 * noise**2 * freedom
        assert search.score(np.log(penalty)) == pytest.approx(expected, rel=2e-5)


def test_too_many_degrees_of_freedom_have_no_score():
    """1.4 of them a sample: where the curve passes through nearly all samples."""
    x, y = noisy(114)
    search = _Search(x, y, 1, None)
    assert search.score(np.log(1e-9)) == np.inf
    assert np.isfinite(search.score(np.log(1.0)))
    assert np.isfinite(_Search(x, y, 1, 0.05).score(np.log(1e-9)))


@pytest.mark.parametrize(("count", "levels"), [(11, 0), (12, 1), (23, 1), (24, 2), (60, 3), (400, 6)])
def test_stiffer_curves_have_fewer_knots(count, levels):
    """Half of them for each 2⁸ of λ beyond 100, as long as about six samples are left between knots at the ends."""
    x, y = noisy(115, count)
    search = _Search(x, y, 1, None)
    assert search.levels == levels
    for level in range(levels + 2):
        for share, stride in ((0.9, level), (1.1, level + 1)):
            basis = search.basis(share * 100.0 * 2.0 ** (8 * level))
            inner = len(basis.knots) - 16
            assert inner == len(x[4:-4][:: 2 ** min(stride, levels)])
            assert search.basis(share * 100.0 * 2.0 ** (8 * level)) is basis


@pytest.mark.parametrize("noise", [None, 0.3, 3.0])
@pytest.mark.parametrize("count", [30, 90])
def test_the_best_penalty_is_the_best_of_a_scan_of_the_whole_range(noise, count):
    """From interpolation, 1e-9, to a cubic, 1e4 with the fewest knots' spacing as the unit."""
    x, y = noisy(116, count, noise=0.3)
    search = _Search(x, y, 1, noise)
    low, high = np.log(1e-9), np.log(1e4) + search.levels * np.log(2.0**8)
    scan = [search.score(at) for at in np.linspace(low, high, 150)]
    found = np.log(search.best())
    assert low <= found <= high
    assert search.score(found) <= min(scan) + 1e-4 * abs(min(scan))


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


def test_interpolation_of_samples_that_share_a_place_has_noise_where_knots_can_be_apart():
    x = np.arange(30.0)
    plain = _interpolation_noise(x)
    assert plain.shape == (30, 3, 3)
    matrix = [scipy.interpolate.make_interp_spline(x, np.eye(30), k=7)(x, order) for order in range(3)]
    expected = np.einsum("ank,bnk->nab", matrix, matrix)
    np.testing.assert_allclose(plain, expected, rtol=1e-6, atol=1e-9)
    twice = np.sort(np.append(x, 14.0 + 1e-13))
    assert np.isfinite(_interpolation_noise(twice)).all()
    blank = interpolate_samples(np.arange(11.0), np.zeros((11, 1)), 1)
    assert np.isnan(blank.noise)
    assert np.isnan(blank.covariance).all()
    assert blank.covariance.shape == (11, 3, 3)
    assert blank.penalty == 0.0


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


@pytest.mark.parametrize("at_end", [False, True])
def test_knots_keep_their_distance_from_the_first_and_the_last_sample(at_end):
    """Not from those beside them: six samples within a third of the spacing, and a knot at the sixth."""
    x = np.concatenate([[0.0, 0.05, 0.1, 0.15, 0.32], np.arange(1.0, 20.0)])
    if at_end:
        x = x[-1] - x[::-1]
    inner = SplineBasis(x, nearest=0.3).knots[8:-8]
    edge = x[-5] if at_end else x[4]
    assert edge in inner
    assert edge not in SplineBasis(x, nearest=0.33).knots[8:-8]


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
