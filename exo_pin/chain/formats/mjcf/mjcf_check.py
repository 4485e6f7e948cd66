"""The comparison of a tree that was built from MJCF with MuJoCo's own equations of motion.

At one seeded state the mass matrix, the forces of gravity and velocity, and the passive forces have to be the same.
This finds everything in a file that changes the motion and is not read, except contact, equalities and actuators, whose
control is not read.

The two have different coordinates v: MuJoCo's free joint has its linear velocity in the world's axes,
v_theirs = T v, so that M = Tᵀ M_theirs T, and forces are Tᵀ times theirs. The acceleration that belongs to a = 0 is
T' v there, in which M_theirs T' v is added to their bias.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from ....core.validation import FloatArray
from ...structure.motion_axes import q_slice
from ...structure.passive import PassiveForces
from .mjcf_compiling import Compiled, mujoco_warnings
from .mjcf_tree import MjcfTree, addresses

#: Largest difference, relative to MuJoCo's largest entry: both sides round a few hundred times.
_SAME = 1e-9


def refuse_disagreement(source: Compiled, tree: MjcfTree) -> None:
    """Raise FileFormatError if MuJoCo's equations of motion are others than the tree's."""
    if not tree.model.nv:
        return
    q, v = _state(tree.model)
    data = source.mujoco.MjData(source.model)
    T, rate = _put(source, tree, data, q, v)
    with mujoco_warnings(source.mujoco, source.messages):
        M = _evaluate(source, data)
    bias = T.T @ (data.qfrc_bias + M @ (rate @ v))
    ours = tree.model.createData()
    upper = np.triu(np.reshape(pin.crba(tree.model, ours, q), (tree.model.nv, tree.model.nv)))
    pairs = {
        "mass matrix": (upper + np.triu(upper, 1).T, T.T @ M @ T),
        "forces of gravity and velocity": (pin.nonLinearEffects(tree.model, ours, q, v), bias),
        "passive forces": (PassiveForces(tree.model, tree.properties).force(q, v), T.T @ data.qfrc_passive),
    }
    for what, (one, other) in pairs.items():
        size = float(np.abs(other).max())
        if what.startswith("forces of gravity"):
            # They may cancel. Velocities are of size one, so that single terms are of the size of M.
            size = max(size, float(np.abs(M).max()))
        if not np.isfinite(size):
            raise source.error(f"its {what} are not finite: some number is far too large. Check its units")
        if not np.abs(one - other).max() <= _SAME * size:
            raise source.error(
                f"MuJoCo computes other {what} than the chain that was read from the file. Something in the file is "
                "not understood: please report it"
            )


def _state(model: pin.Model) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(0)
    q = pin.integrate(model, pin.neutral(model), rng.standard_normal(model.nv))
    return np.asarray(q), rng.standard_normal(model.nv)


def _put(source: Compiled, tree: MjcfTree, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give MuJoCo the state; return T and its rate, shape (nv, nv)."""
    theirs, model = source.model, tree.model
    T, rate = np.zeros((2, model.nv, model.nv))
    data.qpos[addresses(source, tree)] = q
    for joint, index in enumerate(tree.joints):
        at, count, dof = model.idx_vs[index], model.nvs[index], int(theirs.jnt_dofadr[joint])
        T[dof : dof + count, at : at + count] = np.eye(count)
        if count == 6:
            R = pin.Quaternion(q[q_slice(model, index)][3:]).toRotationMatrix()
            T[dof : dof + 3, at : at + 3] = R
            rate[dof : dof + 3, at : at + 3] = R @ pin.skew(v[at + 3 : at + 6])
    data.qvel[:] = T @ v
    return T, rate


def _evaluate(source: Compiled, data: Any) -> FloatArray:
    """Let MuJoCo compute its forces, without contacts, and return its mass matrix."""
    model, mujoco = source.model, source.mujoco
    flags = model.opt.disableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    model.opt.disableflags = flags
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M
