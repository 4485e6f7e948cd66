"""Damping, friction, armature, springs and limits of joints: through every file format, as other programs read them."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from joint_arrays import here
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from urdf_trees import random_tree

from exo_pin.chain import ClosedChain, Closures, JointProperties, Root

HINGES = ("revolute", "prismatic", "continuous")


def strong_chain(seed, armature=True):
    """A tree of hinges and slides in which every joint has all data."""
    xml, rng = random_tree(seed, 6, HINGES), np.random.default_rng(seed)
    bare = ClosedChain.from_urdf(xml, Closures("strong"))
    joints = []
    for index in range(1, bare.model.njoints):
        unit = "m" if "JointModelP" in bare.model.joints[index].shortname() else "rad"
        # An endless hinge carries no spring.
        spring = (rng.uniform(0.5, 50.0), (rng.normal(),)) if bare.model.nqs[index] == 1 else (0.0, None)
        inertia = (rng.uniform(0.01, 0.1),) if armature else None
        joints.append(JointProperties(bare.model.names[index], *spring, inertia, unit))
    return ClosedChain.from_urdf(xml, Closures("strong", joints=tuple(joints), root=Root(gravity=(0, 0, 0))))


def bounded(chain):
    """The chain with bounds of cosines and sines, which are no angles."""
    model = chain.model.copy()
    for index in (index for index in range(1, model.njoints) if model.nqs[index] == 2):
        own = slice(model.idx_qs[index], model.idx_qs[index] + 2)
        model.lowerPositionLimit[own], model.upperPositionLimit[own] = -1.0, 1.0
    return ClosedChain(model, chain.description)


def rest(chain, name):
    """Where a joint's spring is slack, rad or m."""
    reference = next(item.spring_reference for item in chain.description.joints if item.joint == name)
    return 0.0 if reference is None else reference[0]


@pytest.mark.parametrize("seed", range(3))
def test_the_urdf_as_drake_and_mujoco_read_it(seed, tmp_path):
    chain = strong_chain(seed)
    path, model = chain.to_urdf(tmp_path), chain.model
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    theirs = mujoco.MjModel.from_xml_path(str(path))
    for index in range(1, model.njoints):
        name, v, q = model.names[index], model.idx_vs[index], model.idx_qs[index]
        joint, mine = plant.GetJointByName(name), theirs.joint(name)
        assert joint.default_damping_vector()[0] == model.damping[v]
        assert mine.damping[0] == model.damping[v]
        assert mine.frictionloss[0] == model.upperDryFrictionLimit[v]
        assert joint.velocity_upper_limits()[0] == model.upperVelocityLimit[v]
        assert joint.velocity_lower_limits()[0] == model.lowerVelocityLimit[v]
        if model.nqs[index] == 1:
            limits = [model.lowerPositionLimit[q], model.upperPositionLimit[q]]
            assert [joint.position_lower_limits()[0], joint.position_upper_limits()[0]] == limits
            np.testing.assert_allclose(mine.range, limits)


@pytest.mark.parametrize("seed", range(5))
def test_mujoco_has_the_same_springs_damping_and_limits(seed, tmp_path):
    chain = bounded(strong_chain(seed))
    model, theirs = chain.model, mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path, chain.neutral())))
    data, rng = mujoco.MjData(theirs), np.random.default_rng(seed)
    q = pin.integrate(model, chain.neutral(), rng.normal(size=model.nv))
    v = rng.normal(size=model.nv)
    for index in range(1, model.njoints):
        name = model.names[index]
        data.joint(name).qpos[0], data.joint(name).qvel[0] = here(chain, q, name), v[model.idx_vs[index]]
    mujoco.mj_forward(theirs, data)
    for index in range(1, model.njoints):
        name, at = model.names[index], model.idx_vs[index]
        joint, stiffness = theirs.joint(name), chain.description.joints[index - 1].stiffness
        start = joint.dofadr[0]
        spring = -stiffness * (here(chain, q, name) - rest(chain, name))
        assert data.qfrc_spring[start] == pytest.approx(spring, rel=1e-12, abs=1e-12)
        assert data.qfrc_damper[start] == pytest.approx(-model.damping[at] * v[at], rel=1e-12)
        assert joint.armature[0] == model.armature[at]
        assert joint.frictionloss[0] == model.upperDryFrictionLimit[at]
        assert theirs.jnt_actfrclimited[joint.id]
        assert list(theirs.jnt_actfrcrange[joint.id]) == [model.lowerEffortLimit[at], model.upperEffortLimit[at]]
        if model.nqs[index] == 1:
            limits = [array[model.idx_qs[index]] for array in (model.lowerPositionLimit, model.upperPositionLimit)]
            assert list(joint.range) == limits
        else:
            assert not theirs.jnt_limited[joint.id]


