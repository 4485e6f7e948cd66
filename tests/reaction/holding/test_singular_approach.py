"""The way into a singular pose: where it ends, how the forces grow, and which axis loses hold."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.errors import InvalidInput
from exo_pin.reaction.holding.remedy import remedy
from exo_pin.reaction.holding.singular_approach import singular_approach

#: They compile kernels of their own.
pytestmark = pytest.mark.full

WORN = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


def growth(approach):
    """Slope of log force over log angle at the end of the way."""
    size = np.linalg.norm(approach.reaction.actuator_forces, axis=1)[-8:]
    return float(np.polyfit(np.log(approach.turns[-8:]), np.log(size), 1)[0])


def test_it_ends_in_the_nearest_singular_pose():
    pose = WORN.pose(abduction=8.0)
    approach = WORN.singular_approach(pose)
    assert WORN.singularity(approach.singular_pose).smallest_singular_value < 1e-9
    assert (pose * approach.singular_pose.inv()).magnitude() == pytest.approx(approach.distance, abs=1e-12)
    # det X is 0 at 6.21° of pure abduction: the nearest singular pose is no farther.
    assert 0.0 < np.degrees(approach.distance) < 8.0 - 6.2
    left = (approach.poses * approach.singular_pose.inv()).magnitude()
    np.testing.assert_allclose(left, approach.turns, atol=1e-12)
    assert (np.diff(approach.turns) < 0).all()


def test_forces_near_the_end_carry_the_moment_about_the_lost_axis():
    # Statics: Σ f_i (b_i × s_i) = C × W, so along the left singular vector n of the least singular value σ
    # |f| σ tends to |n·(C × W)|, with the moment taken from the arm's data alone.
    approach = WORN.singular_approach(WORN.pose(abduction=8.0))
    centre = approach.poses.as_matrix() @ WORN.arm.centre_of_mass
    moment = np.cross(centre, WORN.arm.mass * WORN.mechanism.gravity)
    sigma = WORN.singularity(approach.poses).smallest_singular_value
    size = np.linalg.norm(approach.reaction.actuator_forces, axis=1)
    expected = np.abs(moment @ approach.lost_axis) / sigma
    assert size[-1] == pytest.approx(expected[-1], rel=0.01)
    assert growth(approach) == pytest.approx(-1.0, abs=0.02)


def test_a_way_that_touches_the_surface_grows_with_the_square():
    # At 90° of abduction (plates parallel) det X has a double zero along pure abduction.
    approach = WORN.singular_approach(WORN.pose(abduction=90.0), WORN.pose(abduction=60.0))
    assert approach.distance == 0.0
    np.testing.assert_allclose(np.abs(approach.lost_axis), [0.0, 1.0, 0.0], atol=1e-9)
    assert approach.turns[0] == pytest.approx(np.radians(30.0))
    assert growth(approach) == pytest.approx(-2.0, abs=0.02)
    at = int(np.abs(approach.turns - np.radians(1.0)).argmin())
    own = WORN.reaction(WORN.pose(abduction=89.0))
    np.testing.assert_allclose(approach.reaction.actuator_forces[at], own.actuator_forces, rtol=1e-6)


def test_without_a_start_the_limbs_regain_hold_fast():
    pose = WORN.pose(abduction=90.0)
    approach, touching = WORN.singular_approach(pose), WORN.singular_approach(pose, WORN.pose(abduction=70.0))
    assert approach.turns[0] == pytest.approx(np.radians(20.0))
    size, other = (
        np.interp(np.radians(5.0), a.turns[::-1], WORN.singularity(a.poses).amplification[::-1])
        for a in (approach, touching)
    )
    assert size < 0.7 * other


def test_it_prints_draws_and_lists():
    pytest.importorskip("matplotlib").use("agg")
    approach = WORN.singular_approach(WORN.pose(abduction=8.0))
    text = str(approach)
    for part in (
        "nearest singular pose is 1.",
        "cannot resist a moment about",
        "No pose within 60°",
        "largest limb force",
    ):
        assert part in text
    frame = approach.to_dataframe()
    assert frame["angle_left_deg"].iloc[0] == pytest.approx(20.0)
    assert frame["F_s_N"].max() == pytest.approx(approach.peak)
    axes = approach.plot().axes[0]
    assert "internal rotation" in axes.get_title()
    curve = axes.lines[0]
    np.testing.assert_allclose(curve.get_ydata(), approach.reaction.magnitude)


def test_a_short_way_is_printed_too():
    end = WORN.pose(abduction=90.0)
    text = str(WORN.singular_approach(end, Rotation.from_rotvec([0.0, np.radians(0.05), 0.0]) * end))
    assert len(text.splitlines()[-1].split()) == 3


def test_a_pose_that_can_be_held_is_its_own_nearest():
    design = ep.load("four-linear-actuators")
    pose = design.pose(40.0, 30.0)
    found = design.remedy(pose)
    assert found.nearest.distance == 0.0
    assert (found.nearest.pose * pose.inv()).magnitude() == 0.0
    assert found.nearest.check.can_hold
    assert str(found) == "The pose itself can be held."


def test_wrong_input_is_refused():
    moving = ep.Case(WORN.pose(60), ep.Motion([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]))
    for compare in (singular_approach, remedy):
        with pytest.raises(InvalidInput, match="no motion"):
            compare(WORN, moving, ep.Assumptions())
    cables = ep.load("four-cables")
    with pytest.raises(InvalidInput, match="expected a singular pose: of 4 limbs"):
        cables.singular_approach(cables.pose(60))
    for compare in (WORN.singular_approach, WORN.remedy):
        with pytest.raises(InvalidInput, match="single rotation"):
            compare(WORN.pose([0, 10]))
        with pytest.raises(InvalidInput, match="Rotation"):
            compare("rest")
    with pytest.raises(InvalidInput, match="other than the singular pose"):
        WORN.singular_approach(WORN.pose(abduction=90), WORN.pose(abduction=90))


def test_the_table_has_the_named_angles_and_the_forces_there():
    approach = WORN.singular_approach(WORN.pose(abduction=8.0))
    lines = [line.split() for line in str(approach).splitlines()[-8:]]
    assert [float(line[0]) for line in lines] == [20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1]
    for angle, shoulder, largest in lines:
        turn = Rotation.from_rotvec(
            np.radians(float(angle))
            * (approach.poses[0] * approach.singular_pose.inv()).as_rotvec()
            / approach.turns[0]
        )
        there = WORN.reaction(turn * approach.singular_pose)
        assert float(shoulder) == pytest.approx(there.magnitude, rel=1e-5, abs=0.6)
        assert float(largest) == pytest.approx(np.abs(there.actuator_forces).max(), rel=1e-5, abs=0.6)
