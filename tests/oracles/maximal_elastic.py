"""The elastic device at the displaced geometry in maximal coordinates: all joint angles, slides and twists.

A limb is a chain of seven joints from the base ring to the platform: two revolute joints at A_i, the slide, the
twist of the guide, two revolute joints at B_i. Its wrench on the platform follows from virtual work: nothing in the
revolute joints, f in the slide, and the guide's moment in the twist. The guide's torsional stiffness comes from the
strain energy of the beam by quadrature. Nothing here knows of X_i, of reciprocal screws in closed form, of k_i or
of t_i φ_i.
"""

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

GAUSS = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)


def cross(u, v):
    """Much faster than numpy's for few vectors."""
    return np.stack([u[..., 1] * v[..., 2] - u[..., 2] * v[..., 1], u[..., 2] * v[..., 0] - u[..., 0] * v[..., 2],
                     u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]], axis=-1)  # fmt: skip


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def turns(axis, angle):
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    out = np.zeros((len(angle), 3, 3))
    out[:, i, i] = 1.0
    out[:, j, j] = out[:, k, k] = np.cos(angle)
    out[:, k, j] = np.sin(angle)
    out[:, j, k] = -out[:, k, j]
    return out


def seat(y, s):
    """Frames with y along the joint's first axis and x across the limb, shape (n, 3, 3)."""
    x = unit(cross(y, s))
    return np.stack([x, y, cross(x, y)], axis=-1)


