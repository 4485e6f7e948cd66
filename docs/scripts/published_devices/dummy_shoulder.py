"""The shoulder unit of the dummy (thesis, Figure 5-4): a flange bearing about Y, then a universal joint about X and Z.

Intrinsic Y-X-Z, so its angles are those of ``shoulder_rotation`` up to their signs. It locks at 90° of abduction: that
lock is the real unit's.
"""

from __future__ import annotations

import numpy as np

from exo_pin.chain.formats.urdf.urdf_writing import Document, Picture
from exo_pin.chain.structure.description import Closures, Roles, Root
from exo_pin.design import Arm
from exo_pin.wrist_chain import AssumedMasses
from exo_pin.wrist_chain.wrist_urdf import arm_body, arm_visuals

_BELOW = np.array([[0.0, 0.0, -0.2]])


def dummy_shoulder(arm: Arm, assumed: AssumedMasses) -> tuple[str, Closures]:
    """The XML, and root, gravity and roles; there is no loop."""
    notes = [
        "The shoulder unit of the dummy (Figure 5-4): flange bearing about Y, universal joint about X and Z.",
        "Table 5-6: Y turns freely; |theta_x - 90| + |theta_z| below 95 degrees is a diamond, which joint limits",
        "cannot say. The limits here are the box around it: -5 to 185 degrees and -95 to 95 degrees.",
        assumed.statement,
    ]
    document = Document("dummy-shoulder", notes)
    small = assumed.cross_body()
    document.link("torso", None, [Picture("base", 0.06, (0.0, -0.2, -0.4), (0.0, -0.2, 0.05))])
    document.link("shoulder_flange", small, [Picture("base_half", 0.03, (0.0, -0.14, 0.0), (0.0, -0.04, 0.0))])
    document.link("shoulder_cross", small, [Picture("cross", 0.015, (-0.03, 0.0, 0.0), (0.03, 0.0, 0.0))])
    document.link("arm", arm_body(arm, _BELOW, assumed, document), arm_visuals(_BELOW, False))
    zero = np.zeros(3)
    document.joint("shoulder_y", "continuous", "torso", "shoulder_flange", zero, [0, 1, 0])
    box = np.radians([-5.0, 185.0]), np.radians([-95.0, 95.0])
    document.joint("shoulder_x", "revolute", "shoulder_flange", "shoulder_cross", zero, [1, 0, 0], box[0])
    document.joint("shoulder_z", "revolute", "shoulder_cross", "arm", zero, [0, 0, 1], box[1])
    roles = Roles(arm="arm", reference_point="arm")
    return document.text(), Closures("dummy-shoulder", Root("fixed"), (), roles)
