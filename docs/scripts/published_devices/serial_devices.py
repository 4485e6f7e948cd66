"""Serial devices: three motors in series whose axes meet in the shoulder's centre, from the torso to the cuff.

The angles of the joints are clinical ones: of ``flexion`` about y, ``abduction`` about x, ``internal_rotation`` about
the arm, and the pose of a left arm is Ry(-flexion) Rx(abduction) Rz(-internal) in the order Y-X-Z, see
:func:`exo_pin.core.conventions.shoulder_rotation`; in the order X-Y-Z it is Rx(abduction) Ry(-flexion) Rz(-internal).

* **Masses, centres, inertias**: the three links of NESM, a device with four axes, as its URDF in dojo-sim/Dojo.jl
  (MIT) has them: 6.712, 3.487 and 1.663 kg, of which the last one moves with the arm; the elbow's, 0.494 kg, is left
  out. Its first motor is outside of its axis, its link leads to where the second motor is outside of its own, and so
  on: those directions are kept.
* **Order**: NESM's own, X-Y-Z with the first motor behind the shoulder, and that of the thesis's shoulder angles, Y-X-Z
  with the first motor beside it and the second one behind it, to which NESM's links are given by their places.
* **Travel**: NESM's 0 to 90°, 0 to 90° and -80 to 25° from the arm forward are (Dojo.jl) abduction 0 to 90° (hanging
  is 90° of its first joint), flexion 0 to 90°, and the internal rotation. For Y-X-Z the ranges of Carignan in Table 2-2
  of the thesis: flexion -45 to 180°, abduction -65 to 90°, internal rotation -30 to 210°.
* **Moments**: 92 N m a joint, Carignan and Liszka in Section 2.2.1 of the thesis; NESM's are not known.
"""

from __future__ import annotations

import numpy as np

from exo_pin.chain.formats.urdf.urdf_writing import Body, Picture
from exo_pin.core.validation import FloatArray

from .device_document import CUFF_SHARE, MOTOR, UPPER_ARM, DeviceDocument, DeviceFiles, JointDrive, arc, framework, ring

#: NESM's links: mass, kg; centre, m; inertia about it, kg m²: xx, xy, xz, yy, yz, zz. In the axes of its joints: z
#: along the axis, away from the motor; y to the next motor, or along the arm; of the last link z along the arm.
NESM_LINKS = (
    (6.712, (0.0, 0.1301, -0.1279), (0.3787893, -0.0006556, -0.0006709, 0.192833, 0.0540633, 0.1956839)),
    (3.487, (0.0001, 0.1051, -0.1201), (0.1108677, -0.0000977, 0.0000399, 0.0689688, 0.0384741, 0.0569634)),
    (1.663, (-0.0006, 0.1079, -0.03), (0.0266938, 0.0001282, -0.0000556, 0.007941, 0.0038772, 0.0235228)),
)
#: From the shoulder to the origin of NESM's third joint along the arm, m.
_TO_THIRD = 0.3087
#: Axes by letter: name of the joint, direction of its coordinate seen from the arm, and its motor's side (left arm).
_JOINTS = {
    "y": ("flexion", np.array([0.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0])),
    "x": ("abduction", np.array([-1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])),
}
#: Radii of the links' bars about O, m, assumed: outside of an arm with its cuff.
_OUTER, _INNER = 0.20, 0.17
_DOWN = np.array([0.0, 0.0, -1.0])


