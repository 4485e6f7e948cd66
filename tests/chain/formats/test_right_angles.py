"""Right angles that files round: read as they are meant where the caller says so."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import FileFormatError, InvalidInput
from exo_pin.chain import ClosedChain, Closures

#: A planar four-bar whose hinges are about x, turned by rounded right angles so that they are about z.
SDF = """<sdf version="1.7"><model name="four_bar">
  <link name="base"/><joint name="ground" type="fixed"><parent>world</parent><child>base</child></joint>
  <link name="crank"><pose>0 0 0 0 {first} 0</pose></link>
  <link name="coupler"><pose>0 0.1 0 0 {second} 0</pose></link>
  <link name="rocker"><pose>0.3 0 0 0 {first} 0</pose></link>
  <joint name="a" type="revolute"><parent>base</parent><child>crank</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="b" type="revolute"><parent>crank</parent><child>coupler</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="c" type="revolute"><parent>base</parent><child>rocker</child><axis><xyz>1 0 0</xyz></axis></joint>
  <joint name="d" type="revolute"><pose relative_to="rocker">0 0.2 0.05 0 0 0</pose><parent>coupler</parent>
    <child>rocker</child><axis><xyz>1 0 0</xyz></axis></joint>
</model></sdf>"""
URDF = """<robot name="arm"><link name="base"/><link name="hand"><inertial><origin xyz="0 0 0" rpy="0 {0} 0"/>
  <mass value="1"/><inertia ixx="1" iyy="1.5" izz="2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="wrist" type="revolute"><origin xyz="0 0 0.5" rpy="{0} 0.3 {1}"/><parent link="base"/><child link="hand"/>
  <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_rounded_angles_lock_a_plane_loop_and_exact_ones_do_not():
    """Axes that are not parallel make an exact loop spatial and rigid."""
    rounded = SDF.format(first="1.5708", second="-4.7124")
    chain = ClosedChain.from_sdf(rounded, right_angle_tolerance=2e-5)
    exact = ClosedChain.from_sdf(SDF.format(first=repr(np.pi / 2), second=repr(-1.5 * np.pi)))
    q = exact.close(pin.integrate(exact.model, exact.neutral(), np.array([0.1, 0.2, -0.1])))
    assert chain.mobility(q, actuated=()).redundant == exact.mobility(q, actuated=()).redundant == 3
    np.testing.assert_array_equal(chain.forward_dynamics(q).a, exact.forward_dynamics(q).a)
    assert chain.mobility(q, actuated=()).degrees_of_freedom == 1
    # Without it the digits say how well the file knows its geometry.
    plain = ClosedChain.from_sdf(rounded)
    assert plain.description.tolerance == 5e-5
    assert "of the loops' rows 1 agree with others" in " ".join(plain.description.left_out)
    assert plain.mobility(plain.neutral(), actuated=()).degrees_of_freedom == 1
    assert plain.with_tolerance(0.0).mobility(plain.neutral(), actuated=()).degrees_of_freedom == 0


def test_of_a_urdf():
    """rpy of joints and inertias; other angles stay."""
    chain = ClosedChain.from_urdf(URDF.format("1.5708", "-3.1416"), Closures(), right_angle_tolerance=2e-5)
    plain = ClosedChain.from_urdf(URDF.format(repr(np.pi / 2), repr(-np.pi)), Closures())
    np.testing.assert_array_equal(
        chain.model.jointPlacements[1].homogeneous, plain.model.jointPlacements[1].homogeneous
    )
    np.testing.assert_array_equal(chain.model.inertias[1].inertia, plain.model.inertias[1].inertia)
    rounded = ClosedChain.from_urdf(URDF.format("1.5708", "-3.1416"), Closures())
    assert np.abs(rounded.model.jointPlacements[1].rotation - plain.model.jointPlacements[1].rotation).max() > 1e-6


@pytest.mark.parametrize(
    ("pose", "changed"),
    [
        ("<pose>0 0 1.5708 1.5708 3.14159 -4.7124</pose>", (1.5708, np.pi / 2, np.pi, -1.5 * np.pi)),
        ("<pose>0 0 0 1.5709 1.57 0.00001</pose>", (0.0, 1.5709, 1.57, 0.0)),
        *(
            (f"<pose {given}>0 0 0 1.5708 0 0</pose>", (0.0, np.pi / 2, 0.0, 0.0))
            for given in ('degrees="false"', 'degrees="0"', 'rotation_format="euler_rpy"')
        ),
        *(
            (f'<pose degrees="{given}">0 0 0 1.5708 0 0</pose>', (0.0, np.radians(1.5708), 0.0, 0.0))
            for given in ("true", "1", "True")
        ),
    ],
)
def test_only_angles_within_the_tolerance_change(pose, changed):
    """Lengths, other angles and degrees stay; angles within 2e-5 of zero are zero."""
    text = f'<sdf version="1.9"><model name="m"><link name="l">{pose}</link></model></sdf>'
    place = ClosedChain.from_sdf(text, right_angle_tolerance=2e-5).model.jointPlacements[1]
    height, roll, pitch, yaw = changed
    np.testing.assert_array_equal(place.rotation, pin.rpy.rpyToMatrix(roll, pitch, yaw))
    assert place.translation[2] == height


@pytest.mark.parametrize(("tolerance", "changed"), [(0.0, False), (3.6e-6, False), (3.7e-6, True), (0.01, True)])
def test_an_angle_is_right_within_the_tolerance(tolerance, changed):
    """1.5708 is 3.673e-6 above π/2; a place of 1.5708 m is no angle."""
    text = URDF.format("-1.5708", "0").replace("0 0 0.5", "1.5708 0 0.5")
    pose = ClosedChain.from_urdf(text, Closures(), right_angle_tolerance=tolerance).model.jointPlacements[1]
    angle = -0.5 * np.pi if changed else -1.5708
    np.testing.assert_allclose(pose.rotation, pin.rpy.rpyToMatrix(angle, 0.3, 0.0), rtol=0, atol=1e-12)
    assert pose.translation[0] == 1.5708


def test_quaternions_stay():
    """Four numbers are no angles."""
    pose = '<pose rotation_format="quat_xyzw">0 0 0 0 0 0.7071068 0.7071068</pose>'
    text = f'<sdf version="1.9"><model name="m"><link name="l">{pose}</link></model></sdf>'
    one, other = (ClosedChain.from_sdf(text, right_angle_tolerance=t).model.jointPlacements[1] for t in (0.0, 0.01))
    np.testing.assert_array_equal(one.homogeneous, other.homogeneous)


@pytest.mark.parametrize("pose", ["1 2 3", "0 0 0 1.5708 nan 0", "0 0 0 1.5708 x 0", "0 0 0 inf 0 0"])
def test_what_is_no_pose_is_still_refused(pose):
    """The reader names the element, as without a tolerance."""
    text = f'<sdf version="1.9"><model name="m"><link name="l"><pose>{pose}</pose></link></model></sdf>'
    with pytest.raises(FileFormatError, match="pose"):
        ClosedChain.from_sdf(text, right_angle_tolerance=2e-5)


@pytest.mark.parametrize("tolerance", [-1e-5, np.nan, np.inf, 0.02, "wide", None])
def test_a_wrong_tolerance_is_refused(tolerance):
    """Before the file is read."""
    with pytest.raises(InvalidInput, match="right_angle_tolerance"):
        ClosedChain.from_sdf("<sdf/>", right_angle_tolerance=tolerance)
    with pytest.raises(InvalidInput, match="right_angle_tolerance"):
        ClosedChain.from_urdf("<robot/>", Closures(), right_angle_tolerance=tolerance)
