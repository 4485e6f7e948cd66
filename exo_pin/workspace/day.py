"""A day in the device: the hand at mouth, ear, hair, belt, pocket and shelf, sitting, in a car, in bed, in a door.

A task is a place where the hand has to be. For a person of a size it fixes the bend of the elbow, by the law of
cosines, and leaves one freedom: the arm swivels about the line from the shoulder to the hand. Every swivel that the
person can take is tried.

Places are on the person's own body of capsules (:class:`exo_pin.BodyShape`), and on the obstacles about it. The hand
ends at the third knuckle (:attr:`exo_pin.Wearer.forearm_length`).

Assumptions: the shoulder's centre stands still; the hand is on the place, not the way to it; the trunk is upright but
in bed. A person takes a swivel where the arm is within the daily range of the shoulder and the middle of the forearm
stays out of trunk, neck and head, but for 50 mm: flesh gives way, and the shoulder goes forward.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.conventions import MIRROR, pose_columns
from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.validation import FloatArray, ReadOnly, as_positive, require_method
from ..design import Wearer
from ..design.obstacles import obstacle
from ..load_case.case import beyond_motion
from ..study import StudyTable
from ..wrist.clearance.clearance import BodyShape
from .criteria import Criteria
from .query import workspace

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: Farthest bend of an elbow, rad; shares of the reach at which the hand is at a shelf, and in a hanging arm.
_BENT, _STRETCHED, _HANGING = 2.6, 0.95, 0.995
#: Depth of the forearm's middle line in the body that a person gets to, m.
_GIVES = 0.05
#: Where the forearm is looked at, from elbow to hand.
_ALONG = np.array([0.0, 0.25, 0.5, 0.75])
#: How far a car's seat leans, degrees.
_CAR = 25.0
#: Parts of a torso: two capsules each of chest and belly, then collar, neck and head.
_BELLY, _HEAD = (2, 3), 6


class _Task(NamedTuple):
    name: str
    place: str
    obstacles: tuple[str, ...] = ()
    #: How far the trunk leans back, degrees.
    lean: float = 0.0


#: What people do in a day, where the hand is in it, and what stands about them.
_DAY = (
    _Task("soup, at a table", "mouth", ("chair",)),
    _Task("telephone", "ear"),
    _Task("comb", "hair"),
    _Task("seat belt's buckle", "other hip", ("car",), lean=_CAR),
    _Task("back pocket", "back of the hip"),
    _Task("shelf at eye height", "shelf"),
    _Task("other shoulder", "other shoulder"),
    _Task("jacket, second sleeve", "small of the back"),
    _Task("intimate care", "groin"),
    _Task("chair's arm rest", "chair", ("chair",)),
    _Task("wheelchair's arm rest", "wheelchair", ("wheelchair",)),
    _Task("in a car, hand to mouth", "mouth", ("car",), lean=_CAR),
    _Task("in bed, hand to mouth", "mouth", ("bed",), lean=90.0),
    _Task("through a door", "thigh", ("door",)),
)


@dataclass(frozen=True, eq=False)
class Day(Result, ReadOnly):
    """What a design does in the tasks of a day; n tasks, k swivels.

    Attributes
    ----------
    design : str
        Name of the design.
    tasks : tuple of str
        Names of the tasks.
    swivels : ndarray
        Shape (k,), rad: turn of the elbow about the line from the shoulder to the hand; 0 is the straight turn from
        rest.
    poses : Rotation
        Shape (n, k), of the upper arm.
    elbow_flexion : ndarray
        Shape (n,), rad; NaN where the hand does not get there.
    possible : ndarray of bool
        Shape (n, k): whether the person takes it.
    inside : ndarray of bool
        Shape (n, k): whether the person takes it and the design meets all criteria.
    reasons : ndarray of str
        Shape (n, k): criteria that are not met; "" where all are, or where the person does not take it.
    shoulder_force : ndarray
        Shape (n, k), |F_s|, N; NaN where it is not known.
    side : {"left", "right"}
        Side of the body.

    Examples
    --------
    >>> day = ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["forces"], step=30.0)
    >>> day.table["can_do"].tolist()[:3]
    ['yes', 'yes', 'yes']
    """

    design: str
    tasks: tuple[str, ...]
    swivels: FloatArray
    poses: Rotation
    elbow_flexion: FloatArray
    possible: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    reasons: NDArray[np.str_]
    shoulder_force: FloatArray
    side: str

    @cached_property
    def best(self) -> NDArray[np.intp]:
        """Shape (n,): the swivel inside of least |F_s|; of a task without one it says nothing."""
        return np.asarray(np.where(self.inside, np.nan_to_num(self.shoulder_force), np.inf).argmin(axis=1))

    @property
    def table(self) -> StudyTable:
        """One row a task.

        ``can_do`` is yes, no, or out of reach; ``swivels`` counts those that the person takes; ``inside`` is the share
        of them in which the design meets all criteria, and ``limited_by`` the criterion that most others miss. Elbow,
        pose and |F_s| are of the swivel of least |F_s|.
        """
        rows, at = [], self.best
        angles = {name: column[np.arange(len(at)), at] for name, column in pose_columns(self.poses, self.side).items()}
        for k, task in enumerate(self.tasks):
            count, held = int(self.possible[k].sum()), int(self.inside[k].sum())
            failed = [name for text in self.reasons[k][self.possible[k]] for name in str(text).split(", ") if name]
            rows.append(
                {
                    "task": task,
                    "can_do": "out of reach" if not count else "yes" if held else "no",
                    "swivels": count,
                    "inside": held / count if count else np.nan,
                    "limited_by": max(failed, key=failed.count) if failed else "",
                    "elbow_deg": float(np.degrees(self.elbow_flexion[k])),
                    **{name: float(column[k]) if held else np.nan for name, column in angles.items()},
                    "F_s_N": float(self.shoulder_force[k, at[k]]) if held else np.nan,
                }
            )
        return StudyTable(rows)

    def summary(self) -> dict[str, Any]:
        """Number of tasks, of these those that can be done, and those that the person cannot reach.

        Returns
        -------
        dict of str to int

        Examples
        --------
        >>> day = ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["stroke"], step=30.0)
        >>> sorted(day.summary())
        ['done', 'out_of_reach', 'tasks']
        """
        return {
            "tasks": len(self.tasks),
            "done": int(self.inside.any(axis=1).sum()),
            "out_of_reach": int((~self.possible.any(axis=1)).sum()),
        }

    def columns(self) -> dict[str, Any]:
        """The columns of :attr:`table`.

        Returns
        -------
        dict of str to ndarray
            Each of a row a task.

        Examples
        --------
        >>> day = ep.workspace.day_reach(ep.load("four-cables"), ["stroke", "forces"], step=30.0)
        >>> list(day.columns())[:3]
        ['task', 'can_do', 'swivels']
        """
        return self.table.columns()

    def __str__(self) -> str:
        found = self.summary()
        text = f"{self.design} does {found['done']} of {found['tasks']} tasks of a day."
        return f"{text}\n\n{self.table}"


@checked
def day_reach(exo: ShoulderExo, criteria: Criteria | Iterable[str] | None = None, step: float = 5.0) -> Day:
    """Which tasks of a day a person does with a design on.

    Parameters
    ----------
    exo : ShoulderExo
        The design on its wearer.
    criteria : Criteria or iterable of str, optional
        As in :func:`exo_pin.workspace.workspace`, besides the obstacles of each task; "connected" needs a grid and is
        left out.
    step : float
        Between swivels, degrees.

    Returns
    -------
    Day

    Raises
    ------
    MissingData
        If nobody wears the design.

    Notes
    -----
    Of a hand in T at distance d from the shoulder, with an upper arm a and a forearm b, the elbow bends by β with
    cos β = (d² - a² - b²) / (2 a b). With h the hand's place in {O_B}, the poses are R(φ) = exp(φ T/d) R_0, where R_0
    is the straight turn from h to T.

    Examples
    --------
    >>> day = ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["forces"], step=30.0)
    >>> day.summary()["tasks"]
    14
    """
    require_method("exo", exo, "worn_by", "ShoulderExo")
    arm = exo.device.arm
    if arm is None or arm.wearer is None:
        raise MissingData(["who wears it (wearer)"], "a day's tasks", exo.name)
    wearer, limits = arm.wearer, Criteria.of(criteria).off_grid()
    if limits.obstacles:
        raise InvalidInput("expected criteria without obstacles: each task has its own")
    count = max(1, round(360.0 / as_positive("step", step)))
    swivels = 2.0 * np.pi * np.arange(count) / count - np.pi
    places, torso = _places(wearer), BodyShape.of(wearer).torso
    rows = [_row(exo, wearer, task, places[task.place], torso, swivels, limits) for task in _DAY]
    quaternions, bends, *columns = map(np.stack, zip(*rows, strict=True))
    names, poses = tuple(task.name for task in _DAY), Rotation.from_quat(quaternions)
    possible, inside, reasons, force = columns
    return Day(exo.name, names, swivels, poses, bends, possible, inside, reasons, force, exo.side)


def _row(
    exo: ShoulderExo,
    wearer: Wearer,
    task: _Task,
    place: FloatArray,
    torso: FloatArray,
    swivels: FloatArray,
    limits: Criteria,
) -> tuple[Any, ...]:
    """One task, on the side of the design: quaternions, and the attributes of :class:`Day` from the elbow's on."""
    count = len(swivels)
    bend = bend_to(place, wearer)
    inside = np.zeros(count, dtype=bool)
    texts, force = np.full(count, "", dtype=object), np.full(count, np.nan)
    if np.isnan(bend):
        return Rotation.identity(count).as_quat(), bend, inside, inside, texts.astype(str), force
    matrices = swivelled(place, wearer, bend, swivels)
    possible = ~beyond_motion(matrices, "left") & _is_free(matrices, wearer, bend, torso)
    poses = Rotation.from_matrix(matrices if exo.side == "left" else MIRROR @ matrices @ MIRROR)
    if possible.any():
        worn = exo.worn_by(replace(wearer, elbow_flexion=bend))
        if task.lean:
            # What pulls down pulls to the back of a trunk that leans back.
            lean = np.radians(task.lean)
            weight = float(np.linalg.norm(exo.device.gravity)) * np.array([-np.sin(lean), 0.0, -np.cos(lean)])
            worn = worn.replace(gravity=weight.round(12) + 0.0)
        found = workspace(worn.device, poses[possible], replace(limits, obstacles=task.obstacles))
        inside[possible], force[possible] = found.inside, found.magnitude
        texts[possible] = found.reasons
    return poses.as_quat(), bend, possible, inside, texts.astype(str), force


