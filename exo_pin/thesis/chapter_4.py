"""Rows of Chapter 4: kinematics, with the printed formulas as they are, and the numbers of Scenario One."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.conventions import thesis_angles, thesis_rotation
from ..core.validation import FloatArray
from ..design import WristGeometry, preset
from ..wrist import LimbState, forward_kinematics, forward_kinematics_from_base_angles, inverse_kinematics
from ..wrist_chain import mechanism_urdf
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


def scenario_one_rows() -> list[Row]:
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


def _about(axis: int, angle: float) -> FloatArray:
    """(4-4) to (4-6): the matrices as printed, which turn the frame, not the vector."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        np.array([[1, 0, 0], [0, c, s], [0, -s, c]]),
        np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]),
        np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]),
    )[axis]


class _Example:
    """The mechanism of Scenario One in its pose (0, 45, 45)°, with all quantities of the equations."""

    def __init__(self) -> None:
        self.geometry: WristGeometry = preset("scenario-one").geometry
        self.pose = thesis_rotation(0, 45, 45, degrees=True)
        self.R: FloatArray = self.pose.as_matrix()
        self.state: LimbState = inverse_kinematics(self.geometry, self.pose)
        self.A, self.B = self.geometry.base_points, self.geometry.platform_points
        self.frames = self.geometry.base_frames
        self.x, self.y, self.l = self.state.base_theta_x, self.state.base_theta_y, self.state.lengths
        self.t = self.state.directions
        self.A2, self.B2 = (self.A**2).sum(axis=1), (self.B**2).sum(axis=1)
        # \bar A_i · R_Ai-1, -2, -3: the joint centre in its own frame.
        self.AR = np.einsum("ni,nij->nj", self.A, self.frames)


def rows() -> list[Row]:
    """Rows of the ledger."""
    e = _Example()
    return [_freedoms(), *_orientation(), *_joints(e), *_scenario_one(e), *_scenario_two(e), *scenario_one_rows()]


def _freedoms() -> Row:
    """Freedoms of the wrist without a ball joint, from the rank of its loop closures."""
    mechanism = preset("prototype")
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="wrist"))
    found = chain.mobility(chain.neutral())
    return row("chapter_4.degrees_of_freedom", found.degrees_of_freedom, values=(found.rank, found.rows))  # fmt: skip


def _orientation() -> list[Row]:
    angles = np.radians([20.0, -30.0, 10.0])
    pose = thesis_rotation(*angles)
    R = pose.as_matrix()
    x, y, z = angles
    turned = (_about(2, z) @ _about(1, y) @ _about(0, x)).T
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    written = np.array(
        [
            [cy * cz, -cy * sz, sy],
            [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -cy * sx],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
        ]
    )
    circles = preset("prototype").geometry.circles
    assert circles is not None
    alpha, geometry = circles.alpha_A, preset("prototype").geometry
    A = np.stack([circles.r_A * np.cos(alpha), -circles.h_A + 0 * alpha, circles.r_A * np.sin(alpha)], axis=1)
    B = np.stack([circles.r_B * np.cos(alpha), circles.r_B * np.sin(alpha), -circles.h_B + 0 * alpha], axis=1)
    lengths = np.linalg.norm(B @ R.T - A, axis=1)
    four = forward_kinematics(geometry, inverse_kinematics(geometry, pose).lengths)
    closest = float((four.rotations[four.valid] * pose.inv()).magnitude().min())
    far = thesis_rotation(0, -110, 0, degrees=True)
    S = far.as_matrix()
    printed = thesis_rotation(np.arctan(-S[1, 2] / S[2, 2]), np.arcsin(S[0, 2]), np.arctan(-S[0, 1] / S[0, 0]))
    mended = thesis_rotation(*thesis_angles(far))
    # A geometry of the thesis that has as many real solutions as there can be, if rarely: 9 of these 2,000 poses.
    many = preset("optimised-table-c-2").geometry
    drawn = Rotation.random(2000, rng=1)
    most = int(forward_kinematics(many, inverse_kinematics(many, drawn).lengths).count.max())
    return [
        row("chapter_4.real_solutions_from", most),
        row("chapter_4.l_i_of_the_prototype", inverse_kinematics(geometry, pose).lengths, printed=lengths),
        row("chapter_4.A_i_and_B_i_of_the", [geometry.base_points, geometry.platform_points],
            printed=[A, B]),
        row("chapter_4.R_at_20_30_10", R, printed=turned),
        row("chapter_4.R_at_20_30_10_entry", R, printed=written),
        row("chapter_4.error_of_the_closest", np.degrees(closest), values=(int(four.count),)),
        row("chapter_4.R_at_theta_0_110", S, printed=printed.as_matrix(), mended=mended.as_matrix()),
    ]  # fmt: skip


