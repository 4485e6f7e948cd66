"""The trees of a device that gives way; see :mod:`exo_pin.device.elastic.soft_equations`."""

from __future__ import annotations

from ...core.validation import FloatArray
from ..chain_device import ChainDevice
from ..device_model import DeviceModel, device_model
from .guided_limbs import guided_limbs, straight
from .soft_tree import CUFF, SHOULDER, soft_device
from .springs import placed_springs


class SoftModel:
    """The trees of a device that gives way.

    Parameters
    ----------
    device : ChainDevice
        The device.
    """

    def __init__(self, device: ChainDevice) -> None:
        self.device, self.rigid = device, device_model(device)
        self.soft = soft_device(device)
        rigid = (SHOULDER,) * (device.shoulder.stiffness is None) + (CUFF,) * (device.interfaces.cuff is None)
        limbs = guided_limbs(device)
        free = [limb.joint for limb in limbs.values() if not limb.part.resists]
        added = sorted(set(self.soft.chain.model.names) - set(device.chain.model.names) - {*rigid, *free})
        self._guides = {limb.part.slide: limb.joint for limb in limbs.values() if limb.part.resists}
        self.model = DeviceModel(self.soft, held_joints=rigid, soft_joints=tuple(added))
        self.springs = placed_springs(device, self.model)
        held = self.model.held
        self.base, self.cuff = (held.configuration_slice(name) for name in (SHOULDER, CUFF))

    def start(self, q: FloatArray, quaternion: FloatArray) -> FloatArray:
        """The configuration of the rigid device, with no spring displaced, shape (nq,)."""
        state, out = self.model.held, self.model.held.neutral()
        given = self.rigid.held
        for name in list(given.model.names)[1:]:
            own = q[given.configuration_slice(name)]
            if name in self._guides:
                own = straight(given.model.joints[given.joint_index(name)], q)
            out[state.configuration_slice(self._guides.get(name, name))] = own
        out[self.model.arm_q] = quaternion
        return out
