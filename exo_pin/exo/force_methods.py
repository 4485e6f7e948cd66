"""Forces on shoulder, limbs, arm and torso: of poses, movements and maps, and the pressures that make them."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..load_case import CentreOffset, CentrePath, Load, Motion, Movement
from ..load_case.human_range import warn_outside_human_range
from ..reaction import (
    ActuatorBounds,
    ConstraintBounds,
    ElasticDifference,
    Elasticity,
    GlenoidCone,
    PressurePlan,
    Reaction,
    ReactionMap,
    Split,
    Weights,
    elastic_difference,
    plan_pressures,
    reaction,
    reaction_map,
)
from ..reaction.along import MovementReaction, movement_reaction
from ..reaction.batch.reaction_maps import CHUNK
from ..reaction.holding.remedy import Remedy, remedy
from ..wrist_chain import EquilibriumModel
from .subject import Subject

__all__ = ["ForceQuestions"]


class ForceQuestions(Subject):
    """Forces of a design, with limb masses through Pinocchio or, for maps, in closed form."""

    @functools.cached_property
    def _equilibrium(self) -> EquilibriumModel:
        return EquilibriumModel(self.mechanism)

    def reaction(
        self,
        orientation: Rotation | Movement,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        actuator_bounds: ActuatorBounds = None,
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
        orientation : Rotation or Movement
            Pose of the arm, single or a stack of shape (...); or a movement, whose motion then counts
            (:meth:`follow` adds peaks and the noise of measured movements).
        motion : Motion, optional
            Angular velocity and acceleration; the arm is at rest if left out.
        load : Load, optional
            Force and couple on the arm, besides its weight.
        split : {"spherical", "minimal", "elastic", "elastic_linear", "elastic_locked", "standalone"} or Split
            "spherical": g = 0, limbs that carry no side force, as bare pneumatic muscles; (D-30).
            "minimal": the g within ``constraint_bounds`` that make |F_s| least: the best that a perfect structure
            could do, no prediction, since the g_i are passive reactions. Without bounds on three UPU limbs
            the least is zero wherever det X is not, and the answer says that it is trivial.
            "elastic": by stiffness of the limbs' guides, their joints, the shoulder and what sits on the person, at the
            geometry to which all of it gives way (:mod:`exo_pin.reaction.splits.elastic`); the pose is held, and
            actuator forces adapt. "elastic_locked": the same with the lengths of the limbs locked, so that the arm
            moves and turns.
            "elastic_linear": the limit of small displacements (:mod:`exo_pin.reaction.splits.elastic_linear`).
            "standalone": F_s = 0, the wrist without a shoulder; (D-25).
            Or an instance of a class of your own (:class:`exo_pin.reaction.Split`).
            With more than three limbs, the tensions that equilibrium does not determine are those of least sum of
            squares; in "minimal" the tensions that balance themselves serve to lower |F_s| as well.
        constraint_bounds : None, "actuator", number or (lower, upper), optional
            Bounds on g_i for "minimal": none, |g_i| <= |f_i|, |g_i| at most so many N, or N, broadcasting to (..., n).
            With a centre offset "actuator" means the |f_i| of limbs without side force, unless ``actuator_bounds`` fix
            the sign of f.
        centre_offset : CentreOffset, CentrePath or array_like, optional
            Where the device's centre lies, seen from the anatomical one, m; an array of shape (..., 3) shifts base
            and cuff together, a path lets the anatomical centre move as the arm is lifted. Both effects count,
            lever arms and misfit, in the displaced geometry; limbs with mass move as
            :mod:`exo_pin.wrist.forces.limb_inertia` says.
        actuator_bounds : None, "pull", "design", number, (lower, upper), or actuators, optional
            Limits of f_i: none; f_i >= 0; |f_i| at most so many N; what the design's own actuators can do at
            their lengths (:class:`exo_pin.Actuator`); N, broadcasting to (..., n); or one object with
            ``force_limits(length)`` for all limbs or a sequence of one a limb (see
            :class:`exo_pin.reaction.ForceLimited`). A pose that cannot be held within them has status "infeasible",
            and ``infeasibility`` says why.
        cone : GlenoidCone, optional
            Keep F_s in the socket, as a constraint or at a price. Give the person's own muscles with it.
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
        """
        if isinstance(orientation, Movement):
            if motion is not None:
                raise InvalidInput("expected a movement without motion: a movement has a motion of its own")
            orientation, motion = orientation.orientations, orientation.motion
        if isinstance(orientation, Rotation):
            warn_outside_human_range(orientation.as_matrix().reshape(-1, 3, 3), self.side)
        return reaction(
            self._equilibrium,
            orientation,
            motion,
            load,
            split,
            constraint_bounds,
            centre_offset,
            actuator_bounds=actuator_bounds,
            cone=cone,
            weights=weights,
            progress=progress,
        )

    def holding_reaction(
        self, orientation: Rotation, motion: Motion | None = None, load: Load | None = None, **options: Any
    ) -> Reaction:
        """Forces that the design's actuators can give, if they can hold every pose; else those of plain equilibrium.

        More than three limbs leave a choice of tensions. :meth:`reaction` takes the shortest, which may be pushes of
        cables; here they are within the limits of the actuators (``actuator_bounds="design"``) if that is possible.

        Parameters
        ----------
        orientation, motion, load
            As in :meth:`reaction`.
        **options
            More of :meth:`reaction`. With ``actuator_bounds`` among them it is the same as :meth:`reaction`.

        Returns
        -------
        Reaction
        """
        answer = self.reaction(orientation, motion, load, **options)
        if options.get("actuator_bounds") is not None or not answer.has_better_tensions:
            return answer
        return self.reaction(orientation, motion, load, **options | {"actuator_bounds": "design"})

    def remedy(self, orientation: Rotation, progress: bool = False, **options: Any) -> Remedy:
        """What would make a single pose possible: a pose nearby that can be held, or the moment that is missing.

        Parameters
        ----------
        orientation : Rotation
            Single.
        progress : bool
            Whether to show a bar on standard error.
        **options
            Of :meth:`reaction`: ``load``, ``centre_offset``, ``split``.

        Returns
        -------
        Remedy
            Prints as sentences.
        """
        return remedy(self._equilibrium, orientation, progress, **options)

    def elastic_difference(self, orientation: Rotation, **options: Any) -> ElasticDifference:
        """By how much the elastic formula for small displacements misses the equilibrium at the displaced geometry.

        Parameters
        ----------
        orientation : Rotation
            Pose, single or a stack of shape (...).
        **options
            Of :meth:`reaction`, without ``split``.

        Returns
        -------
        ElasticDifference
            Both answers, the difference of F_s and its relative size; prints as a sentence.
        """
        return elastic_difference(self._equilibrium, orientation, **options)

    def pressures(
        self,
        orientation: Rotation,
        actuators: Any,
        motion: Motion | None = None,
        load: Load | None = None,
        **options: Any,
    ) -> PressurePlan:
        """Which pressures hold a pose with least shoulder force, and how stiff it is then.

        A muscle's force at a length rises with its pressure, so the best forces within what the pressures can do are
        the best pressures: the query is solved in forces and turned into pressures.

        Parameters
        ----------
        orientation : Rotation
            Pose, single or a stack of shape (...).
        actuators : object or sequence of n objects
            Pneumatic muscles, :class:`exo_pin.reaction.PressureActuator`.
        motion, load : Motion, Load, optional
            As in :meth:`reaction`. The stiffness is that of the arm at rest.
        **options
            More of :meth:`reaction`: ``split`` ("minimal" if left out), ``constraint_bounds``, ``cone``, ``weights``.

        Returns
        -------
        PressurePlan
        """
        return plan_pressures(self._equilibrium, orientation, actuators, motion, load, **options)

    def follow(
        self, movement: Movement, load: Load | None = None, static: bool = False, **options: Any
    ) -> MovementReaction:
        """Forces along a movement.

        Parameters
        ----------
        movement : Movement
            From :meth:`Movement.from_samples` or :func:`exo_pin.read_movement`.
        load : Load, optional
            On the arm, constant or of stack shape (N,).
        static : bool
            Whether to leave out velocity and acceleration, as for a slow movement or an arm without inertia data.
        **options
            More of :meth:`reaction`: ``split``, ``actuator_bounds``, ``cone``, ``progress``, ...

        Returns
        -------
        MovementReaction
            Histories, and their peak, rms, impulse and fraction not holdable.
        """
        return movement_reaction(self._equilibrium, movement, load, static, **options)

    def reaction_map(
        self,
        orientations: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str = "spherical",
        constraint_bounds: ConstraintBounds = None,
        threads: int = 1,
        chunk: int = CHUNK,
        keep: Iterable[str] | None = None,
        elasticity: Elasticity | None = None,
        progress: bool = False,
    ) -> ReactionMap:
        """What :meth:`reaction` answers, for millions of poses: closed form, compiled, massless limbs.

        Beside the answer itself, memory does not grow with the number of poses: they are worked off in blocks. Each
        pose is computed by itself, so neither ``threads`` nor ``chunk`` changes a bit of the answer.

        Parameters
        ----------
        orientations : Rotation
            Poses of the arm, a stack of shape (...).
        motion, load, constraint_bounds
            As in :meth:`reaction`.
        split : {"spherical", "minimal", "standalone", "elastic_linear", "elastic"}
            As in :meth:`reaction`. "minimal" is solved by an exact active-set method, without a solver
            (:mod:`exo_pin.numerics.active_set`). "elastic_linear", also under the name "elastic": by stiffness, for
            small displacements, with the device's centre at the shoulder's and rigid interfaces;
            :meth:`elastic_difference` says how far that is from :meth:`reaction`; poses in which neither limbs nor
            shoulder are stiff in some direction are "not_solved".
        threads : int
            How many blocks to work on at once.
        chunk : int
            Poses in a block.
        keep : iterable of str, optional
            What to keep, of "shoulder_force", "actuator_forces", "constraint_forces", "status", "margin" and
            "magnitude"; all of it if left out. ``keep=("magnitude", "status")`` takes 9 bytes a pose.
        elasticity : Elasticity, optional
            Stiffness of guides and shoulder for "elastic", instead of the design's own.
        progress : bool
            Whether to show a bar on standard error.

        Returns
        -------
        ReactionMap

        Raises
        ------
        MissingData
            If the design has no arm, ``motion`` is given and the arm's inertia is not known, or ``split`` is
            "elastic" and the shoulder's stiffness is not known.
        InvalidInput
            If a limb has mass, or an argument does not fit; NonConvexBound and InfeasibleBounds are its children.
        """
        return reaction_map(
            self.mechanism,
            orientations,
            motion,
            load,
            split,
            constraint_bounds,
            threads,
            chunk,
            keep,
            elasticity,
            progress,
        )
