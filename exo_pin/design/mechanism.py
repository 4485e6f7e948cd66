"""A design: geometry, limbs, arm and shoulder in one frozen record."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..core.conventions import GRAVITY, MIRROR, Side, as_side, other_side, refuse_other_side
from ..core.errors import InvalidInput, MissingData
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, as_finite, frozen, require_type, require_types, set_fields
from .arm import Arm
from .geometry import WristGeometry
from .limb import Limb, limbs_for
from .shoulder import Interfaces, Shoulder

#: What sensors may tell a controller.
MEASURES = ("lengths", "arm")
#: Parts whose sources are marked where they are replaced.
_SOURCED = ("geometry", "limbs", "shoulder", "arm", "interfaces")


@checked
@dataclass(frozen=True, eq=False)
class Mechanism(Record):
    """A wrist of limbs between torso and arm.

    Attributes
    ----------
    geometry : WristGeometry
        Joint centres and frames.
    arm : Arm or None
        The moving part; None where the source does not give one.
    limbs : tuple of Limb
        One per joint pair; massless UPU limbs if left out.
    shoulder : Shoulder
        The ball joint at O.
    gravity : ndarray
        Shape (3,), m/s², base frame; another direction than -z is a leaning trunk.
    side : {"left", "right"}
        Side of the body.
    name, title : str
        Short name and a line of description.
    sources : mapping of str to str
        What each part was taken from.
    estimated : tuple of str
        Keys whose values the source does not print, and that are estimates.
    measures : tuple of str
        What sensors tell its controller: "lengths" of the limbs, "arm" for the arm's orientation; empty where it is not
        stated, and then both may be read.
    interfaces : Interfaces
        What sits between device and person, harness and cuff; rigid if left out. They give way in the split "elastic".

    Examples
    --------
    >>> mechanism = ep.Mechanism(ep.load("scenario-one").geometry, arm=ep.Arm(2.0, [0.0, 0.0, -0.2]))
    >>> mechanism.limb_count, bool(mechanism.is_upu.all()), mechanism.limbs_are_massless
    (3, True, True)
    """

    geometry: WristGeometry
    arm: Arm | None = None
    limbs: tuple[Limb, ...] = ()
    shoulder: Shoulder = field(default_factory=Shoulder)
    gravity: FloatArray = field(default_factory=lambda: GRAVITY)
    side: Side = "left"
    name: str = "unnamed"
    title: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    estimated: tuple[str, ...] = ()
    interfaces: Interfaces = field(default_factory=Interfaces)
    measures: tuple[str, ...] = ()

    #: It is no robot's file, of which something may be left out.
    doubts: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        require_types(self, geometry=WristGeometry, arm=Arm | None, shoulder=Shoulder, interfaces=Interfaces)
        gravity = as_finite("gravity", self.gravity, (3,))
        if np.linalg.norm(gravity) > 100.0:
            raise InvalidInput(f"expected gravity in m/s², got {gravity} (mm/s²?)")
        limbs = limbs_for(self.limbs, self.geometry.limb_count)
        set_fields(self, limbs=limbs, gravity=gravity, side=as_side(self.side))
        circles = self.geometry.circles
        if circles is not None and circles.side != self.side:
            raise InvalidInput(
                f"this geometry is laid out for the {circles.side} shoulder, not the {self.side}: use mirrored()"
            )
        for name in ("name", "title"):
            require_type(name, getattr(self, name), str, "a string")
        if not isinstance(self.sources, Mapping) or not all(
            isinstance(text, str) for pair in self.sources.items() for text in pair
        ):
            raise InvalidInput(f"expected sources to map strings to strings, got {echo(self.sources)}")
        if not isinstance(self.estimated, (tuple, list)) or not all(isinstance(key, str) for key in self.estimated):
            raise InvalidInput(f"expected estimated to be a list of strings, got {echo(self.estimated)}")
        given = (self.measures,) if isinstance(self.measures, str) else tuple(self.measures)
        set_fields(self, measures=tuple(as_choice("what it measures", each, MEASURES) for each in given))
        set_fields(self, sources=MappingProxyType(dict(self.sources)), estimated=tuple(self.estimated))

    @property
    def limb_count(self) -> int:
        """Number of limbs n."""
        return len(self.limbs)

    @property
    def summary(self) -> str:
        """Number and kinds of its limbs, such as "3UPU+1SPS"."""
        kinds = [limb.kind for limb in self.limbs]
        return "+".join(f"{kinds.count(kind)}{kind}" for kind in ("UPU", "SPS") if kind in kinds)

    @cached_property
    def radius(self) -> float:
        """Largest |B_i|, m, by which moments are divided."""
        return self.geometry.platform_radius

    @property
    def driven_moments(self) -> int:
        """Independent moments about O that the limbs make in general, 0 to 3."""
        return min(3, self.limb_count)

    @property
    def springs(self) -> tuple[()]:
        """Empty: no springs with laws of their own act beside the limbs."""
        return ()

    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of each tension: "limb 1" and on, N."""
        return tuple((f"limb {i}", "N") for i in range(1, 1 + self.limb_count))

    @property
    def has_limbs(self) -> bool:
        """Whether efforts are the tensions of limbs."""
        return True

    @property
    def force_words(self) -> tuple[str, str]:
        """What f and g are."""
        return "limb forces f", "side forces g"

    @cached_property
    def is_upu(self) -> NDArray[np.bool_]:
        """Shape (n,), bool: which limbs have universal joints at both ends."""
        return frozen(np.array([limb.kind == "UPU" for limb in self.limbs]))

    @property
    def limbs_are_massless(self) -> bool:
        """Whether no limb has mass, as in the thesis."""
        return all(limb.mass == 0.0 for limb in self.limbs)

    def require_arm(self, needed_for: str, inertia: bool = False) -> Arm:
        """Return the arm.

        Parameters
        ----------
        needed_for : str
            What for, in the message.
        inertia : bool
            Whether its inertia is needed.

        Returns
        -------
        Arm

        Raises
        ------
        MissingData
            If there is none, or if its inertia is needed and not known.

        Examples
        --------
        >>> try:
        ...     ep.load("scenario-one").mechanism.require_arm("its weight")
        ... except ep.MissingData as error:
        ...     print(error.missing)
        ('arm mass', 'arm centre of mass')
        """
        if self.arm is None:
            remedy = "give a person who wears it (--person 1.75,75,male, or worn_by), or an arm in the file"
            raise MissingData(["arm mass", "arm centre of mass"], needed_for, self.name, remedy)
        if inertia and self.arm.inertia is None:
            raise MissingData(["arm inertia"], needed_for, self.name)
        return self.arm

    def replace(self, **changes: Any) -> Self:
        """Return a new mechanism with some fields changed.

        With another number of joints ``limbs`` is adapted only if all limbs are alike; otherwise pass
        ``limbs`` too. Sources of changed values are marked "changed from"; those of an arm go with
        the arm.

        Parameters
        ----------
        **changes
            Fields of the class.

        Returns
        -------
        Mechanism

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.
        InvalidInput
            If it is another ``side``, which mirrors nothing: see :meth:`mirrored`.

        Examples
        --------
        >>> record = ep.Mechanism(ep.load("prototype").geometry, arm=ep.Arm(2.0, [0.0, 0.0, -0.3]))
        >>> supine = ep.ShoulderExo.from_mechanism(record.replace(gravity=[-9.81, 0.0, 0.0]))
        >>> supine.reaction(supine.pose(flexion=90)).actuator_forces.round(9) + 0.0  # the arm points up: no moment
        array([0., 0., 0.])
        """
        known = {item.name for item in fields(self)}
        for name in changes:
            as_choice("field", name, known)
        refuse_other_side(changes, self.side)
        geometry = changes.get("geometry", self.geometry)
        grown = isinstance(geometry, WristGeometry) and geometry.limb_count != self.limb_count
        if grown and "limbs" not in changes and len(set(self.limbs)) == 1:
            changes["limbs"] = self.limbs[:1] * geometry.limb_count
        if "sources" not in changes:
            changed = {name for name in _SOURCED if name in changes and changes[name] is not getattr(self, name)}
            changes["sources"] = sources_after(self.sources, changed)
        if "estimated" not in changes:
            changes["estimated"] = tuple(key for key in self.estimated if is_unchanged(self, changes, key))
        return replace(self, **changes)

    def mirrored(self) -> Self:
        """The same device on the other shoulder: mirror image in the x-z plane.

        Returns
        -------
        Mechanism

        Examples
        --------
        >>> right = ep.load("four-cables").mechanism.mirrored()
        >>> right.side, (1e3 * right.geometry.base_points[0]).round(3)  # mm; the left one has its first at y = 164
        ('right', array([  33., -164.,  185.]))
        """
        return replace(
            self,
            geometry=self.geometry.mirrored(),
            arm=None if self.arm is None else self.arm.mirrored(),
            limbs=tuple(limb.mirrored() for limb in self.limbs),
            shoulder=self.shoulder.mirrored(),
            gravity=self.gravity @ MIRROR,
            interfaces=self.interfaces.mirrored(),
            side=other_side(self.side),
        )

    def on_side(self, side: str) -> Self:
        """This mechanism if it is for ``side``, else its mirror image.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        Mechanism

        Raises
        ------
        UnknownName
            If ``side`` is neither.

        Examples
        --------
        >>> mechanism = ep.load("prototype").mechanism
        >>> mechanism.on_side("left") is mechanism, mechanism.on_side("right").side
        (True, 'right')
        """
        return self if as_side(side) == self.side else self.mirrored()


def is_unchanged(mechanism: object, changes: Mapping[str, Any], key: str) -> bool:
    """Whether changes leave the value of a key such as ``limbs[0].stroke.end_fitting`` as it is."""
    first, *steps = re.findall(r"\w+", key)
    if first not in changes:
        return True
    here: Any = getattr(mechanism, first, None)
    there: Any = changes[first]
    for step in steps:
        if here is there:
            return True
        try:
            here, there = (item[int(step)] if step.isdigit() else getattr(item, step) for item in (here, there))
        except (AttributeError, IndexError, KeyError, TypeError, ValueError):
            return False
    return bool(np.array_equal(here, there))


def sources_after(sources: Mapping[str, str], changed: set[str]) -> dict[str, str]:
    """Sources of a mechanism some of whose parts have been replaced: a citation must not vouch for other numbers."""
    marked = {}
    for key, text in sources.items():
        part = re.split(r"[.\[]", key)[0]
        if part == "arm" and "arm" in changed:
            continue
        stale = part in changed or (key == "mechanism" and "geometry" in changed)
        marked[key] = f"changed from: {text}" if stale and not text.startswith("changed from: ") else text
    return marked
