"""The elastic device at the displaced geometry with all joint angles, its guides by their strain energy alone.

Unknown are the four revolute angles of each limb, besides the displacements. The angles are those at which the strain
energy of the bent and twisted guide is stationary, and the guide's wrench on the platform is minus the slope of that
energy by the platform's own motions; the slopes are complex steps of one formula for the energy. The flexibility of the
beam's ends comes from quadrature. Nothing here knows of X_i, of reciprocal screws, of couples across two axes, of k_i
or of t_i φ_i.
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
    out = np.zeros((len(angle), 3, 3), dtype=np.asarray(angle).dtype)
    out[:, i, i] = 1.0
    out[:, j, j] = out[:, k, k] = np.cos(angle)
    out[:, k, j] = np.sin(angle)
    out[:, j, k] = -out[:, k, j]
    return out


def seat(y, s):
    """Frames with y along the joint's first axis and x across the limb, shape (n, 3, 3)."""
    x = unit(cross(y, s))
    return np.stack([x, y, cross(x, y)], axis=-1)


def spin(v):
    """[v], the matrix of v ×."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def energy(near, far, span, length, F):
    """Strain energy of guides between two end frames, to third order; complex numbers pass.

    The ends turn out of the line by θ across it; turned back by these, they differ by the twist.
    """
    bending, torsion = F
    s = span / np.sqrt((span * span).sum(axis=1, keepdims=True))
    turn, axis = [], []
    for frame in (near, far):
        t, x = frame[:, :, 2], frame[:, :, 0]
        across, along = cross(s, t), (s * t).sum(axis=1, keepdims=True)
        square = (across * across).sum(axis=1, keepdims=True)
        turn.append(across * arcsine(square))
        axis.append(x - (x * s).sum(axis=1, keepdims=True) / (1.0 + along) * (s + t))
    twist = 2.0 * np.arctan((cross(*axis) * s).sum(axis=1) / (1.0 + (axis[0] * axis[1]).sum(axis=1)))
    twist = twist + 0.5 * (cross(*turn) * s).sum(axis=1)
    both = np.stack(turn, axis=1)
    return 0.5 * np.einsum("nki,nkj,nji->n", both, np.linalg.inv(bending), both) + 0.5 * twist**2 / torsion


def arcsine(square):
    """arcsin(x)/x of x²."""
    small = np.abs(square) < 0.02
    series, term = np.zeros_like(square), np.ones_like(square)
    for k in range(12):
        series = series + term / (2 * k + 1)
        term = term * square * (2 * k + 1) / (2 * k + 2)
    root = np.sqrt(np.where(small, 1.0, square))
    return np.where(small, series, np.arcsin(root) / root)


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
        limb = [np.zeros(self.n), np.arctan2(-axes[0][:, 1], axes[0][:, 2]),
                np.zeros(self.n), np.arctan2(-axes[1][:, 1], axes[1][:, 2])]  # fmt: skip
        held = 3 if not locked else self.n
        self.soft = 6 * sum(own is not None for own in self.interfaces)
        self.start = np.concatenate([np.zeros(3 + 3 * locked + self.soft + held), np.concatenate(limb)])

    def parts(self, z):
        ends = np.cumsum([3, 3 * self.locked, self.soft, self.n if self.locked else 3])
        delta, turn, soft, pull, limb = np.split(z, ends)
        return delta, turn, soft, pull, limb.reshape(4, self.n)

    def residual(self, z, share):
        delta, turn, soft, pull, angles = self.parts(z)
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
        span = p - a
        length = np.linalg.norm(span, axis=1)
        s = span / length[:, None]
        closing, side = self.guides_at(angles, first, last, s, span, length)
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

    def guides_at(self, angles, first, last, s, span, length):
        """What vanishes for the right joint angles, and the wrench of each guide on the platform at B_i."""
        step = 1e-30j
        F = self.flexibility(length)
        slopes = []
        for k in range(10):
            moved = angles + step * (np.arange(4) == k)[:, None]
            along, turned = span, last
            if 4 <= k < 7:
                along = span + step * np.eye(3)[k - 4]
            elif k >= 7:
                turned = last + step * (spin(np.eye(3)[k - 7]) @ last)
            near = first @ turns("y", moved[0]) @ turns("x", moved[1])
            far = turned @ turns("y", moved[2]) @ turns("x", moved[3])
            slopes.append(energy(near, far, along, length, F).imag / step.imag)
        # A limb that resists nothing has its joints where the crosses are across its line.
        near = first @ turns("y", angles[0]) @ turns("x", angles[1])
        far = last @ turns("y", angles[2]) @ turns("x", angles[3])
        free = [np.einsum("ni,ni->n", frame[:, :, k], s) for frame in (near, far) for k in (0, 1)]
        closing = np.where(self.is_stiff, np.array(slopes[:4]), np.array(free))
        return closing.ravel(), -np.where(self.is_stiff, np.array(slopes[4:]), 0.0).T

    def flexibility(self, length):
        """Turns of the two ends per couple across the guide, shape (n, 2, 2), and its twist per torque, (n,)."""
        F = np.zeros((self.n, 2, 2))
        for x in GAUSS:
            moment = np.array([-(1.0 - x), x])  # for a unit couple on the near, and on the far end
            F += 0.5 * (length / self.EI)[:, None, None] * np.outer(moment, moment)
        F += (2.0 / (self.shear * length**2))[:, None, None] + np.eye(2) / self.couple[:, None, None]
        return F, length / self.GJ + 2.0 / self.couple

    def placed(self, i, give, points):
        own = self.interfaces[i]
        if own is None:
            return points
        return own.at + give[:3] + Rotation.from_rotvec(give[3:]).apply(points - own.at)

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
