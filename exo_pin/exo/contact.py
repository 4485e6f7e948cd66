"""Contact force of the wearer's shoulder joint with the device on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import as_finite, as_mapping, as_positive, as_real, as_single_rotation, require_method
from ..load_case import Case, CentreOffset, CentrePath, Load, Motion, Movement
from ..load_case.case import Posture
from ..load_case.pose_stacks import pose_matrices
from ..reaction import Assumptions, Limits, Reaction, Split, solve
from ..reaction.holding.verdict import angle_words
from ..uncertainty.total_uncertainty import ASSUMED_TONE, TONE, TotalUncertainty
from ..uncertainty.total_uncertainty import total_uncertainty as spread_of
from ..wrist.clearance.gaps import own_body
from ..wrist.forces.displaced import as_offset

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..control import Run, Tracking
    from ..device import Device
    from ..person import ContactOptions, ContactRange, DeviceAction, JointContact, Person
    from ..person.contact.assumption_range import ContactQuestion
    from .shoulder_exo import ShoulderExo


def joint_contact(
    self: ShoulderExo,
    poses: Rotation | Movement,
    person: Person,
    forces: Reaction | ArrayLike | str | None = None,
    motion: Motion | None = None,
    load: Load | None = None,
    *,
    limits: Limits = "design",
    constraint_bounds: float | tuple[ArrayLike, ArrayLike] | None = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    options: ContactOptions | None = None,
    outside: str = "raise",
    progress: bool = False,
    executor: Executor | None = None,
    posture: Posture = None,
) -> JointContact:
    """Contact force of the glenohumeral joint with the person's own muscles and the device.

    Parameters
    ----------
    poses : Rotation or Movement
        Pose of the arm, single or a stack of shape (...); or a movement, whose motion then counts.
    person : Person
        The wearer; the arm on the device's side is taken.
    forces : number, array_like, Reaction, "least_effort" or "least_contact", optional
        The limb forces:

        * left out: those that carry all moments of the person's arm; of a device that cannot make every moment,
          what it carries, which the answer says;
        * a number: the share of the moments of the person's arm (weight, inertia and load) that the device
          carries, 1 for all, 0 for a device that carries no more than itself; not of a device without drives,
          whose springs carry what they do;
        * an array of shape (..., n), N, tension positive;
        * a Reaction of the same poses: its wrenches, with side forces and limb masses;
        * "least_effort": within ``limits``, chosen together with the activations for least effort;
        * "least_contact": the same for least contact force, a lower bound.

        Of choices that are equally good the last two take the shortest: limb forces that effort does not need, and
        activations that do not lower the contact force, stay small.

        Limbs carry no side force, except in a Reaction or with ``constraint_bounds``.
    motion, load : Motion, Load, optional
        As in :meth:`exo_pin.ShoulderExo.reaction`.
    limits : optional
        Limits of the limb forces for the last two, as in :meth:`exo_pin.ShoulderExo.reaction`.
    constraint_bounds : float or (lower, upper), optional
        Side forces g of the UPU limbs within these bounds, N (a number N is -N to N), chosen together with the
        activations: for least contact force if ``forces`` gives the limb forces, else as they are. That is what
        side forces could do at best; what stiff limbs do follows from their stiffness. Left out: none.
    centre_offset : CentreOffset, CentrePath or array_like, optional
        Where the device's centre lies, seen from the anatomical one; ``person.centre_path()`` for a device whose
        centre is fixed to the torso. Not with a Reaction, which has its own.
    options : ContactOptions, optional
        Criterion, socket, passive forces.
    outside : {"raise", "mark"}
        What to do with poses outside the person's range of motion.
    progress : bool
        Whether to show a progress bar.
    executor : concurrent.futures.Executor, optional
        Where the poses of a stack are computed (docs/howto/many_machines.md); here if left out. The numbers are
        the same.
    posture : mapping or array_like, optional
        Where joints stand that move while the arm rests, as in :meth:`exo_pin.ShoulderExo.reaction`. Not with a
        Reaction, which has its own.

    Returns
    -------
    JointContact
        With ``without_device``, the same for the arm alone.

    Raises
    ------
    OutsideRangeOfMotion
        If a pose is outside the person's range of motion and ``outside`` is "raise".
    MissingExtra
        If the extra ``person`` is not installed.
    InvalidInput
        If an argument does not fit, a limb has mass and ``forces`` is no Reaction, or a share is asked of a device
        that has no drives to set it.

    Examples
    --------
    >>> man, exo = ep.Person(1.75, 75, "male"), ep.load("four-cables-worn")
    >>> answer = exo.joint_contact(exo.pose(60), man)
    >>> print(f"{answer.magnitude:.0f} N in the joint, {answer.without_device.magnitude:.0f} N without the device")
    68 N in the joint, 278 N without the device
    """
    from ..person.contact.device import load_of_share, require_drives, share_words  # here: few need a person
    from .device_action import action_of_limbs, action_of_reaction

    require_method("person", person, "joint_contact", "a Person")
    case = Case(poses, motion, load, centre_offset, posture=posture)
    poses, motion = case.poses, case.motion
    device, wearer, words = self.device, person.on_side(self.side), ""
    given = (centre_offset, constraint_bounds, posture) if isinstance(forces, Reaction) else (None,)
    if any(value is not None for value in given):
        raise InvalidInput("a Reaction has its own centre_offset, bounds and posture: leave them out here")
    if forces is None or (not isinstance(forces, Reaction | str) and as_real("forces", forces).ndim == 0):
        share = 1.0
        if forces is not None:
            require_drives(device)
            share = float(as_finite("forces", forces, ()))
        rest = load_of_share(share, wearer, device.gravity, poses, motion, load)
        worn = self.worn_by(person.on_side("left"))
        words = f"limbs carry {100.0 * share:g} % of the moments of the person's arm"
        # Without drives there are no limits to keep: the wearer makes what is left.
        kept = limits if device.driven_moments else "none"
        forces = worn.reaction(poses, motion, rest, centre_offset=centre_offset, limits=kept, posture=posture)
    if isinstance(forces, Reaction) and constraint_bounds is None:
        words = words and f"{words}; no side forces"
        if device.driven_moments < 3:
            # What such a device carries is what it does, whatever was asked.
            words = share_words(forces.closest.cuff_wrench, wearer, device.gravity, poses, motion, load)
        action = action_of_reaction(forces, poses, words)
    else:
        tensions = forces.closest.actuator_forces if isinstance(forces, Reaction) else forces
        action = action_of_limbs(device, case, tensions, limits, constraint_bounds, given_by=words)
    return _felt(
        self, case, person, action, forces, options=options, outside=outside, progress=progress, executor=executor
    )


def _felt(
    exo: ShoulderExo, case: Case, person: Person, action: DeviceAction, forces: Any, **asked: Any
) -> JointContact:
    """The answer for what the device does to the arm, with a caution where it touches the wearer."""
    poses = case.poses
    found = person.on_side(exo.side).joint_contact(
        poses, case.motion, case.load, action, gravity=exo.device.gravity, **asked
    )
    worn = exo.worn_by(person.on_side("left"))
    if not isinstance(forces, Reaction) and case.posture is not None:
        forces = solve(worn, case, Assumptions(limits="none"))
    shown, offset, placed = worn.device, None, None
    if isinstance(forces, Reaction):
        # The configurations are those of the reaction's device, which may have other joints where it gives way.
        own = forces.source.poses
        shown, offset, placed = own.mechanism, own.offset, own.placed
    elif (moved := case.offset) is not None:
        offset = as_offset(moved, poses.shape)
    touching = shown.gaps(pose_matrices(poses)[1], offset, placed, own_body(worn.device.arm, worn.side)).words
    if touching:
        found = replace(found, caution=f"{found.caution} {touching}".lstrip())
    return replace(found, record_cautions=case.cautions) if case.cautions else found


@checked
def joint_contact_of_run(
    self: ShoulderExo, tracking: Tracking | Run, person: Person, progress: bool = False, *, rate: float = 25.0
) -> JointContact:
    """Contact force of the wearer's shoulder joint along a simulated motion, with the efforts of the run.

    The wearer's own muscles carry what the device leaves of weight, motion, payloads and pushes.

    Parameters
    ----------
    tracking : Tracking or Run
        Of this design.
    person : Person
        The wearer.
    progress : bool
        Whether to show a progress bar.
    rate : float
        About how many samples a second are answered, beside that of the largest |F_s|; each takes some milliseconds.

    Returns
    -------
    JointContact
        A stack of the samples; poses beyond the person's range of motion are marked.

    Examples
    --------
    >>> exo, man = ep.load("four-cables-worn"), ep.Person(1.75, 75, "male")
    >>> run = exo.track("flexion", "model", duration=0.4)
    >>> exo.joint_contact_of_run(run, man, rate=5.0).magnitude.round()
    array([ 8., 34.,  8., 12.])
    """
    from ..control.plant.arm_wrench import posture_of
    from ..person.contact.device import DeviceAction  # here: few need a person

    run: Any = getattr(tracking, "run", tracking)
    count = len(run.times)
    step = max(round((count - 1) / max(np.ptp(run.times) * as_positive("rate", rate), 1.0)), 1)
    # A drive that fails may press the joint for some milliseconds only.
    rows = np.union1d(np.arange(0, count, step), [int((run.shoulder_force**2).sum(axis=1).argmax())])
    case = Case(
        run.rotations[rows],
        Motion(run.angular_velocity[rows], run.angular_acceleration[rows]),
        run.external_load(rows),
        posture=posture_of(run, rows),
    )
    # As the run has it: with the inertia of links, the motion of joints that no drive moves, and the give of a cuff.
    f = run.tensions[rows]
    units = () if self.device.has_limbs else self.device.drive_units[: f.shape[1]]
    given = "forces of the run"
    action = DeviceAction(run.cuff_wrench[rows], np.zeros((*f.shape, 6)), f, f, chosen_by=given, drive_units=units)
    return _felt(self, case, person, action, None, outside="mark", progress=progress)


def contact_range(
    self: ShoulderExo,
    poses: Rotation,
    person: Person,
    *,
    options: ContactOptions | None = None,
    **arguments: Unpack[ContactQuestion],
) -> ContactRange:
    """The contact force with the device under other assumptions, one changed at a time.

    Parameters
    ----------
    poses : Rotation
        Pose of the arm, single or a stack of shape (...).
    person : Person
        The wearer.
    options : ContactOptions, optional
        The assumptions to start from.
    **arguments
        More of :meth:`joint_contact`.

    Returns
    -------
    ContactRange

    Examples
    --------
    >>> exo, woman = ep.load("four-cables-worn"), ep.Person(1.63, 67, "female")
    >>> found = exo.contact_range(exo.pose(45), woman)
    >>> round(float(found.reference.magnitude)), len(found.variants)
    (37, 14)
    """
    from ..person.contact.assumption_range import contact_range

    return contact_range(self.joint_contact, poses, person, options, **arguments)


def total_uncertainty(
    self: ShoulderExo,
    pose: Rotation,
    person: Person | None = None,
    *,
    load: Load | None = None,
    split: str | Split = "spherical",
    limits: Limits = "design",
    posture: Posture = None,
    uncertainties: Mapping[str, float] | None = None,
    draws: int = 200,
    seed: int = 0,
    progress: bool = False,
) -> TotalUncertainty:
    """How far |F_s| and the force in the joint spread with everything uncertain at once, and what dominates.

    Parameters
    ----------
    pose : Rotation
        Single.
    person : Person, optional
        Whose muscles are counted for the force in the joint (extra ``person``).
    load, split, limits, posture
        As in :meth:`reaction`.
    uncertainties : mapping, optional
        As in :meth:`uncertainty`; with a person ``tone_percent``, 30 if left out, too.
    draws : int
        Number of draws of all quantities; a quarter of them of each alone.
    seed : int
        Of the random numbers.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    TotalUncertainty

    Raises
    ------
    UnknownName, InvalidInput
        As :meth:`uncertainty`.
    SolverFailed
        If the pose has no answer, or none of the draws.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> spread = exo.total_uncertainty(exo.pose(60, 30), draws=40)
    >>> low, middle, high = spread.quantiles["F_s_N"]
    >>> low < spread.magnitude < high
    True
    """
    stated = dict(as_mapping("uncertainties", uncertainties, "names of quantities to their uncertainty"))
    tone = as_positive(TONE, stated.pop(TONE, ASSUMED_TONE if person is not None else 0.0), zero=True)
    case = Case(as_single_rotation("pose", pose), None, load, None, posture=posture)
    title, joint = f"{self.name}, {angle_words(case.poses, self.side)}", None
    if person is not None:
        wearer = person.on_side(self.side)

        def joint(device: Device, found: Reaction, tone: float) -> float:
            return float(with_kept(type(self).from_device(device), found, wearer, 0.01 * tone).magnitude)

    assumed = Assumptions(split, limits=limits)
    return spread_of(self.device, case, assumed, title, stated, tone, draws, seed, joint, progress)


def with_kept(exo: ShoulderExo, answer: Reaction, person: Person, kept: float) -> JointContact:
    """What the joint carries at rest where muscles keep a share of their activation and the device carries the rest."""
    from ..person import ContactOptions  # here: few answers need it
    from ..person.contact.device import load_of_share

    case, forces = answer.case, answer
    if kept > 0.0:
        rest = load_of_share(1.0 - kept, person.on_side(exo.side), exo.device.gravity, case.poses, None, case.load)
        forces = solve(exo.device, replace(case, load=rest), answer.assumptions)
    options = ContactOptions(kept_activation=kept)
    return exo.joint_contact(case.poses, person, forces, load=case.load, options=options, outside="mark")
