"""A ring of joints as a rigid whole: how far it is displaced and turned from its nominal place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..core.validation import FloatArray, ReadOnly
from .information import Information
from .length_model import LengthModel

#: Joints nearer to one line than this part of their distances do not show how the ring is turned.
_ON_A_LINE = 1e-3


@dataclass(frozen=True, eq=False)
class RingPosition(ReadOnly):
    """Least-squares displacement of a ring of joints, to first order in the turn.

    Attributes
    ----------
    translation : ndarray
        Shape (3,), m: of the device's centre, which the ring carries.
    turn : ndarray
        Shape (3,), rad, rotation vector about that centre; zero if the joints lie on a line.
    covariance : ndarray
        Shape (6, 6), of translation and turn, from the errors of the joints as measured and from how much they differ
        from a rigid ring; infinite and NaN where they are not determined.
    """

    translation: FloatArray
    turn: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, model: LengthModel, values: FloatArray, information: Information, ring: str) -> RingPosition:
        """Of the ring ``"base"`` or ``"platform"``; of its offset, where that is an unknown of its own."""
        is_base = ring == "base"
        points, offset = ("base_points", "base_offset") if is_base else ("platform_points", "cuff_offset")
        nominal = model.base if is_base else model.platform
        covariance = np.zeros((6, 6))
        if offset in model.places:
            covariance[:3, :3] = information.spread(np.eye(model.size)[model.places[offset]])
        if offset in model.places or points not in model.places:
            return cls(model.group(offset, values), np.zeros(3), covariance)
        moved, rigid = values[model.places[points]], _rigid(nominal)
        fit = np.linalg.pinv(rigid)
        found = fit @ moved
        rows = np.zeros((len(found), model.size))
        rows[:, model.places[points]] = fit
        turn = found[3:] if len(found) == 6 else np.zeros(3)
        scatter = float(((moved - rigid @ found) ** 2).sum()) / (len(moved) - len(found))
        covariance[: len(found), : len(found)] = information.spread(rows) + scatter * fit @ fit.T
        return cls(found[:3], turn, covariance)


def _rigid(points: FloatArray) -> FloatArray:
    """Displacements of points by a translation and a small turn, shape (3 n, 6), or (3 n, 3) for points on a line."""
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    shifts = np.tile(np.eye(3), (len(points), 1))
    if sizes[1] < _ON_A_LINE * sizes[0]:
        return shifts
    return np.concatenate([shifts, np.concatenate([-pin.skew(point) for point in points])], axis=1)
