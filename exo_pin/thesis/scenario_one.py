"""The example of Scenario One, Section 4.2.2: six base angles, limb lengths, and the orientation back."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import thesis_angles, thesis_rotation
from ..core.validation import FloatArray
from ..design import preset
from ..wrist import inverse_kinematics
from .rows import CONTRADICTED, NO_READING, Row, compare

_SOURCE = "Section 4.2.2, Scenario One"
_PRINTED_THETA_X = np.array([-41.179, 76.885, -23.8481])
_PRINTED_THETA_Y = np.array([-64.716, -88.425, 75.7441])
_PRINTED_ANGLES = np.array([-3.4815, 47.4355, 44.3940])
PRINTED_MATRICES = np.array(
    [
        [[0.4271, 0.5953, -0.6805], [0.7831, 0.1328, 0.6076], [0.4521, -0.7924, -0.4095]],
        [[-0.4466, 0.6454, -0.6197], [0.8657, 0.1366, -0.4816], [-0.2261, -0.7516, -0.6197]],
        [[-0.5428, 0.5331, -0.6489], [-0.8394, 0.3711, 0.3972], [0.0290, 0.7603, 0.6489]],
    ]
)


def _joint_matrices(theta_x: FloatArray, theta_y: FloatArray) -> FloatArray:
    """R_Ai R_OAi = {A_i} Ry(θy) Rx(θx), shape (3, 3, 3): the order of (4-25), not of (4-10)."""
    turns = Rotation.from_euler("YX", np.stack([theta_y, theta_x], axis=-1)).as_matrix()
    return np.asarray(preset("scenario-one").geometry.base_frames @ turns)


def _roots(directions: FloatArray) -> FloatArray:
    """Both roots of l² + 2 l (a·s) + |a|² - |b|² = 0 for each limb, shape (3, 2), m; (4-19) with its sign right.

    Source: thesis (4-19), (4-20).
    """
    geometry = preset("scenario-one").geometry
    half = np.einsum("ij,ij->i", geometry.base_points, directions)
    gap = (geometry.base_points**2).sum(axis=1) - (geometry.platform_points**2).sum(axis=1)
    width = np.sqrt(half**2 - gap)
    return np.stack([-half - width, -half + width], axis=-1)


def rows() -> list[Row]:
    """Rows of the ledger."""
    geometry = preset("scenario-one").geometry
    pose = thesis_rotation(0, 45, 45, degrees=True)
    state = inverse_kinematics(geometry, pose)
    theta_x, theta_y = np.degrees(state.base_theta_x), np.degrees(state.base_theta_y)
    matrices = _joint_matrices(state.base_theta_x, state.base_theta_y)
    mended = PRINTED_MATRICES.copy()
    mended[2, 0, 1], mended[2, 2, 2] = -0.5331, -0.6489
    roots = _roots(matrices[:, :, 2]) * 1e3
    # The printed route with the printed, rounded angles: directions, positive roots, then R from the three points.
    directions = _joint_matrices(np.radians(_PRINTED_THETA_X), np.radians(_PRINTED_THETA_Y))[:, :, 2]
    points = geometry.base_points + _roots(directions)[:, 1:] * directions
    matrix = np.linalg.solve(geometry.platform_points, points).T
    solved = thesis_angles(Rotation.from_matrix(matrix), degrees=True)
    points_note = (
        "A_2 and B_2 lost their signs in print; as printed B_2 = B_3, and no printed angle of limb 2 would follow"
    )
    return [
        compare(_SOURCE, "A_2", "mm", [-44.7371, -25.829, 86.43], geometry.base_points[1] * 1e3, 5e-4,
                mended=[-44.7371, -29.825, -25.83], note=points_note, digits=3),
        compare(_SOURCE, "B_2", "mm", [44.7371, -25.829, -86.43], geometry.platform_points[1] * 1e3, 5e-4,
                mended=[-44.7371, -25.829, -86.43], note=points_note, digits=3),
        compare(_SOURCE, "height of A_1 over the axis, the radius of the ring of A_3", "mm", 51.658,
                np.hypot(*geometry.base_points[2, [0, 2]]) * 1e3, 1e-3, digits=3),
        compare(_SOURCE, "height of B_1 over the axis, the radius of the ring of B_3", "mm", 94.9,
                np.hypot(*geometry.platform_points[2, :2]) * 1e3, 1e-3, digits=3, otherwise=CONTRADICTED,
                note="(4-2) puts B_1 on the ring of the others; the printed angles and lengths follow from 94.9 mm, so "
                "that is what was used"),
        compare(_SOURCE, "θ_yA at (0, 45, 45)°", "°", _PRINTED_THETA_Y, theta_y, 6e-4, digits=3),
        compare(_SOURCE, "θ_xA at (0, 45, 45)°", "°", _PRINTED_THETA_X, theta_x, 1.2e-3, digits=3,
                note="the print rounds an intermediate result"),
        compare(_SOURCE, "R_A1 R_OA1", "", PRINTED_MATRICES[0].ravel(), matrices[0].ravel(), 1e-4),
        compare(_SOURCE, "R_A2 R_OA2", "", PRINTED_MATRICES[1].ravel(), matrices[1].ravel(), 1e-4),
        compare(_SOURCE, "R_A3 R_OA3", "", PRINTED_MATRICES[2].ravel(), matrices[2].ravel(), 1e-4,
                mended=mended[2].ravel(), note="entries (1,2) and (3,3) lost their signs"),
        compare(_SOURCE, "l_i, positive roots", "mm", [159.5270, 41.6830, 108.7461], roots[:, 1], 1e-4),
        compare(_SOURCE, "l_i, negative roots", "mm", [-80.9774, -157.8718, -60.5132], roots[:, 0], 1.5e-4,
                note="the print rounds an intermediate result"),
        compare(_SOURCE, "l_3, printed again below the roots", "mm", 108.741, roots[2, 1], 5e-4,
                mended=108.7461, digits=3, note="the print lost a digit: 108.7461 stands among the roots"),
        compare(_SOURCE, "orientation from the six printed angles", "°", _PRINTED_ANGLES, solved, 5e-3,
                digits=3, otherwise=CONTRADICTED,
                note="the print calls 3° to 4° a round-off error; solved properly, (0, 45, 45)° comes back"
                + NO_READING),
        compare(_SOURCE, "largest error of that orientation, printed as around 3° to 4°", "°", [3.0, 4.0],
                [np.abs(_PRINTED_ANGLES - [0.0, 45.0, 45.0]).max()] * 2, 0.0, digits=2, relation="within",
                note="of the printed angles themselves; it is no round-off error, see the row above"),
    ]  # fmt: skip
