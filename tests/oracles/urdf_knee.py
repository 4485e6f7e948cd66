"""A robot with one joint as URDF, which tests change in places."""

import numpy as np
import pinocchio as pin

from exo_pin.chain import Closures

BARE = Closures("bare")
GOOD = """<?xml version="1.0"?>
<robot name="r">
  <link name="a"/>
  <link name="b">
    <inertial><origin xyz="0 0 0.1"/><mass value="2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry><material name="red"><color rgba="1 0 0 1"/></material></visual>
  </link>
  <joint name="knee" type="revolute">
    <origin xyz="1 2 3" rpy="0 0 0.5"/>
    <parent link="a"/>
    <child link="b"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="3" velocity="4"/>
    <dynamics damping="0.5" friction="0.2"/>
  </joint>
</robot>
"""


def same_as_good(chain):
    good = pin.buildModelFromXML(GOOD)
    assert chain.model.jointPlacements[1] == good.jointPlacements[1]
    assert chain.model.inertias[1] == good.inertias[1]
    for name in ("damping", "upperDryFrictionLimit", "lowerPositionLimit", "upperPositionLimit", "effortLimit"):
        np.testing.assert_array_equal(getattr(chain.model, name), getattr(good, name))
