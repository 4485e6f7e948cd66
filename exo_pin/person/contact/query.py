"""The query: person, poses, loads and device in, contact forces out."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import MIRROR
from ...core.errors import InvalidInput, OutsideRangeOfMotion
from ...core.progress import mapped
from ...core.validation import FloatArray, as_choice, as_finite
from ...load_case import Load, Motion
from ...load_case.pose_stacks import Query, as_query, carried
from ...reaction.answer import STANDARD_GRAVITY
from ..limb.limb_state import LIMIT_NAMES, LimbGeometry, limb_lengths, limb_state
from ..limb.muscle_table import MUSCLES, MuscleState, muscle_state
from ..limb.myoarm import myoarm
from .activation import BALANCED, MusclePose, least_effort, least_missing
from .assumption_range import ContactOptions
from .device import DeviceAction, as_action
from .result import STATUS, JointContact

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..wearer import Person


class Balance(NamedTuple):
    """Balance of N poses, linear in the activations a: ``rows @ a = -(constant)`` and contact = ``pull @ a + rest``.

    Attributes
    ----------
    rows : ndarray
        Moments per activation, shape (N, 5, m), N m: three about the centre, elbow flexion, forearm.
    constant : ndarray
        Moments of all that does not depend on the activations, shape (N, 5), N m.
    pull : ndarray
        Contact force per activation, shape (N, 3, m), N: of the scapula on the humerus.
    rest : ndarray
        Contact force without activation, shape (N, 3), N.
    """

    rows: FloatArray
    constant: FloatArray
    pull: FloatArray
    rest: FloatArray


def balance_of(
    person: Person,
    limb: LimbGeometry,
    muscles: MuscleState,
    query: Query,
    gravity: FloatArray,
    options: ContactOptions,
    load: Load | None,
) -> Balance:
    """Muscles, weight, inertia and load about a centre that is displaced against bones and muscles.

    Parameters
    ----------
    person : Person
        Whose arm it is, a right one.
    limb, muscles
        Bones, paths and strengths in these poses.
    query : Query
        Poses, motion and load.
    gravity : ndarray
        Shape (3,), m/s².
    options : ContactOptions
        What the load acts on, so that the elbow has to carry it, and the displacement, for the side of the person.
    load : Load, optional
        Of the query, as it was given: where it acts.
    """
    shift = np.asarray(options.centre_shift) @ (MIRROR if person.side == "left" else np.eye(3))
    force, about_centre = carried(person.arm, gravity, query, query.force, query.moment)
    counts = _beyond_elbow(person, load) if options.load_on is None else options.load_on == "forearm"
    on_forearm = np.broadcast_to(counts, query.shape).reshape(-1, 1)
    below, about = carried(person.forearm, gravity, query, query.force * on_forearm, query.moment * on_forearm)
    about_elbow = about - np.cross(query.matrices @ person.elbow_centre, below)
    elbow = np.einsum("ni,ni->n", limb.elbow_axis, about_elbow)
    moment = limb.moment - np.cross(shift, limb.pull)
    arms = np.concatenate([np.swapaxes(moment, 1, 2), limb.elbow[:, None, :], limb.forearm[:, None, :]], axis=1)
    outer = np.concatenate([about_centre - np.cross(shift, force), elbow[:, None], np.zeros((len(elbow), 1))], axis=1)
    pulls = np.swapaxes(limb.pull, 1, 2)
    return Balance(
        arms * muscles.active[:, None, :],
        outer + np.einsum("nkm,nm->nk", arms, muscles.passive),
        -pulls * muscles.active[:, None, :],
        -(force + np.einsum("nkm,nm->nk", pulls, muscles.passive)),
    )


def _beyond_elbow(person: Person, load: Load | None) -> Any:
    """Whether a load acts on the forearm's side of the elbow, shape (...): of the plane that bisects both segments.

    Upper arm and forearm point along (0, 0, -1) and (sin bend, 0, -cos bend) in {O_A}; their sum is the plane's normal.
    """
    if load is None:
        return False
    bend = person.elbow_flexion
    along = np.array([np.sin(bend), 0.0, -np.cos(bend) - 1.0])
    return (np.asarray(load.at) - person.elbow_centre) @ along >= -_AT_ELBOW


#: A load this near to the elbow acts on the forearm, m.
_AT_ELBOW = 2e-3
#: An elbow bent by less than this is straight, rad.
_STRAIGHT = np.radians(1.0)
#: Time either way in which the rate of the muscles' lengths is taken, s: rounding of lengths is 1e-11 m/s then.
_INSTANT = 1e-5
#: Moments of an arm of which less is left are rounding, N m.
_NO_MOMENT = 1e-6
#: Poses that are sent to a worker at once; each takes some milliseconds.
_BLOCK = 16
#: Programs whose answers are kept, some kB each: designs that are compared ask for the same arm in the same poses.
_KEPT = 1024


class _Arm(NamedTuple):
    """The arm in N poses, a stack of a shape, without a device."""

    person: Person
    shape: tuple[int, ...]
    limb: LimbGeometry
    muscles: MuscleState
    balance: Balance
    options: ContactOptions
    progress: bool
    executor: Executor | None

    @property
    def is_straight(self) -> bool:
        """Whether the elbow is at its end of extension, which holds a moment."""
        return self.person.elbow_flexion < _STRAIGHT


class _Solved(NamedTuple):
    """Outputs of all poses, and the part of them that has no balance."""

    z: FloatArray
    status: NDArray[np.int8]
    missing: FloatArray
    kkt: FloatArray
    gap: FloatArray


def contact_forces(
    person: Person,
    poses: Rotation,
    motion: Motion | None,
    load: Load | None,
    device: DeviceAction | ArrayLike | None,
    options: ContactOptions,
    gravity: ArrayLike,
    outside: str,
    progress: bool,
    executor: Executor | None = None,
) -> JointContact:
    """Contact forces of a person's shoulder; see :meth:`exo_pin.Person.joint_contact`."""
    as_choice("outside", outside, ("raise", "mark"))
    query = as_query(poses, motion, load)
    pull = as_finite("gravity", gravity, (3,))
    action = None if device is None else as_action(device)
    left = person.side == "left"
    if left:
        # The model is a right arm: a left one is its mirror image, bit for bit.
        query, pull = _mirrored_query(query), pull @ MIRROR
        action = None if action is None else action.mirrored()
    posture = (person.elbow_flexion, person.forearm_rotation, person.length_scale)
    limb = limb_state(query.matrices, *posture, left=False, scapular_motion=person.scapular_motion)
    if outside == "raise":
        _refuse(limb, query.shape)
    velocity = None if motion is None else _length_rates(person, query)
    muscles = muscle_state(person.muscle_table, limb.length, velocity, options.passive)
    balance = balance_of(person, limb, muscles, query, pull, options, load)
    # Of a right arm, whose socket faces to the right: forwards is a positive turn about the vertical.
    turn = Rotation.from_rotvec([0.0, 0.0, options.socket_turn])
    limb = limb._replace(glenoid=limb.glenoid @ turn.as_matrix().T)
    if action is not None:
        action = action.about(np.asarray(options.centre_shift) @ (MIRROR if left else np.eye(3)))
    arm = _Arm(person, query.shape, limb, muscles, balance, options, progress, executor)
    assumptions = options.described(person, motion is not None)
    result = _answer(arm, as_action(np.zeros(6)), assumptions)
    if action is not None:
        # NaN times zero is NaN, which counts as nothing that is kept.
        kept = options.kept_activation * result.activations.reshape(-1, len(MUSCLES))
        with_device = _answer(arm, action, {**assumptions, "device": action.chosen_by}, kept)
        held = np.array(np.broadcast_to(action.held, query.shape))
        result = replace(
            with_device, without_device=result, caution=action.caution, held=held, drive_units=action.drive_units
        )
    return result.mirrored() if left else result


