"""Loop closures as data: their types, frames and placements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_choice, as_finite, as_positive, as_unit_vector, require_type
from .frames import Placement, require_name
from .projection import ANGULAR, LINEAR


@checked
@dataclass(frozen=True)
class ClosureType:
    """A kind of closure, by the rules of its rows on the motion of frame a against frame b.

    The rules say all: residual, Jacobian and drift follow from them, and so does what each format writes. A format that
    cannot say them refuses the closure.

    Attributes
    ----------
    name : str
        As in the file.
    linear, angular : str
        Rules of its rows in metres, which come first, and in radians: keys of
        :data:`exo_pin.chain.structure.projection.LINEAR` and ``ANGULAR``.
    has_axis : bool
        Whether another direction than its frame's z can be stated for z.

    Raises
    ------
    UnknownName
        If there is no such rule.

    Examples
    --------
    >>> from exo_pin.chain import TYPES
    >>> revolute = TYPES["revolute"]
    >>> revolute.linear, revolute.angular, revolute.has_axis  # three rows in metres, two in radians
    ('xyz', 'xy', True)
    """

    name: str
    linear: str
    angular: str
    has_axis: bool = False

    def __post_init__(self) -> None:
        linear = ("",) if self.angular == "joints" else LINEAR
        as_choice(f"linear rule of closure type {self.name!r}", self.linear, linear)
        as_choice(f"angular rule of closure type {self.name!r}", self.angular, ANGULAR)

    @property
    def rules(self) -> tuple[str, str]:
        """Both rules: what tables of the forms of closures go by."""
        return self.linear, self.angular

    @property
    def code(self) -> int:
        """Its kind in the compiled functions."""
        return LINEAR[self.linear] + ANGULAR[self.angular][1]

    @property
    def translations(self) -> int:
        """Number of its rows in metres."""
        return 1 if self.linear == "length" else len(self.linear)

    @property
    def rotations(self) -> int:
        """Number of its rows in radians."""
        return ANGULAR[self.angular][0]

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return self.translations + self.rotations

    @property
    def is_coupling(self) -> bool:
        """Whether it joins positions of joints, and not frames."""
        return self.angular == "joints"


_ALL_TYPES = (
    ClosureType("rigid", "xyz", "xyz"),
    ClosureType("spherical", "xyz", ""),
    ClosureType("revolute", "xyz", "xy", has_axis=True),
    ClosureType("universal", "xyz", "cross"),
    ClosureType("prismatic", "xy", "xyz", has_axis=True),
    ClosureType("cylindrical", "xy", "xy", has_axis=True),
    ClosureType("distance", "length", ""),
    # Its row is in metres where joint b slides.
    ClosureType("coupling", "", "joints"),
)

#: The closure types by name; "point" is another name for "spherical".
TYPES: dict[str, ClosureType] = {kind.name: kind for kind in _ALL_TYPES} | {"point": _ALL_TYPES[1]}

#: Most coefficients of a coupling's polynomial: up to the fourth power, as in MuJoCo.
COEFFICIENTS = 5


@checked
@dataclass(frozen=True)
class Closure:
    """One loop closure between two frames.

    Attributes
    ----------
    name : str
        Unique among the closures.
    type : str
        Name in :data:`TYPES`; an alias is stored under its own name.
    frame_a, frame_b : str
        Frames (links or joints) of the URDF, or "universe". Of a coupling the joints a and b, hinges or slides whose
        coordinate is one number; with "universe" as joint a, joint b is held at a constant position.
    placement_a, placement_b : Placement
        Of the closure's frame in ``frame_a`` and ``frame_b``.
    axis : tuple of float or None
        Direction about (along) which a revolute, prismatic or cylindrical closure turns (slides), in the closure's
        frame, of length 1; by default its z axis. A universal closure turns about the y axis of frame b and the x
        axis of frame a.
    distance : float or None
        Constant distance between the origins of the two frames of a distance closure, m; None for other types.
    polynomial : tuple of float or None
        Coefficients c_0 to c_n, n <= 4, of a coupling, q_b - r_b = Σ c_k (q_a - r_a)^k, m and rad; None for other
        types.
    references : tuple of float
        Positions r_a and r_b of the joints of a coupling, m or rad; zero for other types.

    Raises
    ------
    UnknownName
        If there is no such closure type.
    InvalidInput
        If an axis, a distance or a polynomial is given to a type that has none, or a type that has one lacks it; if
        a coupling has placements, couples a joint with itself, or holds a joint at more than a constant.

    Examples
    --------
    >>> from exo_pin.chain import Closure
    >>> pin = Closure("pin", "revolute", "arm", "universe", axis=(0.0, 1.0, 0.0))
    >>> chain = ep.load("six-cables").chain.with_closure(pin)
    >>> chain.mobility(chain.close(chain.neutral())).degrees_of_freedom  # flexion alone is left
    1
    """

    name: str
    type: str
    frame_a: str
    frame_b: str
    placement_a: Placement = field(default_factory=Placement)
    placement_b: Placement = field(default_factory=Placement)
    axis: tuple[float, float, float] | None = None
    distance: float | None = None
    polynomial: tuple[float, ...] | None = None
    references: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for key in ("name", "type", "frame_a", "frame_b"):
            require_name(f"closure {key}", getattr(self, key))
        where = f"closure {self.name!r}"
        for key in ("placement_a", "placement_b"):
            require_type(f"{key} of {where}", getattr(self, key), Placement)
        as_choice("closure type", self.type, TYPES, where)
        kind = TYPES[self.type]
        object.__setattr__(self, "type", kind.name)
        if self.axis is not None:
            if not kind.has_axis:
                having = ", ".join(name for name, other in TYPES.items() if other.has_axis)
                wrong = f"a {kind.name} closure has no axis, got {self.axis}"
                raise InvalidInput(f"{where}: {wrong}: leave it out, or use a closure of type {having}")
            axis = as_finite(f"axis of {where}", self.axis, (3,))
            if abs(float(np.linalg.norm(axis)) - 1.0) > 1e-12:
                # An axis of length 1 is not normalised again, so that a file loads back bit for bit.
                axis = as_unit_vector(f"axis of {where}", axis)
            object.__setattr__(self, "axis", tuple(axis.tolist()))
        if (self.distance is None) == (kind.linear == "length"):
            raise InvalidInput(
                f"{where}: expected a distance for a closure of constant distance and for no other, "
                f"got {self.distance} for type {kind.name!r}"
            )
        if self.distance is not None:
            object.__setattr__(self, "distance", as_positive(f"distance of {where}", self.distance))
        self._check_coupling(where)

    def _check_coupling(self, where: str) -> None:
        references = as_finite(f"references of {where}", self.references, (2,))
        object.__setattr__(self, "references", tuple(references.tolist()))
        if (self.polynomial is None) == self.kind.is_coupling:
            raise InvalidInput(
                f"{where}: expected a polynomial for a coupling and for no other type, got {self.polynomial} for type "
                f"{self.type!r}"
            )
        if self.polynomial is None:
            if references.any():
                raise InvalidInput(f"{where}: only a coupling has references, got {self.references}: leave them out")
            return
        polynomial = as_finite(f"polynomial of {where}", self.polynomial, (None,))
        if not 1 <= len(polynomial) <= COEFFICIENTS:
            raise InvalidInput(f"{where}: expected 1 to {COEFFICIENTS} coefficients, got {len(polynomial)}")
        object.__setattr__(self, "polynomial", tuple(polynomial.tolist()))
        if self.placement_a != Placement() or self.placement_b != Placement():
            raise InvalidInput(f"{where}: a coupling joins positions of joints and has no placements: leave them out")
        if self.frame_a == self.frame_b:
            raise InvalidInput(f"{where} couples joint {self.frame_a!r} with itself: expected two joints")
        if self.frame_b == "universe":
            raise InvalidInput(f"{where}: expected a joint as joint b, got the world")
        if self.frame_a == "universe" and polynomial[1:].any():
            raise InvalidInput(f"{where}: joint b alone is held at a constant, one coefficient, got {self.polynomial}")

    @property
    def kind(self) -> ClosureType:
        """The record of its type."""
        return TYPES[self.type]

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return self.kind.rows

    def form_in(self, forms: Mapping[tuple[str, str], Any], lack: str) -> Any:
        """Its form in a format or library, of those by rules; ``lack`` says what is missing if it has none.

        Raises
        ------
        InvalidInput
            If there is none.
        """
        if self.kind.rules not in forms:
            known = ", ".join(name for name, kind in TYPES.items() if kind.rules in forms)
            raise InvalidInput(f"{lack} for the {self.type} closure {self.name!r}: expected closures of type {known}")
        return forms[self.kind.rules]
