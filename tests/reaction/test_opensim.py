"""Forces on the shoulder as OpenSim computes them for the same mechanism.

OpenSim knows nothing of wrists: the arm is a body on a ball joint, limbs without mass act as forces on it, and limbs
with mass are bodies that hang on the arm by ball joints and end at the torso in point constraints.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import PERSON, heavy_limbs, random_mechanism, regular_poses

import exo_pin as ep

osim = pytest.importorskip("opensim", reason="a check with OpenSim: pip install opensim")


def vec(values):
    return osim.Vec3(*(float(value) for value in values))


def of(vector, size=3):
    return np.array([vector.get(k) for k in range(size)])


def body_of(model, name, mass, centre, inertia):
    moments = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    body = osim.Body(name, float(mass), vec(centre), osim.Inertia(*(float(value) for value in moments)))
    model.addBody(body)
    return body


def arm_model(mechanism):
    """A model with the arm on a ball joint at the origin, and the joint."""
    arm = mechanism.arm
    model = osim.Model()
    model.setGravity(vec(mechanism.gravity))
    inertia = np.zeros((3, 3)) if arm.inertia is None else arm.inertia
    body = body_of(model, "arm", arm.mass, arm.centre_of_mass, inertia)
    joint = osim.BallJoint("shoulder", model.getGround(), body)
    model.addJoint(joint)
    return model, body, joint


def put(joint, state, orientation):
    """Put a ball joint into an orientation by its body-fixed X-Y-Z angles."""
    for k, angle in enumerate(orientation.as_euler("XYZ")):
        joint.get_coordinates(k).setValue(state, float(angle), False)


def shoulder_reaction(model, joint, state):
    """Force of the ball joint on the arm, base frame."""
    model.realizeAcceleration(state)
    return of(joint.calcReactionOnChildExpressedInGround(state).get(1))


@pytest.mark.parametrize("count", [3, 5])
def test_massless_limbs_at_rest(count):
    rng = np.random.default_rng(400 + count)
    mechanism = ep.load("prototype").worn_by(PERSON).mechanism if count == 3 else random_mechanism(rng, 5)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    for pose in regular_poses(mechanism, rng, 10, margin=0.05):
        answer = exo.reaction(pose)
        model, body, joint = arm_model(mechanism)
        for i, wrench in enumerate(answer.limb_wrenches):
            force = osim.PrescribedForce(f"limb_{i}", body)
            force.setForceIsInGlobalFrame(True)
            force.setPointIsInGlobalFrame(True)
            for setter, part in ((force.setForceFunctions, wrench[:3]), (force.setTorqueFunctions, wrench[3:])):
                setter(*(osim.Constant(float(value)) for value in part))
            force.setPointFunctions(*(osim.Constant(0.0) for _ in range(3)))
            model.addForce(force)
        state = model.initSystem()
        put(joint, state, pose)
        found = shoulder_reaction(model, joint, state)
        size = np.abs(answer.actuator_forces).max()
        np.testing.assert_allclose(found, answer.shoulder_force, atol=1e-9 * size)
        acceleration = of(body.getAngularAccelerationInGround(state))
        np.testing.assert_allclose(acceleration, 0.0, atol=1e-7 * size)


def push(model, body, name, force, moment=(0.0, 0.0, 0.0)):
    """A force through the body's own origin and a moment on it, base frame."""
    element = osim.PrescribedForce(name, body)
    element.setForceIsInGlobalFrame(True)
    element.setForceFunctions(*(osim.Constant(float(value)) for value in force))
    element.setTorqueFunctions(*(osim.Constant(float(value)) for value in moment))
    model.addForce(element)


def test_massless_limbs_in_motion():
    rng = np.random.default_rng(411)
    exo = ep.load("prototype").worn_by(PERSON)
    for pose in regular_poses(exo.mechanism, rng, 10, margin=0.05):
        speed, change = rng.normal(size=3), 5.0 * rng.normal(size=3)
        answer = exo.reaction(pose, ep.Motion(speed, change))
        model, body, joint = arm_model(exo.mechanism)
        total = answer.limb_wrenches.sum(axis=0)
        push(model, body, "limbs", total[:3], total[3:])
        state = model.initSystem()
        put(joint, state, pose)
        # The speeds of a ball joint are the angular velocity in the axes of its parent.
        for k in range(3):
            joint.get_coordinates(k).setSpeedValue(state, float(speed[k]))
        size = np.abs(answer.actuator_forces).max()
        np.testing.assert_allclose(shoulder_reaction(model, joint, state), answer.shoulder_force, atol=1e-9 * size)
        np.testing.assert_allclose(of(body.getAngularVelocityInGround(state)), speed, atol=1e-12)
        np.testing.assert_allclose(of(body.getAngularAccelerationInGround(state)), change, atol=1e-8 * size)


def hang_limb(model, arm, name, limb, base, platform):
    """A limb of two halves with mass, x along it: a ball on the arm at B, a slide, a point held at A of the torso."""
    halves = []
    for half, (label, sign) in zip(
        (limb.platform_body, limb.base_body), (("upper", 1.0), ("lower", -1.0)), strict=True
    ):
        inertia = np.diag([half.axial_inertia, half.transverse_inertia, half.transverse_inertia])
        halves.append(body_of(model, f"{name}_{label}", half.mass, [sign * half.centre, 0.0, 0.0], inertia))
    nothing = osim.Vec3(0)
    ball = osim.BallJoint(f"{name}_ball", arm, vec(platform), nothing, halves[0], nothing, nothing)
    slide = osim.SliderJoint(f"{name}_slide", halves[0], halves[1])
    for joint in (ball, slide):
        model.addJoint(joint)
    model.addConstraint(osim.PointConstraint(model.getGround(), vec(base), halves[1], nothing))
    return halves, ball, slide


def test_limbs_with_mass_at_rest():
    rng = np.random.default_rng(412)
    mechanism = heavy_limbs(random_mechanism(rng, 3, ["SPS"] * 3), rng)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    geometry = mechanism.geometry
    for pose in regular_poses(mechanism, rng, 8, margin=0.1):
        answer = exo.reaction(pose)
        model, arm, joint = arm_model(mechanism)
        R = pose.as_matrix()
        spans = geometry.base_points - geometry.platform_points @ R.T
        lengths = np.linalg.norm(spans, axis=1)
        parts = []
        for i, limb in enumerate(mechanism.limbs):
            direction = spans[i] / lengths[i]
            ends = geometry.base_points[i], geometry.platform_points[i]
            own = hang_limb(model, arm, f"limb_{i}", limb, *ends)
            pull = answer.actuator_forces[i] * direction
            push(model, own[0][0], f"pull_{i}", pull)
            push(model, own[0][1], f"back_{i}", -pull)
            parts.append((*own, direction))
        state = model.initSystem()
        put(joint, state, pose)
        for (_, ball, slide, direction), length in zip(parts, lengths, strict=True):
            along = R.T @ direction
            put(ball, state, Rotation.align_vectors([along], [[1.0, 0.0, 0.0]])[0])
            slide.get_coordinates(0).setValue(state, float(length), False)
        size = np.abs(answer.actuator_forces).max()
        np.testing.assert_allclose(shoulder_reaction(model, joint, state), answer.shoulder_force, atol=1e-9 * size)
        np.testing.assert_allclose(of(arm.getAngularAccelerationInGround(state)), 0.0, atol=1e-7 * size)
