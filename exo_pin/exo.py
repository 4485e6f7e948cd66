"""The one object a user holds: a mechanism, and the questions it answers."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from scipy.spatial.transform import Rotation

from . import wrist
from .chain import AssumedMasses, ClosedChain, mechanism_urdf, write_urdf
from .consistency import Report, check
from .design import (
    Arm,
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
from .errors import InvalidInput, UnknownName
from .reaction import (
    ConstraintBounds,
    Elasticity,
    EquilibriumModel,
    Reaction,
    ReactionMap,
    reaction,
    reaction_map,
)
from .reaction.map import CHUNK
from .validation import FloatArray

__all__ = ["ShoulderExo", "load"]

_ASSUMED = AssumedMasses()


class ShoulderExo:
    """A parallel shoulder exoskeleton.

    Frozen: :meth:`replace` makes a new design. Not safe to share between threads.

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
            limbs=() if limbs is None else tuple(limbs),
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
        return self._mechanism.arm

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """The limbs."""
        return self._mechanism.limbs

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

    def replace(self, **changes: Any) -> ShoulderExo:
        """Return a new design with some fields of its mechanism changed (``geometry=``, ``arm=``, ``limbs=``, ...).

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.
        """
        return ShoulderExo.from_mechanism(self._mechanism.replace(**changes))

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
        return ShoulderExo.from_mechanism(self._mechanism.mirrored())

    def save(self, path: str | PathLike[str]) -> None:
        """Write the design as a TOML file that :func:`load` reads back bit for bit."""
        write_mechanism(self._mechanism, path)

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
        return write_urdf(self._mechanism, folder, part, assumed)

    @functools.cached_property
    def chain(self) -> ClosedChain:
        """The closed kinematic chain in Pinocchio, with the ball joint."""
        return ClosedChain.from_urdf(*mechanism_urdf(self._mechanism, part="whole"))

    @functools.cached_property
    def _equilibrium(self) -> EquilibriumModel:
        return EquilibriumModel(self._mechanism)

    def check(self) -> Report:
        """Kinematic consistency: loops, Jacobians, wrist conditions, mobility, inertia, neutral pose.

        Returns
        -------
        Report
            Prints as a table; ``passed`` tells whether nothing failed.
        """
        return check(self._mechanism)

    def inverse_kinematics(self, orientation: Rotation) -> wrist.LimbState:
        """Limb lengths, directions and joint angles; see :func:`exo_pin.wrist.inverse_kinematics`."""
        return wrist.inverse_kinematics(self.geometry, orientation)

    def jacobian(self, orientation: Rotation) -> FloatArray:
        """d(lengths)/dt = J ω, shape (..., n, 3), m/rad; see :func:`exo_pin.wrist.limb_jacobian`."""
        return wrist.limb_jacobian(self.geometry, orientation)

    def singularity(self, orientation: Rotation) -> wrist.Singularity:
        """How far poses are from losing control; see :func:`exo_pin.wrist.singularity`."""
        return wrist.singularity(self.geometry, orientation)

    def reaction(
        self,
        orientation: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str = "spherical",
        constraint_bounds: ConstraintBounds = None,
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
        split : {"spherical", "minimal", "standalone"}
            "spherical": g = 0, limbs that carry no side force, as bare pneumatic muscles; (D-30).
            "minimal": the g within ``constraint_bounds`` that make |F_s| least: the best that a perfect structure
            could do, no prediction, since the g_i are passive reactions. Without bounds on three UPU limbs
            the least is zero wherever det X is not, and the answer says that it is trivial.
            "standalone": F_s = 0, the wrist without a shoulder; (D-25).
            With more than three limbs, what is still open is chosen with the least sum of squares; in "minimal" the
            tensions that balance themselves serve to lower |F_s| as well.
        constraint_bounds : None, "actuator" or (lower, upper), optional
            Bounds on g_i for "minimal": none, |g_i| <= |f_i|, or N, broadcasting to (..., n).

        Returns
        -------
        Reaction

        Raises
        ------
        MissingData
            If the design has no arm, or ``motion`` is given and the arm's inertia is not known.
        InvalidInput
            If an argument does not fit; NonConvexBound and InfeasibleBounds are its children.
        """
        return reaction(self._equilibrium, orientation, motion, load, split, constraint_bounds)

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
            Stiffness of guides and shoulder, for "elastic".
        progress : bool
            Whether to show a bar on standard error.

        Returns
        -------
        ReactionMap

        Raises
        ------
        MissingData
            If the design has no arm, ``motion`` is given and the arm's inertia is not known, or "elastic" is asked
            without ``elasticity``.
        InvalidInput
            If a limb has mass, or an argument does not fit; NonConvexBound and InfeasibleBounds are its children.
        """
        return reaction_map(
            self._mechanism,
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


def load(source: str | PathLike[str], side: str | None = None) -> ShoulderExo:
    """Load a design.

    Parameters
    ----------
    source : str or path-like
        Name of a preset (:func:`exo_pin.presets`), or path of a ``.toml`` file.
    side : {"left", "right"}, optional
        The side of the body to wear it on; the other side is the mirror image. As written in the file if left out
        (all presets are left).

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
    text = fspath(source)
    if text in presets():
        mechanism = preset(text)
    elif text.endswith(".toml"):
        mechanism = read_mechanism(text)
    else:
        raise UnknownName("preset or .toml file", text, presets())
    return ShoulderExo.from_mechanism(mechanism if side is None else mechanism.on_side(side))
