"""Equilibrium of arm and limbs through Pinocchio: the equations of motion of the closed chain, solved limb by limb.

The tree hangs from the arm (see :mod:`exo_pin.wrist_chain.wrist_urdf`): every limb is a branch, closed onto the
torso at A_i. Write λ_i for the wrench about O that the torso puts on limb i at its closure. With the columns J_i of
the tree's Jacobian that belong to the limb's own joints, their equations of motion are

    J_iᵀ λ_i = τ_i + e_slide f_i          τ_i of the open tree; the actuator's effort is -f_i, tension pulls

and, for a UPU limb, five such rows leave one freedom of the six, the couple in the universal joint at B_i. That
couple defines g_i, also where the limb has mass: it is g_i |B_i| about b_i/|b_i| × X_i, on the arm, (D-18). So λ_i is
affine in f_i and g_i, and what is left is the arm's moment balance for f and its force balance for F_s.

The joint angles that close the loops are known in closed form. The plane O A_i B_i, across X_i, holds b_i, s_i and a_i:
two of the angles are those between them. The other two are turns of X_i about b_i and about a_i.
"""

from __future__ import annotations

import threading
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..chain import ClosedChain
from ..core.progress import track
from ..core.validation import FloatArray, require_type
from ..design import Arm, Mechanism
from ..load_case.pose_stacks import Query
from ..wrist.forces.affine_state import AffineState
from ..wrist.limbs import Limbs, classify, joint_angles
from .closure_kernels import sps_closures, upu_closures
from .wrist_urdf import across, mechanism_urdf

#: Largest distance, m, and turn, rad, by which a loop may be open.
_CLOSED = 1e-12


