"""Mechanisms as data: frozen records, changed dimensions, mirror images, and what is refused."""

import re

import numpy as np
import pytest
from mirror_image import MIRROR
from same_records import same
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput, UnknownName
from exo_pin.design import (
    Arm,
    Interface,
    Limb,
    LimbBody,
    Mechanism,
    Shoulder,
    Stroke,
    WristGeometry,
    preset,
)
from exo_pin.load_case import Load, Motion

TRIANGLE = np.array([[0.1, -0.05, 0.0], [0.0, -0.05, 0.1], [-0.1, -0.05, 0.0]])


def test_prototype_points_and_estimates():
    mechanism = preset("prototype")
    np.testing.assert_allclose(mechanism.geometry.base_points[:, 1], -0.078)
    np.testing.assert_allclose(mechanism.geometry.platform_points[:, 2], -0.2)
    assert [limb.stroke.nominal_length for limb in mechanism.limbs] == [0.15, 0.25, 0.25]
    for index in range(3):
        assert f"limbs[{index}].stroke.end_fitting" in mechanism.estimated
    assert "Table 5-3" in mechanism.sources["geometry"]


def test_records_are_frozen_copies():
    points = TRIANGLE.copy()
    geometry = WristGeometry(points, points - [0, 0, 0.2])
    points[0] = 7.0
    assert geometry.base_points[0, 0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        geometry.base_points[0, 0] = 1.0


def test_replacing_dimensions():
    geometry = preset("prototype").geometry
    wider = geometry.replace(r_A=0.15)
    np.testing.assert_allclose(np.hypot(wider.base_points[:, 0], wider.base_points[:, 2]), 0.15)
    np.testing.assert_array_equal(wider.platform_points, geometry.platform_points)
    turned = geometry.replace(alpha_A=[0.1, 0.9, 2.0])
    # α_A = α_B by design, so both turn together.
    np.testing.assert_array_equal(turned.circles.alpha_B, [0.1, 0.9, 2.0])
    with pytest.raises(InvalidInput, match="points, not circles"):
        preset("appendix-d").geometry.replace(r_A=0.1)
    with pytest.raises(UnknownName, match="r_C"):
        geometry.replace(r_C=0.1)
    four = preset("prototype").replace(geometry=geometry.replace(alpha_A=[0.1, 0.9, 2.0, 3.0]), limbs=(Limb(),) * 4)
    assert four.limb_count == 4


def test_mirroring_twice_is_nothing():
    mechanism = preset("prototype")
    assert same(mechanism, mechanism.mirrored().mirrored())
    right = mechanism.mirrored()
    np.testing.assert_array_equal(right.geometry.base_points, mechanism.geometry.base_points @ MIRROR)
    np.testing.assert_array_equal(right.arm.inertia, MIRROR @ mechanism.arm.inertia @ MIRROR)
    assert right.side == "right"


def test_a_left_geometry_is_refused_on_a_right_shoulder():
    with pytest.raises(InvalidInput, match="mirrored"):
        preset("prototype").replace(side="right")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arm(0.0, [0, 0, 0]), "mass"),
        (lambda: Arm(1.0, [0, 0, -190]), "millimetres"),
        (lambda: Arm(1.0, [0, 0, 0], np.diag([1, 1, 3])), "triangle"),
        (lambda: Arm(1.0, [0, 0, 0], [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "symmetric"),
        (lambda: Arm(656.56, [0, 0, 0]), "grams"),
        (lambda: Arm.from_inertia_about_origin(0.656, [0, 0, -0.19], np.diag([2.8e7, 2.8e7, 1.4e6])), "g mm²"),
        (lambda: Arm(1.0, [0, 0, 0], device="no"), "device"),
        (lambda: preset("prototype").replace(gravity=[0, 0, -9810]), "mm/s²"),
        (lambda: preset("prototype").replace(limbs=Limb()), "each a Limb"),
        (lambda: preset("prototype").replace(name=None), "name"),
        (lambda: preset("prototype").replace(estimated="x"), "estimated"),
        (lambda: preset("prototype").replace(estimated=[1]), "estimated"),
        (lambda: preset("prototype").replace(sources={"arm": 1}), "map strings to strings"),
        (lambda: preset("prototype").replace(sources=["arm"]), "map strings to strings"),
        (lambda: Load([1, 2, 3], moment=[[1, 2], [3]]), "real numbers"),
        (lambda: Load(np.ma.masked_array([1, 2, 3], [0, 1, 0])), "real numbers"),
        (lambda: Motion([1e8, 0, 0], [0, 0, 0]), "below"),
        (lambda: Arm.from_anthropometry(1.75, 75, []), "female, male"),
        (lambda: Arm.from_anthropometry(175, 75, "male"), "0.5 to 2.6 m"),
        (lambda: Arm.from_anthropometry(51, 75, "male"), "did you mean 0.51 m?"),
        (lambda: Arm.from_anthropometry(259, 75, "male"), "did you mean 2.59 m?"),
        (lambda: preset("prototype").replace(gravity=[0, 0, -110]), "gravity"),
        (lambda: Arm.from_anthropometry(1.75, 75, "man"), "female, male"),
        (lambda: Arm.from_anthropometry(1.75, 75, "male", elbow_flexion=90), "rad"),
        (lambda: WristGeometry(TRIANGLE[:2], TRIANGLE[:2]), "at least 3"),
        (lambda: WristGeometry(TRIANGLE * 1000, TRIANGLE), "millimetres"),
        (lambda: WristGeometry(TRIANGLE, TRIANGLE), "line through O"),
        (lambda: WristGeometry(TRIANGLE, np.zeros((3, 3))), "away from O"),
        (lambda: WristGeometry(TRIANGLE, np.full((3, 3), np.nan)), "finite"),
        (lambda: WristGeometry.from_circles(0.1, 0.1, 0.1, 0.1, [31, 60, 120]), "degrees"),
        (lambda: WristGeometry.from_circles(-0.1, 0.1, 0.1, 0.1, [1, 2, 3]), "r_A"),
        (lambda: Limb("PUU"), "UPU"),
        (lambda: LimbBody(1.0, 0.1, 0.1, 0.3), "triangle"),
        (lambda: Stroke(0.1, 1.0, 0.75), "shortest"),
        (lambda: Shoulder(stiffness=-1e3 * np.eye(3)), "negative principal stiffness"),
        (lambda: Shoulder(stiffness=np.tri(3).T), "symmetric"),
        (lambda: Interface(np.eye(6), at=[0.0, 0.0, -190.0]), "millimetres"),
        (lambda: Interface(np.eye(6) - 2.0 * np.diag([0, 0, 0, 0, 0, 1.0])), "diagonal"),
        (lambda: Interface(np.eye(6) + np.triu(np.full((6, 6), 0.1), 1)), "symmetric"),
        (lambda: Interface(np.eye(6) + 1.1 * (np.ones((6, 6)) - np.eye(6))), "resists every motion"),
        (lambda: Load([1, 2]), "force"),
        (lambda: Load([1, 2, 3], frame="torso"), "arm, base"),
        (lambda: Motion([np.inf, 0, 0], [0, 0, 0]), "finite"),
        (lambda: Mechanism("prototype"), "WristGeometry"),
        (lambda: preset("prototype").replace(limbs=(Limb(),) * 4), "expected 3 limbs"),
        (lambda: preset("prototype").replace(legs=3), "legs"),
    ],
)
def test_bad_records_are_refused(make, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        make()


def test_shoulder_range_is_a_diamond():
    shoulder = preset("prototype").shoulder
    poses = Rotation.from_euler("YXZ", [[0, 90, 0], [50, 90, 90], [0, 0, 0], [0, 0, 10], [0, -4, 5]], degrees=True)
    assert shoulder.allows(poses).tolist() == [True, True, True, False, False]
    # (θy, θx, θz) is also (θy + 180°, 180° - θx, θz + 180°), and the unit turns freely about Y.
    x, z = (grid.ravel() for grid in np.meshgrid(np.arange(-85.0, 90.0, 10.0), np.arange(-175.0, 180.0, 10.0)))
    grid = Rotation.from_euler("YXZ", np.stack([np.full(x.shape, 20.0), x, z], axis=1), degrees=True)
    for centre, half in ((np.degrees(shoulder.abduction_centre), np.degrees(shoulder.half_diagonal)), (105.0, 50.0)):
        twice = [(x, np.abs(z)), (180.0 - x, 180.0 - np.abs(z))]
        inside = np.any([np.abs(own - centre) + turned < half for own, turned in twice], axis=0)
        assert Shoulder(np.radians(centre), np.radians(half)).allows(grid).tolist() == inside.tolist()
        assert 0.02 < inside.mean() < 0.95
    assert Shoulder().allows(poses).all()
