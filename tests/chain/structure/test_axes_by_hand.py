"""Forests of copies, and constants packed and unpacked."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, random_loop

from exo_pin import ExoPinError
from exo_pin.chain.structure.memory.chain_buffers import Forest, _window, packed_constants, unpacked_constants
from exo_pin.chain.structure.motion_axes import symmetric

pytestmark = pytest.mark.usefixtures("plain")


def branched(count):
    """Bodies of all masses on hinges and slides, one ball among them."""
    model, rng = pin.Model(), np.random.default_rng(count)
    for k in range(count):
        kind = (pin.JointModelRZ(), pin.JointModelPX(), pin.JointModelSpherical())[k % 3]
        place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        joint = model.addJoint(k if k % 4 else 0, kind, place, f"j{k}")
        model.appendBodyToJoint(joint, pin.Inertia(1.0 + k, rng.normal(size=3), np.diag([0.4, 0.5, 0.6])), place)
    model.armature = rng.uniform(0.0, 0.5, model.nv)
    return model, rng


@pytest.mark.parametrize(("joints", "samples"), [(1, 3), (3, 1), (3, 30), (5, 7)])
def test_a_forest_computes_many_samples_as_one_tree_does_each(joints, samples):
    model, rng = branched(joints)
    forest, data = Forest(model), model.createData()
    q = np.array([pin.integrate(model, pin.neutral(model), rng.uniform(-2, 2, model.nv)) for _ in range(samples)])
    v, a = rng.normal(size=(2, samples, model.nv))
    model.gravity.linear = np.array([1.0, 2.0, -3.0])
    forest.follow()
    poses, J, dJ = forest.kinematics(q, v)
    bare, same, none = forest.kinematics(q)
    np.testing.assert_array_equal(poses, bare)
    np.testing.assert_array_equal(J, same)
    assert not none.any()
    tau, forces = forest.rnea(q, v, a)
    moved = forest.integrate(q, v)
    for k in range(samples):
        pin.computeJointJacobiansTimeVariation(model, data, q[k], v[k])
        np.testing.assert_allclose(J[k], np.array(data.J).reshape(6, -1).T, atol=1e-12)
        np.testing.assert_allclose(dJ[k], np.array(data.dJ).reshape(6, -1).T, atol=1e-12)
        for joint in range(model.njoints):
            pose = np.vstack([data.oMi[joint].rotation.T, data.oMi[joint].translation])
            np.testing.assert_allclose(poses[k, joint], pose, atol=1e-12)
        np.testing.assert_allclose(tau[k], pin.rnea(model, data, q[k], v[k], a[k]), atol=1e-10)
        np.testing.assert_allclose(
            forces[k, 1:], [data.f[joint].vector for joint in range(1, model.njoints)], atol=1e-10
        )
        np.testing.assert_allclose(moved[k], pin.integrate(model, q[k], v[k]), atol=1e-12)


@pytest.mark.parametrize("named", [five_bar(), random_loop("rigid"), random_loop("coupling"), random_loop("distance")])
def test_packed_constants_are_unpacked_as_they_were(named):
    chain = named.chain()
    top, tree = chain._state.topology, (list(chain.model.parents), chain._state.topology.owners)
    loops, scales, bodies, found_tree = unpacked_constants(*packed_constants(chain.model, top))
    for found, given in ((loops, top.loops), (bodies, top.bodies), (scales[:2], top.scales[:2]), (found_tree, tree)):
        assert len(found) == len(given)
        for one, other in zip(found, given, strict=True):
            np.testing.assert_array_equal(one, other)
            assert np.shape(one) == np.shape(other)
    for one, other in zip(scales[2], top.scales[2], strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_symmetric_matrix_of_a_lower_half():
    A = np.arange(9.0).reshape(3, 3)
    np.testing.assert_array_equal(symmetric(A), [[0, 3, 6], [3, 4, 7], [6, 7, 8]])


def records(count=3, gap=0, order="C"):
    """Blocks of 2 by 3 numbers with rows of 3 behind them, in one piece of memory with a gap after each."""
    memory = np.arange(count * (9 + gap), dtype=float)
    rows = [memory[k * (9 + gap) :] for k in range(count)]
    return [row[:6].reshape((2, 3), order=order) for row in rows], [row[6:9] for row in rows], memory


def test_a_window_is_on_the_numbers_themselves():
    first, second, memory = records()
    window = _window(first, second, (3, 3))
    np.testing.assert_array_equal(window.reshape(-1), memory)
    memory[13] = -1.0
    assert window[1, 1, 1] == -1.0


def test_records_in_another_layout_are_refused():
    first, second, _ = records()
    apart = np.arange(3.0)
    for one, other in (
        records(gap=1)[:2],
        records(order="F")[:2],
        (first, [*second[:2], apart]),
        ([*first[:2], np.ones((2, 3))], second),
        (first, [row[::-1] for row in second]),
        (first[::-1], second[::-1]),
    ):
        with pytest.raises(ExoPinError, match="unexpected layout"):
            _window(one, other, (3, 3))
    # Blocks that leave no room for what is behind them, or too much.
    for shape in ((2, 3), (4, 3)):
        with pytest.raises(ExoPinError, match="unexpected layout"):
            _window(first[:1], second[:1], shape)
