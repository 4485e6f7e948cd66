"""Dead points: a mechanism that is as near to one as its loops are closed is at it, in one sample and in stacks."""

import mechanisms
import numpy as np
import pytest

from exo_pin import UndeterminedMotion

pytestmark = pytest.mark.usefixtures("plain")


def folded_four_bar():
    """The four-bar whose rocker lies on its coupler: the crank pushes along both and turns neither."""
    named = mechanisms.four_bar()
    # The rocker's pivot is as far from the crank's tip as the coupler is longer than the rocker.
    crank = np.arccos((0.3**2 + 0.4**2 - (np.sqrt(0.5) - 0.5) ** 2) / (2 * 0.3 * 0.4))
    line = np.arctan2(-0.3 * np.sin(crank), 0.4 - 0.3 * np.cos(crank))
    return named.chain(), np.array([crank, line - crank, line])


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
