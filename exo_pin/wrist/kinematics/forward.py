"""Forward kinematics: every pose that fits the measurements."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_rotation
from ...design import WristGeometry
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .from_directions import angle_residuals, directions_stack, planes_stack
from .from_lengths import lengths_stack, twist_stack
from .modes import AssemblyModes, nearest_slots
from .solutions import Joints, Modes


@checked
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

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("scenario-one")
    >>> lengths = exo.inverse_kinematics(exo.pose(20, 40)).lengths
    >>> int(wrist.forward_kinematics(exo.geometry, lengths).count)  # of up to eight
    4
    """
    values = _measured("lengths", lengths, geometry.limb_count)
    rows, modes = _rows_and_room(values, MAX_MODES)
    lengths_stack(rows, _joints(geometry), float(tolerance), modes)
    return _result(modes, values, np.isfinite(values) & (values > 0.0), near, "lengths, m, finite and above zero")


@checked
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

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype")
    >>> pose = exo.pose(20, 30)
    >>> sensors = exo.inverse_kinematics(pose).base_theta_x  # Scenario Two: one angle a limb
    >>> modes = wrist.forward_kinematics_from_base_angles(exo.geometry, theta_x=sensors, near=pose)
    >>> found = modes.rotations[int(modes.nearest)]
    >>> round(float(np.degrees((found * pose.inv()).magnitude())), 6)  # degrees off
    0.0
    """
    n, joints, expected = geometry.limb_count, _joints(geometry), "angles, rad, finite"
    if theta_x is not None and theta_y is not None:
        x, y = _measured("theta_x", theta_x, n), _measured("theta_y", theta_y, n)
        try:
            x, y = np.broadcast_arrays(x, y)
        except ValueError:
            raise InvalidInput(f"expected theta_x and theta_y to broadcast, got {x.shape} and {y.shape}") from None
        rows, modes = _rows_and_room(x, 2**n)
        directions_stack(rows, np.ascontiguousarray(y).reshape(-1, n), joints, modes)
        values = np.concatenate([x, y], axis=-1)
        return _result(modes, values, np.isfinite(values), near, expected)
    if theta_x is not None:
        values = _measured("theta_x", theta_x, n)
        rows, modes = _rows_and_room(values, MAX_MODES * 2 ** int((joints.b < joints.a).sum()))
        twist_stack(rows, joints, modes)
    elif theta_y is not None:
        values = _measured("theta_y", theta_y, n)
        rows, modes = _rows_and_room(values, MAX_MODES)
        planes_stack(rows, joints, modes)
    else:
        raise InvalidInput("expected theta_x, theta_y or both")
    angle_residuals(rows, theta_x is not None, joints, float(tolerance), modes)
    return _result(modes, values, np.isfinite(values), near, expected)


def _joints(geometry: WristGeometry) -> Joints:
    base, platform = geometry.base_points, geometry.platform_points
    a, b = (np.linalg.norm(points, axis=1) for points in (base, platform))
    frames, reference = geometry.base_frames, geometry.neutral.as_quat()
    u, v = base / a[:, None], platform / b[:, None]
    return Joints(base, platform, u, v, a, b, frames, _triples(u, v), reference)


def _triples(u: FloatArray, v: FloatArray) -> NDArray[np.int64]:
    """Triples of limbs, shape (T, 3), the best conditioned first.

    Three equations leave a curve of poses where all u, or all v, of them are parallel, and where two are one and the
    same because both their u and their v are. Triples near to that come last.
    """
    triples = np.array(list(combinations(range(len(u)), 3)), dtype=np.int64)
    pairs = triples[:, [[0, 1], [1, 2], [2, 0]]]
    apart = sum((np.cross(x[pairs[..., 0]], x[pairs[..., 1]]) ** 2).sum(axis=-1) for x in (u, v))
    second = [np.linalg.svd(x[triples], compute_uv=False)[:, 1] for x in (u, v)]
    score = second[0] * second[1] * np.asarray(apart).min(axis=1)
    return np.ascontiguousarray(triples[np.argsort(-score, kind="stable")])


def _measured(name: str, value: ArrayLike, n: int) -> FloatArray:
    """Measurements, shape (..., n); NaN allowed, for rows may be marked."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise InvalidInput(f"expected {name} to be real numbers, got {echo(value)}")
    if array.ndim == 0 or array.shape[-1] != n:
        raise InvalidInput(f"expected {name} to have shape (..., {n}), got {array.shape}")
    return array.astype(np.float64)


def _rows_and_room(values: FloatArray, width: int) -> tuple[FloatArray, Modes]:
    """Measurements as rows, shape (N, n), and room for ``width`` modes each."""
    rows = np.ascontiguousarray(values).reshape(-1, values.shape[-1])
    count = len(rows)
    residual, margin = np.full((2, count, width), np.nan)
    return rows, Modes(np.full((count, width, 4), np.nan), residual, margin, np.zeros(count, dtype=np.int64))


def _result(
    modes: Modes, values: FloatArray, good: NDArray[np.bool_], near: Rotation | None, expected: str
) -> AssemblyModes:
    # As many measurements as freedoms: the equations have a determinant.
    shape, determined = values.shape[:-1], values.shape[-1] == 3
    if shape == () and not good.all():
        raise InvalidInput(f"expected {expected}, got {values}")
    q, residual, signed = (part.reshape((*shape, *part.shape[1:])) for part in modes[:3])
    continuum = modes.number.reshape(shape) == CONTINUUM
    count = np.where(continuum, 0, modes.number.reshape(shape))
    width = max(MAX_MODES, int(count.max(initial=0)))
    valid = np.arange(width) < count[..., None]
    residual, signed = (np.where(valid, part[..., :width], np.nan) for part in (residual, signed))
    margin = np.abs(signed)
    side = np.where(valid & determined, np.sign(np.nan_to_num(signed)), 0.0).astype(np.int64)
    # SciPy's Rotation has no missing value: a NaN quaternion is refused by half of its methods.
    filler = np.where(valid[..., :1], q[..., 0, :], [0.0, 0.0, 0.0, 1.0])
    q = np.where(valid[..., None], q[..., :width, :], filler[..., None, :])
    meets = margin < MEETING_MARGIN
    status = np.full(shape, "ok", dtype="<U11")
    status[meets.any(axis=-1)] = "meeting"
    status[count == 0] = "unreachable"
    status[continuum] = "continuum"
    status[~good.all(axis=-1)] = "invalid"
    nearest = ambiguous = None
    if near is not None:
        pose = as_rotation("near", near)
        try:
            close = np.broadcast_to(pose.as_quat(), (*shape, 4))
        except ValueError:
            raise InvalidInput(f"expected near to broadcast to shape {shape}, got {pose.shape}") from None
        nearest, ambiguous = nearest_slots(q, valid, meets, close)
    return AssemblyModes(Rotation.from_quat(q), valid, count, residual, margin, side, status, nearest, ambiguous)
