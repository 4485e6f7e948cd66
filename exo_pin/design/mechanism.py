"""A design: geometry, limbs, arm and shoulder in one frozen record."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.conventions import GRAVITY, MIRROR, Side, as_side
from ..core.errors import InvalidInput, MissingData
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.fields import set_fields
from ..core.records import Record
from ..core.tables import limb_list
from ..core.validation import FloatArray, as_choice, as_finite, frozen, require_type
from .arm import Arm
from .geometry import WristGeometry
from .interface import Interfaces
from .limb import Limb
from .shoulder import Shoulder

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
    interfaces : Interfaces
        What sits between device and person, harness and cuff; rigid if left out. They give way in the split "elastic".
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

    def __post_init__(self) -> None:
        require_type("geometry", self.geometry, WristGeometry)
        require_type("arm", self.arm, Arm | None)
        require_type("shoulder", self.shoulder, Shoulder)
        require_type("interfaces", self.interfaces, Interfaces)
        gravity = as_finite("gravity", self.gravity, (3,))
        if np.linalg.norm(gravity) > 100.0:
            raise InvalidInput(f"expected gravity in m/s², got {gravity} (mm/s²?)")
        limbs = _limbs(self.limbs, self.geometry.limb_count)
        set_fields(self, limbs=limbs, gravity=gravity, side=as_side(self.side))
        circles = self.geometry.circles
        if circles is not None and circles.side != self.side:
            raise InvalidInput(
                f"this geometry is laid out for the {circles.side} shoulder, not the {self.side}: use mirrored()"
            )
        self._check_texts()

    def _check_texts(self) -> None:
        for name in ("name", "title"):
            if not isinstance(getattr(self, name), str):
                raise InvalidInput(f"expected {name} to be a string, got {echo(getattr(self, name))}")
        if not isinstance(self.sources, Mapping) or not all(
            isinstance(text, str) for pair in self.sources.items() for text in pair
        ):
            raise InvalidInput(f"expected sources to map strings to strings, got {echo(self.sources)}")
        if not isinstance(self.estimated, (tuple, list)) or not all(isinstance(key, str) for key in self.estimated):
            raise InvalidInput(f"expected estimated to be a list of strings, got {echo(self.estimated)}")
        set_fields(self, sources=MappingProxyType(dict(self.sources)), estimated=tuple(self.estimated))

    @property
    def limb_count(self) -> int:
        """Number of limbs n."""
        return len(self.limbs)

    @cached_property
    def radius(self) -> float:
        """Largest |B_i|, m, by which moments are divided."""
        return self.geometry.platform_radius

    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]:
        """Empty: limbs have numbers, and tensions in N."""
        return ()

    @property
    def force_words(self) -> tuple[str, str]:
        """What f and g are."""
        return "limb forces f", "side forces g"

    def limb_words(self, numbers: Sequence[int]) -> str:
        """Limbs of these numbers, counted from 1, in words: "limbs 1 and 3"."""
        return limb_list(numbers)

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

        Raises
        ------
        MissingData
            If there is none, or if its inertia is needed and not known.
        """
        if self.arm is None:
            remedy = "give it an arm, or a person who wears it (--person, worn_by)"
            raise MissingData(["arm mass", "arm centre of mass"], needed_for, self.name, remedy)
        if inertia and self.arm.inertia is None:
            raise MissingData(["arm inertia"], needed_for, self.name)
        return self.arm

    def replace(self, **changes: Any) -> Mechanism:
        """Return a new mechanism with some fields changed.

        With another number of joints ``limbs`` is adapted only if all limbs are alike; otherwise pass
        ``limbs`` too. Sources of changed values are marked "changed from"; those of an arm go with
        the arm.

        Raises
        ------
        UnknownName
            If a name is no field of a mechanism.
        """
        known = {item.name for item in fields(self)}
        for name in changes:
            as_choice("field", name, known)
        geometry = changes.get("geometry", self.geometry)
        grown = isinstance(geometry, WristGeometry) and geometry.limb_count != self.limb_count
        if grown and "limbs" not in changes and len(set(self.limbs)) == 1:
            changes["limbs"] = self.limbs[:1] * geometry.limb_count
        if "sources" not in changes:
            changed = {name for name in _SOURCED if name in changes and changes[name] is not getattr(self, name)}
            changes["sources"] = _sources_after(self.sources, changed)
        if "estimated" not in changes:
            changes["estimated"] = tuple(key for key in self.estimated if _is_same(self, changes, key))
        return replace(self, **changes)

    def mirrored(self) -> Mechanism:
        """The same device on the other shoulder: mirror image in the x-z plane."""
        return replace(
            self,
            geometry=self.geometry.mirrored(),
            arm=None if self.arm is None else self.arm.mirrored(),
            limbs=tuple(limb.mirrored() for limb in self.limbs),
            shoulder=self.shoulder.mirrored(),
            gravity=self.gravity @ MIRROR,
            interfaces=self.interfaces.mirrored(),
            side="right" if self.side == "left" else "left",
        )

    def on_side(self, side: str) -> Mechanism:
        """This mechanism if it is for ``side``, else its mirror image."""
        return self if as_side(side) == self.side else self.mirrored()


def _is_same(mechanism: Mechanism, changes: Mapping[str, Any], key: str) -> bool:
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


def _limbs(limbs: Sequence[Limb] | None, count: int) -> tuple[Limb, ...]:
    if limbs is None or (isinstance(limbs, Sequence) and len(limbs) == 0):
        return (Limb(),) * count
    if not isinstance(limbs, Sequence):
        raise InvalidInput(f"expected limbs to be a sequence of Limb records, got {type(limbs).__name__}")
    for limb in limbs:
        if not isinstance(limb, Limb):
            raise InvalidInput(f"expected limbs to be Limb records, got {type(limb).__name__}")
    if len(limbs) != count:
        raise InvalidInput(f"expected {count} limbs, one per joint pair of the geometry, got {len(limbs)}")
    return tuple(limbs)


def _sources_after(sources: Mapping[str, str], changed: set[str]) -> dict[str, str]:
    """Sources of a mechanism some of whose parts have been replaced: a citation must not vouch for other numbers."""
    marked = {}
    for key, text in sources.items():
        part = re.split(r"[.\[]", key)[0]
        if part == "arm" and "arm" in changed:
            continue
        stale = part in changed or (key == "mechanism" and "geometry" in changed)
        marked[key] = f"changed from: {text}" if stale and not text.startswith("changed from: ") else text
    return marked
