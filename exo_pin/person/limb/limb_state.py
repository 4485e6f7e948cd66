"""What the anatomical model says in a stack of poses: centre, socket, lines of action and lengths of the muscles.

A muscle's pull on a body part is read from the points of its path where it leaves that part for the rest: the tension
acts there along the path. Wrapping surfaces have no friction, so that the tension is the same everywhere, and a path
that wraps around a bone of the same part adds nothing. MuJoCo's generalised forces are not used: the joint that
elevates the arm drags clavicle and scapula along, and at elevation zero the shoulder's axes are singular.
"""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import MIRROR
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from .muscle_table import MUSCLES
from .myoarm import MyoArm, glenoid_surface, myoarm

#: Below this elevation, rad, the limits of the plane of elevation do not count: the plane is hardly defined there, and
#: a little adduction or extension lies outside of them.
_HANGING = np.radians(10.0)
#: What rounding may add to an angle at its limit, rad.
_ROUNDING = 1e-9
#: Names of the angles that have limits, in the order of :attr:`MyoArm.limits`.
LIMIT_NAMES = ("plane of elevation", "elevation", "axial rotation", "elbow flexion", "forearm rotation")
#: Where the joints below the shoulder go, degrees.
_RANGES = {"elbow_flexion": (0.0, 130.0), "forearm_rotation": (-90.0, 90.0)}


def as_joint_angle(name: str, value: Any, degrees: bool) -> float:
    """An angle of elbow or forearm in rad, given in rad or degrees; InvalidInput where the joint does not go there."""
    angle = float(as_finite(name, value, ()))
    angle = float(np.radians(angle)) if degrees else angle
    low, high = _RANGES[name]
    if not np.radians(low) - _ROUNDING <= angle <= np.radians(high) + _ROUNDING:
        raise InvalidInput(
            f"expected {name} of {low:g} to {high:g}°, where the model's joint goes, got "
            f"{np.degrees(angle):g}°{'' if degrees else ' (give degrees=True for degrees)'}"
        )
    return angle


def thorax_to_base(limb: MyoArm) -> FloatArray:
    """Rotation from the model's thorax frame to {O_A} of a right shoulder, shape (3, 3)."""
    up = limb.vertical
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    forward /= np.linalg.norm(forward)
    return np.stack([forward, np.cross(up, forward), up])


def model_axes(limb: MyoArm) -> FloatArray:
    """Axes K = [e1 e2 e3] of the angles, as columns in {O_A} of a right shoulder, shape (3, 3)."""
    to_base = thorax_to_base(limb)
    e1, e3 = to_base @ limb.elevation_axis, to_base @ limb.vertical
    return np.stack([e1, np.cross(e3, e1), e3], axis=1)


def angles_of(limb: MyoArm, matrices: FloatArray) -> FloatArray:
    """Angles of right upper arms.

    Parameters
    ----------
    limb : MyoArm
        The model.
    matrices : ndarray
        Orientations of {O_B} in {O_A}, shape (N, 3, 3).

    Returns
    -------
    ndarray
        Shape (N, 3), rad: plane of elevation (0 outwards, positive forwards), elevation, axial rotation (positive
        inwards).
    """
    K = model_axes(limb)
    G = K.T @ matrices @ K
    level = np.hypot(G[:, 0, 2], G[:, 1, 2])
    elevation = np.arctan2(level, G[:, 2, 2])
    # Below this the direction of so small a tilt is rounding.
    plane = np.where(level > 1e-12, np.arctan2(G[:, 0, 2], -G[:, 1, 2]), 0.0)
    # Turn about the arm's own axis: first row of Rx(-elevation) Rz(-plane) G.
    cos, sin = np.cos(plane), np.sin(plane)
    first = cos[:, None] * G[:, 0] + sin[:, None] * G[:, 1]
    turn = np.arctan2(-first[:, 1], first[:, 0])
    rotation = np.mod(turn + plane + np.pi, 2.0 * np.pi) - np.pi
    return np.stack([plane, elevation, rotation], axis=1)


def beyond(limb: MyoArm, angles: FloatArray) -> NDArray[np.bool_]:
    """Which poses lie outside the model's range of motion.

    Parameters
    ----------
    limb : MyoArm
        The model.
    angles : ndarray
        Of :func:`angles_of`, shape (N, 3).

    Returns
    -------
    ndarray of bool
        Shape (N, 3): which angle is outside.
    """
    limits = limb.limits[:3]
    outside: Any = (angles < limits[:, 0] - _ROUNDING) | (angles > limits[:, 1] + _ROUNDING)
    outside[:, 0] &= angles[:, 1] > _HANGING
    return outside


