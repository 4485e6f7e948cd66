"""What the page says in words: the numbers of a pose, and the frame around it in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles
from ...reaction import SPLITS
from ..scene.force_arrows import PoseForces

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["notebook_cell", "numbers_panel"]

_STATUS = {
    "near_singular": "near a singular pose: limb forces far above the load",
    "singular": "singular pose: no equilibrium, no forces",
    "folded": "a limb points at the shoulder centre: no forces",
    "infeasible": "cannot be held within the limits: no forces",
    "not_solved": "not solved: no forces",
}


def numbers_panel(exo: ShoulderExo, pose: Rotation, forces: PoseForces | None, notes: Sequence[str]) -> dict[str, Any]:
    """The panel of a pose: what is shown, |F_s|, det X, and what to know about them."""
    flexion, abduction, internal = (_degrees(angle) for angle in shoulder_angles(pose, exo.side, degrees=True))
    determinant = forces.determinant if forces is not None else float(exo.singularity(pose).determinant)
    values, remarks = [], []
    if forces is not None:
        size = float(np.linalg.norm(forces.shoulder))
        values.append({"name": "on the shoulder, |F_s|", "value": _newtons(size)})
        if forces.status != "ok":
            remarks.append({"text": _STATUS.get(forces.status, forces.status), "warn": True})
        if forces.percent is not None and np.isfinite(forces.percent):
            remarks.append({"text": f"{forces.percent:.1f} % of body weight", "warn": False})
        remarks.append({"text": _assumption(exo, forces.split), "warn": False})
    if np.isfinite(determinant):
        values.append({"name": "margin, det X", "value": f"{determinant:+.3f}".replace("-", "−")})
    remarks += [{"text": note, "warn": True} for note in notes]
    return {
        "title": exo.mechanism.title or exo.name,
        "pose": f"{exo.side} shoulder: flexion {flexion}, abduction {abduction}, internal rotation {internal}",
        "values": values,
        "notes": remarks,
    }


def _assumption(exo: ShoulderExo, split: str) -> str:
    """What the numbers rest on, in words."""
    law = SPLITS.get(split)
    return f"split “{split}”" if law is None else f"{law.caption(exo.mechanism)} (split “{split}”)"


def notebook_cell(source: str, height: int) -> Any:
    """A frame in a notebook; ``source`` is its attribute ``src`` or ``srcdoc``, escaped."""
    from IPython.display import HTML

    return HTML(
        f'<div style="height: {int(height)}px"><iframe {source} style="width: 100%; height: 100%; border: none">'
        "</iframe></div>"
    )


def _newtons(size: float) -> str:
    if not np.isfinite(size):
        return "none"
    return f"{size:.1f} N" if size < 1000.0 else f"{size:.3g} N" if size >= 1e6 else f"{size:.0f} N"


def _degrees(angle: float) -> str:
    # Adding zero turns -0 into 0.
    return f"{round(angle) + 0:d}°".replace("-", "−")
