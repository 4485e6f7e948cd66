"""Which poses a stroke gives up, and what a lost limb costs several wearers."""

from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import study
from exo_pin.numerics.cones import smallest_cone
from exo_pin.workspace import Criteria, Criterion, limb_loss, limb_table, starting_design
from exo_pin.workspace.optimisation.stroke_fitting import stroke_windows, window_margin

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


def test_a_lost_limb_has_to_be_borne_by_the_heaviest_arm():
    """Two wearers together are held only where each is; what is missing is that of the one who misses more."""
    exo = ep.load("four-linear-actuators")
    poses = exo.pose([20, 50, 80, 110], [86, 30, 56, 86], [-5, 25, 25, -5])
    small, large = ep.Wearer(1.55, 50.0, "female"), ep.Wearer(1.9, 105.0, "male")

    def loss(*wearers):
        found = exo.workspace(poses, Criteria(names=("singularity",), wearers=wearers))
        assert found.inside.all()
        return limb_loss(exo.mechanism, found)

    alone, both = [loss(small), loss(large)], loss(small, large)
    for name in ("missing_Nm", "missing_share"):
        np.testing.assert_allclose(both[name], np.maximum(*(table[name] for table in alone)), rtol=1e-9)
    assert (both["held"] <= np.minimum(*(table["held"] for table in alone)) + 1e-12).all()
    assert (alone[1]["held"] < alone[0]["held"]).sum() >= 2
    assert (alone[1]["missing_Nm"] > alone[0]["missing_Nm"] + 0.1).any()


def test_cones_of_a_displaced_device_hold_its_limbs():
    """Base and cuff are off the shoulder by their own: lines from A_i to B_i of the displaced rings."""
    exo = ep.load("four-linear-actuators")
    poses, base, cuff = (
        exo.pose([10, 40, 60], [0, 20, 10]),
        np.array([0.01, 0.0, -0.005]),
        np.array([0.0, 0.012, 0.006]),
    )
    found = exo.workspace(poses, Criteria(names=("singularity",)), centre_offset=ep.CentreOffset(base, cuff))
    assert found.inside.all()
    table, geometry = limb_table(exo.mechanism, found), exo.geometry
    for i in range(4):
        lines = poses.apply(geometry.platform_points[i] + cuff) - geometry.base_points[i] - base
        lengths = np.linalg.norm(lines, axis=1)
        assert table["used_from_m"][i] == pytest.approx(lengths.min())
        assert table["used_to_m"][i] == pytest.approx(lengths.max())
        along = lines / lengths[:, None]
        for name, rows in (("base_cone_deg", along), ("arm_cone_deg", poses.inv().apply(-along))):
            assert table[name][i] == pytest.approx(np.degrees(smallest_cone(rows)[1]), abs=1e-6)


def test_a_criterion_aims_at_what_just_meets_it():
    own = Criterion("reach", "m", "long limb", "#117733", lambda at: 0.35 - at.lengths.max(axis=1), scale=0.05)
    assert (own.aim, own.most, own.limit, own.is_vital, own.needs) == (0.0, 2.0, "", False, ())
    # It needs nothing, so that nothing lacks.
    assert own.missing(ep.load("prototype").mechanism, Criteria(), False) == []
