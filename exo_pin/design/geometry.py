"""Positions and frames of the universal joints of a spherical parallel wrist."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import MIRROR, Side, as_side, mirrored
from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import (
    FloatArray,
    as_choice,
    as_finite,
    as_single_rotation,
    as_unit_vector,
    frozen,
    require_type,
    set_fields,
    set_positive,
)


@dataclass(frozen=True, eq=False)
class CircleDimensions(Record):
    """The dimensions of (4-2): joints on two circles whose axes pass through O.

    Attributes
    ----------
    r_A : float
        Radius of the circle of the joints on the torso, m.
    r_B : float
        Radius of the circle of the joints on the arm, m.
    h_A : float
        Distance of the plane of the joints on the torso from O, m.
    h_B : float
        Distance of the plane of the joints on the arm from O, m: the height of the cuff.
    alpha_A : ndarray
        Shape (n,), angles of the joints on the torso, rad.
    alpha_B : ndarray
        Shape (n,), angles of the joints on the arm, rad.
    side : {"left", "right"}
        Side of the body; the right one is the mirror image in the x-z plane.

    Examples
    --------
    >>> from exo_pin.design import CircleDimensions
    >>> angles = np.radians([90.0, 210.0, 330.0])
    >>> circles = CircleDimensions(0.13, 0.10, 0.02, 0.15, angles, angles)
    >>> circles.platform_points[:, 2]  # m, the plane of the joints on the arm
    array([-0.15, -0.15, -0.15])
    """

    r_A: float
    r_B: float
    h_A: float
    h_B: float
    alpha_A: FloatArray
    alpha_B: FloatArray
    side: Side = "left"

    def __post_init__(self) -> None:
        set_positive(self, "r_A", "r_B")
        set_fields(self, h_A=float(as_finite("h_A", self.h_A, ())), h_B=float(as_finite("h_B", self.h_B, ())))
        for name in ("alpha_A", "alpha_B"):
            angles = as_finite(name, getattr(self, name), (None,))
            if np.abs(angles).max(initial=0.0) > 2 * np.pi + 1e-9:
                raise InvalidInput(f"expected {name} in rad within ±2π, got {angles} (degrees?)")
            set_fields(self, **{name: angles})
        if self.alpha_A.shape != self.alpha_B.shape:
            raise InvalidInput(
                f"expected alpha_A and alpha_B of one length, got {self.alpha_A.shape} and {self.alpha_B.shape}"
            )
        set_fields(self, side=as_side(self.side))

    @property
    def base_points(self) -> FloatArray:
        """Shape (n, 3), m, base frame: A_i of (4-2)."""
        height = np.full_like(self.alpha_A, -self.h_A)
        points = np.stack([self.r_A * np.cos(self.alpha_A), height, self.r_A * np.sin(self.alpha_A)], axis=1)
        return points if self.side == "left" else points @ MIRROR

    @property
    def platform_points(self) -> FloatArray:
        """Shape (n, 3), m, arm frame: B_i of (4-2)."""
        height = np.full_like(self.alpha_B, -self.h_B)
        points = np.stack([self.r_B * np.cos(self.alpha_B), self.r_B * np.sin(self.alpha_B), height], axis=1)
        return points if self.side == "left" else points @ MIRROR


#: A joint farther than this from the shoulder centre, m, is taken for a length given in millimetres.
_FARTHEST_JOINT = 5.0
#: Sine of the angle between a_i and b_i below which their plane has no direction.
_FOLDED_SINE = 1e-9


@dataclass(frozen=True, eq=False)
class WristGeometry(Record):
    """Universal-joint centres of a wrist whose limbs turn the platform about the point O.

    Attributes
    ----------
    base_points : ndarray
        Shape (n, 3), m, joint centres A_i in the base frame {O_A}, n >= 3.
    platform_points : ndarray
        Shape (n, 3), m, joint centres B_i in the arm frame {O_B}.
    base_axis : ndarray or None
        Shape (3,), unit vector along the axis of the circle of the joints on the torso, from the circle's plane
        towards O; +y in (4-2). With an axis, the joint frames follow (4-15). Without it they follow the limb's plane
        O A_i B_i in the neutral pose.
    platform_axis : ndarray or None
        The same for the joints on the arm; +z in (4-2).
    neutral : Rotation
        The pose in which the mechanism is drawn and its chain has all joint angles zero.
    circles : CircleDimensions or None
        The dimensions that the points were made from, if they were.
    base_frames, platform_frames : ndarray
        Shape (n, 3, 3), rotations whose columns are the axes of {A_i} in {O_A} and of {B_i} in {O_B}. This is
        the one place that declares them: Y points from the joint to O, X lies along Y × axis (in the
        circle's plane) or along the limb's X_i in the neutral pose, Z = X × Y. The source prints no {B_i};
        this one is built as (4-15) builds {A_i}.

    Examples
    --------
    >>> base = [[0.1, 0.1, 0.3], [-0.1, 0.15, 0.3], [-0.3, 0.0, -0.2]]
    >>> platform = [[0.05, 0.05, -0.15], [-0.05, 0.07, -0.15], [-0.05, -0.02, -0.15]]
    >>> geometry = ep.WristGeometry(base, platform)
    >>> np.linalg.norm(geometry.platform_points - geometry.base_points, axis=1).round(3)  # m, lengths at rest
    array([0.456, 0.46 , 0.256])
    """

    base_points: FloatArray
    platform_points: FloatArray
    base_axis: FloatArray | None = None
    platform_axis: FloatArray | None = None
    neutral: Rotation = field(default_factory=Rotation.identity)
    circles: CircleDimensions | None = None
    base_frames: FloatArray = field(init=False, repr=False)
    platform_frames: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require_type("circles", self.circles, CircleDimensions | None)
        for name in ("base_points", "platform_points"):
            set_fields(self, **{name: _joint_centres(name, getattr(self, name))})
        if self.base_points.shape != self.platform_points.shape:
            raise InvalidInput(
                "expected as many base_points as platform_points, got "
                f"{len(self.base_points)} and {len(self.platform_points)}"
            )
        for name in ("base_axis", "platform_axis"):
            if getattr(self, name) is not None:
                set_fields(self, **{name: as_unit_vector(name, getattr(self, name))})
        set_fields(self, neutral=_settled(as_single_rotation("neutral", self.neutral)))
        limb_axes = self._neutral_limb_axes()
        in_arm = None if limb_axes is None else limb_axes @ self.neutral.as_matrix()
        set_fields(
            self,
            base_frames=_frames(self.base_points, self.base_axis, limb_axes),
            platform_frames=_frames(self.platform_points, self.platform_axis, in_arm),
        )

    @cached_property
    def platform_radius(self) -> float:
        """Distance from O to the farthest joint on the arm, m: the length that moments are divided by."""
        return float(np.linalg.norm(self.platform_points, axis=1).max())

    @classmethod
    def from_circles(
        cls,
        r_A: float,
        r_B: float,
        h_A: float,
        h_B: float,
        alpha_A: ArrayLike,
        alpha_B: ArrayLike | None = None,
        side: str = "left",
    ) -> WristGeometry:
        """Joints on two circles, (4-2).

        Parameters
        ----------
        r_A, r_B : float
            Radii of the base and platform circle, m.
        h_A, h_B : float
            Distances from O to the circles' planes, m.
        alpha_A : array_like
            Shape (n,), rad, angles on the base circle, from x towards z.
        alpha_B : array_like, optional
            Shape (n,), rad, angles on the platform circle, from x towards y; the same as ``alpha_A`` if left out.
        side : {"left", "right"}
            The right side is the mirror image in the x-z plane.

        Returns
        -------
        WristGeometry

        Raises
        ------
        InvalidInput
            If a radius is not positive, an angle looks like degrees, or fewer than three limbs are given.

        Notes
        -----
        Source: thesis (4-2), Figure 4-1.

        Examples
        --------
        >>> geometry = ep.WristGeometry.from_circles(0.132, 0.105, 0.02, 0.15, np.radians([90, 210, 330]))
        >>> np.linalg.norm(geometry.platform_points, axis=1).round(4)  # sqrt(r_B² + h_B²)
        array([0.1831, 0.1831, 0.1831])
        """
        angles = alpha_A if alpha_B is None else alpha_B
        circles = CircleDimensions(r_A, r_B, h_A, h_B, alpha_A, angles, side)  # type: ignore[arg-type]
        return cls._on_circles(circles, Rotation.identity())

    @classmethod
    def _on_circles(cls, circles: CircleDimensions, neutral: Rotation) -> WristGeometry:
        axes = np.array([0.0, 1.0 if circles.side == "left" else -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
        return cls(circles.base_points, circles.platform_points, *axes, neutral, circles)

    @property
    def limb_count(self) -> int:
        """Number of limbs n."""
        return len(self.base_points)

    def replace(self, **changes: Any) -> WristGeometry:
        """Return a new geometry with some dimensions changed.

        Parameters
        ----------
        **changes
            Fields of :class:`CircleDimensions` (``r_A=...``; only for joints on circles), or ``base_points``,
            ``platform_points``, ``base_axis``, ``platform_axis``, ``neutral``.

        Returns
        -------
        WristGeometry

        Raises
        ------
        UnknownName
            If a name is no dimension of a wrist.
        InvalidInput
            If a circle's dimension is changed in a geometry made from points.

        Examples
        --------
        >>> geometry = ep.load("prototype").geometry
        >>> (geometry.replace(h_B=geometry.circles.h_B + 0.02).platform_points - geometry.platform_points)[0].round(3)
        array([ 0.  ,  0.  , -0.02])
        """
        on_circles = {item.name for item in fields(CircleDimensions)}
        on_points = {"base_points", "platform_points", "base_axis", "platform_axis", "neutral"}
        for name in changes:
            as_choice("dimension", name, on_circles | on_points)
        circle_changes = {name: value for name, value in changes.items() if name in on_circles}
        point_changes = {name: value for name, value in changes.items() if name in on_points}
        if circle_changes and (self.circles is None or set(point_changes) - {"neutral"}):
            raise InvalidInput(f"{', '.join(sorted(circle_changes))}: this geometry is given by points, not circles")
        if circle_changes:
            assert self.circles is not None
            aligned = np.array_equal(self.circles.alpha_A, self.circles.alpha_B)
            if aligned and "alpha_A" in circle_changes:
                circle_changes.setdefault("alpha_B", circle_changes["alpha_A"])
            circles = replace(self.circles, **circle_changes)
            return WristGeometry._on_circles(circles, point_changes.get("neutral", self.neutral))
        return replace(self, circles=self.circles if set(point_changes) <= {"neutral"} else None, **point_changes)

    def mirrored(self) -> WristGeometry:
        """Mirror image in the x-z plane: the same device for the other shoulder.

        Returns
        -------
        WristGeometry

        Examples
        --------
        >>> left = ep.load("prototype").geometry
        >>> right = left.mirrored()
        >>> (1e3 * np.array([left.base_points[0], right.base_points[0]])).round(1)  # mm
        array([[116.5, -78. ,  70.8],
               [116.5,  78. ,  70.8]])
        """
        neutral = mirrored(self.neutral)
        if self.circles is not None:
            other: Side = "right" if self.circles.side == "left" else "left"
            return WristGeometry._on_circles(replace(self.circles, side=other), neutral)
        over, about = (None if axis is None else axis @ MIRROR for axis in (self.base_axis, self.platform_axis))
        return WristGeometry(self.base_points @ MIRROR, self.platform_points @ MIRROR, over, about, neutral)

    def _neutral_limb_axes(self) -> FloatArray | None:
        """X_i of (D-11) in the neutral pose, base frame; None where both circle axes are given."""
        if self.base_axis is not None and self.platform_axis is not None:
            return None
        normal = -np.cross(self.base_points, self.platform_points @ self.neutral.as_matrix().T)
        length = np.linalg.norm(normal, axis=1)
        reach = np.linalg.norm(self.base_points, axis=1) * np.linalg.norm(self.platform_points, axis=1)
        folded = np.flatnonzero(length < _FOLDED_SINE * reach)
        if folded.size:
            raise InvalidInput(
                f"limb index {folded[0]} lies on a line through O in the neutral pose, so its plane gives no joint "
                "frames: choose another neutral pose, or give base_axis and platform_axis"
            )
        return normal / length[:, None]


def _settled(rotation: Rotation) -> Rotation:
    """The rotation with a quaternion that normalising no longer changes, so that a file brings it back bit for bit."""
    for _ in range(8):
        quaternion = rotation.as_quat()
        rotation = Rotation.from_quat(quaternion)
        if np.array_equal(rotation.as_quat(), quaternion):
            break
    return rotation


def _joint_centres(name: str, value: ArrayLike) -> FloatArray:
    points = as_finite(name, value, (None, 3))
    if len(points) < 3:
        raise InvalidInput(f"expected at least 3 {name} (fewer limbs cannot hold an arm), got {len(points)}")
    distance = np.linalg.norm(points, axis=1)
    if distance.max() > _FARTHEST_JOINT:
        raise InvalidInput(f"expected {name} in m, got a joint {distance.max():g} m from O (millimetres?)")
    if distance.min() < 1e-9:
        raise InvalidInput(f"expected {name} away from O, got joint index {int(distance.argmin())} at O")
    return points


def _frames(points: FloatArray, axis: FloatArray | None, limb_axes: FloatArray | None) -> FloatArray:
    """Columns X, Y, Z of a joint frame per point, shape (n, 3, 3).

    Source: thesis (4-15), Figure 4-4.
    """
    y = -points / np.linalg.norm(points, axis=1, keepdims=True)
    if axis is None:
        assert limb_axes is not None
        # Of a limb that is nearly folded in the neutral pose the axis is perpendicular to few digits.
        x = limb_axes - (limb_axes * y).sum(axis=1, keepdims=True) * y
        x = x / np.linalg.norm(x, axis=1, keepdims=True)
    else:
        x = np.cross(y, axis)
        length = np.linalg.norm(x, axis=1, keepdims=True)
        if length.min() < _FOLDED_SINE:
            raise InvalidInput("a joint lies on the axis of its own circle, which gives it no frame")
        x = x / length
    return frozen(np.stack([x, y, np.cross(x, y)], axis=-1))
