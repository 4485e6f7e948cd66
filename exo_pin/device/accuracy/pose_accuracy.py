"""How well the drives of a device place the arm, and which other pose looks the same to them.

Drives move at the rates J of their positions, J ω for an angular velocity ω of the arm. The least singular value of J
is the weakest rate: about that axis a degree of the arm moves the drives least, and an error of a drive turns the arm
most. Where it is small over a long way, or lengths return to what they were, other poses far away look alike: twins, in
which drives that follow their positions settle as well.

Poses are twins if the drives' differences, each over its tolerance, have a root mean square of at most 1. The tolerance
of a drive is its play and its resolution; where neither is stated, what makes 2 mm as the root of the sum of squares
over all drives that slide, and 0.5° of a hinge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.results import Result
from ...core.tables import percent
from ...core.validation import FloatArray, ReadOnly
from ...design import WristGeometry
from ...load_case.pose_stacks import as_query, pose_matrices
from ...wrist.singularities.measures import centre_shift
from ..device_singularity import placed_readings
from ..equilibrium import device_equilibrium
from ..protocol import Device
from .hand_stiffness import hand_stiffness
from .twins import SPACING, TWIN_ANGLE, WIDE_SPACING, Twins, find_twins

#: Of drives that state neither play nor resolution: of all that slide together, m, and of a hinge, rad.
LENGTHS, HINGE = 2e-3, float(np.radians(0.5))
#: Weakest rate, mm/° or °/°, below which drives are said not to place the arm, and difference half way to a twin, in
#: tolerances, up to which an arm may come to it.
WEAK, _EASY = 0.3, 3.0
#: Turn over an error of the drives, °/mm or °/°, above which they leave the arm free.
_ANY_TURN = 180.0
#: How far the hand moves at most for a small turn, mm.
_FAR = 100.0
#: Tolerance of drives whose play and resolution are stated as zero, m or rad: what is below it is rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class PoseAccuracy(Result, ReadOnly):
    """How well drives place the arm in poses of shape (...), n drives.

    Attributes
    ----------
    rate : ndarray
        Weakest rate, shape (...): least change of the drives' positions, root of the sum of squares, over the turn of
        the arm; m/rad, or rad/rad of a device with hinges as drives, whose slides count over their mean lever. Of a
        device that does not hold the arm about every axis, among the axes about which it does. NaN out of reach.
    axis : ndarray
        Of that turn, shape (..., 3), base frame.
    has_hinges : bool
        Whether rates are rad/rad.
    twin_difference : ndarray
        Shape (...): of the pose at least ``least_angle`` away and within the range of motion that looks most alike,
        the root mean square of the drives' differences over their tolerances: a twin if at most 1. Infinite where
        none was found or looked for.
    twin_angle : ndarray
        How far away that pose is, shape (...), rad; NaN where there is none.
    twin_matrices : ndarray
        Its orientation, shape (..., 3, 3).
    barrier : ndarray
        Root mean square as of ``twin_difference`` half way to that pose, shape (...): where it is large, the drives
        keep the arm from it.
    differences : ndarray
        What the drives' positions differ by, shape (..., n), m or rad.
    free_turn : ndarray
        Largest turn that play and resolution of the drives leave to the arm, to either side, shape (...), rad; NaN
        where they are not stated.
    hand_stiffness : ndarray
        Shape (...), N/m: force at the hand over what it gives way, drives locked, in the direction in which it gives
        way most, for the soft cuff of the design or one as measured (:mod:`.hand_stiffness`); NaN where nobody wears
        the device, and of devices without limbs between two joint centres.
    side : {"left", "right"}
        Side of the body, for the angles.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = exo.accuracy(exo.pose(80))
    >>> round(float(found.mm_per_degree), 2), round(float(np.degrees(found.twin_angle)), 1)
    (0.25, 18.5)
    """

    rate: FloatArray
    axis: FloatArray
    has_hinges: bool
    twin_difference: FloatArray
    twin_angle: FloatArray
    twin_matrices: FloatArray
    barrier: FloatArray
    differences: FloatArray
    free_turn: FloatArray
    hand_stiffness: FloatArray
    side: str

    _per_row = "rate"
    _derived = ("mm_per_degree", "degrees_per_mm")

    @property
    def has_twin(self) -> NDArray[np.bool_]:
        """Shape (...): whether a pose far away looks the same to the drives."""
        return np.asarray(self.twin_difference <= 1.0)

    @property
    def mm_per_degree(self) -> FloatArray:
        """Weakest rate, shape (...), mm/°; of a device with hinges as drives °/°."""
        return self.rate * (1.0 if self.has_hinges else 1e3 * np.pi / 180.0)

    @property
    def degrees_per_mm(self) -> FloatArray:
        """Turn of the arm about its worst axis over an error of the drives, shape (...), °/mm, or °/°."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.mm_per_degree)

    @property
    def is_doubtful(self) -> NDArray[np.bool_]:
        """Shape (...): whether the drives alone do not place the arm: weak rates, or a twin that it may come to."""
        return np.asarray((self.has_twin & (self.barrier < _EASY)) | (self.mm_per_degree < WEAK))

    def sensitivity(self, row: int = 0) -> str:
        """What an error of the drives does in one of the poses, and which pose looks the same, in words.

        Parameters
        ----------
        row : int
            Of the poses, counted over all dimensions.

        Returns
        -------
        str

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> print(exo.accuracy(exo.pose(80)).sensitivity())
        1 mm of the drives turns the arm by 4.1°, and a pose 18.5° away has the same positions to 0.34 mm
        """
        unit, scale = ("°", 180.0 / np.pi) if self.has_hinges else (" mm", 1e3)
        turn = self.degrees_per_mm.flat[row]
        # Beyond half a turn the linear law says no more than that nothing places the arm.
        grows = f"by {turn:.2g}°" if turn <= _ANY_TURN else "freely about one axis"
        text = f"1{unit} of the drives turns the arm {grows}"
        if not self.has_twin.flat[row]:
            return text
        off = scale * np.linalg.norm(self.differences.reshape(-1, self.differences.shape[-1])[row])
        away = np.degrees(self.twin_angle.flat[row])
        return f"{text}, and a pose {away:.1f}° away has the same positions to {off:.2f}{unit}"

    def __str__(self) -> str:
        rates = np.asarray(self.mm_per_degree)
        known = rates[np.isfinite(rates)]
        if not known.size:
            return "How well the drives place the arm is not known here."
        if self.rate.ndim:
            twins = f"twins of {percent(float(self.has_twin.mean()), 0)} of the poses"
            return f"weakest rate {known.min():.2g} to {known.max():.2g} {self.unit}; {twins}"
        text = f"The weakest rate of the drives is {float(self.mm_per_degree):.2g} {self.unit}: {self.sensitivity()}."
        if np.isfinite(self.free_turn):
            text += f" Play and resolution leave the arm {np.degrees(self.free_turn):.2g}° to either side."
        if self.has_twin:
            text += " A sensor of the arm's orientation tells them apart."
        if np.isfinite(self.hand_stiffness):
            gives = 1e3 / float(self.hand_stiffness)
            much = f"by {gives:.2g} mm" if gives < _FAR else f"by more than {_FAR:.0f} mm"
            text += f" While the drives stand, a soft cuff lets 1 N at the hand move it {much}."
        return text

    @property
    def unit(self) -> str:
        """Of :attr:`mm_per_degree`."""
        return "°/°" if self.has_hinges else "mm/°"


