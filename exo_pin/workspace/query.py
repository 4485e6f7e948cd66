"""Workspaces of a design: over a stack of poses, over daily tasks as in Table 5-7, and over persons.

A published range is a box of angles, not a movement: its corners may be poses that nobody takes in the task, so its
share says less than that of a movement. The table labels them.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike, fspath
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, SuspectMeasurements
from ..core.errors.base import warn
from ..core.errors.checked import checked
from ..core.progress import mapped
from ..core.validation import FloatArray, as_rotation, require_method, require_type
from ..design import Mechanism, Wearer
from ..device.device_singularity import device_jacobian
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case import CentreOffset, CentrePath, Load, Movement, read_movement
from ..load_case.case import Posture
from ..load_case.pose_stacks import pose_matrices
from ..load_case.ranges_of_motion import DAILY_RANGES, RangeOfMotion
from ..study import StudyTable, adl_box
from ..wrist import limb_jacobian
from .criteria import Criteria
from .device_values import values_of
from .evaluation import PoseOffsets
from .result import Workspace

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..exo.shoulder_exo import ShoulderExo


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
    >>> round(float(found.index), 3)  # of the poses within |θx - 90°| + |θz| < 95° of Table 5-6
    0.603
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
        device.drive_units,
    )


@functools.lru_cache(maxsize=8)
def _grid(step: float, side: str) -> tuple[Rotation, FloatArray]:
    """The grid of daily activities and its matrices, shape (N, 3, 3): made once, because that takes longer than use."""
    poses = adl_box(step, side)
    # Writable, for the kernels are compiled for such arrays; nobody else holds it.
    return poses, pose_matrices(poses)[1]


@checked
def task_reach(
    mechanism: Device | Mechanism,
    movements: Mapping[str, Movement | str | PathLike[str]] | None = None,
    ranges: Iterable[RangeOfMotion] = DAILY_RANGES,
    criteria: Criteria | Iterable[str] | None = None,
    step: float = 8.0,
) -> StudyTable:
    """Share of the poses of daily tasks that are inside the workspace.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design; of a device that is not a wrist a pose takes milliseconds.
    movements : mapping of str to Movement or path, optional
        By name of the task: movements, or recordings (:func:`exo_pin.read_movement`).
    ranges : iterable of RangeOfMotion
        Published ranges.
    criteria : Criteria or iterable of str, optional
        As in :func:`exo_pin.workspace.workspace`; "connected" needs a grid and is left out of movements.
    step : float
        Of the grid over a range, degrees.

    Returns
    -------
    StudyTable
        One row a task: ``task``; ``data``, "movement" or "published range"; ``poses``; ``inside``, the share of the
        poses that are inside; ``limited_by``, the criterion that most poses outside do not meet; and of movements
        ``fastest_limb_m_s`` (of drives in hinges ``fastest_joint_rad_s``) and ``largest_power_W`` with ``fast_enough``,
        the share of the poses within the speed and power of the actuators (NaN where these are not known).

    Raises
    ------
    InvalidInput
        If there is neither a movement nor a range; FileFormatError of a file as :func:`exo_pin.read_movement`, whose
        cautions are warnings here (:class:`exo_pin.SuspectMeasurements`).

    Notes
    -----
    The device's centre is the shoulder's in all poses.

    Source: thesis Table 5-7.

    Examples
    --------
    >>> from exo_pin.workspace import task_reach
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(0, 50, 6)), smoothing=None)
    >>> table = task_reach(exo.mechanism, {"lift": lift}, ranges=())
    >>> table["inside"].tolist(), table["data"].tolist()
    ([1.0], ['movement'])
    """
    limits = Criteria.of(criteria)
    rows = [_of_movement(mechanism, name, given, limits) for name, given in (movements or {}).items()]
    for item in ranges:
        require_type("each of the ranges", item, RangeOfMotion)
        found = workspace(mechanism, item.poses(step, mechanism.side), limits)
        rows.append(_row(item.name, "published range", found, _Rates(mechanism, None)))
    if not rows:
        raise InvalidInput("expected at least one movement or range")
    return StudyTable(rows)


def _of_movement(
    mechanism: Device | Mechanism,
    name: str,
    given: Movement | str | PathLike[str],
    criteria: Criteria,
) -> dict[str, Any]:
    movement = given if isinstance(given, Movement) else read_movement(fspath(given), mechanism.side)
    for text in () if movement is given else movement.cautions:
        warn(f"{name}: {text}", SuspectMeasurements)
    found = workspace(mechanism, movement.poses, criteria.off_grid())
    return _row(name, "movement", found, _Rates(mechanism, movement))


class _Rates:
    """How fast limbs or drives move along a movement, and what that takes.

    Attributes
    ----------
    turning : ndarray
        Shape (n,), which of them turn.
    values : ndarray
        Shape (N, n), m/s or rad/s, positive where the effort does work.
    limits : ndarray
        Shape (2, n), of speed and power; NaN where not known.
    """

    def __init__(self, mechanism: Device | Mechanism, movement: Movement | None) -> None:
        device = as_device(mechanism)
        own = device.drives
        units = [unit for _, unit in device.drive_units[: len(own)]]
        self.turning = np.array([unit != "N" for unit in units], dtype=bool)
        limits = [(None, None) if each is None else (each.speed_limit, each.power_limit) for each in own]
        self.limits = np.array(limits, dtype=np.float64).reshape(len(own), 2).T
        self.values = np.full((0, len(own)), np.nan)
        if movement is not None:
            self.values = np.einsum("kij,kj->ki", _work(mechanism, movement), movement.motion.angular_velocity)

    def fastest(self, which: NDArray[np.bool_]) -> float:
        """Largest speed of some of them; NaN if there is none."""
        return _largest(np.abs(self.values[:, which]))

    def power(self, efforts: FloatArray) -> FloatArray:
        """What they give, W, shape (N, n)."""
        return np.maximum(efforts[:, : self.values.shape[1]] * self.values, 0.0)

    def fast_enough(self, power: FloatArray) -> float:
        """Share of the samples within speed and power of the actuators; NaN if neither is known of some."""
        if not self.limits.size or np.isnan(self.limits).all(axis=0).any():
            return float("nan")
        # A limit that is not given is NaN. A speed that is not known fits no limit.
        speed, watts = self.limits
        fits = ((np.abs(self.values) <= speed) | np.isnan(speed)) & ~(power > watts)
        return float(fits.all(axis=1).mean())


def _work(mechanism: Device | Mechanism, movement: Movement) -> FloatArray:
    """Power per effort and angular velocity, shape (N, n, 3)."""
    device = as_device(mechanism)
    limbs = device.accelerate("rates")
    if limbs is None:
        return device_jacobian(device.as_chain(), movement.poses)
    return -limb_jacobian(limbs.geometry, movement.poses)


def _largest(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def _row(name: str, data: str, found: Workspace, rates: _Rates) -> dict[str, Any]:
    outside = ~found.inside
    failed = {each: int((outside & ~met).sum()) for each, met in found.met.items()}
    limited = max(failed, key=lambda each: failed[each]) if outside.any() else ""
    power_used = fast_enough = float("nan")
    if len(rates.values):
        power = rates.power(found.tensions)
        power_used, fast_enough = _largest(power), rates.fast_enough(power)
    return {
        "task": name,
        "data": data,
        "poses": found.inside.size,
        "inside": found.index,
        "limited_by": limited,
        "fastest_limb_m_s": rates.fastest(~rates.turning),
        **({"fastest_joint_rad_s": rates.fastest(rates.turning)} if rates.turning.any() else {}),
        "largest_power_W": power_used,
        "fast_enough": fast_enough,
    }


#: Tasks that are sent to a worker at once; each takes a tenth of a second or more.
_BLOCK = 2


@checked
def population(
    designs: Iterable[ShoulderExo],
    wearers: Sequence[Wearer],
    poses: Rotation | float | None = None,
    criteria: Criteria | Iterable[str] | None = None,
    *,
    moving_centre: bool = False,
    executor: Executor | None = None,
    progress: bool = False,
) -> StudyTable:
    """The workspace of every design on every person.

    Parameters
    ----------
    designs : iterable of ShoulderExo
        Each is worn by everybody (:meth:`exo_pin.ShoulderExo.worn_by`).
    wearers : sequence of Wearer
        The persons.
    poses, criteria
        As in :meth:`exo_pin.ShoulderExo.workspace`.
    moving_centre : bool
        Whether the shoulder's centre moves with the arm, for each by the path of their own (needs the extra
        ``person``).
    executor : concurrent.futures.Executor, optional
        Where they are computed (docs/howto/many_machines.md); here if left out. The numbers are the same.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    StudyTable
        A row a design and person, designs one after the other: ``design``, ``height_m``, ``mass_kg``, ``sex``,
        ``index`` (Φ of (C-1), the share of the poses inside), ``limited_by`` (the criterion that alone costs most;
        "" where none does), ``mean_F_s_N`` and ``peak_F_s_N`` inside, NaN where they are not known.

    Raises
    ------
    InvalidInput
        If there is no design or no person, or the executor does not return one result a design and person.
    MissingData, UnknownName, MissingExtra
        As :meth:`exo_pin.ShoulderExo.workspace` raises them.

    Examples
    --------
    >>> from exo_pin.workspace import population
    >>> table = population([ep.load("four-linear-actuators-worn")], ep.Wearer.drawn(2), 20.0)
    >>> table["index"].round(2).tolist()  # share of the daily poses, one a person
    [0.88, 0.87]
    """
    exos, limits = list(designs), Criteria.of(criteria)
    if not exos or not wearers:
        raise InvalidInput(f"expected designs and wearers, got {len(exos)} and {len(wearers)}")
    for exo in exos:
        require_method("designs", exo, "workspace", "ShoulderExos")
    for wearer in wearers:
        require_type("wearers", wearer, Wearer, "Wearers")
    question = functools.partial(_of_person, poses=poses, criteria=limits, moving_centre=moving_centre)
    tasks = [(exo, wearer) for exo in exos for wearer in wearers]
    return StudyTable(mapped(question, tasks, executor, "persons", progress, _BLOCK))


def _of_person(
    task: tuple[ShoulderExo, Wearer], poses: Rotation | float | None, criteria: Criteria, moving_centre: bool
) -> dict[str, Any]:
    exo, wearer = task
    path = None
    if moving_centre:
        from ..person import Person  # here: it needs an extra

        path = Person.of_wearer(wearer).on_side(exo.side).centre_path()
    found = exo.worn_by(wearer).workspace(poses, criteria, centre_offset=path)
    lost = found.lost_to
    worst = max(lost, key=lambda name: lost[name], default="")
    return {
        "design": exo.name,
        "height_m": wearer.height,
        "mass_kg": wearer.mass,
        "sex": wearer.sex,
        "index": found.index,
        "limited_by": worst if worst and lost[worst] > 0.0 else "",
        "mean_F_s_N": found.force_inside.get("mean", np.nan),
        "peak_F_s_N": found.force_inside.get("largest", np.nan),
    }
