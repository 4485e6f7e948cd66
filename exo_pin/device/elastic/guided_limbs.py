"""The limbs of a device with a guide, or without one, where the chain has them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..device_record import DeviceRecord, soft_bodies
from ..parts.guided_slides import GuidedSlide

#: What the names of the joints of a guide, and of a limb that may twist, end in.
OF_GUIDE, OF_TWIST = "_guide", "_twist"
#: Sine of the angle between a slide and the line of its limb's joints that is rounding.
_ALONG = 1e-6


class GuidedLimb(NamedTuple):
    """A limb between two joints.

    Attributes
    ----------
    part : GuidedSlide
        What resists.
    near, far : ndarray
        The joint that carries the slide in the axes of the slide's placement, and the one that it carries in those of
        the slide's body, shape (3,), m.
    along : ndarray
        Unit vector from one to the other, shape (3,), in both.
    length : float
        Between them where the slide is at zero, m.
    """

    part: GuidedSlide
    near: FloatArray
    far: FloatArray
    along: FloatArray
    length: float

    @property
    def joint(self) -> str:
        """Name of the joint that takes the place of the slide, or follows it."""
        return self.part.slide + (OF_GUIDE if self.part.resists else OF_TWIST)


def guided_limbs(device: DeviceRecord) -> dict[int, GuidedLimb]:
    """Limbs by the index of their slides.

    Raises
    ------
    InvalidInput
        If what is named is no slide between two joints on the line of the slide, or its drive pushes.
    """
    state, found = device.chain._state, dict[int, GuidedLimb]()
    model, springs = state.model, soft_bodies(device)
    for part in device.guided_slides:
        joint, own = state.joint_index(part.slide), f"expected {part.slide!r} to be a slide of a limb"
        if model.joints[joint].nv != 1 or not state.topology.metres[model.joints[joint].idx_v]:
            raise InvalidInput(f"{own}, got {model.joints[joint].shortname()}")
        carried = [k for k in range(1, model.njoints) if model.parents[k] == joint]
        if model.parents[joint] == 0 or len(carried) != 1:
            raise InvalidInput(f"{own} between two joints, got {len(carried)} joints that it carries")
        data = model.joints[joint].createData()
        model.joints[joint].calc(data, np.ones(model.nq))
        axis = np.array(data.M.translation)
        near = model.jointPlacements[joint].inverse().translation
        far = np.array(model.jointPlacements[carried[0]].translation)
        span = far - near
        length = float(np.linalg.norm(span))
        if not np.linalg.norm(np.cross(span, axis)) <= _ALONG * length or span @ axis < 0.0:
            raise InvalidInput(f"{own} that is longer at larger coordinates, along the line of its two joints")
        if joint in found:
            raise InvalidInput(f"expected one guide of {part.slide!r}")
        if joint in springs:
            raise InvalidInput(f"expected a guide or a spring of {springs[joint]!r}, got both")
        if part.resists and any(drive.joint == part.slide and not drive.pulls for drive in device.drives):
            raise InvalidInput(f"expected the drive of {part.slide!r} with pulls=True: that of a limb with a guide")
        if any(spring.joint == part.slide for spring in device.springs):
            raise InvalidInput(f"expected no spring in {part.slide!r}, which has a guide: lay it along a route")
        found[joint] = GuidedLimb(part, near, far, span / length, length)
    return found


def straight(joint: pin.JointModel, q: FloatArray) -> FloatArray:
    """The free flight, shape (7,), that stands for a slide in a configuration of its chain."""
    data = joint.createData()
    joint.calc(data, q)
    return np.array(pin.SE3ToXYZQUAT(data.M))