def _joints(e: _Example) -> list[Row]:
    """Frames and angles of the universal joints on the base.

    Source: thesis (4-26).
    """
    in_joint = np.einsum("nji,nj->ni", e.frames, e.t)
    cx, sx, cy, sy = np.cos(e.x), np.sin(e.x), np.cos(e.y), np.sin(e.y)
    right = np.stack([cx * sy, -sx, cx * cy], axis=1)
    wrong = np.stack([-sx, cx * sy, cx * cy], axis=1)
    written = np.stack([-sy, sx * cy, cx * cy], axis=1)
    proper = np.array([_about(1, b).T @ _about(0, a).T for a, b in zip(e.x, e.y, strict=True)])
    geometry = preset("prototype").geometry
    circles = geometry.circles
    assert circles is not None
    beta = np.arctan2(circles.r_A, circles.h_A)
    frames = np.array([(_about(0, -beta) @ _about(1, np.pi / 2 - alpha)).T for alpha in circles.alpha_A])
    vectors = e.B @ e.R.T - e.A
    return [
        row("chapter_4.limb_vectors_at", e.l[:, None] * e.t, printed=vectors),
        row("chapter_4.third_column_of", in_joint, printed=written, mended=proper[:, :, 2]),
        row("chapter_4.limb_vector_in_A_i", in_joint, printed=wrong, mended=right),
        row("chapter_4.R_Ai_of_the_prototype", geometry.base_frames, printed=frames),
        row("chapter_4.limb_vector_in_O_A", vectors,
            printed=e.l[:, None] * np.einsum("nij,nj->ni", e.frames, written),
            mended=e.l[:, None] * np.einsum("nij,nj->ni", e.frames, proper[:, :, 2])),
        row("chapter_4.K_i_against_R_B_i", e.B @ e.R.T,
            printed=e.l[:, None] * np.einsum("nij,nj->ni", e.frames, right) + e.A),
    ]  # fmt: skip


def _scenario_one(e: _Example) -> list[Row]:
    along = np.einsum("ij,ij->i", e.A, e.t)
    width = np.sqrt(along**2 - e.A2 + e.B2)
    K_printed, K = e.A - e.l[:, None] * e.t, e.A + e.l[:, None] * e.t
    six = forward_kinematics_from_base_angles(e.geometry, e.x, e.y)
    det = np.linalg.det(e.B)
    cofactors = np.linalg.inv(e.B) * det

    def by_cramer(points: FloatArray) -> FloatArray:
        return np.array([cofactors @ points[:, k] for k in range(3)]) / det

    return [
        row("chapter_4.l_i_t_i_against", e.A - e.B @ e.R.T, printed=e.l[:, None] * e.t, mended=-e.l[:, None] * e.t),
        row("chapter_4.left_side_at_the", np.zeros(3), printed=e.l**2 - 2 * along * e.l + e.A2 - e.B2,
            mended=e.l**2 + 2 * along * e.l + e.A2 - e.B2),
        row("chapter_4.larger_roots", e.l, printed=along + width, mended=-along + width),
        row("chapter_4.R_from_its_nine", e.R, printed=by_cramer(K_printed), mended=by_cramer(K)),
        row("chapter_4.pose_from_all_six", np.degrees((six.rotations[0] * e.pose.inv()).magnitude())),
    ]  # fmt: skip


