"""Closures written the other way round: with their frames turned in themselves, or their ends exchanged."""

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.chain import Closure, Placement

#: Swaps x and y, and turns z around: the frames of a universal closure with its bodies exchanged.
SWAP = np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])


def turned(placement, quaternion):
    """The placement with its frame turned in itself by a unit quaternion (x, y, z, w)."""
    turn = Rotation.from_quat(placement.quaternion) * Rotation.from_quat(np.array(quaternion))
    return Placement(placement.translation, tuple(turn.as_quat().tolist()))


def exchanged(closure):
    """The same closure with a and b exchanged: the same motion, with rows in the axes of the other body."""
    if closure.polynomial is not None:
        constant, slope = closure.polynomial
        back = (-constant / slope, 1.0 / slope)
        ends = closure.frame_b, closure.frame_a
        return Closure(closure.name, closure.type, *ends, polynomial=back, references=closure.references[::-1])
    a, b = closure.placement_a, closure.placement_b
    if closure.kind.angular == "cross":
        a, b = turned(a, SWAP), turned(b, SWAP)
    return Closure(closure.name, closure.type, closure.frame_b, closure.frame_a, b, a, closure.axis, closure.distance)
