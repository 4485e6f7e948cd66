"""Right angles that files round: read as they are meant where the caller says so."""

import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain

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
