"""Poses, Jacobians and steps of trees in compiled code, against Pinocchio's, for every kind of joint."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain.kinematics.kernels.tree_kernels import place_tree, step_tree, tree_arrays

KINDS = {
    "hinge": pin.JointModelRX,
    "hinge about any axis": lambda: pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])),
    "endless hinge": pin.JointModelRUBY,
    "slide": pin.JointModelPZ,
    "slide along any axis": lambda: pin.JointModelPrismaticUnaligned(np.array([0.6, 0.8, 0.0])),
    "screw": lambda: pin.JointModelHelicalUnaligned(np.array([0.6, 0.8, 0.0]), 0.3),
    "ball": pin.JointModelSpherical,
    "flight": pin.JointModelFreeFlyer,
    "shift": pin.JointModelTranslation,
    "plane": pin.JointModelPlanar,
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_tree_is_where_pinocchio_has_it(kind):
    pin.seed(len(kind))
    rng = np.random.default_rng(len(kind))
    model = pin.Model()
    first = model.addJoint(0, KINDS[kind](), pin.SE3.Random(), "first")
    between = model.addJoint(first, pin.JointModelRevoluteUnaligned(np.array([0.0, 0.6, 0.8])), pin.SE3.Random(), "b")
    model.addJoint(between, KINDS[kind](), pin.SE3.Random(), "last")
    tree, data = tree_arrays(model), pin.Data(model)
    q = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq))
    poses, J = np.zeros((model.njoints, 4, 3)), np.zeros((model.nv, 6))
    place_tree(tree, q, np.zeros((2, 4, 3)), poses, J)
    pin.computeJointJacobians(model, data, q)
    np.testing.assert_allclose(poses[:, :3], [pose.rotation.T for pose in data.oMi], atol=1e-13)
    np.testing.assert_allclose(poses[:, 3], [pose.translation for pose in data.oMi], atol=1e-13)
    np.testing.assert_allclose(J, data.J.T, atol=1e-13)
    # Of joints that shift and turn at once the shift is a straight one, which agrees to second order.
    size, rough = (1e-5, 1e-9) if kind in ("flight", "plane") else (0.4, 1e-13)
    move = size * rng.normal(size=model.nv)
    there = q.copy()
    step_tree(tree, move, there)
    np.testing.assert_allclose(there, pin.integrate(model, q, move), atol=rough)
