"""Which poses the drives of a plant can hold at rest."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_rotation, require_type
from ...load_case.pose_stacks import as_query, carried, require_massless
from ...reaction.holding import nearest_tensions
from ...wrist import limb_jacobian
from ..plant.plant import Plant

#: Moment, N m, that may be missing in a pose that counts as held: what a hundredth of the prototype's arm weighs.
HELD = 0.01


def missing_moments(plant: Plant, poses: Rotation) -> FloatArray:
    """Least moment about O that is missing for equilibrium, whatever the drives do within their limits.

    Pressures go from zero to the supply's, motors to the force limits of the design. A muscle that is pulled beyond its
    nominal length pulls back with its braid, also without air, so poses that stretch a muscle miss more. Strokes of
    motor drives do not count here.

    Parameters
    ----------
    plant : Plant
        With massless limbs. Its load counts; friction and stops do not.
    poses : Rotation
        Stack of shape (N,).

    Returns
    -------
    ndarray
        Shape (N,), N m; zero where the pose can be held.

    Raises
    ------
    InvalidInput
        If a limb has mass, or poses are no stack of shape (N,).
    """
    require_type("plant", plant, Plant, "a Plant")
    if len(as_rotation("poses", poses).shape) != 1:
        raise InvalidInput(f"expected poses as a stack of shape (N,), got {poses.shape}")
    mechanism = plant.mechanism
    require_massless(mechanism)
    query = as_query(poses, None, plant.load)
    arm = mechanism.require_arm("a pose to hold")
    moment = carried(arm, mechanism.gravity, query, query.force, query.moment)[1]
    lengths = plant.contractions.lengths(poses)
    least, greatest = np.empty_like(lengths), np.empty_like(lengths)
    for row, low, high in zip(lengths, least, greatest, strict=True):
        low[:], high[:] = plant.force_limits(row, slack=True)
    arms = np.swapaxes(limb_jacobian(mechanism.geometry, poses), -1, -2)
    return nearest_tensions.missing_moments(moment, arms, least, greatest)
