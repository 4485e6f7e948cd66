"""Which criteria make a pose part of the workspace, and their limits."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import InvalidInput, MissingData, UnknownName
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import as_choice, as_finite, require_types, set_fields, set_positive
from ..design import Arm, Mechanism, Wearer
from ..design.obstacles import as_obstacle
from ..device.wrist_device import as_device
from ..reaction.constraints.glenoid_cone import GlenoidCone
from ..wrist.clearance.clearance import BodyShape, as_elbow_range
from ..wrist.clearance.gaps import NOBODY, beyond_elbow
from .criterion import CRITERIA, NO_LIMIT, NO_SPRINGS, NO_UNIVERSAL_JOINTS, grid

#: Largest step between the postures of an elbow in which forces are checked, rad.
_ARM_STEP = np.radians(45.0)


@checked
@dataclass(frozen=True, eq=False)
class Criteria(Record):
    """Criteria of a workspace and their limits. A pose belongs to the workspace if all checked criteria hold.

    Attributes
    ----------
    names : tuple of str or None
        Which of :data:`CRITERIA` to check; None for all for which the design and this record have the data.
    least_margin : float
        Least margin to a singular pose, as :attr:`exo_pin.Reaction.margin`, on the side of the singular surface that
        rest is on: from 0 to 1.
    stroke_rule : {"each", "not all short"}
        "each": every limb within its stroke (Table 5-6). "not all short": only a pose in which all actuators would be
        shorter than their shortest length fails (Appendix C).
    least_tension : float
        Tension that every limb which only pulls must have, N: what keeps a cable taut.
    least_moment : float
        Disturbing moment of any direction that must be held besides, N m.
    largest_shoulder_force : float or None
        Limit of |F_s|, N. None: |F_s| is reported and not limited.
    largest_pull_out : float or None
        Limit of the pull of F_s that draws the head out of its socket, N; None: not limited. The wearer's own muscles
        press it in, with tens to hundreds of N, and are not part of F_s.
    socket : GlenoidCone or None
        Where the socket faces, for ``largest_pull_out``: :meth:`exo_pin.Person.glenoid_cone`.
    largest_cuff_pull : float or None
        Limit of the cuff's pull along the arm, either way, N; None: not limited.
    largest_cuff_slip : float or None
        Limit of what a soft cuff slips on the arm, m (:attr:`exo_pin.Reaction.cuff_slip`); None: not limited.
    least_above_elbow : float or None
        How far above the elbow of every wearer the cuff ends at least, m: the sleeve that its joints ask for
        (:func:`exo_pin.design.holding_frame.sleeve_size`), whose rim is 10 mm below the lowest one. None: not checked.
    least_moment_without_limb : float or None
        Disturbing moment of any direction that must still be held besides while any one limb gives no force, N m; 0:
        the arm is held. None: not checked.
    least_rate : float or None
        Least of the weakest rates of the drives' positions (:mod:`exo_pin.device.accuracy.pose_accuracy`), m/rad, or
        rad/rad of a device with hinges as drives; 0.0573 m/rad is 1 mm/°. None: not checked.
    least_twin_angle : float or None
        No pose that is at least so far away, rad, may look the same to the drives (a twin); 0.1745 is 10°. None: not
        checked.
    least_gap : float
        Distance that limbs must keep from the body and from one another, m.
    limb_radius : float or None
        Of all limbs, m; None for that of each one's family (:mod:`exo_pin.wrist.clearance.clearance`).
    wearers : tuple of Wearer
        For each of whom the criteria must hold, with the arm and the body of each: a person, or all that one size is
        meant for. Empty: for who wears the design (:meth:`exo_pin.ShoulderExo.worn_by`, or the arm of its file).
    elbow_range : tuple of float or None
        From which to which angle of the elbow they must hold, rad; None: in the posture of each wearer.
    body : BodyShape or None
        Another shape that limbs must keep clear of; None: that of the wearers. Where none is known the criterion
        "clearance" is not checked. Its upper arm is as long as that of each of ``wearers``.
    obstacles : tuple of str
        What stands about the wearers, beside their body: "chair", "wheelchair", "bed", "door", and "wall:120" or
        "ceiling:0" for planes so many mm behind the back or above the head
        (:func:`exo_pin.design.obstacles.obstacle`). Its gaps count as those to the torso.

    Raises
    ------
    UnknownName
        If a name is none of the criteria.
    InvalidInput
        If a limit is negative, or the body is another person's.

    Examples
    --------
    >>> asked = ep.Criteria(largest_shoulder_force=60.0)
    >>> found = ep.load("four-linear-actuators").workspace(10.0, criteria=asked)
    >>> print(f"{found.fractions['shoulder_force']:.0%} of the poses stay below 60 N")
    94% of the poses stay below 60 N
    """

    names: tuple[str, ...] | None = None
    least_margin: float = 0.05
    stroke_rule: str = "each"
    least_tension: float = 0.0
    least_moment: float = 0.0
    largest_shoulder_force: float | None = None
    largest_pull_out: float | None = None
    socket: GlenoidCone | None = None
    largest_cuff_pull: float | None = None
    largest_cuff_slip: float | None = None
    least_above_elbow: float | None = None
    least_moment_without_limb: float | None = None
    least_rate: float | None = None
    least_twin_angle: float | None = None
    least_gap: float = 0.0
    limb_radius: float | None = None
    wearers: tuple[Wearer, ...] = ()
    elbow_range: tuple[float, float] | None = None
    body: BodyShape | None = None
    obstacles: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.names is not None:
            if isinstance(self.names, str) or not isinstance(self.names, Iterable):
                raise InvalidInput(f"expected names to be a sequence of criteria, got {echo(self.names)}")
            asked = tuple(self.names)  # once: it may be a generator
            for name in asked:
                if name not in CRITERIA:
                    raise UnknownName("criterion", name, CRITERIA)
            set_fields(self, names=tuple(name for name in CRITERIA if name in asked))
        as_choice("stroke_rule", self.stroke_rule, ("each", "not all short"))
        set_positive(self, "least_margin", "least_tension", "least_moment", zero=True)
        set_fields(self, least_gap=float(as_finite("least_gap", self.least_gap, ())))
        forces = ("largest_shoulder_force", "largest_cuff_pull", "largest_cuff_slip")
        set_positive(self, "least_rate", "least_twin_angle", "limb_radius", *forces, optional=True)
        zero = ("largest_pull_out", "least_above_elbow", "least_moment_without_limb")
        set_positive(self, *zero, zero=True, optional=True)
        require_types(self, socket=GlenoidCone | None, body=BodyShape | None)
        wearers = (self.wearers,) if isinstance(self.wearers, Wearer) else tuple(self.wearers)
        if not all(isinstance(each, Wearer) for each in wearers):
            raise InvalidInput(f"expected wearers to be Wearers, got {echo(self.wearers)}")
        obstacles = (self.obstacles,) if isinstance(self.obstacles, str) else tuple(self.obstacles)
        for each in obstacles:
            as_obstacle(each)
        set_fields(self, wearers=wearers, obstacles=obstacles)
        if self.elbow_range is not None:
            set_fields(self, elbow_range=as_elbow_range(self.elbow_range))
        if self.obstacles and self.body is not None:
            raise InvalidInput("obstacles stand about the wearers: with a body of your own, put them into its torso")
        if self.body is not None:
            self.body.require_fit(self.wearers)

    @classmethod
    def of(cls, value: Criteria | Iterable[str] | None) -> Criteria:
        """Criteria from what a user passes: a record, names, or None for all that the data allow.

        Parameters
        ----------
        value : Criteria or iterable of str or None
            What was passed.

        Returns
        -------
        Criteria

        Raises
        ------
        UnknownName
            If a criterion does not exist.

        Examples
        --------
        >>> ep.Criteria.of(["stroke", "clearance"]).names
        ('stroke', 'clearance')
        """
        if isinstance(value, Criteria):
            return value
        return cls() if value is None else cls(names=value)  # type: ignore[arg-type]

    def replace(self, **changes: Any) -> Criteria:
        """A copy with some limits changed.

        Parameters
        ----------
        **changes
            Attributes of the class.

        Returns
        -------
        Criteria

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators")
        >>> strict = ep.Criteria(largest_shoulder_force=40.0)
        >>> both = strict, strict.replace(largest_shoulder_force=80.0)
        >>> low, high = (exo.workspace(30.0, criteria=each).fractions["shoulder_force"] for each in both)
        >>> low < high  # of the poses, with 40 and with 80 N
        True
        """
        return replace(self, **changes)

    def wearers_of(self, mechanism: Mechanism) -> tuple[Wearer, ...]:
        """For whom the criteria must hold; empty where that is not known.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        tuple of Wearer

        Examples
        --------
        >>> (wearer,) = ep.Criteria().wearers_of(ep.load("four-cables-worn").mechanism)
        >>> wearer.height, wearer.mass  # m, kg
        (1.75, 75.0)
        """
        if self.wearers:
            return self.wearers
        own = None if mechanism.arm is None else mechanism.arm.wearer
        return () if own is None else (own,)

    def arms(self, mechanism: Mechanism) -> tuple[Arm | None, ...]:
        """Arms that must be held, with what the device moves besides.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        tuple of Arm or None

        Raises
        ------
        MissingData
            If the elbow bends and it is not known whose it is.

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> arms = ep.Criteria().arms(exo.mechanism)
        >>> round(float(arms[0].mass), 2)  # kg, of the wearer's arm and what the device moves
        4.86
        """
        if not self.wearers and self.elbow_range is None:
            return (mechanism.arm,)
        wearers = self.wearers_of(mechanism)
        if not wearers:
            raise MissingData([NOBODY], "an arm whose elbow bends", mechanism.name)
        return _arms(mechanism.arm, wearers, self.elbow_range)

    def body_of(self, mechanism: Mechanism) -> BodyShape | None:
        """What limbs must keep clear of; None where that is not known.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        BodyShape or None

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> body = ep.Criteria().body_of(exo.mechanism)
        >>> round(float(2e3 * np.pi * body.arm[0, 6]))  # mm, girth of the upper arm of a man of 1.755 m and 85 kg
        359
        """
        wearers = self.wearers_of(mechanism)
        if self.obstacles and not wearers:
            raise MissingData([NOBODY], "obstacles", mechanism.name)
        if self.body is not None or not wearers:
            return self.body
        return _body(wearers, mechanism.side, self.elbow_range, self.obstacles)

    def off_grid(self) -> Criteria:
        """These criteria without those of a grid, for poses that are none.

        Returns
        -------
        Criteria

        Examples
        --------
        >>> ep.Criteria.of(["stroke", "connected"]).off_grid().names
        ('stroke',)
        """
        if self.names is None:
            return self
        return self.replace(names=tuple(name for name in self.names if grid not in CRITERIA[name].needs))

    def chosen(self, mechanism: Mechanism, is_grid: bool) -> tuple[tuple[str, ...], dict[str, str]]:
        """Criteria to check on a design, and why the others are not checked.

        Parameters
        ----------
        mechanism : Mechanism
            The design.
        is_grid : bool
            Whether the poses are a grid of shoulder angles.

        Returns
        -------
        checked : tuple of str
            Names of :data:`exo_pin.workspace.CRITERIA`.
        not_checked : dict of str to str
            The others, and why.

        Raises
        ------
        MissingData
            If one that was named cannot be checked.

        Examples
        --------
        >>> checked, others = ep.Criteria().chosen(ep.load("prototype").mechanism, is_grid=False)
        >>> "stroke" in checked, "connected" in others
        (True, True)
        """
        left_out = {}
        for name, criterion in CRITERIA.items():
            lacking = criterion.missing(mechanism, self, is_grid)
            if lacking and self.names is not None and name in self.names:
                raise MissingData(_lacked(lacking), f"the criterion {name!r}", mechanism.name)
            if lacking:
                left_out[name] = _why(lacking)
            elif self.names is not None and name not in self.names:
                left_out[name] = "not chosen"
        limbs = as_device(mechanism).accelerate("workspace")
        if limbs is not None and "elbow" in left_out:
            words = beyond_elbow(limbs.geometry.platform_points, self.wearers_of(mechanism))
            left_out["elbow"] = f"{words} (least_above_elbow)" if words else left_out["elbow"]
        return tuple(name for name in CRITERIA if name not in left_out), left_out


# A search asks for the same arms and the same body for every design.
@functools.lru_cache(maxsize=32)
def _arms(own: Arm | None, wearers: tuple[Wearer, ...], elbow_range: tuple[float, float] | None) -> tuple[Arm, ...]:
    found = []
    for wearer in wearers:
        low, high = (wearer.elbow_flexion,) * 2 if elbow_range is None else elbow_range
        for bend in np.linspace(low, high, 1 + int(np.ceil((high - low) / _ARM_STEP))):
            # A person's arm lies in the x-z plane, so that it is the same on either side of the body.
            arm = Arm.of_wearer(replace(wearer, elbow_flexion=float(bend)))
            found.append(arm.with_device_of(own))
    return tuple(found)


@functools.lru_cache(maxsize=32)
def _body(
    wearers: tuple[Wearer, ...], side: str, elbow_range: tuple[float, float] | None, obstacles: tuple[str, ...]
) -> BodyShape:
    return BodyShape.of(wearers, side, elbow_range, obstacles)


def _lacked(lacking: list[str]) -> list[str]:
    """What a design lacks, as it stands after "has no"."""
    nouns = {NO_UNIVERSAL_JOINTS: "limb with universal joints", NO_SPRINGS: "spring with a law"}
    return [nouns.get(text, text.removeprefix("no ")) for text in lacking]


def _why(lacking: list[str]) -> str:
    """Why a criterion is left out, from what it lacks."""
    if lacking in ([NO_UNIVERSAL_JOINTS], [NO_SPRINGS]):
        return f"does not apply: {lacking[0]}"
    return lacking[0] if lacking[0].startswith(NO_LIMIT) else "not known: " + ", ".join(lacking)
