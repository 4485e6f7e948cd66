"""What a lost limb costs several wearers, and how far limbs turn."""

import itertools

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria, limb_table


def opening(directions):
    """Half angle of the smallest cone around few directions: it touches two of them, or three."""
    sets = [subset for size in (2, 3) for subset in itertools.combinations(directions, size)]
    axes = [np.linalg.lstsq(np.array(subset), np.ones(len(subset)))[0] for subset in sets]
    return min(np.arccos((directions @ (axis / np.linalg.norm(axis))).min()) for axis in axes)


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
