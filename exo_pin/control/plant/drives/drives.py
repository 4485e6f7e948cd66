"""The drives of a design."""

from __future__ import annotations

from collections.abc import Callable

from ....core.errors import MissingData
from ....design import Limb, Mechanism, preset, presets
from ..options import PlantOptions
from .drive import Drive
from .motor_drive import motor_drive
from .muscle_drive import muscle_drive


def has_motor(limb: Limb) -> bool:
    """Whether the actuator of a limb is a winch or a linear actuator, by its family; otherwise it has muscles."""
    actuator = limb.actuator
    return actuator is not None and actuator.family != "pneumatic muscle" and actuator.tackle is None


def drives_of(mechanism: Mechanism, options: PlantOptions) -> tuple[Drive, ...]:
    """The drive of each limb, by the family of its actuator.

    A pneumatic muscle is in line with its limb. A cable is pulled by pneumatic muscles if its actuator has a tackle,
    and by a winch otherwise. The numbers that a design does not have come from the options.

    Raises
    ------
    MissingData
        If an actuator, a force law or limit, a stroke or an end fitting is not known.
    """
    found, missing = _made(mechanism, options)
    if missing:
        complete = [name for name in presets() if not _made(preset(name), options)[1]]
        raise MissingData(missing, "a plant", mechanism.name, f"presets with all of it: {', '.join(complete)}")
    return tuple(found)


def _made(mechanism: Mechanism, options: PlantOptions) -> tuple[list[Drive], list[str]]:
    """The drives of the limbs that have one, and what the others lack."""
    found: list[Drive] = []
    missing: list[str] = []
    for i, limb in enumerate(mechanism.limbs):
        made: Callable[..., Drive] = motor_drive if has_motor(limb) else muscle_drive
        try:
            found.append(made(limb, f"limbs[{i}]", options))
        except MissingData as error:
            missing += error.missing
    return found, missing
