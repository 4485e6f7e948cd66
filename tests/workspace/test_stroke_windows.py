"""Which poses a stroke gives up: windows of lengths that the actuators of a design should take."""

from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import study
from exo_pin.workspace import starting_design
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows, window_margin

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LINEAR = ep.Actuator("linear", push_limit=300.0, pull_limit=300.0)


def fitted(lengths, weights=None):
    """Window of three limbs of equal lengths; a linear actuator of length l goes down to l/2 + 50 mm."""
    design = starting_design(LINEAR, ARM, 3)
    weights = np.ones(len(lengths)) if weights is None else np.array(weights)
    windows = stroke_windows(design, np.repeat(np.array(lengths)[:, None], 3, axis=1), weights)
    np.testing.assert_array_equal(windows, windows[[0, 0, 0]])
    return windows[0]


def test_a_stroke_gives_up_poses_far_off_before_many_that_are_nearly_in():
    """Two poses at 0.6 m need a shortest length of 0.35 m, and a millimetre less is needed in three."""
    bulk, long = [0.45] * 45, [0.6, 0.6]
    np.testing.assert_allclose(fitted([*bulk, *long, *[0.349] * 3]), [0.35, 0.6])
    # Poses count by themselves, too: five nearly in are more than two far off, which count no more than 0.1 m off.
    np.testing.assert_allclose(fitted([*bulk[2:], *long, *[0.349] * 5]), [0.349, 0.45])
    # And by their weights.
    heavy = np.ones(50)
    heavy[-3:] = 5.0
    np.testing.assert_allclose(fitted([*bulk, *long, *[0.349] * 3], heavy), [0.349, 0.45])


@pytest.mark.parametrize("grid_low", [True, False])
def test_the_grid_and_the_poses_of_a_search_have_half_of_the_weight_each(monkeypatch, grid_low):
    """Seven of ten on one side and four of ten on the other at 0.4 m: 55 % of the weight, so that 0.6 m is given up."""
    module, poses = import_module("exo_pin.workspace.optimisation.stroke_fitting"), Rotation.identity(10)
    seven, four = np.repeat([0.4, 0.6], [7, 3]), np.repeat([0.4, 0.6], [4, 6])
    grid, search = (seven, four) if grid_low else (four, seven)
    asked = []
    monkeypatch.setattr(study, "adl_box", lambda step, side: asked.append((step, side)) or poses)
    monkeypatch.setattr(module, "limb_lengths", lambda *_: np.repeat(grid[:, None], 3, axis=1))
    motor = ep.Actuator("linear", push_limit=300.0, pull_limit=300.0, travel_limit=0.05)
    for centres in ((None,), (None, None)):
        found = module.with_strokes(
            starting_design(motor, ARM, 3), np.full(10, 0.1), np.repeat(search[:, None], 3, axis=1), centres, False
        )
        for limb in found.limbs:
            assert limb.length_range[0] < 0.4 < limb.length_range[1] < 0.41
    assert asked == [(4.0, "left")] * 2


def test_margins_of_windows_are_distances_to_the_nearer_end():
    windows = np.array([[0.2, 0.4], [0.3, 0.35]])
    lengths = np.array([[0.3, 0.32], [0.25, 0.34], [0.39, 0.36], [0.1, 0.3]])
    np.testing.assert_allclose(window_margin(windows, lengths), [0.02, 0.01, -0.01, -0.1])


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


def test_spare_length_costs_no_pose():
    """A linear actuator that is at its family's limit is not made longer, for then its shortest length would rise."""
    linear = starting_design(ep.Actuator("linear", pull_limit=400.0, push_limit=400.0), ARM, 3)
    lengths = np.tile([[0.35], [0.45], [0.60]], (1, 3))  # 0.35 = 0.60/2 + 0.1/2
    for spare in (0.0, 0.002):
        stroke = fitted_strokes(linear, lengths, np.full(3, 1 / 3), spare).limbs[0].stroke
        ends = [stroke.end_fitting + ratio * stroke.nominal_length for ratio in (stroke.shortest, stroke.longest)]
        assert ends == pytest.approx([0.35, 0.60], abs=1e-9)
    # Where there is room the spare is taken at both ends.
    shorter = np.tile([[0.45], [0.50], [0.60]], (1, 3))
    roomy = fitted_strokes(linear, shorter, np.full(3, 1 / 3), 0.002).limbs[0].stroke
    ends = [roomy.end_fitting + ratio * roomy.nominal_length for ratio in (roomy.shortest, roomy.longest)]
    assert ends == pytest.approx([0.448, 0.602], abs=1e-9)
