"""The held elastic device with geometrically exact rods for guides: large bending and twist, no lumped law.

Each guide is a rod (Kirchhoff, no extension or shear) from A_i to B_i, clamped to the crosses of its universal joints,
with a slide at mid-length that carries no force along it: the actuator between A_i and B_i carries that. Unknown
are the joint angles, force and couple at A_i and the length of the rod; its equations are integrated from A_i to B_i
(fourth-order Runge-Kutta), where position, joint axes and free couples must fit (shooting).

    r' = t_3,    t_j' = κ × t_j,    κ = Σ (m · t_j / D_j) t_j,    m' = n × t_3 ... with the force n constant
"""

import numpy as np
from maximal_elastic import cross, seat, turns, unit
from scipy.optimize import root

STEPS = 12  # even: the slide lies at a node


class RodDevice:
    """A mechanism of guided limbs with rigid joints, held in a pose, with base and cuff offsets, m."""

    def __init__(self, exo, orientation, base, cuff):
        mechanism = exo.mechanism
        self.n, self.R = mechanism.limb_count, orientation.as_matrix()
        self.a = mechanism.geometry.base_points + base
        self.plate = (mechanism.geometry.platform_points + cuff) @ self.R.T
        self.K, self.arm = mechanism.shoulder.stiffness, mechanism.arm
        self.weight = self.arm.mass * mechanism.gravity
        self.y_a = -unit(mechanism.geometry.base_points)
        self.y_b = -unit(mechanism.geometry.platform_points @ self.R.T)
        guides = [limb.guide for limb in mechanism.limbs]
        self.D = np.array([[g.bending_rigidity, g.bending_rigidity, g.torsional_rigidity] for g in guides])
        s = unit(self.plate - self.a)
        self.seat_a, self.seat_b = seat(self.y_a, s), seat(self.y_b, s)

    def guess(self, answer):
        """Unknowns near an answer of the lumped law: straight rods with its side forces."""
        delta = answer.centre_displacement
        span = self.plate + delta - self.a
        s = unit(span)
        angles = []
        for frame in (self.seat_a, self.seat_b):
            v = np.einsum("nji,nj->ni", frame, s)
            angles += [np.arctan2(v[:, 0], v[:, 2]), np.arctan2(-v[:, 1], np.hypot(v[:, 0], v[:, 2]))]
        pull = np.linalg.lstsq(cross(self.plate, s).T @ cross(self.plate, s), np.zeros(3), rcond=None)[0]
        arms = cross(self.plate, s)
        pull = np.linalg.lstsq(arms, answer.actuator_forces, rcond=None)[0]
        on_arm = answer.limb_wrenches[:, :3] + answer.actuator_forces[:, None] * s
        limb = np.vstack([*angles, np.linalg.norm(span, axis=1), 0.01 * on_arm.T, np.zeros(self.n)])
        return np.concatenate([100.0 * delta, 0.01 * pull, limb.ravel()])

    def residual(self, z):
        delta, pull = 0.01 * z[:3], 100.0 * z[3:6]
        a1, a2, b1, b2, length, *force, couple = z[6:].reshape(9, self.n)
        n = -100.0 * np.array(force).T  # force of the far part of the rod on the near one: minus what the arm gets
        n = -n
        first = self.seat_a @ turns("y", a1)
        near = first @ turns("x", a2)
        far = self.seat_b @ turns("y", b1) @ turns("x", b2)
        # The joint at A_i bears the couple across both of its axes.
        m = couple[:, None] * unit(cross(self.y_a, first[:, :, 0]))
        r, frame = self.a.copy(), near.copy()
        h = (length / STEPS)[:, None]
        slide, largest, points = None, 0.0, [r]
        for k in range(STEPS):
            if k == STEPS // 2:
                slide = np.einsum("ni,ni->n", n, frame[:, :, 2])
            steps = []
            for weight in (0.0, 0.5, 0.5, 1.0):
                if steps:
                    dr, dF, dm = steps[-1]
                    at = r + weight * h * dr, frame + weight * h[..., None] * dF, m + weight * h * dm
                else:
                    at = r, frame, m
                curve = np.einsum("nij,nj->ni", at[1], np.einsum("nij,ni->nj", at[1], at[2]) / self.D)
                turned = np.stack([cross(curve, at[1][:, :, j]) for j in range(3)], axis=-1)
                steps.append((at[1][:, :, 2], turned, -cross(at[1][:, :, 2], n)))
            mix = [sum(c * step[j] for c, step in zip((1, 2, 2, 1), steps, strict=True)) / 6 for j in range(3)]
            r, frame, m = r + h * mix[0], frame + h[..., None] * mix[1], m + h * mix[2]
            points.append(r)
        p = self.plate + delta
        s = unit(p - self.a)
        chord = np.array(points) - self.a
        largest = np.linalg.norm(cross(chord, s[None]), axis=-1).max(axis=0) / np.linalg.norm(p - self.a, axis=1)
        self.bending = largest
        mismatch = np.einsum("nji,njk->nik", frame, far)
        lost = np.stack([mismatch[:, 2, 1] - mismatch[:, 1, 2], mismatch[:, 0, 2] - mismatch[:, 2, 0],
                         mismatch[:, 1, 0] - mismatch[:, 0, 1]], axis=1) / 2  # fmt: skip
        # On the far end the platform puts (n, m): the arm gets (-n, -m), and no couple about the free axes.
        free = np.stack([np.einsum("ni,ni->n", m, self.y_b), np.einsum("ni,ni->n", m, far[:, :, 0])], axis=1)
        f = cross(self.plate, s) @ pull
        on_arm = -n - f[:, None] * s
        forces = -self.K @ delta + on_arm.sum(axis=0) + self.weight
        moments = (cross(self.plate, on_arm) - m).sum(axis=0) + np.cross(self.R @ self.arm.centre_of_mass, self.weight)
        rods = np.concatenate([10.0 * (r - p), lost, free, 0.01 * slide[:, None]], axis=1)
        return np.concatenate([0.01 * forces, 0.1 * moments, rods.ravel()])

    def solve(self, guess):
        """F_s and how far each rod bends off its chord, over its length; None if nothing is found."""
        found = root(self.residual, guess, tol=1e-11)
        if np.abs(self.residual(found.x)).max() > 1e-8:
            return None
        return -self.K @ (0.01 * found.x[:3]), self.bending
