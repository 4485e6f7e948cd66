"""Cautions about forces that are huge because a motion is hardly held."""

import re

import numpy as np
import pinocchio as pin
import pytest
from scenes import human_urdf, needs_human

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


@pytest.mark.parametrize("masses", [1e-3, 1e3])
def test_a_caution_is_the_same_of_light_and_of_heavy_links(masses):
    chain = ClosedChain.from_mjcf(FOUR_BAR.format(length=0.3))
    q = chain.forward_kinematics([DEAD - 0.01], chain.close(chain.reference_configuration()), ["crank_hinge"])
    own = chain.inverse_dynamics(q, actuated=["rocker_hinge"])
    model = chain.model.copy()
    for joint in range(1, model.njoints):
        one = model.inertias[joint]
        model.inertias[joint] = pin.Inertia(masses * one.mass, one.lever, masses * one.inertia)
    other = ClosedChain(model, chain.description).inverse_dynamics(q, actuated=["rocker_hinge"])
    effort = masses * own.effort("rocker_hinge")[0]
    assert other.cautions == tuple(
        text.replace(f"{own.effort('rocker_hinge')[0]:.4g} in", f"{effort:.4g} in") for text in own.cautions
    )
    assert len(other.cautions) == 1
    # The largest moment, or force at a characteristic length, over the largest load: weights at their levers or there.
    length, still = chain.characteristic_length, np.zeros(3)
    forces = [*np.abs(own.tau), *(length * np.abs(own.multipliers))]
    mass = {str(name): one.mass for name, one in zip(chain.model.names, chain.model.inertias, strict=True)}
    carried = max(mass["crank_hinge"] + mass["coupler_hinge"], mass["rocker_hinge"])
    levers = np.abs(pin.rnea(chain.model, chain.model.createData(), q, still, still)).max()
    share = max(forces) / max(9.81 * carried * length, levers)
    assert f"is {share:.0f} times the loads" in own.cautions[0]
    # Without any load nothing is amplified.
    model.gravity.linear = np.zeros(3)
    assert ClosedChain(model, chain.description).inverse_dynamics(q, actuated=["rocker_hinge"]).cautions == ()


@pytest.mark.parametrize(("before", "motor"), [(0.3, "rocker_hinge"), (0.01, "crank_hinge")])
def test_ordinary_forces_have_none(before, motor):
    found = forces(before, motor)
    assert found.cautions == ()
    assert "Caution" not in str(found)


def test_accelerations_have_the_cautions_of_their_forces():
    """Of a regular pose of a geometry that is known to 1 mm: what that leaves uncertain, with a number."""
    exact = ClosedChain.from_mjcf(FOUR_BAR.format(length=0.3))
    chain = exact.with_tolerance(1e-3)
    start = chain.close(chain.reference_configuration())
    q = chain.forward_kinematics([DEAD - 0.3], start, ["crank_hinge"])
    assert exact.forward_dynamics(q).cautions == ()
    motion = chain.forward_dynamics(q)
    assert motion.cautions == motion.forces.cautions
    assert motion.cautions == ("the digits of the geometry leave forces uncertain by about 2 %",)


@pytest.mark.full
@needs_human
def test_cassies_tarsus_in_place_of_its_knee_has_a_caution():
    chain = ClosedChain.from_sdf(human_urdf().parents[2] / "cassie_description" / "robots" / "cassie_v2.sdf")
    motors = ["roll-op", "yaw-op", "pitch-op", "foot-op", "shin-tarsus-joint", "tarsus-spring-joint"]
    actuated = ["root_joint", *(f"{side}-{name}" for side in ("left", "right") for name in motors)]
    q = chain.close(chain.neutral())

    def effort(q):
        found = chain.inverse_dynamics(q, actuated=actuated)
        return found, found.effort("left-shin-tarsus-joint")[0]

    found, there = effort(q)
    (text,) = found.cautions
    assert f"{there:.4g} in left-shin-tarsus-joint" in text
    # The figures of the tutorial, N m and times the loads.
    assert there == pytest.approx(-81.6, abs=0.1)
    assert "is 21 times the loads" in text
    # Joints that are off by 0.001 rad change it by tens of per cent, as it says; the knee's own motors have no caution.
    rng = np.random.default_rng(0)
    moved = [effort(chain.close(pin.integrate(chain.model, q, 1e-3 * rng.uniform(-1.0, 1.0, 32))))[1] for _ in range(5)]
    assert 0.1 < np.abs(np.array(moved) / there - 1.0).max() < 1.0
    with_knees = [name.replace("shin-tarsus-joint", "knee-op") for name in actuated]
    ordinary = chain.inverse_dynamics(q, actuated=with_knees)
    assert ordinary.cautions == ()
    assert np.abs(ordinary.tau[6:]).max() < 5.0
