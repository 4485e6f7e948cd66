"""The case of a question: in which poses, in what motion, under which load, on whom.

Poses that no human shoulder reaches are noticed here. The limits are generous: they are meant for a pose of the other
side of the body, radians taken for degrees and the like, not to judge a wearer's range. In terms of the arm's
direction, seen from a healthy shoulder: at most 65° of extension and at most 50° across the body unless the arm is in
front of it.

Angles that look as if they were given in radians where degrees are expected are noticed, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, OutsideHumanRange
from ..core.errors.base import warn
from ..core.records import Record
from ..core.validation import FloatArray, as_count, as_finite, as_rotation, require_type, set_fields
from .motion_and_load import CentreOffset, CentrePath, Load, Motion
from .pose_stacks import Query, as_query
from .trajectories import Movement

#: Values of idle joints by name, or configurations of a device's chain; None: by the straight turn from rest.
Posture = Mapping[str, ArrayLike] | ArrayLike | None
#: Backward component of the arm's direction beyond which it is extended too far: sin 65°.
BACKWARD = float(np.sin(np.radians(65.0)))
#: Component into the body beyond which the arm passes through it (sin 50°), unless this far forward (sin 20°).
INTO_BODY, IN_FRONT = float(np.sin(np.radians(50.0))), float(np.sin(np.radians(20.0)))
#: Turns of the arm about its own axis, rad: those of the daily-life box, -90.7 and 134.5°, with room.
INWARD, OUTWARD = float(np.radians(-95.0)) - 1e-9, float(np.radians(135.0)) + 1e-9


@dataclass(frozen=True, eq=False)
class Case(Record):
    """What is asked of a device, checked once; the same case may be put to many devices.

    Attributes
    ----------
    poses : Rotation or Movement
        Pose of the arm, single or a stack of shape (...), taking {O_B} to {O_A}. A movement gives its poses and its
        motion.
    motion : Motion or None
        Angular velocity and acceleration; the arm is at rest if left out.
    load : Load or None
        Force and couple on the arm, besides its weight.
    centre_offset : CentreOffset, CentrePath, array_like or None
        Where the device's centre lies, seen from the anatomical one, m; an array of shape (..., 3) shifts base and cuff
        together, a path lets the anatomical centre move as the arm is lifted.
    wearer : Arm, Person or None
        Who wears the device; the arm of the design if left out.
    pose_cautions : tuple of str
        Doubts about the poses of a measured movement, which a movement brings along.
    posture : mapping, array_like or None
        Of a device with joints that move while the arm rests: their values by name, rad or m (``"elbow_deg"``,
        ``"slide_mm"`` for others), each a number or one a pose; or configurations of its chain, shape (..., nq), as
        :meth:`exo_pin.ShoulderExo.assembly_modes` returns them. If left out, idle joints move as little as they can
        along the straight turn from rest.

    Raises
    ------
    InvalidInput
        If something is of the wrong type, or its stack dimensions do not broadcast to those of the poses.

    Examples
    --------
    >>> case = ep.Case(ep.load("four-cables").pose([0, 30]), load=ep.Load([0.0, 0.0, -10.0]))  # 10 N more
    >>> [ep.solve(ep.load(name), case).magnitude.round(1).tolist() for name in ("four-cables", "four-linear-actuators")]
    [[51.0, 15.7], [51.9, 31.9]]
    """

    poses: Rotation
    motion: Motion | None = None
    load: Load | None = None
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None
    wearer: Any = None
    pose_cautions: tuple[str, ...] = ()
    posture: Posture = None

    def __post_init__(self) -> None:
        if isinstance(self.poses, Movement):
            if self.motion is not None:
                raise InvalidInput("expected a movement without motion: a movement has a motion of its own")
            moved = self.poses
            set_fields(self, motion=moved.motion, poses=moved.poses, pose_cautions=moved.pose_cautions)
        if not isinstance(self.poses, Rotation):
            # Whether they are finite is checked with the copy that is computed with: there may be millions.
            as_rotation("poses", self.poses)
        for name, kind in (("motion", Motion), ("load", Load)):
            if getattr(self, name) is not None:
                require_type(name, getattr(self, name), kind)
        offset = self.centre_offset
        if offset is not None and not isinstance(offset, CentreOffset | CentrePath):
            offset = CentreOffset.together(as_finite("centre_offset", offset, (3,), stack=True))
            set_fields(self, centre_offset=offset)

    @cached_property
    def query(self) -> Query:
        """Poses, motion and load as flat stacks."""
        return as_query(self.poses, self.motion, self.load)

    def turned(self, rows: NDArray[np.intp], matrices: FloatArray) -> Query:
        """Rows of the stack with the arm in other orientations.

        Parameters
        ----------
        rows : ndarray
            Numbers of the rows, shape (k,); a row may occur more than once.
        matrices : ndarray
            The orientations, shape (k, 3, 3).

        Returns
        -------
        Query
            Orientations, and the motion and load of these rows.

        Examples
        --------
        >>> case = ep.Case(ep.load("four-cables").pose([0, 60]))
        >>> case.turned(np.array([1]), case.poses[:1].as_matrix()).matrices.shape
        (1, 3, 3)
        """
        matrices = as_finite("matrices", matrices, (3, 3), stack=True)
        return as_query(Rotation.from_matrix(matrices, assume_valid=True), *self._of_rows(rows))

    def _own(self, array: Any, rows: Any, *last: int) -> Any:
        """Rows of the flat stack of an array that broadcasts to its shape, without a copy of all others."""
        shape = self.poses.shape or (1,)
        return np.broadcast_to(array, (*shape, *last))[np.unravel_index(rows, shape)]

    def _of_rows(self, rows: Any) -> tuple[Motion | None, Load | None]:
        """Motion and load of some rows, or of one."""
        motion, load = self.motion, self.load
        if motion is not None:
            motion = Motion(
                *(self._own(each, rows, 3) for each in (motion.angular_velocity, motion.angular_acceleration))
            )
        if load is not None:
            force, moment, at = (self._own(each, rows, 3) for each in (load.force, load.moment, load.at))
            load = Load(force, moment, at, load.frame)
        return motion, load

    def row(self, k: int) -> Case:
        """One pose of the stack, with what of the case is its own.

        Parameters
        ----------
        k : int
            Number of the pose, counted over all dimensions.

        Returns
        -------
        Case

        Examples
        --------
        >>> case = ep.Case(ep.load("four-cables").pose([0, 60]), load=ep.Load([[0.0, 0.0, -10.0], [0.0, 0.0, -20.0]]))
        >>> case.row(1).load.force
        array([  0.,   0., -20.])
        """
        return self._cut(as_count("k", k, 0, int(np.prod(self.poses.shape)) - 1))

    def _cut(self, rows: Any) -> Case:
        """Some rows of the flat stack, or one, with what of the case is their own."""
        offset, posture = self.offset, self.posture
        if offset is not None:
            offset = CentreOffset(self._own(offset.base, rows, 3), self._own(offset.cuff, rows, 3))
        if isinstance(posture, Mapping):
            posture = {name: self._own(value, rows) for name, value in posture.items()}
        elif posture is not None:
            posture = self._own(posture, rows, np.shape(posture)[-1])
        # Only stacks of one dimension take rows.
        one = len(self.poses.shape) == 1
        poses = self.poses[rows] if one else Rotation.from_quat(self._own(self.poses.as_quat(), rows, 4))
        motion, load = self._of_rows(rows)
        return replace(self, poses=poses, motion=motion, load=load, centre_offset=offset, posture=posture)

    @property
    def offset(self) -> CentreOffset | None:
        """Offset of the device's centre in these poses; None where it is the shoulder's."""
        given = self.centre_offset
        return given.offset(self.poses) if isinstance(given, CentrePath) else given  # type: ignore[return-value]

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about how poses and motion were measured; empty where there are none."""
        return (*self.pose_cautions, *(() if self.motion is None else self.motion.cautions))

    @property
    def is_stacked(self) -> bool:
        """Whether load or offset has a value for every pose."""
        parts: tuple[Any, ...] = self.load, None if isinstance(self.centre_offset, CentrePath) else self.centre_offset
        return any(np.ndim(value) >= 2 for part in parts if part is not None for value in vars(part).values())

    def at(self, poses: Rotation, motion: Motion | None = None) -> Case:
        """The same case in other poses, at rest unless a motion is given.

        Parameters
        ----------
        poses : Rotation
            Shape (...).
        motion : Motion, optional
            Of the arm; at rest if left out.

        Returns
        -------
        Case

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators")
        >>> case = ep.Case(exo.pose(flexion=30), load=ep.Load([0.0, 0.0, -20.0]))
        >>> higher = case.at(exo.pose(flexion=80))
        >>> higher.load is case.load, round(float(np.rad2deg(higher.poses.magnitude())), 6)  # the same load, at 80°
        (True, 80.0)
        """
        return replace(self, poses=poses, motion=motion, pose_cautions=())


