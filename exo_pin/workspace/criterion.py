"""The criteria of a workspace: one record each, with name, unit, words, colour, needs, margin and weight.

Needs say what a design, limits and poses lack for a criterion.

A criterion that is added to :data:`CRITERIA` is checked wherever its needs are met, and stands in every table, picture
and search.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..design import Mechanism
from ..design.holding_frame import sleeve_size
from ..device.wrist_device import as_device
from ..reaction.constraints.actuator_limits import AT_END, length_limits
from ..reaction.holding.hold_check import missing_limits
from ..wrist.clearance.gaps import NOBODY

if TYPE_CHECKING:
    from .criteria import Criteria
    from .evaluation import PoseValues


#: Why the angles of universal joints are left out where there are none.
NO_UNIVERSAL_JOINTS = "no limb has universal joints"
#: Why data of springs are left out where there are none.
NO_SPRINGS = "no spring has a law"
#: Limits of an actuator that are none of its forces.
_NO_FORCES = ("stroke", "end fitting", "range of length")


#: Lists what a design, limits and poses (whether they are a grid) lack for a criterion; empty if nothing.
Need: TypeAlias = "Callable[[Mechanism, Criteria, bool], list[str]]"
#: Why a criterion is not checked that nobody asked for.
NO_LIMIT = "no limit given"


def joints(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the universal joints' ranges."""
    jointed = [limb for limb in mechanism.limbs if limb.kind == "UPU"]
    lacking = [] if jointed else [NO_UNIVERSAL_JOINTS]
    if any(limb.joint_limit is None for limb in jointed):
        lacking.append("range of the universal joints (joint_limit)")
    if any(limb.joint_straight is None for limb in jointed):
        lacking.append("straight direction of the universal joints (joint_straight)")
    return lacking


