"""The wrist as a frame of elastic beams: an independent model of where side forces and shoulder force come from.

Linear displacement method about one pose. A limb is a twelve-coordinate Euler-Bernoulli beam from A_i to B_i whose ends
turn freely about the two axes of their universal joints, and nowhere else; the arm is a rigid body on a spring at O.
Nothing here knows of X_i, of a wrench through O, or of side stiffness.
"""

import numpy as np

AXIAL = 1e10  # N: stiff enough that the arm does not turn


def cross_matrix(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def beam_stiffness(length, EI, GJ):
    """Stiffness of a beam along local x: (u, v, w, θx, θy, θz) at either end."""
    K = np.zeros((12, 12))

    def add(dofs, block):
        K[np.ix_(dofs, dofs)] += block

    pair = np.array([[1, -1], [-1, 1]])
    add([0, 6], AXIAL / length * pair)
    add([3, 9], GJ / length * pair)
    L = length
    bend = np.array([[12, 6 * L, -12, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2],
                     [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2]])  # fmt: skip
    add([1, 5, 7, 11], EI / L**3 * bend)
    flip = np.diag([1, -1, 1, -1])
    add([2, 4, 8, 10], EI / L**3 * flip @ bend @ flip)
    return K


def solve(base, arm_points, guides, K_s, force, moment):
    """Displacement of O, shoulder force on the arm, tensions, and the limbs' forces on the arm.

    Coordinates: translation and rotation of the arm, then per limb the free rotations (two at A, two at B), and the
    give of its joints (displacement across the limb at A and B, twist across both axes at A and B).
    """
    n = len(base)
    size = 6 + 8 * n
    K = np.zeros((size, size))
    K[:3, :3] += K_s
    elements = []
    for i in range(n):
        a, b, guide = base[i], arm_points[i], guides[i]
        span = b - a
        length = np.linalg.norm(span)
        s = span / length
        y_a, y_b = -a / np.linalg.norm(a), -b / np.linalg.norm(b)
        x = np.cross(y_a, s)
        x /= np.linalg.norm(x)
        B = np.zeros((12, size))  # end displacements and rotations, world axes
        own = 6 + 8 * i
        B[3:6, own], B[3:6, own + 1] = x, y_a
        B[6:9, :3], B[6:9, 3:6] = np.eye(3), -cross_matrix(b)
        B[9:12, 3:6] = np.eye(3)
        B[9:12, own + 2], B[9:12, own + 3] = x, y_b
        B[0:3, own + 4], B[6:9, own + 5] = x, x
        across_a, across_b = np.cross(x, y_a), np.cross(x, y_b)
        B[3:6, own + 6], B[9:12, own + 7] = across_a, across_b
        turn = np.zeros((3, 3))
        turn[0], turn[1] = s, x
        turn[2] = np.cross(s, x)
        T = np.kron(np.eye(4), turn)
        element = T.T @ beam_stiffness(length, guide.bending_rigidity, guide.torsional_rigidity) @ T
        K += B.T @ element @ B
        for offset, stiffness in ((4, guide.joint_stiffness), (6, guide.joint_twist_stiffness)):
            value = 1e12 if np.isinf(stiffness) else stiffness
            K[own + offset, own + offset] += value
            K[own + offset + 1, own + offset + 1] += value
        elements.append((element, B, s))
    load = np.zeros(size)
    load[:3], load[3:6] = force, moment
    u = np.linalg.solve(K, load)
    tensions, on_arm = np.empty(n), np.empty((n, 3))
    for i, (element, B, s) in enumerate(elements):
        end = element @ (B @ u)
        on_arm[i] = -end[6:9]
        tensions[i] = end[6:9] @ s
    return u[:3], -K_s @ u[:3], tensions, on_arm
