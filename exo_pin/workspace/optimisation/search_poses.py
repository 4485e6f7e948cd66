"""What a search may choose of a device, and the poses, centre offsets and contact forces that judge its designs.

Dimensions are of a wrist those of joints and strokes, of another device its links. Their names are those of sweeps
(:mod:`exo_pin.design.parameters.names`, :mod:`exo_pin.device.dimensions`). A limb of a wrist whose ``nominal_length``
is no variable gets the stroke of its family that fits best.

A frame on the torso has the shoulder's centre at its own only in some poses, and no donning is exact. A search may be
given several offsets, each of them one for all poses or a centre path: then every pose counts once with each.

The contact force of the wearer's shoulder is the least that the design can bring about: limb forces within the limits
of the actuators and activations of the wearer's muscles are chosen together so that the contact force is least
(:meth:`exo_pin.ShoulderExo.joint_contact`, ``forces="least_contact"``). That is a lower bound of what a wearer feels,
and it counts what |F_s| leaves out: poses that the device holds only together with the muscles, and the muscles of the
elbow, which press on the shoulder as well.

One pose is a cone program of some milliseconds, as much as a whole design costs by the other objectives. So it is
solved in a few poses, drawn evenly from the weights of the search, and only for the better designs of a generation;
the others get a **surrogate**: the smaller one of |F_s| (which needs no muscle) and the contact force without the
device, shifted by what it misses on average in the better designs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_rotation
from ...core.errors import InvalidInput, MissingData
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, ReadOnly, as_finite, as_positive
from ...design import Mechanism
from ...design.holding_frame import with_cuff_by_geometry
from ...design.parameters.names import bounds_of
from ...device.protocol import Device
from ...device.wrist_device import as_device
from ...load_case import CentreOffset, CentrePath
from ...load_case.pose_stacks import pose_matrices, require_massless
from ...load_case.ranges_of_motion import ADL_BOX
from ...reaction.constraints.given_limits import Limits
from ...reaction.holding.least_held_forces import tension_limits
from ...reaction.splits.pose_stack import limb_lengths
from ..criteria import Criteria
from ..device_values import values_of
from ..evaluation import PoseOffsets

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person


#: By how much a design may miss a bound, m and rad: bounds are given in rounded figures.
_ROUNDED = 1e-6


class DesignVariables(Record):
    """Variables with their bounds, and the design that belongs to a point of the unit cube.

    Parameters
    ----------
    design : Device or Mechanism
        The design to start from.
    bounds : mapping of str to (float, float)
        By name; see the module's description.
    by_geometry : bool
        Whether the moving part of the device is that of each design's own cuff
        (:func:`exo_pin.design.holding_frame.estimated_cuff`), in place of what the design moves.

    Raises
    ------
    UnknownName
        If a name is none of these.
    InvalidInput
        If a bound is not finite or the lower one is not below the upper, or a circle's dimension is varied in a design
        whose joints are not on circles, or an end fitting of a limb without its length.
    """

    def __init__(self, design: Device | Mechanism, bounds: Mapping[str, Any], by_geometry: bool = False) -> None:
        if not isinstance(bounds, Mapping) or not bounds:
            raise InvalidInput("expected variables as a mapping of names to (lowest, highest)")
        self.device: Device = as_device(design)
        self.by_geometry = by_geometry
        self.parameters = self.device.parameters(bounds)
        self.names = tuple(named.si_name for named in self.parameters)
        if len(set(self.names)) < len(self.names):
            raise InvalidInput(f"expected each variable once, got {', '.join(bounds)}")
        pairs = zip(self.parameters, bounds.values(), strict=True)
        self.bounds = np.array([bounds_of(named, given) for named, given in pairs])
        self._whole = np.isclose(self.bounds[:, 1] - self.bounds[:, 0], 2.0 * np.pi)
        self._whole &= [named.kind == "angle" for named in self.parameters]
        self.of_design()  # raises for what is no dimension
        #: By limb: whether the variables set its stroke, so that none is fitted, shape (n,).
        self.sets_stroke = self._are_named("nominal_length")
        idle = np.flatnonzero(self._are_named("end_fitting") & ~self.sets_stroke)
        if idle.size:
            limb = idle[0] + 1
            raise InvalidInput(f"expected nominal_length[{limb}] beside end_fitting: its stroke is fitted otherwise")

    def _are_named(self, key: str) -> NDArray[np.bool_]:
        """Limbs that have this parameter, of their own or of all limbs, among the variables, shape (n,)."""
        limbs = [named.limb for named in self.parameters if named.key == key]
        return np.array([None in limbs or i + 1 in limbs for i in range(self.device.limb_count)])

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.names)

    def values(self, point: FloatArray) -> dict[str, float]:
        """Values by name of a point, shape (k,).

        Bounds are met by a cosine, low + (high - low) (1 - cos π x)/2, which is smooth where a search would otherwise
        bounce off a wall, and good designs lie at many walls. A full circle goes on where it ends.
        """
        inside = 0.5 - 0.5 * np.cos(np.pi * point)
        values = self.bounds[:, 0] + inside * (self.bounds[:, 1] - self.bounds[:, 0])
        turned = self.bounds[:, 0] + np.mod(point, 1.0) * 2.0 * np.pi
        return dict(zip(self.names, np.where(self._whole, turned, values).tolist(), strict=True))

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point that belongs to values within the bounds, shape (k,)."""
        chosen = np.array([values[name] for name in self.names])
        share = (chosen - self.bounds[:, 0]) / (self.bounds[:, 1] - self.bounds[:, 0])
        return np.where(self._whole, share, np.arccos(np.clip(1.0 - 2.0 * share, -1.0, 1.0)) / np.pi)

    def of_design(self, must_fit: bool = False) -> dict[str, float]:
        """Values of the design to start from, by name, moved into the bounds; their middle where it has none.

        Raises
        ------
        InvalidInput
            If a value of the design is outside, and the design must fit: a search would begin elsewhere.
        """
        values = {}
        for named, (low, high) in zip(self.parameters, self.bounds, strict=True):
            value = self.device.value_of(named)
            if must_fit and value is not None and not low - _ROUNDED <= value <= high + _ROUNDED:
                raise InvalidInput(
                    f"expected bounds that hold the design that is refined: its {named.si_name} is {value:g}, outside "
                    f"{low:g} to {high:g} (m, rad)"
                )
            values[named.si_name] = float(np.clip(0.5 * (low + high) if value is None else value, low, high))
        return values

    def design(self, values: Mapping[str, float]) -> Any:
        """The device with these values."""
        made = self.device.with_values({named: values[named.si_name] for named in self.parameters})
        return with_cuff_by_geometry(made) if self.by_geometry else made  # type: ignore[arg-type]


