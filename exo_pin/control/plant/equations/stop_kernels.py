"""The range of the dummy's shoulder unit (Table 5-6) as elastic stops, compiled.

The unit turns freely about Y; its universal joint allows |θx - c| + |θz| <= h in the Y-X-Z angles. A point outside is
pushed back by a spring and a damper, with the potential k d²/2 of the depth d = |θx - c| + |θz| - h:

    M = -(k d + c_d d') (∂d/∂θx e_x + ∂d/∂θz e_z)

with the corners of |.| rounded off over 0.01 rad (|.| is smaller there, by at most as much). e_x and e_z are the
gradients of the angles, x' = Ry e_x and w, the part of the arm's own z axis across Y divided by cos² θx. At θx = 90°
the unit locks and w is infinite: within 6° of it the moment is held at its value there. Of the two triples of angles
of an orientation the one with the smaller depth counts, as for :meth:`exo_pin.design.shoulder.Shoulder.allows`.
"""

from __future__ import annotations

import math
from typing import Any

from ....core.compiled import kernel
from ....numerics.vectors import dot

#: Radius by which the corners of the diamond are rounded off, rad: at a sharp one the moment would jump.
_CORNER = 0.01
#: Least cos² of the angle of the universal joint.
_LOCK = 1e-2


@kernel
def _rounded(value: float) -> Any:
    """|value| with its corner rounded off, and its slope."""
    root = math.sqrt(value * value + _CORNER * _CORNER)
    return root - _CORNER, value / root


@kernel
def stop_moment(R: Any, w: Any, centre: float, half: float, side: float, stiffness: float, damping: float) -> Any:
    """Moment of the stops on the arm about O in N m, the power that they take in W, and their potential in J.

    ``R`` rows of the rotation matrix, ``w`` angular velocity; ``side`` 1 for the left shoulder, -1 for the right.
    """
    zero = (0.0, 0.0, 0.0)
    abduction = side * math.asin(min(max(-R[1][2], -1.0), 1.0))
    axial = math.atan2(R[1][0], R[1][1])
    off, by_x = _rounded(abduction - centre)
    aside, by_z = _rounded(axial)
    by_x, depth = side * by_x, off + aside - half
    turned = axial - math.pi if axial > 0.0 else axial + math.pi
    off, slope = _rounded(math.pi - abduction - centre)
    aside, other = _rounded(turned)
    if off + aside - half < depth:
        by_x, by_z, depth = -side * slope, other, off + aside - half
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
