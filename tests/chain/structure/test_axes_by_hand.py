"""Which joints have constant axes, forests of copies, and constants packed and unpacked."""

import changing_axes
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, random_loop

from exo_pin import ExoPinError
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.structure.memory.chain_buffers import (
    Forest,
    _window,
    forest_of,
    packed_constants,
    unpacked_constants,
)
from exo_pin.chain.structure.motion_axes import ConstantAxes, has_constant_axes, symmetric

pytestmark = pytest.mark.usefixtures("plain")


def composite(*parts):
    made = pin.JointModelComposite()
    for part in parts:
        made.addJoint(part)
    return made


@pytest.mark.parametrize(
    ("kind", "constant"),
    [
        (pin.JointModelRX(), True), (pin.JointModelPlanar(), True), (pin.JointModelSpherical(), True),
        (pin.JointModelFreeFlyer(), True), (pin.JointModelTranslation(), True), (pin.JointModelSphericalZYX(), False),
        (pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]), False), (pin.JointModelEllipsoid(0.1, 0.2, 0.3), False),
        (composite(pin.JointModelRX(), pin.JointModelRY()), False),
    ],
)  # fmt: skip
def test_axes_are_constant_where_the_subspace_is_at_random_configurations(kind, constant):
    model, rng = pin.Model(), np.random.default_rng(0)
    model.addJoint(0, kind, pin.SE3.Identity(), "one")
    assert has_constant_axes(model, 1) == constant
    joint = model.joints[1]
    data = joint.createData()
    found = []
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.0, 1.0, model.nv))
        joint.calc(data, q)
        found.append(np.array(data.S))
    assert np.allclose(found[0], found[1]) == constant
    assert ConstantAxes(model).differs == (not constant and "Ellipsoid" not in kind.shortname())
    # The rate of the Jacobian along a motion, by differences.
    axes = ConstantAxes(model)
    data, v, h = axes.model.createData(), rng.normal(size=model.nv), 1e-6
    axes.jacobian_rate(data, q, v)
    rate = np.array(data.dJ).reshape(6, model.nv)
    ends = [
        np.array(pin.computeJointJacobians(model, model.createData(), pin.integrate(model, q, s * h * v))).reshape(
            6, -1
        )
        for s in (1, -1)
    ]
    np.testing.assert_allclose(rate, (ends[0] - ends[1]) / (2 * h), atol=1e-8)


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
    push = rng.normal(size=(samples, model.njoints, 6))
    model.gravity.linear = np.array([1.0, 2.0, -3.0])
    forest.follow()
    poses, J, dJ = forest.kinematics(q, v)
    bare, same, none = forest.kinematics(q)
    np.testing.assert_array_equal(poses, bare)
    np.testing.assert_array_equal(J, same)
    assert not none.any()
    tau, forces = forest.rnea(q, v, a, push)
    free, _ = forest.rnea(q, v, a, None)
    moved = forest.integrate(q, v)
    for k in range(samples):
        pin.computeJointJacobiansTimeVariation(model, data, q[k], v[k])
        np.testing.assert_allclose(J[k], np.array(data.J).reshape(6, -1).T, atol=1e-12)
        np.testing.assert_allclose(dJ[k], np.array(data.dJ).reshape(6, -1).T, atol=1e-12)
        for joint in range(model.njoints):
            pose = np.vstack([data.oMi[joint].rotation.T, data.oMi[joint].translation])
            np.testing.assert_allclose(poses[k, joint], pose, atol=1e-12)
        vector = pin.StdVec_Force()
        vector.extend([pin.Force(push[k, joint]) for joint in range(model.njoints)])
        np.testing.assert_allclose(free[k], pin.rnea(model, data, q[k], v[k], a[k]), atol=1e-10)
        np.testing.assert_allclose(tau[k], pin.rnea(model, data, q[k], v[k], a[k], vector), atol=1e-10)
        np.testing.assert_allclose(
            forces[k, 1:], [data.f[joint].vector for joint in range(1, model.njoints)], atol=1e-10
        )
        np.testing.assert_allclose(moved[k], pin.integrate(model, q[k], v[k]), atol=1e-12)


@pytest.mark.parametrize("named", [five_bar(), random_loop("rigid"), random_loop("coupling"), random_loop("distance")])
def test_packed_constants_are_unpacked_as_they_were(named):
    chain = named.chain()
    top, axes = chain._state.topology, ConstantAxes(chain.model)
    loops, scales, bodies, tree = unpacked_constants(*packed_constants(top, axes))
    for found, given in ((loops, top.loops), (bodies, top.bodies), (scales[:2], top.scales[:2]), (tree, axes.tree)):
        assert len(found) == len(given)
        for one, other in zip(found, given, strict=True):
            np.testing.assert_array_equal(one, other)
            assert np.shape(one) == np.shape(other)
    for one, other in zip(scales[2], top.scales[2], strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_symmetric_matrix_of_a_lower_half():
    A = np.arange(9.0).reshape(3, 3)
    np.testing.assert_array_equal(symmetric(A), [[0, 3, 6], [3, 4, 7], [6, 7, 8]])
    assert forest_of(ClosedChain(branched(3)[0], Closures("three"))._state) is not None


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


@pytest.mark.parametrize("kind", ["universal", "composite"])
def test_derivatives_follow_masses_armatures_and_gravity_that_change(kind):
    """Of joints that are expanded: the mass matrix by RNEA of the model itself, and dτ/dv by differences of it."""
    chain, q = changing_axes.chain(kind)
    model = chain.model
    axes, rng = ConstantAxes(model), np.random.default_rng(7)
    assert axes.differs
    for joint in range(1, model.njoints):
        model.inertias[joint] = pin.Inertia(2.0 + joint, rng.normal(size=3), np.diag(rng.uniform(1.0, 2.0, 3)))
    model.armature, model.gravity.linear = rng.uniform(1.0, 2.0, model.nv), np.array([1.0, -2.0, 3.0])
    v, a = rng.normal(size=(2, model.nv))
    data, own = axes.model.createData(), model.createData()
    axes.rnea_derivatives(data, q, v, a)

    def forces(v, a):
        return pin.rnea(model, own, q, v, a)

    eye = np.eye(model.nv)
    np.testing.assert_allclose(data.tau, forces(v, a), atol=1e-10)
    M = np.column_stack([forces(v, a + unit) - forces(v, a) for unit in eye])
    whole = np.triu(data.M) + np.triu(data.M, 1).T
    np.testing.assert_allclose(whole, M, atol=1e-10)
    # Forces are quadratic in v.
    by_speed = np.column_stack([0.5 * (forces(v + unit, a) - forces(v - unit, a)) for unit in eye])
    np.testing.assert_allclose(data.dtau_dv, by_speed, atol=1e-10)
