"""A kind of device as somebody else would add it."""

from functools import cached_property

from places import URDF

import exo_pin as ep
from exo_pin.device import ChainDevice, DeviceKind, Drive, LinearSpring, Spring


class MotorKind(DeviceKind):
    """Hinges through O, as many of them driven as asked; a spring on one, and a soft cuff."""

    def __init__(self, motors):
        self.motors = motors

    @cached_property
    def _device(self):
        device = ChainDevice.from_chain(ep.ClosedChain.from_urdf(URDF / "serial-y-x-z.urdf"))
        return device.replace(
            drives=[Drive(f"motor {name}", name, lower=-40.0, upper=40.0)
                    for name in ("flexion", "abduction", "internal_rotation")[: self.motors]],
            springs=[Spring("support", LinearSpring(6.0), joint="abduction")],
            interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19)),
            name="motor",
        )  # fmt: skip

    def as_chain(self):
        return self._device
