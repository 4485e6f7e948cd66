"""Statics and dynamics in closed form, (D-1) to (D-30), for stacks of poses and massless limbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, ReadOnly, as_choice
from ...design import Mechanism
from ...load_case import Load, Motion
from ...load_case.pose_stacks import as_query, carried, require_massless
from ..kernels import force_stack
from ..limbs import STATUS

__all__ = ["STATUS", "WristForces", "dynamics", "require_standalone", "statics"]

Split = Literal["spherical", "standalone"]


@dataclass(frozen=True, eq=False)
class WristForces(ReadOnly):
    """Forces in a pose or a stack of poses of shape (...). Rows without an answer are NaN and say why.

    Attributes
    ----------
    actuator_forces : ndarray
        f_i, shape (..., n), N, tension positive.
    constraint_forces : ndarray
        g_i, shape (..., n), N; the limb pulls the arm with -g_i X_i through O.
    shoulder_force : ndarray
        F_s, shape (..., 3), N, from the shoulder on the arm, base frame.
    status : ndarray of str
        Shape (...): "ok", "near_singular", "singular" or "folded".
    margin : ndarray
        Shape (...), dimensionless distance from the singular surface: the smallest singular value of the
        matrix of rows b_i × s_i over the largest |B_i|, within a factor √3.
    """

    actuator_forces: FloatArray
    constraint_forces: FloatArray
    shoulder_force: FloatArray
    status: NDArray[np.str_]
    margin: FloatArray


def statics(
    mechanism: Mechanism, orientation: Rotation, load: Load | None = None, split: Split = "spherical"
) -> WristForces:
    """Limb and shoulder forces of an arm at rest, (D-19) to (D-30).

    Parameters
    ----------
    mechanism : Mechanism
        With an arm, and massless limbs.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    load : Load, optional
        On the arm, besides its weight.
    split : {"spherical", "standalone"}
        "spherical": g_i = 0, limbs without side force, (D-30). "standalone": no ball joint, F_s = 0, (D-25);
        needs six limb forces or more, tensions
        and side forces of UPU limbs together. What equilibrium still leaves open with more limbs than needed is chosen
        with the least sum of squares of the forces f (and g).

    Returns
    -------
    WristForces

    Raises
    ------
    MissingData
        If the mechanism has no arm.
    InvalidInput
        If a limb has mass, or a standalone wrist is asked of too few limb forces.

    Notes
    -----
    Source: thesis (D-9), (D-10), (D-30).
    """
    return _balance(mechanism, orientation, None, load, split)


def dynamics(
    mechanism: Mechanism,
    orientation: Rotation,
    motion: Motion,
    load: Load | None = None,
    split: Split = "spherical",
) -> WristForces:
    """Limb and shoulder forces of a moving arm, (D-1) to (D-8).

    Parameters
    ----------
    mechanism : Mechanism
        With an arm whose inertia is known, and massless limbs.
    orientation : Rotation
        Pose, single or a stack of shape (...).
    motion : Motion
        ω and η, broadcasting to (..., 3).
    load : Load, optional
        On the arm, besides its weight.
    split : {"spherical", "standalone"}
        As in :func:`statics`.

    Returns
    -------
    WristForces

    Raises
    ------
    MissingData
        If the mechanism has no arm, or its inertia is not known.
    InvalidInput
        As :func:`statics`.

    Notes
    -----
    Source: thesis (D-1), (D-2), (D-7).
    """
    return _balance(mechanism, orientation, motion, load, split)


def _balance(
    mechanism: Mechanism, orientation: Rotation, motion: Motion | None, load: Load | None, split: str
) -> WristForces:
    as_choice("split", split, ("spherical", "standalone"))
    require_massless(mechanism)
    is_upu, n = mechanism.is_upu, mechanism.limb_count
    standalone = split == "standalone"
    if standalone:
        require_standalone(mechanism)
    arm = mechanism.require_arm("motion" if motion is not None else "weight", inertia=motion is not None)
    query = as_query(orientation, motion, load)
    count = len(query.matrices)
    F, M = carried(arm, mechanism.gravity, query, query.force, query.moment)
    f, g, shoulder = np.empty((count, n)), np.empty((count, n)), np.empty((count, 3))
    status, margin = np.empty(count, dtype=np.int8), np.empty(count)
    geometry = mechanism.geometry
    force_stack(
        query.matrices,
        geometry.base_points,
        geometry.platform_points,
        np.flatnonzero(is_upu),
        F,
        M,
        standalone,
        f,
        g,
        shoulder,
        status,
        margin,
    )
    shape = query.shape
    return WristForces(
        f.reshape(*shape, n),
        g.reshape(*shape, n),
        shoulder.reshape(*shape, 3),
        np.array(STATUS)[status].reshape(shape),
        margin.reshape(shape),
    )


def require_standalone(mechanism: Mechanism) -> None:
    """Raise unless there are enough limb forces to hold the arm without a shoulder.

    Raises
    ------
    InvalidInput
        If tensions (one a limb) and side forces (one a UPU limb) are fewer than the six components to hold.
    """
    sides = int(mechanism.is_upu.sum())
    if mechanism.limb_count + sides < 6:
        raise InvalidInput(
            f"without a shoulder the limbs must hold six components, and {mechanism.limb_count} tensions with {sides} "
            "side forces of UPU limbs are too few"
        )
