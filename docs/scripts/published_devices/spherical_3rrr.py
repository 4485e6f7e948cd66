"""Spherical 3RRR with right angles, the agile eye: three limbs of three hinges whose axes all meet in O.

Limb i turns about u_i on the torso (the motor), w_i between its two links and v_i on the cuff; u_1, u_2, u_3 are at
right angles, so are v_1, v_2, v_3, and every link spans 90°, so that w_i is across u_i and v_i. So
w_i = ±(u_i × v_i)/|u_i × v_i|: two ways for every limb and eight for the device. Given motor angles belong to four
poses, besides the four, the same for all angles, where every v_i lies along its u_i. The device is singular where a v_i
lies along its u_i, which is one curve of poses for each sign of each limb, and nowhere else. Derived, and found by
Bonev, Chablat and Wenger, "Working and Assembly Modes of the Agile Eye", arXiv 0708.3936; the device is that of
Gosselin, St. Pierre and Gagne, 1996.

* **Arcs**: 90°, as published.
* **Directions** of u_i and v_i, and the sides of the links: found for the thesis's box (flexion 0 to 110°, abduction -4
  to 96°, internal rotation -20 to 85°) among those that keep the least singular value of the unit vectors w_i × v_i and
  the least sine between u_i and v_i above 0.15: the links are clear of the arm, and of boxes for torso and head, in the
  most poses. Rounded to whole degrees. ``benchmarks/device_search.py`` is that search.
* **Assumed**: radii of the links about O, which the kinematics does not depend on; masses of bars. The motors stay on
  the torso; they are as strong as those of ``serial-y-x-z``, 92 N m.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.core.validation import FloatArray

from .device_document import CUFF_SHARE, MOTOR, UPPER_ARM, DeviceDocument, DeviceFiles, JointDrive, arc, framework, ring

#: Turns about x, y, z (intrinsic), degrees, of x, y, z to the motors' axes u_i in the base frame and to the cuff's axes
#: v_i in the arm frame.
BASE_TURN, CUFF_TURN = (-175.0, 19.0, 167.0), (-114.0, 27.0, -46.0)
#: Sides of the motor, of the hinge between the links and of that on the cuff: signs of u_i, w_i and v_i, limb by limb.
SIDES = ((1, 1, -1), (1, -1, -1), (-1, -1, 1))
#: Radii of the outer and the inner links' bars about O, m.
_OUTER, _INNER = 0.22, 0.18


def axes() -> tuple[FloatArray, FloatArray]:
    """Unit vectors u_i in the base frame and v_i in the arm frame as rows, shape (3, 3) each."""
    base, cuff = (Rotation.from_euler("XYZ", turn, degrees=True).as_matrix() for turn in (BASE_TURN, CUFF_TURN))
    return base.T, cuff.T


def agile_eye() -> DeviceFiles:
    """The device as XML and closures.

    Notes
    -----
    Nine of the eighteen rows are redundant with one another and with the ball joint, because all nine hinges and the
    shoulder share one centre: equilibrium determines the motors' moments alone.
    """
    height = -CUFF_SHARE * UPPER_ARM
    u, v = axes()
    sides = np.array(SIDES)
    out_u, out_v = sides[:, :1] * u, sides[:, 2:] * v
    w = np.cross(u, v)
    out_w = sides[:, 1:2] * w / np.linalg.norm(w, axis=1, keepdims=True)
    sleeve = ring(height)
    struts = [np.stack([_INNER * side, _foot(side, height)]) for side in out_v]
    device = DeviceDocument(_NAME, _NOTES, framework("platform", [sleeve, *struts], list(_INNER * out_v)))
    for i in range(3):
        name = f"limb_{i + 1}"
        inner = framework("platform_half", [arc(out_v[i], out_w[i], _INNER)], [_INNER * out_w[i]])
        bridge = np.stack([_INNER * out_w[i], _OUTER * out_w[i]])
        outer = framework("base_half", [bridge, arc(out_w[i], out_u[i], _OUTER)])
        stand = framework("base", [np.stack([_OUTER * out_u[i], (_OUTER + 0.04) * out_u[i]])], [_OUTER * out_u[i]])
        device.hinge(f"{name}_cuff", "cuff", f"{name}_inner", inner, v[i])
        device.hinge(f"{name}_elbow", f"{name}_inner", f"{name}_outer", outer, out_w[i])
        # The outer link turns about u_i by the coordinate, seen from the torso.
        device.hinge(
            f"{name}_motor", f"{name}_outer", f"{name}_base", stand, -u[i], drive=JointDrive((-np.pi, np.pi), MOTOR)
        )
        device.hold(f"{name}_base", "rigid", f"{name}_base")
    return device.finish()


_NAME = "spherical-3rrr"
_NOTES = (
    "Spherical 3RRR with arcs of 90 degrees (agile eye): all hinges meet in the shoulder.",
    "Arcs: Gosselin, St. Pierre, Gagne 1996; Bonev, Chablat, Wenger, arXiv 0708.3936.",
    "Directions of axes and sides of links: found, off the singular curves and clear of the body in the thesis's box.",
    "Radii of the links, masses of bars (13 mm aluminium tube) and joints (50 g) and 92 N m a motor are assumed.",
)


def _foot(side: FloatArray, height: float) -> FloatArray:
    """The place of the cuff's ring that a strut from a hinge leads to."""
    circle = ring(height)
    return np.asarray(circle[int(np.argmax(circle @ side))])
