"""Next to a singular configuration forces and accelerations are refused, not computed from rounding."""

import numpy as np
import pytest
from mechanisms import random_loop

from exo_pin import NearSingularConfiguration
from exo_pin.chain.dynamics.equations.equations_of_motion import CERTAIN, refuse_near_singular
from exo_pin.chain.kinematics.rank import RESOLVED


@pytest.mark.parametrize("size", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize(
    ("passive", "least"), [(None, 0.1), ([0, 1, 2, 3], 0.1), ([1, 3], 0.1), ([0, 3], 1.0), ([0, 2], 1.0)]
)
def test_a_value_with_more_than_a_thousandth_of_error_is_refused(size, passive, least):
    """Values s and s/10, scaled: closed to a gap g, the configuration is known to 10 g/s, and each value to 10 g."""
    state = random_loop("spherical").chain()._state
    # The slide and three hinges.
    places, scaled = np.array([2, 0, 1, 3]), np.zeros((3, state.nv))
    scaled[:2, places] = size * np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.1, 1e-16, 0.0]])
    assert state.topology.metres[places].tolist() == [True, False, False, False]
    J = scaled / state.topology.row_scale[:, None] / state.topology.column
    q, passive = np.zeros(state.nq), None if passive is None else places[passive]
    edge = RESOLVED * 0.1 * size * least
    refuse_near_singular(state, q, J, 0.99 * edge, 0.0, passive)
    with pytest.raises(NearSingularConfiguration) as caught:
        refuse_near_singular(state, q, J, 1.01 * edge, 0.0, passive)
    assert caught.value.singular_value == pytest.approx(size * least)
    assert caught.value.error == pytest.approx(1.01 * edge / 0.1)
    # Not asked where a bound of the values is large enough, nor without rows.
    refuse_near_singular(state, q, J, 1.01 * edge, 1.01 * CERTAIN, passive)
    with pytest.raises(NearSingularConfiguration):
        refuse_near_singular(state, q, J, 1.01 * edge, 0.99 * CERTAIN, passive)
    refuse_near_singular(state, q, J[:0], 1.01 * edge, 0.0, passive)
