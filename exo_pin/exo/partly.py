"""Names of the face that only some devices have: on others they are no attribute, and the error says what serves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..core.errors import AbsentAttribute
from ..core.records import OneProcess

#: What only a wrist has, and what serves another device in its place.
INSTEAD = {
    "geometry": "",
    "mechanism": "its record is .device; sweep and compare take any device, and searches change wrists",
    "limbs": "its drives are .device.drives",
    "forward_kinematics": "chain.close and chain.forward_kinematics serve any chain",
    "forward_kinematics_from_base_angles": "",
    "nearest_singularity": "singularity(poses) gives the margin of each pose",
    "sensor_sensitivity": "",
    "track": "its controllers drive limbs of wrists; chain.simulate moves any chain",
    "joint_contact_of_run": "",
}


class Partly(OneProcess):
    """An attribute of a class whose objects have it only where a test holds.

    Where it does not, access raises :class:`exo_pin.core.errors.AbsentAttribute`, so that ``hasattr`` is False.

    Parameters
    ----------
    there : callable
        Whether an object has the attribute.
    member : callable or property
        The method or property.
    owner : callable, optional
        Returns the object to which the member belongs; the object itself if left out.
    """

    _instead = "it is a part of a class"

    def __init__(self, there: Callable[[Any], bool], member: Any, owner: Callable[[Any], Any] | None = None) -> None:
        self._there, self._member, self._owner = there, member, owner
        self.__doc__ = member.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            return self._member
        if not self._there(instance):
            raise AbsentAttribute(self._name, INSTEAD[self._name])
        own = instance if self._owner is None else self._owner(instance)
        return self._member.__get__(own, type(own))
