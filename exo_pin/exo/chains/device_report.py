"""What a designer asks of one pose of a device that is not a wrist; see :mod:`exo_pin.exo.pose_report`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.results import Result
from ...core.tables import aligned, filled
from ...device.chain_device import ChainDevice
from ...device.device_singularity import DeviceSingularity, device_singularity
from ...reaction.holding.verdict import describe_axis
from ..pose_report import PoseReport


class DevicePoseReport(PoseReport):
    """One pose of a device with what stands beside it: its drives with their efforts and ranges."""

    def _fields(self) -> dict[str, Any]:
        own = Result._fields(self)
        return own | {
            "bare_arm_share": self.bare_arm_share,
            "drive_coordinates": self.answer.source.poses.lengths[0],
            "drive_units": [list(pair) for pair in self.answer.drive_units],
            "singular_kind": str(self.device_singularity.kind),
            "singular_margin": float(self.device_singularity.margin),
        }

    @property
    def device_singularity(self) -> DeviceSingularity:
        """Singularities of the drives and of the device's own loops."""
        return device_singularity(self._device, self._pose)

    @property
    def _device(self) -> ChainDevice:
        owner: Any = self.answer.source.poses.mechanism
        assert isinstance(owner, ChainDevice)
        return owner

    @property
    def _unheld_words(self) -> str:
        if self._device.holds_alone:
            return ", if the drives could give the efforts below"
        return ", with what is listed below from the wearer"

    def _limbs(self) -> list[str]:
        """Coordinate and effort of each drive beside its limits."""
        poses, bounds = self.answer.source.poses, self.answer.source.poses.limits
        cells = [("drive", "coordinate", "range", "effort", "limits")]
        for i, (drive, (name, unit)) in enumerate(zip(self._device.limbs, self.answer.drive_units, strict=True)):
            turns = unit == "N m"
            scale, at = (180.0 / np.pi, "°") if turns else (1e3, "mm")
            low, high = drive.length_range
            held = name.startswith("wearer")
            cells.append(
                (
                    name,
                    "" if held else f"{scale * poses.lengths[0, i]:.0f} {at}",
                    "" if held else _range(scale * low, scale * high, at),
                    f"{np.round(self.answer.actuator_forces[i], 1) + 0.0:.1f} {unit}",
                    _range(float(bounds.lower[0, i]), float(bounds.upper[0, i]), unit) if bounds.asked else "not asked",
                )
            )
        return aligned(cells)

    def _footnotes(self) -> list[str]:
        text = self.answer.cuff_text()
        lines = [filled(text)] if text else []
        if (self.answer.certificate.undetermined > 0).any():
            lines.append(filled(self.answer.certificate.statement))
            lines.append("--compare shows other assumptions, --certificate each component, --table all forces.")
        return [*lines, *(filled(text) for text in self.answer.cautions if text.startswith("Not "))]

    def _near(self) -> str:
        axis = describe_axis(self.device_singularity.lost_direction)
        return filled(f"This pose is almost singular: the drives hardly resist a moment about {axis}.")

    def _beside(self) -> str:
        return ""


def _range(low: float, high: float, unit: str) -> str:
    if np.isnan(low) or (np.isinf(low) and np.isinf(high)):
        return "not known" if unit != "°" else "no end"
    least = f"{low + 0.0:.0f}" if np.isfinite(low) else "?"
    return f"{least} to {high:.0f} {unit}" if np.isfinite(high) else f"from {least} {unit}"
