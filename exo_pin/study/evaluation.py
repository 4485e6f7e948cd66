"""Figures of designs over the same poses: one design, or several side by side on one wearer, payload and side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.progress import track
from ..core.tables import enumerated
from ..core.validation import FloatArray, as_rotation, require_method
from ..design import Arm, Wearer
from ..reaction.assumptions import Question
from ..reaction.columns import peak_of
from ..reaction.constraints.actuator_limits import closed_length_limits
from .detailed_figures import (
    detailed_figures,
    is_passive,
    joint_figures,
    joint_words,
    require_rest,
    why_blank,
    within_reach,
)
from .study_table import StudyTable

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__: list[str] = []


#: Mass of an arm beside that of its wearer's segments, kg, that is rounding of a design's file.
_ROUNDED = 0.02
#: An elbow that is less bent, degrees, is called straight.
_STRAIGHT = 0.05


def on_one_arm(designs: Sequence[ShoulderExo], person: Arm | Wearer | None) -> tuple[list[ShoulderExo], str]:
    """The designs on the arm of one person and on the side of the first, and a sentence that says whose arm it is.

    What a device itself moves stays its own.

    Parameters
    ----------
    designs : sequence of ShoulderExo
        At least one.
    person : Arm or Wearer, optional
        A left arm, or whose it is; that of the first design that has one if left out.

    Raises
    ------
    MissingData
        If nobody wears any design, and one moves nothing of its own either.
    """
    side = designs[0].side
    alike = [each if each.side == side else each.mirrored() for each in designs]
    turned = [each.name for each in designs if each.side != side]
    mirrored = f" {enumerated(turned)}: mirrored to the {side} shoulder." if turned else ""
    if person is not None:
        worn = [each.worn_by(person) for each in alike]
        return worn, f"All worn by {_words(_own(worn[0]))} (as asked).{mirrored}"
    owner, own = next(((k, own) for k, each in enumerate(alike) if (own := _own(each)) is not None), (0, None))
    if own is None:
        bare = [each.name for each in alike if each.arm is None]
        if bare:
            advice = "give a person who wears them all (--person 1.75,75,male, or person=)"
            raise MissingData(["arm of a person"], "a comparison", enumerated(bare), advice)
        return alike, (
            "Nobody wears these designs: each carries its own moving parts alone, without the arm of a person "
            f"(--person, or person=, puts one on all).{mirrored}"
        )
    left = own if side == "left" else own.mirrored()
    worn = [each if k == owner else each.worn_by(left) for k, each in enumerate(alike)]
    whose = "the first design's" if owner == 0 else f"that of {alike[owner].name}: no design before it has a person"
    return worn, f"All worn by {_words(own)} ({whose}).{mirrored}"


def _own(exo: ShoulderExo) -> Arm | None:
    """The person's part of what moves."""
    return None if exo.arm is None else exo.arm.person


def _words(arm: Arm | None) -> str:
    """Whose arm it is, what it carries and how it is bent."""
    assert arm is not None
    wearer = arm.wearer
    if wearer is None:
        return f"an arm of {arm.mass:.3g} kg of a person whose size is not known"
    kind = {"male": "man", "female": "woman"}[wearer.sex]
    bend = float(np.degrees(wearer.elbow_flexion))
    elbow = "elbow straight" if abs(bend) < _STRAIGHT else f"elbow bent by {bend:.3g}°"
    besides = arm.mass - Arm.of_wearer(wearer).mass
    payload = wearer.payload + (besides if besides > _ROUNDED else 0.0)
    return f"a {kind} of {wearer.height:.4g} m, {wearer.mass:.3g} kg, {elbow}, payload {payload:.3g} kg"


@checked
def evaluate(exo: ShoulderExo, poses: Rotation, **question: Unpack[Question]) -> dict[str, float]:
    """Figures of one design over poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design, with an arm.
    poses : Rotation
        Any stack.
    **question
        Of :meth:`ShoulderExo.reaction`: ``motion``, ``load``, ``split``, ``limits``, ``cone``, ...

    Returns
    -------
    dict
        ``peak_F_s_N``, ``p95_F_s_N``, ``median_F_s_N`` : |F_s| over the poses that can be held; NaN if none can. A
        passive device holds none alone: its |F_s| is that of all poses, with the moments that its wearer adds.
        If a design crosses det X = 0, its peak depends on how near to the crossing a pose of the grid lies.
        ``can_hold`` : fraction of poses that are known to be held.
        ``holdable`` : fraction of poses that are held as far as the limits are known.
        ``least_margin`` : smallest dimensionless distance from the singular surface.
        ``one_side`` : fraction of poses on the more frequent side of the singular surface; the rest is out of reach of
        them without passing through it. NaN but for three drives that hold the arm alone, such as three limbs.
        ``reach`` : fraction of poses in which every limb is within its stroke; NaN if a stroke, or what the end
        fittings add, is not known. Of a device that is not a wrist: in which its loops close, with drives and joints
        within what is known of their travel.

    Examples
    --------
    >>> from exo_pin.study import evaluate
    >>> exo = ep.load("four-cables")
    >>> round(evaluate(exo, exo.pose([0, 30, 60], 30))["peak_F_s_N"], 1)
    46.5
    """
    return _figures(exo, poses, question)[0]


