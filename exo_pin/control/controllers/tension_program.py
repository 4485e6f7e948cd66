"""Tensions for a wanted motion: nearest moment within what the muscles can pull, then least shoulder force.

The limbs pull the arm with the moment -Jᵀ f about O, J the Jacobian of their lengths. With the load that arm and
motion put on them, the wanted tensions obey Jᵀ f = m. Muscles only pull, and not without limit, so that they take
the nearest moment and, of several sets of tensions with it, that of least |F_s|
(:mod:`exo_pin.reaction.holding.least_held_forces`).

With three muscles there are several only in singular poses; with a fourth throughout.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, MissingData
from ...core.errors.base import echo
from ...core.validation import FloatArray, as_real, as_rotation, as_single_rotation, require_type
from ...design import Mechanism
from ...load_case import Load, Motion
from ...load_case.pose_stacks import as_query, carried, require_massless
from ...reaction.holding import least_held_forces
from ...wrist import inverse_kinematics, limb_jacobian
from ..plant.plant import Plant

#: Moment, N m, that may be missing in a pose that counts as held: what a hundredth of the prototype's arm weighs.
HELD = 0.01


class Tensions(NamedTuple):
    """Answer of :func:`tensions_for_motion`, one pose.

    Attributes
    ----------
    tensions : ndarray
        f, shape (n,), N.
    missing_moment : ndarray
        m - Jᵀ f, shape (3,), N m, base frame: what the muscles cannot do; zero where they can.
    shoulder_force : ndarray
        F_s, shape (3,), N, base frame, if the arm moved as wanted.

    Examples
    --------
    >>> from exo_pin.control import tensions_for_motion
    >>> exo = ep.load("four-cables")
    >>> found = tensions_for_motion(exo.mechanism, exo.pose(abduction=45), None, greatest=np.full(4, 200.0))
    >>> bool(found.tensions.min() >= 0.0), np.abs(found.missing_moment).round(9)  # N; N m
    (True, array([0., 0., 0.]))
    """

    tensions: FloatArray
    missing_moment: FloatArray
    shoulder_force: FloatArray


def tensions_for_motion(
    mechanism: Mechanism,
    poses: Rotation,
    motion: Motion | None,
    greatest: FloatArray,
    least: FloatArray | None = None,
    load: Load | None = None,
) -> Tensions:
    """Tensions within limits that move the arm as wanted, or as nearly as they can.

    Parameters
    ----------
    mechanism : Mechanism
        With an arm; massless limbs.
    poses : Rotation
        Pose, single.
    motion : Motion or None
        Angular velocity and wanted angular acceleration, base frame; None for rest.
    greatest, least : ndarray
        f_max and f_min, shape (n,), N; f_min is zero if left out.
    load : Load, optional
        On the arm besides its weight.

    Returns
    -------
    Tensions

    Raises
    ------
    MissingData
        If the mechanism has no arm.
    InvalidInput
        If a limb has mass, or orientation or limits have a wrong shape or are NaN; InfeasibleBounds if a lower limit
        stands above its upper one.

    Examples
    --------
    >>> from exo_pin.control import tensions_for_motion
    >>> exo = ep.load("three-linear-actuators")
    >>> pose = exo.pose(flexion=40)
    >>> found = tensions_for_motion(exo.mechanism, pose, None, np.full(3, 500.0), np.full(3, -500.0))
    >>> bool(np.allclose(found.tensions, exo.reaction(pose, limits="none").actuator_forces))  # N
    True
    """
    require_type("mechanism", mechanism, Mechanism, "a Mechanism")
    require_massless(mechanism)
    if mechanism.arm is None:
        raise MissingData(["arm"], "a tension program", mechanism.name)
    as_single_rotation("poses", poses)
    query = as_query(poses, motion, load)
    force, moment = (part[0] for part in carried(mechanism.arm, mechanism.gravity, query, query.force, query.moment))
    count = mechanism.limb_count
    upper = _limits("greatest", greatest, count)
    lower = np.zeros(count) if least is None else _limits("least", least, count)
    limbs = inverse_kinematics(mechanism.geometry, poses)
    arms = np.cross(limbs.platform_points, limbs.directions).T
    f = least_held_forces.nearest_tensions(arms, moment, limbs.directions.T, force, lower, upper)
    return Tensions(f, moment - arms @ f, limbs.directions.T @ f - force)


def _limits(name: str, given: FloatArray, count: int) -> FloatArray:
    """Limits of the tensions, shape (n,); they may be infinite."""
    limits = as_real(name, given)
    if limits.shape != (count,) or np.isnan(limits).any():
        raise InvalidInput(f"expected {name} as {count} tensions in N, got {echo(given)}")
    return limits


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

    Examples
    --------
    >>> from exo_pin.control import missing_moments
    >>> exo = ep.load("four-muscle-cables")
    >>> missing_moments(ep.Plant(exo), exo.pose(flexion=[0, 30, 60])).round(6)  # N m: these muscles are strong enough
    array([0., 0., 0.])
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
    limits = np.array([plant.force_limits(row, slack=True) for row in lengths]).reshape(-1, 2, plant.count)
    least, greatest = np.ascontiguousarray(limits.swapaxes(0, 1))
    arms = np.swapaxes(limb_jacobian(mechanism.geometry, poses), -1, -2)
    return least_held_forces.missing_moments(moment, arms, least, greatest)
