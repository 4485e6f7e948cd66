"""What a person's shoulder joint feels, as methods of the person."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Unpack

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import GRAVITY
from ...core.errors import InvalidInput
from ...load_case import Case, Load, Motion, Movement
from .assumption_range import ContactQuestion, ContactRange, contact_range
from .contact_options import ContactOptions
from .device import DeviceAction
from .query import contact_forces
from .result import JointContact

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..wearer import Person


class ContactQuestions:
    """Contact force of a person's joint, and what it depends on."""

    def joint_contact(  # type: ignore[misc]
        self: Person,
        poses: Rotation | Movement,
        motion: Motion | None = None,
        load: Load | None = None,
        device: DeviceAction | ArrayLike | None = None,
        *,
        options: ContactOptions | None = None,
        gravity: ArrayLike = GRAVITY,
        outside: str = "raise",
        progress: bool = False,
        executor: Executor | None = None,
    ) -> JointContact:
        """Contact force of the glenohumeral joint with the person's own muscles.

        The humerus is in equilibrium, with the scapula held; activations are those of least effort
        (:mod:`exo_pin.person.contact.activation`). The result is a model's: it names its assumptions, and
        :meth:`contact_range` varies them.

        Parameters
        ----------
        poses : Rotation or Movement
            Pose of the upper arm, single or a stack of shape (...); or a movement, whose motion then counts.
        motion : Motion, optional
            Angular velocity and acceleration: inertia and force-velocity count then.
        load : Load, optional
            Force and couple on the arm, besides its weight and the payload.
        device : array_like or DeviceAction, optional
            Wrench of a device on the upper arm, shape (..., 6): force, N, and moment about the glenohumeral centre,
            N m, in {O_A}; or an action with limb forces to choose. :meth:`exo_pin.ShoulderExo.joint_contact` makes one.
        options : ContactOptions, optional
            Criterion, socket, passive forces.
        gravity : array_like
            Shape (3,), m/s², in {O_A}: another one for a leaning trunk.
        outside : {"raise", "mark"}
            What to do with poses outside the range of motion.
        progress : bool
            Whether to show a progress bar.
        executor : concurrent.futures.Executor, optional
            Where the poses of a stack are computed (docs/howto/many_machines.md); here if left out. The numbers are
            the same.

        Returns
        -------
        JointContact

        Raises
        ------
        OutsideRangeOfMotion
            If a pose is outside the range of motion and ``outside`` is "raise".
        MissingExtra
            If the extra ``person`` is not installed.
        InvalidInput
            If an argument does not fit.

        Examples
        --------
        >>> man = ep.Person(1.75, 75, "male")
        >>> answer = man.joint_contact(ep.shoulder_rotation(0, 90, 0, degrees=True))
        >>> print(f"{answer.magnitude:.0f} N, {answer.percent_body_weight:.0f} % of body weight")
        438 N, 59 % of body weight
        """
        chosen = ContactOptions() if options is None else options
        if not isinstance(chosen, ContactOptions):
            raise InvalidInput(f"expected options to be ContactOptions, got {type(options).__name__}")
        case = Case(poses, motion, load)
        found = contact_forces(
            self, case.poses, case.motion, load, device, chosen, gravity, outside, progress, executor
        )
        return replace(found, record_cautions=case.cautions) if case.cautions else found

    def contact_range(  # type: ignore[misc]
        self: Person, poses: Rotation, *, options: ContactOptions | None = None, **query: Unpack[ContactQuestion]
    ) -> ContactRange:
        """The contact force under other assumptions, one changed at a time.

        Parameters
        ----------
        poses : Rotation
            Pose of the upper arm, single or a stack of shape (...).
        options : ContactOptions, optional
            The assumptions to start from.
        **query
            More of :meth:`joint_contact`.

        Returns
        -------
        ContactRange
            Criterion, weights, socket, passive forces, rotator cuff, centre of the joint, and the band over persons.

        Examples
        --------
        >>> weak = ep.Person(1.63, 67, "female", strength=0.8)
        >>> found = weak.contact_range(ep.shoulder_rotation(40, 0, 0, degrees=True))
        >>> len(found.persons) > 0, all(each.status == "ok" for each in found.persons)
        (True, True)
        """
        return contact_range(
            lambda pose, person, **asked: person.joint_contact(pose, **asked), poses, self, options, **query
        )