def bend_to(place: FloatArray, wearer: Wearer) -> float:
    """Bend of the elbow with the hand at a place about the shoulder, rad; NaN where it does not get there."""
    upper, fore = wearer.upper_arm_length, wearer.forearm_length
    cosine = (float(place @ place) - upper**2 - fore**2) / (2.0 * upper * fore)
    bend = float(np.arccos(cosine)) if -1.0 <= cosine <= 1.0 else np.nan
    return bend if bend <= _BENT else np.nan


def swivelled(place: FloatArray, wearer: Wearer, bend: float, swivels: FloatArray) -> FloatArray:
    """Orientations of a left upper arm with the hand at a place, shape (k, 3, 3)."""
    hand = _hand(wearer, bend)
    line = place / np.linalg.norm(place)
    axis, cosine = np.cross(hand, place), float(hand @ place)
    sine = float(np.linalg.norm(axis))
    # No place of a day is on the line of the hand at rest, on which the turn would have no axis.
    first = Rotation.from_rotvec(np.arctan2(sine, cosine) / sine * axis)
    return np.asarray((Rotation.from_rotvec(swivels[:, None] * line) * first).as_matrix())


def _hand(wearer: Wearer, bend: float) -> FloatArray:
    """The hand in {O_B}, m."""
    upper, fore = wearer.upper_arm_length, wearer.forearm_length
    return np.array([fore * np.sin(bend), 0.0, -upper - fore * np.cos(bend)])


