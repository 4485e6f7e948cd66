"""Blocks of the constraint Jacobian, what is clearly regular, and least motions, against whole decompositions."""

import itertools

import numpy as np
import pytest
from closed_chains import CHAINS, off

from exo_pin.chain.kinematics.kernels.dependent_kernels import dependent_on, nearest_motion
from exo_pin.chain.kinematics.rank import RESOLVED, configuration_error, least_motion, rank_tolerance
from exo_pin.chain.structure.topology import blocks_of


def is_clearly_regular(J, scales, joints, residual):
    return nearest_motion(np.ascontiguousarray(J), np.zeros(len(J)), scales, joints, residual, False)[2]


def block_diagonal(rng, values):
    """A matrix with blocks of the given singular values in shuffled rows and columns, one closure a block.

    Returns the matrix, scales of rows and columns that are taken out of it, and its blocks.
    """
    shapes = [(len(own), len(own) + int(rng.integers(0, 3))) for own in values]
    height, width = (sum(side) for side in zip(*shapes, strict=True))
    columns, matrix, rows = rng.permutation(width + 2), np.zeros((height, width + 2)), [0]
    signs = np.zeros((len(values), width + 2))
    for k, ((m, n), own) in enumerate(zip(shapes, values, strict=True)):
        left, right = (np.linalg.qr(rng.normal(size=(side, side)))[0] for side in (m, n))
        mine, columns = columns[:n], columns[n:]
        matrix[rows[-1] : rows[-1] + m, mine] = (left * own) @ right[:m]
        signs[k, mine] = 1.0
        rows.append(rows[-1] + m)
    row_scale, column = rng.uniform(0.1, 10.0, height), rng.uniform(0.1, 10.0, width + 2)
    return matrix / row_scale[:, None] / column, matrix, row_scale, column, blocks_of(signs, np.array(rows))


def depends_on_rounding(matrix, joints, residual):
    """The definition, by a singular value decomposition of the whole matrix."""
    values = np.linalg.svd(matrix, compute_uv=False)
    tolerance = rank_tolerance(matrix.shape, float(values[0]), joints, residual)
    error = configuration_error(values, tolerance, joints, residual) * values[0]
    return error > RESOLVED * values[np.count_nonzero(values > tolerance) - 1]


@pytest.mark.parametrize("name", CHAINS)
def test_the_jacobian_is_zero_outside_its_blocks(name):
    chain, q = CHAINS[name]
    J = chain.constraint_jacobian(off(chain, q, np.random.default_rng(1), 0.1))
    rows, columns, row_starts, column_starts = chain._state.topology.blocks
    np.testing.assert_array_equal(np.sort(rows), np.arange(chain.row_count))
    inside = np.zeros(J.shape, dtype=bool)
    for b in range(len(row_starts) - 1):
        own, mine = rows[row_starts[b] : row_starts[b + 1]], columns[column_starts[b] : column_starts[b + 1]]
        inside[np.ix_(own, mine)] = True
    assert not J[~inside].any()


def test_closures_are_in_one_block_if_they_share_a_coordinate_by_any_way():
    signs = np.array([[1, -1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 1, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0]], dtype=float)
    rows, columns, row_starts, column_starts = blocks_of(signs, np.array([0, 3, 4, 6, 7]))
    found = [set(rows[first:last].tolist()) for first, last in itertools.pairwise(row_starts)]
    assert sorted(map(sorted, found)) == [[0, 1, 2, 4, 5], [3], [6]]
    moved = [set(columns[first:last].tolist()) for first, last in itertools.pairwise(column_starts)]
    assert sorted(map(sorted, moved)) == [[0, 1, 3], [2], [4]]


@pytest.mark.full
@pytest.mark.parametrize("smallest", [1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-12, 0.0])
@pytest.mark.parametrize("residual", [0.0, 1e-12, 1e-9])
def test_what_counts_as_clearly_regular_does_not_depend_on_rounding(smallest, residual):
    rng = np.random.default_rng(3)
    for _ in range(30):
        values = [rng.uniform(0.3, 2.0, rng.integers(1, 5)) for _ in range(3)]
        for own in values[: rng.integers(1, 4)]:
            own[-1] = smallest
            if rng.random() < 0.3:
                own[0] = 0.0
        J, matrix, row_scale, column, blocks = block_diagonal(rng, values)
        regular = is_clearly_regular(J, (row_scale, column, blocks), 10, residual)
        assert not (regular and depends_on_rounding(matrix, 10, residual))
        # And it is of use: away from singular configurations it is true.
        if smallest >= 1e-2 or (smallest == 0.0 and residual == 0.0):
            assert regular


def test_least_motions_are_those_of_the_whole_matrix():
    rng = np.random.default_rng(5)
    for _ in range(20):
        values = [rng.uniform(0.3, 2.0, rng.integers(1, 5)) for _ in range(3)]
        values[0][-1] = 0.0
        J, matrix, row_scale, column, blocks = block_diagonal(rng, values)
        right = rng.normal(size=len(J))
        x, motions = least_motion(J, right, (row_scale, column, blocks), 10, 0.0, True)
        np.testing.assert_allclose(x / column, np.linalg.pinv(matrix, 1e-9) @ (row_scale * right), atol=1e-12)
        rank = sum(np.count_nonzero(own) for own in values)
        assert motions.shape == (len(column), len(column) - rank)
        np.testing.assert_allclose(matrix @ motions, 0.0, atol=1e-13)
        np.testing.assert_allclose(motions.T @ motions, np.eye(motions.shape[1]), atol=1e-13)
        assert least_motion(J, right, (row_scale, column, blocks), 10, 0.0, False)[1].shape[1] == 0


