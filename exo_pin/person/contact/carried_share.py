"""The share of the moments of a person's arm that a device carries: the one that is asked for, and the one it does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ...load_case import Load, Motion
from ...load_case.pose_stacks import as_query, carried

if TYPE_CHECKING:
    from ..wearer import Person

#: Moment of an arm that is rounding, N m.
_NONE = 1e-9


def require_drives(device: Any) -> None:
    """Raise unless a device has drives that can set a share of the moments.

    Raises
    ------
    InvalidInput
        If none of its drives makes a moment: what it carries then follows from the pose.
    """
    if not device.driven_moments:
        raise InvalidInput(
            f"expected no share of the moments (forces, --share) for {device.name!r}, which has no drives that could "
            "set one: what its springs carry follows from the pose. Leave it out, and the answer says the share"
        )


def load_of_share(
    share: float, wearer: Person, gravity: FloatArray, poses: Rotation, motion: Motion | None, load: Load | None
) -> Load:
    """The load with which a device carries a share of the moments of the person's arm (weight, inertia and load).

    The rest of the moments, which the wearer's muscles carry, acts on the arm as a couple.

    Raises
    ------
    InvalidInput
        If the share is not between 0 and 1.
    """
    if not 0.0 <= share <= 1.0:
        raise InvalidInput(f"expected forces as a share of 0 to 1 of the arm's moments, got {share:g} (percent?)")
    query = as_query(poses, motion, load)
    moment = carried(wearer.arm, gravity, query, query.force, query.moment)[1]
    couple = query.moment - (1.0 - share) * moment
    return Load(query.force.reshape(*query.shape, 3), couple.reshape(*query.shape, 3))


def share_words(
    cuff: FloatArray, wearer: Person, gravity: FloatArray, poses: Rotation, motion: Motion | None, load: Load | None
) -> str:
    """What a device carries of the moments of the person's arm, and what it leaves to the muscles, in a clause.

    The share is 1 - |moment left| / |moment of the arm|; it is negative where the device adds to what the wearer must
    make.

    Parameters
    ----------
    cuff : ndarray
        Wrench of the cuff on the person's arm, shape (..., 6), about O, base frame; NaN where it is not known.
    wearer, gravity, poses, motion, load
        As in :func:`load_of_share`.
    """
    query = as_query(poses, motion, load)
    moment = carried(wearer.arm, gravity, query, query.force, query.moment)[1]
    bare = np.linalg.norm(moment, axis=-1)
    left = np.linalg.norm(moment + cuff.reshape(-1, 6)[:, 3:], axis=-1)
    known = np.isfinite(left)
    if not known.any():
        return "the share of the moments that it carries is not known"
    most = f"{left[known].max():.2f} N m"
    needed = known & (bare > _NONE)
    if not needed.any():
        return f"the arm needs no moment here; it leaves {most} to the wearer's muscles"
    shares = 100.0 * (1.0 - left[needed] / bare[needed])
    if len(bare) > 1:
        low, middle, high = (f"{value + 0.0:.0f}" for value in np.percentile(shares, (0.0, 50.0, 100.0)))
        return (
            f"it carries {low} to {high} % (median {middle} %) of the moments of the person's arm, and leaves "
            f"at most {most} to the wearer's muscles"
        )
    if shares[0] < 0.0:
        return f"it adds {-shares[0]:.0f} % to the moments of the person's arm: {most} for the wearer's muscles"
    return (
        f"it carries {shares[0] + 0.0:.0f} % of the moments of the person's arm here, and leaves {most} to the "
        "wearer's muscles"
    )
