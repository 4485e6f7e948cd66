"""What a lost limb costs several wearers, and how far limbs turn."""

import itertools

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria, Criterion, limb_loss, limb_table


def opening(directions):
    """Half angle of the smallest cone around few directions: it touches two of them, or three."""
    sets = [subset for size in (2, 3) for subset in itertools.combinations(directions, size)]
    axes = [np.linalg.lstsq(np.array(subset), np.ones(len(subset)))[0] for subset in sets]
    return min(np.arccos((directions @ (axis / np.linalg.norm(axis))).min()) for axis in axes)


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
            assert table[name][i] == pytest.approx(np.degrees(opening(rows)), abs=1e-6)


def test_a_criterion_aims_at_what_just_meets_it():
    own = Criterion("reach", "m", "long limb", "#117733", lambda at: 0.35 - at.lengths.max(axis=1), scale=0.05)
    assert (own.aim, own.most, own.limit, own.is_vital, own.needs) == (0.0, 2.0, "", False, ())
    # It needs nothing, so that nothing lacks.
    assert own.missing(ep.load("prototype").mechanism, Criteria(), False) == []
