"""The PI controller against closed forms."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.control import PIGains, ProportionalIntegral

GAIN, LAG = 2.0, 0.4


def loop(gains, steps, interval, target):
    """A first-order lag dy/dt = (GAIN u - y) / LAG under control; y at the samples."""
    controller = ProportionalIntegral([gains], (-100.0, 100.0))
    decay = np.exp(-interval / LAG)
    y = [0.0]
    for _ in range(steps):
        u = controller.step([target - y[-1]], interval)[0]
        y.append(decay * y[-1] + (1.0 - decay) * GAIN * u)
    return np.array(y)


def analytic(gains, t, target):
    """Step response of the continuous loop: LAG T_i s² + (1 + GAIN K_c) T_i s + GAIN K_c, one zero at -1/T_i."""
    loop_gain = GAIN * gains.K_c
    p, q = np.roots([LAG * gains.T_i, (1.0 + loop_gain) * gains.T_i, loop_gain]).astype(complex)
    # Residues of loop_gain (T_i s + 1) / (LAG T_i (s - p)(s - q)) times target / s.
    scale = loop_gain / (LAG * gains.T_i)
    at = sum(scale * (gains.T_i * a + 1.0) / (a * (a - b)) * np.exp(a * t) for a, b in ((p, q), (q, p)))
    return target * (1.0 + at).real


@pytest.mark.parametrize("gains", [PIGains(0.8, 0.25), PIGains(3.0, 0.9), PIGains(0.3, 0.1)])
def test_step_response_tends_to_that_of_the_continuous_loop(gains):
    misses = []
    for interval in (0.01, 0.001):
        steps = round(2.0 / interval)
        t = interval * np.arange(steps + 1)
        misses.append(np.abs(loop(gains, steps, interval, 1.5) - analytic(gains, t, 1.5)).max())
    # First order in the interval.
    assert misses[1] < 0.02
    assert misses[0] / misses[1] == pytest.approx(10.0, rel=0.25)


def test_integral_at_a_limit_follows_the_geometric_series_of_back_calculation():
    gains, interval, error = PIGains(0.5, 0.8, 0.3), 0.01, 4.0
    controller = ProportionalIntegral([gains], (0.0, 1.0))
    # I' = I + h (K_c e / T_i + (1 - K_c e - I) / T_t), at the limit from the first sample.
    rest = 1.0 - gains.K_c * error + gains.K_c * error * gains.T_t / gains.T_i
    for k in range(1, 200):
        assert controller.step([error], interval) == 1.0
        assert controller.integral[0] == pytest.approx(rest * (1.0 - (1.0 - interval / gains.T_t) ** k), abs=1e-12)
        if gains.K_c * error + controller.integral[0] < 1.0:
            break
    assert k == 199


def test_anti_windup_leaves_the_limit_sooner():
    def samples_at_the_limit(tracking_time):
        controller = ProportionalIntegral([PIGains(0.5, 0.8, tracking_time)], (0.0, 1.0))
        for _ in range(500):
            controller.step([4.0], 0.01)
        return sum(controller.step([-1.0], 0.01)[0] == 1.0 for _ in range(3000))

    assert samples_at_the_limit(0.3) == 0
    # Without it the integral is 500 · 0.01 · 0.5 · 4 / 0.8 = 12.5, and falls by 0.625 a second from there.
    assert samples_at_the_limit(np.inf) == pytest.approx((12.5 - 0.5 - 1.0) / 0.625 * 100, abs=2)


def test_channels_do_not_know_each_other_and_reset_forgets():
    both = ProportionalIntegral([PIGains(0.5, 0.8), PIGains(0.1, 0.2)], (-1.0, 1.0))
    alone = [ProportionalIntegral([gains], (-1.0, 1.0)) for gains in both.gains]
    errors = np.random.default_rng(3).normal(size=(50, 2))
    first = [both.step(error, 0.01) for error in errors]
    for error, given in zip(errors, first, strict=True):
        assert given.tolist() == [each.step([part], 0.01)[0] for each, part in zip(alone, error, strict=True)]
    both.reset()
    assert [both.step(error, 0.01).tolist() for error in errors] == [given.tolist() for given in first]


@pytest.mark.parametrize(
    "make",
    [
        lambda: PIGains(-1.0, 1.0),
        lambda: PIGains(1.0, 0.0),
        lambda: PIGains(1.0, 1.0, -2.0),
        lambda: PIGains(np.nan, 1.0),
        lambda: ProportionalIntegral([]),
        lambda: ProportionalIntegral([PIGains(1.0, 1.0)], (1.0, 1.0)),
        lambda: ProportionalIntegral([PIGains(1.0, 1.0)]).step([np.nan], 0.01),
        lambda: ProportionalIntegral([PIGains(1.0, 1.0)]).step([1.0, 2.0], 0.01),
    ],
)
def test_bad_input_is_refused(make):
    with pytest.raises(InvalidInput):
        make()
