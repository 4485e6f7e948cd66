"""Names of the face that only some devices have: on others they are no attribute, and the error says what serves.

What only a wrist of limbs between torso and arm has: joint centres, closed-form kinematics, singular surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.errors import AbsentAttribute
from ..core.errors.checked import checked
from ..core.records import OneProcess, Record
from ..design import Limb, Mechanism, WristGeometry

#: What only a wrist has, and what serves another device in its place.
INSTEAD = {
    "geometry": "",
    "mechanism": "its record is .device; sweep and compare take any device, and searches change wrists",
    "limbs": "its drives are .device.drives",
    "forward_kinematics": "chain.close and chain.forward_kinematics serve any chain",
    "forward_kinematics_from_base_angles": "",
    "nearest_singularity": "singularity(poses) gives the margin of each pose",
}


def has_record(exo: Any) -> bool:
    """Whether it is a wrist whose record holds all of it, so that the closed forms give its forces."""
    return exo.wrist is not None and exo.has_arm and not exo.wrist.beyond_record


class Partly(OneProcess):
    """An attribute of :class:`Wrist` as one of the face, which only wrists have.

    Elsewhere access raises :class:`exo_pin.core.errors.AbsentAttribute`, so that ``hasattr`` is False.

    Parameters
    ----------
    member : callable or property
        The method or property.
    of_record : bool
        Whether only wrists have it whose record holds all of them.
    """

    _instead = "it is a part of a class"

    def __init__(self, member: Any, of_record: bool = False) -> None:
        self._member, self._of_record = member, of_record
        self.__doc__ = member.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            return self._member
        if instance.wrist is None or (self._of_record and not has_record(instance)):
            raise AbsentAttribute(self._name, INSTEAD[self._name])
        return self._member.__get__(instance.wrist, Wrist)


@checked
@dataclass(frozen=True, eq=False)
class Wrist(Record):
    """The wrist of a device: present for every wrist geometry, also where a chain gives the forces.

    Attributes
    ----------
    geometry : WristGeometry
        Joint centres and frames.
    record : Mechanism
        Geometry and kinds of limbs; its masses are those of the device only where ``beyond_record`` is empty.
    beyond_record : str
        What the device has that a wrist's record cannot hold, such as masses of crosses, in words; empty if nothing.
    """

    record: Mechanism
    beyond_record: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The frozen record of the design."""
        return self.record

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """The limbs."""
        return self.record.limbs

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames."""
        return self.record.geometry

    @property
    def is_upu(self) -> NDArray[np.bool_]:
        """Shape (n,), bool: which limbs have universal joints at both ends."""
        return self.record.is_upu

    def limbs_alone(self) -> Mechanism:
        """Geometry and kinds of limbs without any mass: kinematics, no forces."""
        return self.record.replace(arm=None, limbs=[Limb(limb.kind) for limb in self.record.limbs])

    def forward_kinematics(
        self, lengths: ArrayLike, near: Rotation | None = None, tolerance: float = 1e-9
    ) -> wrist.AssemblyModes:
        """All poses with given limb lengths, m; see :func:`exo_pin.wrist.forward_kinematics`.

        Parameters
        ----------
        lengths : array_like
            l_i, shape (..., n), m.
        near : Rotation, optional
            Broadcasts to (...): a pose that is known to be close, to select a mode.
        tolerance : float
            Only for more than three limbs: poses whose lengths deviate by more, m, do not count.

        Returns
        -------
        AssemblyModes

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> pose = exo.pose(30, 20, 10)
        >>> modes = exo.forward_kinematics(exo.inverse_kinematics(pose).lengths, near=pose)
        >>> found = modes.rotations[int(modes.nearest)]
        >>> int(modes.count), bool((found * pose.inv()).magnitude() < 1e-9)
        (4, True)
        """
        return wrist.forward_kinematics(self.geometry, lengths, near, tolerance)

    def forward_kinematics_from_base_angles(
        self,
        theta_x: ArrayLike | None = None,
        theta_y: ArrayLike | None = None,
        near: Rotation | None = None,
        tolerance: float = 1e-9,
    ) -> wrist.AssemblyModes:
        """All poses with given angles of the base joints, rad.

        Both angles, θ_x alone or θ_y alone; see :func:`exo_pin.wrist.forward_kinematics_from_base_angles`.

        Parameters
        ----------
        theta_x, theta_y : array_like, optional
            Shape (..., n), rad, as in (4-25); at least one of them.
        near : Rotation, optional
            Broadcasts to (...): a pose that is known to be close, to select a mode.
        tolerance : float
            Only for more than three limbs and one angle of each: poses whose residual exceeds this, rad, do not count.

        Returns
        -------
        AssemblyModes

        Examples
        --------
        >>> exo = ep.load("scenario-one")
        >>> state = exo.inverse_kinematics(exo.pose(20, 10))
        >>> modes = exo.forward_kinematics_from_base_angles(state.base_theta_x, state.base_theta_y)
        >>> int(modes.count)  # six angles leave one pose
        1
        """
        return wrist.forward_kinematics_from_base_angles(self.geometry, theta_x, theta_y, near, tolerance)

    def nearest_singularity(self, poses: Rotation) -> wrist.NearestSingularity:
        """The closest singular pose and its angle; see :func:`exo_pin.wrist.nearest_singularity`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        NearestSingularity

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> round(float(np.degrees(exo.nearest_singularity(exo.pose()).distance)), 2)  # degrees from rest
        5.46
        """
        return wrist.nearest_singularity(self.geometry, poses)
