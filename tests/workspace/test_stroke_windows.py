"""Which poses a stroke gives up: windows of lengths that the actuators of a design should take."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import starting_design
from exo_pin.workspace.optimisation.starting_designs import fitted_strokes, stroke_windows, window_margin

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LINEAR = ep.Actuator("linear", push_limit=300.0, pull_limit=300.0)


def fitted(lengths, weights=None):
    """Window of three limbs of equal lengths; a linear actuator of length l goes down to l/2 + 50 mm."""
    design = starting_design(LINEAR, ARM, 3)
    weights = np.ones(len(lengths)) if weights is None else np.array(weights)
    windows = stroke_windows(design, np.repeat(np.array(lengths)[:, None], 3, axis=1), weights)
    np.testing.assert_array_equal(windows, windows[[0, 0, 0]])
    return windows[0]


def windows_by_scan(family, travel, lengths, weights):
    """The longest length of least shortfall, of the quantiles."""
    share, least = {"pneumatic muscle": (0.75, 0.04), "linear": (0.5, 0.1), "cable": (0.0, 0.03)}[family]
    best = None
    for quantile in (1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5):
        end = sorted(lengths)[round(quantile * (len(lengths) - 1))]
        begin = max(share * end + (1.0 - share) * least, min(lengths), -np.inf if travel is None else end - travel)
        cost = 0.0
        for length, weight in zip(lengths, weights, strict=True):
            out = max(begin - length, length - end, 0.0)
            cost += weight * (min(out, 0.1) / 0.1 + (out > 0.0))
        if best is None or cost < best[0] - 1e-12:
            best = cost, begin, max(end, begin)
    return best[1:]


@pytest.mark.parametrize("travel", [None, 0.08])
@pytest.mark.parametrize("family", ["pneumatic muscle", "linear", "cable"])
def test_windows_are_those_of_a_scan(family, travel):
    push = 400.0 if family == "linear" else None
    mechanism = starting_design(ep.Actuator(family, pull_limit=400.0, push_limit=push, travel_limit=travel), ARM, 3)
    rng = np.random.default_rng(5)
    lengths = rng.uniform([0.3, 0.2, 0.12], [0.42, 0.5, 0.16], (40, 3)) + 0.02 * rng.standard_exponential((40, 3))
    weights = rng.dirichlet(np.ones(40))
    found = stroke_windows(mechanism, lengths, weights)
    expected = [windows_by_scan(family, travel, column.tolist(), weights) for column in lengths.T]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    margin = [min(min(x - lo, hi - x) for x, (lo, hi) in zip(row, found, strict=True)) for row in lengths]
    np.testing.assert_allclose(window_margin(found, lengths), margin)
    # The fitted strokes take these windows, and a limb whose stroke is given keeps it.
    fitted = fitted_strokes(mechanism, lengths, weights, is_given=[False, True, False])
    assert fitted.limbs[1].stroke is mechanism.limbs[1].stroke
    for limb, (short, long) in zip(np.array(fitted.limbs, dtype=object)[[0, 2]], found[[0, 2]], strict=True):
        ends = limb.length_range
        assert ends[1] == pytest.approx(long)
        assert ends[0] <= short + 1e-9
        assert travel is None or ends[1] - ends[0] <= travel + 1e-9
    bare = mechanism.replace(limbs=[ep.Limb("SPS")] * 3)
    with pytest.raises(ep.MissingData, match="actuator of limb 1"):
        stroke_windows(bare, lengths, weights)
