"""Dead points: a mechanism that is as near to one as its loops are closed is at it, in one sample and in stacks."""

from dataclasses import replace

import mechanisms
import numpy as np
import pytest

from exo_pin import UndeterminedMotion
from exo_pin.chain import ClosedChain

pytestmark = pytest.mark.usefixtures("plain")


def folded_four_bar():
    """The four-bar whose rocker lies on its coupler: the crank pushes along both and turns neither."""
    named = mechanisms.four_bar()
    # The rocker's pivot is as far from the crank's tip as the coupler is longer than the rocker.
    crank = np.arccos((0.3**2 + 0.4**2 - (np.sqrt(0.5) - 0.5) ** 2) / (2 * 0.3 * 0.4))
    line = np.arctan2(-0.3 * np.sin(crank), 0.4 - 0.3 * np.cos(crank))
    return named.chain(), np.array([crank, line - crank, line])


def flat_parallelogram(tolerance=0.0):
    text, closures = mechanisms.flat_parallelogram()
    return ClosedChain.from_urdf(text, replace(closures, tolerance=tolerance))


@pytest.mark.parametrize(
    ("moved", "opened", "is_dead"), [(0.0, 0.0, True), (2e-7, 1e-8, True), (2e-7, 0.0, False), (1e-6, 1e-8, False)]
)
def test_the_crank_moves_nothing_at_a_dead_point_up_to_the_opening_of_the_loops(moved, opened, is_dead):
    chain, q = folded_four_bar()
    # The other two turn about the crank's tip and the pivot and keep the tips together: 0.7071 and 0.5 m from them.
    there = q + moved * np.array([0.0, 0.5, np.sqrt(0.5)]) + [0.0, 0.0, opened]
    # The rocker of 0.5 m opens the loop; what the other motion opens is of second order.
    np.testing.assert_allclose(np.abs(chain.residual(there)).max(), 0.5 * opened, atol=1e-12)
    for ask in (
        lambda: chain.split(there, ["crank_hinge"]),
        lambda: chain.reduced_jacobian(there, ["crank_hinge"]),
        lambda: chain.dependent_motion(there, ["crank_hinge"], [1.0]),
    ):
        if is_dead:
            with pytest.raises(UndeterminedMotion) as caught:
                ask()
            assert (caught.value.free, caught.value.joints) == (1, ("coupler_hinge", "rocker_hinge"))
        else:
            ask()


@pytest.mark.parametrize(
    ("moved", "opened", "tolerance", "is_flat"),
    [
        (0.0, 0.0, 0.0, True), (2e-8, 3e-9, 0.0, True), (2e-8, 0.0, 0.0, False), (1e-6, 3e-9, 0.0, False),
        (1e-6, 0.0, 1e-6, True), (1e-6, 0.0, 1e-9, False), (1e-4, 0.0, 1e-6, False),
    ],
)  # fmt: skip
def test_projections_see_a_flat_loop_up_to_its_opening_or_its_digits(moved, opened, tolerance, is_flat):
    """Flat, the tips allow every motion that does not part them across the line: one row and not two."""
    chain, v = flat_parallelogram(tolerance), np.array([0.3, -0.8, 0.5])
    across = np.array([0.6, 0.4, -0.2])
    free = v - across * (across @ v) / (across @ across)
    there = moved * np.array([0.0, 1.0, 2.0]) + opened * across  # one of the two motions at the dead point
    assert np.abs(chain.residual(there)).max() < 1e-8
    J = chain.constraint_jacobian(there)
    kept = free if is_flat else v - np.linalg.pinv(J, 1e-14) @ J @ v
    assert is_flat or np.abs(kept - free).max() > 0.05
    stack = np.tile(there, (2, 1))
    for found in (
        chain.project_velocity(there, v),
        chain.project_velocity(stack, np.tile(v, (2, 1)))[1],
        chain.project_acceleration(there, np.zeros(3), v),
        chain.project_acceleration(stack, np.zeros((2, 3)), np.tile(v, (2, 1)))[1],
    ):
        np.testing.assert_allclose(found, kept, atol=max(2e-7, 10.0 * moved))
