"""Chains with fewer actuators than freedoms, in motions that their actuators make."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from moving_chains import WITH_MASS, moving
from scenes import human_urdf

from exo_pin.chain import ClosedChain, Closures

#: Robots of one tree: joints as (type, axis, whether it is actuated).
TREES = {
    "acrobot": [("hinge", "0 1 0", False), ("hinge", "0 1 0", True)],
    "pendubot": [("hinge", "0 1 0", True), ("hinge", "0 1 0", False)],
    "cart-pole": [("slide", "1 0 0", True), ("hinge", "0 1 0", False)],
    "cart with two poles": [("slide", "1 0 0", True), ("hinge", "0 1 0", False), ("hinge", "1 0 0", False)],
}
MOTORS = [f"{side}-{name}-op" for side in ("left", "right") for name in ("roll", "yaw", "pitch", "knee", "foot")]
#: Joints of loops that drive themselves alone: one independent joint less is a robot that is not driven in all.
LOOPS = [name for name in WITH_MASS if name not in ("four-bar", "four-bar cut in a link", "parallelogram")]


class Underactuated(NamedTuple):
    """A chain and a motion that efforts ``tau`` in the actuated joints make."""

    chain: ClosedChain
    actuated: list[str]
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


def tree_mjcf(joints, rng):
    """A chain of links as MJCF text, masses and lengths at random."""
    inner = ""
    for k, (kind, axis, _) in reversed(list(enumerate(joints))):
        mass, length = rng.uniform(0.5, 2.0), rng.uniform(0.3, 1.0)
        lever = rng.uniform(-0.1, 0.1, 3) - [0, 0, length / 2]
        inner = (
            f'<body name="link{k}" pos="0 0 {-length if k else 0}"><joint name="joint{k}" type="{kind}" axis="{axis}"/>'
            f'<inertial pos="{lever[0]} {lever[1]} {lever[2]}" mass="{mass}" '
            f'diaginertia="{0.09 * mass} {0.08 * mass} {0.03 * mass}"/>{inner}</body>'
        )
    return f'<mujoco><compiler autolimits="true"/><worldbody>{inner}</worldbody></mujoco>'


def random_tree(rng):
    """A floating or fixed tree of several joint types and branches, and some of its joints."""
    model = pin.Model()
    kinds = [pin.JointModelRX, pin.JointModelPY, pin.JointModelRZ, pin.JointModelSpherical]
    path = [0]
    for k in range(int(rng.integers(3, 7))):
        kind = pin.JointModelFreeFlyer if k == 0 and rng.random() < 0.4 else kinds[rng.integers(len(kinds))]
        # Pinocchio's numbers are depth first: a branch leaves the last one added, or what carries it.
        del path[rng.integers(1, len(path) + 1) :]
        parent = path[-1]
        added = model.addJoint(parent, kind(), pin.SE3.Random() if k else pin.SE3.Identity(), f"joint{k}")
        size = rng.uniform(0.05, 0.3, 3)
        model.appendBodyToJoint(added, pin.Inertia.FromBox(rng.uniform(0.01, 3.0), *size), pin.SE3.Identity())
        path.append(added)
    names = list(model.names)[1:]
    return ClosedChain(model, Closures("tree")), [name for name in names[:-1] if rng.random() < 0.5]


def underactuated(name, seed):
    """A tree of ``TREES``, "random tree", "Cassie", or a loop of ``LOOPS`` with some of its actuators."""
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    if name in TREES:
        chain = ClosedChain.from_mjcf(tree_mjcf(TREES[name], rng))
        actuated = [f"joint{k}" for k, joint in enumerate(TREES[name]) if joint[2]]
    elif name == "random tree":
        chain, actuated = random_tree(rng)
    elif name == "Cassie":
        path = human_urdf().parents[2] / "cassie_description" / "robots" / "cassie_v2.sdf"
        chain, actuated = ClosedChain.from_sdf(path, right_angle_tolerance=2e-5), MOTORS
    else:
        case = moving(name, seed)
        chain, joints = case.chain, list(case.chain.roles.actuated) or case.independent
        count = rng.integers(0, min(len(joints), case.dof))
        actuated = [str(joint) for joint in rng.choice(joints, count, replace=False)]
        return Underactuated(chain, actuated, case.q, case.v, driven(chain, actuated, case.q, case.v, rng))
    size = 0.02 if name == "Cassie" else 1.0
    q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-size, size, chain.model.nv))
    q = chain.close(q, tolerance=1e-13)
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    return Underactuated(chain, actuated, q, v, driven(chain, actuated, q, v, rng))


def driven(chain, actuated, q, v, rng):
    """The acceleration that random efforts make."""
    tau = np.zeros(chain.model.nv)
    tau[chain.velocity_indices(actuated)] = 10.0 * rng.normal(size=len(chain.velocity_indices(actuated)))
    return chain.forward_dynamics(q, v, tau).a
