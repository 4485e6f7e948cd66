"""What a search may vary, asked of a device: joints, circles, strokes, lengths of muscles and end fittings."""

import numpy as np
import pytest
from small_searches import EXO, searched

import exo_pin as ep
from exo_pin.workspace import free_joints, starting_design

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


def start(actuator=None, side="left"):
    arm = ARM if side == "left" else ARM.mirrored()
    design = starting_design(actuator or ep.Actuator("cable", pull_limit=400.0), arm, 3, side)
    return ep.ShoulderExo.from_mechanism(design).device


def test_joints_by_hand():
    values = {"A[1].radius": 0.2, "A[1].azimuth": np.pi / 2, "A[1].elevation": np.pi / 6}
    values |= {"B[1].radius": 0.1, "B[1].azimuth": np.pi, "B[1].drop": 0.25}
    left, right = (start(side=side).with_dimensions(**values).geometry for side in ("left", "right"))
    np.testing.assert_allclose(left.base_points[0], [0.0, 0.2 * np.cos(np.pi / 6), 0.1], atol=1e-12)
    np.testing.assert_allclose(left.platform_points[0], [-0.1, 0.0, -0.25], atol=1e-12)
    np.testing.assert_allclose(right.base_points[0, 1], -left.base_points[0, 1])
    np.testing.assert_allclose(left.base_points[1:], start().geometry.base_points[1:], atol=1e-15)


def test_circles_keep_their_dimensions():
    device = ep.load("prototype").device
    circles = device.with_dimensions(**{"r_A": 0.1, "alpha[2]": 0.7, "alpha_B[3]": 1.8}).geometry.circles
    changed = (circles.r_A, circles.alpha_A[1], circles.alpha_B[1], circles.alpha_B[2])
    assert changed == pytest.approx((0.1, 0.7, 0.7, 1.8))
    assert circles.alpha_A[2] == device.geometry.circles.alpha_A[2]


def test_muscle_lengths_and_end_fittings_are_dimensions():
    muscle = start(ep.Actuator("pneumatic muscle", pull_limit=400.0))
    design = muscle.with_dimensions(**{"nominal_length[2]": 0.3, "end_fitting[2]": 0.1})
    assert design.limbs[1].stroke == ep.Stroke(0.3, 0.75, 1.0, 0.1)
    assert design.limbs[0].stroke is None
    np.testing.assert_array_equal(design.geometry.base_points, muscle.geometry.base_points)
    # Without a value of its own the end fitting is the family's.
    alone = muscle.with_dimensions(**{"nominal_length[2]": 0.3})
    assert alone.limbs[1].stroke == ep.Stroke(0.3, 0.75, 1.0, 0.04)
    # A linear actuator that is 0.5 m long when extended has 0.1 m of dead length, so a travel of 0.2 m.
    linear = start(ep.Actuator("linear", pull_limit=400.0, push_limit=400.0))
    stroke = linear.with_dimensions(**{"nominal_length[1]": 0.5}).limbs[0].stroke
    assert stroke.shortest * 0.5 == pytest.approx(0.3)


def test_length_as_a_dimension_keeps_the_travel_of_the_actuator():
    device = ep.load("four-muscle-cables").device
    stroke = device.with_dimensions(**{"nominal_length[1]": 0.6}).limbs[0].stroke
    travel = (stroke.longest - stroke.shortest) * stroke.nominal_length
    assert travel == pytest.approx(device.limbs[0].actuator.travel_limit)


def test_strokes_that_are_variables_are_not_fitted(plain):
    muscle = ep.ShoulderExo.from_device(start(ep.Actuator("pneumatic muscle", pull_limit=400.0)))
    bounds = {"A[1].radius": (0.12, 0.3), "nominal_length[1]": (0.3499, 0.35), "end_fitting[1]": (0.0999, 0.1)}
    found = searched(exo=muscle, variables=bounds, budget=1, fit_strokes=True, poses=EXO.pose([0.0, 40.0])).best
    own, *fitted = (limb.stroke for limb in found.limbs)
    assert own.nominal_length == pytest.approx(0.35, abs=1e-4)
    assert own.end_fitting == pytest.approx(0.1, abs=1e-4)
    assert [stroke.end_fitting for stroke in fitted] == pytest.approx([0.04, 0.04])


@pytest.mark.parametrize("name", ["four-linear-actuators", "four-cables-worn", "four-muscle-cables"])
def test_free_joints_hold_any_start_that_they_are_given(name):
    """Names of all joints of a design, whose values make it again."""
    device = ep.load(name).device
    known = {name.rpartition("_")[0]: name for name in device.dimensions()}
    values = device.dimensions()
    own = {known[name]: values[known[name]] for name in free_joints(device.limb_count)}
    again = device.with_dimensions(**own)
    np.testing.assert_allclose(again.geometry.base_points, device.geometry.base_points, atol=1e-9)
    np.testing.assert_allclose(again.geometry.platform_points, device.geometry.platform_points, atol=1e-9)
