import numpy as np
import pinocchio as pin
import pytest
from moving_chains import moving

from exo_pin.chain import ClosedChain, Closures

DOWN = np.array([0.0, -9.81, 0.0])
TEN_SECONDS = np.linspace(0.0, 10.0, 51)


@pytest.mark.full
@pytest.mark.parametrize(
    "name",
    [
        *("four-bar cut in a link", "five-bar", "Stewart platform"),
        *(
            pytest.param(name, marks=pytest.mark.full)
            for name in ("four-bar", "3RRR", "prismatic loop", "revolute loop")
        ),
    ],
)
def test_energy_and_loops_of_a_free_swing_are_constant_for_ten_seconds(name):
    case = moving(name)
    if name in ("four-bar", "four-bar cut in a link", "five-bar", "3RRR"):
        case.chain.model.gravity.linear = DOWN
    swing = case.chain.simulate(case.q, 0.3 * case.v, TEN_SECONDS)
    assert swing.kinetic_energy.max() > 10 * swing.kinetic_energy[0] or name == "3RRR"
    # rtol 1e-9 a step and some thousand steps.
    assert swing.energy_drift <= 1e-7
    assert swing.opening.max() <= 1e-12
    for q, v in zip(swing.q, swing.v, strict=True):
        assert np.abs(case.chain.constraint_jacobian(q) @ v).max() <= 1e-10 * (1 + np.abs(v).max())


def test_a_pendulum_has_its_period():
    # No loop at all: a compound pendulum against the elliptic integral.
    from scipy.special import ellipk

    urdf = (
        '<robot name="pendulum"><link name="ground"/><link name="rod"><inertial><origin xyz="0.5 0 0"/>'
        '<mass value="2"/><inertia ixx="1e-6" iyy="0.1666666" izz="0.1666666" ixy="0" ixz="0" iyz="0"/></inertial>'
        '</link><joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><axis xyz="0 0 1"/>'
        "</joint></robot>"
    )
    chain = ClosedChain.from_urdf(urdf, Closures("pendulum"))
    chain.model.gravity.linear = DOWN
    amplitude, inertia = 1.2, 0.1666666 + 2 * 0.25
    period = 4 * np.sqrt(inertia / (2 * 9.81 * 0.5)) * ellipk(np.sin(amplitude / 2) ** 2)
    q = pin.integrate(chain.model, chain.neutral(), np.array([-np.pi / 2 + amplitude]))
    swing = chain.simulate(q, np.zeros(1), [0.0, period / 2, period])
    angles = np.arctan2(swing.q[:, 1], swing.q[:, 0])
    np.testing.assert_allclose(
        angles, [-np.pi / 2 + amplitude, -np.pi / 2 - amplitude, -np.pi / 2 + amplitude], atol=1e-7
    )
    np.testing.assert_allclose(swing.v, 0.0, atol=1e-6)
    # All else that one coordinate can be asked for.
    forces = chain.inverse_dynamics(q, [2.0], [3.0], actuated=["hinge"])
    weight = 2 * 9.81 * 0.5 * np.cos(-np.pi / 2 + amplitude)
    assert forces.effort("hinge") == pytest.approx(inertia * 3.0 + weight)
    np.testing.assert_allclose(
        forces.joint_reaction("hinge", in_frame="local").force,
        2
        * (np.array([-0.5 * 4.0, 0.5 * 3.0, 0.0]) + 9.81 * np.array([np.cos(amplitude) * -1, np.sin(amplitude), 0.0])),
    )
    found = chain.inverse_dynamics_derivatives(q, [2.0], [3.0], actuated=["hinge"])
    assert found.tau_q[0, 0] == pytest.approx(-2 * 9.81 * 0.5 * np.sin(-np.pi / 2 + amplitude))
    assert found.tau_a[0, 0] == pytest.approx(inertia)


def test_efforts_and_wrenches_do_work():
    case = moving("Stewart platform")
    wrench = np.array([3.0, -2.0, 5.0, 0.2, 0.1, -0.3])

    def efforts(t, q, v):
        return {f"slide_{i}": 9.81 * 3.0 / 6 + np.sin(t + i) for i in range(6)}

    moved = case.chain.simulate(case.q, 0.0 * case.v, np.linspace(0, 1, 11), efforts, external={"platform": wrench})
    assert abs(moved.work[-1]) > 0.1
    assert moved.energy_drift <= 1e-8
    np.testing.assert_allclose(moved.energy - moved.energy[0], moved.work, atol=1e-8 * moved.kinetic_energy.max())