def outside_human_range(matrices: FloatArray, side: str) -> NDArray[np.bool_]:
    """Whether the arm points where no human shoulder brings it.

    Parameters
    ----------
    matrices : ndarray
        Orientations, shape (N, 3, 3), {O_B} to {O_A}.
    side : {"left", "right"}
        Side of the body, as a design has it.

    Returns
    -------
    ndarray of bool
        Shape (N,).
    """
    forward = -matrices[:, 0, 2]
    outward = -matrices[:, 1, 2] if side == "left" else matrices[:, 1, 2]
    through_body = (outward < -INTO_BODY) & (forward < IN_FRONT)
    return np.asarray((forward < -BACKWARD) | through_body)


def beyond_motion(matrices: FloatArray, side: str) -> NDArray[np.bool_]:
    """Whether poses are beyond a shoulder's range of motion.

    That is where :func:`outside_human_range` says it of the arm's direction, or the arm is turned about its own axis
    further than in daily life, from the straight turn that brings it to its direction.

    Parameters
    ----------
    matrices, side
        As there.

    Returns
    -------
    ndarray of bool
        Shape (N,).
    """
    # About z of the arm, of the quaternion's parts over 4 w: the turn is outward on a left side.
    sine, cosine = matrices[:, 1, 0] - matrices[:, 0, 1], matrices[:, 0, 0] + matrices[:, 1, 1]
    outward = np.arctan2(sine, cosine) * (1.0 if side == "left" else -1.0)
    return outside_human_range(matrices, side) | (outward < INWARD) | (outward > OUTWARD)


