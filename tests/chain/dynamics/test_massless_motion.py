"""Motions without inertia."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import MasslessMotion
from exo_pin.chain import ClosedChain, Closures

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
    with pytest.raises(MasslessMotion, match="spin") as refused:
        ClosedChain(model, Closures("rod")).forward_dynamics([0.3, 0.2, 0.1])
    assert sorted(refused.value.joints) == ["spin_0", "spin_1"]
