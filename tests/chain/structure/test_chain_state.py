import pickle

import numpy as np
import pinocchio as pin
import pytest
from closable_chains import CHAINS, HAND, open_configurations
from mechanisms import five_bar, four_bar
from scipy.spatial.transform import Rotation

from exo_pin import LoopNotClosed
from exo_pin.chain import TYPES

# Central differences of step h: h²/6 of a third derivative of order 10 here, plus rounding eps/h times order 10.
STEP = 1e-5
FINITE = 1e-7


@pytest.fixture(params=CHAINS, scope="module")
def chain(request):
    return CHAINS[request.param]


@pytest.mark.parametrize("name", HAND)
def test_configurations_found_by_hand_are_closed(name):
    assert np.abs(CHAINS[name].residual(HAND[name])).max() < 1e-15


def test_close_reaches_1e_12(chain):
    for q in open_configurations(chain, 1, count=20):
        closed = chain.close(q)
        assert np.abs(chain.residual(closed)).max() <= 1e-12


def test_close_does_not_move_held_joints(chain):
    held = chain.roles.actuated[0]
    part = chain.configuration_slice(held)
    for q in open_configurations(chain, 18, count=20, size=0.02):
        closed = chain.close(q, hold=[held])
        assert np.abs(chain.residual(closed)).max() <= 1e-12
        np.testing.assert_array_equal(closed[part], q[part])


def test_close_leaves_a_closed_configuration_alone(chain):
    closed = chain.close(open_configurations(chain, 2, count=1)[0])
    np.testing.assert_array_equal(chain.close(closed), closed)
    before = closed.copy()
    chain.close(closed)[:] = 0.0
    np.testing.assert_array_equal(closed, before)


def test_close_moves_little_more_than_the_nearest_closed_configuration(chain):
    # From a closed configuration, go away by 0.05: the answer may not lie farther than that, up to the manifold's
    # curvature.
    for q in open_configurations(chain, 3):
        closed = chain.close(q)
        rng = np.random.default_rng(4)
        away = rng.normal(size=chain.model.nv)
        away *= 0.05 / np.linalg.norm(away)
        back = chain.close(pin.integrate(chain.model, closed, away))
        assert np.linalg.norm(pin.difference(chain.model, closed, back)) < 0.12


def test_closing_the_four_bar_with_its_crank_held_gives_the_hand_derived_answer():
    named, chain = four_bar(), CHAINS["four_bar"]
    start = named.q + np.array([0.0, 0.3, -0.3])
    np.testing.assert_allclose(chain.close(start, hold=["crank_hinge"]), named.q, atol=1e-11)


def test_closing_the_five_bar_with_its_cranks_held_gives_the_hand_derived_answer():
    named, chain = five_bar(), CHAINS["five_bar"]
    start = named.q + np.array([0.0, 0.3, 0.0, -0.3])
    np.testing.assert_allclose(chain.close(start, hold=chain.roles.actuated), named.q, atol=1e-11)


def test_a_loop_that_cannot_close_raises_with_its_evidence():
    named, chain = five_bar(), CHAINS["five_bar"]
    # Cranks turned away from each other: the elbows are 0.6 apart, the forearms reach 0.55.
    q = named.q.copy()
    q[0], q[2] = np.pi, 0.0
    with pytest.raises(LoopNotClosed) as caught:
        chain.close(q, hold=chain.roles.actuated)
    error = caught.value
    assert error.residual == pytest.approx(np.abs(chain.residual(error.q)).max())
    # The forearms end up stretched along x, 0.05 short of each other.
    assert error.residual == pytest.approx(0.05, abs=1e-3)
    assert error.iterations > 1
    np.testing.assert_array_equal(error.q[[0, 2]], q[[0, 2]])
    for count in (0, 1):
        with pytest.raises(LoopNotClosed) as caught:
            chain.close(named.q + 0.2, max_iterations=count)
        assert caught.value.iterations == count
    with pytest.raises(LoopNotClosed):
        chain.close(named.q + 0.2, hold=chain.model.names[1:])


PINOCCHIOS = [
    name for name, chain in CHAINS.items() if {item.type for item in chain.closures} <= {"rigid", "spherical"}
]


@pytest.fixture(params=PINOCCHIOS)
def as_pinocchio(request):
    return CHAINS[request.param]


def test_residual_is_pinocchios_relative_placement(as_pinocchio):
    chain = as_pinocchio
    q = open_configurations(chain, 5, count=1)[0]
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    residual = chain.residual(q)
    for closure, constraint in zip(chain.closures, chain.constraint_models, strict=True):
        constraint_data = constraint.createData()
        constraint.calc(chain.model, data, constraint_data)
        b_in_a = constraint_data.c1Mc2
        rows = residual[chain.rows(closure.name)]
        np.testing.assert_allclose(rows[:3], -b_in_a.translation, atol=1e-14)
        if closure.rows == 6:
            expected = Rotation.from_matrix(b_in_a.rotation.T).as_rotvec()
            np.testing.assert_allclose(rows[3:], expected, atol=1e-14)


