"""The test rig of Section 5.1: Tables 5-1 and 5-2, and what the text says of them."""

from __future__ import annotations

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ...core.conventions import thesis_rotation
from ...core.validation import FloatArray
from ...design import preset
from ...wrist import singularity
from ..rows import Row, row

#: |A_i| = |B_i| of the test rig, mm: all that is printed of it.
RIG_RADIUS = 219.2
_RIG_NOTE = "of the rig only |A_i| = |B_i| = 219.2 mm is printed, which alone ties θ_xA to l: l = -2 |A| sin θ_xA"

#: Table 5-1: (θx, θy, θz) in degrees, and the lengths estimated from them, mm.
STATIC_ANGLES = np.array(
    [
        [0.9, 1.0, -26.2],
        [18.5, -2.3, 9.0],
        [32.0, -11.9, 7.2],
        [39.1, -5.1, 1.6],
        [39.5, -3.9, -3.8],
        [57.0, 12.4, -0.8],
    ]
)
STATIC_LENGTHS = np.array(
    [
        [278.4, 177.4, 176.6],
        [277.0, 183.9, 182.4],
        [271.9, 199.6, 184.1],
        [268.5, 199.5, 192.2],
        [268.5, 198.5, 194.1],
        [256.2, 198.0, 217.6],
    ]
)
#: Table 5-1: the lengths measured by hand, and the shift of the centre (5-1), mm.
_MEASURED_LENGTHS = np.array(
    [[275, 175, 175], [275, 180, 180], [270, 202, 182], [270, 196, 192], [270, 196, 193], [270, 210, 220]], dtype=float
)
_SHIFTS = np.array(
    [
        [-0.4, -2.3, 2.53],
        [1.8, 1.0, 3.8],
        [-6.6, -3.6, -3.5],
        [5.8, 5.2, 5.3],
        [0.5, 4.3, 5.2],
        [20.9, -13.7, 16.2],
    ]
)
#: Table 5-2: limb lengths and |B_i| by inverse and by forward kinematics, mm, and the measured θ_xA, degrees.
_INVERSE, _FORWARD = np.array([277.0, 184.0, 182.6]), np.array([271.4833, 182.4, 180.5])
_INVERSE_B, _FORWARD_B = np.array([219.2, 219.2, 219.2]), np.array([211.7, 217.6, 219.7])
_MEASURED_ANGLES = np.array([-83.6, 31.1, 34.4])
#: Orientation by the sensor and by forward kinematics, as the text of Section 5.1.2 prints both, degrees.
_SENSOR, _ESTIMATE = np.array([18.75, -2.33, 8.99]), np.array([15.55, -3.0, 6.5])


def _fitted_lengths() -> FloatArray:
    """Lengths, mm, of the rings of (4-2), alike on base and platform, that come closest to Table 5-1."""
    matrices = Rotation.from_euler("XYZ", STATIC_ANGLES, degrees=True).as_matrix()

    def lengths(p: FloatArray) -> FloatArray:
        r, h, alpha = RIG_RADIUS * np.sin(p[0]), RIG_RADIUS * np.cos(p[0]), p[1:]
        A = np.stack([r * np.cos(alpha), -h + 0 * alpha, r * np.sin(alpha)], axis=-1)
        B = np.stack([r * np.cos(alpha), r * np.sin(alpha), -h + 0 * alpha], axis=-1)
        return np.linalg.norm(np.einsum("kij,nj->kni", matrices, B) - A, axis=-1)

    rng = np.random.default_rng(0)
    starts = np.column_stack([rng.uniform(0.2, 1.4, 20), rng.uniform(0, 2 * np.pi, (20, 3))])
    fits = [scipy.optimize.least_squares(lambda p: (lengths(p) - STATIC_LENGTHS).ravel(), start) for start in starts]
    return lengths(min(fits, key=lambda fit: fit.cost).x)


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis Table 5-1, Table 5-2.
    """
    return [*_static_tests(), *_forward_kinematics()]


def _static_tests() -> list[Row]:
    far = _SHIFTS[-1]
    angles = np.linspace(80.0, 100.0, 201)
    geometry = preset("prototype").geometry
    determinants = singularity(geometry, thesis_rotation(angles, 0, 0, degrees=True)).determinant
    return [
        row("rig.estimated_lengths", _fitted_lengths().ravel(), printed=STATIC_LENGTHS.ravel()),
        row("rig.size_of_O_B_cases", np.abs(STATIC_LENGTHS - _MEASURED_LENGTHS).max(axis=1),
            printed=np.linalg.norm(_SHIFTS, axis=1)),
        row("rig.largest_component", np.abs(_SHIFTS[:-1]).max()),
        row("rig.largest_component_of", np.abs(far).max(), values=(np.linalg.norm(far),)),
        row("rig.theta_x_of_the_singular", angles[np.abs(determinants).argmin()]),
    ]  # fmt: skip


def _forward_kinematics() -> list[Row]:
    off = np.concatenate([_INVERSE - _FORWARD, _INVERSE_B - _FORWARD_B])
    differences = np.abs(_SENSOR - _ESTIMATE)
    theta = np.radians(_MEASURED_ANGLES)
    lengths = -2 * RIG_RADIUS * np.sin(theta)
    # Y_A points from A_i to O, and the limb has -sin θ_xA along it, whatever θ_yA is.
    reached = np.hypot(lengths * np.cos(theta), RIG_RADIUS + lengths * np.sin(theta))
    return [
        row("rig.differences_of_measured", differences),
        row("rig.largest_difference", np.abs(off).max()),
        row("rig.largest_error_of", differences.max()),
        row("rig.error_of_the_potentiometers", 100 * (305 - 300) / 300),
        row("rig.theta_xA_for_the", np.degrees(np.arcsin(-_INVERSE / (2 * RIG_RADIUS)))),
        row("rig.l_i_for_the_measured", lengths, printed=_FORWARD),
        row("rig.B_i", reached, printed=_FORWARD_B),
    ]  # fmt: skip
