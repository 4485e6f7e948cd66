"""The bound of Jacobians that are surely regular, by another pivoted QR."""

import numpy as np
import pytest
from scipy.linalg import qr

from exo_pin.chain.kinematics.kernels.dependent_kernels import nearest_motion
from exo_pin.chain.kinematics.rank import ROUNDING

pytestmark = pytest.mark.usefixtures("plain")


def is_clearly_regular(J, scales, joints, residual):
    return nearest_motion(J, np.zeros(len(J)), scales, joints, residual, False)[2]


@pytest.mark.parametrize("shape", [(3, 3), (2, 5), (4, 4), (3, 6)])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_bound_of_regular_jacobians_is_that_of_a_pivoted_triangle(shape, seed):
    """Sure up to the residual at which error and tolerance meet 1/|R⁻¹|, by SciPy's pivoted QR."""
    rng = np.random.default_rng(seed)
    m, n = shape
    row_scale, column = rng.uniform(0.5, 2.0, m), rng.uniform(0.5, 2.0, n)
    A, joints = rng.normal(size=shape), 5
    J = A / row_scale[:, None] / column
    blocks = np.arange(m), np.arange(n), np.array([0, m]), np.array([0, n])
    R = qr(A.T, mode="economic", pivoting=True)[1]
    weakest, most = 1.0 / np.linalg.norm(np.linalg.inv(R)), np.linalg.norm(A)
    sure = min(1e-3 * weakest**2 / most, 0.5 * weakest / (max(shape) * most) - joints * ROUNDING)
    for share, expected in ((0.999, True), (1.001, False)):
        assert is_clearly_regular(J, (row_scale, column, blocks), joints, share * sure) == expected
    # A row that repeats others exactly counts for nothing, nor does a row of zeros; one that nearly does is in doubt.
    for last in (0.3 * A[0] - A[1], np.zeros(n)):
        more = np.vstack([A, last])
        wide = np.arange(m + 1), np.arange(n), np.array([0, m + 1]), np.array([0, n])
        assert is_clearly_regular(more / column, (np.ones(m + 1), column, wide), joints, 1e-12)
        nearly = (more + 1e-7 * rng.normal(size=n)) / column
        assert is_clearly_regular(nearly, (np.ones(m + 1), column, wide), joints, 0.0) == (n == m)
    # Of several blocks the weakest and the largest count, wherever they are.
    for scales in ((1.0, 1e-2), (1e-2, 1.0)):
        both = np.zeros((2 * m, 2 * n))
        both[:m, :n], both[m:, n:] = scales[0] * A, scales[1] * A
        two = np.arange(2 * m), np.arange(2 * n), np.array([0, m, 2 * m]), np.array([0, n, 2 * n])
        least = 1e-2 * weakest
        sure = min(1e-3 * least**2 / most, 0.5 * least / (2 * max(shape) * most) - joints * ROUNDING)
        for share, expected in ((0.999, True), (1.001, False)):
            assert is_clearly_regular(both, (np.ones(2 * m), np.ones(2 * n), two), joints, share * sure) == expected
