"""A wrist whose chain has more than its record can hold."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from ...chain import ClosedChain
from ...design import Limb
from ..shoulder_exo import ShoulderExo
from .chain_exo import ChainExo

if TYPE_CHECKING:
    from ...design import WristGeometry
    from ...wrist_chain import Recognised


class HeavyWrist(ChainExo):
    """A wrist with masses, damping, friction, armatures or springs that its record cannot hold.

    Its kinematics is a wrist's in closed form; forces are those of the chain, with all that it has.

    Attributes
    ----------
    recognised : Recognised
        The wrist, and what its record cannot hold.
    """

    recognised: Recognised

    inverse_kinematics = ShoulderExo.inverse_kinematics
    forward_kinematics = ShoulderExo.forward_kinematics
    forward_kinematics_from_base_angles = ShoulderExo.forward_kinematics_from_base_angles
    joint_motion = ShoulderExo.joint_motion
    nearest_singularity = ShoulderExo.nearest_singularity
    sensor_sensitivity = ShoulderExo.sensor_sensitivity
    jacobian = ShoulderExo.jacobian
    view = ShoulderExo.view  # type: ignore[assignment]

    @classmethod
    def of_recognised(
        cls, chain: ClosedChain, found: Recognised, side: str, urdf: str | PathLike[str] | None
    ) -> HeavyWrist:
        """The chain of a wrist that was recognised."""
        exo = cls.of_robot(chain, side, urdf)
        assert isinstance(exo, HeavyWrist)
        exo.recognised = found
        return exo

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames."""
        return self.recognised.mechanism.geometry

    def limbs_alone(self) -> ShoulderExo:
        """The wrist's geometry and kinds of limbs without any mass: kinematics, no forces."""
        known = self.recognised.mechanism
        return ShoulderExo.from_mechanism(known.replace(arm=None, limbs=[Limb(limb.kind) for limb in known.limbs]))