class EquilibriumModel:
    """A mechanism's tree in Pinocchio, ready for equilibrium pose by pose. May be used from several threads at once.

    Parameters
    ----------
    mechanism : Mechanism
        With an arm. An arm without inertia is given none, so it must be at rest then.

    Attributes
    ----------
    arm, model : Arm, pinocchio.Model
        The mechanism's arm; the tree with the ball joint.
    upu, sps : ndarray of int
        Indices of the UPU and of the other limbs.
    radius : float
        Largest |B_i|, m.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.arm = arm = mechanism.require_arm("weight")
        if arm.inertia is None:
            arm = Arm(arm.mass, arm.centre_of_mass, np.zeros((3, 3)))
        mechanism = mechanism.replace(arm=arm, limbs=tuple(limb.without_spin() for limb in mechanism.limbs))
        text, self._closures = mechanism_urdf(mechanism, part="whole", visuals=False)
        self.model = model = pin.buildModelFromXML(text, pin.JointModelSpherical(), self._closures.root.name)
        model.gravity.linear = mechanism.gravity
        self.upu, self.sps = np.flatnonzero(mechanism.is_upu), np.flatnonzero(~mechanism.is_upu)
        self._massless = mechanism.limbs_are_massless
        self._index_joints()
        self._set_neutral()
        self._local = threading.local()

    def __reduce__(self) -> tuple[type[EquilibriumModel], tuple[Mechanism]]:
        return type(self), (self.mechanism,)

    @cached_property
    def chain(self) -> ClosedChain:
        """The same tree as a closed chain."""
        return ClosedChain(self.model, self._closures)

    def _index_joints(self) -> None:
        """Where the limbs' joints and ends stand in the model."""
        model, names = self.model, ("platform_y", "platform_x", "slide", "base_x", "base_y")
        ids = [
            [model.getJointId(f"limb_{i + 1}_{name}") for name in names[: 5 if i in self.upu else 3]]
            for i in range(self.mechanism.limb_count)
        ]
        self._first_joint = [own[0] for own in ids]
        self._q_index = np.concatenate([[model.idx_qs[j] for j in own] for own in ids])
        #: Which of the angles, shape (n, 5), these are.
        self._angles = np.concatenate([5 * i + np.array([0, 1, 4, 2, 3])[: len(own)] for i, own in enumerate(ids)])
        columns = [[model.idx_vs[j] for j in own] for own in ids]
        self._upu_columns = np.array([columns[i] for i in self.upu], dtype=int).reshape(-1, 5)
        self._slides = np.array([own[2] for own in columns])
        self._ends = [model.getFrameId(closure.frame_a) for closure in self._closures.closures]
        places = [closure.placement_b for closure in self._closures.closures]
        targets = [pin.SE3(pin.Quaternion(np.array(place.quaternion)), np.array(place.translation)) for place in places]
        self._targets = np.array([target.homogeneous for target in targets])
        held = np.ones_like(self._targets, dtype=bool)
        held[self.sps, :, :3] = False
        self._held = held.nonzero()

    def _set_neutral(self) -> None:
        """The limbs in the neutral pose, where all joint angles are zero."""
        geometry = self.mechanism.geometry
        R = geometry.neutral.as_matrix()
        limbs = classify(self.mechanism, R[None])
        size_a, size_b = (np.linalg.norm(p, axis=1) for p in (geometry.base_points, geometry.platform_points))
        self._base_points = np.array(geometry.base_points)  # writable, for which the kernel is compiled
        self._radii, self.radius = size_b, float(size_b.max())
        X = limbs.X[0] @ R
        for i in np.flatnonzero(limbs.reach[0] == 0.0):
            X[i] = across(geometry.platform_points[i])
        # Turns of X about -b in the axes of the arm, and about -a in those of the base: sine and cosine per unit of X.
        self._about_b = np.stack([-np.cross(geometry.platform_points / size_b[:, None], X), X], axis=1)
        X = X @ R.T
        self._about_a = np.stack([np.cross(geometry.base_points / size_a[:, None], X), X], axis=1)
        self._neutral: FloatArray = np.zeros(0)
        self._neutral = self._joint_angles(R[None], limbs)[0]

    def _joint_angles(self, matrices: FloatArray, limbs: Limbs) -> FloatArray:
        """Angles of platform_y, platform_x, base_x and base_y, rad, and slide, m, of all limbs, shape (N, 5 n)."""
        angles = np.empty((*limbs.length.shape, 5))
        joint_angles(matrices, self.mechanism.geometry.base_points, limbs, self._about_a, self._about_b, angles)
        flat = angles.reshape(len(matrices), 5 * angles.shape[1])
        return flat - self._neutral if self._neutral.size else flat

    def configuration(self, R: FloatArray, quaternion: FloatArray) -> FloatArray:
        """Joint vector with closed loops for a pose, shape (nq,).

        Parameters
        ----------
        R : ndarray
            Shape (3, 3), the pose.
        quaternion : ndarray
            Shape (4,), the same pose, xyzw.

        Raises
        ------
        LoopNotClosed
            If the loops do not close to 1e-12.
        """
        q = self._configurations(R[None], quaternion[None], classify(self.mechanism, R[None]))
        return self._linearised(q[0], self._data)

    def _configurations(self, matrices: FloatArray, quaternions: FloatArray, limbs: Limbs) -> FloatArray:
        """Joint vectors of N poses, shape (N, nq)."""
        q = np.empty((len(matrices), self.model.nq))
        q[:, :4] = quaternions
        q[:, self._q_index] = self._joint_angles(matrices, limbs)[:, self._angles]
        return q

    @property
    def _data(self) -> pin.Data:
        """This thread's memory."""
        data = getattr(self._local, "data", None)
        if data is None:
            data = self._local.data = self.model.createData()
        return data

    def _linearised(self, q: FloatArray, data: pin.Data) -> FloatArray:
        """Fill placements and Jacobian; returns q, with closed loops.

        Raises
        ------
        LoopNotClosed
            If the loops do not close to 1e-12.
        """
        pin.computeJointJacobians(self.model, data, q)
        ends = np.array([pin.updateFramePlacement(self.model, data, frame).homogeneous for frame in self._ends])
        if not np.abs(ends - self._targets)[self._held].max(initial=0.0) <= _CLOSED:
            q = self.chain.close(q)
            pin.computeJointJacobians(self.model, data, q)
        return q

    def states(self, query: Query, limbs: Limbs, rows: NDArray[np.intp], progress: bool = False) -> AffineState:
        """Equilibrium of a stack of N poses.

        Parameters
        ----------
        query : Query
            Poses, motion and load.
        limbs : Limbs
            Of these poses, from :func:`exo_pin.wrist.limbs.classify`.
        rows : ndarray of int
            Poses that have an answer; the rows of the others are zero.
        progress : bool
            Whether to show a progress bar.

        Raises
        ------
        LoopNotClosed
            If the loops of a pose do not close to 1e-12.

        Source: thesis (D-1), (D-2), (D-19), (D-20), (D-26).
        """
        model, data, count = self.model, self._data, len(query.matrices)
        q = self._configurations(query.matrices, query.quaternions, limbs)
        closure, of_f, of_g, share = np.zeros((4, *limbs.length.shape, 6))
        wrench, tau, J = np.zeros((count, 6)), np.zeros((count, model.nv)), np.zeros((count, 6, model.nv))
        v = a = np.zeros(model.nv)
        moves = query.velocity.any() or query.acceleration.any()
        for k in track(rows.tolist(), "reaction", True) if progress else rows.tolist():
            q_k = self._linearised(q[k], data)
            J[k] = data.J
            if moves:
                v, a = self._motion(query.matrices[k].T, q_k, query.velocity[k], query.acceleration[k])
            tau[k] = pin.rnea(model, data, q_k, v, a)
            wrench[k] = data.oMi[1].act(data.f[1]).vector
            if not self._massless:
                share[k] = [data.oMi[j].act(data.f[j]).vector for j in self._first_joint]
        wrench[:, :3] -= query.force
        wrench[:, 3:] -= query.moment
        if self.upu.size:
            columns, radii, light = self._upu_columns, self._radii, self._massless
            upu_closures(rows, self.upu, columns, radii, light, J, tau, share, closure, of_f, of_g)
        if self.sps.size:
            sides = (self._base_points, limbs.length, limbs.b, tau, share, closure, of_f)
            sps_closures(limbs.s, self.sps, self._slides, *sides)
        return AffineState.of_closures(closure, of_f, of_g, share, wrench)

    def _motion(
        self, to_arm: FloatArray, q: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations of all joints; massless limbs need none of theirs."""
        v, a = np.zeros((2, self.model.nv))
        v[:3], a[:3] = to_arm @ velocity, to_arm @ acceleration
        return (v, a) if self._massless else self.chain.dependent_motion(q, ["root_joint"], v[:3], a[:3])


@lru_cache(maxsize=4)
def equilibrium_model(mechanism: Mechanism) -> EquilibriumModel:
    """Made once for designs that are asked again; mechanisms are compared by identity.

    Raises
    ------
    InvalidInput
        If it is no mechanism.
    """
    require_type("device", mechanism, Mechanism)
    return EquilibriumModel(mechanism)
