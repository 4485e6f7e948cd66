"""Forward kinematics: every pose that fits what is measured, and the right one along a path."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..design import WristGeometry
from ..errors import InvalidInput
from ..validation import FloatArray, as_rotation
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .measured import angle_residuals, directions_stack, lengths_stack, planes_stack, twist_stack

__all__ = ["AssemblyModes", "ModePath", "forward_kinematics", "forward_kinematics_from_base_angles"]

#: A least-squares mode of six angles is kept if it explains them no worse than the best one, times this.
_KEEP = 3.0


@dataclass(frozen=True, eq=False)
class ModePath:
    """One mode followed along a path of N sets of measurements.

    Attributes
    ----------
    rotations : Rotation
        Stack of N; where no pose fits, the last one found (or the start) is held.
    index : ndarray of int
        Shape (N,), slot of the mode in each row; -1 where no pose fits.
    ambiguous : ndarray of bool
        Shape (N,): modes meet here or have met since the row before, or two are so close that the step along the path
        does not tell them apart, or none fits.
    """

    rotations: Rotation
    index: NDArray[np.int64]
    ambiguous: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class AssemblyModes:
    """All poses that fit, for a stack of shape (...); W slots a row, W = 8 unless more are needed.

    From lengths, from both base angles and from θ_yA there are at most 8. From θ_xA alone each limb with |b| < |a|
    doubles the candidates, and W grows with what is found.

    Attributes
    ----------
    rotations : Rotation
        Shape (..., W), ordered by their angle from the geometry's neutral pose; from both base angles by residual.
        Empty slots repeat the first one; in a row without any they are the identity, which means nothing.
    valid : ndarray of bool
        Shape (..., W): which slots count.
    count : ndarray of int
        Shape (...), number of distinct poses; poses that meet are one.
    residual : ndarray
        Shape (..., W), largest deviation from what was measured, m for lengths and rad for angles; NaN if empty.
    margin : ndarray
        Shape (..., W), distance from the pose at which the mode meets another: the smallest singular value (within
        √3) of the unit-free equations; NaN if empty.
    side : ndarray of int
        Shape (..., W), sign of the equations' determinant: two modes that meet have opposite ones, so a mode whose side
        changes along a path has met another. 0 if empty, and where more is measured than a pose needs.
    status : ndarray of str
        Shape (...): "ok"; "meeting", some mode is a multiple root; "unreachable", no pose fits; "continuum", a whole
        curve of poses fits and none is given; "invalid", the row has a NaN or a length that is not positive.
    nearest : ndarray of int or None
        Shape (...), with ``near=``: the slot closest to it, -1 where there is none.
    ambiguous : ndarray of bool or None
        Shape (...), with ``near=``: the nearest mode meets another, or another is so close that ``near`` does not
        tell them apart (the nearest is farther from ``near`` than half way to its neighbour), or none fits.
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
        return np.asarray(self.valid & (np.nan_to_num(self.margin, nan=1.0) < MEETING_MARGIN))

    @property
    def nearest_rotations(self) -> Rotation:
        """Shape (...): the mode closest to ``near``.

        Raises
        ------
        InvalidInput
            If the question was asked without ``near=``, or some row has no pose at all (``nearest`` is -1 there).
        """
        if self.nearest is None:
            raise InvalidInput("no mode is nearest: ask with near= a Rotation")
        lost = np.flatnonzero(np.asarray(self.nearest).ravel() < 0)
        if lost.size:
            raise InvalidInput(f"no pose fits in {lost.size} of {np.size(self.nearest)} rows, the first is {lost[0]}")
        slot = np.asarray(self.nearest)[..., None, None]
        return Rotation.from_quat(np.take_along_axis(self.rotations.as_quat(), slot, axis=-2)[..., 0, :])

    def follow(self, start: Rotation) -> ModePath:
        """Follow one mode along a path, the stack's only dimension, from a known pose near its first row.

        Each row takes the mode closest to where the last two steps lead. Where two modes meet, this carries on
        through, as a moving arm does, and says that it might be wrong.

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
        """
        if self.count.ndim != 1:
            raise InvalidInput(f"expected modes along one path, shape (N,), got {self.count.shape}")
        if as_rotation("start", start).shape != ():
            raise InvalidInput(f"expected start to be a single rotation, got shape {start.shape}")
        quats = self.rotations.as_quat()
        index = np.full(len(self.count), -1, dtype=np.int64)
        ambiguous = np.ones(len(self.count), dtype=bool)
        held = np.empty((len(self.count), 4))
        expected, last, last_side = start, start, 0
        meets = self.meets
        for k in range(len(index)):
            picked, unsure = _nearest(quats[k], self.valid[k], meets[k], expected.as_quat())
            index[k], ambiguous[k] = picked, unsure
            held[k] = last.as_quat() if picked < 0 else quats[k, picked]
            if picked < 0:
                expected = last
                continue
            side = int(self.side[k, picked])
            if side * last_side < 0:
                ambiguous[k] = True
            last_side = side
            here = Rotation.from_quat(held[k])
            # Same angular step again; the first row has none before it.
            expected = here * last.inv() * here if k > 0 else here
            last = here
        return ModePath(Rotation.from_quat(held), index, ambiguous)


