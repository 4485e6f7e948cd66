"""A passive arm support: one spring strut from the hip to the upper arm, as it was published force by force.

The published device is one of Ottobock's on twelve persons: the force on the arm across and along it at ten elevations
(ami-iit/paper_latella_2021_thms_overhead-exoskeleton-torque, BSD-3, beside Latella 2021, IEEE THMS,
10.1109/THMS.2021.3128892: means; whether measured or the maker's model is not stated). It acts at 0.69 of the upper
arm, and the force at the hip is as large: a strut between two balls.

* **Foot of the strut**: found from the ten forces, whose directions it has to give: straight below the shoulder by
  2.383 times the distance of the upper end from the shoulder. All components are then met within 0.3 N. A foot that is
  free to lie before the shoulder as well would be 0.015 of that distance from there, and meet them no better.
* **Law of the spring**: the sizes of the ten forces over the strut's lengths at their elevations, pushing. Outside of
  the ten elevations the first and the last force are assumed to stay.
* **Not known, assumed**: what lies out of the plane of elevation. With the foot below the shoulder the support is the
  same in every plane. The strut stands for the line of the force, not for the shape of the device, whose parts lie
  behind the arm: it is a spring between two points, without links or mass. The cuff is a ring.
"""

from __future__ import annotations

import numpy as np

from exo_pin.core.validation import FloatArray

from .device_document import UPPER_ARM, DeviceDocument, DeviceFiles, framework, ring

#: Elevations, degrees, and the force on the arm there, N: across it (raising) and along it (away from the shoulder).
ELEVATIONS = tuple(float(angle) for angle in range(10, 101, 10))
ACROSS = (0.3, 2.8, 7.1, 12.5, 18.0, 23.2, 27.8, 31.4, 33.6, 35.7)
ALONG = (-0.8, -4.0, -6.2, -6.6, -5.2, -2.1, 2.3, 7.9, 14.2, 21.1)
#: Upper end of the strut as a fraction of the upper arm; depth of its foot under the shoulder over that distance.
ARM_SHARE, FOOT_RATIO = 0.69, 2.383
_AT = ARM_SHARE * UPPER_ARM
_FOOT = FOOT_RATIO * _AT
#: Beyond the lengths that the strut can have, m, so that rounding does not end the table.
_MARGIN = 0.01


def strut_length(elevation: FloatArray) -> FloatArray:
    """Length of the strut at elevations of the arm in any plane, rad, m."""
    return np.sqrt(_AT**2 + _FOOT**2 - 2.0 * _AT * _FOOT * np.cos(elevation))


def spring_support() -> DeviceFiles:
    """The device's files; it has no drive, so the wearer makes the moments that the spring does not."""
    device = DeviceDocument("spring-support", _NOTES, framework("platform", [ring(-_AT)]), -_AT)
    lengths = strut_length(np.radians([0.0, *ELEVATIONS, 180.0])) + np.array(
        [-_MARGIN, *[0.0] * len(ELEVATIONS), _MARGIN]
    )
    pushes = np.hypot(ACROSS, ALONG)
    strut = {
        "name": "strut",
        "law": "table",
        "coordinates_m": np.round(lengths, 9).tolist(),
        "forces_N": np.round([-pushes[0], *-pushes, -pushes[-1]], 9).tolist(),
        "points": [
            {"link": "universe", "point_m": [0.0, 0.0, round(-_FOOT, 9)]},
            {"link": "cuff_middle", "point_m": [0.0, 0.0, 0.0]},
        ],
    }
    return device.finish({"springs": [strut]})


_NOTES = (
    "Passive arm support: one spring strut from the hip to the upper arm; the law of its spring is in its device file.",
    "Forces at ten elevations: ami-iit/paper_latella_2021_thms_overhead-exoskeleton-torque (BSD-3), with Latella 2021,",
    "IEEE THMS, 10.1109/THMS.2021.3128892. Foot of the strut: found from the directions of these forces.",
    "Forces outside of 10 to 100 degrees, all out of the plane of elevation and the cuff's mass are assumed.",
)
