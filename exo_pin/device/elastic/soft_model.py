"""The trees of a device that gives way; see :mod:`exo_pin.device.elastic.soft_equations`."""

from __future__ import annotations

from ...core.validation import FloatArray
from ..chain_device import ChainDevice
from ..device_model import DeviceModel, device_model
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
        added = sorted(set(self.soft.chain.model.names) - set(device.chain.model.names) - set(rigid))
        self.model = DeviceModel(self.soft, held_joints=rigid, soft_joints=tuple(added))
        self.springs = placed_springs(device, self.model)
        held = self.model.held
        self.base, self.cuff = (held.configuration_slice(name) for name in (SHOULDER, CUFF))

    def start(self, q: FloatArray, quaternion: FloatArray) -> FloatArray:
        """The configuration of the rigid device, with no spring displaced, shape (nq,)."""
        state, out = self.model.held, self.model.held.neutral()
        for name in list(self.rigid.held.model.names)[1:]:
            out[state.configuration_slice(name)] = q[self.rigid.held.configuration_slice(name)]
        out[self.model.arm_q] = quaternion
        return out