def _scenario_two(e: _Example) -> list[Row]:
    cx, sx, cy, sy = np.cos(e.x), np.sin(e.x), np.cos(e.y), np.sin(e.y)
    pairs = [(0, 1), (1, 2), (2, 0)]
    product = np.einsum("nij,njk,nkm->nim", e.frames, _stack(1, e.y), _stack(0, e.x))
    squared = e.l**2 + e.A2 + 2 * e.l * cx * (sy * e.AR[:, 0] + cy * e.AR[:, 2]) - 2 * e.l * sx * e.AR[:, 1]
    K = e.A + e.l[:, None] * e.t
    chords = np.array([((e.B[i] - e.B[j]) ** 2).sum() for i, j in pairs])
    limb = e.l[:, None] * e.t
    printed_33 = [
        e.l[i] ** 2 + e.l[j] ** 2 - 2 * limb[i] @ limb[j] + ((e.A[i] - e.A[j]) ** 2).sum()
        + 2 * (e.A[i] - e.A[j]) @ (limb[i] - limb[j])
        for i, j in pairs
    ]  # fmt: skip
    alone = e.A2 + e.l**2 - e.B2 - 2 * e.l * sx * e.AR[:, 1]
    left_31 = (
        4 * cy**2 * e.l**2 * (e.AR[:, 2] ** 2 * cx**2 + e.AR[:, 2] ** 2 * sx**2)
        - 4 * cy * e.l * e.AR[:, 2] * cx * alone + alone**2 - 4 * e.l**2 * cx**2 * e.AR[:, 0] ** 2
    )  # fmt: skip
    # (4-32) divides by the first and third of e.AR and (4-34) has them above and below: zero in every pose.
    undefined = np.full(3, np.nan)
    quartic = (
        e.l**4 - 2 * e.l**3 * sx * e.AR[:, 1] + e.l**2 * (2 * e.A2 - 2 * e.B2 + sx**2 * e.AR[:, 1] ** 2)
        - 2 * e.l * sx * e.AR[:, 1] * (e.A2 - e.B2) + (e.A2 - e.B2) ** 2
    )  # fmt: skip
    mended = (e.l**2 + e.A2 - e.B2 - 2 * e.l * sx * e.AR[:, 1]) ** 2
    two = forward_kinematics_from_base_angles(e.geometry, theta_x=e.x, near=e.pose)
    proto = preset("prototype").geometry
    circles = proto.circles
    assert circles is not None
    on_ring = [
        circles.r_B**2
        * ((np.cos(circles.alpha_B[i]) - np.cos(circles.alpha_B[j])) ** 2
           + (np.sin(circles.alpha_B[i]) - np.sin(circles.alpha_B[j])) ** 2)
        for i, j in pairs
    ]  # fmt: skip
    between = [((proto.platform_points[i] - proto.platform_points[j]) ** 2).sum() for i, j in pairs]
    cramer = _printed_cramer(e.B, K)
    return [
        row("chapter_4.third_column_of_R_Ai", e.t, printed=product[:, :, 2]),
        row("chapter_4.left_side_against", e.B2, printed=squared),
        row("chapter_4.R_B_1_R_B_2_against", K[0] - K[1], printed=e.R @ (e.B[0] - e.B[1])),
        row("chapter_4.B_i_B_j_2_K_i_K_j", chords, printed=[e.B2[i] + e.B2[j] - 2 * K[i] @ K[j] for i, j in pairs]),
        row("chapter_4.B_i_B_j_of_the_prototype", between, printed=on_ring),
        row("chapter_4.left_side_at_the_true", np.zeros(3), printed=left_31),
        row("chapter_4.cos_theta_yA_by", cy, printed=undefined),
        row("chapter_4.left_side_against_B_i", chords, printed=printed_33),
        row("chapter_4.theta_yA_by_the", e.y, printed=undefined),
        row("chapter_4.R_from_K_i_by_the", e.R, printed=cramer),
        row("chapter_4.left_side_at_the_true_l_i", np.zeros(3), printed=quartic, mended=mended),
        row("chapter_4.pose_from_the_three", np.degrees((two.nearest_rotations * e.pose.inv()).magnitude()),
            values=(int(two.count),)),
    ]  # fmt: skip


def _stack(axis: int, angles: FloatArray) -> FloatArray:
    return np.array([_about(axis, angle).T for angle in angles])


def _printed_cramer(B: FloatArray, K: FloatArray) -> FloatArray:
    """Source: thesis (4-35), (4-36), (4-37)."""
    (b1x, b1y, b1z), (b2x, b2y, b2z), (b3x, b3y, b3z) = B
    below = b1x * b2y * b3z - b1x * b2z * b3y - b1y * b2x * b3z + b1y * b2z * b3x + b1z * b2x * b3y - b1z * b2y * b3x
    weights = np.array(
        [
            [b2y * b3z - b2z * b3y, b1z * b3y - b1y * b3z, b1y * b2z - b1z * b2y],
            [b2z * b3x - b2x * b3z, b1x * b3z - b1z * b3x, b1z * b2x - b1x * b2z],
            [b2x * b3y - b2y * b3x, b1y * b3x - b1x * b3y, b1x * b2y - b1y * b2x],
        ]
    )
    return np.array([weights @ K[:, k] for k in range(3)]) / below
