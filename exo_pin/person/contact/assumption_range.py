"""How the contact force changes with its assumptions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.results import Result
from ...core.tables import aligned
from ...core.validation import FloatArray, as_choice, as_finite, require_type, set_fields
from ...design.wearer import Wearer
from ...reaction.constraints.glenoid_cone import GlenoidCone
from .result import WITHOUT_MUSCLES, JointContact

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ...load_case import CentreOffset, CentrePath, Load, Motion
    from ...load_case.case import Posture
    from ...reaction import Limits, Reaction
    from ..wearer import Person
    from .device import DeviceAction


@checked
@dataclass(frozen=True, eq=False)
class ContactOptions(Record):
    """Assumptions of a contact query.

    Attributes
    ----------
    power : int
        p of the effort Σ w a^p: 2 or 3.
    weights : {"equal", "volume"}
        w: 1, or the muscle's volume over the mean one.
    passive : bool
        Whether stretched fibres pull without activation.
    cone : GlenoidCone or None
        Rim that the contact force stays inside; its ratios count, its axes are those of the bone. None: no condition.
    load_on : {"upper arm", "forearm"} or None
        What the load acts on; None: the forearm, so that the elbow carries it, where the force acts beyond the elbow.
    centre_shift : ndarray
        Displacement of the joint's centre against bones and muscles, shape (3,), m, {O_A}.
    socket_turn : float
        Turn of the socket about the vertical against that of the model, rad, positive to face further forward; the
        muscles' paths stay.
    kept_activation : float
        With a device every muscle keeps at least this share of its activation without the device, 0 to 1: people do
        not let go of all that a device carries. Let the device carry the rest (``forces=1 - kept_activation``).

    Examples
    --------
    >>> man = ep.Person(1.75, 75, "male")
    >>> pose = ep.shoulder_rotation(0, 60, 0, degrees=True)
    >>> free = ep.ContactOptions(cone=None)  # the force may leave the socket
    >>> [round(float(man.joint_contact(pose, options=each).percent_body_weight)) for each in (None, free)]
    [66, 63]
    """

    power: int = 2
    weights: str = "equal"
    passive: bool = False
    cone: GlenoidCone | None = GlenoidCone()  # noqa: RUF009 (frozen)
    load_on: str | None = None
    centre_shift: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    socket_turn: float = 0.0
    kept_activation: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.power, int) or self.power not in (2, 3):
            raise InvalidInput(f"expected power to be 2 or 3, got {self.power!r}")
        as_choice("weights", self.weights, ("equal", "volume"))
        if self.load_on is not None:
            as_choice("load_on", self.load_on, ("upper arm", "forearm"))
        shift = as_finite("centre_shift", self.centre_shift, (3,))
        if np.abs(shift).max() > 0.05:
            raise InvalidInput(f"expected centre_shift in m, within 0.05 m, got {shift} (millimetres?)")
        turn = float(as_finite("socket_turn", self.socket_turn, ()))
        if abs(turn) > np.pi / 2:
            raise InvalidInput(f"expected socket_turn in rad, within a right angle, got {turn:g} (degrees?)")
        kept = float(as_finite("kept_activation", self.kept_activation, ()))
        if not 0.0 <= kept <= 1.0:
            raise InvalidInput(f"expected kept_activation as a share of 0 to 1, got {kept:g} (percent?)")
        set_fields(self, centre_shift=shift, socket_turn=turn, kept_activation=kept)
        if self.cone is not None:
            require_type("cone", self.cone, GlenoidCone | None)
            own = self.cone.orientation is not None or self.cone.penalty is not None
            if own or self.cone.muscle_compression != 0.0:
                raise InvalidInput(
                    "expected a cone with ratios only: its axes are those of the person's scapula, and the muscles' "
                    "compression is computed. Leave out orientation, muscle_compression and penalty"
                )

    def described(self, person: Person, moving: bool) -> dict[str, str]:
        """The assumptions in words.

        Parameters
        ----------
        person : Person
            The wearer.
        moving : bool
            Whether the arm moves.

        Returns
        -------
        dict of str to str

        Examples
        --------
        >>> words = ep.ContactOptions().described(ep.Person(1.75, 75, "male"), moving=False)
        >>> sorted(words)[:3]
        ['criterion', 'muscles', 'scapula']
        """
        rim = "none"
        if self.cone is not None:
            rim = f"inside the rim, shear over compression up to {self.cone.superior:g} (superior) and "
            rim += f"{self.cone.anterior:g} (anterior)"
        beyond = "no co-contraction beyond it"
        if self.kept_activation:
            beyond = f"each at least {100.0 * self.kept_activation:.3g} % of that without the device"
        if not person.strength:
            return {
                "muscles": "none (strength 0); something else holds the elbow",
                "socket": f"no condition; {WITHOUT_MUSCLES}",
            }
        return {
            "criterion": f"least sum of {'squared' if self.power == 2 else 'cubed'} activations, {self.weights} "
            f"weights, {beyond}",
            "socket": rim,
            "muscles": f"Saul 2015 on MyoArm's paths, strength x {person.strength_scale:.3g}, lengths x "
            f"{person.length_scale:.3g}, force-length{' and force-velocity' if moving else ''}, "
            f"passive forces {'on' if self.passive else 'off'}",
            "scapula": "follows the elevation rigidly; its own equilibrium is not computed; ligaments carry nothing",
        }


#: Displacement of the joint's centre, m, turn of the socket, rad, and strength of a weak rotator cuff: adults' sockets
#: differ by 10° of version, and women's outward rotators have 56 % of men's strength (96 men, 90 women).
_SHIFT, _TURN, _WEAK_CUFF = 0.005, np.radians(10.0), 0.56
#: Least motion of the scapula, over the model's: a rhythm of 2.7, as measured while arms are lowered (2.3 raised).
_STIFF = 0.7
#: Persons who are drawn for the band.
_PERSONS = 60
_AXES = (("forwards", 0), ("to the left", 1), ("up", 2))


class ContactQuestion(TypedDict, total=False):
    """Arguments of ``joint_contact`` of a person or of a device, for functions that hand them on by name."""

    motion: Motion | None
    load: Load | None
    device: DeviceAction | ArrayLike | None
    gravity: ArrayLike
    forces: Reaction | ArrayLike | str | None
    limits: Limits
    constraint_bounds: float | tuple[ArrayLike, ArrayLike] | None
    centre_offset: CentreOffset | CentrePath | ArrayLike | None
    posture: Posture


@dataclass(frozen=True, eq=False)
class ContactRange(Result):
    """One query under several assumptions.

    Attributes
    ----------
    reference : JointContact
        Under the assumptions that were given.
    variants : dict of str to JointContact
        With one assumption changed each.
    persons : tuple of JointContact
        Of persons drawn at random, who differ in size, rotator cuff, socket and scapular rhythm, each by itself.

    Examples
    --------
    >>> man = ep.Person(1.75, 75, "male")
    >>> found = man.contact_range(ep.shoulder_rotation(0, 45, 0, degrees=True))
    >>> forces = [each.magnitude for each in found.variants.values()]
    >>> bool(min(forces) < found.reference.magnitude < max(forces))
    True
    """

    reference: JointContact
    variants: dict[str, JointContact]
    persons: tuple[JointContact, ...]

    @property
    def _all(self) -> list[JointContact]:
        return [self.reference, *self.variants.values()]

    @property
    def lowest(self) -> FloatArray:
        """Least contact force of all variants that have a result, shape (...), N."""
        return np.asarray(np.fmin.reduce([result.magnitude for result in self._all]))

    @property
    def highest(self) -> FloatArray:
        """Largest contact force of all variants that have a result, shape (...), N."""
        return np.asarray(np.fmax.reduce([result.magnitude for result in self._all]))

    @property
    def band(self) -> tuple[FloatArray, FloatArray]:
        """5th and 95th percentile of the contact force over the persons, shape (...) each, percent of body weight.

        Over those who have a result; NaN where none has.
        """
        shares = np.stack([np.asarray(result.percent_body_weight) for result in self.persons])
        known = np.isfinite(shares).any(axis=0)
        low, high = np.nanpercentile(np.where(known, shares, 0.0), [5.0, 95.0], axis=0)
        return np.where(known, low, np.nan), np.where(known, high, np.nan)

    @property
    def relief_percent(self) -> tuple[FloatArray, FloatArray] | None:
        """Least and largest relief by the device, percent, shape (...) each; None without a device."""
        reliefs = [relief for result in self._all if (relief := result.relief_percent) is not None]
        return (np.asarray(np.fmin.reduce(reliefs)), np.asarray(np.fmax.reduce(reliefs))) if reliefs else None

    def __str__(self) -> str:
        columns = {"N": "magnitude", "% BW": "percent_body_weight"}
        columns |= {"relief %": "relief_percent"} if self.reference.without_device is not None else {}
        rows = [["", *columns]]
        for name, result in {"as given": self.reference, **self.variants}.items():
            rows.append([name, *(_median(getattr(result, key)) for key in columns.values())])
        lines = aligned(rows, words=1)
        low, high = (_median(side) for side in self.band)
        who = f"{len(self.persons)} persons who differ in size, rotator cuff, socket and scapular rhythm"
        lines.append(f"{who}, nine of ten: {low} to {high} % BW")
        if self.reference.status.ndim:
            lines.append("medians over the poses that have a result")
        return "\n".join(lines)


def _median(values: FloatArray) -> str:
    good = values[np.isfinite(values)]
    return f"{np.median(good):.0f}" if good.size else "-"


def contact_range(
    query: Callable[..., JointContact],
    poses: Rotation,
    person: Person,
    options: ContactOptions | None = None,
    **arguments: Unpack[ContactQuestion],
) -> ContactRange:
    """Repeat a query with one assumption changed at a time.

    Parameters
    ----------
    query : callable
        Gives the contact force: ``query(orientation, person, options=options, **arguments)``.
    poses : Rotation
        Pose of the upper arm, single or a stack of shape (...).
    person : Person
        The wearer.
    options : ContactOptions, optional
        The assumptions to start from.
    **arguments
        More of the query.

    Returns
    -------
    ContactRange
        Criterion, weights, socket and its turn by ± 10°, passive forces, a rotator cuff of 56 %, a scapula that moves
        by 70 %, centre of the joint ± 5 mm along each axis; and the band over sixty persons, who are drawn by
        :meth:`exo_pin.Wearer.drawn` with a rotator cuff of 56 to 100 % and a scapula that moves by 70 to 100 % (even),
        and a socket turned by 0 ± 10° (normal, cut at 20°), independently.
    """
    options = ContactOptions() if options is None else options
    other_power, other_weights = 5 - options.power, "volume" if options.weights == "equal" else "equal"
    changes = {
        f"{'cubed' if other_power == 3 else 'squared'} activations": (person, replace(options, power=other_power)),
        f"{other_weights} weights": (person, replace(options, weights=other_weights)),
        f"passive forces {'off' if options.passive else 'on'}": (person, replace(options, passive=not options.passive)),
    }
    if options.cone is not None:
        changes["no condition on the socket"] = person, replace(options, cone=None)
        for words, turn in (("forward", _TURN), ("backward", -_TURN)):
            turned = replace(options, socket_turn=options.socket_turn + turn)
            changes[f"socket {np.degrees(_TURN):.0f}° {words}"] = person, turned
    weak = replace(person, cuff_strength=person.cuff_strength * _WEAK_CUFF)
    changes[f"rotator cuff of {100.0 * _WEAK_CUFF:.0f} %"] = weak, options
    stiff = replace(person, scapular_motion=person.scapular_motion * _STIFF)
    changes[f"scapula moves by {100.0 * _STIFF:.0f} %"] = stiff, options
    for name, axis in _AXES:
        for sign in (-1.0, 1.0):
            shift = np.array(options.centre_shift, dtype=np.float64)
            shift[axis] += sign * _SHIFT
            moved = replace(options, centre_shift=shift)
            changes[f"centre {1e3 * sign * _SHIFT:+.0f} mm {name}"] = person, moved
    contacts = {name: query(poses, wearer, options=chosen, **arguments) for name, (wearer, chosen) in changes.items()}
    persons = tuple(
        query(poses, other, options=chosen, **arguments) for other, chosen in _drawn(person, options, _PERSONS)
    )
    return ContactRange(query(poses, person, options=options, **arguments), contacts, persons)


def _drawn(person: Person, options: ContactOptions, count: int) -> Iterator[tuple[Person, ContactOptions]]:
    """Persons in the posture of one, and the turns of their sockets."""
    numbers = np.random.default_rng(count)
    for size in Wearer.drawn(count):
        turn = float(np.clip(numbers.standard_normal(), -2.0, 2.0)) * _TURN
        cuff, motion = (float(numbers.uniform(least, 1.0)) for least in (_WEAK_CUFF, _STIFF))
        other = replace(person, height=size.height, mass=size.mass, sex=size.sex)
        other = replace(
            other, cuff_strength=person.cuff_strength * cuff, scapular_motion=person.scapular_motion * motion
        )
        yield other, replace(options, socket_turn=options.socket_turn + turn)