def _mirrored_query(query: Query) -> Query:
    """Mirror image in the x-z plane; angular velocity and moments are pseudovectors."""
    return query._replace(
        matrices=np.ascontiguousarray(MIRROR @ query.matrices @ MIRROR),
        velocity=-query.velocity @ MIRROR,
        acceleration=-query.acceleration @ MIRROR,
        force=query.force @ MIRROR,
        moment=-query.moment @ MIRROR,
    )


def _refuse(limb: LimbGeometry, shape: tuple[int, ...]) -> None:
    """Raise for the first pose that is outside the range of motion."""
    rows = np.flatnonzero(limb.outside.any(axis=1))
    if not rows.size:
        return
    row = int(rows[0])
    which = int(np.argmax(limb.outside[row]))
    low, high = np.degrees(myoarm().limits[which])
    reason = (
        f"{LIMIT_NAMES[which]} of {np.degrees(limb.angles[row, which]):.1f}°, where the model goes from "
        f"{low:.0f} to {high:.0f}°"
    )
    index = tuple(int(i) for i in np.unravel_index(row, shape)) if shape else ()
    raise OutsideRangeOfMotion(reason, len(rows), index)


def _length_rates(person: Person, query: Query) -> FloatArray:
    """Rates of the muscles' lengths, shape (N, m), m/s, by central differences along the motion."""
    sides, posture = [], (person.elbow_flexion, person.forearm_rotation, person.length_scale, person.scapular_motion)
    for sign in (1.0, -1.0):
        turned = Rotation.from_rotvec(sign * _INSTANT * query.velocity).as_matrix() @ query.matrices
        sides.append(limb_lengths(turned, *posture))
    return (sides[0] - sides[1]) / (2.0 * _INSTANT)


