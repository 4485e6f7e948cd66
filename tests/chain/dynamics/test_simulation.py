import numpy as np
import pinocchio as pin
import pytest
from mechanisms import parallelogram
from moving_chains import moving
from rounded_mechanisms import mechanism

from exo_pin import InvalidInput
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


def test_a_motion_goes_on_through_a_singular_configuration():
    # All cranks in line with the bar: the bar might go on in parallel or tilt, and goes on as it came.
    named = parallelogram()
    chain = named.chain()
    chain.model.gravity.linear = DOWN
    v = chain.dependent_motion(named.q, ["hinge_0"], [-3.0])[0]
    moved = chain.simulate(named.q, v, TEN_SECONDS)
    assert {event.kind for event in moved.events} == {"crossing"}
    cranks = chain.velocity_indices([name for name in chain.model.names if name.startswith("hinge")])
    np.testing.assert_allclose(
        moved.v[:, cranks], np.broadcast_to(moved.v[:, cranks[:1]], moved.v[:, cranks].shape), atol=1e-5
    )
    assert moved.energy_drift < 1e-6


def test_states_are_returned_at_the_given_times():
    case = moving("four-bar")
    case.chain.model.gravity.linear = DOWN
    few = case.chain.simulate(case.q, case.v, [0.0, 0.37, 1.0])
    many = case.chain.simulate(case.q, case.v, np.linspace(0, 1, 101))
    np.testing.assert_array_equal(few.q[0], case.q)
    at = int(np.flatnonzero(np.isclose(many.times, 0.37))[0])
    np.testing.assert_allclose(few.q[1], many.q[at], atol=1e-8)
    np.testing.assert_allclose(few.q[-1], many.q[-1], atol=1e-8)
    alone = case.chain.simulate(case.q, case.v, [2.0])
    assert alone.q.shape == (1, 3)


def test_a_chain_that_is_held_or_comes_to_rest_runs_into_no_singular_configuration():
    # At rest there is no kinetic energy that rounding could be compared with.
    case = moving("five-bar")
    chain, joints = case.chain, case.chain.roles.actuated
    chain.model.gravity.linear = DOWN
    hold = chain.inverse_dynamics(case.q)
    held = chain.simulate(case.q, 0.0 * case.v, TEN_SECONDS[:11], {joint: hold.effort(joint) for joint in joints})
    np.testing.assert_allclose(held.q, np.broadcast_to(case.q, held.q.shape), atol=1e-7)

    own = chain.velocity_indices(joints)
    goal = chain.close(case.q + 0.1 * np.isin(np.arange(4), own), hold=joints)
    there = chain.inverse_dynamics(goal).tau

    def servo(t, q, v):
        tau = there.copy()
        tau[own] -= 20.0 * (q - goal)[own] + 3.0 * v[own]
        return tau

    moved = chain.simulate(case.q, 0.0 * case.v, TEN_SECONDS, servo)
    np.testing.assert_allclose(moved.q[-1], goal, atol=1e-9)
    np.testing.assert_allclose(moved.energy - moved.energy[0], moved.work, atol=1e-8 * np.abs(moved.work).max())


def test_efforts_may_jump_at_any_time():
    case = moving("five-bar")
    case.chain.model.gravity.linear = DOWN

    def pulses(t, q, v):
        return {"left_crank_hinge": 1.0 if t % 0.1 < 0.05 else -1.0}

    moved = case.chain.simulate(case.q, case.v, [0.0, 0.5], pulses)
    # The same, stopped and started at every jump.
    q, v = case.q, case.v
    for k in range(10):
        start = 0.05 * k
        piece = case.chain.simulate(q, v, [start, start + 0.05], {"left_crank_hinge": -1.0 if k % 2 else 1.0})
        q, v = piece.q[-1], piece.v[-1]
    np.testing.assert_allclose(moved.q[-1], q, atol=1e-6)
    assert moved.energy_drift <= 1e-7


def test_bad_input_is_refused():
    case = moving("four-bar")
    for call in (
        lambda: case.chain.simulate(case.q, case.v, [0.0, 0.0]),
        lambda: case.chain.simulate(case.q, case.v, [1.0, 0.5]),
        lambda: case.chain.simulate(case.q, case.v, []),
        lambda: case.chain.simulate(case.q, np.ones(3), [0.0, 1.0]),
        lambda: case.chain.simulate(case.q, case.v, [0.0, 1.0], rtol=0.0),
        lambda: case.chain.simulate(case.q, case.v, [0.0, 1.0], atol="small"),
        lambda: case.chain.simulate(case.q, case.v, [0.0, 1.0], lambda t, q, v: np.ones(7)),
    ):
        with pytest.raises(InvalidInput):
            call()


@pytest.mark.parametrize("name", ["bennett", "spherical"])
def test_redundant_rows_stay_redundant_while_a_step_opens_the_loops(name):
    """An exact overconstrained linkage falls as far as its energy says, also where steps are long."""
    chain = mechanism(name, seed=3)
    for rtol in (1e-5, 1e-9):
        found = chain.simulate(chain.neutral(), np.zeros(chain.model.nv), np.linspace(0.0, 0.5, 6), rtol=rtol)
        assert found.energy_drift < 10 * rtol
        assert found.opening.max() < 1e-12
        assert found.kinetic_energy[-1] > 0.1
        assert chain.mobility(found.q[-1]).degrees_of_freedom == 1
