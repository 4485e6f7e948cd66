"""The one object a user holds: a mechanism, and the questions it answers."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from . import wrist
from .chain import AssumedMasses, ClosedChain, Recognised, mechanism_urdf, wrist_of, write_urdf
from .consistency import Report, check, check_chain
from .conventions import as_side
from .design import (
    Arm,
    CentreOffset,
    CentrePath,
    Limb,
    Load,
    Mechanism,
    Motion,
    Shoulder,
    WristGeometry,
    preset,
    presets,
    read_mechanism,
    write_mechanism,
)
from .errors import InvalidInput, NotAWrist, UnknownName
from .questions import Questions
from .reaction import (
    ActuatorBounds,
    ConstraintBounds,
    Elasticity,
    EquilibriumModel,
    GlenoidCone,
    Movement,
    MovementReaction,
    PressurePlan,
    Reaction,
    ReactionMap,
    Weights,
    movement_reaction,
    plan_pressures,
    reaction,
    reaction_map,
)
from .reaction.locking import ChainSingularity, LockedChains
from .reaction.map import CHUNK
from .validation import FloatArray

if TYPE_CHECKING:
    from .study import StudyTable
    from .view import Scene

__all__ = ["ShoulderExo", "load"]

_ASSUMED = AssumedMasses()


class ShoulderExo(Questions):
    """A parallel shoulder exoskeleton.

    Frozen: :meth:`replace` makes a new design. Not safe to share between threads.

    A robot that was loaded from a URDF and is no wrist has its :attr:`chain`; what needs a wrist raises NotAWrist.

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

    _recognised: Recognised | None = None
    _given_side: str = "left"
    _why_not: str = ""

    def __init__(
        self,
        geometry: WristGeometry,
        arm: Arm | None = None,
        limbs: Sequence[Limb] | None = None,
        shoulder: Shoulder | None = None,
        **details: Any,
    ) -> None:
        self._mechanism: Mechanism | None = Mechanism(
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

    @classmethod
    def from_chain(cls, chain: ClosedChain, side: str = "left") -> ShoulderExo:
        """Wrap a robot that is given as a closed chain.

        What :attr:`chain` can answer, it answers for any robot. If the chain is a wrist as :meth:`to_urdf` writes them,
        with its limbs among the roles, the closed forms hold, too; otherwise they raise NotAWrist, as everything
        does that needs a wrist's record.

        Parameters
        ----------
        chain : ClosedChain
            The robot.
        side : {"left", "right"}
            The shoulder that it is for; nothing is mirrored.
        """
        exo = cls.__new__(cls)
        exo._mechanism, exo.chain, exo._given_side = None, chain, as_side(side)
        try:
            exo._recognised, exo._why_not = wrist_of(chain, as_side(side)), ""
        except NotAWrist as error:
            exo._recognised, exo._why_not = None, error.reason
        if exo._recognised is not None and not exo._recognised.heavier:
            exo._mechanism = exo._recognised.mechanism
        return exo

    @property
    def mechanism(self) -> Mechanism:
        """The frozen record of the design.

        Raises
        ------
        NotAWrist
            If the robot was loaded from a URDF that is no wrist, or has masses that a wrist's record cannot hold.
        """
        if self._mechanism is None:
            reason = self._why_not
            if self._recognised is not None:
                reason = (
                    "its geometry is a wrist's, but a wrist's record cannot hold the masses of "
                    f"{len(self._recognised.heavier)} links, the first of them after {self._recognised.heavier[0]}"
                )
            raise NotAWrist(self.name, reason)
        return self._mechanism

    @property
    def name(self) -> str:
        """Short name."""
        return self.chain.description.name if self._mechanism is None else self._mechanism.name

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames."""
        known = self._recognised.mechanism if self._mechanism is None and self._recognised is not None else None
        return (known or self.mechanism).geometry

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
        return self._given_side if self._mechanism is None else self._mechanism.side

    def __repr__(self) -> str:
        if self._mechanism is None:
            return f"<ShoulderExo {self.name!r}: {self.chain!r}>"
        m = self._mechanism
        kinds = "+".join(
            f"{count}{kind}" for kind in ("UPU", "SPS") if (count := sum(limb.kind == kind for limb in m.limbs))
        )
        arm = "no arm" if m.arm is None else f"arm {m.arm.mass:.3g} kg"
        return f"<ShoulderExo {m.name!r}: {kinds}, {m.side} shoulder, {arm}>"

    def replace(self, **changes: Any) -> ShoulderExo:
        """Return a new design with some fields of its mechanism changed (``geometry=``, ``arm=``, ``limbs=``, ...).

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.
        """
        return ShoulderExo.from_mechanism(self.mechanism.replace(**changes))

    def worn_by(self, person: Arm) -> ShoulderExo:
        """The design on a person's arm: what the device itself moves is kept, another person's arm is not.

        Parameters
        ----------
        person : Arm
            A left arm, as :meth:`Arm.from_anthropometry` makes it; it is mirrored for a right-sided design.
        """
        if not isinstance(person, Arm):
            raise InvalidInput(f"expected person to be an Arm, got {type(person).__name__}")
        arm = person if self.side == "left" else person.mirrored()
        for part in () if self.arm is None else self.arm.parts:
            if part.device:
                arm = arm + part
        return self.replace(arm=arm)

    def mirrored(self) -> ShoulderExo:
        """The same device on the other shoulder."""
        return ShoulderExo.from_mechanism(self.mechanism.mirrored())

    def save(self, path: str | PathLike[str]) -> None:
        """Write the design as a TOML file that :func:`load` reads back bit for bit.

        Sources are written beside what they speak of; comments of a file that was loaded are not kept.
        """
        write_mechanism(self.mechanism, path)

    def to_urdf(
        self, folder: str | PathLike[str], part: str = "whole", assumed: AssumedMasses | None = _ASSUMED
    ) -> Path:
        """Write the design as URDF with a closures file beside it.

        Parameters
        ----------
        folder : path-like
            Where to; made if it is not there.
        part : {"whole", "wrist", "shoulder", "floating"}
            Limbs and ball joint; the limbs alone; the ball joint with the arm alone; or limbs and a free arm whose
            ball joint is a closure.
        assumed : AssumedMasses or None
            Masses for links that have none, because simulators need them; the file says that they are assumed.
            None leaves such links without mass.

        Returns
        -------
        Path
            The URDF.
        """
        return write_urdf(self.mechanism, folder, part, assumed)

    @functools.cached_property
    def chain(self) -> ClosedChain:
        """The closed kinematic chain in Pinocchio, with the ball joint."""
        return ClosedChain.from_urdf(*mechanism_urdf(self.mechanism, part="whole"))

    @functools.cached_property
    def _equilibrium(self) -> EquilibriumModel:
        return EquilibriumModel(self.mechanism)

    def check(self) -> Report:
        """Kinematic consistency: loops, Jacobians, wrist conditions, mobility, inertia, neutral pose.

        Of a robot that is no wrist: loops, Jacobian, mobility, limits and inertia.

        Returns
        -------
        Report
            Prints as a table; ``passed`` tells whether nothing failed.
        """
        return check_chain(self.chain) if self._mechanism is None else check(self._mechanism)

    def inverse_kinematics(self, orientation: Rotation) -> wrist.LimbState:
        """Limb lengths, directions and joint angles; see :func:`exo_pin.wrist.inverse_kinematics`."""
        return wrist.inverse_kinematics(self.geometry, orientation)

    def jacobian(self, orientation: Rotation) -> FloatArray:
        """d(lengths)/dt = J ω, shape (..., n, 3), m/rad; see :func:`exo_pin.wrist.limb_jacobian`."""
        return wrist.limb_jacobian(self.geometry, orientation)

    def forward_kinematics(
        self, lengths: ArrayLike, near: Rotation | None = None, tolerance: float = 1e-9
    ) -> wrist.AssemblyModes:
        """All poses with given limb lengths, m; see :func:`exo_pin.wrist.forward_kinematics`."""
        return wrist.forward_kinematics(self.geometry, lengths, near, tolerance)

    def forward_kinematics_from_base_angles(
        self,
        theta_x: ArrayLike | None = None,
        theta_y: ArrayLike | None = None,
        near: Rotation | None = None,
        tolerance: float = 1e-9,
    ) -> wrist.AssemblyModes:
        """All poses with given angles of the base joints, rad.

        Both angles, θ_x alone or θ_y alone; see :func:`exo_pin.wrist.forward_kinematics_from_base_angles`.
        """
        return wrist.forward_kinematics_from_base_angles(self.geometry, theta_x, theta_y, near, tolerance)

    def joint_motion(self, orientation: Rotation, motion: Motion) -> wrist.JointMotion:
        """Rates and accelerations of limbs and universal joints; see :func:`exo_pin.wrist.joint_motion`."""
        return wrist.joint_motion(self.geometry, orientation, motion)

    def singularity(self, orientation: Rotation) -> wrist.Singularity:
        """How far poses are from losing control; see :func:`exo_pin.wrist.singularity`."""
        return wrist.singularity(self.geometry, orientation, [limb.kind == "UPU" for limb in self.limbs])

    def nearest_singularity(self, orientation: Rotation) -> wrist.NearestSingularity:
        """The closest singular pose and its angle; see :func:`exo_pin.wrist.nearest_singularity`."""
        return wrist.nearest_singularity(self.geometry, orientation)

    def sensor_sensitivity(
        self, orientation: Rotation, measured: str | Iterable[str] = "base_theta_x"
    ) -> wrist.SensorSensitivity:
        """Error of the arm per error of joint sensors; see :func:`exo_pin.wrist.sensor_sensitivity`."""
        return wrist.sensor_sensitivity(self.geometry, orientation, measured)

    @functools.cached_property
    def _locked_chains(self) -> LockedChains:
        return LockedChains(self.mechanism)

    def chain_singularity(self, orientation: Rotation) -> ChainSingularity:
        """A single pose's singularity from Pinocchio's constraint Jacobians, for three UPU limbs.

        See :class:`exo_pin.reaction.locking.LockedChains`.
        """
        return self._locked_chains.singularity(orientation)

    def reaction(
        self,
        orientation: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str = "spherical",
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
        orientation : Rotation
            Pose of the arm, single or a stack of shape (...).
        motion : Motion, optional
            Angular velocity and acceleration; the arm is at rest if left out.
        load : Load, optional
            Force and couple on the arm, besides its weight.
        split : {"spherical", "minimal", "elastic", "standalone"}
            "spherical": g = 0, limbs that carry no side force, as bare pneumatic muscles; (D-30).
            "minimal": the g within ``constraint_bounds`` that make |F_s| least: the best that a perfect structure
            could do, no prediction, since the g_i are passive reactions. Without bounds on three UPU limbs
            the least is zero wherever det X is not, and the answer says that it is trivial.
            "elastic": by stiffness of the limbs' guides, their joints and the shoulder
            (:mod:`exo_pin.reaction.elastic`).
            "standalone": F_s = 0, the wrist without a shoulder; (D-25).
            With more than three limbs, what is still open is chosen with the least sum of squares; in "minimal" the
            tensions that balance themselves serve to lower |F_s| as well.
        constraint_bounds : None, "actuator" or (lower, upper), optional
            Bounds on g_i for "minimal": none, |g_i| <= |f_i|, or N, broadcasting to (..., n).
        centre_offset : CentreOffset, CentrePath or array_like, optional
            Where the device's centre lies, seen from the anatomical one, m; an array of shape (..., 3) shifts base
            and cuff together, a path lets the anatomical centre move as the arm is lifted. Both effects count,
            lever arms and misfit, in the displaced geometry; massless limbs only.
        actuator_bounds : None, "pull", (lower, upper), or actuators, optional
            Limits of f_i: none; f_i >= 0; N, broadcasting to (..., n); or one object with ``force_limits(length)``
            for all limbs or a sequence of one a limb (see :class:`exo_pin.reaction.ForceLimited`). A pose that
            cannot be held within them has status "infeasible", and ``infeasibility`` says why.
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
            If the design has no arm, ``motion`` is given and the arm's inertia is not known, or "elastic" is
            asked and the shoulder's stiffness is not known.
        InvalidInput
            If an argument does not fit; NonConvexBound and InfeasibleBounds are its children.
        """
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

    def compare(self, other: ShoulderExo, orientations: Rotation, **options: Any) -> StudyTable:
        """This design beside another over the same poses.

        Parameters
        ----------
        other : ShoulderExo
            The other design.
        orientations : Rotation
            Poses, any stack, such as :func:`exo_pin.adl_box`.
        **options
            ``load``, and those of :meth:`reaction`.

        Returns
        -------
        StudyTable
            One row a design; see :func:`exo_pin.study.evaluate` for the columns.
        """
        from .study import compare

        return compare(self, other, orientations, **options)

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
        split : {"spherical", "minimal", "standalone", "elastic"}
            As in :meth:`reaction`. "minimal" is solved by an exact active-set method, without a solver
            (:mod:`exo_pin.reaction.active_set`). "elastic": by stiffness, with the device's centre at the shoulder's;
            poses in which neither limbs nor shoulder are stiff in some direction are "not_solved".
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
            If the design has no arm, ``motion`` is given and the arm's inertia is not known, or "elastic" is asked
            and the shoulder's stiffness is not known.
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

    def view(self, **options: Any) -> Scene:
        """The design in three dimensions, with its forces; see :class:`exo_pin.view.Scene`.

        Parameters
        ----------
        **options
            Arguments of :class:`exo_pin.view.Scene`: ``human``, ``limbs``, ``metres_per_newton``, ``elbow_flexion``.

        Returns
        -------
        Scene
            At rest. ``serve`` opens a page, ``show`` moves it, ``save_html`` and ``save_png`` write files.
        """
        from .view import Scene

        return Scene(self, **options)


def load(source: str | PathLike[str], side: str | None = None) -> ShoulderExo:
    """Load a design.

    Parameters
    ----------
    source : str or path-like
        Name of a preset (:func:`exo_pin.presets`), path of a ``.toml`` file, or of a ``.urdf`` file with its
        closures file beside it; see :meth:`ShoulderExo.from_chain`.
    side : {"left", "right"}, optional
        The side of the body to wear it on; the other side is the mirror image. As written in the file if left out
        (all presets are left). A URDF is not mirrored: there it says which side the robot is for, left if left out.

    Returns
    -------
    ShoulderExo

    Raises
    ------
    UnknownName
        If there is no such preset or file; the message lists the presets.
    FileFormatError
        If the file has an unknown, missing or wrong key.
    """
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput(f"expected the name of a preset or the path of a .toml file, got {source!r:.60}")
    text = fspath(source)
    if text in presets():
        mechanism = preset(text)
    elif text.endswith(".toml"):
        mechanism = read_mechanism(text)
    elif text.endswith(".urdf"):
        return ShoulderExo.from_chain(ClosedChain.from_urdf(text), "left" if side is None else side)
    else:
        raise UnknownName("preset, .toml or .urdf file", text, presets())
    return ShoulderExo.from_mechanism(mechanism if side is None else mechanism.on_side(side))