_own = threading.local()
#: Elevations of :func:`limb_by_elevation`, rad.
_ELEVATIONS = np.radians(np.arange(0.0, 180.1, 2.5))


class LimbGeometry(NamedTuple):
    """Geometry of N poses of one side; vectors in {O_A} of that side, for m muscles.

    Attributes
    ----------
    angles : ndarray
        Shape (N, 3), rad: plane of elevation, elevation and axial rotation of the model.
    outside : ndarray of bool
        Shape (N, 3): which of them is beyond the model's range. Such rows are NaN below.
    centre : ndarray
        Displacement of the glenohumeral centre from its place at rest, shape (N, 3), m.
    glenoid : ndarray
        Shape (N, 3, 3), rows: out of the socket, superior, anterior.
    pull : ndarray
        Force of each muscle on humerus and forearm per newton of tension, shape (N, m, 3).
    moment : ndarray
        Its moment about the glenohumeral centre, shape (N, m, 3), m.
    elbow, forearm : ndarray
        Moment on the forearm about the axis of elbow flexion, and on the radius about the forearm's axis, per newton,
        shape (N, m), m; flexion and pronation are positive.
    elbow_axis : ndarray
        Axis of elbow flexion, shape (N, 3), unit vectors; for both sides the moment M about it that flexes is M · axis.
    length : ndarray
        Length of the muscles with their tendons, shape (N, m), m.
    """

    angles: FloatArray
    outside: NDArray[np.bool_]
    centre: FloatArray
    glenoid: FloatArray
    pull: FloatArray
    moment: FloatArray
    elbow: FloatArray
    forearm: FloatArray
    elbow_axis: FloatArray
    length: FloatArray


def limb_state(
    matrices: FloatArray,
    elbow_flexion: float,
    forearm_rotation: float,
    scale: float,
    left: bool,
    scapular_motion: float = 1.0,
) -> LimbGeometry:
    """Evaluate the model in a stack of poses.

    Parameters
    ----------
    matrices : ndarray
        Orientations of {O_B} in {O_A}, shape (N, 3, 3).
    elbow_flexion, forearm_rotation : float
        Angles of elbow and forearm, rad; pronation is positive.
    scale : float
        Person's lengths over the model's.
    left : bool
        Whether the arm is a left one: the mirror image of the model.
    scapular_motion : float
        How far clavicle and scapula follow the elevation, over the model's.

    Returns
    -------
    LimbGeometry
    """
    limb = myoarm()
    right = MIRROR @ matrices @ MIRROR if left else matrices
    angles = angles_of(limb, right)
    outside = beyond(limb, angles)
    count, m = len(angles), len(MUSCLES)
    shapes = ((3,), (3, 3), (m, 3), (m, 3), (m,), (m,), (3,), (m,))
    state = LimbGeometry(angles, outside, *(np.full((count, *shape), np.nan) for shape in shapes))
    rest = _evaluate(limb, np.zeros(3), 0.0, 0.0)[0]
    to_base = thorax_to_base(limb)
    for row in np.flatnonzero(~outside.any(axis=1)):
        centre, glenoid, pull, moment, elbow, forearm, axis, length = _evaluate(
            limb, angles[row], elbow_flexion, forearm_rotation, scapular_motion
        )
        state.centre[row] = scale * (to_base @ (centre - rest))
        state.glenoid[row] = glenoid @ to_base.T
        state.pull[row] = pull @ to_base.T
        state.moment[row] = scale * (moment @ to_base.T)
        state.elbow[row], state.forearm[row] = scale * elbow, scale * forearm
        state.elbow_axis[row] = to_base @ axis
        state.length[row] = scale * length
    return _mirrored(state) if left else state


def limb_lengths(
    matrices: FloatArray, elbow_flexion: float, forearm_rotation: float, scale: float, scapular_motion: float = 1.0
) -> FloatArray:
    """Lengths of the muscles of right arms alone, shape (N, m), m, also a little beyond the range of motion."""
    limb = myoarm()
    lengths = np.empty((len(matrices), len(MUSCLES)))
    for row, angles in enumerate(angles_of(limb, matrices)):
        data = placed(limb, angles, elbow_flexion, forearm_rotation, scapular_motion)
        lengths[row] = data.ten_length[limb.tendons]
    return scale * lengths


def limb_by_elevation(scale: float, left: bool, scapular_motion: float = 1.0) -> tuple[FloatArray, LimbGeometry]:
    """Elevations from 0 to 180°, rad, and the bones with a straight arm that is lifted outwards by them."""
    axis = model_axes(myoarm())[:, 0]
    lifted = Rotation.from_rotvec(_ELEVATIONS[:, None] * (-axis @ MIRROR if left else axis))
    return _ELEVATIONS, limb_state(lifted.as_matrix(), 0.0, 0.0, scale, left, scapular_motion)


