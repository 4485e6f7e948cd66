"""The one object a user holds: a mechanism, and the questions it answers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Unpack

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..consistency import Report, check
from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.errors.renamed import old_attributes
from ..design import Arm, Limb, Mechanism, Shoulder, WristGeometry, preset, presets, read_mechanism
from ..design.parameters.changes import worn_by
from ..device.device_files import device_file_of, robot_of
from ..load_case.case import warn_outside_human_range, warn_suspicious_angles
from .control_methods import ControlQuestions
from .kinematic_methods import KinematicQuestions, WorkspaceQuestions
from .model_methods import ModelMethods
from .movement_and_map_methods import MovementAndMapQuestions
from .person_methods import PersonQuestions
from .uncertainty_methods import UncertaintyQuestions

if TYPE_CHECKING:
    from ..design import Wearer
    from ..reaction.assumptions import Question
    from ..study import StudyTable


@checked
class ShoulderExo(
    ModelMethods,
    KinematicQuestions,
    MovementAndMapQuestions,
    UncertaintyQuestions,
    PersonQuestions,
    WorkspaceQuestions,
    ControlQuestions,
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
    """

    if not TYPE_CHECKING:
        __getattr__ = old_attributes(
            {
                "holding_reaction": "reaction, which keeps the limits of the design",
                "chain_singularity": "chain.mobility(q, locked=slides)",
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
        """Wrap a mechanism record."""
        if not isinstance(mechanism, Mechanism):
            raise InvalidInput(f"expected a Mechanism, got {type(mechanism).__name__}")
        exo = cls.__new__(cls)
        exo._mechanism = mechanism
        return exo

    @property
    def mechanism(self) -> Mechanism:
        """The frozen record of the design."""
        return self._mechanism

    @property
    def name(self) -> str:
        """Short name."""
        return self._mechanism.name

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames."""
        return self._mechanism.geometry

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

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.
        """
        return ShoulderExo.from_mechanism(self._mechanism.replace(**changes))

    def worn_by(self, person: Arm | Wearer) -> ShoulderExo:
        """The design on a person's arm: what the device itself moves is kept, another person's arm is not.

        Parameters
        ----------
        person : Arm or Wearer
            A left arm, which is mirrored for a right-sided design; or whose it is, a :class:`exo_pin.Person` too: then
            answers say where limbs would pass through the body, and workspaces keep clear of it.

        Examples
        --------
        >>> exo = ep.load("prototype").worn_by(ep.Wearer(1.60, 55, "female"))
        >>> round(float(exo.arm.mass), 2)  # kg, of her arm and the moving part of the device
        3.13
        """
        return ShoulderExo.from_mechanism(worn_by(self.mechanism, person))

    def mirrored(self) -> ShoulderExo:
        """The same device on the other shoulder."""
        return ShoulderExo.from_mechanism(self.mechanism.mirrored())

    def check(self) -> Report:
        """Kinematic consistency: loops, Jacobians, wrist conditions, mobility, inertia, neutral pose.

        Returns
        -------
        Report
            Prints as a table; ``passed`` is true if nothing failed.
        """
        return check(self._mechanism)

    def compare(
        self, *others: ShoulderExo | Rotation, poses: Rotation | None = None, **question: Unpack[Question]
    ) -> StudyTable:
        """This design beside others, of any kind, over the same poses.

        Parameters
        ----------
        *others : ShoulderExo
            The other designs.
        poses : Rotation
            Any stack, such as :func:`exo_pin.adl_box`; by name or after the designs.
        **question
            Of :meth:`reaction`: ``motion``, ``load``, ``split``, ``limits``, ...

        Returns
        -------
        StudyTable
            One row a design; see :func:`exo_pin.study.evaluate` for the columns.
        """
        from ..study import compare

        return compare(self, *others, poses=poses, **question)


def _load_robot(robot: str, side: str, leave_out: Iterable[str], device_file: str | None = None) -> ShoulderExo:
    """A device from a robot's file, with the device file beside it if there is one."""
    chain = _ROBOTS[robot[robot.rindex(".") :]](robot, leave_out=leave_out)
    beside = device_file_of(robot) if device_file is None else device_file
    return ShoulderExo.from_chain(chain, side, robot if robot.endswith(".urdf") else None, beside)


_ROBOTS: dict[str, Any] = {".urdf": ClosedChain.from_urdf, ".xml": ClosedChain.from_mjcf, ".sdf": ClosedChain.from_sdf}


def load(source: str | PathLike[str], side: str | None = None, leave_out: Iterable[str] = ()) -> ShoulderExo:
    """Load a design.

    Parameters
    ----------
    source : str or path-like
        Name of a preset (:func:`exo_pin.presets`), path of a ``.toml`` file, or of a robot: a ``.urdf`` file with its
        closures file beside it, an MJCF ``.xml`` or an ``.sdf``, and its ``.device.toml`` with springs and cables; see
        :meth:`ShoulderExo.from_chain` and :mod:`exo_pin.device.device_files`.
    side : {"left", "right"}, optional
        The side of the body to wear it on; the other side is the mirror image. As written in the file if left out
        (all presets are left). A robot is not mirrored: there it says which side the robot is for, left if left out.
    leave_out : iterable of str
        Of a robot, what to leave out of its file; see :meth:`ClosedChain.from_mjcf`.

    Returns
    -------
    ShoulderExo

    Raises
    ------
    UnknownName
        If there is no such preset or file; the message lists the presets.
    FileFormatError
        If the file has an unknown, missing or wrong key.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> round(float(exo.arm.mass), 3)  # kg, the moving part of the device
    0.657
    """
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput(f"expected the name of a preset or the path of a .toml file, got {echo(source)}")
    text = fspath(source)
    if text in presets():
        mechanism = preset(text)
    elif text.endswith(".device.toml"):
        return _load_robot(fspath(robot_of(text)), "left" if side is None else side, leave_out, text)
    elif text.endswith(".toml"):
        mechanism = read_mechanism(text)
    elif text.endswith(tuple(_ROBOTS)):
        return _load_robot(text, "left" if side is None else side, leave_out)
    else:
        raise UnknownName("preset, .toml, .urdf, .xml (MJCF) or .sdf file", text, presets())
    return ShoulderExo.from_mechanism(mechanism if side is None else mechanism.on_side(side))
