"""The test rig of Section 5.1: Tables 5-1 and 5-2."""

from __future__ import annotations

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray
from .rows import NO_READING, Row, compare

__all__ = ["RIG_RADIUS", "STATIC_ANGLES", "STATIC_LENGTHS", "rows"]

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
    inverse_lengths = np.array([277.0, 184.0, 182.6])
    measured = np.radians([-83.6, 31.1, 34.4])
    shift = np.array([20.9, -13.7, 16.2])
    return [
        compare("Table 5-1", "estimated lengths, cases 1, 15, 9, 14, 13, 12", "mm", STATIC_LENGTHS.ravel(),
                _fitted_lengths().ravel(), 0.1, digits=1,
                note="the rig's angles α are not printed; computed: the best fit of equal rings by (4-2), with (4-7); "
                "free joint centres at 219.2 mm and 48 readings of the angles come no nearer than 13 mm"),
        compare("Table 5-1, Section 5.1.2", "largest component of O_B in case 12, printed as around 20 mm", "mm", 20.0,
                np.abs(shift).max(), 1.0, digits=1,
                note=f"by direction, as the ±7 mm of the other cases; the distance is {np.linalg.norm(shift):.1f} mm"),
        compare("Table 5-2, inverse kinematics", "θ_xA for the lengths of that row", "°", [-75.4, -59.4, 43.4],
                np.degrees(np.arcsin(-inverse_lengths / (2 * RIG_RADIUS))), 0.1, digits=1,
                note=_RIG_NOTE + "; the last two are printed as θ_yA in the other row as well" + NO_READING),
        compare("Table 5-2, forward kinematics", "l_i for the measured θ_xA", "mm", [271.4833, 182.4, 180.5],
                -2 * RIG_RADIUS * np.sin(measured), 1.0, digits=1,
                note=_RIG_NOTE + "; a positive angle has no length" + NO_READING),
    ]  # fmt: skip