def _answer(
    arm: _Arm, action: DeviceAction, assumptions: dict[str, str], kept: FloatArray | float = 0.0
) -> JointContact:
    """The answer with activations of at least ``kept``, shape (N, m); NaN, as of a bare arm without result, is none."""
    m, limb, balance, shape = len(MUSCLES), arm.limb, arm.balance, arm.shape
    action = action.flat(shape)
    tensions = action.limbs.shape[1] - action.side_forces
    solved = _solve(arm, action, np.nan_to_num(np.broadcast_to(kept, (len(limb.centre), m))))
    z, status = solved.z, solved.status
    a, f = z[:, :m], z[:, m:]
    wrench = action.constant + np.einsum("kni,kn->ki", action.limbs, f)
    force = balance.rest - wrench[:, :3] + np.einsum("kim,km->ki", balance.pull, a)
    tension = arm.muscles.active * a + arm.muscles.passive
    empty = status != 0
    for array in (force, a, f, tension, wrench, solved.kkt, solved.gap):
        array[empty] = np.nan
    return JointContact(
        force=force.reshape(*shape, 3),
        activations=a.reshape(*shape, m),
        muscle_forces=tension.reshape(*shape, m),
        device_forces=f[:, :tensions].reshape(*shape, tensions),
        constraint_forces=f[:, tensions:].reshape(*shape, action.side_forces),
        device_wrench=wrench.reshape(*shape, 6),
        glenoid=limb.glenoid.reshape(*shape, 3, 3),
        centre=limb.centre.reshape(*shape, 3),
        status=np.array(STATUS)[status].reshape(shape),
        missing_moment=solved.missing[:, :3].reshape(*shape, 3),
        missing_elbow=solved.missing[:, 3:].reshape(*shape, 2),
        # What something else holds is missing from nothing.
        residual=_residual(
            balance._replace(constant=balance.constant + solved.missing), a, wrench, arm.is_straight
        ).reshape(shape),
        kkt=solved.kkt.reshape(shape),
        gap=solved.gap.reshape(shape),
        body_weight=arm.person.mass * STANDARD_GRAVITY,
        side="right",
        assumptions=assumptions,
    )