#: An offset that holds for any pose; None: the centres are one.
Centre = CentreOffset | CentrePath | None


def as_centres(given: Centre | ArrayLike | Sequence[Centre]) -> tuple[Centre, ...]:
    """Offsets from what a user passes: one, or a sequence of records and None.

    Raises
    ------
    InvalidInput
        If one of them is a stack: a search has other poses than the check of what it finds.
    """
    is_listed = isinstance(given, (tuple, list)) and all(isinstance(each, Centre) for each in given)
    listed: Any = given if is_listed else (given,)
    if not listed:
        raise InvalidInput("expected at least one centre_offset, got an empty sequence")
    found = []
    for each in listed:
        centre = each
        if not isinstance(each, Centre):
            centre = CentreOffset.together(as_finite("centre_offset", each, (3,), stack=True))
        if isinstance(centre, CentreOffset) and (centre.base.ndim > 1 or centre.cuff.ndim > 1):
            raise InvalidInput(
                f"expected centre_offset as one offset or a CentrePath, got stacks of {centre.base.shape}, "
                f"{centre.cuff.shape}: designs are judged in other poses, too"
            )
        found.append(centre)
    return tuple(found)


def shifted(centre: Centre, shift: FloatArray) -> CentreOffset | CentrePath:
    """The offset of a device that sits elsewhere besides, base and cuff alike, by ``shift``, shape (3,), m."""
    if isinstance(centre, CentrePath):
        return replace(centre, fit=np.asarray(centre.fit) + shift)
    if centre is None:
        return CentreOffset.together(shift)
    return CentreOffset(centre.base + shift, centre.cuff + shift)


