"""The motion of an arm by MuJoCo's own matrices, with the classical Runge-Kutta method of fourth order."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.control import ArmState


def moved(exact, qpos, push, wearer, steps, duration=1.0):
    """Orientation of the arm, on the first ball joint, after each tenth of the time.

    Parameters
    ----------
    exact : ExactMujoco
    qpos : ndarray
        Where it starts, at rest.
    push : callable
        From the arm's rotation matrix and qpos to forces, shape (nv,).
    wearer : callable
        Moment on the arm, as of a plant.
    steps : int
    duration : float
        s.
    """
    model, qpos, qvel, found = exact.model, qpos.copy(), np.zeros(exact.model.nv), []
    h = duration / steps
    at = [place for place, joint in enumerate(model.jnt_type) if joint == int(mujoco.mjtJoint.mjJNT_BALL)]
    balls = [slice(start, start + 3) for start in (int(model.jnt_dofadr[place]) for place in at)]
    ball, arm = int(model.jnt_qposadr[at[0]]), balls[0]

    def acceleration(turn, v):
        q = qpos.copy()
        mujoco.mj_integratePos(model, q, turn, 1.0)
        R = Rotation.from_quat(q[ball : ball + 4], scalar_first=True).as_matrix()
        forces = push(R, q)
        forces[arm] += R.T @ wearer(0.0, ArmState(R, R @ v[arm]))
        return exact.acceleration(q, v, forces)

    def rate(turn, v):
        # The rate of a rotation vector in the body's axes, to second order in a turn of one step.
        out = v.copy()
        for own in balls:
            w, e = v[own], turn[own]
            out[own] = w + 0.5 * np.cross(e, w) + np.cross(e, np.cross(e, w)) / 12.0
        return out, acceleration(turn, v)

    for k in range(steps):
        zero = np.zeros(model.nv)
        k1 = rate(zero, qvel)
        k2 = rate(0.5 * h * k1[0], qvel + 0.5 * h * k1[1])
        k3 = rate(0.5 * h * k2[0], qvel + 0.5 * h * k2[1])
        k4 = rate(h * k3[0], qvel + h * k3[1])
        turn, gain = (h / 6.0 * (a + 2.0 * b + 2.0 * c + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        mujoco.mj_integratePos(model, qpos, turn, 1.0)
        qvel = qvel + gain
        if (k + 1) % (steps // 10) == 0:
            found.append(qpos[ball : ball + 4].copy())
    return Rotation.from_quat(np.array(found), scalar_first=True)