def test_nearest_motions_from_the_rows_are_those_of_the_singular_values():
    rng = np.random.default_rng(6)
    for smallest in (1.0, 1e-3, 1e-9, 0.0):
        for _ in range(20):
            values = [rng.uniform(0.3, 2.0, rng.integers(1, 5)) for _ in range(3)]
            values[0][-1] = smallest
            J, matrix, row_scale, column, blocks = block_diagonal(rng, values)
            scales = row_scale, column, blocks
            right = J @ rng.normal(size=len(column))
            expected, other = least_motion(J, right, scales, 10, 1e-12, True)
            x, motions, regular = nearest_motion(J, right, scales, 10, 1e-12, True)
            size = np.abs(expected / column).max()
            rounding = 1e-14 / smallest if smallest else 1e-12
            np.testing.assert_allclose(x / column, expected / column, rtol=0, atol=10 * rounding * size)
            np.testing.assert_allclose(motions @ motions.T, other @ other.T, rtol=0, atol=10 * rounding)
            np.testing.assert_allclose(motions.T @ motions, np.eye(other.shape[1]), atol=1e-13)
            assert not (regular and depends_on_rounding(matrix, 10, 1e-12))
            assert regular == (smallest in (1.0, 1e-3)) or smallest == 0.0
            assert nearest_motion(J, right, scales, 10, 1e-12, False)[1].shape[1] == 0


def plain_scales(J, row_scale=1.0, column=1.0):
    """Scales of one block, in which all is in radians if none are given."""
    m, n = J.shape
    blocks = np.arange(m), np.arange(n), np.array([0, m]), np.array([0, n])
    return row_scale * np.ones(m), column * np.ones(n), blocks


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("residual", [1e-7, 1e-12])
@pytest.mark.parametrize(("share", "rank"), [(0.4, 1), (0.9, 1), (1.2, 2), (4.0, 2)])
def test_ranks_do_not_depend_on_the_size_of_the_matrix(size, residual, share, rank, plain):
    """Two rows at right angles, the second near what an error of the entries by the residual makes: 3 |J| of it."""
    right = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 0.0]])
    J = size * right / np.linalg.norm(right, axis=1)[:, None] * np.array([[1.0], [3.0 * residual * share]])
    scales, b = plain_scales(J), J @ np.array([1.0, 2.0, 3.0])
    expected = np.linalg.pinv(J[:rank]) @ b[:rank]
    for solve in (least_motion, nearest_motion):
        x, motions = solve(J, b, scales, 3, residual, True)[:2]
        np.testing.assert_allclose(x, expected, atol=1e-3)
        assert motions.shape == (3, 3 - rank)
    assert not is_clearly_regular(J, scales, 3, residual) or rank == 1
    # By columns: each of the triangle's is as long as what is left of the column.
    order, found, x, _, triangle, tolerance, _ = dependent_on(
        np.ascontiguousarray(J.T), np.zeros((3, 0)), np.ones(2, dtype=bool), plain_scales(J.T), 3, residual
    )
    assert found == rank
    assert tolerance == pytest.approx(rank_tolerance((3, 2), size, 3, residual), rel=1e-6)
    np.testing.assert_allclose(np.abs(np.diag(triangle)), np.linalg.norm(J, axis=1)[:rank], rtol=1e-3)
    assert order.tolist() == [0, 1]
    assert x.shape == (rank, 2 - rank)


@pytest.mark.parametrize("size", [1e-2, 1.0, 30.0])
@pytest.mark.parametrize("other", [0.0, 0.5])
def test_regular_is_an_error_of_a_thousandth_of_the_weakest_row(size, other, plain):
    """Rows at right angles of lengths s and s/2: weakest² is the inverse of the sum of 1/s², largest² the sum of s²."""
    rows = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]])
    lengths = size * np.array([1.0, other])[: 2 if other else 1]
    J = lengths[:, None] * rows[: len(lengths)]
    weakest, largest = 1.0 / np.sqrt(np.sum(lengths**-2)), np.sqrt(np.sum(lengths**2))
    edge = RESOLVED * weakest**2 / largest
    # In rows and coordinates of any units.
    scales = plain_scales(J, np.array([20.0, 0.05])[: len(J)], np.array([30.0, 0.02, 1.0]))
    given = J / scales[0][:, None] / scales[1]
    for share, regular in ((0.99, True), (1.01, False)):
        x, _, clear = nearest_motion(given, given @ scales[1], scales, 3, share * edge, False)
        assert clear == regular
        np.testing.assert_allclose(x / scales[1], np.linalg.pinv(J) @ J @ np.ones(3), atol=1e-9)


@pytest.mark.parametrize("size", [1e-2, 1.0])
def test_a_row_that_is_nearly_another_is_not_left_out_of_a_small_matrix(size, plain):
    """Twice the same row but for 1e-5 of it, known to 1e-6 of a characteristic length: weak, and not redundant."""
    J = size * np.array([[1.0, 0.0, 0.0], [1.0, 1e-5, 0.0]])
    assert not is_clearly_regular(J, plain_scales(J), 3, 1e-6)
    assert is_clearly_regular(J[:1], plain_scales(J[:1]), 3, 1e-6 * size)
