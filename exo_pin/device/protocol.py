"""What a question asks of a device, whatever its kind is.

A kind is one class with these names. :class:`.ChainDevice` is any closed chain with an arm; :class:`.WristDevice` is a
wrist of limbs, whose closed forms answer faster. Another kind describes itself as a chain (:meth:`Device.as_chain`) and
hands the rest on to it, as :class:`.DeviceKind` does.

    M_f f + M_b b + M_g g + M_w w = m     drives f, brakes b, forces of the structure g, the wearer's moment w

holds for every motion that the loops of the chain allow; see :mod:`exo_pin.device.equilibrium`.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..chain import ClosedChain
from ..core.validation import FloatArray
from ..design import Arm, Interfaces, Mechanism, Shoulder
from ..design.parameters.names import DesignParameter
from ..wrist.clearance.clearance import BodyShape
from ..wrist.clearance.gaps import Gaps
from .chain_device import ChainDevice

__all__ = ["Device", "DeviceKind"]


@runtime_checkable
class Device(Protocol):
    """A device on an arm, frozen: its data, its form as a chain, and what its kind answers by itself.

    Attributes
    ----------
    name, title, side, hash : str
        Short name, a line of description, side of the body, and SHA-256 of all data.
    arm : Arm or None
        What moves about the shoulder, person and device together.
    gravity : ndarray
        Shape (3,), m/s², base frame.
    shoulder, interfaces : Shoulder, Interfaces
        The ball joint, and stiffness of harness and cuff.
    sources : mapping of str to str
        What each part was taken from.
    estimated : tuple of str
        Keys whose values are estimates.
    chain : ClosedChain
        The device on the arm, loops closed.
    limbs : sequence
        What an answer lists efforts of: drives, then brakes, then the wearer's moments of a device that needs them;
        each with its actuator, stroke and limits.
    drive_units : tuple of (str, str)
        Name and unit of each of these, at every door: of a drive or brake as its file has it, "limb 1" and on of
        limbs.
    has_limbs : bool
        Whether these are the tensions of limbs, which have numbers.
    is_upu : ndarray of bool
        Shape (n,): which forces g the structure can exert without any effort.
    radius : float
        Length by which moments are divided, m.
    driven_moments : int
        Independent moments about O that its drives make in general, 0 to 3.
    holds_alone : bool
        Whether its drives can make every moment about O, away from singular poses.

    Examples
    --------
    >>> from exo_pin.device import Device
    >>> isinstance(ep.load("prototype").device, Device)
    True
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def title(self) -> str: ...  # noqa: D102
    @property
    def side(self) -> str: ...  # noqa: D102
    @property
    def hash(self) -> str: ...  # noqa: D102
    @property
    def arm(self) -> Arm | None: ...  # noqa: D102
    @property
    def gravity(self) -> FloatArray: ...  # noqa: D102
    @property
    def shoulder(self) -> Shoulder: ...  # noqa: D102
    @property
    def interfaces(self) -> Interfaces: ...  # noqa: D102
    @property
    def sources(self) -> Mapping[str, str]: ...  # noqa: D102
    @property
    def estimated(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def doubts(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def chain(self) -> ClosedChain: ...  # noqa: D102
    @property
    def limbs(self) -> Sequence[Any]: ...  # noqa: D102
    @property
    def drives(self) -> Sequence[Any]: ...  # noqa: D102
    @property
    def efforts(self) -> Sequence[Any]: ...  # noqa: D102
    @property
    def springs(self) -> Sequence[Any]: ...  # noqa: D102
    @property
    def limb_count(self) -> int: ...  # noqa: D102
    @property
    def drive_units(self) -> tuple[tuple[str, str], ...]: ...  # noqa: D102
    @property
    def has_limbs(self) -> bool: ...  # noqa: D102
    @property
    def force_words(self) -> tuple[str, str]: ...  # noqa: D102
    @property
    def is_upu(self) -> NDArray[np.bool_]: ...  # noqa: D102
    @property
    def radius(self) -> float: ...  # noqa: D102
    @property
    def driven_moments(self) -> int: ...  # noqa: D102
    @property
    def holds_alone(self) -> bool: ...  # noqa: D102
    @property
    def links_mass(self) -> float: ...  # noqa: D102
    @property
    def limbs_are_massless(self) -> bool: ...  # noqa: D102
    @property
    def cuff_is_known(self) -> bool: ...  # noqa: D102
    @property
    def summary(self) -> str: ...  # noqa: D102

    def require_arm(self, needed_for: str, inertia: bool = False) -> Arm:
        """The arm; raises MissingData if there is none, or if its inertia is needed and not known."""

    def moment_of_wearer(self, f: FloatArray) -> FloatArray:
        """Moment of the wearer in the efforts of an answer, shape (N, 3), N m."""

    def gaps(
        self,
        matrices: FloatArray,
        offset: tuple[FloatArray, FloatArray] | None = None,
        placed: Any = None,
        body: BodyShape | None = None,
        radius: float | None = None,
    ) -> Gaps:
        """Gaps to the wearer and between parts in N poses."""

    def replace(self, **changes: Any) -> Self:
        """The device with some data changed."""

    def mirrored(self) -> Self:
        """The mirror image, for the other shoulder."""

    def parameters(self, names: Iterable[Any]) -> tuple[DesignParameter, ...]:
        """Its parameters of these names, which may be changed together; raises for what is none."""

    def value_of(self, named: DesignParameter) -> float | None:
        """Value of a dimension, SI; None where it is not known."""

    def with_values(self, values: Mapping[DesignParameter, Any], payload_at: ArrayLike | None = None) -> Self:
        """The device with other values of its parameters, SI."""

    def dimensions(self) -> dict[str, float]:
        """Values of its dimensions by name, SI."""

    def with_dimensions(self, **values: float) -> Self:
        """The device with other values of its dimensions."""

    def places(self) -> dict[str, FloatArray]:
        """Points that may be elsewhere than they are meant to be, by name, shape (3,), m, each in its own frame."""

    def with_place(self, name: str, point: FloatArray) -> Self:
        """The device with one of these points elsewhere."""

    def stiffened(self, parts: str, more: float) -> Self | None:
        """The device with its "guides" or "links" so many times as stiff; None if all of them are rigid."""

    def as_chain(self) -> ChainDevice:
        """The same device as any closed chain with drives: the general way to every answer."""

    def accelerate(self, question: str) -> Mechanism | None:
        """A wrist's record whose closed forms answer a question in place of the chain; None to take the chain.

        Questions are "forces", "map", "workspace", "contact", "uncertainty", "rates", "check",
        "singularity" and "plant". Without them forces and verdicts are the same.
        """


class DeviceKind:
    """Base of a kind that describes itself as a closed chain: one method, and the chain's device answers the rest.

    A changed device (:meth:`Device.replace`, :meth:`Device.mirrored`, another wearer, other values) is a copy of the
    same class with the changed chain. What else the kind has is as it was, so that a copy has no closed forms; a
    kind whose own data follow a change writes these methods itself.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice, DeviceKind
    >>> class Copy(DeviceKind):
    ...     "The chain of a wrist, asked as a kind of its own."
    ...
    ...     def as_chain(self):
    ...         return ChainDevice.from_chain(ep.load("prototype").chain)
    >>> exo = ep.ShoulderExo.from_device(Copy())
    >>> round(float(exo.reaction(exo.pose(30, 30)).magnitude), 2)  # N
    12.52
    """

    def as_chain(self) -> ChainDevice:
        """The device as a closed chain with drives, the same object at every call.

        Returns
        -------
        ChainDevice

        Examples
        --------
        >>> from exo_pin.device import DeviceKind
        >>> try:
        ...     DeviceKind().as_chain()
        ... except NotImplementedError as error:
        ...     print(error)  # a kind has to say it
        DeviceKind.as_chain
        """
        raise NotImplementedError(f"{type(self).__name__}.as_chain")

    def accelerate(self, question: str) -> Mechanism | None:
        """None: the chain answers.

        Parameters
        ----------
        question : str
            See :meth:`Device.accelerate`.

        Returns
        -------
        Mechanism or None

        Examples
        --------
        >>> from exo_pin.device import DeviceKind
        >>> print(DeviceKind().accelerate("forces"))
        None
        """
        return None

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


def described(device: Device) -> dict[str, Any]:
    """What a document says of a device: name, hash, and the arm that it moves, in SI units, which names end in."""
    arm = device.arm
    wearer = arm and arm.wearer
    body = arm and {
        "mass_kg": arm.mass,
        "centre_of_mass_m": arm.centre_of_mass.tolist(),
        "inertia_kg_m2": None if arm.inertia is None else arm.inertia.tolist(),
        "body_mass_kg": arm.body_mass,
    }
    person = wearer and {
        "height_m": wearer.height,
        "mass_kg": wearer.mass,
        "sex": wearer.sex,
        "elbow_flexion_rad": wearer.elbow_flexion,
        "payload_kg": wearer.payload,
    }
    known = {"name": device.name, "title": device.title, "side": device.side, "sha256": device.hash}
    return {**known, "arm": body, "person": person}


class _OfChain:
    """A name of the protocol that the chain's device answers; no attribute of the class, so no default of a field.

    What a method answers that ``changes`` the device is one of the same class.
    """

    def __init__(self, name: str, changes: bool) -> None:
        self._name, self._changes = name, changes

    def __get__(self, instance: DeviceKind | None, owner: type) -> Any:
        if instance is None:
            raise AttributeError(self._name)
        found = getattr(instance.as_chain(), self._name)
        return partial(_changed, instance, found) if self._changes else found


def _changed(kind: DeviceKind | None, method: Callable[..., ChainDevice | None], *given: Any, **named: Any) -> Any:
    found, other = method(*given, **named), copy.copy(kind)
    if found is None:
        return None
    for name, answer in (("as_chain", found), ("accelerate", None)):
        object.__setattr__(other, name, partial(_constant, answer))
    return other


def _constant(answer: Any, *question: str) -> Any:
    return answer


for _name in vars(Device):
    if not _name.startswith("_") and _name not in vars(DeviceKind):
        _returns = getattr(vars(Device)[_name], "__annotations__", {}).get("return", "")
        setattr(DeviceKind, _name, _OfChain(_name, "Self" in _returns))
