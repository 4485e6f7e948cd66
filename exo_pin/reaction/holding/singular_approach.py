"""Forces along a turn into a singular pose: its distance, the axis without resistance, and the growth of the forces.

The turn is about one fixed axis and ends in the singular pose. If the load has a moment about the axis without
resistance, limb forces near that pose grow with the inverse of the remaining angle if the turn crosses the surface of
singular poses, and with its inverse square if it only touches the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.pictures import drawn
from ...core.results import Result, frame_of
from ...core.validation import FloatArray, ReadOnly, as_single_rotation
from ...load_case.case import Case
from ...wrist.singularities.measures import Singularity, singularity
from ...wrist.singularities.nearest_singularity_search import nearest_singularity
from ..assumptions import Assumptions
from ..columns import force_columns, peak_of
from ..result import Reaction
from ..solve_case import solve
from .remedy import NearestPose, at_rest, nearest_held_pose, spread_directions
from .verdict import angle_words, describe_axis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Angle at which the turn begins if no start is given, angle at which it ends, rad, and the number of samples.
_FROM, _TO, _SAMPLES = float(np.radians(20.0)), float(np.radians(0.05)), 81
#: Angles of the printed table, degrees.
_PRINTED = (20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1)
#: Or, of a shorter way, one in so many samples.
_EVERY = 20
#: Number of directions that lead out of a singular pose, and the angle at which they are compared, rad.
_DIRECTIONS, _AT = 96, float(np.radians(5.0))


@checked
@dataclass(frozen=True, eq=False)
class SingularApproach(Result, ReadOnly):
    """Forces at rest along a turn into a singular pose, k samples.

    Attributes
    ----------
    singular_pose : Rotation
        Single: the end of the turn; the given pose if it is singular, else the nearest singular one.
    distance : float
        Angle between the given pose and the singular one, rad; 0 if the given pose is singular.
    lost_axis : ndarray
        Shape (3,), unit vector, base frame: the axis about which the limbs resist no moment in the singular pose.
    turns : ndarray
        Shape (k,), rad, falling: remaining angle to the singular pose.
    poses : Rotation
        Shape (k,), the poses along the turn.
    reaction : Reaction
        Shape (k,), the forces there.
    nearest_held : NearestPose or None
        The nearest pose to the given one that the device can hold, as far as its limits are known; None if none was
        found within 60°.
    side : {"left", "right"}
        Side of the body, for the angles.

    Examples
    --------
    >>> exo = ep.load("three-linear-actuators")
    >>> way = exo.singular_approach(exo.pose(10))
    >>> products = way.reaction.magnitude * way.turns  # |F_s| grows as one over the angle that remains
    >>> round(float(products[-1] / products[-5]), 2)
    1.01
    """

    singular_pose: Rotation
    distance: float
    lost_axis: FloatArray
    turns: FloatArray
    poses: Rotation
    reaction: Reaction
    nearest_held: NearestPose | None
    side: str

    @property
    def peak(self) -> float:
        """Largest |F_s| of the samples, N; NaN without an answer. It depends on the angle at which the turn ends."""
        return peak_of(self.reaction.magnitude)

    def to_dataframe(self) -> Any:
        """A pandas DataFrame, one row a sample: remaining angle, forces, margin and status, with units in the names.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        MissingExtra
            If pandas is not installed.

        Examples
        --------
        >>> exo = ep.load("three-linear-actuators")
        >>> frame = exo.singular_approach(exo.pose(30)).to_dataframe()
        >>> frame[["angle_left_deg", "F_s_N"]].iloc[-1].round(2).tolist()  # next to the singular pose
        [0.05, 4212.61]
        """
        left = {"angle_left_deg": np.degrees(self.turns)}
        return frame_of(left | force_columns(self.reaction) | {"status": self.reaction.status.astype(object)})

    def plot(self) -> Figure:
        """Draw |F_s| and the limb forces over the remaining angle to the singular pose.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        MissingExtra
            If matplotlib is not installed.

        Examples
        --------
        >>> exo = ep.load("three-linear-actuators")
        >>> figure = exo.singular_approach(exo.pose(20)).plot()
        >>> figure.axes[0].get_xscale(), figure.axes[0].get_yscale()
        ('log', 'log')
        """
        return drawn("approach_figure", self)

    def __str__(self) -> str:
        where = angle_words(self.singular_pose, self.side)
        distance = np.degrees(self.distance)
        head = (
            f"The pose is singular ({where})."
            if distance < 1e-6
            else f"The nearest singular pose is {distance:.2g}° away: {where}."
        )
        lines = [head, f"There the limbs cannot resist a moment about {describe_axis(self.lost_axis)}."]
        if self.nearest_held is None:
            lines.append("No pose within 60° can be held.")
        else:
            lines.append(self.nearest_held.sentence(self.side))
        lines += ["", f"{'angle left, °':>14} {'shoulder |F_s|, N':>18} {'largest limb force, N':>22}"]
        largest = np.abs(self.reaction.actuator_forces).max(axis=-1)
        degrees = np.degrees(self.turns)
        printed = np.flatnonzero(np.isclose(degrees[:, None], _PRINTED, rtol=1e-7, atol=0.0).any(axis=1))
        # A way that begins within 0.1° has none of those angles.
        for k in printed if printed.size else range(0, len(degrees), _EVERY):
            lines.append(f"{degrees[k]:14.2g} {self.reaction.magnitude[k]:18.0f} {largest[k]:22.0f}")
        return "\n".join(lines)


def singular_approach(
    device: Any, case: Case, assumptions: Assumptions, start: Rotation | None = None
) -> SingularApproach:
    """Forces along a turn into the singular pose at or nearest to a pose.

    Parameters
    ----------
    device : ShoulderExo
        The device.
    case : Case
        Of a single pose at rest. Of other than three limbs it must be singular itself: their singular poses form no
        surface.
    assumptions : Assumptions
        Of the question.
    start : Rotation, optional
        Single: beginning of the turn. If left out, the turn covers the last 20° from the side of the given pose; for a
        singular pose it takes the direction in which the margin grows fastest.

    Raises
    ------
    InvalidInput
        If a pose is a stack, the start is the singular pose, there are other than three limbs and the pose is not
        singular, or the case has a motion.
    """
    pose = at_rest(case)
    begin = None if start is None else as_single_rotation("start", start)
    mechanism = device.mechanism

    def measure(poses: Rotation) -> Singularity:
        return singularity(mechanism.geometry, poses, mechanism.is_upu)

    end, distance = pose, 0.0
    if not measure(pose).actuation:
        if mechanism.limb_count != 3:
            raise InvalidInput(
                f"expected a singular pose: of {mechanism.limb_count} limbs the nearest one is not searched for"
            )
        found = nearest_singularity(mechanism.geometry, pose)
        end, distance = found.pose, float(found.distance)
    away, reach = _way(measure, end, pose if begin is None else begin, begin is not None)
    degrees = np.degrees(np.geomspace(reach, min(_TO, 0.1 * reach), _SAMPLES))
    rounded = [value for value in _PRINTED if degrees[-1] < value < degrees[0]]
    turns = np.radians(np.unique(np.round([*degrees, *rounded], 9))[::-1])
    poses = Rotation.from_rotvec(turns[:, None] * away) * end
    return SingularApproach(
        singular_pose=end,
        distance=distance,
        lost_axis=measure(end).lost_direction,
        turns=turns,
        poses=poses,
        reaction=solve(device, case.at(poses), assumptions),
        nearest_held=nearest_held_pose(lambda poses: solve(device, case.at(poses), assumptions).limits, pose),
        side=mechanism.side,
    )


def _way(
    measure: Callable[[Rotation], Singularity], end: Rotation, begin: Rotation, whole: bool
) -> tuple[FloatArray, float]:
    """Axis of the turn that leads away from the end, unit vector, and its angle, rad."""
    turn = (begin * end.inv()).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if angle > 1e-9:
        return turn / angle, angle if whole else _FROM
    if whole:
        raise InvalidInput("expected a start other than the singular pose")
    directions = spread_directions(_DIRECTIONS)
    worst = measure(Rotation.from_rotvec(_AT * directions) * end).amplification
    return directions[int(np.argmin(worst))], _FROM