def forward_kinematics(
    geometry: WristGeometry, lengths: ArrayLike, near: Rotation | None = None, tolerance: float = 1e-9
) -> AssemblyModes:
    """All poses with given limb lengths.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    lengths : array_like
        l_i, shape (..., n), m.
    near : Rotation, optional
        Broadcasts to (...): a pose known to be close, to pick a mode by.
    tolerance : float
        Only for more than three limbs, whose lengths determine the pose more than once: poses of least squares whose
        residual exceeds this, m, do not count.

    Returns
    -------
    AssemblyModes
        At most 8 a row; every real solution is there.

    Raises
    ------
    InvalidInput
        If the shape does not fit, or a single set is not finite and positive. In a stack a bad row is marked "invalid"
        and spoils no other.
    """
    values, shape = _measured("lengths", lengths, geometry.limb_count)
    work = _Work(len(values), MAX_MODES)
    lengths_stack(
        values,
        geometry.base_points,
        geometry.platform_points,
        _triples(geometry.limb_count),
        float(tolerance),
        geometry.neutral.as_quat(),
        *work,
    )
    good = np.isfinite(values).all(axis=-1) & (values > 0.0).all(axis=-1)
    return _result(work, good, shape, near, "lengths, m, finite and above zero", values)


def forward_kinematics_from_base_angles(
    geometry: WristGeometry,
    theta_x: ArrayLike | None = None,
    theta_y: ArrayLike | None = None,
    near: Rotation | None = None,
    tolerance: float = 1e-9,
) -> AssemblyModes:
    """All poses with given angles of the universal joints on the base, Section 4.2.2.

    Both angles of all joints (Scenario One) are more than a pose needs: the answer is the rotation of least squares
    over all angles, and the residual says how well they fit together. Modes that explain the angles more than
    three times worse than the best one are dropped. θ_x alone (Scenario Two) gives each limb's length in closed form,
    l² + 2 l |a| sin θx + |a|² - |b|² = 0, and the poses from the lengths. θ_y alone gives each limb's plane.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres and frames {A_i}.
    theta_x, theta_y : array_like, optional
        Shape (..., n), rad, as in (4-25): the limb's direction in {A_i} is (cos θx sin θy, -sin θx, cos θx cos θy).
        At least one of them.
    near : Rotation, optional
        Broadcasts to (...): a pose known to be close, to pick a mode by.
    tolerance : float
        Only for more than three limbs and one angle of each: poses of least squares whose residual exceeds this, rad,
        do not count.

    Returns
    -------
    AssemblyModes

    Raises
    ------
    InvalidInput
        If neither is given, the shapes do not fit, or a single set is not finite.
    """
    n = geometry.limb_count
    if theta_x is None and theta_y is None:
        raise InvalidInput("expected theta_x, theta_y or both")
    base, platform, frames = geometry.base_points, geometry.platform_points, geometry.base_frames
    reference, triples = geometry.neutral.as_quat(), _triples(n)
    if theta_x is not None and theta_y is not None:
        _measured("theta_x", theta_x, n), _measured("theta_y", theta_y, n)
        try:
            both = np.broadcast_arrays(theta_x, theta_y)
        except ValueError:
            raise InvalidInput(
                f"expected theta_x and theta_y to broadcast, got {np.shape(theta_x)} and {np.shape(theta_y)}"
            ) from None
        (x, shape), (y, _) = _measured("theta_x", both[0], n), _measured("theta_y", both[1], n)
        work = _Work(len(x), 2**n if n > 3 else MAX_MODES)
        directions_stack(x, y, base, platform, frames, _KEEP, *work)
        good = np.isfinite(x).all(axis=-1) & np.isfinite(y).all(axis=-1)
        return _result(work, good, shape, near, "angles, rad, finite", np.hstack([x, y]))
    if theta_x is not None:
        values, shape = _measured("theta_x", theta_x, n)
        doubled = (np.linalg.norm(platform, axis=-1) < np.linalg.norm(base, axis=-1)).sum()
        work = _Work(len(values), MAX_MODES * 2 ** int(doubled))
        twist_stack(values, base, platform, triples, np.inf, reference, *work)
    else:
        assert theta_y is not None
        values, shape = _measured("theta_y", theta_y, n)
        work = _Work(len(values), MAX_MODES)
        planes_stack(values, base, platform, frames, triples, reference, *work)
    angle_residuals(values, theta_x is not None, base, platform, frames, float(tolerance), *work)
    good = np.isfinite(values).all(axis=-1)
    return _result(work, good, shape, near, "angles, rad, finite", values)


