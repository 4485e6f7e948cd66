"""Ways from rest over a grid, by floods."""

import numpy as np
import pytest
from scipy import ndimage

from exo_pin.workspace.kernels import (
    widest_path,
)

pytestmark = pytest.mark.usefixtures("plain")

FACES = ndimage.generate_binary_structure(3, 1)


def by_floods(value, start):
    """The greatest level at which each node is in one piece with the start."""
    found = np.full(value.shape, -np.inf)
    for level in np.unique(value[np.isfinite(value)]):
        labels, _ = ndimage.label(value >= level, FACES)
        if labels[start]:
            found[labels == labels[start]] = level
    return found


@pytest.mark.parametrize("shape", [(2, 3, 4), (1, 5, 3), (4, 1, 6), (3, 4, 1), (1, 1, 7)])
def test_widest_paths_go_through_faces_and_not_around_the_edges(shape):
    rng = np.random.default_rng(sum(shape))
    value = rng.integers(0, 6, shape).astype(float) + 1e-3 * rng.random(shape)
    value[tuple(rng.integers(0, side) for side in shape)] = -np.inf
    for _ in range(4):
        start = tuple(int(rng.integers(0, side)) for side in shape)
        if not np.isfinite(value[start]):
            continue
        flat, out = value.ravel(), np.full(value.size, np.nan)
        widest_path(flat, np.argsort(-flat), shape, int(np.ravel_multi_index(start, shape)), out)
        np.testing.assert_array_equal(out.reshape(shape), by_floods(value, start))
