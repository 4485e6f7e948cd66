"""Geometry of loops and of couplings, against Pinocchio, differences and by hand."""

import pickle

import numpy as np
import pinocchio as pin
import pytest
from closable_chains import CHAINS, open_configurations
from geared_arms import arm, geared
from mechanisms import five_bar
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closure, Closures

# Central differences of step h: h²/6 of a third derivative of order 10 here, plus rounding eps/h times order 10.
STEP = 1e-5


FINITE = 1e-7


@pytest.fixture(params=CHAINS, scope="module")
def chain(request):
    return CHAINS[request.param]


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


def test_drift_is_the_jacobians_rate(chain):
    rng = np.random.default_rng(11)
    for q in open_configurations(chain, 12, size=1.0):
        v = rng.normal(size=chain.model.nv)
        ahead, behind = (chain.constraint_jacobian(pin.integrate(chain.model, q, s * STEP * v)) @ v for s in (1, -1))
        expected = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose(chain.constraint_drift(q, v), expected, atol=FINITE * 10)


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


CUBE = Closure("gear", "coupling", "joint_0", "joint_2", polynomial=(0.1, 1.0, 0.0, 2.0), references=(0.2, -0.1))


def chain_of(*closures, seed=0):
    return ClosedChain.from_urdf(arm(seed), Closures("geared", closures=closures))


def test_residual_jacobian_and_drift_by_hand():
    chain = chain_of(CUBE)
    q, v = np.array([0.5, 0.3, 0.7, 0.1, -0.2]), np.array([2.0, 1.0, 3.0, -1.0, 0.5])
    # x = 0.3: p = 0.1 + 0.3 + 2 0.027, p' = 1 + 6 0.09, p'' = 12 0.3.
    np.testing.assert_allclose(chain.residual(q), [0.7 + 0.1 - 0.454], atol=1e-15)
    np.testing.assert_allclose(chain.constraint_jacobian(q), [[-1.54, 0, 1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(chain.constraint_drift(q, v), [-3.6 * 4.0], atol=1e-14)


@pytest.mark.parametrize("seed", range(6))
def test_a_closed_arm_has_a_freedom_less_for_each_coupling(seed):
    urdf, closures = geared(seed)
    chain = ClosedChain.from_urdf(urdf, closures)
    start = np.random.default_rng(seed).uniform(-0.5, 0.5, chain.model.nv)
    q = chain.close(start)
    assert np.abs(chain.residual(q)).max() < 1e-12
    found = chain.mobility(q)
    assert (found.rows, found.rank, found.degrees_of_freedom, found.kinds) == (2, 2, 3, ())
    # The step to closed positions is a least one: nothing else moves.
    np.testing.assert_array_equal(q[3], start[3])
