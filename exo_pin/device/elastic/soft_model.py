"""A device on a cuff and a harness that give way: the tree with a spring of six freedoms under each.

The part of the device that is fixed to the arm hangs on the arm by a free flight with the cuff's spring, and what is
fixed to the torso on the torso by one with the harness's. The pose of the arm is held: with drives of q, the springs'
displacements and the drives' efforts follow from equilibrium,

    Nᵀ (b(q) - springs(q) - B f) = 0        for all motions N that the loops allow, those of the arm among them.

The steps take the springs' stiffness for the change of the left side and leave out that of geometry under load, which
is smaller by the ratio of the forces over their lever arms to the stiffness; they end where the residual does.
Rotations of the springs count by their rotation vector.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...chain.kinematics.closing import nearest_closed
from ...chain.structure.chain_state import ChainState
from ...chain.structure.motion_axes import q_slice, v_slice
from ...chain.variants import COPIED
from ...core.errors import InvalidInput, SolverFailed
from ...core.validation import FloatArray
from ...design import Interface
from ...load_case.pose_stacks import Query
from ..chain_device import ChainDevice
from ..device_model import DeviceModel, device_model
from ..pose_forces import NONE, PoseForces

#: Names of the springs' joints.
CUFF, HARNESS = "cuff_spring", "harness_spring"
#: Most steps, and the residual of equilibrium, over the largest force, at which they end.
_STEPS, _BALANCED = 60, 1e-11
_CLOSED = 1e-12


def soft_device(device: ChainDevice) -> ChainDevice:
    """The device with a joint for each interface that gives way.

    Raises
    ------
    InvalidInput
        If neither cuff nor harness has a stiffness.
    """
    own = {CUFF: device.interfaces.cuff, HARNESS: device.interfaces.harness}
    springs = {name: spring for name, spring in own.items() if spring is not None}
    if not springs:
        raise InvalidInput(
            'split="elastic" needs what gives way: interfaces=ep.Interfaces(cuff=..., harness=...) of the device'
        )
    chain = device.chain
    model, description = _with_springs(chain._state, device.arm_index, springs)
    return device.replace(chain=type(chain)(model, description))


def _with_springs(given: ChainState, arm: int, springs: dict[str, Interface]) -> tuple[pin.Model, Any]:
    """Tree and description with a free flight under what hangs on the arm, and under what stands on the torso."""
    old, new = given.model, pin.Model()
    new.name, new.gravity = old.name, old.gravity
    index = {0: 0}
    under = {0: 0, arm: 0}

    def flight(name: str, parent: int) -> int:
        added = new.addJoint(parent, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
        new.inertias[added] = pin.Inertia.Zero()
        new.addFrame(pin.Frame(name, added, 0, pin.SE3.Identity(), pin.FrameType.BODY), False)
        return added

    for joint in range(1, old.njoints):
        parent = old.parents[joint]
        carrier = index[parent]
        for name, body in ((HARNESS, 0), (CUFF, arm)):
            if name in springs and parent == body and joint != arm:
                under[body] = under[body] or flight(name, index[body])
                carrier = under[body]
        index[joint] = new.addJoint(carrier, old.joints[joint], old.jointPlacements[joint], old.names[joint])
        new.inertias[index[joint]] = old.inertias[joint]
    for name, body in ((HARNESS, 0), (CUFF, arm)):
        if name in springs and not under[body]:
            under[body] = flight(name, index[body])
    for frame in list(old.frames)[1:]:
        moved = pin.Frame(frame)
        moved.parentJoint = index[frame.parentJoint]
        moved.parentFrame = 0
        new.addFrame(moved, False)
    for joint in range(1, old.njoints):
        for names, part in (COPIED[0], q_slice), (COPIED[1], v_slice):
            for name in names:
                getattr(new, name)[part(new, index[joint])] = getattr(old, name)[part(old, joint)]
    ends = {body: name for name, body in ((HARNESS, 0), (CUFF, arm)) if name in springs}
    closures = []
    for closure in given.closures:
        changes: dict[str, Any] = {}
        for end in ("a", "b") if closure.polynomial is None else ():
            name = getattr(closure, f"frame_{end}")
            frame = old.frames[given.frame_index(name)]
            if frame.parentJoint in ends:
                place = frame.placement * _placed(getattr(closure, f"placement_{end}"))
                quaternion = pin.Quaternion(place.rotation).normalized().coeffs().tolist()
                kind = type(getattr(closure, f"placement_{end}"))
                changes[f"frame_{end}"] = ends[frame.parentJoint]
                changes[f"placement_{end}"] = kind(tuple(place.translation.tolist()), tuple(quaternion))
        closures.append(replace(closure, **changes))
    return new, replace(given.description, closures=tuple(closures), shapes=())


def _placed(placement: Any) -> pin.SE3:
    quaternion, translation = placement.quaternion, placement.translation
    return pin.SE3(pin.Quaternion(np.array(quaternion)).matrix(), np.array(translation))


class SoftModel:
    """The trees of a device on springs, ready for equilibrium.

    Parameters
    ----------
    device : ChainDevice
        The device, with interfaces.
    base, cuff : tuple of float
        Shifts of torso side and arm side, as of :class:`.DeviceModel`.
    """

    def __init__(self, device: ChainDevice, base: tuple[float, float, float], cuff: tuple[float, float, float]) -> None:
        self.device, self.rigid = device, device_model(device)
        soft = soft_device(device)
        self.model = DeviceModel(soft, base, cuff)
        own = {CUFF: device.interfaces.cuff, HARNESS: device.interfaces.harness}
        held, free = self.model.held.model, self.model.free.model
        self.springs = [
            (held.getJointId(name), v_slice(held, held.getJointId(name)), v_slice(free, free.getJointId(name)), spring)
            for name, spring in own.items()
            if spring is not None
        ]

    def start(self, q: FloatArray, quaternion: FloatArray) -> FloatArray:
        """A closed configuration near the one of the rigid device, shape (nq,)."""
        state, out = self.model.held, self.model.held.neutral()
        for name in list(self.rigid.held.model.names)[1:]:
            out[state.configuration_slice(name)] = q[self.rigid.held.configuration_slice(name)]
        out[self.model.arm_q] = quaternion
        held = state.velocity_indices([str(state.model.names[self.model.arm])])
        return nearest_closed(state, out, held, _CLOSED, 60)[0]

    def displacement(self, q: FloatArray, joint: int, spring: Interface) -> tuple[FloatArray, FloatArray]:
        """Displacement and rotation vector at a spring's point, shape (6,), and the rotation, shape (3, 3)."""
        own = q[q_slice(self.model.held.model, joint)]
        turn = Rotation.from_quat(own[3:])
        at = np.array(spring.at)
        return np.concatenate([own[:3] + turn.apply(at) - at, turn.as_rotvec()]), turn.as_matrix()

    def load(self, q: FloatArray) -> FloatArray:
        """Generalised forces of the springs on the free tree, shape (nv,)."""
        out = np.zeros(self.model.free.nv)
        for joint, _, own, spring in self.springs:
            moved, R = self.displacement(q, joint, spring)
            wrench = -np.array(spring.stiffness) @ moved
            about = wrench[3:] + np.cross(R @ np.array(spring.at), wrench[:3])
            out[own] = np.concatenate([R.T @ wrench[:3], R.T @ about])
        return out

    def stiffness(self) -> FloatArray:
        """Change of minus these forces with the springs' coordinates, near rest, shape (nv, nv) of the free tree."""
        out = np.zeros((self.model.free.nv, self.model.free.nv))
        for _, _, own, spring in self.springs:
            x, y, z = np.array(spring.at)
            lever = np.eye(6)
            lever[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
            out[own, own] = lever.T @ np.array(spring.stiffness) @ lever
        return out

    def pose(self, q: FloatArray, query: Query, k: int) -> PoseForces:
        """Equations of motion with the springs' forces among the loads."""
        pose = PoseForces.of(self.model, q, query, k)
        pose.tau = pose.tau - self.load(q)
        return pose

    def solve(self, q: FloatArray, query: Query, k: int) -> tuple[PoseForces, FloatArray]:
        """Equilibrium of a pose at rest or in motion, from a closed configuration.

        Raises
        ------
        SolverFailed, LoopNotClosed
            If the steps do not end in one.
        """
        model, state = self.model, self.model.held
        held = state.velocity_indices([str(state.model.names[model.arm])])
        K, rest = self.stiffness(), model.rest
        worst = np.inf
        for _ in range(_STEPS):
            pose = self.pose(q, query, k)
            N = pose.motions()
            # Motions of the arm first, then those that leave it where it is.
            turning = N[np.searchsorted(rest, model.angular)]
            vt = np.linalg.svd(turning)[2]
            idle = N @ vt[int((np.linalg.svd(turning, compute_uv=False) > NONE).sum()) :].T
            B, tau = pose.B[rest], pose.tau[rest]
            if not self.device.holds_alone:
                wearer = np.zeros((len(rest), 3))
                wearer[np.searchsorted(rest, model.angular)] = pose.R.T
                B = np.column_stack([B, wearer])
            A = np.column_stack([N.T @ B, -N.T @ K[np.ix_(rest, rest)] @ idle])
            step = np.linalg.lstsq(A, N.T @ tau, rcond=1e-12)[0]
            f, move = step[: B.shape[1]], step[B.shape[1] :]
            size = max(float(np.abs(tau).max()), float(np.abs(B * f).max(initial=0.0)), 1e-9)
            worst = float(np.abs(K[np.ix_(rest, rest)] @ (idle @ move)).max(initial=0.0)) / size
            if worst < _BALANCED:
                return pose, q
            change = np.zeros(state.nv)
            whole = np.zeros(model.free.nv)
            whole[rest] = idle @ move
            change[model.v_from] = whole[model.v_of]
            scale = float(np.abs(change / state.topology.column).max())
            q = pin.integrate(state.model, q, change * min(1.0, 0.2 / max(scale, 1e-300)))
            q, _ = nearest_closed(state, q, held, _CLOSED, 20)
        raise SolverFailed("equilibrium on springs", worst, "displacements of cuff and harness")


__all__ = ["CUFF", "HARNESS", "soft_device"]