def _figures(exo: ShoulderExo, poses: Rotation, question: Question) -> tuple[dict[str, float], FloatArray]:
    """The figures of :func:`evaluate`, and |F_s| in every pose, NaN where it is not held."""
    require_method("exo", exo, "reaction", "a ShoulderExo")
    poses = as_rotation("poses", poses)
    if poses.as_quat().size == 0:
        raise InvalidInput("expected at least one pose, got an empty stack")
    answer = exo.reaction_map(poses, **question)
    held, counted = answer.held, answer
    if is_passive(exo):
        counted = exo.reaction_map(poses, **(question | {"limits": "none"}))
    force = np.where(counted.held, np.asarray(counted.magnitude), np.nan)
    by_limbs = exo.device.accelerate("map") is not None
    known = force[counted.held] if counted.held.any() else np.array([np.nan])
    figures = {
        "peak_F_s_N": float(known.max()),
        "p95_F_s_N": float(np.percentile(known, 95.0)),
        "median_F_s_N": float(np.median(known)),
        "can_hold": float(answer.can_hold.mean()),
        "holdable": float(held.mean()),
        "least_margin": float(np.fmin.reduce(np.asarray(answer.margin).reshape(-1))),
        "one_side": _one_side(exo, poses),
        "reach": _reach(exo, poses) if by_limbs else float(within_reach(answer.status).mean()),
    }
    return figures, force


def _one_side(exo: ShoulderExo, poses: Rotation) -> float:
    if len(exo.device.drives) != 3 or not exo.device.holds_alone:
        return float("nan")
    determinant = np.asarray(exo.singularity(poses).determinant)
    known = determinant[np.isfinite(determinant)]
    return float(max((known > 0.0).mean(), (known < 0.0).mean())) if known.size else float("nan")


def _reach(exo: ShoulderExo, poses: Rotation) -> float:
    low, high = closed_length_limits(exo.mechanism)
    if np.isnan(low).any():
        return float("nan")
    lengths = exo.inverse_kinematics(poses).lengths
    return float(((low <= lengths) & (lengths <= high)).all(axis=-1).mean())


