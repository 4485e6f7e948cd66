"""A limb as free bodies: which wrenches its joints let through, from the equilibrium of every part and nothing else.

Torso, cross, lower half, upper half, cross and arm hang together by two revolute joints, a slide and two revolute
joints. Unknown are the six components of the wrench in each joint. Nothing here knows of X_i, of side wrenches or
of bisectors.
"""

import itertools

import numpy as np
from scipy.linalg import null_space


def transmitted(a, b, y_base, y_arm):
    """Wrenches of a limb on the arm about O that its joints let through, shape (6, 2).

    The first has the force s, from A to B, the second a force of size 1 across the limb, on the side of both cross
    axes Y × s.
    """
    s = (b - a) / np.linalg.norm(b - a)
    crosses = [np.cross(y, s) / np.linalg.norm(np.cross(y, s)) for y in (y_base, y_arm)]
    # On the part behind each joint: force and moment about O, columns 6 j to 6 j + 5.
    rows = []
    for j, (axis, point) in enumerate([(y_base, a), (crosses[0], a), (None, a), (crosses[1], b), (y_arm, b)]):
        if axis is not None:  # a slide gives way along s, and its actuator pulls there
            row = np.zeros((1, 30))
            row[0, 6 * j : 6 * j + 3], row[0, 6 * j + 3 : 6 * j + 6] = -np.cross(axis, point), axis
            rows.append(row)
        if j:  # the massless part between the joint before and this one
            part = np.zeros((6, 30))
            part[:, 6 * j - 6 : 6 * j], part[:, 6 * j : 6 * j + 6] = np.eye(6), -np.eye(6)
            rows.append(part)
    through = null_space(np.concatenate(rows), rcond=1e-10)[24:]
    assert through.shape == (6, 2)
    along = np.concatenate([s, np.cross(b, s)])
    across = through @ null_space((s @ through[:3])[None])[:, 0]
    across /= np.linalg.norm(across[:3])
    return np.stack([along, across * np.sign(across[:3] @ (crosses[0] + crosses[1]))], axis=1)


class FreeBodies:
    """Arm, shoulder and limbs of a wrist in one pose, its device off centre.

    Attributes
    ----------
    pull, side : ndarray
        Wrench on the arm per N of f_i and of g_i, shape (6, n).
    load : ndarray
        Of the arm's weight, shape (6,).
    """

    def __init__(self, mechanism, R, base, cuff):
        points = zip(mechanism.geometry.base_points, mechanism.geometry.platform_points, strict=True)
        limbs = [-transmitted(A + base, R @ (B + cuff), -A, -R @ B) for A, B in points]
        self.pull, self.side = np.moveaxis(limbs, 2, 0).swapaxes(1, 2)
        weight = mechanism.arm.mass * np.array(mechanism.gravity)
        self.load = np.concatenate([weight, np.cross(R @ mechanism.arm.centre_of_mass, weight)])

    def solve(self, g):
        """f and F_s of three limbs for side forces g."""
        wrench = self.load + self.side @ g
        f = np.linalg.solve(self.pull[3:], -wrench[3:])
        return f, -(wrench + self.pull @ f)[:3]

    def least(self, bound):
        """Least |F_s| of three limbs with |g| <= bound, shape (3,): the best of all 27 sets of bounds that act."""
        constant = self.solve(np.zeros(3))[1]
        effect = np.stack([self.solve(row)[1] - constant for row in np.eye(3)], axis=1)
        sizes = []
        for signs in itertools.product((-1.0, 0.0, 1.0), repeat=3):
            g, free = bound * signs, np.array(signs) == 0.0
            g[free] = np.linalg.lstsq(effect[:, free], -constant - effect @ g, rcond=None)[0]
            if (np.abs(g) <= bound * (1 + 1e-9)).all():
                sizes.append(np.linalg.norm(constant + effect @ g))
        return min(sizes)
