"""The result of a reaction query, with its checks, its texts and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray, ReadOnly
from ..wrist.singularities.measures import singularity
from .columns import ShownReaction
from .holding.actuator_limits import ForceLimits
from .holding.hold_check import HoldCheck, hold_check
from .holding.verdict import verdict
from .indeterminacy.certificate import Certificate
from .indeterminacy.component_assumptions import ComponentSource
from .indeterminacy.infeasibility import Infeasibility
from .table import reaction_html, reaction_table

__all__ = ["Optimum", "Reaction"]


@dataclass(frozen=True, eq=False)
class Optimum(ReadOnly):
    """Optimality of the chosen forces, for a pose or a stack of shape (...).

    Attributes
    ----------
    kkt : ndarray
        Shape (...): largest violation of the optimality conditions, relative to the largest force of the problem;
        0 where there was nothing to choose, NaN without an answer.
    gap : ndarray
        Shape (...), N: duality gap, the most by which the minimised quantity (|F_s| for "minimal" without weights) can
        exceed its least value.
    unique : ndarray of bool
        Shape (...): whether f and g are the only optimal ones. F_s always is for "minimal": its cost is strictly
        convex in it. True is sure, False may be cautious where limits coincide.
    """

    kkt: FloatArray
    gap: FloatArray
    unique: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Reaction(ShownReaction, ReadOnly):
    """Forces between arm, limbs, shoulder and torso in a pose or a stack of poses of shape (...).

    Forces are in N, moments in N m about O, both in the base frame. Rows without an answer are NaN, and ``status``
    gives the reason. The arrays are read-only. ``Rotation.apply`` of SciPy does not take such arrays: give it a copy,
    or multiply by ``as_matrix()``.

    Attributes
    ----------
    shoulder_force : ndarray
        F_s, shape (..., 3): the force of the shoulder **on the arm**.
    actuator_forces : ndarray
        f_i, shape (..., n), tension positive.
    constraint_forces : ndarray
        g_i, shape (..., n): the couple in the universal joint at B_i is g_i |B_i|, (D-18), and for a massless
        limb the limb pulls the arm with -f_i s_i - g_i X_i. These are passive reactions, no actuator sets them.
        Zero for an SPS limb.
    limb_wrenches : ndarray
        Shape (..., n, 6): force and moment of each limb on the arm.
    cuff_wrench : ndarray
        Shape (..., 6): wrench of the cuff on the person's arm: all limbs together, less the weight and inertia of the
        device's own moving part.
    harness_wrenches : ndarray
        Shape (..., n, 6): force and moment of each limb on the torso.
    spherical_force : ndarray
        Shape (..., 3): F_s with limbs that carry no side force, the F_s0 of (D-34).
    split : str
        How the forces that equilibrium does not determine were chosen.
    equilibrium_status : ndarray of str
        Shape (...): status of the equilibrium, whether the actuators can supply it or not: "ok", "near_singular"
        (an answer, with limb forces far above the load), "singular", "folded", "not_solved", "infeasible" (the limits
        that the query was given leave no forces, see ``infeasibility``), "out_of_stroke" (an actuator that the query
        was given cannot take the length of its limb), "no_equilibrium" (the elastic device has none near the pose, see
        ``load_share``) or "guide_overloaded" (see ``guide_load``); all but the first two have no answer.
    margin : ndarray
        Shape (...): dimensionless distance from the singular surface (see :class:`exo_pin.wrist.limbs.Limbs`).
    determinant : ndarray
        det[X_1 X_2 X_3], shape (...), NaN for other than three limbs. Where its sign changes along a path the
        path crosses the singular surface.
    residual : ndarray
        Shape (...): error of the force and moment balance of the arm, relative to the largest force (moments over
        the largest |B_i|), evaluated from the wrenches above; NaN without an answer.
    source : ComponentSource
        From which :attr:`certificate` is computed on demand.
    body_weight : float or None
        Weight of the person under standard gravity, N, where the mass is known.
    trivial : bool
        Whether the least shoulder force is zero by construction, in every pose that has an answer: side forces and
        tensions without bounds can produce every shoulder force, so that the limbs alone can always carry the arm.
        A least force of zero is then no property of the device.
    centre_displacement : ndarray or None
        δ, shape (..., 3), m: displacement of the shoulder's centre, for split "elastic". Moments about O are then
        about the displaced centre of the arm's joint.
    side_stiffness : ndarray or None
        k_i, shape (..., n), N/m, for split "elastic"; zero for bare muscles and SPS limbs.
    optimum : Optimum or None
        Optimality conditions, duality gap and uniqueness of the chosen forces.
    infeasibility : Infeasibility or None
        Evidence for the poses that cannot be held; None if there are none.
    arm_orientation : ndarray or None
        Shape (..., 3, 3), for split "elastic": orientation of the arm. It differs from the pose only with locked
        actuators.
    interface_displacements : ndarray or None
        Shape (..., 2, 6), for split "elastic": displacement and rotation vector of the base ring against the torso
        (base frame) and of the platform against the arm (arm frame {O_B}), m and rad.
    limb_lengths : ndarray or None
        l_i of the displaced device, shape (..., n), m, for split "elastic".
    guide_twist : ndarray or None
        φ_i, shape (..., n), rad, for split "elastic": twist that the universal joints would give a straight guide.
    guide_bending : ndarray or None
        Shape (..., n), for split "elastic": deflection of a guide from the line A_i B_i, over its length. The law of
        the guides neglects its square; see :mod:`exo_pin.wrist.forces.bent_guides`.
    guide_load : ndarray or None
        Shape (..., n), for split "elastic": utilisation of the guide, the larger of bending moment and torque, each
        over its limit, as far as the limits are known; NaN where neither is, or where there is no equilibrium.
    load_share : ndarray or None
        Shape (...), for split "elastic": the share of load and centre offset up to which an equilibrium was
        followed from the unloaded, aligned device; 1 for an answer.
    """

    shoulder_force: FloatArray
    actuator_forces: FloatArray
    constraint_forces: FloatArray
    limb_wrenches: FloatArray
    cuff_wrench: FloatArray
    harness_wrenches: FloatArray
    spherical_force: FloatArray
    split: str
    equilibrium_status: NDArray[np.str_]
    margin: FloatArray
    determinant: FloatArray
    residual: FloatArray
    source: ComponentSource
    body_weight: float | None = None
    trivial: bool = False
    centre_displacement: FloatArray | None = None
    side_stiffness: FloatArray | None = None
    optimum: Optimum | None = None
    infeasibility: Infeasibility | None = None
    arm_orientation: FloatArray | None = None
    interface_displacements: FloatArray | None = None
    limb_lengths: FloatArray | None = None
    guide_twist: FloatArray | None = None
    guide_bending: FloatArray | None = None
    guide_load: FloatArray | None = None
    load_share: FloatArray | None = None

    @cached_property
    def certificate(self) -> Certificate:
        """Which of these forces equilibrium determines."""
        return Certificate.of(self.source)

    @property
    def ratio(self) -> FloatArray:
        """Γ = |F_s| / |F_s0| of (D-34), shape (...).

        Both vanish together at some poses: the ratio is NaN there, so never average it over a workspace.

        Source: thesis (D-34).
        """
        size, reference = self.magnitude, np.linalg.norm(self.spherical_force, axis=-1)
        nothing = 1e-12 * np.maximum(size, np.abs(self.limb_wrenches[..., :3]).max(axis=(-1, -2)))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(reference > nothing, size / reference, np.where(size > nothing, np.inf, np.nan))
        return np.asarray(np.where(np.isnan(size), np.nan, ratio))

    @cached_property
    def limits(self) -> HoldCheck:
        """Lengths and tensions compared with the limits of the design's actuators."""
        poses, answered = self.source.poses, self.has_answer.reshape(-1)
        tensions = self.actuator_forces.reshape(len(answered), poses.mechanism.limb_count)
        free = self.source.split.free_stress(poses)
        check = hold_check(poses.mechanism, poses.lengths, tensions, free, answered, poses.limits)
        return check.reshaped(self.has_answer.shape)

    @property
    def has_better_tensions(self) -> bool:
        """Whether in some pose the actuators cannot give the tensions of the answer, but others that hold it too.

        A limb whose actuator is not known has no limits.
        """
        return bool((self.limits.tensions != self.actuator_forces)[self._held].any())

    def bounds_where_held(self, rows: NDArray[np.bool_] | bool = True) -> str | tuple[FloatArray, FloatArray]:
        """Limits of the actuators in the poses that they hold, infinite in all others: ``actuator_bounds`` of a query.

        Only in ``rows``, shape (...), if they are given. "design" if they hold all poses and all limits are known, else
        arrays of shape (..., n), N.
        """
        poses, held = self.source.poses, (self._held & rows)[..., None]
        if held.all() and all(limb.actuator is not None for limb in poses.mechanism.limbs):
            return "design"
        own = ForceLimits.of_design(poses.mechanism, poses.lengths)
        lower, upper = (limit.reshape(self.actuator_forces.shape) for limit in own)
        return np.where(held, lower, -np.inf), np.where(held, upper, np.inf)

    @property
    def _held(self) -> NDArray[np.bool_]:
        return self.has_answer & ~self.limits.violated

    @property
    def can_hold(self) -> NDArray[np.bool_]:
        """Shape (...): true only where every limit of the actuators is known, none is estimated, and all are met."""
        return self.limits.can_hold

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Shape (...): whether :attr:`can_hold` depends on a limit that is missing or estimated."""
        return self.limits.unknown

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """Shape (...): as ``equilibrium_status``, or "beyond_limits" where the design's actuators cannot hold the pose.

        The forces of "beyond_limits" are those of equilibrium, which the actuators would have to supply. "ok" means
        that no known limit is broken.
        """
        status = np.where(self.limits.violated, "beyond_limits", self.equilibrium_status)
        status.setflags(write=False)
        return status

    @cached_property
    def verdict(self) -> str:
        """Whether the device can hold the pose, or how many poses of a stack, in one sentence."""
        axis = None
        if self.equilibrium_status.ndim == 0 and self.equilibrium_status == "singular":
            poses = self.source.poses
            orientation = Rotation.from_matrix(poses.matrices[0])
            axis = singularity(poses.mechanism.geometry, orientation, poses.mechanism.is_upu).lost_direction
        return verdict(self.limits, self.equilibrium_status, axis)

    @property
    def magnitude(self) -> FloatArray:
        """|F_s|, shape (...), N."""
        return np.asarray(np.linalg.norm(self.shoulder_force, axis=-1))

    @property
    def harness_wrench(self) -> FloatArray:
        """All limbs together on the torso, shape (..., 6): force in N and moment about O in N m, base frame."""
        return np.asarray(self.harness_wrenches.sum(axis=-2))

    @property
    def percent_body_weight(self) -> FloatArray | None:
        """|F_s| in percent of the person's weight, shape (...); None where the weight is not known."""
        return None if self.body_weight is None else 100.0 * self.magnitude / self.body_weight

    @property
    def has_answer(self) -> NDArray[np.bool_]:
        """Shape (...): whether the pose has an answer."""
        return np.isin(self.equilibrium_status, ("ok", "near_singular"))

    def is_balanced(self, tolerance: float = 1e-9) -> bool:
        """Whether every pose that has an answer balances to ``tolerance`` of the largest force."""
        return bool((self.residual[self.has_answer] <= tolerance).all())

    def crossings(self) -> NDArray[np.int64]:
        """Where a path crosses the singular surface.

        Returns
        -------
        ndarray of int
            Shape (k, d) for a stack of d dimensions, the last of which runs along the path: index of the last pose
            before det X takes the other sign. Poses on the surface itself belong to neither side: a path that steps
            onto it and goes on crosses once, one that touches it and turns back does not. Empty for other than three
            limbs, whose surface has no such sign.

        Notes
        -----
        A path to a pose beyond the surface passes a pose in which the limbs cannot hold the arm.
        """
        # Poses that the limbs are too weak for lie on one side of the surface, too.
        side = np.where(self.equilibrium_status == "singular", 0.0, np.sign(np.nan_to_num(self.determinant)))
        if side.ndim == 0:
            return np.empty((0, 0), dtype=np.int64)
        found = []
        for path in np.ndindex(side.shape[:-1]):
            steps = np.flatnonzero(side[path])
            signs = side[path][steps]
            found += [(*path, int(steps[k])) for k in np.flatnonzero(signs[1:] != signs[:-1])]
        return np.array(found, dtype=np.int64).reshape(len(found), side.ndim)

    def __str__(self) -> str:
        return reaction_table([self])

    def _repr_html_(self) -> str:
        """The table for notebooks."""
        return reaction_html([self])
