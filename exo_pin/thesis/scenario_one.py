"""The example of Scenario One, Section 4.2.2: six base angles, limb lengths, and the orientation back."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import thesis_angles, thesis_rotation
from ..core.validation import FloatArray
from ..design import preset
from ..wrist import inverse_kinematics
from .rows import Row, row

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
        row("scenario_one.A_2", geometry.base_points[1] * 1e3, note=points_note),
        row("scenario_one.B_2", geometry.platform_points[1] * 1e3, note=points_note),
        row("scenario_one.height_of_A_1_over", np.hypot(*geometry.base_points[2, [0, 2]]) * 1e3),
        row("scenario_one.height_of_B_1_over", np.hypot(*geometry.platform_points[2, :2]) * 1e3),
        row("scenario_one.theta_yA_at_0_45", theta_y, printed=_PRINTED_THETA_Y),
        row("scenario_one.theta_xA_at_0_45", theta_x, printed=_PRINTED_THETA_X),
        row("scenario_one.R_A1_R_OA1", matrices[0].ravel(), printed=PRINTED_MATRICES[0].ravel()),
        row("scenario_one.R_A2_R_OA2", matrices[1].ravel(), printed=PRINTED_MATRICES[1].ravel()),
        row("scenario_one.R_A3_R_OA3", matrices[2].ravel(), printed=PRINTED_MATRICES[2].ravel(),
            mended=mended[2].ravel()),
        row("scenario_one.l_i_positive_roots", roots[:, 1]),
        row("scenario_one.l_i_negative_roots", roots[:, 0]),
        row("scenario_one.l_3_printed_again", roots[2, 1]),
        row("scenario_one.orientation_from", solved, printed=_PRINTED_ANGLES),
        row("scenario_one.largest_error_of", [np.abs(_PRINTED_ANGLES - [0.0, 45.0, 45.0]).max()] * 2),
    ]  # fmt: skip
