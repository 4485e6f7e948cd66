"""A plant of one's own for devices whose hinges all meet in the shoulder, in minimal coordinates: the arm's turn.

A limb has three hinges, from the arm v (fixed to the arm), w (to the link on the arm) and u (to the torso). All bodies
turn about O, so that with the arm's ω

    ω + v a + w b + u c = 0,      ω_2 = ω + v a,      ω_3 = ω_2 + w b = -u c

determine every rate, and one more derivative every angular acceleration. Virtual power of all bodies' moments about O,
motors in u, v or w with their rotors included, gives the arm's angular acceleration. Axes, inertias and moments of mass
about O are read from the chain at rest; nothing else is its.
"""

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from exo_pin.device.device_model import device_model
from exo_pin.device.postures import closed_at_rest


class HingedDevice:
    """Of a device whose limbs hang on the arm, three hinges each; ``rotors`` kg m² by joint."""

    def __init__(self, device, rotors=0.0):
        model = device_model(device.as_chain())
        tree, q = model.held.model, closed_at_rest(model)
        data = tree.createData()
        pin.computeJointJacobians(tree, data, q)
        self.gravity = np.array(tree.gravity.linear)

        def body(k):
            placed = data.oMi[k].act(tree.inertias[k])
            c = np.array(placed.lever)
            about = np.array(placed.inertia) + placed.mass * (c @ c * np.eye(3) - np.outer(c, c))
            return about, placed.mass * c

        self.arm = body(model.arm)
        self.limbs = []
        driven = [drive.joint for drive in device.as_chain().drives]
        for first in (k for k in range(1, tree.njoints) if tree.parents[k] == model.arm):
            own = [first, first + 1, first + 2]
            axes = np.array([data.J[3:, tree.idx_vs[k]] for k in own])
            motors = [driven.index(tree.names[k]) if tree.names[k] in driven else None for k in own]
            self.limbs.append((axes, body(first), body(first + 1), motors))
        self.rotors = rotors

    def acceleration(self, turns, w, efforts, moment):
        """Angular acceleration; ``turns`` rotation matrices of the arm and of two links a limb."""
        R = turns[0]
        mass, rest = np.zeros((3, 3)), np.array(moment, dtype=float)
        rates = []
        for k, (body, G, spin, bias) in enumerate(self._bodies(turns, w, efforts, rates)):
            about, m = body
            A = turns[k] @ about @ turns[k].T
            weight = np.cross(turns[k] @ m, self.gravity)
            mass += G.T @ A @ G
            rest += G.T @ (weight - np.cross(spin, A @ spin) - A @ bias)
        for to_rates, bias, motors in rates:
            for j, drive in enumerate(motors):
                if drive is not None:
                    mass += self.rotors * np.outer(to_rates[j], to_rates[j])
                    rest += to_rates[j] * (efforts[drive] - self.rotors * bias[j])
        return np.linalg.solve(mass, rest), R

    def _bodies(self, turns, w, efforts, rates):
        yield self.arm, np.eye(3), w, np.zeros(3)
        for k, (axes, second, third, motors) in enumerate(self.limbs):
            v, u = turns[0] @ axes[0], axes[2]
            x = turns[1 + 2 * k] @ axes[1]
            A = np.linalg.inv(np.column_stack([v, x, u]))
            a, b, _ = -A @ w
            spin = w + v * a
            turning = np.cross(w, v) * a + np.cross(spin, x) * b
            # Of the three rates: -A α - A turning.
            rates.append((-A, -A @ turning, motors))
            yield second, np.eye(3) - np.outer(v, A[0]), spin, np.cross(w, v) * a - v * (A[0] @ turning)
            yield third, np.outer(u, A[2]), u * (A[2] @ w), u * (A[2] @ turning)

    def run(self, times, start, efforts, moment, w=(0.0, 0.0, 0.0)):
        """Orientations at times, from the turns of the bodies at the start; ``moment(t, R, w)``."""
        count = 1 + 2 * len(self.limbs)

        def rate(t, y):
            quats = y[: 4 * count].reshape(count, 4)
            turns = Rotation.from_quat(quats).as_matrix()
            w = y[4 * count :]
            bodies = list(self._bodies(turns, w, efforts(t), []))
            alpha, _ = self.acceleration(turns, w, efforts(t), moment(t, turns[0], w))
            out = [_quaternion_rate(quat, body[2]) for quat, body in zip(quats, bodies, strict=True)]
            return np.concatenate([*out, alpha])

        y = np.concatenate([start.ravel(), w])
        found = solve_ivp(rate, (times[0], times[-1]), y, "DOP853", times, rtol=1e-11, atol=1e-12)
        return Rotation.from_quat(found.y[:4].T), found.y[4 * count :].T


def _quaternion_rate(q, w):
    x, y, z, s = q
    a, b, c = w
    return 0.5 * np.array([s * a + b * z - c * y, s * b + c * x - a * z, s * c + a * y - b * x, -a * x - b * y - c * z])


def turns_of(device, pose):
    """Turns of arm and links since rest, as quaternions, in a pose of the device."""
    model = device_model(device.as_chain())
    tree = model.held.model
    data = tree.createData()
    from exo_pin.device.postures import postures

    def places(q):
        pin.forwardKinematics(tree, data, q)
        chosen = [model.arm]
        for first in (k for k in range(1, tree.njoints) if tree.parents[k] == model.arm):
            chosen += [first, first + 1]
        return [np.array(data.oMi[k].rotation) for k in chosen]

    rest = places(closed_at_rest(model))
    there = places(postures(model, pose.as_matrix()[None]).q[0])
    return np.array([Rotation.from_matrix(b @ a.T).as_quat() for a, b in zip(rest, there, strict=True)])
