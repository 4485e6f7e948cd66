"""Poses that are reached from rest without a singular pose.

The share of each daily range of motion beyond the singular surface.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, as_rotation
from ...design import WristGeometry
from ...load_case.ranges_of_motion import (
    ADL_BOX,
    DAILY_RANGES,
    RangeOfMotion,
    Share,
    cell_volumes,
    grid_rotation,
    share_of_volume,
)
from .measures import locus_function

#: The locus function, of order one, is zero to rounding below this.
_SINGULAR = 1e-12


#: |det X| below which a pose of a daily range counts as close to the locus.
CLOSE = 0.05


def side_of_rest(geometry: WristGeometry) -> int:
    """Side of the singular surface of the hanging arm: the sign of det X there, 0 if that pose is singular."""
    value = float(locus_function(geometry, Rotation.identity())[0])
    return 0 if abs(value) < _SINGULAR else int(np.sign(value))


@dataclass(frozen=True, eq=False)
class FreeRegion:
    """The connected, singularity-free part of the rotation group that holds a starting pose.

    Attributes
    ----------
    axes : tuple of ndarray
        Grid of flexion, abduction and internal rotation, degrees.
    inside : ndarray of bool
        Shape (nf, na, ni): nodes of the grid that belong to it.
    share : Share
        Its share of the volume of the grid on the rotation group, with the estimate of its error.
    components : int
        Number of connected parts, on both sides together, that take more than a thousandth of the volume each: between
        sheets closer than the step of the grid there are spurious parts.
    side : str
        Side of the body.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> part = wrist.free_region(ep.load("prototype").geometry, step_deg=10.0)
    >>> round(float(part.share), 2), part.components  # of all orientations; parts on both sides
    (0.5, 2)
    """

    geometry: WristGeometry
    axes: tuple[FloatArray, FloatArray, FloatArray]
    inside: NDArray[np.bool_]
    share: Share
    components: int
    side: str
    sign: float = 1.0

    def contains(self, poses: Rotation) -> NDArray[np.bool_]:
        """Which poses can be reached from the start without a singular pose on the way.

        A pose belongs to the part if it is on the same side of the locus and a corner of its cell of the grid
        belongs to it.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        ndarray of bool
            Shape (...).

        Examples
        --------
        >>> from exo_pin import wrist
        >>> exo = ep.load("prototype")
        >>> part = wrist.free_region(exo.geometry, step_deg=15.0)
        >>> part.contains(exo.pose(abduction=[0, 5, 30])).tolist()  # the surface is crossed at 6.21°
        [True, True, False]
        """
        smooth, _ = locus_function(self.geometry, poses)
        angles = shoulder_angles(poses, self.side, degrees=True)
        found = np.zeros(smooth.shape, dtype=bool)
        place = [(angles[..., k] - axis[0]) / (axis[1] - axis[0]) for k, axis in enumerate(self.axes)]
        for corner in np.ndindex(2, 2, 2):
            nodes = tuple(np.floor(at + 1e-9).astype(int) + step for at, step in zip(place, corner, strict=True))
            found |= self.inside.ravel()[np.ravel_multi_index(nodes, self.inside.shape, mode=("wrap", "clip", "wrap"))]
        return np.asarray(found & (np.sign(smooth) == self.sign))


@checked
def free_region(
    geometry: WristGeometry, start: Rotation | None = None, step_deg: float = 5.0, side: str = "left"
) -> FreeRegion:
    """Find the connected, singularity-free part that holds a pose.

    Neighbouring nodes of a grid are connected if they are on the same side of the locus. The grid of the rotation group
    closes on itself in flexion and rotation, and at ±90° of abduction, where only the sum or difference of the two
    counts, nodes that are one pose are joined.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    start : Rotation, optional
        A single pose; the hanging arm if left out.
    step_deg : float
        Of the grid, degrees; it must divide 90. Sheets closer together may be missed.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    FreeRegion

    Raises
    ------
    InvalidInput
        For other than three limbs, a start that is singular, or a step that does not fit.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype")
    >>> here, there = (wrist.free_region(exo.geometry, exo.pose(0, angle), step_deg=15.0) for angle in (0, 30))
    >>> round(float(here.share + there.share), 2)  # the two sides of the surface are all there is
    1.0
    """
    pose = Rotation.identity() if start is None else as_rotation("start", start)
    if pose.shape != ():
        raise InvalidInput(f"expected start to be a single rotation, got shape {pose.shape}")
    here = float(locus_function(geometry, pose)[0])
    if abs(here) < _SINGULAR:
        raise InvalidInput("the start is a singular pose: it belongs to neither side")
    step = as_positive("step_deg", step_deg)
    quarter = round(90.0 / step)
    if abs(quarter * step - 90.0) > 1e-9:
        raise InvalidInput(f"expected a step that divides 90 degrees, got {step:g}")
    circle = np.asarray(np.arange(4 * quarter) * step - 180.0, dtype=np.float64)
    half = np.asarray(np.arange(2 * quarter + 1) * step - 90.0, dtype=np.float64)
    axes = (circle, half, circle)
    smooth, _ = locus_function(geometry, grid_rotation(*axes, side))
    labels = _components(np.sign(smooth))
    volumes = cell_volumes(axes, closed=True)
    parts = np.bincount(labels[labels >= 0], weights=volumes[labels >= 0])
    count = int((parts > 1e-3).sum())
    # A trial region of all nodes on the side of the start gives the corners of its cell.
    sign = float(np.sign(here))
    region = FreeRegion(geometry, axes, smooth * sign > 0, Share(1.0, 0.0), count, side, sign)
    inside = labels == _label_of(region, labels, pose)
    return replace(region, inside=inside, share=share_of_volume(inside, axes, closed=True))


def _label_of(region: FreeRegion, labels: NDArray[np.int64], pose: Rotation) -> int:
    """Label of the part that a pose belongs to: that of the nearest node on its side."""
    nodes = np.argwhere(region.inside)
    if len(nodes) == 0 or not region.contains(pose):
        raise InvalidInput("the grid is too coarse to resolve the side of the start")
    angles = [axis[nodes[:, k]] for k, axis in enumerate(region.axes)]
    quats = shoulder_rotation(angles[0], angles[1], angles[2], region.side, degrees=True).as_quat()
    return int(labels[tuple(nodes[np.abs(quats @ pose.as_quat()).argmax()])])


def _components(sign: FloatArray) -> NDArray[np.int64]:
    """Label the connected parts of equal sign; nodes on the locus belong to none."""
    index = np.arange(sign.size).reshape(sign.shape)
    pairs = []

    def join(a: NDArray[np.int64], b: NDArray[np.int64]) -> None:
        flat = sign.ravel()
        same = (flat[a.ravel()] == flat[b.ravel()]) & (flat[a.ravel()] != 0)
        pairs.append(np.stack([a.ravel()[same], b.ravel()[same]]))

    for axis in (0, 2):
        join(index, np.roll(index, -1, axis=axis))
    join(index[:, :-1], index[:, 1:])
    # At +90° of abduction turning by flexion and rotation is about one axis, against each other; at -90° with.
    for end, way in ((-1, 1), (0, -1)):
        pole = index[:, end, :]
        join(pole, np.roll(np.roll(pole, -1, axis=0), -way, axis=1))
    rows, columns = np.concatenate(pairs, axis=1)
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(sign.size, sign.size))
    _, labels = connected_components(graph, directed=False)
    return np.where(sign.ravel() != 0, labels, -1).reshape(sign.shape)


@dataclass(frozen=True, eq=False)
class RangeCrossing:
    """Shares of the volume of a range of motion on either side of the singular surface, with their errors.

    Attributes
    ----------
    range : RangeOfMotion
        The range.
    across : Share
        Share of it on the other side of the locus than the rest pose.
    unreachable : Share
        Share that cannot be reached from rest without passing a singular pose; at least ``across``.
    close : Share
        Share with |det X| below 0.05.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.daily_crossings(ep.load("optimised-table-c-2").geometry, step_deg=15.0)[0]
    >>> found.range.name, bool(found.unreachable >= found.across)
    ('daily-life box', True)
    """

    range: RangeOfMotion
    across: Share
    unreachable: Share
    close: Share


@checked
def daily_crossings(
    geometry: WristGeometry,
    ranges: Iterable[RangeOfMotion] = (ADL_BOX, *DAILY_RANGES),
    step_deg: float = 5.0,
    side: str = "left",
    start: Rotation | None = None,
) -> list[RangeCrossing]:
    """Share of each range on the other side of the singular surface than the rest pose.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    ranges : iterable of RangeOfMotion
        The ranges.
    step_deg : float
        Of the grids, degrees; must divide 90.
    side : {"left", "right"}
        Side of the body.
    start : Rotation, optional
        The rest pose; the hanging arm if left out.

    Returns
    -------
    list of RangeCrossing

    Raises
    ------
    InvalidInput
        As :func:`free_region`.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> crossings = wrist.daily_crossings(ep.load("prototype").geometry, step_deg=15.0)
    >>> round(float(crossings[0].across), 1)  # of the box of daily life, beyond the singular surface
    0.4
    """
    region = free_region(geometry, start, step_deg, side)
    found = []
    for item in ranges:
        poses = item.poses(step_deg, side)
        smooth, determinant = locus_function(geometry, poses)
        sets = (np.sign(smooth) != region.sign, ~region.contains(poses), np.abs(np.nan_to_num(determinant)) < CLOSE)
        found.append(RangeCrossing(item, *(share_of_volume(member, item.axes(step_deg)) for member in sets)))
    return found
