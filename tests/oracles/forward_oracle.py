"""Forward kinematics by brute force: damped Newton from many poses all over the rotation group, in plain NumPy."""

import numpy as np
from scipy.spatial.transform import Rotation


def all_solutions(u, v, c, starts, iterations=30, same=1e-5):
    """Every R with u_i·R v_i = c_i that a start leads to, one array (k, 3, 3)."""
    R = starts.copy()
    for _ in range(iterations):
        w = np.swapaxes(R @ v.T, 1, 2)
        error = c - np.einsum("ij,kij->ki", u, w)
        J = np.cross(w, u)
        damping = 1e-12 + 0.1 * (error**2).sum(axis=1)
        G = np.swapaxes(J, 1, 2) @ J + damping[:, None, None] * np.eye(3)
        step = np.linalg.solve(G, np.swapaxes(J, 1, 2) @ error[:, :, None])[:, :, 0]
        size = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
        R = Rotation.from_rotvec(step).as_matrix() @ R
    error = np.abs(c - np.einsum("ij,kij->ki", u, np.swapaxes(R @ v.T, 1, 2))).max(axis=1)
    found = []
    for candidate in R[error < 1e-11]:
        if all(np.abs(candidate - other).max() > same for other in found):
            found.append(candidate)
    return np.array(found).reshape(-1, 3, 3)


def length_equations(geometry, lengths):
    """u, v and c of a_i · R B_i = (|a|² + |b|² - l²)/2."""
    a, b = np.linalg.norm(geometry.base_points, axis=1), np.linalg.norm(geometry.platform_points, axis=1)
    return (
        geometry.base_points / a[:, None],
        geometry.platform_points / b[:, None],
        (a**2 + b**2 - lengths**2) / (2 * a * b),
    )


def distance_to_closest(modes, poses):
    """Angle from each pose to the closest of its modes, rad."""
    q, p = modes.rotations.as_quat(), poses.as_quat()[..., None, :]
    gap = np.minimum(np.linalg.norm(q - p, axis=-1), np.linalg.norm(q + p, axis=-1))
    return 2 * np.where(modes.valid, gap, np.inf).min(axis=-1)
