"""Forward kinematics: every pose that fits the measurements."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_rotation
from ...design import WristGeometry
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .from_angles import angle_residuals, planes_stack
from .from_directions import directions_stack
from .from_lengths import lengths_stack, twist_stack
from .modes import AssemblyModes, nearest_slots

__all__ = ["forward_kinematics", "forward_kinematics_from_base_angles"]

#: Largest residual of a least-squares mode of six angles, as a multiple of the best one.
_KEEP = 3.0


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
        Broadcasts to (...): a pose that is known to be close, to select a mode.
    tolerance : float
        Only for more than three limbs, whose lengths overdetermine the pose: poses of least squares whose
        residual exceeds this, m, do not count.

    Returns
    -------
    AssemblyModes
        At most 8 a row: every real solution.

    Raises
    ------
    InvalidInput
        If the shape does not fit, or a single set is not finite and positive. In a stack a bad row is marked "invalid"
        and has no effect on others.
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
    good = (np.isfinite(values) & (values > 0.0)).all(axis=-1)
    return _result(work, np.asarray(good), shape, near, "lengths, m, finite and above zero", values)


def forward_kinematics_from_base_angles(
    geometry: WristGeometry,
    theta_x: ArrayLike | None = None,
    theta_y: ArrayLike | None = None,
    near: Rotation | None = None,
    tolerance: float = 1e-9,
) -> AssemblyModes:
    """All poses with given angles of the universal joints on the base, Section 4.2.2.

    Both angles of all joints (Scenario One) overdetermine the pose: the answer is the rotation of least squares over
    all angles, with its residual. Modes with more than three times the residual of the best one are dropped. θ_x alone
    (Scenario Two) gives each limb's length in closed form, l² + 2 l |a| sin θx + |a|² - |b|² = 0, and the poses from
    the lengths. θ_y alone gives each limb's plane.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres and frames {A_i}.
    theta_x, theta_y : array_like, optional
        Shape (..., n), rad, as in (4-25): the limb's direction in {A_i} is (cos θx sin θy, -sin θx, cos θx cos θy),
        θx within ±90°. At least one of them.
    near : Rotation, optional
        Broadcasts to (...): a pose that is known to be close, to select a mode.
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

    Notes
    -----
    Source: thesis (4-17), (4-21), (4-23), (4-27), (5-3).
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
        good = (np.isfinite(x) & np.isfinite(y)).all(axis=-1)
        return _result(work, np.asarray(good), shape, near, "angles, rad, finite", np.hstack([x, y]))
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
    return _result(work, np.asarray(good), shape, near, "angles, rad, finite", values)


class _Work(tuple):
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
    expected: str,
    values: FloatArray,
) -> AssemblyModes:
    # As many measurements as freedoms: the equations have a determinant.
    determined = values.shape[-1] == 3
    q, residual, margin, count = work
    if shape == () and not good[0]:
        raise InvalidInput(f"expected {expected}, got {values[0]}")
    continuum = count == CONTINUUM
    count = np.where(continuum, 0, count)
    width = max(MAX_MODES, int(count.max(initial=0)))
    q, residual, margin = q[:, :width], residual[:, :width], margin[:, :width]
    valid = np.arange(width) < count[:, None]
    side = np.where(valid & determined, np.sign(np.nan_to_num(margin)), 0.0).astype(np.int64)
    margin = np.abs(margin)
    residual[~valid], margin[~valid] = np.nan, np.nan
    # SciPy's Rotation has no missing value: a NaN quaternion is refused by half of its methods.
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
        nearest, ambiguous = nearest_slots(q, valid, meets, close)
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