def described(centre: Centre) -> dict[str, Any] | None:
    """The numbers of an offset, by which a stored study knows it again."""
    return None if centre is None else {name: np.asarray(value).tolist() for name, value in vars(centre).items()}


def centre_text(centre: CentreOffset | CentrePath) -> str:
    """One line on an offset, for a report."""
    if isinstance(centre, CentrePath):
        most, fit = 1e3 * np.linalg.norm(centre.displacement, axis=1).max(), 1e3 * np.asarray(centre.fit)
        where = "" if not fit.any() else f", and is off by ({', '.join(f'{x:g}' for x in fit)}) mm at rest"
        return f"The shoulder's centre moves with the arm, by at most {most:.0f} mm on its path{where}."
    base, cuff = (", ".join(f"{1e3 * x:g}" for x in side) for side in (centre.base, centre.cuff))
    return f"The device's centre is off the shoulder's by ({base}) mm at the base and ({cuff}) mm at the cuff."


@checked
@dataclass(frozen=True, eq=False)
class SearchPoses(ReadOnly):
    """A stack of N poses with weights of sum 1.

    Attributes
    ----------
    poses : Rotation
        Shape (N,).
    weights : ndarray
        Shape (N,).
    offsets : PoseOffsets
        Of the device's centre in these poses; none if left out.
    """

    poses: Rotation
    weights: FloatArray
    offsets: PoseOffsets = field(default_factory=PoseOffsets.none)

    def __post_init__(self) -> None:
        weights = as_finite("weights", self.weights, (None,))
        if self.poses.shape != weights.shape or (weights < 0.0).any() or not weights.sum() > 0.0:
            raise InvalidInput(
                f"expected one weight of zero or more a pose, got shapes {self.poses.shape}, {weights.shape}"
            )
        object.__setattr__(self, "weights", weights / weights.sum())

    @classmethod
    def of(cls, value: SearchPoses | Rotation) -> SearchPoses:
        """Poses of equal weight, if ``value`` has none."""
        if isinstance(value, SearchPoses):
            return value
        if not isinstance(value, Rotation) or value.as_quat().size == 0:
            got = "an empty stack" if isinstance(value, Rotation) else type(value).__name__
            raise InvalidInput(f"expected poses as a stack of rotations or SearchPoses, got {got}")
        flat = Rotation.from_quat(value.as_quat().reshape(-1, 4))
        return cls(flat, np.ones(len(flat)))

    def at_centres(self, centres: Sequence[Centre]) -> SearchPoses:
        """These poses with every one of the offsets of the device's centre, one stack after the other."""
        quaternions, count = self.poses.as_quat(), len(self.weights)
        offsets = PoseOffsets.joined([PoseOffsets.of(each, self.poses) for each in centres], count)
        return SearchPoses(
            Rotation.from_quat(np.tile(quaternions, (len(centres), 1))), np.tile(self.weights, len(centres)), offsets
        )


#: Share of the weight that the lines of lifting have together.
_LIFTING = 0.3


