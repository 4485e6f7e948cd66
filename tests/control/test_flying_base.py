"""Inertial forces of links on a torso that moves, against Pinocchio's tree on a free base."""

import numpy as np
import pinocchio as pin
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.control.plant.any_device.arm_actions import TorsoState, carried_along


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "nesm"])
def test_inertial_forces_of_links_are_those_of_a_tree_on_a_flying_base(name):
    device = ep.load(URDF / f"{name}.urdf").device.as_chain()
    options = control.PlantOptions(joint_motor=control.JointMotor(limit=50.0))
    own = ep.Plant(device, options).equations
    rng = np.random.default_rng(3)
    tree, model, base = own.state.model, own.model, pin.Model()
    base.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    base.addFrame(pin.Frame("root", 1, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    whole = pin.appendModel(base, tree, base.getFrameId("root"), pin.SE3.Identity())
    whole.gravity.vector = tree.gravity.vector
    q = own.configuration(ep.shoulder_rotation(30.0, 20.0, 10.0, degrees=True))
    v, a, w, e, push = rng.normal(size=tree.nv), rng.normal(size=tree.nv), *rng.normal(size=(3, 3))
    # O rests at this instant and accelerates; the root stands in the world's origin.
    c = model.centre
    spatial = np.concatenate([push - np.cross(e, c), e])
    turned = Rotation.from_euler("xyz", [0.4, -0.3, 0.8])
    back = turned.inv().as_matrix()
    data, q_base = whole.createData(), np.concatenate([np.zeros(3), turned.as_quat()])
    motion = np.concatenate([-np.cross(w, c), w, v]), np.concatenate([spatial, a])
    whole_tau = pin.rnea(whole, data, np.concatenate([q_base, q]), *motion)
    gravity = np.array(tree.gravity.linear)
    state = TorsoState(push - back @ gravity + gravity, w, e)
    own.state.buffers.jacobian_rates(q, v)
    found = carried_along(own.state, c, own._bodies, own._owners, state)
    alone = pin.rnea(tree, tree.createData(), q, v, a)
    np.testing.assert_allclose(alone - found, whole_tau[6:], atol=1e-9)