def _is_free(matrices: FloatArray, wearer: Wearer, bend: float, torso: FloatArray) -> NDArray[np.bool_]:
    """Poses in which the middle line of the forearm is out of the body, as far as a person gets."""
    elbow = np.array([0.0, 0.0, -wearer.upper_arm_length])
    along = elbow + _ALONG[:, None] * (_hand(wearer, bend) - elbow)
    points = along @ matrices.transpose(0, 2, 1)
    first, last, radius = torso[:, 0:3], torso[:, 3:6], torso[:, 6]
    axis = last - first
    share = np.einsum("kpbi,bi->kpb", points[:, :, None] - first, axis) / np.maximum((axis**2).sum(axis=1), 1e-18)
    nearest = first + np.clip(share, 0.0, 1.0)[..., None] * axis
    return np.asarray((np.linalg.norm(points[:, :, None] - nearest, axis=-1) > radius - _GIVES).all(axis=(1, 2)))


def _places(wearer: Wearer) -> dict[str, FloatArray]:
    """Places of the hand about the left shoulder, m, {O_A} (x forward, y left, z up)."""
    torso = BodyShape.of(replace(wearer, clothing=0.0)).torso
    near, far, head = torso[_BELLY[0]], torso[_BELLY[1]], torso[_HEAD]
    belly, round_head = near[6], head[6]
    middle, low, high = head[1], np.array(head[0:3]), np.array(head[3:6])
    eyes = 0.5 * (low + high)
    behind_up = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
    reach = _STRETCHED * (wearer.upper_arm_length + wearer.forearm_length)
    rests = {name: _arm_rest(name, wearer) for name in ("chair", "wheelchair")}
    return rests | {
        "mouth": low + round_head * np.array([1.0, 0.0, 0.0]),
        "ear": eyes + round_head * np.array([0.0, 1.0, 0.0]),
        "hair": high + round_head * behind_up,
        "other hip": far[3:6] + belly * np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0),
        "back of the hip": np.array([-belly, near[1], near[5]]),
        "shelf": np.array([np.sqrt(reach**2 - eyes[2] ** 2), 0.0, eyes[2]]),
        "other shoulder": np.array([0.0, 2.0 * middle, 0.0]) + torso[4][6] * np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0),
        "small of the back": np.array([-belly, middle, near[2]]),
        "groin": np.array([0.0, middle, near[5]]) + belly * np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0),
        "thigh": np.array([0.0, 0.0, -_HANGING * (wearer.upper_arm_length + wearer.forearm_length)]),
    }


def _arm_rest(name: str, wearer: Wearer) -> FloatArray:
    """The middle of the arm rest beside the left arm, on its upper side: the rod farthest left that leads forward."""
    rows = obstacle(name, wearer)
    forward = rows[(rows[:, 3] > rows[:, 0] + 0.1) & (rows[:, 1] == rows[:, 4])]
    rest = forward[forward[:, 1].argmax()]
    return np.array([0.5 * (rest[0] + rest[3]), rest[1], rest[2] + rest[6]])
