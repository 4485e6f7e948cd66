"""Ranges of shoulder motion in daily life, as published, in clinical angles.

Source: thesis Table 2-1.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_angles, shoulder_rotation
from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite, as_positive, set_fields


@dataclass(frozen=True)
class RangeOfMotion:
    """A box of shoulder angles, intrinsic Y-X-Z, all positive as named.

    Attributes
    ----------
    name : str
        What it is the range of.
    flexion_deg, abduction_deg, internal_rotation_deg : tuple of float
        Lowest and highest, degrees.
    source : str
        Where it was published.

    Examples
    --------
    >>> reach = ep.load_case.RangeOfMotion("reach", (0, 90), (0, 30), (0, 0))
    >>> reach.intervals
    ((0.0, 90.0), (0.0, 30.0), (0.0, 0.0))
    """

    name: str
    flexion_deg: tuple[float, float]
    abduction_deg: tuple[float, float]
    internal_rotation_deg: tuple[float, float]
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("flexion_deg", "abduction_deg", "internal_rotation_deg"):
            low, high = as_finite(name, getattr(self, name), (2,)).tolist()
            if not -360.0 <= low <= high <= 360.0:
                raise InvalidInput(f"expected {name} as (lowest, highest) in degrees, got ({low:g}, {high:g})")
            set_fields(self, **{name: (low, high)})

    @property
    def intervals(self) -> tuple[tuple[float, float], ...]:
        """The three intervals, degrees, in the order flexion, abduction, internal rotation."""
        return self.flexion_deg, self.abduction_deg, self.internal_rotation_deg

    def axes(self, step_deg: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angles from lowest to highest, both ends included.

        Parameters
        ----------
        step_deg : float
            Largest step, degrees; the steps of one angle are equal.

        Returns
        -------
        tuple of ndarray
            Flexion, abduction and internal rotation, degrees.

        Examples
        --------
        >>> [len(angles) for angles in ep.load_case.ADL_BOX.axes(30)]
        [5, 5, 5]
        """
        step = as_positive("step_deg", step_deg)
        first, second, third = (
            np.linspace(low, high, int(np.ceil((high - low) / step - 1e-9)) + 1) for low, high in self.intervals
        )
        return first, second, third

    def poses(self, step_deg: float, side: str = "left") -> Rotation:
        """The grid of :meth:`axes`.

        Parameters
        ----------
        step_deg : float
            Largest step, degrees.
        side : {"left", "right"}
            Whose shoulder.

        Returns
        -------
        scipy.spatial.transform.Rotation
            A stack of shape (flexions, abductions, rotations).

        Examples
        --------
        >>> ep.load_case.ADL_BOX.poses(30).shape
        (5, 5, 5)
        """
        return grid_rotation(*self.axes(step_deg), side=side)


def grid_rotation(flexion: FloatArray, abduction: FloatArray, internal: FloatArray, side: str = "left") -> Rotation:
    """Orientations over a grid of angles in degrees, shape (nf, na, ni); single turns are made once and multiplied."""
    first = shoulder_rotation(flexion[:, None, None], 0.0, 0.0, side, degrees=True)
    second = shoulder_rotation(0.0, abduction[:, None], 0.0, side, degrees=True)
    return first * second * shoulder_rotation(0.0, 0.0, internal, side, degrees=True)


#: What the mechanism is meant to cover: the summarised range of Table 2-1, of which Appendix C makes its grid.
ADL_BOX = RangeOfMotion(
    "daily-life box", (0.0, 110.0), (-4.0, 96.0), (-20.0, 85.0), "Table 2-1, summarised range; Appendix C"
)

#: Three published ranges of daily tasks.
DAILY_RANGES = (
    # Printed "-20.1 to -39.7" for abduction; every other cell runs from low to high, so the second sign is a slip.
    RangeOfMotion(
        "ten daily tasks (Murray & Johnson)",
        (14.7, 111.9),
        (-20.1, 39.7),
        (18.7, 85.9),
        "Table 2-1, first row; Murray & Johnson 2004",
    ),
    RangeOfMotion(
        "daily tasks (Buckley et al.)", (7.0, 108.0), (15.0, 96.0), (-20.0, 85.0), "Table 2-1, third row; Buckley 1996"
    ),
    RangeOfMotion("feeding (Safaee-Rad et al.)", (5.0, 45.0), (5.0, 35.0), (5.0, 25.0), "Safaee-Rad et al. 1990"),
)


#: Difference of a stack of poses from a grid above which it is none.
_SAME = 1e-9

#: Step of the coarser grids, from whose spread the error is estimated, in steps of the grid.
_COARSER = 3

Axes = tuple[FloatArray, FloatArray, FloatArray]