class _Work(tuple):  # noqa: SLOT001
    """Arrays that the kernels fill: quaternions, residual, margin, count."""

    def __new__(cls, rows: int, width: int) -> _Work:
        arrays = (
            np.full((rows, width, 4), np.nan),
            np.full((rows, width), np.nan),
            np.full((rows, width), np.nan),
            np.zeros(rows, dtype=np.int64),
        )
        return super().__new__(cls, arrays)


def _triples(n: int) -> NDArray[np.int64]:
    return np.array(list(combinations(range(n), 3)), dtype=np.int64)


def _measured(name: str, value: ArrayLike, n: int) -> tuple[FloatArray, tuple[int, ...]]:
    """Rows of measurements, shape (N, n), and the stack's shape; NaN allowed, for rows may be marked."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise InvalidInput(f"expected {name} to be real numbers, got {value!r:.80}")
    if array.ndim == 0 or array.shape[-1] != n:
        raise InvalidInput(f"expected {name} to have shape (..., {n}), got {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64).reshape(-1, n), array.shape[:-1]


def _result(
    work: _Work,
    good: NDArray[np.bool_],
    shape: tuple[int, ...],
    near: Rotation | None,
    wanted: str,
    values: FloatArray,
) -> AssemblyModes:
    # As many measurements as freedoms: the equations have a determinant.
    determined = values.shape[-1] == 3
    q, residual, margin, count = work
    if shape == () and not good[0]:
        raise InvalidInput(f"expected {wanted}, got {values[0]}")
    continuum = count == CONTINUUM
    count = np.where(continuum, 0, count)
    width = max(MAX_MODES, int(count.max(initial=0)))
    q, residual, margin = q[:, :width], residual[:, :width], margin[:, :width]
    valid = np.arange(width) < count[:, None]
    side = np.where(valid & determined, np.sign(np.nan_to_num(margin)), 0.0).astype(np.int64)
    margin = np.abs(margin)
    residual[~valid], margin[~valid] = np.nan, np.nan
    # SciPy's Rotation holds no missing value: a NaN quaternion is refused by half of its methods.
    filler = np.where((count > 0)[:, None], q[:, 0], [0.0, 0.0, 0.0, 1.0])
    q = np.where(valid[..., None], q, filler[:, None])
    meets = valid & (np.nan_to_num(margin, nan=1.0) < MEETING_MARGIN)
    status = np.full(len(count), "ok", dtype="<U11")
    status[meets.any(axis=-1)] = "meeting"
    status[count == 0] = "unreachable"
    status[continuum] = "continuum"
    status[~good] = "invalid"
    nearest = ambiguous = None
    if near is not None:
        pose = as_rotation("near", near)
        try:
            close = np.broadcast_to(pose.as_quat(), (*shape, 4)).reshape(-1, 4)
        except ValueError:
            raise InvalidInput(f"expected near to broadcast to shape {shape}, got {pose.shape}") from None
        nearest, ambiguous = np.empty(len(count), dtype=np.int64), np.empty(len(count), dtype=bool)
        for k in range(len(count)):
            nearest[k], ambiguous[k] = _nearest(q[k], valid[k], meets[k], close[k])
        nearest, ambiguous = nearest.reshape(shape), ambiguous.reshape(shape)
    return AssemblyModes(
        Rotation.from_quat(q.reshape(*shape, width, 4)),
        valid.reshape(*shape, width),
        count.reshape(shape),
        residual.reshape(*shape, width),
        margin.reshape(*shape, width),
        side.reshape(*shape, width),
        status.reshape(shape),
        nearest,
        ambiguous,
    )


def _angles(quats: FloatArray, other: FloatArray) -> FloatArray:
    """Angles between the rotations of unit quaternions, rad, without losing digits of small ones."""
    apart = np.linalg.norm(quats - other, axis=-1)
    across = np.linalg.norm(quats + other, axis=-1)
    return np.asarray(4.0 * np.arcsin(np.minimum(1.0, 0.5 * np.minimum(apart, across))))


def _nearest(
    quats: FloatArray, valid: NDArray[np.bool_], meets: NDArray[np.bool_], close: FloatArray
) -> tuple[int, bool]:
    """Slot of the mode closest to a pose, -1 for none, and whether another might be meant."""
    slots = np.flatnonzero(valid)
    if slots.size == 0:
        return -1, True
    away = _angles(quats[slots], close)
    best = int(away.argmin())
    apart = _angles(quats[slots], quats[slots[best]])
    apart[best] = np.inf
    return int(slots[best]), bool(meets[slots[best]] or away[best] > 0.5 * apart.min())

