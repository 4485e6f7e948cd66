"""A calibration as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.validation import FloatArray
from .length_model import labels

if TYPE_CHECKING:
    from .result import Calibration

#: Undetermined directions and outliers that are listed; the others are counted.
_LISTED = 8
#: Other devices that are listed, and from which distance, m, a joint of theirs counts as elsewhere.
_OTHERS, _ELSEWHERE = 3, 1e-4


def report(found: Calibration) -> str:
    """Verdict, residuals, unknowns with their standard deviations, what is undetermined, other devices, outliers."""
    lines = [found.verdict, "", *_fit(found), "", *_unknowns(found)]
    if found.undetermined:
        lines += ["", "Not determined by these measurements:"]
        if found.lengths.size < found.model.size:
            lines.append(f"  ({found.lengths.size} lengths for {found.model.size} unknowns: measure more poses)")
        lines += [f"  {direction}" for direction in found.undetermined[:_LISTED]]
        lines += _rest(len(found.undetermined))
        lines.append("  Measure other poses, or hold the unknowns near the nominal design with tolerances.")
    if found.device_count > 1:
        lines += ["", *_others(found)]
    outliers = found.outliers
    if len(outliers):
        lines += ["", f"{len(outliers)} residuals beyond four standard deviations:"]
        lines += [
            f"  pose {k}, limb {i + 1}: {1e3 * found.residuals[k, i]:+.2f} mm" for k, i in outliers[:_LISTED].tolist()
        ]
        lines += _rest(len(outliers))
    return "\n".join(lines)


def _rest(count: int) -> list[str]:
    return [f"  and {count - _LISTED} more"] if count > _LISTED else []


def _others(found: Calibration) -> list[str]:
    """Devices that fit as well: how far from the nominal design they are, and which joints are elsewhere."""
    lines = [
        f"Other devices that fit equally well ({found.device_count - 1}), the nearest to the nominal design first:"
    ]
    own = np.concatenate(found.joints)
    names = [part for name in ("base_points", "platform_points") for part in labels(name, found.model.limb_count)]
    for device in found.devices[1 : _OTHERS + 1]:
        apart = np.linalg.norm(np.concatenate(device.joints) - own, axis=1)
        moved = [f"{name} {1e3 * size:.3g}" for name, size in zip(names, apart, strict=True) if size > _ELSEWHERE]
        lines.append(f"  {1e3 * device.distance:.3g} mm from it; joints elsewhere by mm: {', '.join(moved) or 'none'}")
    return lines


def _fit(found: Calibration) -> list[str]:
    residuals = found.residuals
    size = 1e3 * float(np.sqrt((residuals**2).mean()))
    source = "found" if found.errors.length_noise is None else "stated"
    lines = [
        f"poses and limbs      {len(residuals)} x {residuals.shape[1]}, {found.degrees_of_freedom} degrees of freedom",
        f"residuals            {size:.3g} mm (root of the mean square), largest {1e3 * np.abs(residuals).max():.3g} mm",
        f"noise of a length    {1e3 * found.length_noise:.3g} mm ({source})",
    ]
    if np.isfinite(found.probability):
        lines.append(f"probability          {found.probability:.2g} (chi-square, of residuals as large or larger)")
    return lines


def _unknowns(found: Calibration) -> list[str]:
    """One row a joint, a length offset, or a vector."""
    model = found.model
    lines = [f"{'unknown':22}{'nominal':>24}{'found':>24}{'standard deviation':>24}"]
    for name, place in model.places.items():
        parts = labels(name, model.limb_count)
        unit, factor = ("deg", np.degrees(1.0)) if name.endswith("mounting") else ("mm", 1e3)
        nominal = {"base_points": model.base, "platform_points": model.platform}.get(name)
        if nominal is not None:
            values = nominal + model.group(name, found.values, nominal.shape)
        elif name == "length_offsets":
            values = found.length_offsets
        elif name.endswith("mounting"):
            values = getattr(found, name).as_rotvec()
        else:
            values = found.values[place]
        rows, deviations = (x.reshape(len(parts), -1) for x in (values, found.standard_deviations[place]))
        for i, part in enumerate(parts):
            start = None if nominal is None else factor * nominal[i]
            lines.append(_row(f"{part}, {unit}", start, factor * rows[i], factor * deviations[i]))
    return lines


def _row(name: str, nominal: FloatArray | None, found: FloatArray, deviation: FloatArray) -> str:
    columns = ["" if nominal is None else _numbers(nominal, 1), _numbers(found, 1), _numbers(deviation, 2)]
    return f"{name:22}" + "".join(f"{column:>24}" for column in columns)


def _numbers(values: FloatArray, digits: int) -> str:
    return " ".join(f"{value:7.{digits}f}" for value in values)
