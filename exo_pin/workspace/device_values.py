"""Margins of a device that is not a wrist to the criteria of a workspace.

The same criteria as of a wrist, with what a device has in the place of limbs: ranges of its drives and joints for
strokes, the margin of its drives' moments for the singular surface, the way from rest that its assembly mode follows
for the connection, and the shapes of its links for clearance. Forces are those of :func:`exo_pin.solve` within the
limits that make |F_s| least, with a cuff that puts no couple on the arm that is not needed. Links that are fixed to the
arm are part of the cuff and do not count as near it.
"""

from __future__ import annotations

import functools
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..design.holding_frame import device_mass, mass_text
from ..device.accuracy.twins import WIDE_SPACING
from ..device.chain_device import ChainDevice
from ..device.device_singularity import moment_volume, placed_readings
from ..device.equilibrium import DeviceEquilibrium
from ..device.turns.given_postures import given_posture
from ..device.wrist_device import as_device
from ..load_case import Case, CentreOffset, Load
from ..load_case.case import Posture
from ..reaction import Assumptions, Reaction, solve
from ..reaction.holding.infeasible_poses import disturbing_moment
from .criteria import Criteria
from .criterion import CRITERIA
from .evaluation import PoseOffsets, PoseValues, rest_side

__all__: list[str] = []

#: In the place of an arm whose mass is not known, where no criterion needs forces.
_NO_MASS = Arm(1e-12, np.zeros(3))
#: Margin of a pose that the data of a spring do not cover although its coordinate is within the range.
_BEYOND = 1e-9


def values_of(
    design: Any,
    matrices: FloatArray,
    criteria: Criteria,
    names: tuple[str, ...],
    load: Load | None = None,
    offsets: PoseOffsets | None = None,
    shape: tuple[int, ...] | None = None,
    posture: Posture = None,
) -> PoseValues:
    """What is known of N poses of any device, by its closed forms where it has them; see :class:`.PoseValues`."""
    device, own = as_device(design), (len(matrices),) if shape is None else shape
    record = device.accelerate("workspace") if posture is None else None
    if record is None:
        return DeviceValues(device.as_chain(), matrices, own, criteria, names, load, offsets, posture)
    return PoseValues(record, matrices, own, criteria, names, load, offsets)


