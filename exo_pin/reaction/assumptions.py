"""What is assumed where equilibrium alone does not determine the forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from inspect import Parameter, signature
from typing import Any, TypedDict, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import echo
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, require_type, set_positive
from ..design import Mechanism
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.case import Posture
from .constraints.given_limits import ConstraintBounds, Limits
from .constraints.glenoid_cone import GlenoidCone, known_orientation
from .elastic import Elastic
from .splits.split import Minimal, Spherical, Split, Standalone


@dataclass(frozen=True)
class Weights:
    """Objective of the split "minimal": a weighted sum of squares of F_s and of the tensions.

        compression (F_s · out)² + shear (|F_s|² - (F_s · out)²) + tension Σ f_i²

    Attributes
    ----------
    shear, compression : float
        Weights of F_s across and along the axis out of the socket, above zero, so that the best F_s is unique.
    tension : float
        Weight of the limb forces, dimensionless, zero or more. Above zero the best f is unique too; 0.01 weighs 1 N of
        shoulder force as 10 N of tension. At zero, of several best sets of forces that of least norm is taken.
    glenoid : GlenoidCone or None
        Defines the axes; only its orientation counts here. Not needed where shear and compression weigh the same.

    Raises
    ------
    InvalidInput
        If a weight is not positive.
    MissingData
        If shear and compression weigh differently and no orientation says which is which.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> case = ep.Case(exo.pose(60, 30))
    >>> kind = [ep.Assumptions("minimal", weights=each) for each in (None, ep.Weights(tension=1.0))]
    >>> plain, weighted = (ep.solve(exo, case, each) for each in kind)
    >>> round(float(weighted.magnitude - plain.magnitude), 1)  # N more, so that the tensions are smaller
    10.1
    """

    shear: float = 1.0
    compression: float = 1.0
    tension: float = 0.0
    glenoid: GlenoidCone | None = None

    def __post_init__(self) -> None:
        set_positive(self, "shear", "compression")
        set_positive(self, "tension", zero=True)
        require_type("glenoid", self.glenoid, GlenoidCone | None)
        if self.shear != self.compression:
            known_orientation((self.glenoid or GlenoidCone()).orientation)

    def root(self, side: str, pose: Rotation) -> FloatArray:
        """Shape (3, 3): its product with F_s, squared, is the cost of F_s in a single pose of the arm.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.
        pose : Rotation
            Single.

        Returns
        -------
        ndarray
            Shape (3, 3).

        Examples
        --------
        >>> root = ep.Weights(shear=4.0, compression=4.0).root("left", ep.shoulder_rotation(30, 0, 0, degrees=True))
        >>> float(np.sum((root @ [3.0, 0.0, 4.0]) ** 2))  # 4 × 5²
        100.0
        """
        axes = np.eye(3) if self.shear == self.compression else (self.glenoid or GlenoidCone()).axes(side, pose)
        return np.asarray(np.sqrt([self.compression, self.shear, self.shear])[:, None] * axes)


#: Splits that come with the package, by name. The first is the default.
SPLITS: dict[str, Split] = {
    split.name: split for split in (Spherical(), Minimal(), Elastic(), Elastic("locked"), Standalone())
}

# Only arguments that are given by name alone can be declared once: a ParamSpec takes no further ones by name (PEP 612),
# and a TypedDict has none by position (PEP 692). So the positional ones stand in each signature.
_Function = TypeVar("_Function", bound=Callable[..., Any])


class Within(TypedDict, total=False):
    """Arguments of :meth:`exo_pin.ShoulderExo.reaction` that are given by name alone."""

    limits: Limits
    cone: GlenoidCone | None
    weights: Weights | None


class Question(Within, total=False):
    """Arguments of :meth:`exo_pin.ShoulderExo.reaction` after the poses, for functions that hand them on by name."""

    motion: Motion | None
    load: Load | None
    split: str | Split
    constraint_bounds: ConstraintBounds
    centre_offset: CentreOffset | CentrePath | ArrayLike | None
    posture: Posture


@dataclass(frozen=True, eq=False)
class Assumptions(Record):
    """How undetermined forces are chosen, and within which limits; checked once.

    Attributes
    ----------
    split : str or Split
        How undetermined forces are divided between shoulder and limbs, see :meth:`exo_pin.ShoulderExo.reaction`.
    limits : "design", "none", "pull", number, (lower, upper), or actuators
        Limits of the limbs.
    constraint_bounds : None, "actuator", number or (lower, upper)
        Bounds on the side forces g of the split "minimal", N.
    cone : GlenoidCone or None
        Keeps F_s in the socket.
    weights : Weights or None
        Objective of the split "minimal".

    Raises
    ------
    InvalidInput
        If the split does not support an option, or an option is of the wrong type; UnknownName is its child.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> case = ep.Case(exo.pose(20, 30))
    >>> for split in ("spherical", "minimal"):
    ...     print(split, round(float(ep.solve(exo, case, ep.Assumptions(split, "none")).magnitude), 2), "N")
    spherical 16.69 N
    minimal 0.0 N
    """

    split: str | Split = "spherical"
    limits: Limits = "design"
    constraint_bounds: ConstraintBounds = None
    cone: GlenoidCone | None = None
    weights: Weights | None = None

    def __post_init__(self) -> None:
        law = self.law
        for name, kind in (("constraint_bounds", None), ("cone", GlenoidCone), ("weights", Weights)):
            value = getattr(self, name)
            if value is None:
                continue
            _check_option(law, name)
            if kind is not None:
                require_type(name, value, kind)

    @cached_property
    def law(self) -> Split:
        """The split itself."""
        return as_split(self.split)


def spelled_out(function: _Function) -> _Function:
    """Show the arguments of :class:`Within` one by one in a function's signature, with their defaults."""
    own = signature(function)
    kept = [each for each in own.parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
    each_field = ((item, Within.__annotations__.get(item.name)) for item in fields(Assumptions))
    more = [
        Parameter(item.name, Parameter.KEYWORD_ONLY, default=item.default, annotation=item.type)
        for item, declared in each_field
        if declared is not None
    ]
    function.__signature__ = own.replace(parameters=[*kept, *more])  # type: ignore[attr-defined]
    return function


def as_split(split: str | Split) -> Split:
    """The split with a name; an instance of a class of the user is returned as it is.

    Raises
    ------
    InvalidInput
        If there is no split of that name, or an instance has no name of its own or no assumption in words.
    """
    if not isinstance(split, Split):
        if isinstance(split, type) and issubclass(split, Split):
            raise InvalidInput(f"expected split as a name or an instance, got the class {split.__name__}")
        return SPLITS[as_choice("split", split, SPLITS)]
    for what in ("name", "assumption"):
        if not (isinstance(text := getattr(split, what, None), str) and text):
            raise InvalidInput(f"expected {type(split).__name__}.{what} to be words, got {echo(text)}")
    if type(SPLITS.get(split.name, split)) is not type(split):
        raise InvalidInput(f"split {split.name!r} is another one than {type(split).__name__}: choose a name of its own")
    if split.moves and not isinstance(split, Elastic):
        raise InvalidInput(f"split {split.name!r} moves: expected a child of Elastic, which displaces the device")
    return split


def _check_option(split: Split, option: str) -> None:
    """Raise for an option that a split does not support, with the reason or the splits that do."""
    if option in split.options:
        return
    if option in split.refusals:
        raise InvalidInput(split.refusals[option])
    names = [f'split="{other.name}"' for other in SPLITS.values() if option in other.options]
    raise InvalidInput(f"{option} belong to {' or '.join(names)}, got split={split.name!r}")


def comparable_splits(mechanism: Mechanism) -> list[str]:
    """Splits that fit a design and need no stiffness."""
    return [name for name, law in SPLITS.items() if not law.determines_sides and _fits(name, mechanism)]


def _fits(name: str, mechanism: Mechanism) -> bool:
    try:
        SPLITS[name].check(mechanism)
    except ExoPinError:
        return False
    return True
