"""Which poses the muscles of a plant can hold at rest."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_rotation
from ...load_case.pose_stacks import as_query, carried, require_massless
from ...numerics.active_set import least_forces
from ...wrist import limb_jacobian
from ..controllers.contraction import Contractions
from ..controllers.pressure_kernels import static_tensions
from ..plant.equations.plant_tables import supply_of
from ..plant.plant import Plant

__all__ = ["HELD", "missing_moments"]

#: Moment, N m, that may be missing in a pose that counts as held: what a hundredth of the prototype's arm weighs.
HELD = 0.01


def missing_moments(plant: Plant, poses: Rotation) -> FloatArray:
    """Least moment about O that is missing for equilibrium, whatever the pressures from zero to the supply's.

    A muscle that is pulled beyond its nominal length pulls back with its braid, also without air, so poses that stretch
    a muscle miss more.

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
    if not isinstance(plant, Plant):
        raise InvalidInput(f"expected plant to be a Plant, got {type(plant).__name__}")
    if len(as_rotation("poses", poses).shape) != 1:
        raise InvalidInput(f"expected poses as a stack of shape (N,), got {poses.shape}")
    mechanism, tables = plant.mechanism, plant.tables
    require_massless(mechanism)
    query = as_query(poses, None, plant.load)
    arm = mechanism.require_arm("a pose to hold")
    moment = carried(arm, mechanism.gravity, query, query.force, query.moment)[1]
    lengths = Contractions(mechanism).lengths(poses)
    least, greatest = np.empty_like(lengths), np.empty_like(lengths)
    highest = supply_of(mechanism, plant.options).pressure
    for row, low, high in zip(lengths, least, greatest, strict=True):
        static_tensions(tables.law, tables.muscles, row, 0.0, low)
        static_tensions(tables.law, tables.muscles, row, highest, high)
    arms = np.swapaxes(limb_jacobian(mechanism.geometry, poses), -1, -2)
    return np.asarray(np.linalg.norm(least_forces(-moment, arms, least, np.maximum(greatest, least)).forces, axis=-1))