class DeviceValues(PoseValues):
    """What is known of N poses of a device, and their margins; see :class:`.PoseValues` for parameters and attributes.

    ``lengths`` are the drives' coordinates, ``bend`` is infinite, and ``margin`` is NaN where it was not found.
    """

    _net_spacing = WIDE_SPACING

    def __init__(
        self,
        device: ChainDevice,
        matrices: FloatArray,
        shape: tuple[int, ...],
        criteria: Criteria,
        names: tuple[str, ...],
        load: Load | None = None,
        offsets: PoseOffsets | None = None,
        posture: Posture = None,
    ) -> None:
        self.mechanism, self.matrices, self.shape = cast("Mechanism", device), matrices, shape
        self.criteria, self.load = criteria, load
        given = given_posture(device, posture, shape)
        if given is not None:
            # By pose, whatever the shape of the stack.
            self.posture = dict(zip(given.joints, given.values.T, strict=True)) if given.joints else given.values
        self.offsets = PoseOffsets.none() if offsets is None else offsets
        self._needs = {need for name in names for need in CRITERIA[name].needs}
        # Without the mass of an arm nothing is known of forces; where the device reaches does not depend on it.
        self._device = device if device.arm is not None else device.replace(arm=_NO_MASS)
        poses = self._plain.source.poses
        assert poses.placed is not None
        self._placed, self.lengths = poses.placed, poses.placed.coordinates
        self.bend = np.full(len(matrices), np.inf)
        signed = self._signed(self._placed)
        self.side = rest_side(float(self._signed_at(np.eye(3)[None])[0]), signed)
        self.margin = np.where(self._placed.reached, self.side * signed, self._placed.share - 1.0)
        self.margins = {name: np.asarray(CRITERIA[name].margin(self)) for name in names}
        if "stroke" in self.margins:
            passive = cast("FloatArray", poses.limits.passive_error)
            inside = np.where(passive > 0.0, -passive, self.margins["stroke"])
            self.margins["stroke"] = np.where(self._placed.reached, inside, self._placed.share - 1.0)

    @functools.cached_property
    def _plain(self) -> Reaction:
        return self._answer(self._device)

    def _answer(self, device: ChainDevice) -> Reaction:
        case = self._case(self.matrices, self.offsets, load=self.load, posture=self.posture)
        return solve(device, case, Assumptions("minimal", constraint_bounds=(0.0, 0.0)))

    def _case(self, matrices: FloatArray, offsets: PoseOffsets, **more: Any) -> Case:
        offset = None if offsets.is_aligned else CentreOffset(offsets.base, offsets.cuff)
        return Case(Rotation.from_matrix(matrices), centre_offset=offset, **more)

    def _signed(self, placed: DeviceEquilibrium) -> FloatArray:
        """Margins, zero out of reach; with the sign of the moments' volume, where they have one."""
        margin, volume = np.where(placed.reached, placed.margin, 0.0), moment_volume(self._device, placed)
        return np.where(volume < 0.0, -margin, margin)

    def _signed_at(self, way: FloatArray) -> FloatArray:
        case = self._case(way, self.offsets.at(way, self._nearest))
        placed = solve(self._device, case, Assumptions(limits="none")).source.poses.placed
        assert placed is not None
        return np.where(placed.reached, self._signed(placed), placed.share - 1.0)

    def readings(self, matrices: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """See :meth:`.PoseValues.readings`."""
        case = self._case(matrices, self.offsets.rows(rows))
        placed = solve(self._device, case, Assumptions(limits="none")).source.poses.placed
        assert placed is not None
        return placed_readings(self._device, placed)

    @property
    def stroke_unit(self) -> str:  # type: ignore[override]
        """Of the distance to the ends of strokes; see :attr:`levers`."""
        return "rad" if "N m" in {self._device.unit_of(drive) for drive in self._device.efforts} else "m"

    @property
    def levers(self) -> FloatArray:
        """See :attr:`.PoseValues.levers`; the wearer's moments have no travel."""
        scales = self._device.structure.scales
        return np.array([*scales, *np.ones(self.lengths.shape[1] - len(scales))])

    @property
    def data_margin(self) -> FloatArray:
        """See :attr:`.PoseValues.data_margin`; NaN out of reach."""
        placed, covered = self._placed, self._placed.data_margin
        # Rounding at an end, and laws that do not say where they end.
        return np.where(placed.evaluated, np.maximum(covered, 0.0), np.minimum(covered, -_BEYOND))

    def held_by_arm(self, lost: int | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """See :meth:`.PoseValues.held_by_arm`; the drive of the index ``lost`` gives no effort."""
        found = []
        for arm in self._arms:
            own = self._device if arm is self._device.arm else self._device.replace(arm=arm)
            if lost is not None and lost < len(own.drives):
                idle = own.drives[lost].idle()
                own = own.replace(drives=(*own.drives[:lost], idle, *own.drives[lost + 1 :]))
            answer = self._plain if own is self._device else self._answer(own)
            held = answer.held[:, None]
            margin = disturbing_moment(answer.source.poses)
            # A moment that is left to the wearer within what nobody feels leaves no room: rounding decides its sign.
            margin = np.where(answer.held, np.maximum(margin, 0.0), margin)
            parts = (np.where(held, answer.actuator_forces, np.nan), np.where(held, answer.shoulder_force, np.nan))
            found.append((np.where(self._placed.reached, margin, -np.inf), *parts))
        margins, tensions, shoulder = (np.stack(each) for each in zip(*found, strict=True))
        return margins, tensions, shoulder


def mass_of(design: Any) -> float:
    """Estimate of frame, cuff and drives of a wrist (:mod:`exo_pin.design.holding_frame`), else of all links, kg."""
    device = as_device(design)
    record = device.accelerate("workspace")
    return device_mass(record) if record is not None else float(device.links_mass + _on_arm(device))


def mass_words(design: Any) -> str:
    """What a design moves besides the arm, and what it weighs."""
    device = as_device(design)
    record = device.accelerate("workspace")
    own = f"Links that move otherwise: {device.links_mass:.2f} kg." if record is None else mass_text(record)
    return f"Moving mass besides the arm: {_on_arm(device):.2f} kg. {own}"


def _on_arm(device: Any) -> float:
    arm = device.arm
    return 0.0 if arm is None or arm.person is None else float(arm.mass - arm.person.mass)
