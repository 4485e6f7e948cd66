"""Results of forward kinematics: all poses that fit, and one mode along a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.results import Result
from ...core.validation import FloatArray, as_rotation
from .assembly import MEETING_MARGIN


@dataclass(frozen=True, eq=False)
class ModePath:
    """One mode followed along a path of N sets of measurements.

    Attributes
    ----------
    rotations : Rotation
        Stack of N; where no pose fits, the last one found (or the start) is repeated.
    index : ndarray of int
        Shape (N,), slot of the mode in each row; -1 where no pose fits.
    ambiguous : ndarray of bool
        Shape (N,): modes meet here or have met since the row before, or two are too close to distinguish with the
        step along the path, or none fits.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> way = exo.pose(abduction=np.linspace(0.0, 12.0, 13))  # det X = 0 at 6.21°
    >>> path = exo.forward_kinematics(exo.inverse_kinematics(way).lengths).follow(way[0])
    >>> np.flatnonzero(path.ambiguous).tolist()  # degrees, where two modes meet
    [7]
    """

    rotations: Rotation
    index: NDArray[np.int64]
    ambiguous: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class AssemblyModes(Result):
    """All poses that fit, for a stack of shape (...); W slots a row, W = 8 unless more are needed.

    From lengths, from both base angles and from θ_yA there are at most 8. From θ_xA alone each limb with |b| < |a|
    doubles the candidates, and W grows with what is found.

    Attributes
    ----------
    rotations : Rotation
        Shape (..., W), ordered by their angle from the geometry's neutral pose; from both base angles by residual.
        Empty slots repeat the first one; in a row without any they are the identity, without meaning.
    valid : ndarray of bool
        Shape (..., W): which slots hold a pose.
    count : ndarray of int
        Shape (...), number of distinct poses; poses that meet are one.
    residual : ndarray
        Shape (..., W), largest deviation from the measurements, m for lengths and rad for angles; NaN if empty.
    margin : ndarray
        Shape (..., W), distance from the pose at which the mode meets another: the smallest singular value (within
        √3) of the unit-free equations; NaN if empty.
    side : ndarray of int
        Shape (..., W), sign of the equations' determinant: two modes that meet have opposite ones, so a mode whose side
        changes along a path has met another. 0 if empty, and where the measurements overdetermine the pose.
    status : ndarray of str
        Shape (...): "ok"; "meeting", some mode is a multiple root; "unreachable", no pose fits; "continuum", a whole
        curve of poses fits and none is given; "invalid", the row has a NaN or a length that is not positive.
    nearest : ndarray of int or None
        Shape (...), with ``near=``: the slot closest to it, -1 where there is none.
    ambiguous : ndarray of bool or None
        Shape (...), with ``near=``: the nearest mode meets another, or another is too close to distinguish with
        ``near`` (the nearest is farther from ``near`` than half way to its neighbour), or none fits.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> modes = exo.forward_kinematics([0.262958325, 0.330503366, 0.384212449])
    >>> angles = ep.thesis_angles(modes.rotations, degrees=True)[modes.valid]
    >>> angles[np.argmin(np.abs(angles - [20.0, -30.0, 10.0]).sum(axis=1))].round(3)  # one of four
    array([ 20., -30.,  10.])
    """

    rotations: Rotation
    valid: NDArray[np.bool_]
    count: NDArray[np.int64]
    residual: FloatArray
    margin: FloatArray
    side: NDArray[np.int64]
    status: NDArray[np.str_]
    nearest: NDArray[np.int64] | None = None
    ambiguous: NDArray[np.bool_] | None = None

    @property
    def meets(self) -> NDArray[np.bool_]:
        """Shape (..., W): where two modes meet, to rounding."""
        return np.asarray(self.margin < MEETING_MARGIN)

    @property
    def nearest_rotations(self) -> Rotation:
        """Shape (...): the mode closest to ``near``.

        Raises
        ------
        InvalidInput
            If the call was without ``near=``, or some row has no pose at all (``nearest`` is -1 there).
        """
        if self.nearest is None:
            raise InvalidInput("no mode is nearest: call with near= a Rotation")
        lost = np.flatnonzero(np.asarray(self.nearest).ravel() < 0)
        if lost.size:
            raise InvalidInput(f"no pose fits in {lost.size} of {np.size(self.nearest)} rows, the first is {lost[0]}")
        slot = np.asarray(self.nearest)[..., None, None]
        return Rotation.from_quat(np.take_along_axis(self.rotations.as_quat(), slot, axis=-2)[..., 0, :])

    def follow(self, start: Rotation) -> ModePath:
        """Follow one mode along a path, the stack's only dimension, from a known pose near its first row.

        Each row takes the mode closest to the extrapolation of the last two steps. Where two modes meet, the path
        continues, as a moving arm does, and the rows are marked ambiguous.

        Parameters
        ----------
        start : Rotation
            A single pose.

        Returns
        -------
        ModePath

        Raises
        ------
        InvalidInput
            If the stack has not exactly one dimension, or ``start`` is not a single rotation.

        Examples
        --------
        >>> exo = ep.load("scenario-one")
        >>> way = exo.pose(np.linspace(0, 40, 9), 10)
        >>> path = exo.forward_kinematics(exo.inverse_kinematics(way).lengths).follow(way[0])
        >>> round(float((path.rotations * way.inv()).magnitude().max()), 6)  # rad off the way
        0.0
        """
        if self.count.ndim != 1:
            raise InvalidInput(f"expected modes along one path, shape (N,), got {self.count.shape}")
        if as_rotation("start", start).shape != ():
            raise InvalidInput(f"expected start to be a single rotation, got shape {start.shape}")
        quats = self.rotations.as_quat()
        index = np.empty(len(self.count), dtype=np.int64)
        ambiguous = np.empty(len(self.count), dtype=bool)
        held = np.empty((len(self.count), 4))
        expected, last, last_side = start, start, 0
        meets = self.meets
        for k in range(len(index)):
            slot, unsure = nearest_slots(quats[k], self.valid[k], meets[k], expected.as_quat())
            index[k], ambiguous[k] = slot, unsure
            if slot < 0:
                held[k], expected = last.as_quat(), last
                continue
            held[k] = quats[k, slot]
            side = self.side[k, slot]
            ambiguous[k] |= side * last_side < 0
            last_side = side
            here = Rotation.from_quat(held[k])
            # Same angular step again; the first row has none before it.
            expected = here * last.inv() * here if k > 0 else here
            last = here
        return ModePath(Rotation.from_quat(held), index, ambiguous)


def _angles(quats: FloatArray, other: FloatArray) -> FloatArray:
    """Angles between the rotations of unit quaternions, rad, without losing digits of small ones."""
    apart = np.linalg.norm(quats - other, axis=-1)
    across = np.linalg.norm(quats + other, axis=-1)
    return np.asarray(4.0 * np.arcsin(0.5 * np.minimum(apart, across)))


def nearest_slots(
    quats: FloatArray, valid: NDArray[np.bool_], meets: NDArray[np.bool_], close: FloatArray
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Slots of the modes closest to poses, -1 for none, and whether they are ambiguous.

    Shapes (..., W, 4), (..., W), (..., W) and (..., 4).
    """
    away = np.where(valid, _angles(quats, close[..., None, :]), np.inf)
    best = away.argmin(axis=-1)[..., None]
    chosen = np.take_along_axis(quats, best[..., None], axis=-2)
    apart = np.where(valid, _angles(quats, chosen), np.inf)
    np.put_along_axis(apart, best, np.inf, axis=-1)
    gone = ~valid.any(axis=-1)
    unsure = np.take_along_axis(away, best, axis=-1)[..., 0] > 0.5 * apart.min(axis=-1)
    unsure |= np.take_along_axis(meets, best, axis=-1)[..., 0] | gone
    return np.where(gone, -1, best[..., 0]), np.asarray(unsure)
