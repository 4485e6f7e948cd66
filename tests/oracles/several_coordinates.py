"""Chains with joints of several coordinates, closed in a random configuration."""

import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain, Closure, Closures, JointProperties, Placement

KINDS = {
    "spherical": pin.JointModelSpherical,
    "planar": pin.JointModelPlanar,
}


def _place(seed):
    rng = np.random.default_rng(seed)
    return pin.SE3(pin.exp3(rng.normal(size=3)), 0.2 * rng.normal(size=3))


def _body(rng):
    spread = 0.1 * rng.normal(size=(4, 3))
    inertia = sum(0.5 * (p @ p * np.eye(3) - np.outer(p, p)) for p in spread)
    return pin.Inertia(2.0, 0.1 * rng.normal(size=3), inertia)


def tree(kind, seed):
    """Two arms: the kind, a hinge and the kind again; a hinge and a ball joint."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    model.gravity.linear = np.array([1.0, -4.0, -8.0])
    hinge = pin.JointModelRevoluteUnaligned(0.0, 0.6, 0.8)
    arms = [("left", [KINDS[kind](), hinge, KINDS[kind]()]), ("right", [hinge, pin.JointModelSpherical()])]
    for side, joints in arms:
        carrier = 0
        for k, joint in enumerate(joints):
            name = f"{side}_{k}"
            carrier = model.addJoint(carrier, joint, _place(int(rng.integers(1000))), name)
            model.appendBodyToJoint(carrier, _body(rng), pin.SE3.Identity())
            model.addFrame(pin.Frame(f"{name}_link", carrier, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.armature = rng.uniform(0.0, 0.1, model.nv)
    return model


def chain(kind, closure="spherical", seed=0, passive=False):
    """The tree with its arms' ends joined; returns the chain and a configuration where they are."""
    model, rng = tree(kind, seed), np.random.default_rng(seed + 1)
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-0.8, 0.8, model.nv))
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    last = {side: model.getJointId(name) for side, name in (("left", "left_2"), ("right", "right_1"))}
    here = pin.SE3(pin.exp3(rng.normal(size=3)), 0.2 * rng.normal(size=3))
    there = data.oMi[last["right"]].actInv(data.oMi[last["left"]] * here)
    distance = 0.4 if closure == "distance" else None
    if distance:
        there = there * pin.SE3(np.eye(3), np.array([0.0, 0.24, 0.32]))
    joints = []
    if passive:
        model.damping = rng.uniform(0.1, 1.0, model.nv)
        still = pin.integrate(model, q, rng.uniform(-0.5, 0.5, model.nv))
        for joint in range(1, model.njoints):
            first, size = model.idx_qs[joint], model.nqs[joint]
            plain = size == model.nvs[joint] or model.joints[joint].shortname() == "JointModelSpherical"
            if plain:
                reference = tuple(still[first : first + size].tolist())
                joints.append(JointProperties(model.names[joint], float(rng.uniform(1.0, 20.0)), reference))
    ends = [Placement(tuple(M.translation.tolist()), _quaternion(M)) for M in (here, there)]
    loop = Closure("loop", closure, "left_2_link", "right_1_link", *ends, distance=distance)
    return ClosedChain(model, Closures("arms", closures=(loop,), joints=tuple(joints))), q


def _quaternion(placement):
    return tuple(np.array(pin.Quaternion(placement.rotation).normalized().coeffs()).tolist())


def motion(chain, q, seed=2):
    """A velocity and an acceleration that keep the loop closed."""
    rng = np.random.default_rng(seed)
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    return v, chain.project_acceleration(q, v, rng.normal(size=chain.model.nv))
