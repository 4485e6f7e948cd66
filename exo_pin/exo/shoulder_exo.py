"""The one object a user holds: a mechanism, and the questions it answers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..consistency import Report, check
from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.errors.renamed import old_attributes
from ..design import Arm, Limb, Mechanism, Shoulder, WristGeometry
from ..design.parameters.changes import worn_by
from ..load_case.case import warn_outside_human_range, warn_suspicious_angles
from .control_methods import ControlQuestions
from .kinematic_methods import WorkspaceQuestions
from .model_methods import ModelMethods
from .movement_and_map_methods import MovementAndMapQuestions
from .person_methods import PersonQuestions
from .uncertainty_methods import UncertaintyQuestions

if TYPE_CHECKING:
    from ..design import Wearer


@checked
class ShoulderExo(
    ModelMethods, MovementAndMapQuestions, UncertaintyQuestions, PersonQuestions, WorkspaceQuestions, ControlQuestions
):
    """A parallel shoulder exoskeleton.

    Frozen: :meth:`replace` makes a new design. One design may be used from several threads at once: its answers are the
    same as from one thread, bit for bit as long as kernels run in one form. In mode "auto"
    (:mod:`exo_pin.core.compiled`) they change from plain to compiled once, and the two agree to rounding.

    A wrist of limbs between torso and arm. Devices of any other kind are a child of this class, with the same questions
    and answers (:class:`exo_pin.exo.chains.chain_exo.ChainExo`); :func:`exo_pin.load` makes them.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    arm : Arm, optional
        What moves about the shoulder, person and device together.
    limbs : sequence of Limb, optional
        One per joint pair; massless UPU limbs if left out.
    shoulder : Shoulder, optional
        The ball joint.
    **details
        Further fields of :class:`exo_pin.Mechanism` (``gravity``, ``side``, ``name``, ...).

    Examples
    --------
    >>> geometry = ep.WristGeometry.from_circles(0.14, 0.12, 0.08, 0.20, np.radians([30, 60, 120]))
    >>> exo = ep.ShoulderExo(geometry, ep.Arm(3.7, [0.0, 0.0, -0.3]))
    >>> exo.reaction(exo.pose()).shoulder_force.round(2) + 0.0  # N; a hanging arm: its weight, 3.7 × 9.81
    array([ 0. ,  0. , 36.3])
    """

    if not TYPE_CHECKING:
        __getattr__ = old_attributes(
            {
                "holding_reaction": "reaction, which keeps the limits of the design",
                "chain_singularity": "chain.mobility(q, locked=slides)",
                "joint_motion": "wrist.joint_jacobians for rates and chain.project_acceleration for accelerations",
                "singular_approach": "nearest_singularity, and for forces on the way there reaction,",
            }
            | dict.fromkeys(("worst_offset", "worst_stiffness", "sensitivity", "ranking"), "uncertainty")
        )

    def __init__(
        self,
        geometry: WristGeometry,
        arm: Arm | None = None,
        limbs: Sequence[Limb] | None = None,
        shoulder: Shoulder | None = None,
        **details: Any,
    ) -> None:
        self._mechanism = Mechanism(
            geometry,
            arm=arm,
            limbs=() if limbs is None else limbs,  # type: ignore[arg-type]
            shoulder=Shoulder() if shoulder is None else shoulder,
            **details,
        )

    @classmethod
    def from_mechanism(cls, mechanism: Mechanism) -> ShoulderExo:
        """Wrap a mechanism record.

        Parameters
        ----------
        mechanism : Mechanism
            The record of a design.

        Returns
        -------
        ShoulderExo

        Raises
        ------
        InvalidInput
            If it is no Mechanism.

        Examples
        --------
        >>> record = ep.Mechanism(ep.load("prototype").geometry, arm=ep.Arm(2.0, [0.0, 0.0, -0.25]))
        >>> exo = ep.ShoulderExo.from_mechanism(record)
        >>> round(float(np.linalg.norm(exo.reaction(exo.pose(30, 30)).residual)), 9)  # of the balance, N and N m
        0.0
        """
        if not isinstance(mechanism, Mechanism):
            raise InvalidInput(f"expected a Mechanism, got {type(mechanism).__name__}")
        exo = cls.__new__(cls)
        exo._mechanism = mechanism
        return exo

    @property
    def name(self) -> str:
        """Short name."""
        return self._mechanism.name

    @property
    def arm(self) -> Arm | None:
        """The moving part."""
        return self.mechanism.arm

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """The limbs."""
        return self.mechanism.limbs

    @property
    def side(self) -> str:
        """Side of the body."""
        return self._mechanism.side

    def __repr__(self) -> str:
        m = self._mechanism
        kinds = "+".join(
            f"{count}{kind}" for kind in ("UPU", "SPS") if (count := sum(limb.kind == kind for limb in m.limbs))
        )
        arm = "no arm" if m.arm is None else f"arm {m.arm.mass:.3g} kg"
        return f"<ShoulderExo {m.name!r}: {kinds}, {m.side} shoulder, {arm}>"

    def pose(
        self, flexion: ArrayLike = 0.0, abduction: ArrayLike = 0.0, internal_rotation: ArrayLike = 0.0
    ) -> Rotation:
        """Orientation of the arm from clinical angles in degrees, on the design's own side of the body.

        Warns (:class:`exo_pin.OutsideHumanRange`) of a pose that a human shoulder of that side does not reach, and of
        angles that look like radians.

        Parameters
        ----------
        flexion, abduction, internal_rotation : array_like
            Degrees, positive as named: arm forward, away from the body, turned inward. They broadcast to shape (...).

        Returns
        -------
        Rotation
            Takes {O_B} to {O_A}; single, or a stack of shape (...). See :func:`exo_pin.shoulder_rotation`.

        Raises
        ------
        InvalidInput
            If an angle is not finite or the shapes do not broadcast.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> hand = exo.pose(flexion=90).apply([0.0, 0.0, -0.6])  # a hanging hand, raised to the front
        >>> (hand + 0.0).round(3)
        array([ 0.6,  0. , -0. ])
        """
        angles = {"flexion": flexion, "abduction": abduction, "internal_rotation": internal_rotation}
        orientation = shoulder_rotation(**angles, side=self.side, degrees=True)
        warn_suspicious_angles(angles)
        warn_outside_human_range(orientation.as_matrix().reshape(-1, 3, 3), self.side)
        return orientation

    def replace(self, **changes: Any) -> ShoulderExo:
        """Return a new design with some fields of its mechanism changed (``geometry=``, ``arm=``, ``limbs=``, ...).

        Parameters
        ----------
        **changes
            Fields of :class:`exo_pin.Mechanism`.

        Returns
        -------
        ShoulderExo

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.

        Examples
        --------
        >>> earth = ep.load("prototype")
        >>> moon = earth.replace(gravity=[0.0, 0.0, -1.62])
        >>> pose = earth.pose(30, 30)
        >>> forces = [exo.reaction(pose, limits="none").actuator_forces for exo in (moon, earth)]
        >>> (forces[0] / forces[1]).round(4)  # 1.62 / 9.81
        array([0.1651, 0.1651, 0.1651])
        """
        return ShoulderExo.from_mechanism(self._mechanism.replace(**changes))

    def worn_by(self, person: Arm | Wearer) -> ShoulderExo:
        """The design on a person's arm: what the device itself moves is kept, another person's arm is not.

        Parameters
        ----------
        person : Arm or Wearer
            A left arm, which is mirrored for a right-sided design; or whose it is, a :class:`exo_pin.Person` too: then
            answers say where limbs would pass through the body, and workspaces keep clear of it.

        Returns
        -------
        ShoulderExo

        Examples
        --------
        >>> exo = ep.load("prototype").worn_by(ep.Wearer(1.60, 55, "female"))
        >>> round(float(exo.arm.mass), 2)  # kg, of her arm and the moving part of the device
        3.13
        """
        return ShoulderExo.from_mechanism(worn_by(self.mechanism, person))

    def mirrored(self) -> ShoulderExo:
        """The same device on the other shoulder.

        Returns
        -------
        ShoulderExo
            Its mirror image in the x-z plane. In the same clinical angles lengths, tensions and |F_s| are the same; the
            side forces g change their sign.

        Examples
        --------
        >>> left = ep.load("four-linear-actuators")
        >>> right = left.mirrored()
        >>> there, here = (exo.reaction(exo.pose(40, 20, 10)).shoulder_force for exo in (right, left))
        >>> (there / here).round(6)  # to the other side, else the same
        array([ 1., -1.,  1.])
        """
        return ShoulderExo.from_mechanism(self.mechanism.mirrored())

    def check(self) -> Report:
        """Kinematic consistency: loops, Jacobians, wrist conditions, mobility, inertia, neutral pose.

        Returns
        -------
        Report
            Prints as a table; ``passed`` is true if nothing failed.

        Examples
        --------
        >>> report = ep.load("four-linear-actuators").check()
        >>> print(report.passed)
        True
        """
        return check(self._mechanism)