def _solve(arm: _Arm, action: DeviceAction, kept: FloatArray) -> _Solved:
    limbs, lower, upper, balance, cone = action.limbs, action.lower, action.upper, arm.balance, arm.options.cone
    count, n = limbs.shape[:2]
    m = len(MUSCLES)
    out = _Solved(
        np.full((count, m + n), np.nan),
        np.zeros(count, dtype=np.int8),
        np.zeros((count, 5)),
        np.full(count, np.nan),
        np.full(count, np.nan),
    )
    out.status[arm.limb.outside.any(axis=1)] = STATUS.index("outside")
    no_force = np.isnan(lower).any(axis=1) | np.isnan(upper).any(axis=1) | np.isnan(limbs).any(axis=(1, 2))
    out.status[(out.status == 0) & no_force] = STATUS.index("no_device_force")
    if not arm.person.strength:
        return _without_muscles(arm, action, out)
    volume = arm.person.muscle_table.volume
    weights = np.ones(m) if arm.options.weights == "equal" else volume / volume.mean()
    ratios = None if cone is None else np.array([[1.0], [cone.superior], [cone.anterior]])
    rows, programs, places = np.flatnonzero(out.status == 0).tolist(), [], []
    for row in rows:
        # Given limb forces are loads, not variables: an interior-point solver needs room between the bounds.
        fixed = lower[row] == upper[row]
        out.z[row, m:][fixed] = lower[row, fixed]
        wrench = action.constant[row] + limbs[row, fixed].T @ lower[row, fixed]
        free = limbs[row, ~fixed]
        pose = MusclePose(
            rows=np.concatenate([balance.rows[row], np.vstack([free[:, 3:].T, np.zeros((2, len(free)))])], axis=1),
            constant=balance.constant[row] + np.concatenate([wrench[3:], np.zeros(2)]),
            pull=np.concatenate([balance.pull[row], -free[:, :3].T], axis=1),
            rest=balance.rest[row] - wrench[:3],
            low=np.concatenate([kept[row], lower[row, ~fixed]]),
            high=np.concatenate([np.ones(m), upper[row, ~fixed]]),
            weights=weights,
            power=arm.options.power,
            socket=None if ratios is None else arm.limb.glenoid[row] / ratios,
            stopped=arm.is_straight,
            least=action.least if len(free) else "effort",
        )
        programs.append(pose)
        places.append(np.concatenate([np.ones(m, dtype=bool), ~fixed]))
    found = mapped(_solve_pose, programs, arm.executor, "muscles", arm.progress, _BLOCK)
    for row, chosen, (z, status, kkt, gap, missing) in zip(rows, places, found, strict=True):
        out.status[row] = STATUS.index(status)
        if z is not None:
            out.z[row, chosen] = z
        out.kkt[row], out.gap[row], out.missing[row] = kkt, gap, missing
    return out


@lru_cache(maxsize=_KEPT)
def _solve_pose(pose: MusclePose) -> tuple[FloatArray | None, str, float, float, FloatArray]:
    """Variables, status, errors, and what is missing where there is no solution, of one pose."""
    found, nothing = least_effort(pose), np.zeros(5)
    if found.is_optimal:
        return found.z, "ok", found.kkt, found.gap, nothing
    missing, proved = least_missing(pose, in_socket=False)
    status = "too_weak"
    if proved and np.abs(missing).max() <= BALANCED and pose.socket is not None:
        missing, proved = least_missing(pose, in_socket=True)
        status = "unstable"
    # Not "<=": a moment that is NaN is no answer of nothing missing.
    if not proved or bool((np.abs(missing) <= BALANCED).all()):
        return None, "not_solved", np.nan, np.nan, nothing
    return None, status, np.nan, np.nan, missing


def _without_muscles(arm: _Arm, action: DeviceAction, out: _Solved) -> _Solved:
    """Of a wearer without any muscle force: the device balances the arm, or nothing does; something holds the elbow.

    Raises
    ------
    InvalidInput
        If limb forces are to be chosen together with the activations.
    """
    rows, m = np.flatnonzero(out.status == 0), len(MUSCLES)
    if (action.lower[rows] != action.upper[rows]).any():
        raise InvalidInput("expected given limb forces for a wearer of strength 0: there is no effort to be made least")
    out.z[rows, :m], out.z[rows, m:] = 0.0, action.lower[rows]
    turning = action.constant[rows] + np.einsum("kni,kn->ki", action.limbs[rows], action.lower[rows])
    out.missing[rows] = -arm.balance.constant[rows]
    out.missing[rows, :3] -= turning[:, 3:]
    if arm.is_straight:
        out.missing[rows, 3] = np.minimum(out.missing[rows, 3], 0.0)
    least = BALANCED * np.maximum(1.0, np.linalg.norm(turning[:, 3:], axis=1))
    held = np.linalg.norm(out.missing[rows, :3], axis=1) <= least
    out.missing[rows[held], :3] = 0.0
    out.status[rows[~held]] = STATUS.index("too_weak")
    out.kkt[rows[held]] = out.gap[rows[held]] = 0.0
    return out


def _residual(balance: Balance, a: FloatArray, wrench: FloatArray, stopped: bool) -> FloatArray:
    """What the moment balance misses, over the sum of the sizes of its terms, or over what is rounding."""
    terms = balance.rows * a[:, None, :]
    outer = balance.constant.copy()
    outer[:, :3] += wrench[:, 3:]
    miss = terms.sum(axis=2) + outer
    if stopped:
        miss[:, 3] = np.maximum(miss[:, 3], 0.0)
    size = np.abs(terms).sum(axis=(1, 2)) + np.abs(outer).sum(axis=1)
    return np.asarray(np.abs(miss).max(axis=1) / np.maximum(size, _NO_MOMENT))
