"""Parts of the searches on the singular surface alone: first zeros, least turns, and cells of a grid."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from exo_pin.numerics.polynomial import MAX_DEGREE
from exo_pin.wrist.singularities.singular_surface import _first_zero, _nearest


def unit_rows(rng, count):
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def first_zero(axis, a, b):
    room = np.empty(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1), np.empty(2 * MAX_DEGREE), np.empty((3, 3, 3))
    return _first_zero(axis, a, b, *room)


def surface(axis, angle, a, b):
    """det[a_i × b_i] after turns about an axis."""
    turned = Rotation.from_rotvec(np.multiply.outer(angle, axis)).as_matrix() @ b.T
    return np.linalg.det(np.cross(a, np.swapaxes(turned, -1, -2)))


@pytest.mark.full
@pytest.mark.usefixtures("plain")
def test_no_other_axis_leads_to_the_surface_sooner():
    """From few directions: a minimum of the angle near each, and the least of them."""
    rng = np.random.default_rng(203)
    a, b = unit_rows(rng, 3), unit_rows(rng, 3)
    directions, axis = unit_rows(rng, 5), np.empty(3)
    least = _nearest(a, b, directions, axis)
    assert np.linalg.norm(axis) == pytest.approx(1.0, abs=1e-14)
    assert first_zero(axis, a, b) == least
    assert least <= min(first_zero(one, a, b) for one in directions)
    better = minimize(
        lambda v: first_zero(v / np.linalg.norm(v), a, b), axis, method="Nelder-Mead", options={"xatol": 1e-6}
    )
    assert better.fun > least - 1e-10
    # The gradient along the surface is the axis: with it as normal the turn is straight.
    h, slopes = 1e-6, []
    for step in np.eye(3):
        ends = [surface(step, s * h, a, Rotation.from_rotvec(least * axis).apply(b)) for s in (1, -1)]
        slopes.append((ends[0] - ends[1]) / (2 * h))
    assert np.linalg.norm(np.cross(slopes, axis)) < 1e-5 * np.linalg.norm(slopes)
