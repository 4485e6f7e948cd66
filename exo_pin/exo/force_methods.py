"""Forces on shoulder, limbs, arm and torso in a pose or a stack of poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..design import Mechanism
from ..load_case import CentreOffset, CentrePath, Load, Motion, Movement
from ..load_case.case import Case, warn_outside_human_range
from ..reaction import Assumptions, ConstraintBounds, GlenoidCone, Limits, Reaction, Split, Weights, solve
from ..reaction.holding.remedy import Remedy, remedy
from ..wrist_chain.equilibrium import EquilibriumModel, equilibrium_model
from .subject import Subject

if TYPE_CHECKING:
    from .pose_report import PoseReport


class ForceQuestions(Subject):
    """Forces of a design, with limb masses through Pinocchio or, for maps, in closed form."""

    @property
    def device(self) -> Mechanism:
        """What is asked: the mechanism of a wrist, the :class:`exo_pin.device.ChainDevice` of any other device."""
        return self._mechanism

    @property
    def _equilibrium(self) -> EquilibriumModel:
        return equilibrium_model(self.mechanism)

    def _report(self, *parts: Any) -> PoseReport:
        """A report of :func:`.report_on_pose`."""
        from .pose_report import PoseReport

        return PoseReport(*parts)

    def reaction(
        self,
        poses: Rotation | Movement,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        limits: Limits = "design",
        cone: GlenoidCone | None = None,
        weights: Weights | None = None,
        progress: bool = False,
    ) -> Reaction:
        """Forces on shoulder, limbs, arm and torso.

        With a ball joint at O and UPU limbs the forces are statically indeterminate: equilibrium fixes the limb
        forces f_i (of three limbs), but how the rest is shared between the shoulder and the limbs' side forces g_i
        depends on stiffness and fit. ``split`` says what is assumed; the answer's certificate says what is sure.

        Parameters
        ----------
        poses : Rotation or Movement
            Pose of the arm, single or a stack of shape (...); or a movement, whose motion then counts
            (:meth:`follow` adds peaks and the noise of measured movements).
        motion : Motion, optional
            Angular velocity and acceleration; the arm is at rest if left out.
        load : Load, optional
            Force and couple on the arm, besides its weight.
        split : {"spherical", "minimal", "elastic", "elastic_locked", "standalone"} or Split
            "spherical": g = 0, limbs that carry no side force, as bare pneumatic muscles; (D-30).
            "minimal": the g within ``constraint_bounds`` that make |F_s| least: the best that a perfect structure
            could do, no prediction, since the g_i are passive reactions. Without bounds on three UPU limbs
            the least is zero wherever det X is not, and the answer says that it is trivial.
            "elastic": by stiffness of the limbs' guides, their joints, the shoulder and what sits on the person, at the
            geometry to which all of it gives way (:mod:`exo_pin.reaction.splits.elastic`); the pose is held, and
            actuator forces adapt. "elastic_locked": the same with the lengths of the limbs locked, so that the arm
            moves and turns.
            "standalone": F_s = 0, the wrist without a shoulder; (D-25).
            Or an instance of a class of your own (:class:`exo_pin.reaction.Split`).
            With more than three limbs, the tensions that equilibrium does not determine are those of least sum of
            squares; in "minimal" the tensions that balance themselves serve to lower |F_s| as well.
        constraint_bounds : None, "actuator", number or (lower, upper), optional
            Bounds on g_i, the force of a limb across its line, for "minimal": none, |g_i| <= |f_i|, |g_i| at most so
            many N, or N, broadcasting to (..., n).
            With a centre offset "actuator" means the |f_i| of limbs without side force, unless ``limits`` fix
            the sign of f.
        centre_offset : CentreOffset, CentrePath or array_like, optional
            Where the device's centre lies, seen from the anatomical one, m; an array of shape (..., 3) shifts base
            and cuff together, a path lets the anatomical centre move as the arm is lifted. Both effects count,
            lever arms and misfit, in the displaced geometry; limbs with mass move as
            :mod:`exo_pin.wrist.forces.limb_inertia` says.
        limits : "design", "none", "pull", number, (lower, upper), or actuators, optional
            Limits of the limbs, met in every pose in which that is possible. "design": what the design's own actuators
            can do at their lengths (:class:`exo_pin.Actuator`, :class:`exo_pin.Stroke`); a limb whose actuator is not
            known has no limits, and the verdict says so. "none": plain equilibrium. "pull" (f_i >= 0), a number
            (|f_i| at most so many N) and (lower, upper), N, broadcasting to (..., n), narrow the design's limits. One
            object with ``force_limits(length)`` for all limbs, or a sequence of one a limb
            (:class:`exo_pin.reaction.ForceLimited`), takes the place of the design's actuators. A pose that cannot be
            held keeps the forces of plain equilibrium, which would be needed; ``can_hold`` is false, ``status`` and
            ``verdict`` give the reason, and ``infeasibility`` what is missing.
        cone : GlenoidCone, optional
            Keep F_s in the socket, as a constraint or at a price. :meth:`exo_pin.Person.glenoid_cone` makes one that
            follows the scapula; give the compression by the person's own muscles with it.
        weights : Weights, optional
            For "minimal": other weights of shear, compression and tension than 1, 1 and 0.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        Reaction

        Raises
        ------
        MissingData
            If the design has no arm, ``motion`` is given and the arm's inertia is not known, or ``split``
            is "elastic" and the shoulder's stiffness is not known.
        InvalidInput
            If an argument does not fit; NonConvexBound and InfeasibleBounds are its children.

        Notes
        -----
        Source: thesis (D-30).

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> answer = exo.reaction(exo.pose(60, 30))
        >>> print(answer.verdict)
        The device can hold this pose.
        >>> print(f"{answer.magnitude:.1f} N on the shoulder, {answer.percent_body_weight:.1f} % of body weight")
        68.3 N on the shoulder, 8.2 % of body weight
        """
        case = Case(poses, motion, load, centre_offset)
        warn_outside_human_range(case.query.matrices, self.device.side)
        return solve(self, case, Assumptions(split, limits, constraint_bounds, cone, weights), progress=progress)

    def remedy(
        self,
        poses: Rotation,
        load: Load | None = None,
        split: str | Split = "spherical",
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        limits: Limits = "design",
        progress: bool = False,
    ) -> Remedy:
        """What would make a single pose possible: a pose nearby that can be held, or the moment that is missing.

        Parameters
        ----------
        poses : Rotation
            Single, at rest.
        load, split, centre_offset, limits
            As in :meth:`reaction`.
        progress : bool
            Whether to show a bar on standard error.

        Returns
        -------
        Remedy
            Prints as sentences.

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> lacking = str(exo.remedy(exo.pose(30, 30))).split(". ")
        >>> print(lacking[1] + ".")
        With the best forces within the limits, 0.32 N m about (-0.08, -0.79, 0.61) is missing.
        """
        return remedy(self, Case(poses, None, load, centre_offset), Assumptions(split, limits), progress)
