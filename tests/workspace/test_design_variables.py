"""What a search may vary: joints, circles, strokes, lengths of muscles and end fittings."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.starting_designs import joints_and_variables
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows
from exo_pin.wrist import BodyShape

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


CABLE = ep.Actuator("cable", pull_limit=400.0)


LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))


def start(actuator=CABLE, limb_count=4, side="left"):
    return starting_design(actuator, ARM if side == "left" else ARM.mirrored(), limb_count, side)


def merit(mechanism=None, criteria=LIMITS):
    mechanism = start() if mechanism is None else mechanism
    poses = lifting_poses(mechanism.side, counts=(3, 3, 2))
    return Merit(DesignVariables(mechanism, free_joints(mechanism.limb_count)), poses, criteria)


def test_joints_by_hand():
    space = DesignVariables(start(limb_count=3), free_joints(3))
    values = dict.fromkeys(space.names, 0.0)
    values |= {"A[1].radius": 0.2, "A[1].azimuth": np.pi / 2, "A[1].elevation": np.pi / 6}
    values |= {"B[1].radius": 0.1, "B[1].azimuth": np.pi, "B[1].drop": 0.25}
    for i in (2, 3):
        values |= {f"A[{i}].radius": 0.2, f"A[{i}].azimuth": float(i), f"B[{i}].radius": 0.1, f"B[{i}].drop": 0.2}
    geometry = space.design(values).geometry
    np.testing.assert_allclose(geometry.base_points[0], [0.0, 0.2 * np.cos(np.pi / 6), 0.1], atol=1e-12)
    np.testing.assert_allclose(geometry.platform_points[0], [-0.1, 0.0, -0.25], atol=1e-12)
    right = DesignVariables(start(limb_count=3, side="right"), free_joints(3)).design(values).geometry
    np.testing.assert_allclose(right.base_points[:, 1], -geometry.base_points[:, 1])


def test_points_and_values_are_each_others_inverse():
    space = DesignVariables(start(), free_joints(4))
    rng = np.random.default_rng(0)
    for _ in range(5):
        values = {name: rng.uniform(*pair) for name, pair in zip(space.names, space.bounds, strict=True)}
        again = space.values(space.point(values))
        assert again == pytest.approx(values)
    outside = space.values(rng.uniform(-3.0, 3.0, space.count))
    for (low, high), value in zip(space.bounds, outside.values(), strict=True):
        assert low - 1e-12 <= value <= high + 1e-12


def test_circles_keep_their_dimensions():
    exo = ep.load("prototype")
    space = DesignVariables(exo.mechanism, {"r_A": (0.05, 0.18), "alpha[2]": (0.5, 1.0), "alpha_B[3]": (1.6, 2.1)})
    circles = space.design({"r_A": 0.1, "alpha[2]": 0.7, "alpha_B[3]": 1.8}).geometry.circles
    changed = (circles.r_A, circles.alpha_A[1], circles.alpha_B[1], circles.alpha_B[2])
    assert changed == pytest.approx((0.1, 0.7, 0.7, 1.8))
    assert circles.alpha_A[2] == exo.geometry.circles.alpha_A[2]


@pytest.mark.parametrize(
    ("bounds", "error"),
    [
        ({"A[1].height": (0.0, 1.0)}, UnknownName),
        ({"A[9].radius": (0.1, 0.2)}, InvalidInput),
        ({"r_A": (0.1, 0.2)}, InvalidInput),
        ({"A[1].radius": (0.2, 0.1)}, InvalidInput),
        ({}, InvalidInput),
    ],
)
def test_wrong_variables_are_refused(bounds, error):
    with pytest.raises(error):
        DesignVariables(start(), bounds)


def test_limbs_from_three_to_six():
    for limb_count in (3, 4, 5, 6):
        judge = merit(start(limb_count=limb_count))
        assert judge.variables.count == 6 * limb_count
        found = judge.evaluate(np.random.default_rng(limb_count).uniform(size=judge.variables.count), {})
        assert 0.0 < found.merit < 100.0


def test_muscle_lengths_and_end_fittings_are_variables():
    muscle = start(ep.Actuator("pneumatic muscle", pull_limit=400.0), 3)
    space = DesignVariables(muscle, {"nominal_length[2]": (0.1, 0.5), "end_fitting[2]": (0.02, 0.2)})
    design = space.design({"nominal_length[2]": 0.3, "end_fitting[2]": 0.1})
    assert design.limbs[1].stroke == ep.Stroke(0.3, 0.75, 1.0, 0.1)
    assert design.limbs[0].stroke is None
    np.testing.assert_array_equal(design.geometry.base_points, muscle.geometry.base_points)
    # Without a variable of its own the end fitting is the family's.
    alone = DesignVariables(muscle, {"nominal_length[2]": (0.1, 0.5)})
    assert alone.design({"nominal_length[2]": 0.3}).limbs[1].stroke == ep.Stroke(0.3, 0.75, 1.0, 0.04)
    # A linear actuator that is 0.5 m long when extended has 0.1 m of dead length, so a travel of 0.2 m.
    linear = start(ep.Actuator("linear", pull_limit=400.0, push_limit=400.0), 3)
    stroke = DesignVariables(linear, {"nominal_length[1]": (0.1, 0.6)}).design({"nominal_length[1]": 0.5})
    assert stroke.limbs[0].stroke.shortest * 0.5 == pytest.approx(0.3)


def test_length_as_a_variable_keeps_the_travel_of_the_actuator():
    exo = ep.load("four-muscle-cables")
    space = DesignVariables(exo.mechanism, {"nominal_length[1]": (0.2, 0.8)})
    stroke = space.design({"nominal_length[1]": 0.6}).limbs[0].stroke
    travel = (stroke.longest - stroke.shortest) * stroke.nominal_length
    assert travel == pytest.approx(exo.limbs[0].actuator.travel_limit)


def test_variables_set_the_strokes_that_are_not_fitted():
    muscle = start(ep.Actuator("pneumatic muscle", pull_limit=400.0), 3)
    lengths = np.random.default_rng(0).uniform(0.3, 0.4, (50, 3))
    space = DesignVariables(muscle, {"nominal_length[1]": (0.1, 0.5), "end_fitting[1]": (0.0, 0.2)})
    design = space.design({"nominal_length[1]": 0.35, "end_fitting[1]": 0.1})
    fitted = fitted_strokes(design, lengths, np.full(50, 0.02), is_given=space.sets_stroke)
    assert fitted.limbs[0].stroke == ep.Stroke(0.35, 0.75, 1.0, 0.1)
    assert fitted.limbs[2].stroke.end_fitting == pytest.approx(0.04)
    windows = stroke_windows(design, lengths, np.full(50, 0.02), space.sets_stroke)
    np.testing.assert_allclose(windows[0], [0.75 * 0.35 + 0.1, 0.45])
    np.testing.assert_allclose(windows[1, 0], 0.75 * (windows[1, 1] - 0.04) + 0.04)


def test_end_fitting_that_changes_nothing_is_refused():
    bounds = {"A[1].radius": (0.12, 0.3), "end_fitting[2]": (0.0, 0.2)}
    with pytest.raises(InvalidInput, match=r"nominal_length\[2\]"):
        DesignVariables(start(), bounds)
    assert DesignVariables(start(), bounds | {"nominal_length[2]": (0.2, 0.5)}).sets_stroke.tolist() == [
        False, True, False, False
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["four-linear-actuators", "four-cables-worn", "four-muscle-cables"])
def test_bounds_of_a_refinement_hold_its_start(name):
    """Joints half a metre from the shoulder, as those of the default bounds (0.25 m) would not be."""
    mechanism = ep.load(name).mechanism
    space = DesignVariables(mechanism, joints_and_variables(mechanism, {}, refine=True))
    space.require_design_inside()
    again = space.design(space.values(space.point(space.of_design())))
    np.testing.assert_allclose(again.geometry.base_points, mechanism.geometry.base_points, atol=1e-9)
    np.testing.assert_allclose(again.geometry.platform_points, mechanism.geometry.platform_points, atol=1e-9)
