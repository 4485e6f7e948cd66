"""The PI controller against closed forms."""

import numpy as np
import pytest

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
    gains, interval, error = PIGains(0.5, 0.8), 0.01, 4.0
    controller = ProportionalIntegral([gains], (0.0, 1.0))
    # I' = I + h (K_c e + 1 - K_c e - I) / T_i, at the limit from the first sample.
    for k in range(1, 200):
        assert controller.step([error], interval) == 1.0
        assert controller.integral[0] == pytest.approx(1.0 - (1.0 - interval / gains.T_i) ** k, abs=1e-12)
        if gains.K_c * error + controller.integral[0] < 1.0:
            break
    assert k == 199
