"""Springs of a device that gives way: displacements and generalised forces on its tree."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...chain.structure.motion_axes import q_slice, v_slice
from ...core.validation import FloatArray
from ...design import Interface
from ..device_model import DeviceModel
from ..device_record import DeviceRecord
from .guided_limbs import guided_limbs
from .placed_guides import PlacedGuide, placed_guide
from .soft_tree import CUFF, HARNESS, OF_LINK, SHOULDER


class PlacedSpring(NamedTuple):
    """A spring in the trees of a device.

    Attributes
    ----------
    name : str
        Its joint.
    held, own : slice
        Its coordinates in q of the held tree, and in v of the free one.
    stiffness : ndarray
        Shape (6, 6), or (3, 3) of the shoulder.
    at : ndarray
        The point meant, shape (3,), m, in the axes of the body under it.
    """

    name: str
    held: slice
    own: slice
    stiffness: FloatArray
    at: FloatArray

    def displacement(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Displacement and rotation vector at the spring's point, shape (6,), or displacement of the shoulder's, (3,).

        Parameters
        ----------
        q : ndarray
            Configuration of the held tree.
        base, cuff : ndarray
            Offsets of the device's centre, shape (3,), m, which load no spring.
        """
        own, unloaded = q[self.held], {SHOULDER: base, CUFF: cuff}.get(self.name, np.zeros(3))
        if len(own) == 3:
            return np.asarray(own - unloaded)
        turn = pin.skew(own[3:6])
        across = 2.0 * turn @ self._arm(base, cuff)
        # What a small turn moves, without the difference of two long arms, whose rounding a stiff spring makes a force.
        moved = own[6] * across + turn @ across
        return np.concatenate([own[:3] - unloaded + moved, pin.log3(pin.Quaternion(own[3:]))])

    def load(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Generalised force on its joint in the free tree, shape (6,) or (3,); see :meth:`displacement`."""
        moved = self.displacement(q, base, cuff)
        wrench = -self.stiffness @ moved
        if len(moved) == 3:
            return np.asarray(wrench)
        R = pin.Quaternion(q[self.held][3:]).matrix()
        # The energy depends on the rotation vector, whose rate is the inverse of the left Jacobian times the turn's.
        lever = R @ self._arm(base, cuff)
        about = pin.Jlog3(R) @ wrench[3:] + pin.skew(lever) @ wrench[:3]
        return np.concatenate([R.T @ wrench[:3], R.T @ about])

    def along_motion(self, q: FloatArray) -> FloatArray:
        """Motions of its joint that strain no spring: none, shape (6, 0) or (3, 0)."""
        return np.zeros((self.own.stop - self.own.start, 0))

    def _arm(self, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """From the spring's joint, which is in the device's centre, to the point that is meant."""
        return np.asarray(self.at - {HARNESS: base, CUFF: cuff}.get(self.name, np.zeros(3)))


def placed_springs(device: DeviceRecord, model: DeviceModel) -> list[PlacedSpring | PlacedGuide]:
    """Springs of shoulder, harness, cuff and links, and guides, in this order; of those that are not rigid."""
    held, free = model.held.model, model.free.model
    parts: dict[str, Interface | None] = {HARNESS: device.interfaces.harness, CUFF: device.interfaces.cuff}
    parts |= {soft.link + OF_LINK: soft.spring for soft in device.soft_links}
    known = {name: (np.array(part.stiffness), np.array(part.at)) for name, part in parts.items() if part is not None}
    if device.shoulder.stiffness is not None:
        known = {SHOULDER: (np.array(device.shoulder.stiffness), np.zeros(3))} | known
    guides = [placed_guide(held, free, limb) for limb in guided_limbs(device).values() if limb.part.resists]
    springs = [
        PlacedSpring(name, q_slice(held, held.getJointId(name)), v_slice(free, free.getJointId(name)), *own)
        for name, own in known.items()
    ]
    return [*springs, *guides]
