"""Forward kinematics: every pose that fits the measurements.

Results of forward kinematics: all poses that fit, and one mode along a path.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray, as_real, as_rotation, broadcast_to
from ...design import WristGeometry
from .assembly import CONTINUUM, MAX_MODES, MEETING_MARGIN
from .from_lengths import angle_residuals, directions_stack, lengths_stack, planes_stack, twist_stack
from .solutions import Joints, Modes


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
    array = as_real(name, value)
    if array.ndim == 0 or array.shape[-1] != n:
        raise InvalidInput(f"expected {name} to have shape (..., {n}), got {array.shape}")
    return array


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
    width = int(count.max(initial=MAX_MODES))
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
        close = broadcast_to("near", as_rotation("near", near).as_quat(), (*shape, 4))
        nearest, ambiguous = nearest_slots(q, valid, meets, close)
    return AssemblyModes(Rotation.from_quat(q), valid, count, residual, margin, side, status, nearest, ambiguous)