def tolerances(device: Device) -> FloatArray:
    """Share of the tolerance of each drive, shape (n,), m or rad: twins differ by 1, root of the sum of squares."""
    drives, turning = device.drives, are_hinges(device)
    stated = [(each.play or 0.0) + (each.resolution or 0.0) if _is_stated(each) else np.nan for each in drives]
    own = np.array(stated, dtype=np.float64)
    slides = np.isnan(own) & ~turning
    own[slides] = LENGTHS / np.sqrt(max(1, slides.sum()))
    own[np.isnan(own)] = HINGE
    return np.asarray(np.maximum(own, _ROUNDING) * np.sqrt(len(own)))


def _is_stated(drive: Any) -> bool:
    return drive is not None and not (drive.play is None and drive.resolution is None)


def are_hinges(device: Device) -> NDArray[np.bool_]:
    """Shape (n,): drives in hinges, whose effort is a moment."""
    count = len(device.drives)
    units = [unit for _, unit in device.drive_units[:count]]
    return np.array([unit != "N" for unit in units], dtype=bool)


def limb_readings(
    geometry: WristGeometry, matrices: FloatArray, base: FloatArray | float = 0.0, cuff: FloatArray | float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Lengths (N, n) of limbs and their rates (N, n, 3), m and m/rad, with offsets of the device's centre (N, 3), m."""
    a = geometry.base_points + np.asarray(base)[..., None, :] if np.ndim(base) else geometry.base_points
    p = geometry.platform_points + np.asarray(cuff)[..., None, :] if np.ndim(cuff) else geometry.platform_points
    b = p @ matrices.mT
    span = b - a
    lengths = np.linalg.norm(span, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return lengths, np.cross(b, span / lengths[..., None])


def weakest_rates(device: Device, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weakest rates (N,) and axes (N, 3) of rates (N, n, 3); NaN where they are not known or nothing is driven."""
    count, held = len(rates), min(device.driven_moments, rates.shape[1])
    value, axis = np.full(count, np.nan), np.full((count, 3), np.nan)
    known = np.isfinite(rates).all(axis=(1, 2))
    if held == 0 or not known.any():
        return value, axis
    own, turning = rates[known], are_hinges(device)
    if turning.any():
        # Slides beside hinges over their mean lever, as in the margin.
        own = own / np.array(device.as_chain().structure.scales[: own.shape[1]])[:, None]
    _, values, directions = np.linalg.svd(own, full_matrices=False)
    value[known], axis[known] = values[:, held - 1], directions[:, held - 1]
    return value, axis


def _free_turn(device: Device, rates: FloatArray) -> FloatArray:
    """See :attr:`PoseAccuracy.free_turn`, shape (N,)."""
    if not all(map(_is_stated, device.drives)):
        return np.full(len(rates), np.nan)
    half = [0.5 * max((each.play or 0.0) + (each.resolution or 0.0), _ROUNDING) for each in device.drives]
    rows = rates / np.array(half)[:, None]
    return np.where(np.isfinite(rows).all(axis=(1, 2)), centre_shift(np.nan_to_num(rows)), np.nan)


def pose_accuracy(device: Device, poses: Rotation, twins: bool = True, least_angle: float = TWIN_ANGLE) -> PoseAccuracy:
    """How well the drives of a device place the arm.

    Parameters
    ----------
    device : Device
        Of any kind.
    poses : Rotation
        Single, or a stack of shape (...).
    twins : bool
        Whether to look for twins; of a device whose drives do not hold the arm about every axis, there are none to be
        looked for.
    least_angle : float
        Angle from which a pose is a twin, rad.
    """
    shape, matrices = pose_matrices(poses)
    matrices = np.array(matrices)
    record = device.accelerate("rates")

    def readings(asked: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        if record is not None:
            return limb_readings(record.geometry, asked)
        chain = device.as_chain()
        return placed_readings(chain, device_equilibrium(chain, as_query(Rotation.from_matrix(asked))))

    count, n, own = len(matrices), len(device.drives), np.arange(len(matrices))
    share = tolerances(device)
    positions, rates = readings(matrices, own)
    value, axis = weakest_rates(device, rates)
    found = Twins(np.full(count, np.inf), np.full((count, 3, 3), np.nan))
    if twins and device.driven_moments == 3 and count:
        spacing = WIDE_SPACING if record is None else SPACING
        found = find_twins(readings, matrices, share, device.side, least_angle, spacing)
    there = np.isfinite(found.difference)
    angle, barrier, differences = np.full(count, np.nan), np.full(count, np.nan), np.full((count, n), np.nan)
    if there.any():
        turn = Rotation.from_matrix(found.matrices[there] @ matrices[there].mT)
        angle[there] = turn.magnitude()
        differences[there] = readings(found.matrices[there], own[there])[0] - positions[there]
        half = Rotation.from_rotvec(0.5 * turn.as_rotvec()).as_matrix() @ matrices[there]
        barrier[there] = np.linalg.norm((readings(half, own[there])[0] - positions[there]) / share, axis=1)

    def stacked(array: FloatArray) -> FloatArray:
        return array.reshape((*shape, *array.shape[1:]))

    return PoseAccuracy(
        stacked(value),
        stacked(axis),
        bool(are_hinges(device).any()),
        stacked(found.difference),
        stacked(angle),
        stacked(found.matrices),
        stacked(barrier),
        stacked(differences),
        stacked(_free_turn(device, rates)),
        stacked(np.full(count, np.nan) if record is None else hand_stiffness(device, record, matrices, rates)),
        device.side,
    )
