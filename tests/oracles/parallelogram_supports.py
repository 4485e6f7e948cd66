"""Devices that carry the arm through a parallelogram, with their bodies in any order."""

import numpy as np
import pinocchio as pin
from mechanisms import placed, unit
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.chain import Closure, Closures, Roles, Root
from exo_pin.device import ChainDevice

#: Where the arm stands among the bodies of a file: before the device, behind it, or as the root that carries it.
ORDERS = ("arm first", "arm last", "from the arm")
Z = np.array([0.0, 0.0, 1.0])


def parallelogram_support(seed, order="arm first", closing="revolute", drives=("turn", "crank", "spin")):
    """A support on the torso: a hinge, a parallelogram, two hinges, and a cylindrical joint along the arm.

    Parameters
    ----------
    seed : int
        Of its dimensions.
    order : str
        One of :data:`ORDERS`; the mechanism is the same.
    closing : str
        Closure of the parallelogram: "spherical" with one redundant row, or "revolute" with three.
    drives : tuple of str
        Joints that are driven.

    Returns
    -------
    ShoulderExo
    """
    rng = np.random.default_rng(seed)
    foot = np.array([-0.15, 0.12, 0.1]) + rng.uniform(-0.04, 0.04, 3)
    crank, apart = np.array([0.16, 0.05, -0.08]) + rng.uniform(-0.03, 0.03, 3), np.array([-0.02, 0.0, -0.09])
    across = unit(np.cross(crank, apart))
    cuff = np.array([0.0, 0.0, -0.2])
    elbow = foot + crank + rng.uniform(0.02, 0.05, 3)
    swing, tilt = (unit(axis + rng.uniform(-0.2, 0.2, 3)) for axis in ([1.0, 0.3, 0.3], [-0.3, 1.0, 0.3]))
    #: Joints from torso to arm, where they are at rest, their axes, and the bodies between them.
    joints = [
        ("turn", foot, unit(np.array([0.1, 0.1, 1.0]))),
        ("crank", foot, across),
        ("tip", foot + crank, across),
        ("swing", elbow, swing),
        ("tilt", cuff, tilt),
        ("spin", cuff, Z),
        ("slide", cuff, Z),
    ]
    bodies, masses = ["foot", "yoke", "rod", "bar", "fork", "hub", "ring", "end"], [0, 0.8, 0.4, 0.3, 0.2, 0.2, 0.15, 0]
    model, at = pin.Model(), {"universe": np.zeros(3)}
    model.name = "support"

    places = dict(zip(bodies[1:-1], (point for _, point, _ in joints), strict=False)) | {"rod_2": foot + apart}

    def add(name, parent, body, point, kind, mass=0.0):
        under = 0 if parent == "universe" else model.frames[model.getFrameId(parent)].parentJoint
        index = model.addJoint(under, kind, pin.SE3(np.eye(3), point - at[parent]), name)
        model.addJointFrame(index)
        if mass:
            middle = places[body] + [0.02, 0.01, -0.03] - point
            model.inertias[index] = pin.Inertia(mass, middle, 0.01 * mass * np.eye(3))
        model.addFrame(pin.Frame(body, index, pin.SE3.Identity(), pin.FrameType.BODY))
        at[body] = np.array(point)

    def arm():
        add("shoulder", "universe", "arm", np.zeros(3), pin.JointModelSpherical())
        tensor = np.diag([0.09, 0.088, 0.006])
        model.inertias[model.getJointId("shoulder")] = pin.Inertia(3.0, np.array([0.0, 0.01, -0.28]), tensor)

    def device(steps, last):
        for (name, point, axis), parent, body in steps:
            slides, sign = name == "slide", -1.0 if last == "foot" else 1.0
            kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
            add(name, parent, body, point, kind(sign * axis), masses[bodies.index(body)] if body in bodies else 0.4)
            if body == "yoke":
                add("crank_2", "yoke", "rod_2", foot + apart, pin.JointModelRevoluteUnaligned(across), 0.35)

    pairs = list(zip(joints, bodies, bodies[1:], strict=False))
    if order == "from the arm":
        arm()
        device([(joint, "arm" if far == "end" else far, near) for joint, near, far in reversed(pairs)], "foot")
    else:
        parts = [arm, lambda: device([(j, "universe" if a == "foot" else a, b) for j, a, b in pairs], "end")]
        for part in parts if order == "arm first" else reversed(parts):
            part()
    ends = ("foot", "universe") if order == "from the arm" else ("end", "arm")
    point = foot if order == "from the arm" else cuff
    turn = Rotation.align_vectors([across], [Z])[0]
    tip = foot + apart + crank
    inner = Closure("tip_2", closing, "rod_2", "bar", placed(tip - at["rod_2"], turn), placed(tip - at["bar"], turn))
    outer = Closure("outer", "rigid", *ends, placed(point - at[ends[0]]), placed(point - at[ends[1]]))
    roles = Roles(actuated=drives, shoulder="shoulder", arm="arm")
    chain = ep.ClosedChain(model, Closures("support", Root("fixed"), (inner, outer), roles))
    return ep.ShoulderExo.from_chain(ChainDevice.from_chain(chain).chain)
