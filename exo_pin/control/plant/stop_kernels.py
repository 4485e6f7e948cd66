"""The range of the dummy's shoulder unit (Table 5-6) as elastic stops, compiled.

The unit turns freely about Y; its universal joint allows |θx - c| + |θz| <= h in the Y-X-Z angles. A point outside is
pushed back by a spring and a damper, with the potential k d²/2 of the depth d = |θx - c| + |θz| - h:

    M = -(k d + c_d d') (sign(θx - c) e_x + sign(θz) e_z)

where e_x and e_z are the gradients of the angles, x' = Ry e_x and w, the part of the arm's own z axis across Y
divided by cos² θx. At θx = 90° the unit locks and w is infinite: within 0.6° of it the moment is held at its value
there. Of the two triples of angles of an orientation the one with the smaller depth counts, as for
:meth:`exo_pin.design.shoulder.Shoulder.allows`.
"""

from __future__ import annotations

import math
from typing import Any

from ...core.compiled import kernel
from ...numerics.vectors import dot

__all__ = ["stop_moment"]

#: Least cos² of the angle of the universal joint.
_LOCK = 1e-4


@kernel
def stop_moment(R: Any, w: Any, centre: float, half: float, side: float, stiffness: float, damping: float) -> Any:
    """Moment of the stops on the arm about O in N m, the power that they take in W, and their potential in J.

    ``R`` rows of the rotation matrix, ``w`` angular velocity; ``side`` 1 for the left shoulder, -1 for the right.
    """
    zero = (0.0, 0.0, 0.0)
    abduction = math.asin(min(max(-R[1][2], -1.0), 1.0))
    axial = math.atan2(R[1][0], R[1][1])
    first = abs(side * abduction - centre) + abs(axial)
    turned = axial - math.pi if axial > 0.0 else axial + math.pi
    second = abs(math.pi - side * abduction - centre) + abs(turned)
    # The slope of |θx - c| by the abduction in (-90°, 90°), and of the axial angle.
    by_x = side if side * abduction > centre else -side
    by_z = 1.0 if axial > 0.0 else -1.0
    depth = first - half
    if second < first:
        depth = second - half
        by_x = -side if math.pi - side * abduction > centre else side
        by_z = 1.0 if turned > 0.0 else -1.0
    if depth <= 0.0:
        return zero, 0.0, 0.0
    # θy of the triple with cos θx > 0.
    flexion = math.atan2(R[0][2], R[2][2])
    x_axis = (math.cos(flexion), 0.0, -math.sin(flexion))
    cosine = max(R[1][0] * R[1][0] + R[1][1] * R[1][1], _LOCK)
    z_axis = (R[0][2] / cosine, 0.0, R[2][2] / cosine)
    gradient = (by_x * x_axis[0] + by_z * z_axis[0], 0.0, by_x * x_axis[2] + by_z * z_axis[2])
    rate = dot(gradient, w)
    push = stiffness * depth + damping * rate
    # A stop does not pull.
    push = max(push, 0.0)
    loss = (push - stiffness * depth) * rate
    return (-push * gradient[0], -push * gradient[1], -push * gradient[2]), loss, 0.5 * stiffness * depth * depth