def warn_outside_human_range(matrices: FloatArray, side: str) -> None:
    """Warn of poses outside a human's range, with the likely cause."""
    outside = outside_human_range(matrices, side)
    if not outside.any():
        return
    other = "right" if side == "left" else "left"
    swapped = not outside_human_range(matrices[outside], other).any()
    which = "this pose" if len(outside) == 1 else f"{int(outside.sum())} of {len(outside)} poses"
    cause = (
        f'a {other} shoulder does: load the design with side="{other}", or mirror the pose'
        if swapped
        else "check the signs, the unit of the angles and their order"
    )
    warn(f"{which} cannot be reached by a human {side} shoulder; {cause}", OutsideHumanRange)


#: 30, 45, 60, 90 and 120° in radians, with two and three digits behind the point.
_ROUNDED = (0.52, 0.524, 0.79, 0.785, 1.05, 1.047, 1.57, 1.571, 2.09, 2.094)
#: So many angles are a stack of poses.
_MANY = 4


def warn_suspicious_angles(angles: Mapping[str, ArrayLike]) -> None:
    """Warn of angles beyond 180°, and of what looks like radians.

    That is whole degrees in radians, such as 1.0471975511965976 for 60°; the common angles with two or three digits,
    such as 1.05; and many angles none of which is above half a turn in radians, such as ``linspace(0, 1.57, 50)``.
    """
    suspects = {}
    for name, value in angles.items():
        values = np.asarray(value, dtype=np.float64).reshape(-1)
        if (np.abs(values) > 180.0).any():
            worst = float(values[np.abs(values).argmax()])
            warn(f"{name} = {worst:g}° is beyond half a turn", OutsideHumanRange)
        whole = np.degrees(values)
        likely = (np.abs(values) > 1e-3) & (np.abs(values) <= np.pi) & (np.abs(whole - np.rint(whole)) < 1e-9)
        # A whole number of degrees is what it says.
        likely &= values != np.rint(values)
        likely |= np.isin(np.abs(values), _ROUNDED)
        largest = float(np.abs(values).max(initial=0.0))
        if len(values) >= _MANY and 0.5 < largest <= np.pi and not largest.is_integer():
            likely |= np.abs(values) == largest
        if likely.any():
            suspects[name] = float(values[likely][0])
    if suspects:
        name, first = next(iter(suspects.items()))
        warn(
            f"{name} = {first:.6g}° is {np.degrees(first):.0f}° in radians; this function takes degrees",
            OutsideHumanRange,
        )