@checked
def lifting_poses(side: str = "left", counts: tuple[int, int, int] = (7, 6, 6)) -> SearchPoses:
    """A coarse grid of the box of daily activities, and ``lifting_lines`` in steps of 10° with 30 % of the weight.

    Parameters
    ----------
    side : {"left", "right"}
        Side of the body.
    counts : (int, int, int)
        Nodes in flexion, abduction and internal rotation, both ends included.

    Returns
    -------
    SearchPoses

    Examples
    --------
    >>> from exo_pin.workspace import lifting_poses
    >>> lifting_poses(counts=(3, 3, 2)).poses.shape
    (38,)
    """
    angles = [np.linspace(low, high, count) for (low, high), count in zip(ADL_BOX.intervals, counts, strict=True)]
    flexion, abduction, internal = (nodes.ravel() for nodes in np.meshgrid(*angles, indexing="ij"))
    grid = shoulder_rotation(flexion, abduction, internal, side, degrees=True)
    lines = Rotation.concatenate(lifting_lines(side, 10.0))
    shares = ((grid, 1.0 - _LIFTING), (lines, _LIFTING))
    weights = np.concatenate([np.full(len(poses), share / len(poses)) for poses, share in shares])
    return SearchPoses(Rotation.concatenate([grid, lines]), weights)


@checked
def lifting_lines(side: str, step: float = 5.0) -> tuple[Rotation, Rotation]:
    """Lifting forward and sideways from 0 to 90° in steps, degrees, as two stacks."""
    angles = np.linspace(0.0, 90.0, int(np.ceil(90.0 / as_positive("step", step))) + 1)
    return (
        shoulder_rotation(angles, 0.0, 0.0, side, degrees=True),
        shoulder_rotation(0.0, angles, 0.0, side, degrees=True),
    )


#: Poses in which the contact force is computed.
_POSES = 12


class ContactObjective(Record):
    """Mean contact force of a wearer over some poses.

    Parameters
    ----------
    person : Person
        The wearer, on the side of the design.
    poses : SearchPoses
        Of the search; those that the person can take and hold without the device count.
    kind : type of ShoulderExo
        Class of design that is made of a device; it computes the contact force.
    criteria : Criteria
        Whose ``least_tension`` the limbs have.

    Raises
    ------
    MissingData
        If the person can hold none of the poses.
    MissingExtra
        If the extra ``person`` is not installed.
    """

    def __init__(self, person: Person, poses: SearchPoses, kind: type[ShoulderExo], criteria: Criteria) -> None:
        self._person, self._kind = person, kind
        self._criteria = criteria.replace(names=("forces",))
        bare = person.joint_contact(poses.poses, outside="mark").magnitude
        # Some poses in proportion to their weights: at equal steps of the sum of the weights.
        reached = np.cumsum(np.where(np.isfinite(bare), poses.weights, 0.0))
        if not reached[-1] > 0.0:
            raise MissingData(["poses that the person can hold"], "the contact force of a search")
        chosen = np.unique(np.searchsorted(reached, (np.arange(_POSES) + 0.5) / _POSES * reached[-1]))
        self.poses, self.bare = poses.poses[chosen], bare[chosen]
        self._matrices = pose_matrices(self.poses)[1]
        self._offsets = poses.offsets.rows(chosen)

    def surrogate(self, mechanism: Any) -> float:
        """Mean of the smaller one of |F_s| and the contact force without the device, N."""
        values = values_of(mechanism, self._matrices, self._criteria, ("forces",), offsets=self._offsets)
        return float(np.fmin(values.shoulder_size, self.bare).mean())

    def exact(self, mechanism: Any) -> float:
        """Mean of the least contact force, N; where no answer is found that without the device counts."""
        design, wearer = self._kind.from_device(mechanism), self._person
        bounds: Limits = "design"
        offsets = self._offsets.spread(len(self._matrices))
        record = design.device.accelerate("workspace")
        if record is not None:
            require_massless(record)
            lengths = limb_lengths(record, self._matrices, offsets)
            bounds = tension_limits(record, lengths, self._criteria.least_tension)
        found = design.joint_contact(
            self.poses, wearer, "least_contact", limits=bounds, centre_offset=CentreOffset(*offsets), outside="mark"
        ).magnitude
        return float(np.where(np.isfinite(found), found, self.bare).mean())

    def description(self) -> Any:
        """What a stored study says of it."""
        return {"person": repr(self._person), "poses": len(self.bare)}
