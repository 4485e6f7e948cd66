"""The ends of a person's range of motion: each pushes back, and none pulls.

Angles are those of :attr:`exo_pin.Person.range_of_motion`: the arm swings straight from hanging to its direction u, in
a plane of elevation by an elevation, and turns about its own axis by an axial rotation τ. With e the vertical, n the
normal of an end of the plane, and z' the arm's own axis, the depths d beyond the ends and their gradients are

    elevation  d = E - E_end           ∇d = (-e × u)/sin E
    plane      d = asin(u · n)         ∇d = (u × n)/cos d       (the angle between arm and plane, not its azimuth, which
                                                                 has no meaning for an arm that hangs)
    axial      d = ±(τ - τ_end)        ∇d = ±(e + z')/(1 + e · z')

and the moment is -max(k d + c d', 0) ∇d, d' = ∇d · ω: that of a potential k d²/2, and of a damper.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import as_side
from ..core.errors import InvalidInput, UnknownName
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_finite, set_fields, set_positive
from ..load_case.pose_stacks import pose_matrices
from .plant.any_device.arm_actions import ArmState, require_known

__all__ = ["JointStops"]

#: Angles of the shoulder, and those of elbow and forearm, which do not count here.
_ANGLES, _OTHERS = ("plane of elevation", "elevation", "axial rotation"), ("elbow flexion", "forearm rotation")
#: Least sine and cosine that something is divided by: an arm straight up has no plane, and no axial rotation.
_LEAST = 1e-6

#: Depth beyond an end, rad, and its gradient by the arm's turn, base frame.
_End = tuple[float, FloatArray]


@checked
@dataclass(frozen=True, eq=False)
class JointStops:
    """Elastic ends of a person's range of motion, as moments of the wearer; see the module.

    Parameters
    ----------
    ranges : mapping
        Lower and upper end, rad, by angle: "plane of elevation", "elevation", "axial rotation", with the signs of
        :attr:`exo_pin.Person.range_of_motion`, which can be given as it is. What is not named has no end.
    stiffness, damping : float
        k and c of each end, N m/rad and N m s/rad.
    side : {"left", "right"}
        Side of the body.
    source : str
        Where the stiffness is from.

    Raises
    ------
    MissingData
        If a number or the source is not given: no stiffness of a shoulder's ends is taken for known.
    InvalidInput
        If a range is none, or elevation begins above zero.
    UnknownName
        If an angle is not one of these.

    Examples
    --------
    >>> from exo_pin.control import ArmState, JointStops
    >>> ends = JointStops({"elevation": (0.0, 2.0)}, 50.0, 1.0, source="an assumption for this example")
    >>> up = ArmState(ep.shoulder_rotation(2.1, 0, 0).as_matrix(), np.zeros(3))
    >>> ends(0.0, up).round(6)  # N m: 50 N m/rad times 0.1 rad, back down
    array([0., 5., 0.])
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    stiffness: float | None = None
    damping: float | None = None
    side: str = "left"
    source: str = ""

    def __post_init__(self) -> None:
        values = {"ranges": self.ranges or None, "stiffness": self.stiffness, "damping": self.damping}
        require_known(self.source, values, "ends of a person's range of motion")
        as_side(self.side)
        set_positive(self, "stiffness", "damping", zero=True)
        ranges = {}
        for name, ends in self.ranges.items():
            if name not in _ANGLES + _OTHERS:
                raise UnknownName("angle", name, _ANGLES)
            low, high = as_finite(f"ranges[{name!r}]", ends, (2,)).tolist()
            if not low < high <= low + 2.0 * math.pi:
                raise InvalidInput(f"expected two angles in rad, the lower first, for {name!r}, got {ends}")
            if name in _ANGLES:
                ranges[name] = (low, high)
        if ranges.get("elevation", (0.0, 0.0))[0] > 0.0:
            raise InvalidInput("expected elevation to begin at zero: a hanging arm is within every range")
        set_fields(self, ranges=ranges)

    def __call__(self, t: float, arm: ArmState) -> FloatArray:
        """Moment at a time; see the class."""
        moment = np.zeros(3)
        for depth, gradient in self._ends(np.asarray(arm.matrix)):
            if depth > 0.0:
                push = self.stiffness * depth + self.damping * float(gradient @ arm.angular_velocity)  # type: ignore[operator]
                moment = moment - max(push, 0.0) * gradient
        return moment

    def depth(self, poses: Rotation) -> FloatArray:
        """How far beyond the nearest end poses are, shape (...), rad; zero within.

        Parameters
        ----------
        poses : Rotation
            Single or a stack of shape (...).

        Returns
        -------
        ndarray
            Shape (...).

        Examples
        --------
        >>> from exo_pin.control import JointStops
        >>> ends = JointStops({"axial rotation": (-1.0, 1.5)}, 20.0, 0.0, source="an assumption for this example")
        >>> ends.depth(ep.shoulder_rotation(0, 0, [-1.2, 0.0, 1.6])).round(6)  # rad
        array([0.2, 0. , 0.1])
        """
        shape, matrices = pose_matrices(poses)
        found = [max([0.0, *(depth for depth, _ in self._ends(R))]) for R in matrices]
        return np.array(found).reshape(shape)

    def _ends(self, R: FloatArray) -> list[_End]:
        """Depth beyond each end, or less than zero within, and its gradient."""
        side = 1.0 if self.side == "left" else -1.0
        found: list[_End] = []
        u, axis = -R[:, 2], R[:, 2]
        plane, elevation, axial = (self.ranges.get(name) for name in _ANGLES)
        if elevation is not None:
            level = math.hypot(u[0], u[1])
            toward = np.array([u[1], -u[0], 0.0]) / max(level, _LEAST)
            found.append((math.atan2(level, -u[2]) - elevation[1], toward))
        if plane is not None and plane[1] - plane[0] < 2.0 * math.pi:
            # Outward normals of the two half planes; u has its azimuth from the side to the front.
            low, high = (
                self._half_plane(u, np.array([way * math.cos(angle), -way * side * math.sin(angle), 0.0]))
                for angle, way in zip(plane, (-1.0, 1.0), strict=True)
            )
            # Of a wide range what is beyond both ends is outside, of a narrow one what is beyond either.
            found += [min(low, high, key=lambda end: end[0])] if plane[1] - plane[0] >= math.pi else [low, high]
        if axial is not None:
            turn = -side * math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
            about = -side * (axis + np.array([0.0, 0.0, 1.0])) / max(1.0 + axis[2], _LEAST)
            found += [(axial[0] - turn, -about), (turn - axial[1], about)]
        return found

    @staticmethod
    def _half_plane(u: FloatArray, n: FloatArray) -> _End:
        """The angle of a direction beyond a plane, and its gradient."""
        sine = float(u @ n)
        return math.asin(min(max(sine, -1.0), 1.0)), np.cross(u, n) / max(
            math.sqrt(max(1.0 - sine * sine, 0.0)), _LEAST
        )
