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
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..chain import ClosedChain
from ..core.compiled import kernel
from ..core.errors.checked import checked
from ..core.progress import track
from ..core.validation import FloatArray, require_type
from ..design import Arm, Mechanism
from ..load_case.pose_stacks import Query
from ..numerics.vectors import cross, vector
from ..wrist.forces.affine_state import AffineState
from ..wrist.limbs import Limbs, classify, joint_angles
from .wrist_urdf import across, mechanism_urdf

#: Joints of a limb from the arm on. An SPS limb has the first three.
_NAMES = ("platform_y", "platform_x", "slide", "base_x", "base_y")
#: Their places among what :func:`exo_pin.wrist.limbs.joint_angles` fills.
_PLACES = np.array([0, 1, 4, 2, 3])


#: Largest distance, m, and turn, rad, by which a loop may be open.
_CLOSED = 1e-12


def _neutral(mechanism: Mechanism, base: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Turns of X and joint angles of the neutral pose, as :class:`EquilibriumModel` holds them."""
    R, platform = mechanism.geometry.neutral.as_matrix(), mechanism.geometry.platform_points
    limbs = classify(mechanism, R[None])
    X = limbs.X[0] @ R
    for i in np.flatnonzero(limbs.reach[0] == 0.0):
        X[i] = across(platform[i])
    about_b = np.stack([-np.cross(platform / np.linalg.norm(platform, axis=1)[:, None], X), X], axis=1)
    X = X @ R.T
    about_a = np.stack([np.cross(base / np.linalg.norm(base, axis=1)[:, None], X), X], axis=1)
    angles = np.empty((1, mechanism.limb_count, 5))
    joint_angles(R[None], base, limbs, about_a, about_b, angles)
    return about_a, about_b, angles.reshape(-1)


@kernel(stack=True)
def upu_closures(
    rows: Any, limbs: Any, columns: Any, radius: Any, massless: bool, J: Any, tau: Any, share: Any, closure: Any,
    of_f: Any, of_g: Any,
) -> None:  # fmt: skip
    """Fill the closure wrenches of the UPU limbs: five joint rows and the couple at B_i for six components of λ_i.

    Of a wrench (F, M) about O the couple at B along n = b/|b| × X is n·M - |b| X·F, and the joint platform_x, about the
    axis X through B, has the column (b × X, X) in the tree's Jacobian.

    Source: thesis (D-13), (D-14), (D-15), (D-17), (D-18).

    Parameters
    ----------
    rows : ndarray of int
        Poses to fill.
    limbs, columns, radius : ndarray
        Indices of the UPU limbs, shape (m,), the columns of their joints, shape (m, 5), and |B_i|, shape (n,), m.
    massless : bool
        Whether no limb has mass.
    J, tau : ndarray
        The tree's Jacobian and the joint efforts of the open tree, shapes (N, 6, nv) and (N, nv).
    share : ndarray
        Wrenches that move and carry the limbs, shape (N, n, 6).
    closure, of_f, of_g : ndarray
        λ_i at f = g = 0 and its change, shape (N, n, 6), written.
    """
    system, target = np.empty((6, 6)), np.empty((6, 3))
    for r in range(rows.shape[0]):
        k = rows[r]
        for m in range(limbs.shape[0]):
            i = limbs[m]
            for j in range(5):
                for e in range(6):
                    system[j, e] = J[k, e, columns[m, j]]
            for e in range(3):
                system[5, e] = -radius[i] * system[1, 3 + e]
                system[5, 3 + e] = system[1, e] / radius[i]
            target[:] = 0.0
            if not massless:
                for j in range(5):
                    target[j, 0] = tau[k, columns[m, j]]
                for e in range(6):
                    target[5, 0] += system[5, e] * share[k, i, e]
            target[2, 1] = 1.0
            target[5, 2] = radius[i]
            solved = np.linalg.solve(system, target)
            for e in range(6):
                closure[k, i, e], of_f[k, i, e] = solved[e, 0], solved[e, 1]
                # Side wrenches are forces through O: what the solution has as moment is rounding.
                of_g[k, i, e] = solved[e, 2] if e < 3 else 0.0


@kernel(stack=True)
def sps_closures(
    s: Any, limbs: Any, slides: Any, base: Any, length: Any, b: Any, tau: Any, share: Any, closure: Any, of_f: Any
) -> None:
    """Fill the SPS limbs: a pure force through A_i, also where the limb points at O.

    Along the limb the slide's row gives it, across the limb the moment balance of the limb about B_i.

    Source: thesis (D-6), (D-14), (D-15).

    Parameters
    ----------
    s : ndarray
        Directions of the limbs, shape (N, n, 3).
    limbs, slides : ndarray
        Indices of the SPS limbs, shape (m,), and the columns of the slides of all limbs, shape (n,).
    base : ndarray
        A_i, shape (n, 3), m.
    length, b : ndarray
        Lengths of the limbs and OB_i, shapes (N, n) and (N, n, 3).
    tau : ndarray
        Joint efforts of the open tree, shape (N, nv).
    share : ndarray
        Wrenches that move and carry the limbs, shape (N, n, 6).
    closure, of_f : ndarray
        λ_i at f = 0 and its change, shape (N, n, 6), written.
    """
    for k in range(s.shape[0]):
        for i in limbs:
            s_i, a_i, force_i = vector(s[k], i), vector(base, i), vector(share[k], i)
            turning = cross(vector(b[k], i), force_i)
            about_B = (share[k, i, 3] - turning[0], share[k, i, 4] - turning[1], share[k, i, 5] - turning[2])
            across = cross(s_i, about_B)
            reach = length[k, i] if length[k, i] > 0.0 else 1.0
            along = tau[k, slides[i]]
            force = (
                across[0] / reach - along * s_i[0],
                across[1] / reach - along * s_i[1],
                across[2] / reach - along * s_i[2],
            )
            moment, arm = cross(a_i, force), cross(a_i, s_i)
            for e in range(3):
                closure[k, i, e], closure[k, i, 3 + e] = force[e], moment[e]
                of_f[k, i, e], of_f[k, i, 3 + e] = -s_i[e], -arm[e]


@checked
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
        self._massless = mechanism.limbs_are_massless
        self.radius = mechanism.geometry.platform_radius
        self._local = threading.local()
        self._find_limbs(mechanism)

    def _find_limbs(self, mechanism: Mechanism) -> None:
        """Find the joints and ends of the n limbs in the model."""
        model, geometry, closures = self.model, mechanism.geometry, self._closures.closures
        #: Indices of the UPU and of the other limbs.
        self._upu, self._sps = np.flatnonzero(mechanism.is_upu), np.flatnonzero(~mechanism.is_upu)
        ids = [
            [model.getJointId(f"limb_{i + 1}_{name}") for name in _NAMES[: 5 if upu else 3]]
            for i, upu in enumerate(mechanism.is_upu)
        ]
        columns = [[model.idx_vs[joint] for joint in own] for own in ids]
        #: The joint of each limb at the arm; places of all joints in q, and among the 5 n angles and slides.
        self._first = [own[0] for own in ids]
        self._q_index = np.concatenate([[model.idx_qs[joint] for joint in own] for own in ids])
        self._angles = np.concatenate([5 * i + _PLACES[: len(own)] for i, own in enumerate(ids)])
        #: Columns in v of the joints of the UPU limbs, shape (u, 5), and of all slides, shape (n,).
        self._upu_columns = np.array([columns[i] for i in self._upu], dtype=int).reshape(-1, 5)
        self._slides = np.array([own[2] for own in columns])
        #: Frames of the limbs' ends on the torso; where they belong, shape (n, 4, 4); what the closures hold of it.
        self._ends = [model.getFrameId(closure.frame_a) for closure in closures]
        places = [closure.placement_b for closure in closures]
        self._targets = np.array(
            [pin.SE3(pin.Quaternion(np.array(p.quaternion)), np.array(p.translation)).homogeneous for p in places]
        )
        held = np.ones_like(self._targets, dtype=bool)
        held[self._sps, :, :3] = False
        self._held = held.nonzero()
        #: A_i, shape (n, 3), which can be written, as the kernels are compiled for, and |B_i|, shape (n,), m.
        self._base_points = np.array(geometry.base_points)
        self._radii = np.linalg.norm(geometry.platform_points, axis=1)
        #: Shape (n, 2, 3): sine and cosine per unit of X of its turn about -a_i, base frame, and about -b_i, arm frame;
        #: angles, rad, and slides, m, in the neutral pose, where those of the joints are zero, shape (5 n,).
        self._about_a, self._about_b, self._neutral = _neutral(mechanism, self._base_points)

    def __reduce__(self) -> tuple[type[EquilibriumModel], tuple[Mechanism]]:
        return type(self), (self.mechanism,)

    @cached_property
    def chain(self) -> ClosedChain:
        """The same tree as a closed chain."""
        return ClosedChain(self.model, self._closures)

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
        angles = np.empty((*limbs.length.shape, 5))
        joint_angles(matrices, self._base_points, limbs, self._about_a, self._about_b, angles)
        q = np.empty((len(matrices), self.model.nq))
        q[:, :4] = quaternions
        flat = angles.reshape(len(matrices), len(self._neutral))
        q[:, self._q_index] = (flat - self._neutral)[:, self._angles]
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
                share[k] = [data.oMi[j].act(data.f[j]).vector for j in self._first]
        wrench[:, :3] -= query.force
        wrench[:, 3:] -= query.moment
        if self._upu.size:
            own = (self._upu, self._upu_columns, self._radii, self._massless)
            upu_closures(rows, *own, J, tau, share, closure, of_f, of_g)
        if self._sps.size:
            sides = (self._base_points, limbs.length, limbs.b, tau, share, closure, of_f)
            sps_closures(limbs.s, self._sps, self._slides, *sides)
        return AffineState.of_closures(closure, of_f, of_g, share, wrench)

    def _motion(
        self, to_arm: FloatArray, q: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations of all joints; massless limbs need none of theirs."""
        v, a = np.zeros((2, self.model.nv))
        v[:3], a[:3] = to_arm @ velocity, to_arm @ acceleration
        return (v, a) if self._massless else self.chain.dependent_motion(q, ["root_joint"], v[:3], a[:3])


def equilibrium_model(mechanism: Mechanism) -> EquilibriumModel:
    """Made once for designs that are asked again; mechanisms are compared by identity.

    Raises
    ------
    InvalidInput
        If it is no mechanism.
    """
    require_type("device", mechanism, Mechanism)
    return _made_once(mechanism)


_made_once = lru_cache(maxsize=4)(EquilibriumModel)
