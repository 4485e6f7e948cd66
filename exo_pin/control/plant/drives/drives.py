"""The drives of a design."""

from __future__ import annotations

from collections.abc import Callable

from ....core.errors import MissingData
from ....design import Mechanism
from ..options import PlantOptions
from .drive import Drive
from .motor_drive import motor_drive
from .muscle_drive import muscle_drive

__all__ = ["drives_of"]


def drives_of(mechanism: Mechanism, options: PlantOptions) -> tuple[Drive, ...]:
    """The drive of each limb, by the family of its actuator.

    A pneumatic muscle is in line with its limb. A cable is pulled by pneumatic muscles if its actuator has a tackle,
    and by a winch otherwise. The numbers that a design does not have come from the options.

    Raises
    ------
    MissingData
        If an actuator, a force law or limit, a stroke or an end fitting is not known.
    """
    found: list[Drive] = []
    missing: list[str] = []
    for i, limb in enumerate(mechanism.limbs):
        actuator, place = limb.actuator, f"limbs[{i}]"
        with_air = actuator is None or actuator.family == "pneumatic muscle" or actuator.tackle is not None
        made: Callable[..., Drive] = muscle_drive if with_air else motor_drive
        try:
            found.append(made(limb, place, options))
        except MissingData as error:
            missing += error.missing
    if missing:
        raise MissingData(missing, "a plant", mechanism.name)
    return tuple(found)
