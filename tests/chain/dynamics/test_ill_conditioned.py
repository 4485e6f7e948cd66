"""Cautions about forces that are huge because a motion is hardly held."""

import re

import numpy as np

from exo_pin.chain import ClosedChain

FOUR_BAR = """<mujoco model="four_bar">
  <default><joint axis="0 1 0"/><geom type="capsule" size="0.01" mass="0.2"/></default>
  <worldbody>
    <body name="crank">
      <joint name="crank_hinge"/><geom fromto="0 0 0 0 0 0.1"/>
      <body name="coupler" pos="0 0 0.1">
        <joint name="coupler_hinge"/><geom fromto="0 0 0 0.3 0 0"/><site name="coupler_end" pos="{length} 0 0"/>
      </body>
    </body>
    <body name="rocker" pos="0.3 0 0">
      <joint name="rocker_hinge"/><geom fromto="0 0 0 0 0 0.2"/><site name="rocker_end" pos="0 0 0.2"/>
    </body>
  </worldbody>
  <equality><connect name="pin" site1="coupler_end" site2="rocker_end"/></equality>
</mujoco>"""
#: Angle of the crank at which it lies along the coupler, so that the rocker cannot hold it.
DEAD = np.pi / 2 - np.arccos((0.4**2 + 0.3**2 - 0.2**2) / (2 * 0.4 * 0.3))


def forces(before, motor, length=0.3):
    chain = ClosedChain.from_mjcf(FOUR_BAR.format(length=length))
    start = chain.close(chain.reference_configuration())
    return chain.inverse_dynamics(chain.forward_kinematics([DEAD - before], start, ["crank_hinge"]), actuated=[motor])


def test_forces_beside_a_dead_centre_have_a_caution():
    near = forces(0.01, "rocker_hinge")
    (text,) = near.cautions
    effort = near.effort("rocker_hinge")[0]
    assert f"{effort:.4g} in rocker_hinge" in text
    assert f"Caution: {text}" in str(near)
    # The bound is that of the condition number; of lengths and angles that are off by 0.1 % each stays below it.
    bound = float(re.search(r"by up to about (\d+) %", text)[1])
    longer, turned = forces(0.01, "rocker_hinge", 0.3003), forces(0.009, "rocker_hinge")
    changes = [100.0 * abs(other.effort("rocker_hinge")[0] / effort - 1.0) for other in (longer, turned)]
    assert min(changes) > 5.0
    assert max(changes) < bound < 10.0 * max(changes)