@pytest.mark.parametrize("seed", range(5))
def test_drake_has_the_same_springs_damping_and_limits_from_sdf(seed, tmp_path):
    chain = bounded(strong_chain(seed, armature=False))
    model, rng = chain.model, np.random.default_rng(seed)
    as_written, q = (pin.integrate(model, chain.neutral(), rng.normal(size=model.nv)) for _ in range(2))
    plant = MultibodyPlant(0.0)
    path = chain.to_sdf(tmp_path, as_written)
    # Not strictly, because Drake has no dry friction and warns of it.
    Parser(plant).AddModels(str(path))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    context, forces = plant.CreateDefaultContext(), MultibodyForces(plant)
    text, positions = path.read_text(), np.zeros(plant.num_positions())
    for index in range(1, model.njoints):
        name = model.names[index]
        joint = plant.GetJointByName(name)
        moved = here(chain, q, name) - here(chain, as_written, name)
        positions[joint.position_start()] = moved
        assert f"<friction>{float(model.upperDryFrictionLimit[model.idx_vs[index]])!r}</friction>" in text
    plant.SetPositions(context, positions)
    plant.CalcForceElementsContribution(context, forces)
    actuators = [plant.get_joint_actuator(k) for k in plant.GetJointActuatorIndices()]
    efforts = {actuator.joint().name(): actuator.effort_limit() for actuator in actuators}
    for index in range(1, model.njoints):
        name, at = model.names[index], model.idx_vs[index]
        joint, stiffness = plant.GetJointByName(name), chain.description.joints[index - 1].stiffness
        spring = -stiffness * (here(chain, q, name) - rest(chain, name))
        assert forces.generalized_forces()[joint.velocity_start()] == pytest.approx(spring, rel=1e-9, abs=1e-9)
        assert joint.default_damping_vector()[0] == model.damping[at]
        assert joint.velocity_upper_limits()[0] == model.upperVelocityLimit[at]
        assert efforts[name] == model.upperEffortLimit[at]
        if model.nqs[index] == 1:
            start = here(chain, as_written, name)
            limits = [
                array[model.idx_qs[index]] - start for array in (model.lowerPositionLimit, model.upperPositionLimit)
            ]
            theirs = [joint.position_lower_limits()[0], joint.position_upper_limits()[0]]
            np.testing.assert_allclose(theirs, limits, rtol=1e-12)
        else:
            assert joint.position_upper_limits()[0] == np.inf


def one_joint(kind, name, arrays):
    """A heavy body on the world."""
    model = pin.Model()
    joint = model.addJoint(0, kind, pin.SE3.Identity(), name)
    model.addJointFrame(joint, -1)
    model.addBodyFrame("arm", joint, pin.SE3.Identity(), -1)
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.1, 0, 0]), np.eye(3)), pin.SE3.Identity())
    for key, values in arrays.items():
        getattr(model, key)[:] = values
    return model


def ball_chain(**arrays):
    return one_joint(pin.JointModelSpherical(), "ball", arrays)


def test_a_ball_joint_in_mujoco(tmp_path):
    chain = ClosedChain(
        ball_chain(damping=0.3, armature=0.2, upperDryFrictionLimit=0.1, lowerDryFrictionLimit=-0.1),
        Closures("one", joints=(JointProperties("ball", 3.0),)),
    )
    theirs = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path)))
    data = mujoco.MjData(theirs)
    turn, v = np.array([0.3, -0.5, 0.7]), np.array([1.0, 2.0, 3.0])
    q = pin.integrate(chain.model, chain.neutral(), turn)
    data.qpos[:], data.qvel[:] = q[[3, 0, 1, 2]], v
    mujoco.mj_forward(theirs, data)
    np.testing.assert_allclose(data.qfrc_spring, -3.0 * turn, rtol=1e-12)
    np.testing.assert_allclose(data.qfrc_damper, -0.3 * v, rtol=1e-12)
    np.testing.assert_array_equal(theirs.dof_armature, 0.2)
    np.testing.assert_array_equal(theirs.dof_frictionloss, 0.1)
    # The URDF's closures file has the spring and the armature of a root joint.
    bare = ClosedChain(ball_chain(armature=0.2), Closures("one", joints=(JointProperties("ball", 3.0),)))
    again = ClosedChain.from_urdf(bare.to_urdf(tmp_path))
    assert again.description.joints == (JointProperties("ball", 3.0, armature=(0.2, 0.2, 0.2), unit="rad"),)
    np.testing.assert_array_equal(again.model.armature, 0.2)


def floating_chain(seed):
    """A floating joint with an origin of its own and a hinge, in an order that the seed decides."""
    chain = ClosedChain.from_urdf(random_tree(seed, 2, ("floating", "revolute")), Closures("free"))
    return chain, pin.integrate(chain.model, chain.neutral(), np.random.default_rng(seed).normal(size=7))


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_free_body_stands_in_mujoco_where_it_stands(seed, tmp_path):
    chain, q = floating_chain(seed)
    theirs = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path, q)))
    data = mujoco.MjData(theirs)
    mujoco.mj_resetDataKeyframe(theirs, data, 0)
    mujoco.mj_forward(theirs, data)
    for link in ("l1", "l2"):
        np.testing.assert_allclose(data.body(link).xpos, chain.placement(q, link).translation, atol=1e-12)
        np.testing.assert_allclose(data.body(link).xmat.reshape(3, 3), chain.placement(q, link).rotation, atol=1e-12)
