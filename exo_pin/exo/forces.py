"""Forces on shoulder, limbs, arm and torso: in poses, movements and maps, beside other designs, and how sure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Unpack

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.validation import require_type
from ..load_case import Case, CentreOffset, CentrePath, Load, Motion, Movement
from ..load_case.case import Posture, warn_outside_human_range
from ..load_case.recordings.reading import movement_cautions
from ..reaction import (
    Assumptions,
    ConstraintBounds,
    Limits,
    MovementReaction,
    Reaction,
    ReactionMap,
    Split,
    movement_reaction,
    solve,
)
from ..reaction import reaction_map as map_of_reactions
from ..reaction.assumptions import Within, spelled_out
from ..reaction.batch.reaction_maps import CHUNK
from ..reaction.holding.remedy import Remedy
from ..reaction.holding.remedy import remedy as remedy_of
from ..uncertainty.force_uncertainty import ForceUncertainty, force_uncertainty

if TYPE_CHECKING:
    from ..design import Arm, Wearer
    from ..reaction.assumptions import Question
    from ..study import StudyTable
    from .shoulder_exo import ShoulderExo


@spelled_out
def reaction(
    self: ShoulderExo,
    poses: Rotation | Movement,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str | Split = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    progress: bool = False,
    posture: Posture = None,
    **within: Unpack[Within],
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
        geometry to which all of it gives way (:mod:`exo_pin.reaction.elastic`); the pose is held, and
        actuator forces adapt. "elastic_locked": the same with the lengths of the limbs, or the coordinates of a
        device's drives and brakes, locked, so that the arm moves and turns.
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
        :mod:`exo_pin.wrist.forces.side_forces` says.
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
    posture : mapping or array_like, optional
        Of a device with joints that move while the arm rests: their values by name, rad or m, or with the unit in the
        name (``{"elbow_deg": 30}``), each a number or one a pose; or configurations of its chain. If left out, idle
        joints move as little as they can along the straight turn from rest, and undriven ones settle.
        :func:`exo_pin.reaction.posture_range` has the range over all of them.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    Reaction

    Raises
    ------
    MissingData
        If the design has no arm, ``motion`` is given and the arm's inertia is not known, or ``split``
        is "elastic" and nothing has a stiffness.
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
    case = Case(poses, motion, load, centre_offset, posture=posture)
    warn_outside_human_range(case.query.matrices, self.device.side)
    return solve(self, case, Assumptions(split, constraint_bounds=constraint_bounds, **within), progress=progress)


def remedy(
    self: ShoulderExo,
    poses: Rotation,
    load: Load | None = None,
    split: str | Split = "spherical",
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    limits: Limits = "design",
    posture: Posture = None,
    progress: bool = False,
) -> Remedy:
    """What would make a single pose possible: a pose nearby that can be held, or the moment that is missing.

    Parameters
    ----------
    poses : Rotation
        Single, at rest.
    load, split, centre_offset, limits, posture
        As in :meth:`reaction`; a posture by the names of joints, which poses nearby take, too.
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
    case = Case(poses, None, load, centre_offset, posture=posture)
    return remedy_of(self, case, Assumptions(split, limits), progress)


@spelled_out
def follow(
    self: ShoulderExo,
    movement: Movement,
    load: Load | None = None,
    static: bool = False,
    split: str | Split = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    progress: bool = False,
    posture: Posture = None,
    **within: Unpack[Within],
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
    split, constraint_bounds, centre_offset, posture, limits, cone, weights, progress
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
    doubts = movement_cautions(movement, self.side)
    case = Case(movement.poses, motion, load, centre_offset, None, doubts, posture)
    assumed = Assumptions(split, constraint_bounds=constraint_bounds, **within)
    return movement_reaction(self, movement, case, assumed, progress)


@spelled_out
def reaction_map(
    self: ShoulderExo,
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
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    posture: Posture = None,
    **within: Unpack[Within],
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
        "elastic" and nothing has a stiffness.
    InvalidInput
        If an argument does not fit; NonConvexBound and InfeasibleBounds are its children.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> answer = exo.reaction_map(exo.pose(flexion=np.arange(0.0, 91.0, 0.1)))
    >>> int(answer.held.sum()), round(float(answer.magnitude.max()), 1)  # poses of 910, N
    (910, 73.5)
    """
    return map_of_reactions(
        self,
        Case(poses, motion, load, centre_offset, posture=posture),
        Assumptions(split, constraint_bounds=constraint_bounds, **within),
        threads=threads,
        chunk=chunk,
        keep=keep,
        progress=progress,
    )


def compare(
    self: ShoulderExo,
    *others: ShoulderExo | Rotation,
    poses: Rotation | None = None,
    person: Arm | Wearer | None = None,
    joint: bool = False,
    detailed: bool = False,
    progress: bool = False,
    **question: Unpack[Question],
) -> StudyTable:
    """This design beside others, of any kind, on one arm and over the same poses.

    Parameters
    ----------
    *others : ShoulderExo
        The other designs.
    poses : Rotation
        Any stack, such as :func:`exo_pin.adl_box`; by name or after the designs.
    person : Arm or Wearer, optional
        Who wears all of them; who wears this design if left out (or the first of the others that names a person).
    joint : bool
        Whether the force in the joint with the wearer's own muscles leads, over the held of at most 100 poses.
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
        One row a design; see :func:`exo_pin.study.compare`.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> table = exo.compare(ep.load("prototype"), poses=exo.pose([30, 60, 90], 15))
    >>> table["can_hold"].tolist()  # three muscles on the prototype hold none of these poses
    [1.0, 0.0]
    """
    from ..study import compare

    return compare(
        self, *others, poses=poses, person=person, joint=joint, detailed=detailed, progress=progress, **question
    )


@spelled_out
def uncertainty(
    self: ShoulderExo,
    poses: Rotation | Movement,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str | Split = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    uncertainties: Mapping[str, float] | None = None,
    posture: Posture = None,
    **within: Unpack[Within],
) -> ForceUncertainty:
    """How much |F_s| changes with what is uncertain, largest first, and at the worst offset of the device.

    Parameters
    ----------
    poses : Rotation or Movement
        A pose; of a stack or a movement the peak of the poses that can be held is asked.
    motion, load, split, constraint_bounds, centre_offset, posture, limits, cone, weights
        As in :meth:`reaction`.
    uncertainties : mapping, optional
        By name of the quantity, with the unit in the name, to both sides: ``{"offset_mm": 20, "A[1]_mm": 5}``;
        zero takes it as certain. Names are those of :mod:`exo_pin.uncertainty.quantities` and dimensions of the
        design (``"cuff_height_mm"``, ``"r_A_mm"``, ...). What is not stated is taken from
        :data:`exo_pin.uncertainty.quantities.ASSUMED_UNCERTAINTY`.

    Returns
    -------
    ForceUncertainty

    Raises
    ------
    UnknownName
        If an uncertainty is stated for a name that is no quantity of the question.
    InvalidInput
        If it is no number of zero or more, or another argument does not fit.
    SolverFailed
        If no pose has an answer.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> sure = exo.uncertainty(exo.pose(60, 30), uncertainties={"offset_mm": 10})
    >>> round(float(sure.worst_offset.magnitude), 1)  # N, the device 10 mm off in the worst direction
    84.8
    """
    case = Case(poses, motion, load, centre_offset, posture=posture)
    assumed = Assumptions(split, constraint_bounds=constraint_bounds, **within)
    return force_uncertainty(self, case, assumed, uncertainties)
