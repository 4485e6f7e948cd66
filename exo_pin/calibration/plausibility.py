"""Measurements that are mislabelled, or in another unit, frame or order of angles than expected."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ..core.conventions import mirrored, thesis_angles, thesis_rotation
from ..core.errors import InvalidInput, SuspectMeasurements
from ..core.errors.base import warn
from ..core.validation import FloatArray, as_finite, as_rotation
from .length_model import LengthModel

#: Lengths beyond this, m, were given in another unit.
_LONGEST = 5.0
#: Ratios of measured to nominal lengths that a unit explains: of lengths that were taken for metres, and of those that
#: were taken for millimetres, as in a column of a file.
_UNITS = {
    "millimetres": 1000.0,
    "centimetres": 100.0,
    "inches": 1.0 / 0.0254,
    "metres read as millimetres": 1e-3,
    "inches read as millimetres": 1.0 / 25.4,
    "centimetres read as millimetres": 0.1,
}
#: A range of lengths from which a unit can be told, m.
_CHANGES = 5e-3
#: A limb is longer or shorter by a constant if it is so by more than this, m, and half of its lengths vary by less.
_CONSTANT, _VARIES = 0.04, 0.006
#: Lengths that differ from the nominal ones by no more than this, m (root of the mean square), look right.
_NEAR = 0.005
#: Poses from which a shift by a row can be told.
_FEWEST = 10
#: Another reading must leave this part of the differences or less.
_CLEARLY_BETTER = 0.35


def as_poses(poses: Rotation) -> Rotation:
    """A flat stack of measured orientations, shape (N,), N >= 1."""
    poses = as_rotation("poses", poses)
    if poses.shape == ():
        raise InvalidInput("expected a stack of orientations, one a measured pose, got a single one")
    flat = poses.as_quat().reshape(-1, 4)
    if len(flat) == 0:
        raise InvalidInput("expected one orientation or more, got none")
    return Rotation.from_quat(flat)


def as_lengths(lengths: object, poses: Rotation, nominal: FloatArray, free_offsets: bool) -> FloatArray:
    """Measured lengths, shape (N, n), m, one row a pose and one column a limb.

    Parameters
    ----------
    lengths : array_like
        As given.
    poses : Rotation
        As given, shape (...).
    nominal : ndarray
        Shape (N, n), lengths of the nominal design, m.
    free_offsets : bool
        Whether a constant may be missing from each limb's lengths.

    Raises
    ------
    InvalidInput
        If the shapes do not fit, a length is not above zero, or all are in another unit.
    """
    count = nominal.shape[1]
    given = as_finite("lengths", lengths, (None,) * len(poses.shape) + (count,))  # type: ignore[arg-type]
    if given.shape[:-1] != poses.shape:
        raise InvalidInput(
            f"expected lengths of shape {(*poses.shape, count)}, one row an orientation and one column a limb, "
            f"got {given.shape}"
        )
    values = given.reshape(-1, count)
    # Against the nominal lengths, or against how much they change.
    own, expected = (np.ptp(x, axis=0) if free_offsets else np.median(x, axis=0) for x in (values, nominal))
    clear = np.flatnonzero(expected > _CHANGES)
    found = [next((u for u, f in _UNITS.items() if 0.6 < own[i] / (expected[i] * f) < 1.6), "") for i in clear]
    for i, unit in zip(clear.tolist(), found, strict=True):
        if unit:
            factor, others = _UNITS[unit], len(set(found)) > 1
            cure = f"divide by {factor:.5g}" if factor > 1.0 else f"multiply by {1.0 / factor:.5g}"
            where = f" of limb {i + 1}" if others else ""
            raise InvalidInput(
                f"expected lengths{where} in m, about {expected[i]:.3g}, got {own[i]:.4g}: these look like {unit}, "
                f"{cure}"
            )
    if values.max() > _LONGEST:
        raise InvalidInput(f"expected lengths in m, at most {_LONGEST:g}, got {values.max():g} (millimetres?)")
    if values.min() <= 0.0 and not free_offsets:
        raise InvalidInput(f"expected lengths above zero, got {values.min():g}; make length_offsets unknown for others")
    return values


def warn_of_mix_ups(model: LengthModel, poses: Rotation, lengths: FloatArray) -> None:
    """Warn (:class:`SuspectMeasurements`) if another reading of the data fits the nominal design far better.

    The readings are: limbs in another order, orientations inverted, of the other side of the body, quaternions with w
    first, or made from angles of the other order, swapped or in radians, and rows of lengths shifted. A
    constant per limb is left out of the comparison, and named where no offset is unknown. Where mountings are unknown,
    only the limbs are judged.
    """
    squares = _misfits(model, poses, lengths)
    base = float(np.sqrt(np.diag(squares).mean()))
    best, cause = (0.0 if base <= _NEAR else _CLEARLY_BETTER * base), ""
    order = scipy.optimize.linear_sum_assignment(squares)[1]
    swapped = float(np.sqrt(squares[np.arange(len(order)), order].mean()))
    if swapped < best:
        moved = [f"column {j + 1} is limb {i + 1}" for i, j in enumerate(order.tolist()) if i != j]
        best, cause = swapped, f"the limbs are in another order: {', '.join(moved)}"
    if not {"torso_mounting", "arm_mounting"} & set(model.unknowns):
        late = ("lengths are a row late", poses[:-1], lengths[1:]), ("lengths are a row early", poses[1:], lengths[:-1])
        readings = [(reading, other, lengths) for reading, other in _readings(poses)]
        for reading, other, own in (*readings, *(late if len(poses) > _FEWEST else ())):
            left = float(np.sqrt(np.diag(_misfits(model, other, own)).mean()))
            if left < best:
                best, cause = left, reading
    if cause:
        warn(
            f"changes of the lengths differ from those of the nominal design by {1e3 * base:.3g} mm, but only by "
            f"{1e3 * best:.3g} mm if {cause}",
            SuspectMeasurements,
        )
    elif "length_offsets" not in model.unknowns:
        _warn_of_constants(model.lengths(np.zeros(model.size), poses.as_matrix()) - lengths)


def _warn_of_constants(missing: FloatArray) -> None:
    """Warn of limbs whose lengths lack a constant; ``missing`` has shape (N, n), m."""
    middle = np.median(missing, axis=0)
    spread = np.median(np.abs(missing - middle), axis=0)
    constant = np.flatnonzero((np.abs(middle) > _CONSTANT) & (spread < _VARIES))
    if len(constant):
        said = ", ".join(f"limb {i + 1} by {1e3 * middle[i]:+.3g} mm" for i in constant.tolist())
        warn(
            f"lengths differ from the nominal ones by a constant: {said}; where they leave out an end fitting, or a "
            "sensor's zero is elsewhere, make length_offsets unknown",
            SuspectMeasurements,
        )


def _readings(poses: Rotation) -> Iterator[tuple[str, Rotation]]:
    """What the orientations may be instead."""
    theta, clinical = thesis_angles(poses), poses.as_euler("YXZ", suppress_warnings=True)
    flexion, abduction, turned = clinical.T
    x, y, z, w = poses.as_quat().T
    # The first component of the file came as x.
    yield "the quaternions have w first and were read as x, y, z, w", Rotation.from_quat(np.stack([y, z, w, x], axis=1))
    yield "the angles are in radians and were read as degrees", Rotation.from_euler("YXZ", np.degrees(clinical))
    for sign in (-1.0, 1.0):  # of a left and a right shoulder
        swapped = clinical[:, [1, 0, 2]] * [sign, sign, 1.0]
        yield "flexion and abduction are swapped", Rotation.from_euler("YXZ", swapped)
    yield "the orientations are inverted: they must take {O_B} to {O_A}", poses.inv()
    yield "the orientations are of the other side of the body: load the design with that side", mirrored(poses)
    yield (
        "angles in the order Y-X-Z (shoulder_rotation) were read as X-Y-Z (thesis_rotation)",
        Rotation.from_euler("YXZ", theta[:, [1, 0, 2]]),
    )
    yield (
        "angles in the order X-Y-Z (thesis_rotation) were read as Y-X-Z (shoulder_rotation)",
        thesis_rotation(abduction, flexion, turned),
    )


def _misfits(model: LengthModel, poses: Rotation, lengths: FloatArray) -> FloatArray:
    """Mean squares of differences between changes of limb i's predicted length and of column j, shape (n, n)."""
    predicted = model.lengths(np.zeros(model.size), poses.as_matrix())
    changes, measured = (each - each.mean(axis=0) for each in (predicted, lengths))
    return np.asarray(((changes[:, :, None] - measured[:, None, :]) ** 2).mean(axis=0))