def serial_device(order: str) -> DeviceFiles:
    """A serial device in the order of its axes from the torso, "yxz" or "xyz", as XML and closures.

    Notes
    -----
    The rigid device and the shoulder hold the arm's centre twice: three rows are redundant, so equilibrium determines
    the motors' moments and leaves the force between device and shoulder undetermined.
    """
    first, second = order[0], order[1]
    outside = _JOINTS[first][2], _JOINTS[second][2]
    height = -CUFF_SHARE * UPPER_ARM
    # Columns: where the axes x, y, z of NESM's joints are on this device with the arm hanging.
    frames = [_columns(-outside[0], outside[1]), _columns(-outside[1], _DOWN), _columns(_DOWN, outside[1])]
    bodies = [_moved(link, columns) for link, columns in zip(NESM_LINKS, frames, strict=True)]
    last = Body(bodies[2].mass, bodies[2].centre + _TO_THIRD * _DOWN, bodies[2].inertia)
    bars = {
        "link_1": [arc(outside[0], outside[1], _OUTER)],
        "link_2": [_leg(outside[1], height)],
        "cuff": [ring(height)],
    }
    looks = {name: framework("platform", lines)[1] for name, lines in bars.items()}
    device = DeviceDocument(_NAMES[order], _notes(order), (last, looks["cuff"]))
    device.hinge(
        "internal_rotation", "cuff", "link_2", (bodies[1], looks["link_2"] + _motor(outside[1], _INNER)),
        -_DOWN, drive=_DRIVES[order]["internal_rotation"],
    )  # fmt: skip
    for letter, parent, child, part in (
        (second, "link_2", "link_1", (bodies[0], looks["link_1"] + _motor(outside[0], _OUTER))),
        (first, "link_1", "frame", framework("base", [_stand(outside[0])])),
    ):
        name, axis, _ = _JOINTS[letter]
        device.hinge(name, parent, child, part, axis, drive=_DRIVES[order][name])
    device.hold("frame", "rigid", "frame")
    return device.finish()


_NAMES = {"yxz": "serial-y-x-z", "xyz": "nesm"}
_CARIGNAN = {"flexion": (-45.0, 180.0), "abduction": (-65.0, 90.0), "internal_rotation": (-30.0, 210.0)}
_NESM = {"flexion": (0.0, 90.0), "abduction": (0.0, 90.0), "internal_rotation": (-25.0, 80.0)}
_DRIVES = {
    order: {joint: JointDrive(tuple(np.radians(travel).tolist()), effort) for joint, travel in ranges.items()}
    for order, ranges, effort in (("yxz", _CARIGNAN, MOTOR), ("xyz", _NESM, np.inf))
}


def _notes(order: str) -> list[str]:
    own = order == "xyz"
    return [
        "Serial device, axes " + "-".join(order.upper()) + " from the torso through the shoulder's centre.",
        "Masses, centres, inertias: NESM, URDF in dojo-sim/Dojo.jl (MIT)"
        + (", mirrored to the left arm." if own else ", its links by their places in the series."),
        "Travel: "
        + (
            "NESM, Dojo.jl; limits of effort are not known."
            if own
            else "Carignan, thesis Table 2-2. Moments: 92 N m, Carignan and Liszka, thesis Section 2.2.1."
        ),
        "The bars of the pictures, which are not NESM's, and the frame, which does not move, are assumed.",
    ]


def _columns(z: FloatArray, y: FloatArray) -> FloatArray:
    """Axes of a joint of NESM, as columns; its x completes them on a right arm, whose mirror image this is."""
    return np.stack([-np.cross(y, z), y, z], axis=1)


def _moved(link: tuple[float, tuple[float, ...], tuple[float, ...]], columns: FloatArray) -> Body:
    mass, centre, (xx, xy, xz, yy, yz, zz) = link
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Body(mass, columns @ np.array(centre), columns @ inertia @ columns.T)


def _leg(side: FloatArray, height: float) -> FloatArray:
    """From the second motor along the arm to the ring of the cuff, shape (3, 3), m."""
    foot = ring(height)
    nearest = foot[int(np.argmax(foot @ side))]
    return np.stack([_INNER * side, _INNER * side + height * np.array([0.0, 0.0, 1.0]), nearest])


def _motor(side: FloatArray, radius: float) -> list[Picture]:
    """A motor about an axis through O, outside of the bars; its radius and length are assumed."""
    start, end = (tuple((distance * side).tolist()) for distance in (radius, radius + 0.06))
    return [Picture("base_half", 0.04, start, end)]


def _stand(side: FloatArray) -> FloatArray:
    """From the first motor up and back to the harness behind the shoulder, m."""
    top = np.array([0.0, 0.0, 0.22])
    return np.stack([(_OUTER + 0.06) * side, (_OUTER + 0.06) * side + top, np.array([-0.15, -0.10, 0.22])])
