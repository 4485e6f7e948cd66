"""Changes of the least multipliers, against differences of NumPy's least squares along a line of constant rank."""

import numpy as np
import pytest

from exo_pin.chain.derivatives.force_change_kernels import force_changes, open_changes

pytestmark = pytest.mark.usefixtures("plain")

H = 1e-4


class Line:
    """J(s) = (C + s C') (D + s D') of constant rank, and efforts that change with s."""

    def __init__(self, height, nv, passive, rank, seed):
        rng = np.random.default_rng(seed)
        self.passive = np.array(passive)
        self.row_scale, self.column = rng.uniform(0.5, 2.0, height), rng.uniform(0.5, 2.0, nv)
        self.C, self.dC = rng.normal(size=(2, height, rank))
        self.D, self.dD = rng.normal(size=(2, rank, nv))
        # At s = 0 nothing is missing, and the multipliers are the least.
        unit = self.row_scale[:, None] * self.column
        wanted = rng.normal(size=height)
        A = (self.J(0.0) * unit)[:, self.passive].T
        self.multipliers = self.row_scale * (np.linalg.pinv(A, rcond=1e-9) @ (A @ wanted))
        self.tau, self.dtau = self.J(0.0).T @ self.multipliers, rng.normal(size=nv)
        self.tau[np.setdiff1d(range(nv), self.passive)] += 3.0
        self.unit = unit

    def J(self, s):
        return (self.C + s * self.dC) @ (self.D + s * self.dD)

    def at(self, s, still=False):
        """Multipliers and efforts; with ``still`` the loops do not change."""
        J, tau = self.J(0.0 if still else s), self.tau + s * self.dtau
        A = (J * self.unit)[:, self.passive].T
        b = self.column[self.passive] * tau[self.passive]
        multipliers = self.row_scale * (np.linalg.pinv(A, rcond=1e-9) @ b)
        return multipliers, tau - J.T @ multipliers

    def change(self, still=False):
        ends = [self.at(s * H, still) for s in (1, -1, 2, -2)]
        return [(8 * (a - b) - (c - d)) / (12 * H) for a, b, c, d in zip(*ends, strict=True)]


@pytest.mark.parametrize(
    ("height", "nv", "passive", "rank"),
    [
        (3, 5, [0, 1, 3, 4], 3), (4, 5, [0, 2, 3], 2), (4, 6, [1, 4], 2), (2, 6, [0, 1, 2, 3, 5], 2), (5, 4, [2], 1),
        (3, 3, [0, 1, 2], 1),
    ],
)  # fmt: skip
@pytest.mark.parametrize("seed", [0, 1])
def test_changes_of_the_least_multipliers_are_differences(height, nv, passive, rank, seed):
    line = Line(height, nv, passive, rank, seed)
    multipliers, left = line.at(0.0)
    np.testing.assert_allclose(multipliers, line.multipliers, atol=1e-10)
    np.testing.assert_allclose(left[line.passive], 0.0, atol=1e-10)
    along = (line.dC @ line.D + line.C @ line.dD)[None]
    # Of q the efforts at constant multipliers change with J, too; of v and a, J is still.
    moved, change = np.zeros((4, 3, nv, 1)), np.zeros((3, height, 1))
    moved[3, :, :, 0] = line.dtau
    moved[3, 0, :, 0] -= along[0].T @ line.multipliers
    scales = line.row_scale, line.column, None
    force_changes(moved, along, line.multipliers, scales, line.J(0.0), line.passive, 5, 0.0, change)
    for kind, still in ((0, False), (1, True), (2, True)):
        expected, efforts = line.change(still)
        np.testing.assert_allclose(change[kind, :, 0], expected, atol=1e-6 * (1.0 + np.abs(expected).max()))
        np.testing.assert_allclose(moved[3, kind, :, 0], efforts, atol=1e-6 * (1.0 + np.abs(efforts).max()))
        if rank == len(passive):
            np.testing.assert_array_equal(moved[3, kind, line.passive, 0], 0.0)


def test_without_passive_coordinates_no_multiplier_changes():
    line = Line(3, 4, [0, 1], 2, 0)
    moved, change = np.ones((4, 3, 4, 2)), np.zeros((3, 3, 2))
    force_changes(moved, np.ones((2, 3, 4)), np.ones(3), (line.row_scale, line.column, None), line.J(0.0),
                  np.zeros(0, dtype=np.int64), 5, 0.0, change)  # fmt: skip
    assert not change.any()
    np.testing.assert_array_equal(moved[3], 1.0)


def test_changes_of_the_open_tree_are_products_of_its_derivatives():
    rng, nv, d, height = np.random.default_rng(3), 4, 2, 3
    by_q, by_v, M = rng.normal(size=(3, nv, nv))
    M = M + M.T
    along, multipliers = rng.normal(size=(d, height, nv)), rng.normal(size=height)
    moved = np.zeros((4, 3, nv, d))
    moved[:3] = rng.normal(size=(3, 3, nv, d))
    given = moved.copy()
    # Of the mass matrix the lower half alone is read.
    open_changes((by_q, by_v, np.tril(M)), along, multipliers, moved)
    dq, dv, da = given[0, 0], given[1], given[2]
    loops = np.einsum("kri,r->ik", along, multipliers)
    np.testing.assert_allclose(moved[3, 0], by_q @ dq + by_v @ dv[0] + M @ da[0] - loops)
    np.testing.assert_allclose(moved[3, 1], by_v @ dq + M @ da[1])
    np.testing.assert_allclose(moved[3, 2], M @ dq)
    np.testing.assert_array_equal(moved[:3], given[:3])
