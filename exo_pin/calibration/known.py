"""What a calibration took as known, and what an error of it does.

Least squares moves the unknowns x by dx = -(JᵀJ + P)⁺ Jᵀ J_k dk where a quantity k is wrong by dk; J and J_k are the
derivatives of the lengths over their errors, and P is of the tolerances. With joints unknown a wrong mounting turns all
joints of its ring, seen from the shoulder, and leaves no residual at all; a wrong scale makes all of them grow.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import ExoPinError, ExoPinWarning
from ..core.results import Known
from ..core.validation import FloatArray
from .length_model import FINEST, GROUPS, UNIT, UNITS, LengthModel, whitening

if TYPE_CHECKING:
    from .result import Calibration

#: An error shows if it moves the residuals together by this many standard deviations.
_SHOWS = 3.0
#: Effects on the joints below this, m, are none.
_NONE = 1e-9
#: Poses in which the force is asked for, at most, and step of the joints, m.
_POSES, _STEP = 60, 1e-5


def known_quantities(found: Calibration) -> tuple[Known, ...]:
    """All quantities that are no unknowns and change the joints, largest effect on the joints first."""
    model = found.model
    base, platform = model.points(found.values)
    mountings = found.torso_mounting, found.arm_mounting
    full = LengthModel(base, platform, found.length_offsets, *mountings, GROUPS)
    values = np.zeros(full.size)
    for name in ("length_scale", "base_offset", "cuff_offset"):
        if name in model.places:
            values[full.places[name]] = found.values[model.places[name]]
    here = full.evaluate(values, found.poses.as_matrix())
    noise = found.errors.noise
    J = (whitening(here, noise, found.errors.orientation_noise) @ here.by_unknowns).reshape(-1, full.size) * full.scales
    names = [name for name in model.unknowns if name not in model.known]
    asked = np.concatenate([np.arange(full.size)[full.places[name]] for name in names])
    stiff = np.diag(full.scales[asked] / found.information.prior[model.asked])
    # Of the joints by the scaled unknowns; turns and scales of sensors move none.
    rows, slopes = full.joint_slopes.reshape(-1, full.size), force_slopes(found)
    scale = max(found.estimate.scale, FINEST / UNIT)
    known = []
    for name in GROUPS:
        if name in names:
            continue
        place = full.places[name]
        right = np.concatenate([J[:, place], np.zeros((len(asked), J[:, place].shape[1]))])
        move = -np.linalg.lstsq(np.concatenate([J[:, asked], stiff]), right, rcond=1e-10)[0]
        unit, factor = UNITS[name]
        size = 1.0 / factor
        if name in model.known:
            size = float(found.standard_deviations[model.places[name]].max())
        step = size / full.scales[place]
        joints = (rows[:, asked] @ move + rows[:, place]) * step
        left = np.linalg.norm((J[:, place] + J[:, asked] @ move) * step)
        moved = float(np.sqrt((joints**2).sum(axis=1)).max())
        if moved < _NONE:
            continue
        effects = {"joints_mm": 1e3 * moved}
        if slopes is not None:
            effects["F_s_percent"] = 100.0 * float(np.median(np.linalg.norm(slopes @ joints, axis=1)))
        shows = bool(left > _SHOWS * scale)
        known.append(Known(name.replace("_", " "), factor * size, unit, effects, shows, name in model.known))
    return tuple(sorted(known, key=lambda each: -each.effects["joints_mm"]))


def force_slopes(found: Calibration) -> FloatArray | None:
    """Derivatives of |F_s| over itself by the joints, (N', 6 n), 1/m, with the arm at rest in the measured poses.

    Of plain equilibrium, by central differences; of poses that have an answer. None where the design has no arm.
    """
    if found.nominal.arm is None:
        return None
    chosen = np.linspace(0, len(found.poses) - 1, min(len(found.poses), _POSES)).astype(int)
    arm = found.torso_mounting * found.poses[chosen] * found.arm_mounting
    geometry, joints = found.nominal.geometry, np.stack(found.joints)

    def sizes(there: FloatArray) -> FloatArray:
        moved = geometry.replace(base_points=there[0], platform_points=there[1])
        return np.asarray(found.nominal.replace(geometry=moved).reaction(arm, limits="none").magnitude)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExoPinWarning)  # poses are as measured, whatever an arm can reach
        try:
            here = sizes(joints)
            steps = _STEP * np.eye(joints.size).reshape(-1, *joints.shape)
            slopes = np.stack([(sizes(joints + d) - sizes(joints - d)) / (2.0 * _STEP) for d in steps], axis=1)
        except ExoPinError:
            return None
    slopes = slopes / here[:, None]
    known = np.isfinite(slopes).all(axis=1)
    return slopes[known] if known.any() else None
