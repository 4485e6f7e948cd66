"""Where a search begins and where it judges: variables, sketches, poses and centres."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.load_case.ranges_of_motion import ADL_BOX
from exo_pin.workspace import free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.search_poses import (
    SearchPoses,
    as_centres,
    centre_text,
    described,
    lifting_lines,
    shifted,
)
from exo_pin.workspace.optimisation.starting_designs import joints_and_variables, starting_actuator

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")


def sketch(actuator=None, count=3):
    return starting_design(actuator or ep.Actuator("cable", pull_limit=400.0), ARM, count)


def test_values_of_points_by_hand():
    space = DesignVariables(
        sketch(), {"A[1].radius": (0.1, 0.3), "A[1].azimuth": (-np.pi, np.pi), "B[2].drop": (0.1, 0.2)}
    )
    assert space.count == 3
    for point, values in (
        ([0.0, 0.0, 1.0], [0.1, -np.pi, 0.2]),
        ([0.5, 0.5, 1.0 / 3.0], [0.2, 0.0, 0.125]),
        ([1.5, 1.25, -0.5], [0.2, -np.pi / 2, 0.15]),  # reflected, and once around
    ):
        assert list(space.values(np.array(point)).values()) == pytest.approx(values)
    np.testing.assert_allclose(space.point(space.values(np.array([0.3, 0.3, 0.3]))), 0.3)
    # Of the sketch: its first joint is 0.18 m from the shoulder.
    assert space.of_design()["A[1].radius"] == pytest.approx(np.hypot(0.15, 0.1))
    narrow = DesignVariables(sketch(), {"A[1].radius": (0.2, 0.3)})
    assert narrow.of_design() == {"A[1].radius": 0.2}
    with pytest.raises(InvalidInput, match="outside"):
        narrow.require_design_inside()
    exact = float(np.hypot(0.15, 0.1))
    for low, high in ((exact + 0.9e-6, 0.3), (0.1, exact - 0.9e-6)):
        DesignVariables(sketch(), {"A[1].radius": (low, high)}).require_design_inside()
    for low, high in ((exact + 2e-6, 0.3), (0.1, exact - 2e-6)):
        with pytest.raises(InvalidInput, match="hold the design that is refined"):
            DesignVariables(sketch(), {"A[1].radius": (low, high)}).require_design_inside()


def test_limbs_whose_strokes_are_variables():
    def sets(*names):
        return DesignVariables(sketch(), dict.fromkeys(names, (0.3, 0.5))).sets_stroke.tolist()

    assert sets("A[1].radius") == [False] * 3
    assert sets("nominal_length[2]") == [False, True, False]
    assert sets("nominal_length") == [True] * 3
    with pytest.raises(InvalidInput, match=r"nominal_length\[3\] beside end_fitting"):
        DesignVariables(sketch(), {"end_fitting[3]": (0.0, 0.1), "nominal_length[1]": (0.3, 0.5)})
    with pytest.raises(InvalidInput, match="mapping"):
        DesignVariables(sketch(), {})
    with pytest.raises(InvalidInput, match="each variable once"):
        DesignVariables(sketch(), {"A[1].radius": (0.1, 0.2), "A[1].radius_mm": (100.0, 200.0)})


def test_actuators_of_new_designs():
    cable = starting_actuator()
    assert (cable.family, cable.pull_limit, cable.push_limit, cable.travel_limit) == ("cable", 400.0, 0.0, None)
    assert starting_actuator(pull=50.0, travel=0.2).travel_limit == 0.2
    for push, expected in ((None, 50.0), (20.0, 20.0)):
        linear = starting_actuator("linear", pull=50.0, push=push)
        assert (linear.pull_limit, linear.push_limit) == (50.0, expected)
    for supply, expected in ((None, 4e5), (3e5, 3e5)):
        muscle = starting_actuator("pneumatic muscle", force_law="best", supply=supply)
        assert (muscle.pull_limit, muscle.force_law) == (None, "best")
        assert expected in vars(muscle).values()


def test_sketch_spreads_its_joints_evenly():
    for count in (3, 5):
        geometry = sketch(count=count).geometry
        for points, radius, height in ((geometry.base_points, 0.15, 0.1), (geometry.platform_points, 0.1, -0.2)):
            np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), radius)
            np.testing.assert_allclose(points[:, 2], height)
            turns = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
            np.testing.assert_allclose(np.diff(turns), 2.0 * np.pi / count)
            assert turns[0] == pytest.approx(0.3)
    with pytest.raises(InvalidInput, match="at least 3 limbs"):
        sketch(count=2)


def test_which_variables_are_searched():
    mechanism = sketch()
    own = {"A[1].radius_mm": (10.0, 20.0)}
    free = free_joints(3)
    assert joints_and_variables(mechanism, own) == own
    assert joints_and_variables(mechanism, {}) == free
    assert joints_and_variables(mechanism, {}, drop=None) == free
    wide = joints_and_variables(mechanism, {}, base_radius=(0.3, 0.4))
    assert wide["A[2].radius"] == (0.3, 0.4)
    assert wide["B[2].radius"] == free["B[2].radius"]
    both = joints_and_variables(mechanism, own, drop=(0.1, 0.3))
    assert both["A[1].radius_mm"] == (10.0, 20.0)
    assert "A[1].radius" not in both
    assert both["B[1].drop"] == (0.1, 0.3)
    # A refinement reaches as far as its own joints, but not beyond bounds that were given.
    low = mechanism.replace(
        geometry=ep.WristGeometry(2.0 * mechanism.geometry.base_points, mechanism.geometry.platform_points)
    )
    radius = 2.0 * float(np.hypot(0.15, 0.1))
    assert joints_and_variables(low, {}, refine=True)["A[1].radius"] == pytest.approx((0.12, radius))
    assert joints_and_variables(low, {}, refine=True, base_radius=(0.12, 0.2))["A[1].radius"] == (0.12, 0.2)
    pairs = free_joints(1)
    assert pairs == {
        "A[1].radius": (0.12, 0.25),
        "A[1].azimuth": (-np.pi, np.pi),
        "A[1].elevation": (-np.pi / 2, np.pi / 2),
        "B[1].radius": (0.05, 0.14),
        "B[1].azimuth": (-np.pi, np.pi),
        "B[1].drop": (0.08, 0.28),
    }
    for count in (0, 1001):
        with pytest.raises(InvalidInput, match="limb_count"):
            free_joints(count)


@pytest.mark.parametrize("side", ["left", "right"])
def test_poses_of_a_search(side):
    found = lifting_poses(side, counts=(3, 2, 2), lifting_weight=0.4)
    lines = lifting_lines(side, 10.0)
    assert [len(line) for line in lines] == [10, 10]
    assert len(found.poses) == 12 + 20
    np.testing.assert_allclose(found.weights[:12], 0.6 / 12)
    np.testing.assert_allclose(found.weights[12:], 0.4 / 20)
    corners = [ep.shoulder_rotation(f, a, i, side, degrees=True) for f in np.linspace(*ADL_BOX.intervals[0], 3)
               for a in ADL_BOX.intervals[1] for i in ADL_BOX.intervals[2]]  # fmt: skip
    for one, other in zip(found.poses[:12], corners, strict=True):
        assert (one * other.inv()).magnitude() < 1e-12
    # Rows of zeros and of angles: forward turns the arm towards x, sideways towards the side.
    out = 1.0 if side == "left" else -1.0
    for line, aside in zip(lines, ([1.0, 0.0, 0.0], [0.0, out, 0.0]), strict=True):
        angles = np.radians(np.linspace(0.0, 90.0, 10))[:, None]
        arm = line.apply([0.0, 0.0, -1.0])
        np.testing.assert_allclose(arm, np.sin(angles) * aside - np.cos(angles) * [0.0, 0.0, 1.0], atol=1e-12)
    assert [len(line) for line in lifting_lines(side)] == [19, 19]
    assert [len(line) for line in lifting_lines(side, 50.0)] == [3, 3]
    default = lifting_poses(side)
    assert len(default.poses) == 7 * 6 * 6 + 20
    assert default.weights[-20:].sum() == pytest.approx(0.3)


def test_weights_of_poses():
    turns = Rotation.from_rotvec(np.eye(3))
    np.testing.assert_allclose(SearchPoses(turns, [1.0, 0.0, 3.0]).weights, [0.25, 0.0, 0.75])
    np.testing.assert_allclose(SearchPoses.of(turns).weights, 1.0 / 3.0)
    assert SearchPoses.of(turns[0]).weights.tolist() == [1.0]
    grid = Rotation.from_quat(np.tile(turns.as_quat(), (2, 1)).reshape(2, 3, 4))
    assert SearchPoses.of(grid).poses.shape == (6,)
    for weights in ([1.0, 1.0], [1.0, -1.0, 3.0], [0.0, 0.0, 0.0]):
        with pytest.raises(InvalidInput, match="one weight of zero or more a pose"):
            SearchPoses(turns, weights)
    for given in (turns.as_quat(), turns[:0]):
        with pytest.raises(InvalidInput, match="stack of rotations"):
            SearchPoses.of(given)
    shift = ep.CentreOffset.together([0.01, 0.02, 0.03])
    twice = SearchPoses(turns, [1.0, 2.0, 1.0]).at_centres((None, shift))
    np.testing.assert_allclose(twice.weights, [0.125, 0.25, 0.125] * 2)
    np.testing.assert_allclose(twice.offsets.base, [[0.0] * 3] * 3 + [[0.01, 0.02, 0.03]] * 3)
    assert (twice.poses[:3] * twice.poses[3:].inv()).magnitude().max() < 1e-12


def test_forms_and_words_of_centres():
    shift = np.array([0.001, -0.002, 0.003])
    path = ep.CentrePath(np.radians([0.0, 90.0]), [[0.0] * 3, [0.0, 0.03, 0.04]])
    offset = ep.CentreOffset(np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.0, -0.02]))
    assert centre_text(None) == "The device's centre is the shoulder's."
    assert centre_text(path) == "The shoulder's centre moves with the arm, by at most 50 mm on its path."
    assert centre_text(shifted(path, shift)).endswith(
        "by at most 50 mm on its path, and is off by (1, -2, 3) mm at rest."
    )
    assert centre_text(offset) == (
        "The device's centre is off the shoulder's by (10, 0, 0) mm at the base and (0, 0, -20) mm at the cuff."
    )
    for side, before in (("base", offset.base), ("cuff", offset.cuff)):
        np.testing.assert_allclose(getattr(shifted(offset, shift), side), before + shift)
        np.testing.assert_allclose(getattr(shifted(None, shift), side), shift)
    assert described(None) is None
    assert described(offset) == {"base": [0.01, 0.0, 0.0], "cuff": [0.0, 0.0, -0.02]}
    assert as_centres(None) == (None,)
    assert as_centres((None, path)) == (None, path)
    np.testing.assert_allclose(as_centres([0.01, 0.0, 0.0])[0].base, [0.01, 0.0, 0.0])
    with pytest.raises(InvalidInput, match="at least one centre_offset"):
        as_centres(())
    with pytest.raises(InvalidInput, match="one offset or a CentrePath"):
        as_centres(ep.CentreOffset(np.zeros((2, 3)), np.zeros(3)))
