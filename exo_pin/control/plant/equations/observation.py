"""What a run of the plant reports, from its states."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.vectors import cross, dot, limb, matrix, turn, vector
from .drive_kernels import is_motor, limb_tension, motor_energy, motor_force
from .plant_kernels import rates, rows_of, stop_moment


# Always compiled, as the integration is: what a run reports does not depend on its length.
@kernel(stack=True, cost=301)
def observe(Q: Any, Y: Any, acts: Any, t: Any, motion: Any, limbs: Any, energy: Any) -> None:
    """Fill what a run reports at N instants.

    ``Q`` (N, 4) quaternions, ``Y`` (N, size) states with ξ = 0, ``acts`` (N, n, 4) the last columns of :data:`FLOWS`.
    ``motion`` (N, 9): angular acceleration, and the moments of friction and stops on the arm. ``limbs`` (N, n, 6):
    length, its rate, tension, the bladder's contraction, force of the motor, and energy stored in the drive.
    ``energy`` (N, 2): kinetic, potential of weight, load and stops.
    """
    n = t.base.shape[0]
    flows = np.zeros((n, 10))
    out = np.zeros(Y.shape[1])
    for k in range(len(Q)):
        flows[:, 6:] = acts[k]
        rates(t, flows, Q[k], Y[k], out)
        R, w = rows_of(Q[k], Y[k]), vector(Y[:, 3:6], k)
        joint = t.shoulder
        stop, potential = (0.0, 0.0, 0.0), 0.0
        if joint[3] > 0.0:
            stop, _, potential = stop_moment(R, w, joint[4], joint[5], joint[6], joint[7], joint[8])
        for j in range(3):
            motion[k, j] = out[3 + j]
            motion[k, 3 + j] = -joint[0] * w[j] - joint[1] * Y[k, 6 + 2 * n + j]
            motion[k, 6 + j] = stop[j]
        for i in range(n):
            b, s, _, length, _, _ = limb(R, vector(t.base, i), vector(t.platform, i))
            speed = dot(cross(b, s), w)
            pull, bladder = limb_tension(t, i, Y[k], speed, length)
            limbs[k, i, 0], limbs[k, i, 1] = length, speed
            limbs[k, i, 2], limbs[k, i, 3] = flows[i, 6] * pull, bladder
            if is_motor(t.motors[i]):
                rate = Y[k, 13 + 5 * n + i]
                limbs[k, i, 4] = flows[i, 8] * motor_force(t.motors[i], flows[i, 7], -rate)
                limbs[k, i, 5] = motor_energy(t.motors[i], length, Y[k, 6 + i], rate, flows[i, 6])
        own = turn(((R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])), w)
        energy[k, 0] = 0.5 * dot(own, turn(matrix(t.inertia), own))
        C, point = turn(R, t.centre), turn(R, t.point)
        potential -= t.mass * (t.gravity[0] * C[0] + t.gravity[1] * C[1] + t.gravity[2] * C[2])
        energy[k, 1] = potential - t.force[0] * point[0] - t.force[1] * point[1] - t.force[2] * point[2]
