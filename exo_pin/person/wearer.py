"""The wearer: a person's upper limb with its muscles, scaled to height and mass."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import GRAVITY, as_side
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray, frozen, require_type, set_fields, set_positive
from ..design import Arm, Wearer
from ..load_case import Case, CentrePath, Load, Motion, Movement
from ..load_case.pose_stacks import pose_matrices
from ..reaction.constraints.glenoid_cone import GlenoidCone
from .contact.assumption_range import ContactOptions, ContactQuestion, ContactRange, contact_range
from .contact.device import DeviceAction
from .contact.query import contact_forces
from .contact.result import JointContact, build_table
from .limb.limb_state import LIMIT_NAMES, LimbGeometry, as_joint_angle, limb_by_elevation, limb_state
from .limb.muscle_table import BY_SEX, MODEL_MASS, MUSCLES, MuscleTable, muscle_table
from .limb.myoarm import myoarm

if TYPE_CHECKING:
    from concurrent.futures import Executor

#: Length of the model's upper arm, m: from the glenohumeral centre to the elbow's.
_UPPER_ARM = 0.2907243711831287


@checked
@dataclass(frozen=True, eq=False)
class Person(Wearer):
    """A wearer with the anatomy and the muscles of one arm, and the force in the shoulder joint.

    The anatomy is MyoArm's (:mod:`exo_pin.person.limb.myoarm`), the muscles' strengths and fibre lengths are Saul's
    (:mod:`exo_pin.person.limb.muscle_table`), scaled to the person:

    * **Lengths** of bones, paths, fibres and tendons: by one factor, so that the upper arm is as long as that of
      :meth:`exo_pin.Arm.from_anthropometry` (de Leva 1996, proportional to height). It is 1 for a man of 1.80 m.
    * **Masses** of the arm: :meth:`exo_pin.Arm.from_anthropometry`.
    * **Strengths**: (mass / 79.3 kg)^(2/3), as cross-sections grow in bodies of the same shape, times ``strength``, and
      in women times 0.76, of middle deltoid and supraspinatus 0.50, as measured (96 men, 90 women, Stockholm).

    The pose is the rotation of the upper arm; {O_A} has its origin in the glenohumeral centre at rest
    (:mod:`exo_pin.person.limb.limb_state`), which moves with the elevation (:meth:`centre_path`).

    Attributes
    ----------
    height : float
        Stature, m.
    mass : float
        Of the body, kg.
    sex : {"male", "female"}
        Which half of the anthropometric table.
    strength, cuff_strength : float
        Factor of all muscle forces, and of the rotator cuff's besides: 1 for an average person, less for a weak one.
        A strength of 0 is a flaccid arm: capsule and ligaments alone hold the head, and only a device holds the arm.
    scapular_motion : float
        How far clavicle and scapula follow the elevation, over the model's: 1 is a rhythm of 1.6, 0.7 one of 2.7.
    elbow_flexion : float
        In rad, or degrees with ``degrees=True``, 0 to 130°. At 0 the elbow's stop carries what would extend it further.
    forearm_rotation : float
        Pronation, in rad, or degrees with ``degrees=True``, -90 to 90°.
    payload : float
        A point mass at the end of the hand, kg.
    side : {"left", "right"}
        Side of the body.
    degrees : bool
        Whether the angles are in degrees.

    Raises
    ------
    InvalidInput
        If a value is outside of what a person has, or a joint of the model.
    UnknownName
        If ``sex`` or ``side`` is unknown.

    Examples
    --------
    >>> man, tall = ep.Person(1.75, 75, "male"), ep.Person(1.90, 75, "male", payload=1.0)
    >>> pose = ep.shoulder_rotation(60, 0, 0, degrees=True)
    >>> [round(float(each.joint_contact(pose).magnitude)) for each in (man, tall)]  # N; a longer arm, 1 kg more
    [278, 437]
    """

    strength: float = 1.0
    cuff_strength: float = field(default=1.0, kw_only=True)
    scapular_motion: float = field(default=1.0, kw_only=True)
    forearm_rotation: float = 0.0
    side: str = "left"

    def __post_init__(self, degrees: bool) -> None:
        set_positive(self, "cuff_strength")
        set_positive(self, "strength", "scapular_motion", zero=True)
        if max(self.strength, self.cuff_strength) > 10.0:
            given = f"{self.strength:g} and {self.cuff_strength:g}"
            raise InvalidInput(f"expected strength and cuff_strength as factors up to 10, got {given} (percent?)")
        if self.scapular_motion > 1.5:
            raise InvalidInput(f"expected scapular_motion of 0 to 1.5 of the model's, got {self.scapular_motion:g}")
        angles = ("elbow_flexion", "forearm_rotation")
        set_fields(self, side=as_side(self.side), **{n: as_joint_angle(n, getattr(self, n), degrees) for n in angles})
        super().__post_init__(False)

    def __str__(self) -> str:
        return build_table(self)

    @classmethod
    def of_wearer(cls, wearer: Wearer) -> Person:
        """A wearer with average muscles; one who has muscles stays as they are.

        Parameters
        ----------
        wearer : Wearer
            Size and posture.

        Returns
        -------
        Person

        Examples
        --------
        >>> woman = ep.Person.of_wearer(ep.Wearer(1.60, 55, "female", payload=1.0))
        >>> woman.payload, woman.strength
        (1.0, 1.0)
        """
        if isinstance(wearer, cls):
            return wearer
        return cls(**{each.name: getattr(wearer, each.name) for each in fields(Wearer)})

    def with_changes(self, **changes: Any) -> Person:
        """A copy with some attributes changed; angles in rad.

        Parameters
        ----------
        **changes
            Attributes of the class; the angles in rad.

        Returns
        -------
        Person

        Examples
        --------
        >>> man = ep.Person(1.75, 75, "male")
        >>> pose = ep.shoulder_rotation(0, 60, 0, degrees=True)
        >>> without, with_2_kg = (each.joint_contact(pose).magnitude for each in (man, man.with_changes(payload=2.0)))
        >>> round(float(with_2_kg / without), 1)  # times the force in the joint
        2.2
        """
        return replace(self, **changes)

    def on_side(self, side: str) -> Person:
        """The same person with the arm of a side.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        Person

        Examples
        --------
        >>> left = ep.Person(1.75, 75, "male")
        >>> poses = {side: ep.shoulder_rotation(30, 30, 0, side, degrees=True) for side in ("left", "right")}
        >>> here, there = (left.on_side(side).joint_contact(pose).force for side, pose in poses.items())
        >>> (there / here).round(6)  # a mirror image
        array([ 1., -1.,  1.])
        """
        return self if as_side(side) == self.side else replace(self, side=side)

    #: Names of the m muscles, in the order of all results.
    muscles = MUSCLES

    @cached_property
    def arm(self) -> Arm:
        """Mass properties of the whole arm with the payload, in {O_B}."""
        return Arm.of_wearer(self)

    @cached_property
    def forearm(self) -> Arm:
        """Mass properties of forearm, hand and payload, in {O_B}."""
        return sum((Arm(*body) for body in self.segments()[2:]), Arm(*self.segments()[1]))

    @cached_property
    def elbow_centre(self) -> FloatArray:
        """Centre of the elbow in {O_B}, shape (3,), m."""
        return frozen(np.array([0.0, 0.0, -_UPPER_ARM * self.length_scale]))

    @cached_property
    def length_scale(self) -> float:
        """Person's lengths over those of the model."""
        return self.upper_arm_length / _UPPER_ARM

    @property
    def strength_scale(self) -> float:
        """Person's muscle forces over those of the model."""
        return float(self.strength * BY_SEX[self.sex][0] * (self.mass / MODEL_MASS) ** (2.0 / 3.0))

    @cached_property
    def muscle_table(self) -> MuscleTable:
        """Strengths, fibre lengths, tendon lengths and pennation angles of this person's muscles."""
        return muscle_table(self.length_scale, self.strength_scale, self.cuff_strength, BY_SEX[self.sex][1])

    def limb_state(self, poses: Rotation) -> LimbGeometry:
        """Bones and muscle paths in a stack of poses, flattened to N rows; NaN outside the range of motion.

        Parameters
        ----------
        poses : Rotation
            Of the upper arm, N in all.

        Returns
        -------
        LimbGeometry

        Raises
        ------
        MissingExtra
            If the extra ``person`` is not installed.

        Examples
        --------
        >>> man = ep.Person(1.75, 75, "male")
        >>> state = man.limb_state(ep.shoulder_rotation([0, 60], 0, 0, degrees=True))
        >>> (1e3 * state.centre[1]).round(1)  # mm, of the joint at 60° of flexion: back, inward, up
        array([-18.4,  -4.1,  15. ])
        """
        matrices = pose_matrices(poses)[1]
        posture = (self.elbow_flexion, self.forearm_rotation, self.length_scale)
        return limb_state(matrices, *posture, self.side == "left", self.scapular_motion)

    def allows(self, poses: Rotation) -> np.ndarray:
        """Whether the poses, shape (...), lie within the range of motion of the model, shape (...).

        Parameters
        ----------
        poses : Rotation
            Of the upper arm, single or a stack of shape (...).

        Returns
        -------
        ndarray of bool
            Shape (...).

        Examples
        --------
        >>> person = ep.Person(1.75, 75, "male")
        >>> person.allows(ep.shoulder_rotation(0, [60, -60], 0, degrees=True)).tolist()  # out; through the trunk
        [True, False]
        """
        shape = pose_matrices(poses)[0]
        return np.asarray(~self.limb_state(poses).outside.any(axis=1)).reshape(shape)

    @property
    def range_of_motion(self) -> dict[str, tuple[float, float]]:
        """Limits of the model's angles, rad."""
        return {name: (float(low), float(high)) for name, (low, high) in zip(LIMIT_NAMES, myoarm().limits, strict=True)}

    def joint_contact(
        self,
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
        require_type("options", chosen, ContactOptions, "ContactOptions")
        case = Case(poses, motion, load)
        found = contact_forces(
            self, case.poses, case.motion, load, device, chosen, gravity, outside, progress, executor
        )
        return replace(found, record_cautions=case.cautions) if case.cautions else found

    def contact_range(
        self, poses: Rotation, *, options: ContactOptions | None = None, **query: Unpack[ContactQuestion]
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

    def centre_path(self, fit: ArrayLike = (0.0, 0.0, 0.0)) -> CentrePath:
        """Where the glenohumeral centre goes as the arm is elevated (scapulohumeral rhythm).

        In the model, clavicle and scapula follow the elevation alone, so that the path holds in every plane of
        elevation.

        Parameters
        ----------
        fit : array_like
            Offset of a device at rest, base and cuff together, shape (3,), m, in {O_A}.

        Returns
        -------
        CentrePath
            For ``centre_offset`` of :meth:`exo_pin.ShoulderExo.reaction`: the misalignment of a device whose centre is
            fixed to the torso.

        Examples
        --------
        >>> path = ep.Person(1.75, 75, "male").centre_path()
        >>> (1e3 * path.at(np.radians(90.0))).round()  # mm: how the shoulder's centre moves, seen from the device
        array([-27., -11.,  24.])
        """
        elevations, state = limb_by_elevation(self.length_scale, self.side == "left", self.scapular_motion)
        return CentrePath(elevations, state.centre, fit)

    def glenoid_cone(self, **details: Any) -> GlenoidCone:
        """The cone of this person's socket, which follows the scapula as the arm is elevated.

        The socket is that of :meth:`joint_contact`. In the model the scapula follows the elevation alone, so that the
        cone holds in every plane of elevation, and on either side. ``details`` are further attributes of
        :class:`exo_pin.GlenoidCone`: the compression by the person's muscles, above all.

        Parameters
        ----------
        **details
            Further attributes of :class:`exo_pin.GlenoidCone`.

        Returns
        -------
        GlenoidCone

        Examples
        --------
        >>> cone = ep.Person(1.75, 75, "male").glenoid_cone(muscle_compression=300.0)
        >>> low, high = cone.axes("left", ep.shoulder_rotation([0, 90], 0, 0, degrees=True))[:, 0]
        >>> round(float(np.degrees(np.arccos(low @ high))))  # degrees by which the socket turns with the scapula
        34
        """
        elevations, state = limb_by_elevation(self.length_scale, True, self.scapular_motion)
        turns = Rotation.from_matrix(np.swapaxes(state.glenoid[:, [2, 0, 1]], 1, 2))
        return GlenoidCone(orientation=turns, elevation=elevations, **details)
