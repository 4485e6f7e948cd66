"""Forces along movements, maps of forces over many poses, and the pressures that make them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from scipy.spatial.transform import Rotation

from ..load_case import Load, Motion, Movement
from ..reaction import ConstraintBounds, Elasticity, Limits, PressurePlan, ReactionMap, plan_pressures, reaction_map
from ..reaction.along import MovementReaction, movement_reaction
from ..reaction.batch.reaction_maps import CHUNK
from .force_methods import ForceQuestions

__all__ = ["MovementAndMapQuestions"]


class MovementAndMapQuestions(ForceQuestions):
    """Forces of a design along movements and over maps, and pressures."""

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
            More of :meth:`reaction`: ``split``, ``limits``, ``cone``, ``progress``, ...

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
        *,
        limits: Limits = "design",
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
        limits : "design", "none", "pull", number, (lower, upper), or actuators, optional
            As in :meth:`reaction`, with the same answers.

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
            limits,
        )
