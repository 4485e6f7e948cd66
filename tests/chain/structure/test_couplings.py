"""Couplings of joints' positions: geometry, rank, files, and what is refused."""

import dataclasses
import pickle

import numpy as np
import pytest
from geared_arms import arm, geared
from tree_forces import tree_forces

from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.chain import ClosedChain, Closure, Closures, read_closures, write_closures

CUBE = Closure("gear", "coupling", "joint_0", "joint_2", polynomial=(0.1, 1.0, 0.0, 2.0), references=(0.2, -0.1))
HALF = Closure("half", "coupling", "joint_0", "joint_2", polynomial=(0.0, 0.5))


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


def test_positions_follow_along_a_path():
    chain = chain_of(CUBE)
    q = chain.close(chain.neutral())
    there = chain.forward_kinematics([1.2], q, ["joint_0"])
    assert there[2] == pytest.approx(-0.1 + 0.1 + 1.0 + 2.0, abs=1e-12)
    v, a = chain.dependent_motion(there, ["joint_0", "joint_1", "joint_3", "joint_4"], [1.0, 0, 0, 0], [2.0, 0, 0, 0])
    assert v[2] == pytest.approx(7.0)
    assert a[2] == pytest.approx(7.0 * 2.0 + 12.0)


def test_an_endless_turn_is_counted():
    # A hinge without limits that is coupled has one number for its angle, and three turns are three turns.
    urdf = arm(0).replace('name="joint_0" type="revolute"', 'name="joint_0" type="continuous"')
    urdf = urdf.replace('lower="-30.0" upper="30.0" ', "", 1)
    assert ClosedChain.from_urdf(urdf, Closures("free")).model.nq == 6
    chain = ClosedChain.from_urdf(urdf, Closures("geared", closures=(HALF,)))
    assert chain.model.nq == 5
    assert chain.model.upperPositionLimit[0] == np.inf
    q = chain.forward_kinematics([6 * np.pi], chain.neutral(), ["joint_0"])
    assert q[2] == pytest.approx(3 * np.pi, abs=1e-12)


def test_a_coupling_of_metres_is_weighed_as_metres():
    chain = chain_of(dataclasses.replace(HALF, frame_b="joint_1"))
    assert chain._state.topology.row_metres.tolist() == [True]
    assert chain.characteristic_length == chain_of().characteristic_length
    assert chain.mobility(chain.neutral()).rank == 1


def test_a_gear_stated_twice_is_redundant():
    chain = chain_of(HALF, dataclasses.replace(HALF, name="again"))
    q = chain.close(np.zeros(5))
    found = chain.mobility(q)
    assert found.redundant == 1
    assert dict(found.redundant_closures) == {"half": 1, "again": 1}
    driven = [f"joint_{k}" for k in (0, 1, 3, 4)]
    forces = chain.inverse_dynamics(q, actuated=driven)
    single = chain_of(HALF).inverse_dynamics(q, actuated=driven)
    np.testing.assert_allclose(forces.multipliers, 0.5 * single.multipliers[[0, 0]], rtol=1e-12)
    assert forces.undetermined == 1
    weight = tree_forces(chain, q).tau
    assert single.coupling("half") == pytest.approx({"joint_0": -0.5 * weight[2], "joint_2": weight[2]})
    np.testing.assert_allclose(single.effort("joint_0"), weight[0] + 0.5 * weight[2])


def test_a_coupling_is_in_the_reactions_of_its_joints_as_a_motor_is():
    chain, free = chain_of(HALF), chain_of()
    q = chain.close(np.full(5, 0.2))
    forces = chain.inverse_dynamics(q, actuated=[f"joint_{k}" for k in (0, 1, 3, 4)])
    others = free.inverse_dynamics(q, actuated=[f"joint_{k}" for k in range(5)])
    for joint in list(chain.model.names)[1:]:
        one, other = (each.joint_reaction(joint).wrench for each in (forces, others))
        np.testing.assert_allclose(one, other, atol=1e-12)
    one, other = (each.wrench_on("universe").wrench for each in (forces, others))
    np.testing.assert_allclose(one, other, atol=1e-12)
    with pytest.raises(InvalidInput, match="'half' is a coupling, which transmits no wrench"):
        forces.joint_reaction("half")
    with pytest.raises(UnknownName):
        forces.coupling("nothing")


def test_closures_file_and_pickle(tmp_path):
    held = Closure("held", "coupling", "universe", "joint_4", polynomial=(0.3,), references=(0.0, 0.1))
    closures = Closures("geared", closures=(CUBE, HALF, held), left_out=("a plugin",))
    write_closures(closures, tmp_path / "geared.closures.toml")
    assert read_closures(tmp_path / "geared.closures.toml") == closures
    chain = ClosedChain.from_urdf(arm(0), closures)
    again = pickle.loads(pickle.dumps(chain))
    q = np.linspace(-0.4, 0.4, 5)
    np.testing.assert_array_equal(chain.residual(q), again.residual(q))
    assert chain.residual(q)[2] == pytest.approx(0.4 - 0.1 - 0.3)


def test_a_bad_coupling_in_a_file_is_refused(tmp_path):
    good = (
        'schema = 1\nname = "x"\n[[closures]]\nname = "gear"\ntype = "coupling"\njoint_a = "a"\njoint_b = "b"\n'
        "polynomial = [0.0, 2.0]\n"
    )
    path = tmp_path / "x.closures.toml"
    path.write_text(good)
    assert read_closures(path).closures[0].polynomial == (0.0, 2.0)
    for old, new, said in (
        ("joint_b", "frame_b", "frame_b|joint_b"),
        ("polynomial = [0.0, 2.0]\n", "", "polynomial"),
        ("[0.0, 2.0]", '["x"]', "polynomial"),
        ("polynomial", "distance_m = 0.3\npolynomial", "distance_m"),
    ):
        path.write_text(good.replace(old, new))
        with pytest.raises(FileFormatError, match=said):
            read_closures(path)