def _mirrored(state: LimbGeometry) -> LimbGeometry:
    """Mirror image of vectors; moments and axes are pseudovectors, the moment about an axis stays."""
    return state._replace(
        centre=state.centre @ MIRROR,
        glenoid=state.glenoid @ MIRROR,
        pull=state.pull @ MIRROR,
        moment=-state.moment @ MIRROR,
        elbow_axis=-state.elbow_axis @ MIRROR,
    )


def placed(limb: MyoArm, angles: FloatArray, elbow: float, forearm: float, scapular_motion: float = 1.0) -> Any:
    """This thread's data of the model, placed in a pose, with the tendons' paths."""
    mujoco, model = limb.mujoco, limb.model
    data = getattr(_own, "data", None)
    if data is None:
        data = _own.data = mujoco.MjData(model)
    plane, elevation, rotation = angles
    data.qpos[:] = 0.0
    data.qpos[limb.angles] = plane, elevation, -plane, rotation, elbow, forearm
    # The couplings turn clavicle and scapula there and back: the humerus stays in its pose whatever they are times.
    data.qpos[limb.coupled] = scapular_motion * limb.coupling * elevation
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    return data


def _evaluate(
    limb: MyoArm, angles: FloatArray, elbow: float, forearm: float, scapular_motion: float = 1.0
) -> tuple[FloatArray, ...]:
    """Centre, socket, pulls, moments, elbow and forearm moments, axis of flexion and lengths, in the thorax's frame."""
    data = placed(limb, angles, elbow, forearm, scapular_motion)
    thorax, origin = data.xmat[limb.root].reshape(3, 3), data.xpos[limb.root]
    spots, bodies, muscle = muscle_paths(limb, data)
    centre = data.xpos[limb.humerus]
    pull, moment = _cut(spots, bodies, muscle, limb.in_arm, centre)
    hinges = []
    for part, body, joint in ((limb.in_forearm, limb.ulna, 4), (limb.in_radius, limb.radius, 5)):
        axis = data.xaxis[limb.angles[joint]]
        hinges += [_cut(spots, bodies, muscle, part, data.xpos[body])[1] @ axis, axis @ thorax]
    glenoid = glenoid_surface().axes @ data.xmat[limb.scapula].reshape(3, 3).T
    return (
        (centre - origin) @ thorax,
        glenoid @ thorax,
        pull @ thorax,
        moment @ thorax,
        hinges[0],
        hinges[2],
        hinges[1],
        data.ten_length[limb.tendons].copy(),
    )


def muscle_paths(limb: MyoArm, data: Any) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """Points of all muscles' paths, shape (p, 3), the body that each is on, and the muscle that it belongs to."""
    model = limb.model
    first, count = data.ten_wrapadr[limb.tendons], data.ten_wrapnum[limb.tendons]
    muscle = np.repeat(np.arange(len(count)), count)
    before = np.concatenate([[0], np.cumsum(count)[:-1]])
    place = np.repeat(first - before, count) + np.arange(count.sum())
    objects = data.wrap_obj.ravel()[place]
    at_site = objects < 0
    # The sites come in the order of the path: count them within each muscle.
    passed = np.cumsum(at_site) - 1
    passed -= np.repeat(passed[before] - at_site[before] + 1, count)
    sites = limb.path_sites[np.repeat(limb.site_start[limb.tendons], count) + np.maximum(passed, 0)]
    bodies = np.where(at_site, model.site_bodyid[sites], model.geom_bodyid[np.maximum(objects, 0)])
    return data.wrap_xpos.reshape(-1, 3)[place], bodies, muscle


def _cut(
    spots: FloatArray, bodies: NDArray[np.int64], muscle: NDArray[np.int64], part: NDArray[np.bool_], about: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment about a point, shape (m, 3) each, of unit tensions on a part of the body."""
    inside = part[bodies]
    crosses = np.flatnonzero((inside[:-1] != inside[1:]) & (muscle[:-1] == muscle[1:]))
    near = np.where(inside[crosses], crosses, crosses + 1)
    far = np.where(inside[crosses], crosses + 1, crosses)
    away = spots[far] - spots[near]
    away /= np.linalg.norm(away, axis=1)[:, None]
    force, moment = np.zeros((len(MUSCLES), 3)), np.zeros((len(MUSCLES), 3))
    np.add.at(force, muscle[crosses], away)
    np.add.at(moment, muscle[crosses], np.cross(spots[near] - about, away))
    return force, moment