class Device:
    """A mechanism, a pose, loads and offset, both of which ``share`` scales.

    ``stress`` is what the tensions hold besides those of least norm: its part that balances itself is added.
    """

    def __init__(self, exo, orientation, base, cuff, force=None, moment=None, locked=False, stress=None):
        mechanism = exo.mechanism
        self.n, self.R, self.locked = mechanism.limb_count, orientation.as_matrix(), locked
        self.A, self.B = mechanism.geometry.base_points, mechanism.geometry.platform_points
        self.stress = np.zeros(self.n) if stress is None else stress
        self.base, self.cuff, self.K = np.asarray(base), np.asarray(cuff), mechanism.shoulder.stiffness
        self.arm, self.gravity = mechanism.arm, mechanism.gravity
        self.force = np.zeros(3) if force is None else force
        self.moment = np.zeros(3) if moment is None else moment
        self.guides = [limb.guide if limb.kind == "UPU" else None for limb in mechanism.limbs]
        self.is_stiff = np.array([guide is not None for guide in self.guides])
        rows = [(1.0, 1.0, np.inf, np.inf) if g is None else
                (g.bending_rigidity, g.torsional_rigidity, g.joint_stiffness, g.joint_twist_stiffness)
                for g in self.guides]  # fmt: skip
        self.EI, self.GJ, self.shear, self.couple = np.array(rows).T
        self.interfaces = [mechanism.interfaces.harness, mechanism.interfaces.cuff]
        b = self.B @ self.R.T
        s = unit(b - self.A)
        self.lengths = np.linalg.norm(b - self.A, axis=1)
        self.seat_a, self.seat_b = seat(-unit(self.A), s), self.R.T @ seat(-unit(b), s)
        axes = [np.einsum("nji,nj->ni", frame, s) for frame in (self.seat_a, self.R @ self.seat_b)]
        limb = [np.zeros(self.n), *(np.arctan2(-v[:, 1], v[:, 2]) for v in axes), np.zeros(self.n)]
        limb = [limb[0], limb[1], limb[3], limb[2], self.lengths, np.zeros(self.n)]
        held = 3 if not locked else self.n
        self.soft = 6 * sum(own is not None for own in self.interfaces)
        self.start = np.concatenate([np.zeros(3 + 3 * locked + self.soft + held), np.concatenate(limb)])

    def parts(self, z):
        ends = np.cumsum([3, 3 * self.locked, self.soft, self.n if self.locked else 3])
        delta, turn, soft, pull, limb = np.split(z, ends)
        return delta, turn, soft, pull, limb.reshape(6, self.n)

    def residual(self, z, share):
        delta, turn, soft, pull, (a1, a2, b1, b2, length, twist) = self.parts(z)
        R = Rotation.from_rotvec(turn).as_matrix() @ self.R if self.locked else self.R
        give = [np.zeros(6), np.zeros(6)]
        for i, own in enumerate(self.interfaces):
            if own is not None:
                give[i], soft = soft[:6], soft[6:]
        # Where ring and platform are: the ring in the base frame from the anatomical centre, the platform in the arm.
        ring = self.placed(0, give[0], self.A + share * self.base)
        plate = self.placed(1, give[1], self.B + share * self.cuff)
        ring_turn, plate_turn = (Rotation.from_rotvec(own[3:]).as_matrix() for own in give)
        a, p = ring, delta + plate @ R.T
        first, last = ring_turn @ self.seat_a, R @ plate_turn @ self.seat_b
        near = first @ turns("y", a1) @ turns("x", a2)
        far = last @ turns("y", b1) @ turns("x", b2)
        twisted = near @ turns("z", twist)
        s = near[:, :, 2]
        mismatch = np.einsum("nji,njk->nik", twisted, far)
        closing = np.concatenate([
            (p - a - length[:, None] * s).ravel(),
            (mismatch[:, 2, 1] - mismatch[:, 1, 2]) / 2, (mismatch[:, 0, 2] - mismatch[:, 2, 0]) / 2,
            (mismatch[:, 1, 0] - mismatch[:, 0, 1]) / 2,
        ])  # fmt: skip
        # Twists of the platform by each joint, at p: (velocity, angular velocity).
        axes = [first[:, :, 1], near[:, :, 0], s, s, far[:, :, 0], last[:, :, 1]]
        columns = [np.concatenate([cross(axes[0], p - a), axes[0]], axis=1),
                   np.concatenate([cross(axes[1], p - a), axes[1]], axis=1),
                   np.concatenate([s, 0 * s], axis=1), np.concatenate([0 * s, s], axis=1),
                   np.concatenate([0 * s, axes[4]], axis=1), np.concatenate([0 * s, axes[5]], axis=1)]  # fmt: skip
        J = np.stack(columns, axis=2)
        side = np.linalg.solve(np.swapaxes(J, 1, 2), np.broadcast_to([[0.0], [0], [0], [1], [0], [0]], (self.n, 6, 1)))
        side = side[:, :, 0]  # wrench at p that works one newton metre per radian of the twist
        energy = self.compliance(s, length, side, p)
        moment = np.where(self.is_stiff, twist / energy, 0.0)
        side = -moment[:, None] * side
        if self.locked:
            f = pull
        else:
            arms = cross(p - delta, s)
            own = share * self.stress
            f = arms @ pull + own - arms @ np.linalg.solve(arms.T @ arms, arms.T @ own)
        self.tensions = f
        on_plate = np.concatenate([side[:, :3] - f[:, None] * s, side[:, 3:]], axis=1)
        about = lambda at: np.concatenate([on_plate[:, :3],  # noqa: E731
            on_plate[:, 3:] + cross(p - at, on_plate[:, :3])], axis=1).sum(axis=0)  # fmt: skip
        weight = share * self.arm.mass * self.gravity
        limbs = about(delta)
        load = share * self.moment + cross(R @ self.arm.centre_of_mass, weight)
        out = [-self.K @ delta + limbs[:3] + weight + share * self.force, limbs[3:] + load]
        for i, own in enumerate(self.interfaces):
            if own is None:
                continue
            at = own.at + give[i][:3] if i == 0 else delta + R @ (own.at + give[i][:3])
            wrench = -about(at) if i == 0 else about(at)
            if i == 1:
                for part in self.arm.parts:
                    if part.device:  # its own moving part hangs on the cuff, too
                        own_weight = share * part.mass * self.gravity
                        lever = R @ part.centre_of_mass + delta - at
                        wrench = wrench + np.concatenate([own_weight, cross(lever, own_weight)])
                wrench = np.concatenate([R.T @ wrench[:3], R.T @ wrench[3:]])
            work = np.concatenate([wrench[:3], rates(give[i][3:]).T @ wrench[3:]])
            out.append(np.linalg.solve(own.stiffness, own.stiffness @ give[i] - work))
        if self.locked:
            out.append(length - self.lengths)
        return np.concatenate([*out, closing])

    def placed(self, i, give, points):
        own = self.interfaces[i]
        if own is None:
            return points
        return own.at + give[:3] + Rotation.from_rotvec(give[3:]).apply(points - own.at)

    def compliance(self, s, length, side, p):
        """Twice the strain energy of the unit wrench: bending and torsion along the guide, and its joints."""
        out = np.zeros(self.n)
        for x in GAUSS:
            m = side[:, 3:] + cross((length * x)[:, None] * s, side[:, :3])  # at the distance from p
            along = np.einsum("ni,ni->n", m, s)
            out += 0.5 * length * (np.einsum("ni,ni->n", m, m) - along**2) / self.EI
            out += 0.5 * length * along**2 / self.GJ
        end = side[:, 3:] + cross(length[:, None] * s, side[:, :3])
        out += 2 * np.einsum("ni,ni->n", side[:, :3], side[:, :3]) / self.shear
        return out + (np.einsum("ni,ni->n", end, end) + np.einsum("ni,ni->n", side[:, 3:], side[:, 3:])) / self.couple

    def solve(self, steps=3):
        """δ of the equilibrium that grows from the unloaded, aligned device; None if a step fails."""
        z, before, at = self.start, self.start, 0.0
        step = 1.0 / steps
        while at < 1.0:
            goal = min(at + step, 1.0)
            guess = z + (z - before) * (step and (goal - at) / step if at else 0.0)
            found = root(self.residual, guess, args=(goal,), tol=1e-13)
            moved = np.abs(found.x - guess)[:3].max()
            # Far from the guess is another branch.
            if np.abs(self.residual(found.x, goal)).max() < 1e-8 and moved < 0.02:
                before, z, at = z, found.x, goal
            else:
                step /= 2
                before = z
                if step < 0.02:
                    return None
        return z


def rates(v, step=1e-4):
    """Angular velocity per rate of a rotation vector, by central differences of fourth order."""
    here = Rotation.from_rotvec(v)
    columns = []
    for axis in np.eye(3):
        ends = [(Rotation.from_rotvec(v + h * step * axis) * here.inv()).as_rotvec() for h in (-2, -1, 1, 2)]
        columns.append((ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step))
    return np.array(columns).T
