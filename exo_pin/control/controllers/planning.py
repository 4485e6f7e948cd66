"""What a controller that knows the device asks of it: lengths, their motion, and efforts for a wanted motion.

A wrist with massless limbs answers by closed forms. Its limbs pull the arm with the moment -Jᵀ f about O, J the
Jacobian of their lengths. With the load that arm and motion put on them, the wanted tensions obey Jᵀ f = m. Muscles
only pull, and not without limit, so that they take the nearest moment and, of several sets of tensions with it, that of
least |F_s| (:mod:`exo_pin.reaction.holding.least_held_forces`). With three muscles there are several only in singular
poses; with a fourth throughout.

Any other device answers by its closed chain. For an angular acceleration η of the arm, whose joints follow with the
least motion a,

    Z' Σ f_i p_i = Z' (M a + h - springs) - M_load,      Z the motions of all joints for turns of the arm

and of the efforts within limits that come nearest, those are taken whose shares of their limits have the least sum of
squares. Freedoms that leave the arm at rest are left alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...chain.dynamics.equations.equations_of_motion import open_tree
from ...chain.dynamics.nonsmooth.projected_motion import response_at
from ...chain.kinematics.closing import close
from ...chain.kinematics.loops import constraint_drift
from ...core.errors import InvalidInput, MissingData
from ...core.errors.base import echo
from ...core.validation import FloatArray, as_real, as_rotation, as_single_rotation, require_type
from ...design import Mechanism
from ...device.postures import nearest_reached
from ...device.turns.own_ways import nearest_beside, turns_of
from ...load_case import Load, Motion
from ...load_case.pose_stacks import as_query, carried, require_massless
from ...reaction.holding import least_held_forces
from ...wrist import inverse_kinematics, limb_jacobian
from ..plant.any_device.arm_actions import load_at_shoulder
from ..plant.any_device.device_equations import DeviceEquations
from ..plant.plant import Plant
from ..trajectories.reference import ReferenceState

#: Moment, N m, that may be missing in a pose that counts as held: what a hundredth of the prototype's arm weighs.
HELD = 0.01
#: Of differences over time, s.
_APART = 1e-3


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


#: Step of the rate at which lengths change with a motion, s.
_STEP = 1e-6


class LengthMotion(NamedTuple):
    """Lengths of n limbs in a motion of the arm.

    Attributes
    ----------
    lengths, rates, accelerations : ndarray
        Shape (n,): l in m, l' in m/s, l'' in m/s².
    """

    lengths: FloatArray
    rates: FloatArray
    accelerations: FloatArray


class WristPlanner(NamedTuple):
    """A wrist with massless limbs."""

    plant: Plant

    def lengths(self, pose: Rotation) -> FloatArray:
        """See :class:`DevicePlanner`."""
        return self.plant.contractions.lengths(pose)

    def motion(self, state: Any) -> LengthMotion:
        """See :class:`DevicePlanner`."""
        # With b = B_i - O in the base frame, b' = ω × b: l' = s · b', l'' = s · b'' + (|b'|² - l'²)/l.
        geometry = self.plant.mechanism.geometry
        b = geometry.platform_points @ state.orientation.as_matrix().T
        w, e = np.asarray(state.angular_velocity), np.asarray(state.angular_acceleration)
        span = b - geometry.base_points
        lengths = np.linalg.norm(span, axis=1)
        s = span / lengths[:, None]
        velocity = np.cross(w, b)
        acceleration = np.cross(e, b) + np.cross(w, velocity)
        rates = np.einsum("ij,ij->i", s, velocity)
        across = np.einsum("ij,ij->i", velocity, velocity) - rates**2
        return LengthMotion(lengths, rates, np.einsum("ij,ij->i", s, acceleration) + across / lengths)

    def nearest(self, poses: Rotation) -> Rotation:
        """See :class:`DevicePlanner`."""
        return poses

    def attained(self, reference: Callable[[float], Any]) -> Callable[[float], Any]:
        """See :class:`DevicePlanner`."""
        return reference

    def masses(self, pose: Rotation) -> FloatArray:
        """See :class:`DevicePlanner`: all of its motors have springs between."""
        return np.zeros(self.plant.count)

    def tensions(
        self, pose: Rotation, motion: Motion | None, greatest: FloatArray, least: FloatArray, load: Load | None
    ) -> Tensions:
        """See :class:`DevicePlanner`."""
        return tensions_for_motion(self.plant.mechanism, pose, motion, greatest, least, load)

    def missing(self, poses: Rotation) -> FloatArray:
        """See :class:`DevicePlanner`."""
        return missing_moments(self.plant, poses)

    def left(self, pose: Rotation, motion: Motion, efforts: FloatArray, load: Load | None) -> FloatArray:
        """See :class:`DevicePlanner`."""
        return -self.tensions(pose, motion, efforts, efforts, load).missing_moment


@dataclass(frozen=True)
class _Attained:
    """The poses nearest to those of a reference, and their motion by central differences."""

    reference: Callable[[float], Any]
    nearest: Callable[[Rotation], Rotation]

    def __call__(self, t: float) -> ReferenceState:
        now = max(t, _APART)
        asked = [self.reference(s).orientation for s in (t, now - _APART, now, now + _APART)]
        pose, *own = self.nearest(Rotation.concatenate(asked))
        ahead, behind = (own[2] * own[1].inv()).as_rotvec(), (own[0] * own[1].inv()).as_rotvec()
        return ReferenceState(pose, (ahead - behind) / (2.0 * _APART), (ahead + behind) / _APART**2)


class DevicePlanner:
    """Any device; its joints are those nearest to where they were asked last, so that a call takes a millisecond.

    A device that turns the arm about fewer than three axes is taken to the nearest of its own poses.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true, without its wearer and payloads.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._of = DeviceEquations(plant.mechanism.as_chain(), plant.drives, plant.tables)
        self._q: FloatArray | None = None

    @cached_property
    def _lacks(self) -> bool:
        """Whether the device turns the arm about fewer than three axes."""
        return nearest_reached(self._plant.mechanism.as_chain(), Rotation.identity()) is not None

    def _at(self, pose: Rotation) -> FloatArray:
        """The closed configuration in a pose."""
        own = self._of
        if self._q is None:
            nearest = nearest_reached(self._plant.mechanism.as_chain(), pose) if self._lacks else None
            self._q = own.configuration(pose if nearest is None else nearest)
        if self._lacks:
            self._q = nearest_beside(own.model, self._q, pose.as_quat())
            return self._q
        q = self._q.copy()
        q[own.model.arm_q] = pose.as_quat()
        if own.state.row_count:
            q = close(own.state, q, hold=[str(own.state.model.names[own.model.arm])], restarts=0)
        self._q = q
        return q

    def nearest(self, poses: Rotation) -> Rotation:
        """The poses that the device has nearest to a stack of poses."""
        return Rotation.from_quat([self._at(pose)[self._of.model.arm_q] for pose in poses]) if self._lacks else poses

    def attained(self, reference: Callable[[float], Any]) -> Callable[[float], Any]:
        """A reference on the poses that the device has."""
        return _Attained(reference, self.nearest) if self._lacks else reference

    def lengths(self, pose: Rotation) -> FloatArray:
        """Lengths of the limbs or coordinates of the drives, shape (n,), m or rad."""
        return self._of.coordinates(self._at(pose))

    def _follow(self, q: FloatArray, R: FloatArray, velocity: Any, acceleration: Any) -> tuple[FloatArray, FloatArray]:
        """Velocity and acceleration of all joints with those of the arm, base frame; the tree is linearised here."""
        own = self._of
        v = own.following(q, R.T @ np.asarray(velocity))
        opening = constraint_drift(own.state, q, v) if own.state.row_count else None
        return v, own.following(q, R.T @ np.asarray(acceleration), opening)

    def motion(self, state: Any) -> LengthMotion:
        """Their motion with a state of a reference."""
        own, q = self._of, self._at(state.orientation)
        v, a = self._follow(q, own.rotation(q), state.angular_velocity, state.angular_acceleration)
        x = own.coordinates(q)
        P = own.columns()
        own.state.buffers.linearise(own.moved(q, _STEP * v))
        turning = (own.columns() - P) / _STEP
        return LengthMotion(x, own.signs * (P.T @ v), own.signs * (P.T @ a + turning.T @ v))

    def masses(self, pose: Rotation) -> FloatArray:
        """What moves with each drive where all others are free, shape (n,), kg or kg m²."""
        own, q = self._of, self._at(pose)
        response = response_at(own.state, q).response
        return np.asarray(1.0 / np.maximum(((own.columns().T @ response) ** 2).sum(axis=1), 1e-9))

    def tensions(
        self, pose: Rotation, motion: Motion | None, greatest: FloatArray, least: FloatArray, load: Load | None
    ) -> Tensions:
        """Efforts that move the arm as wanted, or as nearly as they can; the shoulder's force is not asked, and NaN.

        The missing moment is what the arm would have to be relieved of, as that of a wrist.
        """
        own, q = self._of, self._at(pose)
        R, none = own.rotation(q), np.zeros(3)
        v, a = self._follow(
            q, R, *((none, none) if motion is None else (motion.angular_velocity, motion.angular_acceleration))
        )
        left = open_tree(own.state, q, v, a, None)
        P, (springs, _) = own.columns(), own.springs(q)
        # Moments about axes that the loops hold need no drive.
        can = turns_of(own.model, q) if self._lacks else np.eye(3)
        turns = own.following(q, can) @ can.T
        moment = turns.T @ (left - springs)
        if load is not None:
            moment = moment - can @ (can.T @ (R.T @ load_at_shoulder(load, R)[1]))
        arms = turns.T @ P
        # Shares of the limits; a drive without any counts by newtons or newton metres.
        size = np.maximum(np.maximum(np.abs(least), np.abs(greatest)), 1e-6)
        size = np.where(np.isfinite(size), size, 1.0)
        f = np.zeros(len(size))
        if len(f):
            low, high, nothing = least / size, greatest / size, np.zeros((3, len(f)))
            shares = least_held_forces.nearest_tensions(arms * size, moment, nothing, np.zeros(3), low, high)
            f = np.clip(size * shares, least, greatest)
        return Tensions(f, R @ (arms @ f - moment), np.full(3, np.nan))

    def missing(self, poses: Rotation) -> FloatArray:
        """Moment that lacks for equilibrium in poses, shape (N,), N m."""
        out = np.empty(len(poses))
        for k, pose in enumerate(poses):
            least, greatest = self._plant.force_limits(self.lengths(pose), slack=True)
            out[k] = np.linalg.norm(self.tensions(pose, None, greatest, least, self._plant.load).missing_moment)
        return out

    def left(self, pose: Rotation, motion: Motion, efforts: FloatArray, load: Load | None) -> FloatArray:
        """Moment of a motion that given efforts do not make, shape (3,), N m, base frame: that of others."""
        return -self.tensions(pose, motion, efforts, efforts, load).missing_moment


def planner_of(plant: Plant) -> WristPlanner | DevicePlanner:
    """The planner of a plant."""
    return WristPlanner(plant) if plant.mechanism.limbs_are_massless else DevicePlanner(plant)
