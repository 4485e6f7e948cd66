"""Parts of the dynamics alone: sure accelerations, margins of what holds, drift of the energy, missing actuators."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar

from exo_pin import LoopNotClosed, UndrivenMotion
from exo_pin.chain import CLOSED, ClosedChain, Closures, Simulation
from exo_pin.chain.dynamics.equations.equation_kernels import _factor, clear_motion
from exo_pin.chain.dynamics.equations.equations_of_motion import MASSLESS
from exo_pin.chain.dynamics.integration import Instant
from exo_pin.chain.dynamics.nonsmooth import projected_motion as projected
from exo_pin.chain.dynamics.simulation import _simulation
from exo_pin.chain.kinematics.loops import residual
from exo_pin.core import errors

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


@pytest.mark.parametrize("n", [1, 2, 4])
def test_a_cholesky_factor_with_the_size_of_its_inverse(n):
    B = np.random.default_rng(n).normal(size=(n, n))
    A = B @ B.T + 0.1 * np.eye(n)
    L = np.linalg.cholesky(A)
    given = A.copy()
    total = _factor(given)
    np.testing.assert_allclose(np.tril(given), L, atol=1e-12)
    assert total == pytest.approx((np.linalg.inv(L) ** 2).sum())
    assert total >= 1.0 / np.linalg.eigvalsh(A)[0]
    wrong = A - 2.0 * np.linalg.eigvalsh(A)[-1] * np.eye(n)
    assert _factor(wrong) == INF
    assert _factor(np.zeros((n, n))) == INF


def sure_motion(chain, q, v, tau, masses=1.0, massless=MASSLESS):
    state = chain._state
    work, nv = state.buffers, state.nv
    work.jacobian_rates(q, v)
    forces = tau - pin.nonLinearEffects(chain.model, chain.model.createData(), q, v)
    lower = masses * np.reshape(pin.crba(chain.model, work.data, q), (nv, nv)).T
    return clear_motion(
        work.poses, work.J, work.dJ, v, work.q, work.constants, work.gap, work.jacobian, work.jacobian_rate,
        work.drift, lower, forces, (0.0, CLOSED, massless),
    )  # fmt: skip


@pytest.mark.parametrize("named", [four_bar(), five_bar()])
def test_sure_accelerations_are_those_of_gauss_principle(named):
    """M a = forces + Jᵀλ with J a + drift = 0, by least squares."""
    chain, rng = named.chain(), np.random.default_rng(4)
    q, nv = chain.close(named.q), chain.model.nv
    v, tau = chain.project_velocity(q, rng.normal(size=nv)), rng.normal(size=nv)
    found, status, a, (largest, scaled, size, finite) = sure_motion(chain, q, v, tau)
    assert status
    assert finite
    data = chain.model.createData()
    M, J, drift = pin.crba(chain.model, data, q), chain.constraint_jacobian(q), chain.constraint_drift(q, v)
    M = np.triu(M) + np.triu(M, 1).T
    forces = tau - pin.nonLinearEffects(chain.model, data, q, v)
    whole = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
    expected = np.linalg.lstsq(whole, np.concatenate([forces, -drift]), rcond=1e-12)[0][:nv]
    np.testing.assert_allclose(a, expected, atol=1e-9 * np.abs(expected).max())
    top = chain._state.topology
    assert size == pytest.approx(np.abs(a / top.column).max())
    assert largest < 1e-9
    assert scaled < 1e-9
    assert found[4]  # regular
    assert found[:2] == (np.abs(chain.residual(q)).max(), np.abs(chain.residual(q) * top.row_scale).max())
    column = top.column
    scaled_mass = M * column[:, None] * column
    # The motions of the loops alone.
    Z = np.linalg.svd(J * top.row_scale[:, None] * column)[2][np.linalg.matrix_rank(J, tol=1e-9) :].T
    reduced = Z.T @ scaled_mass @ Z
    total = (np.linalg.inv(np.linalg.cholesky(reduced)) ** 2).sum()
    edge = 1.0 / (max(np.trace(reduced), np.diag(scaled_mass).max()) * total)
    if len(reduced) == 1:  # of several the factor depends on their basis
        for share, expected in ((0.99, True), (1.01, False)):
            assert sure_motion(chain, q, v, tau, massless=share * edge)[1] == expected
    # Open loops are in doubt, and so is no mass at all.
    assert not sure_motion(chain, q + 1e-6, v, tau)[1]
    assert not sure_motion(chain, q, v, tau, 0.0)[1]


@pytest.mark.parametrize(("kinetic", "share"), [(0.5, 2.0), (4.0, 0.25), (0.0, 1.0)])
def test_drift_is_the_largest_change_that_work_and_loss_leave_over_the_kinetic_energy(kinetic, share):
    energy, work, lost = np.array([3.0, 5.5, 1.0]), np.array([0.0, 2.0, 1.0]), np.array([0.0, 0.5, 1.75])
    # Left: 5.5 - 2 + 0.5 - 3 = 1 and 1 - 1 + 1.75 - 3 = -1.25.
    none = np.zeros((3, 1))
    run = Simulation(np.arange(3.0), none, none, energy, np.array([0.0, kinetic, 0.0]), work, lost, np.zeros(3), 2)
    assert run.energy_drift == pytest.approx(1.25 * share)


def test_a_motion_tells_by_how_much_its_loops_open():
    state, q = five_bar().chain()._state, five_bar().q
    places = [q, q + 0.1, q - np.array([0.0, 0.3, 0.0, 0.0])]
    run = _simulation(state, np.arange(3.0), [Instant(there, np.zeros(4), 0.0, 0.0) for there in places], 2)
    for there, opening in zip(places, run.opening, strict=True):
        assert opening == np.abs(residual(state, there)).max()
    assert run.opening[0] < 1e-12
    assert min(run.opening[1:]) > 0.01


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


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_weights_are_of_all_that_a_joint_carries_at_the_scaled_motion(gravity):
    """Mass times gravity and acceleration of the size of the motion, at a characteristic length; nothing cancels."""
    chain, rng = five_bar().chain(), np.random.default_rng(10)
    chain.model.gravity.linear = np.array([0.0, 0.0, -gravity])
    q, names = chain.close(five_bar().q), list(chain.model.names)[1:]
    v = chain.project_velocity(q, rng.normal(size=4))
    a = chain.project_acceleration(q, v, rng.normal(size=4))
    found = chain.inverse_dynamics(q, v, a, actuated=names)._equations.weights()
    length, size = chain.characteristic_length, np.abs(a).max() + np.abs(v).max() ** 2
    # Each rod has 1 kg; a crank carries its forearm, too.
    expected = [length * (gravity + length * size) * (2.0 if "crank" in name else 1.0) for name in names]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    still = chain.inverse_dynamics(q, actuated=names)._equations.weights()
    np.testing.assert_allclose(still, [length * gravity * (2.0 if "crank" in name else 1.0) for name in names])


def test_a_truss_does_not_move_whatever_pulls_it():
    named = four_bar()
    whole = named.chain()
    chain = whole.locked(["crank_hinge"], named.q)
    q, nv = chain.close(named.q[1:]), chain.model.nv
    assert chain.mobility(q).degrees_of_freedom == 0
    for tau in (np.zeros(nv), np.array([3.0, -5.0])):
        found = chain.forward_dynamics(q, tau=tau)
        np.testing.assert_allclose(found.a, 0.0, atol=1e-12)
    motion = projected.response_at(chain._state, q)
    assert motion.response.shape[0] == nv
    assert not motion.response.any()
