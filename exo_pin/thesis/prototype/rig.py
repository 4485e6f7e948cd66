"""The test rig of Section 5.1: Tables 5-1 and 5-2, and what the text says of them."""

from __future__ import annotations

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ...core.conventions import thesis_rotation
from ...core.validation import FloatArray
from ...design import preset
from ...wrist import singularity
from ..rows import Row, printed_table, row

#: |A_i| = |B_i| of the test rig, mm: all that is printed of it.
RIG_RADIUS = 219.2
STATIC, KINEMATICS, _POSES = (printed_table(name) for name in ("table_5_1", "table_5_2", "section_5_1_2"))


def _fitted_lengths() -> FloatArray:
    """Lengths, mm, of the rings of (4-2), alike on base and platform, that come closest to Table 5-1."""
    matrices = Rotation.from_euler("XYZ", STATIC["angles"], degrees=True).as_matrix()

    def lengths(p: FloatArray) -> FloatArray:
        r, h, alpha = RIG_RADIUS * np.sin(p[0]), RIG_RADIUS * np.cos(p[0]), p[1:]
        A = np.stack([r * np.cos(alpha), -h + 0 * alpha, r * np.sin(alpha)], axis=-1)
        B = np.stack([r * np.cos(alpha), r * np.sin(alpha), -h + 0 * alpha], axis=-1)
        return np.linalg.norm(np.einsum("kij,nj->kni", matrices, B) - A, axis=-1)

    rng = np.random.default_rng(0)
    starts = np.column_stack([rng.uniform(0.2, 1.4, 20), rng.uniform(0, 2 * np.pi, (20, 3))])
    fits = [
        scipy.optimize.least_squares(lambda p: (lengths(p) - STATIC["estimated"]).ravel(), start) for start in starts
    ]
    return lengths(min(fits, key=lambda fit: fit.cost).x)


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis Table 5-1, Table 5-2.
    """
    return [*_static_tests(), *_forward_kinematics()]


def _static_tests() -> list[Row]:
    far = STATIC["shifts"][-1]
    angles = np.linspace(80.0, 100.0, 201)
    geometry = preset("prototype").geometry
    determinants = singularity(geometry, thesis_rotation(angles, 0, 0, degrees=True)).determinant
    return [
        row("rig.estimated_lengths", _fitted_lengths()),
        row("rig.size_of_O_B_cases", np.abs(STATIC["estimated"] - STATIC["measured"]).max(axis=1),
            printed=np.linalg.norm(STATIC["shifts"], axis=1)),
        row("rig.largest_component", np.abs(STATIC["shifts"][:-1]).max()),
        row("rig.largest_component_of", np.abs(far).max(), values=(np.linalg.norm(far),)),
        row("rig.theta_x_of_the_singular", angles[np.abs(determinants).argmin()]),
    ]  # fmt: skip


def _forward_kinematics() -> list[Row]:
    off = np.concatenate(
        [KINEMATICS["inverse"] - KINEMATICS["forward"], KINEMATICS["inverse_B"] - KINEMATICS["forward_B"]]
    )
    differences = np.abs(_POSES["sensor"] - _POSES["estimate"])
    theta = np.radians(KINEMATICS["measured_angles"])
    lengths = -2 * RIG_RADIUS * np.sin(theta)
    # Y_A points from A_i to O, and the limb has -sin θ_xA along it, whatever θ_yA is.
    reached = np.hypot(lengths * np.cos(theta), RIG_RADIUS + lengths * np.sin(theta))
    return [
        row("rig.differences_of_measured", differences),
        row("rig.largest_difference", np.abs(off).max()),
        row("rig.largest_error_of", differences.max()),
        row("rig.error_of_the_potentiometers", 100 * (305 - 300) / 300),
        row("rig.theta_xA_for_the", np.degrees(np.arcsin(-KINEMATICS["inverse"] / (2 * RIG_RADIUS)))),
        row("rig.l_i_for_the_measured", lengths),
        row("rig.B_i", reached),
    ]  # fmt: skip
