"""Answers of dynamics alone: drift of the energy, missing actuators, samples that do not close, and a truss."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar

from exo_pin import LoopNotClosed, UndrivenMotion
from exo_pin.chain import ClosedChain, Closures, Simulation
from exo_pin.core import errors

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize(("kinetic", "share"), [(0.5, 2.0), (4.0, 0.25), (0.0, 1.0)])
def test_drift_is_the_largest_change_that_work_and_loss_leave_over_the_kinetic_energy(kinetic, share):
    energy, work, lost = np.array([3.0, 5.5, 1.0]), np.array([0.0, 2.0, 1.0]), np.array([0.0, 0.5, 1.75])
    # Left: 5.5 - 2 + 0.5 - 3 = 1 and 1 - 1 + 1.75 - 3 = -1.25.
    none = np.zeros((3, 1))
    run = Simulation(np.arange(3.0), none, none, energy, np.array([0.0, kinetic, 0.0]), work, lost, np.zeros(3), 2)
    assert run.energy_drift == pytest.approx(1.25 * share)


def test_one_joint_that_nothing_drives_is_enough_to_refuse_a_motion():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "upright")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.addJoint(1, pin.JointModelRY(), pin.SE3.Identity(), "level")
    model.appendBodyToJoint(2, pin.Inertia(2.0, np.array([0.3, 0.0, 0.0]), np.eye(3)), pin.SE3.Identity())
    chain = ClosedChain(model, Closures("two"))
    for actuated in ([], ["upright"]):
        with pytest.raises(UndrivenMotion, match="level") as refused:
            chain.inverse_dynamics(np.zeros(2), actuated=actuated)
        assert "upright" not in str(refused.value)
        np.testing.assert_allclose(refused.value.missing, [0.0, -2.0 * 9.81 * 0.3], atol=1e-9)
    np.testing.assert_allclose(chain.inverse_dynamics(np.zeros(2), actuated=["level"]).tau, [0.0, -5.886])


def test_a_stack_names_the_samples_that_do_not_close():
    named = four_bar()
    chain = named.chain()
    q = np.array([named.q, named.q + np.array([0.1, 0.0, 0.0]), named.q + np.array([0.0, 0.02, 0.0])])
    held = ["crank_hinge", "rocker_hinge"]
    with pytest.raises(errors.SamplesFailed) as failed:
        chain.close(q, hold=held)
    assert list(failed.value.failures) == [1]
    assert isinstance(failed.value.failures[1], LoopNotClosed)
    assert np.isnan(failed.value.result[1]).all()
    np.testing.assert_allclose(failed.value.result[[0, 2]], [named.q, named.q], atol=1e-10)
    assert np.abs(chain.residual(failed.value.result[2])).max() <= 1e-12
    np.testing.assert_allclose(chain.close(q), [chain.close(row) for row in q], atol=1e-12)


def test_a_truss_does_not_move_whatever_pulls_it():
    named = four_bar()
    whole = named.chain()
    chain = whole.locked(["crank_hinge"], named.q)
    q, nv = chain.close(named.q[1:]), chain.model.nv
    assert chain.mobility(q).degrees_of_freedom == 0
    for tau in (np.zeros(nv), np.array([3.0, -5.0])):
        found = chain.forward_dynamics(q, tau=tau)
        np.testing.assert_allclose(found.a, 0.0, atol=1e-12)
