"""Motions without inertia, and lawful moments."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import MasslessMotion
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.dynamics.equations.equations_of_motion import inertia_matrix, massless_motion
from exo_pin.chain.formats.bodies import lawful_moments

pytestmark = pytest.mark.usefixtures("plain")


def test_motions_without_inertia_are_named_the_most_moved_first():
    """A rod on two hinges in its line: they may turn against each other, and nothing moves."""
    model = pin.Model()
    for k, ratio in enumerate((1.0, 1.0)):
        model.addJoint(k, pin.JointModelRZ(), pin.SE3.Identity(), f"spin_{k}")
        inertia = np.diag([1.0, 1.0, ratio if k else 0.0])
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), inertia), pin.SE3.Identity())
    model.addJoint(2, pin.JointModelRX(), pin.SE3.Identity(), "swing")
    model.appendBodyToJoint(3, pin.Inertia(1.0, np.array([0.0, 0.0, -1.0]), np.eye(3)), pin.SE3.Identity())
    state = ClosedChain(model, Closures("rod"))._state
    q = np.array([0.3, 0.2, 0.1])
    assert sorted(massless_motion(state, q, np.eye(3)).joints) == ["spin_0", "spin_1"]
    with pytest.raises(MasslessMotion, match="spin"):
        ClosedChain(model, Closures("rod")).forward_dynamics(q)
    M = inertia_matrix(state, q)
    np.testing.assert_array_equal(M, M.T)


@pytest.mark.parametrize(
    ("moments", "expected"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        ([1.0, 2.0, 2.5], [1.0, 2.0, 2.5]),
        ([1.0, 2.0, 3.3], [1.1, 2.1, 3.2]),
        ([-1.0, 2.0, 3.5], [0.5, 2.5, 3.0]),
        ([-1.0, 2.0, 2.0], [0.0, 2.0, 2.0]),
        ([0.0, 0.0, 3.0], [1.0, 1.0, 2.0]),
    ],
)
def test_lawful_moments_are_the_nearest(moments, expected):
    np.testing.assert_allclose(lawful_moments(np.array(moments)), expected, atol=1e-15)
