"""Routes of cables and springs over frictionless points of the links: length, and the wrenches of a unit tension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...chain.structure.chain_state import ChainState
from ...core.conventions import MIRROR
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite, set_fields

__all__ = ["Route", "RoutePoint"]

#: Two points of a route nearer than this have no direction between them, m.
_COINCIDENT = 1e-9
#: A point farther than this from its link, m, is taken for millimetres.
_FARTHEST = 20.0


@dataclass(frozen=True)
class RoutePoint:
    """A point that a cable or spring is fixed to, or passes without friction.

    Attributes
    ----------
    link : str
        A frame of the chain, such as a link; "universe" is the torso.
    point : tuple of float
        Shape (3,), m, in that frame's axes.

    Examples
    --------
    >>> from exo_pin.device import Route, RoutePoint
    >>> anchor = RoutePoint("universe", (0.0, 0.05, 0.2))  # on the torso
    >>> len(Route((anchor, RoutePoint("arm", (0.0, 0.0, -0.2)))).points)
    2
    """

    link: str
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.link, str) or not self.link:
            raise InvalidInput(f"expected the name of a link, got {self.link!r}")
        set_fields(self, point=tuple(as_finite("point", self.point, (3,)).tolist()))
        if max(map(abs, self.point)) > _FARTHEST:
            raise InvalidInput(f"expected a point of {self.link!r} in m, got {self.point} (millimetres?)")


@checked
@dataclass(frozen=True)
class Route:
    """The straight pieces from one end over via points to the other end.

    A small pulley is a via point: the tension is the same on both sides, and its radius does not count.

    Attributes
    ----------
    points : tuple of RoutePoint
        Two or more; the first and the last are the ends.

    Examples
    --------
    >>> from exo_pin.device import Route, RoutePoint
    >>> ends = RoutePoint("universe", (0.0, 0.0, 0.3)), RoutePoint("arm", (0.0, 0.0, -0.1))
    >>> [point.link for point in Route(ends).points]
    ['universe', 'arm']
    """

    points: tuple[RoutePoint, ...]

    def __post_init__(self) -> None:
        points = tuple(self.points)
        if len(points) < 2 or not all(isinstance(point, RoutePoint) for point in points):
            raise InvalidInput(f"expected a route of two or more RoutePoint, got {len(points)}")
        set_fields(self, points=points)

    def mirrored(self) -> Route:
        """Mirror image in the x-z plane, on the mirror images of its links.

        Returns
        -------
        Route

        Examples
        --------
        >>> from exo_pin.device import Route
        >>> route = Route.over(("universe", [0.0, 0.1, 0.2]), ("arm", [0.0, 0.0, -0.2]))
        >>> route.mirrored().points[0].point  # m
        (0.0, -0.1, 0.2)
        """
        return Route.over(*((point.link, np.array(point.point) @ MIRROR) for point in self.points))

    @classmethod
    def over(cls, *points: tuple[str, ArrayLike]) -> Route:
        """A route from pairs of a link and a point on it, m.

        Parameters
        ----------
        *points : tuple of str and array_like
            A link, and a point on it, shape (3,), m; from one end to the other.

        Returns
        -------
        Route

        Examples
        --------
        >>> from exo_pin.device import Route
        >>> route = Route.over(("universe", [0, 0, 0.2]), ("universe", [0, 0.1, 0.2]), ("arm", [0, 0, -0.2]))
        >>> route.points[1].point  # m, of the pulley
        (0.0, 0.1, 0.2)
        """
        return cls(tuple(RoutePoint(link, tuple(as_finite("point", at, (3,)).tolist())) for link, at in points))


class PlacedRoute:
    """A route on the links of a chain, for any of its configurations.

    Parameters
    ----------
    state : ChainState
        The chain.
    route : Route
        The route.

    Raises
    ------
    UnknownName
        If the chain has no such frame.
    """

    def __init__(self, state: ChainState, route: Route) -> None:
        frames = [state.model.frames[state.frame_index(point.link)] for point in route.points]
        self.joints = np.array([frame.parentJoint for frame in frames])
        placed = zip(frames, route.points, strict=True)
        self.local = np.array([frame.placement.act(np.array(point.point)) for frame, point in placed])
        self._bodies = (np.arange(state.model.njoints)[:, None] == self.joints).astype(float)

    @classmethod
    def between(cls, state: ChainState, joints: tuple[int, int], points: ArrayLike) -> PlacedRoute:
        """The straight piece between two points, shape (2, 3), m, each in the axes of its joint."""
        own = cls.__new__(cls)
        own.joints, own.local = np.array(joints), np.array(points, dtype=float)
        own._bodies = (np.arange(state.model.njoints)[:, None] == own.joints).astype(float)
        return own

    def shifted(self, joint: int, shift: FloatArray) -> PlacedRoute:
        """The same route with the points on one body moved, shape (3,), m, in its axes."""
        self.local[self.joints == joint] += shift
        return self

    def points(self, poses: FloatArray) -> FloatArray:
        """Positions of the points, shape (..., k, 3), m, world frame.

        Parameters
        ----------
        poses : ndarray
            Of the joints, shape (..., njoints, 4, 3): the axes of each, one a row, and its origin.
        """
        own = poses[..., self.joints, :, :]
        return np.asarray(np.einsum("...kij,ki->...kj", own[..., :3, :], self.local) + own[..., 3, :])

    def length(self, poses: FloatArray) -> FloatArray:
        """Sum of the pieces, shape (...), m."""
        return np.asarray(self._sizes(poses).sum(axis=-1))

    def has_direction(self, poses: FloatArray) -> NDArray[np.bool_]:
        """Whether its points are apart, so that its tension has a direction, shape (...)."""
        return np.asarray(self._sizes(poses).min(axis=-1) >= _COINCIDENT)

    def _sizes(self, poses: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(np.diff(self.points(poses), axis=-2), axis=-1))

    def wrenches(self, poses: FloatArray) -> FloatArray:
        """Wrench of a tension of 1 N on every body, shape (..., njoints, 6): force and moment about the world's origin.

        Raises
        ------
        InvalidInput
            If two points of the route coincide: the tension has no direction there.
        """
        at = self.points(poses)
        pieces = np.diff(at, axis=-2)
        sizes = np.linalg.norm(pieces, axis=-1)
        if (sizes < _COINCIDENT).any():
            raise InvalidInput(
                "expected the points of a route apart, got two that coincide: their tension has no direction"
            )
        along = pieces / sizes[..., None]
        forces = np.zeros_like(at)
        forces[..., :-1, :] += along
        forces[..., 1:, :] -= along
        return np.asarray(self._bodies @ np.concatenate([forces, np.cross(at, forces)], axis=-1))
