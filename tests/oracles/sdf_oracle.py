"""A chain that was read from SDF beside Drake's reading of the same text.

Drake (libsdformat) reads the file anew. It has no loops: the joints that close them are taken out of its text by name.
A state of the chain is put into Drake joint by joint, and the map of velocities comes from Drake's own velocities for
every unit velocity of the chain.
"""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, BodyIndex, PrismaticJoint, RevoluteJoint, UniversalJoint

from exo_pin.chain import ClosedChain


def without(text, joints, turned=()):
    """The XML without some joints, pictures and collision shapes, and with parent and child of others exchanged."""
    root = ET.fromstring(text)
    if turned:
        # Poses of joints are relative to the child if nothing else is said, which version 1.6 cannot.
        root.set("version", "1.7")
    for model in root.iter("model"):
        for joint in model.findall("joint"):
            if joint.get("name") in joints:
                model.remove(joint)
            elif joint.get("name") in turned:
                parent, child, pose = (joint.find(tag) for tag in ("parent", "child", "pose"))
                pose = ET.SubElement(joint, "pose") if pose is None else pose
                pose.set("relative_to", pose.get("relative_to", child.text))
                parent.text, child.text = child.text, parent.text
        for link in model.findall("link"):
            for tag in ("visual", "collision"):
                for part in link.findall(tag):
                    link.remove(part)
    return ET.tostring(root, encoding="unicode")


def balls_from_child(text, chain):
    """Ball joints that the chain goes through from the child to the parent, which Drake does not."""
    model, found = chain.model, []
    for joint in ET.fromstring(text).iter("joint"):
        if joint.get("type") == "ball" and joint.get("name") in model.names:
            body = model.frames[model.getFrameId(joint.find("child").text.strip())].parentJoint
            while body and model.names[body] != joint.get("name"):
                body = model.parents[body]
            found += [] if body else [joint.get("name")]
    return found


class DrakeSdf:
    """Drake's model of a text, in the states of a chain."""

    def __init__(self, text, chain):
        closing = {closure.name for closure in chain.closures if closure.type != "coupling"}
        self.chain = chain
        self.plant = MultibodyPlant(0.0)
        Parser(self.plant).AddModelsFromString(without(text, closing, balls_from_child(text, chain)), "sdf")
        self.plant.mutable_gravity_field().set_gravity_vector(chain.model.gravity.linear)
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()
        self.joints = {}
        for index in self.plant.GetJointIndices():
            joint = self.plant.get_joint(index)
            if joint.num_velocities() and not joint.child_body().is_floating_base_body():
                self.joints[joint.name()] = joint

    def _own(self, name):
        """The chain's joints of one of Drake's."""
        parts = (name, f"{name}_axis", f"{name}_axis2")
        names = {each.split("::")[-1]: each for each in list(self.chain.model.names)}
        return [names[part] for part in parts if part in names]

    def put(self, q, v):
        """Take a state."""
        chain, plant, context = self.chain, self.plant, self.context
        for name, joint in self.joints.items():
            own = self._own(name)
            here = np.concatenate([q[chain.configuration_slice(each)] for each in own])
            rate = np.concatenate([v[chain.velocity_slice(each)] for each in own])
            if isinstance(joint, BallRpyJoint):
                R = pin.Quaternion(here).toRotationMatrix()
                joint.set_angles(context, RollPitchYaw(RotationMatrix(R)).vector())
                joint.set_angular_velocity(context, R @ rate)
            elif isinstance(joint, UniversalJoint):
                joint.set_angles(context, here)
                joint.set_angular_rates(context, rate)
            elif isinstance(joint, RevoluteJoint):
                joint.set_angle(context, here[0])
                joint.set_angular_rate(context, rate[0])
            else:
                assert isinstance(joint, PrismaticJoint)
                joint.set_translation(context, here[0])
                joint.set_translation_rate(context, rate[0])
        data = chain.model.createData()
        pin.forwardKinematics(chain.model, data, q, v)
        for index in plant.GetFloatingBaseBodies():
            body = plant.get_body(index)
            (frame,) = [k for k, each in enumerate(chain.model.frames) if each.name.split("::")[-1] == body.name()]
            place = pin.updateFramePlacement(chain.model, data, frame)
            twist = pin.getFrameVelocity(chain.model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            plant.SetFreeBodyPose(context, body, RigidTransform(RotationMatrix(place.rotation), place.translation))
            plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity(twist.angular, twist.linear))

    def velocity_map(self, q):
        """T, shape (nv, nv): Drake's velocities are T times the chain's."""
        columns = []
        for unit in np.eye(self.chain.model.nv):
            self.put(q, unit)
            columns.append(self.plant.GetVelocities(self.context).copy())
        return np.array(columns).T

    def mass_and_gravity(self, q):
        """Mass matrix and forces of gravity in the chain's coordinates."""
        T = self.velocity_map(q)
        M = self.plant.CalcMassMatrix(self.context)
        return T.T @ M @ T, T.T @ self.plant.CalcGravityGeneralizedForces(self.context)

    def poses(self):
        """Poses of all links in the world, by name."""
        found = {}
        for k in range(1, self.plant.num_bodies()):
            body = self.plant.get_body(BodyIndex(k))
            X = self.plant.EvalBodyPoseInWorld(self.context, body)
            found[body.name()] = pin.SE3(X.rotation().matrix(), X.translation())
        return found


def mass_matrix(model, q):
    upper = np.triu(np.reshape(pin.crba(model, model.createData(), q), (model.nv, model.nv)))
    return upper + np.triu(upper, 1).T


def assert_is_drakes(text, seed):
    """Places of all links, mass matrix and weight at a random state of the tree."""
    chain = ClosedChain.from_sdf(text)
    model = chain.model
    if model.nv == 0:
        return chain
    drake = DrakeSdf(text, chain)
    q = pin.integrate(model, chain.neutral(), np.random.default_rng(seed).uniform(-1.0, 1.0, model.nv))
    M, weight = drake.mass_and_gravity(q)
    np.testing.assert_allclose(mass_matrix(model, q), M, rtol=0, atol=1e-9 * np.abs(M).max())
    ours = pin.computeGeneralizedGravity(model, model.createData(), q)
    np.testing.assert_allclose(ours, -weight, rtol=0, atol=1e-9 * max(1.0, np.abs(weight).max()))
    for placement in (chain.placements(q), chain.placements(chain.neutral())):
        places = {name.split("::")[-1]: place for name, place in placement.items()}
        found = drake.poses()
        for name, place in found.items():
            np.testing.assert_allclose(places[name].homogeneous, place.homogeneous, atol=1e-9)
        drake.put(chain.neutral(), np.zeros(model.nv))
    for name, joint in drake.joints.items():
        own = [each for each in list(model.names) if each.split("::")[-1] == name]
        if own and joint.num_velocities() == 1:
            (span,) = range(*chain.velocity_slice(own[0]).indices(model.nv))
            at = chain.configuration_slice(own[0]).start
            assert joint.default_damping_vector()[0] == model.damping[span]
            assert joint.position_lower_limits()[0] == model.lowerPositionLimit[at]
            assert joint.position_upper_limits()[0] == model.upperPositionLimit[at]
    return chain
