"""The example of Scenario One, Section 4.2.2: six base angles, limb lengths, and the orientation back."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import thesis_angles, thesis_rotation
from ..core.validation import FloatArray
from ..design import preset
from ..wrist import inverse_kinematics
from .rows import Row, printed_table, row

PRINTED = printed_table("scenario_one")


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
    mended = PRINTED["matrices"].copy()
    mended[2, 0, 1], mended[2, 2, 2] = -0.5331, -0.6489
    roots = _roots(matrices[:, :, 2]) * 1e3
    # The printed route with the printed, rounded angles: directions, positive roots, then R from the three points.
    directions = _joint_matrices(np.radians(PRINTED["theta_x"]), np.radians(PRINTED["theta_y"]))[:, :, 2]
    points = geometry.base_points + _roots(directions)[:, 1:] * directions
    matrix = np.linalg.solve(geometry.platform_points, points).T
    solved = thesis_angles(Rotation.from_matrix(matrix), degrees=True)
    return [
        row("scenario_one.A_2", geometry.base_points[1] * 1e3),
        row("scenario_one.B_2", geometry.platform_points[1] * 1e3),
        row("scenario_one.height_of_A_1_over", np.hypot(*geometry.base_points[2, [0, 2]]) * 1e3),
        row("scenario_one.height_of_B_1_over", np.hypot(*geometry.platform_points[2, :2]) * 1e3),
        row("scenario_one.theta_yA_at_0_45", theta_y),
        row("scenario_one.theta_xA_at_0_45", theta_x),
        row("scenario_one.R_A1_R_OA1", matrices[0]),
        row("scenario_one.R_A2_R_OA2", matrices[1]),
        row("scenario_one.R_A3_R_OA3", matrices[2], mended=mended[2]),
        row("scenario_one.l_i_positive_roots", roots[:, 1]),
        row("scenario_one.l_i_negative_roots", roots[:, 0]),
        row("scenario_one.l_3_printed_again", roots[2, 1]),
        row("scenario_one.orientation_from", solved),
        row("scenario_one.largest_error_of", [np.abs(PRINTED["angles"] - [0.0, 45.0, 45.0]).max()] * 2),
    ]  # fmt: skip
