"""Least distances of a device's limbs to the wearer's arm and torso, and to one another.

Bodies and limbs are segments with a radius (capsules).

Limbs that are joined: two limbs whose joints on the same body are nearer than the sum R of their radii reach into each
other there in every pose, so that the two joints are one fitting: a common eye, pulley or fork. Within the radius ρ of
the fitting a limb does not count for the other one; it is ρ_0 = 3 R + 30 mm (assumed, as the radii of limbs are) where
the joints are one point, and ρ = ρ_0 (1 - d/R) with d between them, at most half of the limb's length. At d = R it is
zero: gaps are continuous as joints move apart, and those of joints that are farther apart are of the whole limbs. Two
limbs from one point, at an angle θ, are 2 ρ_0 sin(θ/2) - R apart beyond the fitting; joints side by side make of it
(1 - d/R) (2 ρ_0 sin(θ/2) - R), with the same sign. They are clear of each other where θ is more than
2 asin(R/(2 ρ_0)), 7° of cables and 15° of linear actuators, and in each other where they fold onto each other.

A wearer's torso, head and arm as capsules about the shoulder.

The lengths of upper arm, forearm and fist are those of the arm's mass (:class:`exo_pin.Wearer`, de Leva 1996), between
the centres of the joints. Half the breadth of the shoulders is 0.129 of stature and the shoulder's height 0.818
(Drillis and Contini, as Winter, Biomechanics and Motor Control of Human Movement, prints them). Girths of arm, neck and
head, breadths and depths of chest and waist follow from sex, stature and mass, or are measured
(:mod:`exo_pin.design.body_dimensions`, ANSUR II). The chest reaches to 0.16 of stature below the shoulder, where the
belly begins, and the trunk to 0.28; each is two upright capsules side by side. Clothing thickens all of them.
**Estimates**: 0.031 of stature for the soft tissue above the collar bone, the heights of waist and neck.

Assumptions: the trunk is upright and stays where it is. Where the shoulder's centre moves against the trunk, the
capsule from neck to shoulder follows it with its outer end.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...core.conventions import as_side
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, require_type
from ...design import Mechanism
from ...design.obstacles import obstacle
from ...design.wearer import Wearer
from ...numerics.vectors import add, dot, matrix, root, turn, vector

#: Shares of stature: from the shoulder to the body's middle and to the top of the head; heights above the shoulder of
#: the upper end of the chest, its lower end, that of the trunk, the neck's foot at the collar bone, and its top.
_MIDDLE, _TO_TOP, _CHEST, _WAIST, _TRUNK, _COLLAR, _NECK = 0.129, 0.182, -0.040, -0.160, -0.280, 0.015, 0.100
#: Radius of the soft tissue above the collar bone, and lower end of the head's capsule, shares of stature.
_SOFT, _HEAD = 0.031, 0.090
#: Largest step between two postures of an elbow that bends, rad: the fist moves by less than the forearm's radius on
#: either side of its own place.
_ELBOW_STEP = np.radians(10.0)


#: By how much the upper arm of a body may be longer or shorter than that of who is said to have it, m.
_FIT = 0.005


#: Squared length, m², below which a segment is a point.
_POINT = 1e-18
#: Radius of the fitting that two limbs share: a multiple of the sum of their radii, and a length more, m.
_FITTING, _EYE = 3.0, 0.03
#: Radius of a limb by its actuator's family, m, where none is given: assumed.
LIMB_RADII = {"cable": 0.003, "pneumatic muscle": 0.015, "linear": 0.016}


def as_elbow_range(given: Any) -> tuple[float, float]:
    """From which to which angle an elbow bends, rad; InvalidInput where none does."""
    low, high = (float(angle) for angle in as_finite("elbow_range", given, (2,)))
    if not -0.3 <= low <= high <= 2.8:
        raise InvalidInput(f"expected elbow_range from -0.3 to 2.8 rad, rising, got {low:g} to {high:g}")
    return low, high


@checked
@dataclass(frozen=True, eq=False)
class BodyShape(Record):
    """Capsules that limbs must keep clear of: rows of two ends and a radius, m.

    Attributes
    ----------
    torso : ndarray
        Shape (K, 7), base frame {O_A}. An end in O is the shoulder itself: it stays in the shoulder's centre where that
        moves against the torso (:mod:`exo_pin.workspace.evaluation`).
    arm : ndarray
        Shape (K, 7), arm frame {O_B}.

    Examples
    --------
    >>> trunk = [[0.0, -0.15, 0.0, 0.0, -0.15, -0.4, 0.1]]  # a capsule of 0.1 m radius
    >>> body = ep.BodyShape(torso=trunk, arm=[[0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.05]])
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = exo.workspace(exo.pose([0, 60]), criteria=ep.Criteria(body=body))
    >>> (1e3 * found.gaps[:, 1]).round().tolist()  # mm between limbs and trunk
    [75.0, 24.0]
    """

    torso: FloatArray
    arm: FloatArray

    def __post_init__(self) -> None:
        for name in ("torso", "arm"):
            rows = as_finite(name, getattr(self, name), (None, 7))
            if (rows[:, 6] < 0.0).any():
                raise InvalidInput(f"expected radii of zero or more in {name}, got {rows[:, 6].min():g} m")
            object.__setattr__(self, name, rows)

    @classmethod
    def of(
        cls,
        wearers: Wearer | Iterable[Wearer],
        side: str = "left",
        elbow_range: tuple[float, float] | None = None,
        obstacles: tuple[str, ...] = (),
    ) -> BodyShape:
        """The body of a person, or of all of several at once, so that what is clear of it is clear of each.

        Parameters
        ----------
        wearers : Wearer or iterable of Wearer
            One person or several, each with the elbow as it is.
        side : {"left", "right"}
            Which shoulder is at O.
        elbow_range : tuple of float, optional
            From which to which angle all of them bend the elbow, rad; the forearm is then in all places between.
        obstacles : tuple of str
            What stands about them, by names of :func:`exo_pin.design.obstacles.obstacle`; counts as torso.

        Returns
        -------
        BodyShape

        Raises
        ------
        InvalidInput
            If there is no wearer, or no elbow bends like this.
        UnknownName
            If an obstacle is none.

        Examples
        --------
        >>> body = ep.BodyShape.of(ep.Wearer(1.75, 75, "male"))
        >>> upper_arm = body.arm[0]
        >>> (1e3 * upper_arm[[6, 5]]).round(1)  # mm: radius, from the girth; place of the elbow
        array([  53.4, -283.2])
        """
        listed = (wearers,) if isinstance(wearers, Wearer) else tuple(wearers)
        if not listed or not all(isinstance(each, Wearer) for each in listed):
            raise InvalidInput("expected a Wearer, or several")
        bent = None if elbow_range is None else as_elbow_range(elbow_range)
        torsos, arms = [], []
        for each in listed:
            torsos += [_torso(each), *(obstacle(name, each) for name in obstacles)]
            low, high = bent or (each.elbow_flexion,) * 2
            arms.append(_arm(each, np.linspace(low, high, 1 + int(np.ceil((high - low) / _ELBOW_STEP)))))
        torso = np.concatenate(torsos)
        if as_side(side) == "right":
            torso[:, [1, 4]] *= -1.0
        return cls(torso, np.concatenate(arms))

    def require_fit(self, wearers: Iterable[Wearer]) -> None:
        """Refuse persons whose upper arm this body does not have.

        Parameters
        ----------
        wearers : iterable of Wearer
            The persons.

        Raises
        ------
        InvalidInput
            If it has upper arms (capsules from O), and none as long as a person's, to 5 mm.

        Examples
        --------
        >>> body = ep.BodyShape.of(ep.Wearer(1.63, 67, "female"))
        >>> try:
        ...     body.require_fit([ep.Wearer(1.63, 60, "female"), ep.Wearer(1.90, 90, "male")])
        ... except ep.InvalidInput as error:
        ...     print(str(error).split(", ")[0])
        expected a body with an upper arm of 307 mm
        """
        own = np.linalg.norm(self.arm[~self.arm[:, 0:3].any(axis=1), 3:6], axis=1)
        for each in wearers:
            require_type("wearers", each, Wearer)
            if own.size and np.abs(own - each.upper_arm_length).min() > _FIT:
                lengths = ", ".join(f"{1e3 * length:.0f}" for length in sorted(set(own.round(3).tolist())))
                raise InvalidInput(
                    f"expected a body with an upper arm of {1e3 * each.upper_arm_length:.0f} mm, that of a person of "
                    f"{each.height:g} m, got one of {lengths} mm; leave body out, and the body is the wearers'"
                )


def _torso(wearer: Wearer) -> FloatArray:
    """Chest, belly, shoulder, neck and head of a left shoulder about its centre, shape (7, 7); x forward, y left."""
    height, sizes = wearer.height, wearer.dimensions()
    middle = -_MIDDLE * height
    rows = []
    for part, top, bottom in (("chest", _CHEST, _WAIST), ("waist", _WAIST, _TRUNK)):
        radius = 0.5 * sizes[f"{part} depth"]
        aside = max(0.5 * sizes[f"{part} breadth"] - radius, 0.0)
        rows += [[0.0, y, top * height, 0.0, y, bottom * height, radius] for y in (middle + aside, middle - aside)]
    rows.append([0.0, middle, _COLLAR * height, 0.0, 0.0, 0.0, _SOFT * height])
    neck, head = (sizes[f"{part} girth"] / (2.0 * np.pi) for part in ("neck", "head"))
    rows.append([0.0, middle, 0.0, 0.0, middle, _NECK * height, neck])
    rows.append([0.0, middle, _HEAD * height, 0.0, middle, _TO_TOP * height - head, head])
    return _dressed(rows, wearer)


def _dressed(rows: list[list[float]], wearer: Wearer) -> FloatArray:
    return np.array(rows) + wearer.clothing * np.eye(7)[6]


def _arm(wearer: Wearer, bends: FloatArray) -> FloatArray:
    """Capsules of the upper arm and of the forearm at each angle of the elbow, shape (1 + angles, 7)."""
    elbow = np.array([0.0, 0.0, -wearer.upper_arm_length])
    hands = elbow + wearer.forearm_length * np.stack([np.sin(bends), 0.0 * bends, -np.cos(bends)], axis=1)
    upper, fore = (wearer.dimensions()[f"{part} girth"] / (2.0 * np.pi) for part in ("upper arm", "forearm"))
    return _dressed([[0.0, 0.0, 0.0, *elbow, upper], *([*elbow, *hand, fore] for hand in hands)], wearer)


@kernel(inline=True)
def _clamp(x: float) -> float:
    return min(1.0, max(0.0, x))


@kernel
def segment_distance(p: Any, q: Any, r: Any, t: Any) -> float:
    """Distance between the segments pq and rt, m.

    Where the lines are parallel any point of the first serves; else the nearest points of the lines, clamped to the
    first segment, then to the second, then to the first again (C. Ericson, Real-Time Collision Detection, 5.1.9).
    """
    d1, d2 = (q[0] - p[0], q[1] - p[1], q[2] - p[2]), (t[0] - r[0], t[1] - r[1], t[2] - r[2])
    w = (p[0] - r[0], p[1] - r[1], p[2] - r[2])
    a, e, c, f = dot(d1, d1), dot(d2, d2), dot(d1, w), dot(d2, w)
    u = v = 0.0
    if a > _POINT:
        if e > _POINT:
            b = dot(d1, d2)
            across = a * e - b * b
            if across > 1e-12 * a * e:
                u = _clamp((b * f - c * e) / across)
            v = (b * u + f) / e
            if v < 0.0:
                v, u = 0.0, _clamp(-c / a)
            elif v > 1.0:
                v, u = 1.0, _clamp((b - c) / a)
        else:
            u = _clamp(-c / a)
    elif e > _POINT:
        v = _clamp(f / e)
    gap = (w[0] + u * d1[0] - v * d2[0], w[1] + u * d1[1] - v * d2[1], w[2] + u * d1[2] - v * d2[2])
    return root(dot(gap, gap))


@kernel(inline=True)
def fitting_radius(p: Any, r: Any, both: float) -> float:
    """Radius of the fitting at the joints p and r of limbs with the sum of radii ``both``, m; 0 if they are apart."""
    away = (p[0] - r[0], p[1] - r[1], p[2] - r[2])
    apart = root(dot(away, away))
    return (_FITTING * both + _EYE) * (1.0 - apart / both) if apart < both else 0.0


@kernel
def joined_distance(p: Any, q: Any, r: Any, t: Any, first: float, last: float) -> float:
    """Distance between the segments pq and rt beyond fittings of their first and of their last ends, m."""
    if first == 0.0 and last == 0.0:
        return segment_distance(p, q, r, t)
    p, q = beyond(p, q, first, last)
    r, t = beyond(r, t, first, last)
    return segment_distance(p, q, r, t)


@kernel
def beyond(p: Any, q: Any, first: float, last: float) -> Any:
    """Ends of the segment pq without what lies within ``first`` of p and ``last`` of q, each at most half of it."""
    along = (q[0] - p[0], q[1] - p[1], q[2] - p[2])
    length = max(root(dot(along, along)), 1e-9)
    u, v = min(first / length, 0.5), 1.0 - min(last / length, 0.5)
    return (
        (p[0] + u * along[0], p[1] + u * along[1], p[2] + u * along[2]),
        (p[0] + v * along[0], p[1] + v * along[1], p[2] + v * along[2]),
    )


@kernel(inline=True)
def displaced_end(end: Any, displacement: Any) -> Any:
    """An end of a capsule of the torso, displaced with it, unless it is the shoulder itself, which is in O."""
    at = (end[0], end[1], end[2])
    return at if dot(at, at) < _POINT else add(at, displacement)


@kernel(stack=True)
def clearance_stack(
    R: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any, radius: Any, still: Any, moving: Any, gap: Any
) -> None:
    """Fill the least distances between surfaces, m, negative where they overlap: (N, 3) to arm, torso, other limbs.

    Parameters
    ----------
    R : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        Shape (n, 3), m, about the device's own centre.
    base_offset, cuff_offset : ndarray
        Where that centre lies, seen from O: held by the base, base frame, and carried by the cuff, arm frame; shape
        (N, 3), or (1, 3) for all poses, m. The torso is displaced by their difference
        (:mod:`exo_pin.workspace.evaluation`), but for ends in O: those are the shoulder itself.
    radius : ndarray
        Of the limbs, shape (n,), m.
    still, moving : ndarray
        Capsules of the torso in the base frame and of the arm in the arm frame, shape (K, 7): two ends and a radius, m.
    """
    n = base.shape[0]
    starts, ends, same = np.empty_like(base), np.empty_like(base), base_offset.shape[0] == 1
    first, last = np.empty((n, n)), np.empty((n, n))
    for i in range(n):
        for j in range(i):
            both = radius[i] + radius[j]
            first[i, j] = fitting_radius(vector(base, i), vector(base, j), both)
            last[i, j] = fitting_radius(vector(platform, i), vector(platform, j), both)
    for k in range(R.shape[0]):
        pose = matrix(R[k])
        held, carried = vector(base_offset, 0 if same else k), vector(cuff_offset, 0 if same else k)
        torso = (held[0] - carried[0], held[1] - carried[1], held[2] - carried[2])
        for i in range(n):
            starts[i, 0], starts[i, 1], starts[i, 2] = add(vector(base, i), held)
            ends[i, 0], ends[i, 1], ends[i, 2] = turn(pose, add(vector(platform, i), carried))
        to_arm = to_torso = to_limb = np.inf
        for j in range(moving.shape[0]):
            r = turn(pose, (moving[j, 0], moving[j, 1], moving[j, 2]))
            t = turn(pose, (moving[j, 3], moving[j, 4], moving[j, 5]))
            for i in range(n):
                distance = segment_distance(vector(starts, i), vector(ends, i), r, t)
                to_arm = min(to_arm, distance - radius[i] - moving[j, 6])
        for j in range(still.shape[0]):
            r, t = displaced_end(still[j, 0:3], torso), displaced_end(still[j, 3:6], torso)
            for i in range(n):
                distance = segment_distance(vector(starts, i), vector(ends, i), r, t)
                to_torso = min(to_torso, distance - radius[i] - still[j, 6])
        for i in range(n):
            for j in range(i):
                distance = joined_distance(
                    vector(starts, i), vector(ends, i), vector(starts, j), vector(ends, j), first[i, j], last[i, j]
                )
                to_limb = min(to_limb, distance - radius[i] - radius[j])
        gap[k, 0], gap[k, 1], gap[k, 2] = to_arm, to_torso, to_limb


def limb_radii(mechanism: Mechanism, radius: float | None = None) -> FloatArray:
    """Radius of every limb, shape (n,), m: the given one or that of its family; NaN where it has none."""
    if radius is not None:
        return np.full(mechanism.limb_count, radius)
    families = [None if limb.actuator is None else limb.actuator.family for limb in mechanism.limbs]
    return np.array([np.nan if family is None else LIMB_RADII[family] for family in families])


@checked
def clearances(
    matrices: FloatArray,
    base: FloatArray,
    platform: FloatArray,
    radii: FloatArray,
    body: BodyShape,
    offset: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Gaps between the surfaces of limbs and of arm, torso and other limbs, shape (N, 3), m; negative in an overlap.

    Parameters
    ----------
    matrices : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        Joints of the limbs about the device's centre, shape (n, 3), m, base and arm frame.
    radii : ndarray
        Of the limbs, shape (n,), m.
    body : BodyShape
        Of the wearer.
    offset : tuple of ndarray, optional
        Where the device's centre lies from the shoulder's, held by the base and carried by the cuff, shape (N, 3) or
        (1, 3) each, m.

    Returns
    -------
    ndarray
        Shape (N, 3), m: to the arm, to the torso, between limbs.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> arm, torso = [0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.05], [0.0, -0.3, 0.0, 0.0, -0.3, -0.5, 0.1]
    >>> body = ep.BodyShape(torso=[torso], arm=[arm])
    >>> base = np.array([[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.2, 0.0]])
    >>> gaps = wrist.clearances(np.eye(3)[None], base, base - [0.0, 0.0, 0.2], np.full(3, 0.01), body)
    >>> (1e3 * gaps[0]).round()  # mm; limbs along the arm at 200 mm: 200 - 50 - 10 of them free
    array([140., 251., 263.])
    """
    n = np.size(radii)
    shapes = [np.shape(each) for each in (matrices, base, platform, radii)]
    if shapes != [(*shapes[0][:1], 3, 3), (n, 3), (n, 3), (n,)]:
        raise InvalidInput(f"expected matrices (N, 3, 3), base and platform (n, 3) and radii (n,), got {shapes}")
    gaps = np.empty((len(matrices), 3))
    held, carried = (np.zeros((1, 3)), np.zeros((1, 3))) if offset is None else offset
    # Writable copies, for which the kernel is compiled.
    still, moving = np.array(body.torso), np.array(body.arm)
    clearance_stack(matrices, base, platform, held, carried, radii, still, moving, gaps)
    return gaps


def limb_gaps(
    matrices: FloatArray,
    mechanism: Mechanism,
    radii: FloatArray,
    body: BodyShape,
    offset: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Least gap of each limb to arm, torso and other limbs over all poses, shape (n, 3), m; see :func:`clearances`."""
    n, base, platform = mechanism.limb_count, mechanism.geometry.base_points, mechanism.geometry.platform_points
    out = np.full((n, 3), np.inf)
    for i in range(n):
        for j in range(n):
            pair = [i, j] if j != i else [i]
            gap = clearances(matrices, base[pair], platform[pair], radii[pair], body, offset).min(axis=0)
            if j == i:
                out[i, :2] = gap[:2]
            else:
                out[i, 2] = min(out[i, 2], gap[2])
    return out
