"""A workspace as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.tables import filled
from .criterion import CRITERIA, NO_LIMIT
from .needs import NO_SPRINGS

if TYPE_CHECKING:
    from .result import Workspace


def workspace_text(found: Workspace) -> str:
    """The result as text: share inside, wearers, forces and a line for each criterion."""
    total, volume_share = found.inside.size, found.volume_share
    volume = "" if volume_share is None else f" ({volume_share.percent} of their volume on the rotation group)"
    vital = [name for name in found.not_checked if CRITERIA[name].is_vital]
    vital += ["elbow"] if found.blocks_elbow else []
    without = f"; not checked: {', '.join(vital)}" if vital else ""
    lines = [f"{found.name}: {100 * found.index:.1f} % of {total} poses are inside{volume}{without}."]
    if found.wearers:
        lines.append(f"Worn by {_persons(found)}.")
    if found.centre_offset is not None:
        furthest = [1e3 * length for length in found.largest_offsets.values()]
        lines.append(
            "The device's centre is off the shoulder's, in these poses by at most "
            f"{furthest[0]:.0f} mm at the base and {furthest[1]:.0f} mm at the cuff."
        )
    if found.unknown.any():
        lines.append(f"{100 * found.unknown.mean():.1f} % more depend on force limits that are not known.")
    if found.not_evaluated.any():
        share = 100.0 * found.not_evaluated.mean()
        lines.append(f"{share:.1f} % are not evaluated: a spring has no data there, so nothing is known of forces.")
    force = found.force_inside
    if force:
        lines.append(
            f"Shoulder force inside: mean {force['mean']:.0f} N, largest {force['largest']:.0f} N "
            "(tensions chosen for the least)."
        )
    width = max([16, *(len(name) + 2 for name in found.margins)])
    if found.margins:
        lines += ["", f"{'criterion':<{width}}{'met':>9}{'only this':>12}{'median margin':>18}"]
    lost, middle = found.lost_to, found.median_margins
    for name, share in found.fractions.items():
        shares = f"{name:<{width}}{100 * share:>7.1f} %{100 * lost[name]:>10.1f} %"
        margin = f"{middle[name]:>12.3g} {found.units[name]}" if np.isfinite(middle[name]) else f"{'-':>12}"
        lines.append(f"{shares}{margin}".rstrip())
    unasked = [f"{name} ({CRITERIA[name].limit})" for name, why in found.not_checked.items() if NO_LIMIT in why]
    shown = {name: why for name, why in found.not_checked.items() if NO_LIMIT not in why and NO_SPRINGS not in why}
    lines += [_left_out(name, why) for name, why in shown.items()]
    lines += [filled(f"Without a limit: {', '.join(unasked)}.")] if unasked else []
    return "\n".join(lines)


def _left_out(name: str, why: str) -> str:
    """A criterion that is not checked, and why."""
    if why.startswith("does not apply"):
        return f"{name}: {why}"
    return f"{name}: not checked, {'because ' if why.startswith('not known') else ''}{why}"


def _persons(found: Workspace) -> str:
    """For whom the criteria hold, in words."""
    persons = [f"a person of {each.height:.2f} m and {each.mass:.0f} kg ({each.sex})" for each in found.wearers]
    if found.criteria.elbow_range is not None:
        low, high = np.degrees(found.criteria.elbow_range)
        elbow = f", while the elbow bends from {low:.0f} to {high:.0f}°"
    else:
        elbow = f", elbow at {' and '.join(sorted({f'{np.degrees(w.elbow_flexion):.0f}°' for w in found.wearers}))}"
    return " and by ".join(persons) + elbow