def forces(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the tensions within the actuators' limits."""
    lacking = [] if mechanism.arm is not None or criteria.wearers else ["arm mass"]
    lacking += [text for text in missing_limits(mechanism) if not text.startswith(_NO_FORCES)]
    # A muscle's pull depends on its length.
    laws = any(limb.actuator is not None and limb.actuator.force_law is not None for limb in mechanism.limbs)
    return [*lacking, *_strokes(mechanism, criteria, is_grid)] if laws else lacking


def body(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the wearer's body and of the shapes of the device's parts."""
    body, none = criteria.body_of(mechanism), np.empty((0, 3, 3))
    return list(as_device(mechanism).gaps(none, body=body, radius=criteria.limb_radius).unknown)


def _one(words: str, known: Callable[[Mechanism, Criteria], Any]) -> Need:
    """Need of one thing, in words, and whether a design and limits have it."""
    return lambda mechanism, criteria, is_grid: [] if known(mechanism, criteria) else [words]


def grid(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of poses on a grid."""
    return [] if is_grid else ["poses on a grid of three angles"]


_springs = _one(NO_SPRINGS, lambda device, _: device.springs)
_shoulder = _one(
    "range of motion of the shoulder ([shoulder])",
    lambda device, _: None not in (device.shoulder.half_diagonal, device.shoulder.abduction_centre),
)
_strokes = _one(
    "stroke or end fitting of limbs",
    lambda device, _: not any(np.isnan(limb.length_range).any() for limb in device.limbs),
)
_socket = _one(
    "where the socket faces (socket, --person)", lambda _, asked: asked.socket and asked.socket.orientation is not None
)
_own_arm = _one("a person's arm", lambda device, asked: asked.wearers or (device.arm and device.arm.person))
_cuff = _one("stiffness of the cuff (interfaces)", lambda device, _: device.interfaces.cuff)
_limbs = _one("limbs between two joint centres", lambda device, _: as_device(device).accelerate("workspace"))
_every_axis = _one("drives that hold the arm about every axis", lambda device, _: as_device(device).driven_moments == 3)
_wearers = _one(NOBODY, lambda device, asked: asked.wearers_of(device))


@checked
@dataclass(frozen=True)
class Criterion:
    """What may put a pose outside the workspace.

    Attributes
    ----------
    name : str
        Its key wherever criteria are named.
    unit : str
        Of its margin; "" for a number without one. Those of "stroke" and "accuracy" are rad and rad/rad for a device
        with hinges as drives (:attr:`exo_pin.workspace.Workspace.units`).
    words : str
        In a picture.
    colour : str
        "#RRGGBB", of poses that do not meet it in a picture; lightness should differ from the others as well as hue.
    margin : callable
        Margin of N poses, shape (N,), from their :class:`PoseValues`: zero or more where it is met, NaN if not known.
    scale : float or callable
        How much less margin counts as one in a search, in its unit, or how much that is with the limits of a search;
        infinite if only whether it is met counts.
    needs : tuple of callable
        What it needs; each lists what lacks. With ``forces`` and ``body`` these are computed.
    aim : float
        Margin that a search aims at, in its unit, so that what is found on a coarse grid holds between its nodes.
    most : float
        Most that it adds to the merit of one pose in a search.
    limit : str
        Attribute of :class:`Criteria` without which nothing is asked; "" for a criterion that needs none.
    is_vital : bool
        Whether nothing is said about whether a design works before this was checked.

    Examples
    --------
    >>> from exo_pin.workspace import CRITERIA, Criterion
    >>> margin = lambda at: 0.6 - at.lengths.max(axis=1)  # m, of the longest limb
    >>> Criterion("short", "m", "long limb", "#117733", margin, scale=0.05).unit == CRITERIA["stroke"].unit
    True
    """

    name: str
    unit: str
    words: str
    colour: str
    margin: Callable[[PoseValues], FloatArray]
    scale: float | Callable[[Criteria], float]
    needs: tuple[Need, ...] = ()
    aim: float = 0.0
    most: float = 2.0
    limit: str = ""
    is_vital: bool = False

    def __reduce__(self) -> Any:
        # Its functions are often lambdas, which cannot be pickled; a criterion of the table is found by its name.
        return (_registered, (self.name,)) if CRITERIA.get(self.name) is self else super().__reduce__()

    def missing(self, mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
        """What it needs and the design, the limits or the poses do not have; empty if nothing lacks.

        Parameters
        ----------
        mechanism : Mechanism
            The design.
        criteria : Criteria
            Limits.
        is_grid : bool
            Whether the poses are a grid of shoulder angles.

        Returns
        -------
        list of str

        Examples
        --------
        >>> from exo_pin.workspace import CRITERIA
        >>> CRITERIA["clearance"].missing(ep.load("prototype").mechanism, ep.Criteria(), is_grid=True)
        ['who wears it (worn_by, --person)']
        """
        asked = self.limit == "" or getattr(criteria, self.limit) is not None
        lacking = [text for need in self.needs for text in need(mechanism, criteria, is_grid)]
        return lacking if asked else [f"{NO_LIMIT} ({self.limit})", *lacking]


def _registered(name: str) -> Criterion:
    return CRITERIA[name]


def _elbow(at: PoseValues) -> FloatArray:
    """How far above the elbow of the shortest arm the cuff ends, less the limit: the same in all poses, (N,), m."""
    arm = min(wearer.upper_arm_length for wearer in at.criteria.wearers_of(at.mechanism))
    end = sleeve_size(np.asarray(at.mechanism.geometry.platform_points))[1]
    return np.full(len(at.matrices), arm + end - (at.criteria.least_above_elbow or 0.0))


def _stroke_margin(at: PoseValues) -> FloatArray:
    """Distance to the ends of the strokes, shape (N,); see :attr:`Criteria.stroke_rule`."""
    low, high = length_limits(at.mechanism)
    # Limb by limb: a minimum along so short an axis takes NumPy several times as long.
    columns = [np.ascontiguousarray(column) for column in at.lengths.T]
    if at.criteria.stroke_rule == "not all short":
        # What the wearer makes has no least length.
        own = columns[: len(as_device(at.mechanism).drives)]
        ends = [(c - a) / s for c, a, s in zip(own, low, at.levers, strict=False)]
        margin = functools.reduce(np.maximum, ends) if ends else np.full(len(at.lengths), np.inf)
    else:
        sides = [np.minimum(c - a, b - c) / s for c, a, b, s in zip(columns, low, high, at.levers, strict=True)]
        margin = functools.reduce(np.minimum, sides)
    # Both ends belong to the stroke: a length at one is within it, whatever its rounding.
    return np.where((margin < 0.0) & (margin >= -AT_END), 0.0, margin)


def _at_least(value: str, limit: str) -> Callable[[PoseValues], FloatArray]:
    """Margin of a value above a limit of the record, both by name."""
    return lambda at: np.asarray(getattr(at, value) - getattr(at.criteria, limit))


_held = _at_least("moment", "least_moment")
_loss = _at_least("moment_without_limb", "least_moment_without_limb")


def _clearance(at: PoseValues) -> FloatArray:
    return np.asarray(at.gaps.min(axis=1) - at.criteria.least_gap)


def _limited(
    name: str, unit: str, words: str, colour: str, limit: str, margin: Any, scale: Any, *needs: Need, **more: Any
) -> Criterion:
    """A criterion that is asked by a limit of the record and adds at most one to the merit of a pose.

    ``margin`` is a function, or the name of a value that stays below the limit.
    """
    below = lambda at: np.asarray(getattr(at.criteria, limit) - getattr(at, margin))  # noqa: E731
    found = below if isinstance(margin, str) else margin
    return Criterion(name, unit, words, colour, found, scale, needs, most=1.0, limit=limit, **more)


_ALL = (
    # First, for of a pose that data do not cover nothing else is known.
    Criterion("evaluated", "", "data of a spring", "#88CCEE", lambda at: at.data_margin, np.inf, (_springs,)),
    Criterion("joint_angles", "rad", "joint angles", "#882255", lambda at: at.bend, 0.5, (joints,), aim=0.05),
    Criterion(
        "shoulder_range", "rad", "shoulder range", "#DDDDDD", lambda at: at.shoulder_range(), np.inf, (_shoulder,)
    ),
    Criterion("stroke", "m", "stroke", "#E69F00", _stroke_margin, 0.05, (_strokes,), is_vital=True),
    Criterion(
        "singularity", "", "singularity", "#000000", _at_least("margin", "least_margin"), 0.08, aim=0.03, is_vital=True
    ),
    Criterion(
        "connected", "", "connection to rest", "#777777", _at_least("connection", "least_margin"), 0.08, (grid,),
        is_vital=True,
    ),
    Criterion("forces", "N m", "forces of the actuators", "#D55E00", _held, 5.0, (forces,), aim=1.0, is_vital=True),
    # A pose that is not held has no shoulder force; "forces" counts how far it is from being held: so one at most.
    _limited(
        "shoulder_force", "N", "shoulder force", "#CC79A7", "largest_shoulder_force", "shoulder_size",
        lambda limits: limits.largest_shoulder_force or 1.0, forces, is_vital=True,
    ),
    _limited("socket", "N", "head pulled out", "#332288", "largest_pull_out", "pull_out", 100.0, forces, _socket),
    _limited(
        "cuff_pull", "N", "pull of the cuff", "#44AA99", "largest_cuff_pull", "cuff_pull", 100.0, forces, _own_arm
    ),
    _limited(
        "cuff_slip", "m", "slip of the cuff", "#999933", "largest_cuff_slip", "cuff_slip", 0.05, forces, _own_arm, _cuff
    ),
    Criterion(
        "elbow", "m", "elbow free of the cuff", "#661100", _elbow, 0.05, (_limbs, _wearers), limit="least_above_elbow"
    ),
    Criterion(
        "limb_loss", "N m", "loss of a limb", "#AA4499", _loss, 5.0, (forces,), limit="least_moment_without_limb"
    ),
    _limited(
        "accuracy", "m/rad", "weak drives", "#117733", "least_rate", _at_least("rates", "least_rate"),
        lambda limits: limits.least_rate or 1.0, _every_axis,
    ),
    _limited(
        "twins", "", "looks like another pose", "#6699CC", "least_twin_angle", lambda at: at.twin_difference - 1.0, 1.0,
        _every_axis, aim=0.2,
    ),
    Criterion("clearance", "m", "clearance", "#F0E442", _clearance, 0.03, (body,), aim=0.003, is_vital=True),
)  # fmt: skip
#: Criteria by name, in the order in which they are reported.
CRITERIA: dict[str, Criterion] = {criterion.name: criterion for criterion in _ALL}
