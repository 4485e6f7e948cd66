"""The workspace of a design: all criteria over a stack of poses."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_rotation
from ..design import Mechanism
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case import CentreOffset, CentrePath, Load
from ..load_case.case import Posture
from ..load_case.pose_stacks import pose_matrices
from ..study import adl_box
from .criteria import Criteria
from .device_values import values_of
from .evaluation import PoseOffsets
from .result import Workspace


@checked
def workspace(
    mechanism: Device | Mechanism,
    poses: Rotation | float | None = None,
    criteria: Criteria | Iterable[str] | None = None,
    load: Load | None = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    posture: Posture = None,
) -> Workspace:
    """Which poses a design can reach, hold and keep safe.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design; of a device that is not a wrist a pose takes milliseconds.
    poses : Rotation or float, optional
        Stack of shape (...), or the step, degrees, of the grid of daily activities; the grid of 4° with 19,656 poses
        of Appendix C if left out.
    criteria : Criteria or iterable of str, optional
        Which criteria, and their limits; all that the design's data allow if left out. The result names the others.
    load : Load, optional
        On the arm, besides its weight.
    centre_offset : CentreOffset, CentrePath or array_like, optional
        Where the device's centre lies, seen from the shoulder's, as in :meth:`exo_pin.ShoulderExo.reaction`: one, or
        one a pose. A centre path displaces the base by minus the motion of the shoulder, for a device whose frame the
        torso holds. Everything is computed in the displaced geometry, with moments about the shoulder's centre
        (:mod:`.evaluation`, which says where the torso is).
    posture : mapping or array_like, optional
        Values of idle joints, as in :meth:`exo_pin.ShoulderExo.reaction`.

    Returns
    -------
    Workspace

    Raises
    ------
    MissingData
        If a criterion that is named needs what the design does not have.
    InvalidInput, UnknownName
        If an argument does not fit.

    Notes
    -----
    The kernels are compiled: 19,656 poses take milliseconds. Tensions are those within the limits that make |F_s|
    least, without side forces of the limbs (g = 0). The arm is at rest; limbs with mass put their weight on it as in
    :meth:`exo_pin.ShoulderExo.reaction`.

    Source: thesis (C-1), Table 5-6.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> found = ep.workspace.workspace(exo.mechanism, 10.0, criteria=["shoulder_range"])
    >>> share = exo.mechanism.shoulder.allows(found.poses).mean()  # |θx - 90°| + |θz| < 95° of Table 5-6
    >>> round(float(found.index), 3), round(float(share), 3)
    (0.603, 0.603)
    """
    limits = Criteria.of(criteria)
    if poses is None or (isinstance(poses, (int, float)) and not isinstance(poses, bool)):
        orientations, matrices = _grid(4.0 if poses is None else float(poses), mechanism.side)
        shape: tuple[int, ...] = orientations.shape
    else:
        orientations = as_rotation("poses", poses)
        shape, matrices = pose_matrices(orientations)
    if matrices.size == 0:
        raise InvalidInput("expected at least one pose, got an empty stack")
    device = as_device(mechanism)
    names, left_out = limits.chosen(device, len(shape) == 3)
    offsets = PoseOffsets.of(centre_offset, orientations)
    values = values_of(device, matrices, limits, names, load, offsets, shape, posture)

    def stacked(array: FloatArray) -> FloatArray:
        return np.ascontiguousarray(array).reshape((*shape, *array.shape[1:]))

    return Workspace(
        mechanism.name,
        mechanism.side,
        orientations,
        limits,
        MappingProxyType({name: stacked(margin) for name, margin in values.margins.items()}),
        MappingProxyType(left_out),
        stacked(values.lengths),
        stacked(values.margin),
        stacked(values.tensions),
        stacked(values.shoulder),
        stacked(values.gaps),
        None if centre_offset is None else CentreOffset(*(stacked(side) for side in offsets.spread(len(matrices)))),
        limits.wearers_of(device),
        values.stroke_unit,
        values.posture,
    )


@functools.lru_cache(maxsize=8)
def _grid(step: float, side: str) -> tuple[Rotation, FloatArray]:
    """The grid of daily activities and its matrices, shape (N, 3, 3): made once, because that takes longer than use."""
    poses = adl_box(step, side)
    # Writable, for the kernels are compiled for such arrays; nobody else holds it.
    return poses, pose_matrices(poses)[1]
