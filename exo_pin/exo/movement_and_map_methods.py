"""Forces along movements, maps of forces over many poses, the pressures that make them, and designs side by side."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.validation import require_type
from ..load_case import Case, CentreOffset, CentrePath, Load, Motion, Movement
from ..reaction import (
    Assumptions,
    ConstraintBounds,
    GlenoidCone,
    Limits,
    MovementReaction,
    PressurePlan,
    ReactionMap,
    Split,
    Weights,
    movement_reaction,
    plan_pressures,
    reaction_map,
)
from ..reaction.batch.reaction_maps import CHUNK
from .force_methods import ForceQuestions

if TYPE_CHECKING:
    from ..reaction.assumptions import Question
    from ..study import StudyTable
    from .shoulder_exo import ShoulderExo


class MovementAndMapQuestions(ForceQuestions):
    """Forces of a design along movements, over maps and beside other designs, and pressures."""

    def pressures(
        self,
        poses: Rotation,
        actuators: Any = None,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "minimal",
        constraint_bounds: ConstraintBounds = None,
        *,
        cone: GlenoidCone | None = None,
        weights: Weights | None = None,
    ) -> PressurePlan:
        """Which pressures hold a pose with least shoulder force, and how stiff it is then.

        A muscle's force at a length rises with its pressure, so the best forces within what the pressures can do are
        the best pressures: the query is solved in forces and turned into pressures.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).
        actuators : object or sequence of n objects, optional
            Pneumatic muscles, :class:`exo_pin.reaction.PressureActuator`; those of the design if left out.
        motion, load : Motion, Load, optional
            As in :meth:`reaction`. The stiffness is that of the arm at rest.
        split, constraint_bounds, cone, weights
            As in :meth:`reaction`.

        Returns
        -------
        PressurePlan

        Examples
        --------
        >>> from exo_pin.muscle import Muscle, muscle_model
        >>> exo = ep.load("prototype")
        >>> plan = exo.pressures(exo.pose(30, 30), [Muscle(model=muscle_model("best"), end_fitting=0.05)] * 3)
        >>> str(plan.reaction.status)  # muscles of 300 mm are too short there
        'out_of_stroke'
        """
        assumed = Assumptions(split, "none", constraint_bounds, cone, weights)
        return plan_pressures(self, Case(poses, motion, load), actuators, assumed)

    def follow(
        self,
        movement: Movement,
        load: Load | None = None,
        static: bool = False,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        limits: Limits = "design",
        cone: GlenoidCone | None = None,
        weights: Weights | None = None,
        progress: bool = False,
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
        split, constraint_bounds, centre_offset, limits, cone, weights, progress
            As in :meth:`reaction`.

        Returns
        -------
        MovementReaction
            Histories, and their peak, rms, impulse and fraction not holdable.

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> lift = ep.Movement.from_samples(np.linspace(0, 2, 21), exo.pose(np.linspace(0, 60, 21)), smoothing=None)
        >>> answer = exo.follow(lift, static=True)
        >>> print(f"peak {answer.peak:.1f} N at {answer.peak_time:.1f} s")
        peak 50.5 N at 0.4 s
        """
        require_type("movement", movement, Movement)
        motion = None if static else movement.motion
        case = Case(movement.poses, motion, load, centre_offset, pose_cautions=movement.pose_cautions)
        assumed = Assumptions(split, limits, constraint_bounds, cone, weights)
        return movement_reaction(self, movement, case, assumed, progress)

    def reaction_map(
        self,
        poses: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        threads: int = 1,
        chunk: int = CHUNK,
        keep: Iterable[str] | None = None,
        progress: bool = False,
        *,
        limits: Limits = "design",
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        cone: GlenoidCone | None = None,
        weights: Weights | None = None,
    ) -> ReactionMap:
        """What :meth:`reaction` answers, for millions of poses: closed form, compiled, massless limbs.

        Beside the answer itself, memory does not grow with the number of poses: they are worked off in blocks. Each
        pose is computed by itself, so neither ``threads`` nor ``chunk`` changes a bit of the answer.

        Questions without a closed form have the same answers, a hundred times slower and in one block: limbs with mass,
        a centre offset, a cone, weights, "elastic", a split of one's own, and motions that speed or power limit.

        Parameters
        ----------
        poses : Rotation
            Poses of the arm, a stack of shape (...).
        motion, load, split, constraint_bounds, centre_offset, cone, weights
            As in :meth:`reaction`. "minimal" is solved by an exact active-set method, without a solver
            (:mod:`exo_pin.numerics.bounded.box_program`).
        threads : int
            How many blocks to work on at once.
        chunk : int
            Poses in a block.
        keep : iterable of str, optional
            What to keep, of "shoulder_force", "actuator_forces", "constraint_forces", "status", "margin" and
            "magnitude"; all of it if left out. ``keep=("magnitude", "status")`` takes 9 bytes a pose.
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
            If an argument does not fit; NonConvexBound and InfeasibleBounds are its children.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> answer = exo.reaction_map(exo.pose(flexion=np.arange(0.0, 91.0, 0.1)))
        >>> int(answer.held.sum()), round(float(answer.magnitude.max()), 1)  # poses of 910, N
        (910, 73.5)
        """
        return reaction_map(
            self,
            Case(poses, motion, load, centre_offset),
            Assumptions(split, limits, constraint_bounds, cone, weights),
            threads=threads,
            chunk=chunk,
            keep=keep,
            progress=progress,
        )

    def compare(  # type: ignore[misc]
        self: ShoulderExo,
        *others: ShoulderExo | Rotation,
        poses: Rotation | None = None,
        detailed: bool = False,
        progress: bool = False,
        **question: Unpack[Question],
    ) -> StudyTable:
        """This design beside others, of any kind, over the same poses.

        Parameters
        ----------
        *others : ShoulderExo
            The other designs.
        poses : Rotation
            Any stack, such as :func:`exo_pin.adl_box`; by name or after the designs.
        detailed : bool
            Whether to ask which kind of device is good for what, some seconds a design; see
            :func:`exo_pin.study.compare`.
        progress : bool
            Whether to show a progress bar.
        **question
            Of :meth:`reaction`: ``motion``, ``load``, ``split``, ``limits``, ...

        Returns
        -------
        StudyTable
            One row a design; see :func:`exo_pin.study.evaluate` for the columns.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> table = exo.compare(ep.load("prototype"), poses=exo.pose([30, 60, 90], 15))
        >>> table["can_hold"].tolist()  # three muscles on the prototype hold none of these poses
        [1.0, 0.0]
        """
        from ..study import compare

        return compare(self, *others, poses=poses, detailed=detailed, progress=progress, **question)