def test_jacobian_is_pinocchios_on_closed_loops(as_pinocchio):
    chain = as_pinocchio
    for q in open_configurations(chain, 6):
        q = chain.close(q)
        models = pin.StdVec_RigidConstraintModel()
        datas = pin.StdVec_RigidConstraintData()
        for constraint in chain.constraint_models:
            models.append(constraint)
            datas.append(constraint.createData())
        data = chain.model.createData()
        pin.computeJointJacobians(chain.model, data, q)
        for constraint, constraint_data in zip(models, datas, strict=True):
            constraint.calc(chain.model, data, constraint_data)
        theirs = pin.getConstraintsJacobian(chain.model, data, models, datas)
        # They refer a 6D twist to a's origin, this module to b's: the loops' 1e-12 apart.
        np.testing.assert_allclose(chain.constraint_jacobian(q), theirs, atol=1e-11)


def test_jacobian_is_the_derivative_of_the_residual_on_closed_loops(chain):
    rng = np.random.default_rng(7)
    for q in open_configurations(chain, 8):
        q = chain.close(q)
        for _ in range(3):
            v = rng.normal(size=chain.model.nv)
            ahead, behind = (chain.residual(pin.integrate(chain.model, q, s * STEP * v)) for s in (1, -1))
            np.testing.assert_allclose(
                chain.constraint_jacobian(q) @ v, (ahead - behind) / (2 * STEP), atol=FINITE * 10
            )


def test_rows_in_metres_are_the_derivative_of_the_residual_everywhere(chain):
    rng = np.random.default_rng(9)
    metres = np.concatenate(
        [[True] * TYPES[item.type].translations + [False] * TYPES[item.type].rotations for item in chain.closures]
    )
    for q in open_configurations(chain, 10, size=1.0):
        v = rng.normal(size=chain.model.nv)
        ahead, behind = (chain.residual(pin.integrate(chain.model, q, s * STEP * v)) for s in (1, -1))
        rates = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose((chain.constraint_jacobian(q) @ v)[metres], rates[metres], atol=FINITE)


def test_drift_is_the_jacobians_rate(chain):
    rng = np.random.default_rng(11)
    for q in open_configurations(chain, 12, size=1.0):
        v = rng.normal(size=chain.model.nv)
        ahead, behind = (chain.constraint_jacobian(pin.integrate(chain.model, q, s * STEP * v)) @ v for s in (1, -1))
        expected = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose(chain.constraint_drift(q, v), expected, atol=FINITE * 10)


def test_a_large_turn_closes_too():
    # The rigid closure starts 2.9 rad off: the logarithm has to be right near half a turn.
    named = four_bar("link")
    q = named.q.copy()
    q[2] += 2.9
    chain = CHAINS["four_bar_link"]
    assert abs(chain.residual(q)[5]) == pytest.approx(2.9)
    closed = chain.close(q, hold=["crank_hinge"])
    assert np.abs(chain.residual(closed)).max() <= 1e-12


@pytest.mark.parametrize("axis", np.eye(3))
@pytest.mark.parametrize("angle", [1e-9, 1.0, 3.0, np.pi - 1e-7, np.pi, np.pi + 1e-7, 4.0])
def test_the_turn_of_a_rigid_closure_is_its_rotation_vector(axis, angle):
    chain = CHAINS["prototype-wrist"]
    q = chain.neutral()
    turn = Rotation.from_rotvec(angle * axis)
    q[3:7] = turn.as_quat()
    rows = chain.residual(q)[:6]
    # Near half a turn both signs of the axis are right.
    expected = turn.as_rotvec()
    assert np.linalg.norm(rows[3:]) == pytest.approx(np.linalg.norm(expected), rel=1e-12)
    np.testing.assert_allclose(Rotation.from_rotvec(rows[3:]).as_matrix(), turn.as_matrix(), atol=1e-14)


def test_placements_are_pinocchios_frames():
    chain = CHAINS["prototype-whole"]
    q = open_configurations(chain, 17, count=1)[0]
    data = chain.model.createData()
    pin.framesForwardKinematics(chain.model, data, q)
    placements = chain.placements(q)
    for index, frame in enumerate(chain.model.frames):
        np.testing.assert_allclose(placements[frame.name].homogeneous, data.oMf[index].homogeneous, atol=1e-15)
        assert chain.placement(q, frame.name) == placements[frame.name]


def test_a_chain_can_be_pickled():
    chain = CHAINS["five_bar"]
    again = pickle.loads(pickle.dumps(chain))
    q = five_bar().q + 0.1
    np.testing.assert_array_equal(again.close(q), chain.close(q))