class Share(float):
    """A share of a volume of the rotation group, 0 to 1, with the estimate of its error.

    Attributes
    ----------
    error : float
        Estimate of the distance from the true share; NaN where the grid is too small for one.
    """

    error: float

    def __new__(cls, value: float, error: float) -> Share:
        """Make a share of a number and its error."""
        own = super().__new__(cls, value)
        own.error = float(error)
        return own

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (float(self), self.error)

    def __repr__(self) -> str:
        return f"Share({float(self):.6g}, error={self.error:.2g})"

    @property
    def percent(self) -> str:
        """In percent with its error, where there is an estimate: "89.2 ± 0.3 %"."""
        return f"{100.0 * self:.1f}{'' if np.isnan(self.error) else f' ± {100.0 * self.error:.1f}'} %"


def _sine_integral(angles: FloatArray) -> FloatArray:
    """∫ |cos| from zero to angles, rad: beyond 90° two triples of angles are one pose, and the cosine changes sign."""
    turns = np.floor(angles / np.pi + 0.5)
    return 2.0 * turns + np.sin(angles - turns * np.pi)


def cell_volumes(axes: Axes, whole: Axes | None = None) -> FloatArray:
    """Volume of the cell of each node, as a share of all cells together, shape (nf, na, ni).

    Cells end halfway between nodes, and at the ends of the grid.

    Parameters
    ----------
    axes : tuple of ndarray
        Flexion, abduction and internal rotation, each rising or falling, degrees. An axis of one node has no width and
        does not count.
    whole : tuple of ndarray, optional
        Grid to whose ends the cells reach, if this is a coarser one of its nodes.
    """
    volumes = np.ones(())
    for k, (nodes, full) in enumerate(zip(axes, axes if whole is None else whole, strict=True)):
        ends = np.radians(np.concatenate([full[:1], 0.5 * (nodes[1:] + nodes[:-1]), full[-1:]]))
        size = np.abs(np.diff(_sine_integral(ends) if k == 1 else ends))
        volumes = volumes[..., None] * (size / size.sum() if size.sum() > 0.0 else np.full(len(size), 1.0 / len(size)))
    return volumes


def share_of_volume(member: NDArray[np.bool_], axes: Axes) -> Share:
    """Share of the volume of a grid that belongs to a set.

    Parameters
    ----------
    member : ndarray of bool
        Shape (nf, na, ni): nodes that belong to it.
    axes
        As in :func:`cell_volumes`.
    """
    value = float((cell_volumes(axes) * member).sum())
    coarse = []
    steps = [_COARSER if len(nodes) >= 2 * _COARSER else 1 for nodes in axes]
    for starts in product(*map(range, steps)):
        rows = tuple(slice(first, None, step) for first, step in zip(starts, steps, strict=True))
        flexion, abduction, internal = (nodes[row] for nodes, row in zip(axes, rows, strict=True))
        coarse.append(float((cell_volumes((flexion, abduction, internal), axes) * member[rows]).sum()))
    return Share(value, 0.5 * (max(coarse) - min(coarse)) if len(coarse) > 1 else float("nan"))


def grid_axes(poses: Rotation, side: str) -> Axes | None:
    """Axes of a stack of poses that is a grid of shoulder angles, degrees; None if it is none.

    Parameters
    ----------
    poses : Rotation
        Shape (nf, na, ni).
    side : {"left", "right"}
        Side of the body.
    """
    if len(poses.shape) != 3 or 0 in poses.shape:
        return None
    quats = poses.as_quat()
    line = shoulder_angles(Rotation.from_quat(quats[0, :, 0]), side, degrees=True)
    # The middle angle farthest from 90° distinguishes the two others best.
    best = int(np.abs(np.cos(np.radians(line[:, 1]))).argmax())
    # Two triples of angles are one pose; a grid may lead beyond 90°, where the usual triple is the other one.
    beyond = np.cos(np.radians(line[:, 0] - line[best, 0])) < 0.0
    abduction = np.where(beyond, 180.0 - line[:, 1], line[:, 1])
    flexion = shoulder_angles(Rotation.from_quat(quats[:, best, 0]), side, degrees=True)[:, 0]
    internal = shoulder_angles(Rotation.from_quat(quats[0, best, :]), side, degrees=True)[:, 2]
    axes = flexion, abduction, internal
    if any((nodes[1:] == nodes[:-1]).any() or len(set(np.sign(np.diff(nodes)))) > 1 for nodes in axes):
        return None
    apart = np.abs((grid_rotation(*axes, side=side).as_quat() * quats).sum(axis=-1))
    return axes if (apart >= 1.0 - _SAME).all() else None
