"""How the efforts of a device share what it holds: the wearer least, then the drives, then the brakes.

In each pose equilibrium is A f + w = m, with a row for each motion that drives or brakes hold; w, in the three rows of
the arm's turns, is the wearer's moment where they cannot hold the arm alone. Chosen are, in this order,

1. the least w: no drive is spared at the wearer's expense;
2. efforts f of least sum of squares. Where drives have one unit these are squares of N, or of N m. Where they mix N and
   N m, each effort is divided by the larger magnitude of its limits; where a limit is not known, numbers in N and N m are
   added as they are, and the answer says so. A brake's effort is a reaction and counts a thousandth of a drive's.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.validation import FloatArray
from ..device.device_state import DeviceState
from ..device.least_loads import NONE
from ..wrist.forces.affine_state import BalancedTensions
from .constraints.actuator_limits import depend_on_length, stroke_limits

#: What a unit of a brake's effort counts beside one of a drive.
_OF_BRAKES = 1e-3
#: Moment of the wearer, relative to the load, that is rounding.
_ROUNDING = 1e-12
#: Share of the greatest limit that counts for a drive that gives nothing.
_NOTHING = 1e-6


class EffortSharing(NamedTuple):
    """By what the efforts of a device are chosen among those in equilibrium.

    Attributes
    ----------
    scales : ndarray or None
        What each effort is divided by, shape (p,), the largest of the drives' 1; None where all count alike.
    unknown : tuple of str
        Drives that have no limit to divide by, although the units mix.
    wearer : ndarray of bool or None
        Components that are the wearer's moment, shape (p,); None where the device holds the arm.
    """

    scales: FloatArray | None
    unknown: tuple[str, ...]
    wearer: NDArray[np.bool_] | None

    @property
    def words(self) -> str:
        """What goes before and after "least sum of squares", in words; empty where nothing does."""
        words = "" if self.scales is None else ", each effort over its greatest limit"
        return words if self.wearer is None else f"{words}, after the wearer's least moment"


def sharing_of(device: Any) -> EffortSharing:
    """Of a device whose efforts are drives, brakes and, at the end, the wearer's moments."""
    p, drives, held = device.limb_count, len(device.drives), len(device.efforts)
    wearer = None if p == held else np.arange(p) >= held
    scales, unknown = np.ones(p), ()
    if len({device.unit_of(drive) for drive in device.drives}) > 1:
        ends = [drive.effort_range for drive in device.drives]
        known = stroke_limits(device) if depend_on_length(device) else np.array(ends).T
        size = np.nan_to_num(np.abs(known), nan=0.0, posinf=0.0).max(axis=0)[:drives]
        lacking = (size == 0.0) & ~(np.array(ends) == 0.0).all(axis=1)
        unknown = tuple(drive.name for drive, lacks in zip(device.drives, lacking, strict=True) if lacks)
        if not unknown and size.max() > 0.0:
            scales[:drives] = np.maximum(size / size.max(), _NOTHING)
    scales[drives:held] = 1.0 / _OF_BRAKES
    return EffortSharing(None if (scales == 1.0).all() else scales, unknown, wearer)


def balanced_efforts(state: DeviceState, rank: int, sharing: EffortSharing) -> BalancedTensions:
    """Efforts in equilibrium, without limits, as the module says.

    Parameters
    ----------
    state : DeviceState
        N poses.
    rank : int
        Rows that drives and brakes can meet in general; the columns of what is left free do not depend on the pose.
    sharing : EffortSharing
        Of the device.
    """
    count, r, p = state.moment_of_f.shape
    held = p if sharing.wearer is None else int((~sharing.wearer).sum())
    scales = np.ones(held) if sharing.scales is None else sharing.scales[:held]
    rank = min(rank, r, held)
    U, values, Vt = np.linalg.svd(state.moment_of_f[..., :held] * scales)
    kept = values[:, :rank] > NONE * values[:, :1]
    U, V = U[..., :rank], np.swapaxes(Vt, 1, 2)
    inverse = np.divide(1.0, values[:, :rank], out=np.zeros_like(kept, dtype=float), where=kept)
    efforts = scales[:, None] * (V[..., :rank] * inverse[:, None]) @ np.swapaxes(U, 1, 2)
    f, left = np.zeros((count, p)), state.moment
    if sharing.wearer is not None:
        met = U * kept[:, None]
        unmet = np.eye(r) - met @ np.swapaxes(met, 1, 2)
        w = (np.linalg.pinv(unmet[..., :3], rcond=NONE) @ (unmet @ left[..., None]))[..., 0]
        w[np.abs(w).max(axis=1) <= _ROUNDING * np.abs(left).max(axis=1)] = 0.0
        f[:, held:] = w
        left = left - np.pad(w, ((0, 0), (0, r - 3)))
    own = (efforts @ left[..., None])[..., 0]
    # One refinement: near a singular pose efforts are large, and their rounding would be left over as moment.
    miss = left - (state.moment_of_f[..., :held] @ own[..., None])[..., 0]
    f[:, :held] = own + (efforts @ miss[..., None])[..., 0]
    stress = np.zeros((count, p, held - rank))
    stress[:, :held] = scales[:, None] * V[..., rank:]
    return BalancedTensions(
        f,
        np.zeros((count, p, p)),
        stress,
        state.shoulder + (state.shoulder_of_f @ f[..., None])[..., 0],
        state.shoulder_of_g,
        state.shoulder_of_f @ stress,
        values,
    )
