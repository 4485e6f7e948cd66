"""Forces of the tree of a chain with given multipliers, by Pinocchio's recursion with every wrench put on by hand."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from exo_pin.chain.dynamics.nonsmooth.joint_friction import friction_of
from exo_pin.chain.kinematics.kernels.closure_kernels import fill_units, new_scratch


@dataclass
class TreeForces:
    """Generalised forces, shape (nv,), and wrenches about the world's origin, world axes, of joints and closures.

    A joint's wrench is from its parent on its child, a closure's from the body of frame b on that of frame a.
    """

    tau: np.ndarray
    joints: dict
    closures: dict
    frames: dict

    def joint_wrench(self, name, at="origin", frame="world"):
        return self._expressed(self.joints[name], name, at, frame)

    def closure_wrench(self, name, at="origin", frame="world"):
        return self._expressed(self.closures[name], name, at, frame)

    def _expressed(self, wrench, name, at, frame):
        R, p = self.frames[name]
        force, point = wrench[:3], p if isinstance(at, str) else np.asarray(at)
        pair = force, wrench[3:] - np.cross(point, force)
        return np.concatenate([R.T @ part for part in pair] if frame == "local" else pair)


def tree_forces(chain, q, v=None, a=None, multipliers=None, external=None):
    """τ = M a + h - passive - Jᵀλ - external, and the wrench that every joint and closure transmits."""
    model, state, q = chain.model, chain._state, np.asarray(q, dtype=float)
    data, names = model.createData(), list(model.names)
    v, a = (np.zeros(model.nv) if rate is None else np.asarray(rate, dtype=float) for rate in (v, a))
    given = np.zeros(chain.row_count) if multipliers is None else np.asarray(multipliers, dtype=float)
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    chain.residual(q)
    unit, pushes = np.empty((chain.row_count, 6)), [pin.Force.Zero() for _ in names]
    fill_units(state.buffers.poses, state.topology.loops, new_scratch(), unit)
    frames = {name: (data.oMi[k].rotation.copy(), data.oMi[k].translation.copy()) for k, name in enumerate(names)}

    def push(joint, wrench):
        pushes[joint] += data.oMi[joint].actInv(pin.Force(wrench))

    closures = {}
    for c, closure in enumerate(chain.closures):
        if closure.polynomial is None:
            closures[closure.name] = wrench = unit[chain.rows(closure.name)].T @ given[chain.rows(closure.name)]
            carriers = [int(joint) for joint in state.topology.joints[c]]
            for joint, sign in zip(carriers, (1.0, -1.0), strict=True):
                push(joint, sign * wrench)
            one, other = (data.oMi[joint] * state.topology.frame(c, end) for end, joint in enumerate(carriers))
            frames[closure.name] = one.rotation, other.translation
    for name, wrench in (external or {}).items():
        frame, force = model.getFrameId(name), np.asarray(wrench[:3], dtype=float)
        moment = wrench[3:] + np.cross(data.oMf[frame].translation, force)
        push(model.frames[frame].parentJoint, np.append(force, moment))
    forces = pin.StdVec_Force()
    forces.extend(pushes)
    tau = np.array(pin.rnea(model, data, q, v, a, forces)) - friction_of(state, v, a).force - state.passive.force(q, v)
    couplings = [chain.rows(closure.name) for closure in chain.closures if closure.polynomial is not None]
    for rows in couplings:
        tau -= chain.constraint_jacobian(q)[rows].T @ given[rows]
    joints = {name: data.oMi[k].act(data.f[k]).vector for k, name in enumerate(names)}
    return TreeForces(tau, joints, closures, frames)
