"""The singular surface: known crossings, daily ranges, pictures."""

import matplotlib as mpl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName, shoulder_rotation, wrist
from exo_pin.design import preset
from exo_pin.load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES, RangeOfMotion, grid_rotation
from exo_pin.wrist import daily_crossings
from exo_pin.wrist.singularities import measures as loci

mpl.use("Agg")
DEGREES = {"degrees": True}


def test_locus_function_has_the_sign_and_zeros_of_the_determinant():
    geometry = random_mechanism(np.random.default_rng(0), 3).geometry
    poses = Rotation.random(200, np.random.default_rng(1))
    smooth, determinant = loci.locus_function(geometry, poses)
    np.testing.assert_allclose(determinant, wrist.singularity(geometry, poses).determinant, rtol=1e-10, atol=1e-14)
    assert (np.sign(smooth) == np.sign(determinant)).all()
    state = wrist.inverse_kinematics(geometry, poses)
    size = np.linalg.norm(geometry.base_points, axis=1) * np.linalg.norm(geometry.platform_points, axis=1)
    sines = np.linalg.norm(np.cross(geometry.base_points, state.platform_points), axis=-1) / size
    np.testing.assert_allclose(smooth, determinant * sines.prod(axis=-1), rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "negative", "close"),
    [("prototype", 0.620, 0.284), ("optimised-table-5-3", 0.606, 0.691), ("optimised-table-c-2", 0.640, 0.124)],
)
def test_known_shares_of_the_daily_life_box(name, negative, close):
    poses = ADL_BOX.poses(5.0)
    assert poses.shape == (23, 21, 22)
    _, determinant = loci.locus_function(preset(name).geometry, poses)
    assert (determinant < 0).mean() == pytest.approx(negative, abs=6e-4)
    assert (np.abs(determinant) < 0.05).mean() == pytest.approx(close, abs=6e-4)


def test_grid_is_the_convention():
    grid = grid_rotation(np.array([0.0, 40.0]), np.array([10.0, 90.0]), np.array([-20.0, 85.0]), side="right")
    one = shoulder_rotation(40, 90, -20, side="right", **DEGREES)
    assert (Rotation.from_quat(grid.as_quat()[1, 1, 0]) * one.inv()).magnitude() < 1e-14
    first, second, third = ADL_BOX.axes(3.0)
    for axis, (low, high) in zip((first, second, third), ADL_BOX.intervals, strict=True):
        assert (axis[0], axis[-1]) == (low, high)
        assert np.diff(axis).max() <= 3.0 + 1e-9


def test_slices_show_the_known_crossings():
    geometry = preset("prototype").geometry
    points = np.vstack(loci.shoulder_slice(geometry, 0.0, step_deg=0.5)[3])
    # Known: along abduction at 6.21°, along flexion at 35.45°.
    assert np.linalg.norm(points - [0, 6.21], axis=1).min() < 0.3
    assert np.linalg.norm(points - [35.45, 0], axis=1).min() < 0.3
    on_curve, _ = loci.locus_function(geometry, shoulder_rotation(points[:, 0], points[:, 1], 0, **DEGREES))
    # Linear interpolation over half a degree.
    assert np.abs(on_curve).max() < 1e-4


def test_daily_ranges_across_the_locus():
    geometry = preset("prototype").geometry
    found = {item.range.name: item for item in daily_crossings(geometry)}
    share = found["daily-life box"].across
    assert share == pytest.approx(0.399, abs=2e-3)
    assert 0.0 < share.error < 0.02
    assert len(found) == 1 + len(DAILY_RANGES) == 4
    assert DAILY_RANGES[0].intervals == ((14.7, 111.9), (-20.1, 39.7), (18.7, 85.9))  # Table 2-1
    for item in found.values():
        _, determinant = loci.locus_function(geometry, item.range.poses(5.0))
        # Poses of a grid, each counted once, are not its volume, but nearly.
        assert item.across == pytest.approx((determinant > 0).mean(), abs=0.03)
        if item.range.name == "daily-life box":
            assert (determinant > 0).mean() == pytest.approx(0.380, abs=6e-4)
        assert 0.05 < item.across < 0.95


def test_mirror_image_has_the_mirrored_locus():
    left, right = preset("prototype").geometry, preset("prototype").mirrored().geometry
    a = daily_crossings(left, step_deg=10.0, side="left")
    b = daily_crossings(right, step_deg=10.0, side="right")
    assert [x.across for x in a] == [x.across for x in b]
    one, two = (loci.shoulder_slice(g, 20.0, step_deg=10.0, side=s) for g, s in ((left, "left"), (right, "right")))
    np.testing.assert_allclose(one[2], two[2], atol=1e-12)


def test_what_does_not_fit_is_named():
    geometry = preset("prototype").geometry
    with pytest.raises(InvalidInput, match="three limbs"):
        loci.locus_function(random_mechanism(np.random.default_rng(6), 4).geometry, Rotation.identity())
    with pytest.raises(InvalidInput, match="singular pose"):
        daily_crossings(geometry, start=ep.thesis_rotation(90, 0, 0, **DEGREES))
    with pytest.raises(InvalidInput, match="lowest, highest"):
        RangeOfMotion("wrong", (10, 0), (0, 10), (0, 10))
    with pytest.raises(InvalidInput, match="lowest, highest"):
        RangeOfMotion("wide", (0, 361), (0, 10), (0, 10))
    with pytest.raises(UnknownName, match="left"):
        ADL_BOX.poses(10.0, side="up")
    calm = loci.shoulder_slice(geometry, 0.0, RangeOfMotion("calm", (60, 62), (60, 62), (0, 2)), 1.0)
    assert calm[3] == []


@pytest.mark.full
def test_pictures_show_what_they_say():
    import matplotlib.pyplot as plt

    from exo_pin.view.plots.angle_maps import determinant_map

    exo = ep.load("prototype")
    ax = determinant_map(exo, step=2.0)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "singular, det X = 0" in texts
    assert "across from rest" in texts
    assert sum("beyond" in text for text in texts) == 3
    shares = {item.range.name: item.across for item in daily_crossings(exo.geometry)}
    for item in DAILY_RANGES:
        assert f"{item.name}: {100 * shares[item.name]:.0f} % beyond" in texts
    assert ax.get_xlabel() == "flexion, °"
    curves = [line for line in ax.get_lines() if line.get_linewidth() == 3.0]
    points = np.vstack([line.get_xydata() for line in curves])
    assert np.linalg.norm(points - [0, 6.21], axis=1).min() < 1.0
    plt.close("all")
