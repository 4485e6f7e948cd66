"""Equilibrium of arm and limbs in one pose: the equations of motion of the closed chain, solved limb by limb.

The tree hangs from the arm (see :mod:`exo_pin.wrist_chain.wrist_urdf`): every limb is a branch, closed onto the
torso at A_i. Write λ_i for what the torso puts on limb i at its closure. Of the chain's equations of motion
(:mod:`exo_pin.chain.dynamics.equations_of_motion`), the rows of a limb's own joints say

    J_iᵀ λ_i = τ_i + e_slide f_i          τ_i of the open tree; the actuator's effort is -f_i, tension pulls

and, for a UPU limb, five such rows leave one freedom of the six, the couple in the universal joint at B_i. That
couple defines g_i, also where the limb has mass: it is g_i |B_i| about b_i/|b_i| × X_i, on the arm, (D-18). So λ_i is
affine in f_i and g_i, and what is left is the arm's moment balance for f and its force balance for F_s.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..chain import ClosedChain
from ..chain.dynamics.equations_of_motion import EquationsOfMotion, equations_of_motion
from ..core.progress import track
from ..core.validation import FloatArray
from ..design import Arm, Limb, Mechanism
from ..load_case.pose_stacks import Query
from ..wrist.forces.affine_state import AffineState
from ..wrist.kernels import limb_vectors
from .joint_angles import NeutralLimbs, joint_angles, side_couples
from .wrist_urdf import mechanism_urdf

__all__ = ["EquilibriumModel"]


def _without_spin(limb: Limb) -> Limb:
    """An SPS limb may spin about its own line at any rate, so its inertia about that line is left out."""
    if limb.kind != "SPS" or limb.mass == 0.0:
        return limb
    base, platform = limb.base_body, limb.platform_body
    return replace(
        limb,
        base_body=base and replace(base, axial_inertia=0.0),
        platform_body=platform and replace(platform, axial_inertia=0.0),
    )


class _LimbPose(NamedTuple):
    """The limbs of one pose, base frame, filled by :func:`limb_vectors` and :func:`joint_angles`.

    Attributes
    ----------
    b, s, X : ndarray
        Vectors from O to B_i, directions and axes of the limbs, shape (n, 3).
    length, reach : ndarray
        Shape (n,), m.
    angles : ndarray
        Shape (n, 5), angles of the limbs' joints, rad, and the slide, m.
    """

    b: FloatArray
    s: FloatArray
    X: FloatArray
    length: FloatArray
    reach: FloatArray
    angles: FloatArray

    @classmethod
    def empty(cls, n: int) -> _LimbPose:
        """Memory for n limbs."""
        return cls(np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n), np.empty(n), np.empty((n, 5)))


class EquilibriumModel:
    """A mechanism's closed chain, ready for equilibrium pose by pose.

    May be used from several threads at once: each thread has its own memory for the limbs of its pose.

    Parameters
    ----------
    mechanism : Mechanism
        With an arm. An arm without inertia is given none, so only poses at rest may then be asked.

    Attributes
    ----------
    chain : ClosedChain
        The chain with the ball joint.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        arm = mechanism.require_arm("weight")
        if arm.inertia is None:
            arm = Arm(arm.mass, arm.centre_of_mass, np.zeros((3, 3)))
        mechanism = mechanism.replace(arm=arm, limbs=tuple(_without_spin(limb) for limb in mechanism.limbs))
        self.chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="whole"))
        self._model = self.chain.model
        geometry = mechanism.geometry
        self._neutral = NeutralLimbs(geometry)
        self._base_axes = -geometry.base_points / np.linalg.norm(geometry.base_points, axis=-1, keepdims=True)
        self._radii = np.linalg.norm(geometry.platform_points, axis=-1)
        self._upu = np.flatnonzero(mechanism.is_upu)
        self._sps = np.flatnonzero(~mechanism.is_upu)
        self._massless = mechanism.limbs_are_massless
        names = ("platform_y", "platform_x", "slide", "base_x", "base_y")
        joints = [
            [self._model.getJointId(f"limb_{i + 1}_{name}") for name in names[: 5 if limb.kind == "UPU" else 3]]
            for i, limb in enumerate(mechanism.limbs)
        ]
        self._first_joint = [ids[0] for ids in joints]
        self._q_index = [[self._model.joints[j].idx_q for j in ids] for ids in joints]
        v_index = [[self._model.joints[j].idx_v for j in ids] for ids in joints]
        self._upu_columns = np.array([v_index[i] for i in self._upu], dtype=int).reshape(-1, 5)
        closures = [self.chain.rows(role.closure) for role in self.chain.roles.limbs]
        rigid = [np.arange(own.start, own.stop) for own in closures if own.stop - own.start == 6]
        self._upu_rows = np.array(rigid, dtype=int).reshape(-1, 6)
        self._slides = np.array([columns[2] for columns in v_index])
        self._local = threading.local()

    def __reduce__(self) -> tuple[type[EquilibriumModel], tuple[Mechanism]]:
        return type(self), (self.mechanism,)

    @property
    def _pose(self) -> _LimbPose:
        """This thread's limbs in the pose that :meth:`configuration` was called with last."""
        pose = getattr(self._local, "pose", None)
        if pose is None:
            pose = self._local.pose = _LimbPose.empty(self.mechanism.limb_count)
        return pose

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

        Notes
        -----
        Source: thesis (D-4), (D-11), (D-12).
        """
        geometry, neutral, pose = self.mechanism.geometry, self._neutral, self._pose
        limb_vectors(
            R,
            geometry.base_points,
            geometry.platform_points,
            pose.b,
            pose.s,
            pose.X,
            pose.length,
            pose.reach,
        )
        joint_angles(
            R,
            geometry.platform_points,
            self._base_axes,
            pose.s,
            pose.X,
            pose.length,
            pose.reach,
            neutral.axes,
            neutral.directions,
            neutral.lengths,
            neutral.base_axes,
            neutral.matrix,
            pose.angles,
        )
        q = np.empty(self._model.nq)
        q[:4] = quaternion
        for index, angles in zip(self._q_index, pose.angles, strict=True):
            q[index] = angles[: len(index)]
        return self.chain.close(q)

    def states(self, query: Query, quaternions: FloatArray, rows: list[int], progress: bool = False) -> AffineState:
        """Equilibrium of a stack of N poses.

        Parameters
        ----------
        query : Query
            Poses, motion and load.
        quaternions : ndarray
            Shape (N, 4), the same poses, xyzw.
        rows : list of int
            Poses that have an answer; the rows of the others are zero.
        progress : bool
            Whether to show a progress bar.

        Raises
        ------
        LoopNotClosed
            If the loops of a pose do not close to 1e-12.

        Notes
        -----
        Source: thesis (D-1), (D-2), (D-19), (D-20), (D-26).
        """
        count, n = len(query.matrices), self.mechanism.limb_count
        closure, of_f, of_g, share = (np.zeros((count, n, 6)) for _ in range(4))
        wrench = np.zeros((count, 6))
        for k in track(rows, "reaction", progress):
            R = query.matrices[k]
            q = self.configuration(R, quaternions[k])
            v, a = self._motion(R, q, query.velocity[k], query.acceleration[k])
            # Closed by construction, and massless limbs need no motion of their own: nothing to refuse.
            balance = equations_of_motion(self.chain.state, q, v, a, check_closed=False)
            if not self._massless:
                share[k] = balance.tree[self._first_joint]
            if self._upu.size:
                self._close_upu(balance, share[k], closure[k], of_f[k], of_g[k])
            if self._sps.size:
                self._close_sps(balance.tau, share[k], closure[k], of_f[k])
            wrench[k, :3], wrench[k, 3:] = balance.tree[1, :3] - query.force[k], balance.tree[1, 3:] - query.moment[k]
        # Side wrenches are forces through O: what the solves leave as moment is rounding.
        of_g[:, :, 3:] = 0.0
        return AffineState.of_closures(closure, of_f, of_g, share, wrench)

    def _motion(
        self, R: FloatArray, q: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations of all joints; massless limbs need none of theirs."""
        v, a = np.zeros(self._model.nv), np.zeros(self._model.nv)
        v[:3], a[:3] = R.T @ velocity, R.T @ acceleration
        if self._massless or not (velocity.any() or acceleration.any()):
            return v, a
        return self.chain.dependent_motion(q, ["root_joint"], v[:3], a[:3])

    def _close_upu(
        self,
        balance: EquationsOfMotion,
        share: FloatArray,
        closure: FloatArray,
        of_f: FloatArray,
        of_g: FloatArray,
    ) -> None:
        """Fill the rows of the UPU limbs: five joint rows and the couple at B_i for six components of λ_i.

        Source: thesis (D-14), (D-15), (D-17), (D-18).
        """
        limbs, columns, own = self._upu, self._upu_columns, self._upu_rows
        X, radius = self._pose.X[limbs], self._radii[limbs]
        couple = np.empty((limbs.size, 6))
        side_couples(self._pose.b[limbs], X, couple)
        # In the multipliers of the limb's rigid closure; ``unit`` makes wrenches about O of them.
        unit = balance.unit[own]
        rows = np.empty((limbs.size, 6, 6))
        rows[:, :5] = balance.jacobian[own[:, None, :], columns[:, :, None]]
        rows[:, 5] = (unit @ couple[:, :, None])[:, :, 0]
        target = np.zeros((limbs.size, 6, 3))
        target[:, :5, 0] = balance.tau[columns]
        target[:, 5, 0] = (couple * share[limbs]).sum(axis=1)
        target[:, 2, 1] = 1.0
        target[:, 5, 2] = radius
        solved = unit.transpose(0, 2, 1) @ np.linalg.solve(rows, target)
        closure[limbs], of_f[limbs], of_g[limbs] = solved[:, :, 0], solved[:, :, 1], solved[:, :, 2]

    def _close_sps(self, tau: FloatArray, share: FloatArray, closure: FloatArray, of_f: FloatArray) -> None:
        """Fill the rows of the SPS limbs: a pure force through A_i, also where the limb points at O.

        Along the limb the slide's row gives it, across the limb the moment balance of the limb about B_i.

        Source: thesis (D-6), (D-14), (D-15).
        """
        limbs = self._sps
        s, length, b = self._pose.s[limbs], self._pose.length[limbs, None], self._pose.b[limbs]
        base = self.mechanism.geometry.base_points[limbs]
        about_B = share[limbs, 3:] - np.cross(b, share[limbs, :3])
        across = np.cross(s, about_B) / np.where(length > 0.0, length, 1.0)
        along = -(tau[self._slides[limbs]])[:, None] * s
        force = along + across
        closure[limbs] = np.concatenate([force, np.cross(base, force)], axis=1)
        of_f[limbs] = np.concatenate([-s, np.cross(base, -s)], axis=1)
