"""Assumptions of a contact query."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, as_finite, set_fields
from ...reaction.constraints.glenoid_cone import GlenoidCone

if TYPE_CHECKING:
    from ..wearer import Person


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
    load_on : {"upper arm", "forearm"}
        What the load acts on.
    centre_shift : ndarray
        Displacement of the joint's centre against bones and muscles, shape (3,), m, {O_A}.
    socket_turn : float
        Turn of the socket about the vertical against that of the model, rad, positive to face further forward; the
        muscles' paths stay.

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
    load_on: str = "upper arm"
    centre_shift: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    socket_turn: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.power, int) or self.power not in (2, 3):
            raise InvalidInput(f"expected power to be 2 or 3, got {self.power!r}")
        as_choice("weights", self.weights, ("equal", "volume"))
        as_choice("load_on", self.load_on, ("upper arm", "forearm"))
        if not isinstance(self.passive, bool):
            raise InvalidInput(f"expected passive to be True or False, got {self.passive!r}")
        shift = as_finite("centre_shift", self.centre_shift, (3,))
        if np.abs(shift).max() > 0.05:
            raise InvalidInput(f"expected centre_shift in m, within 0.05 m, got {shift} (millimetres?)")
        turn = float(as_finite("socket_turn", self.socket_turn, ()))
        if abs(turn) > np.pi / 2:
            raise InvalidInput(f"expected socket_turn in rad, within a right angle, got {turn:g} (degrees?)")
        set_fields(self, centre_shift=shift, socket_turn=turn)
        if self.cone is not None:
            if not isinstance(self.cone, GlenoidCone):
                raise InvalidInput(f"expected cone to be a GlenoidCone or None, got {type(self.cone).__name__}")
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
        return {
            "criterion": f"least sum of {'squared' if self.power == 2 else 'cubed'} activations, {self.weights} "
            "weights, no co-contraction beyond it",
            "socket": rim,
            "muscles": f"Saul 2015 on MyoArm's paths, strength x {person.strength_scale:.3g}, lengths x "
            f"{person.length_scale:.3g}, force-length{' and force-velocity' if moving else ''}, "
            f"passive forces {'on' if self.passive else 'off'}",
            "scapula": "follows the elevation rigidly; its own equilibrium is not computed; ligaments carry nothing",
        }
