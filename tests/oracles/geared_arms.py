"""Arms with couplings between their joints, as URDF, and the same in MuJoCo, whose joint equalities are its own."""

import mujoco
import numpy as np
from mujoco_tree import spec_of

from exo_pin.chain import Closure, Closures
from exo_pin.chain.formats.urdf.urdf_writing import Body, Document

#: Of the joints of an arm.
KINDS = ("revolute", "prismatic", "revolute", "revolute", "prismatic")


def arm(seed):
    """The URDF of a serial arm of five joints, joint_0 to joint_4, on the ground."""
    rng = np.random.default_rng(seed)
    document = Document("geared")
    document.link("ground", None)
    parent = "ground"
    for k, kind in enumerate(KINDS):
        axis = rng.normal(size=3)
        document.link(f"link_{k}", Body(rng.uniform(0.5, 2.0), rng.normal(size=3) * 0.1, np.diag([0.03, 0.02, 0.025])))
        origin = rng.normal(size=3) * 0.3
        document.joint(f"joint_{k}", kind, parent, f"link_{k}", origin, axis / np.linalg.norm(axis), [-30, 30])
        parent = f"link_{k}"
    return document.text()


def random_coupling(rng, name, a, b):
    """Of any degree up to four; ``a`` may be None."""
    powers = rng.uniform(-1.0, 1.0, 1 if a is None else int(rng.integers(2, 6)))
    references = tuple(rng.uniform(-0.5, 0.5, 2)) if a is not None else (0.0, float(rng.uniform(-0.5, 0.5)))
    return Closure(name, "coupling", a or "universe", b, polynomial=tuple(powers), references=references)


def geared(seed):
    """An arm with two couplings, joint 2 by joint 0 and joint 4 by joint 1, or held."""
    rng = np.random.default_rng([seed, 1])
    second = None if rng.random() < 0.3 else "joint_1"
    pair = (random_coupling(rng, "first", "joint_0", "joint_2"), random_coupling(rng, "second", second, "joint_4"))
    return arm(seed), Closures("geared", closures=pair)


def in_mujoco(urdf, closures):
    """MuJoCo's model of the URDF's tree with a joint equality for every coupling."""
    spec = spec_of(urdf, closures.root, closures.root.gravity)
    for closure in closures.closures:
        equality = spec.add_equality(name=closure.name, type=mujoco.mjtEq.mjEQ_JOINT, name1=closure.frame_b)
        if closure.frame_a != "universe":
            equality.name2 = closure.frame_a
        equality.objtype = mujoco.mjtObj.mjOBJ_JOINT
        r_a, r_b = closure.references
        # MuJoCo's positions count from zero here: q_b = r_b + p(q_a - r_a), expanded.
        moved = np.polynomial.Polynomial(closure.polynomial)(np.polynomial.Polynomial([-r_a, 1.0])) + r_b
        equality.data = np.pad(moved.coef, (0, len(equality.data) - len(moved.coef)))
    return spec.compile()