def compare(
    exo: ShoulderExo,
    *others: ShoulderExo | Rotation,
    poses: Rotation | None = None,
    person: Arm | Wearer | None = None,
    joint: bool = False,
    detailed: bool = False,
    progress: bool = False,
    **question: Unpack[Question],
) -> StudyTable:
    """Designs of any kind side by side, on one arm and one side; see :func:`evaluate` for the columns.

    All designs are worn by one person with one payload in the hand, and designs for the other side are mirrored. The
    heading of the table says who it is. What a device itself moves stays its own.

    ``common_peak_F_s_N`` is the largest |F_s| over the poses that all hold which hold any: the peak over all that a
    design holds counts harder poses of the one that holds more. A design that holds none changes no figure of another.
    A passive design, which holds none alone, counts with its wearer's moments, over the same poses. ``poses`` may also
    be the last of ``others``.

    Parameters
    ----------
    exo : ShoulderExo
        A design.
    *others : ShoulderExo
        The other designs.
    poses : Rotation
        Any stack; by name or after the designs.
    person : Arm or Wearer, optional
        Who wears all designs: a left arm, or whose it is. If left out, who wears the first design that names a
        person, the first of all if it does. If none does, every design carries its own moving parts alone.
    joint : bool
        Whether the force in the joint with the wearer's own muscles leads: the columns ``contact_N`` to ``relief`` of
        the notes, over the held of at most 100 poses, evenly spaced, at rest. Needs the extra ``person``.
    detailed : bool
        Whether to ask which kind of device is good for what: the columns of the notes besides, some seconds a design.
    progress : bool
        Whether to show a progress bar.
    **question
        Of :meth:`ShoulderExo.reaction`: ``motion``, ``load``, ``split``, ``limits``, ...

    Returns
    -------
    StudyTable
        One row a design: ``design``, ``rank`` (equal designs share one), ``common_peak_F_s_N``, the columns of
        :func:`evaluate`, and ``blank``: which of them have no number, and why.

    Raises
    ------
    InvalidInput
        If there is no other design, a detailed comparison has a ``centre_offset``, or ``joint`` comes with a motion or
        a load.
    MissingData
        If nobody wears any design, and one has no moving parts either.
    MissingExtra
        If a detailed comparison is of designs with a wearer and the extra ``person`` is not installed.

    Notes
    -----
    Columns of a detailed comparison:

    ``not_evaluated`` : fraction of poses that the data of a spring do not cover: of these it is not known whether they
    are held, and they are among no other fraction but the reached, clear and singular ones, which need no spring.
    ``clear``, ``held_and_clear`` : fractions of poses with the device's parts away from the wearer, and held too.
    ``singular`` : fraction of the reached poses that are singular, or whose :attr:`exo_pin.Reaction.margin` is below
    0.05, as in a workspace; ``median_margin`` : median of that margin. NaN of a device whose drives do not hold the arm
    about all axes in any pose.
    ``weakest_rate`` : rate of the drives' positions about the arm's worst axis that 99 % of the reached poses exceed,
    mm/°, of hinges °/° (:meth:`exo_pin.ShoulderExo.accuracy`); ``twins`` : fraction of poses with a twin.
    ``held_after_failure`` : fraction of poses held while one drive gives no effort, the one that matters most; NaN
    without limits.
    ``effort_N``, ``effort_Nm`` : largest effort of a drive in the held poses, of forces and of torques;
    ``effort_share`` : largest share of what the drive can give there; ``stroke_mm``, ``stroke_deg`` : largest range of
    a drive over the reached poses (over all if none is reached within its travel).
    ``mass_on_arm_kg``, ``mass_of_links_kg`` : of the device, fixed to the arm and moving otherwise.
    ``contact_N``, ``peak_contact_N`` : median and largest contact force in the joint with the wearer's own muscles over
    the held poses that the wearer can take; ``contact_without_N`` : median without device there; ``relief`` : median of
    what the device takes from it, pose by pose.
    ``left_to_wearer`` : of a passive device, the moments that the wearer makes over those of the arm's weight, median.
    ``undetermined`` : components of F_s that equilibrium leaves open.
    ``follows_10_mm`` : fraction of poses in which the device closes with its centre 10 mm off in each of 26 directions;
    ``change_by_10_mm_N`` : there, the largest change of F_s over the directions, median over the poses;
    ``change_on_cuff_N`` : the same on a soft cuff, its own or one as measured on 21 persons
    (:meth:`exo_pin.Interface.upper_arm_cuff`) where the device holds the arm; what has no stiffness is rigid. All three
    at rest, without load and limits, in at most six poses, evenly spaced over the list.

    Examples
    --------
    >>> cables, motors = ep.load("four-cables"), ep.load("four-linear-actuators")
    >>> table = ep.study.compare(cables, motors, poses=cables.pose([0, 45, 90]))
    >>> table["common_peak_F_s_N"].round(1)  # N, over the poses that both hold
    array([72.5, 50.7])
    >>> print(table.heading[0])
    All worn by a man of 1.75 m, 75 kg, elbow straight, payload 0 kg (the first design's).
    >>> table = ep.study.compare(cables, motors, poses=cables.pose([0, 45, 90]), detailed=True)
    >>> table["held_after_failure"]  # three actuators still hold these poses, three cables none of them
    array([0., 1.])
    """
    designs: list[Any] = [exo, *others]
    stack = as_rotation("poses", designs.pop() if poses is None else poses)
    if len(designs) < 2:
        raise InvalidInput("expected at least one other design to compare with")
    for design in designs:
        require_method("design", design, "reaction", "a ShoulderExo")
    if joint:
        require_rest(question)
    designs, whose = on_one_arm(designs, person)
    found = []
    for each in track(designs, "designs", progress):
        figures, force = _figures(each, stack, question)
        details = detailed_figures(each, stack, question) if detailed else {}
        leading = joint_figures(each, stack, question) if joint and not detailed else {}
        found.append((force, leading, figures | details))
    common, words = _common(designs, [force for force, *_ in found])
    rows: list[dict[str, Any]] = []
    for each, (force, leading, figures) in zip(designs, found, strict=True):
        # A passive design may lack a force in some of the poses: its peak over the others is no common figure.
        there = np.isfinite(force[common]).all()
        row = {**leading, "common_peak_F_s_N": peak_of(force[common]) if there else np.nan, **figures}
        rows.append({"design": each.name, "rank": 0, **row, "blank": why_blank(each, row, question)})
    for row, rank in zip(rows, StudyTable(rows).ranks, strict=True):
        row["rank"] = rank
    if joint and not detailed:
        words += f" {joint_words(stack)}"
    return StudyTable(rows, heading=(whose, words.lstrip()))


def _common(designs: Sequence[ShoulderExo], forces: Sequence[FloatArray]) -> tuple[NDArray[np.bool_], str]:
    """Poses that all designs hold which hold any, and a sentence about them; of passive designs those with a force."""
    active = [k for k, each in enumerate(designs) if not is_passive(each)]
    known = [np.isfinite(force) for force in forces]
    holding = [k for k in active if known[k].any()]
    counted = holding or [k for k in range(len(designs)) if k not in active]
    common = np.all([known[k] for k in counted], axis=0) if counted else np.zeros(known[0].shape, dtype=bool)
    if not holding:
        return common, ""
    none = [designs[k].name for k in active if k not in holding]
    but = f" but {enumerated(none)}, which hold{'s' * (len(none) == 1)} none" if none else ""
    return common, f"Common peaks are over the {common.sum()} of {common.size} poses that all hold{but}."
